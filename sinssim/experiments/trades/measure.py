"""The numbers of a cell: of its covariance budget, or of its ensemble of runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from sinssim.data import Array
from sinssim.formatting import number_text
from sinssim.statistics.requirements.exceeded import NEVER, Exceeded
from sinssim.statistics.requirements.quantity import Quantity
from sinssim.statistics.requirements.requirement import COMPONENTS, SHARES, Requirement
from sinssim.units import NAUTICAL_MILE

if TYPE_CHECKING:
    from sinssim.analyses.error_budget.result import BudgetResult
    from sinssim.experiments.ensembles.result import EnsembleResult
    from sinssim.experiments.trades.schema import TradeStudy

_HEADING = COMPONENTS.index("heading")

Word = Literal["met", "not met", "undecided"]


@dataclass(frozen=True)
class CellVerdict:
    """The verdict of a cell on a requirement.

    Attributes:
        requirement: the requirement as it was written.
        verdict: "met" or "not met"; of an ensemble with 95 % confidence, or "undecided".
        value: its quantity in the unit of the requirement.
        limit: the limit in this unit.
        unit: the unit.
        time_s: instant of the value, s since the start.
        more_runs: about how many more runs would decide; 0 if decided, None if they cannot be counted.
        exceeded_from_s: since when the limit is exceeded, throughout a run, s since the start; None if it is not.
        after_fixes_end_s: how long after the last fix this is, s; None outside an outage.
    """

    requirement: str
    verdict: Word
    value: float
    limit: float
    unit: str
    time_s: float
    more_runs: int | None = 0
    exceeded_from_s: float | None = None
    after_fixes_end_s: float | None = None

    @property
    def text(self) -> str:
        """The value, and since when the limit is exceeded, in words; "" if no run has a solution."""
        if math.isnan(self.value):
            return ""
        value = f"{number_text(self.value)} {self.unit}" if math.isfinite(self.value) else "∞"
        text = f"{value} at {self.time_s:g} s"
        if self.exceeded_from_s is None:
            return text
        after = self.after_fixes_end_s
        return f"{text}, {Exceeded(self.exceeded_from_s, None if after is None else self.exceeded_from_s - after).text}"


@dataclass(frozen=True)
class CellNumbers:
    """The numbers of a cell.

    Attributes:
        values: by column, with the unit in its name; `Quantity.column` is that of a quantity. An ensemble has the ends
            of the 95 % band of a quantity as column + "_low" and "_high".
        verdicts: on each requirement.
        time: instants of the growth of the errors, s since the start.
        cep, r95: CEP and R95 at these instants, m.
        notes: remarks, whole sentences.
    """

    values: dict[str, float]
    verdicts: tuple[CellVerdict, ...]
    time: Array = field(default_factory=lambda: np.zeros(0))
    cep: Array = field(default_factory=lambda: np.zeros(0))
    r95: Array = field(default_factory=lambda: np.zeros(0))
    notes: tuple[str, ...] = ()


def of_budget(study: TradeStudy, result: BudgetResult) -> CellNumbers:
    """Return the numbers of a budget.

    Returns:
        The numbers that `sinssim budget` gives, bit for bit.
    """
    from sinssim.analyses.error_budget.limits import answer_of

    cep, r95 = result.cep, result.r95
    rms, sigma, bias = result.root_mean_square(), result.sigma(), result.bias
    values: dict[str, float] = {}
    for one in study.quantities:
        if one.quantity in SHARES:
            radius = cep if one.quantity == "cep" else r95
            if one.quantity == "rate":
                with np.errstate(divide="ignore", invalid="ignore"):
                    radius = radius / NAUTICAL_MILE / (result.time / 3600.0)
            values[one.column] = _budget_value(result, one, radius)
            continue
        k = COMPONENTS.index(one.quantity)
        values[one.column] = _budget_value(result, one, rms[:, k])
        if one.when != "run":
            values[f"sigma_{one.column}"] = _budget_value(result, one, sigma[:, k])
            values[f"mean_{one.column}"] = _budget_value(result, one, -bias[:, k] if k == _HEADING else bias[:, k])
    if result.filter_covariance is not None:
        own = result.r95_of(result.filter_covariance[-1:], np.zeros((1, 9)))
        values["filter_r95_end_m"] = float(own[0])
    verdicts = []
    for requirement in study.requirements:
        value, time, exceeded = answer_of(result, requirement)
        word: Word = "met" if value <= requirement.limit else "not met"
        verdicts.append(_verdict(requirement, word, value, time, 0, exceeded))
    return CellNumbers(values, tuple(verdicts), result.time, cep, r95)


def _budget_value(result: BudgetResult, one: Quantity, course: Array) -> float:
    if one.when == "run":
        return float(np.max(course))
    return float(course[-1 if one.when == "end" else result.row(one.time)])


def _verdict(
    requirement: Requirement, word: Word, value: float, time: float, more: int | None, exceeded: Exceeded | None
) -> CellVerdict:
    size, since = requirement.unit_size, NEVER if exceeded is None else exceeded.numbers
    limit = requirement.limit / size
    return CellVerdict(requirement.text, word, value / size, limit, requirement.unit, time, more, **since)


def of_ensemble(study: TradeStudy, result: EnsembleResult) -> CellNumbers:
    """Return the numbers that `sinssim ensemble` gives, bit for bit; its epochs have the study's instants."""
    from sinssim.experiments.ensembles.judge import judge
    from sinssim.experiments.ensembles.summary import ensemble_numbers

    summary = ensemble_numbers(result)
    values: dict[str, float] = {"runs": float(len(result)), "failed_runs": float(result.failed.sum())}
    for one in study.quantities:
        values |= _circle(result, one) if one.quantity in SHARES else _component(result, one)
    for name in ("cep", "r95"):
        band = summary["rate_nmi_h"]["line"][name]
        for key, end in (("value", ""), ("low", "_low"), ("high", "_high")):
            values[f"rate_line_{name}_nmi_h{end}"] = band[key]
    consistency = next(iter(summary["nees"].values()), None)  # of all states
    if consistency is not None:
        values["nees_mean"] = consistency["mean"]
        values["nees_share_in_band"] = consistency["share_in_band"]
    verdicts = []
    for requirement in study.requirements:
        found = judge(result, requirement)
        verdicts.append(_verdict(requirement, found.verdict, found.value, found.time, found.more_runs, found.exceeded))
    cep, r95 = np.asarray(result.cep.value), np.asarray(result.r95.value)
    return CellNumbers(values, tuple(verdicts), result.elapsed, cep, r95, tuple(result.notes))


