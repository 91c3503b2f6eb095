"""The manoeuvres "loop", "barrel_roll" and "doublet" (a doublet or a step on one control)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import asin, atan2, cos, pi, remainder, sin
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.toml_section import Moment, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, LOAD_FACTOR, ROLL_RATE, AircraftState, Autopilot, G
from sinssim.truth.flight.leg import GRAVITY, DeadReckoning, Direction, LegBase, wait
from sinssim.units import DEG


class LoopLeg(LegBase):
    """A full vertical loop from level flight to level flight on the same heading."""

    holds: ClassVar[frozenset[str]] = frozenset()

    type: Literal["loop"]
    load_factor_g: float = Field(default=4.0, ge=2.0, le=9.0, description="constant load factor of the loop")
    recovery_s: Moment = Field(default=10.0, description="level flight afterwards")
    timeout_s: Timeout = Field(default=120.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s, of a circle at the load factor and the recovery; see `LegBase.reckon`."""
        circle = 2.0 * math.pi * plan.true_airspeed() / (GRAVITY * self.load_factor_g)
        plan.turning += (2.0 * math.pi) ** 2 / circle
        return plan.straight(circle, 0.0) + plan.straight(self.recovery_s)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Hold the load factor with the wings level in the loop's plane; see `LegBase.fly`."""
        heading = pilot.heading
        pilot.lateral, pilot.vertical, pilot.fixed_throttle = ROLL_RATE, LOAD_FACTOR, 1.0
        angle, last = 0.0, state.theta
        # The plane of the loop is vertical and contains the nose at the entry; its normal points right: n0 = (-sinψ,
        # cosψ, 0).
        normal_n, normal_e = -sin(state.psi), cos(state.psi)
        ahead_n, ahead_e = cos(state.psi), sin(state.psi)
        while angle < 2.0 * pi - 6.0 * DEG:
            cf, sf, st = cos(state.phi), sin(state.phi), sin(state.theta)
            cp, sp = cos(state.psi), sin(state.psi)
            # The components of the normal along the body's right and down axes give the roll command without singular
            # angles.
            right = (sf * st * cp - cf * sp) * normal_n + (sf * st * sp + cf * cp) * normal_e
            down = (cf * st * cp + sf * sp) * normal_n + (cf * st * sp - sf * cp) * normal_e
            pilot.roll_rate = 1.5 * atan2(down, right)
            pilot.load_factor = self.load_factor_g
            if angle > pi:  # beyond the top, full power would only widen the second half of the loop
                pilot.fixed_throttle = None
            yield
            nose = atan2(sin(state.theta), cos(state.theta) * (cos(state.psi) * ahead_n + sin(state.psi) * ahead_e))
            angle += remainder(nose - last, 2.0 * pi)
            last = nose
        pilot.resume(state)
        pilot.heading = heading
        yield from wait(state, state.time + self.recovery_s)


class BarrelRollLeg(LegBase):
    """A full roll around a helix with positive load factor that ends in level flight."""

    holds: ClassVar[frozenset[str]] = frozenset()

    type: Literal["barrel_roll"]
    direction: Direction = Field(default="right", description="direction of the roll")
    duration_s: float = Field(default=8.0, ge=3.0, le=20.0, description="duration of the roll")
    load_factor_g: float = Field(default=1.5, ge=0.5, le=4.0, description="constant load factor of the roll")
    recovery_s: Moment = Field(default=10.0, description="level flight afterwards")
    timeout_s: Timeout = Field(default=120.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        plan.turning += (2.0 * math.pi) ** 2 / self.duration_s
        return plan.straight(self.duration_s + self.recovery_s)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Pull up, roll once round at a steady rate, return to level flight; see `LegBase.fly`."""
        heading = pilot.heading
        side = 1.0 if self.direction == "right" else -1.0
        rate = 2.0 * pi / self.duration_s
        # The lift turns through a full circle and cancels, so gravity bends the path by gT/V; half of it is added
        # upwards before.
        path = 0.5 * G * self.duration_s / state.tas
        pilot.vertical = LOAD_FACTOR
        while asin(max(-1.0, min(1.0, state.climb / max(state.tas, 20.0)))) < path:
            pilot.load_factor = 1.0 + self.load_factor_g
            yield
        pilot.lateral, pilot.roll_rate = ROLL_RATE, side * rate
        rolled = 0.0
        while rolled < 2.0 * pi - rate / pilot.bank_rate:
            pilot.load_factor = self.load_factor_g
            yield
            rolled += side * state.p * INTERVAL
        pilot.resume(state)
        pilot.heading = heading
        yield from wait(state, state.time + self.recovery_s)


class DoubletLeg(LegBase):
    """A doublet (a deflection in one direction, then in the other) or a step of one control. The autopilot of that axis
    is off during the deflection."""

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
