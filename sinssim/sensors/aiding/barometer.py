"""A barometric altimeter: height with errors of the pressure field, of the instrument and of its tube."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.section import CorrelationTime, Moment, Noise, Offset, Spread
from sinssim.sensors.aiding.base.lag import lagged
from sinssim.sensors.aiding.base.random_errors import correlated, turn_on, white
from sinssim.sensors.aiding.base.sensor import AidingReadings, AidingSensor, SensorState, Vehicle
from sinssim.units import PPM


class BarometerSection(AidingSensor):
    """A barometric altimeter, which measures the height above the ellipsoid."""

    sigma_m: Noise = Field(default=1.0, description="white noise")
    bias_m: Offset = Field(default=0.0, description="constant error that is unknown to the filter")
    bias_sigma_m: Spread = Field(default=10.0, description="1σ of the Gauss-Markov error of the pressure field")
    bias_correlation_time_s: CorrelationTime = Field(default=7200.0, description="correlation time of this error")
    scale_ppm: Offset | None = Field(default=None, description="given relative error of the height")
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    lag_s: Moment = Field(default=0.0, description="time constant of the sensor's first-order lag")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return heights (1 + k) h + b + b(t) + ν, with h lagged.

        The filter models a lag τ as a delay by τ, which is exact in a steady climb.

        Args:
            vehicle: the vehicle that carries the altimeter.

        Returns:
            "baro", heights above the ellipsoid.

        Raises:
            InputError: the motion ends before the first reading, or the seed cannot be used.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)

        def height(t: Array) -> Array:
            return trajectory.state(t).height

        scale = PPM * turn_on(seed, "baro scale", s.scale_ppm, s.scale_sigma_ppm)
        bias = s.bias_m + correlated(seed, "baro bias", (s.bias_sigma_m,), time, s.bias_correlation_time_s)
        value = (1.0 + scale) * lagged(height, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
        value += white(seed, "baro noise", (s.sigma_m,), len(time))
        true = {"baro bias": bias, "baro scale": np.array([scale])}
        return [s.readings("baro", "baro-height", time, value, (s.sigma_m,), true, lag=s.lag_s)]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the pressure field's error and of the scale factor."""
        yield SensorState("baro bias", (self.bias_sigma_m,), self.bias_correlation_time_s)
        yield SensorState("baro scale", (PPM * math.hypot(self.scale_sigma_ppm, self.scale_ppm or 0.0),))
