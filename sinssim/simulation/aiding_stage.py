"""The fourth stage of a run: the solution of its filter, and its errors."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.progress import Progress, silent
from sinssim.scenario.navigation_section import initial_state_with_errors
from sinssim.simulation.truth_stage import RecordedMotion, Truth

if TYPE_CHECKING:
    from sinssim.data import NavSolution, NavState
    from sinssim.estimation.filter_start import Start
    from sinssim.logs.reference_solution import Reference
    from sinssim.scenario import Scenario
    from sinssim.simulation.sensed_stage import Sensed
    from sinssim.simulation.truth_comparison import Aided


def aid(scenario: Scenario, sensed: Sensed, progress: Progress = silent) -> Aided:
    """Run the filter of a scenario from the initial state of its inertial solutions.

    Args:
        scenario: with a filter, whose states are written out.
        progress: called with what a diagnosis tries and the fraction done.

    Returns:
        The aided solution with its errors, or its differences from the reference of recorded sensors.
    """
    if isinstance(sensed.truth, RecordedMotion):
        return _aid_recorded(scenario, sensed, sensed.truth, progress)
    from sinssim.simulation.aided_run import aid_run

    assert sensed.errors is not None  # those of simulated sensors are known
    return aid_run(
        scenario,
        sensed.truth.trajectory,
        sensed.imu,
        first_state(scenario, sensed.truth),
        sensed.errors,
        monitored=sensed.readings.monitored,
        progress=progress,
    )


def first_state(scenario: Scenario, truth: Truth | RecordedMotion) -> NavState:
    """Return the state that the filter of a run starts from, with the initial errors of the scenario."""
    axes = truth.axes(scenario.navigation.frame) if isinstance(truth, Truth) else "north"
    error = scenario.navigation.initial_error
    return initial_state_with_errors(truth.first, error, truth.ellipsoid, scenario.seed, axes)


def recorded_start(scenario: Scenario, sensed: Sensed) -> Start:
    """Return the start of the filter on recorded sensors."""
    from sinssim.estimation.filter_start import Start

    return Start(sensed.imu, first_state(scenario, sensed.truth), None)


def _aid_recorded(scenario: Scenario, sensed: Sensed, motion: RecordedMotion, progress: Progress) -> Aided:
    """Run the filter; without a reference it is compared with its own smoothed solution, which has no error then."""
    from sinssim.simulation.recorded_filter_run import aid_recorded, all_readings, as_reference, compare_recorded
    from sinssim.strapdown.navigation_error import NavError

    estimate = aid_recorded(motion.prepared, sensed.imu, recorded_start(scenario, sensed), progress=progress)
    reference = motion.reference
    if reference is None and estimate.smoothed is not None:
        reference = as_reference("the smoothed solution", estimate.smoothed.solution)
    aided = compare_recorded(estimate, all_readings(motion.prepared), reference, float(motion.time[-1]))
    if motion.reference is None and (smoothed_error := aided.smoothed_error) is not None:
        # it would be zero, up to rounding
        unknown = [
            np.full_like(error, np.nan)
            for error in (smoothed_error.position_ned, smoothed_error.velocity_ned, smoothed_error.attitude)
        ]
        aided = replace(aided, smoothed_error=NavError(smoothed_error.time, *unknown))
    return aided


def best_reference(motion: RecordedMotion, aided: Aided | None, solutions: dict[str, NavSolution]) -> Reference | None:
    """Return what the inertial solutions of recorded sensors are compared with: the best that is known.

    Args:
        aided: the aided solution, if there is a filter.

    Returns:
        The recorded reference, or else the smoothed solution, the aided one, or the first of several; None for nothing.
    """
    from sinssim.simulation.recorded_filter_run import as_reference

    if motion.reference is not None:
        return motion.reference
    if aided is not None and len(aided.estimate.time) > 1:
        smoothed = aided.estimate.smoothed
        name = "the aided solution" if smoothed is None else "the smoothed solution"
        return as_reference(name, (smoothed or aided.estimate).solution)
    if len(solutions) > 1:
        name, solution = next(iter(solutions.items()))
        return as_reference(f"the solution {name}", solution)
    return None
