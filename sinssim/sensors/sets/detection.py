"""Probabilities of the parity test: false alarm, missed detection, and the smallest fault that is found.

The statistic D = pᵀ C⁻¹ p of a parity vector p of n components with the covariance C has a χ² distribution with n
degrees of freedom as long as the errors are normal. A fault that adds f v_i to p makes it non-central,

    (1) λ = f² v_iᵀ C⁻¹ v_i

With errors of one variance, C = σ² I, these are pᵀp/σ² and λ = f² |v_i|²/σ². The threshold T has the probability of
false alarm P{χ²_n > T}, and a fault is missed with the probability P{χ²_n(λ) < T}.
"""

from __future__ import annotations

from sinssim.data import Array
from sinssim.errors import InputError


def threshold(false_alarm: float, freedom: int) -> float:
    """Return the threshold of the statistic.

    Args:
        false_alarm: probability of exceeding it without a fault, between 0 and 1.
        freedom: degrees of freedom, m − 3.

    Raises:
        InputError: the probability is not between 0 and 1, or there is no degree of freedom.
    """
    from scipy.special import chdtri

    if not 0.0 < false_alarm < 1.0:
        raise InputError(f"false_alarm = {false_alarm:g} must be a probability between 0 and 1.")
    if freedom < 1:
        raise InputError(f"freedom = {freedom} must be at least 1: three sensors have no redundancy.")
    return float(chdtri(freedom, false_alarm))


def missed_detection(noncentrality: float, false_alarm: float, freedom: int) -> float:
    """Return the probability that a test misses a fault.

    Args:
        noncentrality: λ of the fault (1).
        false_alarm: probability of false alarm.
        freedom: degrees of freedom, m − 3.

    Returns:
        P{χ²(λ) < T}.

    Raises:
        InputError: as of `threshold`.
    """
    from scipy.special import chndtr

    return float(chndtr(threshold(false_alarm, freedom), freedom, noncentrality))


def smallest_noncentrality(missed: float, false_alarm: float, freedom: int) -> float:
    """Return the non-centrality of the smallest fault that a test finds with a probability.

    Args:
        missed: probability of missed detection, between 0 and 1 − false_alarm.
        freedom: degrees of freedom, m − 3.

    Raises:
        InputError: the probabilities exclude each other, or as of `threshold`.
    """
    from scipy.optimize import brentq

    if not 0.0 < missed < 1.0 - false_alarm:
        raise InputError(f"missed = {missed:g} must be between 0 and 1 − false_alarm = {1.0 - false_alarm:g}.")
    most = 2.0 * threshold(false_alarm, freedom) + 200.0
    return float(brentq(lambda x: missed_detection(x, false_alarm, freedom) - missed, 0.0, most, xtol=1e-10))


def smallest_fault(columns: Array, covariance: Array, false_alarm: float, missed: float) -> Array:
    """Return the smallest fault of each sensor that a test finds with a probability.

    Args:
        columns: V, (m − 3, m).
        covariance: C of the parity vector, (m − 3, m − 3).
        false_alarm: probability of false alarm.
        missed: probability of missed detection.

    Returns:
        f of (1), (m,), in the unit of the readings; infinite for a sensor whose fault is not seen.

    Raises:
        InputError: as of `smallest_noncentrality`.
    """
    import numpy as np

    seen = np.einsum("ai,ab,bi->i", columns, np.linalg.inv(covariance), columns)
    least = smallest_noncentrality(missed, false_alarm, len(columns))
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(least / np.where(seen < 1e-12 * seen.max(), 0.0, seen)))
