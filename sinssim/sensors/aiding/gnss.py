"""Satellite receivers: position and velocity, the course of the first motion, and the heading of the line between two
antennas.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.sensors.aiding_sensor import (
    AidingReadings,
    AidingSensor,
    Mask,
    SensorState,
    Vehicle,
    correlated,
    state_at,
    turn_on,
    white,
    within,
)
from sinssim.sensors.measurement_kind import (
    PHI,
    Comparison,
    MeasurementKind,
    R,
    compare_heading,
    compare_velocity,
    skew,
)
from sinssim.toml_section import (
    CorrelationTime,
    Duration,
    LeverArm,
    Moment,
    Noise,
    Offset,
    Section,
    Spread,
    TimeSpread,
    Velocity,
    in_order,
)
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG

_DOWN = np.array([1.0, 1.0, -1.0])
"""Factors from north, east, up to north, east, down."""

TimeOffset = Annotated[float, Field(ge=-10.0, le=10.0)]
"""s: a filter linearises a delay; larger ones are found beforehand."""
Averaging = Annotated[float, Field(ge=0.0, le=2.0)]
"""s: of a receiver that differences positions or phases."""

_NEAR_POLE = np.radians(89.9)
"""Latitude beyond which an error is added in the tangent plane, because a pole has no metres of longitude."""


def _without_size(fault: _Fault) -> str:
    """Return the keys of the size of a fault if none of them is given."""
    sizes = [name for name in type(fault).model_fields if name not in _Fault.model_fields]
    return "" if fault.changed(*sizes) else ", ".join(sizes)


class _Fault(Section):
    rules = ((_without_size, "{it} are all 0: give at least one of them"),)

    from_s: Moment = Field(description="time at which the fault begins")
    to_s: Duration | None = Field(default=None, description="time at which the fault ends; default: never")

    @model_validator(mode="after")
    def _lasts(self) -> Self:
        if self.to_s is not None:
            in_order((self.from_s, self.to_s))
        return self


class Jump(_Fault):
    """A constant error of the fixes during an interval."""

    north_m: Offset = Field(default=0.0, description="error to the north")
    east_m: Offset = Field(default=0.0, description="error to the east")
    up_m: Offset = Field(default=0.0, description="error upwards")


class Ramp(_Fault):
    """A spoofing ramp: the position error of the fixes grows at a constant rate, and the velocity fixes contain this
    rate."""

    north_mps: Velocity = Field(default=0.0, description="rate of the error to the north")
    east_mps: Velocity = Field(default=0.0, description="rate of the error to the east")
    up_mps: Velocity = Field(default=0.0, description="rate of the error upwards")


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


def compare_antenna_velocity(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare velocities as `compare_velocity`, of the satellite antenna, whose lever arm the model may have."""
    return compare_velocity(at, value, at.model.slices.get("gnss lever arm"))


