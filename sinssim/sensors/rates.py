"""A block that gives rates instead of increments, and the increments that navigation makes of them.

Mean rates are increments divided by the interval, so that navigation obtains the same increments again. Instantaneous
rates r_k at the time stamps t_k are integrated by the trapezoidal rule,

    (1) Δβ_k = ½ (r_{k−1} + r_k) T,

like those of recorded sensors (`sinssim.logs.increments`). An oscillation of the angular frequency Ω is integrated with
the factor κ = x/tan x of its amplitude, x = ΩT/2; the products that coning and sculling consist of have the factor κ².
A coning motion of the half-angle a, whose rate is ½ a²Ω, therefore causes the drift

    (2) d' = κ² (½ a²Ω + d) − ½ a²Ω

where d is the drift of the algorithm on exact increments; to second order in T it is d − ½ a²Ω (ΩT)²/6.

Every reading is rounded by itself to a multiple of Q/T, where Q is the quantum, because nothing is accumulated. The
error of one rounding is white noise of the density Q/√(12 T).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sinssim import sensors
from sinssim.data import Array, ImuData
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.rectification import rectified
from sinssim.truth.trajectory import Trajectory


def perfect_increments(trajectory: Trajectory, ideal: ImuData, imu: Imu) -> ImuData:
    """Return the increments that navigation makes of the output of a block without errors.

    Returns:
        The increments; the ideal ones unless the block gives instantaneous rates.
    """
    if imu.output != "instantaneous-rates":
        return ideal
    return _by_trapezoids(_at_the_stamps(trajectory, ideal))


def measured_increments(
    trajectory: Trajectory,
    ideal: ImuData,
    imu: Imu,
    errors: ImuErrors,
    seed: int,
    calibration: ImuErrors | None,
) -> tuple[ImuData, ImuData | None]:
    """Return the increments that navigation makes of the output of a block with errors.

    Args:
        seed: the run's seed.
        calibration: calibration values; None without a compensation.

    Returns:
        Measured increments, and those after the compensation, which acts on the readings; None without one.

    Raises:
        InputError: as of `emulate` and of `compensate`.
    """
    instantaneous = imu.output == "instantaneous-rates"
    if instantaneous:  # the response of a sensor acts on the values at the stamps
        true = _at_the_stamps(trajectory, ideal)
    else:
        true = rectified(trajectory, ideal, errors)
    if imu.output == "increments":
        read = sensors.emulate(true, errors, seed, rounded=True)
    else:
        read = _rounded(sensors.emulate(true, _without_pulses(errors), seed, rounded=True), errors)
        if read.time is not true.time:  # jitter: navigation multiplies the rates by the intervals of the stamps
            longer = (np.diff(read.time) / np.diff(true.time))[:, None]
            read = replace(read, dtheta=read.dtheta * longer, dvel=read.dvel * longer)
    left = None if calibration is None else compensate(read, calibration)
    if not instantaneous:
        return read, left
    return _by_trapezoids(read), None if left is None else _by_trapezoids(left)


def of_output(sigma: ImuErrors, imu: Imu) -> ImuErrors:
    """Return the standard deviations of a block's errors with the noise of its output.

    Returns:
        The same for increments; for rates, the rounding is white noise and part of the random walk.
    """
    if imu.output == "increments":
        return sigma
    root = math.sqrt(imu.rate_hz / 12.0)
    gyro, accel = (
        replace(one, quantum=0.0, random_walk=math.hypot(one.random_walk, root * one.quantum))
        for one in (sigma.gyro, sigma.accel)
    )
    return replace(sigma, gyro=gyro, accel=accel)


def _at_the_stamps(trajectory: Trajectory, ideal: ImuData) -> ImuData:
    """Return the rates at the edges of the samples, times the interval, as N + 1 samples that end there."""
    time = ideal.time
    interval = float(time[-1] - time[0]) / len(ideal)
    rate, force = trajectory.rates(time)
    return ImuData(np.concatenate([time[:1] - interval, time]), rate * interval, force * interval)


def _by_trapezoids(read: ImuData) -> ImuData:
    """Return the increments of N + 1 readings at the edges of N samples, (1)."""

    def between(rows: Array) -> Array:
        return np.asarray(0.5 * (rows[1:] + rows[:-1]))

    flags = None if read.flags is None else read.flags[1:] | read.flags[:-1]
    return ImuData(read.time[1:], between(read.dtheta), between(read.dvel), flags)


def _without_pulses(errors: ImuErrors) -> ImuErrors:
    gyro, accel = (replace(triad, quantum=0.0) for triad in (errors.gyro, errors.accel))
    return replace(errors, gyro=gyro, accel=accel)


def _rounded(read: ImuData, errors: ImuErrors) -> ImuData:
    """Round each reading by itself."""

    def steps(rows: Array, triad: TriadErrors) -> Array:
        return np.asarray(np.rint(rows / triad.quantum) * triad.quantum) if triad.quantum else rows

    return replace(read, dtheta=steps(read.dtheta, errors.gyro), dvel=steps(read.dvel, errors.accel))
