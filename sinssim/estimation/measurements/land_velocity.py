"""Velocity of a land vehicle across its axes, which is zero on wheels: the non-holonomic constraint.

With u = C_bn v + ω × l, the velocity of the point at the lever arm l in the block's axes, and the vehicle's axes in the
block's, turned by the yaw ψ and then by the pitch θ,

    x = (cos ψ cos θ, sin ψ cos θ, −sin θ),  y = (−sin ψ, cos ψ, 0),  z = (cos ψ sin θ, sin ψ sin θ, cos θ),

the predicted quantities are y · u and z · u (Dissanayake, Sukkarieh, Nebot and Durrant-Whyte, IEEE Trans. Robotics and
Automation 17, 2001, 731). A roll between the axes has no effect, because both are zero. Tyres hold sideways only at a
slip angle, which is proportional to the lateral acceleration up to about 4 m/s² (Gillespie, Fundamentals of Vehicle
Dynamics, 1992, chapter 6): a rear axle drifts outwards by y · u = −k (x · u) a, a = (z · ω) (x · u), with its cornering
compliance k.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sinssim.data import Array
from sinssim.estimation.dynamics import PHI, V, skew
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class LandVelocity(MeasurementKind):
    """Velocity to the right and down of a land vehicle [m/s], and the assumed pitch and yaw of its axes [rad]."""

    columns = ("velocity_right_mps", "velocity_down_mps", "pitch_rad", "yaw_rad")
    axes = ("right", "down")
    unit = "mps"
    velocities = 2
    rounding = "accelerometers"
    needs_rate = True
    own_errors: ClassVar = {
        "mounting": (("pitch", "yaw"), "rad"),
        "lever arm": (("forward", "right", "down"), "m"),
        "slip": (("",), "rad_per_mps2"),
    }
    diagnosed: ClassVar = {"mounting": 0.3, "lever arm": 3.0}

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare at the lever arm, in the vehicle's axes; see the base."""
        angles, arm = value[:, 2:], at.lever_arm
        mounting, arm_states, slip = at.states("mounting"), at.states("lever arm"), at.states("slip")
        if mounting is not None:
            angles = angles + at.known("mounting")
        if arm_states is not None:
            arm = arm + at.known("lever arm")
        c_vb = _axes(angles)  # rows x, y, z
        turning, velocity = at.turning(), at.state.velocity_ned
        u = np.einsum("kij,kj->ki", at.c_bn, velocity) + np.cross(turning, arm)
        forward, right, down = np.einsum("kij,kj->ik", c_vb, u)
        residual = np.stack([right, down], axis=1) - value[:, :2]
        across = c_vb[:, 1:]
        h = -across @ skew(arm) @ at.turning_error()
        h[:, :, V] += across @ at.c_bn
        h[:, :, PHI] -= across @ at.c_bn @ skew(velocity)
        if mounting is not None:  # dy/dψ = −(cos ψ, sin ψ, 0), dz/dψ = sin θ y, dz/dθ = x
            pitch = angles[:, 0]
            h[:, 0, mounting.start + 1] = np.cos(pitch) * forward + np.sin(pitch) * down
            h[:, 1, mounting.start + 1] = -np.sin(pitch) * right
            h[:, 1, mounting.start] = -forward
        if arm_states is not None:
            h[:, :, arm_states] = -across @ skew(turning)
        if slip is not None:
            drift = forward**2 * np.einsum("kj,kj->k", c_vb[:, 2], turning)
            residual[:, 0] += at.known("slip")[0] * drift
            h[:, 0, slip.start] = -drift
        return residual, h

    def less_bias(self, value: Array, bias: Array) -> Array:
        """Return readings whose velocities are less by a bias."""
        return np.column_stack([value[:, :2] - bias, value[:, 2:]])


def _axes(angles: Array) -> Array:
    """Return the matrices into the vehicle's axes from the block's, of pitch and yaw, (M, 3, 3)."""
    (st, sp), (ct, cp) = np.sin(angles).T, np.cos(angles).T
    rows = ((cp * ct, sp * ct, -st), (-sp, cp, np.zeros_like(sp)), (cp * st, sp * st, ct))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
