"""The figures of a study's report."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.algorithms import family
from sinssim.experiments.studies.naming import Label, line_labeller
from sinssim.experiments.studies.results import ErrorGrowth, Order, Row, StudyResult
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.recording.style import COLORS, colors, css

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Paint = Mapping[str, str]
"""CSS colour of each line by its name."""

_MARKERS = {"1": "o", "1p": "P", "2": "s", "3": "^", "4": "D"}
_FLOOR = 1e-16  # smaller numbers are drawn as this one, because a logarithmic axis has no zero
_NANOMETRE = 1e-9  # rounding error of a position
_COLUMNS = 3  # panels side by side; with more, their text would be too small to read


def palette(comparison: StudyResult) -> dict[str, str]:
    """Return the colours of a study's lines; a name has the same colour in all figures and panels.

    Args:
        comparison: the study.

    Returns:
        CSS colour by name.
    """
    names: dict[str, None] = {}
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        names |= dict.fromkeys(map(line_labeller(part, rows), rows))
    return {name: css(color) for name, color in zip(names, colors(list(names)), strict=True)}


def color_of(algorithm: str) -> str:
    """Return the colour of an algorithm, which is the same everywhere.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        "#rrggbb".
    """
    return css(colors([algorithm])[0])


def _line(name: str, color: str) -> dict[str, Any]:
    """Return the line style: marker by order, dashed and hollow if corrected after each step."""
    order = re.search(r"-(\d+p?)", name)
    corrected = name.endswith(("-ortho", "-norm"))
    return {
        "color": color,
        "marker": _MARKERS.get(order[1] if order else "", "*" if family(name) in COLORS else "o"),
        "linestyle": "--" if corrected else "-",
        "markerfacecolor": "white" if corrected else color,
        "zorder": 2.5 if corrected else 2.0,
    }


def _rate_axis(axes: Axes, rates: Sequence[float]) -> None:
    from matplotlib.ticker import FixedLocator, NullLocator

    axes.set_xscale("log")
    shown = [rates[0]]
    for rate in rates[1:]:
        if np.log(rate / shown[-1]) > 0.08 * np.log(rates[-1] / rates[0]):
            shown.append(rate)
    axes.xaxis.set_major_locator(FixedLocator(shown))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([f"{rate:g}" for rate in shown])
    axes.set_xlabel("sample rate [Hz]")


def _cost_axis(axes: Axes) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("processor time per second of motion [µs]")


def _panels(motions: Sequence[str], quantities: int, names: int) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure, and its axes by quantity and motion; motions beyond `_COLUMNS` continue below."""
    columns = min(len(motions), _COLUMNS)
    bands = -(-len(motions) // columns)
    height = max(3.2 * quantities * bands, 0.6 + 0.165 * names)
    figure = new_figure(max(3.3 * columns, 6.0) + 2.2, height)
    every = figure.subplots(quantities * bands, columns, squeeze=False)
    panels = [[every[quantities * (m // columns) + q, m % columns] for m in range(len(motions))]
              for q in range(quantities)]  # fmt: skip
    for line in panels:
        for axes in line[1:]:
            axes.sharey(line[0])
    for axes in set(every.flat) - {axes for line in panels for axes in line}:
        axes.remove()
    return figure, panels


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", handlelength=2.4)


_QUANTITIES = (
    ("max_attitude_error_arcsec", "largest attitude error [″]"),
    ("max_horizontal_error_m", "largest horizontal error [m]"),
)


@styled
def against_rate(rows: Sequence[Row], label: Label, paint: Paint) -> Figure:
    """Draw errors over the sample rate: a column for each motion, a line for each algorithm or other varied choice.

    Args:
        rows: rows of one part.
        label: returns the name of a line.
        paint: colours by name.

    Returns:
        The figure.
    """
    return _lines(rows, label, paint, _QUANTITIES, "rate")


@styled
def against_cost(rows: Sequence[Row], label: Label, paint: Paint) -> Figure:
    """Draw errors over the processor time per second of motion.

    Args:
        rows: rows of one part.
        label: returns the name of a line.
        paint: colours by name.

    Returns:
        The figure.
    """
    return _lines(rows, label, paint, _QUANTITIES[:1], "cost")


@styled
def defect_against_rate(rows: Sequence[Row], label: Label, paint: Paint) -> Figure:
    """Draw the loss of norm or orthogonality over the sample rate.

    Args:
        rows: rows of one part.
        label: returns the name of a line.
        paint: colours by name.

    Returns:
        The figure.
    """
    kept = [row for row in rows if row.max_defect > 0.0]
    return _lines(kept, label, paint, (("max_defect", "largest defect of norm\nor orthogonality"),), "rate")


def _lines(rows: Sequence[Row], label: Label, paint: Paint, quantities: Sequence[tuple[str, str]], over: str) -> Figure:
    motions = list(dict.fromkeys(row.motion for row in rows))
    names = list(dict.fromkeys(label(row) for row in rows))
    figure, grid = _panels(motions, len(quantities), len(names))
    rates = sorted({row.rate_hz for row in rows})
    for column, motion in enumerate(motions):
        for line, (quantity, title) in enumerate(quantities):
            axes = grid[line][column]
            for name in names:
                found = [r for r in rows if r.motion == motion and label(r) == name and r.status == "done"]
                found.sort(key=lambda r: r.rate_hz)
                x = [r.rate_hz if over == "rate" else r.rate_hz * r.ns_per_step * 1e-3 for r in found]
                y = [max(getattr(r, quantity), _FLOOR) for r in found]
                axes.plot(x, y, label=name, **_line(name, paint[name]))
            axes.set_yscale("log")
            if over == "rate":
                _rate_axis(axes, rates)
            else:
                _cost_axis(axes)
            if line == 0:
                axes.set_title(motion)
            if column % _COLUMNS == 0:
                axes.set_ylabel(title)
            else:
                axes.tick_params(labelleft=False)
            if quantity == "max_attitude_error_arcsec" and len({r.algorithm for r in rows}) > 1:
                axes.axhline(18.0, color=style.SOFT, linewidth=style.THIN, linestyle=":")
                if column == 0:
                    axes.annotate(
                        "0.3′", (0.99, 18.0), xycoords=("axes fraction", "data"), color=style.SOFT,
                        xytext=(0, 2), textcoords="offset points", ha="right",
                    )  # fmt: skip
    _legend(figure, grid[0][0])
    return figure


@styled
def bars(rows: Sequence[Row], label: Label, line: Label, paint: Paint) -> Figure:
    """Draw errors as bars, for comparisons at one rate.

    Args:
        rows: rows of one part.
        label: returns the name of a bar.
        line: returns the name of the bar's line over time, whose colour it shares.
        paint: colours of lines by name.

    Returns:
        The figure.
    """
    from matplotlib.ticker import NullLocator

    done = [row for row in rows if row.status == "done"]
    motions = list(dict.fromkeys(row.motion for row in done))
    names = list(dict.fromkeys(label(row) for row in rows))
    columns = min(len(motions), _COLUMNS)
    lines = -(-len(motions) // columns)
    figure = new_figure(max(7.5, 2.4 + 3.2 * columns), lines * (1.0 + 0.24 * len(names)) + 0.4)
    grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
    for axes in grid.flat[len(motions) :]:
        axes.remove()
    for axes, motion in zip(grid.flat, motions, strict=False):
        for row in (r for r in done if r.motion == motion):
            place = names.index(label(row))
            value = max(row.max_horizontal_error_m, _FLOOR)
            axes.barh(place, value, color=paint[line(row)], height=0.7)
            axes.annotate(_short(value), (value, place), xytext=(3, 0), textcoords="offset points", va="center")
        values = [max(row.max_horizontal_error_m, _FLOOR) for row in done if row.motion == motion]
        low, high = np.floor(np.log10(min(values)) - 0.3), np.ceil(np.log10(max(values)))
        axes.set_xscale("log")
        axes.set_xlim(10.0**low, 10.0 ** (high + 0.18 * (high - low)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.tick_params(axis="y", length=0)
        axes.grid(False, axis="y")
        axes.set_title(motion)
        axes.set_xlabel("largest horizontal error [m]")
    return figure


@styled
def growth(panels: Mapping[str, Sequence[tuple[str, ErrorGrowth]]], paint: Paint) -> Figure:
    """Draw the horizontal error over time, both logarithmic, so that a power of time is a straight line.

    Args:
        panels: by motion, names of lines and the growth of their errors.
        paint: colours of lines by name.

    Returns:
        The figure.
    """
    columns = min(len(panels), _COLUMNS)
    lines = -(-len(panels) // columns)
    names = dict.fromkeys(name for drawn in panels.values() for name, _ in drawn)
    figure = new_figure(max(3.3 * columns, 5.5) + 2.6, max(3.0 * lines, 0.6 + 0.165 * len(names)))
    grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    for axes, (motion, drawn) in zip(grid.flat, panels.items(), strict=False):
        for name, history in drawn:
            axes.plot(
                history.time[1:] - history.time[0],
                np.maximum(history.horizontal[1:], _NANOMETRE),
                label=name,
                color=paint[name],
            )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_title(motion)
        axes.set_xlabel("time [s]")
    for axes in grid[:, 0]:
        axes.set_ylabel("horizontal error [m]")
    handles = {
        label: line for axes in figure.axes for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside right center", handlelength=2.4)
    return figure


def _short(value: float) -> str:
    if not 1e-3 <= value < 1e7:
        return f"{value:.1e}"
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


@styled
def costs(comparison: StudyResult) -> Figure:
    """Draw the cost of one step of each algorithm, frame and schedule: operations, and processor time.

    Args:
        comparison: the study.

    Returns:
        The figure.
    """
    measured = list(comparison.costs.values())
    several = [key for key in ("frame", "pace") if len({getattr(cost, key) for cost in measured}) > 1]
    names = [" · ".join([cost.algorithm, *(getattr(cost, key) for key in several)]) for cost in measured]
    figure = new_figure(8.5, 0.9 + 0.24 * len(names))
    left, right = figure.subplots(1, 2, sharey=True)
    colors = [color_of(cost.algorithm) for cost in measured]
    for axes, values, title in (
        (left, [cost.operations.total for cost in measured], "floating-point operations per step"),
        (right, [cost.ns_per_step for cost in measured], "processor time per step [ns]"),
    ):
        axes.barh(range(len(names)), values, color=colors, height=0.7)
        for place, value in enumerate(values):
            axes.annotate(f"{value:.0f}", (value, place), xytext=(3, 0), textcoords="offset points", va="center")
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(0.0, 1.12 * max(values, default=1.0))
        axes.tick_params(axis="y", length=0)
        axes.grid(False, axis="y")
        axes.set_xlabel(title)
    return figure


@styled
def orders(fits: Sequence[Order]) -> Figure:
    """Draw fitted orders of convergence of the attitude: a row for each algorithm, a mark for each motion.

    Args:
        fits: orders of one part for one quantity.

    Returns:
        The figure.
    """
    names = list(dict.fromkeys(order.algorithm for order in fits))
    motions = list(dict.fromkeys(order.motion for order in fits))
    figure = new_figure(7.5, 1.1 + 0.24 * len(names))
    axes = figure.subplots()
    shapes = "os^Dv"
    for number, motion in enumerate(motions):
        here = [order for order in fits if order.motion == motion]
        axes.errorbar(
            [order.order for order in here],
            [names.index(order.algorithm) for order in here],
            xerr=[order.uncertainty for order in here],
            fmt="none",
            ecolor=style.SOFT,
            elinewidth=style.THIN,
        )
        axes.scatter(
            [order.order for order in here],
            [names.index(order.algorithm) for order in here],
            c=[color_of(order.algorithm) for order in here],
            marker=shapes[number % len(shapes)],
            edgecolors=style.INK,
            linewidths=style.THIN,
            s=34,
            zorder=3,
        )
        axes.scatter(
            [], [], c=css(COLORS["bound"]), marker=shapes[number % len(shapes)], edgecolors=style.INK, label=motion
        )
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    top = max([order.order for order in fits], default=4.0)
    axes.set_xticks(range(int(np.ceil(top)) + 2))
    axes.set_xlim(0.0, top + 0.7)
    axes.set_xlabel("order of convergence of the attitude: error ~ intervalᵖ, p")
    if len(motions) > 1:
        figure.legend(loc="outside right center")
    return figure
