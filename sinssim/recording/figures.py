"""Figures drawn by matplotlib: one style, and the charts of exhibits, which `plot()` returns."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from sinssim.charts import (
    Axis,
    Band,
    Bars,
    Cells,
    Chart,
    Charts,
    Dots,
    Histogram,
    Limit,
    Line,
    Mark,
    Remark,
    Rule,
    Shares,
)
from sinssim.errors import InputError, RunError
from sinssim.recording import style
from sinssim.recording.style import envelope, log_numbers
from sinssim.system.files import draft

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_P = ParamSpec("_P")
_R = TypeVar("_R")


FORMATS = (".svg", ".png", ".pdf")
"""File formats of figures."""


_STYLE: dict[str, Any] = {
    "font.size": style.TEXT,
    "axes.titlesize": style.TEXT,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": style.TEXT,
    "figure.titlesize": style.TEXT,
    "figure.titleweight": "bold",
    "xtick.labelsize": style.TEXT,
    "ytick.labelsize": style.TEXT,
    "legend.fontsize": style.SMALL,
    "legend.frameon": False,
    "text.color": style.INK,
    "axes.titlecolor": style.INK,
    "axes.labelcolor": style.SOFT,
    "axes.edgecolor": style.SOFT,
    "xtick.color": style.SOFT,
    "ytick.color": style.SOFT,
    "axes.linewidth": style.HAIR,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.grid.which": "major",
    "grid.color": style.GRID,
    "grid.linewidth": style.HAIR,
    "lines.linewidth": style.LINE,
    "lines.markersize": 5.0,
    "savefig.dpi": 150,
    "svg.fonttype": "none",
}


def styled(draw: Callable[_P, _R]) -> Callable[_P, _R]:
    """Make a function draw in the style of all figures."""

    @wraps(draw)
    def drawn(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        import matplotlib

        with matplotlib.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return drawn


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a width and a height in inches, which needs no display; its layout is computed when it
    is written."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def check_format(path: Path) -> None:
    """Refuse an unknown file format before the figure is drawn."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: the file name of a figure must end in {', '.join(FORMATS)}.")


def save(figure: Figure, path: Path) -> None:
    """Write a figure to a temporary file and rename it into place."""
    check_format(path)
    import matplotlib

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stamp: dict[str, Any] = {"Date": None} if path.suffix.lower() == ".svg" else {}
        with draft(path) as beside, matplotlib.rc_context({**_STYLE, "svg.hashsalt": "sinssim"}):
            figure.savefig(beside, format=path.suffix[1:].lower(), metadata=stamp or None)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error


def to_png(figure: Figure) -> bytes:
    """Return a figure as a picture."""
    import matplotlib

    data = io.BytesIO()
    with matplotlib.rc_context(_STYLE):
        figure.savefig(data, format="png")
    return data.getvalue()


_WIDTHS = {
    "broad": 6.0 * style.LINE,
    "wide": 3.5 * style.LINE,
    "bold": 2.0 * style.LINE,
    "line": style.LINE,
    "thin": style.THIN,
    "hair": style.HAIR,
}
_COLUMNS = 4000
"""Columns of pixels in which a long line keeps its least and greatest value."""


@styled
def figure_of(charts: Charts) -> Figure:
    """Draw a group of charts."""
    figure = new_figure(*charts.size)
    columns = max(map(len, charts.rows))
    grid = figure.subplots(
        len(charts.rows), columns, squeeze=False, sharex="x" in charts.share, sharey="y" in charts.share,
        width_ratios=charts.widths or None, height_ratios=charts.heights or None,
    )  # fmt: skip
    named: dict[str, Artist] = {}
    for row, panels in zip(charts.rows, grid, strict=True):
        for left in panels[len(row) :]:
            left.remove()
        for column, (chart, axes) in enumerate(zip(row, panels, strict=False)):
            draw(axes, chart, legend=charts.legend == "each")
            if "y" in charts.share and column:
                axes.set_ylabel("")
            if column and chart.y.names and chart.y.names == row[0].y.names:
                axes.tick_params(labelleft=False)
            if "x" in charts.share and row is not charts.rows[-1]:
                axes.set_xlabel("")
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                named.setdefault(label, handle)
    if "x" in charts.share:
        ends = [[end / chart.unit(False)[1] for end in chart.ends(False) if end is not None] for chart in charts]
        if whole := [end for pair in ends for end in pair]:
            grid[0, 0].set_xlim(min(whole), max(whole))
    if charts.legend != "each" and len(named) > 0:
        place = {"right": "outside right upper", "below": "outside lower center"}[charts.legend]
        rank = {getattr(mark, "name", getattr(mark, "label", "")): k for chart in charts
                for k, mark in enumerate(chart.marks)}  # fmt: skip
        names = sorted(named, key=lambda name: rank.get(name, len(rank)))
        figure.legend([named[name] for name in names], names, loc=place, ncols=1 if charts.legend == "right" else 3,
                      title=charts.named or None, title_fontsize=style.SMALL, alignment="left")  # fmt: skip
    if charts.title:
        figure.suptitle(charts.title)
    if charts.note:
        figure.supxlabel(charts.note, fontsize=style.SMALL, color=style.SOFT, x=0.02, ha="left")
    return figure


