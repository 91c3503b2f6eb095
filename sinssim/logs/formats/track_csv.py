"""Tracks as tables with named columns, CSV or Parquet; the streams `truth` and `nav_…` of a run are such tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats import columns
from sinssim.logs.gps_time import gps_seconds
from sinssim.logs.recorded_streams import Clock, SolutionStream, Streams
from sinssim.logs.text.column_names import TIME_UNITS, epoch_unit, meaning_of
from sinssim.logs.text.column_tables import NamedTable, names_of
from sinssim.units import DEG

_PLACE = ("latitude", "longitude", "height")
_ATTITUDE = ("roll", "pitch", "heading")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a file with these first bytes may be a table with the columns of a track."""
    try:
        _, names = names_of(path, head)
    except InputError:
        return False
    if columns.recognises(path, head):
        return False  # which reads inertial readings and σ, too
    return {"time", "latitude"} <= {meaning[0] for name in names if (meaning := meaning_of(name)) is not None}


def read(path: Path) -> Streams:
    """Return the track in a CSV or Parquet file with named columns.

    The columns are a time (`time_s`, or `time` in seconds or ISO 8601), `latitude_deg`, `longitude_deg`, optionally
    `height_m`, the attitude (`roll_deg`, `pitch_deg`, `heading_deg`, or `qw`, `qx`, `qy`, `qz`), and a velocity
    (`velocity_n_mps`, `velocity_e_mps`, `velocity_d_mps`). Angles may be in radians: `latitude_rad`, heights in feet:
    `altitude_ft`. A note names the columns that are not read.

    Returns:
        One solution, named "track".

    Raises:
        InputError: a column is missing, or a field is not a number; the message gives file and row.
    """
    table = NamedTable(path)
    notes = [*table.notes]
    time, clock = _time(table, notes)
    place = {name: _column(table, name, notes) for name in _PLACE}
    latitude, longitude, height = place.values()
    if latitude is None or longitude is None:
        name = "latitude" if latitude is None else "longitude"
        raise InputError(f"{path} has no column {name}_deg; its columns are {table.listed}. Rename one of them.")
    q_nb = table.quaternion()
    if q_nb is None and table.complete(_ATTITUDE):
        angles = [angle for name in _ATTITUDE if (angle := _column(table, name, notes)) is not None]
        q_nb = rotation.quaternion_from_euler(*angles) if len(angles) == len(_ATTITUDE) else None
    solution = SolutionStream(
        time,
        latitude,
        longitude,
        np.full(len(time), np.nan) if height is None else height,
        "ellipsoid" if "height_m" in table.names else "unknown",
        velocity_ned=table.vector(("north", "east", "down")),
        q_nb=q_nb,
    )
    if rest := table.unused:
        notes.append(f"Columns that are not read: {shortened(', '.join(rest), 300)}.")
    return Streams(path, "track-csv", clock, solutions={"track": solution}, notes=tuple(notes))


def _column(table: NamedTable, quantity: str, notes: list[str]) -> Array | None:
    """Return a column, SI; angles without a unit are degrees if one of them exceeds a turn in radians."""
    given = table.find(quantity)
    if len(given) > 1:
        raise InputError(f"{table.path} has the columns {' and '.join(name for name, _ in given)}: keep one of them.")
    if not given or given[0][1] or quantity == "height":
        return table.column(quantity)
    bare = [table.table.column(name, gaps=True) for of in _ATTITUDE for name, unit in table.find(of) if not unit]
    if quantity in _ATTITUDE and not any(float(np.nanmax(np.abs(own), initial=0.0)) > 2.0 * np.pi for own in bare):
        name = given[0][0]
        notes.append(
            f"The column {name} has no unit, and its numbers may be degrees or radians: name it {name}_deg or "
            f"{name}_rad."
        )
        return None
    return table.numbers(given[0][0]) * DEG


def _time(table: NamedTable, notes: list[str]) -> tuple[Array, Clock]:
    """Return the times of the column time_s, or else of the first one of times, and their clock."""
    given = dict(table.find("time"))
    if not given:
        raise InputError(
            f"{table.path} has no column time_s; its columns are {table.listed}. A path without times is planned with "
            "[[track.waypoints]] and speeds."
        )
    name = "time_s" if "time_s" in given else next(iter(given))
    texts = table.table.texts(name)
    if texts is None or not ("-" in texts[0].strip()[1:] and ":" in texts[0]):
        stamps, unit = table.numbers(name), given[name]
        if not unit and len(stamps) > 1:
            unit = epoch_unit(stamps, float(np.median(np.diff(stamps)))) or "s"
        return stamps * TIME_UNITS[unit or "s"], Clock("machine", None, f"{unit or 's'} of the column {name}")
    table.used.add(name)
    moments, zoned = np.empty(len(texts)), True
    for row, word in enumerate(texts):
        try:
            moments[row], zone = gps_seconds(str(word))
        except InputError as error:
            raise InputError(f"{table.table.place(row)}: {error}") from error
        zoned = zoned and zone
    origin = int(np.floor(moments[0]))
    if not zoned:
        notes.append("Times without a time zone are taken as UTC.")
    return moments - origin, Clock("utc", origin, f"UTC of the column {name}")
