"""The error of the navigation algorithm itself: one run on perfect increments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.analyses.error_budget.motion import TrueMotion
from sinssim.data import Array
from sinssim.scenario.sections.navigation import InitialErrorSection
from sinssim.sensors.rates import perfect_increments
from sinssim.simulation.navigation import solve
from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

ALGORITHM = Source("algorithm", "algorithm, gravity model, ellipsoid", "navigation", "one run", float("nan"), "")
"""The algorithm as a source."""


def of_algorithm(scenario: Scenario, motion: TrueMotion, outputs: Array) -> Array:
    """Return the errors of the scenario's first algorithm with perfect sensors, from the true state.

    Args:
        outputs: instants, (E,) s.

    Returns:
        Position, velocity and attitude errors, (E, 9) SI.

    Raises:
        RunError: the algorithm cannot navigate this motion.
    """
    exact = scenario.navigation.model_copy(
        update={"algorithms": scenario.navigation.algorithms[:1], "initial_error": InitialErrorSection()}
    )
    # that of the block, whose attitude is not turned out: errors of its encoders are sources of their own
    block = scenario.imu.model_copy(update={"rotation": None})
    plain = scenario.model_copy(update={"navigation": exact, "imu": block})
    trajectory, height = motion.trajectory, motion.state.height
    increments = perfect_increments(trajectory, motion.ideal, scenario.imu)
    truth = Truth.along(trajectory, trajectory, scenario.imu.rate_hz, motion.ideal, motion.state)
    (solution,) = solve(plain, truth, increments, None, height)[0].values()
    error = truth.error_of(solution, "north")
    columns = np.hstack([error.position_ned, error.velocity_ned, error.attitude])
    return np.column_stack([np.interp(outputs, solution.time, column) for column in columns.T])
