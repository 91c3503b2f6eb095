"""Height above the ellipsoid: residual −δr_D."""

from __future__ import annotations

from typing import ClassVar

from sinssim.data import Array
from sinssim.estimation.dynamics import R
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class BaroHeight(MeasurementKind):
    """Height above the ellipsoid [m]."""

    columns = ("height_m",)
    axes = ("",)
    unit = "m"
    diagnosed: ClassVar = {"bias": 1000.0, "scale": 0.3}

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the height; see the base."""
        h = at.zeros(1)
        h[:, 0, R.start + 2] = -1.0
        return at.state.height[:, None] - value, h
