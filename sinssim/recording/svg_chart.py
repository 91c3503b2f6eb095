"""Charts on a page: drawn as SVG, without a drawing library, in the page's colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sinssim.charts import Axis, Chart, Charts, Dots, Limit, Line, Mark, Rule, Shares
from sinssim.recording import style
from sinssim.recording.live_chart import can_live, can_zoom, live, live_map
from sinssim.recording.style import log_numbers, tick_label, ticks, time_ticks
from sinssim.recording.svg import DASHES, WIDTHS, PixelScale, element, marks_of, path, segments, shapes_of, text, words
from sinssim.recording.svg import STYLE as OF_ELEMENTS
from sinssim.units import TIME_SCALE

STYLE = (
    OF_ELEMENTS
    + """
.charts { display: grid; grid-template-columns: minmax(0, 1fr); gap: .8rem; margin: .6rem 0 1.2rem; }
.charts h4 { margin: .4rem 0 0; } .row { display: flex; gap: 1.2rem; align-items: flex-start; }
.row > svg { flex: 0 1 auto; min-width: 0; }
@media screen and (max-width: 1000px) { .many { flex-wrap: wrap; } .many > svg { width: calc(50% - .6rem); } }
@media screen and (max-width: 860px) { .two { flex-direction: column; } .two > svg { width: 100%; max-width: 44rem; } }
"""
    # lines in the colours of words are those of a dark page, too
    + f'svg [stroke="{style.INK}"] {{ stroke: var(--ink); }} svg [stroke="{style.SOFT}"] {{ stroke: var(--soft); }}\n'
    + f'svg [stroke="{style.FAINT}"] {{ stroke: var(--line); }}\n'
    + f'svg [stroke="{style.GRID}"] {{ stroke: var(--hair); }} svg [fill="{style.INK}"] {{ fill: var(--ink); }}\n'
)

_PAGE, _GAP, _INCH = 1130, 19, 92
"""Width of a page and gap between charts, px; pixels of an inch of a picture."""
_LETTER = 6.4
_SMALL = style.SMALL / style.POINTS_PER_PIXEL
_SAME = 0.5
"""Distance up to which lines coincide, px."""


def html_of(charts: Charts) -> str:
    """Return a group of charts as HTML."""
    heights = charts.heights or (1.0,) * len(charts.rows)
    body = [f"<h4>{words(charts.title)}</h4>"] if charts.title else []
    if charts.legend != "each":
        body.append(_common_legend(charts))
    columns = max(map(len, charts.rows))
    widths = charts.widths or (1.0,) * columns
    whole = min(_PAGE, charts.size[0] * 1.08 * _INCH) - _GAP * (columns - 1)
    in_line = "x" in charts.share
    margin = max(_left(chart, *_ranges(chart)) for chart in charts) if in_line else 0.0
    aside = max(_aside(chart) for chart in charts) if in_line and charts.legend == "each" else 0.0
    span = _hull(charts, upright=False) if in_line else None
    reach = _hull(charts, upright=True) if "y" in charts.share and not charts.rows[0][0].y.names else None
    for row, share in zip(charts.rows, heights, strict=True):
        height = charts.size[1] * _INCH * share / sum(heights)
        again = [bool(chart.y.names) and number > 0 and chart.y.names == row[0].y.names
                 for number, chart in enumerate(row)]  # fmt: skip
        beside = _left(row[0], *_ranges(row[0])) if any(again) else 0.0  # names take no room from the first chart
        drawn, top = [], max(_heads(chart, 0.0, labelled=True)[1] for chart in row)
        for column, (chart, part) in enumerate(zip(row, widths, strict=False)):
            width = (whole - beside) * part / sum(widths) + (0.0 if column else beside)
            hidden = again[column] or (column > 0 and "y" in charts.share)
            frame = _Frame(margin, aside, top, span, reach, names=not hidden)
            drawn.append(_with_data(charts, chart, width, height, frame))
        apart = not any(again) and "y" not in charts.share  # charts that share names stay beside each other
        kind = "row" if not apart else "row two" if columns == 2 else "row many"
        body.append(drawn[0] if len(drawn) == 1 else f'<div class="{kind}">{"".join(drawn)}</div>')
    note = f'<p class="note">{words(charts.note)}</p>' if charts.note else ""
    return f'<div class="charts">{"".join(body)}</div>{note}'


def _with_data(charts: Charts, chart: Chart, width: float, height: float, frame: _Frame) -> str:
    """Return a chart of a group as HTML, with the data of curves over time."""
    still = svg_of(chart, width, height, frame, legend=charts.legend == "each")
    ends = _ranges(chart)
    if can_zoom(chart):
        return live_map(still, chart, *ends)
    if not can_live(chart):
        return still
    across, upright = frame.span or ends[0], frame.reach or ends[1]
    told = replace(chart, marks=tuple(_told_apart(chart, upright, height)))
    left = max(frame.left, _left(chart, across, upright))
    return live(still, told, across, upright, left, named=charts.legend == "each")


def _hull(charts: Charts, *, upright: bool) -> tuple[float, float]:
    """Return the ends of an axis that all charts have in common, SI."""
    ends = [_ranges(chart)[upright] for chart in charts]
    return min(low for low, _ in ends), max(high for _, high in ends)


@dataclass(frozen=True)
class _Frame:
    """What a chart has in common with its neighbours: least margins, px, ends of both axes, names of places."""

    left: float = 0.0
    right: float = 0.0
    top: int = 0
    span: tuple[float, float] | None = None
    reach: tuple[float, float] | None = None
    names: bool = True


def _ranges(chart: Chart) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of both axes, SI."""
    ranges = [_range(chart, upright) for upright in (False, True)]
    if chart.equal and None in (chart.x.low, chart.x.high, chart.y.low, chart.y.high):
        reach = max(abs(end) for ends in ranges for end in ends)
        ranges = [(-reach, reach)] * 2 if all(low < 0.0 < high for low, high in ranges) else ranges
    return ranges[0], ranges[1]


