"""Tracks as tables with named columns, CSV or Parquet; the streams `truth` and `nav_…` of a run are such tables."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats import columns
from sinssim.logs.streams import Clock, HeightDatum, SolutionStream, Streams
from sinssim.logs.text.cut_rows import cut_rows
from sinssim.logs.text.description import TIME_UNITS, epoch_unit
from sinssim.logs.utc import gps_seconds
from sinssim.system.user_file import read_bytes, user_file
from sinssim.units import DEG, FOOT

_STEMS = {
    "time": ("time", "t", "time_utc", "timestamp"),
    "latitude": ("latitude", "lat"),
    "longitude": ("longitude", "lon", "lng", "long"),
    "height": ("height", "altitude", "alt", "elevation", "ele", "hgt"),
    "roll": ("roll",),
    "pitch": ("pitch",),
    "heading": ("heading", "yaw", "hdg"),
}
"""First parts of the names of columns; a unit follows."""
_ANGLES = {"deg": DEG, "degree": DEG, "degrees": DEG, "°": DEG, "rad": 1.0, "radian": 1.0, "radians": 1.0}
_LENGTHS = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "km": 1e3, "ft": FOOT, "feet": FOOT,
    "foot": FOOT,
}  # fmt: skip
_UNITS = {name: _LENGTHS if name == "height" else TIME_UNITS if name == "time" else _ANGLES for name in _STEMS}
"""Units in the names of columns, in SI."""
_ATTITUDE = ("roll", "pitch", "heading")
_QUATERNIONS = (("qw", "qx", "qy", "qz"), ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"))
_VELOCITIES = (("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), ("vn_mps", "ve_mps", "vd_mps"))
_PARQUET = b"PAR1"
_NAME = re.compile(r"(time_utc|[a-z]+)(?:_([a-z]+)|\s*[\[(]\s*([a-z°]+)\s*[\])])?")
"""A quantity and its unit: altitude_ft, "Altitude [ft]", "Altitude (ft)"."""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a file with these first bytes may be a table with the columns of a track."""
    if head.startswith(_PARQUET):
        try:
            names = _parquet_names(path)
        except InputError:
            return False
    else:
        text = head.decode("utf-8", "replace").lstrip("﻿")
        line = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
        names = [name.strip() for name in line.split(_delimiter(line))]
    if not head.startswith(_PARQUET) and columns.recognises(path, head):
        return False  # which reads inertial readings and σ, too
    return {"time", "latitude"} <= {found[0] for name in names if (found := _quantity(name)) is not None}


def _quantity(name: str) -> tuple[str, str] | None:
    """Return which quantity a column holds by its name, and in what unit, "" if it gives none; None for others."""
    match = _NAME.fullmatch(name.strip().lower())
    if match is None:
        return None
    quantity = next((quantity for quantity, stems in _STEMS.items() if match[1] in stems), None)
    unit = match[2] or match[3] or ""
    return None if quantity is None or (unit and unit not in _UNITS[quantity]) else (quantity, unit)


