"""Filters beside that of [filter], on the same readings: each is a solution of the run."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sinssim.data import NavSolution
from sinssim.progress import silent
from sinssim.scenario.filter_model import with_first
from sinssim.simulation.navigation_stage import aid

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.simulation.truth_and_sensors import Sensed
    from sinssim.simulation.truth_comparison import Aided


@dataclass(frozen=True)
class FilterSolution(NavSolution):
    """The solution of a further filter.

    Attributes:
        aided: it with its estimate and errors.
        kind: kind of the filter.
        seconds: processor time that it took, s.
    """

    aided: Aided | None = None
    kind: str = ""
    seconds: float = 0.0


def further_solutions(scenario: Scenario, sensed: Sensed) -> dict[str, FilterSolution]:
    """Return the solutions of the filters of [[filters]], by name.

    Args:
        scenario: with a filter, whose states are written out.
    """
    solutions = {}
    for of in scenario.filters:
        alone = with_first(scenario, of.name)
        assert alone.filter is not None
        began = time.thread_time()
        aided = aid(alone, sensed, silent, history=False)
        took = time.thread_time() - began
        fields = vars(aided.estimate.solution) | {"algorithm": of.name}
        solutions[of.name] = FilterSolution(**fields, aided=aided, kind=alone.filter.kind, seconds=took)
    return solutions
