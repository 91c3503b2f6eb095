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

import numpy as np

from sinssim.checks import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.scenario.sections.compensation import CompensationSection
from sinssim.scenario.sections.imu import ImuSection
from sinssim.sensors.imu.errors import ImuErrors, TriadErrors, draw, stated
from sinssim.sensors.imu.placement import at_the_elements
from sinssim.sensors.imu.terms import CALIBRATED, FIELDS, TERMS, non_linearity, response_slope

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


def after_compensation(section: ImuSection, compensation: CompensationSection | None) -> ImuSection:
    """Return a section whose 1σ are those of the errors that a compensation leaves.

    Args:
        section: the [imu] section of a scenario, without given errors.
        compensation: the [compensation] section, without measured values; None for none.

    Returns:
        The section with the 1σ of the calibration errors.
    """
    if compensation is None:
        return section
    return section.model_copy(
        update={term.sigma_key: getattr(compensation, term.sigma_key) for term in TERMS if term.calibrated}
    )


def draw_calibration(errors: ImuErrors, section: CompensationSection, seed: int = 0) -> ImuErrors:
    """Return the calibration values of one run: measured ones; for the others the true errors minus random ones.

    Args:
        errors: the block's true errors.
        section: the [compensation] section of a scenario: 1σ of the calibration errors, and measured values.
        seed: the run's seed.

    Returns:
        Calibration values.

    Raises:
        InputError: the seed cannot be used.
    """
    # The errors of a calibration are drawn like those of a block without noise, with their own seed.
    wrong = draw(ImuSection(grade="ideal", **section.uncertainties().model_dump(exclude_none=True)), seed + _APART)
    calibration = imperfect_calibration(errors, wrong)
    block = ImuSection(grade="ideal", **section.model_dump(exclude_none=True))
    measured: dict[str, dict[str, Array]] = {"gyro": {}, "accel": {}}
    for term in TERMS:
        if term.calibrated and getattr(section, term.key) is not None:
            measured[term.triad][term.field] = stated(block, term)[0]
    return replace(
        calibration,
        gyro=replace(calibration.gyro, **measured["gyro"]),
        accel=replace(calibration.accel, **measured["accel"]),
        arms=calibration.arms if section.accel_arms_mm is None else np.array(section.accel_arms_mm) * 1e-3,
    )
