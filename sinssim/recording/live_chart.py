"""Curves that can be zoomed and read off: the still picture of a chart with its data, which the page's script draws.

uPlot (https://github.com/leeoniya/uPlot, 1.6.32, MIT licence) draws them on the screen. Without scripts, and in print,
the still picture is seen.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from sinssim.charts import Band, Chart, Dash, Dots, Ellipses, Limit, Line, Mark, Remark, Rule, ScaleBar, Shares, Sites
from sinssim.data import Array
from sinssim.exhibits import Interactive
from sinssim.recording import style
from sinssim.recording.svg import DASHES, MOST_DOTS, WIDTHS, pieces
from sinssim.units import TIME_SCALE, fixed

_TIES = {style.INK: "--ink", style.SOFT: "--soft", style.FAINT: "--line", style.GRID: "--hair"}
"""Colours that are others on a dark page, and their names in its style."""

_SECONDS = fixed("s")
_MOST = float(np.finfo(np.float32).max)

Ends = tuple[float, float]


def can_live(chart: Chart) -> bool:
    """Return whether a chart consists of curves over time or over a duration."""
    lines = [mark for mark in chart.marks if isinstance(mark, Line | Dots | Band | Shares)]
    return (
        chart.x.units in (TIME_SCALE, _SECONDS)
        and not (chart.equal or chart.y.names)
        and any(isinstance(mark, Line | Shares) for mark in lines)
        and all(isinstance(mark, Line | Dots | Band | Shares | Rule | Limit | Remark) for mark in chart.marks)
        and all(bool(np.all(np.diff(mark.x[:]) >= 0.0)) for mark in lines)
        and not any(isinstance(mark, Dots) and (len(mark.error) or not style.is_one(mark.color)) for mark in lines)
    )


def live(still: str, chart: Chart, across: Ends, upright: Ends, left: float, *, named: bool) -> str:
    """Return a chart as HTML: its still picture, SVG, and the data from which the script draws it: the ends of both
    axes in SI, the least room `left` of the curves in px, and whether the names of the marks are beside it."""
    (x_unit, x_size), (y_unit, y_size) = chart.unit(False), chart.unit(True)
    if not chart.x.log:
        _, _, x_unit, x_size = style.time_ticks(*across)
    data = _Data(x_size, y_size)
    for mark, color in zip(chart.marks, style.of_marks(chart.marks), strict=True):
        data.add(mark, _paint(color), chart)
    axes = [
        {"label": axis.label, "unit": unit, "size": size, "ends": [end / size for end in ends], "log": axis.log,
         "ticks": [at / size for at in axis.ticks]}
        for axis, unit, size, ends in ((chart.x, x_unit, x_size, across), (chart.y, y_unit, y_size, upright))
    ]  # fmt: skip
    whole = {"key": chart.key, "title": chart.title, "left": left, "timed": not chart.x.log, "x": axes[0], "y": axes[1],
             "curves": data.curves, "bands": data.bands, "rules": data.rules, "words": data.words,
             "kept": data.kept, "counts": [len(part) for part in data.numbers.values()],
             "numbers": _packed(list(data.numbers.values()))}  # fmt: skip
    text = html.escape(json.dumps(whole, ensure_ascii=False, allow_nan=False))
    return f'<figure class="{"live" if named else "live short"}" data-chart="{text}">{still}</figure>'


def can_zoom(chart: Chart) -> bool:
    """Return whether a chart is a map with a track."""
    return chart.equal and any(isinstance(mark, Line) and len(mark.time) for mark in chart.marks)


def live_map(still: str, chart: Chart, across: Ends, upright: Ends) -> str:
    """Return a map as HTML: its still picture, and what the script draws of it at other scales. `still`: the picture,
    SVG; `across`, `upright`: ends of both axes, SI."""
    size, arrays = chart.unit(False)[1], list[Array]()

    def number(values: Array) -> int:
        arrays.append(np.asarray(values, "<f4"))
        return len(arrays) - 1

    lines, dots, texts, ellipses, sites = ([] for _ in range(5))
    bars = [mark for mark in chart.marks if isinstance(mark, ScaleBar)]
    beside = {(float(bar.x[0]), float(bar.y[1])) for bar in bars}
    beside |= {(x, y) for mark in chart.marks if isinstance(mark, Sites) for x, y in mark.sites.tolist()}
    for mark, color in zip(chart.marks, style.of_marks(chart.marks), strict=True):
        match mark:
            case ScaleBar():
                pass
            case Ellipses():
                ellipses.append({"color": _paint(color), "at": number(mark.at), "parts": [
                    number(values / size) for values in (*mark.centres.T, *mark.axes.reshape(-1, 4).T)]})  # fmt: skip
                lines.append(_map_line(mark, color, number, size))
            case Line():
                lines.append(_map_line(mark, color, number, size))
            case Sites():
                x, y = (number(values / size) for values in mark.sites.T)
                sites.append({"color": _paint(color), "x": x, "y": y, "names": mark.names, "large": mark.large})
            case Dots():
                dots.append({"color": _paint(color), "x": number(mark.x[:] / size), "y": number(mark.y[:] / size),
                             "size": mark.size / style.POINTS_PER_PIXEL})  # fmt: skip
            case Remark() if (mark.x, mark.y) not in beside:
                texts.append({"x": mark.x / size, "y": mark.y / size, "text": mark.text, "left": mark.left,
                              "below": mark.below, "soft": mark.soft})  # fmt: skip
    whole = {"ends": [[end / size for end in ends] for ends in (across, upright)], "lines": lines, "dots": dots,
             "words": texts, "ellipses": ellipses, "sites": sites,
             "bars": [[bar.unit, bar.size / size] for bar in bars],
             "counts": [len(part) for part in arrays], "numbers": _packed(arrays)}  # fmt: skip
    text = html.escape(json.dumps(whole, ensure_ascii=False, allow_nan=False))
    return f'<figure class="live_map" data-map="{text}">{still}</figure>'


def _map_line(mark: Line, color: Any, number: Callable[[Array], int], size: float) -> dict[str, Any]:
    """Return a line of a map as the script reads it."""
    return {"color": _paint(color), "x": number(mark.x / size), "y": number(mark.y / size),
            "width": round(WIDTHS[mark.weight], 2), "dash": DASHES[mark.dash], "marker": bool(mark.marker),
            "time": number(mark.time) if len(mark.time) else None}  # fmt: skip


@dataclass(frozen=True)
class _Data:
    """What the script reads of the marks of a chart, in the units of its axes."""

    x_size: float
    y_size: float
    curves: list[dict[str, Any]] = field(default_factory=list)
    bands: list[dict[str, Any]] = field(default_factory=list)
    rules: list[dict[str, Any]] = field(default_factory=list)
    words: list[dict[str, Any]] = field(default_factory=list)
    numbers: dict[bytes, Array] = field(default_factory=dict)  # all arrays; many curves have the same times
    # what it has of the curves: width of the columns of extremes, s, 0 if every value; every how many-th dot
    kept: dict[str, float] = field(default_factory=lambda: {"step": 0.0, "dots": 1})

    def add(self, mark: Mark, paint: str, chart: Chart) -> None:
        """Add a mark in a colour."""
        x, y = self.x_size, self.y_size
        match mark:
            case Line():
                at, values, step = _thinned(mark, log=chart.x.log)
                self.kept["step"] = max(self.kept["step"], step)
                self._curve(mark.name, paint, at, values, WIDTHS[mark.weight], mark.dash, 6.0 if mark.marker else 0.0,
                            turns=mark.turn > 0.0)  # fmt: skip
            case Dots():
                every = max(1, len(mark.x) // MOST_DOTS)
                self.kept["dots"] = max(self.kept["dots"], every)
                at, values = mark.x[::every], mark.y[::every]
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

    def _number(self, values: Array) -> int:
        """Return the number of an array, 4-byte floats; a gap where a value is beyond their range."""
        small = np.where(np.abs(values) <= _MOST, values, np.nan).astype("<f4")
        self.numbers.setdefault(small.tobytes(), small)
        return list(self.numbers).index(small.tobytes())

    def _curve(
        self, name: str, paint: str, x: Array, y: Array, width: float, dash: Dash, dots: float, *, turns: bool = False
    ) -> None:
        at, values = self._number(x / self.x_size), self._number(y / self.y_size)
        self.curves.append(
            {"name": name, "color": paint, "x": at, "y": values, "width": round(width, 2), "dash": _dashes(dash),
             "dots": dots, "turns": turns}
        )  # fmt: skip

    def _band(self, name: str, paint: str, x: Array, low: Array, high: Array, *, share: bool) -> None:
        self.bands.append(
            {"name": name, "color": paint, "x": self._number(x / self.x_size), "low": self._number(low / self.y_size),
             "high": self._number(high / self.y_size), "share": share}
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


def _thinned(mark: Line, *, log: bool) -> tuple[Array, Array, float]:
    """Return a line with the extremes of each column, and the width of a column, s, 0 if every point is kept;
    not-a-number stands in its gaps and jumps."""
    parts = list(pieces(mark))
    if not parts:
        return np.empty(0), np.empty(0), 0.0
    start, end = float(parts[0][0][0]), float(parts[-1][0][-1])
    drawn: list[Array] = []
    step = mark.step
    for number, (at, values) in enumerate(parts):
        if number:
            drawn.append(np.array([[at[0], np.nan]]))
        some = max(2, round(style.FINEST * float(at[-1] - at[0]) / (end - start))) if end > start else 2
        if not (log or mark.marker) and len(at) > 2 * some:
            step = max(step, float(at[-1] - at[0]) / some)
            at, values = style.envelope(at, values, float(at[0]), float(at[-1]), some)
        drawn.append(np.column_stack((at, values)))
    x, y = np.concatenate(drawn).T
    return x, y, step


def _packed(arrays: Sequence[Array]) -> str:
    """Return arrays of 4-byte floats as the script reads them: the differences of their bits as unsigned integers that
    are small for small differences of either sign, first all lowest bytes, then the next; deflated; base 64."""
    parts = [np.diff(part.view("<u4"), prepend=np.uint32(0)).view("<i4") for part in arrays]
    steps = np.concatenate([np.empty(0, "<i4"), *parts])
    planes = ((steps << 1) ^ (steps >> 31)).astype("<i4").view(np.uint8).reshape(-1, 4).T
    return base64.b64encode(deflated(planes.tobytes())).decode()


def deflated(contents: bytes) -> bytes:
    """Return bytes deflated as the script of a page inflates them."""
    packer = zlib.compressobj(6, wbits=-15)
    return packer.compress(contents) + packer.flush()


def interactive(item: Interactive) -> str:
    """Return numbers for a script of the page as HTML; without scripts, a sentence is seen."""
    plain, arrays = item.data()
    small = [array.astype("<f4") for array in arrays]
    whole = {**plain, "counts": [len(array) for array in small], "numbers": _packed(small)}
    text = html.escape(json.dumps(whole, ensure_ascii=False, allow_nan=False))
    return (
        f'<div class="{item.key}" data-live="{text}"><p class="note">This part needs the scripts of the page.</p></div>'
    )


def with_scripts(body: Sequence[str]) -> list[str]:
    """Return the parts of a page; if it has such charts, with a sentence above the first, and the scripts; if it only
    has tables, with the script for wide ones."""
    whole = "".join(body)
    if '<figure class="live' not in whole:
        return [*body, f"<script>{packaged('wide_tables.js')}</script>"] if '<div class="wide"' in whole else list(body)
    more = [*(["live_map"] if "data-map=" in whole else []), *re.findall(r'<div class="(\w+)" data-live', whole)]
    more += ["circles"] if _WITH_CIRCLES & set(more) else []  # whose name puts it before those that use it
    first = next(k for k, part in enumerate(body) if '<figure class="live' in part)
    hints = (_OF_CHARTS if "data-chart=" in whole else "") + (_OF_MAPS if "data-map=" in whole else "")
    hints += _OF_ELLIPSES if "ellipses&quot;: [{" in whole else ""
    hint = f'<p class="note hint" hidden>{hints.strip()}</p>'
    return [*body[:first], hint, *body[first:], _scripts(tuple(sorted(set(more))))]


def policy(body: Iterable[str], *, asks: bool = False) -> str:
    """Return what a page may load and run: nothing from elsewhere, and no script but ours.

    A page that `asks` has a server of its own, which its script may ask.
    """
    script = next((part.split("<script>")[1].split("</script>")[0] for part in body if "<script>" in part), None)
    allowed = ""
    if script is not None:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        allowed = f" script-src 'sha256-{digest}';"
    allowed += " connect-src 'self';" if asks else ""
    return f"default-src 'none';{allowed} style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


_WITH_CIRCLES = {"trade_what_if", "what_if"}
"""Scripts that need those of the circles."""

_OF_CHARTS = (
    "Drag across a curve to zoom in; a double click shows all again. Move over a curve to read its values; click on a "
    "name to hide its curve, and on a mark above to see what follows it; <em>log</em> changes the scale. A chart that "
    "was clicked on follows the wheel and the keys: <kbd>←</kbd> <kbd>→</kbd> move the cursor, with <kbd>Shift</kbd> "
    "far; <kbd>+</kbd> <kbd>−</kbd> zoom; <kbd>Page Up</kbd> <kbd>Page Down</kbd> move the part that is shown; "
    "<kbd>Esc</kbd> shows all."
)
_OF_MAPS = (
    " So does a map, which dragging and the arrows move; the cursor has its place there, and <em>3-D</em> copies the "
    "command that shows this instant in the viewer."
)
_OF_ELLIPSES = " The ellipse about that place contains 95 % of the positions that are expected."


def packaged(name: str, package: str = "") -> str:
    """Return a script, a style or a page: a file of `recording/interactive`, or one of a package."""
    folder = files(package) if package else files(__package__ or "").joinpath("interactive")
    return folder.joinpath(name).read_text(encoding="utf-8")


@cache
def _scripts(more: tuple[str, ...], further: tuple[str, ...] = ()) -> str:
    """Return the style and the script of such charts, of the interactive parts of a page, and further ones, HTML."""
    parts = ("wide_tables", "live_chart", "chart_gestures", *more)
    names = ("uPlot.min.css", "live_chart.css", "uPlot.iife.min.js", *(f"{part}.js" for part in parts))
    text = {name: packaged(name) for name in names}
    looks, scripts = (([text for name, text in text.items() if name.endswith(kind)]) for kind in (".css", ".js"))
    return f"<style>{chr(10).join(looks)}</style><script>{chr(10).join((*scripts, *further))}</script>"


def scripts_with(further: Sequence[str]) -> str:
    """Return the style and the script of such charts and maps with the scripts of a page that adds some by itself,
    HTML."""
    return _scripts(("live_map",), tuple(further))
