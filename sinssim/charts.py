"""Charts as data: axes with quantities and marks in SI, which every medium of `sinssim.recording` draws.

A colour is the name of what is drawn (`recording.style` has one colour for each name), red, green and blue, or "" for
the colour of the mark's label.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, Rows, blocks
from sinssim.units import TIME_SCALE, Scale, fixed, suiting

Color = str | tuple[int, int, int]
Weight = Literal["broad", "wide", "bold", "line", "thin", "hair"]
Dash = Literal["", "--", ":", "-."]
NUMBER: Scale = fixed("")


@dataclass(frozen=True, kw_only=True)
class Axis:
    """An axis of a chart."""

    label: str = ""  # what it shows, without the unit
    units: Scale = NUMBER  # units of its quantity; the one that suits the largest value is taken
    log: bool = False  # whether the scale is logarithmic
    # its ends, SI; by the marks if None
    low: float | None = None
    high: float | None = None
    names: tuple[str, ...] = ()  # words at the places 0, 1, 2 … instead of numbers
    ticks: tuple[float, ...] = ()  # the only numbers that are written, SI; chosen if empty
    grid: bool = True  # whether lines cross the chart at its ticks
    least: float = 0.0  # smallest change that is not rounding, SI


TIME = Axis(label="time", units=TIME_SCALE)
"""Time since the start of a run."""


PAIR, WIDE = (11.4, 3.0), (11.4, 3.6)
"""Sizes of two plots side by side and of one over the whole width of a run's report, inches."""


def over(span: tuple[float, float]) -> Axis:
    """Return the axis of the times of a run between its first and last instant, s."""
    return Axis(label="time", units=TIME_SCALE, low=span[0], high=span[1])


def extremes(values: Rows) -> Array:
    """Return the least and the greatest finite value, all that a linear axis needs; nothing if there is none."""
    low, high = np.inf, -np.inf
    for rows in blocks(len(values)):
        block = values[rows]
        if block.size and not np.isfinite([block.min(), block.max()]).all():
            block = block[np.isfinite(block)]
        if block.size:
            low, high = min(low, block.min()), max(high, block.max())
    return np.array([low, high]) if low <= high else np.empty(0)


class _Points:
    """What lines and dots have in common."""

    x: Rows
    y: Rows

    @cached_property
    def across(self) -> Array:
        """`extremes` of x."""
        return extremes(self.x)

    @cached_property
    def upright(self) -> Array:
        """`extremes` of y."""
        return extremes(self.y)


@dataclass(frozen=True, kw_only=True, eq=False)
class Line(_Points):
    """A line."""

    label: str = ""  # name in the legend; "" for none
    # (N,) SI; a NaN gives a gap
    x: Array
    y: Array
    color: Color = ""  # its colour
    weight: Weight = "line"  # how broad it is
    dash: Dash = ""  # pattern
    turn: float = 0.0  # full turn by which the values, if they are angles, jump; 0 for others
    marker: str = ""  # shape of the mark on each point: "o", "s", "^", "D", "P", "*", "" for none
    hollow: bool = False  # whether the marks are hollow
    counts: bool = True  # whether the line widens the axis
    more: str = ""  # what a picture adds to the label, such as the last value
    step: float = 0.0  # width along x within which it has only the extremes of what it shows, SI; 0 if it has all
    time: Array = field(default_factory=lambda: np.empty(0))  # (N,) s at its points, of a track; empty if not known

    @property
    def name(self) -> str:
        """Name in the legend of a picture."""
        return self.label + self.more


@dataclass(frozen=True, kw_only=True, eq=False)
class Ellipses(Line):
    """Ellipses about places of a track, drawn at some instants; the map of a page also has that of its cursor."""

    at: Array  # (M,) s
    centres: Array  # (M, 2) SI
    axes: Array  # (M, 2, 2), both semi-axes as vectors, the longer first, SI

    @classmethod
    def about(cls, at: Array, centres: Array, axes: Array, shown: Array, **look: Any) -> Ellipses:
        """Return the ellipses of instants, (M,) s, about centres with semi-axes; the rows `shown` are drawn."""
        turn = np.append(np.linspace(0.0, 2.0 * np.pi, 49), np.nan)
        ring = np.stack((np.cos(turn), np.sin(turn)), axis=1)
        x, y = (centres[shown, None] + ring @ axes[shown]).reshape(-1, 2).T
        return cls(x=x, y=y, at=at, centres=centres, axes=axes, **look)


