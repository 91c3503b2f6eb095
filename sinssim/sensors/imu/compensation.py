"""The analytic compensator: the inverse of the instrument model with calibration values, applied before navigation.

It inverts the stages 4 to 1 of `sinssim.sensors.imu.emulation`, in this order, as far as they are constant in a run or
depend on the temperature. With the mean reading x̃ = Δβ̃/T of an interval, and calibration values marked by (^),

    n = (x̃ − ω̂₀ − β̂Θ̂ − Ĝf)/(1 + k̂ + k̂′Θ̂)                 bias, scale factor, temperature, g-sensitivity
    x_i + ½κ̂|x_i| + K̂₂x_i² + K̂₃x_i³ + Σ Ĉ_ij x_i u_j = n_i    response, by Newton's method to rounding
    u = (I + M̂)⁻¹ x                                           misalignment; iterated with Ĉ to convergence

Each line has the rows of the table of terms that act on this part of the reading, with what they multiply there (the
chapter's analytic compensation, section 8.2). Then follow the delay and the arms of the accelerometers. To first order
in the errors of the calibration, the result is an instrument whose errors are those of the calibration: Δβ̂ − Δβ ≈ (k −
k̂) Δβ + (M − M̂) Δβ + (K₂ − K̂₂) x²T + … + (ω₀ − ω̂₀) T. Random walk, instability, flicker, ramp, a laser gyro's null
shift, range, quantisation and faults are not compensated.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from sinssim.arguments import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.sensors.imu.error_term_table import CALIBRATED, TERMS, of_triad
from sinssim.sensors.imu.generated_imu_keys import CompensationKeys, TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, draw_triad
from sinssim.sensors.imu.imu_section import Imu, Places
from sinssim.sensors.imu.size_effect import at_the_elements
from sinssim.toml_mistakes import read_toml

_SENSORS, _AXES = {"gyro": "gyro", "accel": "accelerometer"}, np.eye(3)
_APART = 1 << 40  # offset of the seed, far from those of scenarios and of single accelerometers
_STEPS = 50
_CONVERGED = 1e-9  # relative; after a Newton step this small, the next changes only the last digits
_STANDS = 4e-16  # relative, of the iteration over the coupling of the axes
_STEP = 1e-4  # of the largest reading, for the slope of the response: the difference of a cube is right to 1e-8 of it


def compensate(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Compensate the errors of increments by calibration values. `calibration`: calibrated values of the errors: the
    fields in `CALIBRATED` of each triad, the temperature, the arms and the delay."""
    measured = checked_imu(measured)
    if not isinstance(calibration, ImuErrors):
        raise InputError(f"calibration must be ImuErrors, not {shortened(repr(calibration))}.")
    return compensate_checked(measured, calibration)


