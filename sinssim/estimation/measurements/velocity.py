"""Velocity of a point at a lever arm: v + C (ω × l), residual δv + [C (ω × l) ×] φ − C [l×] W x − C [ω×] δl.

ω is the rate relative to the Earth, W x its error, l the lever arm, δl its error.
"""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.estimation.dynamics import PHI, V, skew
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


def point_velocity(at: Comparison, value: Array, arm_states: slice | None) -> tuple[Array, Array]:
    """Return residual and H of the velocity at the lever arm.

    Args:
        at: the predicted quantities.
        value: velocities north, east, down, (M, 3) or (3,) m/s.
        arm_states: where the model has the lever arm's error; None if it has none.

    Returns:
        Residuals (M, 3) m/s and H (M, 3, n).
    """
    residual = at.state.velocity_ned - value
    h = at.zeros(3)
    h[:, :, V] = np.eye(3)
    if at.lever_arm.any() or arm_states is not None:
        turning = at.turning()
        swing = np.einsum("kij,kj->ki", at.c_nb, np.cross(turning, at.lever_arm))
        residual = residual + swing
        h -= at.c_nb @ skew(at.lever_arm) @ at.turning_error()
        h[:, :, PHI] += skew(swing)
        if arm_states is not None:
            h[:, :, arm_states] = -at.c_nb @ skew(turning)
    return residual, h


class GnssVelocity(MeasurementKind):
    """Velocity of the antenna, north, east, down [m/s]."""

    columns = ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps")
    axes = ("n", "e", "d")
    unit = "mps"
    velocities = 3
    rounding = "accelerometers"
    at_antenna = True
    on_gnss_clock = True
    of_north = True

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare at the lever arm; see the base."""
        return point_velocity(at, value, at.model.slices.get("gnss lever arm"))


class ZeroVelocity(MeasurementKind):
    """Velocity of the block, north, east, down [m/s], zero except for disturbances of the vehicle."""

    columns = ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps")
    axes = ("n", "e", "d")
    unit = "mps"
    velocities = 3
    rounding = "accelerometers"
    turns_with_north = False

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the block's own velocity; see the base."""
        h = at.zeros(3)
        h[:, :, V] = np.eye(3)
        return at.state.velocity_ned - value, h
