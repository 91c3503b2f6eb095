"""Velocities by differences of positions, for the start with a receiver that gives positions only."""

from __future__ import annotations

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Measurements
from sinssim.earth.models import WGS84

_SPAN_S = 2.0
"""Time between the two positions of a difference, s. At the 3 m/s of a first course they are 6 m apart; the errors of
positions within so short a time are alike, and their difference is some decimetres, which is 3° of the course."""
_NOISE = 0.3
"""1σ of such a difference, m, or of two independent positions if that is less."""


def velocity_of_positions(position: Measurements | None) -> Measurements | None:
    """Return velocities from differences of positions.

    Args:
        position: positions of satellites; None without.

    Returns:
        Velocities at the middle of each difference, north, east, down; None with fewer than three positions.
    """
    if position is None or len(position) < 3:
        return None
    time = position.time
    place = earth.geodetic_to_ecef(position.value[:, 0], position.value[:, 1], position.value[:, 2], WGS84)
    begin = np.arange(len(time))
    end = np.searchsorted(time, time + _SPAN_S - 1e-6)
    rows = end < len(time)
    begin, end = begin[rows], end[rows]
    if not len(begin):
        return None
    lasts = (time[end] - time[begin])[:, None]
    q_en = earth.q_en(position.value[begin, 0], position.value[begin, 1])
    velocity = rotation.rotate(rotation.conjugate(q_en), (place[end] - place[begin]) / lasts)
    noise = np.minimum(np.sqrt(position.sigma[begin] ** 2 + position.sigma[end] ** 2), _NOISE) / lasts
    at = 0.5 * (time[end] + time[begin])
    return Measurements("gnss-velocity", at, at, velocity, noise, position.lever_arm, position.name)