def _range(chart: Chart, upright: bool) -> tuple[float, float]:
    axis, (_, size) = (chart.y if upright else chart.x), chart.unit(upright)
    if axis.names:
        return (len(axis.names) - 0.5, -0.5) if upright else (-0.5, len(axis.names) - 0.5)
    low, high = chart.ends(upright)
    values = [v[np.isfinite(v)] for v in chart.values(upright)]
    values = [v for v in values if len(v)]
    if upright:
        near = [mark.height for mark in chart.marks if isinstance(mark, Limit) and not mark.is_far(chart.most)]
        values += [np.array([1.1 * height]) for height in near]
        high = high if high is None else max(high, *(1.1 * height for height in near), high)
    least = min((float(v.min()) for v in values), default=0.0)
    most = max((float(v.max()) for v in values), default=1.0)
    if axis.log:
        return (low or 0.1), (high or 1.0)
    if most - least <= max(1e-9 * max(abs(least), abs(most)), axis.least):
        least, most = least - 0.5 * size, most + 0.5 * size
    if low is None or high is None:
        step = ticks(least / size, most / size, 5)[1] * size
        low = float(np.floor(least / step + 1e-6) * step) if low is None else low
        high = float(np.ceil(most / step - 1e-6) * step) if high is None else high
    return (low, high) if high > low else (low, low + size)


def _numbers(axis: Axis, ends: tuple[float, float], unit: tuple[str, float], count: int) -> list[tuple[float, str]]:
    """Return the places, SI, and texts of the ticks of an axis."""
    low, high, size = *ends, unit[1]
    if axis.names:
        return [(float(k), name) for k, name in enumerate(axis.names)]
    if axis.ticks:
        return [(at, f"{at / size:g}".replace("-", "−")) for at in axis.ticks]
    if axis.log:
        return [(v * size, f"{v:g}" if 1e-4 <= v < 1e6 else f"{v:.0e}") for v in log_numbers(low / size, high / size)]
    if axis.units is TIME_SCALE:
        at, step, _, size = time_ticks(low, high)
    else:
        at, step = ticks(low / size, high / size, count)
        if len(at) < 3:  # a range about zero may have no other number of such a step
            at, step = ticks(low / size, high / size, 2 * count)
    return [(float(v) * size, tick_label(float(v), step)) for v in at]


