"""The result of a covariance budget: `BudgetResult`, its answers to requirements, and allowed sizes of the sources.

The covariance is quadratic in the size of each source, P(f) = P + (f² − 1) P_j, and an error that is the same in every
run is linear in it. The largest factor f with which a requirement is met is therefore the root of one equation in one
unknown, found to rounding; nothing is linearised about the present size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.error_budget.error_sources import Source
from sinssim.data import Array, html_table, short_repr
from sinssim.errors import InputError, unknown_name
from sinssim.recording.result import Media, Result
from sinssim.recording.track_map import Track
from sinssim.statistics.circular_error import radius_about_mean, share_inside
from sinssim.statistics.requirements import (
    BY_PATH,
    COMPONENTS,
    MISS,
    SHARES,
    Exceeded,
    Quantity,
    Requirement,
    first_exceeded,
    parse_requirements,
)

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


BUDGET_COMPONENTS = (
    "position_north", "position_east", "position_down", "velocity_north", "velocity_east", "velocity_down",
    "tilt_north", "tilt_east", "heading",
)  # fmt: skip
"""The navigation errors, in the order of covariances: m, m/s, rad. The heading error is −φ_down."""

HORIZONTAL = slice(0, 2)
_TABLE_ROWS = 6
_FAR_LARGER = 1.5


@dataclass(frozen=True)
class Improvement:
    """The effect of one source on R95 at an instant."""

    source: Source
    alone: float  # R95 by this source alone, m
    gain: float  # decrease of R95 of all sources together if this source were halved, m
    share: float  # its share of the horizontal mean square error


@dataclass(frozen=True, eq=False)
class Added:
    """What the intervals between some instants add to the navigation errors, by source."""

    begin: Array
    end: Array  # begin, end: of the intervals, (K,) s, in the run's time
    covariance: Mapping[str, Array]  # of the change within each interval by name of each random source, (K, 9, 9) SI
    mean: Mapping[str, Array]  # the change by name of each source that is the same in every run, (K, 9) SI

    def shares(self, interval: int, rows: Sequence[int]) -> tuple[float, list[tuple[str, float]]]:
        """Return the root mean square of a change, SI, and name and share of its sources, the largest first.

        `rows` are the components of the navigation errors whose squares are added.
        """
        parts = {name: float(sum(p[interval, k, k] for k in rows)) for name, p in self.covariance.items()}
        bias = np.sum([mean[interval, list(rows)] for mean in self.mean.values()], axis=0)
        parts |= {name: float(mean[interval, list(rows)] @ bias) for name, mean in self.mean.items()}
        square = sum(parts.values())
        if not square > 0.0:
            return 0.0, []
        ordered = sorted(parts.items(), key=lambda item: -item[1])
        return square**0.5, [(name, value / square) for name, value in ordered]


@dataclass(frozen=True)
class PredictedMiss:
    """How the flights by their navigators miss a waypoint: to the right, over all runs, by linear theory."""

    waypoint: str
    time: float  # in the run's time, s
    technical: float  # miss of a perfect navigator, m
    mean: float  # of all runs, m
    sigma: float  # 1σ of the runs about it, m


@short_repr
@dataclass(frozen=True, eq=False)
class BudgetResult(Result):
    """Covariances of the navigation errors by source.

    Attributes:
        scenario: the scenario.
        solution: "inertial" or "filter".
        time: epochs of the results, (E,) s, in the run's time.
        sources: the sources.
        covariance: by name of each random source, position, velocity (north, east, down) and attitude φ, (E, 9, 9) SI.
        mean: by name of each source that is the same in every run, its error with its sign, (E, 9) SI.
        filter_covariance: the filter's own covariance of the navigation errors, (E, 9, 9); None without a filter.
        added: what the intervals between the times `marks` of `budget` add; None without them.
        requirements: the requirements that were asked for.
        free: names of sources that share one factor in the answers to them.
        times: times for which tables have further lines, s since the start.
        directory: directory of the budget; None if none was written.
        waypoints: how a flight by this navigator misses its waypoints.
        track: the true track, for the map.
        media: what draws and writes it.
    """

    scenario: Scenario
    solution: str
    time: Array
    sources: tuple[Source, ...]
    covariance: Mapping[str, Array]
    mean: Mapping[str, Array]
    filter_covariance: Array | None = None
    added: Added | None = None
    requirements: tuple[Requirement, ...] = ()
    free: tuple[str, ...] = ()
    times: tuple[float, ...] = ()
    directory: Path | None = None
    waypoints: tuple[PredictedMiss, ...] = ()
    track: Track | None = None
    media: Media[BudgetResult] = field(kw_only=True, repr=False, compare=False)

    def first(self) -> Added:
        """Return the errors at the first epoch as one interval that begins without errors."""
        covariance = {name: p[:1] for name, p in self.covariance.items()}
        return Added(self.time[:1], self.time[:1], covariance, {name: mean[:1] for name, mean in self.mean.items()})

    def _repr_html_(self) -> str:
        def radius(share: float, covariance: Array | None, mean: Array | None) -> str:
            p = np.zeros((1, 9, 9)) if covariance is None else covariance[-1:]
            m = np.zeros((1, 9)) if mean is None else mean[-1:]
            return f"{radius_about_mean(p[:, HORIZONTAL, HORIZONTAL], m[:, HORIZONTAL], share)[0]:.4g}"

        rows: list[tuple[str, ...]] = [
            ("all sources", *(radius(share, self.total, self.bias) for share in (0.5, 0.95))),
            *(
                (
                    f"{source.group}, {source.label}",
                    "",
                    radius(0.95, self.covariance.get(source.name), self.mean.get(source.name)),
                )
                for source in self.sources
            ),
        ]
        title = f"Budget of {self.scenario.name}, {self.solution}, at the end"
        return html_table(title, rows, ("source", "CEP, m", "R95, m (of a source: by it alone)"))

    def answers(
        self,
        requirements: str | Requirement | Iterable[str | Requirement] | None = None,
        free: Sequence[str] | None = None,
    ) -> tuple[Answer, ...]:
        """Judge requirements, and say how large each source may be.

        Args:
            requirements: such as "r95(3600 s) <= 1852 m", one or several. A time that is not in `time` must be among
                the `require` or `times` of `sinssim.budget`. By default those that were asked for.
            free: names of sources that share one factor; by default those that were named.

        Returns:
            One answer for each requirement, see `sinssim.analyses.error_budget.budget_result.Answer`.

        Raises:
            InputError: a requirement cannot be read, a source is unknown or has no size, or a time is not an epoch.
        """
        if requirements is None and free is None:
            return self._answers
        judged = self.requirements if requirements is None else requirements
        return answers(self, judged, self.free if free is None else free)

    @cached_property
    def _answers(self) -> tuple[Answer, ...]:
        """The answers to what was asked for: the report, the files and the console each need them."""
        return answers(self, self.requirements, self.free)

    @cached_property
    def _radii(self) -> dict[tuple[float, str | None], Array]:
        """Radii that were asked for, by share and source: reports, figures and recordings ask for the same ones."""
        return {}

    @cached_property
    def total(self) -> Array:
        """Covariance by all random sources together, (E, 9, 9)."""
        none = np.zeros((len(self.time), 9, 9))
        return np.asarray(sum(self.covariance.values(), none))

    @cached_property
    def bias(self) -> Array:
        """Error that is the same in every run, (E, 9)."""
        return np.asarray(sum(self.mean.values(), np.zeros((len(self.time), 9))))

    def source(self, name: str) -> Source:
        """Return a source.

        Args:
            name: its name, as in `sources`.

        Returns:
            The source.

        Raises:
            InputError: there is no source of this name.
        """
        for source in self.sources:
            if source.name == name:
                return source
        raise unknown_name("source of errors", name, [source.name for source in self.sources])

    def row(self, t: float) -> int:
        """Return the row of an epoch.

        Args:
            t: its time, s.

        Returns:
            Its row in the arrays.

        Raises:
            InputError: the budget does not have it.
        """
        row = int(np.argmin(np.abs(self.time - t)))
        if abs(float(self.time[row]) - t) > 1e-6:
            raise InputError(
                f"the budget has no time t = {t:g} s; add it to the argument times of budget(). The nearest is "
                f"{self.time[row]:g} s."
            )
        return row

    def table_rows(self, extra: Sequence[float] = ()) -> list[int]:
        """Return the rows of the epochs that tables show: six evenly spaced ones, and others.

        Args:
            extra: times of the others, s.

        Returns:
            Rows in order.
        """
        even = np.linspace(self.time[0], self.time[-1], _TABLE_ROWS + 1)[1:]
        return sorted({int(np.argmin(np.abs(self.time - t))) for t in even} | {self.row(t) for t in extra})

    def scaled(self, factors: Mapping[str, float]) -> tuple[Array, Array]:
        """Return covariance and mean if some sources were larger or smaller.

        Args:
            factors: factor of each of these sources' size.

        Returns:
            (E, 9, 9) and (E, 9).
        """
        total, bias = self.total.copy(), self.bias.copy()
        for name, factor in factors.items():
            if name in self.covariance:
                total += (factor**2 - 1.0) * self.covariance[name]
            elif name in self.mean:
                bias += (factor - 1.0) * self.mean[name]
        return total, bias

    def sigma(self, source: str | None = None) -> Array:
        """Return the standard deviation of each component.

        Args:
            source: name of a random source; all together by default.

        Returns:
            (E, 9), in the order of `COMPONENTS`.
        """
        covariance = self.total if source is None else self.covariance.get(source, np.zeros((len(self.time), 9, 9)))
        return np.asarray(np.sqrt(np.maximum(np.einsum("kii->ki", covariance), 0.0)))

    def root_mean_square(self) -> Array:
        """Return the root mean square of each component over all runs: σ and the given errors together, (E, 9)."""
        return np.asarray(np.hypot(self.sigma(), self.bias))

    def radius(self, share: float, source: str | None = None) -> Array:
        """Return the radius of the circle that contains a share of the horizontal errors.

        Args:
            share: 0.5 for CEP, 0.95 for R95.
            source: name of one source alone; all together by default.

        Returns:
            (E,) m.
        """
        known = self._radii.get((share, source))
        if known is None:
            covariance, mean = self.total, self.bias
            if source is not None:
                covariance = self.covariance.get(source, np.zeros_like(self.total))
                mean = self.mean.get(source, np.zeros_like(self.bias))
            known = radius_about_mean(covariance[:, HORIZONTAL, HORIZONTAL], mean[:, HORIZONTAL], share)
            self._radii[share, source] = known
        return known.copy()

    @property
    def cep(self) -> Array:
        """Radius of the circle that contains half of all runs, (E,) m."""
        return self.radius(0.5)

    @property
    def r95(self) -> Array:
        """Radius of the circle that contains 95 % of all runs, (E,) m."""
        return self.radius(0.95)

    @property
    def instants_to_rank(self) -> tuple[float, ...]:
        """Times at which sources are ranked: the end, and that of the largest R95 if it is far larger, s."""
        r95, end = self.r95, len(self.time) - 1
        worst = int(np.argmax(r95))
        also = (float(self.time[worst]),) if r95[worst] > _FAR_LARGER * r95[end] else ()
        return (float(self.time[end]), *also)

    def improvements(self, t: float | None = None) -> tuple[Improvement, ...]:
        """Rank the sources by the gain in R95 if each alone were halved.

        Args:
            t: time, s; the end by default.

        Returns:
            The sources, the largest gain first.
        """
        row = len(self.time) - 1 if t is None else self.row(t)
        at = slice(row, row + 1)
        square = float(np.trace(self.total[row, HORIZONTAL, HORIZONTAL]) + np.sum(self.bias[row, HORIZONTAL] ** 2))
        now = float(self.r95_of(self.total[at], self.bias[at])[0])
        improvements = []
        for source in self.sources:
            covariance = self.covariance.get(source.name, np.zeros_like(self.total))[at]
            mean = self.mean.get(source.name, np.zeros_like(self.bias))[at]
            halved = self.r95_of(self.total[at] - 0.75 * covariance, self.bias[at] - 0.5 * mean)
            part = float(np.trace(covariance[0, HORIZONTAL, HORIZONTAL]))
            part += float(np.sum(mean[0, HORIZONTAL] * self.bias[row, HORIZONTAL]))
            alone = float(self.r95_of(covariance, mean)[0])
            improvements.append(Improvement(source, alone, now - float(halved[0]), part / square if square else 0.0))
        return tuple(sorted(improvements, key=lambda improvement: -improvement.gain))

    @staticmethod
    def r95_of(covariance: Array, mean: Array) -> Array:
        """Return the radius of the circle that contains 95 % of the horizontal errors.

        Args:
            covariance: (N, 9, 9) SI.
            mean: (N, 9) SI.

        Returns:
            (N,) m.
        """
        return radius_about_mean(covariance[:, HORIZONTAL, HORIZONTAL], mean[:, HORIZONTAL], 0.95)


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


def check_budgeted(requirement: Requirement | Quantity) -> None:
    """Raise for a requirement that a covariance of the navigation errors does not answer."""
    if requirement.quantity in (*BY_PATH, MISS):
        raise InputError(
            f"{requirement.text!r}: a budget has the errors of the navigator, not the flight that follows them; "
            "`sinssim ensemble` and `run` judge it."
        )


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
        check_budgeted(requirement)
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
