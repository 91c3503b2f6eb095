"""Velocity along the forward axis: (C_bn v + ω × l)_x, residual (C_bn δv − C_bn [v×] φ − [l×] W x)_x."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sinssim.data import Array
from sinssim.estimation.dynamics import PHI, V, skew
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class Speed(MeasurementKind):
    """Velocity along the forward axis, of the point at the lever arm [m/s]."""

    columns = ("speed_mps",)
    axes = ("",)
    unit = "mps"
    diagnosed: ClassVar = {"scale": 0.3}
    velocities = 1
    rounding = "accelerometers"

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare at the lever arm; see the base."""
        forward = at.c_bn[:, :1]
        velocity = at.state.velocity_ned
        residual = np.einsum("kij,kj->ki", forward, velocity) - value
        h = at.zeros(1)
        if at.lever_arm.any():
            residual = residual + np.cross(at.turning(), at.lever_arm)[:, :1]
            h -= (skew(at.lever_arm) @ at.turning_error())[:, :1]
        h[:, :, V] += forward
        h[:, :, PHI] -= forward @ skew(velocity)
        return residual, h
