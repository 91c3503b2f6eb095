"""Single gyros and accelerometers with errors.

Readings of a redundant set and of a gyro-free block's accelerometers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import check_finite, check_kind, doubles
from sinssim.data import Array, ImuData
from sinssim.errors import InputError, shortened
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.error_term_table import CALIBRATED
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu, draw
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sets.redundant_geometry import along
from sinssim.sensors.sets.sensor_set import Redundant

# Each further triad of accelerometers has its own seed, far from those of scenarios.
APART = 1 << 32


def draw_accelerometers(imu: Imu, count: int, seed: int = 0) -> list[TriadErrors]:
    """Return the errors of single accelerometers, drawn in threes like those of a triad.

    Args:
        seed: the run's seed; the first three have the draws of the triad of a usual block.
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
    """Return the measured increments of single accelerometers of a grade: measured increments, (N, K) m/s.

    Each has all the errors that the block gives an accelerometer of a triad. It is emulated as one axis of a triad at
    its own place, with the two other axes perpendicular to it, so that its misalignment tilts it towards them.

    Args:
        time: edges of the intervals, (N+1,) s.
        force: integrals of the specific force at each accelerometer's place, (N, K, 3) m/s, K a multiple of three.
        direction: directions of the sensitive axes, unit vectors in the same axes, (K, 3).
        seed: the run's seed.
        errors: errors of the accelerometers in threes, if already drawn from block and seed.
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
        increments = force[:, k] @ axes_about(sensitive, axis).T
        block = ImuErrors(accel=triads[k // 3], warm_up=imu.warm_up)
        read = emulate(ImuData(time, np.zeros_like(increments), increments), block, seed + k // 3 * APART)
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


@dataclass(frozen=True)
class SingleSensors:
    """Increments of the m single gyros and the m single accelerometers of a redundant set.

    Attributes:
        time: edges of the samples, (N+1,) s; stamps with jitter if there is any.
        dtheta: angle increments along the sensitive axes, (N, m) rad.
        dvel: velocity increments along the sensitive axes, (N, m) m/s.
        flags: flags of the gyros and of the accelerometers, (N, 2m), as in `ImuData`; None without limits and faults.
    """

    time: Array
    dtheta: Array
    dvel: Array
    flags: NDArray[np.uint8] | None = None


def draw_single_sensors(imu: Imu, count: int, seed: int = 0) -> tuple[ImuErrors, ...]:
    """Return the errors of single sensors, drawn in threes like those of a triad.

    Args:
        seed: the run's seed; the first three have the draws of the triads of a usual block.

    Returns:
        A block without faults for every three gyros and three accelerometers; sensor i is axis i mod 3 of block i // 3.
    """
    sound = imu.model_copy(update={"faults": ()})
    return tuple(draw(sound, seed + number * APART) for number in range(-(-count // 3)))


def perfect_readings(ideal: ImuData, directions: Array) -> SingleSensors:
    """Return the readings of sensors without errors.

    Args:
        directions: sensitive axes, unit vectors in the block's axes, (m, 3).
    """
    return SingleSensors(ideal.time, along(ideal.dtheta, directions), along(ideal.dvel, directions))


def emulate_single_sensors(ideal: ImuData, imu: Imu, blocks: tuple[ImuErrors, ...], seed: int = 0) -> SingleSensors:
    """Return the measured increments of the single sensors of a redundant set.

    Each has all the errors that the block gives a sensor of a triad. A gyro and an accelerometer are emulated as one
    axis of a block whose two other axes are perpendicular to it, so that misalignment tilts it towards them.

    Args:
        imu: the sensor block, whose sensor set is redundant.
        blocks: result of `draw_single_sensors`.
        seed: the run's seed.
    """
    assert isinstance(imu.sensor_set, Redundant)
    directions = imu.sensor_set.axes
    count = len(directions)
    dtheta, dvel = np.empty((len(ideal), count)), np.empty((len(ideal), count))
    flags: NDArray[np.uint8] | None = None
    time = ideal.time
    for i, direction in enumerate(directions):
        axis, of = i % 3, blocks[i // 3]
        block = axes_about(direction, axis)
        increments = ImuData(ideal.time, along(ideal.dtheta, block), along(ideal.dvel, block))
        faults = tuple(fault.fault(i) for fault in imu.faults)
        read = emulate(increments, replace(of, faults=faults), seed + i // 3 * APART)
        dtheta[:, i], dvel[:, i] = read.dtheta[:, axis], read.dvel[:, axis]
        if i == 0:
            time = read.time  # all sensors of the set have the same stamps
        if read.flags is not None:
            flags = np.zeros((len(ideal), 2 * count), np.uint8) if flags is None else flags
            flags[:, i], flags[:, count + i] = read.flags[:, axis], read.flags[:, 3 + axis]
    return SingleSensors(time, dtheta, dvel, flags)


def compensate_single_sensors(
    readings: SingleSensors, calibrations: tuple[ImuErrors, ...], directions: Array, estimate: ImuData
) -> SingleSensors:
    """Compensate the errors of single sensors by calibration values, before they are combined.

    Args:
        calibrations: calibration values of the sensors in threes, in the order of `draw_single_sensors`.
        directions: sensitive axes, (m, 3).
        estimate: increments in the block's axes, which give the input across the sensitive axes.
    """
    dtheta, dvel = readings.dtheta.copy(), readings.dvel.copy()
    for i, direction in enumerate(directions):
        axis, block = i % 3, axes_about(direction, i % 3)
        increments = ImuData(readings.time, along(estimate.dtheta, block), along(estimate.dvel, block))
        increments.dtheta[:, axis], increments.dvel[:, axis] = readings.dtheta[:, i], readings.dvel[:, i]
        known = calibrations[i // 3]
        compensated = compensate_checked(
            increments, replace(known, gyro=_alone(known.gyro, axis), accel=_alone(known.accel, axis))
        )
        dtheta[:, i], dvel[:, i] = compensated.dtheta[:, axis], compensated.dvel[:, axis]
    return replace(readings, dtheta=dtheta, dvel=dvel)


def _alone(triad: TriadErrors, axis: int) -> TriadErrors:
    """Return the errors of one axis of a triad; the others have none."""
    fields: dict[str, Any] = {}
    for name in CALIBRATED:
        value = getattr(triad, name)
        fields[name] = np.where((np.arange(3) == axis).reshape((3,) + (1,) * (value.ndim - 1)), value, 0.0)
    return TriadErrors(**fields)
