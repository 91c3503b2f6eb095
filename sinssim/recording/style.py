"""Style of everything that is drawn: colours, fonts, line widths, ticks, and thinning of rows.

It is that of the figures, the plots of the reports, and the recordings. Thinning loses no peaks.

The colours are Okabe and Ito's set for all kinds of colour vision ("Color universal design", 2008), without black and
without its yellow, so that every line is legible on a dark and on a light background.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.charts import Chart, Charts, Color, Line, Mark
from sinssim.data import Array
from sinssim.exhibits import Beside, Item, Section
from sinssim.strapdown.attitude import ORDER, family
from sinssim.units import time_unit

Rgb = tuple[int, int, int]

INK, SOFT, FAINT, GRID = "#1c1c1c", "#555555", "#cccccc", "#e4e4e4"
"""CSS colours on a light background: titles and legends; axes, their numbers and labels; meridians; the grid."""
ON_DARK, ON_LIGHT = "#fefefe", "#1d1d1d"
"""Numbers on cells of a map, which keep their colours on a dark page; other than white and `INK`, which do not."""
PALE = "#f3f8fc"
"""The lightest shade of a map of numbers."""
FRAME = 1.6
"""Width of the line around a marked cell of a map, points."""
FONTS = "Liberation Sans, Arial, sans-serif"
"""Font families of text in SVG, in order of preference; pictures use matplotlib's own sans-serif."""
TEXT, SMALL = 9.0, 8.25
"""Size of text, and of remarks within a plot, pt."""
LINE, THIN, HAIR = 1.125, 0.8, 0.75
"""Width of a line, of a reference line, and of the grid and the axes, pt."""
POINTS_PER_PIXEL = 0.75
"""Size of a point, 1/72 inch, in CSS pixels of 1/96 inch."""


COLORS: dict[str, Rgb] = {
    # attitude algorithms, by family
    "quaternion": (86, 180, 233),
    "poisson": (230, 159, 0),
    "euler": (204, 121, 167),
    "two-quaternions": (0, 158, 115),
    "rotation-vector": (120, 100, 200),
    "functional-iteration": (213, 94, 0),
    "measured-attitude": (0, 114, 178),
    "platform": (213, 94, 0),
    # source of a quantity
    "truth": (0, 158, 115),
    "ideal": (0, 158, 115),
    "measured": (213, 94, 0),
    # a flight by its navigator: the three paths, the corridor, the three errors
    "planned": (120, 100, 200),
    "corridor": (213, 94, 0),
    "tse": (0, 158, 115),
    "nse": (86, 180, 233),
    "fte": (120, 100, 200),
    # estimates of a filter
    "aided": (0, 114, 178),
    "smoothed": (204, 121, 167),
    "backward": (213, 94, 0),
    "bound": (150, 150, 150),
    "refused": (225, 30, 110),
    # aiding sensors, and the blocks of a filter's states
    "gnss-position": (0, 158, 115),
    "gnss-velocity": (213, 94, 0),
    "baro": (160, 160, 60),
    "magnetometer": (220, 150, 185),
    "airspeed": (110, 180, 190),
    "odometer": (230, 159, 0),
    "zero-velocity": (204, 121, 167),
    "zero-rate": (120, 100, 200),
    "star-tracker": (86, 180, 233),
    "dual-antenna": (200, 150, 60),
    "land-vehicle": (140, 130, 110),
    "master-velocity": (190, 100, 40),
    "master-attitude": (70, 150, 200),
    "position": (0, 158, 115),
    "velocity": (213, 94, 0),
    "attitude": (0, 114, 178),
    "gyro bias": (230, 159, 0),
    "gyro scale": (204, 121, 167),
    "gyro misalignment": (205, 180, 80),
    "gyro instability": (161, 111, 0),
    "accelerometer bias": (120, 100, 200),
    "accelerometer scale": (86, 180, 233),
    "accelerometer misalignment": (102, 197, 171),
    "accelerometer instability": (95, 80, 165),
    "gyro g-sensitivity": (185, 95, 45),
    "gyro asymmetry": (220, 140, 110),
    "gyro quadratic": (175, 75, 120),
    "gyro cubic": (225, 165, 195),
    "accelerometer asymmetry": (60, 120, 120),
    "accelerometer quadratic": (45, 95, 150),
    "accelerometer cubic": (150, 165, 215),
    "accelerometer cross-axis": (95, 140, 90),
    "gyro flicker": (165, 130, 25),
    "accelerometer flicker": (35, 135, 170),
    "gravity disturbance": (160, 60, 90),
    "gnss lever arm": (150, 120, 90),
    "gnss time offset": (110, 90, 70),
    # axes: of the body, and of the local level
    "x": (213, 94, 0),
    "y": (0, 158, 115),
    "z": (86, 180, 233),
    "north": (213, 94, 0),
    "east": (0, 158, 115),
    "down": (86, 180, 233),
    # angles of an alignment
    "heading": (0, 114, 178),
    "roll": (230, 159, 0),
    "pitch": (204, 121, 167),
    "latitude": (0, 158, 115),
    # noise terms of a sensor, and their sum
    "Q": (120, 100, 200),
    "N": (0, 158, 115),
    "B": (230, 159, 0),
    "K": (204, 121, 167),
    "R": (0, 114, 178),
    "sigma_b": (86, 180, 233),
    "fit": (90, 90, 90),
    # ensembles
    "cep": (0, 158, 115),
    "r95": (0, 114, 178),
    "run": (150, 150, 150),
    "limit": (213, 94, 0),
    # others
    "reference": (140, 140, 140),
    "ground": (120, 120, 120),
    "vehicle": (200, 204, 210),
}

