"""The base of every aiding sensor: keys, readings, kinds of measurement, filter states, random errors, lever arm.

An error that differs from run to run can be given in two ways, as for the inertial sensors: `bias_sigma_m = 10.0` is
the 1σ of a random error, `bias_m = 10.0` the error itself. All noises are 1σ of each measurement; every axis of every
term has its own random numbers. By default the filter assumes the true 1σ of the white noise and the true description
of the errors in its states; `[filter]` can change these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, Measurements, NavState, short_repr
from sinssim.errors import InputError
from sinssim.sensors.measurement_kind import MeasurementKind
from sinssim.toml_section import LeverArm, Moment, Noise, Rate, Section, Span
from sinssim.truth.sampling import block_state, part_by_part, sample_edges
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.data import NavSolution


Mask = NDArray[np.bool_]
Spans = Sequence[tuple[float, float]]


Noise3 = tuple[Noise, Noise, Noise]


@dataclass(frozen=True)
class Vehicle:
    """The vehicle that carries aiding sensors."""

    trajectory: Trajectory  # true motion of the sensor block
    # the run's seed; every axis of every term of every sensor has its own generator, so that its draws do not depend on
    # the other sensors
    seed: int = 0
    # function that navigates another inertial system of a given grade at a lever arm [m] from the block, from the exact
    # initial state; the solution is in the block's axes. None if not available.
    navigate: Callable[[str, LeverArm], NavSolution] | None = None
    # mounting of the block, v_b = C_bs v_s, (4,)
    q_bs: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    imu: ImuData | None = None  # the increments that the filter navigates on; None if not available


class SensorState(NamedTuple):
    """An error of an aiding sensor that the filter estimates: a constant, or a Gauss-Markov process."""

    block: str  # name of the states, for example "<label> bias"; see `sinssim.estimation.state_model.BLOCKS`
    sigma: tuple[float, ...]  # 1σ of each component, SI; the filter has no state for an error whose 1σ are all zero
    correlation_time: float = math.inf  # correlation time of a Gauss-Markov process, s; infinite for a constant
    key: str = ""  # key of the sensor's table with this 1σ, which a diagnosis of the filter names
    drawn: bool = True  # whether `read` draws the error; False for a wind, which is that of the flight


@short_repr
@dataclass(frozen=True)
class AidingReadings:
    """The readings of an aiding sensor for one kind of measurement, with the true values of its parameters."""

    measurements: Measurements
    time: Array  # instants of all readings, including those in outages, (M,) s
    # true values of the sensor's parameters that a filter may estimate, by block of states: constants (k,), or values
    # at `time` (M, k)
    parameters: dict[str, Array]


class AidingSensor(Section):
    """A table of [aiding]: the common keys of aiding sensors, which are rate, latency, and outages."""

    table: ClassVar[str] = ""
    """Name of the table: that of the sensor's file, unless several sensors share one."""
    kinds: ClassVar[tuple[MeasurementKind, ...]] = ()
    """The kinds of measurement that the sensor brings; its readings may also be of kinds that other sensors bring."""
    assumed: ClassVar[bool] = False
    """Whether the readings are zero by assumption, with an error of the given 1σ."""

    rate_hz: Rate = Field(
        default=1.0,
        description="measurements per second, at most the rate of the IMU; the first measurement is one "
        "interval after the start",
    )
    latency_s: Moment = Field(
        default=0.0, description="time from the validity of a measurement to its arrival at the filter"
    )
    outages_s: tuple[Span, ...] = Field(
        default=(), description="[from, to] of each interval without measurements; intervals may overlap"
    )

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return the readings of the sensor during a run."""
        raise NotImplementedError

    @property
    def no_budget(self) -> str:
        """Why a budget cannot have the sensor, for a message; "" if it can."""
        return ""

    @property
    def of_fixed_block(self) -> str:
        """Why the readings need a block that does not turn in the vehicle, for a message; "" if they do not."""
        return ""

    @property
    def needs_no_truth(self) -> bool:
        """Whether the readings follow from the inertial readings themselves, see `from_imu`; not by default."""
        return False

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return the readings that follow from the inertial readings themselves, in a run or in a log; none by default.
        `velocity` is "gnss-velocity" of the same run, if there is any; q_bs is the mounting of the block, v_b = C_bs
        v_s."""
        return []

    def states(self) -> Iterable[SensorState]:
        """Return the errors of the sensor that the filter estimates; none by default."""
        return ()

    def epochs(self, trajectory: Trajectory) -> Array:
        """Return the instants of the readings, outages included: start + k/rate for k = 1, 2, …, (M,) s."""
        duration = trajectory.end - trajectory.start
        if duration * self.rate_hz < 1.0 - 1e-9:
            raise InputError(
                f"aiding.{self.table}.rate_hz = {self.rate_hz:g}: the first measurement comes after "
                f"{1.0 / self.rate_hz:g} s, and the motion ends after {duration:g} s. Use a higher rate or a longer "
                "motion."
            )
        return sample_edges(trajectory.start, trajectory.end, self.rate_hz)[1:]

    def readings(
        self,
        label: str,
        kind: str,
        time: Array,
        value: Array,
        sigma: ArrayLike,
        parameters: dict[str, Array],
        *,
        lever_arm: ArrayLike = (0.0, 0.0, 0.0),
        valid: Mask | None = None,
        lag: float = 0.0,
    ) -> AidingReadings:
        """Return readings in the form for the filter.

        All errors are drawn before, so that an outage does not change the noise of the other readings.

        Args:
            label: name of the readings, unique among all sensors; names of the sensor's blocks begin with it.
            kind: kind of measurement, see `Measurements`.
            time: instants of all readings, (M,) s.
            value: all readings, (M, k).
            sigma: 1σ of each component, (k,).
            parameters: see `AidingReadings`.
            lever_arm: from the block to the sensor, body axes, (3,) m.
            valid: which readings exist, regardless of outages, (M,); all by default.
            lag: time by which the reading lags the quantity, s.
        """
        kept = ~within(time, self.outages_s)
        if valid is not None:
            kept &= valid
        instant = time
        if not kept.all():
            instant, value = time[kept], value[kept]
        sigma_row = np.asarray(sigma, dtype=np.float64)
        sigmas = np.broadcast_to(sigma_row, (len(instant), len(sigma_row)))  # one row for all readings
        valid_at = instant - lag if lag else instant
        arrival = instant + self.latency_s if self.latency_s else instant
        given = Measurements(kind, valid_at, arrival, value, sigmas, np.asarray(lever_arm, dtype=np.float64), label)
        return AidingReadings(given, time, parameters)


