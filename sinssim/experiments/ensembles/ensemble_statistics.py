"""The numbers of an ensemble in the words of the field, as they stand in its `summary.json`.

Circles, components, consistency, verdicts on requirements, and the σ that the covariance budget predicts.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array
from sinssim.errors import InputError, SinssimError, SinssimWarning
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS
from sinssim.experiments.ensembles.ensemble_execution import DIVERGED
from sinssim.formatting import number_text
from sinssim.scenario.ensemble_section import MOST_RUNS, EnsembleSection
from sinssim.scenario.plan_summary import own_files
from sinssim.statistics.chi_square import extreme, share_inside
from sinssim.statistics.circular_error import circle_radius
from sinssim.statistics.percentiles import Percentile, cep, percentile, r95
from sinssim.statistics.position_error_rate import END, LINE, to_nmi_h
from sinssim.statistics.requirement_verdict import (
    CONFIDENCE,
    NEVER,
    Tally,
    Verdict,
    columns_of,
    errors_of,
    joined,
    tally,
    verdict_of,
)
from sinssim.statistics.requirements import Requirement

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.ensemble_plan import Plan
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


def ensemble_numbers(result: EnsembleResult, status: str = "finished") -> dict[str, Any]:
    """Return the numbers of an ensemble.

    Args:
        status: "finished", "interrupted" or "failed".

    Returns:
        The contents of `summary.json`, apart from the versions: definitions, numbers of runs, the errors at the end
        and at the times asked for, rates in both definitions, components, the comparison with the regulation,
        requirements, a filter's NEES, NIS and verdict, failures, the worst, median and best runs, and files outside the
        package on which the numbers depend. Numbers that are not finite are as they are.
    """
    plan = result.plan
    lasts = float(plan.epochs[-1] - plan.start)
    return {
        "scenario": plan.scenario.name,
        "status": status,
        "seed": plan.scenario.seed,
        "solution": plan.solution,
        "runs": len(result),
        "failed": int(result.failed.sum()),
        "start_s": plan.start,
        "end_s": float(plan.epochs[-1]),
        "epochs": len(plan.epochs),
        "varied": list(plan.keys),
        "definitions": DEFINITIONS,
        "final_horizontal_m": {
            "cep": band(cep(result.final_horizontal)),
            "r95": band(r95(result.final_horizontal)),
        },
        "at": _at(result),
        "rate_nmi_h": {
            name: {
                "definition": definition,
                "cep": band(cep(to_nmi_h(rates))),
                "r95": band(r95(to_nmi_h(rates))),
            }
            for name, definition, rates in (("line", LINE, result.mean_rates), ("end", END, result.end_rates))
        },
        "components": _components(result),
        "circles_of_covariance_m": _circles(result),
        "part_121": part_121(result, lasts),
        "requirements": requirements(result),
        "looks": list(result.looks),
        "nees": {name: _mean_square(one) for name, one in result.nees.items()},
        "nis": {name: _mean_square(one) for name, one in result.nis.items()},
        "consistency": consistency(result),
        "failures": {str(number): text for number, text in result.failures.items()},
        "named_runs": named_runs(result),
        "notes": result.notes,
        "computed": result.computed,
        "seconds": round(result.seconds, 3),
        **({"own_content": own} if (own := [file.to_json() for file in own_files(plan.scenario)]) else {}),
    }


def band(found: Percentile) -> dict[str, float]:
    """Return a percentile of one number of each run as `value`, `low`, `high` and `runs`."""
    return {
        "value": float(found.value),
        "low": max(float(found.low), 0.0),
        "high": float(found.high),
        "runs": int(found.runs),
    }


def named_runs(result: EnsembleResult) -> list[dict[str, Any]]:
    """Return the worst runs, the median and the best one, by the rate of the line through the origin.

    Returns:
        Each with its rank in words, number, seed, rate, final error, and failure or "".
    """
    order, count = result.ranking, len(result)
    worked = order[int(result.failed.sum()) :]
    picked = {int(number): "worst" for number in order[:1]}
    if len(worked):
        picked.setdefault(int(worked[-1]), "best")
        picked.setdefault(int(worked[len(worked) // 2]), "median")
    for place, number in enumerate(order[:WORST], 1):  # in few runs, one of them is the median
        picked.setdefault(int(number), f"worst {place}")
    rates, rows = to_nmi_h(result.mean_rates), {int(n): k for k, n in enumerate(result.errors.number)}
    return [
        {
            "rank": rank,
            "run": number,
            "seed": int(result.errors.seed[rows[number]]),
            "rate_nmi_h": float(rates[rows[number]]),
            "final_horizontal_m": float(result.final_horizontal[rows[number]]),
            "settings": result.member(number).settings,
            "failure": result.errors.failure[rows[number]],
        }
        for number, rank in sorted(picked.items(), key=lambda item: int(np.flatnonzero(order == item[0])[0]))
        if count
    ]


def requirements(result: EnsembleResult) -> list[dict[str, Any]]:
    """Return the verdicts on the requirements as plain numbers.

    Returns:
        For each the requirement as it was written, its meaning, the verdict and its confidence, the value of these runs
        and the limit in the unit as written, the time of the value, since when the limit is exceeded over the whole run
        (None if it is not), the number of runs judged, and about how many more are needed (None if more than can be
        counted).
    """
    return [
        {
            "requirement": one.requirement.text,
            "meaning": one.requirement.meaning,
            "verdict": one.verdict,
            "confidence": CONFIDENCE,
            "value": one.value / one.requirement.unit_size,
            "limit": one.requirement.limit / one.requirement.unit_size,
            "unit": one.requirement.unit,
            "time_s": one.time,
            **(one.exceeded.numbers if one.exceeded else NEVER),
            "runs": one.runs,
            "more_runs": one.more_runs,
        }
        for one in result.verdicts
    ]


def part_121(result: EnsembleResult, lasts: float) -> dict[str, Any]:
    """Compare an ensemble with 14 CFR Part 121, Appendix G.

    Args:
        result: the ensemble.
        lasts: length of the run, s.

    Returns:
        `rule`, the `quantities` that it limits with their bands, and `verdict`: "met", "not met", "undecided" (the
        limit lies in the band), or "does not apply" with its `reason`.
    """
    if result.plan.filtered:
        reason = "the solution is aided, and the rule applies only to inertial systems"
        return {"rule": PART_121, "quantities": {}, "verdict": "does not apply", "reason": reason}
    if lasts <= PART_121_HOURS * 3600.0:
        rule = f"{PART_121}: up to 10 h, at most 2 nmi/h of circular error in 95 % of flights, r(T)/T"
        quantities = {"R95 of r(T)/T, nmi/h": (band(r95(to_nmi_h(result.end_rates))), PART_121_RATE)}
    else:
        rule = f"{PART_121}: beyond 10 h, ±20 nmi across the track and ±25 nmi along it in 95 % of flights"
        course = result.plan.course
        if not np.isfinite(course):
            reason = "the vehicle is at rest at the end, so that no track is known"
            return {"rule": rule, "quantities": {}, "verdict": "does not apply", "reason": reason}
        north, east = (np.where(result.failed, np.inf, result.errors.final[:, i]) for i in (0, 1))
        with np.errstate(invalid="ignore"):
            along = np.abs(north * np.cos(course) + east * np.sin(course))
            across = np.abs(east * np.cos(course) - north * np.sin(course))
        quantities = {
            f"95 % {name} the track, nmi": (band(percentile(_failed_far(result, x) / units.NAUTICAL_MILE, 0.95)), limit)
            for name, x, limit in (("across", across, _ACROSS), ("along", along, _ALONG))
        }
    verdicts = [_verdict(found, limit) for found, limit in quantities.values()]
    verdict = next((v for v in ("not met", "undecided") if v in verdicts), "met")
    return {
        "rule": rule,
        "quantities": {name: {**found, "limit": limit} for name, (found, limit) in quantities.items()},
        "verdict": verdict,
    }


def _failed_far(result: EnsembleResult, values: Array) -> Array:
    return np.where(result.failed, np.inf, values)


def _verdict(found: dict[str, float], limit: float) -> str:
    if found["high"] <= limit:
        return "met"
    return "not met" if found["low"] > limit else "undecided"


def _components(result: EnsembleResult) -> dict[str, dict[str, float]]:
    """Return mean and σ at the end, and rms over all epochs, of each component of the errors."""
    found = {}
    worked = ~result.failed
    for number, name in enumerate(COMPONENTS):
        final = result.errors.final[worked, number]
        sums, counts = (values[worked].sum() for values in result.mean_squares_of_runs(name))
        count = len(final)
        sigma = float(np.std(final, ddof=1)) if count > 1 else float("nan")
        square = sums / counts if counts else float("nan")
        found[name] = {
            "final_mean": float(np.mean(final)) if count else float("nan"),
            "final_sigma": sigma,
            "final_sigma_standard_error": sigma / float(np.sqrt(2.0 * max(count, 1))),
            "rms": float(np.sqrt(square)),
        }
    return found


def covariance_at_end(result: EnsembleResult) -> Array:
    """Return mean squares and products of the final errors north and east over the runs that did not fail, (2, 2) m².

    Returns:
        The second moment about zero, the covariance of a zero-mean distribution; NaN with fewer than two runs.
    """
    final = result.errors.final[~result.failed, :2]
    if len(final) < 2:
        return np.full((2, 2), np.nan)
    return np.asarray(final.T @ final / len(final))


def _circles(result: EnsembleResult) -> dict[str, float]:
    """Return the circles of the zero-mean normal distribution with the second moments of the final errors."""
    p = covariance_at_end(result)
    return {"cep": float(circle_radius(p, 0.5)), "r95": float(circle_radius(p, 0.95))}


def _at(result: EnsembleResult) -> list[dict[str, Any]]:
    """Return CEP and R95 at the times that were asked for."""
    rows = []
    for time in sorted(set(result.times)):
        k = int(np.argmin(np.abs(result.elapsed - time)))
        row: dict[str, Any] = {"time_s": float(result.elapsed[k])}
        for key, one in (("cep_m", result.cep), ("r95_m", result.r95)):
            there = {name: getattr(one, name)[k] for name in ("value", "low", "high", "runs")}
            row[key] = band(replace(one, **there))
        rows.append(row)
    return rows


def consistency(result: EnsembleResult) -> dict[str, Any] | None:
    """Judge a filter by all runs: no better than the worst of its tests, with at most 1 % of false alarms.

    The tests are ANEES of each block at each epoch, whose sum over independent runs is χ², and NIS of each sensor over
    all epochs, since innovations are independent in time, too. As for a single run, an ANEES below 1 does not count,
    because the initial state may have been better than assumed.

    Returns:
        `verdict`, "consistent" or "not consistent"; `runs` that did not fail and `diverged`, the number of those whose
        filter did; `worst`, the test with the least probability: its `test`, `name`, `time_s` (None over all epochs),
        `value`, `limit`, `probability` (Bonferroni over `tests`) and `level`; `hints`, the causes as for a single run.
        None without a filter, or if no run has a test.
    """
    from sinssim.estimation.consistency import FALSE_ALARM
    from sinssim.scenario.filter_model import hints
    from sinssim.scenario.unknown_gravity import gravity_notes

    tests: list[tuple[str, str, float | None, float, float]] = []
    for name, one in result.nees.items():
        there = np.flatnonzero(np.isfinite(one.value))
        tests += [("ANEES", name, float(result.time[k]), float(one.value[k]), float(one.freedom[k])) for k in there]
    for name, one in result.nis.items():
        tests.append(("NIS", name, None, _mean_square(one)["mean"], float(one.freedom.sum())))
    values, freedom, both = ([one[3] for one in tests], [one[4] for one in tests], [one[0] == "NIS" for one in tests])
    found = extreme(values, freedom, both, FALSE_ALARM)
    diverged = sum(text.startswith(DIVERGED) for text in result.failures.values())
    if found is None and not diverged:
        return None
    sound = not diverged and found is not None and found.probability >= FALSE_ALARM
    worst: dict[str, Any] | None = None
    if found is not None:
        test, name, time, value, _ = tests[found.place]
        worst = {"test": test, "name": name, "time_s": time, "value": value, "limit": found.limit,
                 "probability": found.probability, "tests": found.tests, "level": found.level}  # fmt: skip
    scenario = result.plan.scenario
    return {
        "verdict": "consistent" if sound else "not consistent",
        "runs": int((~result.failed).sum()),
        "diverged": diverged,
        "worst": worst,
        "hints": [] if sound else [*gravity_notes(scenario), *hints(scenario)],
    }


def consistency_sentences(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Write the verdict on a filter, from `ensemble_numbers`, in sentences, the causes first; none without a filter."""
    found = numbers["consistency"]
    if found is None:
        return
    yield from found["hints"]
    runs, diverged, worst = found["runs"], found["diverged"], found["worst"]
    said = [f"it diverged in {diverged} of {numbers['runs']} runs"] if diverged else []
    if worst is not None:
        when = "over all epochs" if worst["time_s"] is None else f"at {worst['time_s']:g} s"
        p = f"= {number_text(worst['probability'], 2)}" if worst["probability"] > 1e-300 else "< 1e-300"
        said.append(
            f"the worst of {worst['tests']} tests, {worst['test']} of {worst['name']} {when}, is "
            f"{number_text(worst['value'])}, with the limit {number_text(worst['limit'])} for "
            f"{100.0 * worst['level']:g} % of false alarms in all tests together; p {p} (χ², Bonferroni)"
        )
    the = "Therefore the" if found["hints"] else "The"
    yield f"{the} filter is {found['verdict']} over {runs} {'run' if runs == 1 else 'runs'}: {'; '.join(said)}."


