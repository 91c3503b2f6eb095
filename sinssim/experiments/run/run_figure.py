"""The figure of a run for a notebook or a paper: errors of its solutions over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.scales import ANGLES, LENGTHS, SPEEDS, suiting, time_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sinssim.experiments.run.result import Run
    from sinssim.strapdown.nav_error import NavError

_POINTS = 4000
"""Most points of a line."""
_FAR = 20.0
"""Ratio of the largest errors of two solutions from which the scale is logarithmic."""
_DASHES = ("-", "--", "-.", ":")
"""So that solutions with the same errors do not hide one another."""


@styled
def run_figure(run: Run) -> Figure:
    """Draw the horizontal, the velocity and the attitude error of each solution of a run over time.

    Args:
        run: a finished run.

    Returns:
        The figure.

    Raises:
        InputError: the run has no solution with errors.
    """
    errors: dict[str, NavError] = dict(run.errors)
    if run.aided is not None and run.aided.true_parameters_known:
        errors["aided"] = run.aided.error
        for name, one in (("backward", run.aided.backward_error), ("smoothed", run.aided.smoothed_error)):
            errors |= {} if one is None else {name: one}
    if not errors:
        raise InputError(
            f"the run {run.scenario.name} has no solution in three dimensions with errors to draw; its report and its "
            "recording show what it has."
        )
    figure = new_figure(8.0, 6.6)
    panels = figure.subplots(3, 1, sharex=True)
    word, size = time_unit(max(float(error.time[-1] - error.time[0]) for error in errors.values()))
    for panel, (name, scale, values) in zip(
        panels,
        (
            ("horizontal error", LENGTHS, {k: e.horizontal for k, e in errors.items()}),
            ("velocity error", SPEEDS, {k: e.speed for k, e in errors.items()}),
            ("attitude error", ANGLES, {k: np.linalg.norm(e.attitude, axis=1) for k, e in errors.items()}),
        ),
        strict=True,
    ):
        unit, factor = suiting(scale, np.concatenate([v[np.isfinite(v)] for v in values.values()]))
        for k, ((algorithm, one), color) in enumerate(zip(values.items(), style.colors(list(values)), strict=True)):
            rows = _thinned(len(one))
            panel.plot(
                errors[algorithm].time[rows] / size, one[rows] / factor, color=style.css(color), label=algorithm,
                linestyle=_DASHES[k % len(_DASHES)],
            )  # fmt: skip
        panel.set_ylabel(f"{name} [{unit}]")
        largest = [np.nanmax(one) for one in values.values()]
        if max(largest) > _FAR * min(largest) > 0.0:
            panel.set_yscale("log")  # an aided error beside an inertial one would be a line on the axis
            panel.set_ylim(bottom=min(np.nanmedian(one) for one in values.values()) / factor / 10.0)
        else:
            panel.set_ylim(bottom=0.0)
    panels[0].set_title(run.scenario.name)
    panels[0].legend(loc="best")
    panels[-1].set_xlabel(f"time [{word}]")
    return figure


def _thinned(count: int) -> Array:
    return np.unique(np.linspace(0, count - 1, min(count, _POINTS)).round().astype(np.intp))
