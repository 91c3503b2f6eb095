"""Wraps filterpy's `KalmanFilter`: prediction, innovation and update, with gating and cross-covariance.

filterpy's class has no gate. State and residual are one-dimensional here: with a column as state and a one-dimensional
residual, filterpy would silently turn the state into a matrix.

P is never symmetrised, because rounding does not accumulate. A prediction turns an asymmetry A of P into Φ A Φᵀ; an
update (Joseph form, or with a cross-covariance) turns it into (I − K H) A (I − K H)ᵀ to first order. Both transform A
as they transform P, so that A stays at rounding level relative to P.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from sinssim.data import Array


class Innovation(NamedTuple):
    """Innovation ν, its covariance S, and νᵀS⁻¹ν."""

    value: Array
    covariance: Array
    nis: float


class ErrorFilter:
    """Estimate x and covariance P of a state that starts at zero.

    Args:
        covariance: P at the start, (n, n).
    """

    def __init__(self, covariance: Array) -> None:
        self._filter = KalmanFilter(dim_x=len(covariance), dim_z=1)
        self._filter.x = np.zeros(len(covariance))
        self._filter.P = covariance.copy()

    @property
    def x(self) -> Array:
        """Estimate, (n,)."""
        return self._filter.x  # type: ignore[no-any-return]

    @x.setter
    def x(self, value: Array) -> None:
        self._filter.x = value

    @property
    def covariance(self) -> Array:
        """P, (n, n)."""
        return self._filter.P  # type: ignore[no-any-return]

    @property
    def gain(self) -> Array:
        """Gain K of the last update, (n, k)."""
        return self._filter.K  # type: ignore[no-any-return]

    def turn(self, matrix: Array) -> None:
        """Refer estimate and covariance to other axes.

        Args:
            matrix: from the present axes into the others, (n, n).
        """
        self._filter.x = matrix @ self._filter.x
        self._filter.P = matrix @ self._filter.P @ matrix.T

    def predict(self, phi: Array, q: Array) -> None:
        """Predict over one interval.

        Args:
            phi: Φ, (n, n).
            q: Q, (n, n).
        """
        self._filter.F, self._filter.Q = phi, q  # as arguments they would take filterpy longer
        self._filter.predict()

    def innovation(self, residual: Array, h: Array, r: Array, cross: Array | None = None) -> Innovation:
        """Return the innovation of a reading.

        Args:
            residual: (k,).
            h: H, (k, n).
            r: R, (k, k).
            cross: covariance of the state's error with the reading's noise, (n, k); None if they are independent.

        Returns:
            The innovation; its square is NaN where S is singular.
        """
        value = residual - h @ self.x
        covariance = h @ self.covariance @ h.T + r
        if cross is not None:
            both = h @ cross
            covariance = covariance + both + both.T
        try:
            squares = float(value @ np.linalg.solve(covariance, value))
        except np.linalg.LinAlgError:  # readings more accurate than doubles resolve beside P
            squares = np.nan
        return Innovation(value, covariance, squares)

    def update(self, residual: Array, h: Array, r: Array, cross: Array | None = None) -> None:
        """Update the estimate with a reading.

        Args:
            residual: (k,).
            h: H, (k, n).
            r: R, (k, k).
            cross: covariance of the state's error with the reading's noise, (n, k); None if they are independent.
        """
        self._filter.R = r
        if cross is None:
            self._filter.update(residual, H=h)
        else:
            self._filter.M = cross
            self._filter.update_correlated(residual, H=h)
