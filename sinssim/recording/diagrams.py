"""Block diagrams and axes for reports and docs/questions.md.

They show what the strapdown chapter explains in figures of its own: the axes and the scheme of the one-component
system, the loop of its errors, the scheme of three components, its axes, and the three rates. They are drawn anew, with
the chapter's symbols.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.exhibits import Picture
from sinssim.recording import style
from sinssim.recording.figures import new_figure, styled, to_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OUTLINE, _STROKE = 1.5, 1.2  # width of a block's outline and of an arrow, pt

SENSOR, ATTITUDE, VELOCITY, POSITION = (
    style.css(style.COLORS[name]) for name in ("measured", "attitude", "gyro bias", "position")
)
"""Colours: what is measured, attitude, velocity, position."""

Point = tuple[float, float]


class Canvas:
    """A drawing with inches as coordinates, on which text has its true size.

    Args:
        width, height: inches.
    """

    def __init__(self, width: float, height: float) -> None:
        self.figure: Figure = new_figure(width, height)
        self.figure.set_layout_engine("none")
        self.axes: Axes = self.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        self.axes.set(xlim=(0.0, width), ylim=(0.0, height), aspect="equal")
        self.axes.set_axis_off()

    def text(self, x: float, y: float, words: str, color: str = style.INK, **options: Any) -> None:
        """Write centred words."""
        options = {"ha": "center", "va": "center", "fontsize": style.TEXT, **options}
        self.axes.text(x, y, words, color=color, **options)

    def box(self, x: float, y: float, w: float, h: float, words: str, color: str) -> None:
        """Draw a block with its centre at x, y."""
        from matplotlib.patches import FancyBboxPatch

        corner = (x - 0.5 * w, y - 0.5 * h)
        shape = FancyBboxPatch(
            corner, w, h, boxstyle="round,pad=0,rounding_size=0.06", fc="white", ec=color, lw=_OUTLINE
        )
        self.axes.add_patch(shape)
        self.text(x, y, words)

    def sum(self, x: float, y: float) -> None:
        """Draw the sign of a sum."""
        from matplotlib.patches import Circle

        self.axes.add_patch(Circle((x, y), 0.13, fc="white", ec=style.INK, lw=_STROKE, zorder=3))
        self.text(x, y, "+", zorder=4)

    def path(
        self, *points: Point, color: str = style.SOFT, width: float = _STROKE, head: bool = True, dash: str = "-"
    ) -> None:
        """Draw a line through points, with an arrow at its end."""
        x, y = zip(*points, strict=True)
        start = len(points) - (1 if head else 0)
        self.axes.plot(x[:start], y[:start], color=color, lw=width, ls=dash, solid_capstyle="butt")
        if head:
            arrow = {"arrowstyle": "-|>", "color": color, "lw": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 10}
            self.axes.annotate("", xy=points[-1], xytext=points[-2], arrowprops={**arrow, "ls": dash})

    def arc(self, centre: Point, radius: float, first: float, last: float, color: str = style.INK) -> None:
        """Draw an arc between two directions in degrees."""
        from matplotlib.patches import Arc

        self.axes.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=first, theta2=last, color=color, lw=_STROKE))


def ray(start: Point, length: float, degrees: float) -> tuple[Point, Point]:
    """Return the ends of a line from a point in a direction."""
    angle = np.deg2rad(degrees)
    return start, (start[0] + length * float(np.cos(angle)), start[1] + length * float(np.sin(angle)))


@styled
def one_component_axes() -> Figure:
    """Draw the vertical plane: Earth, local horizon, axes of the accelerometers, and the coordinate."""
    c = Canvas(5.6, 4.3)
    centre, radius, along = (2.6, 0.35), 2.3, 62.0
    c.arc(centre, radius, 20.0, 160.0, style.SOFT)
    for degrees, words, place in ((90.0, "start", (2.33, 1.0)), (along, "R", (3.33, 1.3))):
        c.path(*ray(centre, radius, degrees), color=style.SOFT, head=False, dash="--")
        c.text(*place, words, style.SOFT)
    c.arc(centre, 0.7, along, 90.0, POSITION)
    c.text(2.88, 1.22, "y", POSITION)
    here = ray(centre, radius, along)[1]
    begin = ray(centre, radius, 90.0)[1]
    for degrees, words, place in ((0.0, "ξ$_0$", (1.0, 0.0)), (90.0, "η$_0$", (0.0, 0.95))):
        c.path(*ray(begin, 0.8, degrees), color=style.SOFT)
        c.text(begin[0] + place[0], begin[1] + place[1], words, style.SOFT)
    c.path(*ray(here, 1.5, 0.0), color=style.SOFT, head=False, dash="--")  # parallel to ξ₀ of the start
    c.text(5.33, 2.38, "ξ$_0$", style.SOFT)
    c.arc(here, 1.15, along - 90.0, 0.0, POSITION)
    c.text(*ray(here, 1.26, 0.5 * (along - 90.0))[1], "y", POSITION)
    horizon = along - 90.0
    c.path(*ray(here, 1.35, horizon), color=VELOCITY)
    c.text(5.0, 1.65, "ξ, V", VELOCITY)
    c.path(*ray(here, 1.2, along), color=VELOCITY)
    c.text(4.35, 3.6, "η", VELOCITY)
    pitch = 24.0
    c.path(*ray(here, 1.35, horizon + pitch), color=SENSOR)
    c.text(5.05, 2.22, "x", SENSOR)
    c.path(*ray(here, 1.2, along + pitch), color=SENSOR)
    c.text(3.78, 3.72, "y", SENSOR)
    c.arc(here, 0.75, horizon, horizon + pitch, ATTITUDE)
    c.text(*ray(here, 0.92, horizon + 0.5 * pitch)[1], "α", ATTITUDE)
    c.path(*ray(here, 0.62, along + 180.0), color=style.INK, width=1.6)
    c.text(3.62, 1.72, "g", style.INK)
    legend = (
        ("x, y: axes of the accelerometers", SENSOR),
        ("ξ, η: local horizon and vertical", VELOCITY),
        ("ξ$_0$, η$_0$: the same at the start", style.SOFT),
        ("α: pitch of x above the horizon", ATTITUDE),
        ("y = S/R: coordinate on the Earth", POSITION),
    )
    for line, (words, color) in enumerate(legend):
        c.text(0.15, 4.05 - 0.25 * line, words, color, ha="left")
    return c.figure


@styled
def one_component_scheme() -> Figure:
    """Draw the scheme of the one-component system."""
    c = Canvas(7.7, 2.6)
    c.box(0.85, 2.1, 1.3, 0.5, "accelerometers", SENSOR)
    c.box(0.85, 0.6, 1.3, 0.5, "gyro", SENSOR)
    c.box(3.15, 2.1, 1.9, 0.5, "a$_x$ cos α − a$_y$ sin α", VELOCITY)
    c.box(4.95, 2.1, 0.55, 0.5, "∫", VELOCITY)
    c.box(5.95, 2.1, 0.55, 0.5, "1/R", POSITION)
    c.box(6.95, 2.1, 0.55, 0.5, "∫", POSITION)
    c.box(2.3, 0.6, 0.55, 0.5, "∫", ATTITUDE)
    c.sum(3.15, 0.6)
    c.path((1.5, 2.1), (2.2, 2.1), color=SENSOR)
    c.text(1.85, 2.3, "a$_x$, a$_y$", SENSOR)
    c.path((4.1, 2.1), (4.675, 2.1), color=VELOCITY)
    c.text(4.38, 2.3, "a$_ξ$", VELOCITY)
    c.path((5.225, 2.1), (5.675, 2.1), color=VELOCITY)
    c.text(5.45, 2.3, "V", VELOCITY)
    c.path((6.225, 2.1), (6.675, 2.1), color=POSITION)
    c.path((7.225, 2.1), (7.6, 2.1), color=POSITION)
    c.text(7.42, 2.3, "y", POSITION)
    c.path((1.5, 0.6), (2.025, 0.6), color=SENSOR)
    c.text(1.77, 0.78, "ω", SENSOR)
    c.path((2.575, 0.6), (3.02, 0.6), color=ATTITUDE)
    c.text(2.79, 0.8, "∫ω", ATTITUDE)
    c.path((3.15, 0.73), (3.15, 1.85), color=ATTITUDE)
    c.text(3.95, 1.35, "α = ∫ω dt + y", ATTITUDE)
    c.path((7.42, 2.1), (7.42, 0.6), (3.28, 0.6), color=POSITION)
    c.text(5.35, 0.78, "y: the horizon turns with the place", POSITION)
    return c.figure


@styled
def schuler_loop() -> Figure:
    """Draw the loop of the errors of the one-component system."""
    c = Canvas(6.6, 2.3)
    c.sum(1.25, 1.6)
    c.box(2.35, 1.6, 0.55, 0.5, "∫", VELOCITY)
    c.box(3.5, 1.6, 0.55, 0.5, "1/R", POSITION)
    c.box(4.75, 1.6, 0.55, 0.5, "∫", POSITION)
    c.box(3.5, 0.5, 0.55, 0.5, "−g", ATTITUDE)
    c.sum(5.55, 0.5)
    c.path((0.3, 1.6), (1.12, 1.6), color=SENSOR)
    c.text(0.65, 1.78, "Δa", SENSOR)
    c.path((1.38, 1.6), (2.075, 1.6), color=VELOCITY)
    c.text(1.72, 1.82, "ΔV̇", VELOCITY)
    c.path((2.625, 1.6), (3.225, 1.6), color=VELOCITY)
    c.text(2.92, 1.79, "ΔV", VELOCITY)
    c.path((3.775, 1.6), (4.475, 1.6), color=POSITION)
    c.text(4.12, 1.82, "Δẏ", POSITION)
    c.path((5.025, 1.6), (6.3, 1.6), color=POSITION)
    c.text(6.0, 1.78, "Δy", POSITION)
    c.path((5.55, 1.6), (5.55, 0.63), color=POSITION)
    c.path((6.45, 0.5), (5.68, 0.5), color=SENSOR)
    c.text(6.1, 0.7, "∫Δω dt", SENSOR)
    c.path((5.42, 0.5), (3.775, 0.5), color=ATTITUDE)
    c.text(4.6, 0.68, "Δα: tilt", ATTITUDE)
    c.path((3.225, 0.5), (1.25, 0.5), (1.25, 1.47), color=ATTITUDE)
    c.text(2.25, 0.68, "gravity on ξ", ATTITUDE)
    return c.figure


@styled
def strapdown_scheme() -> Figure:
    """Draw the scheme of the system with three components."""
    c = Canvas(8.7, 3.8)
    top, low = 3.2, 1.5
    c.box(0.85, top, 1.4, 0.6, "three\naccelerometers", SENSOR)
    c.box(0.85, low, 1.4, 0.6, "three gyros", SENSOR)
    for y in (top, low):
        c.box(2.5, y, 1.25, 0.6, "compensation\nof errors", SENSOR)
        c.path((1.55, y), (1.875, y), color=SENSOR)
    c.box(4.15, top, 0.95, 0.6, "C$_{nb}$ f", VELOCITY)
    c.sum(5.15, top)
    c.box(6.15, top, 0.55, 0.6, "∫", VELOCITY)
    c.box(7.55, top, 0.95, 0.6, "position\nB, L, H", POSITION)
    c.box(4.15, low, 1.15, 0.6, "attitude\nC$_{nb}$", ATTITUDE)
    c.box(7.0, low, 2.05, 0.6, "g,  Ω,  ω,  R$_1$,  R$_2$\nCoriolis and transport", POSITION)
    c.box(4.15, 0.4, 1.15, 0.5, "γ, ϑ, heading", ATTITUDE)
    c.path((3.125, top), (3.675, top), color=SENSOR)
    c.text(3.4, top + 0.18, "f", SENSOR)
    c.path((3.125, low), (3.575, low), color=SENSOR)
    c.text(3.35, low + 0.2, "ω$_b$", SENSOR)
    c.path((4.15, low + 0.3), (4.15, top - 0.3), color=ATTITUDE)
    c.text(3.85, 2.35, "C$_{nb}$", ATTITUDE)
    c.path((4.15, low - 0.3), (4.15, 0.65), color=ATTITUDE)
    c.path((4.625, top), (5.02, top), color=VELOCITY)
    c.path((5.28, top), (5.875, top), color=VELOCITY)
    c.path((6.425, top), (7.075, top), color=VELOCITY)
    c.text(6.75, top + 0.18, "V", VELOCITY)
    c.path((6.75, top), (6.75, low + 0.3), color=VELOCITY)
    c.path((7.55, top - 0.3), (7.55, low + 0.3), color=POSITION)
    c.path((6.3, low + 0.3), (6.3, 2.3), (5.15, 2.3), (5.15, top - 0.13), color=POSITION)
    c.text(5.27, 2.5, "g − (2Ω + ω) × V", POSITION, ha="left")
    c.path((5.975, low), (4.725, low), color=POSITION)
    c.text(5.4, low + 0.2, "Ω + ω", POSITION)
    c.path((8.025, top), (8.55, top), color=POSITION)
    return c.figure


@styled
def frames() -> Figure:
    """Draw the axes of navigation on the Earth, and those of the body with its angles."""
    from matplotlib.patches import Arc, Circle, Ellipse

    c = Canvas(7.8, 4.1)
    centre, a, b, latitude = (1.9, 1.75), 1.45, 1.3, 42.0
    c.axes.add_patch(Ellipse(centre, 2 * a, 2 * b, fc="none", ec=style.SOFT, lw=_STROKE))
    c.axes.add_patch(Arc(centre, 2 * a, 0.5, theta1=180.0, theta2=360.0, color=style.SOFT, lw=style.HAIR))
    c.path(centre, (1.9, 3.75), color=style.SOFT)
    c.text(1.62, 3.7, "Z, Ω", style.SOFT)
    angle = np.deg2rad(latitude)
    normal = a / np.sqrt(1.0 - (1.0 - (b / a) ** 2) * np.sin(angle) ** 2)  # R₂ of the drawn ellipse
    here = (centre[0] + normal * np.cos(angle), centre[1] + normal * (b / a) ** 2 * np.sin(angle))
    foot = (here[0] - here[1] / np.tan(angle) + centre[1] / np.tan(angle), centre[1])
    c.path(foot, here, color=style.SOFT, head=False, dash="--")
    c.path(centre, (centre[0] + a, centre[1]), color=style.SOFT, head=False)
    c.arc(foot, 0.45, 0.0, latitude, POSITION)
    c.text(foot[0] + 0.6, foot[1] + 0.2, "B", POSITION)
    c.path(*ray(here, 0.85, latitude), color=VELOCITY)
    c.text(here[0] + 0.78, here[1] + 0.55, "H", VELOCITY)
    c.path(*ray(here, 0.85, latitude + 90.0), color=VELOCITY)
    c.text(here[0] - 0.62, here[1] + 0.8, "N", VELOCITY)
    c.axes.add_patch(Circle(here, 0.09, fc="white", ec=VELOCITY, lw=_OUTLINE, zorder=4))
    for turn in (45.0, 135.0):  # a cross in a circle: an axis into the paper
        (x0, y0), (x1, y1) = ray(here, 0.09, turn)[1], ray(here, 0.09, turn + 180.0)[1]
        c.axes.plot((x0, x1), (y0, y1), color=VELOCITY, lw=_STROKE, zorder=5)
    c.text(here[0] + 0.05, here[1] - 0.27, "E", VELOCITY)
    c.text(1.9, 0.15, "navigation: N north, H up, E east", VELOCITY)
    _body(c)
    return c.figure


def _body(c: Canvas) -> None:
    """Draw north, up and east in perspective with the body's axes, the three turns, and the vectors of their rates."""
    turn = np.deg2rad(-38.0)
    across, up = np.array([np.sin(turn), np.cos(turn)]), np.deg2rad(20.0)

    def seen(n: float, h: float, e: float) -> Point:
        x = n * across[1] + e * -across[0]
        depth = n * across[0] + e * across[1]
        return 5.55 + float(x), 1.55 + float(h * np.cos(up) - depth * np.sin(up))

    def arc(first: Any, second: Any, end: float, radius: float) -> None:
        """Draw a turn from one axis towards another one, with an arrow at its end."""
        angles = np.linspace(0.0, end, 30)
        points = [seen(*(radius * (np.cos(k) * first + np.sin(k) * second))) for k in angles]
        c.axes.plot(*zip(*points[:-1], strict=True), color=ATTITUDE, lw=_STROKE)
        c.path(points[-2], points[-1], color=ATTITUDE)

    # yaw is counter-clockwise about H, so that the heading is 45°; then pitch about the level Z, then roll about X
    psi, theta, gamma = np.deg2rad(-45.0), np.deg2rad(28.0), np.deg2rad(25.0)
    north, height, east = np.eye(3)
    flat, level = np.cos(psi) * north - np.sin(psi) * east, np.sin(psi) * north + np.cos(psi) * east
    forward = np.cos(theta) * flat + np.sin(theta) * height
    upright = -np.sin(theta) * flat + np.cos(theta) * height
    above, right = np.cos(gamma) * upright + np.sin(gamma) * level, np.cos(gamma) * level - np.sin(gamma) * upright
    for name, tip, color, gap in (
        ("N", 1.5 * north, VELOCITY, (0.15, 0.05)),
        ("H", 1.5 * height, VELOCITY, (-0.1, 0.15)),
        ("E", 1.5 * east, VELOCITY, (0.1, -0.14)),
        ("X", 1.7 * forward, SENSOR, (0.15, 0.05)),
        ("Y", 1.3 * above, SENSOR, (-0.12, 0.1)),
        ("Z", 1.3 * right, SENSOR, (-0.14, -0.05)),
    ):
        end = seen(*tip)
        c.path(seen(0, 0, 0), end, color=color, width=1.5)
        c.text(end[0] + gap[0], end[1] + gap[1], name, color)
    for line, dash in (((0.0 * flat, 1.5 * flat), "--"), ((1.5 * flat, 1.7 * forward), ":")):
        c.path(*(seen(*point) for point in line), color=style.SOFT, head=False, dash=dash)
    for line in ((0.0 * level, 1.3 * level), (0.0 * upright, 1.3 * upright)):
        c.path(*(seen(*point) for point in line), color=style.SOFT, head=False, dash="--")
    arc(north, east, -psi, 0.6)
    arc(flat, height, theta, 1.0)
    arc(upright, level, gamma, 1.1)
    for name, start, axis, gap in (  # the rates are vectors along the axes of the turns
        ("ψ̇", 0.9 * height, height, (0.16, 0.02)),
        ("ϑ̇", 0.8 * level, level, (-0.05, -0.17)),
        ("γ̇", 1.1 * forward, forward, (0.0, 0.2)),
    ):
        tip = seen(*(start + 0.42 * axis))
        c.path(seen(*start), tip, color=POSITION, width=2.6)
        c.text(tip[0] + gap[0], tip[1] + gap[1], name, POSITION)
    middle = seen(*(0.8 * (np.cos(0.5 * psi) * north - np.sin(0.5 * psi) * east)))
    c.text(*middle, "−ψ", ATTITUDE)
    c.text(*seen(*(1.18 * (np.cos(0.4 * theta) * flat + np.sin(0.4 * theta) * height))), "ϑ", ATTITUDE)
    c.text(*seen(*(1.28 * (np.cos(0.5 * gamma) * upright + np.sin(0.5 * gamma) * level))), "γ", ATTITUDE)
    c.text(5.75, 0.15, "turns and rates: ψ about H, ϑ about level Z, γ about X", SENSOR)


