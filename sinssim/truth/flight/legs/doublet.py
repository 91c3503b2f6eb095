"""The leg "doublet": a doublet or a step on one control."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Moment, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning
from sinssim.truth.flight.leg import LegBase, wait


class DoubletLeg(LegBase):
    """A doublet (a deflection in one direction, then in the other) or a step of one control. The autopilot of that axis
    is off during the deflection.

    Attributes:
        control: the control.
        amplitude: size, as a fraction of the control's full travel; positive is stick back, stick right, right pedal.
        duration_s: duration of the step, or of each half of the doublet, s.
        shape: doublet or step.
        recovery_s: straight and level flight afterwards, s.
    """

    example: ClassVar[dict[str, Any]] = {"control": "elevator", "amplitude": 0.2}

    holds: ClassVar[frozenset[str]] = frozenset()

    type: Literal["doublet"]
    control: Literal["elevator", "aileron", "rudder"] = Field(description="elevator, aileron or rudder")
    amplitude: float = Field(
        ge=-1.0, le=1.0, description="fraction of full travel; positive: stick back or right, right pedal"
    )
    duration_s: float = Field(
        default=1.0, gt=0.0, le=30.0, description="duration of the step or of each half of the doublet"
    )
    shape: Literal["doublet", "step"] = Field(default="doublet", description="doublet or step")
    recovery_s: Moment = Field(default=10.0, description="straight and level flight afterwards")
    timeout_s: Timeout = Field(default=600.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s; see `LegBase.reckon`. The rate is assumed to be a fraction of the largest roll
        rate."""
        moved = self.duration_s * (2.0 if self.shape == "doublet" else 1.0)
        plan.turning += (self.amplitude * plan.roll_rate) ** 2 * moved
        return plan.straight(moved + self.recovery_s)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Move the control, then return to straight and level flight; see `LegBase.fly`."""
        name = f"fixed_{self.control}"
        rest = getattr(pilot, self.control)
        # JSBSim's elevator is positive nose down and its rudder positive nose left.
        size = self.amplitude if self.control == "aileron" else -self.amplitude
        for part in (size, -size) if self.shape == "doublet" else (size,):
            setattr(pilot, name, max(-1.0, min(1.0, rest + part)))
            yield from wait(state, state.time + self.duration_s)
        pilot.resume(state)
        yield from wait(state, state.time + self.recovery_s)
