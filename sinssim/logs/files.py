"""Reads the files of a [log] table: columns that the table describes, or one of the formats of the registry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.formats.registry import FORMATS
from sinssim.logs.gps_time import EPOCH_UNIX, gps_from_unix
from sinssim.logs.log import TEXT_FORMAT, LogFile, LogImu, LogOther
from sinssim.logs.read import candidates, read_file
from sinssim.logs.streams import Clock, FixStream, InertialStream, OtherStream, SolutionStream, Streams
from sinssim.logs.text.columns import SUFFIXES, Table
from sinssim.logs.text.description import TRIADS, LogDescription
from sinssim.logs.text.fix_description import SIGNS, FixColumns, Quantity, SolutionColumns, Triple
from sinssim.logs.text.joined import joined, with_gravity
from sinssim.logs.text.names import TIME_UNITS, UNITS_OF, unit_in_name
from sinssim.logs.text.samples import read_samples
from sinssim.sensors.aiding.registry import measurement_kind

_Stream = TypeVar("_Stream")
_OWN_TIMES = Clock("machine", None, "times in a column, without a date")


def inertial_stream(section: LogImu) -> tuple[InertialStream, Clock, tuple[str, ...]]:
    """Read the recorded inertial unit.

    Args:
        section: the table [log.imu].

    Returns:
        Its readings turned to forward-right-down, with the axes of the file in `axes`; the clock of the file; and the
        reader's notes.

    Raises:
        InputError: the file cannot be read, holds no inertial unit, or has another kind than described.
    """
    path = Path(section.file)
    found = _formatted(section, described=_describes(section, LogDescription, ("axes",)))
    if found is not None:
        stream = _one(found.inertial, section, found, "inertial unit")
        axes = section.axes if "axes" in section.model_fields_set or stream.axes is None else stream.axes
        matrix = LogDescription.model_validate({"axes": axes}).matrix
        return _turned(replace(stream, axes=axes), matrix), found.clock, found.notes
    apart = [name for name in TRIADS if (triad := section.triad(name)) is not None and triad.apart]
    if len(apart) == len(TRIADS):
        raise InputError(
            f"{path}: gyro and accel both have a file or rows of their own; give those of one of them in log.imu."
        )
    samples = read_samples(path, section, [name for name in TRIADS if name not in apart])
    # the axes are already turned; a copy of the first interval stands before the first stamp
    time, triads, notes = samples.time[1:], samples.triads, samples.notes
    for name in apart:
        time, triads, added = joined(section, samples, name)
        notes += added
    if section.gravity is not None:
        time, triads, added = with_gravity(section, time, triads, samples.clock)
        notes += added
    time, clock = _on_clock(section, time, samples.clock)
    return InertialStream(time, triads["gyro"], triads["accel"], samples.kind), clock, notes


def _on_clock(section: LogFile, time: Array, dated: Clock | None) -> tuple[Array, Clock]:
    """Return the times of a file in columns, and their clock: that of dates, Unix time, or an unknown one."""
    if dated is not None:
        if dated.kind == "utc" or dated.origin_gps_s is None:
            return time, dated
        if section.clock == "utc":
            return time, replace(dated, kind="utc", origin_gps_s=int(gps_from_unix(dated.origin_gps_s + EPOCH_UNIX)))
        return time, replace(dated, kind="gps")
    if section.clock != "unix":
        return time, _OWN_TIMES
    first = math.floor(time[0])
    return time - first, Clock("utc", int(gps_from_unix(first)), "Unix time")


def _turned(stream: InertialStream, matrix: Array) -> InertialStream:
    return replace(stream, gyro=stream.gyro @ matrix.T, accel=stream.accel @ matrix.T)


def fix_stream(section: LogFile) -> tuple[FixStream, Clock, tuple[str, ...]]:
    """Read recorded fixes.

    Args:
        section: the table [log.gnss].

    Returns:
        The fixes, the clock of the file, and the reader's notes.

    Raises:
        InputError: the file cannot be read or holds no fixes.
    """
    assert isinstance(section, FixColumns)
    found = _formatted(section, described=_describes(section, FixColumns))
    if found is not None:
        return _one(found.fixes, section, found, "fixes"), found.clock, found.notes
    table = _table(section)
    stream, _, clock = _fixes_of_columns(table, section)
    return stream, clock, table.notes


def _fixes_of_columns(table: Table, section: LogFile) -> tuple[FixStream, NDArray[np.intp], Clock]:
    """Return the fixes of a file in columns, their rows in the file, and their clock."""
    assert isinstance(section, FixColumns)
    c = section
    _needed(table.path, c, ("latitude", "longitude", "height"))
    quality = None if c.quality is None else table.column(c.quality, gaps=True)
    time, clock = _times(table, section)
    stream = FixStream(
        time,
        _one_of(table, c.latitude, "angle"),
        _one_of(table, c.longitude, "angle"),
        _one_of(table, c.height, "length"),
        position_sigma=None if c.position_sigma is None else np.abs(_three_of(table, c.position_sigma, "length")),
        velocity_ned=_velocity_of(table, c),
        velocity_sigma=None if c.velocity_sigma is None else np.abs(_three_of(table, c.velocity_sigma, "speed")),
        quality=None if quality is None else np.where(np.isfinite(quality), quality, -1).astype(np.int64),
    )
    rows = _fresh(table, stream, c)
    return stream if len(rows) == len(stream) else stream.rows(rows), rows, clock


def solution_stream(section: LogFile) -> tuple[SolutionStream | FixStream, Clock, tuple[str, ...]]:
    """Read a reference: a solution, or fixes.

    Args:
        section: the table [log.reference].

    Returns:
        The solution or the fixes, the clock of the file, and the reader's notes.

    Raises:
        InputError: the file cannot be read or holds neither.
    """
    assert isinstance(section, SolutionColumns)
    found = _formatted(section, described=_describes(section, SolutionColumns))
    if found is not None:
        both: dict[str, SolutionStream | FixStream] = {**found.fixes, **found.solutions}
        if section.stream is None and found.solutions:
            return _one(found.solutions, section, found, "solution"), found.clock, found.notes
        return _one(both, section, found, "solution"), found.clock, found.notes
    table, c = _table(section), section
    if (c.heading or c.quaternion) and not (c.latitude or c.longitude or c.height):
        time, clock = _times(table, section)  # attitude alone
        unknown = np.full(len(time), np.nan)
        stream, rows = FixStream(time, unknown, unknown, unknown), np.arange(len(time))
    else:
        stream, rows, clock = _fixes_of_columns(table, section)
    q_nb = None
    if c.quaternion is not None:
        q_nb = np.column_stack([table.column(column, gaps=True) for column in c.quaternion])
        q_nb = q_nb / np.linalg.norm(q_nb, axis=1, keepdims=True)
    elif c.heading is not None:
        from sinssim import rotation

        level = np.zeros(table.rows)
        roll, pitch, heading = (
            level if angle is None else _one_of(table, angle, "angle") for angle in (c.roll, c.pitch, c.heading)
        )
        q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    if q_nb is None:
        return stream, clock, table.notes
    q_nb = q_nb[rows]
    sigma = None if c.attitude_sigma is None else np.abs(_three_of(table, c.attitude_sigma, "angle"))[rows]
    solution = SolutionStream(
        stream.time, stream.latitude, stream.longitude, stream.height, stream.datum, stream.velocity_ned, q_nb,
        stream.position_sigma, stream.velocity_sigma, sigma,
    )  # fmt: skip
    return solution, clock, table.notes


_DIMENSION = {"m": "length", "rad": "angle", "mps": "speed"}


def other_units(section: LogOther) -> Mapping[str, float]:
    """Return the units that the readings of another sensor may have, in SI.

    Args:
        section: an entry of [[log.others]].
    """
    return UNITS_OF[_DIMENSION[measurement_kind(section.kind).unit]]


def other_stream(section: LogOther) -> tuple[OtherStream, Clock, tuple[str, ...]]:
    """Read the readings of another sensor from columns.

    Args:
        section: an entry of [[log.others]].

    Returns:
        The readings, the clock of the file, and the reader's notes.

    Raises:
        InputError: the file cannot be read, or a unit is unknown.
    """
    units = other_units(section)
    for quantity in (section.reading, section.sigma, section.bias_sigma):
        if quantity is not None and quantity.unit not in units:
            raise unknown_name(f"unit of {section.kind}", quantity.unit, units)
    columns = [c for c in (section.time, section.reading.column, section.sigma.column) if c is not None]
    layout = FixColumns(time=section.time, delimiter=section.delimiter, skip_lines=section.skip_lines)
    table = Table(Path(section.file), layout, columns)
    time = table.column(section.time) * TIME_UNITS[section.time_unit or unit_in_name(section.time) or "s"]
    value = _values(table, section.reading, units[section.reading.unit], len(time))
    sigma = _values(table, section.sigma, units[section.sigma.unit], len(time))
    return OtherStream(section.name, section.kind, time, value[:, None], sigma[:, None]), _OWN_TIMES, table.notes


def _describes(section: LogFile, of: type[LogDescription] | type[FixColumns], also: tuple[str, ...] = ()) -> list[str]:
    """Return the keys of columns that a table gives, other than the defaults that a run writes out."""
    return [
        name
        for name, field in of.model_fields.items()
        if name in section.model_fields_set and name not in also and getattr(section, name) != field.default
    ]


def _formatted(section: LogFile, described: list[str]) -> Streams | None:
    """Read a file of the registry's formats; None for columns that the section describes."""
    path = Path(section.file)
    if section.format == TEXT_FORMAT or (section.format is None and described):
        return None
    if section.format is None and not candidates(path):
        if path.suffix.lower() in SUFFIXES:
            return None
        raise InputError(
            f"{path}: no format recognises this file. Known are {', '.join(FORMATS)}, and text in columns "
            f"({', '.join(SUFFIXES)})."
        )
    found = read_file(path, section.format)
    if described:
        raise InputError(
            f"{path} is read in the format {found.format}, which defines its columns: remove {', '.join(described)}."
        )
    return found


