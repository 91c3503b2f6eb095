"""Block diagrams and axes for reports and docs/questions.md.

They show what the strapdown chapter explains in figures of its own: the axes and the scheme of the one-component
system, the loop of its errors, the scheme of three components, its axes, and the three rates. They are drawn anew, with
the chapter's symbols.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.svg import Drawing, Point

SENSOR, ATTITUDE, VELOCITY, POSITION = (
    style.css(style.COLORS[name]) for name in ("measured", "attitude", "gyro bias", "position")
)
"""Colours: what is measured, attitude, velocity, position."""

_SUM = 13.0  # radius of the sign of a sum, px
_DASHES, _DOTS = "5 4", "1.5 3"


def ray(start: Point, length: float, degrees: float) -> Point:
    """Return the end of a line from a point in a direction, counter-clockwise from the right."""
    angle = np.deg2rad(degrees)
    return start[0] + length * float(np.cos(angle)), start[1] - length * float(np.sin(angle))


def one_component_axes() -> str:
    """Draw the vertical plane: Earth, local horizon, axes of the accelerometers, and the coordinate."""
    d = Drawing(560.0, 410.0, "axes of the one-component system")
    centre, radius, along, pitch = (260.0, 390.0), 230.0, 62.0, 24.0
    horizon = along - 90.0
    d.arc(centre, radius, np.deg2rad(20.0), np.deg2rad(160.0))
    begin, here = ray(centre, radius, 90.0), ray(centre, radius, along)
    for end in (begin, here):
        d.line([centre, end], head=False, dashes=_DASHES)
    d.text(233.0, 325.0, "start", soft=True)
    d.text(333.0, 295.0, "R", soft=True)
    d.arc(centre, 70.0, np.deg2rad(along), np.deg2rad(90.0), POSITION)
    d.text(288.0, 303.0, "y", POSITION)
    for degrees, name, (x, y) in ((0.0, "ξ{0}", (100.0, 0.0)), (90.0, "η{0}", (0.0, -95.0))):
        d.line([begin, ray(begin, 80.0, degrees)])
        d.text(begin[0] + x, begin[1] + y, name, soft=True)
    d.line([here, ray(here, 150.0, 0.0)], head=False, dashes=_DASHES)  # parallel to ξ₀ of the start
    d.text(533.0, here[1], "ξ{0}", soft=True)
    d.arc(here, 115.0, np.deg2rad(horizon), 0.0, POSITION)
    d.text(*ray(here, 126.0, 0.5 * horizon), "y", POSITION)
    for degrees, length, name, color in (
        (horizon, 135.0, "ξ, V", VELOCITY),
        (along, 120.0, "η", VELOCITY),
        (horizon + pitch, 135.0, "x", SENSOR),
        (along + pitch, 120.0, "y", SENSOR),
    ):
        d.line([here, ray(here, length, degrees)], color)
        d.text(*ray(here, length + 13.0, degrees + (0.0 if degrees > 0.0 else -3.0)), name, color)
    d.arc(here, 75.0, np.deg2rad(horizon), np.deg2rad(horizon + pitch), ATTITUDE)
    d.text(*ray(here, 90.0, horizon + 0.5 * pitch), "α", ATTITUDE)
    d.line([here, ray(here, 62.0, along + 180.0)], style.INK, width=2.0)
    d.text(358.0, 250.0, "g")
    for line, (words, color) in enumerate((
        ("x, y: axes of the accelerometers", SENSOR),
        ("ξ, η: local horizon and vertical", VELOCITY),
        ("ξ{0}, η{0}: the same at the start", ""),
        ("α: pitch of x above the horizon", ATTITUDE),
        ("y = S/R: coordinate on the Earth", POSITION),
    )):  # fmt: skip
        d.text(15.0, 20.0 + 22.0 * line, words, color, "start", soft=not color)
    return d.svg()


def one_component_scheme() -> str:
    """Draw the scheme of the one-component system."""
    d = Drawing(770.0, 230.0, "scheme of the one-component system")
    top, low = 50.0, 180.0
    sensors, gyro = d.box(85.0, top, 130.0, ["accelerometers"], SENSOR), d.box(85.0, low, 130.0, ["gyro"], SENSOR)
    level = d.box(315.0, top, 190.0, ["a{x} cos α − a{y} sin α"], VELOCITY)
    speed = d.box(495.0, top, 55.0, ["∫"], VELOCITY)
    rate, place = d.box(595.0, top, 55.0, ["1/R"], POSITION), d.box(695.0, top, 55.0, ["∫"], POSITION)
    turned, total = d.box(230.0, low, 55.0, ["∫"], ATTITUDE), d.circle(315.0, low, _SUM, style.INK, "+")
    d.line([sensors.right, level.left], SENSOR, "a{x}, a{y}")
    d.line([level.right, speed.left], VELOCITY, "a{ξ}")
    d.line([speed.right, rate.left], VELOCITY, "V")
    d.line([rate.right, place.left], POSITION)
    d.line([place.right, (762.0, top)], POSITION, "y")
    d.line([gyro.right, turned.left], SENSOR, "ω")
    d.line([turned.right, total.left], ATTITUDE, "∫ω")
    d.line([total.top, level.bottom], ATTITUDE, "α = ∫ω dt + y")
    d.line([(742.0, top), (742.0, low), total.right], POSITION)
    d.text(535.0, low - 13.0, "y: the horizon turns with the place", POSITION)
    return d.svg()


def schuler_loop() -> str:
    """Draw the loop of the errors of the one-component system."""
    d = Drawing(660.0, 190.0, "loop of the errors of the one-component system")
    top, low = 45.0, 145.0
    push, tilt = d.circle(125.0, top, _SUM, style.INK, "+"), d.circle(555.0, low, _SUM, style.INK, "+")
    speed, rate = d.box(235.0, top, 55.0, ["∫"], VELOCITY), d.box(350.0, top, 55.0, ["1/R"], POSITION)
    place, gravity = d.box(475.0, top, 55.0, ["∫"], POSITION), d.box(350.0, low, 55.0, ["−g"], ATTITUDE)
    d.line([(30.0, top), push.left], SENSOR, "Δa")
    d.line([push.right, speed.left], VELOCITY, "ΔV̇")
    d.line([speed.right, rate.left], VELOCITY, "ΔV")
    d.line([rate.right, place.left], POSITION, "Δẏ")
    d.line([place.right, (630.0, top)], POSITION, "Δy")
    d.line([(555.0, top), tilt.top], POSITION)
    d.line([(650.0, low), tilt.right], SENSOR, "∫Δω dt")
    d.line([tilt.left, gravity.right], ATTITUDE, "Δα: tilt")
    d.line([gravity.left, (125.0, low), push.bottom], ATTITUDE, "gravity on ξ")
    return d.svg()


def strapdown_scheme() -> str:
    """Draw the scheme of the system with three components."""
    d = Drawing(870.0, 335.0, "scheme of the system with three components")
    top, low = 50.0, 200.0
    force = d.box(415.0, top, 95.0, ["C{nb} f"], VELOCITY)
    attitude = d.box(415.0, low, 115.0, ["attitude", "C{nb}"], ATTITUDE)
    for words, chosen, measured in ((["three", "accelerometers"], force, "f"), (["three gyros"], attitude, "ω{b}")):
        sensors = d.box(85.0, chosen.y, 140.0, words, SENSOR)
        compensation = d.box(250.0, chosen.y, 125.0, ["compensation", "of errors"], SENSOR)
        d.line([sensors.right, compensation.left], SENSOR)
        d.line([compensation.right, chosen.left], SENSOR, measured)
    total, speed = d.circle(515.0, top, _SUM, style.INK, "+"), d.box(615.0, top, 55.0, ["∫"], VELOCITY)
    place = d.box(755.0, top, 95.0, ["position", "B, L, H"], POSITION)
    earth = d.box(700.0, low, 205.0, ["g, Ω, ω, R{1}, R{2}", "Coriolis and transport"], POSITION)
    angles = d.box(415.0, 300.0, 115.0, ["γ, ϑ, heading"], ATTITUDE)
    d.line([attitude.top, force.bottom], ATTITUDE, "C{nb}")
    d.line([attitude.bottom, angles.top], ATTITUDE)
    d.line([force.right, total.left], VELOCITY)
    d.line([total.right, speed.left], VELOCITY)
    d.line([speed.right, place.left], VELOCITY, "V")
    edge = earth.top[1]
    d.line([(675.0, top), (675.0, edge)], VELOCITY)
    d.line([place.bottom, (755.0, edge)], POSITION)
    d.line([(630.0, edge), (630.0, 135.0), (515.0, 135.0), total.bottom], POSITION)
    d.text(527.0, 120.0, "g − (2Ω + ω) × V", POSITION, "start")
    d.line([earth.left, attitude.right], POSITION, "Ω + ω")
    d.line([place.right, (855.0, top)], POSITION)
    return d.svg()


def frames() -> str:
    """Draw the axes of navigation on the Earth, and those of the body with its angles."""
    d = Drawing(780.0, 400.0, "axes of navigation and of the body")
    centre, a, flat, latitude = (190.0, 225.0), 145.0, 130.0 / 145.0, 42.0
    d.arc(centre, a, 0.0, 2.0 * np.pi, flat=flat)
    d.arc(centre, a, np.pi, 2.0 * np.pi, flat=25.0 / 145.0)
    d.line([centre, (190.0, 25.0)])
    d.text(162.0, 30.0, "Z, Ω", soft=True)
    angle = np.deg2rad(latitude)
    normal = a / float(np.sqrt(1.0 - (1.0 - flat**2) * np.sin(angle) ** 2))  # R₂ of the drawn ellipse
    here = ray((centre[0] + normal * (1.0 - flat**2) * float(np.cos(angle)), centre[1]), normal * flat**2, latitude)
    foot = (centre[0] + normal * (1.0 - flat**2) * float(np.cos(angle)), centre[1])
    d.line([foot, here], head=False, dashes=_DASHES)
    d.line([centre, (centre[0] + a, centre[1])], head=False)
    d.arc(foot, 45.0, 0.0, angle, POSITION)
    d.text(foot[0] + 60.0, foot[1] - 20.0, "B", POSITION)
    for name, degrees in (("H", latitude), ("N", latitude + 90.0)):
        d.line([here, ray(here, 85.0, degrees)], VELOCITY)
        d.text(*ray(here, 97.0, degrees), name, VELOCITY)
    d.circle(*here, 9.0, VELOCITY, "×")  # an axis into the paper
    d.text(here[0] + 5.0, here[1] + 25.0, "E", VELOCITY)
    d.text(190.0, 385.0, "navigation: N north, H up, E east", VELOCITY)
    _body(d)
    d.text(575.0, 385.0, "turns and rates: ψ about H, ϑ about level Z, γ about X", SENSOR)
    return d.svg()


_ORIGIN, _UNIT = (555.0, 245.0), 100.0  # of the body's axes, px
_TURN, _UP = np.deg2rad(-38.0), np.deg2rad(20.0)  # from where they are seen


def _seen(vector: Array) -> Point:
    """Return where a vector in north, up, east ends on the drawing, px."""
    n, h, e = (float(v) for v in vector)
    x, depth = n * np.cos(_TURN) - e * np.sin(_TURN), n * np.sin(_TURN) + e * np.cos(_TURN)
    return _ORIGIN[0] + _UNIT * float(x), _ORIGIN[1] - _UNIT * float(h * np.cos(_UP) - depth * np.sin(_UP))


def _body(d: Drawing) -> None:
    """Draw north, up and east in perspective with the body's axes, the three turns, and the vectors of their rates."""
    # yaw is counter-clockwise about H, so that the heading is 45°; then pitch about the level Z, then roll about X
    psi, theta, gamma = np.deg2rad(-45.0), np.deg2rad(28.0), np.deg2rad(25.0)
    origin, (north, height, east) = np.zeros(3), np.eye(3)
    flat, level = np.cos(psi) * north - np.sin(psi) * east, np.sin(psi) * north + np.cos(psi) * east
    forward, upright = np.cos(theta) * flat + np.sin(theta) * height, np.cos(theta) * height - np.sin(theta) * flat
    above, right = np.cos(gamma) * upright + np.sin(gamma) * level, np.cos(gamma) * level - np.sin(gamma) * upright
    for name, tip, color, (x, y) in (
        ("N", 1.5 * north, VELOCITY, (15.0, -5.0)),
        ("H", 1.5 * height, VELOCITY, (-10.0, -15.0)),
        ("E", 1.5 * east, VELOCITY, (10.0, 14.0)),
        ("X", 1.7 * forward, SENSOR, (15.0, -5.0)),
        ("Y", 1.3 * above, SENSOR, (-12.0, -10.0)),
        ("Z", 1.3 * right, SENSOR, (-14.0, 5.0)),
    ):
        end = _seen(tip)
        d.line([_seen(origin), end], color, width=1.8)
        d.text(end[0] + x, end[1] + y, name, color)
    for start, tip, dashes in (
        (origin, 1.5 * flat, _DASHES), (1.5 * flat, 1.7 * forward, _DOTS), (origin, 1.3 * level, _DASHES),
        (origin, 1.3 * upright, _DASHES),
    ):  # fmt: skip
        d.line([_seen(start), _seen(tip)], head=False, dashes=dashes)
    for name, first, second, angle, radius, apart, part in (  # turns from one axis towards another one
        ("−ψ", north, east, -psi, 0.6, 0.8, 0.5),
        ("ϑ", flat, height, theta, 1.0, 1.18, 0.4),
        ("γ", upright, level, gamma, 1.1, 1.28, 0.5),
    ):
        turn = [np.cos(t) * first + np.sin(t) * second for t in np.linspace(0.0, angle, 30)]
        d.line([_seen(radius * arm) for arm in turn], ATTITUDE)
        d.text(*_seen(apart * (np.cos(part * angle) * first + np.sin(part * angle) * second)), name, ATTITUDE)
    for name, distance, axis, (x, y) in (  # the rates are vectors along the axes of the turns
        ("ψ̇", 0.9, height, (16.0, -2.0)),
        ("ϑ̇", 0.8, level, (-5.0, 17.0)),
        ("γ̇", 1.1, forward, (0.0, -20.0)),
    ):
        tip = _seen((distance + 0.42) * axis)
        d.line([_seen(distance * axis), tip], POSITION, width=3.0)
        d.text(tip[0] + x, tip[1] + y, name, POSITION)


