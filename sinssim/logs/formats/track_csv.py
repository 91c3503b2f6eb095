"""Tracks as tables with named columns, CSV or Parquet; the streams `truth` and `nav_…` of a run are such tables."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats import columns
from sinssim.logs.streams import Clock, HeightDatum, SolutionStream, Streams
from sinssim.logs.text.cut_rows import cut_rows
from sinssim.logs.utc import gps_seconds
from sinssim.units import DEG

_TIMES = ("time_s", "time", "t", "time_utc", "timestamp")
_PLACES: dict[str, dict[str, float]] = {
    "latitude": {"latitude_deg": DEG, "latitude_rad": 1.0, "latitude": DEG, "lat_deg": DEG, "lat_rad": 1.0, "lat": DEG},
    "longitude": {
        "longitude_deg": DEG, "longitude_rad": 1.0, "longitude": DEG, "lon_deg": DEG, "lon_rad": 1.0, "lon": DEG,
        "lng": DEG,
    },
    "height": {"height_m": 1.0, "altitude_m": 1.0, "alt_m": 1.0, "height": 1.0, "altitude": 1.0, "alt": 1.0},
    "roll": {"roll_deg": DEG, "roll_rad": 1.0},
    "pitch": {"pitch_deg": DEG, "pitch_rad": 1.0},
    "heading": {"heading_deg": DEG, "heading_rad": 1.0, "yaw_deg": DEG, "yaw_rad": 1.0},
}  # fmt: skip
"""Names of columns, and their unit in SI."""
_QUATERNIONS = (("qw", "qx", "qy", "qz"), ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"))
_VELOCITIES = (("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), ("vn_mps", "ve_mps", "vd_mps"))
_PARQUET = b"PAR1"


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
    return bool(set(names) & set(_PLACES["latitude"])) and bool(set(names) & set(_TIMES))


def read(path: Path) -> Streams:
    """Return the track in a CSV or Parquet file with named columns.

    The columns are a time (`time_s`, or `time` in seconds or ISO 8601), `latitude_deg`, `longitude_deg`, optionally
    `height_m`, the attitude (`roll_deg`, `pitch_deg`, `heading_deg`, or `qw`, `qx`, `qy`, `qz`), and a velocity
    (`velocity_n_mps`, `velocity_e_mps`, `velocity_d_mps`). Angles may be in radians: `latitude_rad`.

    Args:
        path: the file.

    Returns:
        One solution, named "track".

    Raises:
        InputError: a column is missing, or a field is not a number; the message gives file and row.
    """
    notes: list[str] = []
    columns = _parquet(path) if path.read_bytes()[:4] == _PARQUET else _csv(path, notes)
    time, clock = _time(path, columns, notes)
    found = {name: _column(path, columns, name) for name in _PLACES}
    for name in ("latitude", "longitude"):
        if found[name] is None:
            raise InputError(
                f"{path} has no column {name}_deg; its columns are {', '.join(columns)}. Rename one of them."
            )
    given = [name for name in ("roll", "pitch", "heading") if found[name] is not None]
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


def _column(path: Path, columns: Columns, quantity: str) -> Array | None:
    given = [name for name in _PLACES[quantity] if name in columns]
    if len(given) > 1:
        raise InputError(f"{path} has the columns {' and '.join(given)}: keep one of them.")
    return _numbers(path, columns, given[0]) * _PLACES[quantity][given[0]] if given else None


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


def _time(path: Path, columns: Columns, notes: list[str]) -> tuple[Array, Clock]:
    name = next((name for name in _TIMES if name in columns), None)
    if name is None:
        raise InputError(
            f"{path} has no column time_s; its columns are {', '.join(columns)}. A path without times is planned with "
            "[[track.waypoints]] and speeds."
        )
    values = columns[name]
    text = not isinstance(values, np.ndarray) and bool(values) and "-" in values[0].strip()[1:] and ":" in values[0]
    if not text:
        return _numbers(path, columns, name), Clock("machine", None, f"seconds of the column {name}")
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


def _is_line(line: str) -> bool:
    return bool(line.strip()) and not line.startswith("#")


def _delimiter(line: str) -> str:
    return max(",;\t", key=line.count)


def _csv(path: Path, notes: list[str]) -> dict[str, list[str]]:
    try:
        data = path.read_bytes()
        text = data.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as text: {error}.") from error
    lines = [line for line in text.splitlines() if _is_line(line)]
    if not lines:
        raise InputError(f"{path} is empty.")
    rows = csv.reader(lines, delimiter=_delimiter(lines[0]), skipinitialspace=True)
    names = [name.strip() for name in next(rows)]
    columns: dict[str, list[str]] = {name: [] for name in names}
    if len(columns) < len(names):
        raise InputError(f"{path} has two columns of one name: {', '.join(names)}.")
    cut = cut_rows(path, _delimiter(lines[0]), text.splitlines().index(lines[0]) + 1, len(names))
    if cut.notes:
        notes += cut.notes
        lines = [line for line in cut.without(data).decode("utf-8-sig").splitlines() if _is_line(line)]
        rows = csv.reader(lines[1:], delimiter=_delimiter(lines[0]), skipinitialspace=True)
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names):
            raise InputError(f"{path}, row {number}: {len(row)} fields, but the first line names {len(names)} columns.")
        for name, value in zip(names, row, strict=True):
            columns[name].append(value)
    return columns


def _parquet_names(path: Path) -> list[str]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return list(pq.read_schema(path).names)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path} cannot be read as Parquet: {error}.") from error


def _parquet(path: Path) -> dict[str, Array]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    wanted = {*_TIMES, *(n for names in _PLACES.values() for n in names), *sum((*_QUATERNIONS, *_VELOCITIES), ())}
    names = [name for name in _parquet_names(path) if name in wanted]
    try:
        table = pq.read_table(path, columns=names)
        return {name: np.asarray(table[name].to_numpy(), np.float64) for name in names}
    except (OSError, ValueError, pa.ArrowException) as error:
        raise InputError(f"{path} cannot be read as a Parquet table of numbers: {error}.") from error
