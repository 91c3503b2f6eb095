"""Circles that hold a share of a zero-mean normal distribution in the plane.

With the eigenvalues λ₁ ≥ λ₂ of the covariance, and a normal pair in polar coordinates, x = √λ₁ ρ cos φ and
y = √λ₂ ρ sin φ with exp(−ρ²/2) uniform on 0…1,

    P(|x, y| ≤ R) = 2/π ∫₀^{π/2} 1 − exp(−R² / (2 s(φ))) dφ,   s(φ) = λ₁ cos² φ + λ₂ sin² φ                         (1)

This is the distribution of Hoyt (R. S. Hoyt, Probability functions for the modulus and angle of the normal complex
variate, Bell System Technical Journal 26, 1947). The integrand is smooth and periodic, so that the trapezoidal rule
converges faster than any power of the number of points. R is the root of (1), not the approximation 0.59 (σ₁ + σ₂).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sinssim.arguments import number, numbers
from sinssim.data import Array
from sinssim.errors import InputError

_POINTS = 256
"""Intervals of the trapezoidal rule over a quarter of a turn: 1e-14 for λ₂ > 0.001 λ₁, 1e-12 down to λ₂ = 0."""

_PHI = np.linspace(0.0, 0.5 * np.pi, _POINTS + 1)
_COS2, _SIN2 = np.cos(_PHI) ** 2, np.sin(_PHI) ** 2
_WEIGHT = np.full(_POINTS + 1, 1.0 / _POINTS)
_WEIGHT[[0, -1]] *= 0.5

_ITERATIONS = 100
_LAST_STEP = 1e-9
"""Step of Newton's method relative to the radius after which the radius is at rounding."""


def share_in_circle(covariance: Any, radius: Any) -> Array:
    """Return the probability that a zero-mean normal error lies within a circle about zero.

    Args:
        covariance: of north and east, (…, 2, 2) m².
        radius: (…) m, not negative.

    Returns:
        Probability, (…); NaN where the covariance is not finite.

    Raises:
        InputError: the covariance is not symmetric and positive semi-definite, or a radius is negative.
    """
    large, small = _eigenvalues(covariance)
    r = numbers("radius", radius)
    if np.any(r < 0.0):
        raise InputError(f"radius = {float(np.nanmin(r)):g} must not be negative.")
    return _share(np.asarray(r, dtype=np.float64), large, small)[0]


def circle_radius(covariance: Any, share: float) -> Array:
    """Return the radius of the circle about zero that contains a share of a zero-mean normal distribution.

    Args:
        covariance: of north and east, (…, 2, 2) m².
        share: probability within the circle, between 0 and 1: 0.5 for CEP, 0.95 for R95.

    Returns:
        (…) m, the root of (1). For equal eigenvalues σ² it is σ √(−2 ln(1 − share)): 1.1774 σ and 2.4477 σ. NaN where
        the covariance is not finite.

    Raises:
        InputError: the covariance is not symmetric and positive semi-definite, or the share is not between 0 and 1.
    """
    from scipy.special import ndtri

    share = number("share", share)
    if not 0.0 < share < 1.0:
        raise InputError(f"share = {share:g} must be between 0 and 1, for example 0.5 or 0.95.")
    large, small = _eigenvalues(covariance)
    # more variance on the second axis needs a larger circle: between one axis alone and equal axes
    low = np.sqrt(large) * float(ndtri(0.5 * (1.0 + share)))
    high = np.sqrt(large) * math.sqrt(-2.0 * math.log1p(-share))
    radius = np.asarray(0.5 * (low + high))
    shape, large, small = radius.shape, large.ravel(), small.ravel()
    radius, low, high = radius.ravel(), low.ravel(), high.ravel()
    left = np.flatnonzero(large > 0.0)
    for _ in range(_ITERATIONS):
        r, below, above = radius[left], low[left], high[left]
        held, slope = _share(r, large[left], small[left])
        below, above = np.where(held < share, r, below), np.where(held < share, above, r)
        with np.errstate(invalid="ignore", divide="ignore"):
            newton = r - (held - share) / slope
        last = np.abs(newton - r) <= _LAST_STEP * above  # the next step would be of the size of this one's square
        inside = (newton >= below) & (newton <= above)
        radius[left] = np.where(inside | last, np.clip(newton, below, above), 0.5 * (below + above))
        low[left], high[left] = below, above
        left = left[~last]
        if not len(left):
            break
    radius, large = radius.reshape(shape), large.reshape(shape)
    return np.where(large > 0.0, radius, np.where(np.isnan(large), np.nan, 0.0))


def _share(radius: Array, large: Array, small: Array) -> tuple[Array, Array]:
    """Return the probability (1) and its derivative with respect to the radius."""
    s = large[..., None] * _COS2 + small[..., None] * _SIN2
    r = radius[..., None]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        exponent = np.where(s > 0.0, r * r / (2.0 * s), np.where(r > 0.0, np.inf, 0.0))
        inside = np.where(np.isnan(s), np.nan, -np.expm1(-exponent))
        slope = np.where(s > 0.0, (1.0 - inside) * r / s, 0.0)
    return np.asarray(inside @ _WEIGHT), np.asarray(slope @ _WEIGHT)


def _eigenvalues(covariance: Any) -> tuple[Array, Array]:
    """Return λ₁ ≥ λ₂ ≥ 0 of checked covariances, (…) each."""
    p = numbers("covariance", covariance)
    if p.shape[-2:] != (2, 2):
        raise InputError(f"covariance has the shape {p.shape}; give (…, 2, 2).")
    a, b, c = p[..., 0, 0], 0.5 * (p[..., 0, 1] + p[..., 1, 0]), p[..., 1, 1]
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    large, small = mean + half, mean - half
    size = np.abs(a) + np.abs(c) + np.abs(b)
    if np.any(np.abs(p[..., 0, 1] - p[..., 1, 0]) > 1e-9 * size) or np.any(small < -1e-9 * size):
        raise InputError("covariance must be symmetric and positive semi-definite.")
    return np.asarray(large), np.asarray(np.maximum(small, 0.0))
