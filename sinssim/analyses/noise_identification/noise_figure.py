"""The figure of a log's Allan deviations: measured values with their band, the fitted sum, and each term."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sinssim.analyses.noise_identification.report import ChannelNoise, NoiseReport
from sinssim.analyses.noise_identification.units import four_digits
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def noise_figure(report: NoiseReport) -> Figure:
    """Draw the Allan deviations of a log.

    Args:
        report: a report with at least one channel.

    Returns:
        The figure, a panel for each channel.
    """
    count = len(report.channels)
    columns = min(count, 3)
    rows = -(-count // columns)
    width, height = (8.0, 5.6) if count == 1 else (5.4 * columns, 4.6 * rows)
    figure = new_figure(width, height)
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

    unit, size = channel.units.rate
    tau, deviation = channel.deviation.tau, channel.deviation.deviation / size
    low, high = channel.low / size, channel.high / size
    fitted = channel.fit.allan_deviation(tau) / size
    measured = style.css(style.COLORS["measured"])
    panel.fill_between(tau, low, high, color=measured, alpha=0.25, lw=0, label="95 % band")
    panel.loglog(tau, deviation, color=measured, lw=style.LINE, marker="o", ms=2.5, label="measured")
    panel.loglog(tau, fitted, color=style.css(style.COLORS["fit"]), ls=(0, (6, 2)), label="sum of terms")
    for symbol in channel.symbols:
        estimate = channel.fit.estimates[symbol]
        if estimate.value is None:
            continue
        term_unit, term_size = channel.units.terms[symbol]
        label = "σ$_b$" if symbol == "sigma_b" else symbol
        panel.loglog(
            tau,
            channel.fit.allan_deviation(tau, symbol) / size,
            color=style.css(style.COLORS[symbol]),
            lw=style.THIN,
            ls=(0, (2, 2)),
            label=f"{label} = {four_digits(estimate.value / term_size)} {term_unit}",
        )
    bottom, top = 0.4 * float(np.min(low)), 2.5 * float(np.max(deviation))
    if math.floor(math.log10(top)) <= math.ceil(math.log10(bottom)):  # fewer than two powers of ten would be labelled
        bottom, top = 10.0 ** math.floor(math.log10(bottom)), 10.0 ** math.ceil(math.log10(top))
    panel.set(
        xlabel="averaging time τ [s]",
        ylabel=f"Allan deviation [{unit}]",
        title=channel.channel.title.replace("$", r"\$"),
        xlim=(tau[0], tau[-1]),
        ylim=(bottom, top),
    )
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(NullFormatter())
    panel.legend()
