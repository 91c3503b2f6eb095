"""Guesses which columns of a text file are time, gyros and accelerometers, and their units, from names and numbers.

Accelerometers show by gravity and by their names.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sinssim.analyses.inspection.text_columns import (
    TextTable,
    Three,
    copies,
    gyro_unit_of,
    lasts,
    quaternion,
    repeats,
    says_no_gravity,
    spread,
    time_column,
    turns,
    uneven,
    unlike_gyros,
    varies,
)
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.column_names import TIME_UNITS, UNITS, quantity, triads, unit_of
from sinssim.logs.gps_time import gps_from_unix
from sinssim.logs.imu_samples import WITHOUT_GRAVITY, with_readings, without_gravity
from sinssim.logs.recorded_streams import Clock, InertialStream
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
    quantities = {quantity(table.words[k]) for k in three}
    return quantities.pop() if len(quantities) == 1 else None


def accelerometers(table: TextTable, three: Three, time: int, interval: float) -> tuple[float, Three, Kind, str]:
    """Judge whether three columns, with an interval between samples, s, are accelerometers: return how badly they fit
    gravity, infinite if not at all, the columns, and kind and unit of the best fit."""
    best: tuple[float, Three, Kind, str] = (np.inf, three, "rates", "")
    quantities = named_quantity(table, three)
    if not varies(table, three) or quantities == "gyro":
        return best
    values = table.values[:, list(three)]
    values = values[np.isfinite(values).all(axis=1)]
    interval *= len(table.values) / max(len(values), 1)
    size = float(np.median(np.linalg.norm(values, axis=1))) if len(values) else 0.0
    word = None if table.words is None else table.words[three[0]]
    trusted = quantities == "accel" and not says_no_gravity(table, word)
    unit_named = trusted and unit_of(word, tuple(UNITS["accel", "rates"])) is not None
    if not size:
        return best
    sure = unit_named or (trusted and turns(table, interval))
    if not sure and (not lasts(values, interval) or without_gravity(values, interval)):
        return best
    # neighbours of z have gravity in them, too, but not its noise; then a whole number of triads before them counts
    before = [k for k in range(min(three)) if k != time and table.values[:, k].std() > 0.0]
    bonus = 2.0 * (quantities == "accel") + 0.05 * (len(before) % 3 == 0)
    bonus -= (0.3 * uneven(values) + 0.3 * min(spread(values), 1.0) + 0.3 * repeats(values)) * (quantities is None)
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


@dataclass(frozen=True)
class Layout:
    """A guess of a log's layout."""

    kind: Kind  # rates or increments
    time: int  # column of the time, from 0
    time_unit: str  # one of s, ms, us, ns
    # gyro, accel: columns x, y, z of the triads, from 0; None for a triad of another file
    gyro: Three | None
    accel: Three | None
    # gyro_unit, accel_unit: units
    gyro_unit: str
    accel_unit: str
    gyro_unit_sure: bool  # whether names or the kind give the unit of the gyros; otherwise fixes have to tell
    # gyro_signs, accel_signs: signs of the columns
    gyro_signs: Three = (1, 1, 1)
    accel_signs: Three = (1, 1, 1)
    # path, columns and numbers of the file with the other triad; None if one file has both
    other: tuple[TextTable, Layout] | None = None
    # file and layout (as `accel`) of a gravity vector that is added to the accelerometers, which do not contain it;
    # None if they do
    gravity: tuple[TextTable, Layout] | None = None

    def columns(self, table: TextTable, name: str) -> tuple[TextTable, Three]:
        """Return the table and the columns of a triad, "gyro" or "accel"."""
        of_triad: Three | None = getattr(self, name)
        if of_triad is not None:
            return table, of_triad
        assert self.other is not None
        three: Three | None = getattr(self.other[1], name)
        assert three is not None
        return self.other[0], three

    def coarse_stamps(self, table: TextTable) -> bool:
        """Return whether stamps repeat between rows that differ: those of packets, or of a clock that is too coarse."""
        of, three = self.columns(table, "gyro")
        rows = table.values[np.isfinite(table.values[:, list(three)]).all(axis=1)] if of is table else table.values
        same = np.diff(rows[:, self.time]) == 0.0
        return bool(same.any() and of is table and (np.diff(rows[:, list(three)], axis=0)[same] != 0.0).any())

    def unix(self, table: TextTable) -> bool:
        """Return whether the times count from 1970."""
        return is_unix(table, self.time, table.values[:, self.time] * TIME_UNITS[self.time_unit])

    def description(self, table: TextTable, folder: Path | None = None) -> dict[str, Any]:
        """Return the keys of the description of the log; the path of a second file is relative to the scenario's
        folder."""
        keys: dict[str, Any] = {"kind": self.kind, "time": table.label(self.time)}
        if self.time not in table.dates:
            keys["time_unit"] = self.time_unit
        keys |= table.layout()
        if self.unix(table):
            keys["clock"] = "unix"
        if self.coarse_stamps(table):
            keys["stamps"] = "even"
        triads = [
            ("gyro", self.gyro_unit, self.gyro_signs, *self.columns(table, "gyro")),
            ("accel", self.accel_unit, self.accel_signs, *self.columns(table, "accel")),
        ]
        if self.gravity is not None:
            at, layout = self.gravity
            triads.append(("gravity", layout.accel_unit, layout.accel_signs, *layout.columns(at, "accel")))
        for name, unit, signs, of, three in triads:
            keys[name] = {"columns": [of.label(k) for k in three], "unit": unit}
            if signs != (1, 1, 1):
                keys[name]["signs"] = list(signs)
            if of is not table and of.path != table.path:
                keys[name]["file"] = of.path.name if folder is None else relative(of.path, folder)
            if of is not table and of.rows != table.rows:
                keys[name]["rows"] = dict(of.rows)
        return keys

    def stream(self, table: TextTable) -> tuple[InertialStream, Clock]:
        """Return the readings in SI units, and the clock of their times."""
        values_of = {}
        time, clock = self._time_of(table, self.time, self.time_unit)
        inside = np.ones(len(time), dtype=bool)
        for name, unit, signs in (
            ("gyro", self.gyro_unit, self.gyro_signs),
            ("accel", self.accel_unit, self.accel_signs),
        ):
            of, three = self.columns(table, name)
            values = of.values[:, list(three)] * (UNITS[name, self.kind][unit] * np.array(signs, dtype=np.float64))
            if of is not table:
                assert self.other is not None
                values, within = self._at(time, clock, (of, self.other[1]), values)
                inside &= within
            values_of[name] = values
        if self.gravity is not None:
            of, layout = self.gravity
            size = UNITS["accel", "rates"][layout.accel_unit] * np.array(layout.accel_signs, dtype=np.float64)
            gravity, within = self._at(time, clock, self.gravity, of.values[:, list(layout.accel or ())] * size)
            values_of["accel"] = values_of["accel"] + gravity
            inside &= within
        inside &= with_readings(values_of["gyro"], values_of["accel"])
        return InertialStream(time[inside], values_of["gyro"][inside], values_of["accel"][inside], self.kind), clock

    def _at(self, time: Array, clock: Clock, part: tuple[TextTable, Layout], values: Array) -> tuple[Array, Array]:
        """Return values of another file or of other rows at some times, (N, 3), and which times are within, (N,)."""
        of, layout = part
        known = np.isfinite(values).all(axis=1)
        at, its = self._time_of(of, layout.time, layout.time_unit)
        at = at[known] + ((its.origin_gps_s or 0) - (clock.origin_gps_s or 0))
        read = np.stack([np.interp(time, at, axis[known]) for axis in values.T], axis=1)
        return read, (time >= at[0]) & (time <= at[-1])

    @staticmethod
    def _time_of(table: TextTable, column: int, unit: str) -> tuple[Array, Clock]:
        """Return the times, s, and their clock."""
        clock = Clock("machine", None, "times without a date")
        if column in table.dates:
            return table.values[:, column], table.clocks.get(column) or clock
        time = table.values[:, column] * TIME_UNITS[unit]
        if not is_unix(table, column, time):
            return time, clock
        first = np.floor(time[0])
        return time - first, Clock("utc", int(gps_from_unix(first)), "Unix time")


