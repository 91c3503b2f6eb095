"""The TOML description of recorded inertial logs, fixes, references and other readings: columns, units and axes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim.data import Array
from sinssim.errors import unknown_name
from sinssim.logs.column_names import TIME_UNITS, UNITS, UNITS_OF, unit_in_name
from sinssim.logs.numeric_columns import WHITESPACE
from sinssim.toml_section import Keys, Rules, Section

TriadName = Literal["gyro", "accel"]
TRIADS: tuple[TriadName, ...] = ("gyro", "accel")
WORDS: dict[TriadName, str] = {"gyro": "gyros", "accel": "accelerometers"}
Direction = Literal["forward", "backward", "right", "left", "down", "up"]
DIRECTIONS: dict[str, tuple[int, float]] = {
    "forward": (0, 1.0),
    "backward": (0, -1.0),
    "right": (1, 1.0),
    "left": (1, -1.0),
    "down": (2, 1.0),
    "up": (2, -1.0),
}
"""Axis and sign of each direction, forward-right-down."""
Column = str | Annotated[int, Field(ge=1)]
"""Name of a column, or its number, from 1, in a text file without a line of names."""


Sign = Literal[-1, 1]


class TriadColumns(Section):
    """The columns of three gyros or three accelerometers."""

    columns: tuple[Column, Column, Column] | str = Field(
        description="three column names or numbers (counted from 1), or one array of three columns (npz)"
    )
    unit: str = Field(description="unit of the numbers")
    signs: tuple[Sign, Sign, Sign] = Field(default=(1, 1, 1), description="sign of each column; -1 reverses a column")
    file: str | None = Field(
        default=None,
        description="another text file of the same layout that contains this triad as rates; they are interpolated "
        "linearly to the times of the main file",
    )
    rows: dict[str, str] | None = Field(
        default=None,
        description='the rows with this triad, if gyros and accelerometers have rows of their own: { type = "gyro" }; '
        "they are interpolated like those of another file",
    )

    @property
    def apart(self) -> bool:
        """Whether the triad has rows of its own, in another file or in the same one."""
        return self.file is not None or self.rows is not None


_OWN: dict[TriadName, TriadColumns] = {
    "gyro": TriadColumns(columns=("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad"), unit="rad"),
    "accel": TriadColumns(columns=("dvel_x_mps", "dvel_y_mps", "dvel_z_mps"), unit="m/s"),
}


class TextLayout(Section):
    """How the columns of a text file are written."""

    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | Literal["whitespace"] = Field(
        default=",",
        description="one character between the fields of a text file, or whitespace for any number of blanks",
    )
    # no heading has a million lines, and the reader accepts at most 2³¹
    skip_lines: int = Field(
        default=0,
        ge=0,
        le=1_000_000,
        description="number of lines before the line of names, or before the first row of numbers",
    )

    decimal: Literal[".", ","] = Field(default=".", description="decimal sign of the text file")
    rows: dict[str, str] | None = Field(
        default=None,
        description='only rows in which columns have these texts, for example { I = "0" } for the first of several '
        "IMUs in one file; columns without names by their number",
    )

    @model_validator(mode="after")
    def _delimiter_separates(self) -> Self:
        if self.delimiter.isalnum() and self.delimiter != WHITESPACE:
            raise ValueError(
                f"delimiter = {self.delimiter!r} cannot separate numbers; use a comma, a semicolon or a tab"
            )
        if self.delimiter == self.decimal == ",":
            raise ValueError('decimal = "," needs another delimiter, for example delimiter = ";"')
        return self


class LogDescription(TextLayout):
    """The description of a log's columns."""

    rules: ClassVar[Rules] = (
        (lambda s: s.kind == "increments" and any(t is not None and t.apart for t in (s.gyro, s.accel)),
         'a triad of another file or other rows is interpolated, which needs kind = "rates"'),
        (lambda s: s.kind == "rates" and s.gyro is None and s.accel is None,
         'kind = "rates" needs a table [gyro] or [accel], or both, with columns and unit'),
        (lambda s: s.rate_hz is not None and "time" in s.model_fields_set and s.time is not None,
         "time (a column) and rate_hz are both given: keep one of them"),
    )  # fmt: skip

    kind: Literal["increments", "rates"] = Field(
        default="increments", description="integrals over an interval, or rates"
    )
    time: Column | None = Field(default="time_s", description="column with the time at the end of each interval")
    time_unit: str | None = Field(
        default=None,
        description=f"one of {', '.join(TIME_UNITS)}; default: the unit at the end of the column's name (t_ms), else s",
    )
    # 100 kHz is also the limit of a scenario; one sample in three hours is slower than any logger
    rate_hz: Annotated[float, Field(ge=1e-4, le=1e5)] | None = Field(
        default=None, description="samples per second, instead of a time column"
    )
    axes: tuple[Direction, Direction, Direction] = Field(
        default=("forward", "right", "down"), description="directions of the three axes of the sensor block"
    )
    gyro: TriadColumns | None = Field(default=None, description="columns and unit of the gyros")
    accel: TriadColumns | None = Field(default=None, description="columns and unit of the accelerometers")

    @model_validator(mode="after")
    def _units_are_known(self) -> Self:
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise unknown_name("unit of time", self.time_unit, TIME_UNITS)
        for name in TRIADS:
            triad = self.triad(name)
            if triad is not None and triad.unit not in UNITS[name, self.kind]:
                raise unknown_name(f"unit of {name} {self.kind}", triad.unit, UNITS[name, self.kind])
        named = self.unit_in_name
        if None not in (self.time_unit, named) and self.time_unit != named and self.rate_hz is None:
            raise ValueError(
                f'time_unit = "{self.time_unit}" contradicts the name of the column, {self.time!r}, which gives {named}'
            )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if abs(np.linalg.det(self.matrix) - 1.0) > 1e-9:
            raise ValueError(
                f"axes = {list(self.axes)} is not a right-handed set of three perpendicular directions "
                'such as ["forward", "right", "down"] or ["right", "forward", "up"]'
            )
        stated = self.described if self.gyro is not None or self.accel is not None else ()
        kinds = {isinstance(column, int) for column in self.used(stated)}
        if len(kinds) > 1:
            raise ValueError(
                "some columns are named and others numbered; a text file either has a line of names or has none (time "
                f"is {self.time!r}; with rate_hz this column is not needed)"
            )
        return self

    @property
    def unit_in_name(self) -> str | None:
        """The unit at the end of the time column's name; None if there is none."""
        return unit_in_name(self.time)

    @property
    def stated_time_unit(self) -> str | None:
        """The unit of time from the description or the column's name; None if neither gives it."""
        return self.time_unit or self.unit_in_name

    def triad(self, name: TriadName) -> TriadColumns | None:
        """Return the columns of one triad; those of the package's own streams if neither triad is described."""
        if self.gyro is None and self.accel is None:
            return _OWN[name]
        return self.gyro if name == "gyro" else self.accel

    @property
    def described(self) -> tuple[TriadName, ...]:
        """The triads whose columns are known."""
        return tuple(name for name in TRIADS if self.triad(name) is not None)

    def used(self, triads: tuple[TriadName, ...]) -> tuple[Column, ...]:
        """Return the columns that are read for given triads."""
        columns: list[Column] = [] if self.time is None or self.rate_hz is not None else [self.time]
        for name in triads:
            if (triad := self.triad(name)) is not None:
                columns += triad.columns if isinstance(triad.columns, tuple) else (triad.columns,)
        return tuple(columns)

    @property
    def numbered(self) -> bool:
        """Whether columns are numbered, in a text file without a line of names."""
        if self.gyro is None and self.accel is None:  # only the time is described
            return self.rate_hz is None and isinstance(self.time, int)
        return isinstance(self.used(self.described)[-1], int)

    @property
    def matrix(self) -> Array:
        """Matrix from the log's components to forward-right-down, (3, 3)."""
        matrix = np.zeros((3, 3))
        for column, direction in enumerate(self.axes):
            row, sign = DIRECTIONS[direction]
            matrix[row, column] = sign
        return matrix


