"""Simple models of vehicles for the 3D views, and which of them a scenario has."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.truth.flight.jsbsim_model import AIRLINER, Proportions, proportions
from sinssim.truth.motions.balloon import BalloonMotion
from sinssim.truth.motions.multirotor import MultirotorMotion
from sinssim.truth.motions.walk import WalkMotion

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


_Ring = list[tuple[float, float, float]]
_Surface = tuple[Array, NDArray[np.int64], Array]
Mesh = tuple[Array, NDArray[np.uint32], Array]
PATHS = {
    "aircraft": "Flight path", "land": "Path of the car", "sea": "Path of the ship", "foot": "Path of the walker",
    "rocket": "Trajectory of the rocket", "multirotor": "Path of the multirotor",
    "balloon": "Path of the balloon", "bomb": "Path of carrier and bomb", "missile": "Path of carrier and missile",
    "": "Path of the vehicle",
}  # fmt: skip
"""Title of the path of each kind of vehicle; "" is a vehicle of unknown kind."""


def kind_of(scenario: Scenario) -> str:
    """Return the kind of vehicle of a scenario, a key of `PATHS`."""
    if scenario.drop is not None:
        return "missile" if scenario.drop.motor else "bomb"
    if scenario.flight is not None:
        return "aircraft"
    if scenario.track is not None:
        return scenario.track.vehicle
    sensors = {} if scenario.aiding is None else scenario.aiding.sensors()
    if scenario.drive is not None or {"land_vehicle", "odometer"} & sensors.keys():
        return "land"
    if isinstance(scenario.motion, WalkMotion):
        return "foot"
    if isinstance(scenario.motion, MultirotorMotion | BalloonMotion):
        return scenario.motion.type
    if scenario.rocket is not None:
        return "rocket"
    return "sea" if scenario.voyage is not None else ""


def shape_of(scenario: Scenario) -> Proportions:
    """Return the proportions of the aircraft of a scenario."""
    return AIRLINER if scenario.flight is None else proportions(scenario.flight.aircraft)


def vehicle_mesh(kind: str, shape: Proportions = AIRLINER) -> Mesh:
    """Return a simple model of a key of `PATHS`, of length 1 in body axes, its centre at the origin, with the
    proportions of an aircraft: vertices (V, 3), triangles (T, 3), brightness of each vertex (V,), 0…1."""
    makers: dict[str, Callable[[], list[_Surface]]] = {
        "aircraft": partial(_aircraft, shape),
        "land": _car,
        "sea": _ship,
        "foot": _shoe,
        "rocket": _rocket,
        "missile": _rocket,
        "bomb": _bomb,
        "multirotor": _multirotor,
        "balloon": _balloon,
        "": _block,
    }
    surfaces = makers[kind]()
    first = np.cumsum([0, *(len(s[0]) for s in surfaces[:-1])])
    return (
        np.concatenate([vertices for vertices, _, _ in surfaces]),
        np.concatenate([triangles + n for (_, triangles, _), n in zip(surfaces, first, strict=True)]).astype(np.uint32),
        np.concatenate([brightness for _, _, brightness in surfaces]),
    )


def _aircraft(shape: Proportions) -> list[_Surface]:
    """Return fuselage, wing, tailplane and fin."""
    surfaces = [
        _loft([_circle(0.5, 0.004), _circle(0.46, 0.03), _circle(0.38, 0.05), _circle(-0.2, 0.05),
               _circle(-0.5, 0.012, -0.03)], 1.0),
        _loft([_fin(-0.33, -0.47, -0.04, 0.008), _fin(-0.45, -0.51, -0.04 - shape.fin, 0.003)], 0.75),
    ]  # fmt: skip
    taper, half = (0.3, 0.5 * shape.span) if shape.tail_span else (0.05, 0.5 * shape.span)
    root = 2.0 * shape.chord / (1.0 + taper)
    back = root * (1.0 - taper) if not shape.tail_span else half * 0.5 if shape.swept else 0.3 * root
    lead = 0.04 + 0.25 * shape.chord + 0.4 * back  # the quarter of the mean chord is near the centre of gravity
    for side in (1.0, -1.0):
        tip = lead - back
        wing = [_blade(lead, lead - root, 0.03 * side, 0.02, 0.012),
                _blade(tip, tip - taper * root, half * side, -0.02, 0.004)]  # fmt: skip
        surfaces.append(_loft(wing, 0.85))
        if shape.tail_span:
            tail = [_blade(-0.36, -0.47, 0.01 * side, -0.03, 0.008),
                    _blade(-0.44, -0.49, 0.5 * shape.tail_span * side, -0.04, 0.003)]  # fmt: skip
            surfaces.append(_loft(tail, 0.85))
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


def _shoe() -> list[_Surface]:
    """Return sole, upper and shaft."""
    sole = [_plan(0.5, 0.17, 0.1), _plan(0.5, 0.17, 0.04)]
    upper = [_plan(0.47, 0.16, 0.04), _plan(0.34, 0.1, -0.1)]
    shaft = [_deck(-0.05, -0.38, 0.11, -0.08), _deck(-0.1, -0.38, 0.1, -0.32)]
    return [_loft(sole, 0.4), _loft(upper, 0.8), _loft(shaft, 0.9)]


def _rocket() -> list[_Surface]:
    """Return body and four fins."""
    surfaces = [_loft([_circle(0.5, 0.004), _circle(0.4, 0.025), _circle(0.25, 0.035), _circle(-0.5, 0.035)], 1.0)]
    for side in (1.0, -1.0):
        level = [_blade(-0.4, -0.5, 0.03 * side, 0.0, 0.004), _blade(-0.46, -0.5, 0.13 * side, 0.0, 0.002)]
        upright = [_fin(-0.4, -0.5, 0.03 * side, 0.004), _fin(-0.46, -0.5, 0.13 * side, 0.002)]
        surfaces += [_loft(level, 0.8), _loft(upright, 0.7)]
    return surfaces


def _bomb() -> list[_Surface]:
    """Return body and four fins, all thicker than a rocket's."""
    rings = ((0.5, 0.005), (0.35, 0.075), (0.15, 0.1), (-0.15, 0.1), (-0.4, 0.04), (-0.5, 0.035))
    surfaces = [_loft([_circle(x, radius) for x, radius in rings], 1.0)]
    for side in (1.0, -1.0):
        level = [_blade(-0.3, -0.5, 0.03 * side, 0.0, 0.008), _blade(-0.4, -0.5, 0.15 * side, 0.0, 0.004)]
        upright = [_fin(-0.3, -0.5, 0.03 * side, 0.008), _fin(-0.4, -0.5, 0.15 * side, 0.004)]
        surfaces += [_loft(level, 0.8), _loft(upright, 0.7)]
    return surfaces


