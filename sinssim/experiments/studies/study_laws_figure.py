"""Figures of a study's laws: heading through full turns, and the power of time of a block without gyros."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim.experiments.studies.claims import power_of_time as law
from sinssim.experiments.studies.results import ErrorGrowth, Heading
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.recording.style import COLORS, colors, css
from sinssim.units import ARCSEC, DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FORM_COLORS = ("euler", "functional-iteration", "two-quaternions", "quaternion")
_LEAST_ARCSEC = 1e-10  # smaller errors are drawn as this one, because a logarithmic axis has no zero
_SLOPE_HALF = 1.08  # a local power is the slope between the instants t/1.08 and 1.08 t


@styled
def turning(found: Sequence[Heading]) -> Figure:
    """Draw the heading in each form over time, and its error.

    Args:
        found: headings of one part, each motion at one rate.

    Returns:
        The figure: a column for each motion.
    """
    motions = list(dict.fromkeys(heading.motion for heading in found))
    figure = new_figure(3.8 * len(motions) + 2.6, 5.4)
    grid = figure.subplots(2, len(motions), squeeze=False, sharex="col")
    widths = (3.4, 1.2, 1.2, 1.2)
    for column, motion in enumerate(motions):
        top, bottom = grid[:, column]
        here = [heading for heading in found if heading.motion == motion]
        for heading, name, width in zip(here, _FORM_COLORS, widths, strict=True):
            color = css(COLORS[name])
            time = heading.time - heading.time[0]
            dashed = "--" if heading.form.endswith("unwrapped") else "-"
            top.plot(time, heading.heading / DEG, color=color, linewidth=width, linestyle=dashed, label=heading.form)
            apart = np.mod(heading.heading - heading.truth + np.pi, 2.0 * np.pi) - np.pi
            error = np.maximum(np.abs(apart) / ARCSEC, _LEAST_ARCSEC)
            bottom.plot(time, error, color=color, linewidth=min(width, 2.0), linestyle=dashed)
        top.set_title(f"{motion}, {here[0].rate_hz:g} Hz")
        bottom.set_yscale("log")
        bottom.axhline(18.0, color=style.SOFT, linewidth=style.THIN, linestyle=":")
        bottom.annotate(
            "0.3′", (0.01, 18.0), xycoords=("axes fraction", "data"), color=style.SOFT, xytext=(0, 2),
            textcoords="offset points",
        )  # fmt: skip
        bottom.set_xlabel("time [s]")
    grid[0, 0].set_ylabel("heading [°]")
    grid[1, 0].set_ylabel("error of the heading [″]")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside right center", handlelength=2.4)
    return figure


@styled
def power_of_time(blocks: Mapping[str, tuple[ErrorGrowth, float]]) -> Figure:
    """Draw the error of blocks without gyros over time, both logarithmic, and its local power of time.

    Args:
        blocks: growth of the errors and arm of the cube, m, by name.

    Returns:
        The figure: errors while the tilt is small above, local powers with the closed form below.
    """
    figure = new_figure(8.5, 6.2)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    paint = [css(color) for color in colors(list(blocks))]
    last = law.SCHULER_PERIOD
    for (name, (growth, arm)), color in zip(blocks.items(), paint, strict=True):
        time, error = law.linear_part(growth, arm)
        if len(time) < 2:
            continue
        last = max(last, float(time[-1]))
        top.plot(time, error, color=color, label=name)
        inside = time[(time > _SLOPE_HALF * time[0]) & (time < time[-1] / _SLOPE_HALF)]
        x, y = np.log(time), np.log(error)
        ends = [np.interp(np.log(inside) + step, x, y) for step in (-np.log(_SLOPE_HALF), np.log(_SLOPE_HALF))]
        bottom.plot(inside, (ends[1] - ends[0]) / (2.0 * np.log(_SLOPE_HALF)), color=color)
    at = np.geomspace(5.0, last, 400)
    bottom.plot(at, law.local_power(at), color=style.INK, linewidth=style.THIN, linestyle="--", label="closed form")
    for start, end, power, within in ((5.0, law.EARLY, 4.0, 0.1), (law.SCHULER_PERIOD, last, 2.0, 0.2)):
        band = css(COLORS["bound"])
        bottom.fill_between([start, end], power - within, power + within, color=band, alpha=0.35, lw=0)
    _times(top, bottom)
    top.set_yscale("log")
    top.set_ylabel("horizontal error [m]")
    bottom.set_ylabel("power of time")
    bottom.set_ylim(1.0, 5.0)
    bottom.set_xlabel("time [s]")
    bottom.set_xlim(5.0, 1.05 * last)
    handles, labels = top.get_legend_handles_labels()
    further, words = bottom.get_legend_handles_labels()
    figure.legend(handles + further, labels + words, loc="outside right center", handlelength=2.4)
    return figure


def _times(top: Axes, bottom: Axes) -> None:
    for axes in (top, bottom):
        axes.set_xscale("log")
        for instant in (law.EARLY, law.SCHULER_PERIOD):
            axes.axvline(instant, color=style.SOFT, linewidth=style.THIN, linestyle=":")
    for instant, words, side in ((law.EARLY, "1000 s", "right"), (law.SCHULER_PERIOD, "Schuler period", "right")):
        top.annotate(
            words, (instant, 0.03), xycoords=("data", "axes fraction"), color=style.SOFT, rotation=90.0,
            xytext=(-3, 0), textcoords="offset points", ha=side,
        )  # fmt: skip
