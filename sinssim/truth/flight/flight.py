"""The true motion of a flight, which JSBSim flies along its plan."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.flight_cache import cached_flight
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import SolutionErrors
from sinssim.truth.motion import AT_REFERENCE_POINT, NORMAL_EARTH, Mounting, Progress, TrueEarth
from sinssim.truth.sampling import Channel

if TYPE_CHECKING:
    from sinssim.truth.curve import Curve


class Flight(FlightPlan):
    """A flight: aircraft, start, legs, wind, atmosphere and turbulence."""

    def trajectory(
        self,
        block: Mounting = AT_REFERENCE_POINT,
        earth: TrueEarth = NORMAL_EARTH,
        seed: int = 0,
        progress: Progress | None = None,
        meanwhile: Callable[[], None] | None = None,
        errors: SolutionErrors | FlightLog | None = None,
    ) -> Curve:
        """Return the motion of the block, flown by JSBSim or from the cache; see `Motion.trajectory`.

        Args:
            errors: those of the navigator whose solution the autopilot sees, or the flight that was flown with them;
                None: it sees the true motion.
        """
        from sinssim.truth.curve import Curve  # needs the compiler

        log = errors if isinstance(errors, FlightLog) else cached_flight(self, seed, progress, meanwhile, errors)
        curve = Curve(
            log.time,
            log.position_ecef,
            log.q_eb,
            block.lever_arm_m,
            block.q_bs,
            earth.gravity,
            earth.figure,
            log.events,
            log.channels,
            log.derivatives,
        )
        return curve if self.atmosphere is None else _in_air(curve, self.air())


def _in_air(curve: Curve, air: Air) -> Curve:
    """Return the motion of a flight with what the air's pressure and temperature are along it, for a barometer."""
    time = curve.channels["airspeed_mps"].time
    heights = curve.state(np.clip(time, curve.start, curve.end)).height.tolist()
    channels = dict(curve.channels)
    for name, value, unit in (
        ("pressure_altitude_m", air.pressure_altitude, "m"),
        ("static_temperature_k", air.temperature, "K"),
        ("static_pressure_pa", air.pressure, "Pa"),
    ):
        channels[name] = Channel(time, np.array([value(height) for height in heights]), unit)
    curve.channels = channels
    return curve
