"""The leg "park": at rest on the ground, engines running or off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.ground import come_to_rest, on_wheels, start_engines
from sinssim.truth.flight.leg import LegBase, LegError, wait

_STOPPING = 0.5  # deceleration to a standstill in dead reckoning [m/s²]
_SETTLING_S = 10.0  # time until the gear has come to rest, in dead reckoning [s]
_STOPPED_S = 30.0  # time in which the thrust of stopped engines decays [s]
_SHUT_DOWN_S = 90.0  # time in which the engines stop, and the aircraft comes to rest again [s]


class ParkedLeg(LegBase):
    """At rest on the ground with the brakes set. A rolling aircraft first brakes to a standstill.

    Attributes:
        duration_s: duration of the standstill, s.
        engines: state of the engines from the beginning of the standstill on; None: as they are.
    """

    example: ClassVar[dict[str, Any]] = {"duration_s": 600.0}
    begins: ClassVar[Literal["runway", "air"]] = "runway"
    ends: ClassVar[Literal["runway", "air"]] = "runway"
    stands_still: ClassVar[bool] = True

    type: Literal["parked", "park"]
    duration_s: float = Field(gt=0.0, le=86_400.0, description="duration of the stop, counted from the standstill")
    engines: Literal["running", "off"] | None = Field(
        default=None, description="engines during the stop; default: unchanged"
    )
    timeout_s: Timeout = Field(default=86_400.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, with the time to stop and to switch the engines; see `LegBase.reckon`."""
        stopping, plan.airspeed = plan.airspeed / _STOPPING, 0.0
        plan.ahead(0.5 * _STOPPING * stopping**2)
        switching = 0.0
        if self.engines is not None and (self.engines == "running") != plan.engines:
            plan.engines = self.engines == "running"
            switching = plan.performance.engine_start_s if plan.engines else _STOPPED_S
        stopping += _SETTLING_S if stopping else 0.0
        return stopping + switching + self.duration_s

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Stop, switch the engines, and hold the brakes; see `LegBase.fly`."""
        if not pilot.standing:
            on_wheels(pilot, state)
            yield from come_to_rest(pilot, state)
        if self.engines == "running" and not state.engines_running:
            yield from start_engines(pilot, state)
            yield from come_to_rest(pilot, state)
        elif self.engines == "off" and pilot.engines:
            pilot.engines, pilot.standing = False, False
            limit = state.time + _SHUT_DOWN_S
            while state.engines_running:
                if state.time > limit:
                    raise LegError("the engines do not stop", 'engines = "running"')
                yield
            yield from wait(state, state.time + _STOPPED_S)
            yield from come_to_rest(pilot, state)
        pilot.brakes, pilot.standing = 1.0, True
        yield from wait(state, state.time + self.duration_s)
