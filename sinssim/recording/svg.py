"""Elements of SVG on a page, the marks of a chart on the scales of its axes, and drawings of blocks, arrows and words.

Attributes have the colours of a light page, so that a drawing can be used elsewhere; `STYLE` overrides them with those
of the page, light or dark.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sinssim.charts import Band, Bars, Cells, Chart, Dots, Histogram, Limit, Line, Remark, Rule, Shares
from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.style import envelope
from sinssim.units import TIME_SCALE

STYLE = """
.grid { stroke: var(--hair); } .axis { stroke: var(--soft); } svg text { fill: var(--ink); }
svg .soft text, svg text.soft { fill: var(--soft); } .mark { stroke: var(--soft); }
svg text.over { stroke: var(--paper); stroke-width: 3px; paint-order: stroke; }
svg .block { fill: var(--paper); } .line { stroke: var(--soft); } svg .head { fill: var(--soft); }
"""

_TEXT, _HAIR = style.TEXT / style.POINTS_PER_PIXEL, style.HAIR / style.POINTS_PER_PIXEL


_BLANKS = re.compile(r"[ \t\r\n\f\v]+")


def words(text: str) -> str:
    """Return a text as HTML with runs of white space reduced to single blanks; a blank that does not break stays."""
    return html.escape(_BLANKS.sub(" ", text).strip(" "))


def element(width: float, height: float, about: str, body: str, more: str = "") -> str:
    """Return a drawing of a width and a height in px, described `about` for readers who cannot see it, with `more`
    attributes."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" '
        f'height="{height:g}" role="img" aria-label="{html.escape(about)}" font-family="{style.FONTS}" '
        f'font-size="{_TEXT:g}"{more}>{body}</svg>'
    )


def text(x: float, y: float, words: str, anchor: str = "start", kind: str = "", more: str = "") -> str:
    """Return a line of text whose "start", "middle" or "end" (the anchor) is at a place of its baseline, px."""
    fill = style.SOFT if "soft" in kind else style.INK
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{fill}"'
        f"{f' class={chr(34)}{kind}{chr(34)}' if kind else ''}{f' {more}' if more else ''}>{html.escape(words)}</text>"
    )


def points(x: Array, y: Array) -> str:
    """Return coordinates in the form of a polyline, to a tenth of a pixel, without repetitions: "x,y x,y …". `x`, `y`:
    (N,) px."""
    rounded = np.round(10.0 * np.column_stack((x, y)))
    new = np.concatenate(([True], (np.diff(rounded, axis=0) != 0.0).any(axis=1)))
    return " ".join([f"{a / 10:g},{b / 10:g}" for a, b in rounded[new].tolist()])


def path(x: Array, y: Array, color: str, width: float, dashes: str = "") -> str:
    """Return a line of a width in px through points (N,) px; its dashes are lengths of dashes and gaps, "" for a solid
    line."""
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<polyline points="{points(x, y)}" fill="none" stroke="{color}" stroke-width="{width:.3g}" '
        f'stroke-linejoin="round"{dashed}/>'
    )


def dots(x: Array, y: Array, color: str, size: float) -> str:
    """Return dots. `x`, `y`: (N,) px; `size`: their diameter, px."""
    places = np.unique(np.round(2.0 * np.column_stack((x, y))), axis=0) / 2.0
    strokes = "".join([f"M{a:g} {b:g}h0" for a, b in places.tolist()])
    return f'<path d="{strokes}" fill="none" stroke="{color}" stroke-width="{size:.3g}" stroke-linecap="round"/>'


def segments(x1: Sequence[float], y1: Sequence[float], x2: Sequence[float], y2: Sequence[float], kind: str) -> str:
    """Return straight line segments of one kind. `x1`, `y1`, `x2`, `y2`: their ends, px; `kind`: "grid", "axis" or
    "mark"."""
    color = style.GRID if kind == "grid" else style.SOFT
    strokes = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for a, b, c, d in zip(x1, y1, x2, y2, strict=True))
    return (
        f'<path class="{kind}" d="{strokes}" fill="none" stroke="{color}" stroke-width="{_HAIR:g}"/>' if strokes else ""
    )


Point = tuple[float, float]

_SUBSCRIPT = re.compile(r"\{(.*?)\}")
_ROW = 15.0  # px between lines of text
_OUTLINE, _STROKE, _HEAD = 1.8, 1.4, 9.0  # widths of an outline and of an arrow, length of its head, px
_ABOVE, _ASIDE = 13.0, 8.0  # from a line to the words above or beside it, px


