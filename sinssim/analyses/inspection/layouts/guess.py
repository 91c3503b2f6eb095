"""Guesses what several text files hold together: a unit in one file or in two, and fixes, in one of them or apart."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sinssim.analyses.inspection.layouts.fix_columns import FixLayout, guess_fixes
from sinssim.analyses.inspection.layouts.gravity import gravity_in, part_of_unit, whole_unit
from sinssim.analyses.inspection.layouts.inertial import Layout, joined, off_gravity
from sinssim.analyses.inspection.layouts.kinds import split_kinds
from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.analyses.inspection.layouts.time_column import UncertainUnitError
from sinssim.errors import InputError
from sinssim.logs.files import fix_stream
from sinssim.logs.log import LogGnss
from sinssim.logs.streams import Streams
from sinssim.logs.text.names import TIME_UNITS, quantity, triads


@dataclass(frozen=True)
class Guessed:
    """What text files hold.

    Attributes:
        unit: file and layout of the inertial unit; None without.
        fixes: files and layouts of fixes.
        left: sentences on files that are not used.
    """

    unit: tuple[TextTable, Layout] | None
    fixes: tuple[tuple[TextTable, FixLayout], ...]
    left: tuple[str, ...] = ()

    @property
    def paths(self) -> set[Path]:
        """The files."""
        return {table.path for table, _ in (*([self.unit] if self.unit else ()), *self.fixes)}

    def streams(self) -> list[Streams]:
        """Return the streams of the files, as a run reads them."""
        found = []
        if self.unit is not None:
            stream, clock = self.unit[1].stream(self.unit[0])
            found.append(Streams(self.unit[0].path, "text", clock, inertial={"imu": stream}, notes=self.unit[0].notes))
        for table, layout in self.fixes:
            keys = {"file": str(table.path.resolve()), "format": "text", **layout.description(table)}
            fixes, clock, notes = fix_stream(LogGnss.model_validate(keys))
            found.append(Streams(table.path, "text", clock, fixes={"gnss": fixes}, notes=notes))
        return found


def guess_files(tables: list[TextTable], *, unit_known: bool = False, lasts: float | None = None) -> Guessed:
    """Guess what text files of unknown columns hold.

    Args:
        lasts: duration of the fixes of other files, s; None if there are none.

    Raises:
        InputError: a file is neither a log of an inertial unit, or a part of one, nor fixes.
    """
    tables, beside = _split(tables)
    tables = [replace(table, lasts=lasts or _longest_fixes(tables)) for table in tables]
    units: list[tuple[TextTable, Layout]] = []
    parts: list[tuple[TextTable, Layout]] = []
    neither: list[InputError] = []
    lacking: list[InputError] = []
    gravity = next(((table, own) for table in tables if (own := gravity_in(table)) is not None), None)
    alone = None if gravity is None or not _is_gravity_alone(gravity[0]) else gravity[0]
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
        parts = [part for part in parts if not any(part is one for one in chosen)]
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
    near = None
    if unit is not None:
        table, layout = unit
        column, scale = table.values[:, layout.time], TIME_UNITS[layout.time_unit]
        if layout.time in table.dates:
            scale = 1.0
        near = table.label(layout.time), layout.time_unit, float(column[0]) * scale, float(column[-1]) * scale
    fixes = [(table, found) for table in tables if (found := guess_fixes(table, near)) is not None]
    if unit is not None and len(fixes) == 1 and fixes[0][0] is unit[0]:
        fixes = [(unit[0], replace(fixes[0][1], time=unit[1].time, time_unit=unit[1].time_unit))]
    return Guessed(unit, tuple(fixes), (*left, *(f"{error} The file is not used." for error in neither)))


def _longest_fixes(tables: list[TextTable]) -> float | None:
    """Return how long the fixes of files without inertial data last, s; None if there are no such files."""
    found = [0.0]
    for table in tables:
        fixes = None if triads(table.words) else guess_fixes(table)
        if fixes is not None and not fixes.held:
            scale = 1.0 if fixes.time in table.dates else TIME_UNITS[fixes.time_unit]
            found.append(float(np.nanmax(table.values[:, fixes.time]) - np.nanmin(table.values[:, fixes.time])) * scale)
    return max(found) or None


def _named(table: TextTable, what: str) -> bool:
    """Return whether the names of a file say that it has a triad: "gyro" or "accel"."""
    return any({quantity((table.words or ())[k]) for k in three} == {what} for three in triads(table.words))


def _is_gravity_alone(table: TextTable) -> bool:
    """Return whether a file of gravity holds nothing else: it is named so, and has one triad."""
    return len(triads(table.words)) == 1


def _split(tables: list[TextTable]) -> tuple[list[TextTable], list[str]]:
    """Return the parts of the files, and sentences on what is left out of them."""
    found: list[TextTable] = []
    left: list[str] = []
    for table in tables:
        parts, sentences = split_kinds(table)
        found, left = [*found, *parts], [*left, *sentences]
    return found, left


def _place(table: TextTable) -> str:
    """Return the file, and the rows in it."""
    said = ", ".join(f"{name} = {value}" for name, value in table.rows.items())
    return f"{table.path}{f' ({said})' if said else ''}"


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
