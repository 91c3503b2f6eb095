"""The log of a flight.

The recording in JSBSim's units and in SI units, and events of legs that missed their targets.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from math import pi, remainder
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array, short_repr
from sinssim.truth.flight.autopilot import HEIGHT, INTERVAL, AircraftState, Autopilot
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.units import DEG, FOOT, KNOT

if TYPE_CHECKING:
    from sinssim.truth.curve import KnotDerivatives
    from sinssim.truth.flight.leg import LegBase


_POUND_FORCE = 4.4482216152605  # [N]

CHANNELS: tuple[tuple[str, str, float, str], ...] = (
    ("airspeed_mps", "velocities/vtrue-fps", FOOT, "m/s"),
    ("calibrated_airspeed_mps", "velocities/vc-fps", FOOT, "m/s"),
    ("alpha_rad", "aero/alpha-rad", 1.0, "rad"),
    ("beta_rad", "aero/beta-rad", 1.0, "rad"),
    ("load_factor", "accelerations/Nz", 1.0, "g"),
    ("vertical_speed_mps", "velocities/h-dot-fps", FOOT, "m/s"),
    ("height_above_ground_m", "position/h-agl-ft", FOOT, "m"),
    ("elevator_rad", "fcs/elevator-pos-rad", 1.0, "rad"),
    ("aileron_rad", "fcs/left-aileron-pos-rad", 1.0, "rad"),
    ("rudder_rad", "fcs/rudder-pos-rad", 1.0, "rad"),
    ("throttle", "fcs/throttle-cmd-norm", 1.0, ""),
    ("wind_north_mps", "atmosphere/total-wind-north-fps", FOOT, "m/s"),
    ("wind_east_mps", "atmosphere/total-wind-east-fps", FOOT, "m/s"),
    ("wind_down_mps", "atmosphere/total-wind-down-fps", FOOT, "m/s"),
)
"""Channels logged ten times a second: name, JSBSim property, factor to the unit, unit."""


@short_repr
@dataclass(frozen=True)
class FlightLog:
    """A flown flight: the centre of gravity's motion at knots, and other logged quantities."""

    time: Array  # instants of the knots, (K,) s, from 0
    position_ecef: Array  # position of the centre of gravity, (K, 3) m
    q_eb: Array  # attitude quaternion, scalar first, v_e = C_eb v_b, without jumps of sign, (K, 4)
    channels: dict[str, Channel]  # airspeed, controls, wind and so on, by name
    events: tuple[FlightEvent, ...]  # beginning and end of each leg
    # derivatives of the curve through the knots; a flight that was not in the cache lacks them
    derivatives: KnotDerivatives | None = None


@dataclass(frozen=True)
class FlightRecord:
    """The recording of a flight in JSBSim's units."""

    poses: array[float]  # position in ECEF (ft) and roll, pitch, heading (rad) of every knot, one after another
    channels: array[float]  # values of the channels, one instant after another, JSBSim's units
    events: tuple[FlightEvent, ...]  # beginning and end of each leg


def flight_log(record: FlightRecord) -> FlightLog:
    """Return a flight in SI units, with one attitude quaternion from body to ECEF: the centre of gravity's motion at 30
    Hz and the other logged quantities."""
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic, q_en
    from sinssim.rotation.quaternions import multiply, quaternion_from_euler

    poses = np.frombuffer(record.poses).reshape(-1, 6)
    position = poses[:, :3] * FOOT
    latitude, longitude, _ = ecef_to_geodetic(position)
    q_eb = multiply(q_en(latitude, longitude), quaternion_from_euler(poses[:, 3], poses[:, 4], poses[:, 5]))
    turned = np.sum(q_eb[1:] * q_eb[:-1], axis=1) < 0.0
    q_eb[1:] *= np.where(np.logical_xor.accumulate(turned), -1.0, 1.0)[:, None]
    values = np.frombuffer(record.channels).reshape(-1, len(record.channels) // (1 + (len(poses) - 1) // 3))
    time = _instants(len(values), 3.0 * INTERVAL)
    channels = {
        name: Channel(time, values[:, column] * factor, unit) for column, (name, _, factor, unit) in enumerate(CHANNELS)
    }
    channels["thrust_n"] = Channel(time, values[:, len(CHANNELS) :].sum(axis=1) * _POUND_FORCE, "N")
    return FlightLog(_instants(len(poses), INTERVAL), position, q_eb, channels, record.events)


def _instants(count: int, interval: float) -> Array:
    return np.arange(count, dtype=np.float64) * interval


_HEIGHT, _HEADING = 50.0, 5.0 * DEG  # a leg that ends farther from its order than this is not attained [m, rad]
_SPEED, _SPEED_SHARE = 10.0 * KNOT, 0.05  # the same for the airspeed: farther off than both [m/s, of the order]
_TURBULENT = 3.0  # factor of these limits in turbulence
_MISSED = " did not reach its targets: at its end "


def shortfall(
    name: str, leg: LegBase, pilot: Autopilot, state: AircraftState, *, turbulent: bool
) -> FlightEvent | None:
    """Compare the end in the air of a leg, named for example "leg 3 (climb)", with what it ordered; return a sentence
    with what is achieved and ordered, None where both agree. Turbulence moves the aircraft at any instant."""
    misses, more = [], _TURBULENT if turbulent else 1.0
    if "height" in leg.holds and pilot.vertical == HEIGHT and abs(state.height - pilot.height) > more * _HEIGHT:
        misses.append(f"the height is {state.height:.0f} m instead of {pilot.height:.0f} m")
    off = abs(state.cas - pilot.airspeed)
    if "airspeed" in leg.holds and off > more * max(_SPEED, _SPEED_SHARE * pilot.airspeed):
        misses.append(f"the airspeed is {state.cas / KNOT:.0f} kt instead of {pilot.airspeed / KNOT:.0f} kt")
    if "heading" in leg.holds and abs(remainder(state.psi - pilot.heading, 2.0 * pi)) > more * _HEADING:
        misses.append(f"the heading is {state.psi / DEG % 360.0:.0f}° instead of {pilot.heading / DEG % 360.0:.0f}°")
    return FlightEvent(state.time, f"{name}{_MISSED}{', '.join(misses)}") if misses else None


def not_attained(events: Iterable[FlightEvent]) -> list[str]:
    """Return the sentences of `shortfall` among the events of a flight, each with its time."""
    return [f"{event.text} (at {event.time:.0f} s)." for event in events if _MISSED in event.text]
