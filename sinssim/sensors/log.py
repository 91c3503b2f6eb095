"""Reading a recorded IMU log into increments: text, Parquet or npz, its columns, units and axes named in a TOML file.

Without a description the columns are those of the package's own streams, `imu_measured.parquet` and its like.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim.data import Array, ImuData
from sinssim.errors import InputError, unknown_name
from sinssim.scenario.section import Positive, Section
from sinssim.units import ARCSEC, DEG, DEG_H, FOOT, G0

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNITS: dict[tuple[str, str], dict[str, float]] = {
    ("gyro", "increments"): {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": DEG, "arcsec": ARCSEC},
    ("gyro", "rates"): {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": DEG, "deg/h": DEG_H},
    ("accel", "increments"): {"m/s": 1.0, "mm/s": 1e-3, "ft/s": FOOT, "g*s": G0},
    ("accel", "rates"): {"m/s^2": 1.0, "ft/s^2": FOOT, "g": G0, "mg": 1e-3 * G0},
}
"""Units by triad and kind of log, in SI."""

TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc")
"""Suffixes of text files."""
SUFFIXES = (*TEXT, ".parquet", ".npz")
"""Suffixes of the files that can be a log."""
WHITESPACE = "whitespace"
"""The delimiter of columns that stand apart by any number of spaces and tabs."""

TriadName = Literal["gyro", "accel"]
Direction = Literal["forward", "backward", "right", "left", "down", "up"]
_DIRECTIONS: dict[str, tuple[int, float]] = {
    "forward": (0, 1.0),
    "backward": (0, -1.0),
    "right": (1, 1.0),
    "left": (1, -1.0),
    "down": (2, 1.0),
    "up": (2, -1.0),
}


Column = str | Annotated[int, Field(ge=1)]
"""Name of a column, or its number, from 1, in a text file without a line of names."""


class TriadColumns(Section):
    """The columns of three gyros or three accelerometers."""

    columns: tuple[Column, Column, Column] | str = Field(
        description="three column names or numbers (from 1), or one array of three columns (npz)"
    )
    unit: str = Field(description="unit of the numbers")


class LogDescription(Section):
    """What a log's columns hold."""

    kind: Literal["increments", "rates"] = Field(
        default="increments", description="integrals over an interval, or rates"
    )
    time: Column | None = Field(default="time_s", description="column with the time at the end of each interval")
    time_unit: str = Field(default="s", description=f"one of {', '.join(TIME_UNITS)}")
    rate_hz: Positive | None = Field(default=None, description="samples per second, in place of a time column")
    axes: tuple[Direction, Direction, Direction] = Field(
        default=("forward", "right", "down"), description="where the three axes of the sensor block point"
    )
    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | Literal["whitespace"] = Field(
        default=",",
        description="one character between the fields of a text file, or whitespace for any number of blanks",
    )
    skip_lines: int = Field(
        default=0, ge=0, description="lines of a text file before its line of names, or its numbers"
    )
    gyro: TriadColumns = TriadColumns(columns=("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad"), unit="rad")
    accel: TriadColumns = TriadColumns(columns=("dvel_x_mps", "dvel_y_mps", "dvel_z_mps"), unit="m/s")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.time_unit not in TIME_UNITS:
            raise unknown_name("unit of time", self.time_unit, TIME_UNITS)
        for name, triad in (("gyro", self.gyro), ("accel", self.accel)):
            if triad.unit not in UNITS[name, self.kind]:
                raise unknown_name(f"unit of {name} {self.kind}", triad.unit, UNITS[name, self.kind])
        if abs(np.linalg.det(self.matrix) - 1.0) > 1e-9:
            raise ValueError(
                f"axes = {list(self.axes)} is not a right-handed set of three perpendicular directions, "
                'as ["forward", "right", "down"] or ["right", "forward", "up"] are'
            )
        if self.rate_hz is not None and "time" in self.model_fields_set and self.time is not None:
            raise ValueError("time (a column) and rate_hz are both given: keep one of them")
        kinds = {isinstance(column, int) for column in self.used}
        if len(kinds) > 1:
            raise ValueError(
                "some columns are named and others numbered: a text file has a line of names or has none (time is "
                f"{self.time!r}; with rate_hz there need be no such column)"
            )
        return self

    @property
    def used(self) -> tuple[Column, ...]:
        """The columns that are read."""
        triads = (t.columns if isinstance(t.columns, tuple) else (t.columns,) for t in (self.gyro, self.accel))
        timed = self.time is not None and self.rate_hz is None
        return (*((self.time,) if timed and self.time is not None else ()), *(c for triad in triads for c in triad))

    @property
    def numbered(self) -> bool:
        """Whether columns go by their numbers, in a text file without a line of names."""
        return isinstance(self.used[-1], int)

    @property
    def matrix(self) -> Array:
        """What turns the log's components into forward-right-down, (3, 3)."""
        matrix = np.zeros((3, 3))
        for column, direction in enumerate(self.axes):
            row, sign = _DIRECTIONS[direction]
            matrix[row, column] = sign
        return matrix


