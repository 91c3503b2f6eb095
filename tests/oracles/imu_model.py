"""The deterministic errors of a sensor block written out as vectors and matrices, straight from their equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors

Array = NDArray[np.float64]

KNOWN = (
    "bias", "scale", "misalignment", "asymmetry", "quadratic", "cubic", "cross_axis", "g_sensitivity",
    "bias_temperature", "scale_temperature", "ramp",
)  # fmt: skip
"""Errors that are written out here; a further one is compared with the row of the table that states it."""


def temperature(errors: ImuErrors, since_start: Array) -> Array:
    """Return the temperature over that of the calibration, K."""
    w = errors.warm_up
    return w.steady + (w.start - w.steady) * np.exp(-since_start / w.time_constant)


def output(errors: TriadErrors, inputs: Array, force: Array, warmth: Array, since_start: Array) -> Array:
    """Return what three sensors read.

    Args:
        errors: of the triad.
        inputs: true rate or specific force in the block's axes, (N, 3).
        force: true specific force, (N, 3) m/s².
        warmth: temperature over that of the calibration, (N,) K.
        since_start: time, (N,) s.

    Returns:
        Readings, (N, 3).
    """
    x = inputs @ (np.eye(3) + errors.misalignment).T
    bent = x + errors.asymmetry / 2 * np.abs(x) + errors.quadratic * x**2 + errors.cubic * x**3
    bent += x * (inputs @ errors.cross_axis.T)
    scale = errors.scale + np.outer(warmth, errors.scale_temperature)
    bias = errors.bias + np.outer(warmth, errors.bias_temperature) + np.outer(since_start, errors.ramp)
    return (1 + scale) * bent + bias + force @ errors.g_sensitivity.T
