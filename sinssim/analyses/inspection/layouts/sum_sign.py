"""Decides whether a recorded gravity vector and an acceleration without gravity have the same sign convention.

A recorder splits the reading s of the accelerometers into gravity g and acceleration u with a filter that turns g with
the gyros and pulls it toward s: ġ = -ω × g + k (s - g). With s = g + u the pull is k u; with s = g - u it is -k u. The
fixes do not tell the two apart: the opposite sign of horizontal accelerations is half a turn of the heading.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sinssim.analyses.inspection.layouts.inertial import Layout
from sinssim.analyses.inspection.layouts.text_table import TextTable
from sinssim.data import Array

_STEP_S = 0.1
_PARTS = 12
_SURE = 4.0
"""Ratio of the mean pull to its 1σ, from the scatter of the parts, from which on it counts; by chance 1 in 500
(Student's t with 11 degrees of freedom)."""


def relative_sign(table: TextTable, layout: Layout) -> int:
    """Return the sign of the acceleration relative to gravity: 1 for a sum, -1 for a difference, 0 if it is unknown."""
    assert layout.gravity is not None
    bare = replace(layout, gravity=None).stream(table)[0]
    whole = layout.stream(table)[0]
    time, first, last = bare.time, *np.searchsorted(bare.time, whole.time[[0, -1]])
    time, rate, added = time[first : last + 1], bare.gyro[first : last + 1], bare.accel[first : last + 1]
    if len(time) != len(whole.time) or not (np.diff(time) >= 0.0).all():
        return 0
    edges = np.arange(time[0], time[-1], max(_STEP_S, 2.0 * float(np.median(np.diff(time)))))
    if len(edges) < 10 * _PARTS:
        return 0
    gravity = _at(edges, time, whole.accel - added)
    middle, step = 0.5 * (gravity[1:] + gravity[:-1]), np.diff(edges)[:, None]
    turned = np.diff(gravity, axis=0) / step + np.cross(_mean(edges, time, rate), middle)
    pushed = _mean(edges, time, added)
    slopes = []
    for pull, u in zip(np.array_split(turned, _PARTS), np.array_split(pushed, _PARTS), strict=True):
        own = u - u.mean(axis=0)
        slopes.append(float(np.sum(pull * own) / max(float(np.sum(own * own)), 1e-300)))
    mean, sigma = float(np.mean(slopes)), float(np.std(slopes, ddof=1)) / np.sqrt(_PARTS)
    return int(np.sign(mean)) if abs(mean) > _SURE * sigma else 0


def _at(edges: Array, time: Array, values: Array) -> Array:
    return np.stack([np.interp(edges, time, axis) for axis in values.T], axis=1)


def _mean(edges: Array, time: Array, values: Array) -> Array:
    """Return the means of readings between edges, (K, 3)."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return np.asarray(np.diff(_at(edges, time, sums), axis=0) / np.diff(edges)[:, None])
