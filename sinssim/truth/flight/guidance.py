"""Guidance by navigation: what the autopilot and the legs see instead of the true motion of the aircraft.

The errors of a navigation solution on another pass over the same plan are added to the present true motion. A flight
that is repeated with the errors of the flight before converges to the one that its own navigator guides, because the
errors depend weakly on the path (`sinssim.simulation.guided_passes`).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, cos, floor, hypot, remainder, sin, tau
from operator import add
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import NotNegative, Section
from sinssim.truth.flight.autopilot import AircraftState

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

TRUTH, AIDED = "truth", "aided"
"""Sources of a flight: the true motion, and the solution of the filter."""
ENDED = "the flight by its navigator ends early: "
"""Beginning of the event of a flight that its navigator has led into the ground or out of its envelope."""

Quantity = Literal["position", "height", "velocity", "attitude"]

QUANTITIES: tuple[Quantity, ...] = ("position", "height", "velocity", "attitude")
"""What a solution may give to the autopilot, in the order of the columns of `SolutionErrors`."""

_COLUMNS = {"position": (0, 1), "height": (2,), "velocity": (3, 4, 5), "attitude": (6, 7, 8, 9, 10, 11)}
_ANGLES = (6, 8)
"""Columns of angles that have no end: roll and heading."""


class Guidance(Section):
    """Guidance of the flight: what the autopilot and the legs see, the true motion or a navigation solution."""

    source: str = Field(
        default=TRUTH,
        description='"truth", an algorithm of [navigation], "aided" or the name of a [[navigator]]: whose solution the '
        "autopilot and the legs see; until it navigates, the true motion",
    )
    quantities: Annotated[tuple[Quantity, ...], Field(min_length=1)] = Field(
        default=QUANTITIES,
        description="what they see of it; the rest stays true. Velocity has the vertical speed and the track, attitude "
        "the rates of the gyros. The airspeed is that of [aiding.airspeed], and without height among them the height "
        "that of [aiding.baro], where there are such sensors",
    )
    latency_s: Annotated[NotNegative, Field(le=10.0)] = Field(
        default=0.0, description="from the instant of a solution until the autopilot has it"
    )
    rate_hz: Annotated[float, Field(ge=1.0, le=30.0)] = Field(default=30.0, description="solutions a second")


class AirData(NamedTuple):
    """The readings of an air-data sensor, in the order of time."""

    time: Array  # their instants from the start of the flight, (M,) s
    arrival: Array  # when the autopilot has them, (M,) s
    errors: Array  # reading less the truth at its instant, (M,), m/s or m


@dataclass(frozen=True)
class SolutionErrors:
    """Errors of a navigation solution at the instants k/rate of a flight: what the autopilot sees less the truth.

    Attributes:
        guidance: rate, latency and quantities.
        values: latitude, longitude, rad; height, m; velocity north, east, down, m/s; roll, pitch, heading, rad; body
            rates, rad/s: (K, 12). After the last row the errors stay as they are.
        airspeed: readings of the true airspeed; None: the autopilot sees the true one.
        height: readings of a barometer, if the autopilot sees its height.
    """

    guidance: Guidance
    values: Array
    airspeed: AirData | None = None
    height: AirData | None = None


@dataclass(frozen=True)
class Guided:
    """How a flight came to follow its navigator.

    Attributes:
        source: the navigator: an algorithm, or "aided".
        by_truth: the flight of the same plan by the true motion: what it would have been with a perfect navigator.
        moved: how far each pass moved the path, or the last trial of each section, m.
        left: how far the path is from that of the closed loop, or nearer, m.
        in_sections: whether it was flown section by section, because the passes did not settle.
    """

    source: str
    by_truth: Trajectory
    moved: tuple[float, ...]
    left: float
    in_sections: bool = False


class Navigator:
    """The navigator's view of a flight in progress: the true state at its last solution, with that solution's errors.

    A flight of the autopilot's rate without latency has a solution at every step; otherwise the true state at the
    instant of a solution lies between two steps, and is interpolated linearly.
    """

    def __init__(self, errors: SolutionErrors, interval: float) -> None:
        """Begin at the start of a flight that is steered once in an `interval`, s."""
        guidance = errors.guidance
        self._rate, self._latency, self._interval = guidance.rate_hz, guidance.latency_s, interval
        seen = {column for name in guidance.quantities for column in _COLUMNS[name]}
        self._seen = tuple(column in seen for column in range(12))
        self._sees_all = all(self._seen)
        self._airspeed, self._height = _LastReading(), _LastReading()
        self.believe(errors)
        self._past: deque[tuple[float, tuple[float, ...]]] = deque(
            maxlen=2 + floor((guidance.latency_s + 1.0 / guidance.rate_hz) / interval + 1e-6)
        )
        self._then: tuple[float, ...] = ()
        self._row: tuple[float, ...] = ()
        self._slow = (0.0, 0.0, 0.0, 0.0)

    def believe(self, errors: SolutionErrors) -> None:
        """Go on with the errors of another pass, of the same guidance."""
        self._errors, self._number = np.where(self._seen, errors.values, 0.0), -1
        self._airspeed.believe(errors.airspeed)
        self._height.believe(errors.height)

    def fast(self, m: AircraftState, latitude: float, longitude: float, track: float, speed: float) -> None:
        """Replace what is refreshed at every step of the true state in `m`, whose other values are given."""
        if self._height.there:
            m.height = self._height.seen(m.time, m.height)
        if self._airspeed.there:
            airspeed = self._airspeed.seen(m.time, m.tas)
            if m.tas > 0.0:
                m.cas, m.tas = m.cas * (airspeed / m.tas), airspeed
        now = (latitude, longitude, m.height, speed * cos(track), speed * sin(track), -m.climb,
               m.phi, m.theta, m.psi, m.p, m.q, m.r)  # fmt: skip
        self._past.append((m.time, now))
        number = max(floor((m.time - self._latency) * self._rate + 1e-6), 0)
        if number != self._number:
            self._number, self._then = number, self._at(number / self._rate)
            self._row = tuple(self._errors[min(number, len(self._errors) - 1)].tolist())
        then = self._then
        if not self._sees_all:
            then = tuple(a if is_seen else b for is_seen, a, b in zip(self._seen, then, now, strict=True))
        (latitude, longitude, m.height, north, east, down,
         phi, m.theta, psi, m.p, m.q, m.r) = map(add, then, self._row)  # fmt: skip
        m.climb, m.phi, m.psi = -down, remainder(phi, tau), psi % tau
        self._slow = latitude, longitude, north, east

    def slow(self, m: AircraftState) -> None:
        """Replace what is refreshed at every third step."""
        m.latitude, m.longitude, north, east = self._slow
        m.track, m.ground_speed = atan2(east, north) % tau, hypot(north, east)

    def _at(self, time: float) -> tuple[float, ...]:
        """Return the true state at an instant that is not over."""
        last = self._past[-1]
        if time >= last[0] - 1e-9:
            return last[1]
        before = self._past[0]
        for after in self._past:
            if after[0] >= time - 1e-6:
                break
            before = after
        part = 0.0 if after[0] <= before[0] else (time - before[0]) / (after[0] - before[0])
        if part >= 1.0 - 1e-6:
            return after[1]
        if part <= 1e-6:
            return before[1]
        return tuple(
            a + part * (remainder(b - a, tau) if c in _ANGLES else b - a)
            for c, (a, b) in enumerate(zip(before[1], after[1], strict=True))
        )


class _LastReading:
    """The last reading that has arrived: the true value at its instant with its error."""

    def __init__(self) -> None:
        self._before = (0.0, 0.0)  # the step before: its time and the true value
        self._late: deque[tuple[float, float]] = deque()  # arrival and value
        self._seen: float | None = None

    def believe(self, of: AirData | None) -> None:
        """Go on with the readings of another pass."""
        self.there = of is not None
        if of is not None:
            rows = slice(np.searchsorted(of.time, self._before[0] + 1e-6, side="right"), None)
            self._next = deque(np.column_stack([of.time, of.arrival, of.errors])[rows].tolist())

    def seen(self, time: float, true: float) -> float:
        """Return what is seen at a step, whose true value is given: that until the first reading."""
        before, value = self._before
        while self._next and self._next[0][0] <= time + 1e-6:
            instant, arrival, error = self._next.popleft()
            self._late.append((arrival, true - (time - instant) / (time - before) * (true - value) + error))
        while self._late and self._late[0][0] <= time + 1e-6:
            self._seen = self._late.popleft()[1]
        self._before = time, true
        return true if self._seen is None else self._seen


def finite_rows(values: Array) -> Array:
    """Return errors with what is not finite replaced by the last finite row before it, zero at the start."""
    numbers = np.where(np.isfinite(values).all(axis=1), np.arange(len(values)), -1)
    last = np.maximum.accumulate(numbers)
    return np.where(last[:, None] >= 0, values[last], 0.0)