Axes = Literal["north-east-down", "north-east-up", "east-north-up"]
SIGNS: dict[Axes, tuple[tuple[int, float], ...]] = {
    "north-east-down": ((0, 1.0), (1, 1.0), (2, 1.0)),
    "north-east-up": ((0, 1.0), (1, 1.0), (2, -1.0)),
    "east-north-up": ((1, 1.0), (0, 1.0), (2, -1.0)),
}
"""Column and sign of north, east and down for each order of three columns."""


class Quantity(Section):
    """One quantity: a column, or a constant instead of a column."""

    exactly_one = (Keys(("column", "value"), "a quantity is a column, or a constant value"),)

    column: Column | None = Field(default=None, description="name of the column, or its number, counted from 1")
    value: float | None = Field(default=None, description="a constant instead of a column")
    unit: str = Field(description="unit of the numbers")


class Triple(Section):
    """Three components: columns, or constants instead of columns."""

    exactly_one = (Keys(("columns", "values"), "three components are columns, or constant values"),)

    columns: tuple[Column, Column, Column] | None = Field(default=None, description="names of three columns")
    values: tuple[float, float, float] | None = Field(default=None, description="three constants instead of columns")
    unit: str = Field(description="unit of the numbers")
    axes: Axes = Field(default="north-east-down", description=f"directions of the three components: {', '.join(SIGNS)}")


