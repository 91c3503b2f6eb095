"""What several sensors read: residual and H of a position, velocity, speed, height, heading and attitude.

Each function takes the predicted quantities `at` and M readings, and returns residuals (M, k) and H (M, k, n); see
`MeasurementKind.compare`.
"""

from __future__ import annotations

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.sensors.aiding.base.measurement import PHI, Comparison, R, V, skew


def compare_position(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare latitude, longitude [rad] and height [m] of a point at the lever arm, r + C l; residual in metres.

    The residual is δr + [C l ×] φ − C δl, in Earth-fixed axes, which have no poles.
    """
    state, ellipsoid = at.state, at.ellipsoid
    q_en = earth.q_en(state.latitude, state.longitude)
    measured = earth.geodetic_to_ecef(value[:, 0], value[:, 1], value[:, 2], ellipsoid)
    height = value[:, 2]
    arm = np.einsum("kij,j->ki", at.c_nb, at.lever_arm)
    if at.lever_arm.any():  # predicted position of the block
        measured -= rotation.rotate(q_en, arm)
        height = earth.ecef_to_geodetic(measured, ellipsoid)[2]
    off = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid) - measured
    residual = rotation.rotate(rotation.conjugate(q_en), off)
    residual[:, 2] = height - state.height
    h = at.zeros(3)
    h[:, :, R] = np.eye(3)
    h[:, :, PHI] = skew(arm)
    if (where := at.model.slices.get("gnss lever arm")) is not None:
        h[:, :, where] = -at.c_nb
    return residual, h


def beyond_a_pole(value: Array) -> str:
    """Return why a position cannot be used, "" if it can; see `MeasurementKind.fault`."""
    return "a latitude beyond a pole (radians are expected)" if abs(value[0]) > 0.5 * np.pi else ""


def compare_velocity(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare velocities north, east, down, (M, 3) or (3,) m/s, of a point at the lever arm, v + C (ω × l).

    ω is the rate relative to the Earth, W x its error; the residual is δv + [C (ω × l) ×] φ − C [l×] W x − C [ω×] δl.
    """
    return _velocity(at, value, None)


def compare_antenna_velocity(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare velocities as `compare_velocity`, of the satellite antenna, whose lever arm the model may have."""
    return _velocity(at, value, at.model.slices.get("gnss lever arm"))


def _velocity(at: Comparison, value: Array, arm_states: slice | None) -> tuple[Array, Array]:
    """Compare velocities; `arm_states` is the place of the lever arm's error, None if the model has none."""
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


def compare_speed(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the velocity along the forward axis of a point at the lever arm, (C_bn v + ω × l)_x, m/s.

    The residual is (C_bn δv − C_bn [v×] φ − [l×] W x)_x.
    """
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


def compare_height(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the height above the ellipsoid, m; residual −δr_D."""
    h = at.zeros(1)
    h[:, 0, R.start + 2] = -1.0
    return at.state.height[:, None] - value, h


def compare_heading(at: Comparison, value: Array, line: Array) -> tuple[Array, Array]:
    """Compare the heading of a line in body axes, (3,), modulo 2π: atan2(c_E, c_N) with c = C line, rad.

    The residual is −φ_D + c_D (c_N φ_N + c_E φ_E)/(c_N² + c_E²).
    """
    north, east, down = (at.c_nb @ line).T
    off = np.arctan2(east, north)[:, None] - value
    h = at.zeros(1)
    level = down / (north**2 + east**2)
    h[:, 0, PHI] = np.stack([level * north, level * east, np.full_like(level, -1.0)], axis=1)
    return np.mod(off + np.pi, 2.0 * np.pi) - np.pi, h


def compare_attitude(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare attitudes q_nb in the local level; residual −C_bn φ, a rotation vector about the body's axes."""
    off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), at.state.q_nb)
    h = at.zeros(3)
    h[:, :, PHI] = -at.c_bn
    return rotation.rotation_vector_from_quaternion(off), h


def turned_back(value: Array, bias: Array) -> Array:
    """Return attitudes with a bias about the body's axes removed; see `MeasurementKind.less_bias`."""
    return rotation.multiply(value, rotation.quaternion_from_rotation_vector(-bias))
