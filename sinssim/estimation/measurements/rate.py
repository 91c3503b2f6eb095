"""Angular rate relative to the Earth: residual W x, the error of the rate."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind
from sinssim.estimation.model import ErrorModel


class ZeroRate(MeasurementKind):
    """Rate relative to the Earth about the body's axes [rad/s], zero except for disturbances of the vehicle."""

    columns = ("rate_x_radps", "rate_y_radps", "rate_z_radps")
    axes = ("x", "y", "z")
    unit = "radps"
    velocities = 3
    mean_rate = True

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the mean rate of the gyros; see the base."""
        return at.turning() - value, at.turning_error()

    def noise(self, model: ErrorModel, interval: Array) -> Array:
        """Return the variance of the gyros' mean rate over T: random walk N²/T and rounding at both ends Q²/6T²."""
        return np.asarray(model.gyro_noise**2 / interval + model.gyro_quantum**2 / (6.0 * interval**2))