def within(time: Array, spans: Spans) -> Mask:
    """Return which instants, (M,) s, lie in one of several intervals, ends included."""
    inside = np.zeros(len(time), dtype=bool)
    for begin, end in spans:
        inside |= (time >= begin) & (time <= end)
    return inside


def white(seed: int, term: str, sigma: Sequence[float] | Array, count: int) -> Array:
    """Return white noise, (M, k), with 1σ by axis, (k,); `term` names sensor and error, for example "gnss position
    noise"."""
    from sinssim.statistics.random_numbers import normals  # needs the compiler

    return np.column_stack([s * normals(seed, term, i, count) for i, s in enumerate(sigma)])


def correlated(seed: int, term: str, sigma: Sequence[float] | Array, time: Array, correlation_time: float) -> Array:
    """Return a stationary first-order Gauss-Markov process at times, (M, k), with 1σ by axis, (k,)."""
    if not np.any(sigma):
        return np.zeros((len(time), len(sigma)))
    from sinssim.statistics.random_numbers import gauss_markov

    fresh = white(seed, term, sigma, len(time))
    interval = np.diff(time)
    return np.column_stack([gauss_markov(interval, correlation_time, axis.copy()) for axis in fresh.T])


def turn_on(seed: int, term: str, fixed: float | None, sigma: float, axis: int = 0) -> float:
    """Return an error that is constant during a run, in the units of `fixed` and `sigma`: the given value, which is the
    mean over all runs, plus a random one."""
    if fixed is not None and not sigma:
        return fixed
    from sinssim.statistics.random_numbers import normals

    drawn = sigma * float(normals(seed, term, axis, 1)[0])
    return drawn if fixed is None else fixed + drawn