def is_unix(table: TextTable, column: int, time: Array) -> bool:
    """Return whether times count from 1970: they are of the years 2001 to 2039, and no name says GPS."""
    if column in table.dates or re.search("gps", str(table.label(column)), re.IGNORECASE):
        return False
    return 1.0e9 < float(np.median(time)) < 2.2e9


def relative(path: Path, folder: Path) -> str:
    """Return a path relative to a folder if it lies in it, or else a whole one."""
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        return path.resolve().as_posix()


def guess_layout(table: TextTable, known: tuple[Three, str] | None = None) -> Layout:
    """Guess the layout of a log of inertial readings. `known`: columns and unit of the accelerations, if they are
    known."""
    time, unit, interval = time_column(table)
    free = _threes(table, time)
    accel = min((accelerometers(table, three, time, interval) for three in free), default=None)
    if known is not None:
        accel = 0.0, known[0], "rates", known[1]
    if accel is None or not np.isfinite(accel[0]):
        named = [three for three in free if named_quantity(table, three) == "accel"]
        raise InputError(no_gravity_words(table, named[0]) if named else _no_gravity(table))
    _, at, kind, accel_unit = accel
    gyros = [three for three in free if not set(three) & set(at) and varies(table, three)]
    gyros = [three for three in gyros if not copies(table, three, at)]
    named = [three for three in gyros if named_quantity(table, three) == "gyro"]
    unnamed = [three for three in gyros if named_quantity(table, three) is None]
    if not (named or unnamed):
        raise InputError(f"{table.path}: besides the accelerometers, no three columns can be gyros.")
    first = (named or sorted(unnamed, key=lambda three: unlike_gyros(table, three, at)))[0]
    gyro_unit, sure = gyro_unit_of(table, first, kind)
    return Layout(kind, time, unit, first, at, gyro_unit, accel_unit, sure)


