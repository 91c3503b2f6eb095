"""The axes of a run in its report: local level on the Earth, and the body at the start, with the run's own angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.experiments.run.report.scheme import AIDED, ATTITUDE, POSITION
from sinssim.frames import FRAME_REGISTRY
from sinssim.recording import style
from sinssim.recording.report.drawing import Drawing, Point
from sinssim.recording.report.page import words
from sinssim.rotation import dcm_from_quaternion, euler_from_quaternion, shown_heading
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.data import NavSolution, NavState
    from sinssim.scenario import Scenario

LEVEL = POSITION
"""Colour of the axes of the local level."""
BODY = style.css(style.COLORS["measured"])
"""Colour of the body's axes."""

_CENTRE, _RADIUS, _FLAT = (165.0, 168.0), 118.0, 0.9  # of the drawn Earth, px; its flattening is exaggerated
_ORIGIN, _UNIT = (560.0, 140.0), 104.0  # of the local level, px
_TURN, _UP = np.radians(-28.0), np.radians(24.0)  # from where it is seen
_NEAR = np.radians(12.0)
"""Angle below which an arc has no room, or two axes are drawn one over the other."""


def axes_drawing(scenario: Scenario, truth: NavState, solutions: Mapping[str, NavSolution]) -> str:
    """Draw the axes at the start of a run.

    Args:
        truth: true states, N rows.

    Returns:
        HTML: a drawing and the sentences below it.
    """
    q = truth.q_nb[0]
    roll, pitch, heading = (float(angle) for angle in euler_from_quaternion(q))
    latitude = float(truth.latitude[0])
    d = Drawing(800.0, 330.0, "axes of the local level and of the body at the start")
    _earth(d, latitude)
    azimuth = _azimuth(scenario, solutions)
    _body(d, dcm_from_quaternion(q), heading, pitch, None if azimuth is None else azimuth[0])
    frame = scenario.navigation.frame
    (shown,) = shown_heading(scenario.output.angles, [heading])
    text = (
        f"The true start: latitude {latitude / DEG:.3f}°, longitude {float(truth.longitude[0]) / DEG:.3f}°, "
        f"heading {float(shown) / DEG:.2f}°, pitch {pitch / DEG:.2f}°, roll {roll / DEG:.2f}°. "
        "N, E, D: north, east, down; x, y, z: forward, right, down of the body."
    )
    if azimuth is not None:
        first, last = azimuth
        text += (
            f" The axis x_w of the frame “{frame}” points {first / DEG:.2f}° from north, clockwise, at the start and "
            f"{last / DEG:.2f}° at the end."
        )
    elif frame == "inertial":
        text += " The inertial axes are the Earth’s at the start: Z along its axis, X in the meridian of Greenwich."
    note = words(text.replace(" -", " −")).replace("x_w", "x<sub>w</sub>")
    return f"{d.svg()}\n<p class=note>{note}</p>"


def _azimuth(scenario: Scenario, solutions: Mapping[str, NavSolution]) -> tuple[float, float] | None:
    """Azimuth of the frame's x axis at start and end by the first solution, rad; None without one."""
    if not FRAME_REGISTRY[scenario.navigation.frame].has_azimuth:
        return None
    for solution in solutions.values():
        if solution.azimuth is not None:
            return float(solution.azimuth[0]), float(solution.azimuth[-1])
    return None


def _earth(d: Drawing, latitude: float) -> None:
    """The meridian with the place, its vertical and the local level."""
    (x, y), a = _CENTRE, _RADIUS
    b = _FLAT * a
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    d.line([(x + a * float(np.cos(t)), y - b * float(np.sin(t))) for t in turn], head=False)
    d.line([(x, y), (x, y - b - 32.0)])
    d.text(x - 12.0, y - b - 26.0, "Ω", soft=True, anchor="end")
    d.line([(x, y), (x + a, y)], head=False)
    d.text(x + 0.5 * a, y + (12.0 if latitude >= 0.0 else -12.0), "equator", soft=True)
    s, c = float(np.sin(latitude)), float(np.cos(latitude))
    normal = a / np.sqrt(1.0 - (1.0 - _FLAT**2) * s * s)
    here = (x + normal * c, y - normal * _FLAT**2 * s)
    foot = (here[0] - normal * _FLAT**2 * c, y)  # where the vertical meets the equator's plane
    d.line([foot, here], head=False, dashes="5 4")
    if abs(latitude) > _NEAR:
        arc = np.linspace(0.0, latitude, 20)
        d.line([(foot[0] + 34.0 * float(np.cos(t)), y - 34.0 * float(np.sin(t))) for t in arc], ATTITUDE, head=False)
        half = 0.5 * latitude
        d.text(foot[0] + 46.0 * float(np.cos(half)), y - 46.0 * float(np.sin(half)), "φ", ATTITUDE)
    for name, (east, north), length in (("N", (-s, c), 62.0), ("D", (-c, -s), 48.0)):
        end = (here[0] + length * east, here[1] - length * north)
        d.line([here, end], LEVEL, width=1.8)
        away = (length + 11.0, 0.0) if name == "N" else (length - 12.0, 12.0)  # beside the dashed vertical
        d.text(
            here[0] + away[0] * east + away[1] * north, here[1] - away[0] * north + away[1] * east, name, LEVEL
        )  # fmt: skip
    d.circle(*here, 6.5, LEVEL, "×")
    d.text(here[0] + 17.0 * c + 2.0, here[1] - 17.0 * s, "E", LEVEL)


