"""Colours, fonts and line widths of everything that is drawn: figures, plots of the reports, recordings.

The colours are Okabe and Ito's set for all kinds of colour vision ("Color universal design", 2008), without black
and without its yellow, so that every line is legible on a dark and on a light background.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sinssim.algorithms import ORDER, family
from sinssim.charts import Color, Mark

Rgb = tuple[int, int, int]

INK, SOFT, GRID = "#1c1c1c", "#555555", "#e4e4e4"
"""CSS colours on a light background: titles and legends; the axes, their numbers and labels; the grid."""
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


def _known(name: str) -> Rgb | None:
    """Return the table's colour, shaded by an algorithm's order or by an aiding sensor's error."""
    sensor, _, of_sensor = name.rpartition(" ")
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


def colors(names: Sequence[str]) -> list[Rgb]:
    """Return one colour per name: the table's colour or, for a name not in the table, the next free one.

    Returns:
        Red, green, blue of 0…255 each.
    """
    others = [name for name in names if _known(name) is None]
    return [_known(n) or _other(others.index(n)) for n in names]


def stacked_widths(count: int) -> list[float]:
    """Return line widths for lines that may coincide: each is thinner than the one under it.

    Returns:
        Widths in points, widest first.
    """
    return [1.5 * 1.8 ** (count - 1 - i) for i in range(count)] if count <= 3 else [1.5] * count


def css(color: tuple[int, int, int]) -> str:
    """Return a colour in CSS notation.

    Args:
        color: red, green, blue of 0…255 each.

    Returns:
        "#rrggbb".
    """
    return "#{:02x}{:02x}{:02x}".format(*color)


def css_of(color: Color) -> str:
    """Return a colour of a chart in CSS notation.

    Args:
        color: a name of the table, one of the colours of text ("ink", "soft", "grid"), "#rrggbb", or red, green, blue.
    """
    if not isinstance(color, str):
        return css(color)
    return color if color.startswith("#") else _TEXTS.get(color) or css(colors([color])[0])


def rgb_of(color: Color) -> Rgb:
    """Return a colour of a chart as red, green and blue.

    Args:
        color: see `css_of`.
    """
    text = css_of(color)
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


_TEXTS = {"ink": INK, "soft": SOFT, "grid": GRID}


def of_marks(marks: Sequence[Mark]) -> list[Any]:
    """Return the colours of marks, each that of its label if it has no own."""
    free = [mark.label for mark in marks if not getattr(mark, "color", "x")]  # type: ignore[union-attr]
    by_label = dict(zip(free, map(css, colors(free)), strict=True))
    return [getattr(mark, "color", "") or by_label.get(getattr(mark, "label", ""), SOFT) for mark in marks]


def shade(fraction: float) -> tuple[str, str]:
    """Return the colour of a cell of a map, and of the number in it.

    Args:
        fraction: from 0, the palest, to 1; NaN for a cell without a value.
    """
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