def draw(axes: Axes, chart: Chart, *, legend: bool = True) -> None:
    """Draw one chart, perhaps without its `legend`, the names of the marks."""
    (_, x), (_, y) = chart.unit(False), chart.unit(True)
    for way, axis in (("x", chart.x), ("y", chart.y)):
        if axis.log:
            getattr(axes, f"set_{way}scale")("log")
    bare = [mark for mark in chart.marks if not isinstance(mark, Limit)]
    for bare_mark, color in zip(bare, style.of_marks(bare), strict=True):
        _draw(axes, bare_mark, color, x, y)
    _ends(axes, chart, x, y)
    for mark in chart.marks:
        if isinstance(mark, Limit):
            _limit(axes, mark, chart.most, x, y)
    words = {"title": chart.title, "xlabel": chart.heading(False), "ylabel": chart.heading(True)}
    axes.set(**{key: text.replace("$", r"\$") for key, text in words.items()})  # a column's name, not a formula
    _ticks(axes, chart.x, x, upright=False)
    _ticks(axes, chart.y, y, upright=True)
    if legend and chart.legend != "none" and axes.get_legend_handles_labels()[0]:
        places: dict[str, dict[str, Any]] = {
            "inside": {"loc": "best"},
            "right": {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)},
            "below": {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 2, "columnspacing": 1.2},
        }
        turned = chart.legend == "right" and any(isinstance(mark, Shares) for mark in chart.marks)
        axes.legend(reverse=turned, **places[chart.legend])


def _css(colors: Any) -> Any:
    """Return one colour, or several, in CSS notation."""
    single = isinstance(colors, str) or isinstance(colors[0], int)
    return style.css_of(colors) if single else [style.css_of(color) for color in colors]


def _draw(axes: Axes, mark: Mark, color: Any, x: float, y: float) -> None:
    """Draw a mark in units of the axes."""
    match mark:
        case Line():
            at, values = _thin(mark)
            hollow: dict[str, Any] = {"markerfacecolor": "white"} if mark.hollow else {}
            axes.plot(
                at / x, values / y, color=_css(color), lw=_WIDTHS[mark.weight], ls=mark.dash or "-",
                marker=mark.marker or None, label=mark.name or None, **hollow,
            )  # fmt: skip
        case Band():
            axes.fill_between(
                mark.x / x, mark.low / y, mark.high / y, color=_css(color), alpha=0.25, lw=0, label=mark.label or None
            )
        case Dots():
            if len(mark.error):
                axes.errorbar(mark.x[:] / x, mark.y[:] / y, xerr=mark.error / x, fmt="none", ecolor=style.SOFT,
                              elinewidth=style.THIN)  # fmt: skip
            axes.scatter(mark.x[:] / x, mark.y[:] / y, c=_css(color), s=mark.size**2, marker=mark.marker or "o",
                         zorder=3, lw=0, label=mark.label or None)  # fmt: skip
        case Bars():
            _bars(axes, mark, _css(color), x if mark.across else y)
        case Shares():
            axes.stackplot(mark.x / x, mark.parts / y, labels=mark.labels, colors=_css(mark.colors), lw=0.3,
                           edgecolor="white")  # fmt: skip
        case Histogram():
            edges, counts = mark.counted
            axes.bar(edges[:-1] / x, counts, np.diff(edges) / x, align="edge", color=_css(color), edgecolor="white")
        case Rule():
            size = x if mark.upright else y
            if mark.low is not None and mark.high is not None:
                span = axes.axvspan if mark.upright else axes.axhspan
                span(mark.low / size, mark.high / size, color=_css(color), alpha=0.25, lw=0)
            straight = axes.axvline if mark.upright else axes.axhline
            straight(mark.at / size, color=_css(color), lw=_WIDTHS[mark.weight], ls=mark.dash or "-",
                     label=mark.label or None)  # fmt: skip
            if mark.text:
                at, coords, ha = ((mark.at / size, 1.0), ("data", "axes fraction"), "center") if mark.upright else (
                    (0.99, mark.at / size), ("axes fraction", "data"), "right")  # fmt: skip
                axes.annotate(mark.text, at, xycoords=coords, color=style.SOFT, xytext=(0, 2),
                              textcoords="offset points", ha=ha)  # fmt: skip
        case Remark():
            apart, side = (-6.0 if mark.left else 6.0, -12.0 if mark.below else 6.0), "right" if mark.left else "left"
            axes.annotate(mark.text, (mark.x / x, mark.y / y), apart, textcoords="offset points", ha=side,
                          fontsize=style.SMALL, color=style.SOFT if mark.soft else style.INK)  # fmt: skip
        case Cells():
            _cells(axes, mark)
        case Limit():
            pass  # drawn after the ends of the axes are known


