"""An attitude reference: the attitude of the block in the local level, with noise and drift."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from sinssim import rotation
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, Noise3, SensorState, Vehicle, correlated, white
from sinssim.sensors.measurement_kind import MeasurementKind, compare_attitude, turned_back
from sinssim.toml_section import CorrelationTime, Spread
from sinssim.units import ARCMIN


class AttitudeReference(AidingSensor):
    """An attitude reference, which measures the attitude of the sensor block relative to the local level frame."""

    kinds: ClassVar = (
        MeasurementKind(
            "attitude",
            columns=("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"),
            axes=("x", "y", "z"),
            unit="rad",
            compare=compare_attitude,
            less_bias=turned_back,
            rounding="gyros",
            diagnosed={"bias": 0.5},
            of_north=True,
        ),
    )

    sigma_arcmin: Noise3 = Field(default=(6.0, 6.0, 18.0), description="white noise about forward, right and down")
    bias_sigma_arcmin: Spread = Field(default=0.0, description="1σ of the Gauss-Markov error about each axis")
    bias_correlation_time_s: CorrelationTime = Field(default=600.0, description="correlation time of this error")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return attitudes q_nb ∘ q(ε), ε noise and drift about the block's axes."""
        s, seed = self, vehicle.seed
        time = s.epochs(vehicle.trajectory)
        slow = (ARCMIN * s.bias_sigma_arcmin,) * 3
        bias = correlated(seed, "attitude drift", slow, time, s.bias_correlation_time_s)
        sigma = ARCMIN * np.array(s.sigma_arcmin)
        error = bias + white(seed, "attitude noise", sigma, len(time))
        q_nb = vehicle.trajectory.state(time).q_nb
        value = rotation.multiply(q_nb, rotation.quaternion_from_rotation_vector(error))
        return [s.readings("attitude", "attitude", time, value, sigma, {"attitude bias": bias})]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the drift about the block's axes."""
        sigma = (ARCMIN * self.bias_sigma_arcmin,) * 3
        yield SensorState("attitude bias", sigma, self.bias_correlation_time_s, key="bias_sigma_arcmin")
