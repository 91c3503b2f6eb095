"""Position of the satellite antenna: r + C l, residual δr + [C l ×] φ − C δl.

C = C_nb, l the lever arm, δl its error, φ the attitude's.
"""

from __future__ import annotations

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.estimation.dynamics import PHI, R, skew
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class GnssPosition(MeasurementKind):
    """Latitude, longitude [rad] and height [m] of the antenna; residual north, east, down [m]."""

    columns = ("latitude_rad", "longitude_rad", "height_m")
    axes = ("n", "e", "d")
    unit = "m"
    at_antenna = True
    on_gnss_clock = True
    turns_with_north = False  # compared in Earth-fixed axes; [C l ×] is that of a lever arm that goes along

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare in Earth-fixed axes, which have no poles; see the base."""
        state, ellipsoid = at.state, at.ellipsoid
        q_en = earth.q_en(state.latitude, state.longitude)
        measured = earth.geodetic_to_ecef(value[:, 0], value[:, 1], value[:, 2], ellipsoid)
        height = value[:, 2]
        arm = np.einsum("kij,j->ki", at.c_nb, at.lever_arm)
        if at.lever_arm.any():  # predicted position of the block
            measured -= rotation.rotate(q_en, arm)
            height = earth.ecef_to_geodetic(measured, ellipsoid)[2]
        off = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid) - measured
        residual = rotation.rotate(rotation.conjugate(q_en), off)
        residual[:, 2] = height - state.height
        h = at.zeros(3)
        h[:, :, R] = np.eye(3)
        h[:, :, PHI] = skew(arm)
        if (where := at.model.slices.get("gnss lever arm")) is not None:
            h[:, :, where] = -at.c_nb
        return residual, h

    def less_bias(self, value: Array, bias: Array) -> Array:
        """Return the readings unchanged: the bias is in metres, and `observe` subtracts it from the residual."""
        return value

    def observe(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Return residuals and H; the bias is north, east, down in metres."""
        residual, h = super().observe(at, value)
        return (residual if at.states("bias") is None else residual + at.known("bias")), h

    def fault(self, value: Array) -> str:
        """Return why a reading cannot be used, "" if it can."""
        return "a latitude beyond a pole (radians are expected)" if abs(value[0]) > 0.5 * np.pi else ""