_OTHERS: tuple[Rgb, ...] = (
    (0, 158, 115), (213, 94, 0), (0, 114, 178), (160, 160, 60), (120, 100, 200), (204, 121, 167), (86, 180, 233),
    (230, 159, 0),
)  # fmt: skip


_ROUNDS = (0.0, 0.4, -0.3)
"""Shades of the other colours once they are used up: towards white, then towards black."""

_SHADES = {"1": 0.4, "1p": 0.25, "2": 0.12, "3": -0.18, "4": -0.36}
"""Shade towards white (positive) or black by an algorithm's order or number of samples."""


_OF_SENSORS = {
    "bias": 0.15,
    "scale": -0.25,
    "deviation": -0.3,
    "wind": -0.3,
    "delay": 0.3,
    "mounting": -0.3,
    "slip": 0.3,
}
"""The same for the errors of an aiding sensor."""

_DARKEST, _LIGHTER = -0.5, 0.1
"""The shade of a process of flicker noise, slower ones lighter."""


def _known(name: str) -> Rgb | None:
    """Return the table's colour, shaded by an algorithm's order, an aiding sensor's error or a process of flicker."""
    sensor, _, of_sensor = name.rpartition(" ")
    if sensor in COLORS and of_sensor.isdecimal():
        return _shaded(COLORS[sensor], _DARKEST + _LIGHTER * int(of_sensor))
    if name not in COLORS and of_sensor in _OF_SENSORS and sensor in COLORS:
        return _shaded(COLORS[sensor], _OF_SENSORS[of_sensor])
    order = ORDER.search(name)
    if name in COLORS or order is None or family(name) not in COLORS:
        return COLORS.get(name)
    return _shaded(COLORS[family(name)], _SHADES.get(order[1], 0.0))


def _shaded(color: Rgb, shade: float) -> Rgb:
    """Return a colour nearer to white (positive) or to black."""
    r, g, b = (round(c + shade * (255 - c if shade > 0.0 else c)) for c in color)
    return (r, g, b)


def _other(place: int) -> Rgb:
    """Return the colour of a name that is not in the table, by its position among such names."""
    turn, number = divmod(place, len(_OTHERS))
    return _shaded(_OTHERS[number], _ROUNDS[turn % len(_ROUNDS)])


def others(count: int) -> list[Rgb]:
    """Return the first colours of names that the table does not have."""
    return [_other(place) for place in range(count)]


def colors(names: Sequence[str]) -> list[Rgb]:
    """Return one colour per name, red, green, blue of 0…255: the table's colour or, for a name not in the table, the
    next free one."""
    others = [name for name in names if _known(name) is None]
    return [_known(n) or _other(others.index(n)) for n in names]


def stacked_widths(count: int) -> list[float]:
    """Return line widths in points for lines that may coincide: each is thinner than the one under it."""
    return [1.5 * 1.8 ** (count - 1 - i) for i in range(count)] if count <= 3 else [1.5] * count


def css(color: tuple[int, int, int]) -> str:
    """Return a colour, red, green, blue of 0…255 each, in CSS notation: "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def is_one(color: Color | Sequence[Color]) -> bool:
    """Return whether a colour is one for all marks, and not one for each."""
    return isinstance(color, str) or isinstance(color[0], int)


def css_of(color: Color) -> str:
    """Return a colour of a chart in CSS notation. `color`: a name of the table, one of the colours of text ("ink",
    "soft", "grid"), "#rrggbb", or red, green, blue."""
    if not isinstance(color, str):
        return css(color)
    return color if color.startswith("#") else _TEXTS.get(color) or css(colors([color])[0])


def rgb_of(color: Color) -> Rgb:
    """Return a colour of a chart as red, green and blue. `color`: see `css_of`."""
    text = css_of(color)
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


_TEXTS = {"ink": INK, "soft": SOFT, "faint": FAINT, "grid": GRID}


def of_marks(marks: Sequence[Mark]) -> list[Any]:
    """Return the colours of marks, each that of its label if it has no own."""
    free = [mark.label for mark in marks if not getattr(mark, "color", "x")]  # type: ignore[union-attr]
    by_label = dict(zip(free, map(css, colors(free)), strict=True))
    return [getattr(mark, "color", "") or by_label.get(getattr(mark, "label", ""), SOFT) for mark in marks]


def shade(fraction: float) -> tuple[str, str]:
    """Return the colour of a cell of a map, and of the number in it. `fraction`: from 0, the palest, to 1; NaN for a
    cell without a value."""
    if math.isnan(fraction):
        return GRID, ON_LIGHT
    pale, deep = rgb_of(PALE), COLORS["r95"]
    r, g, b = (round(p + fraction * (d - p)) for p, d in zip(pale, deep, strict=True))
    return css((r, g, b)), ON_DARK if fraction > _DARK else ON_LIGHT


_DARK = 0.55
"""Shade beyond which numbers are white."""


def tint(color: Rgb) -> Rgb:
    """Return a paler shade of a colour, for the wide line under a thin one."""
    r, g, b = ((2 * c + 3 * 150) // 5 for c in color)
    return (r, g, b)


RowNumbers = NDArray[np.intp]
_PLOT_ROWS = 16384


def envelope(time: Array, values: Array, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Thin a line, (N,) at times in order, s, to the least and the greatest value in each column of pixels of a span of
    time, in order of time; all extremes are kept."""
    if len(time) <= 2 * columns:
        return time, values
    first = np.unique(np.searchsorted(time, np.linspace(start, end, columns + 1)[:-1]))
    first = first[first < len(time)]
    last = np.append(first[1:], len(time)) - 1
    low, high = np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
    rising = values[last] >= values[first]
    return (
        np.column_stack((time[first], time[last])).ravel(),
        np.column_stack((np.where(rising, low, high), np.where(rising, high, low))).ravel(),
    )