def _one(streams: dict[str, _Stream], section: LogFile, found: Streams, what: str) -> _Stream:
    """Return the stream that a section names, or the only one."""
    if section.stream is not None:
        if section.stream not in streams:
            raise unknown_name(f"stream of {found.path}", section.stream, streams)
        return streams[section.stream]
    if len(streams) != 1:
        raise InputError(
            f"{found.path} ({found.format}) has "
            + (f"several streams, {', '.join(streams)}: choose one with stream." if streams else f"no {what}.")
        )
    return next(iter(streams.values()))


def _table(columns: FixColumns) -> Table:
    assert isinstance(columns, LogFile)
    return Table(Path(columns.file), columns, columns.used)


def _needed(path: Path, columns: FixColumns, names: tuple[str, ...]) -> None:
    missing = [name for name in names if getattr(columns, name) is None]
    if missing:
        raise InputError(
            f"{path}: the columns of {', '.join(missing)} are not described, for example "
            f'{missing[0]} = {{ column = "lat", unit = "deg" }}.'
        )


def _times(table: Table, section: LogFile) -> tuple[Array, Clock]:
    """Return the times of a file, (M,) s, and their clock."""
    assert isinstance(section, FixColumns)
    unit = section.time_unit or unit_in_name(section.time) or "s"
    return _on_clock(section, *table.times(section.time, TIME_UNITS[unit]))