@dataclass(frozen=True, kw_only=True, eq=False)
class ScaleBar(Line):
    """A bar whose length on a map is a round number of a unit."""

    unit: str  # its name
    size: float  # SI


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """The surface between two lines, such as a confidence band."""

    # (N,) SI
    x: Array
    low: Array
    high: Array
    color: Color  # its colour, drawn pale
    label: str = ""  # name in the legend; "" for none


@dataclass(frozen=True, kw_only=True, eq=False)
class Dots(_Points):
    """Single points."""

    label: str = ""  # name in the legend; "" for none
    # (N,) SI
    x: Rows
    y: Rows
    color: Color | Sequence[Color] = ""  # one for all, or one for each
    size: float = 4.0  # diameter, points
    marker: str = "o"  # shape, see `Line`
    # (N,) 1σ drawn as a horizontal line through each point, SI; empty for none
    error: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Sites(Dots):
    """Places of a map with names; only some are drawn, and the map of a page has more of them where it is enlarged."""

    sites: Array  # (M, 2) to the right and up, SI, the large ones first
    names: tuple[str, ...]  # M
    large: int  # number of the large ones


@dataclass(frozen=True, kw_only=True, eq=False)
class Bars:
    """Bars from zero at places on an axis with names."""

    label: str = ""  # name in the legend; "" for none
    places: Array  # (N,) centres, in the numbers of the names
    values: Array  # (N,) SI
    color: Color | Sequence[Color] = ""  # one for all, or one for each
    texts: tuple[str, ...] = ()  # what is written at their ends; empty for nothing
    across: bool = True  # whether they are horizontal, with the names on the vertical axis
    width: float = 0.7  # in the numbers of the names
    # (N,) ends of a line through each end, SI; empty for none
    low: Array = field(default_factory=lambda: np.empty(0))
    high: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Shares:
    """Surfaces on top of each other."""

    x: Array  # (N,) SI
    parts: Array  # (k, N), the lowest first, SI
    labels: tuple[str, ...]  # k names
    colors: tuple[Color, ...]  # k colours


@dataclass(frozen=True, kw_only=True, eq=False)
class Histogram:
    """Numbers of values in intervals."""

    values: Array  # (N,) SI, finite
    color: Color  # its colour

    @property
    def counted(self) -> tuple[Array, Array]:
        """Edges, (k + 1,) SI, and numbers, (k,)."""
        counts, edges = np.histogram(self.values, bins="auto" if len(self.values) > 20 else 10)
        return edges, counts.astype(np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class Rule:
    """A straight line across the chart at a value, with a band about it."""

    at: float  # its value, SI
    upright: bool = False  # whether it stands at a value of the horizontal axis
    label: str = ""  # name in the legend; "" for none
    text: str = ""  # written at its end, at the top of one that stands
    color: Color = "soft"  # its colour
    # see `Line`
    weight: Weight = "thin"
    dash: Dash = ""
    # ends of the band; None for none
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, kw_only=True)
class Limit:
    """The limit of a requirement: a line throughout the run, or a mark at one time."""

    text: str  # the requirement
    verdict: str  # "met", "not met" or "undecided"
    height: float  # its limit, SI
    at: float | None = None  # its time, s; None throughout

    FAR = 1.5
    """A limit is drawn up to this multiple of the highest curve; beyond, it is only named."""

    @property
    def label(self) -> str:
        """Its name in a legend."""
        return f"{self.text}: {self.verdict}"

    def is_far(self, most: float) -> bool:
        """Return whether it is beyond a chart whose highest curve reaches `most`, SI."""
        return self.height > self.FAR * most

    def name_in(self, most: float) -> str:
        """Return its name in the legend of such a chart."""
        return self.label + (" (above the plot)" if self.is_far(most) else "")

    @property
    def color(self) -> Color:
        """Its colour, by the verdict."""
        return {"met": "truth", "not met": "measured"}.get(self.verdict, "run")


