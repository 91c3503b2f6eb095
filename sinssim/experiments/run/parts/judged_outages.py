"""Injected outages of satellites: those of a run on recorded sensors, or of further passes of its filter."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NotRequired, TypedDict

import numpy as np

from sinssim.charts import PAIR, Axis, Chart, Charts, Dots, Line, over
from sinssim.data import Array
from sinssim.exhibits import Beside, Column, Item, Sentence, Table
from sinssim.experiments.run.run_result import Part
from sinssim.experiments.run.summary_types import ErrorNumbers
from sinssim.simulation.navigation_stage import Navigated, recorded_start
from sinssim.simulation.truth_and_sensors import RecordedMotion
from sinssim.units import fixed, number_text, signed

if TYPE_CHECKING:
    from sinssim.simulation.recorded_filter_run import OutageErrors


_LISTED = 15
"""Number of outages up to which each has a row on the console; the report has the rows of all."""
_SMOOTHED = "smoothed_max_horizontal_error_m"
_ALONE = "straight_line_horizontal_error_m"
_COLUMNS = {
    "horizontal_error_m": ("horizontal", "m"), "horizontal_sigma_m": ("1σ of the filter", "m"),
    "height_error_m": ("height", "m"), "velocity_error_mps": ("velocity", "m/s"),
    _ALONE: ("by the fixes alone", "m"),
    _SMOOTHED: ("smoothed, largest", "m"),
}  # fmt: skip
"""Heads and units of the table by key."""


class OutageNumbers(TypedDict):
    """The errors of outages: of each, and median and 90 % of their magnitudes; those alone if none has errors."""

    against: NotRequired[str]
    each: list[OutageErrors]
    median: NotRequired[dict[str, float]]
    p90: NotRequired[dict[str, float]]
    error_over_sigma: NotRequired[float]


@dataclass(frozen=True)
class JudgedOutages:
    """The errors of injected outages."""

    numbers: OutageNumbers  # the entry `outages` of the summary
    # for each outage the time since its beginning, (K,) s, and the horizontal error, (K,) m
    growth: tuple[tuple[Array, Array], ...]


@dataclass(frozen=True)
class Outages(Part[OutageNumbers]):
    """The injected outages of a run on recorded sensors with a filter."""

    name, title, place = "outages", "Outages", "filter"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether outages are injected, and a filter bridges them."""
        if not isinstance(run.truth, RecordedMotion) or run.scenario.filter is None:
            return False
        log = run.truth.prepared.log
        return bool(log.outages or any(log.passes))

    @cached_property
    def judged(self) -> JudgedOutages:
        """Errors at the end of each outage, against the reference or else the withheld fixes.

        They are those of the run's own outages, or of each further pass, which is computed here.
        """
        from sinssim.simulation import recorded_filter_run as filtered  # which needs filterpy

        motion, aided = self.run.truth, self.aided
        assert isinstance(motion, RecordedMotion)
        assert aided is not None
        prepared, log = motion.prepared, motion.prepared.log
        reference = filtered.outage_reference(prepared)
        if reference is None:
            return JudgedOutages({"each": []}, ())
        outages, growth = [], []
        for number, spans in enumerate(log.passes or (log.outages,), start=1):
            estimate = aided.estimate
            if log.passes:
                start = recorded_start(prepared.scenario, self.run.sensed)
                estimate = filtered.outage_pass(self.run.sensed.imu, prepared, start, spans)
            error = reference.error_of(estimate.solution)
            smoothed = None if estimate.smoothed is None else reference.error_of(estimate.smoothed.solution)
            of_pass = filtered.outage_errors(estimate, error, smoothed, spans)
            for outage in of_pass:
                if log.reference is None and log.fixes is not None:
                    outage[_ALONE] = filtered.straight_line_error(log.fixes, outage["from_s"], outage["at_s"])
                if log.passes:
                    outage["pass"] = number
                rows = (error.time >= outage["from_s"]) & (error.time <= outage["to_s"] + 1e-9)
                rows &= np.isfinite(error.horizontal)
                growth.append((error.time[rows] - outage["from_s"], error.horizontal[rows]))
            outages += of_pass
        return JudgedOutages({"against": reference.name, **outage_numbers(outages)}, tuple(growth))

    def with_filter(self) -> OutageNumbers:
        """Return the errors of the outages, for `summary.json`."""
        return self.judged.numbers

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the errors at the end of each outage, and all of them in a sentence."""
        if self.entry["each"]:
            title = f"{len(self.entry['each'])} outages: errors at the end, against {self.entry['against']}"
            table = self._table(self.entry["each"] if len(self.entry["each"]) <= _LISTED else ())
            yield replace(table, title=title, note="", on=("console",))
        yield from map(Sentence, sentences(self.entry))

    def exhibits(self) -> Iterator[Item]:
        """Yield the errors within each outage, and at their ends."""
        yield from (Sentence(sentence, "strong") for sentence in sentences(self.entry))
        each = self.entry["each"]
        if each:
            rows = sorted(each, key=lambda outage: float(outage["from_s"]))
            yield Beside([Charts("outages", tuple((chart,) for chart in self._charts(each)),
                                 (0.5 * PAIR[0], 2.0 * PAIR[1]), on=("page",)), self._table(rows)])  # fmt: skip

    def _charts(self, each: Sequence[OutageErrors]) -> Iterator[Chart]:
        """Yield the horizontal error since the beginning of each outage, and at the end of each over the run."""
        y, span = Axis(units=fixed("m"), low=0.0), (float(self.run.time[0]), float(self.run.time[-1]))
        drawn = [(time, error) for time, error in self.judged.growth if len(time) > 1]
        if drawn:
            longest = max(outage["to_s"] - outage["from_s"] for outage in each)
            lines = tuple(
                Line(label="" if number else "one line an outage", x=time, y=error, color="aided", weight="hair")
                for number, (time, error) in enumerate(drawn)
            )
            title = "Horizontal error since the last fix"
            yield Chart(key="outages/growth", title=title, x=over((0.0, longest)), y=y, marks=lines)
        at, end, sigma = (np.array([outage[key] for outage in each], dtype=np.float64)
                          for key in ("at_s", "horizontal_error_m", "horizontal_sigma_m"))  # fmt: skip
        dots = (
            Dots(label="at the end", x=at, y=end, color="aided", size=4.5),
            Dots(label="1σ of the filter", x=at, y=sigma, color="bound", size=3.75),
        )
        yield Chart(
            key="outages/ends", title="Horizontal error at the end of each outage", x=over(span), y=y, marks=dots
        )

    def _table(self, each: Sequence[OutageErrors]) -> Table:
        """Return the errors at the end of some outages, median and 90 % of all."""
        keys = [key for key in _COLUMNS if key in self.entry["median"]]
        rows = [
            (
                f"{outage['from_s']:g} … {outage['to_s']:g}",
                *("–" if outage[k] is None else signed(outage[k]) for k in keys),
            )
            for outage in each
        ]
        for word, errors in (("**median**", self.entry["median"]), ("**90 %**", self.entry["p90"])):
            rows.append((word, *("–" if errors[k] is None else number_text(errors[k]) for k in keys)))
        return Table(
            (Column("from … to", fixed("s"), words=True),
             *(Column(head, fixed(unit)) for head, unit in map(_COLUMNS.__getitem__, keys))), rows,
            note=f"Errors at the last time of each outage at which {self.entry['against']} is known; median and 90 % "
            "of magnitudes. Smoothed: the largest horizontal error within the outage.",
        )  # fmt: skip


def outage_numbers(outages: Sequence[OutageErrors]) -> OutageNumbers:
    """Return the errors of outages together.

    `error_over_sigma` is the root mean square of the horizontal error over the filter's own 1σ, 1 on average for a
    filter that is right.
    """
    ratio = [outage["horizontal_error_m"] / outage["horizontal_sigma_m"] for outage in outages]
    return {
        "each": list(outages),
        "median": _share(outages, 50.0),
        "p90": _share(outages, 90.0),
        "error_over_sigma": float(np.sqrt(np.mean(np.square(ratio)))) if ratio else math.nan,
    }


def _share(outages: Sequence[OutageErrors], percent: float) -> dict[str, float]:
    """Return a percentile over the outages of the magnitude of each error."""
    keys = [key for key in (outages[0] if outages else ()) if key.endswith(("_m", "_mps"))]
    values = {key: np.abs([outage[key] for outage in outages]) for key in keys}
    known = {key: row[np.isfinite(row)] for key, row in values.items()}
    return {key: float(np.percentile(row, percent)) if len(row) else math.nan for key, row in known.items()}


def sentences(numbers: OutageNumbers) -> Iterator[str]:
    """Yield the result of the outages in a sentence."""
    from sinssim.simulation.recorded_filter_run import STRAIGHT_S

    each = numbers["each"]
    if not each:
        yield "No outage could be evaluated: the reference is not known in any of them."
        return
    median, high = numbers["median"], numbers["p90"]
    lengths = {round(outage["to_s"] - outage["from_s"], 3) for outage in each}
    of = f" of {lengths.pop():g} s" if len(lengths) == 1 else ""
    passes = len({outage.get("pass", 1) for outage in each})
    of += f" in {passes} passes" if passes > 1 else ""
    text = (
        f"{len(each)} outage{'s' * (len(each) != 1)}{of}: horizontal error at the end "
        f"{number_text(median['horizontal_error_m'])} m (median), {number_text(high['horizontal_error_m'])} m (90 %)"
    )
    key = "smoothed_max_horizontal_error_m"
    if median.get(key) is not None:  # a filter that diverged is not smoothed
        text += f"; smoothed, at most {number_text(median[key])} m and {number_text(high[key])} m within the outage"
    if len(each) > 1:
        text += f". The errors at the end are {number_text(numbers['error_over_sigma'])} of their 1σ (rms)"
    yield f"{text}."
    alone = median.get(_ALONE)
    if alone is not None and math.isfinite(alone):
        worse = "worse" if median["horizontal_error_m"] > alone else "better"
        yield (
            f"In outages the navigation is {worse} than the fixes alone: a straight line through the fixes of the last "
            f"{STRAIGHT_S:g} s is {number_text(alone)} m off at the end (median)."
        )
