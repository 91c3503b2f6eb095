"""The leg "hold": straight and level."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Keys, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import HALF_STEP, LegBase, LegError, wait


class HoldLeg(LegBase):
    """Straight and level flight with constant heading, height and airspeed, for a duration or until a given time.

    Attributes:
        duration_s: duration, s.
        until_s: time since the start of the flight at which the leg ends, s.
    """

    example: ClassVar[dict[str, Any]] = {"duration_s": 600.0}
    exactly_one = (Keys(("duration_s", "until_s"), "a hold ends after duration_s or at until_s (flight time)"),)

    type: Literal["hold"]
    duration_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="how long")
    until_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="flight time at the end of the leg")
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s; see `LegBase.reckon`."""
        return plan.straight(self.duration_s or max(0.0, (self.until_s or 0.0) - plan.elapsed))

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Hold the current heading, height and airspeed; see `LegBase.fly`."""
        if self.until_s is not None:
            if state.time > self.until_s + HALF_STEP:
                raise LegError(
                    f"it must end at {self.until_s:g} s of the flight, but begins later",
                    "a later until_s, or shorter legs before it",
                )
            yield from wait(state, self.until_s)
        elif self.duration_s is not None:
            yield from wait(state, state.time + self.duration_s)
