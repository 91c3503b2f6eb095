"""Tells accelerations from which a recorder has removed gravity from specific forces."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array

WITHOUT_GRAVITY = (
    "If the recorder has removed gravity (linear or user acceleration), these data alone cannot be navigated: record "
    "the accelerometers with gravity (TotalAcceleration or raw accelerometer of a phone), or give the recorded gravity "
    "vector, too (Gravity.csv; the table gravity of log.imu)."
)
"""What is missing in such data, and what would be right."""

_BLOCK_S = 1.0
_FEWEST = 10  # blocks that tell
_CALM = 0.2  # share of the blocks, those with the least changes
_LESS = 0.5  # of the median over all blocks: calm motion has a specific force of gravity, but hardly an acceleration


def without_gravity(values: Array, interval: float) -> bool:
    """Return whether readings have no gravity in them: where they change least, they are much less than usually.

    Args:
        values: accelerations in any unit, (N, 3).
        interval: between samples, s.

    Returns:
        The answer; False for a log shorter than ten seconds, and for readings whose calm parts are not small.
    """
    width = max(round(_BLOCK_S / interval), 2)
    count = len(values) // width
    if count < _FEWEST:
        return False
    blocks = values[: count * width].reshape(count, width, 3)
    mean = np.linalg.norm(blocks.mean(axis=1), axis=1)
    noise = blocks.var(axis=1).sum(axis=1)
    calm = np.argsort(noise, kind="stable")[: max(round(_CALM * count), 3)]
    return bool(np.median(mean[calm]) < _LESS * np.median(mean))
