"""The analytic compensator: the inverse of the instrument model, with calibration values, in front of the engine.

The model of `emulate` for what is constant in a run, over an interval T: Δβ̃ = (1 + k)(I + M) Δβ + ω₀ T. Its inverse
with calibration values k̂, M̂, ω̂₀ (the chapter's analytic compensation, section 8.2):

    Δβ̂ = (I + M̂)⁻¹ (1 + k̂)⁻¹ (Δβ̃ − ω̂₀ T)

What is left, to first order in the errors of the calibration, is an instrument whose errors are those of the
calibration: Δβ̂ − Δβ ≈ (k − k̂) Δβ + (M − M̂) Δβ + (ω₀ − ω̂₀) T. Random walk, instability and quantisation pass through:
no calibration knows them.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors


def compensate(measured: ImuData, calibration: ImuErrors) -> ImuData:
    """Return increments freed of the errors that a calibration knows.

    Args:
        measured: increments as the sensor block gives them.
        calibration: what the calibration believes the errors to be; of each triad its bias, scale and misalignment
            are used.

    Returns:
        Compensated increments on the same times.

    Raises:
        InputError: calibration values that no instrument has (a scale-factor error of −1, sensitive axes in a plane).
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
    corrected = np.empty_like(measured)
    for i in range(3):  # no matrix product, whose rounding depends on the machine
        corrected[:, i] = inverse[i, 0] * freed[:, 0] + inverse[i, 1] * freed[:, 1] + inverse[i, 2] * freed[:, 2]
    return corrected


def imperfect_calibration(errors: ImuErrors, uncertainty: ImuErrors) -> ImuErrors:
    """Return the calibration that takes the true errors for others by a given amount.

    Args:
        errors: the block's true errors.
        uncertainty: true less calibrated values of bias, scale and misalignment, for example drawn from the 1σ of a
            better grade.

    Returns:
        Calibration values; `compensate` with them leaves `uncertainty`, to first order.
    """

    def triad(true: TriadErrors, left: TriadErrors) -> TriadErrors:
        return TriadErrors(true.bias - left.bias, true.scale - left.scale, true.misalignment - left.misalignment)

    return ImuErrors(triad(errors.gyro, uncertainty.gyro), triad(errors.accel, uncertainty.accel))
