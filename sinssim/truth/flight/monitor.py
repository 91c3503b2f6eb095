"""Watches a flight: ground contact, stall, fuel, poles."""

from __future__ import annotations

from math import pi, tan
from typing import Any

from sinssim.truth.flight.aircraft import Aircraft
from sinssim.truth.flight.autopilot import HEADING, AircraftState, Autopilot, G
from sinssim.truth.flight.leg import LegBase, LegError
from sinssim.truth.flight.plan import FlightPlan
from sinssim.units import DEG

_STALLED = 10  # updates beyond the stall's angle of attack after which the aircraft counts as stalled
_QUARTER = 6_371_009.0 * 0.5 * pi  # distance from the equator to a pole [m]


class Monitor:
    """What makes a leg fail although it goes on."""

    def __init__(self, executive: Any, flight: FlightPlan, aircraft: Aircraft) -> None:
        """Find what is watched."""
        manager = executive.get_property_manager()
        units = range(executive.get_ground_reactions().get_num_gear_units())
        names = (f"{kind}/unit[{unit}]/WOW" for unit in units for kind in ("gear", "contact"))
        self._contacts = [manager.get_node(name).get_double_value for name in names if manager.hasNode(name)]
        self._fuel = manager.get_node("propulsion/total-fuel-lbs").get_double_value
        self._has_fuel = self._fuel() > 0.0
        self._stall = aircraft.performance.stall_alpha_deg * DEG
        self._stalled = 0
        causes = ["a higher airspeed", "a lower load factor"]
        if flight.turbulence is not None:
            causes.append("weaker turbulence")
        if flight.wind.gusts or flight.wind.down_mps:
            causes.append("weaker vertical wind and gusts")
        self._against_stall = ", ".join(causes[:-1]) + f" or {causes[-1]}"

    def watch(self, leg: LegBase, pilot: Autopilot, state: AircraftState) -> None:
        """Raise if a leg cannot be flown on; called ten times a second in the air.

        Args:
            state: the aircraft's state.

        Raises:
            LegError: the reason and a remedy.
        """
        if not pilot.may_touch and (state.height_above_ground < 0.0 or any(touch() for touch in self._contacts)):
            raise LegError("the aircraft hit the ground", "a greater height")
        self._stalled = self._stalled + 1 if state.alpha > self._stall else 0
        if self._stalled >= _STALLED:
            raise LegError("the aircraft stalled", self._against_stall)
        if self._has_fuel and self._fuel() <= 0.0:
            remedy = "a shorter flight, a lower airspeed, or another aircraft"
            raise LegError("the fuel of the model is used up", remedy)
        if "heading" in leg.holds and pilot.lateral == HEADING:
            left = _QUARTER * (1.0 - abs(state.latitude) / (0.5 * pi))
            radius = state.ground_speed**2 / (G * tan(pilot.bank_limit))
            if left < radius:
                raise LegError(
                    f"the pole is {left / 1e3:.1f} km away, and a heading cannot be held within the turn radius of "
                    f"{radius / 1e3:.1f} km",
                    "a path farther from the pole, a waypoint beyond the pole, or [great_circle]",
                )
