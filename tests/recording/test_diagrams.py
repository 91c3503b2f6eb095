"""Diagrams as graphs: which block is connected with which, what stands at the connections, angles and rates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import atan2, degrees, hypot
from typing import Any

import numpy as np
import pytest

from sinssim.recording import diagrams
from sinssim.recording.diagrams import ATTITUDE, POSITION, SENSOR, VELOCITY, ray
from sinssim.recording.svg import Block, Drawing, Point


class Drawn:
    """What a diagram draws: blocks, sums, lines, and words outside blocks."""

    def __init__(self, draw: Callable[[], Any]) -> None:
        self.nodes: list[tuple[str, Block, str]] = []
        self.lines: list[tuple[Sequence[Point], str, dict[str, Any]]] = []
        self.words: list[tuple[str, float, float, str]] = []
        real = {name: getattr(Drawing, name) for name in ("box", "circle", "line", "text")}

        def box(d: Drawing, x: float, y: float, width: float, lines: Sequence[str], color: str) -> Block:
            self.nodes.append((" ".join(lines), Block(x, y, 0.5 * width, 7.5 * len(lines) + 7.0), color))
            block: Block = real["box"](d, x, y, width, lines, color)
            assert block == self.nodes[-1][1]
            return block

        def circle(d: Drawing, x: float, y: float, radius: float, color: str, sign: str = "") -> Block:
            self.nodes.append((sign, Block(x, y, radius, radius), color))
            block: Block = real["circle"](d, x, y, radius, color, sign)
            assert block == self.nodes[-1][1]
            return block

        def line(d: Drawing, points: Sequence[Point], color: str = "", words: str = "", **options: Any) -> None:
            self.lines.append((points, color, options))
            real["line"](d, points, color, words, **options)

        def text(d: Drawing, x: float, y: float, words: str, color: str = "", *place: Any, **options: Any) -> None:
            if not any(abs(x - block.x) < 1.0 and abs(y - block.y) < block.h for _, block, _ in self.nodes):
                self.words.append((words, float(x), float(y), color))
            real["text"](d, x, y, words, color, *place, **options)

        with pytest.MonkeyPatch.context() as patch:
            for name, one in (("box", box), ("circle", circle), ("line", line), ("text", text)):
                patch.setattr(Drawing, name, one)
            draw()

    def at(self, point: Point) -> str:
        """Return the words of the block whose edge a point lies on, with its number among blocks of these words."""
        for k, (words, block, _) in enumerate(self.nodes):
            x, y = abs(point[0] - block.x), abs(point[1] - block.y)
            if x < block.w + 1.0 and y < block.h + 1.0 and not (x < block.w - 1.0 and y < block.h - 1.0):
                number = sum(one[0] == words for one in self.nodes[:k]) + 1
                return f"{words}{number}" if sum(one[0] == words for one in self.nodes) > 1 else words
        return ""

    def edges(self) -> list[tuple[str, str]]:
        return [(self.at(points[0]), self.at(points[-1])) for points, *_ in self.lines]

    def label(self, start: str, end: str) -> list[str]:
        """Return the words beside the first part of a connection, at most 40 px away from its middle."""
        points = next(points for points, *_ in self.lines if (self.at(points[0]), self.at(points[-1])) == (start, end))
        x, y = np.mean(points[:2], axis=0)
        return [words for words, a, b, _ in self.words if hypot(a - x, b - y) < 40.0]


def test_the_loop_of_the_errors() -> None:
    """ΔV̇ = Δa − g Δα, Δẏ = ΔV/R, Δα = ∫Δω dt + Δy: two integrals, one division, and the feedback with −g."""
    found = Drawn(diagrams.schuler_loop)
    assert found.edges() == [
        ("", "+1"), ("+1", "∫1"), ("∫1", "1/R"), ("1/R", "∫2"), ("∫2", ""), ("", "+2"), ("", "+2"), ("+2", "−g"),
        ("−g", "+1"),
    ]  # fmt: skip
    assert found.lines[5][0][0] == (555.0, 45.0)  # the branch of Δy, on the way from the second integral
    for start, end, words in (("", "+1", "Δa"), ("+1", "∫1", "ΔV̇"), ("∫1", "1/R", "ΔV"), ("1/R", "∫2", "Δẏ"),
                              ("+2", "−g", "Δα: tilt"), ("∫2", "", "Δy")):  # fmt: skip
        assert found.label(start, end) == [words]


def test_the_scheme_of_one_component() -> None:
    """Both accelerometers through the pitch to V and y; the pitch from the gyro's integral and y."""
    found = Drawn(diagrams.one_component_scheme)
    projection = "a{x} cos α − a{y} sin α"
    assert found.edges() == [
        ("accelerometers", projection), (projection, "∫1"), ("∫1", "1/R"), ("1/R", "∫2"), ("∫2", ""), ("gyro", "∫3"),
        ("∫3", "+"), ("+", projection), ("", "+"),
    ]  # fmt: skip
    assert found.lines[-1][0][0] == (742.0, 50.0)  # from y
    for start, end, words in (("accelerometers", projection, "a{x}, a{y}"), (projection, "∫1", "a{ξ}"),
                              ("∫1", "1/R", "V"), ("∫2", "", "y"), ("gyro", "∫3", "ω"), ("∫3", "+", "∫ω")):  # fmt: skip
        assert found.label(start, end) == [words]


