"""The compensation file of a calibration: a table [compensation] with its values and 1σ."""

from __future__ import annotations

import numpy as np

from sinssim.analyses.calibration.parameters import errors_of
from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.data import Array
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.terms import TERMS

_OFF = ~np.eye(3, dtype=bool)


def compensation_text(result: CalibrationResult) -> str:
    """Return a compensation file.

    Returns:
        TOML that `[compensation] file = "…"` takes, and that can also be pasted into a scenario. Errors that the
        calibration does not determine are left in the readings: their value is 0, and their 1σ that of [imu].
    """
    errors = errors_of(result.parameters, result.values)
    lines = [
        f"# Calibration of {result.scenario.name} by the {result.method} method.",
        f"# Misalignments refer to {result.frame}.",
        '# Use: [compensation] with file = "compensation.toml", or paste this table.',
    ]
    if result.unobservable:
        lines.append("# Not determined by the sequence, therefore 0 with their former 1σ:")
        lines += [f"#   {words}" for words in result.unobservable]
    lines += ["", "[compensation]"]
    later = ["", "# Not calibrated and not corrected:"]
    for term in TERMS:
        if not term.calibrated:
            continue
        if term.field in ("bias", "scale", "misalignment"):
            lines += _term_lines(result, term, errors)
        else:
            mean, sigma = (np.broadcast_to(part, term.shape) for part in result.scenario.imu.stated(term))
            former = float(np.sqrt(np.mean(mean**2 + sigma**2))) / term.unit
            later += [f"{term.key} = {[0.0] * term.size}", f"{term.sigma_key} = {_number(former)}"]
    if np.any(errors.arms):
        places = ", ".join(f"[{', '.join(map(_number, row))}]" for row in errors.arms / 1e-3)
        lines.append(f"accel_arms_mm = [{places}]")
    return "\n".join([*lines, *later, ""])


def _term_lines(result: CalibrationResult, term: ErrorTerm, errors: ImuErrors) -> list[str]:
    value: Array = getattr(errors.gyro if term.triad == "gyro" else errors.accel, term.field)
    flat = value[_OFF] if term.field == "misalignment" else value
    own = [k for k, one in enumerate(result.parameters) if one.triad == term.triad and one.field == term.field]
    sigma = float(np.sqrt(np.mean(result.sigma[own] ** 2))) / term.unit
    numbers = ", ".join(_number(x / term.unit) for x in flat)
    return [f"{term.key} = [{numbers}]", f"{term.sigma_key} = {_number(sigma)}"]


def _number(value: float) -> str:
    """Write a number with nine digits, as TOML's floating-point numbers need it."""
    text = f"{value:.9g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"
