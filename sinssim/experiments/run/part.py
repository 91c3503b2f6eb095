"""What only some runs have: a part is one class in one file, and `parts.PARTS` lists them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

if TYPE_CHECKING:
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.navigation import Navigated


@dataclass(frozen=True)
class Part:
    """A part of some runs, computed from their stages.

    What is large is a `functools.cached_property`: it is computed when it is first wanted, and a copy by
    `dataclasses.replace` does not hold it.

    Attributes:
        name: key of its entry in `summary.json`, and of the part in `Run.parts`.
        takes_long: whether `explain` does something.
        run: the run that has it, with its inertial solutions.
        aided: the aided solution; None without a filter, and before it has run.
    """

    name: ClassVar[str]
    takes_long: ClassVar[bool] = False
    run: Navigated
    aided: Aided | None = None

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether a run has this part."""
        raise NotImplementedError

    def numbers(self) -> Any:
        """Return the entry in `summary.json`; None for no entry."""
        return None

    def explain(self, numbers: Any) -> Self:
        """Add to the entry what takes long and only a report shows.

        Args:
            numbers: the entry, which may be changed.

        Returns:
            The part with what it has learnt.
        """
        return self

    def with_filter(self, numbers: Any) -> Any:
        """Return the entry of a run whose filter has run.

        Args:
            numbers: the entry without it.
        """
        return numbers

    def on(self, run: Navigated, aided: Aided | None) -> Self:
        """Return the part of the same run after a further stage.

        Args:
            run: the run.
            aided: the aided solution.
        """
        return replace(self, run=run, aided=aided)
