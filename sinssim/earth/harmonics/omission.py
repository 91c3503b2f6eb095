"""Size of the part of the gravity field beyond a degree, by the anomaly degree variances of Tscherning and Rapp.

    c_n = A (n − 1)/((n − 2)(n + B)) s^(n+2),   A = 425.28 mGal², B = 24, s = 0.999617

(Tscherning and Rapp, Closed covariance expressions for gravity anomalies, geoid undulations, and deflections of the
vertical implied by anomaly degree variance models, Report 208, Department of Geodetic Science, Ohio State University,
1974). The covariance of anomalies at a distance ψ is Σ c_n P_n(cos ψ); for the degrees here P_n(cos ψ) = J₀((n + ½)ψ).
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.models import MEAN_GRAVITY, MEAN_RADIUS
from sinssim.units import MGAL

_A, _B, _S = 425.28, 24.0, 0.999617
_MOST = 40_000
"""Highest degree of the sums: s^n is 2e-7 there."""


class Omission(NamedTuple):
    """Size of the field beyond a degree.

    Attributes:
        deflection: 1σ of each component of the deflection, rad.
        anomaly: 1σ of the anomaly, m/s².
        distance: distance at which the correlation of anomalies is 1/e, m.
    """

    deflection: float
    anomaly: float
    distance: float


def degree_variances(degree: int, height: float = 0.0) -> tuple[Array, Array]:
    """Return the variances of the gravity anomaly of the degrees beyond one.

    Args:
        degree: the last one left out, 2 or more.
        height: above the ellipsoid, m; the variances fall with (R/(R + h))^(2n+4).
    """
    n = np.arange(max(degree, 2) + 1.0, _MOST + 1.0)
    fall = np.exp((n + 2.0) * (np.log(_S) - 2.0 * np.log1p(max(height, 0.0) / MEAN_RADIUS)))
    return n, _A * (n - 1.0) / ((n - 2.0) * (n + _B)) * fall * MGAL**2


@cache
def omission(degree: int, height: float = 0.0) -> Omission:
    """Return the size of the field beyond a degree.

    Args:
        degree: the highest degree that is known; 2 for normal gravity.
        height: at which it is felt, above the ellipsoid, m.

    Returns:
        Standard deviations and correlation distance. The variance of deflections of degree n is
        n(n + 1)/(n − 1)² c_n/γ², one half of it for each component.
    """
    from scipy.optimize import brentq
    from scipy.special import j0

    n, c = degree_variances(degree, height)
    total = float(c.sum())
    deflection = float(np.sqrt(0.5 * np.sum(n * (n + 1.0) / (n - 1.0) ** 2 * c))) / MEAN_GRAVITY

    def beyond(angle: float) -> float:
        return float(np.sum(c * j0((n + 0.5) * angle))) / total - math.exp(-1.0)

    high = 1e-5
    while beyond(high) > 0.0:
        high *= 1.5
    angle = brentq(beyond, 0.0, high, xtol=1e-9)
    return Omission(deflection, float(np.sqrt(total)), MEAN_RADIUS * angle)
