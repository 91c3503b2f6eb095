"""Figures of the parked-vehicle theory, for reports: every axis with its unit, drawn without a display."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.alignment.axes import Angles, Array, Attitude
from sinssim.alignment.budget import AVERAGED, SOURCES, Method, bias_takes_over, error_budget, total
from sinssim.errors import InputError, RunError
from sinssim.units import ARCMIN, ARCSEC, DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sinssim.alignment.report import AlignmentReport
    from sinssim.sensors.imu_errors import ImuErrors

# Okabe and Ito's colours, told apart by everybody
_COLORS = {"heading": "#0072B2", "roll": "#E69F00", "pitch": "#CC79A7", "latitude": "#009E73"}
_GREY = "#666666"
FORMATS = (".svg", ".png", ".pdf")
"""What figures can be written as."""


def check_format(path: Path) -> None:
    """Refuse a figure that cannot be written, before work is put into it.

    Args:
        path: .svg, .png or .pdf.

    Raises:
        InputError: another kind of file.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: a figure is written as {', '.join(FORMATS)}.")


def save(figure: Figure, path: Path) -> None:
    """Write a figure, beside its place first and then renamed into it.

    Args:
        figure: the figure.
        path: .svg, .png or .pdf.

    Raises:
        InputError: another kind of file.
        RunError: the file cannot be written.
    """
    check_format(path)
    import matplotlib

    draft = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with matplotlib.rc_context({"svg.hashsalt": "sinssim", "svg.fonttype": "none"}):
            stamp: dict[str, Any] = {"Date": None} if path.suffix.lower() == ".svg" else {}
            figure.savefig(draft, format=path.suffix[1:].lower(), dpi=150, metadata=stamp or None)
        os.replace(draft, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error


def _figure(width: float, height: float) -> Figure:
    from matplotlib.figure import Figure as NewFigure

    return NewFigure(figsize=(width, height), layout="constrained")


def heading_map(heading: ArrayLike, latitude: ArrayLike, sigma: ArrayLike, title: str) -> Figure:
    """Draw the heading's standard deviation over heading and latitude.

    Args:
        heading: (n,) rad.
        latitude: (m,) rad.
        sigma: (m, n) rad.
        title: what it is of.

    Returns:
        The figure.
    """
    from matplotlib.colors import LogNorm

    figure = _figure(7.5, 4.8)
    axes = figure.add_subplot()
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
        for base in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
        if low < np.log10(base) + power < high
    ]
    lines = axes.contour(
        np.asarray(heading) / DEG, np.asarray(latitude) / DEG, values, levels=levels, colors="white", linewidths=0.8
    )
    axes.clabel(lines, fmt=lambda value: f"{value:g}′", fontsize=9)
    bar = figure.colorbar(mesh, ax=axes, label="σ of the heading, arcmin")
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    bar.ax.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "235" else "")
    axes.set(xlabel="heading, °", ylabel="latitude, °", title=title, xticks=np.arange(0, 361, 45))
    return figure


def budget_bars(budget: dict[str, Angles], title: str) -> Figure:
    """Draw the error budget: a bar for every source and angle.

    Args:
        budget: by source, standard deviations of one vehicle, rad.
        title: what it is of.

    Returns:
        The figure.
    """
    figure = _figure(10.0, 5.0)
    _bars(budget, list(figure.subplots(1, 4, sharey=True)))
    figure.suptitle(title)
    return figure


def _bars(budget: dict[str, Angles], panels: list[Axes]) -> None:
    shown = [source for source in SOURCES if any(float(value) > 0.0 for value in budget[source])]
    everything = total(budget)
    labels = [*shown, "all together"]
    rows = np.arange(len(labels))[::-1]
    for panel, name in zip(panels, Angles._fields, strict=True):
        largest = float(getattr(everything, name))
        unit, word = (ARCMIN, "arcmin") if largest > ARCMIN else (ARCSEC, "arcsec")
        values = [*(float(getattr(budget[source], name)) / unit for source in shown), largest / unit]
        colors = [_COLORS[name]] * len(shown) + [_GREY]
        panel.barh(rows, values, color=colors)
        room = max(values) or 1.0
        for row, value in zip(rows, values, strict=True):
            text = f"{value:.2f}" if value >= 0.005 * room else ("" if value == 0.0 else f"{value:.1g}")
            panel.text(value + 0.02 * room, row, text, va="center", fontsize=8)
        panel.set(xlim=(0.0, 1.28 * room), xlabel=f"σ, {word}", title=name, yticks=rows, yticklabels=labels)
        panel.spines[["top", "right"]].set_visible(False)


