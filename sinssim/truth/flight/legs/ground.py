"""The legs on the ground, "take_off", "taxi" and "park", and their elements: engines, speed, turn onto a heading."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import pi, remainder
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.toml_section import Heading, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, INTERVAL, PITCH, AircraftState, Autopilot
from sinssim.truth.flight.leg import GRAVITY, DeadReckoning, LegBase, LegError, wait
from sinssim.units import DEG, KNOT

STILL_SPEED = 1e-5
"""Speed below which an aircraft with its brakes set is held still [m/s]."""
STILL_RATE = 1e-5
"""Angular rate below which it is held still [rad/s]."""

START_LIMIT_S = 90.0
"""Time within which the engines must start [s]."""
IDLING_S = 10.0
"""Time at idle after the start, until the gear has come to rest [s]."""

_SPEED_CHANGE = 0.5  # change of the reference of the ground speed [m/s²]
_THROTTLE, _INTEGRAL = 0.08, 0.02  # ground-speed error to throttle [s/m], and its integral [1/m]
_MOST_THROTTLE = 0.5
_HOLD = 0.05  # growth of the brakes' setting until the aircraft stops [1/s]
_BRAKE, _SLACK = 0.15, 0.3  # excess of the ground speed to brakes [s/m], beyond a slack [m/s]


def on_wheels(pilot: Autopilot, state: AircraftState) -> None:
    """Set the autopilot for rolling: surfaces neutral, the nose wheel steers to the heading."""
    pilot.steering = True
    pilot.heading = state.psi
    pilot.lateral, pilot.bank = BANK, 0.0
    pilot.fixed_elevator = pilot.fixed_aileron = 0.0
    pilot.fixed_throttle = 0.0


def _run(state: AircraftState) -> bool:
    return state.engines_running


def start_engines(pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Start the engines if they are off, with the brakes set."""
    if _run(state):
        pilot.engines = True
        return
    pilot.engines, pilot.brakes, pilot.standing = True, 1.0, False
    on_wheels(pilot, state)
    limit = state.time + START_LIMIT_S
    while not _run(state):
        if state.time > limit:
            raise LegError(
                f"the engines do not start within {START_LIMIT_S:g} s",
                'an aircraft whose model has engines that start, or engines = "running" at the start',
            )
        yield
    until = state.time + IDLING_S
    while state.time < until:
        yield


class Rolling:
    """Holds a ground speed by throttle and brakes, and measures the way over the ground, m."""

    def __init__(self, pilot: Autopilot, state: AircraftState) -> None:
        self._pilot, self._state = pilot, state
        self._reference, self._integral = state.ground_speed, pilot.throttle
        self._held = 0.0
        self.way = 0.0

    def step(self, speed: float) -> None:
        """Set throttle and brakes for the next interval towards a ground speed, m/s."""
        pilot, state = self._pilot, self._state
        self.way += state.ground_speed * INTERVAL
        most = _SPEED_CHANGE * INTERVAL
        self._reference += max(-most, min(most, speed - self._reference))
        error = self._reference - state.ground_speed
        throttle = self._integral + _THROTTLE * error
        if 0.0 < throttle < _MOST_THROTTLE or (throttle <= 0.0) == (error > 0.0):
            self._integral += _INTEGRAL * error * INTERVAL
        pilot.fixed_throttle = max(0.0, min(_MOST_THROTTLE, throttle))
        self._held = self._held + _HOLD * INTERVAL if self._reference == 0.0 else 0.0  # against the idle thrust
        pilot.brakes = max(0.0, min(1.0, _BRAKE * (-error - _SLACK) + self._held))


def turn_onto(pilot: Autopilot, state: AircraftState, heading: float, radius: float) -> None:
    """Turn the heading to steer towards a heading, rad, as far as a turn of a radius, m, goes in a step."""
    left = remainder(heading - pilot.heading, 2.0 * pi)
    most = state.ground_speed / radius * INTERVAL
    pilot.heading += max(-most, min(most, left))