def three_rates() -> str:
    """Draw what runs at the fast, the medium and the slow rate."""
    d = Drawing(760.0, 320.0, "what runs at the fast, the medium and the slow rate")
    rows = (
        (40.0, "fast", "200 Hz", ["increments, compensation,", "attitude, matrix C{nb}"], ATTITUDE, 20),
        (150.0, "medium", "50 Hz", ["projection by C{nb}, Coriolis,", "gravity, velocity V"], VELOCITY, 5),
        (260.0, "slow", "10 Hz", ["position, radii,", "Ω, ω, gravity"], POSITION, 1),
    )
    blocks = []
    for y, name, rate, lines, color, count in rows:
        d.text(50.0, y - 7.5, name, color)
        d.text(50.0, y + 7.5, rate, color)
        blocks.append(d.box(225.0, y, 210.0, lines, color))
        d.line([(390.0, y + 20.0), (740.0, y + 20.0)], head=False, width=1.0)
        for edge in np.linspace(400.0, 730.0, count + 1).tolist():
            d.line([(edge, y + 20.0), (edge, y - 20.0)], color, head=False, width=2.4)
    for upper, lower, down, up, color in zip(
        blocks, blocks[1:], ("C{nb}, ΔV", "V"), ("Ω + ω", "Ω + ω, g"), (ATTITUDE, VELOCITY), strict=False
    ):  # fmt: skip
        x, top, bottom = upper.x - 55.0, upper.bottom[1], lower.top[1]
        d.line([(x, top), (x, bottom)], color)
        d.text(x - 8.0, 0.5 * (top + bottom), down, color, "end")
        d.line([(x + 110.0, bottom), (x + 110.0, top)], POSITION, up)
    d.text(565.0, 305.0, "0.1 s", soft=True)
    for start, end in ((530.0, 400.0), (600.0, 730.0)):
        d.line([(start, 305.0), (end, 305.0)])
    return d.svg()


DIAGRAMS: dict[str, Callable[[], str]] = {
    draw.__name__: draw
    for draw in (one_component_axes, one_component_scheme, schuler_loop, strapdown_scheme, frames, three_rates)
}
"""Every diagram by the name of its file."""
