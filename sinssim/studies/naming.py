"""What the rows of a study are called in its tables and figures, and the colour that goes with a name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from sinssim.recording import style
from sinssim.recording.page import css
from sinssim.studies.results import Comparison, Row
from sinssim.studies.schema import Part

Label = Callable[[Row], str]
Paint = Mapping[str, str]
"""Colour, as CSS has it, of each line by its name."""

_DIMENSIONS = ("algorithm", "frame", "curvature", "gravity", "sensors", "variant")
_SHOWN_HZ = 50.0
_RATES_FOR_LINES = 3  # from so many rates on, errors are drawn over the rate


def varying(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the dimensions in which rows differ, apart from motion and rate.

    Args:
        rows: of one part.

    Returns:
        Names of attributes of `Row`.
    """
    return tuple(d for d in _DIMENSIONS if len({getattr(row, d) for row in rows}) > 1)


def labeller(rows: Sequence[Row], pace: bool = False) -> Label:
    """Return what tells rows of one motion apart, in words.

    Args:
        rows: of one part.
        pace: whether the rate belongs to it, where it differs.

    Returns:
        A function of a row.
    """
    dimensions = varying(rows)
    several = pace and len({row.pace for row in rows}) > 1

    def label(row: Row) -> str:
        parts = [str(getattr(row, d)) for d in dimensions] + ([f"{row.pace} Hz"] if several else [])
        return " · ".join(parts) or row.algorithm

    return label


def over_rates(part: Part) -> bool:
    """Return whether a part is seen best as lines over the rate.

    Args:
        part: of a study.

    Returns:
        Whether it has several plain rates.
    """
    return len(part.rates_hz) >= _RATES_FOR_LINES and not part.schedules_hz


def line_labeller(part: Part, rows: Sequence[Row]) -> Label:
    """Return what a line is called: a schedule has one of its own, the plain rates of an engine share one.

    Args:
        part: of a study.
        rows: its rows.

    Returns:
        A function of a row.
    """
    return labeller(rows, pace=bool(part.schedules_hz))


def at_one_rate(rows: Sequence[Row]) -> list[Row]:
    """Return the rows whose errors are drawn over time: schedules, or of plain rates those at the one nearest to 50 Hz.

    Args:
        rows: some rows of a part.

    Returns:
        Rows with lines of different names.
    """
    scheduled = [row for row in rows if row.schedule_hz]
    if scheduled or not rows:
        return scheduled
    rate = min((row.rate_hz for row in rows), key=lambda hz: abs(math.log(hz / _SHOWN_HZ)))
    return [row for row in rows if row.rate_hz == rate]


def palette(comparison: Comparison) -> dict[str, str]:
    """Return the colours of a study's lines: one name, one colour in all figures and all panels.

    Args:
        comparison: the study.

    Returns:
        Colour, as CSS has it, by name.
    """
    names: dict[str, None] = {}
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        names |= dict.fromkeys(map(line_labeller(part, rows), rows))
    return {name: css(color) for name, color in zip(names, style.colors(list(names)), strict=True)}
