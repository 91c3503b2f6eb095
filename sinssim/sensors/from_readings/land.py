"""Readings of a land vehicle's non-holonomic constraint: it moves neither sideways nor up, where its tyres hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, doubles, number
from sinssim.checks import checked_increments
from sinssim.data import ImuData, Measurements
from sinssim.errors import InputError
from sinssim.sensors.from_readings.windows import windows_of

TYRES_HOLD = 4.0
"""Largest lateral acceleration at which the constraint is used, m/s². Up to there the slip angle of a passenger car's
tyres is proportional to it (Gillespie, Fundamentals of Vehicle Dynamics, 1992, chapter 6), so that a compliance
describes it; beyond, the tyres slide."""

_WINDOW_S = 0.5  # over which the lateral acceleration is averaged: longer than vibration, shorter than a turn


def land_velocity(
    imu: ImuData,
    *,
    rate_hz: float = 2.0,
    sigma: ArrayLike = (0.1, 0.1),
    angles: tuple[float, float] = (0.0, 0.0),
    lever_arm: ArrayLike = (0.0, 0.0, 0.0),
    limit: float = TYRES_HOLD,
    name: str = "",
) -> Measurements:
    """Return the readings of the constraint along a run.

    Args:
        sigma: 1σ of the velocity to the right, and down, by tyres, suspension and road, m/s.
        angles: assumed pitch and yaw of the vehicle's axes in the block's, rad.
        lever_arm: from the block to the middle of the rear axle, which does not steer, (3,) m.
        limit: lateral specific force beyond which there is no reading, m/s².

    Returns:
        "land-velocity", zero.

    Raises:
        InputError: an argument cannot be used.
    """
    checked_increments(imu)
    step = 1.0 / number("rate_hz", rate_hz, "measurements per second", low=POSITIVE)
    limit = number("limit", limit, "m/s²", low=POSITIVE)
    sigmas = doubles("sigma", sigma)
    if sigmas.shape != (2,):
        raise InputError(f"sigma has the shape {sigmas.shape}; it must be 1σ to the right and 1σ down.")
    found = windows_of(imu, _WINDOW_S, step)
    pitch, yaw = angles
    right = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    time = found.end[np.abs(found.mean[:, 3:] @ right) <= limit]
    value = np.zeros((len(time), 4))
    value[:, 2:] = pitch, yaw
    arm = np.asarray(lever_arm, dtype=np.float64)
    return Measurements("land-velocity", time, time, value, np.broadcast_to(sigmas, (len(time), 2)), arm, name)
