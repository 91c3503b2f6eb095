"""The numbers of an ensemble in the words of the field: circles, rates, components, consistency of a filter."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.errors import SinssimError, SinssimWarning
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS
from sinssim.experiments.ensembles.ensemble_execution import DIVERGED
from sinssim.experiments.ensembles.ensemble_plan import Plan
from sinssim.scenario.ensemble_section import EnsembleSection
from sinssim.scenario.filter_model import hints
from sinssim.scenario.plan_summary import own_files
from sinssim.statistics.chi_square import extreme, share_inside
from sinssim.statistics.circular_error import END, LINE, circle_radius, to_nmi_h
from sinssim.statistics.percentiles import Percentile, cep, percentile, r95
from sinssim.statistics.requirements import CONFIDENCE, Verdict
from sinssim.units import number_text

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.ensemble_result import EnsembleResult, MeanSquare


DEFINITIONS = {
    "horizontal error r": "distance between the solution and the true position, along the ground, at each epoch",
    "CEP, R95": "50th and 95th percentile of r over the runs, median-unbiased; the error of a failed run is infinite",
    "band": "95 % confidence, from order statistics (binomial); no normality assumed",
    "rate by the line": f"of each run: {LINE}; 1 nmi = 1852 m",
    "rate at the end": f"of each run: {END}; 1 nmi = 1852 m",
    "sigma": "root of the sample variance over the runs that did not fail, with its standard error sigma/sqrt(2N)",
    "rms": "root of the mean square over all epochs of all runs that did not fail",
    "heading, tilt": "components of the rotation vector of the attitude error about down, and about north and east",
}
"""What each number of an ensemble means."""

WORST = 5
"""Number of the worst runs that are named."""

PART_121_RATE, PART_121_HOURS = 2.0, 10.0
PART_121 = "14 CFR Part 121, Appendix G"
"""Its limits for inertial systems: at most 2 nmi/h of circular error in 95 % of flights up to 10 h; beyond, ±20 nmi
across the track and ±25 nmi along it in 95 %."""
_ACROSS, _ALONG = 20.0, 25.0


class Circles(NamedTuple):
    """CEP and R95 of one number of each run, or of its course."""

    cep: Percentile
    r95: Percentile

    def contents(self, unit: str = "") -> dict[str, Any]:
        """Return both for `summary.json`, with the unit in the names."""
        return {f"cep{unit}": band(self.cep), f"r95{unit}": band(self.r95)}


def circles(values: Array) -> Circles:
    """Return the circles of horizontal errors or of rates."""
    return Circles(cep(values), r95(values))


@dataclass(frozen=True)
class Component:
    """A component of the errors over the runs that did not fail, SI."""

    final_mean: float
    final_sigma: float
    final_sigma_standard_error: float
    rms: float
    """Root mean square over all epochs of all runs."""


@dataclass(frozen=True)
class SquareNumbers:
    """A mean normalised square: its mean over all epochs, and its value and χ² band at the last one."""

    mean: float
    share_in_band: float
    end: float
    low: float
    high: float


@dataclass(frozen=True)
class Regulation:
    """The comparison with a rule: the quantities that it limits with their limits, and the verdict."""

    rule: str
    quantities: dict[str, tuple[Percentile, float]]
    verdict: Literal["met", "not met", "undecided", "does not apply"]
    reason: str = ""
    """Why it does not apply."""

    @property
    def contents(self) -> dict[str, Any]:
        """The comparison for `summary.json`."""
        quantities = {name: {**band(value), "limit": limit} for name, (value, limit) in self.quantities.items()}
        contents = {"rule": self.rule, "quantities": quantities, "verdict": self.verdict}
        return {**contents, "reason": self.reason} if self.reason else contents


@dataclass(frozen=True)
class WorstTest:
    """The test of a filter with the least probability, by Bonferroni over all of them."""

    test: Literal["ANEES", "NIS"]
    name: str
    time_s: float | None
    """None over all epochs."""
    value: float
    limit: float
    probability: float
    tests: int
    level: float


@dataclass(frozen=True)
class Consistency:
    """The verdict on a filter, with the causes as for a single run; `runs` did not fail, `diverged` are others."""

    verdict: Literal["consistent", "not consistent"]
    runs: int
    diverged: int
    worst: WorstTest | None
    hints: list[str]


@dataclass(frozen=True)
class NamedRun:
    """One of the worst runs, the median or the best one, by the rate of the line through the origin."""

    rank: str
    run: int
    seed: int
    rate_nmi_h: float
    final_horizontal_m: float
    settings: list[str]
    failure: str


@dataclass(frozen=True)
class EnsembleNumbers:
    """The numbers of an ensemble; those that are not finite are as they are."""

    status: str
    """ "finished", "interrupted" or "failed"."""
    final: Circles
    """Of the horizontal errors at the end of each run, m."""
    at: tuple[tuple[float, Circles], ...]
    """Times since the start, s, with the circles there, m."""
    line: Circles
    """Of the rates by the line through the origin, nmi/h."""
    end: Circles
    """Of the rates by the end, nmi/h."""
    components: dict[str, Component]
    normal: tuple[float, float]
    """CEP and R95 of the zero-mean normal distribution with the second moments of the final errors, m."""
    part_121: Regulation
    nees: dict[str, SquareNumbers]
    nis: dict[str, SquareNumbers]
    consistency: Consistency | None
    named_runs: tuple[NamedRun, ...]
    own_content: list[dict[str, Any]]
    """Files outside the package on which the numbers depend."""


def ensemble_numbers(result: EnsembleResult, status: str = "finished") -> EnsembleNumbers:
    """Return the numbers of an ensemble, which is "finished", "interrupted" or "failed"."""
    plan, second_moments = result.plan, covariance_at_end(result)
    return EnsembleNumbers(
        status=status,
        final=circles(result.final_horizontal),
        at=tuple(_at(result)),
        line=circles(to_nmi_h(result.mean_rates)),
        end=circles(to_nmi_h(result.end_rates)),
        components=_components(result),
        normal=(float(circle_radius(second_moments, 0.5)), float(circle_radius(second_moments, 0.95))),
        part_121=part_121(result, float(plan.epochs[-1] - plan.start)),
        nees={name: square_numbers(square) for name, square in result.nees.items()},
        nis={name: square_numbers(square) for name, square in result.nis.items()},
        consistency=consistency(result),
        named_runs=tuple(_named_runs(result)),
        own_content=[file.to_json() for file in own_files(plan.scenario)],
    )


def summary_of(result: EnsembleResult, numbers: EnsembleNumbers | None = None) -> dict[str, Any]:
    """Return the contents of `summary.json`, apart from the versions, from the numbers if they are known."""
    plan, of = result.plan, numbers or ensemble_numbers(result)
    contents = {
        "scenario": plan.scenario.name,
        "status": of.status,
        "seed": plan.scenario.seed,
        "solution": plan.solution,
        "runs": len(result),
        "failed": int(result.failed.sum()),
        "start_s": plan.start,
        "end_s": float(plan.epochs[-1]),
        "epochs": len(plan.epochs),
        "varied": list(plan.keys),
        "definitions": DEFINITIONS,
        "final_horizontal_m": of.final.contents(),
        "at": [{"time_s": time, **there.contents("_m")} for time, there in of.at],
        "rate_nmi_h": {
            "line": {"definition": LINE, **of.line.contents()},
            "end": {"definition": END, **of.end.contents()},
        },
        "components": {name: asdict(component) for name, component in of.components.items()},
        "circles_of_covariance_m": dict(zip(("cep", "r95"), of.normal, strict=True)),
        "part_121": of.part_121.contents,
        "requirements": [_requirement(verdict) for verdict in result.verdicts],
        "looks": list(result.looks),
        "nees": {name: asdict(square) for name, square in of.nees.items()},
        "nis": {name: asdict(square) for name, square in of.nis.items()},
        "consistency": None if of.consistency is None else asdict(of.consistency),
        "failures": {str(number): text for number, text in result.failures.items()},
        "named_runs": [asdict(run) for run in of.named_runs],
        "notes": result.notes,
        "computed": result.computed,
        "seconds": round(result.seconds, 3),
    }
    return {**contents, "own_content": of.own_content} if of.own_content else contents


def band(estimate: Percentile) -> dict[str, float]:
    """Return a percentile of one number of each run for `summary.json`."""
    low = max(float(estimate.low), 0.0)
    return {"value": float(estimate.value), "low": low, "high": float(estimate.high), "runs": int(estimate.runs)}


def _requirement(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict for `summary.json`, with value and limit in the unit as written."""
    unit = verdict.in_unit
    return {
        "requirement": unit.requirement,
        "meaning": verdict.requirement.meaning,
        "verdict": unit.verdict,
        "confidence": CONFIDENCE,
        "value": unit.value,
        "limit": unit.limit,
        "unit": unit.unit,
        "time_s": unit.time_s,
        "exceeded_from_s": unit.exceeded_from_s,
        "after_fixes_end_s": unit.after_fixes_end_s,
        "runs": verdict.runs,
        "more_runs": unit.more_runs,
    }


