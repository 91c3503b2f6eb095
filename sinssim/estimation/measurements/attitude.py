"""Whole attitudes: relative to the local level, residual −C_bn φ; relative to the Earth, C_bn (θ − φ).

Residuals are rotation vectors about the body's axes. θ = (δr_E/(R₂+h), −δr_N/(R₁+h), −δr_E tan φ/(R₂+h)) is the
rotation of the local level caused by an error of position.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.estimation.dynamics import PHI, R
from sinssim.estimation.measurements.kind import Comparison, MeasurementKind


class LevelAttitude(MeasurementKind):
    """Attitude q_nb in the local level, scalar first; residual about the body's axes [rad]."""

    columns = ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z")
    axes = ("x", "y", "z")
    unit = "rad"
    diagnosed: ClassVar = {"bias": 0.5}
    rounding = "gyros"
    of_north = True

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the attitude in the local level; see the base."""
        off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), at.state.q_nb)
        h = at.zeros(3)
        h[:, :, PHI] = -at.c_bn
        return rotation.rotation_vector_from_quaternion(off), h

    def less_bias(self, value: Array, bias: Array) -> Array:
        """Return readings with a bias about the body's axes removed."""
        return rotation.multiply(value, rotation.quaternion_from_rotation_vector(-bias))


class EarthAttitude(LevelAttitude):
    """Attitude q_eb relative to Earth-fixed axes, scalar first; residual about the body's axes [rad]."""

    columns = ("q_eb_w", "q_eb_x", "q_eb_y", "q_eb_z")
    of_north = False

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare with the attitude relative to the Earth; see the base."""
        state = at.state
        q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)
        off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), q_eb)
        r1, r2 = earth.radii(state.latitude, at.ellipsoid)
        turn = np.zeros((len(r1), 3, 3))
        turn[:, 0, 1] = 1.0 / (r2 + state.height)
        turn[:, 1, 0] = -1.0 / (r1 + state.height)
        turn[:, 2, 1] = -np.tan(state.latitude) / (r2 + state.height)
        h = at.zeros(3)
        h[:, :, PHI] = -at.c_bn
        h[:, :, R] = at.c_bn @ turn
        return rotation.rotation_vector_from_quaternion(off), h