def read(path: Path) -> Streams:
    """Return the track in a CSV or Parquet file with named columns.

    The columns are a time (`time_s`, or `time` in seconds or ISO 8601), `latitude_deg`, `longitude_deg`, optionally
    `height_m`, the attitude (`roll_deg`, `pitch_deg`, `heading_deg`, or `qw`, `qx`, `qy`, `qz`), and a velocity
    (`velocity_n_mps`, `velocity_e_mps`, `velocity_d_mps`). Angles may be in radians: `latitude_rad`, heights in feet:
    `altitude_ft`. A note names the columns that are not read.

    Args:
        path: the file.

    Returns:
        One solution, named "track".

    Raises:
        InputError: a column is missing, or a field is not a number; the message gives file and row.
    """
    notes: list[str] = []
    columns = _parquet(path) if read_bytes(path)[:4] == _PARQUET else _csv(path, notes)
    time, clock = _time(path, columns, notes)
    found = {name: _column(path, columns, name, notes) for name in _STEMS if name != "time"}
    for name in ("latitude", "longitude"):
        if found[name] is None:
            raise InputError(
                f"{path} has no column {name}_deg; its columns are {_listed(columns)}. Rename one of them."
            )
    given = [name for name in _ATTITUDE if found[name] is not None]
    if given and len(given) < 3:
        raise InputError(
            f"{path} has {' and '.join(f'{name}_deg' for name in given)} but not the other angles of roll_deg, "
            "pitch_deg and heading_deg: give all three, or none."
        )
    height = found["height"]
    latitude, longitude = found["latitude"], found["longitude"]
    assert latitude is not None  # checked above
    assert longitude is not None
    datum: HeightDatum = "ellipsoid" if "height_m" in columns else "unknown"
    used = {_time_column(columns), *sum((*_QUATERNIONS, *_VELOCITIES), ())}
    used |= {n for n in columns if (of := _quantity(n)) is not None and of[0] in found and found[of[0]] is not None}
    if rest := [name for name in columns if name not in used]:
        notes.append(f"Columns that are not read: {_listed(rest)}.")
    solution = SolutionStream(
        time,
        latitude,
        longitude,
        np.full(len(time), np.nan) if height is None else height,
        datum,
        velocity_ned=_vectors(path, columns, _VELOCITIES),
        q_nb=_attitude(path, columns, found),
    )
    return Streams(path, "track-csv", clock, solutions={"track": solution}, notes=tuple(notes))


Columns = Mapping[str, "list[str] | Array"]


def _attitude(path: Path, columns: Columns, found: Mapping[str, Array | None]) -> Array | None:
    q = _vectors(path, columns, _QUATERNIONS)
    if q is not None:
        return q
    roll, pitch, heading = found["roll"], found["pitch"], found["heading"]
    if roll is None or pitch is None or heading is None:
        return None
    from sinssim.rotation.arrays import quaternion_from_euler

    return quaternion_from_euler(roll, pitch, heading)


def _vectors(path: Path, columns: Columns, names: tuple[tuple[str, ...], ...]) -> Array | None:
    for own in names:
        if own[0] in columns:
            missing = [name for name in own if name not in columns]
            if missing:
                raise InputError(f"{path} has a column {own[0]}, but none of {', '.join(missing)}: give all of them.")
            return np.stack([_numbers(path, columns, name) for name in own], axis=1)
    return None


def _column(path: Path, columns: Columns, quantity: str, notes: list[str]) -> Array | None:
    given = [(name, found[1]) for name in columns if (found := _quantity(name)) is not None and found[0] == quantity]
    if len(given) > 1:
        raise InputError(f"{path} has the columns {' and '.join(name for name, _ in given)}: keep one of them.")
    if not given:
        return None
    name, unit = given[0]
    values = _numbers(path, columns, name)
    if quantity in _ATTITUDE and not unit:
        beyond = any(
            float(np.nanmax(np.abs(_numbers(path, columns, other)), initial=0.0)) > 2.0 * np.pi
            for other in columns
            if (found := _quantity(other)) is not None and found[0] in _ATTITUDE and not found[1]
        )
        if not beyond:
            notes.append(
                f"The column {name} has no unit, and its numbers may be degrees or radians: name it {name}_deg or "
                f"{name}_rad."
            )
            return None
    return values * (_UNITS[quantity][unit] if unit else 1.0 if quantity == "height" else DEG)


def _numbers(path: Path, columns: Columns, name: str) -> Array:
    """Return a column as numbers; empty fields are NaN."""
    values = columns[name]
    if isinstance(values, np.ndarray):
        return np.asarray(values, np.float64)
    numbers = np.empty(len(values))
    for row, text in enumerate(values):
        try:
            numbers[row] = float(text) if text.strip() else np.nan
        except ValueError as error:
            raise InputError(f"{path}, row {row + 1}: {name} = {shortened(text)!r} is not a number.") from error
    return numbers


