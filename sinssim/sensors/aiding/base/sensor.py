"""The base of every aiding sensor: its keys, its readings, its kinds of measurement, and its states in the filter.

An error that differs from run to run can be given in two ways, as for the inertial sensors: `bias_sigma_m = 10.0` is
the 1σ of a random error, `bias_m = 10.0` the error itself. All noises are 1σ of each measurement. By default the filter
assumes the true 1σ of the white noise and the true description of the errors in its states; `[filter]` can change
these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from sinssim.data import Array, ImuData, Measurements
from sinssim.errors import InputError
from sinssim.section import LeverArm, Moment, Noise, Rate, Section, Span
from sinssim.sensors.aiding.base.measurement import MeasurementKind
from sinssim.system.short_repr import short_repr
from sinssim.truth.sample_times import sample_edges

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.truth.trajectory import Trajectory

Mask = NDArray[np.bool_]
Spans = Sequence[tuple[float, float]]


Noise3 = tuple[Noise, Noise, Noise]


@dataclass(frozen=True)
class Vehicle:
    """The vehicle that carries aiding sensors.

    Attributes:
        trajectory: true motion of the sensor block.
        seed: the run's seed; every axis of every term of every sensor has its own generator, so that its draws do not
            depend on the other sensors.
        navigate: function that navigates another inertial system of a given grade at a lever arm [m] from the block,
            from the exact initial state; the solution is in the block's axes. None if not available.
        q_bs: mounting of the block, v_b = C_bs v_s, (4,).
        imu: the increments that the filter navigates on; None if not available.
    """

    trajectory: Trajectory
    seed: int = 0
    navigate: Callable[[str, LeverArm], NavSolution] | None = None
    q_bs: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    imu: ImuData | None = None


class SensorState(NamedTuple):
    """An error of an aiding sensor that the filter estimates: a constant, or a Gauss-Markov process.

    Attributes:
        block: name of the states, for example "<label> bias"; see `sinssim.estimation.model.BLOCKS`.
        sigma: 1σ of each component, SI; the filter has no state for an error whose 1σ are all zero.
        correlation_time: correlation time of a Gauss-Markov process, s; infinite for a constant.
        key: key of the sensor's table with this 1σ, which a diagnosis of the filter names.
        drawn: whether `read` draws the error; False for a wind, which is that of the flight.
    """

    block: str
    sigma: tuple[float, ...]
    correlation_time: float = math.inf
    key: str = ""
    drawn: bool = True


@short_repr
@dataclass(frozen=True)
class AidingReadings:
    """The readings of an aiding sensor for one kind of measurement, with the true values of its parameters.

    Attributes:
        measurements: readings for the filter.
        time: instants of all readings, including those in outages, (M,) s.
        parameters: true values of the sensor's parameters that a filter may estimate, by block of states: constants
            (k,), or values at `time` (M, k).
    """

    measurements: Measurements
    time: Array
    parameters: dict[str, Array]


class AidingSensor(Section):
    """A table of [aiding]: the common keys of aiding sensors, which are rate, latency, and outages."""

    table: ClassVar[str] = ""
    """Name of the table: that of the sensor's file."""
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
        """Return the readings of the sensor during a run.

        Raises:
            InputError: the motion ends before the first reading, or the seed cannot be used.
        """
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

        Args:
            velocity: "gnss-velocity" of the same run, if there are any.
            q_bs: mounting of the block in the vehicle, v_b = C_bs v_s, (4,); aligned by default.
        """
        return []

    def states(self) -> Iterable[SensorState]:
        """Return the errors of the sensor that the filter estimates; none by default."""
        return ()

    def epochs(self, trajectory: Trajectory) -> Array:
        """Return the instants of the readings, outages included.

        Returns:
            start + k/rate for k = 1, 2, …, (M,) s.

        Raises:
            InputError: the motion ends before the first reading.
        """
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
        told = np.asarray(sigma, dtype=np.float64)
        sigmas = np.broadcast_to(told, (len(instant), len(told)))  # one row for all readings
        valid_at = instant - lag if lag else instant
        arrival = instant + self.latency_s if self.latency_s else instant
        given = Measurements(kind, valid_at, arrival, value, sigmas, np.asarray(lever_arm, dtype=np.float64), label)
        return AidingReadings(given, time, parameters)


def within(time: Array, spans: Spans) -> Mask:
    """Return which instants lie in one of several intervals.

    Args:
        time: (M,) s.
        spans: beginning and end of each interval, both included, s.

    Returns:
        (M,).
    """
    inside = np.zeros(len(time), dtype=bool)
    for begin, end in spans:
        inside |= (time >= begin) & (time <= end)
    return inside
