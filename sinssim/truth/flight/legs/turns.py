"""The legs with level turns: "turn" to a heading or by an angle, "racetrack", and "s_turns" to both sides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import pi, remainder
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.toml_section import Heading, Keys, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, INTERVAL, AircraftState, Autopilot, G
from sinssim.truth.flight.leg import HALF_STEP, Bank, DeadReckoning, Direction, LegBase, wait
from sinssim.units import DEG

_SAME = 1e-9  # difference by which headings are the same, so that rounding does not order a full circle [rad]


class TurnLeg(LegBase):
    """Level turn to a heading or by an angle."""

    example: ClassVar[dict[str, Any]] = {"heading_deg": 90.0}
    plans: ClassVar[frozenset[str]] = frozenset({"track", "height"})
    exactly_one = (Keys(("heading_deg", "angle_deg"), "a turn needs heading_deg or angle_deg"),)
    rules = (
        (lambda s: s.angle_deg is not None and s.direction is None,
         'a turn by angle_deg needs direction = "left" or "right"'),
    )  # fmt: skip

    type: Literal["turn"]
    heading_deg: Heading | None = Field(default=None, description="target heading")
    angle_deg: float | None = Field(default=None, gt=0.0, le=36_000.0, description="angle of the turn")
    direction: Direction | None = Field(default=None, description="left or right; default: the shorter direction")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's usual angle")

    def reckon(self, plan: DeadReckoning) -> float:
        if self.angle_deg is not None:
            angle = math.radians(self.angle_deg if self.direction == "right" else -self.angle_deg)
            return plan.turn(angle, self.bank_deg)
        return plan.turn(self._angle_from(plan.heading), self.bank_deg)

    def _angle_from(self, heading: float) -> float:
        """Return the angle to turn by from a heading to `heading_deg`, right positive, rad; 0 for the same heading."""
        assert self.heading_deg is not None  # the schema ensures that it or an angle is given
        angle = remainder(self.heading_deg * DEG - heading, 2.0 * pi)
        if self.direction is None or abs(angle) < _SAME:
            return angle
        return angle % (2.0 * pi) if self.direction == "right" else -(-angle % (2.0 * pi))

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        bank = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        if self.angle_deg is not None:
            angle = self.angle_deg * DEG if self.direction == "right" else -self.angle_deg * DEG
        else:
            angle = self._angle_from(pilot.heading)
        yield from turn_by(angle, bank, pilot, state)


def turn_by(angle: float, bank: float, pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Turn by an angle, right positive, rad; the heading held afterwards differs by exactly that angle from the
    previous one."""
    side = 1.0 if angle > 0.0 else -1.0
    target = pilot.heading + angle
    remaining = angle + remainder(pilot.heading - state.psi, 2.0 * pi)
    last = state.psi
    pilot.bank_limit = bank
    # The bank is held while more than a right angle remains; then the heading loop finishes the turn and rolls out.
    while abs(remaining) > 0.5 * pi:
        pilot.lateral, pilot.bank = BANK, side * bank
        yield
        remaining -= remainder(state.psi - last, 2.0 * pi)
        last = state.psi
    pilot.lateral, pilot.heading = HEADING, target % (2.0 * pi)
    while abs(remainder(pilot.heading - state.psi, 2.0 * pi)) > 0.7 * DEG or abs(state.phi) > 2.0 * DEG:
        yield
    pilot.bank_limit = pilot.usual_bank


class RacetrackLeg(LegBase):
    """Two straight legs joined by two half circles, flown a given number of times; the first leg is straight ahead."""

    example: ClassVar[dict[str, Any]] = {"leg_duration_s": 120.0}
    exactly_one = (Keys(("leg_duration_s", "leg_length_m"), "a racetrack needs leg_duration_s or leg_length_m"),)

    type: Literal["racetrack"]
    leg_duration_s: float | None = Field(default=None, gt=0.0, le=7200.0, description="duration of a straight leg")
    leg_length_m: float | None = Field(default=None, gt=0.0, le=500_000.0, description="length of a straight leg")
    direction: Direction = Field(default="right", description="direction of the turns")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's usual angle")
    laps: int = Field(default=1, ge=1, le=100, description="number of laps")
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        return sum(self._reckon_half_lap(plan) for _ in range(2 * self.laps))

    def _reckon_half_lap(self, plan: DeadReckoning) -> float:
        ground = math.hypot(
            plan.true_airspeed() * math.cos(plan.heading) + plan.wind[0],
            plan.true_airspeed() * math.sin(plan.heading) + plan.wind[1],
        )
        seconds = plan.straight(self.leg_duration_s or (self.leg_length_m or 0.0) / ground)
        return seconds + plan.turn(math.pi if self.direction == "right" else -math.pi, self.bank_deg)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Fly straight legs and half circles in turn; see `LegBase.fly`."""
        bank = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        half_circle = pi if self.direction == "right" else -pi
        for _ in range(2 * self.laps):
            if self.leg_duration_s is not None:
                yield from wait(state, state.time + self.leg_duration_s)
            elif self.leg_length_m is not None:
                flown = 0.0
                while flown < self.leg_length_m:
                    flown += state.ground_speed * INTERVAL
                    yield
            yield from turn_by(half_circle, bank, pilot, state)


class STurnsLeg(LegBase):
    """S-turns about the current heading: to one side, to the other side, and back; useful for alignment in motion."""

    example: ClassVar[dict[str, Any]] = {"turns": 4}
    exactly_one = (Keys(("turns", "duration_s"), "S-turns end after turns or after duration_s"),)

    type: Literal["s_turns"]
    swing_deg: float = Field(default=30.0, gt=0.0, le=120.0, description="heading swing to each side")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's usual angle")
    turns: int | None = Field(default=None, ge=1, le=1000, description="number of swings")
    duration_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="duration of the swings")
    first: Direction = Field(default="right", description="side of the first swing")
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s; see `LegBase.reckon`.

        Each swing goes out and back; on average it advances by sin(swing)/swing of its length.
        """
        swing = math.radians(self.swing_deg)
        one_swing = 2.0 * swing / plan.turn_rate(self.bank_deg)
        turns = self.turns or (self.duration_s or 0.0) / one_swing
        plan.turning += turns * plan.turning_of(2.0 * swing, one_swing, self.bank_deg)
        return plan.straight(self.duration_s or turns * one_swing, math.sin(swing) / swing)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Bank to one side and the other, then return to the heading; see `LegBase.fly`."""
        bank = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        middle = pilot.heading
        side = 1.0 if self.first == "right" else -1.0
        end = state.time + self.duration_s if self.duration_s is not None else None
        turns = 0
        pilot.lateral = BANK
        while turns != self.turns and (end is None or state.time < end - HALF_STEP):
            pilot.bank = side * bank
            # The opposite roll begins early enough for the swing to end near its heading.
            while side * remainder(state.psi - middle, 2.0 * pi) < self.swing_deg * DEG - _lead(state, bank):
                if end is not None and state.time >= end - HALF_STEP:
                    break
                yield
            side = -side
            turns += 1
        pilot.lateral, pilot.heading, pilot.bank_limit = HEADING, middle, bank
        while abs(remainder(middle - state.psi, 2.0 * pi)) > 0.7 * DEG or abs(state.phi) > 2.0 * DEG:
            yield
        pilot.bank_limit = pilot.usual_bank


def _lead(state: AircraftState, bank: float) -> float:
    """Return the approximate heading change while rolling out: turn rate times two seconds [rad]."""
    return 2.0 * G * bank / max(state.tas, 20.0)
