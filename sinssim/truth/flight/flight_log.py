"""The log of a flight: what JSBSim records, in its units and in SI units."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array, short_repr
from sinssim.truth.flight.autopilot import INTERVAL
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.units import FOOT

if TYPE_CHECKING:
    from sinssim.truth.curve import KnotDerivatives


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
