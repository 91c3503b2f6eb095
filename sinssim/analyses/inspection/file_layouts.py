"""Guesses what several text files hold: a unit in one file or in two, fixes, and gravity apart.

Fixes are in one of the files with the unit, or in their own.

Phones write a gravity vector g and accelerations u without gravity. A recorder splits the reading s of the
accelerometers into the two with a filter that turns g with the gyros and pulls it toward s: ġ = -ω × g + k (s - g).
With s = g + u the pull is k u; with s = g - u it is -k u, which decides the relative sign. The fixes do not tell the
two apart: the opposite sign of horizontal accelerations is half a turn of the heading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sinssim.analyses.inspection.fix_columns import FixLayout, guess_fixes
from sinssim.analyses.inspection.inertial_columns import (
    Layout,
    guess_layout,
    guess_part,
    joined,
    off_gravity,
    quantity_of,
)
from sinssim.analyses.inspection.text_columns import (
    TextTable,
    Three,
    UncertainUnitError,
    split_kinds,
    time_column,
    varies,
)
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.column_names import TIME_UNITS, UNITS, means, quantity, says, triads, unit_of
from sinssim.logs.log_files import fix_stream
from sinssim.logs.log_settings import LogGnss
from sinssim.logs.recorded_streams import Streams
from sinssim.units import G0

_BARE = r"lin|user"
_NEAR_G = 0.05
"""Relative departure of a gravity vector from standard gravity: that of the Earth, and rounding."""
_ALONG = 0.5
"""Least ratio of the mean component along gravity to the median magnitude of readings that contain gravity."""

Part = tuple[TextTable, Layout]


def gravity_in(table: TextTable) -> Layout | None:
    """Find the columns of a gravity vector, by their names or that of the file, and by its constant magnitude; return
    them as `accel`, or None if there is none."""
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
    """Guess the layout of a file of gyros and accelerometers, or gyros, accelerations without gravity, and gravity."""
    gravity = gravity_in(table)
    if gravity is None:
        return guess_layout(table)
    try:
        layout = guess_layout(table)
        if layout.accel is not None and contains(table, layout.accel, (table, gravity)):
            return layout
    except InputError:
        if not _accelerations(table, gravity):
            raise
    three = next(iter(_accelerations(table, gravity)), None)
    if three is None:
        return guess_layout(table)
    return replace(guess_layout(table, (three, _unit(table, three, gravity))), gravity=(table, gravity))


def part_of_unit(table: TextTable, gravity: Part | None) -> Layout | None:
    """Guess the layout of a file of gyros alone or accelerometers alone, as `guess_part`; that of gravity, if there is
    a file of it, is added if these lack it."""
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
    at, of_gravity = gravity
    three = next(
        (t for t in _accelerations(table, of_gravity if at is table else None) if _overlap(table, gravity)), None
    )
    if three is None:
        if why is not None:
            raise why
        return part
    time, unit, _ = time_column(table)
    names = (table.label(time), at.label(of_gravity.time))
    if names[0] != names[1] or (table.delimiter, table.skip_lines) != (at.delimiter, at.skip_lines):
        raise InputError(
            f"{table.path} and {at.path}: their times are in the columns {names[0]!r} and {names[1]!r}, but both files "
            "must have the same layout. Rewrite one of them."
        )
    return Layout("rates", time, unit, None, three, "rad/s", _unit(table, three, of_gravity), True, gravity=gravity)


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
        known_time, time = at.values[known, layout.time], table.values[:, time_column(table)[0]]
        values = np.stack([np.interp(time, known_time, axis, np.nan, np.nan) for axis in values[known].T], axis=1)
    return np.asarray(values / np.linalg.norm(values, axis=1, keepdims=True))


def _overlap(table: TextTable, gravity: Part) -> bool:
    return bool(np.isfinite(_direction(table, gravity)).any())


def _accelerations(table: TextTable, gravity: Layout | None) -> list[Three]:
    """Return the triads of accelerations that may lack gravity, those whose names say so first."""
    candidates = [t for t in triads(table.words) if (gravity is None or t != gravity.accel) and varies(table, t)]
    candidates = [t for t in candidates if quantity_of(table, t) == "accel"]
    return sorted(candidates, key=lambda t: not says(str(table.label(t[0])), _BARE))


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


@dataclass(frozen=True)
class Guessed:
    """What text files hold."""

    unit: tuple[TextTable, Layout] | None  # file and layout of the inertial unit; None without
    fixes: tuple[tuple[TextTable, FixLayout], ...]  # files and layouts of fixes
    left: tuple[str, ...] = ()  # sentences on files that are not used

    @property
    def paths(self) -> set[Path]:
        """The files."""
        return {table.path for table, _ in (*([self.unit] if self.unit else ()), *self.fixes)}

    def streams(self) -> list[Streams]:
        """Return the streams of the files, as a run reads them."""
        streams = []
        if self.unit is not None:
            stream, clock = self.unit[1].stream(self.unit[0])
            streams.append(
                Streams(self.unit[0].path, "text", clock, inertial={"imu": stream}, notes=self.unit[0].notes)
            )
        for table, layout in self.fixes:
            keys = {"file": str(table.path.resolve()), "format": "text", **layout.description(table)}
            fixes, clock, notes = fix_stream(LogGnss.model_validate(keys))
            streams.append(Streams(table.path, "text", clock, fixes={"gnss": fixes}, notes=notes))
        return streams


def guess_files(tables: list[TextTable], *, unit_known: bool = False, lasts: float | None = None) -> Guessed:
    """Guess what text files of unknown columns hold. `lasts`: duration of the fixes of other files, s; None if there
    are none."""
    tables, beside = _split(tables)
    tables = [replace(table, lasts=lasts or _longest_fixes(tables)) for table in tables]
    units: list[tuple[TextTable, Layout]] = []
    parts: list[tuple[TextTable, Layout]] = []
    neither: list[InputError] = []
    lacking: list[InputError] = []
    gravity = next(((table, of_gravity) for table in tables if (of_gravity := gravity_in(table)) is not None), None)
    # a file of gravity is named so; one that holds nothing else has one triad
    alone = None if gravity is None or len(triads(gravity[0].words)) != 1 else gravity[0]
    for table in tables:
        if table is alone:
            continue
        at = guess_fixes(table)
        placed = at is not None
        if at is not None and not triads(table.words) and not (at.held and table.words is None):
            continue
        try:
            units.append((table, whole_unit(table)))
        except InputError as error:
            if placed:
                neither += [error] if isinstance(error, UncertainUnitError) else []
                if _named(table, "accel") and _named(table, "gyro"):
                    beside.append(f"{error} Only the fixes of the file are used.")
                continue
            try:
                part = part_of_unit(table, gravity)
            except InputError as why:
                neither.append(why)
                continue
            if part is None:
                text = f"{str(error).rstrip('.')}. It also has no columns of latitude and longitude."
                neither.append(InputError(text))
            else:
                parts.append((table, part))
                if part.accel is None and _named(table, "accel"):
                    lacking.append(error)
    whole = bool(units)
    if not whole and {layout.gyro is None for _, layout in parts} == {True, False}:
        chosen = _chosen(parts)
        units.append(joined(chosen))
        parts = [part for part in parts if not any(part is chosen_part for chosen_part in chosen)]
    left = [*beside, *(f"{_place(table)} contains only one triad and is not used." for table, _ in parts)]
    if alone is not None and not any(layout.gravity is not None for _, layout in units):
        left.append(f"{_place(alone)} contains only gravity and is not used.")
    if not units and not unit_known and (neither or parts):
        if neither or lacking:
            raise (*neither, *lacking)[0]
        joined(parts)  # says what is missing
    if len(units) > 1:
        names = " and ".join(str(table.path) for table, _ in units)
        raise InputError(f"{names} each contain the data of an IMU: inspect one of them at a time.")
    unit = units[0] if units else None
    left += [f"{error} The file is not used." for error in neither]
    return Guessed(unit, tuple(_fixes_beside(unit, tables)), tuple(left))


def _fixes_beside(unit: tuple[TextTable, Layout] | None, tables: list[TextTable]) -> list[tuple[TextTable, FixLayout]]:
    """Return the fixes, on the clock of the unit if their file has several times."""
    near = None
    if unit is not None:
        table, layout = unit
        column, scale = table.values[:, layout.time], TIME_UNITS[layout.time_unit]
        if layout.time in table.dates:
            scale = 1.0
        near = table.label(layout.time), layout.time_unit, float(column[0]) * scale, float(column[-1]) * scale
    fixes = [(table, of_fixes) for table in tables if (of_fixes := guess_fixes(table, near)) is not None]
    if unit is not None and len(fixes) == 1 and fixes[0][0] is unit[0]:
        return [(unit[0], replace(fixes[0][1], time=unit[1].time, time_unit=unit[1].time_unit))]
    return fixes


def _longest_fixes(tables: list[TextTable]) -> float | None:
    """Return how long the fixes of files without inertial data last, s; None if there are no such files."""
    durations = [0.0]
    for table in tables:
        fixes = None if triads(table.words) else guess_fixes(table)
        if fixes is not None and not fixes.held:
            scale = 1.0 if fixes.time in table.dates else TIME_UNITS[fixes.time_unit]
            durations.append(
                float(np.nanmax(table.values[:, fixes.time]) - np.nanmin(table.values[:, fixes.time])) * scale
            )
    return max(durations) or None


def _named(table: TextTable, what: str) -> bool:
    """Return whether the names of a file say that it has a triad: "gyro" or "accel"."""
    return any({quantity((table.words or ())[k]) for k in three} == {what} for three in triads(table.words))


def _split(tables: list[TextTable]) -> tuple[list[TextTable], list[str]]:
    """Return the parts of the files, and sentences on what is left out of them."""
    all_parts: list[TextTable] = []
    left: list[str] = []
    for table in tables:
        parts, sentences = split_kinds(table)
        all_parts, left = [*all_parts, *parts], [*left, *sentences]
    return all_parts, left


def _place(table: TextTable) -> str:
    """Return the file, and the rows in it."""
    chosen = ", ".join(f"{name} = {value}" for name, value in table.rows.items())
    return f"{table.path}{f' ({chosen})' if chosen else ''}"


def _chosen(parts: list[tuple[TextTable, Layout]]) -> list[tuple[TextTable, Layout]]:
    """Return the first file of gyros and that of accelerometers with gravity, calibrated ones before others."""

    def badness(part: tuple[TextTable, Layout]) -> tuple[bool, float, bool]:
        table, layout = part
        name = " ".join((table.path.stem, *table.rows.values())).lower()
        off = 0.0 if layout.accel is None or layout.gravity is not None else round(off_gravity(table, layout), 1)
        return layout.gravity is not None, off, "uncal" in name

    order = sorted(parts, key=badness)
    gyros = next(part for part in order if part[1].gyro is not None)
    accel = next(part for part in order if part[1].accel is not None)
    return [gyros, accel]


def fix_words(table: TextTable, layout: FixLayout) -> str:
    """Return which columns hold what."""
    time = "dates" if layout.time in table.dates else layout.time_unit
    words = [f"time {table.label(layout.time)} [{time}]"]
    for name, of in layout.quantities.items():
        what = name.replace("_", " ").replace("sigma", "σ")
        if isinstance(of, int):
            words.append(f"{what} {table.label(of)}")
            continue
        columns = of.get("columns", [of.get("column")])
        axes = f", {of['axes']}" if "axes" in of else ""
        words.append(f"{what} {', '.join(str(table.label(k)) for k in columns)} [{of['unit']}{axes}]")
    return "; ".join(words) + ("; rows repeat a fix until there is a new one" if layout.held else "")


_STEP_S = 0.1
_PARTS = 12
_SURE = 4.0
"""Ratio of the mean pull to its 1σ, from the scatter of the parts, from which on it counts; by chance 1 in 500
(Student's t with 11 degrees of freedom)."""


def relative_sign(table: TextTable, layout: Layout) -> int:
    """Return the sign of the acceleration relative to gravity: 1 for a sum, -1 for a difference, 0 if it is unknown."""
    assert layout.gravity is not None
    bare = replace(layout, gravity=None).stream(table)[0]
    whole = layout.stream(table)[0]
    time, first, last = bare.time, *np.searchsorted(bare.time, whole.time[[0, -1]])
    time, rate, added = time[first : last + 1], bare.gyro[first : last + 1], bare.accel[first : last + 1]
    if len(time) != len(whole.time) or not (np.diff(time) >= 0.0).all():
        return 0
    edges = np.arange(time[0], time[-1], max(_STEP_S, 2.0 * float(np.median(np.diff(time)))))
    if len(edges) < 10 * _PARTS:
        return 0
    gravity = _at(edges, time, whole.accel - added)
    middle, step = 0.5 * (gravity[1:] + gravity[:-1]), np.diff(edges)[:, None]
    turned = np.diff(gravity, axis=0) / step + np.cross(_mean(edges, time, rate), middle)
    pushed = _mean(edges, time, added)
    slopes = []
    for pull, u in zip(np.array_split(turned, _PARTS), np.array_split(pushed, _PARTS), strict=True):
        varying = u - u.mean(axis=0)
        slopes.append(float(np.sum(pull * varying) / max(float(np.sum(varying * varying)), 1e-300)))
    mean, sigma = float(np.mean(slopes)), float(np.std(slopes, ddof=1)) / np.sqrt(_PARTS)
    return int(np.sign(mean)) if abs(mean) > _SURE * sigma else 0


def _at(edges: Array, time: Array, values: Array) -> Array:
    return np.stack([np.interp(edges, time, axis) for axis in values.T], axis=1)


def _mean(edges: Array, time: Array, values: Array) -> Array:
    """Return the means of readings between edges, (K, 3)."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return np.asarray(np.diff(_at(edges, time, sums), axis=0) / np.diff(edges)[:, None])
