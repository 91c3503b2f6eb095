"""Single accelerometers with errors: the six of a gyro-free block."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.emulate import emulate
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw

# Each further triad of accelerometers draws from seeds of its own, far from any that a scenario uses.
_APART = 1 << 32


def emulate_accelerometers(time: Array, ideal: Array, section: ImuSection, seed: int = 0) -> Array:
    """Return what accelerometers of a grade give in place of the ideal increments.

    Bias, scale factor, non-linearity, random walk, instability and quantisation are those of the section's
    accelerometers, drawn anew for each. Misalignment is not: it needs the force across the sensitive axis, which one
    channel does not tell.

    Args:
        time: edges of the intervals, (N+1,) s.
        ideal: error-free increments, (N, K) m/s, K a multiple of three.
        section: the [imu] section of a scenario.
        seed: the run's seed; the first three accelerometers draw as the triad of an ordinary block does.

    Returns:
        Measured increments, (N, K) m/s.

    Raises:
        InputError: a number of accelerometers that is no multiple of three, or what `emulate` refuses.
    """
    if ideal.ndim != 2 or ideal.shape[1] % 3:
        raise InputError(f"accelerometers are emulated in threes; got an array of shape {ideal.shape}.")
    measured = np.empty_like(ideal)
    for first in range(0, ideal.shape[1], 3):
        triad = slice(first, first + 3)
        own = seed + first // 3 * _APART
        accel = replace(draw(section, own).accel, misalignment=np.zeros((3, 3)))
        block = ImuData(time, np.zeros((len(ideal), 3)), np.ascontiguousarray(ideal[:, triad]))
        measured[:, triad] = emulate(block, ImuErrors(TriadErrors(), accel), own).dvel
    return measured
