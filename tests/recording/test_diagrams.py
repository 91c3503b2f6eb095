"""Diagrams as graphs: which block is connected with which, what stands at the connections, angles and rates."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, degrees, hypot
from typing import Any

import numpy as np
import pytest

from sinssim.recording import diagrams
from sinssim.recording.diagrams import ATTITUDE, POSITION, SENSOR, VELOCITY, Canvas, ray


class Drawn:
    """What a diagram draws: boxes, sums, paths and words."""

    def __init__(self, draw: Callable[[], Any]) -> None:
        self.nodes: list[tuple[str, float, float, float, float, str]] = []
        self.paths: list[tuple[tuple[tuple[float, float], ...], dict[str, Any]]] = []
        self.words: list[tuple[str, float, float, str]] = []
        real = {name: getattr(Canvas, name) for name in ("box", "sum", "path", "text")}

        def box(c: Canvas, x: float, y: float, w: float, h: float, words: str, color: str) -> None:
            self.nodes.append((words.replace("\n", " "), x, y, w, h, color))
            real["box"](c, x, y, w, h, words, color)

        def add(c: Canvas, x: float, y: float) -> None:
            self.nodes.append(("+", x, y, 0.26, 0.26, ""))
            real["sum"](c, x, y)

        def path(c: Canvas, *points: tuple[float, float], **options: Any) -> None:
            self.paths.append((points, options))
            real["path"](c, *points, **options)

        def text(c: Canvas, x: float, y: float, words: str, color: str = "", **options: Any) -> None:
            self.words.append((words.replace("\n", " "), float(x), float(y), color))
            real["text"](c, x, y, words, color or "black", **options)

        with pytest.MonkeyPatch.context() as patch:
            for name, one in (("box", box), ("sum", add), ("path", path), ("text", text)):
                patch.setattr(Canvas, name, one)
            draw()

    def at(self, point: tuple[float, float]) -> str:
        """Return the words of the block whose edge a point lies on, with its number among blocks of these words."""
        for k, (words, x, y, w, h, _) in enumerate(self.nodes):
            inside = abs(point[0] - x) < 0.5 * w + 0.01 and abs(point[1] - y) < 0.5 * h + 0.01
            deep = abs(point[0] - x) < 0.5 * w - 0.01 and abs(point[1] - y) < 0.5 * h - 0.01
            if inside and not deep:
                number = sum(one[0] == words for one in self.nodes[:k]) + 1
                return f"{words}{number}" if sum(one[0] == words for one in self.nodes) > 1 else words
        return ""

    def edges(self) -> list[tuple[str, str]]:
        return [(self.at(points[0]), self.at(points[-1])) for points, _ in self.paths]

    def label(self, start: str, end: str) -> list[str]:
        """Return the words beside the first part of a connection, at most 0.4 in away from its middle."""
        points = next(points for points, _ in self.paths if (self.at(points[0]), self.at(points[-1])) == (start, end))
        x, y = np.mean(points[:2], axis=0)
        return [words for words, a, b, _ in self.words if hypot(a - x, b - y) < 0.4 and words != "+"]


def test_the_loop_of_the_errors() -> None:
    """ΔV̇ = Δa − g Δα, Δẏ = ΔV/R, Δα = ∫Δω dt + Δy: two integrals, one division, and the feedback with −g."""
    found = Drawn(diagrams.schuler_loop)
    assert found.edges() == [
        ("", "+1"), ("+1", "∫1"), ("∫1", "1/R"), ("1/R", "∫2"), ("∫2", ""), ("", "+2"), ("", "+2"), ("+2", "−g"),
        ("−g", "+1"),
    ]  # fmt: skip
    assert found.paths[5][0][0] == (5.55, 1.6)  # the branch of Δy, on the way from the second integral
    for start, end, words in (("", "+1", "Δa"), ("+1", "∫1", "ΔV̇"), ("∫1", "1/R", "ΔV"), ("1/R", "∫2", "Δẏ"),
                              ("+2", "−g", "Δα: tilt"), ("∫2", "", "Δy")):  # fmt: skip
        assert found.label(start, end) == [words]


def test_the_scheme_of_one_component() -> None:
    """Both accelerometers through the pitch to V and y; the pitch from the gyro's integral and y."""
    found = Drawn(diagrams.one_component_scheme)
    projection = "a$_x$ cos α − a$_y$ sin α"
    assert found.edges() == [
        ("accelerometers", projection), (projection, "∫1"), ("∫1", "1/R"), ("1/R", "∫2"), ("∫2", ""), ("gyro", "∫3"),
        ("∫3", "+"), ("+", projection), ("", "+"),
    ]  # fmt: skip
    assert found.paths[-1][0][0] == (7.42, 2.1)  # from y
    for start, end, words in (("accelerometers", projection, "a$_x$, a$_y$"), (projection, "∫1", "a$_ξ$"),
                              ("∫1", "1/R", "V"), ("∫2", "", "y"), ("gyro", "∫3", "ω"), ("∫3", "+", "∫ω")):  # fmt: skip
        assert found.label(start, end) == [words]