@styled
def three_rates() -> Figure:
    """Draw what runs at the fast, the medium and the slow rate."""
    c = Canvas(7.6, 3.5)
    rows = (
        (2.9, "fast\n200 Hz", "increments, compensation,\nattitude, matrix C$_{nb}$", ATTITUDE, 20),
        (1.8, "medium\n50 Hz", "projection by C$_{nb}$, Coriolis,\ngravity, velocity V", VELOCITY, 5),
        (0.7, "slow\n10 Hz", "position, radii,\nΩ, ω, gravity", POSITION, 1),
    )
    for y, rate, words, color, count in rows:
        c.text(0.5, y, rate, color)
        c.box(2.25, y, 2.1, 0.62, words, color)
        c.path((3.9, y - 0.2), (7.4, y - 0.2), color=style.SOFT, head=False, width=style.HAIR)
        for edge in np.linspace(4.0, 7.3, count + 1):
            c.path((edge, y - 0.2), (edge, y + 0.2), color=color, head=False, width=1.8)
    for y, words, back, color in ((2.35, "C$_{nb}$, ΔV", "Ω + ω", ATTITUDE), (1.25, "V", "Ω + ω, g", VELOCITY)):
        c.path((1.7, y + 0.24), (1.7, y - 0.24), color=color)
        c.text(1.6, y, words, color, ha="right")
        c.path((2.8, y - 0.24), (2.8, y + 0.24), color=POSITION)
        c.text(2.9, y, back, POSITION, ha="left")
    c.text(5.65, 0.2, "0.1 s", style.SOFT)
    c.path((5.3, 0.2), (4.0, 0.2))
    c.path((6.0, 0.2), (7.3, 0.2))
    return c.figure


def diagram(draw: Callable[[], Figure], key: str) -> Picture:
    """Return a diagram as an exhibit, with a name that is unique on the page."""
    return Picture(lambda: to_svg(draw(), key))


DIAGRAMS: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw
    for draw in (one_component_axes, one_component_scheme, schuler_loop, strapdown_scheme, frames, three_rates)
}
"""Every diagram by the name of its file."""