@dataclass(frozen=True)
class Samples:
    """What a log holds, forward-right-down, SI.

    Attributes:
        kind: whether the numbers are integrals over the intervals or rates.
        time: edges of the intervals, (N+1,) s; the first interval is as long as the second.
        triads: "gyro" and "accel", or one of them, (N, 3): rad and m/s, or rad/s and m/s².
    """

    kind: Literal["increments", "rates"]
    time: Array
    triads: dict[TriadName, Array]


def read_log(path: Path, description: Path | None = None) -> ImuData:
    """Read a recorded log as increments.

    Args:
        path: a text file (`TEXT`), or a .parquet or .npz file.
        description: a TOML file that names columns, units and axes; by default the package's own columns.

    Returns:
        Increments, forward-right-down, SI; the first interval is as long as the second.

    Raises:
        InputError: a file that cannot be read, a column that is missing or not numeric, a value that is not finite,
            times that do not increase.
    """
    samples = read_samples(path, description)
    gyro, accel = samples.triads["gyro"], samples.triads["accel"]
    if samples.kind == "rates":
        interval = np.diff(samples.time)[:, None]
        return ImuData(samples.time, gyro * interval, accel * interval)
    return ImuData(samples.time, gyro, accel)


def read_samples(
    path: Path, description: Path | None = None, triads: Sequence[TriadName] = ("gyro", "accel")
) -> Samples:
    """Read a recorded log as it is, rates as rates.

    Args:
        path: a text file (`TEXT`), or a .parquet or .npz file.
        description: a TOML file that names columns, units and axes; by default the package's own columns.
        triads: those that are needed; the columns of the others may be missing.

    Returns:
        The samples.

    Raises:
        InputError: as `read_log`.
    """
    layout = LogDescription()
    if description is not None:
        from sinssim.scenario.toml_file import read_toml, validate

        text, data = read_toml(description)
        layout = validate(LogDescription, data, text, str(description))
    columns = _columns(path, layout)
    if description is None and not set(layout.used) & set(columns):
        raise InputError(
            f"{path} has none of the columns of imu_measured.parquet ({', '.join(map(str, layout.used))}). Its own are "
            f"{', '.join(map(str, columns)) or 'none'}: say in a TOML file what they hold (--columns)."
        )
    values: dict[TriadName, Array] = {name: _triad(columns, layout, name, path) for name in triads}
    lengths = {name: len(triad) for name, triad in values.items()}
    if layout.rate_hz is not None or layout.time is None:
        if layout.rate_hz is None:
            raise InputError(f"{description}: neither a time column nor rate_hz says when the samples were taken.")
        edges = np.arange(max(lengths.values()) + 1) / layout.rate_hz
    else:
        ends = _column(columns, layout.time, path) * TIME_UNITS[layout.time_unit]
        if len(ends) < 2:
            raise InputError(f"{path} has {len(ends)} sample{'s' * (len(ends) != 1)}; a log needs at least two.")
        edges = np.concatenate([[2.0 * ends[0] - ends[1]], ends])
        backwards = np.flatnonzero(np.diff(edges) <= 0.0)
        if len(backwards):
            k = int(backwards[0])
            raise InputError(f"{path}, sample {k}: the time {edges[k + 1]:.9g} s does not come after {edges[k]:.9g} s.")
    if set(lengths.values()) != {len(edges) - 1}:
        counted = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"{path}: the columns differ in length: {counted}, time {len(edges) - 1} samples.")
    return Samples(layout.kind, edges, values)