def _epochs(result: EnsembleResult, one: Quantity) -> slice:
    """Return the columns of the epochs that count, before the end of the run."""
    if one.when == "run":
        return slice(0, len(result.elapsed))
    row = int(np.argmin(np.abs(result.elapsed - one.time)))
    return slice(row, row + 1)


def _circle(result: EnsembleResult, one: Quantity) -> dict[str, float]:
    """Return a percentile with its band; throughout the run, its largest value without one."""
    from sinssim.statistics.order_statistics import percentile
    from sinssim.statistics.rates import to_nmi_h

    if one.when == "end":
        errors = to_nmi_h(result.end_rates) if one.quantity == "rate" else result.final_horizontal
        errors = errors[:, None]
    else:
        columns = _epochs(result, one)
        errors = result.horizontal[:, columns]
        if one.quantity == "rate":
            errors = to_nmi_h(errors / result.elapsed[columns])
    found = percentile(errors, SHARES[one.quantity])
    return _with_band(one, found.value, np.maximum(found.low, 0.0), found.high)


def _component(result: EnsembleResult, one: Quantity) -> dict[str, float]:
    """Return the root mean square of a component with the χ² band of normal errors, its σ and its mean."""
    from scipy.stats import chi2

    from sinssim.experiments.ensembles.run_errors import VECTORS

    k, worked = COMPONENTS.index(one.quantity), ~result.failed
    if one.when == "end":
        errors = result.errors.final[worked, k][:, None]
    else:
        errors = getattr(result.errors, VECTORS[k // 3])[worked][:, _epochs(result, one), k % 3]
    errors = errors[:, np.isfinite(errors).any(axis=0)]
    if not errors.size:
        return {one.column: float("nan")}
    count = np.count_nonzero(np.isfinite(errors), axis=0)
    rms = np.sqrt(np.nanmean(errors**2, axis=0))
    low, high = (rms * np.sqrt(count / chi2.ppf(share, count)) for share in (0.975, 0.025))
    found = _with_band(one, rms, low, high)
    if one.when != "run":
        there = errors[np.isfinite(errors[:, 0]), 0]
        found[f"sigma_{one.column}"] = float(np.std(there, ddof=1)) if len(there) > 1 else float("nan")
        mean = float(np.mean(there))
        found[f"mean_{one.column}"] = -mean if k == _HEADING else mean
    return found


def _with_band(one: Quantity, value: Array, low: Array, high: Array) -> dict[str, float]:
    if one.when == "run":
        return {one.column: float(np.nanmax(value)) if np.isfinite(value).any() else float(np.max(value))}
    return {one.column: float(value[0]), f"{one.column}_low": float(low[0]), f"{one.column}_high": float(high[0])}
