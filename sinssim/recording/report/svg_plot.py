"""Plots over time, block diagrams and axes as SVG, written directly so that a run's report loads no drawing library.

Every drawing has the colours of a light page in its attributes, so that it can be used elsewhere. On the page, `STYLE`
and `DIAGRAM_STYLE` override them with the page's colours, light or dark.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.style import envelope, tick_label, ticks, time_ticks

STYLE = """
.grid { stroke: var(--hair); } .axis { stroke: var(--soft); } svg text { fill: var(--ink); }
svg .soft text, svg text.soft { fill: var(--soft); } .mark { stroke: var(--soft); }
svg text.over { stroke: var(--paper); stroke-width: 3px; paint-order: stroke; }
"""

_LEFT, _RIGHT, _BOTTOM = 64, 16, 38
_TEXT, _SMALL, _LINE, _HAIR = (
    size / style.POINTS_PER_PIXEL for size in (style.TEXT, style.SMALL, style.LINE, style.HAIR)
)
"""The style's sizes, px."""
_LETTER = 6.4
"""Width of a letter, for laying out legends; px at 12 px."""
_SAME = 0.5
"""Distance up to which lines coincide, px."""
_ENTRY = 56
"""Width of a legend's line and gap, px."""


@dataclass(frozen=True)
class Line:
    """A line in a plot.

    Attributes:
        label: its name in the legend, "" for no entry.
        time: (N,) s, in order.
        values: (N,).
        color: CSS colour.
        width: px.
        dashes: see `path`.
        size: the plot's unit, in the unit of the values.
        turn: full turn by which the values, if they are angles, jump; 0 for others.
        reference: whether it is a reference line, which does not widen the axis.
        dots: diameter of the dots, px; 0 for a line.
    """

    label: str
    time: Array
    values: Array
    color: str
    width: float = _LINE
    dashes: str = ""
    size: float = 1.0
    turn: float = 0.0
    reference: bool = False
    dots: float = 0.0


@dataclass(frozen=True)
class Mark:
    """A vertical line in a plot.

    Attributes:
        time: its place, s.
        text: the text at its top.
        faint: whether the line is thin, for one of many.
    """

    time: float
    text: str
    faint: bool = False


def dashes(count: int) -> list[str]:
    """Return dash patterns that distinguish lines in print and where they coincide.

    Returns:
        Patterns for `path`; all solid if there are more than three lines.
    """
    return ["", "9 9", "4 5"][:count] if count <= 3 else [""] * count


def element(width: float, height: float, about: str, body: str) -> str:
    """Return a drawing.

    Args:
        width, height: px.
        about: description for readers who cannot see the drawing.
    """
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" role="img" aria-label="{html.escape(about)}" font-family="{style.FONTS}" '
        f'font-size="{_TEXT:g}">{body}</svg>'
    )


def text(x: float, y: float, words: str, anchor: str = "start", kind: str = "", more: str = "") -> str:
    """Return a line of text.

    Args:
        x, y: place of its baseline, px.
        anchor: "start", "middle" or "end": the part of the text that is placed there.
    """
    fill = style.SOFT if "soft" in kind else style.INK
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{fill}"'
        f"{f' class={chr(34)}{kind}{chr(34)}' if kind else ''}{f' {more}' if more else ''}>{html.escape(words)}</text>"
    )


def points(x: Array, y: Array) -> str:
    """Return coordinates in the form of a polyline, to a tenth of a pixel, without repetitions.

    Args:
        x, y: (N,) px.

    Returns:
        "x,y x,y …".
    """
    rounded = np.round(10.0 * np.column_stack((x, y)))
    new = np.concatenate(([True], (np.diff(rounded, axis=0) != 0.0).any(axis=1)))
    return " ".join([f"{a / 10:g},{b / 10:g}" for a, b in rounded[new].tolist()])


def path(x: Array, y: Array, color: str, width: float, dashes: str = "") -> str:
    """Return a line.

    Args:
        x, y: (N,) px.
        width: px.
        dashes: lengths of dashes and gaps, "" for a solid line.
    """
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<polyline points="{points(x, y)}" fill="none" stroke="{color}" stroke-width="{width:.3g}" '
        f'stroke-linejoin="round"{dashed}/>'
    )


def dots(x: Array, y: Array, color: str, size: float) -> str:
    """Return dots.

    Args:
        x, y: (N,) px.
        size: their diameter, px.
    """
    places = np.unique(np.round(2.0 * np.column_stack((x, y))), axis=0) / 2.0
    strokes = "".join([f"M{a:g} {b:g}h0" for a, b in places.tolist()])
    return f'<path d="{strokes}" fill="none" stroke="{color}" stroke-width="{size:.3g}" stroke-linecap="round"/>'