def compensate_checked(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Compensate increments whose numbers have been checked; otherwise like `compensate`."""
    dvel = _corrected(measured, calibration, "accel", measured.dvel)
    dtheta = _corrected(measured, calibration, "gyro", dvel)
    imu = replace(measured, dtheta=dtheta, dvel=dvel)
    imu = at_the_elements(imu, np.zeros((3, 3)), -calibration.delay)
    if np.any(calibration.arms):
        imu = replace(imu, dvel=2.0 * imu.dvel - at_the_elements(imu, calibration.arms, 0.0).dvel)
    return replace(imu, flags=measured.flags)


def _times(matrix: Array, vectors: Array) -> Array:
    """Multiply each row by a matrix or its own one; the library's product is avoided, as its rounding depends on the
    machine."""
    x, y, z = vectors.T
    return np.stack([matrix[..., i, 0] * x + matrix[..., i, 1] * y + matrix[..., i, 2] * z for i in range(3)], axis=1)


def _corrected(measured: ImuData, calibration: ImuErrors, name: Literal["gyro", "accel"], dvel: Array) -> Array:
    """Return the increments of a triad, with the velocity increments that its errors depend on."""
    readings, interval = measured.dtheta if name == "gyro" else measured.dvel, np.diff(measured.time)[:, None]
    time = 0.5 * (measured.time[1:] + measured.time[:-1]) - measured.time[0]
    warmth = calibration.warm_up.temperature(time)
    terms = [(term, value) for term, value in getattr(calibration, name).acting if term.calibrated]
    acts = {term.acts_on for term, _ in terms}

    def whole(part: str, start: Array, u: Array, sensed: Array | None = None) -> Array:
        """Add the effect of the terms that act on a part of the reading."""
        acting = ((term, value) for term, value in terms if term.acts_on == part)
        effects = (term.effect(value, u, force, warmth, time, sensed=sensed) for term, value in acting)
        return sum(effects, start)

    def refused(parts: tuple[str, ...], why: str) -> InputError:
        wrong = (f"{t.field} = {np.asarray(v).tolist()}" for t, v in terms if t.acts_on in parts)
        return InputError(f"{_SENSORS[name]} calibration: {', '.join(wrong)} (SI) cannot be inverted{why}.")

    unit = np.ones((1, 3))
    steady = all(term.slopes and not term.slopes[3] for term, _ in terms)
    force = unit if steady else dvel / interval  # which nothing depends on, or the readings
    scale, bias = whole("scale", unit, unit), whole("output", np.zeros(3), force)
    axes = sum(
        (value * term.inputs(unit, unit, warmth, time) for term, value in terms if term.acts_on == "axis"), _AXES
    )
    if not (np.all(scale > 0.0) and np.all(np.linalg.det(axes) > 0.0)):
        raise refused(
            ("scale", "axis"), "; relative scale-factor errors must be above −1 and the three axes must span space"
        )
    inverse = np.asarray(np.linalg.inv(axes), dtype=np.float64)
    freed = (readings - bias * interval) / scale
    if "response" not in acts:
        return _times(inverse, freed)
    reading = freed / interval
    inputs, step = _times(inverse, reading), _STEP * np.abs(reading).max(axis=0) + np.finfo(np.float64).tiny
    across = any(term.acts_on == "response" and len(term.shape) == 2 for term, _ in terms)
    for _ in range(_STEPS):
        x = reading.copy()
        for _ in range(_STEPS):  # Newton's method along each axis
            up, down = (whole("response", np.zeros(3), inputs, x + sign * step) for sign in (1.0, -1.0))
            slope = 1.0 + (up - down) / (2.0 * step)
            if not slope.min() > 0.0:
                break
            change = (whole("response", x, inputs, x) - reading) / slope
            x -= change
            if (np.abs(change) <= _CONVERGED * np.abs(x)).all():
                break
        before, inputs = inputs, _times(inverse, x)
        if not (slope.min() > 0.0 and (np.abs(change) <= _CONVERGED * np.abs(x)).all()):
            break
        if not across or np.abs(inputs - before).max() <= _STANDS * np.abs(inputs).max():
            return inputs * interval
    raise refused(
        ("response",),
        f" at readings from {reading.min():.6g} to {reading.max():.6g} (SI): the reading must increase with the "
        "measured quantity, and a coupling with other axes must be small against 1",
    )


def imperfect_calibration(errors: ImuErrors, uncertainty: ImuErrors) -> ImuErrors:
    """Return a calibration whose values differ from the block's true errors by a given amount, so that `uncertainty`
    remains to first order after `compensate` with them. The uncertainty is true minus calibrated values of the fields
    in `CALIBRATED`, for example drawn from the 1σ of a better grade. Temperature, arms and delay are known exactly."""

    def triad(true: TriadErrors, left: TriadErrors) -> TriadErrors:
        return TriadErrors(**{name: getattr(true, name) - getattr(left, name) for name in CALIBRATED})

    return replace(
        errors, gyro=triad(errors.gyro, uncertainty.gyro), accel=triad(errors.accel, uncertainty.accel), faults=()
    )


class Compensation(CompensationKeys):
    """Analytic compensation of the sensor errors before navigation. If all keys are 0, the compensation is perfect. It
    removes the errors that are constant in a run or depend on the temperature, and the effects of the arms and the
    delay of the accelerometers. An error with a measured calibration value is compensated by this value, which may
    differ from the true error. Any other error is compensated by the true error of the run minus a random error of the
    given 1σ. The filter assumes the 1σ in both cases."""

    rules = (
        (lambda s: next((term for term in TERMS if term.calibrated and getattr(s, term.key) is not None
                         and term.sigma_key not in s.model_fields_set), None),
         "{it.key} (the calibration value) needs its uncertainty: give {it.sigma_key}, 0 if exact"),
    )  # fmt: skip

    file: str | None = Field(
        default=None,
        description="path of a calibration by `sinssim calibrate`, relative to this file; its table [compensation] is "
        "used; keys given here replace those of the file",
    )
    accel_arms_mm: tuple[Places, Places, Places] | None = Field(
        default=None,
        description="calibrated positions of the three accelerometers, each forward, right, down; default: the true "
        "positions",
    )

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Replace the file by its contents, and errors in other units."""
        if not isinstance(data.get("file"), str):
            return super().normalized(data)
        path = Path(data["file"])
        try:
            table = read_toml(path)[1].get("compensation")
        except InputError as error:
            raise ValueError(f"file: {str(error).rstrip('.')}") from error
        if not isinstance(table, dict):
            raise ValueError(f"file: {path} has no table [compensation]; give one that `sinssim calibrate` made")
        if "file" in table:
            raise ValueError(f"file: {path} refers to another file; give that one")
        return super().normalized({**table, **{key: value for key, value in data.items() if key != "file"}})

    def draw(self, errors: ImuErrors, seed: int = 0) -> ImuErrors:
        """Return the calibration values of the run of a seed: measured ones; for the others the block's true errors
        minus random ones."""
        wrong: list[TriadErrors] = []
        measured: list[dict[str, Any]] = []
        for triad in ("gyro", "accel"):
            terms = [term for term in of_triad(triad) if term.calibrated]
            drawn = ((term, np.zeros(()), term.si(getattr(self, term.sigma_key))) for term in terms)
            wrong.append(draw_triad(drawn, seed + _APART))
            measured.append({t.field: t.si(value) for t in terms if (value := getattr(self, t.key)) is not None})
        calibration = imperfect_calibration(errors, ImuErrors(wrong[0], wrong[1]))
        return replace(
            calibration,
            gyro=replace(calibration.gyro, **measured[0]),
            accel=replace(calibration.accel, **measured[1]),
            arms=calibration.arms if self.accel_arms_mm is None else np.array(self.accel_arms_mm) * 1e-3,
        )

    def left(self, imu: Imu) -> Imu:
        """Return a sensor block whose 1σ are those of the errors that this compensation leaves."""
        return imu.model_copy(update={t.sigma_key: getattr(self, t.sigma_key) for t in TERMS if t.calibrated})


class MeanGyroRates:
    """Compensated mean rates of the body over any interval, from the measured increments of a whole run."""

    def __init__(self, imu: ImuData) -> None:
        self._time, self._dtheta = imu.time, imu.dtheta
        self._interval = float(imu.time[-1] - imu.time[0]) / len(imu)

    def mean(self, begin: Array, end: Array, calibration: ImuErrors) -> Array:
        """Return the mean inertial rate from `begin` to `end`, (K,) s, in body axes, (K, 3) rad/s.

        An interval that reaches beyond the data is moved to their end.
        """
        if not len(begin):
            return np.zeros((0, 3))
        # an instant less a delay may lie beyond the data
        shift = np.maximum(self._time[0] - begin, 0.0) - np.maximum(end - self._time[-1], 0.0)
        begin, end = np.maximum(begin + shift, self._time[0]), np.minimum(end + shift, self._time[-1])
        # only the part of the run that the intervals cover is summed and searched
        first, last = np.searchsorted(self._time, (np.min(begin), np.max(end)))
        start = max(int(first) - 1, 0)
        time = self._time[start : int(last) + 1]
        angles = np.zeros((len(time), 3))
        np.cumsum(self._dtheta[start : start + len(time) - 1], axis=0, out=angles[1:])
        turned = [np.interp(end, time, angle) - np.interp(begin, time, angle) for angle in angles.T]
        rate = np.stack(turned, axis=1) / (end - begin)[:, None]
        # a rate is an increment over one second
        unit = ImuData(np.arange(len(rate) + 1.0), rate, np.zeros_like(rate))
        return compensate_checked(unit, calibration).dtheta

    def at(self, time: Array, calibration: ImuErrors) -> Array:
        """Return the mean inertial rate over two samples around each instant, (K, 3) rad/s."""
        inside = np.clip(time, self._time[0], self._time[-1])
        return self.mean(
            np.maximum(inside - self._interval, self._time[0]),
            np.minimum(inside + self._interval, self._time[-1]),
            calibration,
        )
