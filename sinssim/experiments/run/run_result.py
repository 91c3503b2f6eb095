"""The result of a run: `Run`, `PlaneRun` of a motion in a vertical plane, and `Part`, what only some runs have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Self, TypeVar

from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Line, Mark, Weight, over
from sinssim.data import Array, NavSolution, html_table
from sinssim.exhibits import Item
from sinssim.recording.result import Media, Result, plain
from sinssim.recording.streams import Stream
from sinssim.scenario import Scenario
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import RecordedMotion, Sensed, Truth
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.sampling import FlightEvent
from sinssim.units import ANGLE_SCALE, LENGTH_SCALE

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import ErrorNumbers
    from sinssim.simulation.one_component_run import OneComponentResult
    from sinssim.simulation.truth_comparison import Aided


_AIDED = ("aided", "backward", "smoothed")
_SHOWN = ("horizontal_error_m", "velocity_error_mps", "attitude_error_arcsec")


@dataclass(frozen=True)
class Reached:
    """The stages that a run has reached."""

    scenario: Scenario  # the scenario; the states of its filter are written out
    about_filter: Sequence[str] = ()  # lines that explain the filter's default states
    # the last complete stage before the filter, which has those before it
    last: Truth | RecordedMotion | Sensed | Navigated | None = None
    aided: Aided | None = None  # the aided solution, once the filter has run
    # what only some runs have, by name, once the run has navigated
    parts: Mapping[str, Part[object]] = field(default_factory=dict)

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
        media: what draws and writes it.
    """

    scenario: Scenario
    navigated: Navigated
    aided: Aided | None
    parts: Mapping[str, Part[object]]
    summary: dict[str, Any] = field(default_factory=dict)
    directory: Path | None = None
    about_filter: Sequence[str] = ()
    media: Media[Run] = field(kw_only=True, repr=False, compare=False)

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
            (name, *(f"{row.get(f'{kind}_{what}', float('nan')):.4g}" for what in _SHOWN for kind in ("final", "max")))
            for name, row in solutions.items()
            if isinstance(row.get(f"final_{_SHOWN[0]}"), float)
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
        media: what draws and writes it.
    """

    scenario: Scenario
    one_component: OneComponentResult
    summary: dict[str, Any] = field(default_factory=dict)
    directory: Path | None = None
    media: Media[PlaneRun] = field(kw_only=True, repr=False, compare=False)

    def __repr__(self) -> str:
        return _in_words(self.scenario.name, self.summary, with_filter=False)


def _in_words(name: str, summary: Mapping[str, Any], *, with_filter: bool) -> str:
    parts = [str(summary["status"]), f"{summary['start_s']:g} … {summary['end_s']:g} s"]
    parts += [", ".join(summary["algorithms"])] if summary.get("algorithms") else []
    parts += ["with a filter"] if with_filter else []
    return f"Run({name}: {'; '.join(parts)})"


@dataclass(frozen=True)
class DrawnPath:
    """A line on the map and in the 3D scene of a recording, or points with words."""

    name: str  # of its entity
    # latitude, longitude: (K,) rad; NaN for a gap
    latitude: Array
    longitude: Array
    height: Array  # (K,) m
    color: str  # its colour
    words: tuple[str, ...] = ()  # at each of the points; none for a line

    @property
    def named(self) -> list[tuple[str, float, float]]:
        """The points as a map takes them."""
        return list(zip(self.words, self.latitude.tolist(), self.longitude.tolist(), strict=True))


N = TypeVar("N", covariant=True)
"""The entry of a part in `summary.json`."""


@dataclass(frozen=True)
class Part(Generic[N]):
    """A part of some runs, computed from their stages, and what it has to show.

    What is large is a `functools.cached_property`: it is computed when it is first wanted, and a copy by
    `dataclasses.replace` does not hold it.

    Attributes:
        name: key of its entry in `summary.json`, and of the part in `Run.parts`.
        title: heading of its section in the report; "" for none.
        place: what the section follows: the plots of the true motion, those of the sensors' errors, those of the
            errors of navigation, or the aided solution.
        compares: number of algorithms whose errors its sentences have.
        takes_long: whether `explain` does something.
        run: the run that has it, with its inertial solutions.
        aided: the aided solution; None without a filter, and before it has run.
        entry: its entry in `summary.json`, once it is computed.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    place: ClassVar[Literal["motion", "sensors", "errors", "filter"]] = "errors"
    compares: ClassVar[int] = 0
    takes_long: ClassVar[bool] = False
    run: Navigated
    aided: Aided | None = None
    entry: N = field(default=None, compare=False, repr=False)  # type: ignore[assignment]

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether a run has this part."""
        raise NotImplementedError

    def numbers(self) -> N:
        """Return the entry in `summary.json`; None for a part whose entry follows from the filter."""
        return self.entry

    def explain(self) -> Self:
        """Add to the entry what takes long and only a report shows."""
        return self

    def with_filter(self) -> N:
        """Return the entry of a run whose filter has run."""
        return self.entry

    def enter(self, numbers: object) -> None:
        """Keep the entry, with None in place of unknown numbers."""
        vars(self)["entry"] = plain(numbers)

    @property
    def after_filter(self) -> bool:
        """Whether its streams and charts need the aided solution."""
        return False

    def on(self, run: Navigated, aided: Aided | None) -> Self:
        """Return the part of the same run after a further stage."""
        return replace(self, run=run, aided=aided)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield what the console shows, and the first sentences of a report, given the errors of the algorithms."""
        yield from ()

    def exhibits(self) -> Iterator[Item]:
        """Yield the part's section in the report, whose charts over time are in the recording, too."""
        yield from ()

    def streams(self) -> Iterator[Stream]:
        """Yield the tables over time that the run directory keeps of it."""
        yield from ()

    def paths(self) -> Iterator[DrawnPath]:
        """Yield what the recording's map and 3D scene show of it."""
        yield from ()

    def events(self) -> Iterator[FlightEvent]:
        """Yield events of the sensors."""
        yield from ()


def side_by_side(
    key: str,
    errors: Mapping[str, tuple[NavError, Color, Weight]],
    span: tuple[float, float],
    marks: tuple[Mark, ...] = (),
    of: str = "",
) -> Charts:
    """Return the horizontal and the attitude errors of solutions, by name with colour and weight, over a span, s."""
    charts = [
        Chart(
            key=f"{key}/{name}", title=f"{title} of {of}" if of else title, x=over(span), y=Axis(units=units, low=0.0),
            marks=(*(Line(label=label, x=e.time, y=getattr(e, what), color=color, weight=weight)
                     for label, (e, color, weight) in errors.items()), *marks),
        )
        for name, title, what, units in (
            ("horizontal", "Horizontal error", "horizontal", LENGTH_SCALE),
            ("attitude", "Attitude error", "angle", ANGLE_SCALE),
        )
    ]  # fmt: skip
    return Charts(f"{key}_errors", (tuple(charts),), PAIR)
