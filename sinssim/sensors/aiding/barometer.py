"""A barometric altimeter: height with the errors of the pressure field, of the instrument and of its tube."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.scenario.aiding import BarometerSection
from sinssim.sensors.aiding.lag import lagged
from sinssim.sensors.aiding.noise import correlated, turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import PPM


def barometer(trajectory: Trajectory, section: BarometerSection, seed: int = 0) -> Sensed:
    """Return what a barometric altimeter reads: (1 + k) h + b + b(t) + ν, with h lagged.

    Args:
        trajectory: the true motion of the sensor block.
        section: the altimeter.
        seed: the run's seed.

    Returns:
        Its heights; for the filter a lag is so much of a delay, which is what it is in a steady climb.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "baro")

    def height(t: Array) -> Array:
        return trajectory.state(t).height

    scale = PPM * turn_on(seed, "baro scale", s.scale_ppm, s.scale_sigma_ppm)
    bias = s.bias_m + correlated(seed, "baro bias", (s.bias_sigma_m,), time, s.bias_correlation_time_s)
    value = (1.0 + scale) * lagged(height, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
    value += white(seed, "baro noise", (s.sigma_m,), len(time))
    true = {"baro bias": bias, "baro scale": np.array([scale])}
    return sensed("baro", "baro-height", s, time, value, (s.sigma_m,), true, lag=s.lag_s)
