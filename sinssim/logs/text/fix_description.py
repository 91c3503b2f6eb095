"""The TOML description of recorded fixes, of a reference solution and of other readings: columns, constants, units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, Self

from pydantic import Field, model_validator

from sinssim.errors import unknown_name
from sinssim.logs.text.description import Column, TextLayout
from sinssim.logs.text.names import TIME_UNITS, UNITS_OF
from sinssim.section import Keys, Section

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
    together = (("speed", "course"),)

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
        found: list[Column] = [self.time]
        for _, _, quantity in self.quantities():
            if isinstance(quantity, Triple):
                found += quantity.columns or ()
            elif quantity.column is not None:
                found.append(quantity.column)
        found += () if self.quality is None else (self.quality,)
        return (*found, *(getattr(self, "quaternion", None) or ()))

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
