"""The route of the transverse frame, and the least distance from its pole.

The x axis of the transverse frame points to the pole p of the route's great circle. Near p, or opposite it, that
direction rotates about the vertical with ω_z = ω_x p_z/p_x, up to speed/distance, which is unbounded. The engines use
this rate at the start, the middle and the end of a step, and their error depends on the rotation in one step, ε = speed
· step/distance. In simulated flights past the pole at 2 m to 30 km, with 20 and 200 m/s and at 10 to 400 Hz, a passage
caused an error of 0.14 ε³ rad in the direction of the velocity and of 0.2 ε of the distance of one step in the position
(for quaternion and similar algorithms; less for functional iteration): 8.5 m of position error after 300 s at 200 m/s
for ε = 0.1, 0.07 m for 0.02, 9 mm for 0.01. The limit is therefore ε = 0.005, at which 0.14 ε³ causes 1 cm in an hour
at 200 m/s, and 0.2 ε causes 2 mm at 100 Hz.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import vector
from sinssim.data import Array
from sinssim.earth.ellipsoids import normal
from sinssim.errors import InputError

TURN_LIMIT = 0.005
"""Largest rotation of the frame about the vertical in one step, rad."""
NEAREST = 1e-3
"""Least distance from the pole at any speed, m, below which the frame's direction is undefined."""
RADIUS = 6371e3
"""Mean radius of the Earth for conversion of angles to distances, m."""


def route_pole(
    route: tuple[float, float, float, float] | None, latitude: float, longitude: float, velocity_ned: ArrayLike
) -> Array:
    """Return the pole of a great circle, to the left of the route: Earth-fixed unit vector, (3,). The route is latitude
    and longitude of A and of B, rad; None is the great circle along the velocity, or to the east for a vehicle at
    rest."""
    if route is None:
        v = np.asarray(velocity_ned, dtype=np.float64)
        north = np.array(
            [-math.sin(latitude) * math.cos(longitude), -math.sin(latitude) * math.sin(longitude), math.cos(latitude)]
        )
        east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
        ahead = v[0] * north + v[1] * east
        if not float(np.linalg.norm(ahead)) > 0.0:
            ahead = east
        pole = np.cross(normal(latitude, longitude), ahead)
    else:
        values = vector("route (latitude and longitude of A and of B)", route, 4, "rad")
        pole = np.cross(normal(values[0], values[1]), normal(values[2], values[3]))
        if float(np.linalg.norm(pole)) < 1e-9:
            raise InputError(f"route = {route}: A and B coincide or are antipodal; they determine no great circle.")
    return np.asarray(pole / np.linalg.norm(pole))


def route_along(latitude: float, longitude: float, velocity_ned: ArrayLike) -> tuple[float, float, float, float]:
    """Return a route on the great circle of `route_pole` without a route: latitude and longitude of the start and of a
    place a quarter of the circle ahead, rad."""
    ahead = np.cross(route_pole(None, latitude, longitude, velocity_ned), normal(latitude, longitude))
    return latitude, longitude, math.atan2(ahead[2], math.hypot(ahead[0], ahead[1])), math.atan2(ahead[1], ahead[0])


def nearest_allowed(speed: ArrayLike, step: ArrayLike) -> Array:
    """Return the least distance from its pole at which the frame can be used with a horizontal speed, m/s, and a step
    of the engine, s: (...) m."""
    return np.maximum(np.multiply(speed, step) / TURN_LIMIT, NEAREST)


def distance_from_pole(pole: Array, latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """Return the distance over the mean sphere, (...) m, from the pole of a route or from the point opposite it,
    whichever is nearer."""
    up = normal(latitude, longitude)
    return np.asarray(RADIUS * np.arctan2(np.linalg.norm(np.cross(up, pole), axis=-1), np.abs(up @ pole)))


def too_near(pole: Array, time: Array, latitude: Array, longitude: Array, velocity: Array) -> tuple[int, str] | None:
    """Return the first row of a motion, at the times of the engine's steps, that is too near to the pole of its route,
    and a message; None if there is no such row."""
    # only rows near the latitude of either pole can be near a pole: the others need no trigonometry
    fastest = math.sqrt(2.0) * float(np.nanmax(np.abs(velocity)))  # or less; NaN of a solution that ran away left aside
    reach = float(nearest_allowed(fastest, np.diff(time).max())) / RADIUS
    rows = np.flatnonzero(np.abs(np.abs(latitude) - abs(math.asin(max(-1.0, min(1.0, pole[2]))))) <= reach + 1e-9)
    steps = time[rows] - time[np.maximum(rows - 1, 0)]
    steps[rows == 0] = time[1] - time[0]
    distance = distance_from_pole(pole, latitude[rows], longitude[rows])
    speed = np.hypot(velocity[rows, 0], velocity[rows, 1])
    near = distance <= nearest_allowed(speed, steps)
    if not near.any():
        return None
    first = int(np.argmax(near))
    row = int(rows[first])
    pole = pole if normal(latitude[row], longitude[row]) @ pole > 0.0 else -pole
    when = f"at t = {time[row]:.2f} s"
    return row, sentence(pole, float(distance[first]), float(speed[first]), float(steps[first]), when)


def sentence(pole: Array, distance: float, speed: float, step: float, when: str) -> str:
    """Return the message that a motion comes too near to the pole of its route, the nearer one."""
    allowed, shown = float(nearest_allowed(speed, step)), float(f"{distance:.4g}")
    angles = math.asin(max(-1.0, min(1.0, pole[2]))), math.atan2(pole[1], pole[0])
    latitude, longitude = (round(math.degrees(angle), 4) + 0.0 for angle in angles)  # no negative zero
    return (
        f"the transverse frame cannot be used within {allowed:.4g} m of its route's pole at {latitude:.4f}°, "
        f"{longitude:.4f}° with {speed:.4g} m/s and steps of {step:g} s, because it rotates by more than "
        f"{math.degrees(TURN_LIMIT):.2g}° per step: the vehicle is {shown:g} m from there {when}. Choose a route near "
        "the flight's path, or none for the great circle along the initial velocity; wander, free-azimuth and inertial "
        "have no such pole."
    )
