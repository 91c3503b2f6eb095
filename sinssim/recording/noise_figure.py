"""The figure of a log's Allan deviations: what was measured, with its band, the fitted sum, and each term of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sinssim.recording import style
from sinssim.sensors.noise_report import ChannelNoise, NoiseReport
from sinssim.sensors.noise_units import RATE_UNIT, UNITS, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_AXES = ("forward", "right", "down")


def noise_figure(report: NoiseReport) -> Figure:
    """Draw the Allan deviations of a log.

    Args:
        report: at least one channel.

    Returns:
        The figure, a panel for each channel.
    """
    from matplotlib.figure import Figure as NewFigure

    count = len(report.channels)
    columns = min(count, 3)
    rows = -(-count // columns)
    width, height = (8.0, 5.6) if count == 1 else (5.4 * columns, 4.6 * rows)
    figure = NewFigure(figsize=(width, height), layout="constrained")
    panels = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    for panel, channel in zip(panels, report.channels, strict=False):
        _draw(panel, channel)
    for panel in panels[count:]:
        panel.set_axis_off()
    figure.suptitle(
        f"{report.source}: overlapping Allan deviation, {report.duration:g} s at {1.0 / report.interval:.6g} Hz"
    )
    return figure


def _draw(panel: Axes, channel: ChannelNoise) -> None:
    from matplotlib.ticker import NullFormatter

    unit, size = RATE_UNIT[channel.triad]
    tau, deviation = channel.deviation.tau, channel.deviation.deviation / size
    low, high = channel.low / size, channel.high / size
    measured = _color("measured")
    panel.fill_between(tau, low, high, color=measured, alpha=0.25, lw=0, label="95 % band")
    panel.loglog(tau, deviation, color=measured, lw=1.8, marker="o", ms=2.5, label="measured")
    panel.loglog(
        tau, channel.fit.allan_deviation(tau) / size, color=_color("fit"), lw=1.4, ls=(0, (6, 2)), label="sum of terms"
    )
    for symbol in channel.symbols:
        estimate = channel.fit.estimates[symbol]
        if estimate.value is None:
            continue
        term_unit, term_size = UNITS[channel.triad][symbol]
        label = "σ$_b$" if symbol == "sigma_b" else symbol
        panel.loglog(
            tau,
            channel.fit.allan_deviation(tau, symbol) / size,
            color=_color(symbol),
            lw=1.2,
            ls=(0, (2, 2)),
            label=f"{label} = {number(estimate.value / term_size)} {term_unit}",
        )
    bottom, top = 0.4 * float(np.min(low)), 2.5 * float(np.max(deviation))
    if math.floor(math.log10(top)) <= math.ceil(math.log10(bottom)):  # fewer than two powers of ten to read it by
        bottom, top = 10.0 ** math.floor(math.log10(bottom)), 10.0 ** math.ceil(math.log10(top))
    panel.set(
        xlabel="averaging time τ, s",
        ylabel=f"Allan deviation, {unit}",
        title=f"{channel.name} ({_AXES[channel.axis]})",
        xlim=(tau[0], tau[-1]),
        ylim=(bottom, top),
    )
    panel.grid(True, which="major", alpha=0.35)
    panel.grid(True, which="minor", alpha=0.12)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(NullFormatter())
    panel.legend(fontsize=8, framealpha=0.9, edgecolor="none")


def _color(name: str) -> tuple[float, float, float]:
    r, g, b = style.COLORS[name]
    return r / 255.0, g / 255.0, b / 255.0
