"""The result of a run: `Run`, and `PlaneRun` of a motion in a vertical plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.errors import InputError
from sinssim.recording.result import Result
from sinssim.recording.stream_tables import Streams
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.sensed import Sensed
from sinssim.system.short_repr import html_table

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.experiments.run.part import Part
    from sinssim.scenario import Scenario
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.one_component import OneComponentResult
    from sinssim.simulation.truth import RecordedMotion, Truth
    from sinssim.strapdown.nav_error import NavError

_AIDED = ("aided", "backward", "smoothed")
_SHOWN = ("horizontal_error_m", "velocity_error_mps", "attitude_error_arcsec")


@dataclass(frozen=True)
class Reached:
    """The stages that a run has reached.

    Attributes:
        scenario: the scenario; the states of its filter are written out.
        about_filter: lines that explain the filter's default states.
        last: the last complete stage before the filter, which has those before it.
        aided: the aided solution, once the filter has run.
        parts: what only some runs have, by name, once the run has navigated.
    """

    scenario: Scenario
    about_filter: Sequence[str] = ()
    last: Truth | RecordedMotion | Sensed | Navigated | None = None
    aided: Aided | None = None
    parts: Mapping[str, Part] = field(default_factory=dict)

    @property
    def navigated(self) -> Navigated | None:
        """The inertial solutions."""
        return self.last if isinstance(self.last, Navigated) else None

    @property
    def sensed(self) -> Sensed | None:
        """What the sensors read."""
        if isinstance(self.last, Navigated):
            return self.last.sensed
        return self.last if isinstance(self.last, Sensed) else None

    @property
    def truth(self) -> Truth | RecordedMotion | None:
        """The true motion, or what is known of a recorded one."""
        return self.last.truth if isinstance(self.last, Navigated | Sensed) else self.last


@dataclass(frozen=True, eq=False, repr=False)
class Run(Result):
    """The result of a run.

    What is large is computed again when it is wanted, with the same bits, if a filter needed the memory.

    Attributes:
        scenario: the scenario; the states of its filter are written out.
        navigated: the inertial solutions with their errors.
        aided: the aided solution with its errors, of a scenario with a filter.
        parts: what only some runs have, by name: "platform", "rotation", "phases" and so on.
        summary: contents of `summary.json`.
        directory: the run directory, None if nothing was recorded.
        about_filter: lines that explain the filter's default states.
    """

    scenario: Scenario
    navigated: Navigated
    aided: Aided | None
    parts: Mapping[str, Part]
    summary: dict[str, Any] = field(default_factory=dict)
    directory: Path | None = None
    about_filter: Sequence[str] = ()

    @property
    def truth(self) -> Truth | RecordedMotion:
        """The true motion, or what is known of a recorded one."""
        return self.navigated.truth

    @property
    def sensed(self) -> Sensed:
        """What the sensors read."""
        return self.navigated.sensed

    @property
    def solutions(self) -> dict[str, NavSolution]:
        """Inertial solutions by algorithm, for those that have one."""
        return self.navigated.solutions

    @property
    def errors(self) -> dict[str, NavError]:
        """Errors of the inertial solutions by algorithm."""
        return self.navigated.errors

    def __repr__(self) -> str:
        return _in_words(self.scenario.name, self.summary, with_filter=self.aided is not None)

    def _repr_html_(self) -> str:
        of_filter = self.summary.get("filter") or {}
        solutions = {**self.summary.get("algorithms", {}), **{k: of_filter[k] for k in _AIDED if k in of_filter}}
        rows = [
            (name, *(f"{one.get(f'{kind}_{what}', float('nan')):.4g}" for what in _SHOWN for kind in ("final", "max")))
            for name, one in solutions.items()
            if isinstance(one.get(f"final_{_SHOWN[0]}"), float)
        ]
        heads = ("solution", "horizontal error at the end, m", "largest", "velocity error at the end, m/s", "largest",
                 "attitude error at the end, arcsec", "largest")  # fmt: skip
        return html_table(repr(self), rows, heads if rows else ())


@dataclass(frozen=True, eq=False, repr=False)
class PlaneRun(Result):
    """The result of a run in a vertical plane, of a scenario with [one_component].

    Attributes:
        scenario: the scenario.
        one_component: motion, solution and errors.
        summary: contents of `summary.json`.
        directory: the run directory, None if nothing was recorded.
    """

    scenario: Scenario
    one_component: OneComponentResult
    summary: dict[str, Any] = field(default_factory=dict)
    directory: Path | None = None

    @property
    def streams(self) -> Streams:
        """Its streams are in its run directory alone.

        Raises:
            InputError: always.
        """
        raise InputError(
            "a run with [one_component] has its streams in its run directory alone: run it with one, and read "
            "streams/*.parquet."
        )

    def plot(self, quantity: str | None = None) -> Any:
        """Its errors are drawn in its report and its recording alone.

        Args:
            quantity: without effect.

        Returns:
            Nothing: it always raises.

        Raises:
            InputError: always.
        """
        raise InputError(
            f"the run {self.scenario.name} has no solution in three dimensions with errors to draw; its report and its "
            "recording show what it has."
        )

    def __repr__(self) -> str:
        return _in_words(self.scenario.name, self.summary, with_filter=False)


RunResult = Run | PlaneRun
"""What `run` returns."""


def _in_words(name: str, summary: Mapping[str, Any], *, with_filter: bool) -> str:
    parts = [str(summary["status"]), f"{summary['start_s']:g} … {summary['end_s']:g} s"]
    parts += [", ".join(summary["algorithms"])] if summary.get("algorithms") else []
    parts += ["with a filter"] if with_filter else []
    return f"Run({name}: {'; '.join(parts)})"