def _multirotor() -> list[_Surface]:
    """Return body and four rotors; the body points ahead."""
    body = [_rectangle(0.5, 0.02, -0.02, 0.02), _rectangle(0.2, 0.1, -0.06, 0.05), _rectangle(-0.25, 0.1, -0.06, 0.05)]
    rotors = []
    for x in (0.25, -0.3):
        vertices, triangles, shade = _loft(
            [_deck(x + 0.2, x - 0.2, 0.2, -0.09), _deck(x + 0.2, x - 0.2, 0.2, -0.1)], 0.5
        )
        rotors += [(vertices + np.array([0.0, y, 0.0]), triangles, shade) for y in (0.28, -0.28)]
    return [_loft(body, 0.9), *rotors]


def _balloon() -> list[_Surface]:
    """Return the payload, pointed ahead, and a balloon above it, which is nearer than in fact."""
    rings = [_deck(x, -x, x, z) for x, z in ((0.05, -0.1), (0.2, -0.25), (0.3, -0.5), (0.2, -0.75), (0.03, -0.88))]
    payload = [_rectangle(0.5, 0.01, -0.01, 0.01), _rectangle(0.1, 0.12, -0.08, 0.12),
               _rectangle(-0.5, 0.12, -0.08, 0.12)]  # fmt: skip
    return [_loft(rings, 0.9), _loft(payload, 0.6)]


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
