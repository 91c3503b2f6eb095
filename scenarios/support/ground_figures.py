"""Figures of the ground study: maps of the heading error, budgets, session lengths, the disturbed base."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from sinssim.alignment.alignment_budget import Method
from sinssim.alignment.parked_theory import Angles, Array, Attitude
from sinssim.analyses.alignment_result import bars, curves
from sinssim.charts import Axis, Chart, Charts, Histogram, Line, Mark
from sinssim.recording import style
from sinssim.recording.figures import figure_of, new_figure, styled
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.units import ARCMIN, DEG, fixed

_THRESHOLD = style.css(style.COLORS["quaternion"])  # light blue: visible on the colours of the map
_COLORS = {name: style.css(style.COLORS[name]) for name in Angles._fields}


@styled
def heading_map(heading: ArrayLike, latitude: ArrayLike, sigma: ArrayLike, title: str) -> Figure:
    """Draw the heading's standard deviation over heading and latitude.

    Args:
        heading: (n,) rad.
        latitude: (m,) rad.
        sigma: (m, n) rad.
        title: title of the figure.

    Returns:
        The figure.
    """
    figure = new_figure(7.5, 4.8)
    axes = figure.add_subplot()
    axes.grid(False)
    values = np.asarray(sigma) / ARCMIN
    mesh = axes.pcolormesh(
        np.asarray(heading) / DEG,
        np.asarray(latitude) / DEG,
        values,
        norm=LogNorm(),
        cmap="viridis",
        shading="nearest",
        rasterized=True,
    )
    low, high = np.log10(values.min()), np.log10(values.max())
    levels = [
        base * 10.0**power
        for power in range(int(np.floor(low)), int(np.ceil(high)) + 1)
        for base in (1.0, 2.0, 3.0, 5.0)
        if low < np.log10(base) + power < high - 0.15  # room for the labels at the edges
    ]
    lines = axes.contour(
        np.asarray(heading) / DEG,
        np.asarray(latitude) / DEG,
        values,
        levels=levels,
        colors="white",
        linewidths=style.THIN,
    )
    axes.clabel(lines, fmt=lambda value: f"{value:g}′")
    bar = figure.colorbar(mesh, ax=axes, label="σ of the heading [arcmin]")
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    bar.ax.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "235" else "")
    axes.set(xlabel="heading [°]", ylabel="latitude [°]", title=title, xticks=np.arange(0, 361, 45))
    return figure


def budget_bars(budget: dict[str, Angles], title: str) -> Figure:
    """Draw the error budget: a bar for every source and angle.

    Args:
        budget: by source, standard deviations of one vehicle, rad.
        title: title of the figure.

    Returns:
        The figure.
    """
    return figure_of(Charts("budget", (bars(budget),), (10.0, 5.0), title))


def session_curves(
    attitude: Attitude,
    latitude: ArrayLike,
    sigmas: dict[str, ImuErrors],
    title: str,
    *,
    shown: tuple[str, ...] = ("heading", "latitude"),
    method: Method = "quiet",
) -> Figure:
    """Draw standard deviations against session length: the total, and the part that does not average out.

    Args:
        attitude: of one vehicle, rad.
        latitude: rad.
        sigmas: by name, standard deviations of sensor blocks.
        title: title of the figure.
        shown: angles, a panel each.
        method: "quiet" or "disturbed".

    Returns:
        The figure.
    """
    lines = curves(shown, attitude, latitude, sigmas, method)
    return figure_of(Charts("length", (lines,), (5.2 * len(shown), 4.4), title, legend="below"))


@styled
def validity_map(
    x: ArrayLike,
    y: ArrayLike,
    departures: dict[str, Array],
    linear: NDArray[np.bool_],
    threshold: float,
    xlabel: str,
    ylabel: str,
) -> Figure:
    """Draw the deviation of draws through eq. (1) from the first-order theory, on logarithmic axes.

    Args:
        x: (n,) in the units of `xlabel`.
        y: (m,) in the units of `ylabel`.
        departures: by panel, relative deviation of σ from the theory, (m, n).
        linear: where a million draws cannot tell the two apart, (m, n).
        threshold: deviation that is drawn as a line.
        xlabel, ylabel: axis labels with units.

    Returns:
        The figure.
    """
    figure = new_figure(5.2 * len(departures), 4.6)
    panels = np.atleast_1d(figure.subplots(1, len(departures), sharey=True))
    norm = LogNorm(1e-4, 1.0)
    for panel, (name, departure) in zip(panels, departures.items(), strict=True):
        values = np.abs(departure)
        panel.grid(False)
        panel.pcolormesh(x, y, values, norm=norm, cmap="magma_r", shading="nearest", rasterized=True)
        panel.contour(x, y, values, levels=[threshold], colors=_THRESHOLD, linewidths=style.LINE)
        panel.contour(
            x, y, linear.astype(float), levels=[0.5], colors=_COLORS["latitude"], linewidths=style.LINE, linestyles="--"
        )
        panel.set(xlabel=xlabel, title=f"σ of the {name}", xscale="log", yscale="log")
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_formatter(lambda value, _: f"{value:g}")
    panels[0].set_ylabel(ylabel)
    panels[0].plot([], [], color=_THRESHOLD, label=f"deviation of {100 * threshold:g} %")
    panels[0].plot([], [], color=_COLORS["latitude"], ls="--", label="linear up to a million draws (left of line)")
    panels[0].legend(loc="lower right", frameon=True, framealpha=0.95, edgecolor="none")
    label = "|σ of the draws / σ of the theory − 1|"
    bar = figure.colorbar(ScalarMappable(norm, "magma_r"), ax=list(panels), label=label, extend="both")
    bar.ax.axhline(threshold, color=_THRESHOLD)
    figure.suptitle("Validity of the first-order theory")
    return figure


def disturbed_comparison(
    quiet_sigma: float, cone_sigma: float, cone_errors: Array, mean_errors: Array, title: str
) -> Figure:
    """Draw heading errors on a disturbed base: those of the cone and of eq. (1) for the same data.

    Args:
        quiet_sigma: σ of eq. (1) on a quiet base, rad.
        cone_sigma: σ of the cone's heading, predicted, rad.
        cone_errors: of many runs, rad.
        mean_errors: eq. (1)'s, of the same runs, rad.
        title: title of the figure.

    Returns:
        The figure.
    """
    cone = Histogram(values=cone_errors, color="bound")
    width = float(np.diff(cone.counted[0])[0])
    error = np.linspace(-4.0 * cone_sigma, 4.0 * cone_sigma, 400)
    theories = (
        Line(label=label, x=error, y=len(cone_errors) * width * density(error, sigma), color=color)
        for sigma, color, label in (
            (cone_sigma, "heading", "theory of the cone"), (quiet_sigma, "ink", "eq. (1) on a quiet base, theory"),
        )
    )  # fmt: skip
    equation = Histogram(values=mean_errors, color="roll")

    def chart(title: str, unit: str, size: float, *marks: Mark) -> Chart:
        x, y = Axis(label="heading error", units=fixed(unit, size)), Axis(label="runs", low=0.0)
        return Chart(key=unit, title=title, x=x, y=y, marks=marks, room=1.35)  # for the legend

    charts = (chart("gravity's cone in inertial space", "arcmin", ARCMIN, cone, *theories),
              chart("eq. (1) on the same data", "°", DEG, equation))  # fmt: skip
    return figure_of(Charts("disturbed_base", (charts,), (9.0, 4.2), title))


def density(error: Array, sigma: float) -> Array:
    """Return the density of normal errors with a standard deviation, 1/rad."""
    return np.asarray(np.exp(-0.5 * (error / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi)))
