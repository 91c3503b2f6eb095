"""The leg "takeoff": from rest on the runway to a height above it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from sinssim.section import Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, PITCH, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import GRAVITY, DeadReckoning
from sinssim.truth.flight.leg import LegBase
from sinssim.units import DEG, KNOT

_ROLL = 0.25 * GRAVITY  # acceleration of the take-off run in dead reckoning [m/s²]


class TakeoffLeg(LegBase):
    """From rest on the runway to a height above it, straight ahead.

    Attributes:
        height_m: height above the runway at which the leg ends, m.
    """

    begins: ClassVar[Literal["runway", "air"]] = "runway"

    type: Literal["takeoff"]
    height_m: float = Field(default=300.0, ge=50.0, le=3000.0, description="height above the runway to reach")
    timeout_s: Timeout = Field(default=300.0, description="the leg fails if it takes longer")

    def end_height(self, height: float) -> float:
        """Return the runway's height plus `height_m`, m; see `LegBase.end_height`."""
        return height + self.height_m

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: a run at constant acceleration and a steady climb; see `LegBase.reckon`."""
        plan.airspeed = plan.performance.initial_climb_kt * KNOT
        run = plan.airspeed / _ROLL
        plan.ahead(0.5 * plan.airspeed * run)
        return run + plan.climb(plan.altitude + self.height_m, plan.performance.climb_mps)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Accelerate, rotate, retract the gear, climb; see `LegBase.fly`."""
        runway = state.height
        pilot.brakes, pilot.steering, pilot.flaps = 0.0, True, performance.takeoff_flaps
        pilot.lateral, pilot.bank = BANK, 0.0
        pilot.heading = state.psi
        pilot.fixed_elevator, pilot.fixed_aileron, pilot.fixed_throttle = 0.0, 0.0, performance.takeoff_throttle
        while state.cas < performance.takeoff_kt * KNOT:
            yield
        pilot.fixed_elevator = pilot.fixed_aileron = None
        pilot.vertical, pilot.pitch = PITCH, performance.takeoff_pitch_deg * DEG
        while state.height < runway + 12.0:
            yield
        pilot.steering = False
        pilot.gear = 0.0 if performance.retractable_gear else 1.0
        pilot.vertical = PITCH
        pilot.lateral = HEADING
        low, slow = runway + min(60.0, 0.5 * self.height_m), performance.initial_climb_kt * KNOT
        while state.height < low and state.cas < slow:
            yield
        pilot.resume(state)
        pilot.height, pilot.airspeed = runway + self.height_m, performance.initial_climb_kt * KNOT
        pilot.flaps = 0.0
        while state.height < pilot.height - 3.0:
            yield
