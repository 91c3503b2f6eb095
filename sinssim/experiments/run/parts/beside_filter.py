"""The filters of [[filters]] in a run: their errors beside their own σ, their tests, and what they cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from sinssim.data import Array
from sinssim.estimation.consistency import consistency, nees
from sinssim.exhibits import Column, Item, Medium, Sentence, Table
from sinssim.experiments.run.parts.foreign_navigators import SIGMAS
from sinssim.experiments.run.run_result import Part
from sinssim.recording.streams import Stream, Vector
from sinssim.sensors.measurement_kind import CORE, PHI, R
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_comparison import FilterSolution
from sinssim.units import ARCMIN, fixed

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import ErrorNumbers
    from sinssim.strapdown.navigation_error import NavError


class Compared(TypedDict):
    """One filter in numbers; None for what is not known of recorded sensors, or of the filter of a project."""

    kind: str
    states: int | None
    rms_horizontal_error_m: float | None
    rms_horizontal_sigma_m: float | None
    rms_heading_error_arcmin: float | None
    rms_heading_sigma_arcmin: float | None
    nees_per_state: float | None
    consistent: bool | None
    diverged_s: float | None
    processor_s: float


@dataclass(frozen=True)
class FurtherFilters(Part[dict[str, Compared]]):
    """The filters beside that of [filter]."""

    name, title = "filters", "Filters side by side"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the scenario has any."""
        return bool(run.scenario.filters)

    @property
    def _solutions(self) -> dict[str, FilterSolution]:
        return {name: of for name, of in self.run.solutions.items() if isinstance(of, FilterSolution)}

    def numbers(self) -> dict[str, Compared]:
        """Return the numbers of each filter."""
        return {name: _compared(of, self.run.errors[name]) for name, of in self._solutions.items()}

    def brief(self, numbers: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the table for the console."""
        yield self._table(("console",))

    def exhibits(self) -> Iterator[Item]:
        """Yield the table of the filters."""
        yield self._table(("page", "recording"))
        yield Sentence(
            "NEES per state of position, velocity and attitude: 1 on average for a filter whose covariance is right. "
            "The filters are not smoothed; that of [filter] has a section of its own.",
            "note", on=("page",),
        )  # fmt: skip

    def _table(self, on: tuple[Medium, ...]) -> Table:
        error, sigma = "error, rms", "1σ, rms"
        heads = (
            Column("filter", words=True), Column("kind", words=True), Column("states"),
            *(Column(what, fixed(unit), digits=3, group=of)
              for of, unit in (("horizontal", "m"), ("heading", "arcmin")) for what in (error, sigma)),
            Column("NEES per state", digits=3), Column("innovations", words=True),
            Column("processor time", fixed("s"), digits=2),
        )  # fmt: skip
        rows: list[list[str | float]] = []
        for name, of in self.entry.items():
            known = [of["rms_horizontal_error_m"], of["rms_horizontal_sigma_m"],
                     of["rms_heading_error_arcmin"], of["rms_heading_sigma_arcmin"], of["nees_per_state"]]  # fmt: skip
            end = of["diverged_s"]
            verdict = {True: "consistent", False: "not consistent", None: "–"}[of["consistent"]]
            rows.append([
                name, of["kind"], "–" if of["states"] is None else str(of["states"]),
                *(float("nan") if value is None else value for value in known),
                verdict if end is None else f"diverged at {end:.0f} s", of["processor_s"],
            ])  # fmt: skip
        return Table(heads, rows, title=self.title, on=on)

    def streams(self) -> Iterator[Stream]:
        """Yield the 1σ of each filter's navigation states."""
        for name, of in self._solutions.items():
            if of.sigma is not None:
                yield Stream(f"filter_{name}", of.time, (Vector("sigma", SIGMAS, of.sigma),))


def _rms(values: Array) -> float | None:
    """Return the root mean square of what is known, None for nothing."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


def _compared(of: FilterSolution, error: NavError) -> Compared:
    sigma = np.full((1, CORE), np.nan) if of.sigma is None else of.sigma
    heading, spread = _rms(error.attitude[:, 2]), _rms(sigma[:, PHI.start + 2])
    numbers = Compared(
        kind=of.kind, states=None,
        rms_horizontal_error_m=_rms(error.horizontal),
        rms_horizontal_sigma_m=_rms(np.hypot(sigma[:, R.start], sigma[:, R.start + 1])),
        rms_heading_error_arcmin=None if heading is None else heading / ARCMIN,
        rms_heading_sigma_arcmin=None if spread is None else spread / ARCMIN,
        nees_per_state=None, consistent=None, diverged_s=None, processor_s=of.seconds,
    )  # fmt: skip
    if of.aided is None:
        return numbers
    estimate = of.aided.estimate
    if of.aided.true_parameters_known and len(estimate.rows):
        core = slice(0, CORE)
        squares = float(np.mean(nees(of.aided.state_errors_at(estimate.rows), estimate.covariance, core)))
        numbers["nees_per_state"] = squares / CORE
    end = estimate.divergence
    numbers |= {"states": estimate.model.size, "consistent": consistency(estimate).consistent,
                "diverged_s": None if end is None else end.time}  # fmt: skip
    return numbers