def session_curves(
    attitude: Attitude,
    latitude: ArrayLike,
    sigmas: dict[str, ImuErrors],
    title: str,
    *,
    shown: tuple[str, ...] = ("heading", "latitude"),
    method: Method = "quiet",
) -> Figure:
    """Draw standard deviations against session length: all together, and the part that no session averages.

    Args:
        attitude: of one vehicle, rad.
        latitude: rad.
        sigmas: by name, standard deviations of sensor blocks.
        title: what it is of.
        shown: angles, a panel each.
        method: "quiet" or "disturbed".

    Returns:
        The figure.
    """
    figure = _figure(5.2 * len(shown), 4.4)
    panels = np.atleast_1d(figure.subplots(1, len(shown)))
    for panel, name in zip(panels, shown, strict=True):
        _curves(panel, name, attitude, latitude, sigmas, method)
    figure.suptitle(title)
    return figure


def _curves(
    panel: Axes, name: str, attitude: Attitude, latitude: ArrayLike, sigmas: dict[str, ImuErrors], method: Method
) -> None:
    """Draw one angle's curves, a mark where bias takes over."""
    from matplotlib.ticker import LogLocator, NullFormatter

    time = np.geomspace(1.0, 2e4, 200)
    steady = tuple(source for source in SOURCES if source not in AVERAGED)
    k = Angles._fields.index(name)
    unit, word = (ARCMIN, "arcmin") if name in ("heading", "latitude") else (ARCSEC, "arcsec")
    palette = list(_COLORS.values())
    for index, (label, sigma) in enumerate(sigmas.items()):
        color = palette[index % len(palette)]
        budget = error_budget(attitude, latitude, sigma, time, method=method)
        panel.loglog(time, np.broadcast_to(total(budget)[k], time.shape) / unit, color=color, lw=2, label=label)
        floor = np.broadcast_to(total(budget, steady)[k], time.shape) / unit
        panel.loglog(time, floor, color=color, lw=1, ls="--")
        crossing = float(bias_takes_over(attitude, latitude, sigma, method=method)[k])
        if time[0] < crossing < time[-1]:
            panel.plot(crossing, np.sqrt(2.0) * floor[0], "o", color=color)
            panel.annotate(
                f"{crossing:.0f} s",
                (crossing, np.sqrt(2.0) * floor[0]),
                textcoords="offset points",
                xytext=(6, 6),
                fontsize=9,
            )
    panel.set(xlabel="session length T, s", ylabel=f"σ of the {name}, {word}", title=name)
    low, high = panel.get_ylim()
    panel.set_ylim(low / 1.5, max(4.0 * high, 20.0 * low))  # room for the legend, and for a curve that is flat
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="major", alpha=0.3)
    panel.plot([], [], color=_GREY, lw=1, ls="--", label="not averaged by any session")
    panel.plot([], [], "o", color=_GREY, label="bias takes over")
    panel.legend(fontsize=8, frameon=False)