def _thin(line: Line) -> tuple[Any, Any]:
    """Return the points of a line that a picture can show."""
    if line.marker or len(line.x) <= 2 * _COLUMNS or not np.isfinite(line.y).all():
        return line.x, line.y
    return envelope(line.x, line.y, float(line.x[0]), float(line.x[-1]) + 1e-9, _COLUMNS)


def _bars(axes: Axes, mark: Bars, color: Any, size: float) -> None:
    values = mark.values / size
    how: dict[str, Any] = {"height" if mark.across else "width": mark.width, "color": color}
    (axes.barh if mark.across else axes.bar)(mark.places, values, **how, label=mark.label or None)
    if len(mark.low):
        ends = np.maximum(np.array([values - mark.low / size, mark.high / size - values]), 0.0)
        bars: dict[str, Any] = {"fmt": "none", "ecolor": style.INK, "elinewidth": style.THIN, "capsize": 2.5}
        if mark.across:
            axes.errorbar(values, mark.places, xerr=ends, **bars)
        else:
            axes.errorbar(mark.places, values, yerr=ends, **bars)
    tops = mark.high / size if len(mark.high) else values
    for place, value, text in zip(mark.places, np.maximum(np.fmax(tops, values), 0.0), mark.texts, strict=False):
        at, apart = ((value, place), (3.0, 0.0)) if mark.across else ((place, value), (0.0, 2.0))
        placed: dict[str, Any] = {"va": "center"} if mark.across else {"ha": "center"}
        axes.annotate(text, at, apart, textcoords="offset points", fontsize=style.SMALL, **placed)


def _cells(axes: Axes, mark: Cells) -> None:
    from matplotlib.patches import Rectangle

    for (i, k), fraction in np.ndenumerate(mark.shades):
        fill, ink = style.shade(float(fraction))
        axes.add_patch(Rectangle((k - 0.5, i - 0.5), 1.0, 1.0, fc=fill, ec="white", lw=style.THIN))
        axes.text(k, i, mark.texts[i][k], ha="center", va="center", fontsize=style.SMALL, color=ink)
        if mark.framed[i, k]:
            axes.add_patch(Rectangle((k - 0.46, i - 0.46), 0.92, 0.92, fill=False, lw=style.FRAME,
                                     ec=style.css_of("truth"), zorder=2))  # fmt: skip
    axes.set_xlim(-0.5, mark.values.shape[1] - 0.5)
    axes.grid(False)
    axes.spines[:].set_visible(False)


def _ends(axes: Axes, chart: Chart, x: float, y: float) -> None:
    """Set the ends of both axes."""
    for way, axis, size in (("x", chart.x, x), ("y", chart.y, y)):
        low, high = chart.ends(way == "y")
        if low is not None or high is not None:
            getattr(axes, f"set_{way}lim")(None if low is None else low / size, None if high is None else high / size)
        if axis.names and way == "y":
            axes.set_ylim(len(axis.names) - 0.5, -0.5)
        if not axis.grid:
            axes.grid(False, axis=way)  # type: ignore[arg-type]
    if chart.equal:
        axes.set_aspect("equal")
        axes.locator_params(nbins=6)


def _limit(axes: Axes, limit: Limit, most: float, x: float, y: float) -> None:
    color, height = style.css_of(limit.color), limit.height / y
    if limit.is_far(most):
        axes.plot([], [], color=color, ls="none", marker="v", label=limit.name_in(most))
        return
    if limit.at is None:
        axes.axhline(height, color=color, lw=style.THIN, ls="--", label=limit.label)
    else:
        axes.plot([limit.at / x], [height], color=color, marker="v", ls="none", ms=8.0, clip_on=False,
                  label=limit.label)  # fmt: skip
    axes.set_ylim(top=max(axes.get_ylim()[1], 1.1 * height))


def _ticks(axes: Axes, axis: Axis, size: float, *, upright: bool) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    dim = axes.yaxis if upright else axes.xaxis
    if axis.names:
        places = range(len(axis.names))
        turned = not upright and max(map(len, axis.names)) * len(axis.names) > 46
        how: dict[str, Any] = {"rotation": 25, "ha": "right"} if turned else {}
        (axes.set_yticks if upright else axes.set_xticks)(places, axis.names, **how)
        axes.tick_params(axis="y" if upright else "x", length=0)
    elif axis.ticks:
        dim.set_major_locator(FixedLocator([at / size for at in axis.ticks]))
        dim.set_minor_locator(NullLocator())
        dim.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))
    elif axis.log:
        low, high = dim.get_view_interval()
        at = log_numbers(low, high)
        if len(at) > 1:
            dim.set_major_locator(FixedLocator(list(at)))
            dim.set_minor_locator(NullLocator())
        dim.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}" if 1e-4 <= value < 1e6 else f"{value:.0e}"))