def _time_column(columns: Columns) -> str | None:
    """Return the column of the time, time_s before others; None if there is none."""
    given = [name for name in columns if (found := _quantity(name)) is not None and found[0] == "time"]
    return "time_s" if "time_s" in given else next(iter(given), None)


def _time(path: Path, columns: Columns, notes: list[str]) -> tuple[Array, Clock]:
    name = _time_column(columns)
    if name is None:
        raise InputError(
            f"{path} has no column time_s; its columns are {_listed(columns)}. A path without times is planned with "
            "[[track.waypoints]] and speeds."
        )
    values = columns[name]
    text = not isinstance(values, np.ndarray) and bool(values) and "-" in values[0].strip()[1:] and ":" in values[0]
    if not text:
        stamps = _numbers(path, columns, name)
        unit = (_quantity(name) or ("", ""))[1]
        if not unit and len(stamps) > 1:
            unit = epoch_unit(stamps, float(np.median(np.diff(stamps)))) or "s"
        return stamps * TIME_UNITS[unit or "s"], Clock("machine", None, f"{unit or 's'} of the column {name}")
    moments, zoned = np.empty(len(values)), True
    for row, word in enumerate(values):
        try:
            moments[row], zone = gps_seconds(str(word))
        except InputError as error:
            raise InputError(f"{path}, row {row + 1}: {error}") from error
        zoned = zoned and zone
    origin = int(np.floor(moments[0]))
    if not zoned:
        notes.append("Times without a time zone are taken as UTC.")
    return moments - origin, Clock("utc", origin, f"UTC of the column {name}")


def _fields(lines: list[str], delimiter: str) -> list[list[str]]:
    """Return the fields of some lines."""
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))


def _listed(names: Iterable[str]) -> str:
    """Return names of columns for a message."""
    return shortened(", ".join(names), 300)


def _is_line(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#")


def _delimiter(line: str) -> str:
    return max(",;\t", key=line.count)


def _csv(path: Path, notes: list[str]) -> dict[str, list[str]]:
    try:
        data = read_bytes(path)
        text = data.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as text: {error}.") from error
    lines = [line for line in text.splitlines() if _is_line(line)]
    if not lines:
        raise InputError(f"{path} is empty.")
    names = [name.strip() for name in _fields(lines[:1], _delimiter(lines[0]))[0]]
    columns: dict[str, list[str]] = {name: [] for name in names}
    if len(columns) < len(names):
        raise InputError(f"{path} has two columns of one name: {_listed(names)}.")
    cut = cut_rows(path, _delimiter(lines[0]), text.splitlines().index(lines[0]) + 1, len(names))
    if cut.notes:
        notes += cut.notes
        lines = [line for line in cut.without(data).decode("utf-8-sig").splitlines() if _is_line(line)]
    for number, row in enumerate(_fields(lines[1:], _delimiter(lines[0])), start=1):
        if len(row) != len(names):
            raise InputError(f"{path}, row {number}: {len(row)} fields, but the first line names {len(names)} columns.")
        for name, value in zip(names, row, strict=True):
            columns[name].append(value)
    return columns


def _parquet_names(path: Path) -> list[str]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return list(pq.read_schema(user_file(path)).names)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path} cannot be read as Parquet: {error}.") from error


def _parquet(path: Path) -> dict[str, Array]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    wanted = {*sum((*_QUATERNIONS, *_VELOCITIES), ())}
    all_names = _parquet_names(path)
    names = [name for name in all_names if name in wanted or _quantity(name) is not None]
    try:
        table = pq.read_table(user_file(path), columns=names)
        read = {name: np.asarray(table[name].to_numpy(), np.float64) for name in names}
        return read | {name: np.empty(0) for name in all_names if name not in names}
    except (OSError, ValueError, pa.ArrowException) as error:
        raise InputError(f"{path} cannot be read as a Parquet table of numbers: {error}.") from error
