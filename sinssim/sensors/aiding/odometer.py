"""An odometer: the speed of a wheel along the block's forward axis."""

from __future__ import annotations

import numpy as np

from sinssim import rotation
from sinssim.scenario.aiding import OdometerSection
from sinssim.sensors.aiding.lever_arm import state_at
from sinssim.sensors.aiding.noise import turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import PPM


def odometer(trajectory: Trajectory, section: OdometerSection, seed: int = 0) -> Sensed:
    """Return what an odometer reads: (1 + k) v_x + ν, v_x being the forward velocity of the wheel.

    Args:
        trajectory: the true motion of the sensor block.
        section: the odometer.
        seed: the run's seed.

    Returns:
        Speeds along the forward axis.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "odometer")
    wheel = state_at(trajectory, time, s.lever_arm_m)
    forward = rotation.rotate(rotation.conjugate(wheel.q_nb), wheel.velocity_ned)[:, :1]
    scale = PPM * turn_on(seed, "odometer scale", s.scale_ppm, s.scale_sigma_ppm)
    value = (1.0 + scale) * forward + white(seed, "odometer noise", (s.sigma_mps,), len(time))
    true = {"odometer scale": np.array([scale])}
    return sensed("odometer", "speed", s, time, value, (s.sigma_mps,), true, lever_arm=s.lever_arm_m)