FINEST = 4096
"""Columns in which a line of a page keeps its extremes, for zooming: four for each pixel of the whole."""


def as_seen(items: Iterable[Item]) -> list[Item]:
    """Return exhibits whose lines have as many points as a page shows, so that long runs can free their samples."""
    seen: list[Item] = []
    for item in items:
        if isinstance(item, Charts):
            rows = tuple(tuple(_chart_as_seen(chart) for chart in row) for row in item.rows)
            seen += [replace(item, rows=rows)] if "page" in item.on else []
        elif isinstance(item, Section | Beside):
            seen.append(replace(item, items=as_seen(item.items)))
        else:
            seen.append(item)
    return seen


def _chart_as_seen(chart: Chart) -> Chart:
    return replace(chart, marks=tuple(_line_as_seen(m) if isinstance(m, Line) else m for m in chart.marks))


def _line_as_seen(line: Line) -> Line:
    if len(line.x) <= 2 * FINEST or not np.isfinite(line.y.sum()) or (np.diff(line.x) < 0.0).any():
        return replace(line, x=line.x.copy(), y=line.y.copy())
    x, y = envelope(line.x, line.y, float(line.x[0]), float(line.x[-1]) + 1e-9, FINEST)
    return replace(line, x=x, y=y, step=float(line.x[-1] - line.x[0]) / FINEST)


def gaps(angles: Array, turn: float) -> Array:
    """Return angles (N,) with a gap, NaN at the last one before it, where they jump by a whole turn, so that no line
    crosses the plot."""
    jump = np.abs(np.diff(angles)) > 0.5 * turn
    return np.where(np.concatenate((jump, [False])), np.nan, angles)


def ticks(low: float, high: float, count: int, steps: Sequence[float] = (1.0, 2.0, 5.0)) -> tuple[Array, float]:
    """Return round numbers within a range. `steps`: allowed steps between them, up to a power of ten; in rising order,
    from 1 to under 10."""
    least = (high - low) / count
    power = 10.0 ** np.floor(np.log10(least))
    step = float(next(s for s in (*(s * power for s in steps), 10.0 * power) if s >= least * (1.0 - 1e-9)))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1.0), step


def tick_label(value: float, step: float) -> str:
    """Write a tick's number, such as "0.25", with the digits that distinguish it from its neighbours and a true minus
    sign."""
    value = 0.0 if abs(value) < 1e-6 * step else value
    if max(abs(value), step) >= 1e6 or step < 1e-4:
        return f"{value:.3g}".replace("-", "−")
    places = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    return f"{value:.{places}f}".replace("-", "−")


def time_ticks(start: float, end: float) -> tuple[Array, float, str, float]:
    """Return round times: the times in their unit, the step between them, the unit's name and its size in s. `start`,
    `end`: the range, s."""
    unit, size = time_unit(end - start)
    at, step = ticks(start / size, end / size, 9, (1.0, 2.0, 5.0) if unit == "h" else (1.0, 2.0, 3.0, 5.0))
    return at, step, unit, size


def thinned(count: int, most: int = _PLOT_ROWS) -> RowNumbers:
    """Return the rows of a stream to be drawn."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def log_numbers(low: float, high: float) -> Array:
    """Return the numbers that a logarithmic axis between two positive ends shows: at most about ten round ones, powers
    of ten over more than two and a half of them."""
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    steps = (1.0, 2.0, 3.0, 5.0, 7.0) if high < 10.0 * low else (1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)
    at = np.array([decade * step for decade in decades for step in steps])
    at = at[(at >= low * 0.999) & (at <= high * 1.001)]
    return at[:: -(-len(at) // 10)] if steps == (1.0,) and len(at) else at