def _left(chart: Chart, _: tuple[float, float], ends: tuple[float, float]) -> float:
    """Return the room for the numbers or names on the left, px."""
    texts = [text for _, text in _numbers(chart.y, ends, chart.unit(True), 5)]
    return max(40.0, 14.0 + 0.98 * _LETTER * max(map(len, texts), default=0))


def _aside(chart: Chart) -> float:
    """Return the room for a legend on the right, px."""
    names = _named(chart.marks, chart.most) if chart.legend == "right" else []
    return 50.0 + _LETTER * max(len(label) for label, *_ in names) if names else 14.0


def svg_of(chart: Chart, width: float, height: float, frame: _Frame | None = None, *, legend: bool = True) -> str:
    """Return one chart, of a width and a height in px, which a legend, the names of its marks, makes higher; it shares
    a frame with its neighbours."""
    frame = frame or _Frame()
    across, upright = _ranges(chart)
    across, upright = frame.span or across, frame.reach or upright
    left = max(frame.left, _left(chart, across, upright) if frame.names else 14.0)
    names = [] if not legend or chart.legend == "none" else _named(_told_apart(chart, upright, height), chart.most)
    if len(names) == 1 and isinstance(chart.marks[-1], Line) and chart.title:
        names = []  # the title says it
    aside = chart.legend == "right" and len(names) > 0
    right = max(frame.right, _aside(chart) if legend else 14.0)
    body, top = _heads(chart, left, labelled=frame.names)
    top = max(top, frame.top)
    if names and not aside:
        drawn, top = _legend(names, left, top, width)
        body.append(drawn)
    inner = width - left - right
    texts = [mark for mark in chart.marks if isinstance(mark, Rule) and mark.upright and mark.text]
    top += 11 if texts else 0
    tall = max(height - 86.0, 90.0)
    if chart.equal:
        ratio = (upright[1] - upright[0]) / (across[1] - across[0])
        tall = inner * ratio
        if tall > height:
            tall = max(height - 60.0, 240.0)
            inner = tall / ratio
    top += 8
    bottom = top + tall
    x, y = PixelScale(*across, left, left + inner, chart.x.log), PixelScale(*upright, bottom, top, chart.y.log)
    axes = list(_axes(chart, x, y, inner, top, bottom, names=frame.names))
    curves, words_over = marks_of(chart, x, y)
    words_over += _tops(texts, x, top, width - 4.0)
    if can_zoom(chart):  # the script draws both anew
        axes, words_over = (['<g class="redrawn">', *parts, "</g>"] for parts in (axes, words_over))
    body += axes
    # An inner element clips the marks at the axes.
    box = f"{left:g} {top:g} {inner:g} {tall:g}"
    body.append(f'<svg x="{left:g}" y="{top:g}" width="{inner:g}" height="{tall:g}" viewBox="{box}">')
    body += [*curves, "</svg>", *words_over]
    if aside:
        for number, name in enumerate(names):
            at = top + 12.0 + 17.0 * number
            body.append(_sample(left + inner + 10.0, at, name))
            body.append(text(left + inner + 42.0, at + 4.0, name.label, kind="soft"))
        bottom = max(bottom, top + 17.0 * len(names) - 40.0)
    body.append(text(left + inner, bottom + 34, _axis_words(chart, across), "end", "soft"))
    about = f"{chart.title}: {chart.heading(True)} over {chart.heading(False)}".strip(": ")
    return element(width, round(bottom + 42), about, "".join(body))


def _axis_words(chart: Chart, ends: tuple[float, float]) -> str:
    """Return the label of the horizontal axis."""
    if chart.x.units is TIME_SCALE and not chart.x.log:
        return f"{chart.x.label} [{time_ticks(*ends)[2]}]"
    return chart.heading(False)


