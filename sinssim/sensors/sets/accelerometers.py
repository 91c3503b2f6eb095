"""Single accelerometers with errors: the six of a gyro-free block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim.arguments import check_kind, doubles
from sinssim.checks import check_finite
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.sensors.imu.emulate import emulate
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu, draw

# Each further triad of accelerometers has its own seed, far from those of scenarios.
APART = 1 << 32


def draw_accelerometers(imu: Imu, count: int, seed: int = 0) -> list[TriadErrors]:
    """Return the errors of single accelerometers, drawn in threes like those of a triad.

    Args:
        seed: the run's seed; the first three have the draws of the triad of a usual block.

    Raises:
        InputError: the number of accelerometers is not a multiple of three, or the seed cannot be used.
    """
    if count % 3:
        raise InputError(f"the number of accelerometers must be a multiple of three, not {count}.")
    return [draw(imu, seed + triad * APART).accel for triad in range(count // 3)]


def emulate_accelerometers(
    time: Array,
    force: Array,
    direction: Array,
    imu: Imu,
    seed: int = 0,
    errors: Sequence[TriadErrors] | None = None,
) -> Array:
    """Return the measured increments of single accelerometers of a grade.

    Each has all the errors that the block gives an accelerometer of a triad. It is emulated as one axis of a triad at
    its own place, with the two other axes perpendicular to it, so that its misalignment tilts it towards them.

    Args:
        time: edges of the intervals, (N+1,) s.
        force: integrals of the specific force at each accelerometer's place, (N, K, 3) m/s, K a multiple of three.
        direction: directions of the sensitive axes, unit vectors in the same axes, (K, 3).
        seed: the run's seed.
        errors: errors of the accelerometers in threes, if already drawn from block and seed.

    Returns:
        Measured increments, (N, K) m/s.

    Raises:
        InputError: the arrays do not belong together, the number of accelerometers is not a multiple of three, or
            `emulate` refuses the data.
    """
    from sinssim.statistics.random_numbers import key

    time, force, direction = doubles("time", time), doubles("force", force), doubles("direction", direction)
    count = len(direction)
    if direction.shape != (count, 3) or force.shape != (len(time) - 1, count, 3) or time.ndim != 1 or count < 3:
        raise InputError(
            f"accelerometers need (N+1,) times, (N, K, 3) increments and (K, 3) directions, K ≥ 3; got arrays of "
            f"shapes {time.shape}, {force.shape} and {direction.shape}."
        )
    if count % 3:
        raise InputError(f"the number of accelerometers must be a multiple of three, not {count}.")
    check_finite("force", force, "m/s")
    if not np.allclose(np.linalg.norm(direction, axis=1), 1.0, rtol=0.0, atol=1e-6):
        raise InputError(f"direction = {shortened(str(direction.tolist()))} must be unit vectors.")
    check_kind("imu", imu, Imu, "Imu, for example Imu(grade='tactical')")
    key(seed)  # refuses an invalid seed
    seed = int(seed)
    triads = draw_accelerometers(imu, count, seed) if errors is None else errors
    if not isinstance(triads, list | tuple) or len(triads) * 3 != count:
        raise InputError(f"errors = {shortened(repr(triads))} must be a list of {count // 3} TriadErrors.")
    for triad in triads:
        check_kind("each of errors", triad, TriadErrors)
    measured = np.empty(force.shape[:2])
    for k, sensitive in enumerate(direction):
        axis = k % 3
        own = force[:, k] @ axes_about(sensitive, axis).T
        block = ImuErrors(accel=triads[k // 3], warm_up=imu.warm_up)
        read = emulate(ImuData(time, np.zeros_like(own), own), block, seed + k // 3 * APART)
        measured[:, k] = read.dvel[:, axis]
    return measured


def axes_about(direction: Array, axis: int) -> Array:
    """Return the axes of a right-handed triad, one of which has a given direction.

    Args:
        direction: unit vector, (3,).

    Returns:
        Rotation matrix whose row `axis` is the direction, (3, 3).
    """
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    across /= np.linalg.norm(across)
    return np.roll(np.stack([direction, across, np.cross(direction, across)]), axis, axis=0)
