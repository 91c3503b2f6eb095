"""Ticks, and thinning of rows for drawing without losing peaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.scales import time_unit

Rows = NDArray[np.intp]
_PLOT_ROWS = 16384


def envelope(time: Array, values: Array, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Thin a line to the least and the greatest value in each column of pixels.

    Args:
        time: (N,) s, in order.
        values: (N,).
        start, end: the time span of the columns, s.

    Returns:
        Times and values, at most two per column, in order of time; all extremes are kept.
    """
    if len(time) <= 2 * columns:
        return time, values
    first = np.unique(np.searchsorted(time, np.linspace(start, end, columns + 1)[:-1]))
    first = first[first < len(time)]
    last = np.append(first[1:], len(time)) - 1
    low, high = np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
    rising = values[last] >= values[first]
    return (
        np.column_stack((time[first], time[last])).ravel(),
        np.column_stack((np.where(rising, low, high), np.where(rising, high, low))).ravel(),
    )


def gaps(angles: Array, turn: float) -> Array:
    """Return angles with a gap where they jump by a whole turn, so that no line crosses the plot.

    Args:
        angles: (N,).

    Returns:
        (N,), NaN at the last angle before a jump.
    """
    jump = np.abs(np.diff(angles)) > 0.5 * turn
    return np.where(np.concatenate((jump, [False])), np.nan, angles)


def ticks(low: float, high: float, count: int, steps: Sequence[float] = (1.0, 2.0, 5.0)) -> tuple[Array, float]:
    """Return round numbers within a range.

    Args:
        steps: allowed steps between them, up to a power of ten; in rising order, from 1 to under 10.
    """
    least = (high - low) / count
    power = 10.0 ** np.floor(np.log10(least))
    step = float(next(s for s in (*(s * power for s in steps), 10.0 * power) if s >= least * (1.0 - 1e-9)))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1.0), step


def tick_label(value: float, step: float) -> str:
    """Write a tick's number with the digits that distinguish it from its neighbours.

    Returns:
        For example "0.25", with a true minus sign.
    """
    value = 0.0 if abs(value) < 1e-6 * step else value
    if max(abs(value), step) >= 1e6 or step < 1e-4:
        return f"{value:.3g}".replace("-", "−")
    places = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    return f"{value:.{places}f}".replace("-", "−")


def time_ticks(start: float, end: float) -> tuple[Array, float, str, float]:
    """Return round times.

    Args:
        start, end: the range, s.

    Returns:
        The times in their unit, the step between them, the unit's name and its size in s.
    """
    unit, size = time_unit(end - start)
    at, step = ticks(start / size, end / size, 9, (1.0, 2.0, 5.0) if unit == "h" else (1.0, 2.0, 3.0, 5.0))
    return at, step, unit, size


def thinned(count: int, most: int = _PLOT_ROWS) -> Rows:
    """Return the rows of a stream to be drawn."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def log_numbers(low: float, high: float) -> Array:
    """Return the numbers that a logarithmic axis shows.

    Args:
        low, high: its ends, 0 < low < high.

    Returns:
        At most about ten round numbers; powers of ten over more than two and a half of them.
    """
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    steps = (1.0, 2.0, 3.0, 5.0, 7.0) if high < 10.0 * low else (1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)
    at = np.array([decade * step for decade in decades for step in steps])
    at = at[(at >= low * 0.999) & (at <= high * 1.001)]
    return at[:: -(-len(at) // 10)] if steps == (1.0,) and len(at) else at