def _heads(chart: Chart, left: float, *, labelled: bool) -> tuple[list[str], int]:
    """Return title and label of the vertical axis, and the ordinate below them."""
    label = chart.heading(True)
    if chart.title and label and not chart.y.label:
        return [text(left, 15, f"{chart.title} [{label}]", more='font-weight="600"')], 22
    body = [text(left, 15, chart.title, more='font-weight="600"')] if chart.title else []
    if not label:
        return body, 22
    words_over = [text(left, 15 + 17 * len(body), label, kind="soft")] if labelled else []
    return [*body, *words_over], 22 + 17 * len(body)


def _axes(
    chart: Chart, x: PixelScale, y: PixelScale, inner: float, top: float, bottom: float, *, names: bool
) -> Iterator[str]:
    """Yield grid, axes and their numbers, and the names of places."""
    left, right = x.start, x.end
    for axis, way, unit, ends in (
        (chart.x, x, chart.unit(False), (x.low, x.high)), (chart.y, y, chart.unit(True), (y.low, y.high)),
    ):  # fmt: skip
        upright = way is y
        count = max(4, int((bottom - top) // 34)) if upright else max(3, int(inner // 75))
        at = [(float(way(v)), label) for v, label in _numbers(axis, ends, unit, count)]
        at = [(p, label) for p, label in at if min(way.start, way.end) - 0.5 <= p <= max(way.start, way.end) + 0.5]
        if axis.grid and not axis.names:
            lines = [p for p, _ in at]
            n = len(lines)
            yield (
                segments([left] * n, lines, [right] * n, lines, "grid")
                if upright
                else segments(lines, [top] * n, lines, [bottom] * n, "grid")
            )
        if upright and not names:
            continue
        if upright:
            yield from (text(left - 6, p + 4, label, "end", "soft") for p, label in at)
        else:
            yield from _spread(at, bottom, turned=bool(axis.names) and sum(len(t) for _, t in at) * _LETTER > inner)
    plane = chart.equal and chart.y.low is not None  # a map has no zero
    zero = [float(y(0.0))] if not (y.log or plane or chart.y.names) and y.low < 0.0 < y.high else []
    yield segments([left] * (1 + len(zero)), [bottom, *zero], [right] * (1 + len(zero)), [bottom, *zero], "axis")
    yield segments([left], [top], [left], [bottom], "axis")


def _spread(at: Sequence[tuple[float, str]], bottom: float, *, turned: bool) -> Iterator[str]:
    """Yield the numbers of a horizontal axis, without those that would touch their neighbours."""
    free = -np.inf
    for place, label in at:
        half = 0.5 * _LETTER * len(label)
        if turned:
            yield text(
                place, bottom + 14, label, "end", "soft", f'transform="rotate(-20 {place:.1f} {bottom + 14:.1f})"'
            )
        elif place - half > free:
            yield text(place, bottom + 15, label, "middle", "soft")
            free = place + half + 4.0


def _tops(marks: Sequence[Rule], x: PixelScale, top: float, right: float) -> Iterator[str]:
    """Yield the texts of upright lines above the chart, without those that would touch their neighbours."""
    free = -np.inf
    for mark in marks:
        at, long = float(x(mark.at)), 0.92 * _LETTER * len(mark.text)
        left = max(min(at - 0.5 * long, right - long), x.start)  # the top number of the axis is beside it
        if left > free:
            yield text(left, top - 4, mark.text, kind="soft", more=f'font-size="{_SMALL:g}"')
            free = left + long + _LETTER  # numbers without a gap would read as one


def _told_apart(chart: Chart, ends: tuple[float, float], height: float) -> list[Mark]:
    """Return the marks with a word in the names of lines that coincide with a former one."""
    least = _SAME * (ends[1] - ends[0]) / height
    marks: list[Mark] = []
    for mark, color in zip(chart.marks, style.of_marks(chart.marks), strict=True):
        if isinstance(mark, Line) and mark.label and not (chart.y.log or chart.equal):
            lines = [line for line in marks if isinstance(line, Line) and line.label]
            same = next((line.label.partition(" (same as ")[0] for line in lines if _coincide(line, mark, least)), None)
            mark = replace(mark, label=mark.label if same is None else f"{mark.label} (same as {same})", color=color)
        marks.append(mark)
    return marks


def _coincide(line: Line, other: Line, least: float) -> bool:
    """Return whether two lines lie on each other; lines with other instants are compared between them."""
    if not len(line.x) or not len(other.x) or abs(float(line.y[-1]) - float(other.y[-1])) > least:
        return False  # the usual case, without a look at every sample
    values = line.y
    if line.x is not other.x and not np.array_equal(line.x, other.x):
        margin = 0.01 * float(line.x[-1] - line.x[0])
        ends = np.abs(line.x[[0, -1]] - other.x[[0, -1]])
        if line.turn or other.turn or ends.max() > margin or margin < 0.0:
            return False
        values = np.interp(other.x, line.x, line.y)
    return bool(np.abs(values - other.y).max() <= least)


class Named(NamedTuple):
    """An entry of a legend: label, CSS colour, kind, dashes, and width of a line, px."""

    label: str
    color: str
    kind: str
    dash: str = ""
    width: float = 1.6


def _named(marks: Sequence[Mark], most: float) -> list[Named]:
    """Return the entries of the legend of some marks."""
    entries: list[Named] = []
    for mark, color in zip(marks, style.of_marks(marks), strict=True):
        if isinstance(mark, Shares):
            pairs = zip(mark.labels, mark.colors, strict=True)
            entries += [Named(label, style.css_of(shade), "area") for label, shade in pairs][::-1]
        elif label := mark.name if isinstance(mark, Line) else getattr(mark, "label", ""):
            shape = getattr(mark, "marker", "")
            kind = shape if isinstance(mark, Dots) else f"line{shape}" if isinstance(mark, Line) else "area"
            if isinstance(mark, Rule):
                kind = "line"
            if isinstance(mark, Limit):
                kind = "line" if mark.at is None else "v"
                label = mark.name_in(most)
            dash = "--" if isinstance(mark, Limit) else getattr(mark, "dash", "")
            shade = color if style.is_one(color) else color[0]
            width = WIDTHS[mark.weight] if isinstance(mark, Line) else 1.6
            entries.append(Named(label, style.css_of(shade), kind, DASHES[dash], width))
    return list(dict.fromkeys(entries))


def _sample(x: float, y: float, name: Named) -> str:
    """Return the sample of a mark in a legend."""
    _, color, kind, dash, width = name
    if kind == "area":
        return f'<rect x="{x:.1f}" y="{y - 5:.1f}" width="26" height="10" fill="{color}" opacity="0.8"/>'
    line = path(np.array([x, x + 26.0]), np.array([y, y]), color, width, dash) if kind.startswith("line") else ""
    shape = kind.removeprefix("line")
    return line + (shapes_of(np.array([x + 13.0]), np.array([y]), [color], shape, 6.0) if shape else "")


def _legend(names: Sequence[Named], left: float, top: float, width: float) -> tuple[str, int]:
    """Return a legend in rows, and the ordinate of its end."""
    parts, x, y = [], left, top + 10.0
    for name in names:
        long = 44.0 + _LETTER * len(name.label)
        if x > left and x + long > width:
            x, y = left, y + 16.0
        parts += [_sample(x, y - 4.0, name), text(x + 31.0, y, name.label, kind="soft")]
        x += long
    return "".join(parts), round(y + 4.0)


def _common_legend(charts: Charts) -> str:
    """Return the legend of all charts of a group."""
    by_label: dict[str, Named] = {}
    for chart in charts:
        for entry in _named(chart.marks, chart.most):
            by_label.setdefault(entry[0], entry)
    names = list(by_label.values())
    if not names:
        return ""
    width = min(_PAGE, charts.size[0] * 1.08 * _INCH)
    about = text(4.0, 14.0, f"{charts.named}:", kind="soft") if charts.named else ""
    drawn, bottom = _legend(names, 12.0 + _LETTER * len(charts.named) if about else 4.0, 4.0, width)
    drawn = about + drawn
    return element(width, bottom + 4, "legend", drawn)
