"""A flight that follows its own navigator: fly, sense, navigate, and fly again with the errors of the navigator.

The errors of a navigator depend so weakly on the path that each pass brings the path some two digits nearer to that of
the closed loop. The last pass is a flight like any other: the accuracy of its curve and increments is that of a flight
by truth. The sensors' random numbers are those of the run, in every pass the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import RunError
from sinssim.rotation import conjugate, euler_from_quaternion, multiply, rotate
from sinssim.scenario import filter_model
from sinssim.scenario.true_motion import mounting, true_motion
from sinssim.simulation.navigation_stage import aid, by_one, navigate
from sinssim.simulation.truth_and_sensors import Sensed, sense, truth_along
from sinssim.truth.flight.guidance import TRUTH, Guided, SolutionErrors, finite_rows

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

Rows = NDArray[np.intp]

NEAR = 1e-3
"""Distance between the paths of two passes below which the loop is closed, m."""
_MOST = 12
"""Passes after the first; a gate that opens and closes in turn would never end them."""
_RATE = 10.0
"""Rate at which two paths are compared, Hz."""


def is_guided(scenario: Scenario) -> bool:
    """Return whether a scenario has a flight that follows its navigator."""
    return scenario.flight is not None and scenario.flight.guidance.source != TRUTH


def closed_loop(
    scenario: Scenario,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> tuple[Trajectory, Guided]:
    """Fly a plan by the navigator that the scenario names.

    Args:
        scenario: with a flight.
        progress: called with the fraction of the passes flown, 0…1.
        meanwhile: called once while another process flies.

    Returns:
        The motion of the sensor block, and how it came about.

    Raises:
        RunError: the path does not settle, or the navigator has no solution.
    """
    scenario = filter_model.with_states(scenario)
    assert scenario.flight is not None  # it is guided
    source, moved = scenario.flight.guidance.source, list[float]()
    report = progress or (lambda fraction: None)

    def part_of(number: int) -> Callable[[float], None]:
        begin, end = 1.0 - 0.5**number, 1.0 - 0.5 ** (number + 1)
        return lambda fraction: report(begin + (end - begin) * fraction)

    path = by_truth = true_motion(scenario, part_of(0), meanwhile, errors="none")
    while not moved or moved[-1] > NEAR:
        if len(moved) == _MOST:
            raise RunError(
                f"the flight by {source} does not settle: after {_MOST} passes its path still moves by "
                f"{moved[-1]:.3g} m from one pass to the next (before: {', '.join(f'{m:.3g}' for m in moved[-4:-1])} "
                "m). A decision of the navigator, such as a gate, turns with the path."
            )
        errors = solution_errors(scenario, path)
        before, path = path, true_motion(scenario, part_of(len(moved) + 1), errors=errors)
        moved.append(apart(before, path))
    report(1.0)
    return path, Guided(source, by_truth, tuple(moved))


def solution_errors(scenario: Scenario, path: Trajectory) -> SolutionErrors:
    """Return the errors of the navigator along a path, as the autopilot sees them."""
    assert scenario.flight is not None
    guidance = scenario.flight.guidance
    sensed = sense(scenario, truth_along(path, scenario))
    if guidance.source in scenario.solution_names:
        solution = navigate(by_one(scenario, guidance.source), sensed).solutions[guidance.source]
    else:
        solution = aid(scenario, sensed).estimate.solution
    time = np.arange(0.0, path.end - path.start, 1.0 / guidance.rate_hz)
    rows = np.searchsorted(solution.time, path.start + time + 1e-9, side="right") - 1  # the last row before
    begun = rows >= 0  # before it navigates, the true motion guides
    rows = np.maximum(rows, 0)
    values = np.zeros((len(time), 12))
    values[begun, :9] = _state_errors(scenario, path, solution, rows[begun])
    values[begun, 9:] = _rate_errors(scenario, sensed, path.start + time)[begun]
    return SolutionErrors(guidance, finite_rows(values))


def _state_errors(scenario: Scenario, path: Trajectory, solution: NavSolution, rows: Rows) -> Array:
    """Return the errors of some rows of a solution in position, velocity and the vehicle's attitude, (K, 9)."""
    true, place = path.state(solution.time[rows]), conjugate(mounting(scenario).q_bs)

    def columns(state: NavState | NavSolution, of: Rows | slice) -> Array:
        angles = euler_from_quaternion(multiply(state.q_nb[of], place))
        position = (state.latitude[of], state.longitude[of], state.height[of])
        return np.column_stack([*position, state.velocity_ned[of], *angles])

    errors = columns(solution, rows) - columns(true, slice(None))
    for column in (1, 6, 8):  # longitude, roll and heading
        errors[:, column] = np.remainder(errors[:, column] + np.pi, 2.0 * np.pi) - np.pi
    return errors


def _rate_errors(scenario: Scenario, sensed: Sensed, time: Array) -> Array:
    """Return the errors of the gyros' mean rates over the interval before each of some instants, (K, 3) rad/s.

    They are zero for sensors that measure no rates, and for a block that turns in the vehicle.
    """
    measured, ideal = sensed.imu, sensed.perfect.imu
    if scenario.imu.rotation is not None or not np.isfinite(measured.dtheta).all():
        return np.zeros((len(time), 3))
    angle = np.vstack([np.zeros(3), np.cumsum(measured.dtheta - ideal.dtheta, axis=0)])
    edge = np.clip(np.searchsorted(measured.time, time + 1e-9, side="right") - 1, 1, len(angle) - 1)
    before = np.minimum(np.concatenate([[0], edge[:-1]]), edge - 1)
    rate = (angle[edge] - angle[before]) / (measured.time[edge] - measured.time[before])[:, None]
    return rotate(mounting(scenario).q_bs, rate)


def apart(path: Trajectory, other: Trajectory) -> float:
    """Return the largest distance of two paths at the same instants, m; what only one of them has counts as well."""
    end = min(path.end, other.end)
    time = np.append(np.arange(path.start, end, 1.0 / _RATE), end)
    places = [_place(flown, time) for flown in (path, other)]
    whole = [_place(flown, np.array([flown.end]))[0] for flown in (path, other)]
    return float(max(np.linalg.norm(places[0] - places[1], axis=1).max(), np.linalg.norm(whole[0] - whole[1])))


def _place(path: Trajectory, time: Array) -> Array:
    state = path.state(time)
    return geodetic_to_ecef(state.latitude, state.longitude, state.height, path.ellipsoid)