def segments(x1: Sequence[float], y1: Sequence[float], x2: Sequence[float], y2: Sequence[float], kind: str) -> str:
    """Return straight line segments of one kind.

    Args:
        x1, y1, x2, y2: their ends, px.
        kind: "grid", "axis" or "mark".
    """
    color = style.GRID if kind == "grid" else style.SOFT
    strokes = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for a, b, c, d in zip(x1, y1, x2, y2, strict=True))
    return (
        f'<path class="{kind}" d="{strokes}" fill="none" stroke="{color}" stroke-width="{_HAIR:g}"/>' if strokes else ""
    )


def plot(
    title: str,
    unit: str,
    lines: Sequence[Line],
    span: tuple[float, float],
    *,
    marks: Sequence[Mark] = (),
    width: int = 560,
    height: int = 190,
    from_zero: bool = False,
    least: float = 0.0,
    axis: tuple[float, float, float] | None = None,
) -> str:
    """Draw lines over time.

    Args:
        span: first and last time of the axis, s.
        width: of the drawing, px.
        height: of the plot without title, legend and labels, px.
        axis: beginning and end of the axis, and the step of its ticks; chosen from the values if not given.
    """
    start, end = span
    lines = [_finite(line) for line in lines]
    inner = width - _LEFT - _RIGHT
    low, high, step = axis or _range([line for line in lines if not line.reference], from_zero, least)
    names, top = legend(_with_coincidences(lines, _SAME * (high - low) / height), width)
    named = [m for m in marks if m.text]
    top += 16 if named else 4
    bottom = top + height
    at = low + step * np.arange(round((high - low) / step) + 1)
    to_x, to_y = inner / (end - start), height / (high - low)

    y_ticks = [bottom - (v - low) * to_y for v in at]
    times, t_step, t_unit, t_size = time_ticks(start, end)
    x_ticks = [_LEFT + (t * t_size - start) * to_x for t in times]
    body = [text(_LEFT, 15, f"{title} [{unit}]" if unit else title, more='font-weight="600"'), names]
    count = len(y_ticks)
    body.append(segments([_LEFT] * count, y_ticks, [_LEFT + inner] * count, y_ticks, "grid"))
    body.append(segments(x_ticks, [top] * len(x_ticks), x_ticks, [bottom] * len(x_ticks), "grid"))
    zero = [bottom + low * to_y] if low < 0.0 < high else []
    body.append(segments([_LEFT, *[_LEFT] * len(zero)], [bottom, *zero], [_LEFT + inner] * (1 + len(zero)),
                         [bottom, *zero], "axis"))  # fmt: skip
    body += [text(_LEFT - 6, y + 4, tick_label(v, step), "end", "soft") for v, y in zip(at, y_ticks, strict=True)]
    body += [text(x, bottom + 15, tick_label(t, t_step), "middle", "soft") for t, x in zip(times, x_ticks, strict=True)]
    body.append(text(_LEFT + inner, bottom + 32, f"time [{t_unit}]", "end", "soft"))
    body += _marks(marks, [_LEFT + (m.time - start) * to_x for m in marks], top, bottom, width - 4.0)
    # An inner element clips the lines at the axes.
    body.append(f'<svg x="{_LEFT}" y="{top}" width="{inner}" height="{height}">')
    body += _curves(lines, span, inner, height, low, to_y)
    body.append("</svg>")
    return element(width, bottom + _BOTTOM, f"{title}, {unit}, over time", "".join(body))


def _curves(
    lines: Sequence[Line], span: tuple[float, float], inner: int, height: int, low: float, to_y: float
) -> Iterator[str]:
    """Draw lines and dots on a plane of given width and height, px, whose lower edge is at the value `low`."""
    start, end = span
    to_x = inner / (end - start)
    for line in lines:
        if line.dots:
            x, y = (line.time - start) * to_x, height - (line.values / line.size - low) * to_y
            yield dots(x, y, line.color, line.dots)
            continue
        for t, v in _pieces(line, start, end, inner):
            x, y = _settle((t - start) * to_x, height - (v / line.size - low) * to_y)
            yield path(x, y, line.color, line.width, line.dashes)


def _finite(line: Line) -> Line:
    """Remove values that are not finite, which an algorithm has after it diverged."""
    if np.isfinite(line.values.sum()):
        return line
    rows = np.isfinite(line.values)
    return replace(line, time=line.time[rows], values=line.values[rows])


