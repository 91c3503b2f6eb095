"""Finds the column of the time in a text file of inertial readings, and its unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.errors import InputError
from sinssim.logs.text.names import TIME_UNITS, epoch_unit, means, says, says_other, says_time, unit_in_name

_RATES = (1.0, 10_000.0)
"""Samples a second of inertial sensors, from slow recorders to raw outputs."""
_USUAL = 200.0
"""Samples a second in the middle of those of users' units, 50 to 1000."""
_CLEAR = 1.2
"""Least difference of the evidence for two units, in decades of the rate, with which the first one is taken."""


class UncertainUnitError(InputError):
    """Several units of the times of a file are possible."""


def time_column(table: TextTable) -> tuple[int, str, float]:
    """Find the time of a log of inertial readings.

    The unit is that of the name; or else that in which the stamps are dates; or else that with the rate and the
    duration of an inertial log.

    Returns:
        Column, from 0, unit, and interval, s.

    Raises:
        UncertainUnitError: neither name nor numbers show the unit.
        InputError: no column can be the time.
    """
    best: tuple[float, int, list[tuple[float, str, float]]] = (np.inf, -1, [])
    for k, column in enumerate(table.values.T):
        word = "" if table.words is None else table.words[k]
        if not np.isfinite(column).all() or len(column) < 3 or says_other(word):
            continue
        steps = np.diff(column)
        forward = steps[steps > 0.0]
        # stamps may repeat: those of several samples in one packet, or of a clock coarser than the samples
        if len(forward) < 0.1 * len(steps) or (steps < 0.0).mean() > 0.02:
            continue
        middle = float(column[-1] - column[0]) / len(steps)
        if not middle > 0.0:
            continue
        spread = min(float(np.percentile(np.abs(steps - middle), 90.0)) / middle, 3.0)
        spread = round(spread, 1) + 1e-3 * k  # of columns that are alike the first one, in every file of a logger
        middle = middle if len(forward) < 0.9 * len(steps) else float(np.median(forward))
        units = sorted(_units(table, k, middle), reverse=True)
        if units:
            sure = units[0][0] == np.inf or len(units) == 1
            own = says(word, r"header\W*stamp")  # of ROS: that of the sensor, not that of the recording
            best = min(best, (spread - 10.0 * says_time(word) - 5.0 * sure - 1.0 * own, k, units))
    _, k, units = best
    if k < 0:
        counts = [str(word) for word in table.words or () if means(word, "count") and not says_time(word)]
        of = f" ({counts[0]!r} is a count, no time)" if counts else ""
        raise InputError(
            f"{table.path}: no column{of} increases from row to row by the interval of inertial sensors "
            f"({_RATES[0]:g} to {_RATES[1]:g} samples per second) in s, ms, us or ns. Describe the columns in "
            "[log.imu] of a scenario (rate_hz for rows without times), and inspect the scenario."
        )
    (evidence, unit, interval), *others = units
    if others and not evidence - others[0][0] > _CLEAR:
        of = " or ".join(
            f"in {unit} there are {1.0 / step:.4g} samples per second over {len(table.values) * step:.4g} s"
            for _, unit, step in units[:2]
        )
        raise UncertainUnitError(
            f"{table.path}: the unit of the times in column {table.label(k)!r} is not certain: {of}. Put the unit into "
            "the name of the column (t_s, t_ms, t_us), or describe the columns in [log.imu] of a scenario (time_unit), "
            "and inspect the scenario."
        )
    return k, unit, interval


def _units(table: TextTable, k: int, middle: float) -> Iterator[tuple[float, str, float]]:
    """Yield the evidence for each unit of a column of times, infinite for a certain one, and the interval in it, s."""
    column, word = table.values[:, k], "" if table.words is None else table.words[k]
    if k in table.dates:
        yield np.inf, "s", middle
        return
    certain = "100us" if says(word, r"^sampletimefine") else unit_in_name(word) or epoch_unit(column, middle)
    if certain is not None and unit_in_name(word) is None and middle * TIME_UNITS[certain] * _RATES[0] > 1.0 + 1e-3:
        certain = None  # a counter since the start of a computer, which looks like dates
    if certain is not None:
        yield np.inf, certain, middle * TIME_UNITS[certain]
        return
    fractions = bool((column != np.rint(column)).any())
    for unit, scale in TIME_UNITS.items():
        interval = middle * scale
        if unit == "100us" or not _RATES[0] <= 1.0 / interval <= _RATES[1]:
            continue
        evidence = -abs(np.log10(1.0 / interval / _USUAL))
        evidence += 2.5 * (fractions == (unit == "s"))  # loggers count whole ms, us and ns
        if table.lasts is not None:  # what is recorded together lasts as long
            ratio = len(column) * interval / table.lasts
            evidence += 2.5 * (0.2 < ratio < 5.0)
        yield float(evidence), unit, interval
