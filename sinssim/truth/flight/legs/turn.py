"""The leg "turn": a level turn to a heading or by an angle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import pi, remainder
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from sinssim.section import Heading, Keys
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Bank, Direction, LegBase
from sinssim.units import DEG

_SAME = 1e-9  # difference by which headings are the same, so that rounding does not order a full circle [rad]


class TurnLeg(LegBase):
    """Level turn to a heading or by an angle.

    Attributes:
        heading_deg: target heading, degrees.
        angle_deg: angle of the turn, degrees; more than 360 is more than a circle.
        direction: direction of the turn; None: the shorter way (only with heading_deg).
        bank_deg: angle of bank, degrees; None: the aircraft's usual angle.
    """

    example: ClassVar[dict[str, Any]] = {"heading_deg": 90.0}
    exactly_one = (Keys(("heading_deg", "angle_deg"), "a turn needs heading_deg or angle_deg"),)

    type: Literal["turn"]
    heading_deg: Heading | None = Field(default=None, description="target heading")
    angle_deg: float | None = Field(default=None, gt=0.0, le=36_000.0, description="angle of the turn")
    direction: Direction | None = Field(default=None, description="left or right; default: the shorter direction")
    bank_deg: Bank | None = Field(default=None, description="angle of bank; default: the aircraft's usual angle")

    @model_validator(mode="after")
    def _has_a_side(self) -> Self:
        if self.angle_deg is not None and self.direction is None:
            raise ValueError('a turn by angle_deg needs direction = "left" or "right"')
        return self

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, of a steady turn; see `LegBase.reckon`."""
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
        """Turn by the angle to the target; see `LegBase.fly`."""
        bank = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        if self.angle_deg is not None:
            angle = self.angle_deg * DEG if self.direction == "right" else -self.angle_deg * DEG
        else:
            angle = self._angle_from(pilot.heading)
        yield from turn_by(angle, bank, pilot, state)


def turn_by(angle: float, bank: float, pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Turn by an angle; the heading held afterwards differs by exactly that angle from the previous one.

    Args:
        angle: right positive, rad.
        bank: angle of bank, rad.
        state: the aircraft's state.

    Yields:
        None, once per step.
    """
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