def _named_runs(result: EnsembleResult) -> Iterator[NamedRun]:
    """Yield the worst runs, the median and the best one, from the worst to the best."""
    order = result.ranking
    worked = order[int(result.failed.sum()) :]
    ranks = {int(number): "worst" for number in order[:1]}
    if len(worked):
        ranks.setdefault(int(worked[-1]), "best")
        ranks.setdefault(int(worked[len(worked) // 2]), "median")
    for place, number in enumerate(order[:WORST], 1):  # in few runs, one of them is the median
        ranks.setdefault(int(number), f"worst {place}")
    rates, rows = to_nmi_h(result.mean_rates), {int(n): k for k, n in enumerate(result.errors.number)}
    for number in (int(number) for number in order if int(number) in ranks):
        row = rows[number]
        yield NamedRun(
            ranks[number], number, int(result.errors.seed[row]), float(rates[row]),
            float(result.final_horizontal[row]), result.member(number).settings, result.errors.failure[row],
        )  # fmt: skip


def part_121(result: EnsembleResult, duration: float) -> Regulation:
    """Compare an ensemble whose runs last a `duration`, s, with 14 CFR Part 121, Appendix G.

    It is undecided if the limit lies in the band of a quantity, and does not apply to an aided solution, or to a
    vehicle at rest after more than ten hours.
    """
    if result.plan.filtered:
        reason = "the solution is aided, and the rule applies only to inertial systems"
        return Regulation(PART_121, {}, "does not apply", reason)
    if duration <= PART_121_HOURS * 3600.0:
        rule = f"{PART_121}: up to 10 h, at most 2 nmi/h of circular error in 95 % of flights, r(T)/T"
        quantities = {"R95 of r(T)/T, nmi/h": (r95(to_nmi_h(result.end_rates)), PART_121_RATE)}
    else:
        rule = f"{PART_121}: beyond 10 h, ±20 nmi across the track and ±25 nmi along it in 95 % of flights"
        course = result.plan.course
        if not np.isfinite(course):
            reason = "the vehicle is at rest at the end, so that no track is known"
            return Regulation(rule, {}, "does not apply", reason)
        north, east = (np.where(result.failed, np.inf, result.errors.final[:, i]) for i in (0, 1))
        with np.errstate(invalid="ignore"):
            along = np.abs(north * np.cos(course) + east * np.sin(course))
            across = np.abs(east * np.cos(course) - north * np.sin(course))
        quantities = {
            f"95 % {name} the track, nmi": (
                percentile(np.where(result.failed, np.inf, distance) / units.NAUTICAL_MILE, 0.95), limit,
            )
            for name, distance, limit in (("across", across, _ACROSS), ("along", along, _ALONG))
        }  # fmt: skip
    if any(float(value.low) > limit for value, limit in quantities.values()):
        return Regulation(rule, quantities, "not met")
    met = all(float(value.high) <= limit for value, limit in quantities.values())
    return Regulation(rule, quantities, "met" if met else "undecided")


def _components(result: EnsembleResult) -> dict[str, Component]:
    """Return mean and σ at the end, and rms over all epochs, of each component of the errors."""
    components, worked = {}, ~result.failed
    for number, name in enumerate(COMPONENTS):
        final = result.errors.final[worked, number]
        total, values = (each[worked].sum() for each in result.mean_squares_of_runs(name))
        count = len(final)
        sigma = float(np.std(final, ddof=1)) if count > 1 else math.nan
        components[name] = Component(
            float(np.mean(final)) if count else math.nan,
            sigma,
            sigma / float(np.sqrt(2.0 * max(count, 1))),
            float(np.sqrt(total / values if values else math.nan)),
        )
    return components


def covariance_at_end(result: EnsembleResult) -> Array:
    """Return the second moments about zero of the final errors north and east over the runs that worked, (2, 2) m².

    They are the covariance of a zero-mean distribution; NaN with fewer than two runs.
    """
    final = result.errors.final[~result.failed, :2]
    if len(final) < 2:
        return np.full((2, 2), np.nan)
    return np.asarray(final.T @ final / len(final))


def _at(result: EnsembleResult) -> Iterator[tuple[float, Circles]]:
    """Yield the circles at the times of further lines of the tables."""
    for time in sorted(set(result.times)):
        k = int(np.argmin(np.abs(result.elapsed - time)))
        there = (
            replace(circle, value=circle.value[k], low=circle.low[k], high=circle.high[k], runs=circle.runs[k])
            for circle in (result.cep, result.r95)
        )
        yield float(result.elapsed[k]), Circles(*there)


def consistency(result: EnsembleResult) -> Consistency | None:
    """Judge a filter by all runs: no better than the worst of its tests, with at most 1 % of false alarms.

    The tests are ANEES of each block at each epoch, whose sum over independent runs is χ², and NIS of each sensor over
    all epochs, since innovations are independent in time, too. As for a single run, an ANEES below 1 does not count,
    because the initial state may have been better than assumed. None without a filter, or if no run has a test.
    """
    from sinssim.estimation.consistency import FALSE_ALARM

    tests: list[tuple[Literal["ANEES", "NIS"], str, float | None, float, float]] = []
    for name, square in result.nees.items():
        there = np.flatnonzero(np.isfinite(square.value))
        tests += [
            ("ANEES", name, float(result.time[k]), float(square.value[k]), float(square.freedom[k])) for k in there
        ]
    for name, square in result.nis.items():
        tests.append(("NIS", name, None, square_numbers(square).mean, float(square.freedom.sum())))
    values, freedom, two_sided = (
        [test[3] for test in tests],
        [test[4] for test in tests],
        [test[0] == "NIS" for test in tests],
    )
    least = extreme(values, freedom, two_sided, FALSE_ALARM)
    diverged = sum(text.startswith(DIVERGED) for text in result.failures.values())
    if least is None and not diverged:
        return None
    sound = not diverged and least is not None and least.probability >= FALSE_ALARM
    worst = None
    if least is not None:
        test, name, time, value, _ = tests[least.place]
        worst = WorstTest(test, name, time, value, least.limit, least.probability, least.tests, least.level)
    scenario = result.plan.scenario
    return Consistency(
        "consistent" if sound else "not consistent", int((~result.failed).sum()), diverged, worst,
        [] if sound else list(hints(scenario)),
    )  # fmt: skip


def consistency_sentences(verdict: Consistency | None, runs: int) -> Iterator[str]:
    """Write the verdict on a filter over a number of `runs` in sentences, the causes first; none without a filter."""
    if verdict is None:
        return
    yield from verdict.hints
    worst = verdict.worst
    reasons = [f"it diverged in {verdict.diverged} of {runs} runs"] if verdict.diverged else []
    if worst is not None:
        when = "over all epochs" if worst.time_s is None else f"at {worst.time_s:g} s"
        p = f"= {number_text(worst.probability, 2)}" if worst.probability > 1e-300 else "< 1e-300"
        reasons.append(
            f"the worst of {worst.tests} tests, {worst.test} of {worst.name} {when}, is "
            f"{number_text(worst.value)}, with the limit {number_text(worst.limit)} for "
            f"{100.0 * worst.level:g} % of false alarms in all tests together; p {p} (χ², Bonferroni)"
        )
    the = "Therefore the" if verdict.hints else "The"
    over = f"{verdict.runs} {'run' if verdict.runs == 1 else 'runs'}"
    yield f"{the} filter is {verdict.verdict} over {over}: {'; '.join(reasons)}."


def square_numbers(square: MeanSquare) -> SquareNumbers:
    there = np.isfinite(square.value)
    last = int(np.flatnonzero(there)[-1]) if there.any() else 0
    freedom = float(square.freedom.sum())
    total = float(np.nansum(np.where(there, square.value * square.freedom, 0.0)))
    return SquareNumbers(
        total / freedom if freedom else math.nan, share_inside(square.value, square.band), float(square.value[last]),
        float(square.band.low[last]), float(square.band.high[last]),
    )  # fmt: skip


_FEW = 20


def predicted_sigma(plan: Plan) -> Array | None:
    """Return σ of the errors at the epochs by the covariance budget, (K, 9) SI; of the filter's solution with a filter.

    None with varied keys, which the budget does not know; for fewer than 20 runs with a filter, whose budget takes as
    long as one or two of them; and if the scenario has no budget.
    """
    runs = (plan.scenario.ensemble or EnsembleSection()).runs
    if plan.keys or (plan.filtered and runs < _FEW):
        return None
    from sinssim.analyses.error_budget.covariance_budget import budget

    elapsed, solution = plan.epochs - plan.start, "filter" if plan.filtered else "inertial"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SinssimWarning)  # the ensemble itself has warned
            predicted = budget(plan.scenario, times=elapsed.tolist(), solution=solution)
    except SinssimError:
        return None
    rows = np.abs(predicted.time[:, None] - elapsed).argmin(axis=0)
    return np.asarray(predicted.sigma()[rows])
