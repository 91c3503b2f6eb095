"""The phases of a mission: what each adds to the errors, and the sources of that by the covariance budget."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NotRequired, Self, TypedDict, cast

import numpy as np
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array
from sinssim.errors import SinssimError
from sinssim.exhibits import Column, Item, Medium, Section, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.experiments.run.summary_types import ErrorNumbers, Number
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.motions.balloon import BURST, LANDING, LAUNCH
from sinssim.truth.motions.drop import RELEASED
from sinssim.truth.motions.rocket import BURN_OUT, LIFT_OFF
from sinssim.truth.sampling import FlightEvent
from sinssim.units import fixed, signed

if TYPE_CHECKING:
    from sinssim.analyses.error_budget.budget_result import BudgetResult

_LEG = re.compile(r"leg (\d+) \((\w+)\) (begins|ends)")
_REACHED = re.compile(r"(.+) reached: \d+ m away, height .*")
_OF_LEG = {
    "park": "standstill", "parked": "standstill", "stop": "standstill", "taxi": "taxi", "takeoff": "take-off",
    "take_off": "take-off", "land": "landing", "straight": "under way", "turn": "under way",
}  # fmt: skip
"""Phase of a leg by its type; any other leg is flight."""
_STILL = "standstill"
_OF_EVENT = (
    (RELEASED, "fall", "carried"), (LIFT_OFF, "powered flight", _STILL), (BURN_OUT, "free flight", _STILL),
    (LAUNCH, "ascent", _STILL), (BURST, "descent", _STILL), (LANDING, _STILL, _STILL),
)  # fmt: skip
"""Beginnings of the texts of events of motions without legs (a release has some), the phase that begins with them, and
that before the first of them."""

_QUANTITIES = {
    "horizontal": ((0, 1), "horizontal_sigma_m", 1.0),
    "heading": ((8,), "heading_sigma_arcmin", units.ARCMIN),
    "tilt": ((6, 7), "tilt_sigma_arcsec", units.ARCSEC),
}
"""Components of the navigation errors, key and unit of the root mean square over all runs."""

_SMALLEST = 0.01
"""Smaller shares are not listed."""

_HEADS = {
    f"{name}_{what}_{key}": Column("added" if what == "added" else name, fixed(unit))
    for name, key, unit in (
        ("horizontal", "m", "m"), ("velocity", "mps", "m/s"), ("heading", "arcmin", "arcmin"),
        ("tilt", "arcsec", "arcsec"),
    )
    for what in ("error", "added")
}  # fmt: skip
"""Columns of the table by key."""
_NOTE = (
    "Errors at the end of each phase. Added: length of the change of the north and east error of position or velocity "
    "within the phase, and change of the other errors. The first row of a solution that aligns itself is its start."
)
_SOURCE_NOTE = (
    "Sources: root mean square over all runs of what a phase adds, from the covariance budget, and the shares of the "
    "largest sources in the mean square. This run is one of these runs. `sinssim budget` ranks the sources over the "
    "whole run."
)
_LARGEST, _SHARE = 2, 0.1
"""Most sources named in a cell, and their least share."""
_NOTHING = 1e-9
"""Smaller errors, by rounding, are shown as zero."""


class SourceShares(TypedDict):
    """The root mean square over all runs of what a phase adds, in one of three units, and the sources' shares of it."""

    horizontal_sigma_m: NotRequired[Number]
    heading_sigma_arcmin: NotRequired[Number]
    tilt_sigma_arcsec: NotRequired[Number]
    shares: dict[str, float]


class PhaseSpan(TypedDict):
    """A phase of a solution."""

    phase: str
    from_s: float
    to_s: float


class PhaseErrors(TypedDict):
    """The errors at the end of a phase, and what it added."""

    horizontal_error_m: float
    horizontal_added_m: float
    height_error_m: float
    height_added_m: float
    velocity_error_mps: float
    velocity_added_mps: float
    heading_error_arcmin: float
    heading_added_arcmin: float
    tilt_error_arcsec: float
    tilt_added_arcsec: float


