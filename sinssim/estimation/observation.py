"""Residuals and H of the readings of any aiding sensor, for the filter: what inertial navigation predicts for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array, Measurements, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.dynamics import rate_error
from sinssim.estimation.earth_dynamics import refer_to_transported
from sinssim.estimation.model import ErrorModel
from sinssim.sensors.aiding.base.measurement import Comparison, MeasurementKind
from sinssim.sensors.aiding.registry import measurement_kind


@dataclass(frozen=True)
class Prediction:
    """Inertial navigation at the instants of some readings.

    Attributes:
        state: M rows.
        rate_b: inertial rate of the body, or its mean over the reading's interval, (M, 3) rad/s.
        ellipsoid: reference ellipsoid.
        sensed: of a block that turns in the vehicle, the rate that its gyros sense, (M, 3) rad/s, and C_vb, which
            takes its axes into the vehicle's, (M, 3, 3); None for a block that does not turn.
    """

    state: NavState
    rate_b: Array
    ellipsoid: Ellipsoid
    sensed: tuple[Array, Array] | None = None

    def rate_error(self, model: ErrorModel) -> Array:
        """Return the matrix of the rate's error by the gyros' states, (M, 3, n)."""
        if self.sensed is None:
            return rate_error(model, self.rate_b)
        rate, c_vb = self.sensed
        return np.asarray(c_vb @ rate_error(model, rate))


def observe(
    measurements: Measurements, prediction: Prediction, model: ErrorModel, parameters: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Return residuals and H of readings.

    Args:
        parameters: values of the sensors' compensated parameters, by block.

    Returns:
        Residuals, prediction less reading, (M, k), and H, (M, k, n).
    """
    kind, p = measurement_kind(measurements.kind), prediction
    arm = np.asarray(measurements.lever_arm, dtype=np.float64)
    if kind.at_antenna and "gnss lever arm" in model.slices:
        arm = arm + parameters["gnss lever arm"]
    at = Comparison(
        p.state, p.rate_b, lambda: p.rate_error(model), p.ellipsoid, model, parameters, measurements.label, arm
    )
    residual, h = kind.observe(at, measurements.value)
    if model.axes == "transported" and kind.turns_with_north:
        refer_to_transported(h, p.state, p.ellipsoid)
    return residual, h


def delays(kind: MeasurementKind, label: str, model: ErrorModel) -> list[str]:
    """Return the names of the blocks that describe by how much readings of a sensor are stamped too late."""
    own = [f"{label} delay", *(["gnss time offset"] if kind.on_gnss_clock else [])]
    return [name for name in own if name in model.slices]
