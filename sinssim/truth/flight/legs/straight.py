"""The legs of straight flight: "hold", "climb" and "descend" to another height, "speed" for a change of airspeed."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.toml_section import Keys, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.leg import HALF_STEP, Airspeed, Altitude, DeadReckoning, LegBase, LegError, wait
from sinssim.units import KNOT


class HoldLeg(LegBase):
    """Straight and level flight with constant heading, height and airspeed, for a duration or until a given time."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 600.0}
    plans: ClassVar[frozenset[str]] = frozenset({"track", "height"})
    exactly_one = (Keys(("duration_s", "until_s"), "a hold ends after duration_s or at until_s (flight time)"),)

    type: Literal["hold"]
    duration_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="how long")
    until_s: float | None = Field(default=None, gt=0.0, le=86_400.0, description="flight time at the end of the leg")
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
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


_STOP = 0.8  # share of the largest vertical acceleration that a climb or descent takes to stop at its height


class AltitudeLeg(LegBase):
    """Climb or descend to a height at constant airspeed."""

    example: ClassVar[dict[str, Any]] = {"altitude_m": 3000.0}
    plans: ClassVar[frozenset[str]] = frozenset({"track"})

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


class SpeedLeg(LegBase):
    """Accelerate or decelerate to an airspeed in straight and level flight."""

    example: ClassVar[dict[str, Any]] = {"airspeed_kt": 250.0}
    plans: ClassVar[frozenset[str]] = frozenset({"track", "height"})
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
        pilot.airspeed = self.airspeed_kt * KNOT
        while abs(state.cas - pilot.airspeed) > 0.5:
            yield
