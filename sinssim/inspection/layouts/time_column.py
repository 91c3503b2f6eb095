"""Finds the column of the time in a text file of inertial readings, and its unit."""

from __future__ import annotations

import numpy as np

from sinssim.errors import InputError
from sinssim.inspection.layouts.names import says
from sinssim.inspection.layouts.text_table import TextTable
from sinssim.logs.text.description import TIME_UNITS, unit_in_name

_RATES = (5.0, 10_000.0)
"""Samples a second of inertial sensors, from slow recorders to raw outputs."""


def _says(table: TextTable, column: int, pattern: str) -> bool:
    return table.words is not None and says(table.words[column], pattern)


def time_column(table: TextTable) -> tuple[int, str, float]:
    """Find the time of a log of inertial readings.

    Args:
        table: the numbers.

    Returns:
        Column, from 0, unit, and interval, s.

    Raises:
        InputError: no column can be the time.
    """
    best: tuple[float, int, str, float] = (np.inf, -1, "", 0.0)
    for k, column in enumerate(table.values.T):
        if not np.isfinite(column).all() or len(column) < 3:
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
        spread -= 10.0 * _says(table, k, r"time|stamp|^t$|^t[_\W]|sec|tow|sow|epoch")
        middle = middle if len(forward) < 0.9 * len(steps) else float(np.median(forward))
        word = "" if table.words is None else table.words[k]
        said = "100us" if says(word, r"^sampletimefine") else unit_in_name(word)
        for unit, scale in {"s": 1.0}.items() if k in table.dates else TIME_UNITS.items():
            if unit == "100us" != said:
                continue
            rate = 1.0 / (middle * scale)
            inside = _RATES[0] <= rate <= _RATES[1]
            named = k in table.dates or said == unit
            if inside or named:
                off = abs(np.log10(rate / 200.0))  # most units of users give 50 to 1000 a second
                best = min(best, (spread + 0.01 * off - 5.0 * named, k, unit, middle * scale))
    if best[1] < 0:
        raise InputError(
            f"{table.path}: no column increases from row to row by the interval of inertial sensors ({_RATES[0]:g} to "
            f"{_RATES[1]:g} samples per second) in s, ms, us or ns. Describe the columns in [log.imu] of a scenario, "
            "and inspect the scenario."
        )
    return best[1], best[2], best[3]
