"""Computes many inertial runs on one motion together, where the batch of runs serves the scenario; same bits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import NavSolution, NavState
from sinssim.errors import RunError
from sinssim.experiments.ensembles.batch.navigate_batch import BatchSolution, navigate_batch
from sinssim.experiments.ensembles.batch.served import served
from sinssim.experiments.ensembles.run_errors import RunErrors, check_finite, fill_in, rows_at
from sinssim.experiments.ensembles.truth import truth_key
from sinssim.scenario.initial_error import initial_state_with_errors
from sinssim.scenario.sections.ensemble import EnsembleSection
from sinssim.sensors.sets.true_errors import draw_true_errors
from sinssim.simulation.navigation import by_one
from sinssim.strapdown.increments.fit import WINDOW
from sinssim.strapdown.nav_error import navigation_error
from sinssim.strapdown.polar import axes_along

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.members import Member
    from sinssim.experiments.ensembles.plan import Plan
    from sinssim.experiments.ensembles.truth import TruthCache
    from sinssim.simulation.truth import Truth

PAYS = 4e7
"""Samples of all runs from which the batch pays: its kernel compiles once in about ten seconds for each combination of
options, in which single runs pass 4·10⁷ samples."""
_BEGIN = 7000
"""Samples that take as long as what a single run needs once and a batch saves: 1.3 ms."""


def alone_because(plan: Plan, truths: TruthCache) -> str | None:
    """Return why the runs of an ensemble are computed one by one.

    Returns:
        A clause without a full stop, for example "it has a filter"; None if they are computed together.
    """
    if plan.filtered:
        return "it has a filter"
    if plan.keys:
        return "keys vary from run to run"
    if truth_key(plan.scenario) != truth_key(plan.scenario.model_copy(update={"seed": plan.scenario.seed + 1})):
        return "each run has its own motion"
    if (reason := served(by_one(plan.scenario, plan.solution))) is not None:
        return reason
    samples, runs = len(truths.of(plan.scenario).ideal), (plan.scenario.ensemble or EnsembleSection()).runs
    if samples < WINDOW:
        return f"there are fewer than {WINDOW} samples"
    if (samples + _BEGIN) * runs < PAYS:
        return f"{samples * runs:.3g} samples are too few to compensate for compiling the batch"
    return None


def fill_in_together(
    plan: Plan, members: Sequence[Member], truths: TruthCache, errors: RunErrors, on_run: Callable[[int], None] | None
) -> list[int]:
    """Compute runs of a plan that `alone_because` admits together, and fill in the rows of those that can be finished.

    Rows of the others are returned: runs that leave the range of the batch, and those that fail.
    """
    truth = truths.of(plan.scenario)
    epochs, rows = rows_at(plan.epochs, truth.time)
    edges, where = np.unique(rows, return_inverse=True)
    solution = _navigate(plan, members, truth, edges)
    there = replace(truth.state, **{name: value[rows] for name, value in vars(truth.state).items()})
    axes = axes_along(plan.scenario.navigation.frame, truth.trajectory.state, truth.trajectory.start, truth.time[-1])
    left = []
    for row in range(len(members)):
        if row in solution.alone:
            left.append(row)
            continue
        own = solution.state(row)
        kept = NavSolution(
            truth.time[rows], own.latitude[where], own.longitude[where], own.height[where], own.velocity_ned[where],
            own.q_nb[where], np.zeros(len(rows)), plan.solution,
        )  # fmt: skip
        error = navigation_error(there, kept, truth.trajectory.ellipsoid, axes)
        try:
            check_finite(error)
        except RunError:
            left.append(row)
            continue
        errors.end[row] = truth.time[-1]
        fill_in(errors, row, error, epochs)
        if on_run is not None:
            on_run(1)
    return left


def _navigate(plan: Plan, members: Sequence[Member], truth: Truth, edges: NDArray[np.intp]) -> BatchSolution:
    """Return the solutions of runs at some edges of the samples."""
    scenario, trajectory = plan.scenario, truth.trajectory
    navigation = scenario.navigation
    axes = axes_along(navigation.frame, trajectory.state, trajectory.start, trajectory.end)
    start: NavState = trajectory.state(truth.time[0])
    initial = [
        initial_state_with_errors(start, navigation.initial_error, trajectory.ellipsoid, one.seed, axes)
        for one in members
    ]
    return navigate_batch(
        truth.ideal,
        initial,
        [draw_true_errors(scenario.imu, one.seed).imu for one in members],
        [one.seed for one in members],
        edges,
        navigation.mechanization(plan.solution, trajectory.ellipsoid.name),
        height=None if navigation.vertical == "free" else truth.state.height,
    )
