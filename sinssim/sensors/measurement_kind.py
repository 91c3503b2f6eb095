"""Kinds of measurement: residual, H and R of the readings of aiding sensors, and their predictions.

The residual is what inertial navigation predicts less the reading, so that to first order residual = H x + noise with
the errors x of inertial navigation and of the sensors: solution less truth for position and velocity, the attitude φ
with C_solution = (I − [φ×]) C_true, all relative to north, and for a parameter its true value less the compensated one.
A sensor's own bias b and scale factor k belong to the reading, (1 + k) z + b, and enter H with the opposite sign.

The functions `compare_…` take the predicted quantities `at` and M readings, and return residuals (M, k) and H
(M, k, n); see `MeasurementKind.compare`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Literal, Protocol

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid

R, V, PHI = slice(0, 3), slice(3, 6), slice(6, 9)
"""Places of position, velocity and attitude in the state."""

CORE = 9
"""Number of these states."""


def skew(v: Array) -> Array:
    """Return the matrices [v×] of vectors, (..., 3, 3)."""
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def earth_rate(latitude: Array, ellipsoid: Ellipsoid) -> Array:
    """Return ω_ie at latitudes in north, east, down, (K, 3) rad/s."""
    w = ellipsoid.omega
    return np.stack([w * np.cos(latitude), np.zeros_like(latitude), -w * np.sin(latitude)], axis=-1)


def earth_rate_slope(latitude: Array, height: Array, ellipsoid: Ellipsoid) -> Array:
    """Return the derivative of ω_ie with respect to δr, both north, east, down, (K, 3, 3) rad/s/m."""
    over_north = ellipsoid.omega / (earth.radii(latitude, ellipsoid)[0] + height)
    out = np.zeros((len(latitude), 3, 3))
    out[:, 0, 0], out[:, 2, 0] = -over_north * np.sin(latitude), -over_north * np.cos(latitude)
    return out


class States(Protocol):
    """What a measurement needs of an error model: the places of its states, and the noise of the inertial sensors."""

    @property
    def gyro_noise(self) -> float:
        """Angle random walk N, rad/√s."""

    @property
    def gyro_quantum(self) -> float:
        """Weight of a pulse of the gyros, rad."""

    @property
    def accel_quantum(self) -> float:
        """Weight of a pulse of the accelerometers, m/s."""

    @property
    def slices(self) -> Mapping[str, slice]:
        """Place of each block's states, by name."""

    @property
    def size(self) -> int:
        """Number of states."""


@dataclass(frozen=True)
class Comparison:
    """The predicted quantities that readings of one sensor are compared with."""

    state: NavState  # inertial navigation at their instants, M rows
    rate_b: Array  # inertial rate of the body, or its mean over the reading's interval, (M, 3) rad/s
    # function that returns the matrix of that rate's error by the gyros' states, (M, 3, n)
    rate_error: Callable[[], Array]
    ellipsoid: Ellipsoid  # reference ellipsoid
    model: States  # the error model
    parameters: Mapping[str, Array]  # values of the sensors' compensated parameters, by block
    label: str  # name of the sensor
    lever_arm: Array  # from the block to the sensor, body axes, (3,) m

    @cached_property
    def c_nb(self) -> Array:
        """Attitude, from body axes to north, east, down, (M, 3, 3)."""
        return rotation.dcm_from_quaternion(self.state.q_nb)

    @property
    def c_bn(self) -> Array:
        """Its transpose, (M, 3, 3)."""
        return np.asarray(self.c_nb.transpose(0, 2, 1))

    def zeros(self, components: int) -> Array:
        """Return an H of zeros, (M, components, n)."""
        return np.zeros((len(self.c_nb), components, self.model.size))

    def states(self, error: str) -> slice | None:
        """Return the place of the states of the sensor's own error, for example "bias"; None if the model has none."""
        return self.model.slices.get(f"{self.label} {error}")

    def known(self, error: str) -> Array:
        """Return the compensated part of the sensor's own error."""
        return self.parameters[f"{self.label} {error}"]

    def turning(self) -> Array:
        """Return the rate relative to the Earth in body axes, (M, 3) rad/s."""
        rate = earth_rate(self.state.latitude, self.ellipsoid)
        return np.asarray(self.rate_b - np.einsum("kij,kj->ki", self.c_bn, rate))

    def turning_error(self) -> Array:
        """Return W: W x is the error of that rate, (M, 3, n).

        It contains the gyros' errors and the errors of the resolved Earth rate by errors of attitude and position.
        """
        state, out = self.state, self.rate_error()
        out[:, :, PHI] += self.c_bn @ skew(earth_rate(state.latitude, self.ellipsoid))
        out[:, :, R] -= self.c_bn @ earth_rate_slope(state.latitude, state.height, self.ellipsoid)
        return out


def no_fault(value: Array) -> str:
    """Return "": every finite reading can be used."""
    return ""


def first_less(value: Array, bias: Array) -> Array:
    """Return readings, (M, components), whose first components are less by a bias."""
    if value.shape[1] == len(bias):
        return value - bias
    return np.column_stack([value[:, : len(bias)] - bias, value[:, len(bias) :]])