def come_to_rest(pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Brake to a standstill, until the gear has come to rest."""
    rolling = Rolling(pilot, state)
    limit = state.time + 60.0 + 2.0 * state.ground_speed / _SPEED_CHANGE
    while state.ground_speed > 0.3:
        rolling.step(0.0)
        if state.time > limit:
            raise LegError(
                f"the aircraft does not stop: it still rolls at {state.ground_speed:.2f} m/s",
                "a slower leg before it, or a weaker wind",
            )
        yield
    pilot.fixed_throttle, pilot.brakes = 0.0, 1.0
    pilot.heading = state.psi
    limit = state.time + 120.0
    while state.ground_speed > STILL_SPEED or max(abs(state.p), abs(state.q), abs(state.r)) > STILL_RATE:
        if state.time > limit:
            raise LegError(
                f"the aircraft does not come to rest with its brakes set: it moves at {state.ground_speed:.2g} m/s and "
                f"turns at {max(abs(state.p), abs(state.q), abs(state.r)) / DEG:.2g} °/s",
                "a weaker wind, or no gusts while it is parked",
            )
        yield


_TAXI_ACCELERATION = 0.5  # change of speed in dead reckoning [m/s²]
_AT_THE_END = 10.0 * DEG  # largest error of the heading at the end of the way [rad]


class TaxiLeg(LegBase):
    """Roll over a distance on the ground: first turn onto a heading, then straight ahead. Engines that are off are
    started first. The aircraft still rolls at the end; `park` stops it."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 500.0}
    begins: ClassVar[Literal["runway", "air"]] = "runway"
    ends: ClassVar[Literal["runway", "air"]] = "runway"

    type: Literal["taxi"]
    distance_m: float = Field(gt=0.0, le=50_000.0, description="distance over the ground, including the turn")
    heading_deg: Heading | None = Field(default=None, description="target heading; default: straight ahead")
    speed_mps: float | None = Field(
        default=None, ge=1.0, le=20.0, description="ground speed; default: the usual speed of the aircraft"
    )
    radius_m: float = Field(default=40.0, ge=10.0, le=1000.0, description="radius of the turn")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: the start of the engines, and the way at the speed; see `LegBase.reckon`."""
        starting, plan.engines = 0.0 if plan.engines else plan.performance.engine_start_s + IDLING_S, True
        speed = self.speed_mps or plan.performance.taxi_mps
        before, plan.airspeed = plan.airspeed, speed
        change = speed - before  # on the way to a lower speed it is faster
        seconds = self.distance_m / speed + 0.5 * change * abs(change) / (_TAXI_ACCELERATION * speed)
        turn = 0.0
        if self.heading_deg is not None:
            turn = math.remainder(self.heading_deg * DEG - plan.heading, 2.0 * math.pi)
        arc = abs(turn) * self.radius_m
        plan.turning += abs(turn) * speed / self.radius_m
        chord = self.radius_m * 2.0 * math.sin(0.5 * abs(turn))
        plan.move(chord * math.cos(plan.heading + 0.5 * turn), chord * math.sin(plan.heading + 0.5 * turn))
        plan.heading = (plan.heading + turn) % (2.0 * math.pi)
        plan.ahead(max(0.0, self.distance_m - arc))
        return starting + seconds

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Start the engines, roll and turn; see `LegBase.fly`."""
        yield from start_engines(pilot, state)
        on_wheels(pilot, state)
        heading = pilot.heading if self.heading_deg is None else self.heading_deg * DEG
        speed = self.speed_mps or performance.taxi_mps
        rolling = Rolling(pilot, state)
        limit = state.time + 60.0 + 3.0 * self.distance_m / speed
        while rolling.way < self.distance_m:
            rolling.step(speed)
            turn_onto(pilot, state, heading, self.radius_m)
            if state.time > limit:
                raise LegError(
                    f"after {rolling.way:.0f} m of distance_m = {self.distance_m:g} it has taken three times as long "
                    f"as at {speed:g} m/s",
                    "a weaker wind, or an aircraft whose engines move it",
                )
            yield
        left = math.remainder(heading - state.psi, 2.0 * math.pi)
        if abs(left) > _AT_THE_END:
            raise LegError(
                f"the turn is not finished at the end of distance_m = {self.distance_m:g}: "
                f"{abs(left) / DEG:.0f}° are left",
                "a longer distance_m, or a smaller radius_m",
            )


_TO_MOVE_S, _MOVING = 30.0, 5.0  # time within which the aircraft must move [s], and at least so fast [m/s]
_ROLL = 0.25 * GRAVITY  # acceleration of the take-off run in dead reckoning [m/s²]


class TakeoffLeg(LegBase):
    """From the runway to a height above it, straight ahead; starts the engines first if they are off."""

    begins: ClassVar[Literal["runway", "air"]] = "runway"

    type: Literal["takeoff", "take_off"]
    height_m: float = Field(default=300.0, ge=50.0, le=3000.0, description="target height above the runway")
    runway_m: float | None = Field(
        default=None, ge=100.0, le=10_000.0, description="length of the runway ahead; default: as long as needed"
    )
    timeout_s: Timeout = Field(default=300.0, description="the leg fails if it takes longer")

    def end_height(self, height: float) -> float:
        """Return the runway's height plus `height_m`, m; see `LegBase.end_height`."""
        return height + self.height_m

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: a run at constant acceleration and a steady climb; see `LegBase.reckon`."""
        starting, plan.engines = 0.0 if plan.engines else plan.performance.engine_start_s + IDLING_S, True
        plan.airspeed = plan.performance.initial_climb_kt * KNOT
        run = plan.airspeed / _ROLL
        plan.ahead(0.5 * plan.airspeed * run)
        return starting + run + plan.climb(plan.altitude + self.height_m, plan.performance.climb_mps)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Accelerate, rotate, retract the gear, climb; see `LegBase.fly`."""
        yield from start_engines(pilot, state)
        runway = state.height
        pilot.brakes, pilot.steering, pilot.flaps = 0.0, True, performance.takeoff_flaps
        pilot.lateral, pilot.bank = BANK, 0.0
        pilot.heading = state.psi
        pilot.fixed_elevator, pilot.fixed_aileron, pilot.fixed_throttle = 0.0, 0.0, performance.takeoff_throttle
        run, limit = 0.0, state.time + _TO_MOVE_S
        while state.cas < performance.takeoff_kt * KNOT:
            run += state.ground_speed * INTERVAL
            if self.runway_m is not None and run > self.runway_m:
                raise LegError(
                    f"the aircraft does not take off: after runway_m = {self.runway_m:g} m it has "
                    f"{state.cas / KNOT:.0f} kt, but its rotation speed is {performance.takeoff_kt:g} kt",
                    "a longer runway, or an aircraft that needs a shorter one",
                )
            if state.time > limit and state.ground_speed < _MOVING:
                raise LegError(
                    f"the aircraft does not take off: after {_TO_MOVE_S:g} s of take-off thrust it has only "
                    f"{state.ground_speed:.1f} m/s",
                    "an aircraft whose engines move it",
                )
            yield
        pilot.fixed_elevator = pilot.fixed_aileron = None
        pilot.vertical, pilot.pitch = PITCH, performance.takeoff_pitch_deg * DEG
        while state.height < runway + 12.0:
            yield
        pilot.steering = False
        pilot.gear = 0.0 if performance.retractable_gear else 1.0
        pilot.vertical = PITCH
        pilot.lateral = HEADING
        low, slow = runway + min(60.0, 0.5 * self.height_m), performance.initial_climb_kt * KNOT
        while state.height < low and state.cas < slow:
            yield
        pilot.resume(state)
        pilot.height, pilot.airspeed = runway + self.height_m, performance.initial_climb_kt * KNOT
        pilot.flaps = 0.0
        while state.height < pilot.height - 3.0:
            yield


_STOPPING = 0.5  # deceleration to a standstill in dead reckoning [m/s²]
_SETTLING_S = 10.0  # time until the gear has come to rest, in dead reckoning [s]
_STOPPED_S = 30.0  # time in which the thrust of stopped engines decays [s]
_SHUT_DOWN_S = 90.0  # time in which the engines stop, and the aircraft comes to rest again [s]


class ParkedLeg(LegBase):
    """At rest on the ground with the brakes set. A rolling aircraft first brakes to a standstill."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 600.0}
    begins: ClassVar[Literal["runway", "air"]] = "runway"
    ends: ClassVar[Literal["runway", "air"]] = "runway"
    stands_still: ClassVar[bool] = True

    type: Literal["parked", "park"]
    duration_s: float = Field(gt=0.0, le=86_400.0, description="duration of the stop, counted from the standstill")
    engines: Literal["running", "off"] | None = Field(
        default=None, description="engines during the stop; default: unchanged"
    )
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, with the time to stop and to switch the engines; see `LegBase.reckon`."""
        stopping, plan.airspeed = plan.airspeed / _STOPPING, 0.0
        plan.ahead(0.5 * _STOPPING * stopping**2)
        switching = 0.0
        if self.engines is not None and (self.engines == "running") != plan.engines:
            plan.engines = self.engines == "running"
            switching = plan.performance.engine_start_s if plan.engines else _STOPPED_S
        stopping += _SETTLING_S if stopping else 0.0
        return stopping + switching + self.duration_s

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Stop, switch the engines, and hold the brakes; see `LegBase.fly`."""
        if not pilot.standing:
            on_wheels(pilot, state)
            yield from come_to_rest(pilot, state)
        if self.engines == "running" and not state.engines_running:
            yield from start_engines(pilot, state)
            yield from come_to_rest(pilot, state)
        elif self.engines == "off" and pilot.engines:
            pilot.engines, pilot.standing = False, False
            limit = state.time + _SHUT_DOWN_S
            while state.engines_running:
                if state.time > limit:
                    raise LegError("the engines do not stop", 'engines = "running"')
                yield
            yield from wait(state, state.time + _STOPPED_S)
            yield from come_to_rest(pilot, state)
        pilot.brakes, pilot.standing = 1.0, True
        yield from wait(state, state.time + self.duration_s)
