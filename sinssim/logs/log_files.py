"""Reads the files of a [log] table: columns that the table describes, or one of the formats of the registry."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.column_description import SIGNS, TRIADS, FixColumns, LogDescription, Quantity, SolutionColumns, Triple
from sinssim.logs.column_names import TIME_UNITS, UNITS_OF, unit_in_name
from sinssim.logs.column_tables import SUFFIXES, Table
from sinssim.logs.formats import FORMATS, candidates, read_file
from sinssim.logs.gps_time import EPOCH_UNIX, gps_from_unix
from sinssim.logs.imu_samples import joined, read_samples, with_gravity
from sinssim.logs.log_settings import TEXT_FORMAT, Log, LogFile, LogImu, LogOther
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, OtherStream, SolutionStream, Streams
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.aiding_sensor import SensorState
from sinssim.units import PPM

_Stream = TypeVar("_Stream")
_OWN_TIMES = Clock("machine", None, "times in a column, without a date")


def inertial_stream(unit: LogImu) -> tuple[InertialStream, Clock, tuple[str, ...]]:
    """Read the recorded inertial unit: its readings turned to forward-right-down, with the axes of the file in `axes`;
    the clock of the file; and the reader's notes."""
    path = Path(unit.file)
    streams = _formatted(unit, described=_describes(unit, LogDescription, ("axes",)))
    if streams is not None:
        stream = _stream_of(streams.inertial, unit, streams, "inertial unit")
        axes = unit.axes if "axes" in unit.model_fields_set or stream.axes is None else stream.axes
        matrix = LogDescription.model_validate({"axes": axes}).matrix
        return _turned(replace(stream, axes=axes), matrix), streams.clock, streams.notes
    apart = [name for name in TRIADS if (triad := unit.triad(name)) is not None and triad.apart]
    if len(apart) == len(TRIADS):
        raise InputError(
            f"{path}: gyro and accel both have a file or rows of their own; give those of one of them in log.imu."
        )
    samples = read_samples(path, unit, [name for name in TRIADS if name not in apart])
    # the axes are already turned; a copy of the first interval stands before the first stamp
    time, triads, notes = samples.time[1:], samples.triads, samples.notes
    for name in apart:
        time, triads, added = joined(unit, samples, name)
        notes += added
    if unit.gravity is not None:
        time, triads, added = with_gravity(unit, time, triads, samples.clock)
        notes += added
    time, clock = _on_clock(unit, time, samples.clock)
    return InertialStream(time, triads["gyro"], triads["accel"], samples.kind), clock, notes


def _on_clock(source: LogFile, time: Array, dated: Clock | None) -> tuple[Array, Clock]:
    """Return the times of a file in columns, and their clock: that of dates, Unix time, or an unknown one."""
    if dated is not None:
        if dated.kind == "utc" or dated.origin_gps_s is None:
            return time, dated
        if source.clock == "utc":
            return time, replace(dated, kind="utc", origin_gps_s=int(gps_from_unix(dated.origin_gps_s + EPOCH_UNIX)))
        return time, replace(dated, kind="gps")
    if source.clock != "unix":
        return time, _OWN_TIMES
    first = math.floor(time[0])
    return time - first, Clock("utc", int(gps_from_unix(first)), "Unix time")


def _turned(stream: InertialStream, matrix: Array) -> InertialStream:
    return replace(stream, gyro=stream.gyro @ matrix.T, accel=stream.accel @ matrix.T)


def fix_stream(source: LogFile) -> tuple[FixStream, Clock, tuple[str, ...]]:
    """Read recorded fixes, the clock of the file, and the reader's notes."""
    assert isinstance(source, FixColumns)
    streams = _formatted(source, described=_describes(source, FixColumns))
    if streams is not None:
        return _stream_of(streams.fixes, source, streams, "fixes"), streams.clock, streams.notes
    table = _table(source)
    stream, _, clock = _fixes_of_columns(table, source)
    return stream, clock, table.notes


def _fixes_of_columns(table: Table, source: LogFile) -> tuple[FixStream, NDArray[np.intp], Clock]:
    """Return the fixes of a file in columns, their rows in the file, and their clock."""
    assert isinstance(source, FixColumns)
    c = source
    _needed(table.path, c, ("latitude", "longitude", "height"))
    quality = None if c.quality is None else table.column(c.quality, gaps=True)
    time, clock = _times(table, source)
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


def solution_stream(source: LogFile) -> tuple[SolutionStream | FixStream, Clock, tuple[str, ...]]:
    """Read a reference, a solution or fixes, the clock of the file, and the reader's notes."""
    assert isinstance(source, SolutionColumns)
    streams = _formatted(source, described=_describes(source, SolutionColumns))
    if streams is not None:
        both: dict[str, SolutionStream | FixStream] = {**streams.fixes, **streams.solutions}
        if source.stream is None and streams.solutions:
            return _stream_of(streams.solutions, source, streams, "solution"), streams.clock, streams.notes
        return _stream_of(both, source, streams, "solution"), streams.clock, streams.notes
    table, c = _table(source), source
    if (c.heading or c.quaternion) and not (c.latitude or c.longitude or c.height):
        time, clock = _times(table, source)  # attitude alone
        unknown = np.full(len(time), np.nan)
        stream, rows = FixStream(time, unknown, unknown, unknown), np.arange(len(time))
    else:
        stream, rows, clock = _fixes_of_columns(table, source)
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
    return replace(stream.as_solution(), q_nb=q_nb, attitude_sigma=sigma), clock, table.notes