@dataclass(frozen=True, kw_only=True)
class Remark:
    """Words beside a point."""

    # x, y: the point, SI
    x: float
    y: float
    text: str  # the words
    # left, below: whether they are to the left of it, and below it, instead of to the right and above
    left: bool = False
    below: bool = False
    soft: bool = False  # whether they are small and pale


@dataclass(frozen=True, kw_only=True, eq=False)
class Cells:
    """Coloured cells at the places of two axes with names."""

    values: Array  # (m, n), the first row on top, SI; a value that is not finite has no colour
    texts: Sequence[Sequence[str]]  # what is written in the cells, m rows
    # values of the palest and of the darkest shade, SI
    low: float
    high: float
    log: bool  # whether the shades follow the logarithm
    framed: NDArray[np.bool_]  # (m, n), whether a cell has a frame

    @property
    def shades(self) -> Array:
        """From 0 to 1, (m, n), NaN without a colour."""
        scale = np.log if self.log else np.asarray
        with np.errstate(divide="ignore", invalid="ignore"):
            shades = (scale(self.values) - scale(self.low)) / (scale(self.high) - scale(self.low))
        return np.where(np.isfinite(shades), shades, np.nan)


Mark = Line | Band | Dots | Bars | Shares | Histogram | Rule | Limit | Remark | Cells


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """One chart."""

    key: str  # its name within the group; of its entity in a recording
    title: str = ""  # what it shows
    # its axes
    x: Axis = TIME
    y: Axis
    marks: tuple[Mark, ...]  # what is drawn, in this order
    equal: bool = False  # whether both axes have the same scale
    # where the names of the marks are, if the group has no common legend
    legend: Literal["inside", "right", "below", "none"] = "inside"
    room: float = 1.05  # factor of the space above the highest mark of an axis that begins at zero

    def values(self, upright: bool) -> Iterator[Array]:
        """Yield the values that widen an axis, SI; the extremes of a line or of dots on a linear axis."""
        for mark in self.marks:
            match mark:
                case Dots() if len(mark.error) and not upright:
                    yield from (mark.x[:] - mark.error, mark.x[:] + mark.error)
                case Dots() | Line(counts=True):
                    if (self.y if upright else self.x).log:
                        yield (mark.y if upright else mark.x)[:]
                    else:
                        yield mark.upright if upright else mark.across
                case Band():
                    yield from ((mark.low, mark.high) if upright else (mark.x,))
                case Bars() if mark.across != upright:
                    yield from (mark.values, mark.low, mark.high)
                case Shares():
                    yield from ((mark.parts.sum(axis=0),) if upright else (mark.x,))
                case Histogram():
                    yield mark.counted[1] if upright else mark.counted[0]
                case _:
                    pass

    @property
    def most(self) -> float:
        """The largest finite value on the vertical axis, SI; 0 without any."""
        return max((float(v[np.isfinite(v)].max(initial=-np.inf)) for v in self.values(upright=True)), default=0.0)

    def ends(self, upright: bool) -> tuple[float | None, float | None]:
        """Return the ends of an axis that are not left to the medium: both, SI: those of the axis; above zero with room
        over the highest mark; about the positive values on a logarithmic axis; along the horizontal axis those of the
        lines."""
        axis = self.y if upright else self.x
        low, high = axis.low, axis.high
        if low is not None and high is not None:
            return low, high
        ends = [v[np.isfinite(v)] for v in self.values(upright)]
        ends = [v for v in ends if len(v)]
        if not ends or axis.names:
            return low, high
        lines = all(isinstance(mark, Line | Band | Shares | Rule | Limit) for mark in self.marks)
        if axis.log:
            return self._log_ends(axis, np.concatenate(ends), 1.0 if lines and not upright else 1.3)
        most = max(float(v.max()) for v in ends)
        if high is None and low == 0.0:
            named = any(isinstance(mark, Bars) and mark.across != upright and mark.texts for mark in self.marks)
            high = (1.18 if named else self.room) * most if most > 0.0 else 1.0
        if not upright and low is None and high is None and lines:
            least = min(float(v.min()) for v in ends)
            room = 0.03 * (most - least) if any(isinstance(mark, Line) and mark.marker for mark in self.marks) else 0.0
            low, high = (least - room, most + room) if least < most else (None, None)
        return low, high

    @staticmethod
    def _log_ends(axis: Axis, values: Array, room: float) -> tuple[float | None, float | None]:
        """Return the ends of a logarithmic axis: room about the values, and enough for two numbers."""
        values = values[values > 0.0]
        if not len(values):
            return axis.low, axis.high
        low = float(values.min()) / room if axis.low is None else axis.low
        high = float(values.max()) * room if axis.high is None else axis.high
        widen = max(1.0, np.sqrt(4.0 * low / high))  # to a factor of 4, which holds two of 1, 2, 5, 10 …
        return (low / widen if axis.low is None else low), (high * widen if axis.high is None else high)

    def unit(self, upright: bool) -> tuple[str, float]:
        """Return the unit of an axis: its name, and its size in SI."""
        axis = self.y if upright else self.x
        ends = [np.array([end]) for end in (axis.low, axis.high) if end is not None]
        if axis.units is TIME_SCALE and not axis.log and not upright:  # as long as the run is
            known = [extremes(v) for v in (ends or self.values(upright))]
            all_times = np.concatenate([*known, np.zeros(0 if any(len(v) for v in known) else 1)])
            return suiting(TIME_SCALE, np.ptp(all_times, keepdims=True))
        if len(ends) == 2 and not self.equal:
            return suiting(axis.units, *ends)
        if self.equal:
            ends += [v for way in (False, True) for v in self.values(way)]
        return suiting(axis.units, *ends, *(v[np.isfinite(v)] for v in self.values(upright)))

    def heading(self, upright: bool) -> str:
        """Return the label of an axis with its unit."""
        axis, unit = (self.y if upright else self.x), self.unit(upright)[0]
        return f"{axis.label} [{unit}]" if unit and axis.label else unit or axis.label


