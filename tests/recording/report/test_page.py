"""Figures on a page have its paper, ink, axes and grid, light or dark."""

from __future__ import annotations

import re

from sinssim.recording.figures import new_figure, styled, to_svg
from sinssim.recording.page import page
from sinssim.recording.style import GRID, INK, SOFT


@styled
def _figure() -> str:
    figure = new_figure(3.0, 2.0)
    axes = figure.add_subplot()
    axes.plot([0.0, 1.0], [0.0, 1.0], color="#d55e00", label="line")
    axes.set_title("title")
    axes.legend()
    return to_svg(figure, "one")


def test_every_neutral_colour_of_a_figure_follows_the_page() -> None:
    """What is neither a curve's colour nor named by a rule of the page would be illegible in the dark."""
    svg, rules = _figure(), page("x", [])
    found = {paint: set(re.findall(rf"\b{paint}: (#[0-9a-f]{{6}})", svg)) for paint in ("fill", "stroke")}
    assert {"#ffffff", INK, SOFT} <= found["fill"]
    assert GRID in found["stroke"]
    for paint, colors in found.items():
        for color in colors - {"#d55e00"}:
            assert f'svg [style*="{paint}: {color}"] {{ {paint}: var(--' in rules
