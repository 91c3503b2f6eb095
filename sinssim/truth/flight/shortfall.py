"""Compares the end of a leg with what the leg ordered: height, airspeed, heading."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi, remainder
from typing import TYPE_CHECKING

from sinssim.truth.channel import FlightEvent
from sinssim.truth.flight.autopilot import HEIGHT, AircraftState, Autopilot
from sinssim.units import DEG, KNOT

if TYPE_CHECKING:
    from sinssim.truth.flight.leg import LegBase

_HEIGHT, _HEADING = 50.0, 5.0 * DEG  # a leg that ends farther from its order than this is not attained [m, rad]
_SPEED, _SPEED_SHARE = 10.0 * KNOT, 0.05  # the same for the airspeed: farther off than both [m/s, of the order]
_TURBULENT = 3.0  # factor of these limits in turbulence
_MISSED = " did not reach its targets: at its end "


def shortfall(
    name: str, leg: LegBase, pilot: Autopilot, state: AircraftState, *, turbulent: bool
) -> FlightEvent | None:
    """Compare the end of a leg with what it ordered.

    Args:
        name: of the leg, for example "leg 3 (climb)".
        leg: the leg, which has ended in the air.
        state: the aircraft's state.
        turbulent: whether there is turbulence, which moves the aircraft at any instant.

    Returns:
        A sentence with what is achieved and ordered; None where both agree.
    """
    found, more = [], _TURBULENT if turbulent else 1.0
    if "height" in leg.holds and pilot.vertical == HEIGHT and abs(state.height - pilot.height) > more * _HEIGHT:
        found.append(f"the height is {state.height:.0f} m instead of {pilot.height:.0f} m")
    off = abs(state.cas - pilot.airspeed)
    if "airspeed" in leg.holds and off > more * max(_SPEED, _SPEED_SHARE * pilot.airspeed):
        found.append(f"the airspeed is {state.cas / KNOT:.0f} kt instead of {pilot.airspeed / KNOT:.0f} kt")
    if "heading" in leg.holds and abs(remainder(state.psi - pilot.heading, 2.0 * pi)) > more * _HEADING:
        found.append(f"the heading is {state.psi / DEG % 360.0:.0f}° instead of {pilot.heading / DEG % 360.0:.0f}°")
    return FlightEvent(state.time, f"{name}{_MISSED}{', '.join(found)}") if found else None


def not_attained(events: Iterable[FlightEvent]) -> list[str]:
    """Return the sentences of `shortfall` among the events of a flight, each with its time."""
    return [f"{event.text} (at {event.time:.0f} s)." for event in events if _MISSED in event.text]
