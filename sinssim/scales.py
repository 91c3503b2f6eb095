"""Units suited to the size of a quantity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim import units
from sinssim.data import Array

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
TIMES: Scale = (("s", 1.0, 600.0), ("min", 60.0, 4.0 * 3600.0), ("h", 3600.0, np.inf))


def fixed(name: str, size: float = 1.0) -> Scale:
    """Return a kind of quantity with one unit.

    Args:
        name: the unit's name.
        size: in SI.
    """
    return ((name, size, np.inf),)


def suiting(scale: Scale, *values: Array) -> tuple[str, float]:
    """Return the unit that suits the largest of some values.

    Args:
        values: arrays of any shapes, SI.

    Returns:
        The unit's name, and its size in SI; the largest unit if a value is infinite, or an array is NaN throughout.
        Other NaN do not count.
    """
    ends = [float(reduce(v, axis=None)) for v in values if v.size for reduce in (np.fmax.reduce, np.fmin.reduce)]
    largest = np.nan if np.isnan(ends).any() else max(map(abs, ends), default=0.0)
    return next(((name, size) for name, size, most in scale if largest <= most), scale[-1][:2])


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit suited to the times of a run.

    Args:
        duration: duration of the run, s.

    Returns:
        Its name, and its size in s.
    """
    return suiting(TIMES, np.array(duration))


def duration_words(seconds: float) -> str:
    """Return a duration in a suitable unit.

    Args:
        seconds: s.

    Returns:
        For example "66.4 min".
    """
    unit, size = time_unit(seconds)
    return f"{seconds / size:.4g} {unit}"
