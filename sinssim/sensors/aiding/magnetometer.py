"""A magnetic compass: the block's heading with the errors of the declination, of hard iron, and noise."""

from __future__ import annotations

import numpy as np

from sinssim import rotation
from sinssim.scenario.aiding import MagnetometerSection
from sinssim.sensors.aiding.noise import turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG


def magnetometer(trajectory: Trajectory, section: MagnetometerSection, seed: int = 0) -> Sensed:
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
    time = epochs(trajectory, s, "magnetometer")
    heading = rotation.euler_from_quaternion(trajectory.state(time).q_nb)[2]
    bias = turn_on(seed, "magnetometer bias", s.bias_deg, s.bias_sigma_deg)
    a, b = (turn_on(seed, "magnetometer deviation", None, s.deviation_sigma_deg, i) for i in range(2))
    error = DEG * (bias + a * np.sin(heading) + b * np.cos(heading))[:, np.newaxis]
    true = {"magnetometer bias": DEG * np.array([bias]), "magnetometer deviation": DEG * np.array([a, b])}
    noise = DEG * white(seed, "magnetometer noise", (s.sigma_deg,), len(time))
    value = np.mod(heading[:, np.newaxis] + error + noise, 2.0 * np.pi)
    return sensed("magnetometer", "heading", s, time, value, (DEG * s.sigma_deg,), true)