class PhaseNumbers(PhaseSpan, PhaseErrors):
    """A phase with its errors, and with their sources or the reason why these are unknown."""

    sources: NotRequired[dict[str, SourceShares]]
    no_sources: NotRequired[str]


PhasesEntry = dict[str, list[PhaseNumbers]]
"""The phases by solution."""


@dataclass(frozen=True)
class Phase:
    """A part of a mission."""

    name: str  # "alignment", "standstill", "taxi", "take-off", "flight", "landing" and so on
    # start, end: instants, s
    start: float
    end: float


def phases_of(events: Iterable[FlightEvent], driven: bool = False) -> list[Phase]:
    """Return the phases of a motion by its legs, empty for a motion of a single kind.

    Neighbouring legs of one kind are one phase, and so is the flight to each named waypoint. A turn of a vehicle that
    is driven is no flight. Events of balloons, rockets and what is dropped begin phases that the next of them ends.
    """
    begun: dict[str, float] = {}
    phases: list[Phase] = []
    number = ""
    for event in events:
        for text, name, before in _OF_EVENT:
            if event.text.startswith(text) and (not begun or text == RELEASED):
                phases = phases or [Phase(before, 0.0, event.time)]
                if phases[-1].name == name:  # a later burn-out
                    phases.pop()
                phases[-1] = Phase(phases[-1].name, phases[-1].start, event.time)
                phases.append(Phase(name, event.time, np.inf))
        match = _LEG.fullmatch(event.text)
        if match is None:
            place = _REACHED.fullmatch(event.text)
            if place is not None and number in begun:
                phases.append(Phase(f"flight to {place[1]}", begun[number], event.time))
                begun[number] = event.time
            continue
        number, kind, edge = match.groups()
        if edge == "begins":
            begun[number] = event.time
            continue
        name = _OF_LEG.get(kind, "flight")
        if name == "under way" and not driven:
            name = "flight"
        start = begun.get(number, event.time)
        if phases and phases[-1].name == name:
            phases[-1] = Phase(name, phases[-1].start, event.time)
        elif event.time > start:
            phases.append(Phase(name, start, event.time))
    return phases if len(phases) > 1 else []


def phase_rows(phases: Sequence[Phase], time: Array, fine: bool) -> list[PhaseSpan]:
    """Return the phases of a solution at the times (N,) s; those outside the solution are left out.

    These are an alignment before its first row, the rest of the standstill after it, and none that begins after its
    last row, where a filter has diverged. A `fine` alignment goes on while the vehicle stands, by zero velocity.
    """
    rows: list[PhaseSpan] = []
    start, end = float(time[0]), float(time[-1])
    for phase in phases:
        begin, name = phase.start, phase.name
        if phase.end < start - 1e-9 or begin > end - 1e-9:
            continue
        if begin < start - 1e-9:
            rows.append({"phase": "alignment", "from_s": begin, "to_s": start})
            begin = start
        if name == _STILL and fine and len(rows) <= 1:
            name = "fine alignment"
        if phase.end - begin > 1e-9:
            rows.append({"phase": name, "from_s": begin, "to_s": min(phase.end, end)})
    return rows


def phase_numbers(
    phases: Sequence[Phase], time: Array, error_at: Callable[[NDArray[np.intp]], NavError], fine: bool = False
) -> list[PhaseNumbers]:
    """Return the errors of a solution at the end of each phase, and what the phase added; see `phase_rows`."""
    rows = phase_rows(phases, time, fine)
    ends = np.searchsorted(time, [row["to_s"] - 1e-9 for row in rows])
    edges = np.concatenate([[0], np.minimum(ends, len(time) - 1)]).astype(np.intp)
    error = error_at(edges)
    aligned = bool(rows) and rows[0]["phase"] == "alignment"
    errors = (_errors(error, k + 1, None if aligned and k == 0 else k) for k in range(len(rows)))
    return [cast("PhaseNumbers", {**row, **numbers}) for row, numbers in zip(rows, errors, strict=True)]


