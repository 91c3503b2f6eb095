"""Circles that contain a share of the position errors, of a normal distribution, and their rate.

With the eigenvalues λ₁ ≥ λ₂ of the covariance, and a zero-mean normal pair in polar coordinates, x = √λ₁ ρ cos φ and
y = √λ₂ ρ sin φ with exp(−ρ²/2) uniform on 0…1,

    P(|x, y| ≤ R) = 2/π ∫₀^{π/2} 1 − exp(−R² / (2 s(φ))) dφ,   s(φ) = λ₁ cos² φ + λ₂ sin² φ                         (1)

This is the distribution of Hoyt (R. S. Hoyt, Probability functions for the modulus and angle of the normal complex
variate, Bell System Technical Journal 26, 1947). The integrand is smooth and periodic, so that the trapezoidal rule
converges faster than any power of the number of points. R is the root of (1), not the approximation 0.59 (σ₁ + σ₂).

The rate of a run's position error has two definitions, `LINE` and `END`. Both are in use and differ by up to a factor,
because the error of an inertial system oscillates with the Schuler period. Give the definition beside the number.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy

from sinssim.arguments import doubles, number, numbers
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.units import NAUTICAL_MILE

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
        enclosed, outside, slope = _share(r, large[left], small[left])
        # the smaller of both probabilities has the more digits
        excess = enclosed - share if share < 0.5 else (1.0 - share) - outside
        below, above = np.where(excess < 0.0, r, below), np.where(excess < 0.0, above, r)
        with np.errstate(invalid="ignore", divide="ignore"):
            newton = r - excess / slope
        last = np.abs(newton - r) <= _LAST_STEP * above  # the next step would be of the size of this one's square
        inside = (newton >= below) & (newton <= above)
        radius[left] = np.where(inside | last, np.clip(newton, below, above), 0.5 * (below + above))
        low[left], high[left] = below, above
        left = left[~last]
        if not len(left):
            break
    radius, large = radius.reshape(shape), large.reshape(shape)
    return np.where(large > 0.0, radius, np.where(np.isnan(large), np.nan, 0.0))


def _share(radius: Array, large: Array, small: Array) -> tuple[Array, Array, Array]:
    """Return the probability (1), that outside, and the derivative of (1) with respect to the radius."""
    s = large[..., None] * _COS2 + small[..., None] * _SIN2
    r = radius[..., None]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        exponent = np.where(s > 0.0, r * r / (2.0 * s), np.where(r > 0.0, np.inf, 0.0))
        inside = np.where(np.isnan(s), np.nan, -np.expm1(-exponent))
        outside = np.where(np.isnan(s), np.nan, np.exp(-exponent))
        slope = np.where(s > 0.0, outside * r / s, 0.0)
    return np.asarray(inside @ _WEIGHT), np.asarray(outside @ _WEIGHT), np.asarray(slope @ _WEIGHT)


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


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
_REACH = 9.0
"""Standard deviations beyond which a normal density is below the rounding of a double."""
_STEPS, _CONVERGED = 100, 1e-13
_NO_SPREAD = 1e-9
"""Spread relative to the mean below which a distribution is its mean."""


def _inside(radius: Array, mean: Array, sigma: Array) -> Array:
    """Return the probability of a circle about zero, axes along those of the distribution, (N,)."""
    # x = R sin t removes the root at the circle's ends
    low = np.arcsin(np.clip((mean[:, 0] - _REACH * sigma[:, 0]) / radius, -1.0, 1.0))
    high = np.arcsin(np.clip((mean[:, 0] + _REACH * sigma[:, 0]) / radius, -1.0, 1.0))
    t = 0.5 * (high + low)[:, None] + 0.5 * (high - low)[:, None] * _NODES
    x, half = radius[:, None] * np.sin(t), radius[:, None] * np.cos(t)
    density = np.exp(-0.5 * ((x - mean[:, :1]) / sigma[:, :1]) ** 2) / (np.sqrt(2.0 * np.pi) * sigma[:, :1])
    across = scipy.special.ndtr((half - mean[:, 1:]) / sigma[:, 1:]) - scipy.special.ndtr(
        (-half - mean[:, 1:]) / sigma[:, 1:]
    )
    return np.asarray(0.5 * (high - low) * ((density * across * half) @ _WEIGHTS))


def share_inside(radius: Array, covariance: Array, mean: Array) -> Array:
    """Return the probability, (N,), that a circle about zero holds of a normal distribution with a mean, (N, 2)."""
    off = np.hypot(mean[:, 0], mean[:, 1])
    largest = np.sqrt(np.maximum(np.trace(covariance, axis1=-2, axis2=-1), 0.0))
    shares = (off <= radius).astype(np.float64)  # without spread
    central = (off == 0.0) & (largest > 0.0)
    shares[central] = share_in_circle(covariance[central], radius[central])
    rows = np.flatnonzero((off > 0.0) & (largest > _NO_SPREAD * off))
    if len(rows):
        along, sigma = _along_axes(covariance[rows], mean[rows])
        shares[rows] = _inside(radius[rows], along, sigma)
    return shares


def _along_axes(covariance: Array, mean: Array) -> tuple[Array, Array]:
    """Return mean and standard deviations along the axes of distributions, the larger axis first, (N, 2) each."""
    values, vectors = np.linalg.eigh(covariance)
    sigma = np.sqrt(np.maximum(values, 1e-18 * values[:, 1:]))[:, ::-1]
    return np.einsum("kij,ki->kj", vectors, mean)[:, ::-1], sigma


def radius_about_mean(covariance: Array, mean: Array, share: float) -> Array:
    """Return the radius, (N,), of the circle about zero with a share of a normal distribution with a mean, (N, 2).

    With the mean zero it comes from `circle_radius`; else from the integral over one axis of the distribution, to 1e-12
    of the share.
    """
    radii = circle_radius(covariance, share)
    off = np.hypot(mean[:, 0], mean[:, 1])
    largest = np.sqrt(np.maximum(np.trace(covariance, axis1=-2, axis2=-1), 0.0))
    fixed = (off > 0.0) & (largest <= _NO_SPREAD * off)
    radii = np.where(fixed, off, radii)
    rows = np.flatnonzero((off > 0.0) & ~fixed)
    if not len(rows):
        return radii
    along, sigma = _along_axes(covariance[rows], mean[rows])
    radii[rows] = _root(along, sigma, share, off[rows] + radii[rows])
    return radii


def _root(along: Array, sigma: Array, share: float, most: Array) -> Array:
    """Return the radii by the Illinois method, regula falsi that halves the value of an end that stays twice."""
    low, high = np.zeros_like(most), most.copy()
    below, above = np.full_like(most, -share), _inside(most, along, sigma) - share
    side = np.zeros(len(most))
    for _ in range(_STEPS):
        middle = (low * above - high * below) / (above - below)
        value = _inside(np.maximum(middle, 1e-300), along, sigma) - share
        under = value < 0.0
        above = np.where(under & (side == -1.0), 0.5 * above, above)
        below = np.where(~under & (side == 1.0), 0.5 * below, below)
        low, below = np.where(under, middle, low), np.where(under, value, below)
        high, above = np.where(under, high, middle), np.where(under, above, value)
        side = np.where(under, -1.0, 1.0)
        if (np.abs(value) < _CONVERGED).all():
            break
    return np.asarray(np.where(np.abs(below) < np.abs(above), low, high))


LINE, END = "least-squares line through the origin, Σ t r / Σ t²", "error at the end over the time, r(T) / T"
"""The two definitions, in words."""


def mean_rate(time: Any, errors: Any) -> Array:
    """Return the slope of the least-squares line through the origin, Σ t r / Σ t².

    Args:
        time: epochs since the start of navigation, (K,) s; an epoch at zero does not count.
        errors: horizontal errors r of N runs, (N, K), or of one, (K,), m. An infinite error, that of a failed run,
            gives an infinite rate; NaN does not count.

    Returns:
        m/s, (N,), or () for one run; NaN for a run without an epoch after zero. See `to_nmi_h`.

    Raises:
        InputError: the arrays have inconsistent shapes.
    """
    t, r = _pair(time, errors)
    weight = np.where(np.isnan(r), 0.0, t)
    with np.errstate(invalid="ignore", divide="ignore"):
        moment = np.where(weight > 0.0, weight * r, 0.0)
        return np.asarray(moment.sum(axis=-1) / (weight * weight).sum(axis=-1))


def rate_uncertainty(time: Any, errors: Any) -> Array:
    """Return the standard error of the slope of `mean_rate`, √(Σ (r − ṙ t)² / Σ t²), m/s.

    The residuals of navigation errors are correlated over the whole run. They count as one, not as K independent ones.
    """
    t, r = _pair(time, errors)
    left = r - mean_rate(t, r)[..., None] * t
    weight = np.where(np.isnan(r), 0.0, t)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(np.nansum(left * left, axis=-1) / (weight * weight).sum(axis=-1)))


def end_rate(time: Any, errors: Any) -> Array:
    """Return the error at the end over the time, r(T)/T.

    Args:
        time: epochs since the start of navigation, (K,) s.
        errors: as for `mean_rate`; the last epoch that is not NaN is the end of a run.

    Returns:
        m/s, (N,), or () for one run; NaN for a run without an epoch after zero.

    Raises:
        InputError: the arrays have inconsistent shapes.
    """
    t, r = _pair(time, errors)
    there = ~np.isnan(r)
    last = r.shape[-1] - 1 - np.argmax(there[..., ::-1], axis=-1)
    final, end = np.take_along_axis(r, last[..., None], -1)[..., 0], t[last]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(end > 0.0, final / end, np.nan))


def to_nmi_h(rate: Any) -> Array:
    """Convert a rate from m/s to nautical miles (1852 m) per hour.

    Args:
        rate: m/s, any shape.

    Returns:
        nmi/h.
    """
    return np.asarray(np.asarray(rate, dtype=np.float64) * (3600.0 / NAUTICAL_MILE))


def _pair(time: Any, errors: Any) -> tuple[Array, Array]:
    t, r = doubles("time", time), doubles("errors", errors)
    if t.ndim != 1 or r.ndim > 2 or r.shape[-1] != len(t):
        raise InputError(
            f"time has the shape {t.shape} and errors {r.shape}; give K epochs, (K,), and errors of N runs at them, "
            "(N, K) or (K,)."
        )
    if not np.all(np.isfinite(t)) or np.any(t < 0.0):
        raise InputError("time must be finite and not negative: seconds since the start of navigation.")
    return t, r
