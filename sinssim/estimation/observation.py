"""What the readings of aiding sensors say about the errors: residual, H and R of each kind of measurement.

The residual is what inertial navigation predicts less the reading, so that to first order residual = H x + noise with
the errors x of `sinssim.estimation.model`. With C = C_nb of navigation, l the lever arm, ω the rate relative to the
Earth and W x its error (gyros' errors, and the Earth rate resolved in a wrong attitude and place):

    position   r + C l                δr + [C l ×] φ − C δl
    velocity   v + C (ω × l)          δv + [C (ω × l) ×] φ − C [l×] W x − C [ω×] δl
    height     h                      −δr_D
    rate       ω                      W x
    heading    atan2(c_E, c_N)        −φ_D + c_D (c_N φ_N + c_E φ_E)/(c_N² + c_E²), c the forward axis
    attitude   C                      −C_bn φ, about the body's axes
    stars      C_en C                 C_bn (θ − φ), θ = (δr_E/(R₂+h), −δr_N/(R₁+h), −δr_E tan φ/(R₂+h)) the turn of the
                                      local level that navigation is at
    speed      (C_bn v + ω × l)_x     (C_bn δv − C_bn [v×] φ − [l×] W x)_x

A sensor's own bias and scale factor belong to the reading, (1 + k) z + b, and enter with the opposite sign. So does the
deviation of a compass, A sin ψ + B cos ψ. A speed through the air is that of v − w, with the wind w.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, Measurements, NavState
from sinssim.earth import Ellipsoid
from sinssim.estimation.dynamics import PHI, R, V, earth_rate, earth_rate_slope, rate_error, skew
from sinssim.estimation.model import ErrorModel


@dataclass(frozen=True)
class Prediction:
    """Inertial navigation at the instants of some readings.

    Attributes:
        state: M rows.
        rate_b: inertial rate of the body, of a zero-rate reading its mean over the reading's interval, (M, 3) rad/s.
        ellipsoid: reference ellipsoid.
    """

    state: NavState
    rate_b: Array
    ellipsoid: Ellipsoid


@dataclass(frozen=True)
class _Setting:
    """A prediction, the model, and what both make together."""

    now: Prediction
    model: ErrorModel
    lever_arm: Array
    c_nb: Array

    @property
    def c_bn(self) -> Array:
        return np.asarray(self.c_nb.transpose(0, 2, 1))

    def zeros(self, components: int) -> Array:
        return np.zeros((len(self.c_nb), components, self.model.size))

    def turning(self) -> Array:
        """Rate relative to the Earth in body axes, (M, 3)."""
        rate = earth_rate(self.now.state.latitude, self.now.ellipsoid)
        return np.asarray(self.now.rate_b - np.einsum("kij,kj->ki", self.c_bn, rate))

    def turning_error(self) -> Array:
        """W, (M, 3, n)."""
        state, ellipsoid = self.now.state, self.now.ellipsoid
        out = rate_error(self.model, self.now.rate_b)
        out[:, :, PHI] += self.c_bn @ skew(earth_rate(state.latitude, ellipsoid))
        out[:, :, R] -= self.c_bn @ earth_rate_slope(state.latitude, state.height, ellipsoid)
        return out


def _position(s: _Setting, value: Array) -> tuple[Array, Array]:
    state, ellipsoid = s.now.state, s.now.ellipsoid
    q_en = earth.q_en(state.latitude, state.longitude)
    measured = earth.geodetic_to_ecef(value[:, 0], value[:, 1], value[:, 2], ellipsoid)
    height = value[:, 2]
    arm = np.einsum("kij,j->ki", s.c_nb, s.lever_arm)
    if s.lever_arm.any():  # where the block would be
        measured -= rotation.rotate(q_en, arm)
        height = earth.ecef_to_geodetic(measured, ellipsoid)[2]
    off = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid) - measured
    residual = rotation.rotate(rotation.conjugate(q_en), off)
    residual[:, 2] = height - state.height
    h = s.zeros(3)
    h[:, :, R] = np.eye(3)
    h[:, :, PHI] = skew(arm)
    if (where := s.model.slices.get("gnss lever arm")) is not None:
        h[:, :, where] = -s.c_nb
    return residual, h


def _velocity(s: _Setting, value: Array) -> tuple[Array, Array]:
    residual = s.now.state.velocity_ned - value
    h = s.zeros(3)
    h[:, :, V] = np.eye(3)
    where = s.model.slices.get("gnss lever arm")
    if s.lever_arm.any() or where is not None:
        turning = s.turning()
        swing = np.einsum("kij,kj->ki", s.c_nb, np.cross(turning, s.lever_arm))
        residual = residual + swing
        h -= s.c_nb @ skew(s.lever_arm) @ s.turning_error()
        h[:, :, PHI] += skew(swing)
        if where is not None:
            h[:, :, where] = -s.c_nb @ skew(turning)
    return residual, h


def _standing(s: _Setting, value: Array) -> tuple[Array, Array]:
    h = s.zeros(3)
    h[:, :, V] = np.eye(3)
    return s.now.state.velocity_ned - value, h


def _height(s: _Setting, value: Array) -> tuple[Array, Array]:
    h = s.zeros(1)
    h[:, 0, 2] = -1.0
    return s.now.state.height[:, None] - value, h


def _rate(s: _Setting, value: Array) -> tuple[Array, Array]:
    return s.turning() - value, s.turning_error()


def _heading(s: _Setting, value: Array) -> tuple[Array, Array]:
    north, east, down = s.c_nb[:, 0, 0], s.c_nb[:, 1, 0], s.c_nb[:, 2, 0]
    off = np.arctan2(east, north)[:, None] - value
    h = s.zeros(1)
    level = down / (north**2 + east**2)
    h[:, 0, PHI] = np.stack([level * north, level * east, np.full_like(level, -1.0)], axis=1)
    return np.mod(off + np.pi, 2.0 * np.pi) - np.pi, h


def _attitude(s: _Setting, value: Array) -> tuple[Array, Array]:
    off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), s.now.state.q_nb)
    h = s.zeros(3)
    h[:, :, PHI] = -s.c_bn
    return rotation.rotation_vector_from_quaternion(off), h


def _earth_attitude(s: _Setting, value: Array) -> tuple[Array, Array]:
    state = s.now.state
    q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)
    off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), q_eb)
    r1, r2 = earth.radii(state.latitude, s.now.ellipsoid)
    turn = np.zeros((len(r1), 3, 3))
    turn[:, 0, 1] = 1.0 / (r2 + state.height)
    turn[:, 1, 0] = -1.0 / (r1 + state.height)
    turn[:, 2, 1] = -np.tan(state.latitude) / (r2 + state.height)
    h = s.zeros(3)
    h[:, :, PHI] = -s.c_bn
    h[:, :, R] = s.c_bn @ turn
    return rotation.rotation_vector_from_quaternion(off), h


def _speed(s: _Setting, value: Array) -> tuple[Array, Array]:
    forward = s.c_bn[:, :1]
    velocity = s.now.state.velocity_ned
    residual = np.einsum("kij,kj->ki", forward, velocity) - value
    h = s.zeros(1)
    if s.lever_arm.any():
        residual = residual + np.cross(s.turning(), s.lever_arm)[:, :1]
        h -= (skew(s.lever_arm) @ s.turning_error())[:, :1]
    h[:, :, V] += forward
    h[:, :, PHI] -= forward @ skew(velocity)
    return residual, h


@dataclass(frozen=True)
class Kind:
    """A kind of measurement.

    Attributes:
        components: of its value.
        errors: components of its residual and of its sigma.
        observe: residual and H of readings.
    """

    components: int
    errors: int
    observe: Callable[[_Setting, Array], tuple[Array, Array]]


KINDS: dict[str, Kind] = {
    "gnss-position": Kind(3, 3, _position),
    "gnss-velocity": Kind(3, 3, _velocity),
    "baro-height": Kind(1, 1, _height),
    "zero-velocity": Kind(3, 3, _standing),
    "zero-rate": Kind(3, 3, _rate),
    "heading": Kind(1, 1, _heading),
    "attitude": Kind(4, 3, _attitude),
    "earth-attitude": Kind(4, 3, _earth_attitude),
    "speed": Kind(1, 1, _speed),
}
"""The kinds of `sinssim.data.Measurements`."""


def observe(
    measurements: Measurements, now: Prediction, model: ErrorModel, parameters: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Return residuals and H of readings.

    Args:
        measurements: M readings of one sensor.
        now: inertial navigation at their instants.
        model: the error model.
        parameters: values of the sensors' parameters that are compensated already, by block.

    Returns:
        Residuals, prediction less reading, (M, k), and H, (M, k, n).
    """
    m, label = measurements, measurements.label
    arm = np.asarray(m.lever_arm, dtype=np.float64)
    if m.kind in ("gnss-position", "gnss-velocity") and "gnss lever arm" in model.slices:
        arm = arm + parameters["gnss lever arm"]
    setting = _Setting(now, model, arm, rotation.dcm_from_quaternion(now.state.q_nb))
    value = m.value
    bias, scale = model.slices.get(f"{label} bias"), model.slices.get(f"{label} scale")
    if bias is not None:
        known = parameters[f"{label} bias"]
        if m.kind in ("attitude", "earth-attitude"):
            value = rotation.multiply(value, rotation.quaternion_from_rotation_vector(-known))
        elif m.kind != "gnss-position":  # whose value is in radians
            value = value - known
    if scale is not None:
        value = value / (1.0 + parameters[f"{label} scale"])
    forward = setting.c_nb[:, :, 0]
    deviation, wind = model.slices.get(f"{label} deviation"), model.slices.get(f"{label} wind")
    if deviation is not None:
        wave = forward[:, 1::-1] / np.hypot(forward[:, 0], forward[:, 1])[:, None]  # sin ψ, cos ψ
        value = value - wave @ parameters[f"{label} deviation"][:, None]
    residual, h = KINDS[m.kind].observe(setting, value)
    if bias is not None:
        if m.kind == "gnss-position":
            residual = residual + parameters[f"{label} bias"]
        h[:, :, bias] -= np.eye(residual.shape[1])
    if scale is not None:
        h[:, :, scale] -= value[:, :, None]
    if deviation is not None:
        h[:, 0, deviation] -= wave
    if wind is not None:
        known = np.append(parameters[f"{label} wind"], 0.0)
        residual = residual - forward @ known[:, None]
        h[:, 0, PHI] += np.cross(forward, known)  # c · [w ×] φ
        h[:, 0, wind] += forward[:, :2]
    return residual, h
