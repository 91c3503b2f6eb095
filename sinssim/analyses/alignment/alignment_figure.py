"""The figure of an alignment: the expected error by source, and over the length of the session."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.axes import Angles, Attitude
from sinssim.alignment.budget import AVERAGED, SOURCES, Method, bias_takes_over, error_budget, total
from sinssim.errors import InputError
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.units import ARCMIN, ARCSEC

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sinssim.analyses.alignment.report import AlignmentResult
    from sinssim.sensors.imu.errors import ImuErrors

_COLORS = {name: style.css(style.COLORS[name]) for name in Angles._fields}


def draw_budget(budget: dict[str, Angles], panels: list[Axes]) -> None:
    """Draw an error budget as bars, a panel for each angle.

    Args:
        budget: by source, standard deviations, rad.
        panels: four.
    """
    shown = [source for source in budget if any(float(value) > 0.0 for value in budget[source])]
    everything = total(budget)
    labels = [*shown, "total"]
    rows = np.arange(len(labels))[::-1]
    for panel, name in zip(panels, Angles._fields, strict=True):
        largest = float(getattr(everything, name))
        unit, word = (ARCMIN, "arcmin") if largest > ARCMIN else (ARCSEC, "arcsec")
        values = [*(float(getattr(budget[source], name)) / unit for source in shown), largest / unit]
        colors = [_COLORS[name]] * len(shown) + [style.SOFT]
        panel.barh(rows, values, color=colors)
        room = max(values) or 1.0
        for row, value in zip(rows, values, strict=True):
            text = f"{value:.2f}" if value >= 0.005 * room else ("" if value == 0.0 else f"{value:.1g}")
            panel.text(value + 0.02 * room, row, text, va="center", fontsize=style.SMALL)
        panel.set(xlim=(0.0, 1.28 * room), xlabel=f"σ [{word}]", title=name, yticks=rows, yticklabels=labels)
        panel.grid(False, axis="y")


def draw_curves(
    panel: Axes, name: str, attitude: Attitude, latitude: ArrayLike, sigmas: dict[str, ImuErrors], method: Method
) -> None:
    """Draw an angle's σ over the length of the session: all sources, and those that averaging does not reduce.

    Args:
        panel: axes to draw on.
        name: the angle.
        attitude: attitude of the vehicle, rad.
        latitude: rad.
        sigmas: standard deviations of sensor blocks by name.
        method: "quiet" or "disturbed".
    """
    from matplotlib.ticker import LogLocator, NullFormatter

    time = np.geomspace(1.0, 2e4, 200)
    steady = tuple(source for source in SOURCES if source not in AVERAGED)
    k = Angles._fields.index(name)
    unit, word = (ARCMIN, "arcmin") if name in ("heading", "latitude") else (ARCSEC, "arcsec")
    palette = list(_COLORS.values())
    for index, (label, sigma) in enumerate(sigmas.items()):
        color = palette[index % len(palette)]
        budget = error_budget(attitude, latitude, sigma, time, method=method)
        panel.loglog(time, np.broadcast_to(total(budget)[k], time.shape) / unit, color=color, label=label)
        floor = np.broadcast_to(total(budget, steady)[k], time.shape) / unit
        panel.loglog(time, floor, color=color, lw=style.THIN, ls="--")
        crossing = float(bias_takes_over(attitude, latitude, sigma, method=method)[k])
        if time[0] < crossing < time[-1]:
            panel.plot(crossing, np.sqrt(2.0) * floor[0], "o", color=color)
            panel.annotate(
                f"{crossing:.0f} s",
                (crossing, np.sqrt(2.0) * floor[0]),
                textcoords="offset points",
                xytext=(6, 6),
                fontsize=style.SMALL,
            )
    panel.set(xlabel="session length T [s]", ylabel=f"σ of the {name} [{word}]", title=name)
    low, high = panel.get_ylim()
    panel.set_ylim(low / 1.5, max(4.0 * high, 20.0 * low))  # room for the legend, and for a flat curve
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
    panel.yaxis.set_minor_formatter(NullFormatter())
    panel.plot([], [], color=style.SOFT, lw=style.THIN, ls="--", label="not reduced by averaging")
    panel.plot([], [], "o", color=style.SOFT, label="bias dominates")
    panel.legend()


@styled
def session_figure(report: AlignmentResult) -> Figure:
    """Draw the expected errors of one session: the budget by source, and the curves over session length.

    Args:
        report: an alignment with known sensors.

    Returns:
        The figure.

    Raises:
        InputError: the sensors are unknown or the angles undetermined, so that there are no expected errors.
    """
    d = report.determination
    if report.budget is None or report.sigma is None or not all(map(np.isfinite, (*d.attitude, d.latitude))):
        raise InputError(
            f"{report.source}: nothing to plot: the expected errors need the sensors' grade (--grade for a log) and "
            "a determined attitude and latitude."
        )
    figure = new_figure(13.0, 8.0)
    upper, lower = figure.subfigures(2, 1, height_ratios=[1.15, 1.0], squeeze=False)[:, 0]
    draw_budget(report.budget, list(upper.subplots(1, 4, sharey=True)))
    panels = lower.subplots(1, 4)
    for panel, name in zip(panels, Angles._fields, strict=True):
        draw_curves(panel, name, d.attitude, d.latitude, {"total": report.sigma}, report.method)
        panel.axvline(report.duration, color=style.SOFT, lw=style.THIN, ls=":", label="duration")
        panel.legend(frameon=True, framealpha=0.95, edgecolor="none")  # above the line of the duration
        panel.set_title("")
    figure.suptitle(f"{report.source}: expected error of a session of {report.duration:g} s")
    return figure
