"""The limits of requirements in plots over time: a line throughout the run, a mark at one time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from sinssim.recording import style
from sinssim.statistics.requirements.requirement import SHARES, Requirement

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

CIRCLES = tuple(SHARES)
"""Quantities whose limits belong to the plot of CEP and R95."""
FAR = 1.5
"""A limit is drawn up to this multiple of the highest curve; beyond, it is only named."""
_COLORS = {"met": style.COLORS["truth"], "not met": style.COLORS["measured"]}

Judged = Sequence[tuple[Requirement, str]]
"""Requirements with their verdicts: "met", "not met" or "undecided"."""


def color_of(verdict: str) -> style.Rgb:
    """Return the colour of a limit by the verdict on it."""
    return _COLORS.get(verdict, style.COLORS["run"])


def of_quantities(judged: Judged, quantities: Iterable[str]) -> Judged:
    """Return the requirements on some quantities.

    Args:
        judged: requirements with their verdicts.
        quantities: names of quantities.
    """
    chosen = set(quantities)
    return [pair for pair in judged if pair[0].quantity in chosen]


def height_of(one: Requirement, end: float) -> float:
    """Return the limit as a length, speed or angle: that of a rate at its time, the others as they are.

    Args:
        one: the requirement.
        end: end of the run, s since its start.

    Returns:
        SI.
    """
    return one.limit * instant_of(one, end) if one.quantity == "rate" else one.limit


def instant_of(one: Requirement, end: float) -> float:
    """Return the instant of a requirement, s since the start; the end if it has none of its own."""
    return one.time if one.when == "at" else end


def draw_limits(axes: Axes, judged: Judged, most: float, unit: float, size: float, end: float) -> list[Artist]:
    """Draw the limits of requirements.

    Args:
        axes: a plot over time that begins at zero.
        judged: the requirements whose quantities it shows.
        most: highest curve, SI.
        unit: unit of the plot, SI.
        size: unit of the time axis, s.
        end: end of the run, s since its start.

    Returns:
        What was drawn, for a legend. The plot is made high enough.
    """
    drawn: list[Artist] = []
    for one, verdict in judged:
        color, height = style.css(color_of(verdict)), height_of(one, end) / unit
        name = f"{one.text}: {verdict}"
        if height > FAR * most / unit:
            drawn += axes.plot([], [], color=color, ls="none", marker="v", label=f"{name} (above the plot)")
            continue
        if one.when == "run":
            drawn.append(axes.axhline(height, color=color, lw=style.THIN, ls="--", label=name))
        else:
            at = instant_of(one, end) / size
            drawn += axes.plot([at], [height], color=color, marker="v", ls="none", ms=8.0, clip_on=False, label=name)
        axes.set_ylim(top=max(axes.get_ylim()[1], 1.1 * height))
    return drawn
