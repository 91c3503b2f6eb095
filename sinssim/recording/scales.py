"""Units suited to the size of a quantity, ticks, and thinning of rows for drawing without losing peaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array

Rows = NDArray[np.intp]
_PLOT_ROWS = 16384

Scale = Sequence[tuple[str, float, float]]
"""Units of a kind: name, size in SI, and the largest value (SI) that the unit is used for."""

LENGTHS: Scale = (("mm", 1e-3, 0.5), ("m", 1.0, 1e5), ("km", 1e3, np.inf))
HEIGHTS: Scale = (("mm", 1e-3, 0.5), ("m", 1.0, np.inf))
SPEEDS: Scale = (("mm/s", 1e-3, 0.05), ("m/s", 1.0, np.inf))
ANGLES: Scale = (
    ("arcsec", units.ARCSEC, units.ARCMIN),
    ("arcmin", units.ARCMIN, 2.0 * units.DEG),
    ("deg", units.DEG, np.inf),
)


def suiting(scale: Scale, *values: Array) -> tuple[str, float]:
    """Return the unit that suits the largest of some values.

    Args:
        scale: the available units.
        values: arrays of any shapes, SI.

    Returns:
        The unit's name, and its size in SI; the largest unit if a value is infinite, or an array is NaN throughout.
        Other NaN do not count.
    """
    ends = [float(reduce(v, axis=None)) for v in values if v.size for reduce in (np.fmax.reduce, np.fmin.reduce)]
    largest = np.nan if np.isnan(ends).any() else max(map(abs, ends), default=0.0)
    return next(((name, size) for name, size, most in scale if largest <= most), scale[-1][:2])


def envelope(time: Array, values: Array, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Thin a line to the least and the greatest value in each column of pixels.

    Args:
        time: (N,) s, in order.
        values: (N,).
        start, end: the time span of the columns, s.
        columns: number of columns.

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


def ticks(low: float, high: float, count: int, steps: Sequence[float] = (1.0, 2.0, 5.0)) -> tuple[Array, float]:
    """Return round numbers within a range.

    Args:
        low, high: the range, high > low.
        count: approximate maximum number.
        steps: allowed steps between them, up to a power of ten; in rising order, from 1 to under 10.

    Returns:
        The numbers, and the step between them.
    """
    least = (high - low) / count
    power = 10.0 ** np.floor(np.log10(least))
    step = float(next(s for s in (*(s * power for s in steps), 10.0 * power) if s >= least * (1.0 - 1e-9)))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1.0), step


def tick_label(value: float, step: float) -> str:
    """Write a tick's number with the digits that distinguish it from its neighbours.

    Args:
        value: the number.
        step: distance to the next one.

    Returns:
        For example "0.25", with a true minus sign.
    """
    value = 0.0 if abs(value) < 1e-6 * step else value
    if max(abs(value), step) >= 1e6 or step < 1e-4:
        return f"{value:.3g}".replace("-", "−")
    places = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    return f"{value:.{places}f}".replace("-", "−")


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit suited to the times of a run.

    Args:
        duration: duration of the run, s.

    Returns:
        Its name, and its size in s.
    """
    return ("s", 1.0) if duration <= 600.0 else ("min", 60.0) if duration <= 4 * 3600.0 else ("h", 3600.0)


def duration_words(seconds: float) -> str:
    """Return a duration in a suitable unit.

    Args:
        seconds: s.

    Returns:
        For example "66.4 min".
    """
    unit, size = time_unit(seconds)
    return f"{seconds / size:.4g} {unit}"


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
    """Return the rows of a stream to be drawn.

    Args:
        count: number of rows of the stream.
        most: approximate maximum number of rows drawn.

    Returns:
        Indices, evenly spaced, the first and the last row among them.
    """
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))
