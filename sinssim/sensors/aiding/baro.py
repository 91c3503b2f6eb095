"""A barometric altimeter: height with errors of the pressure field, of the instrument and of its tube.

In a flight with [flight.atmosphere] it reads the pressure altitude: the height at which the standard atmosphere has the
pressure around the aircraft. Otherwise the air is taken for the standard atmosphere, and it reads the height.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.sensors.aiding_sensor import (
    AidingReadings,
    AidingSensor,
    SensorState,
    Vehicle,
    correlated,
    lagged,
    turn_on,
    white,
)
from sinssim.sensors.measurement_kind import MeasurementKind, compare_height
from sinssim.toml_section import CorrelationTime, Moment, Noise, Offset, Spread
from sinssim.truth.flight.atmosphere import STANDARD_TEMPERATURE, Air
from sinssim.units import PPM

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


class Barometer(AidingSensor):
    """A barometric altimeter, which measures the height above the ellipsoid."""

    kinds: ClassVar = (
        MeasurementKind(
            "baro-height",
            columns=("height_m",),
            unit="m",
            compare=compare_height,
            diagnosed={"bias": 1000.0, "scale": 0.3},
        ),
    )

    sigma_m: Noise = Field(default=1.0, description="white noise")
    bias_m: Offset = Field(default=0.0, description="constant error, which is unknown to the filter")
    bias_sigma_m: Spread = Field(default=10.0, description="1σ of the Gauss-Markov error due to the pressure field")
    bias_correlation_time_s: CorrelationTime = Field(default=7200.0, description="correlation time of this error")
    scale_ppm: Offset | None = Field(default=None, description="given relative error of the height")
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    lag_s: Moment = Field(default=0.0, description="time constant of the sensor's first-order lag")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return heights (1 + k) h + b + b(t) + ν, with h lagged; h is the pressure altitude if the air has one.

        The filter models a lag τ as a delay by τ, which is exact in a steady climb.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        logged = trajectory.channels.get("pressure_altitude_m")

        def height(t: Array) -> Array:
            if logged is not None:
                return np.asarray(np.interp(t, logged.time, logged.values))
            return trajectory.state(t).height

        scale = PPM * turn_on(seed, "baro scale", s.scale_ppm, s.scale_sigma_ppm)
        bias = s.bias_m + correlated(seed, "baro bias", (s.bias_sigma_m,), time, s.bias_correlation_time_s)
        value = (1.0 + scale) * lagged(height, trajectory.start, time, s.lag_s)[:, np.newaxis] + bias
        value += white(seed, "baro noise", (s.sigma_m,), len(time))
        true = {"baro bias": bias, "baro scale": np.array([scale])}
        if logged is not None:
            of_air = _scale_of_air(trajectory) if self.scale_sigma_ppm or self.scale_ppm else 0.0  # all in the bias
            true["baro scale"] = np.array([(1.0 + scale) * (1.0 + of_air) - 1.0])
            field = height(time) - (1.0 + of_air) * trajectory.state(time).height
            true["baro bias"] = bias + (1.0 + scale) * field[:, np.newaxis]
        return [s.readings("baro", "baro-height", time, value, (s.sigma_m,), true, lag=s.lag_s)]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the pressure field's error and of the scale factor."""
        yield SensorState("baro bias", (self.bias_sigma_m,), self.bias_correlation_time_s, key="bias_sigma_m")
        scale = PPM * math.hypot(self.scale_sigma_ppm, self.scale_ppm or 0.0)
        yield SensorState("baro scale", (scale,), key="scale_sigma_ppm")


def _scale_of_air(trajectory: Trajectory) -> float:
    """Return the relative error of the pressure altitude in the troposphere, −ΔT/(T0 + ΔT).

    Pressure falls with the power g/(RL) of (T0 + ΔT − L H)/(T0 + ΔT), so that equal pressures lie at geopotential
    heights H in the ratio of the temperatures at sea level.
    """
    temperature = trajectory.channels["static_temperature_k"]
    first = float(trajectory.state(temperature.time[:1]).height[0])
    deviation = float(temperature.values[0]) - Air().temperature(first)
    return -deviation / (STANDARD_TEMPERATURE + deviation)
