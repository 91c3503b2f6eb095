"""A star tracker: the attitude relative to the stars, referred to Earth-fixed axes by the time.

It does not sense the local level: tilts computed from it have the error of the assumed position.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from sinssim import earth, rotation
from sinssim.section import Spread
from sinssim.sensors.aiding.base.random_errors import turn_on, white
from sinssim.sensors.aiding.base.sensor import AidingReadings, AidingSensor, Noise3, SensorState, Vehicle
from sinssim.units import ARCSEC


class StarTrackerSection(AidingSensor):
    """A star tracker, which measures the attitude of the sensor block in inertial space."""

    sigma_arcsec: Noise3 = Field(default=(5.0, 5.0, 5.0), description="white noise about forward, right and down")
    bias_sigma_arcsec: Spread = Field(default=0.0, description="1σ of the mounting error about each axis")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return attitudes q_eb ∘ q(ε), ε noise and the mounting's error about the block's axes.

        Args:
            vehicle: the vehicle that carries the tracker.

        Returns:
            "star-tracker", unit quaternions q_eb; the 1σ is about each axis of the block.

        Raises:
            InputError: the motion ends before the first reading, or the seed cannot be used.
        """
        s, seed = self, vehicle.seed
        time = s.epochs(vehicle.trajectory)
        mounting = ARCSEC * s.bias_sigma_arcsec
        bias = np.array([turn_on(seed, "star tracker mounting", None, mounting, axis) for axis in range(3)])
        sigma = ARCSEC * np.array(s.sigma_arcsec)
        error = bias + white(seed, "star tracker noise", sigma, len(time))
        state = vehicle.trajectory.state(time)
        q_nb = rotation.multiply(state.q_nb, rotation.quaternion_from_rotation_vector(error))
        value = rotation.multiply(earth.q_en(state.latitude, state.longitude), q_nb)
        return [s.readings("star-tracker", "earth-attitude", time, value, sigma, {"star-tracker bias": bias})]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the mounting error about the block's axes."""
        yield SensorState("star-tracker bias", (ARCSEC * self.bias_sigma_arcsec,) * 3)