def guess_part(table: TextTable) -> Layout | None:
    """Guess the layout of a file of gyros alone or accelerometers alone, as phones write; None if it is neither."""
    time, unit, interval = time_column(table)
    free = [three for three in _threes(table, time) if varies(table, three)]
    gyros = [t for t in free if quantity_of(table, t) == "gyro"]
    if gyros:
        gyro_unit, sure = gyro_unit_of(table, gyros[0], "rates")
        return Layout("rates", time, unit, gyros[0], None, gyro_unit, "m/s^2", sure)
    accel = [t for t in free if quantity_of(table, t) == "accel"]
    fits = min((accelerometers(table, three, time, interval) for three in accel), default=None)
    if not accel or fits is None:
        return None
    # Sensor Logger writes this file without gravity; 1 m/s² of it would pass for 1 g
    bare = (
        table.path.stem.lower() == "accelerometer" and "seconds_elapsed" in (table.words or ()) and fits[3] != "m/s^2"
    )
    if not np.isfinite(fits[0]) or fits[2] != "rates" or bare:
        raise InputError(no_gravity_words(table, accel[0]))
    return Layout("rates", time, unit, None, fits[1], "rad/s", fits[3], True)


def off_gravity(table: TextTable, layout: Layout) -> float:
    """Return by which part the median specific force of a layout of rates differs from gravity."""
    assert layout.accel is not None
    size = float(np.nanmedian(np.linalg.norm(table.values[:, list(layout.accel)], axis=1)))
    return abs(size * UNITS["accel", "rates"][layout.accel_unit] / G0 - 1.0)


def joined(parts: list[tuple[TextTable, Layout]]) -> tuple[TextTable, Layout]:
    """Join the layouts of a file of gyros and a file of accelerometers; return the file of the gyros, whose stamps
    count."""
    gyros = [part for part in parts if part[1].gyro is not None]
    accel = [part for part in parts if part[1].accel is not None]
    if len(gyros) != 1 or len(accel) != 1:
        names = ", ".join(str(table.path) for table, _ in parts)
        raise InputError(
            f"{names}: {len(gyros)} files contain only gyros and {len(accel)} only accelerometers; one of each is "
            "needed. Give the files of the raw data, with gravity and without compensation."
        )
    (table, layout), (other, of) = gyros[0], accel[0]
    if (table.label(layout.time), _written(table)) != (other.label(of.time), _written(other)):
        raise InputError(
            f"{table.path} and {other.path}: their times are in the columns {table.label(layout.time)!r} and "
            f"{other.label(of.time)!r}, but both files must have the same layout. Rewrite one of them."
        )
    return table, replace(
        layout, accel_unit=of.accel_unit, other=(other, replace(of, gravity=None)), gravity=of.gravity
    )


def _written(table: TextTable) -> dict[str, Any]:
    return {key: value for key, value in table.layout().items() if key != "rows"}


def _no_gravity(table: TextTable) -> str:
    return (
        f"{table.path}: no three adjacent columns have the median magnitude of gravity in m/s², g, mg or ft/s², as "
        "rates or as increments. Describe the columns in the table [log.imu] of a scenario, and inspect the scenario."
    )


def _threes(table: TextTable, time: int) -> list[Three]:
    """Return the columns that may be a triad: those whose names differ by an axis, or else all three in a row."""
    named = [three for three in triads(table.words) if time not in three and named_quantity(table, three) != "other"]
    if named:
        return named
    count = table.values.shape[1]
    taken = {time, *quaternion(table)}
    return [(k, k + 1, k + 2) for k in range(count - 2) if not {k, k + 1, k + 2} & taken]


def quantity_of(table: TextTable, three: Three) -> str | None:
    """Return what the names of three columns say, or else the rows or the name of the file, as `quantity`."""
    stem = next((what for text in (*table.rows.values(), table.path.stem) if (what := quantity(text))), None)
    return named_quantity(table, three) or stem