class Gnss(AidingSensor):
    """A GNSS receiver, which measures the position and the velocity of its antenna."""

    table: ClassVar = "gnss"
    rules = (
        (lambda s: not (s.position or s.velocity),
         "position = false and velocity = false leave no measurement: set one of them to true"),
    )  # fmt: skip

    kinds: ClassVar = (
        MeasurementKind(
            "gnss-position",
            columns=("latitude_rad", "longitude_rad", "height_m"),
            axes=("n", "e", "d"),
            unit="m",
            compare=compare_position,
            less_bias=None,
            fault=beyond_a_pole,
            at_antenna=True,
            on_gnss_clock=True,
            turns_with_north=False,  # compared in Earth-fixed axes; [C l ×] is that of a lever arm that goes along
        ),
        MeasurementKind(
            "gnss-velocity",
            columns=("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"),
            axes=("n", "e", "d"),
            unit="mps",
            compare=compare_antenna_velocity,
            rounding="accelerometers",
            at_antenna=True,
            on_gnss_clock=True,
            of_north=True,
            velocities=3,
        ),
    )

    position: bool = Field(default=True, description="whether the receiver provides positions")
    velocity: bool = Field(default=True, description="whether the receiver provides velocities")
    position_sigma_m: Noise = Field(default=1.5, description="1σ of the white noise north, and east")
    height_sigma_m: Noise = Field(default=3.0, description="1σ of the white noise of the height")
    velocity_sigma_mps: Noise = Field(default=0.05, description="1σ of the white noise of each velocity component")
    correlated_position_sigma_m: Spread = Field(
        default=0.0, description="1σ of the Gauss-Markov error north, and east (orbits, atmosphere)"
    )
    correlated_height_sigma_m: Spread = Field(default=0.0, description="1σ of the Gauss-Markov error of the height")
    correlated_velocity_sigma_mps: Spread = Field(
        default=0.0, description="1σ of the Gauss-Markov error of each velocity component"
    )
    correlation_time_s: CorrelationTime = Field(
        default=300.0, description="correlation time of the Gauss-Markov errors"
    )
    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0),
        description="position of the antenna relative to the sensor block: forward, right, down",
    )
    lever_arm_sigma_m: Spread = Field(default=0.0, description="1σ of the error of each assumed component")
    time_offset_s: TimeOffset | None = Field(
        default=None, description="given delay of the time stamps of all fixes relative to their validity"
    )
    time_offset_sigma_s: TimeSpread = Field(
        default=0.0, description="1σ of a random time offset, added to the given one"
    )
    velocity_averaging_s: Averaging = Field(
        default=0.0,
        description="interval up to the time stamp over which the receiver averages the velocity; the filter knows "
        "this interval",
    )
    velocity_delay_sigma_s: TimeSpread = Field(
        default=0.0,
        description="1σ of a further, unknown delay of the velocity, in addition to the time offset",
    )
    jumps: tuple[Jump, ...] = Field(default=(), description="errors that are constant during an interval")
    ramps: tuple[Ramp, ...] = Field(default=(), description="errors that grow steadily: spoofing")

    def _faults(self, time: Array) -> tuple[Array, Array]:
        """Return the errors of position and velocity by jumps and ramps, north, east, up, (M, 3) m and m/s."""
        position, velocity = np.zeros((len(time), 3)), np.zeros((len(time), 3))
        for jump in self.jumps:
            on = within(time, [(jump.from_s, np.inf if jump.to_s is None else jump.to_s)])
            position[on] += (jump.north_m, jump.east_m, jump.up_m)
        for ramp in self.ramps:
            on = within(time, [(ramp.from_s, np.inf if ramp.to_s is None else ramp.to_s)])
            drift = np.array([ramp.north_mps, ramp.east_mps, ramp.up_mps])
            position[on] += np.multiply.outer(time[on] - ramp.from_s, drift)
            velocity[on] += drift
        return position, velocity

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return positions (latitude, longitude, height) and velocities (north, east, down) of the antenna.

        The lever arm that the filter assumes has the error that the section gives.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        late = turn_on(seed, "gnss time offset", s.time_offset_s, s.time_offset_sigma_s)
        antenna, there = _antenna(trajectory, time, late, s.lever_arm_m)
        off = white(seed, "gnss lever arm", (s.lever_arm_sigma_m,) * 3, 1)[0]
        shared = {"gnss lever arm": -off, "gnss time offset": np.array([late])}
        assumed = np.array(s.lever_arm_m) + off
        moved, drift = s._faults(time)
        readings = []
        if s.position:
            sigma = (s.position_sigma_m, s.position_sigma_m, s.height_sigma_m)
            bias = correlated(seed, "gnss position drift", s._position_drift, time, s.correlation_time_s)
            error = moved + bias + white(seed, "gnss position noise", sigma, len(time))  # north, east, up
            r1, r2 = earth.radii(antenna.latitude, trajectory.ellipsoid)
            value = np.column_stack(
                (
                    antenna.latitude + error[:, 0] / (r1 + antenna.height),
                    antenna.longitude + error[:, 1] / ((r2 + antenna.height) * np.cos(antenna.latitude)),
                    antenna.height + error[:, 2],
                )
            )
            near = np.abs(antenna.latitude) > _NEAR_POLE
            if near.any():
                at = antenna.latitude[near], antenna.longitude[near], antenna.height[near]
                place = earth.displaced(*at, error[near, 0], error[near, 1], trajectory.ellipsoid)
                value[near, :2] = np.column_stack(place)
            true = {"gnss-position bias": bias * _DOWN if bias.any() else np.zeros(3), **shared}
            readings.append(
                s.readings("gnss-position", "gnss-position", time, value, sigma, true, lever_arm=assumed, valid=there)
            )
        if s.velocity:
            sigma = (s.velocity_sigma_mps,) * 3
            bias = correlated(seed, "gnss velocity drift", s._velocity_drift, time, s.correlation_time_s)
            delay = turn_on(seed, "gnss velocity delay", None, s.velocity_delay_sigma_s)
            velocity = antenna.velocity_ned
            if delay or s.velocity_averaging_s:
                velocity, there = _velocity(trajectory, time, late + delay, s.lever_arm_m, s.velocity_averaging_s)
            value = velocity + drift * _DOWN + bias
            value += white(seed, "gnss velocity noise", sigma, len(time))
            true = {"gnss-velocity bias": bias if bias.any() else np.zeros(3), **shared}
            true["gnss-velocity delay"] = np.array([delay])
            readings.append(
                s.readings(
                    "gnss-velocity", "gnss-velocity", time, value, sigma, true, lever_arm=assumed, valid=there,
                    lag=0.5 * s.velocity_averaging_s,
                )
            )  # fmt: skip
        return readings

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the slow errors of position and velocity, of the lever arm, and of the time."""
        if self.position:
            yield SensorState("gnss-position bias", self._position_drift, self.correlation_time_s)
        if self.velocity:
            yield SensorState("gnss-velocity bias", self._velocity_drift, self.correlation_time_s)
        yield SensorState("gnss lever arm", (self.lever_arm_sigma_m,) * 3)
        yield SensorState("gnss time offset", (math.hypot(self.time_offset_sigma_s, self.time_offset_s or 0.0),))
        if self.velocity:
            yield SensorState("gnss-velocity delay", (self.velocity_delay_sigma_s,))

    @property
    def _position_drift(self) -> tuple[float, float, float]:
        """1σ of the slow error, north, east, height, m."""
        return (self.correlated_position_sigma_m, self.correlated_position_sigma_m, self.correlated_height_sigma_m)

    @property
    def _velocity_drift(self) -> tuple[float, float, float]:
        """1σ of the slow error of each component, m/s."""
        return (self.correlated_velocity_sigma_mps,) * 3


def _antenna(trajectory: Trajectory, time: Array, late: float, arm: LeverArm) -> tuple[NavState, Mask]:
    """Return the state of the antenna some time before the stamps, and whether that is within the run, (M,)."""
    valid = time - late
    inside = (valid >= trajectory.start) & (valid <= trajectory.end)
    return state_at(trajectory, np.clip(valid, trajectory.start, trajectory.end), arm), inside


def _velocity(trajectory: Trajectory, time: Array, late: float, arm: LeverArm, averaging: float) -> tuple[Array, Mask]:
    """Return the velocity of the antenna some time before the stamps, averaged over an interval that ends there."""
    end, inside = _antenna(trajectory, time, late, arm)
    if not averaging:
        return end.velocity_ned, inside
    begin, also = _antenna(trajectory, time, late + averaging, arm)
    place = [earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, trajectory.ellipsoid) for s in (begin, end)]
    q_ne = rotation.conjugate(earth.q_en(end.latitude, end.longitude))
    return rotation.rotate(q_ne, place[1] - place[0]) / averaging, inside & also


USUAL = 3.0
"""Speed at which a velocity with a 1σ of 0.05 m/s, as data sheets state it, gives the course to 1°, m/s."""
WORST = np.radians(10.0)
"""1σ of a course that is still used if no speed gives a better one: what the filter assumes of such a heading."""
_ROWS = 3
"""Velocities in a row that must be as fast: a single one may be an outlier."""


def first_course(time: Array, velocity: Array, sigma: Array, least: float | None = None) -> tuple[int, float] | None:
    """Return the row at which a vehicle first moves fast enough for its course, and the 1σ of the course then, rad;
    None if it never does. The velocities are north, east, and anything, (M, k) m/s, each with one 1σ, (M,). By default
    the least speed is `USUAL`, or if that is not reached, the speed at which the 1σ of the course is `WORST`."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    limits = [np.full(len(time), USUAL), sigma / np.tan(WORST)] if least is None else [np.full(len(time), least)]
    for limit in limits:
        fast = speed >= limit
        rows = np.flatnonzero(np.all([fast[k : len(fast) - _ROWS + 1 + k] for k in range(_ROWS)], axis=0))
        if len(time) >= _ROWS and len(rows):
            k = int(rows[0])
            return k, float(np.arctan2(sigma[k], speed[k]))
    return None


