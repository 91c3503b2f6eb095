"""Steps of four seconds bring the engines' terms of higher order out of the rounding that hides them at 50 Hz."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from sinssim import FRAMES, ImuData, NavState, navigate
from tests.oracles.s_turn import A_AXIS, E2, OMEGA_IE, somigliana_free_air

Array = NDArray[np.float64]

SPAN, STEP = 32.0, 4.0
BLOCK = Rotation.from_euler("ZYX", [0.5, 0.4, 0.3])
"""Attitude throughout: askew to north, east and down, and fixed to them."""

RISE, SWING = Polynomial([0.0, 0.0, 3.0, -2.0]), Polynomial([0.0, -1.0, 1.0])
FLIGHTS = {
    "gathering speed": (0.5, np.array([200.0, 300.0, 20.0]), np.array([700.0, -900.0, -400.0]), RISE),
    "swinging": (0.5, np.array([200.0, 300.0, -20.0]), np.array([2048.0, 2560.0, -1536.0]), SWING),
    "swinging far north": (1.2, np.array([200.0, 1200.0, -20.0]), np.array([2048.0, 2560.0, -1536.0]), SWING),
    "steady": (0.5, np.array([900.0, 700.0, 0.0]), np.zeros(3), RISE),
}
"""Latitude and velocity at the start, and change and course of the velocity over the span: the acceleration begins and
ends with nothing, or the jerk is the same throughout, or the velocity is. Then little hides how the velocity gained in
a step turns twice with the axes: by 4e-5 m/s downwards and 5e-6 m/s along the wander frame's x."""

ROUTE = (-0.2, 0.0, 0.1, 1.5)
"""Of the transverse frame: far from the flights, so that it turns about the vertical as they change their speed."""


class Flown(NamedTuple):
    """The edges of the steps, s; latitude, longitude and height, and velocity there; increments between them."""

    time: Array
    place: Array
    velocity: Array
    dtheta: Array
    dvel: Array


@pytest.fixture(scope="module", params=FLIGHTS)
def flight(request: pytest.FixtureRequest) -> tuple[str, Flown]:
    """Return a flight over WGS-84 under Somigliana's gravity in free air, f = v̇ + (2ω_ie + ω_en) × v − g."""
    latitude_0, first, change, course = FLIGHTS[request.param]

    def slope(t: float, y: Array) -> Array:
        latitude, height = y[0], y[2]
        v, acceleration = first + change * course(t / SPAN), change * course.deriv()(t / SPAN) / SPAN
        s, c = np.sin(latitude), np.cos(latitude)
        root = np.sqrt(1.0 - E2 * s * s)
        r1, r2 = A_AXIS * (1.0 - E2) / root**3 + height, A_AXIS / root + height
        ie, en = OMEGA_IE * np.array([c, 0.0, -s]), np.array([v[1] / r2, -v[0] / r1, -v[1] * s / (c * r2)])
        north, down = somigliana_free_air(latitude, height)
        force = acceleration + np.cross(2.0 * ie + en, v) - np.array([north, 0.0, down])
        along = [v[0] / r1, v[1] / (r2 * c), -v[2]]
        return np.concatenate([along, BLOCK.apply(ie + en, inverse=True), BLOCK.apply(force, inverse=True)])

    time = np.arange(0.0, SPAN + 1e-9, STEP)
    rows = [np.array([latitude_0, 0.3, 1e4, *np.zeros(6)])]
    for edges in pairwise(time):
        start = np.concatenate([rows[-1][:3], np.zeros(6)])
        rows.append(solve_ivp(slope, edges, start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1])
    place, dtheta, dvel = (np.ascontiguousarray(part) for part in np.split(np.array(rows), [3, 6], axis=1))
    velocity = first + np.multiply.outer(course(time / SPAN), change)
    return request.param, Flown(time, place, velocity, dtheta[1:], dvel[1:])


# Largest errors to the north, to the east and of height, m, of attitude, rad, and of velocity, m/s, half as much again
# as measured. Those of the level frames come from the velocity at the end of a step, which they predict, and of the
# swings from their first step, where no acceleration is known before it. Far north the directions of the north-pointing
# and transverse frames change fast.
BOUNDS = {
    "gathering speed": {
        "level": (0.05, 7.6e-3, 0.027, 4.5e-8, 6.3e-4),
        "wander": (0.029, 0.033, 0.027, 2e-8, 4.7e-4),
        "free-azimuth": (0.09, 0.031, 0.027, 1.9e-8, 4.7e-4),
        "transverse": (0.037, 0.11, 0.027, 2.7e-8, 6.6e-4),
        "inertial": (4.9e-3, 5.7e-3, 6.3e-3, 1.3e-9, 2.6e-5),
    },
    "swinging": {
        "level": (0.03, 0.022, 0.045, 3.2e-8, 2.4e-3),
        "wander": (0.047, 0.047, 0.045, 3e-8, 2.4e-3),
        "free-azimuth": (0.056, 0.039, 0.045, 2.7e-8, 2.4e-3),
        "transverse": (0.091, 0.053, 0.045, 2.5e-8, 2.4e-3),
        "inertial": (4.2e-3, 4.1e-3, 6.7e-3, 1e-9, 8e-6),
    },
    "swinging far north": {
        "level": (0.76, 0.35, 0.17, 2.2e-7, 3e-3),
        "wander": (0.14, 0.16, 0.17, 7.5e-8, 2.4e-3),
        "free-azimuth": (0.067, 0.12, 0.17, 5.7e-8, 2.4e-3),
        "transverse": (1.7, 0.84, 0.17, 3.8e-7, 5.7e-3),
        "inertial": (6.3e-3, 2.5e-3, 6.6e-3, 1.5e-9, 1.8e-5),
    },
    "steady": {
        "level": (3.5e-3, 3e-3, 1.8e-3, 1.9e-9, 9.6e-7),
        "wander": (2.5e-3, 3.2e-3, 8.4e-4, 9.8e-10, 4.1e-7),
        "free-azimuth": (6.3e-4, 1.3e-3, 3.3e-4, 5.2e-10, 4.5e-7),
        "transverse": (6.8e-3, 9.3e-3, 2.4e-3, 2.6e-9, 1.2e-6),
        "inertial": (3e-5, 1.2e-5, 6.5e-5, 1e-11, 7.2e-7),
    },
}


@pytest.mark.parametrize("frame", FRAMES)
def test_long_steps(frame: str, flight: tuple[str, Flown]) -> None:
    name, (time, place, velocity, dtheta, dvel) = flight
    first = NavState(*place[0], velocity[0], BLOCK.as_quat(scalar_first=True))
    route = ROUTE if frame == "transverse" else None
    found = navigate(ImuData(time, dtheta, dvel), first, frame=frame, gravity="somigliana", route=route)
    north = 6.37e6 * (found.latitude - place[:, 0])
    east = 6.38e6 * np.cos(place[:, 0]) * (found.longitude - place[:, 1])
    turned = Rotation.from_quat(found.q_nb, scalar_first=True) * BLOCK.inv()
    errors = (
        np.abs(north).max(),
        np.abs(east).max(),
        np.abs(found.height - place[:, 2]).max(),
        turned.magnitude().max(),
        np.abs(found.velocity_ned - velocity).max(),
    )
    assert np.all(np.array(errors) < BOUNDS[name][frame]), errors