def _mean_square(one: MeanSquare) -> dict[str, float]:
    there = np.isfinite(one.value)
    last = int(np.flatnonzero(there)[-1]) if there.any() else 0
    total = float(one.freedom.sum())
    mean = float(np.nansum(np.where(there, one.value * one.freedom, 0.0)) / total) if total else float("nan")
    return {
        "mean": mean,
        "share_in_band": share_inside(one.value, one.band),
        "end": float(one.value[last]),
        "low": float(one.band.low[last]),
        "high": float(one.band.high[last]),
    }


_FEW = 20


def predicted_sigma(plan: Plan) -> Array | None:
    """Return σ of the errors at the epochs by the propagation of covariances, without any run.

    Returns:
        (K, 9): position, velocity and attitude, north, east, down: m, m/s, rad; of the filter's solution if the runs
        have a filter. None with varied keys, which the budget does not know; for fewer than 20 runs with a filter,
        whose budget takes as long as one or two of them; and if the scenario has no budget.
    """
    runs = (plan.scenario.ensemble or EnsembleSection()).runs
    if plan.keys or (plan.filtered and runs < _FEW):
        return None
    from sinssim.analyses.error_budget.covariance_budget import budget

    elapsed = plan.epochs - plan.start
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SinssimWarning)  # the ensemble itself has warned
            found = budget(plan.scenario, times=elapsed.tolist(), solution="filter" if plan.filtered else "inertial")
    except SinssimError:
        return None
    rows = np.abs(found.time[:, None] - elapsed).argmin(axis=0)
    return np.asarray(found.sigma()[rows])