def _of_baseline(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the heading of the line from the first antenna to the second, whose vector is the lever arm."""
    return compare_heading(at, value, at.lever_arm)


class DualAntenna(AidingSensor):
    """A GNSS receiver with two antennas, which measures the heading of the baseline between them."""

    table: ClassVar = "dual_antenna"
    kinds: ClassVar = (
        MeasurementKind(
            "baseline-heading",
            columns=("heading_rad",),
            unit="rad",
            compare=_of_baseline,
            rounding="gyros",
            on_gnss_clock=True,
            diagnosed={"bias": 1.0},
            of_north=True,
        ),
    )

    baseline_m: LeverArm = Field(
        default=(1.0, 0.0, 0.0), description="from the first antenna to the second: forward, right, down"
    )
    sigma_deg: Noise = Field(
        default=0.2,
        description="1σ of the white noise; about 0.2 deg for a baseline of 1 m, in inverse proportion to its length",
    )
    bias_deg: Offset | None = Field(default=None, description="given error of the baseline's direction on the vehicle")
    bias_sigma_deg: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")

    @field_validator("baseline_m")
    @classmethod
    def _has_a_heading(cls, value: LeverArm) -> LeverArm:
        if math.hypot(value[0], value[1]) < 0.01:
            raise ValueError(
                f"the antennas are {math.hypot(*value):g} m apart, but less than 0.01 m forward and right: their line "
                "has no heading"
            )
        return value

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return headings of the baseline, ψ + b + ν."""
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        line = rotation.rotate(trajectory.state(time).q_nb, np.array(s.baseline_m))
        bias = turn_on(seed, "dual antenna bias", s.bias_deg, s.bias_sigma_deg)
        error = DEG * (bias + white(seed, "dual antenna noise", (s.sigma_deg,), len(time)))
        value: Array = np.mod(np.arctan2(line[:, 1], line[:, 0])[:, np.newaxis] + error, 2.0 * np.pi)
        true = {"dual-antenna bias": DEG * np.array([bias])}
        sigma = (DEG * s.sigma_deg,)
        return [s.readings("dual-antenna", "baseline-heading", time, value, sigma, true, lever_arm=s.baseline_m)]

    def states(self) -> Iterator[SensorState]:
        """Yield the state of the constant error."""
        sigma = DEG * math.hypot(self.bias_sigma_deg, self.bias_deg or 0.0)
        yield SensorState("dual-antenna bias", (sigma,), key="bias_sigma_deg")
