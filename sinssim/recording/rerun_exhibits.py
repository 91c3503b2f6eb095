"""Exhibits as a Rerun recording: curves over time, pictures, and a text with tables and sentences."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.charts import Band, Chart, Charts, Cloud, Color, Dots, Limit, Line, Rule, Shares
from sinssim.data import Computed, Rows
from sinssim.exhibits import Beside, Exhibits, Item, Picture, Points, Section, Sentence, Table, Verbatim
from sinssim.recording import style
from sinssim.recording.figures import figure_of, to_png
from sinssim.recording.rerun_file import Recording, is_long, screen_rows, time_plot, whole_recording
from sinssim.recording.rerun_viewer import RUN_ENTITY
from sinssim.recording.rerun_views import RunInfo, all_views
from sinssim.recording.style import gaps
from sinssim.units import TIME_SCALE, capital, suiting

_WIDTHS = {"broad": 7.0, "wide": 4.0, "bold": 2.2, "line": 1.5, "thin": 1.0, "hair": 0.8}


def record(exhibits: Exhibits, path: Path) -> None:
    """Write the recording of a result, by convention with the suffix .rrd. Without a kind of its exhibits, it has a tab
    for each group of charts and one for the tables."""
    labels = {"kind": exhibits.kind, **exhibits.labels}
    run = RunInfo(exhibits.name, *exhibits.span, (), labels=labels)
    tabs: list[rrb.Container | rrb.View] = []
    with whole_recording(path, run.application) as recording:
        for charts in exhibits.charts():
            labels |= record_charts(recording, charts, f"{exhibits.root}/", exhibits.span[0])
            if "recording" not in charts.on:
                continue
            name = capital(charts.key.replace("_", " "))
            over_time = [chart for chart in charts if _is_over_time(chart)]
            if charts.key in exhibits.pictures:
                entity = f"{exhibits.root}/figures/{charts.key}"
                image = rr.EncodedImage(contents=to_png(figure_of(charts)), media_type="image/png")
                recording.static(entity, image)
                tabs.append(rrb.Spatial2DView(origin=f"/{entity}", name=name))
            elif over_time:
                tabs.append(rrb.Grid(*(_plot(exhibits, chart) for chart in over_time), name=name))
        for item in exhibits.items:
            if isinstance(item, Cloud):
                record_cloud(recording, f"{exhibits.root}/{item.key}", item, exhibits.span[0])
        recording.document(f"{exhibits.root}/tables", markdown(exhibits))
        tabs.insert(1, rrb.TextDocumentView(origin=f"/{exhibits.root}/tables", name="Summary"))
        if not exhibits.kind:
            recording.blueprint(rrb.Blueprint(rrb.Tabs(*tabs), collapse_panels=True))
            return
        run = replace(run, labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _plot(exhibits: Exhibits, chart: Chart) -> rrb.View:
    unit = chart.unit(True)[0]
    name = f"{chart.title} [{unit}]" if unit else chart.title
    return time_plot(f"{exhibits.root}/{chart.key}", name, np.array(exhibits.span))


def record_charts(recording: Recording, charts: Charts, root: str = "", start: float = 0.0) -> dict[str, str]:
    """Record those of some charts that are over time, at entities below a root and from a start, s; return the unit and
    the title of each by its key, for the views' titles."""
    labels = {}
    for chart in charts if "recording" in charts.on else ():
        if _is_over_time(chart):
            record_chart(recording, f"{root}{chart.key}", chart, start)
            labels[chart.key] = f"log₁₀ {chart.unit(True)[0]}" if chart.y.log else chart.unit(True)[0]
            if chart.title:
                labels[f"{chart.key} title"] = chart.title
    return labels


def _is_over_time(chart: Chart) -> bool:
    return chart.x.units is TIME_SCALE and not chart.x.log


