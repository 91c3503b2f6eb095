"""Two or three whole navigation systems compared with each other: detection and identification of a faulty one.

The systems navigate the same motion with independent errors of the covariance C(t). The difference d of the outputs of
two of them has the covariance 2C, so that without a fault

    (1) s = dᵀ (2C)⁻¹ d

has a χ² distribution with as many degrees of freedom as the output has components, at every instant. Above the
threshold with a given probability of false alarm, one of the two is faulty. An additional error e of one system makes
the distribution non-central with

    (2) λ = eᵀ (2C)⁻¹ e.

Two systems detect a fault. Three identify the faulty one by majority: both differences with it are above the threshold,
and that of the other two is not. The mid-value of three outputs, component by component, is never that of the faulty
system alone once its error exceeds those of the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import doubles, number
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.system.short_repr import short_repr


@short_repr
@dataclass(frozen=True)
class ComparedSystems:
    """The comparison of teams of systems.

    Attributes:
        pairs: numbers of the two systems of each pair.
        statistic: s of (1), (T, P, E) for T teams, P pairs and E instants; 0 where C is singular.
        threshold: with the given probability of false alarm of one test.
    """

    pairs: tuple[tuple[int, int], ...]
    statistic: Array
    threshold: float

    @property
    def alarms(self) -> NDArray[np.bool_]:
        """Whether each pair is above the threshold, (T, P, E)."""
        return np.asarray(self.statistic > self.threshold)

    @property
    def detected(self) -> NDArray[np.bool_]:
        """Whether any pair is, (T, E)."""
        return np.asarray(self.alarms.any(axis=1))

    @property
    def identified(self) -> NDArray[np.int64]:
        """Number of the system that majority finds faulty, −1 for none, (T, E)."""
        systems = 1 + max(max(pair) for pair in self.pairs)
        faulty = np.full(self.detected.shape, -1)
        if systems < 3:
            return faulty
        alarms = self.alarms
        for system in range(systems):
            involved = np.array([system in pair for pair in self.pairs])
            faulty[alarms[:, involved].all(axis=1) & ~alarms[:, ~involved].any(axis=1)] = system
        return faulty


def compare_systems(outputs: Any, covariance: Any, false_alarm: float) -> ComparedSystems:
    """Compare the systems of teams with each other.

    The outputs of n ≥ 2 systems in T teams at E instants have k components, (T, n, E, k); their errors would do. The
    covariance is that of one system without a fault, (E, k, k); `false_alarm` is the probability of one test.
    """
    values = doubles("outputs", outputs)
    if values.ndim != 4 or values.shape[1] < 2:
        raise InputError(
            f"outputs has the shape {values.shape}; it must be teams × systems × instants × components with two "
            "systems or more."
        )
    inverse = _inverse(covariance, values.shape[2:])
    pairs = tuple(combinations(range(values.shape[1]), 2))
    differences = np.stack([values[:, i] - values[:, j] for i, j in pairs], axis=1)
    statistic = np.einsum("tpei,eij,tpej->tpe", differences, inverse, differences)
    return ComparedSystems(pairs, statistic, _threshold(false_alarm, values.shape[3]))


def detection_probability(effect: Any, covariance: Any, false_alarm: float) -> Array:
    """Return P{χ²(λ) > threshold} with λ of (2), (E,): that a test of two systems finds a fault of one of them.

    The effect is the error of its output by the fault alone, (E, k); the covariance as for `compare_systems`.
    """
    from scipy.special import chndtr

    values = doubles("effect", effect)
    if values.ndim != 2:
        raise InputError(f"effect has the shape {values.shape}; it must be instants × components.")
    noncentrality = np.einsum("ei,eij,ej->e", values, _inverse(covariance, values.shape), values)
    limit = _threshold(false_alarm, values.shape[1])
    return np.asarray(1.0 - chndtr(limit, values.shape[1], noncentrality))


def mid_value(outputs: Any) -> Array:
    """Return the median of three or more systems by component, (T, E, k), from outputs as for `compare_systems`."""
    return np.asarray(np.median(doubles("outputs", outputs), axis=1))


def _threshold(false_alarm: float, freedom: int) -> float:
    from scipy.special import chdtri

    probability = number("false_alarm", false_alarm)
    if not 0.0 < probability < 1.0:
        raise InputError(f"false_alarm = {probability:g} must be a probability between 0 and 1.")
    return float(chdtri(freedom, probability))


def _inverse(covariance: Any, shape: tuple[int, ...]) -> Array:
    """Return (2C)⁻¹, zero where C is singular, (E, k, k)."""
    matrix = doubles("covariance", covariance)
    if matrix.shape != (*shape, shape[-1]):
        raise InputError(f"covariance has the shape {matrix.shape}; the outputs need {(*shape, shape[-1])}.")
    inverse = np.zeros_like(matrix)
    regular = np.linalg.cond(matrix) < _SINGULAR
    inverse[regular] = np.linalg.inv(2.0 * matrix[regular])
    return inverse


_SINGULAR = 1e12
"""Condition number of a covariance above which there is no test: at the start, where the systems have no errors yet."""