def test_the_scheme_of_three_components() -> None:
    found = Drawn(diagrams.strapdown_scheme)
    errors = "compensation of errors"
    g = "g,  Ω,  ω,  R$_1$,  R$_2$ Coriolis and transport"
    assert sorted(found.edges()) == sorted([
        ("three accelerometers", f"{errors}1"), ("three gyros", f"{errors}2"), (f"{errors}1", "C$_{nb}$ f"),
        (f"{errors}2", "attitude C$_{nb}$"), ("attitude C$_{nb}$", "C$_{nb}$ f"),
        ("attitude C$_{nb}$", "γ, ϑ, heading"), ("C$_{nb}$ f", "+"), ("+", "∫"), ("∫", "position B, L, H"), ("", g),
        ("position B, L, H", g), (g, "+"), (g, "attitude C$_{nb}$"), ("position B, L, H", ""),
    ])  # fmt: skip
    assert found.label(f"{errors}1", "C$_{nb}$ f") == ["f"]
    assert found.label(f"{errors}2", "attitude C$_{nb}$") == ["ω$_b$"]
    assert found.label("∫", "position B, L, H") == ["V"]
    assert found.label(g, "attitude C$_{nb}$") == ["Ω + ω"]
    assert found.label("attitude C$_{nb}$", "C$_{nb}$ f") == ["C$_{nb}$"]
    colors = {words: color for words, *_, color in found.nodes}
    assert [colors[name] for name in ("three gyros", "∫", "position B, L, H", "attitude C$_{nb}$")] == [
        SENSOR, VELOCITY, POSITION, ATTITUDE,
    ]  # fmt: skip


def test_the_rates() -> None:
    """Within the 0.1 s of the drawing, as many intervals as the rate says: 20, 5 and 1."""
    found = Drawn(diagrams.three_rates)
    rates = {y: words for words, _, y, _ in found.words if words.endswith("Hz")}
    boxes = {y: words for words, _, y, *_ in found.nodes}
    assert [rates[y] for y in sorted(rates, reverse=True)] == ["fast 200 Hz", "medium 50 Hz", "slow 10 Hz"]
    assert {rates[y]: boxes[y] for y in rates} == {
        "fast 200 Hz": "increments, compensation, attitude, matrix C$_{nb}$",
        "medium 50 Hz": "projection by C$_{nb}$, Coriolis, gravity, velocity V",
        "slow 10 Hz": "position, radii, Ω, ω, gravity",
    }
    for y, name in rates.items():
        marks = sorted(points[0][0] for points, _ in found.paths
                       if points[0] == (points[1][0], y - 0.2) and points[1][1] == y + 0.2)  # fmt: skip
        count = float(name.split()[1]) * 0.1
        np.testing.assert_allclose(marks, 4.0 + 3.3 * np.arange(count + 1.0) / count)
    span = [points for points, _ in found.paths if points[0][1] == points[1][1] == 0.2]
    assert [one[-1] for one in span] == [(4.0, 0.2), (7.3, 0.2)]
    assert ("0.1 s", 5.65) in [(words, x) for words, x, *_ in found.words]
    down = [points for points, _ in found.paths if points[0][0] == points[-1][0] == 1.7]
    up = [points for points, _ in found.paths if points[0][0] == points[-1][0] == 2.8]
    assert all(points[0][1] > points[1][1] for points in down)
    assert all(points[0][1] < points[1][1] for points in up)


def test_the_axes_of_one_component() -> None:
    """The place 28° from the start: its horizon dips by 28°, and x is raised by the pitch of 24°."""
    found = Drawn(diagrams.one_component_axes)
    arrows = [(points, options) for points, options in found.paths if options.get("head", True)]
    turned = {}
    for points, options in arrows:
        (x0, y0), (x1, y1) = points
        turned.setdefault(options["color"], []).append(degrees(atan2(y1 - y0, x1 - x0)))
    assert turned[VELOCITY] == [pytest.approx(-28.0), pytest.approx(62.0)]
    assert turned[SENSOR] == [pytest.approx(-4.0), pytest.approx(86.0)]
    assert turned["#1c1c1c"] == [pytest.approx(62.0 + 180.0 - 360.0)]  # gravity, towards the centre
    words = [one[0] for one in found.words]
    assert {"x, y: axes of the accelerometers", "ξ, η: local horizon and vertical", "α: pitch of x above the horizon",
            "y = S/R: coordinate on the Earth", "ξ, V", "η", "g", "α"} <= set(words)  # fmt: skip


def test_a_ray() -> None:
    """30° from the x axis: a run of √3 for a rise of 1."""
    assert ray((1.0, 2.0), 4.0, 30.0) == ((1.0, 2.0), (pytest.approx(1.0 + 12.0**0.5), pytest.approx(4.0)))


def test_the_axes_of_navigation() -> None:
    """On the drawn ellipse the vertical H is at right angles to it, N along it to the pole, E into the paper."""
    found = Drawn(diagrams.frames)
    tips = {name: (x, y) for name, x, y, color in found.words if color == VELOCITY}
    assert {"N", "H", "E"} <= set(tips)
    arrows = [points for points, options in found.paths if options.get("color") == VELOCITY and "width" not in options]
    up, north = (degrees(atan2(b[1] - a[1], b[0] - a[0])) for a, b in arrows)
    assert (up, north) == (pytest.approx(42.0), pytest.approx(132.0))
    (x, y), *_ = arrows[0]
    # the point lies on the ellipse with the half axes 1.45 and 1.3 about (1.9, 1.75), where its normal has 42°
    u, v = x - 1.9, y - 1.75
    assert (u / 1.45) ** 2 + (v / 1.3) ** 2 == pytest.approx(1.0)
    assert degrees(atan2(v / 1.3**2, u / 1.45**2)) == pytest.approx(42.0)


def test_the_axes_of_the_body() -> None:
    """Projected from the side at 38° and 20° above: X turned by the heading of 45° and raised by 28°, H upright."""
    found = Drawn(diagrams.frames)
    centre = (5.55, 1.55)
    arrows = [points for points, options in found.paths if options.get("width") == 1.5]
    assert [points[0] for points in arrows] == [pytest.approx(centre)] * 6
    n, h, e, x, y, z = (np.subtract(points[1], centre) for points in arrows)
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
