"""The analytic compensator: the inverse of the instrument model with calibration values, applied before navigation.

It inverts the stages 4 to 1 of `sinssim.sensors.imu.emulate`, in this order, as far as they are constant in a run or
depend on the temperature. With the mean reading x̃ = Δβ̃/T of an interval, and calibration values marked by (^),

    n = (x̃ − ω̂₀ − β̂Θ̂ − Ĝf)/(1 + k̂ + k̂′Θ̂)                 bias, scale factor, temperature, g-sensitivity
    x_i + ½κ̂|x_i| + K̂₂x_i² + K̂₃x_i³ + Σ Ĉ_ij x_i u_j = n_i    response, by Newton's method to rounding
    u = (I + M̂)⁻¹ x                                           misalignment; iterated with Ĉ to convergence

(the chapter's analytic compensation, section 8.2); then the delay and the arms of the accelerometers. To first order in
the errors of the calibration, the result is an instrument whose errors are those of the calibration: Δβ̂ − Δβ ≈ (k −
k̂) Δβ + (M − M̂) Δβ + (K₂ − K̂₂) x²T + … + (ω₀ − ω̂₀) T. Random walk, instability, flicker, ramp, a laser gyro's null
shift, range, quantisation and faults are not compensated.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim.checks import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.sensors.imu.errors import ImuErrors, draw_triad
from sinssim.sensors.imu.fields import CompensationKeys, TriadErrors
from sinssim.sensors.imu.imu import Imu, Places
from sinssim.sensors.imu.placement import at_the_elements
from sinssim.sensors.imu.terms import CALIBRATED, FIELDS, TERMS, non_linearity, of_triad, response_slope
from sinssim.toml_file import read_toml

_BENT = [name for name in CALIBRATED if FIELDS[name].stage == "BENT"]  # the fields of the non-linear response
_APART = 1 << 40  # offset of the seed, far from those of scenarios and of single accelerometers
_STEPS = 50
_CONVERGED = 1e-9  # relative; after a Newton step this small, the next changes only the last digits
_STANDS = 4e-16  # relative, of the iteration over the coupling of the axes


def compensate(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Compensate the errors of increments by calibration values.

    Args:
        measured: measured increments of the sensor block.
        calibration: calibrated values of the errors: the fields in `CALIBRATED` of each triad, the temperature, the
            arms and the delay.

    Returns:
        Compensated increments on the same times.

    Raises:
        InputError: the calibration values are invalid (a scale-factor error of −1, sensitive axes in a plane, a
            non-linearity that gives the same reading for two rates).
    """
    measured = checked_imu(measured)
    if not isinstance(calibration, ImuErrors):
        raise InputError(f"calibration must be ImuErrors, not {shortened(repr(calibration))}.")
    return compensate_checked(measured, calibration)


