"""The leg "taxi": a way over the ground on a heading."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Heading
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.ground import IDLING_S, Rolling, on_wheels, start_engines, turn_onto
from sinssim.truth.flight.leg import LegBase, LegError
from sinssim.units import DEG

_ACCELERATION = 0.5  # change of speed in dead reckoning [m/s²]
_AT_THE_END = 10.0 * DEG  # largest error of the heading at the end of the way [rad]


class TaxiLeg(LegBase):
    """Roll over a distance on the ground: first turn onto a heading, then straight ahead. Engines that are off are
    started first. The aircraft still rolls at the end; `park` stops it.

    Attributes:
        distance_m: way over the ground including the turn, m.
        heading_deg: heading to turn onto, degrees; None: straight ahead.
        speed_mps: ground speed, m/s; None: the aircraft's usual one.
        radius_m: radius of the turn, m.
    """

    example: ClassVar[dict[str, Any]] = {"distance_m": 500.0}
    begins: ClassVar[Literal["runway", "air"]] = "runway"
    ends: ClassVar[Literal["runway", "air"]] = "runway"

    type: Literal["taxi"]
    distance_m: float = Field(gt=0.0, le=50_000.0, description="distance over the ground, including the turn")
    heading_deg: Heading | None = Field(default=None, description="target heading; default: straight ahead")
    speed_mps: float | None = Field(
        default=None, ge=1.0, le=20.0, description="ground speed; default: the usual speed of the aircraft"
    )
    radius_m: float = Field(default=40.0, ge=10.0, le=1000.0, description="radius of the turn")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: the start of the engines, and the way at the speed; see `LegBase.reckon`."""
        starting, plan.engines = 0.0 if plan.engines else plan.performance.engine_start_s + IDLING_S, True
        speed = self.speed_mps or plan.performance.taxi_mps
        before, plan.airspeed = plan.airspeed, speed
        change = speed - before  # on the way to a lower speed it is faster
        seconds = self.distance_m / speed + 0.5 * change * abs(change) / (_ACCELERATION * speed)
        turn = 0.0
        if self.heading_deg is not None:
            turn = math.remainder(self.heading_deg * DEG - plan.heading, 2.0 * math.pi)
        arc = abs(turn) * self.radius_m
        plan.turning += abs(turn) * speed / self.radius_m
        chord = self.radius_m * 2.0 * math.sin(0.5 * abs(turn))
        plan.move(chord * math.cos(plan.heading + 0.5 * turn), chord * math.sin(plan.heading + 0.5 * turn))
        plan.heading = (plan.heading + turn) % (2.0 * math.pi)
        plan.ahead(max(0.0, self.distance_m - arc))
        return starting + seconds

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Start the engines, roll and turn; see `LegBase.fly`."""
        yield from start_engines(pilot, state)
        on_wheels(pilot, state)
        heading = pilot.heading if self.heading_deg is None else self.heading_deg * DEG
        speed = self.speed_mps or performance.taxi_mps
        rolling = Rolling(pilot, state)
        limit = state.time + 60.0 + 3.0 * self.distance_m / speed
        while rolling.way < self.distance_m:
            rolling.step(speed)
            turn_onto(pilot, state, heading, self.radius_m)
            if state.time > limit:
                raise LegError(
                    f"after {rolling.way:.0f} m of distance_m = {self.distance_m:g} it has taken three times as long "
                    f"as at {speed:g} m/s",
                    "a weaker wind, or an aircraft whose engines move it",
                )
            yield
        left = math.remainder(heading - state.psi, 2.0 * math.pi)
        if abs(left) > _AT_THE_END:
            raise LegError(
                f"the turn is not finished at the end of distance_m = {self.distance_m:g}: "
                f"{abs(left) / DEG:.0f}° are left",
                "a longer distance_m, or a smaller radius_m",
            )