def _with_coincidences(lines: Sequence[Line], least: float) -> list[Line]:
    """Return the lines with a word in the names of those that coincide with a former one.

    Args:
        least: the difference from which lines are seen apart, in the plot's unit.
    """
    found: list[Line] = []
    for line in lines:
        same = next((one for one in lines[: len(found)] if one.label and _coincide(one, line, least)), None)
        if same is not None and line.label:
            line = replace(line, label=f"{line.label} (same as {same.label})")
        found.append(line)
    return found


def _coincide(one: Line, other: Line, least: float) -> bool:
    """Return whether two lines lie on each other; lines with other instants are compared between them."""
    if one.dots or other.dots or not len(one.time) or not len(other.time):
        return False
    if abs(float(one.values[-1]) / one.size - float(other.values[-1]) / other.size) > least:
        return False  # the usual case, without a look at every sample
    values = one.values
    if one.time is not other.time and not np.array_equal(one.time, other.time):
        margin = 0.01 * float(one.time[-1] - one.time[0])
        ends = np.abs(one.time[[0, -1]] - other.time[[0, -1]])
        if one.turn or other.turn or ends.max() > margin:
            return False
        values = np.interp(other.time, one.time, one.values)
    if one.size == other.size:
        return bool(np.abs(values - other.values).max() <= least * one.size)
    return bool(np.abs(values / one.size - other.values / other.size).max() <= least)


def legend(lines: Sequence[Line], width: int, top: int = 34) -> tuple[str, int]:
    """Return a legend: the names of the lines, each beside a sample of the line.

    Args:
        width: of the drawing, px.
        top: baseline of the first row, px.

    Returns:
        SVG, and the ordinate of its end, px; empty for a single line.
    """
    lines = [line for line in lines if line.label]
    if len(lines) < 2:
        return "", top - 12
    parts, x, y = [], float(_LEFT), top
    for line in lines:
        long = _ENTRY + _LETTER * len(line.label)
        if x > _LEFT and x + long > width - _RIGHT:
            x, y = float(_LEFT), y + 16
        along = x + np.linspace(0.0, 34.0, 4)
        level = np.full(4, y - 4.0)
        if line.dots:
            parts.append(dots(along, level, line.color, max(line.dots, 3.0)))
        else:
            parts.append(path(along[[0, -1]], level[[0, -1]], line.color, line.width, line.dashes))
        parts.append(text(x + 40, y, line.label, kind="soft"))
        x += long
    return "".join(parts), y + 6


def _marks(marks: Sequence[Mark], places: Sequence[float], top: float, bottom: float, right: float) -> Iterator[str]:
    free = -np.inf
    for mark, x in zip(marks, places, strict=True):
        kind = "grid" if mark.faint else "mark"
        line = segments([x], [top], [x], [bottom], kind)
        yield line if mark.faint else line.replace("<path", '<path stroke-dasharray="2 3"')
        long = 0.92 * _LETTER * len(mark.text)
        left = max(min(x - 0.5 * long, right - long), _LEFT)  # the top label of the axis is beside it
        if left > free:
            yield text(left, top - 4, mark.text, kind="soft", more=f'font-size="{_SMALL:g}"')
            free = left + long + _LETTER  # numbers without a gap would read as one


def _range(lines: Sequence[Line], from_zero: bool, least: float) -> tuple[float, float, float]:
    """Return the beginning and the end of an axis, and the step of its ticks."""
    low = min((float(line.values.min()) / line.size for line in lines if len(line.values)), default=0.0)
    high = max((float(line.values.max()) / line.size for line in lines if len(line.values)), default=0.0)
    low = min(low, 0.0) if from_zero else low
    if high - low <= max(1e-9 * max(abs(low), abs(high)), least):
        # Constant except for rounding: the line lies in the middle or at the bottom.
        low, high = (0.0, 1.0) if from_zero else (low - 0.5, high + 0.5)
    _, step = ticks(low, high, 5)
    first, last = np.floor(low / step + 1e-6), np.ceil(high / step - 1e-6)
    return float(step * first), float(step * last), step


def _pieces(line: Line, start: float, end: float, columns: int) -> Iterator[tuple[Array, Array]]:
    """Split a line where an angle jumps by a turn, and thin the pieces."""
    if not len(line.time):
        return
    cuts = np.flatnonzero(np.abs(np.diff(line.values)) > 0.5 * line.turn) + 1 if line.turn else np.empty(0, np.intp)
    edges = [0, *cuts.tolist(), len(line.time)]
    for a, b in pairwise(edges):
        share = max(2, round(columns * (line.time[b - 1] - line.time[a]) / (end - start)))
        yield envelope(line.time[a:b], line.values[a:b], line.time[a], line.time[b - 1] + 1e-9, share)


