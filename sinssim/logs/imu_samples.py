"""Reads a recorded IMU log (text, Parquet or npz) into increments; a TOML file names its columns, units and axes.

By default the columns are those of the package's own streams, such as `imu_measured.parquet`. A triad of another file,
or of other rows of a file, is joined to the main one. Gravity is added to accelerations from which a recorder has
removed it, and such accelerations are recognised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData
from sinssim.errors import InputError, warn
from sinssim.logs.column_description import TRIADS, WORDS, Column, LogDescription, TriadColumns, TriadName
from sinssim.logs.column_names import TIME_UNITS, UNITS
from sinssim.logs.column_tables import SUFFIXES, TEXT, Table
from sinssim.logs.log_settings import LogImu
from sinssim.logs.recorded_streams import Clock
from sinssim.logs.stored_run import warn_of_version

__all__ = ["SUFFIXES", "TEXT", "Samples", "TriadName", "read_log", "read_samples", "slow"]

# interval between samples, beyond which a log may be one in ms at up to 10 kHz, or one in s at up to 10 Hz
_SLOWEST = 0.1
_LOST = 0.1  # share of rows of zeros, above which they are those of an ideal sensor in free fall
_FASTEST = 2e4  # samples per second of the fastest raw outputs
_DISORDER = 100.0  # median intervals by which an even stamp may go back; a clock that is reset goes back by more
# Limits beyond any sensor; a shock reaches 1e5 g, and the wheel of a turbocharger 3e4 rad/s.
_MOST: dict[TriadName, tuple[float, str]] = {"gyro": (1e5, "rad/s"), "accel": (1e7, "m/s²")}


@dataclass(frozen=True)
class Samples:
    """The samples of a log, forward-right-down, SI."""

    kind: Literal["increments", "rates"]  # whether the numbers are integrals over the intervals or rates
    time: Array  # edges of the intervals, (N+1,) s; the first interval is as long as the second
    triads: dict[TriadName, Array]  # "gyro" and "accel", or one of them, (N, 3): rad and m/s, or rad/s and m/s²
    quantities: dict[str, Array] = field(default_factory=dict)  # other columns by name, (N,), as in the log
    time_unit_stated: bool = True  # whether the log or its description gives the unit of its times
    clock: Clock | None = None  # what dates in the column of times say; None for numbers
    notes: tuple[str, ...] = ()  # a sentence on each kind of rows that were left out


def read_log(path: Path | str, description: Path | str | None = None) -> ImuData:
    """Read a recorded log as increments.

    Args:
        path: a text file (`TEXT`), or a .parquet or .npz file.
        description: a TOML file that names columns, units and axes; by default the package's own columns.

    Returns:
        Increments, forward-right-down, SI; the first interval is as long as the second.
    """
    samples = read_samples(path, description, TRIADS)
    for note in samples.notes:
        warn(note)
    gyro, accel = samples.triads["gyro"], samples.triads["accel"]
    if samples.kind == "rates":
        interval = np.diff(samples.time)[:, None]
        return ImuData(samples.time, gyro * interval, accel * interval)
    return ImuData(samples.time, gyro, accel)


def read_samples(
    path: Path | str,
    description: Path | str | LogDescription | None = None,
    triads: Sequence[TriadName] | None = None,
    quantities: Sequence[str] = (),
) -> Samples:
    """Read a recorded log, a text file (`TEXT`), .parquet or .npz, without integration: rates stay rates. A TOML file
    or its contents describe columns, units and axes, by default the package's own. Only the given triads are read, by
    default those described; the columns of the others may be missing. Quantities are names of other columns, or their
    numbers as text if columns are numbered."""
    path, layout, source = Path(path), LogDescription(), "the package's own columns"
    if description is None and path.parent.name == "streams":
        warn_of_version(path.parent.parent)
    if isinstance(description, LogDescription):
        layout, source = description, "the description"
    elif description is not None:
        from sinssim.toml_mistakes import read_toml, validate

        source = str(description)
        text, data = read_toml(Path(description))
        layout = validate(LogDescription, data, text, source)
    needed = layout.described if triads is None else tuple(triads)
    for name in needed:
        if layout.triad(name) is None:
            raise InputError(f"{source} does not describe the {WORDS[name]}, which are needed: add a table [{name}].")
    if len({isinstance(column, int) for column in layout.used(needed)}) > 1:
        raise InputError(
            f"{source} numbers the column of times but describes no other column: add tables [gyro] and [accel]."
        )
    by_number = layout.numbered
    others: dict[str, Column] = {name: int(name) if by_number and name.isdecimal() else name for name in quantities}
    table = Table(path, layout, (*layout.used(needed), *others.values()))
    if description is None and needed and not set(layout.used(needed)) & set(table.names):
        raise InputError(
            f"{path} has none of the columns of imu_measured.parquet ({', '.join(map(str, layout.used(needed)))}). Its "
            f"columns are {', '.join(str(name)[:60] for name in table.names[:20]) or 'none'}: describe them in a TOML "
            "file (--columns)."
        )
    if description is None and not needed and layout.time not in table.names:
        raise InputError(
            f"{path} has no column {layout.time!r}. Name the column of its times in a TOML file, for example "
            f'time = "t" (--columns). Its columns are {", ".join(str(name)[:60] for name in table.names[:20])}.'
        )
    try:
        return _samples(table, layout, needed, others, source)
    except MemoryError as error:
        raise InputError(f"{path} does not fit into memory: {error}. Read a part of it.") from error


def slow(time: Array) -> str | None:
    """Return a warning if samples with given edges, (N+1,) s, are slower than those of an inertial sensor, None if
    not."""
    interval = float(np.median(np.diff(time)))
    if interval <= 1.0:
        return None
    return (
        f"The samples are {interval:.4g} s apart, which is usual only for averages. If the sensors are sampled faster, "
        "the unit of the log's times is wrong (time_unit)."
    )


def _samples(
    table: Table, layout: LogDescription, triads: Sequence[TriadName], others: Mapping[str, Column], source: str
) -> Samples:
    notes, values = [*table.notes], {name: _triad(table, layout, name) for name in triads}
    given = _given(table, layout, values)
    quantities = {name: table.column(column, gaps=not given.all()) for name, column in others.items()}
    lengths = {name: len(column) for name, column in (*values.items(), *quantities.items())}
    if layout.rate_hz is not None:
        count, clock = max(lengths.values()), None
        fresh = given if len(given) == count else np.ones(count, dtype=bool)
        edges = _before_first(table.path, np.arange(1.0, count + 1.0)[fresh]) / layout.rate_hz
    elif layout.time is None:
        raise InputError(f"{source}: the times of the samples are missing: give a time column or rate_hz.")
    else:
        fresh = _fresh(table, layout, [*values.values(), *quantities.values()])
        if not fresh.all():
            notes.append(f"{table.path.name}: {int((~fresh).sum())} copies of the preceding row are skipped.")
        if len(given) == len(fresh):
            fresh &= given
        edges, clock = _edges(table, layout, fresh, inertial=bool(triads))
    if not fresh.all():
        values = {name: value[fresh] for name, value in values.items()}
        quantities = {name: value[fresh] for name, value in quantities.items()}
        lengths = {name: len(column) for name, column in (*values.items(), *quantities.items())}
    if set(lengths.values()) != {len(edges) - 1}:
        counted = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"{table.path}: the columns differ in length: {counted}, time {len(edges) - 1} samples.")
    for name, triad in values.items():
        most, unit = _MOST[name]
        rates = np.abs(triad).max(axis=1)
        if layout.kind == "increments":
            rates = rates / np.diff(edges)
        if not np.max(rates) <= most:
            k = int(np.argmax(~(rates <= most)))
            place = table.place(int(np.flatnonzero(fresh)[k]))
            raise InputError(
                f"{place}: the {WORDS[name]} read {rates[k]:.4g} {unit}, but no such sensor exceeds {most:g}. "
                "Units, times or kind (increments or rates) of the log are wrong."
            )
    if not given.all():
        skipped = int((~given).sum())
        notes.append(f"{table.path.name}: {skipped} rows lack the readings of a sensor of the IMU and are skipped.")
    stated = layout.rate_hz is not None or layout.stated_time_unit is not None
    return Samples(layout.kind, edges, values, quantities, stated or clock is not None, clock, tuple(notes))


def with_readings(*triads: Array) -> NDArray[np.bool_]:
    """Return which rows, (N,), have readings of every triad, (N, 3) each, NaN for empty fields. A file may contain rows
    of other sensors, or of one triad only, which leave the other fields empty; a recorder may write zeros for lost
    samples, which noise and gravity never give."""
    given = ~np.any([np.isnan(values).all(axis=1) for values in triads], axis=0)
    lost = np.all([(values == 0.0).all(axis=1) for values in triads], axis=0)
    return np.asarray(given & ~lost if len(triads) > 1 and lost.mean() < _LOST else given)


def _given(table: Table, layout: LogDescription, triads: Mapping[TriadName, Array]) -> NDArray[np.bool_]:
    """Return which rows have readings, (N,), as `with_readings`."""
    if not triads or len({len(values) for values in triads.values()}) > 1:
        return np.ones(1, dtype=bool)
    each = [_raw(table, layout, name) for name in triads]
    raw, given = np.column_stack(each), with_readings(*each)
    wrong = given[:, None] & ~np.isfinite(raw)
    if wrong.any() or not given.any():
        k = int(np.argmax(wrong.any(axis=1)))
        columns = [c for name in triads if (t := layout.triad(name)) is not None for c in _names(t)]
        column = columns[int(np.argmax(wrong[k]))] if wrong.any() else columns[0]
        raise InputError(f"{table.place(k)}: the column {column!r} is empty or not finite.")
    return given


def _fresh(table: Table, layout: LogDescription, columns: Sequence[Array]) -> NDArray[np.bool_]:
    """Return which rows are not copies of the row before, in time and in all readings, (N,)."""
    assert layout.time is not None
    time = table.times(layout.time, 1.0)[0]
    same = np.append(False, np.diff(time) == 0.0)
    if not columns or not same.any() or any(len(column) != len(time) for column in columns):
        return np.ones(len(time), dtype=bool)
    for column in columns:
        step = np.diff(column.reshape(len(time), -1), axis=0)
        same[1:] &= (step == 0.0).all(axis=1)
    return ~same


def _before_first(path: Path, ends: Array) -> Array:
    """Return the edges of intervals with these ends, the first of which is as long as the second, (N+1,)."""
    if len(ends) < 2:
        raise InputError(f"{path} has {len(ends)} sample{'s' * (len(ends) != 1)}; a log needs at least two.")
    return np.concatenate([[2.0 * ends[0] - ends[1]], ends])


def _edges(
    table: Table, layout: LogDescription, fresh: NDArray[np.bool_], inertial: bool
) -> tuple[Array, Clock | None]:
    """Return the edges of the intervals from the time column, (N+1,) s, and the clock that dates give."""
    path, unit, column = table.path, layout.stated_time_unit, layout.time
    assert column is not None  # checked by the caller
    ends, clock = table.times(column, TIME_UNITS[unit or "s"])
    ends = ends[fresh]
    edges = _before_first(path, ends)
    if np.max(np.abs(ends)) > 1e15:  # beyond this, half a second is less than the last digit of a double
        raise InputError(f"{path}: its times reach {np.max(np.abs(ends)):.3g} s, which is impossible for a log.")
    steps = np.diff(edges)
    # stamps that will be made even may repeat, or be out of order by some samples
    least = -_DISORDER * float(np.median(np.abs(steps))) if getattr(layout, "stamps", "") == "even" else 0.0
    if not (np.min(steps) > 0.0 or np.min(steps) > least):
        k = int(np.argmax(steps <= 0.0))
        k += k == 0  # the first interval is a copy of the second
        row = int(np.flatnonzero(fresh)[k])
        raise InputError(f"{table.place(row)}: the time {edges[k + 1]:.9g} s is not later than {edges[k]:.9g} s.")
    interval = float(np.median(steps))
    if inertial and unit is None and clock is None and interval >= _SLOWEST:
        raise InputError(
            f"{path}: the times in {column!r} are {interval:.6g} apart, which in seconds is slow for inertial sensors. "
            f'Give their unit: time_unit = "ms" (or "us", "ns"), or time_unit = "s" for seconds.'
        )
    if unit not in (None, "s") and interval * _FASTEST < 1.0:
        raise InputError(
            f"{path}: the times in {column!r} are {interval / TIME_UNITS[unit or 's']:.6g} {unit} apart: "
            f"{1.0 / interval:.3g} samples per second, but no sensor gives more than {_FASTEST:g}. Their unit is "
            "wrong (time_unit)."
        )
    return edges, clock


def _names(triad: TriadColumns) -> list[Column]:
    """Return the three columns of a triad."""
    return [triad.columns] * 3 if isinstance(triad.columns, str) else list(triad.columns)


def _raw(table: Table, layout: LogDescription, name: TriadName) -> Array:
    """Return the numbers of one triad, (N, 3); NaN where there are none."""
    triad = layout.triad(name)
    assert triad is not None  # checked by the caller
    if isinstance(triad.columns, str):
        return table.column(triad.columns, 3, gaps=True)
    columns = [table.column(column, gaps=True) for column in triad.columns]
    if len({len(column) for column in columns}) > 1:
        counted = ", ".join(f"{n!r} {len(c)}" for n, c in zip(triad.columns, columns, strict=True))
        raise InputError(f"{table.path}: the columns differ in length: {counted} samples.")
    return np.stack(columns, axis=-1)


def _triad(table: Table, layout: LogDescription, name: TriadName) -> Array:
    """Return one triad, forward-right-down, SI, (N, 3)."""
    triad = layout.triad(name)
    assert triad is not None
    with np.errstate(invalid="ignore"):  # infinite numbers are refused afterwards
        scaled = _raw(table, layout, name) * np.array(triad.signs, dtype=np.float64) @ layout.matrix.T
    scaled *= UNITS[name, layout.kind][triad.unit]
    return np.asarray(scaled)


def joined(unit: LogImu, samples: Samples, name: TriadName) -> tuple[Array, dict[TriadName, Array], tuple[str, ...]]:
    """Return the samples of the main file with the triad of another one, where both have some: times, (N,) s; the
    triads, (N, 3) each; a sentence."""
    triad = unit.triad(name)
    assert triad is not None
    time = samples.time[1:]
    both, read, notes = _at(unit, unit, triad, name, (time, samples.clock))
    triads: dict[TriadName, Array] = {key: value[both] for key, value in samples.triads.items()}
    main = "the gyros" if name == "accel" else "the accelerometers"
    note = f"The data of {_place(unit, triad)} are interpolated linearly to the times of {main}."
    return time[both], {**triads, name: read}, (*notes, note)


def with_gravity(
    unit: LogImu, time: Array, triads: dict[TriadName, Array], clock: Clock | None
) -> tuple[Array, dict[TriadName, Array], tuple[str, ...]]:
    """Return the samples with the recorded gravity vector added to the accelerations, where both are known, as
    `joined`; the clock is that of the main file, if it has dates."""
    triad = unit.gravity
    assert triad is not None
    layout = unit.model_copy(update={"accel": triad, "gravity": None})
    both, gravity, notes = _at(unit, layout, triad, "accel", (time, clock))
    common = {key: value[both] for key, value in triads.items()}
    common["accel"] = common["accel"] + gravity
    columns = triad.columns if isinstance(triad.columns, str) else ", ".join(map(str, triad.columns))
    note = f"The specific force is the sum of the accelerations and the gravity of {_place(unit, triad)} ({columns})."
    return time[both], common, (*notes, note)


def _place(unit: LogImu, triad: TriadColumns) -> str:
    """Return the name of the file of a triad, and its rows."""
    which = "" if triad.rows is None else f" with {', '.join(f'{k} = {v}' for k, v in triad.rows.items())}"
    return f"{Path(triad.file or unit.file).name}{which}"


def _at(
    unit: LogImu, described: LogImu, triad: TriadColumns, name: TriadName, to: tuple[Array, Clock | None]
) -> tuple[NDArray[np.bool_], Array, tuple[str, ...]]:
    """Return which times lie within a triad's samples, (N,), the triad interpolated to these, (M, 3), and notes."""
    other_file = triad.file or unit.file
    layout = described if triad.rows is None else described.model_copy(update={"rows": triad.rows})
    other = read_samples(Path(other_file), layout, [name])
    time, clock = to
    shift = 0.0
    if clock is not None and other.clock is not None:
        shift = float((other.clock.origin_gps_s or 0) - (clock.origin_gps_s or 0))
    at = other.time[1:] + shift
    both = (time >= at[0]) & (time <= at[-1])
    if int(both.sum()) < 2:
        raise InputError(
            f"{unit.file} and {other_file} do not overlap: {time[0]:.9g} to {time[-1]:.9g} s and {at[0]:.9g} to "
            f"{at[-1]:.9g} s."
        )
    longest = float(np.diff(at).max())
    if longest > unit.max_gap_s:
        k = int(np.diff(at).argmax())
        raise InputError(
            f"{other_file}: no samples for {longest:.6g} s from {at[k]:.9g} s on, more than max_gap_s = "
            f"{unit.max_gap_s:g}."
        )
    read = np.stack([np.interp(time[both], at, axis) for axis in other.triads[name].T], axis=1)
    return both, read, other.notes


