"""Logs a platform for the viewer: its errors beside strapdown, commanded rates, gimbal angles, drift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim import units
from sinssim.algorithms import PLATFORM
from sinssim.experiments.run.views.log_run import gaps
from sinssim.recording import style
from sinssim.recording.scales import thinned
from sinssim.scales import ANGLES, LENGTHS, suiting

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sinssim.data import Array
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.strapdown.nav_error import NavError
    from sinssim.strapdown.platform.navigate import PlatformSolution


def draw_platform(
    recording: Recording, solution: PlatformSolution, errors: Mapping[str, NavError], sensed: Array
) -> dict[str, str]:
    """Record a platform, below `strapdown/platform/`.

    Args:
        recording: the recording.
        solution: of its navigator.
        errors: errors to compare by name, that of the platform first.
        sensed: ideal increments of angle of the same sensors strapped down, (N, 3) rad.

    Returns:
        Labels for the views' titles.
    """
    labels = {"platform": "yes"}
    names = list(errors)
    colors = {PLATFORM: style.COLORS[PLATFORM], _FREE: style.COLORS["reference"]}
    paint = [colors.get(name) or style.colors([name])[0] for name in names]
    time = solution.time
    rows = thinned(len(time))
    for key, table, values in (
        ("horizontal", LENGTHS, [error.horizontal for error in errors.values()]),
        ("attitude", ANGLES, [error.angle for error in errors.values()]),
    ):
        # an algorithm that takes several samples at once has fewer rows
        thin = [v[np.searchsorted(e.time, time[rows]).clip(max=len(v) - 1)]
                for v, e in zip(values, errors.values(), strict=True)]  # fmt: skip
        labels[f"platform_{key}"], size = suiting(table, *thin)
        lines = np.column_stack(thin) / size
        recording.series(f"platform/{key}", time[rows], lines, names, colors=paint, widths=style.stacked_widths(3))
    samples = thinned(len(time) - 1)
    at, axes = time[1:][samples], style.colors(["x", "y", "z"])
    rate = sensed / np.diff(time)[:, np.newaxis] / units.DEG
    recording.series("platform/sensed", at, rate[samples], ["x forward", "y right", "z down"], colors=axes)
    commanded = solution.commanded[samples] / units.DEG_H
    recording.series("platform/commanded", at, commanded, ["x", "y", "z"], colors=axes)
    angles = solution.gimbals[rows] / units.DEG
    three = np.column_stack([gaps(angles[:, 0], 360.0), angles[:, 1], gaps(angles[:, 2], 360.0)])
    paint = style.colors(["roll", "pitch", "heading"])
    recording.series("platform/gimbals", time[rows], three, ["roll", "pitch", "azimuth"], colors=paint)
    return labels


_FREE = "strapdown, no rate-dependent errors"
"""Name of the strapdown solution whose gyros have no errors that depend on the sensed rate."""


def compared(own: NavError, strapdown: tuple[str, NavError] | None, without: NavError | None) -> dict[str, NavError]:
    """Return the errors that are drawn together, by name.

    Args:
        own: errors of the platform's solution.
        strapdown: the first strapdown algorithm and its errors, if there is one.
        without: its errors if its gyros had no errors that act in turns only.

    Returns:
        The platform's first.
    """
    found = {PLATFORM: own}
    if strapdown is not None:
        found[strapdown[0]] = strapdown[1]
    if without is not None:
        found[_FREE] = without
    return found
