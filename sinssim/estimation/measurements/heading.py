"""Heading of the forward axis: atan2(c_E, c_N), residual −φ_D + c_D (c_N φ_N + c_E φ_E)/(c_N² + c_E²).

c is the forward axis in north, east, down, or the line from one antenna to another. The deviation A sin ψ + B cos ψ of
a compass is an error of the reading.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sinssim.data import Array
from sinssim.estimation.dynamics import PHI
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class Heading(MeasurementKind):
    """Heading of the forward axis [rad]."""

    columns = ("heading_rad",)
    axes = ("",)
    unit = "rad"
    rounding = "gyros"
    of_north = True
    own_errors: ClassVar = {"deviation": (("sin", "cos"), "rad")}
    diagnosed: ClassVar = {"bias": 1.0}

    def direction(self, at: Comparison) -> Array:
        """Return the line whose heading is read, in body axes, (3,)."""
        return np.array([1.0, 0.0, 0.0])

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare modulo 2π; see the base."""
        along = at.c_nb @ self.direction(at)
        north, east, down = along.T
        deviation = at.states("deviation")
        if deviation is not None:
            wave = along[:, 1::-1] / np.hypot(north, east)[:, None]  # sin ψ, cos ψ
            value = value - wave @ at.known("deviation")[:, None]
        off = np.arctan2(east, north)[:, None] - value
        h = at.zeros(1)
        level = down / (north**2 + east**2)
        h[:, 0, PHI] = np.stack([level * north, level * east, np.full_like(level, -1.0)], axis=1)
        if deviation is not None:
            h[:, 0, deviation] -= wave
        return np.mod(off + np.pi, 2.0 * np.pi) - np.pi, h


class BaselineHeading(Heading):
    """Heading of the line from one satellite antenna to another, whose vector is the lever arm [rad]."""

    on_gnss_clock = True
    own_errors: ClassVar = {}

    def direction(self, at: Comparison) -> Array:
        """Return the vector from the first antenna to the second, in body axes, (3,)."""
        return at.lever_arm
