"""What the report and the recording of a filter share: components, scales and limits of the drawings."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.scales import ANGLES, LENGTHS, SPEEDS, Scale

EDGE = 6.0
"""Innovations beyond this many σ are drawn at the limit, so that the plot stays readable."""
SETTLED = 0.05
"""Fraction of a run after which the axes are fitted, because the initial errors are much larger than the later ones."""

NAVIGATION: tuple[tuple[str, Scale, tuple[str, str, str], float], ...] = (
    ("position", LENGTHS, ("position_north", "position_east", "height"), -1.0),
    ("velocity", SPEEDS, ("velocity_north", "velocity_east", "velocity_down"), 1.0),
    ("attitude", ANGLES, ("tilt_north", "tilt_east", "azimuth"), 1.0),
)
"""The blocks of navigation: scale, names of the components, and sign of the third (down to up)."""


def settled(kind: str, time: Array, span: tuple[float, float]) -> slice:
    """Return the rows of a solution after the filter has settled, to which the axes are fitted.

    Args:
        kind: name of the solution; the backward one begins at the end of the run.
        time: (K,) s.
        span: first and last instant of the run, s.
    """
    least = SETTLED * (span[1] - span[0])
    if kind == "backward":
        return slice(0, int(np.searchsorted(time, span[1] - least, side="right")))
    return slice(int(np.searchsorted(time, span[0] + least)), None)