def _settle(x: Array, y: Array) -> tuple[Array, Array]:
    """Replace a column's least and greatest value by their mean where they lie within a pixel."""
    pairs = len(x) // 2
    if pairs < 100 or len(x) % 2:
        return x, y
    left, right = x[0::2], x[1::2]
    low, high = y[0::2], y[1::2]
    smooth = (np.abs(high - low) < 1.0) & (right - left < 1.5)
    middle = 0.5 * (low + high)
    low, high = np.where(smooth, middle, low), np.where(smooth, middle, high)
    keep = np.column_stack((np.ones(pairs, bool), ~smooth)).ravel()
    keep[-1] = True
    return np.column_stack((left, right)).ravel()[keep], np.column_stack((low, high)).ravel()[keep]


DIAGRAM_STYLE = ".block { fill: var(--paper); } .line { stroke: var(--soft); }\n"

Point = tuple[float, float]

_SUBSCRIPT = re.compile(r"\{(.*?)\}")
_ROW = 15.0  # px between lines of text
_OUTLINE, _STROKE, _HEAD = 1.8, 1.4, 9.0  # widths of an outline and of an arrow, length of its head, px


class Drawing:
    """A drawing to which blocks, arrows and words are added; px, y downwards.

    Args:
        width, height: px.
        about: description for readers who cannot see it.
    """

    def __init__(self, width: float, height: float, about: str) -> None:
        self.width, self.height, self.about = width, height, about
        self._body: list[str] = []

    def text(self, x: float, y: float, words: str, color: str = "", anchor: str = "middle", soft: bool = False) -> None:
        """Write words about a point.

        Args:
            x, y: middle of the line's height, px.
            words: plain text; braces hold a subscript.
            color: CSS colour; "" for that of the page's text.
            anchor: "start", "middle" or "end".
        """
        inside = _SUBSCRIPT.sub(
            r'<tspan dy="3" font-size="9.5">\1</tspan><tspan dy="-3">&#8203;</tspan>', html.escape(words)
        )
        fill = f' style="fill:{color}"' if color else f' fill="{style.SOFT if soft else style.INK}"'
        kind = ' class="soft over"' if soft else ' class="over"'
        self._body.append(f'<text x="{x:.1f}" y="{y + 4.2:.1f}" text-anchor="{anchor}"{kind}{fill}>{inside}</text>')

    def box(self, x: float, y: float, width: float, lines: Sequence[str], color: str) -> None:
        """Draw a block with its centre at a point.

        Args:
            x, y: the point, px.
            width: px; the height follows from the lines.
        """
        height = _ROW * len(lines) + 14.0
        self._body.append(
            f'<rect x="{x - 0.5 * width:.1f}" y="{y - 0.5 * height:.1f}" width="{width:.1f}" height="{height:.1f}" '
            f'rx="6" class="block" fill="#fff" stroke="{color}" stroke-width="{_OUTLINE}"/>'
        )
        for number, line in enumerate(lines):
            self.text(x, y + _ROW * (number - 0.5 * (len(lines) - 1)), line)

    def circle(self, x: float, y: float, radius: float, color: str, sign: str = "") -> None:
        """Draw a circle with a sign in it."""
        self._body.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" class="block" fill="#fff" stroke="{color}" '
            f'stroke-width="{_STROKE}"/>'
        )
        if sign:
            self.text(x, y, sign)

    def line(
        self, points: Sequence[Point], color: str = "", head: bool = True, dashes: str = "", width: float = _STROKE
    ) -> None:
        """Draw a line through points.

        Args:
            points: px.
            color: CSS colour; "" for that of axes.
            dashes: SVG's pattern; "" for a solid line.
            width: px.
        """
        shown = color or style.SOFT
        kind = "" if color else ' class="line"'
        dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
        end = np.array(points[-1])
        along = end - np.array(points[-2])
        along = along / max(float(np.hypot(*along)), 1e-9)
        drawn = [*points[:-1], tuple(end - 0.7 * _HEAD * along)] if head else points
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn)
        self._body.append(
            f'<polyline points="{path}" fill="none" stroke="{shown}" stroke-width="{width}"{kind}{dashed}/>'
        )
        if head:
            back, side = end - _HEAD * along, 0.4 * _HEAD * np.array([-along[1], along[0]])
            corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in (end, back + side, back - side))
            fill = f'fill="{shown}"' if color else f'fill="{shown}" style="fill:var(--soft)"'
            self._body.append(f'<polygon points="{corners}" {fill}/>')

    def svg(self) -> str:
        """Return the drawing as an SVG element."""
        return element(self.width, self.height, self.about, "".join(self._body))
