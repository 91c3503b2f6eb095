"""What the numbers of three columns look like: gyros, accelerometers, a magnetometer, copies of other columns."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.data import Array
from sinssim.logs.text.names import UNITS, means, quantity, triads, unit_of

Three = tuple[int, int, int]
"""Columns x, y, z, from 0."""

_COPY = 0.999
"""Least correlation of two columns of the same readings."""
_FILLED = 0.2
"""Least share of rows with readings: rows of other sensors between them leave these fields empty."""
_COARSEST = float(np.radians(2.0))
"""Coarsest resolution of gyros, rad/s: 11 bits of ±2000 °/s, with the sign. Coarser steps are no rad/s."""
_LASTING_S = 10.0
_LASTING = 0.7
"""Least ratio of the mean of the readings over `_LASTING_S`, as a vector, to the mean of their magnitudes, in half of
the windows: gravity lasts, and the accelerations of a vehicle change within seconds."""


def unlike_gyros(table: TextTable, three: Three, accel: Three) -> float:
    """Return how little three columns without names look like gyros.

    A gyro reads about zero in the middle of a log, where a magnetometer has a field; the three have about the same
    noise; and most loggers put them beside the accelerometers.
    """
    values = table.values[:, list(three)]
    values = values[np.isfinite(values).all(axis=1)]
    middle, most = np.abs(np.median(values, axis=0)), np.percentile(np.abs(values), 95.0, axis=0)
    shifted = float((middle / np.maximum(most, 1e-30)).max())
    return shifted + uneven(values) + 0.5 * (abs(three[0] - accel[0]) != 3)


def uneven(values: Array) -> float:
    """Return the decimal logarithm of the ratio of the largest to the least noise of three columns.

    Its measure is a percentile of the second differences, which a few wrong rows do not change.
    """
    noise = np.percentile(np.abs(np.diff(values, n=2, axis=0)), 90.0, axis=0)
    return float(np.log10(max(noise.max(), 1e-30) / max(noise.min(), 1e-30)))


def copies(table: TextTable, one: Three, other: Three) -> bool:
    """Return whether three columns are those of another triad in another unit."""
    pairs = table.values[:, [*one, *other]]
    pairs = pairs[np.isfinite(pairs).all(axis=1)]
    return bool(len(pairs) > 3 and all(abs(np.corrcoef(pairs[:, k], pairs[:, k + 3])[0, 1]) > _COPY for k in range(3)))


def quaternion(table: TextTable) -> set[int]:
    """Return the first four neighbours with the norm 1 in every row."""
    for k in range(table.values.shape[1] - 3):
        norm = np.linalg.norm(table.values[:, k : k + 4], axis=1)
        if np.nanmax(np.abs(norm - 1.0), initial=0.0) < 1e-3 and np.isfinite(norm).any():
            return set(range(k, k + 4))
    return set()


def varies(table: TextTable, three: Three) -> bool:
    """Return whether three columns have numbers in enough rows, and none of them is constant."""
    values = table.values[:, list(three)]
    filled = bool((np.isfinite(values).mean(axis=0) > _FILLED).all())
    return filled and bool((np.nanstd(values, axis=0) > 0.0).all())


def lasts(values: Array, interval: float) -> bool:
    """Return whether readings have a lasting part as large as gravity, unlike those without gravity."""
    width = min(max(round(_LASTING_S / interval), 1), len(values))
    whole = values[: len(values) // width * width].reshape(-1, width, 3)
    mean, size = np.nanmean(whole, axis=1), np.nanmean(np.linalg.norm(whole, axis=2), axis=1)
    return bool(np.median(np.linalg.norm(mean, axis=1) / np.maximum(size, 1e-30)) > _LASTING)


def turns(table: TextTable, interval: float) -> bool:
    """Return whether gyros with names turn by a radian within `_LASTING_S` half of the time: gravity does not last."""
    for three in triads(table.words):
        if table.words is None or {quantity(table.words[k]) for k in three} != {"gyro"} or not varies(table, three):
            continue
        values = table.values[:, list(three)] * UNITS["gyro", "rates"][gyro_unit_of(table, three, "rates")[0]]
        width = min(max(round(_LASTING_S / interval), 1), len(values))
        angle = np.nansum(values[: len(values) // width * width].reshape(-1, width, 3), axis=1) * interval
        return bool(np.median(np.linalg.norm(angle, axis=1)) > 1.0)
    return False


def spread(values: Array) -> float:
    """Return the range of the middle half of the magnitudes over their median: small where gravity is most of them."""
    low, middle, high = np.percentile(np.linalg.norm(values, axis=1), (25.0, 50.0, 75.0))
    return float((high - low) / max(middle, 1e-30))


def repeats(values: Array) -> float:
    """Return the share of rows that repeat the row before: high for readings of slower sensors, such as receivers."""
    return float((np.diff(values, axis=0) == 0.0).all(axis=1).mean()) if len(values) > 1 else 0.0


def says_no_gravity(table: TextTable, word: str | None) -> bool:
    """Return whether names say that gravity is removed: linear or user acceleration, or this file of Sensor Logger."""
    if table.path.stem.lower() == "accelerometer" and "seconds_elapsed" in (table.words or ()):
        return True
    return any(means(text, "without gravity") for text in (word, table.path.stem, *table.rows.values()))


def gyro_unit_of(table: TextTable, three: Three, kind: Literal["rates", "increments"]) -> tuple[str, bool]:
    """Return the unit of the gyros from the names, or the likeliest one from the numbers, and whether it is sure."""
    named = None if table.words is None else unit_of(table.words[three[0]], tuple(UNITS["gyro", kind]))
    if named is not None:
        return named, True
    if kind == "increments":
        return "rad", False
    # a turn of a vehicle is 5 to 100 °/s: numbers above 10 are no rad/s
    values = table.values[:, list(three)]
    fast = float(np.nanpercentile(np.abs(values), 99.0))
    return ("deg/s" if fast > 6.0 or resolution(values) > _COARSEST else "rad/s"), False


def resolution(values: Array) -> float:
    """Return the least step between the values of three columns, the largest of the three; 0 without one."""
    steps = [np.diff(np.unique(axis[np.isfinite(axis)])) for axis in values.T]
    return max((float(s[s > 1e-6].min(initial=np.inf)) for s in steps if (s > 1e-6).any()), default=0.0)