def compensate_checked(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Compensate increments whose numbers have been checked; otherwise like `compensate`.

    Args:
        measured: measured increments of the sensor block.
        calibration: calibrated values of the errors.

    Returns:
        Compensated increments on the same times.

    Raises:
        InputError: the calibration values are invalid.
    """
    interval = np.diff(measured.time)
    warmth = calibration.warm_up.temperature(0.5 * (measured.time[1:] + measured.time[:-1]) - measured.time[0])
    dvel = _corrected(measured.dvel, interval, warmth, calibration.accel, "accelerometer")
    dtheta = measured.dtheta
    if np.any(calibration.gyro.g_sensitivity):
        dtheta = dtheta - _times(calibration.gyro.g_sensitivity, dvel)
    dtheta = _corrected(dtheta, interval, warmth, calibration.gyro, "gyro")
    imu = replace(measured, dtheta=dtheta, dvel=dvel)
    imu = at_the_elements(imu, np.zeros((3, 3)), -calibration.delay)
    if np.any(calibration.arms):
        imu = replace(imu, dvel=2.0 * imu.dvel - at_the_elements(imu, calibration.arms, 0.0).dvel)
    return replace(imu, flags=measured.flags)


def _times(matrix: Array, vectors: Array) -> Array:
    """Multiply each row by a matrix; the library's matrix product is avoided, as its rounding depends on the
    machine."""
    rows = [row[0] * vectors[:, 0] + row[1] * vectors[:, 1] + row[2] * vectors[:, 2] for row in matrix]
    return np.stack(rows, axis=1)


def _corrected(measured: Array, interval: Array, warmth: Array, known: TriadErrors, triad: str) -> Array:
    axes = np.eye(3) + known.misalignment
    scale = np.broadcast_to(1.0 + known.scale, measured.shape)
    bias = np.broadcast_to(known.bias, measured.shape)
    if np.any(known.scale_temperature) or np.any(known.bias_temperature):
        scale = scale + np.multiply.outer(warmth, known.scale_temperature)
        bias = bias + np.multiply.outer(warmth, known.bias_temperature)
    if not (np.all(scale > 0.0) and np.linalg.det(axes) > 0.0):
        raise InputError(
            f"{triad} calibration: scale-factor errors {known.scale} and misalignment {known.misalignment.tolist()} "
            "rad cannot be inverted; relative scale-factor errors must be above −1 and the three axes must span space."
        )
    inverse = np.asarray(np.linalg.inv(axes), dtype=np.float64)
    freed = (measured - bias * interval[:, None]) / scale
    if not any(getattr(known, name).any() for name in _BENT):
        return _times(inverse, freed)
    reading = freed / interval[:, None]
    inputs = _times(inverse, reading)
    for _ in range(_STEPS):
        coupling = 1.0 + _times(known.cross_axis, inputs)
        along = np.stack([_linearised(reading[:, i], coupling[:, i], known, i, triad) for i in range(3)], axis=1)
        before, inputs = inputs, _times(inverse, along)
        if not known.cross_axis.any() or np.abs(inputs - before).max() <= _STANDS * np.abs(inputs).max():
            return inputs * interval[:, None]
    raise InputError(
        f"{triad} calibration: a cross-axis coupling of {known.cross_axis.tolist()} (SI) cannot be inverted at "
        f"readings of up to {np.abs(reading).max():.6g} (SI): it must be small against 1."
    )


def _linearised(reading: Array, coupling: Array, known: TriadErrors, axis: int, triad: str) -> Array:
    """Return x of (1 + c)x + ½κ|x| + K₂x² + K₃x³ = reading, 1 + c the coupling, Newton's method from x = reading."""
    k2, k3, asymmetry = float(known.quadratic[axis]), float(known.cubic[axis]), float(known.asymmetry[axis])
    if not (k2 or k3 or asymmetry):
        return np.asarray(reading / coupling)
    x = reading.copy()
    for _ in range(_STEPS):
        slope = response_slope(x, coupling, asymmetry, k2, k3)
        if not slope.min() > 0.0:
            break
        step = (x * coupling + non_linearity(x, x, asymmetry, k2, k3) - reading) / slope
        x -= step
        if (np.abs(step) <= _CONVERGED * np.abs(x)).all():  # convergence of Newton's method is quadratic
            return x
    raise InputError(
        f"{triad} calibration: a non-linearity with K₂ = {k2:.6g} and K₃ = {k3:.6g} (SI) cannot be inverted at "
        f"readings from {reading.min():.6g} to {reading.max():.6g} (SI): the reading must increase with the measured "
        "quantity."
    )


def imperfect_calibration(errors: ImuErrors, uncertainty: ImuErrors) -> ImuErrors:
    """Return a calibration whose values differ from the true errors by a given amount.

    Args:
        errors: the block's true errors.
        uncertainty: true minus calibrated values of the fields in `CALIBRATED`, for example drawn from the 1σ of a
            better grade. Temperature, arms and delay are known exactly.

    Returns:
        Calibration values; after `compensate` with them, `uncertainty` remains to first order.
    """

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

    @model_validator(mode="before")
    @classmethod
    def _of_file(cls, data: Any) -> Any:
        """Replace the file by its contents."""
        if not isinstance(data, dict) or not isinstance(data.get("file"), str):
            return data
        path = Path(data["file"])
        try:
            table = read_toml(path)[1].get("compensation")
        except InputError as error:
            raise ValueError(f"file: {str(error).rstrip('.')}") from error
        if not isinstance(table, dict):
            raise ValueError(f"file: {path} has no table [compensation]; give one that `sinssim calibrate` made")
        if "file" in table:
            raise ValueError(f"file: {path} refers to another file; give that one")
        return {**table, **{key: value for key, value in data.items() if key != "file"}}

    @model_validator(mode="after")
    def _values_have_uncertainties(self) -> Self:
        for term in TERMS:
            if term.calibrated and getattr(self, term.key) is not None and term.sigma_key not in self.model_fields_set:
                raise ValueError(
                    f"{term.key} (the calibration value) needs its uncertainty: give {term.sigma_key}, 0 if exact"
                )
        return self

    def draw(self, errors: ImuErrors, seed: int = 0) -> ImuErrors:
        """Return the calibration values of one run: measured ones; for the others the true errors minus random ones.

        Args:
            errors: the block's true errors.
            seed: the run's seed.

        Returns:
            Calibration values.

        Raises:
            InputError: the seed cannot be used.
        """
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
        """Return a sensor block whose 1σ are those of the errors that this compensation leaves.

        Args:
            imu: the block, without given errors.
        """
        return imu.model_copy(update={t.sigma_key: getattr(self, t.sigma_key) for t in TERMS if t.calibrated})
