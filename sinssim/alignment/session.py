"""A session: mean readings of a vehicle that stood still, and proof that it did.

A turn of one second of arc during a session of 300 s looks like 0.0033 deg/h to eq. (1), so small motions matter.
They show in two spreads: the angle that the gyros accumulate departs from a straight line by more than their
random walk explains, or the specific force changes its direction by more than its own noise explains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.alignment.axes import Array
from sinssim.alignment.determination import Determination, determine
from sinssim.alignment.theory import InstrumentErrors
from sinssim.checks import checked_increments
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.units import ARCSEC

FEWEST_SAMPLES = 40
"""Samples below which a session does not show whether the vehicle moved."""

_BLOCKS = (2, 20)  # into which a session is cut to compare mean specific forces: a slow sinking, a jolt
_ROTATION_FLOOR = 5.0 * ARCSEC  # departures that are let pass whatever the noise
_TILT_FLOOR = 1.5 * ARCSEC
# A random walk of σ at its end departs from the straight line to its end by more than x with a probability of
# 2 exp(-2x²/σ²): 5e-11 for x = 3.5σ.
_BRIDGE = 3.5
_SIGMAS = 6.0  # of a block's mean


@dataclass(frozen=True, eq=False)
class Stillness:
    """How far a session departs from standing still, and how far noise alone may go.

    Attributes:
        rotation: largest departure of the accumulated angle from a straight line, rad.
        rotation_time: when, s.
        rotation_limit: what the gyros' noise explains, rad.
        tilt: largest departure of the direction of a block's mean specific force from the session's, rad.
        tilt_time: middle of that block, s.
        tilt_limit: what the accelerometers' noise explains, rad.
    """

    rotation: float
    rotation_time: float
    rotation_limit: float
    tilt: float
    tilt_time: float
    tilt_limit: float

    @property
    def moved(self) -> bool:
        """Whether noise does not explain the departures."""
        return self.rotation > self.rotation_limit or self.tilt > self.tilt_limit


def mean_readings(imu: ImuData) -> tuple[Array, Array]:
    """Return mean angular rate and mean specific force over a session.

    Args:
        imu: the session's increments.

    Returns:
        Rate, (3,) rad/s, and specific force, (3,) m/s², forward-right-down.

    Raises:
        InputError: increments that do not fit together, are not finite or not in the order of time.
    """
    check_session(imu)
    duration = imu.time[-1] - imu.time[0]
    return imu.dtheta.sum(axis=0) / duration, imu.dvel.sum(axis=0) / duration


def determine_session(
    imu: ImuData, sigmas: InstrumentErrors | None = None, drift: tuple[float, float] = (0.0, 0.0)
) -> Determination:
    """Determine heading, roll, pitch and latitude from a session of a vehicle that stood still, eq. (1).

    Args:
        imu: the session's increments; a few hundred seconds average the noise.
        sigmas: standard deviations of the instruments' errors, if known; see `determine`.
        drift: by how much a rate [rad/s] and a specific force [m/s²] may change in it though the vehicle stands still;
            see `sinssim.alignment.largest_drift`.

    Returns:
        The determination.

    Raises:
        InputError: unusable increments, a vehicle that moved during the session, or as `determine`.
    """
    readings = mean_readings(imu)
    result = determine(*readings, sigmas)
    found = stillness(imu, sigmas, drift)
    if found.moved:
        turned = found.rotation > found.rotation_limit
        what, size, limit, time = (
            ("its gyros' angle departs from a steady turn", found.rotation, found.rotation_limit, found.rotation_time)
            if turned
            else ("its specific force turns", found.tilt, found.tilt_limit, found.tilt_time)
        )
        raise InputError(
            f"the vehicle moved during the session: at {time:.6g} s {what} by {size / ARCSEC:.4g} arcsec, where noise "
            f"explains up to {limit / ARCSEC:.3g} arcsec; take a quiet part of the session, or align on a disturbed "
            "base."
        )
    return result


def check_session(imu: ImuData) -> None:
    """Check that increments are usable as a session.

    Args:
        imu: the increments.

    Raises:
        InputError: arrays that do not fit together, too few samples, a sample that is not finite, times that do not
            increase.
    """
    checked_increments(imu)
    if len(imu) < FEWEST_SAMPLES:
        raise InputError(
            f"the session has {len(imu)} samples; at least {FEWEST_SAMPLES} show whether the vehicle stood still."
        )


def stillness(
    imu: ImuData, sigmas: InstrumentErrors | None = None, drift: tuple[float, float] = (0.0, 0.0)
) -> Stillness:
    """Measure how far a session departs from standing still.

    Args:
        imu: the session's increments.
        sigmas: standard deviations of the instruments' errors, if known: a fifth of a bias is then let pass as
            drift.
        drift: by how much a rate [rad/s] and a specific force [m/s²] of each axis may change besides.

    Returns:
        Departures and limits.
    """
    elapsed = imu.time - imu.time[0]
    duration, count = float(elapsed[-1]), len(imu)
    gyro, accel = imu.dtheta.sum(axis=0) / duration, imu.dvel.sum(axis=0) / duration
    gravity = float(np.linalg.norm(accel))
    # a rate that changes by c takes the angle of three axes no farther from its line than √3 c T/4, less than c T/2
    turn = 0.5 * drift[0] + (0.0 if sigmas is None else 0.2 * float(np.max(np.asarray(sigmas.gyro_bias))))
    slant = np.sqrt(2.0) * drift[1] + (0.0 if sigmas is None else 0.2 * float(np.max(np.asarray(sigmas.accel_bias))))

    departure = np.linalg.norm(np.cumsum(imu.dtheta, axis=0) - np.outer(elapsed[1:], gyro), axis=1)
    noise = _BRIDGE * white_level(imu.dtheta, duration) * np.sqrt(duration) + _pulse(imu.dtheta)
    rotation_limit = np.hypot(max(_ROTATION_FLOOR, turn * duration), noise)

    level, pulse = white_level(imu.dvel, duration), _pulse(imu.dvel)
    tilts = []
    for blocks in _BLOCKS:
        edges = np.linspace(0, count, blocks + 1).astype(int)
        spans = np.diff(elapsed[edges])
        means = np.add.reduceat(imu.dvel, edges[:-1], axis=0) / spans[:, None]
        tilt = np.linalg.norm(np.cross(means, accel), axis=1) / gravity**2
        worst = int(np.argmax(tilt))
        block = duration / blocks
        noise = (_SIGMAS * level / np.sqrt(block) + pulse / block) / gravity
        limit = np.hypot(max(_TILT_FLOOR, slant / gravity), noise)
        tilts.append((float(tilt[worst]), float(imu.time[edges[worst]] + 0.5 * spans[worst]), float(limit)))
    tilt_found, tilt_time, tilt_limit = max(tilts, key=lambda found: found[0] / found[2])
    worst = int(np.argmax(departure))
    return Stillness(
        rotation=float(departure[worst]),
        rotation_time=float(imu.time[worst + 1]),
        rotation_limit=float(rotation_limit),
        tilt=tilt_found,
        tilt_time=tilt_time,
        tilt_limit=tilt_limit,
    )


def white_level(increments: Array, duration: float) -> float:
    """Return the random walk coefficient N of the noisiest axis, seen past slow motion and most of quantisation.

    White noise has an Allan deviation N/√τ at every τ; slow motion raises it at long τ, quantisation at short τ, a
    jolt in one part of the session. So the smallest N over octaves of τ, of the median over parts of the session.

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


def _pulse(increments: Array) -> float:
    """Return three times what one sample typically departs from the mean at most: the weight of a pulse."""
    departure = np.abs(increments - increments.mean(axis=0)).max(axis=1)
    return 3.0 * float(np.median([part.max() for part in np.array_split(departure, min(16, len(departure)))]))