def turning(trajectory: Trajectory, time: Array, state: NavState) -> Array:
    """Return the angular rate of the sensor block relative to the Earth in its axes, ω_eb = ω_ib − C_be ω_ie, (M, 3)
    rad/s."""
    q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)
    spin = rotation.rotate(rotation.conjugate(q_eb), np.array([0.0, 0.0, trajectory.ellipsoid.omega]))
    return np.asarray(trajectory.rates(time)[0] - spin)


def state_at(trajectory: Trajectory, time: Array, lever_arm: ArrayLike) -> NavState:
    """Return the true state of a point on a lever arm l from the sensor block, body axes, (3,) m.

    r = r_block + C_eb l and v = v_block + C_eb (ω_eb × l), in Earth-fixed axes. North, east and down are those at the
    point.
    """
    arm = np.asarray(lever_arm, dtype=np.float64)
    if not arm.any():
        return trajectory.state(time)
    return part_by_part(lambda part: _on_the_arm(trajectory, part, arm), time)


def _on_the_arm(trajectory: Trajectory, time: Array, arm: Array) -> NavState:
    state = trajectory.state(time)
    q_en = earth.q_en(state.latitude, state.longitude)
    q_eb = rotation.multiply(q_en, state.q_nb)
    position = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, trajectory.ellipsoid)
    swing = np.cross(turning(trajectory, time, state), arm)
    return block_state(
        position + rotation.rotate(q_eb, arm),
        rotation.rotate(q_en, state.velocity_ned) + rotation.rotate(q_eb, swing),
        q_eb,
        trajectory.ellipsoid,
    )


_STEPS = 32
"""Steps per time constant: linear interpolation of the signal x is then in error by at most (τ/32)² x″/8."""

_SHORTEST = 1e-3
"""Shortest step, s: linear interpolation over it is in error by x″ · 1.3e-7 s², for a height at 5 g 6 µm."""

_FORGOTTEN = 40.0
"""Time constants after which the weight of the past is e⁻⁴⁰ = 4e-18, less than the rounding of a double."""

_BLOCK = 1 << 18
"""Maximum number of signal values in memory."""


def lagged(signal: Callable[[Array], Array], start: float, time: Array, lag: float) -> Array:
    """Return the response of a first-order lag, τ ẏ = x − y, to a signal, with y = x at the start: y, (M,).

    Over a step h on which x is linear, y has a closed form for every h/τ: y₁ = e⁻ᵃ y₀ + (1 − r) x₁ + (r − e⁻ᵃ) x₀ with
    a = h/τ and r = (1 − e⁻ᵃ)/a. The steps cover the time between two readings, or its last 40 τ if these are shorter.
    Memory does not grow with the length of the run, and the number of steps is bounded for every τ.
    """
    if not lag:
        return signal(time)
    between = np.diff(time, prepend=start)
    window = np.minimum(between, _FORGOTTEN * lag)
    count = max(int(np.ceil(window.max() / max(lag / _STEPS, _SHORTEST))), 1)
    a = window / (count * lag)
    decay = np.exp(-a)
    rise = np.divide(-np.expm1(-a), a, out=np.ones_like(a), where=a > 0.0)
    came = np.empty(len(time))
    rows = max(_BLOCK // (count + 1), 1)
    for first in range(0, len(time), rows):
        part = slice(first, first + rows)
        steps = np.linspace(-window[part], 0.0, count + 1, axis=1)
        x = signal(np.maximum(time[part, None] + steps, start).ravel()).reshape(steps.shape)
        r, d = rise[part, None], decay[part, None]
        fresh = (1.0 - r) * x[:, 1:] + (r - d) * x[:, :-1]
        came[part] = np.sum(fresh * d ** np.arange(count - 1, -1, -1), axis=1)
    kept = np.exp(-between / lag)
    first_value = float(signal(np.array([start]))[0])
    after = accumulate(zip(kept, came, strict=True), lambda y, step: step[0] * y + step[1], initial=first_value)
    return np.fromiter(after, dtype=np.float64, count=len(time) + 1)[1:]
