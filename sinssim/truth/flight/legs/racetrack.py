"""The leg "racetrack": two straight legs joined by two half circles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import pi
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Keys, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Bank, Direction, LegBase, wait
from sinssim.truth.flight.legs.turn import turn_by
from sinssim.units import DEG


class RacetrackLeg(LegBase):
    """Two straight legs joined by two half circles, flown a given number of times; the first leg is straight ahead.

    Attributes:
        leg_duration_s: duration of a straight leg, s.
        leg_length_m: length of a straight leg over the ground, m.
        direction: direction of the turns.
        bank_deg: angle of bank, degrees; None: the aircraft's usual angle.
        laps: number of laps.
    """

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
        """Return the duration of all laps, s; see `LegBase.reckon`."""
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
