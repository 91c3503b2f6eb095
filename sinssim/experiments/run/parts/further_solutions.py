"""Solutions beside those of the package: of navigators of somebody else, and of the filters of [[filters]]."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from sinssim.data import Array
from sinssim.estimation.consistency import consistency, nees
from sinssim.exhibits import Column, Item, Medium, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.experiments.run.summary_types import ErrorNumbers
from sinssim.recording.streams import Stream, Vector
from sinssim.sensors.measurement_kind import CORE, PHI, R
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.navigator_protocol import ForeignSolution
from sinssim.simulation.truth_comparison import Aided, FilterSolution
from sinssim.strapdown.navigation_error import NavError
from sinssim.units import ARCMIN, fixed, number_text

_VECTORS = ("position_ned", "velocity_ned", "attitude")
SIGMAS = (
    *(f"sigma_position_{axis}_m" for axis in "ned"), *(f"sigma_velocity_{axis}_mps" for axis in "ned"),
    *(f"sigma_phi_{axis}_rad" for axis in "ned"),
)  # fmt: skip
"""Columns of the 1σ of position, velocity and attitude, of any solution that states them."""
_NORMAL = 0.6827
"""Share of normal errors within 1σ."""
_MOST_STATUS = 20
"""Different values of a status that are counted; beyond it is a number, not a status."""


class Stated(TypedDict):
    """What one navigator states; None for what it does not."""

    started: str
    solutions: int
    interval_s: float
    within_sigma: dict[str, float] | None
    status: dict[str, int] | None
    last_message: str


@dataclass(frozen=True)
class Navigators(Part[dict[str, Stated]]):
    """The navigators of somebody else."""

    name, title = "navigators", "Navigators of others"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the scenario names one."""
        return bool(run.scenario.navigator)

    @property
    def _solutions(self) -> dict[str, ForeignSolution]:
        return {name: of for name, of in self.run.solutions.items() if isinstance(of, ForeignSolution)}

    def numbers(self) -> dict[str, Stated]:
        """Return what each states, of those that have a solution."""
        started = {n.name: n.library or " ".join(n.command or ()) for n in self.run.scenario.navigator}
        return {
            name: Stated(
                started=started[name], solutions=len(of.time),
                interval_s=float(np.median(np.diff(of.time))) if len(of.time) > 1 else float("nan"),
                within_sigma=self._within(name, of.sigma), status=_counts(of.status),
                last_message=of.messages.strip().rpartition("\n")[2],
            )
            for name, of in self._solutions.items()
        }  # fmt: skip

    def _within(self, name: str, sigma: Array | None) -> dict[str, float] | None:
        """Return the share of errors within 1σ, by position, velocity and attitude; None without 1σ or a truth."""
        if sigma is None or self.run.axes != "north":
            return None
        errors, shares = self.run.errors[name], {}
        for number, vector in enumerate(_VECTORS):
            known = sigma[:, 3 * number : 3 * number + 3]
            error = getattr(errors, vector)
            there = np.isfinite(known) & np.isfinite(error)
            if there.any():
                shares[vector.removesuffix("_ned")] = float(np.mean(np.abs(error[there]) <= known[there]))
        return shares or None

    def exhibits(self) -> Iterator[Item]:
        """Yield a table of what they state."""
        kinds = ("position", "velocity", "attitude")
        columns = (
            Column("navigator", words=True), Column("solutions"), Column("every", fixed("s"), digits=4),
            *(Column(kind, digits=3, group="errors within its 1σ") for kind in kinds), Column("status", words=True),
            Column("started", words=True),
        )  # fmt: skip
        rows: list[list[str | float]] = []
        for name, stated in self.entry.items():
            shares, status = stated["within_sigma"] or {}, stated["status"] or {}
            words = ", ".join(f"{value} × {count}" for value, count in status.items())
            within = (shares.get(kind, float("nan")) for kind in kinds)
            rows.append([name, str(stated["solutions"]), stated["interval_s"], *within, words, stated["started"]])
        if rows:
            yield Table(columns, rows)
        if any(stated["within_sigma"] for stated in self.entry.values()):
            yield Sentence(f"Of normal errors a share of {number_text(_NORMAL)} is within 1σ.", "note")
        for name, stated in self.entry.items():
            if stated["last_message"]:
                yield Sentence(f"{name} said last: {stated['last_message']}", "note")

    def streams(self) -> Iterator[Stream]:
        """Yield the 1σ, the biases and the status that they state."""
        biases = (*(f"gyro_bias_{axis}_radps" for axis in "xyz"), *(f"accel_bias_{axis}_mps2" for axis in "xyz"))
        for name, of in self._solutions.items():
            vectors = [] if of.sigma is None else [Vector("sigma", SIGMAS, of.sigma)]
            vectors += [] if of.biases is None else [Vector("biases", biases, of.biases)]
            vectors += [] if of.status is None else [Vector("status", ("status",), of.status[:, None])]
            if vectors:
                yield Stream(f"navigator_{name}", of.time, tuple(vectors))


def _counts(status: Array | None) -> dict[str, int] | None:
    """Return how often each value of a status occurs."""
    if status is None:
        return None
    counts = Counter(status[np.isfinite(status)].tolist())
    return {f"{value:g}": counts[value] for value in sorted(counts)} if len(counts) <= _MOST_STATUS else None


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
    """The filter of [filter] and those beside it."""

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
        errors = self.run.errors
        return {
            name: _compared(of.kind, of.seconds, of.sigma, of.aided, errors[name])
            for name, of in self._solutions.items()
        }

    def with_filter(self) -> dict[str, Compared]:
        """Return the numbers of all, first those of [filter]."""
        of, section = self.aided, self.run.scenario.filter
        assert of is not None
        assert section is not None
        first = _compared(section.kind, of.seconds, of.estimate.sigma[:, :CORE], of, of.error)
        return {"aided": first, **self.entry}

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


def _compared(kind: str, seconds: float, stated: Array | None, aided: Aided | None, error: NavError) -> Compared:
    sigma = np.full((1, CORE), np.nan) if stated is None else stated
    heading, spread = _rms(error.attitude[:, 2]), _rms(sigma[:, PHI.start + 2])
    numbers = Compared(
        kind=kind, states=None,
        rms_horizontal_error_m=_rms(error.horizontal),
        rms_horizontal_sigma_m=_rms(np.hypot(sigma[:, R.start], sigma[:, R.start + 1])),
        rms_heading_error_arcmin=None if heading is None else heading / ARCMIN,
        rms_heading_sigma_arcmin=None if spread is None else spread / ARCMIN,
        nees_per_state=None, consistent=None, diverged_s=None, processor_s=seconds,
    )  # fmt: skip
    if aided is None:
        return numbers
    estimate = aided.estimate
    if aided.true_parameters_known and len(estimate.rows):
        core = slice(0, CORE)
        squares = float(np.mean(nees(aided.state_errors_at(estimate.rows), estimate.covariance, core)))
        numbers["nees_per_state"] = squares / CORE
    end = estimate.divergence
    numbers |= {"states": estimate.model.size, "consistent": consistency(estimate).consistent,
                "diverged_s": None if end is None else end.time}  # fmt: skip
    return numbers
