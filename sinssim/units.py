"""Units of scenarios, data sheets and reports in SI: multiply on input, divide on output; numbers as text.

A scale is the list of the units in which a quantity is displayed, each with the largest value that it suits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sinssim.data import Array

DEG = math.pi / 180.0
"""degree [rad]"""
ARCMIN = DEG / 60.0
"""minute of arc [rad]"""
ARCSEC = DEG / 3600.0
"""second of arc [rad]"""
DEG_H = DEG / 3600.0
"""degree per hour [rad/s]"""
DEG_SQRT_H = DEG / 60.0
"""degree per square root of an hour [rad/√s]"""
G0 = 9.80665
"""standard gravity, exact by definition (CGPM 1901) [m/s²]"""
UG = 1e-6 * G0
"""micro-g [m/s²]; a noise density of 1 µg/√Hz is the same number in m/s/√s"""
MGAL = 1e-5
"""milligal [m/s²]"""
PPM = 1e-6
"""part per million"""
MPS_SQRT_H = 1.0 / 60.0
"""metre per second per square root of an hour [m/s/√s]"""
KNOT = 1852.0 / 3600.0
"""international knot [m/s]"""
FOOT = 0.3048
"""international foot [m]"""
NAUTICAL_MILE = 1852.0
"""international nautical mile [m]"""

LENGTHS = {"m": 1.0, "km": 1e3, "nmi": NAUTICAL_MILE, "NM": NAUTICAL_MILE, "ft": FOOT}
"""Units of length as people write them [m]."""
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "kt": KNOT, "nmi/h": KNOT, "NM/h": KNOT, "m/h": 1.0 / 3600.0, "ft/s": FOOT}
"""Units of velocity and of the growth of a position error [m/s]."""
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": DEG, "°": DEG, "arcmin": ARCMIN, "'": ARCMIN, "arcsec": ARCSEC, '"': ARCSEC}
"""Units of angle [rad]."""
TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Units of time [s]."""


Scale = Sequence[tuple[str, float, float]]
"""Units of a kind: name, size in SI, and the largest value (SI) that the unit is used for."""

LENGTH_SCALE: Scale = (("mm", 1e-3, 0.5), ("m", 1.0, 1e5), ("km", 1e3, math.inf))
HEIGHT_SCALE: Scale = (("mm", 1e-3, 0.5), ("m", 1.0, math.inf))
ALTITUDE_SCALE: Scale = (("m", 1.0, 2e4), ("km", 1e3, math.inf))
SPEED_SCALE: Scale = (("mm/s", 1e-3, 0.05), ("m/s", 1.0, math.inf))
ANGLE_SCALE: Scale = (
    ("arcsec", ARCSEC, ARCMIN),
    ("arcmin", ARCMIN, 2.0 * DEG),
    ("deg", DEG, math.inf),
)
TIME_SCALE: Scale = (("s", 1.0, 600.0), ("min", 60.0, 4.0 * 3600.0), ("h", 3600.0, math.inf))


def fixed(name: str, size: float = 1.0) -> Scale:
    """Return a kind of quantity with one unit of a given size in SI."""
    return ((name, size, math.inf),)


def suiting(scale: Scale, *values: Array) -> tuple[str, float]:
    """Return name and size in SI of the unit that suits the largest of some values in SI.

    It is the largest unit if a value is infinite, or an array is NaN throughout; other NaN do not count.
    """
    import numpy as np  # the rest of this file is needed at start-up

    ends = [float(reduce(v, axis=None)) for v in values if v.size for reduce in (np.fmax.reduce, np.fmin.reduce)]
    largest = math.nan if np.isnan(ends).any() else max(map(abs, ends), default=0.0)
    return next(((name, size) for name, size, most in scale if largest <= most), scale[-1][:2])


def time_unit(duration: float) -> tuple[str, float]:
    """Return the unit suited to the times of a run: its name, and its size in s (duration of the run, s)."""
    return next(((name, size) for name, size, most in TIME_SCALE if abs(duration) <= most), TIME_SCALE[-1][:2])


def duration_words(seconds: float) -> str:
    """Return a duration in a suitable unit: for example "66.4 min"."""
    unit, size = time_unit(seconds)
    return f"{seconds / size:.4g} {unit}"


def number_text(value: float | None, digits: int = 3) -> str:
    """Write a number with a few significant digits; return "0.0123", "1.2e-09", or "–" for an unknown number."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if 1e-4 <= abs(value) < 1e6:
        places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{places}f}"
    return f"{value:.{digits - 1}e}"


def signed(value: float, digits: int = 3) -> str:
    """Write a number with a few significant digits and, if it is negative, a true minus sign; return "−0.0123"."""
    return ("−" if value < 0.0 else "") + number_text(abs(value), digits)


def with_band(value: float, low: float, high: float, size: float = 1.0) -> str:
    """Write an estimate with the ends of its band, in a unit of a `size`: "0.712 (0.655 … 0.781)"; "∞" if infinite."""
    value_text, low_text, high_text = (
        "∞" if end == math.inf else number_text(float(end) / size) for end in (value, low, high)
    )
    return f"{value_text} ({low_text} … {high_text})"


def percent(share: float) -> str:
    """Write a share in whole percent: "88 %", "–" for an unknown one."""
    return "–" if math.isnan(share) else f"{100.0 * share:.0f} %"


def two_digits(number: int) -> int:
    """Return about how many: a number of two significant digits."""
    return round(number, min(2 - len(str(number)), 0))


def capital(sentence: str) -> str:
    """Return a sentence with a capital first letter."""
    return sentence[:1].upper() + sentence[1:]


def duration_text(seconds: float) -> str:
    """Return a duration in words of at most six letters: "40 s", "3 min" or "2.5 h"."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def size_text(size: float) -> str:
    """Return a size with a suitable unit: for example "248 MB" (size in bytes)."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size:.0f} B"


def listed(names: Iterable[str], last_by: str = "and") -> str:
    """Return names as a list in a sentence: "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} {last_by} {last}" if first else last
