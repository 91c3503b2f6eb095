"""The leg "take_off": from the runway to a height above it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from sinssim.section import Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, INTERVAL, PITCH, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import GRAVITY, DeadReckoning
from sinssim.truth.flight.ground import IDLING_S, start_engines
from sinssim.truth.flight.leg import LegBase, LegError
from sinssim.units import DEG, KNOT

_TO_MOVE_S, _MOVING = 30.0, 5.0  # time within which the aircraft must move [s], and at least so fast [m/s]
_ROLL = 0.25 * GRAVITY  # acceleration of the take-off run in dead reckoning [m/s²]


class TakeoffLeg(LegBase):
    """From the runway to a height above it, straight ahead; starts the engines first if they are off.

    Attributes:
        height_m: height above the runway at which the leg ends, m.
        runway_m: length of the runway left, m; None: as long as needed.
    """

    begins: ClassVar[Literal["runway", "air"]] = "runway"

    type: Literal["takeoff", "take_off"]
    height_m: float = Field(default=300.0, ge=50.0, le=3000.0, description="target height above the runway")
    runway_m: float | None = Field(
        default=None, ge=100.0, le=10_000.0, description="length of the runway ahead; default: as long as needed"
    )
    timeout_s: Timeout = Field(default=300.0, description="the leg fails if it takes longer")

    def end_height(self, height: float) -> float:
        """Return the runway's height plus `height_m`, m; see `LegBase.end_height`."""
        return height + self.height_m

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: a run at constant acceleration and a steady climb; see `LegBase.reckon`."""
        starting, plan.engines = 0.0 if plan.engines else plan.performance.engine_start_s + IDLING_S, True
        plan.airspeed = plan.performance.initial_climb_kt * KNOT
        run = plan.airspeed / _ROLL
        plan.ahead(0.5 * plan.airspeed * run)
        return starting + run + plan.climb(plan.altitude + self.height_m, plan.performance.climb_mps)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Accelerate, rotate, retract the gear, climb; see `LegBase.fly`."""
        yield from start_engines(pilot, state)
        runway = state.height
        pilot.brakes, pilot.steering, pilot.flaps = 0.0, True, performance.takeoff_flaps
        pilot.lateral, pilot.bank = BANK, 0.0
        pilot.heading = state.psi
        pilot.fixed_elevator, pilot.fixed_aileron, pilot.fixed_throttle = 0.0, 0.0, performance.takeoff_throttle
        run, limit = 0.0, state.time + _TO_MOVE_S
        while state.cas < performance.takeoff_kt * KNOT:
            run += state.ground_speed * INTERVAL
            if self.runway_m is not None and run > self.runway_m:
                raise LegError(
                    f"the aircraft does not take off: after runway_m = {self.runway_m:g} m it has "
                    f"{state.cas / KNOT:.0f} kt, but its rotation speed is {performance.takeoff_kt:g} kt",
                    "a longer runway, or an aircraft that needs a shorter one",
                )
            if state.time > limit and state.ground_speed < _MOVING:
                raise LegError(
                    f"the aircraft does not take off: after {_TO_MOVE_S:g} s of take-off thrust it has only "
                    f"{state.ground_speed:.1f} m/s",
                    "an aircraft whose engines move it",
                )
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
