"""Mean readings of a session, and the noise of its sensors separated from motion."""

from __future__ import annotations

import numpy as np

from sinssim.checks import checked_imu
from sinssim.data import Array, ImuData
from sinssim.errors import InputError

FEWEST_SAMPLES = 40
"""Number of samples that a test for motion needs."""


def mean_readings(imu: ImuData) -> tuple[Array, Array]:
    """Return mean angular rate and mean specific force over a session.

    Args:
        imu: the session's increments.

    Returns:
        Rate, (3,) rad/s, and specific force, (3,) m/s², forward-right-down.

    Raises:
        InputError: the increments have inconsistent shapes, are not finite or not in order of time.
    """
    imu = check_session(imu)
    duration = imu.time[-1] - imu.time[0]
    return imu.dtheta.sum(axis=0) / duration, imu.dvel.sum(axis=0) / duration


def check_session(imu: ImuData) -> ImuData:
    """Check that increments are usable as a session.

    Raises:
        InputError: the arrays do not fit together, there are too few samples, a sample is not finite, or the times do
            not increase.
    """
    imu = checked_imu(imu)
    if len(imu) < FEWEST_SAMPLES:
        raise InputError(f"the session has {len(imu)} samples; the test for motion needs at least {FEWEST_SAMPLES}.")
    return imu


def white_level(increments: Array, duration: float) -> float:
    """Return the random walk coefficient N of the noisiest axis, without slow motion and most of quantisation.

    White noise has an Allan deviation N/√τ at every τ; slow motion raises it at long τ, quantisation at short τ, a jolt
    in one part of the session. The result is therefore the smallest N over octaves of τ of the median over parts of the
    session.

    Args:
        increments: (N, 3) rad or m/s.
        duration: s.

    Returns:
        N, rad/√s or m/s/√s.
    """
    count = len(increments)
    levels = []
    size = 1
    while size == 1 or count // size >= 128:
        blocks = count // size
        sums = increments[: blocks * size].reshape(blocks, size, 3).sum(axis=1)
        squares = 0.5 * np.diff(sums, axis=0) ** 2
        parts = np.array_split(squares, min(16, len(squares)))
        variance = np.median([part.mean(axis=0) for part in parts], axis=0)
        levels.append(np.sqrt(variance * count / (size * duration)))
        size *= 2
    return float(np.max(np.min(levels, axis=0)))


def pulse(increments: Array) -> float:
    """Return an upper estimate of the pulse weight: three times the typical largest departure of a sample from the
    mean.

    Args:
        increments: (N, 3) rad or m/s.

    Returns:
        The weight, rad or m/s.
    """
    departure = np.abs(increments - increments.mean(axis=0)).max(axis=1)
    return 3.0 * float(np.median([part.max() for part in np.array_split(departure, min(16, len(departure)))]))
