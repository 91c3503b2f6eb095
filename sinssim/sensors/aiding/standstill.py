"""The knowledge that a vehicle stands: zero velocity and zero angular rate, but for what wind and engines shake."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.scenario.aiding import ZeroRateSection, ZeroVelocitySection
from sinssim.sensors.aiding.lever_arm import turning
from sinssim.sensors.aiding.noise import white
from sinssim.sensors.aiding.readings import Mask, Sensed, epochs, sensed, within
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, DEG_H

_AT_REST_MPS = 0.05
_AT_REST = 0.05 * DEG
"""Slower than this, m/s and rad/s, a vehicle stands."""


def zero_velocity(trajectory: Trajectory, section: ZeroVelocitySection, seed: int = 0) -> Sensed:
    """Return zero velocities for the times when the vehicle stands, off by what shakes it.

    Args:
        trajectory: the true motion of the sensor block.
        section: how it is known.
        seed: the run's seed.

    Returns:
        Velocities north, east, down; of a vehicle that moves all the time, none.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "zero_velocity")
    sigma = (s.sigma_mps,) * 3
    value = white(seed, "zero velocity noise", sigma, len(time))
    there = _stops(trajectory, section, time)
    return sensed("zero-velocity", "zero-velocity", s, time, value, sigma, {}, there=there)


def zero_rate(trajectory: Trajectory, section: ZeroRateSection, seed: int = 0) -> Sensed:
    """Return zero rates of the block relative to the Earth for the times when the vehicle stands.

    Args:
        trajectory: the true motion of the sensor block.
        section: how it is known.
        seed: the run's seed.

    Returns:
        Angular rates about the block's axes, rad/s; of a vehicle that moves all the time, none.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "zero_rate")
    sigma = (DEG_H * s.sigma_deg_h,) * 3
    value = white(seed, "zero rate noise", sigma, len(time))
    return sensed("zero-rate", "zero-rate", s, time, value, sigma, {}, there=_stops(trajectory, section, time))


def _stops(trajectory: Trajectory, section: ZeroVelocitySection | ZeroRateSection, time: Array) -> Mask:
    """Say at which instants the vehicle stands, or is said to."""
    if section.during_s is not None:
        return within(time, section.during_s)
    state = trajectory.state(time)
    speed = np.linalg.norm(state.velocity_ned, axis=1)
    rate = np.linalg.norm(turning(trajectory, time, state), axis=1)
    return np.asarray((speed < _AT_REST_MPS) & (rate < _AT_REST))
