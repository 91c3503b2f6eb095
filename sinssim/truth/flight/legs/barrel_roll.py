"""The leg "barrel_roll": a full roll around a helix."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import asin, pi
from typing import ClassVar, Literal

from pydantic import Field

from sinssim.section import Moment, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, LOAD_FACTOR, ROLL_RATE, AircraftState, Autopilot, G
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Direction, LegBase, wait


class BarrelRollLeg(LegBase):
    """A full roll around a helix with positive load factor that ends in level flight.

    Attributes:
        direction: direction of the roll.
        duration_s: duration of the roll itself, s.
        load_factor_g: constant load factor of the roll, g.
        recovery_s: level flight afterwards, s.
    """

    holds: ClassVar[frozenset[str]] = frozenset()

    type: Literal["barrel_roll"]
    direction: Direction = Field(default="right", description="direction of the roll")
    duration_s: float = Field(default=8.0, ge=3.0, le=20.0, description="duration of the roll")
    load_factor_g: float = Field(default=1.5, ge=0.5, le=4.0, description="constant load factor of the roll")
    recovery_s: Moment = Field(default=10.0, description="level flight afterwards")
    timeout_s: Timeout = Field(default=120.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, of the roll and the recovery; see `LegBase.reckon`."""
        plan.turning += (2.0 * math.pi) ** 2 / self.duration_s
        return plan.straight(self.duration_s + self.recovery_s)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Pull up, roll once round at a steady rate, return to level flight; see `LegBase.fly`."""
        heading = pilot.heading
        side = 1.0 if self.direction == "right" else -1.0
        rate = 2.0 * pi / self.duration_s
        # The lift turns through a full circle and cancels, so gravity bends the path by gT/V; half of it is added
        # upwards before.
        path = 0.5 * G * self.duration_s / state.tas
        pilot.vertical = LOAD_FACTOR
        while asin(max(-1.0, min(1.0, state.climb / max(state.tas, 20.0)))) < path:
            pilot.load_factor = 1.0 + self.load_factor_g
            yield
        pilot.lateral, pilot.roll_rate = ROLL_RATE, side * rate
        rolled = 0.0
        while rolled < 2.0 * pi - rate / pilot.bank_rate:
            pilot.load_factor = self.load_factor_g
            yield
            rolled += side * state.p * INTERVAL
        pilot.resume(state)
        pilot.heading = heading
        yield from wait(state, state.time + self.recovery_s)
