"""The result of an ensemble: errors of all runs as arrays, and their statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, html_table, short_repr
from sinssim.errors import InputError
from sinssim.estimation.state_model import GRAVITY
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, EVERYTHING, VECTORS, Errors, write_tables
from sinssim.experiments.ensembles.ensemble_plan import ALL, Member, Plan, member
from sinssim.recording.result import Media, Result
from sinssim.statistics.chi_square import Band, mean_square_band
from sinssim.statistics.circular_error import mean_rate
from sinssim.statistics.percentiles import CEP_SHARE, R95_SHARE, Percentile, Spread, percentile, spread
from sinssim.statistics.requirements import Verdict


@short_repr
@dataclass(frozen=True)
class MeanSquare:
    """A mean normalised square over the runs, at the epochs."""

    name: str  # block of the filter's states, or aiding sensor
    value: Array  # mean per degree of freedom, (K,); 1 is expected; NaN at an epoch without one
    band: Band  # its χ² band for the number of runs, at each epoch
    freedom: Array  # degrees of freedom in all, (K,); fewer by what all runs have in common


@dataclass(eq=False, repr=False)
class EnsembleResult(Result):
    """The result of an ensemble of N runs at K epochs.

    Attributes:
        plan: what the runs have in common: the scenario, the epochs, the solution.
        errors: errors of all runs, in the order of their numbers; of many runs, they are read from a file at each use.
        directory: directory of the ensemble; None if nothing is kept.
        seconds: duration of the computation, s, of this call alone.
        computed: number of runs computed by this call; the others had been finished before.
        notes: remarks on how it was computed, whole sentences.
        verdicts: verdicts on the requirements, in their order.
        looks: numbers of runs after which they were judged, with `until_decided`; else none.
        times: times since the start for which tables have further lines, s.
        media: what draws and writes it.
    """

    plan: Plan
    errors: Errors
    directory: Path | None = None
    seconds: float = 0.0
    computed: int = 0
    notes: list[str] = field(default_factory=list)
    verdicts: tuple[Verdict, ...] = ()
    looks: tuple[int, ...] = ()
    times: tuple[float, ...] = ()
    media: Media[EnsembleResult] = field(kw_only=True, repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.errors)

    def __repr__(self) -> str:
        failed = int(self.failed.sum())
        return f"EnsembleResult({self.plan.scenario.name}: {len(self)} runs, {failed} failed, {len(self.time)} epochs)"

    def _repr_html_(self) -> str:
        def text(estimate: Percentile) -> str:
            return f"{estimate.value[-1]:.4g} ({estimate.low[-1]:.4g} … {estimate.high[-1]:.4g})"

        rows: list[tuple[str, ...]] = [("CEP at the end, m", text(self.cep)), ("R95 at the end, m", text(self.r95))]
        rows += [(verdict.requirement.text, verdict.verdict) for verdict in self.verdicts]
        return html_table(repr(self), rows, ("", "value (95 % band)"))

    @property
    def time(self) -> Array:
        """The epochs, (K,) s."""
        return self.plan.epochs

    @property
    def elapsed(self) -> Array:
        """Time since the start of the run at the epochs, (K,) s."""
        return self.plan.epochs - self.plan.start

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each run failed, (N,)."""
        return self.errors.failed

    @property
    def failures(self) -> dict[int, str]:
        """Why runs failed, by their number."""
        return {int(n): text for n, text in zip(self.errors.number, self.errors.failure, strict=True) if text}

    @property
    def horizontal(self) -> Array:
        """Horizontal (radial) error r of each run, (N, K) m: infinite for a failed run, NaN after the end of a run."""
        return self.horizontal_at()

    def horizontal_at(self, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        """Return the horizontal error of some runs at some epochs.

        Args:
            epochs, runs: which of them; by default all.

        Returns:
            (R, E) m: infinite for a failed run, NaN after the end of a run.
        """
        north, east = (self.errors.column(name, epochs, runs) for name in COMPONENTS[:2])
        return np.where(self.failed[runs, None], np.inf, np.hypot(north, east))

    @cached_property
    def final_horizontal(self) -> Array:
        """Horizontal error of each run at its own end, (N,) m; infinite for a failed run."""
        return np.where(self.failed, np.inf, np.hypot(self.errors.final[:, 0], self.errors.final[:, 1]))

    def percentile(self, share: float, confidence: float = 0.95) -> Percentile:
        """Return a percentile of the horizontal error over the runs, at the epochs.

        Args:
            share: share of the runs, between 0 and 1.
            confidence: of its band.

        Returns:
            The percentile in m, (K,), with its band.
        """
        return self._percentiles((share,), confidence)[0]

    def _percentiles(self, shares: Sequence[float], confidence: float = 0.95) -> tuple[Percentile, ...]:
        """Return percentiles at all epochs, some epochs at a time."""
        parts = []
        for epochs in self.errors.spans():
            errors = self.horizontal_at(epochs)
            parts.append([percentile(errors, share, confidence) for share in shares])

        def joined(several: Sequence[Percentile]) -> Percentile:
            value, low, high, runs = (
                np.concatenate([getattr(part, name) for part in several]) for name in ("value", "low", "high", "runs")
            )
            return Percentile(several[0].share, value, low, high, confidence, runs)

        return tuple(map(joined, zip(*parts, strict=True)))

    @cached_property
    def _circles(self) -> tuple[Percentile, ...]:
        return self._percentiles((CEP_SHARE, R95_SHARE))

    @property
    def cep(self) -> Percentile:
        """CEP(t) with its 95 % band, (K,) m."""
        return self._circles[0]

    @property
    def r95(self) -> Percentile:
        """R95(t) with its 95 % band, (K,) m."""
        return self._circles[1]

    @cached_property
    def mean_rates(self) -> Array:
        """Rate of each run by the least-squares line through the origin, Σ t r / Σ t², (N,) m/s."""
        regular, rates = self.plan.regular, np.empty(len(self))
        for runs in self.errors.groups():
            errors = np.compress(regular, self.horizontal_at(runs=runs), axis=1)
            rates[runs] = mean_rate(self.elapsed[regular], errors)
        return rates

    @cached_property
    def end_rates(self) -> Array:
        """Rate of each run by its end, r(T)/T, (N,) m/s."""
        lasts = np.where(self.failed, 1.0, self.errors.end - self.plan.start)
        return np.asarray(self.final_horizontal / lasts)

    def spread(self, quantity: str) -> Spread:
        """Return mean and σ over the runs of an error by component, at the epochs; failed runs do not count.

        Args:
            quantity: "position_ned", "velocity_ned" or "attitude".

        Returns:
            (K, 3) each: m, m/s or rad, with the standard error of σ.

        Raises:
            InputError: there is no such quantity.
        """
        if quantity not in VECTORS:
            raise InputError(f"quantity = {quantity!r} must be one of {', '.join(VECTORS)}.")
        if quantity not in self._spreads:
            self._spreads[quantity] = self._spread(VECTORS.index(quantity))
        return self._spreads[quantity]

    def _spread(self, number: int) -> Spread:
        values = np.empty((4, len(self.time), 3))
        for axis, name in enumerate(COMPONENTS[3 * number : 3 * number + 3]):
            for epochs in self.errors.spans():
                part = spread(self.errors.column(name, epochs))
                values[:, epochs, axis] = part.mean, part.sigma, part.standard_error, part.runs
        return Spread(*values)

    @cached_property
    def _spreads(self) -> dict[str, Spread]:
        return {}

    def stated(self, quantity: str) -> Array | None:
        """Return the σ that the filter states for an error by component: root mean square over the runs.

        Args:
            quantity: "position_ned", "velocity_ned" or "attitude".

        Returns:
            (K, 3): m, m/s or rad; None without a filter.
        """
        if f"sigma_{COMPONENTS[0]}" not in self.errors.names:
            return None
        number, values = VECTORS.index(quantity), np.empty((len(self.time), 3))
        for axis, name in enumerate(COMPONENTS[3 * number : 3 * number + 3]):
            for epochs in self.errors.spans():
                sigma = self.errors.column(f"sigma_{name}", epochs)
                there = np.isfinite(sigma)
                with np.errstate(invalid="ignore", divide="ignore"):
                    mean = (np.where(there, sigma, 0.0) ** 2).sum(axis=0) / there.sum(axis=0)
                values[epochs, axis] = np.sqrt(mean)
        return values

    def mean_squares_of_runs(self, component: str) -> tuple[Array, Array]:
        """Return the sum of an error's squares over the epochs without those of requirements, and their number.

        Args:
            component: one of `COMPONENTS`.

        Returns:
            Sum and number, (N,) each; an epoch that a run does not reach does not count.
        """
        sums, counts = np.empty((2, len(self)))
        for runs in self.errors.groups():
            course = np.compress(self.plan.regular, self.errors.column(component, runs=runs), axis=1)
            sums[runs], counts[runs] = np.nansum(course * course, axis=1), (~np.isnan(course)).sum(axis=1)
        return sums, counts

    @cached_property
    def nees(self) -> dict[str, MeanSquare]:
        """ANEES by block of the filter's states: NEES averaged over the runs; empty without a filter."""
        squares = _mean_squares(self.errors, "nees")
        scenario, places = self.plan.scenario, ("latitude_deg", "longitude_deg")
        field = scenario.gravity is not None and scenario.gravity.model != "normal"
        if GRAVITY in squares and field and not any(key.endswith(places) for key in self.plan.keys):
            for name in (GRAVITY, ALL):
                squares[name] = _with_common(squares[name], self.errors.column(f"nees_freedom {name}"), _OF_GRAVITY)
        return squares

    @cached_property
    def nis(self) -> dict[str, MeanSquare]:
        """NIS by aiding sensor, averaged over the runs and the measurements since the previous epoch."""
        return _mean_squares(self.errors, "nis")

    @cached_property
    def ranking(self) -> NDArray[np.int64]:
        """Numbers of the runs from the worst to the best: failed ones first, then by the rate Σ t r / Σ t²."""
        rate = np.where(np.isnan(self.mean_rates), -np.inf, self.mean_rates)
        return np.asarray(self.errors.number[np.argsort(-rate, kind="stable")])

    def member(self, number: int) -> Member:
        """Return a run of the ensemble, with its seed, its settings and its scenario.

        Args:
            number: its number, from 0.

        Returns:
            The run.

        Raises:
            InputError: the ensemble has no such run.
        """
        if isinstance(number, bool) or not np.any(self.errors.number == number):
            have = f"{len(self)} runs from {self.errors.number.min()} to {self.errors.number.max()}"
            raise InputError(f"run {number}: the ensemble has {have}, but not this one.")
        return member(self.plan.scenario, int(number))

    def command(self, number: int, program: str = "sinssim", scenario: str | None = None) -> str:
        """Return the command that runs one run of the ensemble in full.

        Args:
            number: its number, from 0.
            program: how sinssim is called.
            scenario: name or file of the scenario; by default the file in the ensemble's directory.

        Returns:
            The command; its errors are those of the ensemble, to rounding.

        Raises:
            InputError: the ensemble has no such run.
        """
        import shlex

        if scenario is None:
            scenario = self.plan.scenario.name if self.directory is None else str(self.directory / "scenario.toml")
        settings = " ".join(f"--set {shlex.quote(setting)}" for setting in self.member(number).settings)
        return f"{program} run {shlex.quote(scenario)} {settings}"

    def to_parquet(self, folder: Path | str) -> tuple[Path, Path]:
        """Write the ensemble as two tables, for any other program.

        Args:
            folder: folder to write to; made if it does not exist.

        Returns:
            `errors.parquet`, a row for each run and epoch, and `runs.parquet`, a row for each run with its seed, its
            varied keys, rates, final errors and failure.

        Raises:
            InputError: they cannot be written.
        """
        return write_tables(self.errors, self.time, self.mean_rates, self.end_rates, Path(folder))


_OF_GRAVITY = 3
"""States of the gravity that the navigator does not know: the field is the same in all runs over one path."""


def _with_common(square: MeanSquare, freedom: Array, common: int) -> MeanSquare:
    """Return a mean square `common` states of which have the same errors in all runs, for degrees of freedom of each
    run (N, K). With n states, m of them common, and N runs, the sum of all squares has the mean nN and the variance 2(n
    − m)N + 2mN², those of χ² with f = (nN)²/((n − m)N + mN²) degrees of freedom times a factor (Satterthwaite)."""
    runs = np.count_nonzero(freedom > 0.0, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        fewer = square.freedom**2 / (square.freedom + common * runs * (runs - 1.0))
    fewer = np.where(square.freedom > 0.0, fewer, 0.0)
    return MeanSquare(square.name, square.value, mean_square_band(fewer), fewer)


def _mean_squares(errors: Errors, kind: str) -> dict[str, MeanSquare]:
    squares = {}
    for name in (text.partition(" ")[2] for text in errors.names if text.startswith(f"{kind} ")):
        parts = []
        for epochs in errors.spans():
            freedoms = errors.column(f"{kind}_freedom {name}", epochs)
            square = np.where(freedoms > 0.0, errors.column(f"{kind} {name}", epochs), np.nan)
            parts.append((np.nansum(freedoms, axis=0), np.nansum(square, axis=0)))
        freedom, total = (np.concatenate(rows) for rows in zip(*parts, strict=True))
        with np.errstate(invalid="ignore", divide="ignore"):
            value = np.where(freedom > 0.0, total / freedom, np.nan)
        squares[name] = MeanSquare(name, value, mean_square_band(freedom), freedom)
    return squares
