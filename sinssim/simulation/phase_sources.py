"""Sources of the errors that each phase of a mission adds: the covariance budget of the run's solutions, by phase."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.data import ImuData, NavState
from sinssim.errors import SinssimError
from sinssim.recording.store.summaries.phase_summary import Phase

if TYPE_CHECKING:
    from sinssim.error_budget.result import BudgetResult
    from sinssim.simulation.result import Run
    from sinssim.truth.trajectory import Trajectory

_QUANTITIES = {
    "horizontal": ((0, 1), "horizontal_sigma_m", 1.0),
    "heading": ((8,), "heading_sigma_arcmin", units.ARCMIN),
    "tilt": ((6, 7), "tilt_sigma_arcsec", units.ARCSEC),
}
"""Components of the navigation errors, key and unit of the root mean square over all runs."""

_SMALLEST = 0.01
"""Smaller shares are not listed."""


@dataclass(frozen=True)
class _Truth:
    """The true motion of a run, as a budget takes it."""

    trajectory: Trajectory
    block: Trajectory
    ideal: ImuData
    state: NavState


def budgets_of_phases(run: Run, phases: Sequence[Phase]) -> dict[str, BudgetResult | str]:
    """Return the budgets of the inertial solutions and, with a filter, of the aided one.

    Args:
        run: with its true motion.
        phases: of the motion.

    Returns:
        By "inertial" and "filter": the budget, or why there is none.
    """
    kinds = ("inertial",) if run.scenario.filter is None else ("inertial", "filter")
    return {kind: phase_budget(run, phases, kind) for kind in kinds}


def phase_budget(run: Run, phases: Sequence[Phase], solution: str) -> BudgetResult | str:
    """Return the budget of a run's solutions with the ends of the phases marked, or why there is none.

    Args:
        run: with its true motion.
        phases: of the motion.
        solution: "inertial" or "filter".

    Returns:
        The budget, or the reason in words.
    """
    from sinssim.error_budget.analyse import budget

    start, end = float(run.time[0]), float(run.time[-1])
    truth = _Truth(run.trajectory, run.block, run.ideal, run.truth)
    try:
        return budget(
            run.scenario, solution=solution, truth=truth, marks=[min(phase.end, end) - start for phase in phases]
        )
    except SinssimError as error:
        return str(error)


def add_sources(rows: Sequence[dict[str, Any]], found: BudgetResult | str, start: float) -> None:
    """Add the sources to the phases of a solution.

    Args:
        rows: phases of a solution, from `phase_numbers`; changed: each gets `sources`, the root mean square over all
            runs of what the phase added to the horizontal position, the heading and the tilt, and the shares of the
            sources in its square; or `no_sources`, the reason.
        found: result of `phase_budget`.
        start: beginning of the run, s.
    """
    for row in rows:
        if isinstance(found, str) or found.added is None:
            row["no_sources"] = found if isinstance(found, str) else "no phase ends after the navigation begins."
            continue
        shares = found.first() if row["phase"] == "alignment" else found.added
        ends = shares.end + start
        near = int(np.argmin(np.abs(ends - row["to_s"])))
        row["sources"] = {}
        for name, (components, key, unit) in _QUANTITIES.items():
            square, of = shares.shares(near, components)
            row["sources"][name] = {
                key: square / unit,
                "shares": {source: share for source, share in of if share >= _SMALLEST},
            }
