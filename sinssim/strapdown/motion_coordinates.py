"""A motion in further coordinates, beside geodetic position, velocity north-east-down and q_nb.

These are Earth-fixed axes, inertial axes that coincide with them at the first instant, those along the axes of a frame
with an azimuth of its own, and the conditional coordinates of a route.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth import ecef_to_eci, geodetic_to_ecef, q_en
from sinssim.earth.ellipsoids import WGS84, Ellipsoid, normal
from sinssim.errors import InputError


class EarthFixed(NamedTuple):
    """Motion in Earth-fixed axes."""

    position: Array  # r_e, (N, 3) m
    velocity: Array  # v_e relative to the Earth, (N, 3) m/s
    q_eb: Array  # attitude relative to the Earth's axes, (N, 4)


class Inertial(NamedTuple):
    """Motion in inertial axes, which coincide with the Earth's at one instant, by default the first."""

    position: Array  # r_i, (N, 3) m
    velocity: Array  # absolute velocity dr_i/dt, (N, 3) m/s
    q_ib: Array  # attitude relative to the inertial axes, (N, 4)
    angles: Array  # Euler angles ZYX of q_ib, about x in (−π, π], y in [−π/2, π/2] and z in [0, 2π), (N, 3) rad


class LevelAxes(NamedTuple):
    """Motion along the axes of a local-level frame with an azimuth of its own."""

    azimuth: Array  # direction of the x axis, clockwise from north, (N,) rad
    velocity: Array  # along x, y and down, relative to the Earth, (N, 3) m/s
    heading: Array  # clockwise from the x axis, in [0, 2π), (N,) rad


class Conditional(NamedTuple):
    """Conditional (orthodromic) coordinates: a sphere of normals with the route as its equator."""

    latitude: Array  # angle of the ellipsoid's normal from the plane of the route, positive to its left, (N,) rad
    longitude: Array  # angle along the route from its start, in (−π, π], (N,) rad
    axes: LevelAxes
    """Velocity and heading relative to conditional north, the direction to the pole of the route. A vehicle that flies
    along the route has the conditional heading 90°.
    """


def earth_fixed(state: NavState | NavSolution, ellipsoid: Ellipsoid = WGS84) -> EarthFixed:
    """Return a motion in Earth-fixed axes: N rows."""
    s, turn = state, q_en(state.latitude, state.longitude)
    position = geodetic_to_ecef(s.latitude, s.longitude, s.height, ellipsoid)
    return EarthFixed(position, rotation.rotate(turn, s.velocity_ned), rotation.multiply(turn, s.q_nb))


def inertial(
    state: NavState | NavSolution, time: Array, ellipsoid: Ellipsoid = WGS84, start: float | None = None
) -> Inertial:
    """Return a motion at (N,) s in the inertial axes that are the Earth's at `start`, s, by default the first."""
    fixed, since = earth_fixed(state, ellipsoid), time - (time[0] if start is None else start)
    x, y, _ = fixed.position.T
    velocity = fixed.velocity + ellipsoid.omega * np.stack([-y, x, np.zeros_like(x)], axis=1)  # v + ω × r
    half = 0.5 * ellipsoid.omega * since
    turn = np.stack([np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half)], axis=1)
    q_ib = rotation.multiply(turn, fixed.q_eb)
    return Inertial(
        ecef_to_eci(fixed.position, since, ellipsoid),
        ecef_to_eci(velocity, since, ellipsoid),
        q_ib,
        np.stack(rotation.euler_from_quaternion(q_ib), axis=1),
    )


def level_axes(state: NavState | NavSolution, azimuth: Array | None = None) -> LevelAxes:
    """Return a motion along the axes of a local-level frame at an azimuth, rad; by default the solution's own."""
    if azimuth is None:
        azimuth = getattr(state, "azimuth", None)
        if azimuth is None:
            raise InputError(
                "the solution has no azimuth of its own: it was not navigated in the frame wander, free-azimuth or "
                "transverse. Give the azimuth of the axes."
            )
    c, s = np.cos(azimuth), np.sin(azimuth)
    north, east, down = state.velocity_ned.T
    velocity = np.stack([c * north + s * east, c * east - s * north, down], axis=1)
    heading = rotation.euler_from_quaternion(state.q_nb)[2] - azimuth
    return LevelAxes(azimuth, velocity, rotation.heading_in("0..360", heading))


def conditional(state: NavState | NavSolution, pole: Array, start: tuple[float, float] | None = None) -> Conditional:
    """Return a motion in the conditional coordinates of a route: N rows.

    `pole` is that of the route's great circle, to the left of the route, see
    `sinssim.strapdown.frames.route_pole.route_pole`; `start` are latitude and longitude of its start, rad, by
    default those of the first row.
    """
    first = (float(state.latitude[0]), float(state.longitude[0])) if start is None else start
    up = normal(state.latitude, state.longitude)
    ahead = np.cross(pole, normal(*first))  # along the route at its start
    ahead /= np.linalg.norm(ahead)
    origin = np.cross(ahead, pole)
    latitude = np.arctan2(up @ pole, np.hypot(up @ origin, up @ ahead))
    to_pole = rotation.rotate(rotation.conjugate(q_en(state.latitude, state.longitude)), pole)
    azimuth = np.arctan2(to_pole[:, 1], to_pole[:, 0])
    return Conditional(latitude, np.arctan2(up @ ahead, up @ origin), level_axes(state, azimuth))
