"""Elements of SVG on a page, and diagrams of blocks, arrows and words.

Attributes have the colours of a light page, so that a drawing can be used elsewhere; `STYLE` overrides them with those
of the page, light or dark.
"""

from __future__ import annotations

import html
import re
from collections.abc import Sequence

import numpy as np

from sinssim.data import Array
from sinssim.recording import style

STYLE = """
.grid { stroke: var(--hair); } .axis { stroke: var(--soft); } svg text { fill: var(--ink); }
svg .soft text, svg text.soft { fill: var(--soft); } .mark { stroke: var(--soft); }
svg text.over { stroke: var(--paper); stroke-width: 3px; paint-order: stroke; }
svg .block { fill: var(--paper); } .line { stroke: var(--soft); }
"""

_TEXT, _HAIR = style.TEXT / style.POINTS_PER_PIXEL, style.HAIR / style.POINTS_PER_PIXEL


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
    """Return coordinates in the form of a polyline, to a tenth of a pixel, without repetitions: "x,y x,y …".

    Args:
        x, y: (N,) px.
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
