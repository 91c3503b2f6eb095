"""The true motion of a vehicle on a road or on the sea, as a smooth curve through closely spaced knots.

The course follows the legs on the ellipsoid; the body's response to the road or to the waves is added to height,
attitude and, at sea, to the place. The spline through the knots is the truth: the ideal sensors are exact along it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.earth.models import Ellipsoid
from sinssim.rotation.arrays import multiply, quaternion_from_euler
from sinssim.truth.curve import Curve
from sinssim.truth.trajectory import Channel
from sinssim.truth.vehicles import road, sea
from sinssim.truth.vehicles.profile import Motion, Profile
from sinssim.truth.vehicles.response import respond
from sinssim.truth.vehicles.section import ROADS, DriveSection, VehicleSection, VoyageSection
from sinssim.units import DEG

ROAD_RATE, SEA_RATE = 100.0, 10.0
"""Knots per second of the curve, on a road and on the sea."""
_FASTEST = 0.35
"""Largest frequency with which the road moves the wheels, in units of the knots' rate."""
_BEFORE = 200.0
"""Time before the start in which the hull comes into its motion, s."""


class Body(NamedTuple):
    """Displacement and attitude that the body adds to the course: north, east, up (m), roll, pitch (rad), all (K,)."""

    north: Array
    east: Array
    up: Array
    roll: Array
    pitch: Array


def profile_of(section: VehicleSection) -> Profile:
    """Return speed and heading along the legs of a table.

    Args:
        section: [drive] or [voyage].

    Returns:
        The profile.

    Raises:
        InputError: a leg cannot be; the message names it.
    """
    assert isinstance(section, DriveSection | VoyageSection)
    return Profile(section, section.acceleration_mps2, section.lateral_mps2)


def vehicle_curve(
    section: DriveSection | VoyageSection,
    seed: int,
    lever_arm: tuple[float, float, float],
    q_bs: Array,
    gravity: str,
    ellipsoid: Ellipsoid,
) -> Curve:
    """Return the true motion of a vehicle.

    Args:
        section: [drive] or [voyage].
        seed: seed of road or sea.
        lever_arm: from the vehicle's centre to the sensor block, (3,) m.
        q_bs: mounting of the block, (4,).
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        The motion.

    Raises:
        InputError: a leg cannot be; the message names it.
    """
    profile = profile_of(section)
    rate = ROAD_RATE if isinstance(section, DriveSection) else SEA_RATE
    count = int(np.ceil(profile.duration * rate)) + 1
    step = profile.duration / (count - 1)
    before = 0 if isinstance(section, DriveSection) else round(_BEFORE / step)
    time = np.asarray(np.arange(-before, count) * step, dtype=np.float64)
    course = profile.at(time)
    north, east = (_running(course.speed * part(course.heading), step) for part in (np.cos, np.sin))
    north, east = north - north[before], east - east[before]
    if isinstance(section, DriveSection):
        body, height = _on_road(section, course, step, seed)
        channel = "road_height_m"
    else:
        body, height = _at_sea(section, course, time, north, east, seed)
        channel = "wave_height_m"
    now = slice(before, None)
    latitude, longitude = _place(section, north[now], east[now], ellipsoid)
    q_nb = quaternion_from_euler(body.roll[now], body.pitch[now], course.heading[now])
    m, n = earth.radii(latitude, ellipsoid)
    latitude = latitude + body.north[now] / (m + section.altitude_m)
    longitude = longitude + body.east[now] / ((n + section.altitude_m) * np.cos(latitude))
    place = earth.geodetic_to_ecef(latitude, longitude, section.altitude_m + body.up[now], ellipsoid)
    return Curve(
        time[now],
        place,
        multiply(earth.q_en(latitude, longitude), q_nb),
        lever_arm,
        q_bs,
        gravity,
        ellipsoid,
        profile.events,
        {channel: Channel(time[now], height[now], "m")},
    )


def _running(values: Array, step: float) -> Array:
    """Return the running integral by trapezoids, (K,)."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) * step


def _place(section: VehicleSection, north: Array, east: Array, ellipsoid: Ellipsoid) -> tuple[Array, Array]:
    """Return latitude and longitude of a course from its running north and east components, rad."""
    start, height = np.radians(section.latitude_deg), section.altitude_m
    latitude = np.full(len(north), start)
    for _ in range(3):  # the radius changes by 1e-5 in 10 km: each round gains five digits
        m, _ = earth.radii(latitude, ellipsoid)
        latitude = start + np.concatenate([[0.0], np.cumsum(np.diff(north) / (0.5 * (m[1:] + m[:-1]) + height))])
    _, n = earth.radii(latitude, ellipsoid)
    parallel = (n + height) * np.cos(latitude)
    east_turn = np.concatenate([[0.0], np.cumsum(np.diff(east) / (0.5 * (parallel[1:] + parallel[:-1])))])
    return latitude, np.radians(section.longitude_deg) + east_turn


def _on_road(section: DriveSection, course: Motion, step: float, seed: int) -> tuple[Body, Array]:
    """Return the body's motion on a road, and the height of the road under the vehicle's centre, m."""
    f, damping = section.suspension_hz, section.suspension_damping
    lateral = course.speed * course.rate
    roll = respond(-section.roll_deg_per_mps2 * DEG * lateral, step, f, damping, on_carrier=False)
    pitch = respond(section.pitch_deg_per_mps2 * DEG * course.acceleration, step, f, damping, on_carrier=False)
    none = np.zeros(len(course.way))
    if section.road == "smooth":
        return Body(none, none, none, roll, pitch), none
    from scipy.interpolate import CubicSpline

    highest = min(road.HIGHEST, _FASTEST / step / max(float(course.speed.max()), 1e-9))
    length = float(course.way.max()) + 2.0 * section.wheelbase_m
    heights = road.heights(length, ROADS[section.road], highest, seed)
    surface = CubicSpline(road.STEP * np.arange(len(heights)), heights)
    rear = surface(course.way)
    front = surface(course.way + section.wheelbase_m)
    up = respond(0.5 * (front + rear), step, f, damping, on_carrier=True)
    pitch += respond((front - rear) / section.wheelbase_m, step, f, damping, on_carrier=True)
    return Body(none, none, up, roll, pitch), 0.5 * (front + rear)


def _at_sea(
    section: VoyageSection, course: Motion, time: Array, north: Array, east: Array, seed: int
) -> tuple[Body, Array]:
    """Return the hull's motion, and the height of the waves at it, m."""
    step = float(time[1] - time[0])
    heel = -section.heel_deg_per_mps2 * DEG * course.speed * course.rate
    towards = np.radians(section.waves_towards_deg)
    height, along, slope = (np.zeros(len(time)) for _ in range(3))
    if section.height_m > 0.0:
        waves = sea.waves(section.height_m, sea.peak(section.height_m, section.peak_period_s), seed)
        ahead = north * np.cos(towards) + east * np.sin(towards)
        sea.ride(waves, time, ahead, height, along, slope)
    off = towards - course.heading

    def hull(u: Array, period: float, damping: float) -> Array:
        return respond(u, step, 1.0 / period, damping, on_carrier=False)

    sway = hull(along, section.heave_period_s, section.heave_damping)
    return Body(
        sway * np.cos(towards),
        sway * np.sin(towards),
        hull(height, section.heave_period_s, section.heave_damping),
        hull(heel - slope * np.sin(off), section.roll_period_s, section.roll_damping),
        hull(slope * np.cos(off), section.pitch_period_s, section.pitch_damping),
    ), height