class FixColumns(TextLayout):
    """The columns of a file with positions of a receiver or of a reference."""

    at_most_one = (Keys(("speed", "velocity"), "the velocity"),)
    paired = (("speed", "course"),)

    time: Column = Field(default="time_s", description="column with the times of validity")
    time_unit: str | None = Field(
        default=None, description=f"one of {', '.join(TIME_UNITS)}; default: the unit in the column's name, else s"
    )
    latitude: Quantity | None = Field(default=None, description="geodetic latitude, north positive")
    longitude: Quantity | None = Field(default=None, description="longitude, east positive")
    height: Quantity | None = Field(default=None, description="height")
    velocity: Triple | None = Field(default=None, description="velocity relative to the Earth")
    speed: Quantity | None = Field(default=None, description="speed over ground, with course, instead of velocity")
    course: Quantity | None = Field(default=None, description="course over ground, clockwise from north")
    held: bool = Field(
        default=False,
        description="whether rows repeat a fix until there is a new one; only new fixes are used",
    )
    position_sigma: Triple | None = Field(default=None, description="1σ of the position")
    velocity_sigma: Triple | None = Field(default=None, description="1σ of the velocity")
    quality: Column | None = Field(default=None, description="column with the quality code of the receiver")

    @model_validator(mode="after")
    def _units_are_known(self) -> Self:
        if self.time_unit is not None and self.time_unit not in TIME_UNITS:
            raise unknown_name("unit of time", self.time_unit, TIME_UNITS)
        for name, dimension, quantity in self.quantities():
            if quantity.unit not in UNITS_OF[dimension]:
                raise unknown_name(f"unit of {name}", quantity.unit, UNITS_OF[dimension])
        return self

    def quantities(self) -> Iterator[tuple[str, str, Quantity | Triple]]:
        """Yield name, dimension and description of each quantity that is described."""
        for name, dimension in (
            ("latitude", "angle"), ("longitude", "angle"), ("height", "length"), ("velocity", "speed"),
            ("speed", "speed"), ("course", "angle"),
            ("position_sigma", "length"), ("velocity_sigma", "speed"), ("roll", "angle"), ("pitch", "angle"),
            ("heading", "angle"), ("attitude_sigma", "angle"),
        ):  # fmt: skip
            quantity = getattr(self, name, None)
            if quantity is not None:
                yield name, dimension, quantity

    @property
    def used(self) -> tuple[Column, ...]:
        """The columns that are read."""
        columns: list[Column] = [self.time]
        for _, _, quantity in self.quantities():
            if isinstance(quantity, Triple):
                columns += quantity.columns or ()
            elif quantity.column is not None:
                columns.append(quantity.column)
        columns += () if self.quality is None else (self.quality,)
        return (*columns, *(getattr(self, "quaternion", None) or ()))

    @property
    def numbered(self) -> bool:
        """Whether columns are numbered, in a text file without a line of names."""
        return isinstance(self.time, int)


class SolutionColumns(FixColumns):
    """The columns of a file with positions and attitudes."""

    roll: Quantity | None = Field(default=None, description="roll of the vehicle")
    pitch: Quantity | None = Field(default=None, description="pitch of the vehicle")
    heading: Quantity | None = Field(default=None, description="heading of the vehicle")
    attitude_sigma: Triple | None = Field(default=None, description="1σ of roll, pitch and heading")
    quaternion: tuple[Column, Column, Column, Column] | None = Field(
        default=None, description="columns of q_nb of the vehicle, scalar first"
    )
