"""Curves that can be zoomed and read off: the still picture of a chart with its data, which the page's script draws.

uPlot (https://github.com/leeoniya/uPlot, 1.6.32, MIT licence) draws them on the screen. Without scripts, and in print,
the still picture is seen.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from sinssim.charts import Band, Chart, Dash, Dots, Limit, Line, Mark, Remark, Rule, Shares
from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.svg import DASHES, MOST_DOTS, WIDTHS, pieces
from sinssim.units import TIME_SCALE

_TIES = {style.INK: "--ink", style.SOFT: "--soft", style.FAINT: "--line", style.GRID: "--hair"}
"""Colours that are others on a dark page, and their names in its style."""

_MOST = float(np.finfo(np.float32).max)

Ends = tuple[float, float]


def can_live(chart: Chart) -> bool:
    """Return whether a chart consists of curves over time."""
    lines = [mark for mark in chart.marks if isinstance(mark, Line | Dots | Band | Shares)]
    return (
        chart.x.units is TIME_SCALE
        and not (chart.equal or chart.y.names)
        and any(isinstance(mark, Line | Shares) for mark in lines)
        and all(isinstance(mark, Line | Dots | Band | Shares | Rule | Limit | Remark) for mark in chart.marks)
        and all(bool(np.all(np.diff(mark.x[:]) >= 0.0)) for mark in lines)
        and not any(isinstance(mark, Dots) and (len(mark.error) or not style.is_one(mark.color)) for mark in lines)
    )


def live(still: str, chart: Chart, across: Ends, upright: Ends, columns: int, left: float, *, named: bool) -> str:
    """Return a chart as HTML: its still picture, and the data from which the script draws it.

    Args:
        still: the picture, SVG.
        across, upright: ends of both axes, SI.
        columns: in which a curve keeps its least and greatest value, about one for each pixel.
        left: least room left of the curves, px.
        named: whether the names of its marks are beside it.
    """
    (x_unit, x_size), (y_unit, y_size) = chart.unit(False), chart.unit(True)
    if not chart.x.log:
        _, _, x_unit, x_size = style.time_ticks(*across)
    data = _Data(x_size, y_size, columns)
    for mark, color in zip(chart.marks, style.of_marks(chart.marks), strict=True):
        data.add(mark, _paint(color), chart)
    axes = [
        {"label": axis.label, "unit": unit, "size": size, "ends": [end / size for end in ends], "log": axis.log,
         "ticks": [at / size for at in axis.ticks]}
        for axis, unit, size, ends in ((chart.x, x_unit, x_size, across), (chart.y, y_unit, y_size, upright))
    ]  # fmt: skip
    whole = {"title": chart.title, "left": left, "timed": not chart.x.log, "x": axes[0], "y": axes[1],
             "curves": data.curves, "bands": data.bands, "rules": data.rules, "words": data.words,
             "places": list(data.places)}  # fmt: skip
    text = html.escape(json.dumps(whole, ensure_ascii=False, allow_nan=False))
    return f'<figure class="{"live" if named else "live short"}" data-chart="{text}">{still}</figure>'


@dataclass(frozen=True)
class _Data:
    """What the script reads of the marks of a chart, in the units of its axes."""

    x_size: float
    y_size: float
    columns: int
    curves: list[dict[str, Any]] = field(default_factory=list)
    bands: list[dict[str, Any]] = field(default_factory=list)
    rules: list[dict[str, Any]] = field(default_factory=list)
    words: list[dict[str, Any]] = field(default_factory=list)
    places: dict[str, int] = field(default_factory=dict)  # times, which many curves have in common

    def add(self, mark: Mark, paint: str, chart: Chart) -> None:
        """Add a mark in a colour."""
        x, y = self.x_size, self.y_size
        match mark:
            case Line():
                at, values = _thinned(mark, self.columns, log=chart.x.log)
                self._curve(mark.name, paint, at, values, WIDTHS[mark.weight], mark.dash, 6.0 if mark.marker else 0.0,
                            turns=mark.turn > 0.0)  # fmt: skip
            case Dots():
                some = slice(None, None, max(1, len(mark.x) // MOST_DOTS))
                at, values = mark.x[some], mark.y[some]
                self._curve(mark.label, paint, at, values, 0.0, "", mark.size / style.POINTS_PER_PIXEL)
            case Band():
                self._band(mark.label, paint, mark.x, mark.low, mark.high, share=False)
            case Shares():
                sums = np.vstack((np.zeros(len(mark.x)), np.cumsum(mark.parts, axis=0)))
                parts = list(zip(mark.labels, mark.colors, sums[:-1], sums[1:], strict=True))
                for label, shade, low, high in reversed(parts):
                    self._band(label, _paint(shade), mark.x, low, high, share=True)
            case Rule() if np.isfinite(mark.at):
                size = x if mark.upright else y
                around = [] if mark.low is None or mark.high is None else [mark.low / size, mark.high / size]
                self._rule(mark.label, paint, mark.at / size, WIDTHS[mark.weight], mark.dash, text=mark.text,
                           upright=mark.upright, band=around)  # fmt: skip
            case Limit():
                until = None if mark.at is None else mark.at / x
                self._rule(mark.name_in(chart.most), paint, mark.height / y, 1.1, "--", until=until)
            case Remark() if np.isfinite([mark.x, mark.y]).all():
                self.words.append({"x": mark.x / x, "y": mark.y / y, "text": mark.text, "left": mark.left,
                                   "below": mark.below, "soft": mark.soft})  # fmt: skip

    def _place(self, x: Array) -> int:
        return self.places.setdefault(_coded(x / self.x_size), len(self.places))

    def _curve(
        self, name: str, paint: str, x: Array, y: Array, width: float, dash: Dash, dots: float, *, turns: bool = False
    ) -> None:
        self.curves.append(
            {"name": name, "color": paint, "x": self._place(x), "y": _coded(y / self.y_size), "width": round(width, 2),
             "dash": _dashes(dash), "dots": dots, "turns": turns}
        )  # fmt: skip

    def _band(self, name: str, paint: str, x: Array, low: Array, high: Array, *, share: bool) -> None:
        self.bands.append(
            {"name": name, "color": paint, "x": self._place(x), "low": _coded(low / self.y_size),
             "high": _coded(high / self.y_size), "share": share}
        )  # fmt: skip

    def _rule(
        self, name: str, paint: str, at: float, width: float, dash: Dash, *, text: str = "", upright: bool = False,
        band: Sequence[float] = (), until: float | None = None,
    ) -> None:  # fmt: skip
        self.rules.append(
            {"name": name, "color": paint, "at": at, "width": round(width, 2), "dash": _dashes(dash), "text": text,
             "upright": upright, "band": list(band), "until": until}
        )  # fmt: skip


def _dashes(dash: Dash) -> list[float]:
    return [float(length) for length in DASHES[dash].split()]


def _paint(color: Any) -> str:
    """Return a colour in CSS notation, or its name in the style of the page."""
    css = style.css_of(color)
    return _TIES.get(css, css)


def _thinned(mark: Line, columns: int, *, log: bool) -> tuple[Array, Array]:
    """Return a line with the extremes of each column; not-a-number stands in its gaps and jumps."""
    parts = list(pieces(mark))
    if not parts:
        return np.empty(0), np.empty(0)
    start, end = float(parts[0][0][0]), float(parts[-1][0][-1])
    drawn: list[Array] = []
    for number, (at, values) in enumerate(parts):
        if number:
            drawn.append(np.array([[at[0], np.nan]]))
        some = max(2, round(columns * float(at[-1] - at[0]) / (end - start))) if end > start else 2
        thin = (at, values) if log or mark.marker else style.envelope(at, values, float(at[0]), float(at[-1]), some)
        drawn.append(np.column_stack(thin))
    x, y = np.concatenate(drawn).T
    return x, y


def _coded(values: Array) -> str:
    """Return numbers as the script reads them: 4-byte floats, base 64; a gap where one is beyond their range."""
    small = np.where(np.abs(values) <= _MOST, values, np.nan)
    return base64.b64encode(small.astype("<f4").tobytes()).decode()


def with_scripts(body: Sequence[str]) -> list[str]:
    """Return the parts of a page; if it has such charts, with a sentence above the first, and the scripts."""
    first = next((k for k, part in enumerate(body) if '<figure class="live' in part), None)
    return list(body) if first is None else [*body[:first], _HINT, *body[first:], _scripts()]


_HINT = (
    '<p class="note hint" hidden>Drag across a curve to zoom in; a double click shows all again. Move over a curve to '
    "read its values; click on a name to hide its curve.</p>"
)


@cache
def _scripts() -> str:
    """Return the style and the scripts of such charts, HTML."""
    texts = {name: files(__package__).joinpath(name).read_text(encoding="utf-8")
             for name in ("uPlot.min.css", "live_chart.css", "uPlot.iife.min.js", "live_chart.js")}  # fmt: skip
    return (
        f"<style>{texts['uPlot.min.css']}\n{texts['live_chart.css']}</style>"
        f"<script>{texts['uPlot.iife.min.js']}\n{texts['live_chart.js']}</script>"
    )