LOOKS = 5
"""Most looks at an ensemble that runs until its requirements are decided; the number of runs doubles from one to the
next, so that the last one has 16 times the first number."""


def looks_of(runs: int) -> tuple[int, ...]:
    """Return the numbers of runs after which an ensemble is judged that runs until its requirements are decided.

    Returns:
        At most `LOOKS` numbers, each twice the one before.
    """
    return tuple(sorted({min(runs * 2**look, MOST_RUNS) for look in range(LOOKS)}))


def check_kept(plan: Plan, require: Iterable[Requirement], times: Iterable[float] = ()) -> None:
    """Raise InputError if a time that is asked for, s, is not among the epochs of an ensemble that is continued."""
    elapsed = plan.epochs - plan.start
    asked = [(f"requirement {one.text!r}", one.time) for one in require if one.when == "at"]
    for who, time in (*asked, *((f"times (--at): {time:g} s", time) for time in times)):
        if np.abs(elapsed - time).min() > 1e-6:
            after = int(np.searchsorted(elapsed, time))
            raise InputError(
                f"{who}: the ensemble keeps no errors at {time:g} s, and its files cannot be changed; its nearest "
                f"epochs are {elapsed[after - 1]:.10g} s and {elapsed[after]:.10g} s. Give one of these times, or "
                "begin another ensemble with -o."
            )