def _fresh(table: Table, stream: FixStream, columns: FixColumns) -> NDArray[np.intp]:
    """Return the rows that have a fix, and a new one if fixes are held; their times must increase."""
    known = np.isfinite(stream.latitude) & np.isfinite(stream.longitude)
    nowhere = (stream.latitude == 0.0) & (stream.longitude == 0.0)
    if not nowhere[known].all():  # zeros are written until there is a fix
        known &= ~nowhere
    if stream.velocity_ned is not None:
        known |= np.isfinite(stream.velocity_ned[:, :2]).all(axis=1) & ~nowhere
    if columns.held:
        held = np.column_stack([stream.latitude, stream.longitude, stream.height])
        known &= np.append(True, (np.diff(held, axis=0) != 0.0).any(axis=1))
    time, rows = stream.time[known], np.flatnonzero(known)
    same = np.append(False, np.diff(time) == 0.0)
    if same.any():  # a row written twice says nothing new
        place = np.column_stack([stream.latitude[known], stream.longitude[known], stream.height[known]])
        same &= np.append(False, (np.diff(place, axis=0) == 0.0).all(axis=1))
        time, rows = time[~same], rows[~same]
    steps = np.diff(time)
    if len(steps) and not np.min(steps) > 0.0:
        k = int(np.argmax(~(steps > 0.0))) + 1
        raise InputError(
            f"{table.place(int(rows[k]))}: the time {time[k]:.9g} s is not later than {time[k - 1]:.9g} s."
        )
    if not len(rows):
        raise InputError(f"{table.path}: no row contains a position.")
    return rows


def _velocity_of(table: Table, c: FixColumns) -> Array | None:
    """Return the velocity north, east, down, of components or of speed and course; NaN if it is not known, (M, 3)."""
    if c.velocity is not None:
        return _three_of(table, c.velocity, "speed")
    if c.speed is None or c.course is None:
        return None
    speed, course = _one_of(table, c.speed, "speed"), _one_of(table, c.course, "angle")
    # a receiver at rest has no course
    course = np.where((speed == 0.0) & ~np.isfinite(course), 0.0, course)
    return np.column_stack([speed * np.cos(course), speed * np.sin(course), np.full(len(speed), np.nan)])


def _one_of(table: Table, quantity: Quantity | None, dimension: str) -> Array:
    assert quantity is not None  # checked before
    size = UNITS_OF[dimension][quantity.unit]
    return _values(table, quantity, size, -1)


def _values(table: Table, quantity: Quantity, size: float, count: int) -> Array:
    if quantity.column is not None:
        return table.column(quantity.column, gaps=True) * size
    assert quantity.value is not None
    rows = count if count >= 0 else table.rows
    return np.full(rows, quantity.value * size)


def _three_of(table: Table, triple: Triple, dimension: str) -> Array:
    """Return three components, north, east, down, (M, 3)."""
    size = UNITS_OF[dimension][triple.unit]
    if triple.columns is None:
        assert triple.values is not None
        given = np.tile(np.array(triple.values), (table.rows, 1))
    else:
        given = np.column_stack([table.column(column, gaps=True) for column in triple.columns])
    return np.column_stack([size * sign * given[:, k] for k, sign in SIGNS[triple.axes]])