def record_chart(recording: Recording, entity: str, chart: Chart, start: float) -> None:
    """Record the lines and dots of a chart over time, its horizontal rules and the limits of requirements. Lines at
    different instants are below its entity in their order, which is that of drawing; the viewer draws an entity after
    those below it. The start, s, is added to its times."""
    size = chart.unit(True)[1]
    groups: list[list[tuple[Line, style.Rgb, float]]] = []
    for line in _lines_of(chart):
        same = (group for group in groups if group[0][0].x is line[0].x or np.array_equal(group[0][0].x, line[0].x))
        group = next(same, [])
        groups += [] if group else [group]
        group.append(line)
    for number, group in enumerate(groups):
        time = group[0][0].x
        values = np.column_stack([gaps(line.y, line.turn) if line.turn else line.y for line, *_ in group])
        if is_long(len(time)):
            rows = screen_rows(time, values, float(time[0]), float(time[-1]))
            time, values = time[rows], values[rows]
        values = values / size
        if chart.y.log:  # the viewer has no logarithmic axis
            values = np.log10(np.where(values > 0.0, values, np.nan))
        recording.series(
            f"{entity}/{number}" if len(groups) > 1 else entity, start + time,
            np.where(np.isfinite(values), values, np.nan), [line.label for line, *_ in group],
            colors=[paint for _, paint, _ in group], widths=[width for *_, width in group],
        )  # fmt: skip
    dots = [(m, c) for m, c in zip(chart.marks, style.of_marks(chart.marks), strict=True) if isinstance(m, Dots)]
    for number, (mark, color) in enumerate(dots):
        recording.points(
            f"{entity}/dots_{number}", *_blockwise(mark, start, size), [mark.label], style.rgb_of(color),
            marker="circle", size=mark.size,
        )  # fmt: skip
    below = [ends for place, ends in recording.ranges.items() if place == entity or place.startswith(f"{entity}/")]
    if below:
        recording.ranges[entity] = _ends(chart, below)
        _limits(recording, entity, chart, start)


def _blockwise(dots: Dots, start: float, size: float) -> tuple[Rows, Rows]:
    """Return the times of dots, s, and their values in a unit, (N, 1), block by block."""
    count = len(dots.x)
    time = Computed(count, lambda rows: start + dots.x[rows])
    return time, Computed(count, lambda rows: dots.y[rows][:, np.newaxis] / size)


def _lines_of(chart: Chart) -> Iterator[tuple[Line, style.Rgb, float]]:
    """Yield what a chart draws as lines, with colour and width; of lines with dashes each is under the next."""
    marks = list(zip(chart.marks, style.of_marks(chart.marks), strict=True))
    dashed = [mark for mark, _ in marks if isinstance(mark, Line) and mark.counts]
    apart = iter(style.stacked_widths(len(dashed)) if any(line.dash for line in dashed) else ())
    for mark, color in marks:
        match mark:
            case Line():
                width = next(apart, _WIDTHS[mark.weight]) if mark.counts else _WIDTHS[mark.weight]
                yield replace(mark, label=mark.label or _name_of_color(chart, mark.color)), style.rgb_of(color), width
            case Band():
                name = mark.label or _name_of_color(chart, mark.color)
                for end, values in (("low", mark.low), ("high", mark.high)):
                    line = Line(label=f"{name}, {end}", x=mark.x, y=values)
                    yield line, style.tint(style.rgb_of(color)), _WIDTHS["hair"]
            case Shares():
                for label, part, paint in zip(mark.labels, mark.parts, mark.colors, strict=True):
                    yield Line(label=label, x=mark.x, y=part), style.rgb_of(paint), _WIDTHS["line"]
            case Rule() if not mark.upright and not chart.y.log:
                times = [t for t in chart.values(upright=False) if len(t)]
                ends = [chart.x.low, chart.x.high]
                if None in ends and times:
                    ends = [min(float(t.min()) for t in times), max(float(t.max()) for t in times)]
                if None not in ends:
                    name = mark.label or mark.text or _name_of_color(chart, mark.color)
                    level = Line(label=name, x=np.array(ends), y=np.full(2, mark.at))
                    yield level, style.rgb_of(color), _WIDTHS[mark.weight]
            case _:
                pass


