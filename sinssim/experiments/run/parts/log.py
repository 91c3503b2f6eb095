"""Recorded sensors, [log]: what their solutions are compared with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sinssim.exhibits import Item, Sentence
from sinssim.experiments.run.part import Part
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.truth import RecordedMotion

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.simulation.aided.truth_comparison import Aided


@dataclass(frozen=True)
class Log(Part):
    """The recording of a run on recorded sensors."""

    name = "log"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the sensors are recorded."""
        return isinstance(run.truth, RecordedMotion)

    def numbers(self) -> Mapping[str, Any]:
        """Return what is known of the recording, for `summary.json`."""
        motion = self.run.truth
        assert isinstance(motion, RecordedMotion)
        log, reference = motion.prepared.log, motion.reference
        return {
            "reference_file": None if log.reference is None else log.reference.name,
            "compared_with": None if reference is None else reference.name,
            "knows": [] if reference is None else list(reference.knows),
            "notes": [*log.notes, motion.prepared.start.words],
            "time_0_gps_s": None if log.zero is None else round(log.zero.seconds + log.zero.fraction, 6),
        }

    def brief(self, algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[Item]:
        """Yield remarks on the recording, and what the solutions are compared with."""
        yield from map(Sentence, self.entry["notes"])
        yield Sentence(compared_words(self.entry))


def best_solution(run: Navigated, aided: Aided | None) -> tuple[str, NavSolution]:
    """Return the best solution of a run on recorded sensors, which stands for the motion in pictures.

    Args:
        aided: its aided solution, if there is a filter.

    Returns:
        Its name, and the smoothed solution, else the aided one, else that of the first algorithm.
    """
    if aided is not None and len(aided.estimate.time) > 1:
        smoothed = aided.estimate.smoothed
        if smoothed is not None and aided.estimate.divergence is None:
            return "smoothed", smoothed.solution
        return "aided", aided.estimate.solution
    return next(iter(run.solutions.items()))


def compared_words(about: Mapping[str, Any]) -> str:
    """Return a sentence on what the solutions are compared with.

    Args:
        about: the entry `log` of the summary.
    """
    against, knows = about["compared_with"], about["knows"]
    if about["reference_file"] is not None:
        missing = [what for what in ("velocity", "attitude") if what not in knows]
        without = f"; it has no {' and no '.join(missing)}" if missing else ""
        return f"Errors are differences from the reference {against}{without}."
    if against is None:
        return "There is no reference and only one solution, so the errors are unknown."
    return f"There is no reference: differences from {against} are shown, which is not the truth."
