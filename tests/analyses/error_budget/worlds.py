"""Scenarios and ensembles for the tests of the budget."""

from __future__ import annotations

from typing import Any

import numpy as np

import sinssim
from sinssim.analyses.error_budget.budget_result import BudgetResult
from sinssim.data import Array
from sinssim.scenario import Scenario
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import sense, truth_along

PLACE = {"latitude_deg": 50.0, "longitude_deg": 14.5, "altitude_m": 300.0}

TURNS: dict[str, Any] = {
    "type": "rotation-table",
    **PLACE,
    "steps": [
        {"type": "dwell", "duration_s": 40.0},
        {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": 120.0, "rate_deg_s": 10.0},
        {"type": "dwell", "duration_s": 30.0},
        {"type": "turn", "axis": [1.0, 0.0, 0.0], "angle_deg": -40.0, "rate_deg_s": 5.0},
        {"type": "turn", "axis": [0.0, 1.0, 0.0], "angle_deg": 25.0, "rate_deg_s": 5.0},
        {"type": "dwell", "duration_s": 40.0},
        {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": -200.0, "rate_deg_s": 20.0},
        {"type": "dwell", "duration_s": 97.0},
    ],
}
"""Four minutes with turns about all axes."""


SHORT_TURN: dict[str, Any] = {
    "type": "rotation-table",
    **PLACE,
    "steps": [
        {"type": "dwell", "duration_s": 10.0},
        {"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": 90.0, "rate_deg_s": 10.0},
        {"type": "turn", "axis": [1.0, 0.0, 0.0], "angle_deg": 30.0, "rate_deg_s": 5.0},
        {"type": "dwell", "duration_s": 24.0},
    ],
}
"""Fifty seconds with a turn and a roll."""


def scenario(**tables: Any) -> Scenario:
    """Return a scenario of some tables; by default the turns, at 20 samples a second."""
    data: dict[str, Any] = {"name": "budgeted", **tables}
    if not {"parked", "great_circle", "motion"} & set(data):
        data["motion"] = {**TURNS}
    data["imu"] = {"grade": "ideal", "rate_hz": 20.0, **data.get("imu", {})}
    data["navigation"] = {"vertical": "truth", **data.get("navigation", {})}
    return Scenario.model_validate(_tuples(data))


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def ensemble(plan: Scenario, result: BudgetResult, runs: int, first: int = 1000) -> Array:
    """Return the errors of unaided runs with the seeds first, first + 1, …, (N, E, 9); the motion is computed once."""
    truth = truth_along(sinssim.fly(plan), plan)
    rows = np.searchsorted(truth.time, result.time + truth.time[0] - 1e-6)
    found = []
    for seed in range(first, first + runs):
        one = plan.model_copy(update={"seed": seed})
        (solution,) = Navigated(one, sense(one, truth)).solutions.values()
        error = truth.error_of(solution, "north", rows)
        found.append(np.hstack([error.position_ned, error.velocity_ned, error.attitude]))
    return np.array(found)


def aided_ensemble(plan: Scenario, result: BudgetResult, runs: int, first: int = 1000) -> Array:
    """Return the errors of runs with a filter, (N, E, 9)."""
    found = []
    for seed in range(first, first + runs):
        aided = sinssim.run(plan.model_copy(update={"seed": seed})).aided
        assert aided is not None
        time = aided.estimate.time
        error = aided.error_at(np.searchsorted(time, result.time + aided.trajectory.start - 1e-6))
        found.append(np.hstack([error.position_ned, error.velocity_ned, error.attitude]))
    return np.array(found)


def standard_errors(errors: Array, result: BudgetResult) -> Array:
    """Return the departures of an ensemble's root mean squares from the budget, in standard errors, (E, 9).

    The root of a mean square of N normal numbers has the standard error σ/√(2N). Where the budget has no error, an
    ensemble of numbers below the rounding of the engine (1 µm, 1 nm/s, 1e-10 rad) agrees.
    """
    sigma = result.sigma()
    found = np.sqrt(np.mean((errors - result.bias) ** 2, axis=0))
    floor = np.repeat((1e-6, 1e-9, 1e-10), 3)
    exact = (sigma < floor) & (found < 10.0 * floor)
    ratio = np.divide(found, sigma, out=np.ones_like(found), where=~exact & (sigma > 0.0))
    ratio[~exact & (sigma == 0.0)] = np.inf
    return np.asarray(np.where(exact, 0.0, (ratio - 1.0) * np.sqrt(2.0 * len(errors))))


ALLOWED = 5.0
"""Standard errors that the largest of 9 components at 501 instants may depart: by chance with 9 · 501 · 6e-7 = 0.3 %,
and in truth far less, as neighbouring instants are correlated."""
