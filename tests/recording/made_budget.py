"""A covariance budget of three epochs whose numbers are chosen: circles of round normal distributions.

The radius that contains the share p of a round normal distribution is σ √(−2 ln(1 − p)).
"""

from __future__ import annotations

from math import inf, log, nan, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia
from sinssim.analyses.error_budget.budget_result import Allowance, Answer, BudgetResult
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.statistics.requirements import parse_requirement

TIME = np.array([0.0, 1800.0, 7200.0])
HALF, MOST = sqrt(2.0 * log(2.0)), sqrt(-2.0 * log(0.05))
GYRO, ACCEL = np.array([0.0, 300e3, 200e3]), np.array([0.0, 400e3, 150e3])
"""σ of each of north and east, m: together 0, 500 and 250 km."""
OTHERS = np.array([7.0, 0.01, 0.02, 0.03, 1e-4, 2e-4, 4e-4])
"""σ of height, m, of velocity, m/s, and attitude, rad, at the end; a third of it at 1800 s."""

SOURCES = (
    Source("gyro_bias", "bias", "gyros", "random", 0.03, "deg/h"),
    Source("accel_bias", "bias <b>", "accelerometers", "random", 450.0, "µg"),
    Source("initial_height", "height", "initial_state", "one run", nan, ""),
)


def covariance(horizontal: np.ndarray, others: np.ndarray) -> np.ndarray:
    rows = np.array([[h, h, *(others * share)] for h, share in zip(horizontal, (0.0, 1.0 / 3.0, 1.0), strict=True)])
    return np.asarray(rows[:, :, None] ** 2 * np.eye(9))


def budget(solution: str = "inertial") -> BudgetResult:
    scenario: Any = SimpleNamespace(name="sea & air", description="a trial", filter=None)
    own = {
        "gyro_bias": covariance(GYRO, np.zeros(7)),
        "accel_bias": covariance(ACCEL, OTHERS),
        "initial_height": covariance(np.zeros(3), np.zeros(7)),
    }
    return BudgetResult(scenario, solution, TIME, SOURCES, own, {}, media=BudgetMedia())


def answer(text: str, value: float, time: float) -> Answer:
    gyro, accel, height = SOURCES
    allowances = (Allowance((accel,), 0.75, 50e3), Allowance((gyro,), nan, 120e3), Allowance((height,), inf, 0.0))
    return Answer(parse_requirement(text), value, time, allowances, None, Allowance(SOURCES, 0.4, 0.0))
