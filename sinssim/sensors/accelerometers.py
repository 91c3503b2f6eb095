"""Single accelerometers with errors: the six of a gyro-free block."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.emulate import emulate
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw, warm_up

# Each further triad of accelerometers draws from seeds of its own, far from any that a scenario uses.
_APART = 1 << 32


def draw_accelerometers(section: ImuSection, count: int, seed: int = 0) -> list[TriadErrors]:
    """Return the errors of single accelerometers, drawn in threes as those of a triad are.

    Args:
        section: the [imu] section of a scenario.
        count: how many accelerometers, a multiple of three.
        seed: the run's seed; the first three draw as the triad of an ordinary block does.

    Returns:
        One triad for every three accelerometers.

    Raises:
        InputError: another number of accelerometers, or a seed that cannot be used.
    """
    if count % 3:
        raise InputError(f"accelerometers are emulated in threes; got {count} of them.")
    return [draw(section, seed + triad * _APART).accel for triad in range(count // 3)]


def emulate_accelerometers(time: Array, force: Array, direction: Array, section: ImuSection, seed: int = 0) -> Array:
    """Return what accelerometers of a grade give in place of the ideal increments.

    Every one has all the errors that the section gives an accelerometer of a triad: it is emulated as the axis of a
    triad at its own place, whose two other axes stand across it, so that its misalignment tilts it towards them.

    Args:
        time: edges of the intervals, (N+1,) s.
        force: integrals of the specific force at each accelerometer's place, (N, K, 3) m/s, K a multiple of three.
        direction: of its sensitive axis, unit vectors in the same axes, (K, 3).
        section: the [imu] section of a scenario.
        seed: the run's seed.

    Returns:
        Measured increments, (N, K) m/s.

    Raises:
        InputError: arrays that do not belong together, a number of accelerometers that is no multiple of three, or
            what `emulate` refuses.
    """
    if force.ndim != 3 or direction.shape != force.shape[1:] or direction.shape[1:] != (3,):
        raise InputError(
            f"accelerometers need (N, K, 3) increments and (K, 3) directions; got arrays of shapes {force.shape} and "
            f"{direction.shape}."
        )
    triads = draw_accelerometers(section, len(direction), seed)
    measured = np.empty(force.shape[:2])
    for k, sensitive in enumerate(direction):
        axis, errors = k % 3, triads[k // 3]
        own = force[:, k] @ axes_about(sensitive, axis).T
        block = ImuData(time, np.zeros_like(own), own)
        measured[:, k] = emulate(block, ImuErrors(accel=errors, warm_up=warm_up(section)), seed + k // 3 * _APART).dvel[
            :, axis
        ]
    return measured


def axes_about(direction: Array, axis: int) -> Array:
    """Return the axes of a right-handed triad, one of which points a given way.

    Args:
        direction: unit vector, (3,).
        axis: which of the triad's axes it is.

    Returns:
        Rotation matrix whose row `axis` is the direction, (3, 3).
    """
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    across /= np.linalg.norm(across)
    return np.roll(np.stack([direction, across, np.cross(direction, across)]), axis, axis=0)