@dataclass(frozen=True, eq=False)
class Charts:
    """Charts that belong together."""

    key: str  # name of the group, of the file of its picture and of its parts on a page
    rows: tuple[tuple[Chart, ...], ...]  # the charts, row by row
    size: tuple[float, float]  # width and height of the whole as a picture, inches
    title: str = ""  # above all of them
    note: str = ""  # below all of them
    # where the names of all marks are; "each" for a legend in each chart
    legend: Literal["each", "right", "below"] = "each"
    share: Literal["", "x", "y", "xy"] = ""  # which axes all charts have in common
    # relative widths and heights of columns and rows; equal if empty
    widths: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    on: tuple[str, ...] = ("page", "recording")  # the media that show it
    named: str = ""  # what the names in a common legend are

    def __iter__(self) -> Iterator[Chart]:
        return (chart for row in self.rows for chart in row)


@dataclass(frozen=True, kw_only=True, eq=False)
class Cloud:
    """Points that move in a plane, and circles about its origin; a recording shows it."""

    key: str  # name of its entity
    time: Array  # (K,) s since the start
    # (N, K) to the right and up, SI; NaN where a point is missing
    x: Array
    y: Array
    units: Scale  # units of both
    names: tuple[str, str]  # what lies to the right, and up
    circles: dict[str, Array]  # radius of each circle, (K,) SI, by the name of its colour; none where it is not finite
    on: tuple[str, ...] = ("recording",)  # the media that show it


def in_rows(charts: Sequence[Chart], columns: int) -> tuple[tuple[Chart, ...], ...]:
    """Return charts in rows of a number of `columns`, the last of which may be shorter."""
    return tuple(tuple(charts[k : k + columns]) for k in range(0, len(charts), columns))
