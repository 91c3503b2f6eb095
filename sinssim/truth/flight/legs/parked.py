"""The leg "parked": at rest on the runway."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import LegBase, wait


class ParkedLeg(LegBase):
    """At rest on the runway, brakes set.

    Attributes:
        duration_s: duration, s.
    """

    example: ClassVar[dict[str, Any]] = {"duration_s": 600.0}
    begins: ClassVar[Literal["runway", "air"]] = "runway"
    ends: ClassVar[Literal["runway", "air"]] = "runway"
    stands_still: ClassVar[bool] = True

    type: Literal["parked"]
    duration_s: float = Field(gt=0.0, le=86_400.0, description="duration of the stop")
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s; see `LegBase.reckon`."""
        return self.duration_s

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Hold the brakes; see `LegBase.fly`."""
        pilot.brakes = 1.0
        yield from wait(state, state.time + self.duration_s)
