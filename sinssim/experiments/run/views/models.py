"""Simple models of vehicles for the 3D views: an aircraft, a car, a ship, and a block for a vehicle of unknown kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

_Ring = list[tuple[float, float, float]]
_Surface = tuple[Array, NDArray[np.int64], Array]

PATHS = {"aircraft": "Flight path", "land": "Path of the car", "sea": "Path of the ship", "": "Path of the vehicle"}
"""Title of the path of each kind of vehicle; "" is a vehicle of unknown kind."""


def kind_of(scenario: Scenario) -> str:
    """Return the kind of vehicle of a scenario.

    Returns:
        A key of `PATHS`.
    """
    if scenario.flight is not None:
        return "aircraft"
    if scenario.track is not None:
        return scenario.track.vehicle
    sensors = {} if scenario.aiding is None else scenario.aiding.sensors()
    if scenario.drive is not None or {"land_vehicle", "odometer"} & sensors.keys():
        return "land"
    return "sea" if scenario.voyage is not None else ""


def vehicle_mesh(kind: str) -> tuple[Array, NDArray[np.uint32], Array]:
    """Return a simple model of length 1 in body axes, its centre at the origin.

    Args:
        kind: a key of `PATHS`.

    Returns:
        Vertices (V, 3), triangles (T, 3), brightness of each vertex (V,), 0…1.
    """
    surfaces = {"aircraft": _aircraft, "land": _car, "sea": _ship, "": _block}[kind]()
    first = np.cumsum([0, *(len(s[0]) for s in surfaces[:-1])])
    return (
        np.concatenate([vertices for vertices, _, _ in surfaces]),
        np.concatenate([triangles + n for (_, triangles, _), n in zip(surfaces, first, strict=True)]).astype(np.uint32),
        np.concatenate([brightness for _, _, brightness in surfaces]),
    )


def _aircraft() -> list[_Surface]:
    surfaces = [
        _loft([_circle(0.5, 0.004), _circle(0.46, 0.03), _circle(0.38, 0.05), _circle(-0.2, 0.05),
               _circle(-0.5, 0.012, -0.03)], 1.0),
        _loft([_fin(-0.33, -0.47, -0.04, 0.008), _fin(-0.45, -0.51, -0.2, 0.003)], 0.75),
    ]  # fmt: skip
    for side in (1.0, -1.0):
        wing = [_blade(0.14, -0.08, 0.03 * side, 0.02, 0.012), _blade(-0.08, -0.15, 0.48 * side, -0.02, 0.004)]
        tail = [_blade(-0.36, -0.47, 0.01 * side, -0.03, 0.008), _blade(-0.44, -0.49, 0.18 * side, -0.04, 0.003)]
        surfaces += [_loft(wing, 0.85), _loft(tail, 0.85)]
    return surfaces


def _car() -> list[_Surface]:
    """Return body, cabin and wheels."""
    body = [_rectangle(0.5, 0.17, 0.02, 0.12), _rectangle(0.46, 0.2, -0.03, 0.13), _rectangle(-0.5, 0.2, -0.06, 0.13)]
    cabin = [_deck(0.22, -0.44, 0.185, -0.05), _deck(0.06, -0.36, 0.15, -0.18)]
    wheels = [
        _loft([_rectangle(x + 0.09, 0.03, 0.05, 0.19, y), _rectangle(x - 0.09, 0.03, 0.05, 0.19, y)], 0.35)
        for x in (0.3, -0.32)
        for y in (0.18, -0.18)
    ]
    return [_loft(body, 0.9), _loft(cabin, 0.65), *wheels]


def _ship() -> list[_Surface]:
    """Return hull, superstructure and funnel."""
    hull = [_plan(0.5, 0.11, -0.06), _plan(0.44, 0.07, 0.07)]
    house = [_deck(-0.22, -0.42, 0.085, -0.06), _deck(-0.24, -0.4, 0.08, -0.19)]
    funnel = [_deck(-0.3, -0.37, 0.03, -0.19), _deck(-0.31, -0.36, 0.025, -0.27)]
    return [_loft(hull, 0.7), _loft(house, 1.0), _loft(funnel, 0.5)]


def _block() -> list[_Surface]:
    """Return a block that is pointed ahead."""
    return [_loft([_rectangle(0.5, 0.01, -0.01, 0.01), _rectangle(0.2, 0.2, -0.1, 0.1),
                   _rectangle(-0.5, 0.2, -0.1, 0.1)], 0.9)]  # fmt: skip


def _rectangle(x: float, half: float, top: float, bottom: float, y: float = 0.0) -> _Ring:
    """Return an upright section across the body."""
    return [(x, y + half, bottom), (x, y + half, top), (x, y - half, top), (x, y - half, bottom)]


def _deck(front: float, back: float, half: float, z: float) -> _Ring:
    """Return a level rectangle."""
    return [(front, half, z), (back, half, z), (back, -half, z), (front, -half, z)]


def _plan(front: float, half: float, z: float) -> _Ring:
    """Return the level outline of a hull, with a pointed bow."""
    side = [(0.5 * front, half), (-0.9 * front, 0.9 * half), (-front, 0.6 * half)]
    return [(front, 0.0, z), *((x, y, z) for x, y in side), *((x, -y, z) for x, y in reversed(side))]


def _circle(x: float, radius: float, z: float = 0.0) -> _Ring:
    """Return a ring of the fuselage."""
    angles = [k * 2.0 * np.pi / 12 for k in range(12)]
    return [(x, radius * float(np.cos(a)), z + radius * float(np.sin(a))) for a in angles]


def _profile(lead: float, trail: float, half: float) -> list[tuple[float, float]]:
    """Return a diamond between leading and trailing edge."""
    middle = 0.6 * lead + 0.4 * trail
    return [(lead, 0.0), (middle, -half), (trail, 0.0), (middle, half)]


def _blade(lead: float, trail: float, y: float, z: float, half: float) -> _Ring:
    """Return a section of a wing."""
    return [(x, y, z + d) for x, d in _profile(lead, trail, half)]


def _fin(lead: float, trail: float, z: float, half: float) -> _Ring:
    """Return a section of the fin."""
    return [(x, d, z) for x, d in _profile(lead, trail, half)]


def _loft(rings: list[_Ring], brightness: float) -> tuple[Array, NDArray[np.int64], Array]:
    """Return the closed surface through rings of equally many points; its lower half is darker."""
    n = len(rings[0])
    vertices = np.array([point for ring in rings for point in ring])
    below = np.concatenate([[p[2] > np.mean([q[2] for q in ring]) + 1e-9 for p in ring] for ring in rings])
    triangles = []
    for a in range(0, len(vertices) - n, n):
        for i in range(n):
            j = (i + 1) % n
            triangles += [(a + i, a + j, a + n + i), (a + j, a + n + j, a + n + i)]
    for end in (0, len(vertices) - n):
        triangles += [(end, end + i, end + i + 1) for i in range(1, n - 1)]
    return vertices, np.array(triangles), np.where(below, 0.55, 1.0) * brightness