def _errors(error: NavError, end: int, begin: int | None) -> PhaseErrors:
    """Return the errors in a row, and their change since another; since nothing if there is none."""

    def of(values: Array, unit: float = 1.0) -> tuple[float, float]:
        now = values[end] / unit
        then = np.zeros_like(now) if begin is None else values[begin] / unit
        return float(np.linalg.norm(now)), float(np.linalg.norm(now - then))

    def signed(values: Array, unit: float = 1.0) -> tuple[float, float]:
        now = float(values[end]) / unit
        return now, now - (0.0 if begin is None else float(values[begin]) / unit)

    horizontal, velocity = of(error.position_ned[:, :2]), of(error.velocity_ned)
    height, heading = signed(-error.position_ned[:, 2]), signed(-error.attitude[:, 2], units.ARCMIN)
    tilt = of(error.attitude[:, :2], units.ARCSEC)
    return {
        "horizontal_error_m": horizontal[0],
        "horizontal_added_m": horizontal[1],
        "height_error_m": height[0],
        "height_added_m": height[1],
        "velocity_error_mps": velocity[0],
        "velocity_added_mps": velocity[1],
        "heading_error_arcmin": heading[0],
        "heading_added_arcmin": heading[1],
        "tilt_error_arcsec": tilt[0],
        "tilt_added_arcsec": tilt[1],
    }


@dataclass(frozen=True)
class Phases(Part[PhasesEntry]):
    """The phases of a run's mission."""

    name, title, takes_long = "phases", "What each phase added", True
    # the covariance budget of the inertial solutions and of the aided one, or why there is none
    budgets: Mapping[str, BudgetResult | str] = field(default_factory=dict)

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the motion has several phases."""
        return isinstance(run.truth, Truth) and bool(_phases(run))

    @cached_property
    def phases(self) -> list[Phase]:
        """The phases in order."""
        return _phases(self.run)

    def numbers(self) -> PhasesEntry:
        """Return the errors of each inertial solution by phase, for `summary.json`."""
        return {name: phase_numbers(self.phases, error.time, error.rows) for name, error in self.run.errors.items()}

    def explain(self) -> Self:
        """Add the sources of what each phase adds."""
        budgets = budgets_of_phases(self.run, self.phases)
        for rows in self.entry.values():
            add_sources(rows, budgets["inertial"], float(self.run.truth.time[0]))
        return replace(self, budgets=budgets)

    def with_filter(self) -> PhasesEntry:
        """Return the errors with those of the aided solution."""
        aided, aiding = self.aided, self.run.scenario.aiding
        assert aided is not None
        fine = aiding is not None and "zero_velocity" in aiding.sensors()
        rows = phase_numbers(self.phases, aided.estimate.solution.time, aided.error_at, fine)
        if "filter" in self.budgets:
            add_sources(rows, self.budgets["filter"], float(self.run.truth.time[0]))
        return {**self.entry, "aided": rows}

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the tables for the console."""
        yield from tables(self.entry, "console")

    def exhibits(self) -> Iterator[Item]:
        """Yield the tables, each under the name of its solution."""
        yield from tables(self.entry, "page")


