"""A magnetic compass: the block's heading with errors of the declination and of hard iron, and noise."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from sinssim import rotation
from sinssim.section import Noise, Offset, Spread
from sinssim.sensors.aiding.base.random_errors import turn_on, white
from sinssim.sensors.aiding.base.sensor import AidingReadings, AidingSensor, SensorState, Vehicle
from sinssim.units import DEG


class MagnetometerSection(AidingSensor):
    """A magnetic compass, which measures the heading of the block after correction for declination."""

    sigma_deg: Noise = Field(default=0.5, description="white noise")
    bias_deg: Offset | None = Field(default=None, description="given error of declination and mounting")
    bias_sigma_deg: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    deviation_sigma_deg: Spread = Field(
        default=0.0, description="1σ of each of the two coefficients of A sin ψ + B cos ψ (hard iron)"
    )

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return headings ψ + b + A sin ψ + B cos ψ + ν.

        Args:
            vehicle: the vehicle that carries the compass.

        Returns:
            "magnetometer", headings of the block's forward axis from true north, 0 … 2π.

        Raises:
            InputError: the motion ends before the first reading, or the seed cannot be used.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        heading = rotation.euler_from_quaternion(trajectory.state(time).q_nb)[2]
        bias = turn_on(seed, "magnetometer bias", s.bias_deg, s.bias_sigma_deg)
        a, b = (turn_on(seed, "magnetometer deviation", None, s.deviation_sigma_deg, i) for i in range(2))
        error = DEG * (bias + a * np.sin(heading) + b * np.cos(heading))[:, np.newaxis]
        true = {"magnetometer bias": DEG * np.array([bias]), "magnetometer deviation": DEG * np.array([a, b])}
        noise = DEG * white(seed, "magnetometer noise", (s.sigma_deg,), len(time))
        value = np.mod(heading[:, np.newaxis] + error + noise, 2.0 * np.pi)
        return [s.readings("magnetometer", "heading", time, value, (DEG * s.sigma_deg,), true)]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the constant error and of the deviation's two coefficients."""
        yield SensorState("magnetometer bias", (DEG * math.hypot(self.bias_sigma_deg, self.bias_deg or 0.0),))
        yield SensorState("magnetometer deviation", (DEG * self.deviation_sigma_deg,) * 2)
