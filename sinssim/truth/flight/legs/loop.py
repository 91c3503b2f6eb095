"""The leg "loop": a full vertical loop."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import atan2, cos, pi, remainder, sin
from typing import ClassVar, Literal

from pydantic import Field

from sinssim.section import Moment, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import LOAD_FACTOR, ROLL_RATE, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import GRAVITY, DeadReckoning
from sinssim.truth.flight.leg import LegBase, wait
from sinssim.units import DEG


class LoopLeg(LegBase):
    """A full vertical loop from level flight to level flight on the same heading.

    Attributes:
        load_factor_g: constant load factor of the loop, g.
        recovery_s: level flight afterwards, s.
    """

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
