"""The rate of a run's position error, in the two definitions of the field.

Both are in use and differ by up to a factor, because the error of an inertial system oscillates with the Schuler
period. Give the definition beside the number.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.arguments import doubles
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.units import NAUTICAL_MILE

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
    """Return the standard error of the slope of `mean_rate`, √(Σ (r − ṙ t)² / Σ t²).

    The residuals of navigation errors are correlated over the whole run. They count as one, not as K independent ones.

    Args:
        time, errors: as for `mean_rate`.

    Returns:
        m/s, (N,), or () for one run; NaN for a run without an epoch after zero.
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