class Block(NamedTuple):
    """A block of a drawing: its centre, and half of its width and of its height, px."""

    x: float
    y: float
    w: float
    h: float

    @property
    def left(self) -> Point:
        """Middle of the left edge."""
        return self.x - self.w, self.y

    @property
    def right(self) -> Point:
        """Middle of the right edge."""
        return self.x + self.w, self.y

    @property
    def top(self) -> Point:
        """Middle of the upper edge."""
        return self.x, self.y - self.h

    @property
    def bottom(self) -> Point:
        """Middle of the lower edge."""
        return self.x, self.y + self.h


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
        """Write words, whose braces hold a subscript, about a point at the middle of the line's height, px, in a CSS
        colour, "" for that of the page's text."""
        inside = _SUBSCRIPT.sub(
            r'<tspan dy="3" font-size="9.5">\1</tspan><tspan dy="-3">&#8203;</tspan>', html.escape(words)
        )
        fill = f' style="fill:{color}"' if color else f' fill="{style.SOFT if soft else style.INK}"'
        kind = ' class="soft over"' if soft else ' class="over"'
        self._body.append(f'<text x="{x:.1f}" y="{y + 4.2:.1f}" text-anchor="{anchor}"{kind}{fill}>{inside}</text>')

    def box(self, x: float, y: float, width: float, lines: Sequence[str], color: str) -> Block:
        """Draw a block with its centre at a point, and return it. `x`, `y`: the point, px; `width`: px; the height
        follows from the lines."""
        height = _ROW * len(lines) + 14.0
        self._body.append(
            f'<rect x="{x - 0.5 * width:.1f}" y="{y - 0.5 * height:.1f}" width="{width:.1f}" height="{height:.1f}" '
            f'rx="6" class="block" fill="#fff" stroke="{color}" stroke-width="{_OUTLINE}"/>'
        )
        for number, line in enumerate(lines):
            self.text(x, y + _ROW * (number - 0.5 * (len(lines) - 1)), line)
        return Block(x, y, 0.5 * width, 0.5 * height)

    def circle(self, x: float, y: float, radius: float, color: str, sign: str = "") -> Block:
        """Draw a circle with a sign in it, and return it."""
        self._body.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" class="block" fill="#fff" stroke="{color}" '
            f'stroke-width="{_STROKE}"/>'
        )
        if sign:
            self.text(x, y, sign)
        return Block(x, y, radius, radius)

    def line(
        self, points: Sequence[Point], color: str = "", words: str = "", *, head: bool = True, dashes: str = "",
        width: float = _STROKE,
    ) -> None:  # fmt: skip
        """Draw a line through points, px, in a CSS colour, "" for that of axes, perhaps with an arrow's head at its end
        and with SVG's pattern of dashes. Its words stand at the middle of its first part, above a level one, to the
        right of an upright one."""
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
            self._body.append(f'<polygon points="{corners}" fill="{shown}"{kind.replace("line", "head")}/>')
        if words:
            (x, y), (next_x, next_y) = points[:2]
            level = y == next_y
            place = (0.5 * (x + next_x), y - _ABOVE) if level else (x + _ASIDE, 0.5 * (y + next_y))
            self.text(*place, words, color, "middle" if level else "start")

    def arc(
        self, centre: Point, radius: float, first: float, last: float, color: str = "", *, flat: float = 1.0
    ) -> None:
        """Draw an arc about a point, px, between two directions, counter-clockwise from the right, rad, in a CSS
        colour, "" for that of axes. Of an ellipse, the radius is the half axis to the right, `flat` the upright one
        over it, and the directions are the angles of its parameter."""
        turn = np.linspace(first, last, 2 + int(abs(last - first) * 20.0))
        x, y = centre[0] + radius * np.cos(turn), centre[1] - flat * radius * np.sin(turn)
        self.line(list(zip(x.tolist(), y.tolist(), strict=True)), color, head=False)

    def svg(self) -> str:
        """Return the drawing as an SVG element."""
        return element(self.width, self.height, self.about, "".join(self._body))


