"""The analytic compensator: the inverse of the instrument model, with calibration values, in front of the engine.

The model of `emulate` for what is constant in a run, over an interval T: Δβ̃ = (1 + k) n(x) T + ω₀ T of the rate
x = (I + M) Δβ / T along the sensitive axes, with n(x) = x + K₂x² + K₃x³. Its inverse with calibration values k̂, K̂₂, K̂₃,
M̂, ω̂₀ (the chapter's analytic compensation, section 8.2):

    Δβ̂ = (I + M̂)⁻¹ T n̂⁻¹((Δβ̃/T − ω̂₀)/(1 + k̂))

n̂⁻¹ by Newton's method, to rounding. What is left, to first order in the errors of the calibration, is an instrument
whose errors are those of the calibration: Δβ̂ − Δβ ≈ (k − k̂) Δβ + (M − M̂) Δβ + (K₂ − K̂₂) x²T + (K₃ − K̂₃) x³T
+ (ω₀ − ω̂₀) T. Random walk, instability and quantisation pass through: no calibration knows them.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.scenario.compensation import CompensationSection
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw

_APART = 1 << 40  # far from the seeds of scenarios, and of single accelerometers
_NEWTON_STEPS = 50
_CONVERGED = 1e-9  # relative; the step after one this small only moves the last digits


def compensate(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Return increments freed of the errors that a calibration knows.

    Args:
        measured: increments as the sensor block gives them.
        calibration: what the calibration believes the errors to be; of each triad its bias, scale, misalignment,
            quadratic and cubic are used.

    Returns:
        Compensated increments on the same times.

    Raises:
        InputError: calibration values that no instrument has (a scale-factor error of −1, sensitive axes in a plane,
            a non-linearity that makes one reading of two rates).
    """
    interval = np.diff(measured.time)
    return ImuData(
        measured.time,
        _corrected(measured.dtheta, interval, calibration.gyro, "gyro"),
        _corrected(measured.dvel, interval, calibration.accel, "accelerometer"),
    )


def _corrected(measured: Array, interval: Array, known: TriadErrors, triad: str) -> Array:
    axes = np.eye(3) + known.misalignment
    if not (np.all(1.0 + known.scale > 0.0) and np.linalg.det(axes) > 0.0):
        raise InputError(
            f"{triad} calibration: scale-factor errors {known.scale} and misalignment {known.misalignment.tolist()} "
            "rad cannot be undone; relative scale-factor errors above −1 and three axes that span space are needed."
        )
    inverse = np.linalg.inv(axes)
    freed = (measured - known.bias * interval[:, None]) / (1.0 + known.scale)
    for i in range(3):
        if known.quadratic[i] or known.cubic[i]:
            linear = _linearised(freed[:, i] / interval, float(known.quadratic[i]), float(known.cubic[i]), triad)
            freed[:, i] = linear * interval
    corrected = np.empty_like(measured)
    for i in range(3):  # no matrix product, whose rounding depends on the machine
        corrected[:, i] = inverse[i, 0] * freed[:, 0] + inverse[i, 1] * freed[:, 1] + inverse[i, 2] * freed[:, 2]
    return corrected


def _linearised(reading: Array, k2: float, k3: float, triad: str) -> Array:
    """Return x of x + K₂x² + K₃x³ = reading, Newton's method from x = reading."""
    x = reading.copy()
    for _ in range(_NEWTON_STEPS):
        slope = 1.0 + x * (2.0 * k2 + 3.0 * k3 * x)
        if not slope.min() > 0.0:
            break
        step = (x * (1.0 + x * (k2 + k3 * x)) - reading) / slope
        x -= step
        if (np.abs(step) <= _CONVERGED * np.abs(x)).all():  # Newton's step squares what was left
            return x
    raise InputError(
        f"{triad} calibration: a non-linearity with K₂ = {k2:.6g} and K₃ = {k3:.6g} (SI) cannot be undone at readings "
        f"from {reading.min():.6g} to {reading.max():.6g} (SI): the reading must grow with what it measures."
    )


def imperfect_calibration(errors: ImuErrors, uncertainty: ImuErrors) -> ImuErrors:
    """Return the calibration that takes the true errors for others by a given amount.

    Args:
        errors: the block's true errors.
        uncertainty: true less calibrated values of bias, scale, misalignment, quadratic and cubic, for
            example drawn from the 1σ of a better grade.

    Returns:
        Calibration values; `compensate` with them leaves `uncertainty`, to first order.
    """

    def triad(true: TriadErrors, left: TriadErrors) -> TriadErrors:
        return TriadErrors(
            true.bias - left.bias,
            true.scale - left.scale,
            true.misalignment - left.misalignment,
            true.quadratic - left.quadratic,
            true.cubic - left.cubic,
        )

    return ImuErrors(triad(errors.gyro, uncertainty.gyro), triad(errors.accel, uncertainty.accel))


def draw_calibration(imu: ImuSection, section: CompensationSection, seed: int = 0) -> ImuErrors:
    """Return the calibration values of one run: this run's errors of the block, but for what the calibration misses.

    Args:
        imu: the [imu] section of a scenario.
        section: its [compensation] section, the 1σ of what the calibration is wrong by.
        seed: the run's seed, with which the block's errors are drawn too.

    Returns:
        Calibration values.

    Raises:
        InputError: the seed cannot be used.
    """
    # A calibration's errors are drawn as those of a block are, without noise, and with a seed of their own.
    wrong = draw(ImuSection(grade="ideal", **section.model_dump()), seed + _APART)
    return imperfect_calibration(draw(imu, seed), wrong)