def judge(
    result: EnsembleResult, requirement: Requirement, runs: int | None = None, error: float = 1.0 - CONFIDENCE
) -> Verdict:
    """Judge a requirement by the runs of an ensemble.

    A failed run counts as infinitely far off. A run that has ended, or whose filter has not begun, does not count. At
    the end, every run counts with its own end.

    Args:
        runs: number of runs that are judged, the first ones; by default all.

    Raises:
        InputError: the time of the requirement is not an epoch.
    """
    rows = np.ones(len(result), np.bool_) if runs is None else result.errors.number < runs
    failed, elapsed = result.failed[rows], result.elapsed
    if requirement.when == "end":
        errors = errors_of([result.errors.final[rows, place, None] for place in columns_of(requirement)])
        if requirement.quantity == "rate":  # of each run by its own time
            lasts = np.where(failed, elapsed[-1], result.errors.end[rows] - result.plan.start)
            errors = errors * (elapsed[-1] / lasts)[:, None]
        return verdict_of(requirement, elapsed[-1:], _tally(requirement, elapsed[-1:], errors, failed), error)
    epochs = result.errors.spans()
    if requirement.when == "at":
        column = int(np.argmin(np.abs(elapsed - requirement.time)))
        epochs = [slice(column, column + 1)]
    tallies = []
    for some in epochs:
        errors = errors_of([result.errors.column(COMPONENTS[p], some)[rows] for p in columns_of(requirement)])
        tallies.append(_tally(requirement, elapsed[some], errors, failed))
    aiding = result.plan.scenario.aiding
    outages = () if aiding is None or not result.plan.filtered else aiding.outages
    instants = np.concatenate([elapsed[some] for some in epochs])
    return verdict_of(requirement, instants, joined(tallies), error, outages)


