"""Tests requirements by a budget, and finds the largest size of each source that meets them.

The covariance is quadratic in the size of each source, P(f) = P + (f² − 1) P_j, and an error that is the same in every
run is linear in it. The largest factor f is therefore the root of one equation in one unknown, found to rounding;
nothing is linearised about the present size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.error_budget.budget_result import BudgetResult
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.statistics.circular_error import radius_about_mean, share_inside
from sinssim.statistics.requirement_verdict import Exceeded, first_exceeded
from sinssim.statistics.requirements import COMPONENTS, SHARES, Requirement, parse_requirements

_LARGEST = 2.0**20
"""Factor beyond which a source counts as without effect on a requirement."""


@dataclass(frozen=True)
class Allowance:
    """How large some sources may be while a requirement is met, all others as they are."""

    sources: tuple[Source, ...]  # one source, or several that share a factor
    factor: float
    """Largest factor of their present size; infinite if they have no effect on it; NaN if the requirement is not met
    even without them.
    """
    without: float  # quantity of the requirement without them, SI

    @property
    def possible(self) -> bool:
        """Whether the requirement can be met by these sources at all."""
        return not math.isnan(self.factor)

    @property
    def values(self) -> tuple[float, ...]:
        """Largest value of each source in its unit."""
        return tuple(self.factor * source.value for source in self.sources)


@dataclass(frozen=True)
class Answer:
    """The answer of a budget to a requirement."""

    requirement: Requirement
    value: float  # its quantity, SI; throughout a run, the largest
    time: float  # instant of that value, s since the start
    allowances: tuple[Allowance, ...]  # of every source alone, in the order of their contributions to the quantity
    joint: Allowance | None  # of the sources that are free together; None if none were named
    everything: Allowance  # of all sources that a number describes, together
    exceeded: Exceeded | None = None  # since when the limit is exceeded, throughout a run; None if it is not

    @property
    def met(self) -> bool:
        """Whether the requirement is met."""
        return self.value <= self.requirement.limit

    @property
    def margin(self) -> float:
        """Limit minus value, SI; negative if the requirement is not met."""
        return self.requirement.limit - self.value


def times_of(requirements: Iterable[Requirement]) -> tuple[float, ...]:
    """Return the instants that a budget needs for some requirements, s since the start."""
    return tuple(requirement.time for requirement in requirements if requirement.when == "at")


def answers(
    result: BudgetResult, requirements: str | Requirement | Iterable[str | Requirement], free: Sequence[str] = ()
) -> tuple[Answer, ...]:
    """Judge requirements by a budget that has the instants of `times_of`, and solve them for the sources."""
    joint_sources = tuple(_sized(result, name) for name in free)
    results = []
    for requirement in parse_requirements(requirements):
        requirement.check_within(float(result.time[-1]))
        rows, (value, time, exceeded) = _rows(result, requirement), answer_of(result, requirement)
        order = [improvement.source for improvement in result.improvements(time)]
        sized = tuple(source for source in order if not math.isnan(source.value))
        alone = tuple(
            sorted(
                (_allowance(result, requirement, rows, (source,)) for source in sized),
                key=lambda allowance: allowance.without,
            )
        )
        joint = _allowance(result, requirement, rows, joint_sources) if joint_sources else None
        every = _allowance(result, requirement, rows, sized)
        results.append(Answer(requirement, value, time, alone, joint, every, exceeded))
    return tuple(results)


def answer_of(result: BudgetResult, requirement: Requirement) -> tuple[float, float, Exceeded | None]:
    """Return the quantity of a requirement, SI, its instant, s since the start, and since when the limit is exceeded.

    Throughout the run, it is the largest quantity.
    """
    rows = _rows(result, requirement)
    values = _quantity(requirement, result.time[rows], result.total[rows], result.bias[rows])
    worst, aiding = int(np.argmax(values)), result.scenario.aiding
    outages = () if aiding is None or result.solution == "inertial" else aiding.outages
    exceeded = first_exceeded(requirement, result.time[rows], values, outages)
    return float(values[worst]), float(result.time[rows[worst]]), exceeded


def _sized(result: BudgetResult, name: str) -> Source:
    try:
        source = result.source(name)
    except InputError as error:
        raise InputError(f"free: {error}") from error
    if math.isnan(source.value):
        raise InputError(f"free: {name} is not described by one number, so that no largest value can be given.")
    return source


def _rows(result: BudgetResult, requirement: Requirement) -> NDArray[np.intp]:
    if requirement.when == "run":
        return np.arange(len(result.time))
    if requirement.when == "end":
        return np.array([len(result.time) - 1])
    return np.array([result.row(requirement.time)])


def _quantity(requirement: Requirement, time: Array, covariance: Array, mean: Array) -> Array:
    """Return the quantity at instants, (R,) SI."""
    if requirement.quantity in COMPONENTS:
        k = COMPONENTS.index(requirement.quantity)
        return np.asarray(np.sqrt(np.maximum(covariance[:, k, k], 0.0) + mean[:, k] ** 2))
    radius = radius_about_mean(covariance[:, :2, :2], mean[:, :2], SHARES[requirement.quantity])
    return radius / time if requirement.quantity == "rate" else radius


def _allowance(
    result: BudgetResult, requirement: Requirement, rows: NDArray[np.intp], sources: tuple[Source, ...]
) -> Allowance:
    time, names = result.time[rows], {source.name for source in sources}
    # the others are summed, because a difference from the total can be negative by rounding
    part, rest = (_sum(result.covariance, rows, names, (9, 9), inside) for inside in (True, False))
    part_mean, rest_mean = (_sum(result.mean, rows, names, (9,), inside) for inside in (True, False))

    def excess(factor: float) -> float:
        """Return a number that is positive if the requirement is not met with this factor."""
        covariance, mean = rest + factor**2 * part, rest_mean + factor * part_mean
        if requirement.quantity in COMPONENTS:
            return float(_quantity(requirement, time, covariance, mean).max()) / requirement.limit - 1.0
        # the circle of the limit holds less than the share: no radius need be found
        limit = requirement.limit * (time if requirement.quantity == "rate" else np.ones_like(time))
        inside = share_inside(limit, covariance[:, :2, :2], mean[:, :2])
        return SHARES[requirement.quantity] - float(inside.min())

    without = float(_quantity(requirement, time, rest, rest_mean).max())
    return Allowance(sources, _largest(excess), without)


def _sum(
    parts: Mapping[str, Array], rows: NDArray[np.intp], names: set[str], shape: tuple[int, ...], inside: bool
) -> Array:
    """Return the sum of the sources that have one of the names, or of those that have none, (R, …)."""
    zero = np.zeros((len(rows), *shape))
    return np.asarray(sum((part[rows] for name, part in parts.items() if (name in names) is inside), zero))


def _largest(excess: Callable[[float], float]) -> float:
    """Return the largest factor with which a requirement is met: the root of `excess`, which is positive beyond it."""
    from scipy.optimize import brentq

    if excess(0.0) > 0.0:
        return math.nan
    high = 1.0
    while excess(high) <= 0.0:
        high *= 2.0
        if high > _LARGEST:
            return math.inf
    low = 0.5 * high if high > 1.0 else 0.0
    root = float(brentq(excess, low, high, xtol=1e-15, rtol=1e-14))
    return root if excess(root) <= 0.0 else root * (1.0 - 1e-12)
