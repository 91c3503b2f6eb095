"""Circles that hold a share of normal distributions about a mean that is not zero."""

from __future__ import annotations

import numpy as np
import scipy

from sinssim.data import Array
from sinssim.statistics.circles import circle_radius, share_in_circle

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
    """Return the probability that a circle about zero holds of a normal distribution in the plane.

    Args:
        radius: (N,), positive.
        covariance: (N, 2, 2).
        mean: (N, 2).

    Returns:
        Probabilities, (N,).
    """
    off = np.hypot(mean[:, 0], mean[:, 1])
    largest = np.sqrt(np.maximum(np.trace(covariance, axis1=-2, axis2=-1), 0.0))
    found = (off <= radius).astype(np.float64)  # without spread
    central = (off == 0.0) & (largest > 0.0)
    found[central] = share_in_circle(covariance[central], radius[central])
    rows = np.flatnonzero((off > 0.0) & (largest > _NO_SPREAD * off))
    if len(rows):
        along, sigma = _along_axes(covariance[rows], mean[rows])
        found[rows] = _inside(radius[rows], along, sigma)
    return found


def _along_axes(covariance: Array, mean: Array) -> tuple[Array, Array]:
    """Return mean and standard deviations along the axes of distributions, the larger axis first, (N, 2) each."""
    values, vectors = np.linalg.eigh(covariance)
    sigma = np.sqrt(np.maximum(values, 1e-18 * values[:, 1:]))[:, ::-1]
    return np.einsum("kij,ki->kj", vectors, mean)[:, ::-1], sigma


def radius_about_mean(covariance: Array, mean: Array, share: float) -> Array:
    """Return the radius of the circle about zero that contains a share of a normal distribution in the plane.

    Args:
        covariance: (N, 2, 2).
        mean: (N, 2).

    Returns:
        Radii, (N,). With the mean zero they come from `circle_radius`; else from the integral over one axis of the
        distribution, to 1e-12 of the share.
    """
    found = circle_radius(covariance, share)
    off = np.hypot(mean[:, 0], mean[:, 1])
    largest = np.sqrt(np.maximum(np.trace(covariance, axis1=-2, axis2=-1), 0.0))
    fixed = (off > 0.0) & (largest <= _NO_SPREAD * off)
    found = np.where(fixed, off, found)
    rows = np.flatnonzero((off > 0.0) & ~fixed)
    if not len(rows):
        return found
    along, sigma = _along_axes(covariance[rows], mean[rows])
    found[rows] = _root(along, sigma, share, off[rows] + found[rows])
    return found


def _root(along: Array, sigma: Array, share: float, most: Array) -> Array:
    """Return the radii by the Illinois method, regula falsi that halves the value of an end that stays twice."""
    low, high = np.zeros_like(most), most.copy()
    below, above = np.full_like(most, -share), _inside(most, along, sigma) - share
    kept = np.zeros(len(most))
    for _ in range(_STEPS):
        middle = (low * above - high * below) / (above - below)
        value = _inside(np.maximum(middle, 1e-300), along, sigma) - share
        under = value < 0.0
        above = np.where(under & (kept == -1.0), 0.5 * above, above)
        below = np.where(~under & (kept == 1.0), 0.5 * below, below)
        low, below = np.where(under, middle, low), np.where(under, value, below)
        high, above = np.where(under, high, middle), np.where(under, above, value)
        kept = np.where(under, -1.0, 1.0)
        if (np.abs(value) < _CONVERGED).all():
            break
    return np.asarray(np.where(np.abs(below) < np.abs(above), low, high))
