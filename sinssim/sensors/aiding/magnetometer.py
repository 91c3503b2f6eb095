"""A magnetic compass: the block's heading with the errors of the declination, of hard iron, and noise."""

from __future__ import annotations

import numpy as np

from sinssim import rotation
from sinssim.data import Measurements
from sinssim.scenario.aiding import MagnetometerSection
from sinssim.sensors.aiding.noise import turn_on, white
from sinssim.sensors.aiding.readings import epochs, readings
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG


def magnetometer(trajectory: Trajectory, section: MagnetometerSection, seed: int = 0) -> Measurements:
    """Return what a magnetic compass reads: ψ + b + A sin ψ + B cos ψ + ν.

    Args:
        trajectory: the true motion of the sensor block.
        section: the compass.
        seed: the run's seed.

    Returns:
        Headings of the block's forward axis from true north, 0 … 2π.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s)
    heading = rotation.euler_from_quaternion(trajectory.state(time).q_nb)[2]
    bias = turn_on(seed, "magnetometer bias", s.bias_deg, s.bias_sigma_deg)
    a, b = (turn_on(seed, "magnetometer deviation", None, s.deviation_sigma_deg, i) for i in range(2))
    error = bias + a * np.sin(heading) + b * np.cos(heading)
    error += white(seed, "magnetometer noise", (s.sigma_deg,), len(time))[:, 0]
    value = np.mod(heading + DEG * error, 2.0 * np.pi)[:, np.newaxis]
    return readings("heading", s, time, value, (DEG * s.sigma_deg,))