def tables(entry: Mapping[str, Sequence[PhaseNumbers]], medium: Medium) -> Iterator[Item]:
    """Yield what each phase added to the errors of each solution, and the sources of that."""

    def titled(title: str, plain: str, columns: tuple[Column, ...], rows: Sequence[Sequence[str]]) -> Item:
        if medium == "page":
            return Section(title, [Table(columns, rows)])
        return Table(columns, rows, title=plain, on=("console",))

    heads = (Column("phase", words=True), Column("from … to", fixed("s")), *_HEADS.values())
    for name, rows in entry.items():
        numbers = cast("Sequence[Mapping[str, Number]]", rows)
        cells = [
            [row["phase"], f"{row['from_s']:.0f} … {row['to_s']:.0f}", *(_cell(values[key]) for key in _HEADS)]
            for row, values in zip(rows, numbers, strict=True)
        ]
        yield titled(name, f"{name}: what each phase added", heads, cells)
    if entry:
        yield Sentence(_NOTE, "note", on=(medium,))
    columns = (Column("phase", words=True), *(Column(what, words=True) for what in _QUANTITIES))
    known = {name: rows for name, rows in entry.items() if rows and "sources" in rows[0]}
    for name, rows in entry.items():
        if rows and "no_sources" in rows[0]:
            why = f"{name}: the sources of the phases’ errors are unknown (no budget). {rows[0]['no_sources']}"
            yield Sentence(why, "note", on=(medium,))
        elif name in known:
            cells = [[row["phase"], *(_of_sources(row["sources"], what) for what in _QUANTITIES)] for row in rows]
            plain = f"{name}: sources of what each phase added, 1σ of all runs"
            yield titled(f"{name}: sources", plain, columns, cells)
    if known:
        yield Sentence(_SOURCE_NOTE, "note", on=(medium,))


def _cell(value: Number) -> str:
    """Write a number with three significant digits."""
    if value is None or not np.isfinite(value):
        return "–"
    return "0" if abs(value) < _NOTHING else signed(value, 3)


def _of_sources(sources: Mapping[str, SourceShares], what: str) -> str:
    """Write the root mean square and the largest sources."""
    key, entry = _QUANTITIES[what][1], sources[what]
    largest = [(name, share) for name, share in entry["shares"].items() if share >= _SHARE][:_LARGEST]
    of = ", ".join(f"{name} {100.0 * share:.0f}\u00a0%" for name, share in largest)
    size = _cell(cast("Mapping[str, Number]", entry)[key])
    return size if size == "0" else f"{size} {key.rpartition('_')[2]}: {of}"


def _phases(run: Navigated) -> list[Phase]:
    assert isinstance(run.truth, Truth)
    return phases_of(run.truth.trajectory.events, driven=run.scenario.flight is None)


def budgets_of_phases(run: Navigated, phases: Sequence[Phase]) -> dict[str, BudgetResult | str]:
    """Return the budgets of the inertial solutions and, with a filter, of the aided one, or why there is none."""
    from sinssim.analyses.error_budget.covariance_budget import budget

    truth = run.truth
    assert isinstance(truth, Truth)
    start, end = float(truth.time[0]), float(truth.time[-1])
    marks = [min(phase.end, end) - start for phase in phases]
    budgets: dict[str, BudgetResult | str] = {}
    for kind in ("inertial",) if run.scenario.filter is None else ("inertial", "filter"):
        try:
            budgets[kind] = budget(run.scenario, solution=kind, truth=truth, marks=marks)
        except SinssimError as error:
            budgets[kind] = str(error)
    return budgets


def add_sources(rows: Sequence[PhaseNumbers], budget: BudgetResult | str, start: float) -> None:
    """Add the sources to the phases of a solution, or the reason why there are none; the run begins at `start`, s."""
    for row in rows:
        if isinstance(budget, str) or budget.added is None:
            row["no_sources"] = budget if isinstance(budget, str) else "no phase ends after the navigation begins."
            continue
        shares = budget.first() if row["phase"] == "alignment" else budget.added
        ends = shares.end + start
        near = int(np.argmin(np.abs(ends - row["to_s"])))
        row["sources"] = {}
        for name, (components, key, unit) in _QUANTITIES.items():
            square, of = shares.shares(near, components)
            listed = {source: share for source, share in of if share >= _SMALLEST}
            row["sources"][name] = cast("SourceShares", {key: square / unit, "shares": listed})
