"""The cells of a trade study: their scenarios and digests, and their numbers from a budget or an ensemble."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from sinssim.data import Array, short_repr
from sinssim.errors import InputError
from sinssim.experiments.ensembles.ensemble_plan import WITHOUT_EFFECT, flight_digest
from sinssim.experiments.experiment_directory import contents_digest
from sinssim.experiments.studies.trade_schema import TradeStudy, toml_text
from sinssim.scenario.load import load_scenario
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.schema import Scenario
from sinssim.scenario.true_motion import true_motion
from sinssim.simulation.total_system_error import check_path
from sinssim.statistics.circular_error import to_nmi_h
from sinssim.statistics.requirements import COMPONENTS, SHARES, Quantity, Verdict, VerdictInUnit, quantity_of
from sinssim.truth.flight.flight_cache import flight_key
from sinssim.units import NAUTICAL_MILE

if TYPE_CHECKING:
    from sinssim.analyses.error_budget.budget_result import BudgetResult
    from sinssim.experiments.ensembles.ensemble_result import EnsembleResult


_INSTANTS = 40
"""Most instants of a quantity that is the largest of the run, beside that at which it is so."""


@dataclass(frozen=True)
class SourceParts:
    """A source in the budget of a cell."""

    # as of the source
    name: str
    label: str
    group: str
    unit: str
    key: str
    value: float  # its size, in its unit; NaN if no number describes it or one run gives it
    random: bool  # whether it has a covariance instead of a mean
    # by the text of a quantity of the study, for each of its instants: of a circle the covariance of north, north with
    # east, and east, or the mean of north and east; of a component the variance, or the mean. SI
    parts: Mapping[str, Sequence[Sequence[float]]]


@dataclass(frozen=True)
class CellNumbers:
    """The numbers of a cell."""

    # by column, with the unit in its name; `Quantity.column` is that of a quantity. An ensemble has the ends of the 95
    # % band of a quantity as column + "_low" and "_high"
    values: dict[str, float]
    verdicts: tuple[VerdictInUnit, ...]  # on each requirement
    time: Array = field(default_factory=lambda: np.zeros(0))  # instants of the growth of the errors, s since the start
    # CEP and R95 at these instants, m
    cep: Array = field(default_factory=lambda: np.zeros(0))
    r95: Array = field(default_factory=lambda: np.zeros(0))
    notes: tuple[str, ...] = ()  # remarks, whole sentences
    sources: tuple[SourceParts, ...] = ()  # of a budget, with their parts in the quantities that were asked for
    # times of these parts, s, by the text of a quantity
    instants: Mapping[str, Sequence[float]] = field(default_factory=dict)


@short_repr
@dataclass(frozen=True)
class Cell:
    """One cell of a grid, and what became of it."""

    number: int  # its number, from 1, the last axis changing fastest
    place: tuple[int, ...]  # place of its value on each axis, from 0
    settings: tuple[str, ...]  # the varied keys with their values, as for --set
    scenario: Scenario | None  # its scenario; None if the values do not go together
    digest: str = ""  # of what determines its numbers, `digest_of`; "" without a scenario
    numbers: CellNumbers | None = None  # its numbers; None if it failed or was not reached
    failure: str = ""  # why it failed, or why the values do not go together; "" otherwise

    @property
    def status(self) -> Literal["finished", "failed", "open"]:
        """ "finished", "failed", or "open" if it was not reached."""
        return "failed" if self.failure else "open" if self.numbers is None else "finished"

    def value(self, column: str) -> float:
        """Return a number of the cell, NaN without one."""
        return float("nan") if self.numbers is None else self.numbers.values.get(column, float("nan"))

    def verdict(self, requirement: str) -> VerdictInUnit | None:
        """Return its verdict on a requirement, None without one."""
        there = () if self.numbers is None else self.numbers.verdicts
        return next((verdict for verdict in there if verdict.requirement == requirement), None)

    def verdict_on(self, requirements: Iterable[str]) -> str:
        """Return the verdict on several requirements together: "not met", "undecided", "met", or "" without any."""
        words = {verdict.verdict for text in requirements if (verdict := self.verdict(text)) is not None}
        return next((word for word in ("not met", "undecided", "met") if word in words), "")


def digest_of(study: TradeStudy, scenario: Scenario) -> str:
    """Return the SHA-256 of everything that determines the numbers of a cell, except the versions of the software.

    The number of runs of an ensemble is not part of it, because an ensemble can be extended.
    """
    without = (*WITHOUT_EFFECT, *(("ensemble",) if study.cell == "budget" else ()))
    contents = scenario.contents(without=without)
    if isinstance(contents.get("ensemble"), dict):
        contents["ensemble"] = {key: value for key, value in contents["ensemble"].items() if key != "runs"}
    if study.cell == "budget":
        quantities = [q.text for q in study.quantities]
        how = ["budget", study.inertial, quantities, list(study.require)]
    else:
        how = ["ensemble", list(study.instants)]
    return contents_digest([how, contents, flight_digest(scenario)])


def place_name(study: TradeStudy, place: Sequence[int], titled: bool = True) -> str:
    """Return values of the first axes, or of all, in words: "grade tactical, gyro bias sigma 0.01 deg/h".

    Without the axes' titles, "tactical, 0.01 deg/h".
    """
    words = (
        (*([axis.title] if titled else []), axis.name_of(k), axis.unit)
        for axis, k in zip(study.axes, place, strict=False)
    )
    return ", ".join(" ".join(each).rstrip() for each in words)


def cells_of(study: TradeStudy) -> tuple[Cell, ...]:
    """Return the cells of a study, the last axis changing fastest.

    The scenario of a cell is that of `load_scenario` with the study's fixed keys and then the cell's own. A cell whose
    values do not go together has failed.
    """
    load_scenario(study.scenario, study.set)  # mistakes that have nothing to do with the axes
    cells, flown = [], dict[str, float]()
    for number, place in enumerate(itertools.product(*map(range, study.shape)), start=1):
        settings = tuple(f"{key}={toml_text(value)}" for key, value in study.settings(place).items())
        scenario, mistake = _scenario_of(study, settings, flown)
        digest = "" if scenario is None else digest_of(study, scenario)
        cells.append(Cell(number, place, settings, scenario, digest, failure=mistake))
    _check_values(study, cells, flown)
    return tuple(cells)


def _scenario_of(study: TradeStudy, settings: Sequence[str], flown: dict[str, float]) -> tuple[Scenario | None, str]:
    """Return the scenario of some settings and "", or None and why it cannot be used."""
    try:
        scenario = load_scenario(study.scenario, (*study.set, *settings))
        if study.cell == "budget":
            from sinssim.analyses.error_budget.budget_result import check_budgeted
            from sinssim.analyses.error_budget.covariance_budget import check_kind

            check_kind(scenario, "inertial" if study.inertial else None)
            for quantity in study.quantities:
                check_budgeted(quantity)
        elif scenario.one_component is not None:
            raise InputError(f"the scenario {scenario.name} has [one_component], which has no ensemble.")
        else:
            check_path(scenario, study.quantities)
        _check_times(study, scenario, flown)
    except InputError as error:
        return None, str(error)
    return scenario, ""


def _check_times(study: TradeStudy, scenario: Scenario, flown: dict[str, float]) -> None:
    """Raise for a time of a study outside a run; `flown` keeps the durations of flights."""
    if not study.instants or scenario.log is not None:  # which has no ensemble
        return
    lasts = expected_duration(scenario)
    if scenario.flight is not None and study.instants[-1] > lasts:  # of a flight this is an estimate
        key = flight_key(scenario.flight, scenario.seed)
        if key not in flown:
            motion = true_motion(scenario, errors="none")  # which of a flight by its navigator is an estimate, too
            flown[key] = motion.end - motion.start
        lasts = flown[key]
    for requirement in study.requirements:
        requirement.check_within(lasts)
    if study.instants[-1] > lasts + 1e-6:
        raise InputError(
            f"t = {study.instants[-1]:g} s lies outside the run, which lasts {lasts:g} s; give a time up to this."
        )


def _check_values(study: TradeStudy, cells: list[Cell], flown: dict[str, float]) -> None:
    """Raise for a value of an axis that is allowed in no cell."""
    mistakes = {cell.failure for cell in cells}
    if mistakes == {""}:
        return
    if mistakes == {mistake := _scenario_of(study, (), flown)[1]}:  # it has nothing to do with the axes
        raise InputError(f"the study {study.name}: {mistake}")
    wrong = []
    for number, axis in enumerate(study.axes):
        for k in range(len(axis.values)):
            here = [cell for cell in cells if cell.place[number] == k]
            if all(cell.scenario is None for cell in here):
                wrong.append((number, k, here))
    if all(cell.scenario is None for cell in cells):  # values of one axis may spoil those of the others
        alone = [(number, k, here) for number, k, here in wrong if _wrong_alone(study, number, k, flown)]
        wrong = alone or wrong[:1]
    lines: dict[tuple[int, str], str] = {}
    for number, k, here in wrong:
        axis, cell = study.axes[number], here[0]
        if (number, cell.failure) in lines:  # the key itself is wrong: one value says it all
            continue
        others = f" and {len(here) - 1} more" if len(here) > 1 else ""
        lines[number, cell.failure] = (
            f"axes.{number + 1} ({', '.join(axis.paths)}): the value {axis.name_of(k)} cannot be used in cell "
            f"{cell.number} ({place_name(study, cell.place)}){others}: {cell.failure}"
        )
    if lines:
        several = "\n  - ".join([f"{len(lines)} values of the axes:", *lines.values()])
        text = several if len(lines) > 1 else next(iter(lines.values()))
        raise InputError(f"the study {study.name}: {text}")


def _wrong_alone(study: TradeStudy, number: int, k: int, flown: dict[str, float]) -> bool:
    """Return whether a value of an axis cannot be used even with all other axes left out."""
    settings = [f"{key}={toml_text(value)}" for key, value in study.axes[number].settings(k)]
    return _scenario_of(study, settings, flown)[0] is None


def command_of(study: TradeStudy, cell: Cell, program: str = "sinssim") -> str:
    """Return the command that computes a cell by itself, with the same numbers, bit for bit."""
    import shlex

    words = [program, study.cell, study.scenario]
    if study.runs is not None:
        words += ["--runs", str(study.runs)]
    if study.inertial:
        words.append("--inertial")
    for setting in (*study.set, *cell.settings):
        words += ["--set", setting]
    judged = {requirement.time for requirement in study.requirements}
    for time in study.instants:
        words += [] if time in judged else ["--at", f"{time:.15g}"]
    for text in study.require:
        words += ["--require", text]
    return " ".join(map(shlex.quote, words))


_HEADING = COMPONENTS.index("heading")


def of_budget(study: TradeStudy, result: BudgetResult) -> CellNumbers:
    """Return the numbers that `sinssim budget` gives, bit for bit."""
    from sinssim.analyses.error_budget.budget_result import answer_of

    cep, r95 = result.cep, result.r95
    rms, sigma, bias = result.root_mean_square(), result.sigma(), result.bias
    values: dict[str, float] = {}
    asked = {*map(quantity_of, study.requirements), *study.drawn}
    rows: dict[Quantity, list[int]] = {}
    for quantity in study.quantities:
        if quantity in asked:
            course = r95 if quantity.quantity in SHARES else rms[:, COMPONENTS.index(quantity.quantity)]
            rows[quantity] = _rows(result, quantity, course)
        if quantity.quantity in SHARES:
            radius = cep if quantity.quantity == "cep" else r95
            if quantity.quantity == "rate":
                with np.errstate(divide="ignore", invalid="ignore"):
                    radius = radius / NAUTICAL_MILE / (result.time / 3600.0)
            values[quantity.column] = _budget_value(result, quantity, radius)
            continue
        k = COMPONENTS.index(quantity.quantity)
        values[quantity.column] = _budget_value(result, quantity, rms[:, k])
        if quantity.when != "run":
            values[f"sigma_{quantity.column}"] = _budget_value(result, quantity, sigma[:, k])
            mean = -bias[:, k] if k == _HEADING else bias[:, k]
            values[f"mean_{quantity.column}"] = _budget_value(result, quantity, mean)
    if result.filter_covariance is not None:
        values["filter_r95_end_m"] = float(result.r95_of(result.filter_covariance[-1:], np.zeros((1, 9)))[0])
    verdicts = (Verdict.certain(quantity, *answer_of(result, quantity)).in_unit for quantity in study.requirements)
    instants = {quantity.text: result.time[at].tolist() for quantity, at in rows.items()}
    return CellNumbers(values, tuple(verdicts), result.time, cep, r95, (), parts_of(result, rows), instants)


def _rows(result: BudgetResult, quantity: Quantity, course: Array) -> list[int]:
    """Return the rows of a budget that a quantity, whose course is (E,), needs."""
    if quantity.when != "run":
        return [len(result.time) - 1 if quantity.when == "end" else result.row(quantity.time)]
    spread = np.linspace(0, len(result.time) - 1, min(_INSTANTS, len(result.time))).round().astype(int)
    return sorted({*spread.tolist(), int(np.nanargmax(course))})


def parts_of(result: BudgetResult, rows: Mapping[Quantity, Sequence[int]]) -> tuple[SourceParts, ...]:
    """Return the sources of a cell's budget, with their parts at the rows of each quantity."""
    sources = []
    for source in result.sources:
        covariance, mean = result.covariance.get(source.name), result.mean.get(source.name)
        mean = np.zeros((len(result.time), 9)) if mean is None else mean
        parts = {}
        for quantity, at in rows.items():
            k = None if quantity.quantity in SHARES else COMPONENTS.index(quantity.quantity)
            if covariance is not None:
                of = covariance[at]
                values = np.stack((of[:, 0, 0], of[:, 0, 1], of[:, 1, 1]), 1) if k is None else of[:, k, k, None]
            else:
                values = mean[at, :2] if k is None else mean[at, k, None]
            parts[quantity.text] = values.tolist()
        known = source.kind != "one run" and math.isfinite(source.value)
        sources.append(
            SourceParts(source.name, source.label, source.group.replace("_", " "), source.unit, source.key,
                        source.value if known else math.nan, covariance is not None, parts)
        )  # fmt: skip
    return tuple(sources)