def _columns(path: Path, layout: LogDescription) -> dict[Column, Any]:
    """Read the file's columns by name, or by number."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path}: a log is a text file ({', '.join(TEXT)}) or a .parquet or .npz file, not "
            f"{suffix or 'one without a suffix'}."
        )
    if layout.numbered and suffix not in TEXT:
        raise InputError(
            f"{path}: the columns of a {suffix} file have names; numbers are for text files without names."
        )
    try:
        with path.open("rb") as file:  # whose words are clearer than pyarrow's if there is no such file
            archive = zipfile.is_zipfile(file)
        if suffix == ".npz":
            if not archive:
                raise ValueError("it is no archive of arrays, as numpy.savez writes one")
            with np.load(path) as arrays:
                return {name: np.asarray(arrays[name]) for name in arrays.files}
        if suffix == ".parquet":
            from pyarrow import parquet

            table = parquet.read_table(path)
        else:
            table = _text_table(path, layout)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (ValueError, zipfile.BadZipFile, zlib.error) as error:  # pyarrow's and numpy's own derive from ValueError
        reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
        hint = "" if suffix not in TEXT else f" Its fields are taken to be separated by {layout.delimiter!r}"
        hint += "" if suffix not in TEXT else f" after {layout.skip_lines} skipped lines (delimiter and skip_lines)."
        raise InputError(f"{path} cannot be read as a {suffix} file: {reason}.{hint}") from error
    names: list[Column] = list(range(1, table.num_columns + 1))
    if not layout.numbered:
        names = [name.strip().strip('"') for name in table.column_names]
    return {name: column.to_numpy() for name, column in zip(names, table.columns, strict=True)}


def _text_table(path: Path, layout: LogDescription) -> Any:
    """Read a text file with pyarrow, runs of blanks made single ones first if they are the delimiter."""
    from pyarrow import csv

    source: Path | io.BytesIO = path
    delimiter = layout.delimiter
    if delimiter == WHITESPACE:
        source = io.BytesIO(b"\n".join(b" ".join(line.split()) for line in path.read_bytes().splitlines()))
        delimiter = " "
    return csv.read_csv(
        source,
        read_options=csv.ReadOptions(skip_rows=layout.skip_lines, autogenerate_column_names=layout.numbered),
        parse_options=csv.ParseOptions(delimiter=delimiter),
    )


def _column(columns: dict[Column, Any], name: Column, path: Path) -> Array:
    if name not in columns and isinstance(name, int):
        raise InputError(f"{path}: there is no column {name}; it has {len(columns)} columns.")
    if name not in columns:
        error = unknown_name("column", str(name), [str(known) for known in columns])
        raise InputError(f"{path}: {error}") from error
    try:
        values = np.asarray(columns[name], dtype=np.float64)
    except (TypeError, ValueError) as error:
        k, value = next((k, value) for k, value in enumerate(columns[name]) if not _is_number(value))
        hint = " If it belongs to a heading, skip that (skip_lines) and number the columns." if k == 0 else ""
        raise InputError(f"{path}, sample {k}: the column {name!r} holds {value!r}, not a number.{hint}") from error
    if not values.size:
        raise InputError(f"{path} holds no samples: the column {name!r} is empty.")
    finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    if not finite.all():
        raise InputError(f"{path}, sample {int(np.argmin(finite))}: the column {name!r} is empty or not finite.")
    return values


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def _triad(columns: dict[Column, Any], layout: LogDescription, name: TriadName, path: Path) -> Array:
    """Return one triad, forward-right-down, SI, (N, 3)."""
    triad: TriadColumns = getattr(layout, name)
    if isinstance(triad.columns, str):
        values = _column(columns, triad.columns, path)
        if values.ndim != 2 or values.shape[1] != 3:
            raise InputError(f"{path}: the array {triad.columns!r} has shape {values.shape}; a triad is (N, 3).")
    else:
        values = np.stack([_column(columns, column, path) for column in triad.columns], axis=-1)
        if values.ndim != 2:
            raise InputError(
                f"{path}: a column of {name} is not one number per sample, its shape is {values.shape[:-1]}."
            )
    return np.asarray(values @ layout.matrix.T * UNITS[name, layout.kind][triad.unit])
