"""Wraps filterpy's `KalmanFilter`: prediction, innovation and update, with gating and cross-covariance.

It has no gate. State and residual stay one-dimensional: with a column for a state and a one-dimensional residual it
makes the state a matrix, silently.

P is nowhere made symmetric again, for rounding does not add up. A prediction turns an asymmetry A of P into Φ A Φᵀ; an
update (Joseph, or with a cross-covariance) makes it (I − K H) A (I − K H)ᵀ to first order. Both treat A as
they treat P itself, so that relative to P it stays at rounding.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from sinssim.data import Array


class Innovation(NamedTuple):
    """Residual that the estimate does not explain, its covariance S, and νᵀS⁻¹ν."""

    value: Array
    covariance: Array
    nis: float


class ErrorFilter:
    """Estimate x and covariance P of a state that begins at zero.

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

    def predict(self, phi: Array, q: Array) -> None:
        """Predict over one interval.

        Args:
            phi: Φ, (n, n).
            q: Q, (n, n).
        """
        self._filter.predict(F=phi, Q=q)

    def innovation(self, residual: Array, h: Array, r: Array, cross: Array | None = None) -> Innovation:
        """Return what a reading would tell.

        Args:
            residual: (k,).
            h: H, (k, n).
            r: R, (k, k).
            cross: covariance of the state's error with the reading's noise, (n, k); None for none.

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
        except np.linalg.LinAlgError:  # readings that are too good for what doubles resolve beside P
            squares = np.nan
        return Innovation(value, covariance, squares)

    def update(self, residual: Array, h: Array, r: Array, cross: Array | None = None) -> None:
        """Take a reading into the estimate.

        Args:
            residual: (k,).
            h: H, (k, n).
            r: R, (k, k).
            cross: covariance of the state's error with the reading's noise, (n, k); None for none.
        """
        if cross is None:
            self._filter.update(residual, R=r, H=h)
        else:
            self._filter.M = cross
            self._filter.update_correlated(residual, R=r, H=h)