def seen(vector: Array) -> Point:
    """Return where a vector in north, east, down ends on the drawing.

    Args:
        vector: (3,), in units of the drawing.

    Returns:
        px.
    """
    north, east, down = (float(v) for v in vector)
    across = north * np.sin(-_TURN) + east * np.cos(_TURN)
    depth = north * np.cos(_TURN) + east * np.sin(_TURN)
    return (
        _ORIGIN[0] + _UNIT * float(across),
        _ORIGIN[1] - _UNIT * float(depth * np.sin(_UP) - down * np.cos(_UP)),
    )


def _beside(axes: list[Array], heading: float) -> Point:
    """Return a place along the arc of the heading that is as far as possible from all axes, px."""

    def room(place: Point) -> float:
        p, gaps = np.array(place) - np.array(_ORIGIN), []
        for tip in axes:
            a = np.array(seen(tip)) - np.array(_ORIGIN)
            share = float(np.clip(p @ a / max(float(a @ a), 1e-9), 0.0, 1.0))
            gaps.append(float(np.hypot(*(p - share * a))))
        return min(gaps)

    turns = heading * np.linspace(0.2, 0.8, 13)
    return max((seen(0.64 * np.array([np.cos(t), np.sin(t), 0.0])) for t in turns), key=room)


def _body(d: Drawing, c_nb: Array, heading: float, pitch: float, azimuth: float | None) -> None:
    """North, east and down in perspective with the body's axes and their angles."""
    level = [(name, 1.35 * np.eye(3)[i], LEVEL) for i, name in enumerate("NED")]
    body = [(name, 1.05 * c_nb[:, i], BODY) for i, name in enumerate("xyz")]
    flat = np.array([np.cos(heading), np.sin(heading), 0.0])
    d.line([seen(np.zeros(3)), seen(1.05 * flat)], head=False, dashes="5 4")
    if azimuth is not None and abs(azimuth) > _NEAR:
        level.append(("x{w}", 1.35 * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]), AIDED))
    for _, tip, color in level + body:
        d.line([seen(np.zeros(3)), seen(tip)], color, width=1.8)
    if min(heading, 2.0 * np.pi - heading) > _NEAR:
        turn = np.linspace(0.0, heading, 60)
        d.line([seen(0.5 * np.array([np.cos(t), np.sin(t), 0.0])) for t in turn], ATTITUDE)
        d.text(*_beside([tip for _, tip, _ in level + body], heading), "ψ", ATTITUDE)
    if abs(pitch) > _NEAR:
        turn = np.linspace(0.0, pitch, 20)
        d.line([seen(0.85 * (np.cos(t) * flat - np.sin(t) * np.eye(3)[2])) for t in turn], ATTITUDE)
        d.text(*seen(0.98 * (np.cos(0.5 * pitch) * flat - np.sin(0.5 * pitch) * np.eye(3)[2])), "θ", ATTITUDE)
    drawn: list[Array] = []
    for name, tip, color in level + body:
        along = np.array(seen(tip)) - np.array(_ORIGIN)
        length = max(float(np.hypot(*along)), 1e-9)
        along /= length
        beside = any(float(along @ other) > np.cos(_NEAR) for other in drawn)
        drawn.append(along)
        place = np.array(seen(tip)) + (13.0 * np.array([along[1], -along[0]]) if beside else 12.0 * along)
        d.text(float(place[0]), float(place[1]), name, color)
    d.text(_ORIGIN[0], 315.0, "the body at the start", soft=True)
    d.text(_CENTRE[0], 315.0, "the place at the start, E into the page", soft=True)
