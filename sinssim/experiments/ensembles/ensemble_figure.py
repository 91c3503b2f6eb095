"""The figures of an ensemble: growth of CEP and R95, cloud of final positions, rates, σ by axis, consistency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array
from sinssim.experiments.ensembles.run_errors import VECTORS
from sinssim.experiments.ensembles.summary import PART_121_HOURS, PART_121_RATE, covariance_at_end
from sinssim.formatting import number_text
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.recording.figures.limits import CIRCLES, Judged, draw_limits, of_quantities
from sinssim.recording.style import COLORS, css
from sinssim.scales import ANGLES, LENGTHS, SPEEDS, suiting, time_unit
from sinssim.statistics.circles import circle_radius
from sinssim.statistics.order_statistics import cep, r95
from sinssim.statistics.rates import to_nmi_h
from sinssim.statistics.requirements.requirement import COMPONENTS
from sinssim.units import NAUTICAL_MILE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from sinssim.experiments.ensembles.result import EnsembleResult, MeanSquare

_DOTS = 5000
"""Most runs drawn as dots."""
_LIMIT_SHOWN = 3.0
"""A limit is drawn if it is less than this multiple of the largest value."""


@styled
def overview(result: EnsembleResult) -> Figure:
    """Draw growth of CEP and R95 beside the cloud of final positions: the figure for a paper.

    Args:
        result: the ensemble.

    Returns:
        The figure.
    """
    figure = new_figure(9.0, 3.9)
    left, right = figure.subplots(1, 2, width_ratios=[5, 4])
    _growth(left, result)
    _cloud(right, result)
    return figure


@styled
def growth(result: EnsembleResult) -> Figure:
    """Draw CEP and R95 over time with their bands, and the limit of the regulation.

    Args:
        result: the ensemble.

    Returns:
        The figure.
    """
    figure = new_figure(8.0, 4.0)
    _growth(figure.subplots(), result)
    return figure


@styled
def cloud(result: EnsembleResult) -> Figure:
    """Draw the final positions of the runs with circles of CEP and R95 and the ellipse of their covariance.

    Args:
        result: the ensemble.

    Returns:
        The figure.
    """
    figure = new_figure(5.6, 5.0)
    _cloud(figure.subplots(), result)
    return figure


@styled
def rates(result: EnsembleResult) -> Figure:
    """Draw histograms of the rate of each run in both definitions.

    Args:
        result: the ensemble.

    Returns:
        The figure.
    """
    figure = new_figure(8.0, 3.2)
    panels = figure.subplots(1, 2, sharey=True)
    pairs = ((result.mean_rates, "line through the origin, Σ t r / Σ t²"), (result.end_rates, "at the end, r(T) / T"))
    for axes, (values, title) in zip(panels, pairs, strict=True):
        rate = to_nmi_h(values)
        finite = rate[np.isfinite(rate)]
        axes.set_title(title)
        axes.set_xlabel("rate [nmi/h]")
        axes.grid(False, axis="x")
        if not len(finite):
            continue
        axes.hist(finite, bins="auto" if len(finite) > 20 else 10, color=css(COLORS["run"]), edgecolor="white")
        for found, name in ((cep(rate), "cep"), (r95(rate), "r95")):
            if np.isfinite(found.value):
                label = f"{_LABELS[name]} {number_text(float(found.value))} nmi/h"
                axes.axvline(float(found.value), color=css(COLORS[name]), label=label)
                top = float(found.high) if np.isfinite(found.high) else finite.max()
                _band(axes, [max(float(found.low), 0.0), top], [0.0, 0.0], [1.0, 1.0], css(COLORS[name]), across=True)
        axes.set_xlim(left=0.0)
        axes.locator_params(axis="x", nbins=6)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
    panels[0].set_ylabel("runs")
    panels[0].locator_params(axis="y", integer=True)
    return figure


@styled
def components(result: EnsembleResult, predicted: Array | None = None) -> Figure:
    """Draw σ over the runs of each component of position, velocity and attitude, with its standard error.

    The σ that a filter states, root mean square over the runs, is drawn beside it.

    Args:
        result: the ensemble.
        predicted: σ by another method, such as the propagation of covariances, (K, 9) in the order of position,
            velocity and attitude, north, east, down: m, m/s, rad.

    Returns:
        The figure.
    """
    figure = new_figure(9.0, 6.6)
    grid = figure.subplots(3, 3, sharex=True)
    name, size = time_unit(float(result.elapsed[-1]))
    time, limits = result.elapsed / size, list[Any]()
    rows = zip(VECTORS, units_of(result), _TITLES, strict=True)
    for row, (quantity, (unit, factor), title) in enumerate(rows):
        found = result.spread(quantity)
        claimed = result.stated(quantity)
        other = None if predicted is None else predicted[:, 3 * row : 3 * row + 3]
        for column, axis in enumerate(("north", "east", "down")):
            axes = grid[row, column]
            sigma, error, mean = (v[:, column] for v in (found.sigma, found.standard_error, found.mean))
            lines = [sigma, mean, *(v[:, column] for v in (claimed, other) if v is not None)]
            finite = [v[np.isfinite(v)] for v in lines]
            color = css(COLORS[axis])
            _band(axes, time, (sigma - 1.96 * error) / factor, (sigma + 1.96 * error) / factor, color)
            axes.plot(time, sigma / factor, color=color, label="σ of the runs, ± 1.96 standard errors")
            if claimed is not None:
                axes.plot(time, claimed[:, column] / factor, color=style.INK, linestyle="--", linewidth=style.THIN,
                          label="σ stated by the filter")  # fmt: skip
            if other is not None:
                apart = (
                    style.INK if claimed is None else css(COLORS["smoothed"])
                )  # on the filter's own where they agree
                axes.plot(time, other[:, column] / factor, color=apart, linestyle=":",
                          label="σ predicted by the budget")  # fmt: skip
            axes.plot(time, mean / factor, color=style.SOFT, linewidth=style.THIN, label="mean of the runs")
            axes.set_title(f"{title}, {axis} [{unit}]")
            judged = of_quantities(judged_of(result), [COMPONENTS[3 * row + column]])
            most = max((float(np.abs(v).max(initial=0.0)) for v in finite), default=0.0)
            end = float(result.elapsed[-1])
            limits += draw_limits(axes, judged, most, factor, size, end)
    for axes in grid[-1]:
        axes.set_xlabel(f"time [{name}]")
    handles = [one for one in grid[0, 0].get_legend_handles_labels()[0] if one not in limits] + limits
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


@styled
def consistency(result: EnsembleResult, squares: Mapping[str, MeanSquare], title: str) -> Figure:
    """Draw mean normalised squares over the runs with their χ² bands.

    Args:
        result: the ensemble.
        squares: by block or sensor.
        title: quantity, for the axes.

    Returns:
        The figure.
    """
    columns = 2 if len(squares) > 1 else 1
    lines = -(-len(squares) // columns)
    figure = new_figure(4.4 * columns, 0.5 + 1.75 * lines)
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True)
    name, size = time_unit(float(result.elapsed[-1]))
    for axes in grid.flat[len(squares) :]:
        axes.remove()
    for axes, one in zip(grid.flat, squares.values(), strict=False):
        there = np.isfinite(one.value)
        time = result.elapsed[there] / size
        band = [np.broadcast_to(end, one.value.shape)[there] for end in (one.band.low, one.band.high)]
        _band(axes, time, band[0], band[1], css(COLORS["bound"]))
        color = css(style.colors([one.name])[0])
        axes.plot(time, one.value[there], color=color, linewidth=style.THIN)
        axes.axhline(1.0, color=style.SOFT, linewidth=style.HAIR)
        axes.set_title(one.name)
        axes.set_ylabel(title)
        axes.set_ylim(bottom=0.0)
    for axes in figure.axes[-columns:]:
        axes.set_xlabel(f"time [{name}]")
        axes.tick_params(labelbottom=True)
    return figure


def judged_of(result: EnsembleResult) -> Judged:
    """Return the requirements of an ensemble with their verdicts, as figures take them."""
    return [(one.requirement, one.verdict) for one in result.verdicts]


_LABELS = {"cep": "CEP", "r95": "R95"}
_TITLES = ("position", "velocity", "attitude φ")


def _band(axes: Axes, x: ArrayLike, low: ArrayLike, high: ArrayLike, color: str, across: bool = False) -> None:
    """Draw a band between two lines; with `across`, over the whole height of the plot."""
    transform: dict[str, Any] = {"transform": axes.get_xaxis_transform()} if across else {}
    axes.fill_between(x, low, high, color=color, alpha=0.25, lw=0, **transform)


def units_of(result: EnsembleResult) -> list[tuple[str, float]]:
    """Return the units of positions, velocities and attitudes in all figures and tables of an ensemble.

    Args:
        result: the ensemble.

    Returns:
        Name and size in SI of each.
    """
    circles = (result.r95.value, result.cep.value, result.errors.final[:, :2])
    found = []
    for quantity, scale in zip(VECTORS, (LENGTHS, SPEEDS, ANGLES), strict=True):
        spread = result.spread(quantity)
        values = (spread.sigma, spread.mean, *(circles if scale is LENGTHS else ()))
        found.append(suiting(scale, *(v[np.isfinite(v)] for v in values)))
    return found


def _growth(axes: Axes, result: EnsembleResult) -> None:
    name, size = time_unit(float(result.elapsed[-1]))
    time = result.elapsed / size
    drawn = {"r95": result.r95, "cep": result.cep}
    finite = [v.value[np.isfinite(v.value)] for v in drawn.values()]
    (unit, factor), *_ = units_of(result)
    largest = max((float(v.max()) for v in finite if len(v)), default=1.0)
    top = 0.0
    for key, found in drawn.items():
        low, high = (np.where(np.isfinite(v), v, np.nan) for v in (found.low, found.high))
        color = css(COLORS[key])
        _band(axes, time, np.maximum(low, 0.0) / factor, high / factor, color)
        end = float(found.value[-1])
        label = f"{_LABELS[key]}, at the end {number_text(end / factor)} {unit}"
        if not np.isfinite(end):
            label = f"{_LABELS[key]} is infinite: too many runs failed"
        axes.plot(time, np.where(np.isfinite(found.value), found.value, np.nan) / factor, color=color, label=label)
        top = max(top, *(float(np.max(v[np.isfinite(v)], initial=0.0)) for v in (high, found.value)))
    limit = PART_121_RATE * NAUTICAL_MILE / 3600.0 * result.elapsed
    near = not result.plan.filtered and largest > 0.0 and float(limit[-1]) < _LIMIT_SHOWN * largest
    if result.elapsed[-1] <= PART_121_HOURS * 3600.0 and near:
        axes.plot(time, limit / factor, color=css(COLORS["limit"]), linestyle="--", linewidth=style.THIN,
                  label="2 nmi/h, limit of R95 (14 CFR 121 App. G)")  # fmt: skip
        top = max(top, float(limit[-1]))
    axes.set_xlabel(f"time [{name}]")
    axes.set_ylabel(f"horizontal error [{unit}]")
    axes.set_title(f"{len(result)} runs, 95 % bands")
    axes.set_ylim(0.0, 1.25 * top / factor if top > 0.0 else 1.0)  # with room for the legend
    draw_limits(axes, of_quantities(judged_of(result), CIRCLES), top, factor, size, float(result.elapsed[-1]))
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.legend(loc="upper left")


def _cloud(axes: Axes, result: EnsembleResult) -> None:
    final = result.errors.final[~result.failed][:, [1, 0]]  # east to the right, north up
    circles: list[tuple[str, Any]] = [("r95", r95(result.final_horizontal)), ("cep", cep(result.final_horizontal))]
    radii = [float(found.value) for _, found in circles if np.isfinite(found.value)]
    reach = max([*radii, float(np.abs(final).max()) if len(final) else 0.0, 1e-3])
    (unit, factor), *_ = units_of(result)
    shown = final[:_DOTS]
    size = 2.5 if len(shown) > 200 else 4.5
    axes.plot(shown[:, 0] / factor, shown[:, 1] / factor, ".", color=css(COLORS["run"]), markersize=size, zorder=1)
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    p = covariance_at_end(result)
    for key, found in circles:
        radius = float(found.value)
        if np.isfinite(radius):
            axes.plot(
                radius * np.sin(angle) / factor, radius * np.cos(angle) / factor, color=css(COLORS[key]),
                label=f"{_LABELS[key]} {number_text(radius / factor)} {unit}",
            )  # fmt: skip
    if np.isfinite(p).all():
        root, vectors = np.linalg.eigh(p)
        ring = vectors @ (np.sqrt(np.maximum(root, 0.0))[:, None] * np.array([np.cos(angle), np.sin(angle)]))
        k = float(np.sqrt(-2.0 * np.log(0.05)))
        axes.plot(k * ring[1] / factor, k * ring[0] / factor, color=style.INK, linestyle="--", linewidth=style.THIN,
                  label="95 % ellipse of the covariance")  # fmt: skip
        normal = float(circle_radius(p, 0.95)) / factor
        axes.plot(normal * np.sin(angle), normal * np.cos(angle), color=style.INK, linestyle=":",
                  label=f"95 % circle of the covariance {number_text(normal)} {unit}")  # fmt: skip
        reach = max(reach, k * float(np.sqrt(max(root.max(), 0.0))))
    axes.set_aspect("equal")
    axes.set_xlim(-1.05 * reach / factor, 1.05 * reach / factor)
    axes.set_ylim(-1.05 * reach / factor, 1.05 * reach / factor)
    axes.set_xlabel(f"east [{unit}]")
    axes.set_ylabel(f"north [{unit}]")
    axes.set_title("errors at the end")
    if not axes.get_legend_handles_labels()[0]:
        axes.set_title("errors at the end: every run failed, or too many for a circle")
        return
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, columnspacing=1.2, handlelength=1.6)
