"""What only some runs have: a part is one class in one file, and `parts.PARTS` lists them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Line, Mark, Weight, over
from sinssim.recording.store.summary import plain
from sinssim.scales import ANGLES, LENGTHS

if TYPE_CHECKING:
    from sinssim.exhibits import Item
    from sinssim.recording.streams import Stream
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.navigation import Navigated
    from sinssim.strapdown.nav_error import NavError
    from sinssim.truth.channel import FlightEvent


@dataclass(frozen=True)
class Part:
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
        entry: its entry in `summary.json`, once it is computed; None for none.
    """

    name: ClassVar[str]
    title: ClassVar[str] = ""
    place: ClassVar[Literal["motion", "sensors", "errors", "filter"]] = "errors"
    compares: ClassVar[int] = 0
    takes_long: ClassVar[bool] = False
    run: Navigated
    aided: Aided | None = None
    entry: Any = field(default=None, compare=False, repr=False)

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether a run has this part."""
        raise NotImplementedError

    def numbers(self) -> Any:
        """Return the entry in `summary.json`; None for no entry."""
        return None

    def explain(self, numbers: Any) -> Self:
        """Add to the entry what takes long and only a report shows."""
        return self

    def with_filter(self, numbers: Any) -> Any:
        """Return the entry of a run whose filter has run."""
        return numbers

    def enter(self, numbers: Any) -> None:
        """Keep the entry, with None in place of unknown numbers."""
        vars(self)["entry"] = plain(numbers)

    def on(self, run: Navigated, aided: Aided | None) -> Self:
        """Return the part of the same run after a further stage."""
        return replace(self, run=run, aided=aided)

    def brief(self, algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[Item]:
        """Yield what the console shows, and the sentences that a report begins with.

        Args:
            algorithms: errors of the algorithms with a solution, as in `summary.json`.
        """
        yield from ()

    def exhibits(self) -> Iterator[Item]:
        """Yield the part's section in the report, whose charts over time are in the recording, too."""
        yield from ()

    def streams(self) -> Iterator[Stream]:
        """Yield the tables over time that the run directory keeps of it."""
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
    """Return the horizontal and the attitude errors of solutions beside each other.

    Args:
        errors: by name, with colour and weight of their lines.
        span: first and last instant of the run, s.
        of: the algorithm that they have in common, for the titles.
    """
    charts = [
        Chart(
            key=f"{key}/{name}", title=f"{title} of {of}" if of else title, x=over(span), y=Axis(units=units, low=0.0),
            marks=(*(Line(label=label, x=e.time, y=getattr(e, what), color=color, weight=weight)
                     for label, (e, color, weight) in errors.items()), *marks),
        )
        for name, title, what, units in (
            ("horizontal", "Horizontal error", "horizontal", LENGTHS), ("attitude", "Attitude error", "angle", ANGLES),
        )
    ]  # fmt: skip
    return Charts(f"{key}_errors", (tuple(charts),), PAIR)
