"""Finds a recorded gravity vector, and the accelerations without gravity to which it is added, as phones write them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sinssim.analyses.inspection.layouts.inertial import Layout, guess_layout, guess_part, quantity_of
from sinssim.analyses.inspection.layouts.likeness import Three, varies
from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.analyses.inspection.layouts.time_column import time_column
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.text.names import UNITS, means, says, triads, unit_of
from sinssim.units import G0

_BARE = r"lin|user"
_NEAR_G = 0.05
"""Relative departure of a gravity vector from standard gravity: that of the Earth, and rounding."""
_ALONG = 0.5
"""Least ratio of the mean component along gravity to the median magnitude of readings that contain gravity."""

Part = tuple[TextTable, Layout]


def gravity_in(table: TextTable) -> Layout | None:
    """Find the columns of a gravity vector, by their names or that of the file, and by its constant magnitude.

    Returns:
        Its layout, with the columns as `accel`; None if there is none.
    """
    try:
        time, unit, _ = time_column(table)
    except InputError:
        return None
    of_file = any(means(text, "gravity") for text in (*table.rows.values(), table.path.stem))
    for three in triads(table.words):
        if time in three or not (of_file or all(means(str(table.label(k)), "gravity") for k in three)):
            continue
        size = np.linalg.norm(table.values[:, list(three)], axis=1)
        size = size[np.isfinite(size)]
        if not len(size) or float(np.std(size)) > _NEAR_G * float(np.median(size)):
            continue
        for name, scale in UNITS["accel", "rates"].items():
            if abs(float(np.median(size)) * scale / G0 - 1.0) < _NEAR_G:
                return Layout("rates", time, unit, None, three, "rad/s", name, True)
    return None


def whole_unit(table: TextTable) -> Layout:
    """Guess the layout of a file of gyros and accelerometers, or of gyros, accelerations without gravity and gravity.

    Raises:
        InputError: as for `guess_layout`.
    """
    own = gravity_in(table)
    if own is None:
        return guess_layout(table)
    try:
        layout = guess_layout(table)
        if layout.accel is not None and contains(table, layout.accel, (table, own)):
            return layout
    except InputError:
        if not _accelerations(table, own):
            raise
    three = next(iter(_accelerations(table, own)), None)
    if three is None:
        return guess_layout(table)
    return replace(guess_layout(table, (three, _unit(table, three, own))), gravity=(table, own))


def part_of_unit(table: TextTable, gravity: Part | None) -> Layout | None:
    """Guess the layout of a file of gyros alone or accelerometers alone; gravity is added if these lack it.

    Args:
        gravity: file and layout of a gravity vector; None if there is none.

    Returns:
        As `guess_part`.

    Raises:
        InputError: as for `guess_part`, or the files of acceleration and gravity have different layouts.
    """
    if gravity is None:
        return guess_part(table)
    why: InputError | None = None
    part: Layout | None = None
    try:
        part = guess_part(table)
        if part is None or part.accel is None or contains(table, part.accel, gravity):
            return part
    except InputError as error:
        why = error
    at, own = gravity
    three = next((t for t in _accelerations(table, own if at is table else None) if _overlap(table, gravity)), None)
    if three is None:
        if why is not None:
            raise why
        return part
    time, unit, _ = time_column(table)
    names = (table.label(time), at.label(own.time))
    if names[0] != names[1] or (table.delimiter, table.skip_lines) != (at.delimiter, at.skip_lines):
        raise InputError(
            f"{table.path} and {at.path}: their times are in the columns {names[0]!r} and {names[1]!r}, but both files "
            "must have the same layout. Rewrite one of them."
        )
    return Layout("rates", time, unit, None, three, "rad/s", _unit(table, three, own), True, gravity=gravity)


def contains(table: TextTable, three: Three, gravity: Part) -> bool:
    """Return whether accelerations have gravity in them: their mean along the recorded gravity is large."""
    values, down = table.values[:, list(three)], _direction(table, gravity)
    good = np.isfinite(values).all(axis=1) & np.isfinite(down).all(axis=1)
    if not good.any():
        return False
    along = abs(float(np.mean(np.sum(values[good] * down[good], axis=1))))
    return along > _ALONG * float(np.median(np.linalg.norm(values[good], axis=1)))


def _direction(table: TextTable, gravity: Part) -> Array:
    """Return the unit vector of gravity at the times of a table, (N, 3); NaN where it is unknown."""
    at, layout = gravity
    values = at.values[:, list(layout.accel or ())]
    if at is not table:
        known = np.isfinite(values).all(axis=1)
        own, time = at.values[known, layout.time], table.values[:, time_column(table)[0]]
        values = np.stack([np.interp(time, own, axis, np.nan, np.nan) for axis in values[known].T], axis=1)
    return np.asarray(values / np.linalg.norm(values, axis=1, keepdims=True))


def _overlap(table: TextTable, gravity: Part) -> bool:
    return bool(np.isfinite(_direction(table, gravity)).any())


def _accelerations(table: TextTable, own: Layout | None) -> list[Three]:
    """Return the triads of accelerations that may lack gravity, those whose names say so first."""
    found = [t for t in triads(table.words) if (own is None or t != own.accel) and varies(table, t)]
    found = [t for t in found if quantity_of(table, t) == "accel"]
    return sorted(found, key=lambda t: not says(str(table.label(t[0])), _BARE))


def _unit(table: TextTable, three: Three, gravity: Layout) -> str:
    """Return the unit of accelerations: that of their names, or else that of gravity."""
    word = None if table.words is None else table.words[three[0]]
    return unit_of(word, tuple(UNITS["accel", "rates"])) or gravity.accel_unit


def opposite(layout: Layout) -> Layout:
    """Return the layout of a sum with the acceleration's signs reversed."""
    x, y, z = layout.accel_signs
    return replace(layout, accel_signs=(-x, -y, -z))


def other_units(table: TextTable, layout: Layout) -> list[Layout]:
    """Return the layouts of a sum with the acceleration in another unit of phones, if its name gives none."""
    of, three = layout.columns(table, "accel")
    if of.words is not None and unit_of(of.words[three[0]], tuple(UNITS["accel", "rates"])) is not None:
        return []
    return [replace(layout, accel_unit="g" if layout.accel_unit == "m/s^2" else "m/s^2")]