def _tally(requirement: Requirement, instants: Array, errors: Array, failed: NDArray[np.bool_]) -> Tally:
    works = np.isfinite(errors) & ~failed[:, None]
    reached = works.any(axis=0) if not failed.all() else np.ones(len(instants), np.bool_)
    counts = (works | failed[:, None]) & reached
    return tally(requirement, instants, np.where(failed[:, None], np.inf, errors), counts)


class Looks:
    """The looks at an ensemble; a verdict that is reached stands."""

    def __init__(self, require: Sequence[Requirement], first: int, until_decided: bool) -> None:
        """Begin without a look at a `first` number of runs, the only one unless the ensemble runs `until_decided`."""
        self.numbers = looks_of(first) if until_decided else (first,)
        self.done: list[int] = []
        self.verdicts: list[Verdict | None] = [None] * len(require)
        self._require, self.several = tuple(require), until_decided

    @property
    def decided(self) -> bool:
        """Whether all requirements are met or not met."""
        return all(one is not None and one.verdict != "undecided" for one in self.verdicts)

    def so_far(self, result: EnsembleResult) -> tuple[Verdict, ...]:
        """Judge the runs of an ensemble that stopped early; no look is counted.

        Returns:
            The verdicts that had been reached, and those of these runs on the other requirements.
        """
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        return tuple(
            judge(result, one, None, error) if before is None or before.verdict == "undecided" else before
            for one, before in zip(self._require, self.verdicts, strict=True)
        )

    def look(self, result: EnsembleResult, runs: int) -> None:
        """Judge the requirements that are not decided.

        Several looks judge their number of runs alone, so that a continued ensemble looks as a new one does; a single
        look judges all runs of the directory.
        """
        error = (1.0 - CONFIDENCE) / (LOOKS if self.several else 1)
        self.done.append(runs if self.several else len(result))
        for place, (one, before) in enumerate(zip(self._require, self.verdicts, strict=True)):
            if before is None or before.verdict == "undecided":
                self.verdicts[place] = judge(result, one, runs if self.several else None, error)


_WORDS = {"met": "met, with 95 % confidence", "not met": "NOT MET, with 95 % confidence", "undecided": "undecided"}


def verdict_text(found: Verdict) -> str:
    """Return the value behind a verdict, its limit, and about how many more runs decide."""
    one, size = found.requirement, found.requirement.unit_size
    if math.isnan(found.value):
        return f"No run has a solution {one.instant}."
    value = f"{number_text(found.value / size)} {one.unit}" if math.isfinite(found.value) else "∞ (failed runs)"
    at = "at the end" if one.when == "end" else f"at {found.time:g} s"
    it = "the largest value" if one.when == "run" else "it"
    text = f"In {found.runs} runs {it} is {value} {at}; the limit is {one.limit / size:g} {one.unit}."
    if found.exceeded is not None:
        text += f" It is {found.exceeded.text}."
    if found.verdict != "undecided":
        return text
    if found.more_runs is None:
        return f"{text} The value lies at the limit: the necessary number of runs cannot be predicted."
    return f"{text} About {_rounded(found.more_runs)} more runs are needed for a decision if they are similar."


def looks_text(result: EnsembleResult) -> str:
    """Return how often an ensemble was looked at, and the probability of error.

    Returns:
        Whole sentences; "" if it did not run until decided.
    """
    if not result.looks:
        return ""
    *first, last = map(str, result.looks)
    numbers = f"{', '.join(first)} and {last}" if first else last
    limit = ""
    if any(one.verdict == "undecided" for one in result.verdicts):
        limit = (
            f" {last} runs are the most for this --runs; a further series of tests has its own probability of error of "
            "5 %."
        )
    return (
        f"Tested after {numbers} runs. Each of at most {LOOKS} tests errs with at most {5 / LOOKS:g} %, all together "
        f"with at most 5 %.{limit}"
    )


def requirement_lines(result: EnsembleResult) -> list[str]:
    """Return the verdicts as lines for the console."""
    lines = [f"{one.requirement.text}: {_WORDS[one.verdict]}. {verdict_text(one)}" for one in result.verdicts]
    return [*lines, *filter(None, [looks_text(result)])]


def _rounded(number: int) -> str:
    """Return about how many: two digits."""
    digits = max(len(str(number)) - 2, 0)
    return str(round(number, -digits))
