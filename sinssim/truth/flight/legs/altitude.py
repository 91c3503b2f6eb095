"""The legs "climb" and "descend", to another height."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import Altitude, LegBase

_STOP = 0.8  # share of the largest vertical acceleration that a climb or descent takes to stop at its height


class AltitudeLeg(LegBase):
    """Climb or descend to a height at constant airspeed.

    Attributes:
        altitude_m: target height above the ellipsoid, m.
        vertical_speed_mps: rate of climb or descent, without sign, m/s; None: the aircraft's usual rate.
    """

    example: ClassVar[dict[str, Any]] = {"altitude_m": 3000.0}

    type: Literal["climb", "descend"]
    altitude_m: Altitude = Field(description="target height above the ellipsoid")
    vertical_speed_mps: float | None = Field(
        default=None,
        gt=0.0,
        le=150.0,
        description="rate of climb or descent, positive; default: the aircraft's usual rate",
    )

    def end_height(self, height: float) -> float:
        """Return `altitude_m`; refuse a climb that goes down and a descent that goes up; see `LegBase.end_height`."""
        up = self.altitude_m - height
        if (up < 0.0) if self.type == "climb" else (up > 0.0):
            raise ValueError(
                f"goes {'down' if up < 0.0 else 'up'}, from {height:g} m to altitude_m = {self.altitude_m:g}: give the"
                f' height to reach, or type = "{"descend" if up < 0.0 else "climb"}"'
            )
        return self.altitude_m

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, at a steady vertical speed; see `LegBase.reckon`."""
        change = self.altitude_m - plan.altitude
        usual = plan.performance.climb_mps if change > 0.0 else plan.performance.descent_mps
        return plan.climb(self.altitude_m, self.vertical_speed_mps or usual)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Set the height and the limits of the vertical speed; see `LegBase.fly`."""
        pilot.height = self.altitude_m
        climb = self.vertical_speed_mps or pilot.usual_climb
        descent = self.vertical_speed_mps or pilot.usual_descent
        while (left := abs(state.height - pilot.height)) > 3.0:
            # A faster vertical speed than the usual one decreases in time to stop at the height: v² = 2 a Δh.
            stop = sqrt(2.0 * _STOP * pilot.vertical_acceleration * left)
            pilot.climb_limit = min(climb, max(pilot.usual_climb, stop))
            pilot.descent_limit = min(descent, max(pilot.usual_descent, stop))
            yield
        pilot.climb_limit, pilot.descent_limit = pilot.usual_climb, pilot.usual_descent