@dataclass(frozen=True, eq=False)
class MeasurementKind:
    """A kind of measurement."""

    name: str  # `Measurements.kind`, unique among all sensors
    _: KW_ONLY
    columns: tuple[str, ...]  # names of the reading's components with their units, as in the recorded streams
    axes: tuple[str, ...] = ("",)  # axes of the residual and of sigma, as in the streams; "" for a single one
    unit: str  # unit of the residual, as in the streams
    # function of the predicted quantities and of M readings, free of the sensor's known errors, (M, components);
    # returns residuals, prediction less reading, (M, errors), and H, (M, errors, n), zero for bias and scale factor
    compare: Callable[[Comparison, Array], tuple[Array, Array]]
    # function that returns readings less a bias, (M, components); by default the first components are less. None for a
    # bias in the unit of the residual only, which is added to the residual.
    less_bias: Callable[[Array, Array], Array] | None = first_less
    # function that returns the reason why a reading with finite components, (components,), cannot be used, "" if it can
    fault: Callable[[Array], str] = no_fault
    # the inertial sensors whose pulse rounding is in the predicted quantity
    rounding: Literal["gyros", "accelerometers"] | None = None
    mean_rate: bool = False  # whether the reading is compared with the gyros' mean rate since the previous reading
    needs_rate: bool = False  # whether the reading is compared with the body's rate even without a lever arm
    # whether the reading is that of the satellite antenna, so that the states "gnss lever arm" apply
    at_antenna: bool = False
    # whether the satellite receiver stamps the reading, so that the state "gnss time offset" applies
    on_gnss_clock: bool = False
    # axes and unit, as in the streams, of errors that only sensors of this kind have
    own_errors: Mapping[str, tuple[tuple[str, ...], str]] = field(default_factory=dict)
    # own errors that a diagnosis tries as states, with a wide 1σ in SI; for example a bias
    diagnosed: Mapping[str, float] = field(default_factory=dict)
    of_north: bool = False  # whether the reading depends on the direction of north, so that it has no meaning at a pole
    # whether H is that of errors relative to north, which the filter refers to the model's axes; False if it is the
    # same in all axes, as for a velocity of zero
    turns_with_north: bool = True
    zero: bool = False  # whether the reading is that of a velocity of zero, which is zero in any axes
    # number of the first components that are velocities or rates, whose sign changes in reverse time
    velocities: int = 0

    @property
    def components(self) -> int:
        """Number of the reading's components."""
        return len(self.columns)

    @property
    def errors(self) -> int:
        """Number of components of the residual and of sigma."""
        return len(self.axes)

    def is_velocity(self, error: str) -> bool:
        """Return whether an error of the sensor is a velocity or a rate, whose sign changes in reverse time."""
        return self.velocities > 0 if error == "bias" else self.own_errors.get(error, ((), ""))[1] in ("mps", "radps")

    def observe(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Return residuals, (M, errors), and H, (M, errors, n), of readings, (M, components), with the sensor's own
        bias and scale factor."""
        bias, scale = at.states("bias"), at.states("scale")
        if bias is not None and self.less_bias is not None:
            value = self.less_bias(value, at.known("bias"))
        if scale is None:
            residual, h = self.compare(at, value)
        else:
            # (1 + k) z + b is linear in k at the predicted z; the reading over 1 + k is not, and its noise is less
            gain = 1.0 + at.known("scale")
            residual, h = self.compare(at, value / gain)
            predicted = residual + value / gain
            residual, h = gain * residual, gain * h
            h[:, :, scale] -= predicted[:, :, None]
        if bias is not None:
            residual = residual if self.less_bias is not None else residual + at.known("bias")
            h[:, :, bias] -= np.eye(self.errors)
        return residual, h

    def noise(self, model: States, interval: Array) -> Array:
        """Return the contribution of the inertial sensors' noise to R, the variance of every component, (M,), from the
        time since the previous reading, (M,) s.

        The rounding of the last pulse is independent from sample to sample in velocity and attitude, with the variance
        Q²/12. The random walk is process noise, except in a mean rate over T: N²/T, and rounding at both ends, Q²/6T².
        """
        if self.mean_rate:
            return np.asarray(model.gyro_noise**2 / interval + model.gyro_quantum**2 / (6.0 * interval**2))
        quanta = {"gyros": model.gyro_quantum, "accelerometers": model.accel_quantum, None: 0.0}
        return np.full(len(interval), quanta[self.rounding] ** 2 / 12.0)


def compare_velocity(at: Comparison, value: Array, arm_states: slice | None = None) -> tuple[Array, Array]:
    """Compare velocities north, east, down, (M, 3) or (3,) m/s, of a point at the lever arm, v + C (ω × l).

    ω is the rate relative to the Earth, W x its error; the residual is δv + [C (ω × l) ×] φ − C [l×] W x − C [ω×] δl.
    `arm_states` is the place of δl among the states, None if the model does not have it.
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