_DIMENSION = {"m": "length", "rad": "angle", "mps": "speed"}


def other_units(sensor: LogOther) -> Mapping[str, float]:
    """Return the units that the readings of another sensor may have, in SI."""
    return UNITS_OF[_DIMENSION[measurement_kind(sensor.kind).unit]]


def other_stream(sensor: LogOther) -> tuple[OtherStream, Clock, tuple[str, ...]]:
    """Read the readings of another sensor from columns, the clock of the file, and the reader's notes."""
    units = other_units(sensor)
    for quantity in (sensor.reading, sensor.sigma, sensor.bias_sigma):
        if quantity is not None and quantity.unit not in units:
            raise unknown_name(f"unit of {sensor.kind}", quantity.unit, units)
    columns = [c for c in (sensor.time, sensor.reading.column, sensor.sigma.column) if c is not None]
    layout = FixColumns(time=sensor.time, delimiter=sensor.delimiter, skip_lines=sensor.skip_lines)
    table = Table(Path(sensor.file), layout, columns)
    time = table.column(sensor.time) * TIME_UNITS[sensor.time_unit or unit_in_name(sensor.time) or "s"]
    value = _values(table, sensor.reading, units[sensor.reading.unit], len(time))
    sigma = _values(table, sensor.sigma, units[sensor.sigma.unit], len(time))
    return OtherStream(sensor.name, sensor.kind, time, value[:, None], sigma[:, None]), _OWN_TIMES, table.notes


def _describes(source: LogFile, of: type[LogDescription] | type[FixColumns], also: tuple[str, ...] = ()) -> list[str]:
    """Return the keys of columns that a table gives, other than the defaults that a run writes out."""
    return [
        name
        for name, field in of.model_fields.items()
        if name in source.model_fields_set and name not in also and getattr(source, name) != field.default
    ]


def _formatted(source: LogFile, described: list[str]) -> Streams | None:
    """Read a file of the registry's formats; None for columns that the table describes."""
    path = Path(source.file)
    if source.format == TEXT_FORMAT or (source.format is None and described):
        return None
    if source.format is None and not candidates(path):
        if path.suffix.lower() in SUFFIXES:
            return None
        raise InputError(
            f"{path}: no format recognises this file. Known are {', '.join(FORMATS)}, and text in columns "
            f"({', '.join(SUFFIXES)})."
        )
    streams = read_file(path, source.format)
    if described:
        raise InputError(
            f"{path} is read in the format {streams.format}, which defines its columns: remove {', '.join(described)}."
        )
    return streams


def _stream_of(streams: dict[str, _Stream], source: LogFile, contents: Streams, what: str) -> _Stream:
    """Return the stream that a source names, or the only one."""
    if source.stream is not None:
        if source.stream not in streams:
            raise unknown_name(f"stream of {contents.path}", source.stream, streams)
        return streams[source.stream]
    if len(streams) != 1:
        raise InputError(
            f"{contents.path} ({contents.format}) has "
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


def _times(table: Table, source: LogFile) -> tuple[Array, Clock]:
    """Return the times of a file, (M,) s, and their clock."""
    assert isinstance(source, FixColumns)
    unit = source.time_unit or unit_in_name(source.time) or "s"
    return _on_clock(source, *table.times(source.time, TIME_UNITS[unit]))


def _fresh(table: Table, stream: FixStream, columns: FixColumns) -> NDArray[np.intp]:
    """Return the rows that have a fix, and a new one if fixes are held; their times must increase."""
    known = np.isfinite(stream.latitude) & np.isfinite(stream.longitude)
    nowhere = (stream.latitude == 0.0) & (stream.longitude == 0.0)
    if not nowhere[known].all():  # zeros are written until there is a fix
        known &= ~nowhere
    if stream.velocity_ned is not None:
        known |= np.isfinite(stream.velocity_ned[:, :2]).all(axis=1) & ~nowhere
    if columns.held:
        repeated = np.column_stack([stream.latitude, stream.longitude, stream.height])
        known &= np.append(True, (np.diff(repeated, axis=0) != 0.0).any(axis=1))
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


@dataclass(frozen=True)
class RecordedOther:
    """The errors of a sensor of [[log.others]]."""

    section: LogOther  # its description

    def states(self) -> Iterator[SensorState]:
        """Yield the states of its bias and its scale factor; of σ 0 if there is none."""
        s, bias = self.section, 0.0
        if s.bias_sigma is not None and s.bias_sigma.value is not None:
            bias = s.bias_sigma.value * other_units(s)[s.bias_sigma.unit]
        yield SensorState(f"{s.name} bias", (bias,), s.bias_correlation_time_s or math.inf)
        yield SensorState(f"{s.name} scale", (PPM * s.scale_sigma_ppm,))


def recorded_errors(log: Log | None) -> tuple[Gnss | RecordedOther, ...]:
    """Return the sensors of a log with errors that are states of the filter; their keys are those of emulated ones."""
    if log is None:
        return ()
    others = tuple(RecordedOther(other) for other in log.others)
    if (gnss := log.gnss) is None:
        return others
    keys = (
        "lever_arm_sigma_m", "correlated_position_sigma_m", "correlated_height_sigma_m",
        "correlated_velocity_sigma_mps", "correlation_time_s", "time_offset_sigma_s", "velocity_delay_sigma_s",
    )  # fmt: skip
    satellites = Gnss(
        position="position" in gnss.use,
        velocity="velocity" in gnss.use,
        **{key: getattr(gnss, key) for key in keys},
    )
    return (satellites, *others)
