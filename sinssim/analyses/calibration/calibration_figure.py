"""Figures of a calibration: the reduction of the 1σ of each parameter, observability, residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim.analyses.calibration.least_squares import OBSERVABLE
from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.units import DEG_H, UG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LEAST = 1e-3


@styled
def parameters_figure(result: CalibrationResult) -> Figure:
    """Draw 1σ of each parameter over its size before, and the error over 1σ where the truth is known.

    Args:
        result: the calibration.

    Returns:
        The figure.
    """
    count = len(result.parameters)
    figure = new_figure(11.0, 0.8 + 0.21 * count)
    panels = figure.subplots(1, 1 if result.truth is None else 2, sharey=True, squeeze=False)[0]
    place = np.arange(count)[::-1]
    size = np.array([one.size for one in result.parameters])
    seen = result.observable
    own, lost = style.css(style.COLORS["aided"]), style.css(style.COLORS["refused"])
    colors = [own if one else lost for one in seen]
    left = panels[0]
    left.barh(place, result.sigma / size, color=colors, height=0.6)
    left.set_xscale("log")
    left.set_xlim(min(_LEAST, 0.5 * float((result.sigma / size).min())), 2.0)
    left.axvline(1.0, color=style.css(style.COLORS["limit"]), lw=style.THIN)
    left.set_xlabel("1σ after the calibration over 1σ before")
    left.set_yticks(place, result.names)
    left.grid(axis="y", visible=False)
    left.set_title("What the sequence determines" + ("" if seen.all() else " (pink: not observable)"))
    if result.normalised_error is not None:
        right = panels[1]
        right.axvspan(-1.0, 1.0, color=style.GRID)
        right.axvline(0.0, color=style.css(style.COLORS["truth"]), lw=style.THIN)
        right.scatter(result.normalised_error, place, color=colors, s=18.0, zorder=3)
        reach = max(3.5, 1.1 * float(np.abs(result.normalised_error).max()))
        right.set_xlim(-reach, reach)
        right.set_xlabel("error over 1σ")
        right.grid(axis="y", visible=False)
        right.set_title("Errors against the truth")
    return figure


@styled
def observability_figure(result: CalibrationResult) -> Figure:
    """Draw the singular values of the observations.

    Args:
        result: the calibration.

    Returns:
        The figure.
    """
    figure = new_figure(11.0, 2.9)
    panel = figure.subplots()
    singular = np.maximum(result.estimate.solution.singular, _LEAST)
    number = np.arange(1, len(singular) + 1)
    seen = singular >= OBSERVABLE
    panel.semilogy(number[seen], singular[seen], "o", color=style.css(style.COLORS["aided"]), label="observable")
    if not seen.all():
        panel.semilogy(
            number[~seen], singular[~seen], "o", color=style.css(style.COLORS["refused"]), label="not observable"
        )
    panel.axhline(OBSERVABLE, color=style.css(style.COLORS["limit"]), lw=style.THIN, label="limit")
    panel.set_xlabel("direction, by falling information")
    panel.set_ylabel("1σ before over 1σ after")
    panel.set_xticks(number)
    panel.legend(loc="upper right")
    panel.set_title("Singular values")
    return figure


@styled
def residual_figure(result: CalibrationResult) -> Figure:
    """Draw the residuals in the order of time.

    Args:
        result: the calibration.

    Returns:
        The figure.
    """
    estimate = result.estimate
    series = [(estimate.residual_gyro / DEG_H, "gyros, deg/h"), (estimate.residual_accel / UG, "accelerometers, µg")]
    names: tuple[str, ...] = ("position or turn", "position")
    if result.method == "systematic":
        series, names = [(estimate.residual_accel, "velocity, 1σ")], ("observation",)
    figure = new_figure(11.0, 2.7 * len(series))
    panels = figure.subplots(len(series), 1, squeeze=False)[:, 0]
    for panel, (values, label), name in zip(panels, series, names, strict=True):
        axes = ("x", "y", "z") if result.method == "separate" else ("north", "east", "down")
        every = max(len(values) // 2000, 1)
        for axis, word in enumerate(axes):
            color = style.css(style.COLORS[word])
            number = np.arange(1, len(values) + 1)[::every]
            panel.plot(
                number, values[::every, axis], "o", ms=2.2 if len(values) > 200 else 4.0, color=color, label=word
            )
        panel.axhline(0.0, color=style.SOFT, lw=style.HAIR)
        panel.set_xlabel(name)
        panel.set_ylabel(label)
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    panels[0].set_title("Residuals")
    return figure
