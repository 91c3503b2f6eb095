"""Judges which three columns of a text file are accelerometers, by gravity and by names, and their kind and unit."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sinssim.analyses.inspection.layouts.likeness import (
    Three,
    lasts,
    repeats,
    says_no_gravity,
    spread,
    turns,
    uneven,
    varies,
)
from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.logs.text.names import UNITS, quantity, unit_of
from sinssim.logs.text.no_gravity import WITHOUT_GRAVITY, without_gravity
from sinssim.units import G0

Kind = Literal["rates", "increments"]

_NEAR_G = 0.3
"""Relative departure of the median specific force from gravity: manoeuvres make it larger, units differ by a factor of
three or more."""
_NAMED_G = (0.5, 2.0)
"""Range of the median over gravity of columns that are named accelerometers: half of the way to another unit."""
_COUNTS = 200.0
"""Least magnitude of readings that may be counts: sensors of ±16 g with 12 bits have 128 per g."""
_UNIT_G = (0.5, 10.0)
"""The same if the name gives the unit, too: a rocket, a centrifuge."""


def named_quantity(table: TextTable, three: Three) -> str | None:
    """Return what the names of three columns say: "gyro", "accel", "other" or nothing."""
    if table.words is None:
        return None
    said = {quantity(table.words[k]) for k in three}
    return said.pop() if len(said) == 1 else None


def accelerometers(table: TextTable, three: Three, time: int, interval: float) -> tuple[float, Three, Kind, str]:
    """Judge whether three columns are accelerometers.

    Args:
        interval: between samples, s.

    Returns:
        How badly they fit gravity, infinite if not at all; the columns; and kind and unit of the best fit.
    """
    best: tuple[float, Three, Kind, str] = (np.inf, three, "rates", "")
    said = named_quantity(table, three)
    if not varies(table, three) or said == "gyro":
        return best
    values = table.values[:, list(three)]
    values = values[np.isfinite(values).all(axis=1)]
    interval *= len(table.values) / max(len(values), 1)
    size = float(np.median(np.linalg.norm(values, axis=1))) if len(values) else 0.0
    word = None if table.words is None else table.words[three[0]]
    trusted = said == "accel" and not says_no_gravity(table, word)
    unit_named = trusted and unit_of(word, tuple(UNITS["accel", "rates"])) is not None
    if not size:
        return best
    sure = unit_named or (trusted and turns(table, interval))
    if not sure and (not lasts(values, interval) or without_gravity(values, interval)):
        return best
    # neighbours of z have gravity in them, too, but not its noise; then a whole number of triads before them counts
    before = [k for k in range(min(three)) if k != time and table.values[:, k].std() > 0.0]
    bonus = 2.0 * (said == "accel") + 0.05 * (len(before) % 3 == 0)
    bonus -= (0.3 * uneven(values) + 0.3 * min(spread(values), 1.0) + 0.3 * repeats(values)) * (said is None)
    readings: list[tuple[Kind, float]] = [("rates", 1.0), ("increments", 1.0 / interval)]
    for kind, per_second in readings:
        units = UNITS["accel", kind]
        named = unit_of(word, tuple(units))
        for unit, scale in units.items():
            if unit != "m/s^2" and named is None and says_no_gravity(table, word):
                continue  # 1 m/s² would pass for 1 g
            of_g = size * scale * per_second / G0
            low, high = _UNIT_G if unit_named and unit == named else _NAMED_G if trusted else (1 - _NEAR_G, 1 + _NEAR_G)
            if low <= of_g <= high:
                worse = (kind == "increments") * 1e-3 - 0.5 * (unit == named)
                best = min(best, (abs(of_g - 1.0) + worse - bonus, three, kind, unit))
    return best


def no_gravity_words(table: TextTable, three: Three) -> str:
    """Return the sentence on three columns whose magnitude is not gravity: counts, or acceleration without gravity."""
    if not varies(table, three):
        names = ", ".join(str(table.label(k)) for k in three)
        return f"{table.path}: the columns {names} of the accelerometers have no numbers, or never change."
    size = float(np.nanmedian(np.linalg.norm(table.values[:, list(three)], axis=1)))
    names = ", ".join(str(table.label(k)) for k in three)
    text = f"{table.path}: the columns {names} have a median magnitude of {size:.3g}, which is not gravity in any unit."
    values = table.values[:, list(three)]
    if size > _COUNTS and (values == np.rint(values)).all():
        bits = 2.0 ** round(np.log2(size))
        return (
            f"{text} Whole numbers are counts: {bits:g} of them per g are usual for this magnitude. Multiply gyros and "
            "accelerometers by the scale factors of the data sheet."
        )
    return f"{text} {WITHOUT_GRAVITY}"