def _budget_value(result: BudgetResult, quantity: Quantity, course: Array) -> float:
    if quantity.when == "run":
        return float(np.max(course))
    return float(course[-1 if quantity.when == "end" else result.row(quantity.time)])


def of_ensemble(study: TradeStudy, result: EnsembleResult) -> CellNumbers:
    """Return the numbers that `sinssim ensemble` gives, bit for bit; its epochs have the study's instants."""
    from sinssim.experiments.ensembles.ensemble_summary import band, circles, square_numbers
    from sinssim.experiments.ensembles.ensemble_verdicts import estimate, judge

    values: dict[str, float] = {"runs": float(len(result)), "failed_runs": float(result.failed.sum())}
    for quantity in study.quantities:
        column, of_runs = quantity.column, estimate(result, quantity)
        columns = {
            column: of_runs.value, f"{column}_low": of_runs.low, f"{column}_high": of_runs.high,
            f"sigma_{column}": of_runs.sigma, f"mean_{column}": of_runs.mean,
        }  # fmt: skip
        values |= {name: value for name, value in columns.items() if value is not None}
    for name, circle in circles(to_nmi_h(result.mean_rates))._asdict().items():
        for end, value in zip(("", "_low", "_high"), band(circle).values(), strict=False):
            values[f"rate_line_{name}_nmi_h{end}"] = value
    if squares := next(iter(result.nees.values()), None):  # of all states
        numbers = square_numbers(squares)
        values |= {"nees_mean": numbers.mean, "nees_share_in_band": numbers.share_in_band}
    verdicts = tuple(judge(result, requirement).in_unit for requirement in study.requirements)
    cep, r95 = np.asarray(result.cep.value), np.asarray(result.r95.value)
    return CellNumbers(values, verdicts, result.elapsed, cep, r95, tuple(result.notes))
