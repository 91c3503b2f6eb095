"""The leg "speed": a change of airspeed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Airspeed, LegBase
from sinssim.units import KNOT


class SpeedLeg(LegBase):
    """Accelerate or decelerate to an airspeed in straight and level flight.

    Attributes:
        airspeed_kt: target calibrated airspeed, kt.
    """

    example: ClassVar[dict[str, Any]] = {"airspeed_kt": 250.0}
    holds: ClassVar[frozenset[str]] = frozenset({"airspeed", "heading"})

    type: Literal["speed"]
    airspeed_kt: Airspeed = Field(description="target calibrated airspeed")
    timeout_s: Timeout = Field(default=600.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, at the aircraft's usual acceleration; see `LegBase.reckon`."""
        before, plan.airspeed = plan.airspeed, self.airspeed_kt * KNOT
        after = plan.airspeed
        seconds = abs(after - before) / plan.performance.acceleration_mps2
        return plan.straight(seconds, 0.5 * (before + after) / after)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Set the airspeed; see `LegBase.fly`."""
        pilot.airspeed = self.airspeed_kt * KNOT
        while abs(state.cas - pilot.airspeed) > 0.5:
            yield