def validity_map(
    x: ArrayLike,
    y: ArrayLike,
    departures: dict[str, Array],
    linear: NDArray[np.bool_],
    threshold: float,
    xlabel: str,
    ylabel: str,
) -> Figure:
    """Draw where draws through eq. (1) depart from the first-order theory, on logarithmic axes.

    Args:
        x: (n,) in the units of `xlabel`.
        y: (m,) in the units of `ylabel`.
        departures: by panel, relative departure of σ from the theory, (m, n).
        linear: where a million draws cannot tell the two apart, (m, n).
        threshold: departure that is drawn as a line.
        xlabel, ylabel: axis labels with units.

    Returns:
        The figure.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    figure = _figure(5.2 * len(departures), 4.6)
    panels = np.atleast_1d(figure.subplots(1, len(departures), sharey=True))
    norm = LogNorm(1e-4, 1.0)
    for panel, (name, departure) in zip(panels, departures.items(), strict=True):
        values = np.abs(departure)
        panel.pcolormesh(x, y, values, norm=norm, cmap="magma_r", shading="nearest", rasterized=True)
        panel.contour(x, y, values, levels=[threshold], colors="#0072B2", linewidths=2)
        panel.contour(x, y, linear.astype(float), levels=[0.5], colors="#009E73", linewidths=2, linestyles="--")
        panel.set(xlabel=xlabel, title=f"σ of the {name}", xscale="log", yscale="log")
        panel.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panels[0].set_ylabel(ylabel)
    panels[0].plot([], [], color="#0072B2", lw=2, label=f"departs by {100 * threshold:g} %")
    panels[0].plot([], [], color="#009E73", lw=2, ls="--", label="linear to a million draws (left of it)")
    panels[0].legend(fontsize=8, loc="lower right", framealpha=0.95)
    label = "|σ of the draws / σ of the theory − 1|"
    bar = figure.colorbar(ScalarMappable(norm, "magma_r"), ax=list(panels), label=label, extend="both")
    bar.ax.axhline(threshold, color="#0072B2", lw=2)
    figure.suptitle("where the first-order theory holds")
    return figure


def disturbed_comparison(
    quiet_sigma: float, cone_sigma: float, cone_errors: Array, mean_errors: Array, title: str
) -> Figure:
    """Draw heading errors on a disturbed base: the cone's and eq. (1)'s of the same data.

    Args:
        quiet_sigma: σ of eq. (1) on a quiet base, rad.
        cone_sigma: σ of the cone's heading, predicted, rad.
        cone_errors: of many runs, rad.
        mean_errors: eq. (1)'s, of the same runs, rad.
        title: what it is of.

    Returns:
        The figure.
    """
    figure = _figure(9.0, 4.2)
    left, right = figure.subplots(1, 2)
    limit = 4.0 * cone_sigma / ARCMIN
    left.hist(
        cone_errors / ARCMIN, bins=np.linspace(-limit, limit, 41), density=True, color=_COLORS["heading"], alpha=0.5
    )
    grid = np.linspace(-limit, limit, 400)
    for sigma, color, label in (
        (cone_sigma, _COLORS["heading"], "theory of the cone"),
        (quiet_sigma, _GREY, "eq. (1) on a quiet base, theory"),
    ):
        s = sigma / ARCMIN
        left.plot(grid, np.exp(-0.5 * (grid / s) ** 2) / (s * np.sqrt(2 * np.pi)), color=color, lw=2, label=label)
    left.set(
        xlabel="heading error, arcmin", ylabel="probability density, 1/arcmin", title="gravity's cone in inertial space"
    )
    left.set_ylim(0.0, 1.35 * left.get_ylim()[1])
    left.legend(fontsize=8, frameon=False)
    right.hist(mean_errors / DEG, bins=40, density=True, color=_COLORS["roll"], alpha=0.6)
    right.set(xlabel="heading error, °", ylabel="probability density, 1/°", title="eq. (1) on the same data")
    figure.suptitle(title)
    return figure


def session_figure(report: AlignmentReport) -> Figure:
    """Draw what to expect of one session: the budget by source, and the curves over session length.

    Args:
        report: an alignment whose sensors are known.

    Returns:
        The figure.

    Raises:
        InputError: the sensors are not known, or the angles not determined, so that there is nothing to expect.
    """
    d = report.determination
    if report.budget is None or report.sigma is None or not all(map(np.isfinite, (*d.attitude, d.latitude))):
        raise InputError(
            f"{report.source}: nothing to plot; the expected errors need the sensors' grade (--grade for a log) and "
            "an attitude and latitude that are determined."
        )
    figure = _figure(13.0, 8.0)
    upper, lower = figure.subfigures(2, 1, height_ratios=[1.15, 1.0], squeeze=False)[:, 0]
    _bars(report.budget, list(upper.subplots(1, 4, sharey=True)))
    panels = lower.subplots(1, 4)
    for panel, name in zip(panels, Angles._fields, strict=True):
        _curves(panel, name, d.attitude, d.latitude, {"all together": report.sigma}, report.method)
        panel.axvline(report.duration, color=_GREY, lw=1, ls=":", label="this session")
        panel.legend(fontsize=7, framealpha=0.95, edgecolor="none")  # above the line of this session
        panel.set_title("")
    figure.suptitle(f"{report.source}: expected error of a session of {report.duration:g} s")
    return figure