WIDTHS = {"broad": 8.0, "wide": 4.5, "bold": 2.4, "line": 1.5, "thin": 1.07, "hair": 1.0}
DASHES = {"": "", "--": "6 4", ":": "1.5 3", "-.": "7 3 1.5 3"}
MOST_DOTS = 1500
"""Approximate number of dots of a mark that are drawn."""
_MANY = 50
"""Pieces of a line, such as coasts, from which they are one element."""
_SHAPES = {"s": "M-3-3h6v6h-6z", "^": "M0-4l4 7h-8z", "D": "M0-4l4 4l-4 4l-4-4z", "v": "M0 4l4-7h-8z",
           "P": "M-1.5-4h3v2.5h2.5v3h-2.5v2.5h-3v-2.5h-2.5v-3h2.5z", "*": "M0-5l1.4 3.4 3.6.3-2.8 2.3.9 3.6-3.1-2-3.1 "
           "2 .9-3.6-2.8-2.3 3.6-.3z"}  # fmt: skip


@dataclass(frozen=True)
class PixelScale:
    """A scale: from values in SI to pixels."""

    low: float
    high: float
    start: float
    end: float
    log: bool

    def __call__(self, values: Any) -> Any:
        v, low, high = np.asarray(values, dtype=np.float64), self.low, self.high
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                v, low, high = np.log(np.maximum(v, 1e-300)), np.log(low), np.log(high)
        return self.start + (v - low) * (self.end - self.start) / (high - low)