def test_the_scheme_of_three_components() -> None:
    found = Drawn(diagrams.strapdown_scheme)
    errors = "compensation of errors"
    g = "g, Ω, ω, R{1}, R{2} Coriolis and transport"
    assert sorted(found.edges()) == sorted([
        ("three accelerometers", f"{errors}1"), ("three gyros", f"{errors}2"), (f"{errors}1", "C{nb} f"),
        (f"{errors}2", "attitude C{nb}"), ("attitude C{nb}", "C{nb} f"),
        ("attitude C{nb}", "γ, ϑ, heading"), ("C{nb} f", "+"), ("+", "∫"), ("∫", "position B, L, H"), ("", g),
        ("position B, L, H", g), (g, "+"), (g, "attitude C{nb}"), ("position B, L, H", ""),
    ])  # fmt: skip
    assert found.label(f"{errors}1", "C{nb} f") == ["f"]
    assert found.label(f"{errors}2", "attitude C{nb}") == ["ω{b}"]
    assert found.label("∫", "position B, L, H") == ["V"]
    assert found.label(g, "attitude C{nb}") == ["Ω + ω"]
    assert found.label("attitude C{nb}", "C{nb} f") == ["C{nb}"]
    colors = {words: color for words, *_, color in found.nodes}
    assert [colors[name] for name in ("three gyros", "∫", "position B, L, H", "attitude C{nb}")] == [
        SENSOR, VELOCITY, POSITION, ATTITUDE,
    ]  # fmt: skip


def test_the_rates() -> None:
    """Within the 0.1 s of the drawing, as many intervals as the rate says: 20, 5 and 1."""
    found = Drawn(diagrams.three_rates)
    rates = {y - 7.5: words for words, x, y, _ in found.words if words.endswith("Hz")}
    names = {y + 7.5: words for words, x, y, _ in found.words if x == 50.0 and not words.endswith("Hz")}
    assert [(names[y], rates[y]) for y in sorted(rates)] == [("fast", "200 Hz"), ("medium", "50 Hz"), ("slow", "10 Hz")]
    assert {rates[block.y]: words for words, block, _ in found.nodes} == {
        "200 Hz": "increments, compensation, attitude, matrix C{nb}",
        "50 Hz": "projection by C{nb}, Coriolis, gravity, velocity V",
        "10 Hz": "position, radii, Ω, ω, gravity",
    }
    for y, name in rates.items():
        marks = sorted(points[0][0] for points, *_ in found.lines
                       if points[0] == (points[1][0], y + 20.0) and points[1][1] == y - 20.0)  # fmt: skip
        count = float(name.split()[0]) * 0.1
        np.testing.assert_allclose(marks, 400.0 + 330.0 * np.arange(count + 1.0) / count)
    span = [points for points, *_ in found.lines if points[0][1] == points[1][1] == 305.0]
    assert [one[-1] for one in span] == [(400.0, 305.0), (730.0, 305.0)]
    assert ("0.1 s", 565.0) in [(words, x) for words, x, *_ in found.words]
    down = [points for points, *_ in found.lines if points[0][0] == points[-1][0] == 170.0]
    up = [points for points, *_ in found.lines if points[0][0] == points[-1][0] == 280.0]
    assert len(down) == len(up) == 2
    assert all(points[0][1] < points[1][1] for points in down)
    assert all(points[0][1] > points[1][1] for points in up)


