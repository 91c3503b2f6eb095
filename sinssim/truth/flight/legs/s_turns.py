"""The leg "s_turns": swings of the heading to both sides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import pi, remainder
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Keys, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, AircraftState, Autopilot, G
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import HALF_STEP, Bank, Direction, LegBase
from sinssim.units import DEG


class STurnsLeg(LegBase):
    """S-turns about the current heading: to one side, to the other side, and back; useful for alignment in motion.

    Attributes:
        swing_deg: heading swing to each side, degrees.
        bank_deg: angle of bank, degrees; None: the aircraft's usual angle.
        turns: number of swings.
        duration_s: duration of the swings, s.
        first: side of the first swing.
    """

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