def _ends(chart: Chart, below: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the ends of the vertical axis of a chart in a recording, from those of its lines and dots."""
    size, axis = chart.unit(True)[1], chart.y
    low, high = min(low for low, _ in below), max(high for _, high in below)
    if axis.low is not None and axis.high is not None and not axis.ticks:
        return axis.low / size, axis.high / size
    if high - low < axis.least / size:  # no more than rounding
        low, high = low - 0.5, high + 0.5
    return low, high


def record_cloud(recording: Recording, entity: str, cloud: Cloud, start: float) -> None:
    """Record points that move in a plane, and the circles about its origin. `cloud`: the points; `start`: added to its
    times, s."""
    size = suiting(cloud.units, cloud.x, cloud.y)[1]
    # the picture's y axis points down
    frames = np.stack((cloud.x, -cloud.y), axis=-1).transpose(1, 0, 2) / size
    there, time = [frame[np.isfinite(frame).all(axis=1)] for frame in frames], start + cloud.time
    dots = rr.Points2D.from_fields(radii=rr.Radius.ui_points(1.6), colors=[style.COLORS["run"]])
    recording.static(f"{entity}/runs", dots)
    positions = rr.Points2D.columns(positions=np.concatenate(there)).partition([len(frame) for frame in there])
    recording.columns(f"{entity}/runs", time, positions)
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    ring = np.column_stack((np.sin(angle), np.cos(angle)))
    for name, radius in cloud.circles.items():
        strips = [r * ring for r in np.where(np.isfinite(radius), radius, 0.0) / size]
        look = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.2), colors=[style.COLORS[name]])
        recording.static(f"{entity}/{name}", look)
        recording.columns(f"{entity}/{name}", time, rr.LineStrips2D.columns(strips=strips))
    reach = max((float(np.abs(frame).max(initial=0.0)) for frame in there), default=1.0) or 1.0
    cross = [np.array([[-reach, 0.0], [reach, 0.0]]), np.array([[0.0, -reach], [0.0, reach]])]
    grey = style.COLORS["ground"]
    recording.static(f"{entity}/axes", rr.LineStrips2D(cross, radii=rr.Radius.ui_points(0.5), colors=grey))
    words = rr.Points2D(
        [[1.05 * reach, 0.0], [0.0, -1.05 * reach]], labels=list(cloud.names), colors=grey,
        radii=rr.Radius.ui_points(0.1), show_labels=True,
    )  # fmt: skip
    recording.static(f"{entity}/words", words)


def _name_of_color(chart: Chart, color: Color) -> str:
    """Return the label of the line in a colour, which is also that of its band and of its line below zero."""
    lines = (mark for mark in chart.marks if isinstance(mark, Line | Rule))
    return next((mark.label for mark in lines if mark.label and color and mark.color == color), "")


def _limits(recording: Recording, entity: str, chart: Chart, start: float) -> None:
    """Record the limits of requirements below the entity of a plot; far ones are left out."""
    size, most = chart.unit(True)[1], chart.most
    low, high = recording.ranges[entity]
    end = max((float(x.max()) for x in chart.values(upright=False) if len(x)), default=0.0)
    limits = [mark for mark in chart.marks if isinstance(mark, Limit)]
    for number, limit in enumerate(limits, start=1):
        if limit.is_far(most):
            continue
        height, color = limit.height / size, style.rgb_of(limit.color)
        place = f"{entity}/limit_{number}"
        if limit.at is None:
            recording.series(
                place, start + np.array([0.0, end]), np.full((2, 1), height), [limit.label], colors=[color]
            )
        else:
            at = np.array([start + limit.at])
            recording.points(place, at, np.full((1, 1), height), [limit.label], color, marker="down", size=6.0)
        low, high = min(low, height), max(high, height)
    recording.ranges[entity] = (low, high)


def markdown(exhibits: Exhibits) -> str:
    """Return the tables and sentences of a result as text."""
    return "\n".join([f"# {exhibits.title}", "", markdown_of(exhibits.items)])


def markdown_of(items: Sequence[Item]) -> str:
    """Return tables and sentences as text."""
    return "\n".join(_lines(items, 2))


def _lines(items: Sequence[Item], level: int) -> Iterator[str]:
    for item in items:
        if isinstance(item, Charts | Cloud | Picture) or "recording" not in item.on:
            continue
        match item:
            case Sentence():
                yield from (item.text, "")
            case Table():
                columns, heads, rows = item.shown("recording")
                yield from ([f"**{_escaped(item.title)}**", ""] if item.title else [])
                named = zip(columns, heads, strict=True)
                texts = (", ".join(filter(None, (column.group, *head))) for column, head in named)
                yield "| " + " | ".join(map(_escaped, texts)) + " |"
                yield "|" + "".join("---|" if column.words else "---:|" for column in columns)
                yield from ("| " + " | ".join(map(_escaped, row)) + " |" for row in rows)
                yield from ("", *([item.note, ""] if item.note else []))
            case Verbatim():
                yield from (f"```\n{item.text}\n```", "")
            case Points():
                yield from (*(f"- {text}" for text in item.texts), "")
            case Beside():
                yield from _lines(item.items, level)
            case Section():
                inner = list(_lines(item.items, level + 1))
                if item.title and inner:
                    yield from (f"{'#' * level} {item.title}{f': {item.verdict}' if item.verdict else ''}", "")
                yield from inner


def _escaped(text: str) -> str:
    """Return a text in which bars and single asterisks stand for themselves."""
    return re.sub(r"\||(?<!\*)\*(?!\*)", r"\\\g<0>", text).replace("\n", " ")
