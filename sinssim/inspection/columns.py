"""Guesses which columns of a text file are time, gyros and accelerometers, and their units, from names and numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.inspection.text_table import TextTable
from sinssim.logs.streams import InertialStream
from sinssim.units import DEG, DEG_H, FOOT, G0

Kind = Literal["rates", "increments"]

_TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_RATES = (5.0, 10_000.0)
"""Samples a second of inertial sensors, from slow recorders to raw outputs."""
_ACCEL = {"m/s^2": 1.0, "g": G0, "mg": 1e-3 * G0, "ft/s^2": FOOT}
_ACCEL_INCREMENTS = {"m/s": 1.0, "g*s": G0, "mm/s": 1e-3, "ft/s": FOOT}
_GYRO = {"rad/s": 1.0, "deg/s": DEG, "mrad/s": 1e-3, "deg/h": DEG_H}
_GYRO_INCREMENTS = {"rad": 1.0, "deg": DEG, "arcsec": DEG / 3600.0, "urad": 1e-6, "mrad": 1e-3}
_NEAR_G = 0.3
"""Relative departure of the median specific force from gravity: manoeuvres make it larger, units differ by a factor of
three or more."""
_UNIT_WORDS = {
    "rad/s": r"rad[_/]?s|rad/s|rps",
    "deg/s": r"deg[_/ ]?s|dps|°/s|deg/s",
    "deg/h": r"deg[_/]?h|°/h|dph",
    "m/s^2": r"m[_/]?s\^?2|mps2|m/s/s|m/s²|ms2",
    "g": r"(?:^|[\W_])g(?:$|[\W_])",
    "mg": r"(?:^|[\W_])mg(?:$|[\W_])",
}


@dataclass(frozen=True)
class Layout:
    """A guess of a log's layout.

    Attributes:
        kind: rates or increments.
        time: column of the time, from 0.
        time_unit: one of s, ms, us, ns.
        gyro, accel: first columns of the triads, from 0.
        gyro_unit, accel_unit: units.
        gyro_unit_sure: whether names or the kind give the unit of the gyros; otherwise fixes have to tell.
    """

    kind: Kind
    time: int
    time_unit: str
    gyro: int
    accel: int
    gyro_unit: str
    accel_unit: str
    gyro_unit_sure: bool

    def description(self, table: TextTable) -> dict[str, Any]:
        """Return the keys of the description of the log."""

        def three(first: int) -> list[str | int]:
            return [table.label(first + k) for k in range(3)]

        keys: dict[str, Any] = {"kind": self.kind, "time": table.label(self.time), "time_unit": self.time_unit}
        if table.delimiter != ",":
            keys["delimiter"] = table.delimiter
        if table.skip_lines:
            keys["skip_lines"] = table.skip_lines
        keys["gyro"] = {"columns": three(self.gyro), "unit": self.gyro_unit}
        keys["accel"] = {"columns": three(self.accel), "unit": self.accel_unit}
        return keys

    def stream(self, table: TextTable) -> InertialStream:
        """Return the readings in SI units."""
        gyro_units = _GYRO if self.kind == "rates" else _GYRO_INCREMENTS
        accel_units = _ACCEL if self.kind == "rates" else _ACCEL_INCREMENTS
        values = table.values
        return InertialStream(
            values[:, self.time] * _TIME_UNITS[self.time_unit],
            values[:, self.gyro : self.gyro + 3] * gyro_units[self.gyro_unit],
            values[:, self.accel : self.accel + 3] * accel_units[self.accel_unit],
            self.kind,
        )


def guess_layout(table: TextTable) -> Layout:
    """Guess the layout of a log of inertial readings.

    Args:
        table: the numbers.

    Returns:
        The guess.

    Raises:
        InputError: no column can be the time, or no three columns gravity; the message says what was looked for.
    """
    time, unit, interval = _time(table)
    free = [k for k in range(table.values.shape[1] - 2) if not {k, k + 1, k + 2} & {time}]
    accel = min((_accelerometers(table, k, time, interval) for k in free), default=None)
    if accel is None or not np.isfinite(accel[0]):
        raise InputError(
            f"{table.path}: no three columns in a row have a median magnitude of gravity in m/s², g, mg or ft/s², as "
            "rates or as increments. "
            "Describe the columns in a scenario's table [log.imu], and inspect the scenario."
        )
    _, at, kind, accel_unit = accel
    gyros = [k for k in free if abs(k - at) >= 3 and _varies(table, k)]
    if not gyros:
        raise InputError(f"{table.path}: beside the accelerometers no three columns in a row can be gyros.")
    named = [k for k in gyros if _says(table, k, r"gyr|omega|(?:^|_)w[xyz]|rate|dtheta|angvel|ang_?rate")]
    first = (named or sorted(gyros, key=lambda k: abs(abs(k - at) - 3)))[0]
    gyro_unit, sure = _gyro_unit(table, first, kind)
    return Layout(kind, time, unit, first, at, gyro_unit, accel_unit, sure)


def _says(table: TextTable, column: int, pattern: str) -> bool:
    return table.names is not None and re.search(pattern, table.names[column], re.IGNORECASE) is not None


def _varies(table: TextTable, first: int) -> bool:
    three = table.values[:, first : first + 3]
    return bool(np.isfinite(three).mean() > 0.9 and (np.nanstd(three, axis=0) > 0.0).all())


def _time(table: TextTable) -> tuple[int, str, float]:
    """Return column, unit and interval [s] of the time."""
    best: tuple[float, int, str, float] = (np.inf, -1, "", 0.0)
    for k, column in enumerate(table.values.T):
        if not np.isfinite(column).all() or len(column) < 3:
            continue
        steps = np.diff(column)
        middle = float(np.median(steps))
        if not middle > 0.0 or (steps > 0.0).mean() < 0.98:
            continue
        spread = float(np.percentile(np.abs(steps - middle), 90.0)) / middle
        spread -= 10.0 * _says(table, k, r"time|stamp|^t$|^t[_\W]|sec|tow|sow|epoch")
        for unit, scale in _TIME_UNITS.items():
            rate = 1.0 / (middle * scale)
            inside = _RATES[0] <= rate <= _RATES[1]
            named = _says(table, k, rf"(?:[\W_]){unit}(?:ec)?\W*$|[a-z]{unit.upper()}$")
            if inside or named:
                off = abs(np.log10(rate / 200.0))  # most units of users give 50 to 1000 a second
                best = min(best, (spread + 0.01 * off - 5.0 * named, k, unit, middle * scale))
    if best[1] < 0:
        raise InputError(
            f"{table.path}: no column increases from row to row by the interval of inertial sensors ({_RATES[0]:g} to "
            f"{_RATES[1]:g} samples a second) in s, ms, us or ns. Describe the columns in a scenario's [log.imu], "
            "and inspect the scenario."
        )
    return best[1], best[2], best[3]


def _accelerometers(table: TextTable, first: int, time: int, interval: float) -> tuple[float, int, Kind, str]:
    """Return how badly three columns fit gravity (infinite if not at all), with the kind and unit of the best fit."""
    three = table.values[:, first : first + 3]
    best: tuple[float, int, Kind, str] = (np.inf, first, "rates", "")
    if not _varies(table, first):
        return best
    size = float(np.nanmedian(np.linalg.norm(three, axis=1)))
    # names of all three, or a whole number of triads before them: neighbours of z have gravity in them, too
    named = all(_says(table, first + k, r"acc|force|^f[xyz]|^a[xyz]|dv") for k in range(3))
    before = [k for k in range(first) if k != time and table.values[:, k].std() > 0.0]
    bonus = 2.0 * named + (len(before) % 3 == 0)
    readings: list[tuple[Kind, dict[str, float], float]] = [
        ("rates", _ACCEL, 1.0),
        ("increments", _ACCEL_INCREMENTS, 1.0 / interval),
    ]
    for kind, units, per_second in readings:
        for unit, scale in units.items():
            off = abs(size * scale * per_second / G0 - 1.0)
            if off <= _NEAR_G:
                best = min(best, (off + (kind == "increments") * 1e-3 - bonus, first, kind, unit))
    return best


def _gyro_unit(table: TextTable, first: int, kind: Kind) -> tuple[str, bool]:
    """Return the unit of the gyros from the names, or the likeliest one from the numbers, and whether it is sure."""
    for unit in _GYRO if kind == "rates" else _GYRO_INCREMENTS:
        if _says(table, first, _UNIT_WORDS.get(unit, rf"(?:[\W_]){re.escape(unit)}(?:$|[\W_])")):
            return unit, True
    if kind == "increments":
        return "rad", False
    # a turn of a vehicle is 5 to 100 °/s: numbers above 10 are no rad/s
    return (
        "deg/s" if float(np.nanpercentile(np.abs(table.values[:, first : first + 3]), 99.0)) > 6.0 else "rad/s"
    ), False


def other_gyro_units(layout: Layout) -> list[str]:
    """Return the units that the gyros may have, the guessed one first."""
    units = list(_GYRO if layout.kind == "rates" else _GYRO_INCREMENTS)
    units.remove(layout.gyro_unit)
    return [layout.gyro_unit, *units]


def scaled(values: Array, unit: str, kind: Kind) -> Array:
    """Return numbers of the gyros in SI units.

    Args:
        values: (N, 3) in `unit`.
        unit: unit.
        kind: rates or increments.

    Returns:
        (N, 3) rad/s or rad.
    """
    return np.asarray(values * (_GYRO if kind == "rates" else _GYRO_INCREMENTS)[unit])