def marks_of(chart: Chart, x: PixelScale, y: PixelScale) -> tuple[list[str], list[str]]:
    """Return the marks of a chart, and words that lie over them."""
    body: list[str] = []
    over: list[str] = []
    for mark, color in zip(chart.marks, style.of_marks(chart.marks), strict=True):
        match mark:
            case Line():
                body += _line(mark, style.css_of(color), x, y, timed=chart.x.units is TIME_SCALE)
            case Band():
                body.append(_area(x(mark.x), y(mark.low), y(mark.high), style.css_of(color), 0.25))
            case Dots():
                if len(mark.error):
                    left, right, level = x(mark.x[:] - mark.error), x(mark.x[:] + mark.error), y(mark.y[:])
                    body.append(segments(left, level, right, level, "mark"))
                several = not style.is_one(color)
                some = slice(None, None, max(1, len(mark.x) // MOST_DOTS))
                px, py = x(mark.x[some]), y(mark.y[some])
                paints = [style.css_of(shade) for shade in (color[some] if several else [color] * len(px))]
                body.append(shapes_of(px, py, paints, mark.marker, mark.size / 0.75))
            case Bars():
                drawn, named = _bars(mark, color, x, y)
                body += drawn
                over += named
            case Shares():
                sums = np.vstack((np.zeros(len(mark.x)), np.cumsum(mark.parts, axis=0)))
                body += [
                    _area(x(mark.x), y(low), y(high), style.css_of(shade), 1.0)
                    for low, high, shade in zip(sums[:-1], sums[1:], mark.colors, strict=True)
                ]
            case Histogram():
                edges, counts = mark.counted
                fill = style.css_of(color)
                body += [
                    _box(float(x(a)), float(y(0.0)), float(x(b)) - 1.0, float(y(n)), fill)
                    for a, b, n in zip(edges[:-1], edges[1:], counts, strict=True)
                ]
            case Rule():
                body += _rule(mark, style.css_of(color), x, y)
                if mark.text and not mark.upright:
                    over.append(text(x.end - 4.0, float(y(mark.at)) - 3.0, mark.text, "end", "soft"))
            case Cells():
                over += _cells(mark, x, y)
            case Limit():
                body += _limit(mark, chart.most, x, y)
            case Remark():
                over.append(_remark(mark, float(x(mark.x)), float(y(mark.y))))
    return body, over


def _line(mark: Line, color: str, x: PixelScale, y: PixelScale, *, timed: bool) -> Iterator[str]:
    """Yield the pieces of a line between its gaps and jumps; of one over time, what its columns of pixels show."""
    parts = list(pieces(mark))
    if len(parts) > _MANY and not mark.marker:
        strokes = "".join(f"M{points(np.asarray(x(at)), np.asarray(y(values)))}" for at, values in parts)
        look = f'stroke="{color}" stroke-width="{WIDTHS[mark.weight]:.3g}"'
        dashed = f' stroke-dasharray="{DASHES[mark.dash]}"' if mark.dash else ""
        yield f'<path d="{strokes}" fill="none" {look} stroke-linejoin="round"{dashed}/>'
        return
    for at, values in parts:
        columns = max(2, round(abs(float(x(at[-1]) - x(at[0])))))
        long = not (x.log or mark.marker) and len(at) > 2 * columns
        rising = timed or bool(np.all(np.diff(at) > 0.0))
        if long and rising:
            at, values = envelope(at, values, float(at[0]), float(at[-1]) + 1e-9, columns)
        elif not (rising or mark.marker):  # a track: no points within a pixel and a half of the way
            way = np.concatenate(([0.0], np.hypot(np.diff(x(at)), np.diff(y(values))).cumsum()))
            seen = np.concatenate(([True], np.diff(np.floor(way / 1.5)) > 0))
            seen[-1:] = True
            at, values = at[seen], values[seen]
        px, py = np.asarray(x(at)), np.asarray(y(values))
        if not mark.marker:
            px, py = _settled(px, py)
        yield path(px, py, color, WIDTHS[mark.weight], DASHES[mark.dash])
        if mark.marker:
            fill = "hollow" if mark.hollow else color
            yield shapes_of(px, py, [fill] * len(at), mark.marker, 6.0, edge=color)


def pieces(mark: Line) -> Iterator[tuple[Array, Array]]:
    """Yield the parts of a line between gaps and jumps."""
    whole = len(mark.x) > 0 and bool(np.isfinite(mark.x[[0, -1]]).all() and np.isfinite(mark.y.sum()))
    if whole and not mark.turn:
        yield mark.x, mark.y
        return
    there = np.isfinite(mark.x) & np.isfinite(mark.y)
    cuts = np.flatnonzero(~there)
    if mark.turn:
        with np.errstate(invalid="ignore"):
            cuts = np.union1d(cuts, np.flatnonzero(np.abs(np.diff(mark.y)) > 0.5 * mark.turn) + 1)
    for rows in np.split(np.arange(len(mark.x)), cuts):
        rows = rows[there[rows]]
        if len(rows):
            yield mark.x[rows], mark.y[rows]


def _settled(x: Array, y: Array) -> tuple[Array, Array]:
    """Replace a column's least and greatest value by their mean where they lie within a pixel."""
    pairs = len(x) // 2
    if pairs < 100 or len(x) % 2:
        return x, y
    left, right, low, high = x[0::2], x[1::2], y[0::2], y[1::2]
    smooth = (np.abs(high - low) < 1.0) & (right - left < 1.5)
    middle = 0.5 * (low + high)
    low, high = np.where(smooth, middle, low), np.where(smooth, middle, high)
    keep = np.column_stack((np.ones(pairs, bool), ~smooth)).ravel()
    keep[-1] = True
    return np.column_stack((left, right)).ravel()[keep], np.column_stack((low, high)).ravel()[keep]


def shapes_of(x: Array, y: Array, colors: Sequence[str], marker: str, size: float, edge: str = "") -> str:
    """Return marks on points."""
    if marker in ("", "o", ".") and len(set(colors)) == 1 and "hollow" not in colors:
        return dots(x, y, colors[0], size)
    drawn = []
    for a, b, color in zip(x, y, colors, strict=True):
        if not (np.isfinite(a) and np.isfinite(b)):
            continue
        stroke = f' stroke="{edge}" stroke-width="1.2"' if edge else ""
        fill = 'class="block" fill="#fff"' if color == "hollow" else f'fill="{color}"'
        if marker in _SHAPES:
            drawn.append(f'<path d="{_SHAPES[marker]}" transform="translate({a:.1f} {b:.1f})" {fill}{stroke}/>')
        else:
            drawn.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{0.5 * size:.1f}" {fill}{stroke}/>')
    return "".join(drawn)


def _remark(mark: Remark, x: float, y: float) -> str:
    aside, up = (3.0, 3.0) if mark.soft else (7.0, 6.0)
    size = 'font-size="10"' if mark.soft else ""
    place = (x - aside if mark.left else x + aside, y + 15.0 if mark.below else y - up)
    return text(*place, mark.text, "end" if mark.left else "start", "soft over" if mark.soft else "over", size)


def _area(x: Any, low: Any, high: Any, color: str, opacity: float) -> str:
    there = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    if there.sum() < 2:
        return ""
    keep = np.flatnonzero(there)
    keep = keep[np.unique(np.linspace(0, len(keep) - 1, min(len(keep), 1200)).astype(np.intp))]
    around = points(np.concatenate((x[keep], x[keep][::-1])), np.concatenate((low[keep], high[keep][::-1])))
    return f'<polygon points="{around}" fill="{color}" fill-opacity="{opacity:g}"/>'


def _box(x1: float, y1: float, x2: float, y2: float, color: str) -> str:
    return (
        f'<rect x="{min(x1, x2):.1f}" y="{min(y1, y2):.1f}" width="{abs(x2 - x1):.1f}" height="{abs(y2 - y1):.1f}" '
        f'fill="{color}"/>'
    )


def _bars(mark: Bars, color: Any, x: PixelScale, y: PixelScale) -> tuple[list[str], list[str]]:
    """Return bars, and the texts at their ends."""
    several = not style.is_one(color)
    paints = [style.css_of(shade) for shade in color] if several else [style.css_of(color)] * len(mark.values)
    along, places = (x, y) if mark.across else (y, x)
    foot = along.start if along.log else float(along(0.0))
    body, over = [], []
    tops = np.fmax(mark.values, mark.high) if len(mark.high) else mark.values
    for number, (place, value, paint) in enumerate(zip(mark.places, mark.values, paints, strict=True)):
        if not np.isfinite(value):
            continue
        a, b = float(places(place - 0.5 * mark.width)), float(places(place + 0.5 * mark.width))
        tip, end = float(along(value)), float(along(max(float(tops[number]), 0.0)))
        middle = 0.5 * (a + b)
        body.append(_box(foot, a, tip, b, paint) if mark.across else _box(a, foot, b, tip, paint))
        if len(mark.low) and np.isfinite(mark.low[number]) and np.isfinite(mark.high[number]):
            ends = [float(along(mark.low[number])), float(along(mark.high[number]))]
            across = ([ends[0]], [middle], [ends[1]], [middle]), ([middle], [ends[0]], [middle], [ends[1]])
            body.append(segments(*across[0 if mark.across else 1], "mark"))
        if number < len(mark.texts):
            over.append(
                text(end + 5.0, middle + 4.0, mark.texts[number])
                if mark.across else text(middle, end - 5.0, mark.texts[number], "middle")
            )  # fmt: skip
    return body, over


def _cells(mark: Cells, x: PixelScale, y: PixelScale) -> Iterator[str]:
    for (i, k), fraction in np.ndenumerate(mark.shades):
        fill, ink = style.shade(float(fraction))
        left, right, top, bottom = (float(v) for v in (x(k - 0.5), x(k + 0.5), y(i - 0.5), y(i + 0.5)))
        yield _box(left + 1.0, top + 1.0, right - 1.0, bottom - 1.0, fill)
        if mark.framed[i, k]:
            frame = f' fill-opacity="0" stroke="{style.css_of("truth")}" stroke-width="2"/>'
            yield _box(left + 3.0, top + 3.0, right - 3.0, bottom - 3.0, fill).replace("/>", frame)
        middle = text(0.5 * (left + right), 0.5 * (top + bottom) + 4.0, mark.texts[i][k], "middle")
        yield middle.replace("<text", f'<text style="fill:{ink}"', 1)


def _rule(mark: Rule, color: str, x: PixelScale, y: PixelScale) -> Iterator[str]:
    way, other = (x, y) if mark.upright else (y, x)
    if mark.low is not None and mark.high is not None:
        least, most = sorted((way.start, way.end))
        a, b = (min(max(float(way(end)), least), most) for end in (mark.low, mark.high))
        box = (a, other.start, b, other.end) if mark.upright else (other.start, a, other.end, b)
        yield _box(*box, color).replace("/>", ' fill-opacity="0.25"/>')
    at = np.full(2, float(way(mark.at)))
    ends = np.array([other.start, other.end])
    across, along = (at, ends) if mark.upright else (ends, at)
    yield path(across, along, color, WIDTHS[mark.weight], DASHES[mark.dash])


def _limit(mark: Limit, most: float, x: PixelScale, y: PixelScale) -> Iterator[str]:
    if mark.is_far(most):
        return
    color, height = style.css_of(mark.color), float(y(mark.height))
    if mark.at is None:
        yield path(np.array([x.start, x.end]), np.full(2, height), color, 1.1, DASHES["--"])
    else:
        yield shapes_of(np.array([float(x(mark.at))]), np.array([height - 3.0]), [color], "v", 8.0)