WITHOUT_GRAVITY = (
    "If the recorder has removed gravity (linear or user acceleration), these data alone cannot be navigated: record "
    "the accelerometers with gravity (TotalAcceleration or raw accelerometer of a phone), or give the recorded gravity "
    "vector, too (Gravity.csv; the table gravity of log.imu)."
)
"""What is missing in such data, and what would be right."""

_BLOCK_S = 1.0
_FEWEST = 10  # blocks that tell
_CALM = 0.2  # share of the blocks, those with the least changes
_LESS = 0.5  # of the median over all blocks: calm motion has a specific force of gravity, but hardly an acceleration


def without_gravity(values: Array, interval: float) -> bool:
    """Return whether accelerations in any unit, (N, 3), an interval, s, apart have no gravity in them: where they
    change least, they are much less than usually. False for a log shorter than ten seconds, and for readings whose calm
    parts are not small."""
    width = max(round(_BLOCK_S / interval), 2)
    count = len(values) // width
    if count < _FEWEST:
        return False
    blocks = values[: count * width].reshape(count, width, 3)
    mean = np.linalg.norm(blocks.mean(axis=1), axis=1)
    noise = blocks.var(axis=1).sum(axis=1)
    calm = np.argsort(noise, kind="stable")[: max(round(_CALM * count), 3)]
    return bool(np.median(mean[calm]) < _LESS * np.median(mean))
