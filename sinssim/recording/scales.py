"""The unit that suits a quantity's size, and rows thinned for drawing without losing a peak."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim import units
from sinssim.data import Array

Scale = Sequence[tuple[str, float, float]]
"""Units of a kind: name, size in SI, and the largest value (SI) that it is used for."""

LENGTHS: Scale = (("mm", 1e-3, 0.5), ("m", 1.0, 2.0 * units.NAUTICAL_MILE), ("nmi", units.NAUTICAL_MILE, np.inf))
SPEEDS: Scale = (("mm/s", 1e-3, 0.05), ("m/s", 1.0, np.inf))
ANGLES: Scale = (
    ("arcsec", units.ARCSEC, units.ARCMIN),
    ("arcmin", units.ARCMIN, 2.0 * units.DEG),
    ("deg", units.DEG, np.inf),
)


def suiting(scale: Scale, *values: Array) -> tuple[str, float]:
    """Return the unit in which a person would say the largest of some values.

    Args:
        scale: the units there are.
        values: arrays of any shapes, SI.

    Returns:
        The unit's name, and its size in SI; the largest unit for what is not finite.
    """
    largest = max((float(np.abs(v).max()) for v in values), default=0.0)
    return next(((name, size) for name, size, most in scale if largest <= most), scale[-1][:2])


def envelope(time: Array, values: Array, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Thin a line to the least and the greatest value in each of some columns of pixels.

    Args:
        time: (N,) s, in order.
        values: (N,).
        start, end: what the columns span, s.
        columns: how many.

    Returns:
        Times and values, at most two per column, in order of time; every extreme is among the values.
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
        count: about how many at most.
        steps: what steps between them may be, times a power of ten; in rising order, from 1 to under 10.

    Returns:
        The numbers, and the step between them.
    """
    least = (high - low) / count
    power = 10.0 ** np.floor(np.log10(least))
    step = float(next(s for s in (*(s * power for s in steps), 10.0 * power) if s >= least * (1.0 - 1e-9)))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1.0), step