def test_the_axes_of_one_component() -> None:
    """The place 28° from the start: its horizon dips by 28°, and x is raised by the pitch of 24°."""
    found = Drawn(diagrams.one_component_axes)
    turned: dict[str, list[float]] = {}
    for points, color, options in found.lines:
        if options.get("head", True):
            (x0, y0), (x1, y1) = points
            turned.setdefault(color, []).append(degrees(atan2(y0 - y1, x1 - x0)))
    assert turned[VELOCITY] == [pytest.approx(-28.0), pytest.approx(62.0)]
    assert turned[SENSOR] == [pytest.approx(-4.0), pytest.approx(86.0)]
    assert turned["#1c1c1c"] == [pytest.approx(62.0 + 180.0 - 360.0)]  # gravity, towards the centre
    words = [one[0] for one in found.words]
    assert {"x, y: axes of the accelerometers", "ξ, η: local horizon and vertical", "α: pitch of x above the horizon",
            "y = S/R: coordinate on the Earth", "ξ, V", "η", "g", "α"} <= set(words)  # fmt: skip


def test_a_ray() -> None:
    """30° from the x axis: a run of √3 for a rise of 1, upwards on the page."""
    assert ray((1.0, 2.0), 4.0, 30.0) == (pytest.approx(1.0 + 12.0**0.5), pytest.approx(0.0))


def test_the_axes_of_navigation() -> None:
    """On the drawn ellipse the vertical H is at right angles to it, N along it to the pole, E into the paper."""
    found = Drawn(diagrams.frames)
    tips = {name: (x, y) for name, x, y, color in found.words if color == VELOCITY}
    assert {"N", "H", "E"} <= set(tips)
    arrows = [points for points, color, options in found.lines if color == VELOCITY and "width" not in options]
    up, north = (degrees(atan2(a[1] - b[1], b[0] - a[0])) for a, b in arrows)
    assert (up, north) == (pytest.approx(42.0), pytest.approx(132.0))
    (x, y), *_ = arrows[0]
    # the point lies on the ellipse with the half axes 145 and 130 px about (190, 225), where its normal has 42°
    u, v = x - 190.0, 225.0 - y
    assert (u / 145.0) ** 2 + (v / 130.0) ** 2 == pytest.approx(1.0)
    assert degrees(atan2(v / 130.0**2, u / 145.0**2)) == pytest.approx(42.0)
    whole, front = (np.array(points) for points, color, _ in found.lines if not color and len(points) > 50)
    for drawn, b in ((whole, 130.0), (front, 25.0)):
        assert ((drawn[:, 0] - 190.0) / 145.0) ** 2 + ((drawn[:, 1] - 225.0) / b) ** 2 == pytest.approx(1.0)
    assert (front[:, 1] > 224.99).all()


def test_the_axes_of_the_body() -> None:
    """Projected from the side at 38° and 20° above: X turned by the heading of 45° and raised by 28°, H upright."""
    found = Drawn(diagrams.frames)
    centre = (555.0, 245.0)
    arrows = [points for points, _, options in found.lines if options.get("width") == 1.8]
    assert [points[0] for points in arrows] == [pytest.approx(centre)] * 6
    n, h, e, x, y, z = (np.subtract(points[1], centre) * (0.01, -0.01) for points in arrows)
    assert h == pytest.approx((0.0, 1.5 * np.cos(np.radians(20.0))))
    # X is the mean of north and east, turned up by 28°: of the lengths 1.5, 1.5 and 1.7
    up = np.array([0.0, np.cos(np.radians(20.0))])
    level = np.sqrt(0.5) * (n / 1.5 + e / 1.5)
    assert x == pytest.approx(1.7 * (np.cos(np.radians(28.0)) * level + np.sin(np.radians(28.0)) * up))
    # with a roll of 25°, right wing down: Z is right and down, Y to the right of upright
    right = np.sqrt(0.5) * (e / 1.5 - n / 1.5)
    upright = -np.sin(np.radians(28.0)) * level + np.cos(np.radians(28.0)) * up
    assert z == pytest.approx(1.3 * (np.cos(np.radians(25.0)) * right - np.sin(np.radians(25.0)) * upright))
    assert y == pytest.approx(1.3 * (np.cos(np.radians(25.0)) * upright + np.sin(np.radians(25.0)) * right))
    assert n[0] > 0.0  # north to the right, east towards the viewer
    assert e == pytest.approx(
        1.5 * np.array([np.sin(np.radians(38.0)), -np.cos(np.radians(38.0)) * np.sin(np.radians(20.0))])
    )
