"""The analytic compensator: the inverse of the instrument model, with calibration values, in front of the engine.

It undoes, from the last to the first, the stages 1 to 4 of `sinssim.sensors.imu.emulate` as far as they are constant
in a run or follow the temperature. With the mean reading x̃ = Δβ̃/T of an interval, and calibration values (^) for
everything,

    n = (x̃ − ω̂₀ − β̂Θ̂ − Ĝf)/(1 + k̂ + k̂′Θ̂)                 bias, scale factor, temperature, g-sensitivity
    x_i + ½κ̂|x_i| + K̂₂x_i² + K̂₃x_i³ + Σ Ĉ_ij x_i u_j = n_i    response, by Newton's method to rounding
    u = (I + M̂)⁻¹ x                                           misalignment; together with Ĉ until it stands still

(the chapter's analytic compensation, section 8.2); then the delay and the arms of the accelerometers. What is left, to
first order in the errors of the calibration, is an instrument whose errors are those of the calibration: Δβ̂ − Δβ ≈
(k − k̂) Δβ + (M − M̂) Δβ + (K₂ − K̂₂) x²T + … + (ω₀ − ω̂₀) T. Random walk, instability, flicker, ramp, a laser gyro's null
shift, range, quantisation and faults pass through: no calibration knows them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sinssim.checks import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.scenario.sections.compensation import CompensationSection
from sinssim.scenario.sections.imu import ImuSection
from sinssim.sensors.imu.errors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.placement import at_the_elements
from sinssim.sensors.imu.terms import CALIBRATED, FIELDS, non_linearity, response_slope

_APART = 1 << 40  # far from the seeds of scenarios, and of single accelerometers
_STEPS = 50
_CONVERGED = 1e-9  # relative; Newton's step after one this small only moves the last digits
_STANDS = 4e-16  # relative, of the iteration over the coupling of the axes


def compensate(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Return increments freed of the errors that a calibration knows.

    Args:
        measured: increments as the sensor block gives them.
        calibration: calibrated values of the errors: the fields in `CALIBRATED` of each triad, the temperature, the
            arms and the delay.

    Returns:
        Compensated increments on the same times.

    Raises:
        InputError: invalid calibration values (a scale-factor error of −1, sensitive axes in a plane,
            a non-linearity that makes one reading of two rates).
    """
    measured = checked_imu(measured)
    if not isinstance(calibration, ImuErrors):
        raise InputError(f"calibration must be ImuErrors, not {shortened(repr(calibration))}.")
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
    """Multiply each row by a matrix; no matrix product of the library, whose rounding depends on the machine."""
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
            "rad cannot be undone; relative scale-factor errors above −1 and three axes that span space are needed."
        )
    inverse = np.asarray(np.linalg.inv(axes), dtype=np.float64)
    freed = (measured - bias * interval[:, None]) / scale
    if not any(getattr(known, name).any() for name in CALIBRATED if FIELDS[name].stage == "BENT"):
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
        f"{triad} calibration: a cross-axis coupling of {known.cross_axis.tolist()} (SI) cannot be undone at readings "
        f"of up to {np.abs(reading).max():.6g} (SI): it must be small against 1."
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
        if (np.abs(step) <= _CONVERGED * np.abs(x)).all():  # Newton's step squares what was left
            return x
    raise InputError(
        f"{triad} calibration: a non-linearity with K₂ = {k2:.6g} and K₃ = {k3:.6g} (SI) cannot be undone at readings "
        f"from {reading.min():.6g} to {reading.max():.6g} (SI): the reading must grow with what it measures."
    )


def imperfect_calibration(errors: ImuErrors, uncertainty: ImuErrors) -> ImuErrors:
    """Return a calibration whose values differ from the true errors by a given amount.

    Args:
        errors: the block's true errors.
        uncertainty: true less calibrated values of the fields in `CALIBRATED`, for example drawn from the 1σ of a
            better grade. Temperature, arms and delay are known as they are.

    Returns:
        Calibration values; `compensate` with them leaves `uncertainty`, to first order.
    """

    def triad(true: TriadErrors, left: TriadErrors) -> TriadErrors:
        return TriadErrors(**{name: getattr(true, name) - getattr(left, name) for name in CALIBRATED})

    return replace(
        errors, gyro=triad(errors.gyro, uncertainty.gyro), accel=triad(errors.accel, uncertainty.accel), faults=()
    )


def draw_calibration(errors: ImuErrors, section: CompensationSection, seed: int = 0) -> ImuErrors:
    """Return the calibration values of one run: the block's errors in this run, less what the calibration misses.

    Args:
        errors: the block's true errors.
        section: the [compensation] section of a scenario, the 1σ of what the calibration is wrong by.
        seed: the run's seed.

    Returns:
        Calibration values.

    Raises:
        InputError: the seed cannot be used.
    """
    # The errors of a calibration are drawn like those of a block without noise, with a seed of their own.
    wrong = draw(ImuSection(grade="ideal", **section.model_dump()), seed + _APART)
    return imperfect_calibration(errors, wrong)
