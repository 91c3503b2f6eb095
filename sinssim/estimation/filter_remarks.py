"""Remarks on a filter's result: readings that were not used, and vibration that its settings leave out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.estimation.filter_result import Innovations
from sinssim.estimation.state_model import ErrorModel
from sinssim.sensors.vibration_noise import AddedNoise, vibration


def neglected(model: ErrorModel) -> list[str]:
    """Name the errors of the inertial sensors that no state describes."""
    if not model.untold:
        return []
    return [f"The inertial sensors have errors that no state of the filter describes: {', '.join(model.untold)}."]


def remarks(innovations: Sequence[Innovations], late: Sequence[int]) -> list[str]:
    """Return sentences on readings that were not used; `late` readings of each sensor arrive after the end."""
    sentences = [] if innovations else ["There are no measurements: the result is the inertial solution."]
    for i, later in zip(innovations, late, strict=True):
        count = len(i.time)
        if later > max(1, count // 10) or later == count > 0:  # a few readings pending at the end are normal
            sentences.append(
                f"{i.sensor}: {later} of {count} measurements arrive after the end of the run; only the smoothed "
                "solution uses them."
            )
        rejected = int(np.count_nonzero(~i.accepted & ~np.isnan(i.nis)))
        unusable = Counter(reason for reason, nis in zip(i.reason, i.nis, strict=True) if reason and np.isnan(nis))
        if not count:
            stood = " (the vehicle was never at rest)" if i.kind in ("zero-velocity", "zero-rate") else ""
            sentences.append(f"{i.sensor}: there was no measurement{stood}; the sensor corrects nothing.")
            continue
        why = ", ".join(f"{number} {reason}" for reason, number in unusable.items())
        if not i.accepted.any():
            detail = "; ".join(filter(None, [why, f"{rejected} rejected by the gate" if rejected else ""]))
            sentences.append(
                f"{i.sensor}: none of {count} measurements was used{f' ({detail})' if detail else ''}; the sensor "
                "corrects nothing."
            )
            continue
        if why:
            sentences.append(f"{i.sensor}: some of {count} measurements could not be used ({why}).")
        if rejected:
            sentences.append(f"{i.sensor}: the gate rejected {rejected} of {count} measurements.")
    if innovations and not any(i.accepted.any() for i in innovations):
        sentences.append("No measurement was used: the result is the inertial solution.")
    return sentences


REFUSED = 0.02
"""Share of refused readings from which a cause is looked for; a gate refuses a ten-thousandth of correct ones."""

SHAKEN = 3.0
"""Ratio of the shaking to the assumed noise from which it is named."""

_AXES = ("forward", "right", "down")


def vibration_untold(
    innovations: Sequence[Innovations], imu: ImuData, model: ErrorModel, added: AddedNoise | None
) -> list[str]:
    """Name the vibration in the inertial readings if readings are rejected and the filter assumes none.

    White noise of density N scatters the readings of one sample by N/√Δt. Readings that scatter more hold either more
    noise or vibration, which adds noise.
    """
    tested = sum(int(np.count_nonzero(~np.isnan(i.nis))) for i in innovations)
    refused = sum(int(np.count_nonzero(~np.isnan(i.nis) & ~i.accepted)) for i in innovations)
    if added is not None or refused <= REFUSED * tested:
        return []
    try:
        level_of = vibration(imu)
    except InputError:  # sampled too slowly to show vibration
        return []
    triads = (
        ("gyros", level_of.gyro, model.gyro_noise, 180.0 / np.pi, "°/s"),
        ("accelerometers", level_of.accel, model.accel_noise, 1.0, "m/s²"),
    )
    words = []
    for name, level, density, unit, symbol in triads:
        rms = np.sqrt(np.mean(level**2, axis=0))
        axis, assumed = int(np.argmax(rms)), density / np.sqrt(level_of.interval)
        if rms[axis] > SHAKEN * assumed:
            times = f"{rms[axis] / assumed:.0f} times the assumed noise of a sample" if assumed else "none is assumed"
            words.append(f"the {name} by {unit * rms[axis]:.3g} {symbol} (rms, {_AXES[axis]}), {times}")
    if not words:
        return []
    return [
        f"The gate rejected {100.0 * refused / tested:.0f} % of all measurements, and the inertial data contain "
        f"vibration: {'; '.join(words)}. Vibration adds noise that the filter does not model: set "
        "filter.vibration_noise (about 0.4), or increase filter.inertial_noise_factor."
    ]
