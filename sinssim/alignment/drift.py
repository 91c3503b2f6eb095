"""Largest change of readings at rest within a session by the drifts of the sensors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sinssim.alignment.budget import INSTANTS, Expected
from sinssim.data import Array
from sinssim.earth.models import OMEGA_IE
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.units import G0


class Drift(NamedTuple):
    """Largest change of readings within a session of a vehicle at rest.

    Attributes:
        rate: known part of the change of a rate, rad/s.
        rate_sigma: standard deviation of the unknown part, rad/s.
        force: known part of the change of a specific force, m/s².
        force_sigma: standard deviation of the unknown part, m/s².
    """

    rate: float
    rate_sigma: float
    force: float
    force_sigma: float


def largest_drift(expected: Expected, duration: float, start: float = 0.0) -> Drift:
    """Return the largest change of a reading at rest within a session by the drifts of the sensors.

    Args:
        expected: expected errors of the sensor block.
        duration: length of the session, s.
        start: time from when the sensors were switched on to its first sample, s.

    Returns:
        The largest change over the axes.
    """
    ends = np.array([start, start + duration])
    warmth = expected.mean.warm_up.temperature(ends)

    def of_triad(name: str, reading: float) -> tuple[float, float]:
        mean, sigma = getattr(expected.mean, name), getattr(expected.sigma, name)

        def driven(of: TriadErrors) -> Array:  # by temperature and time, each term by itself
            x, force = np.full((2, 3), reading), np.full((2, 3), G0)
            squares = ((np.diff(t.inputs(x, force, warmth, ends), axis=0)[0] * v) ** 2 for t, v in of.acting)
            axes = (one.sum(axis=-1) if one.ndim == 2 else one for one in squares)
            return np.sqrt(sum(axes, np.zeros(3)))

        remembered = np.exp(-duration / sigma.correlation_time)
        wandered = sigma.rate_walk**2 * duration + 2.0 * sigma.instability**2 * (1.0 - remembered)
        # density B²/(πf): the variance between means over a second at a distance T is (2B²/π)(ln T + 3/2)
        wandered += sigma.flicker**2 * 2.0 / np.pi * (np.log(max(duration, 1.0)) + 1.5)
        return float(np.max(driven(mean))), float(np.max(np.sqrt(driven(sigma) ** 2 + wandered)))

    rate, rate_sigma = of_triad("gyro", OMEGA_IE)
    if (shift := expected.mean.null_shift) is not None:
        instants = start + duration * np.linspace(0.0, 1.0, INSTANTS)
        rate += float(np.ptp(shift.bias(expected.mean.warm_up.temperature(instants))))
    return Drift(rate, rate_sigma, *of_triad("accel", G0))
