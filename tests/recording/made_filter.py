"""A filter's estimate of five epochs whose every number is chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.estimation.filter_result import Innovations

TIME = np.array([20.0, 30.0, 40.0, 220.0, 420.0])
SMOOTHED = np.array([20.0, 50.0, 420.0])
BACKWARD = np.array([30.0, 400.0, 410.0])
SLICES = {
    "position": slice(0, 3), "velocity": slice(3, 6), "attitude": slice(6, 9), "gyro bias": slice(9, 12),
    "accelerometer bias": slice(12, 14),
}  # fmt: skip
BLOCKS = [
    SimpleNamespace(name=name, states=[f"{name} {axis}" for axis in ("forward", "right", "down")][: at.stop - at.start])
    for name, at in SLICES.items()
]
SIZE = np.array([2.0, 3.0, 5.0, 0.002, 0.003, 0.005, 1e-6, 2e-6, 4e-4, 1e-7, 2e-7, 3e-7, 0.0, 4e-4])
"""Size of each state; the first component of the accelerometers' bias is known exactly."""
SHARE = np.array([100.0, 40.0, 10.0, 6.0, 4.0])
ERROR = np.outer([-50.0, 30.0, -12.0, 7.0, 5.0], SIZE)
SIGMA = np.outer(SHARE, SIZE)
SMOOTHED_ERROR, SMOOTHED_SIGMA = np.outer([8.0, -3.0, 2.0], SIZE), np.outer([9.0, 2.5, 3.5], SIZE)
BACKWARD_ERROR, BACKWARD_SIGMA = np.outer([1.0, -4.0, 60.0], SIZE), np.outer([1.5, 5.0, 80.0], SIZE)
ESTIMATES = {name: np.outer([1.0, 2.0, 3.0, -4.0, 6.0], SIZE[at]) for name, at in SLICES.items() if "bias" in name}

FIXES = Innovations(
    "gnss", "position", np.array([21.0, 22.0, 23.0, 24.0]),
    np.array([[3.0, -8.0], [np.nan, np.nan], [1.0, 1.0], [-40.0, 10.0]]),
    np.array([[4.0, 1.0, 16.0], [4.0, 0.0, 16.0], [4.0, 0.0, 25.0], [16.0, 0.5, 4.0]]),
    np.array([2.5, np.nan, 0.3, 99.0]), np.array([True, False, True, False]), ["", "skipped", "", "gate"], 13.8,
)  # fmt: skip
"""1σ: 2 and 4, 2 and 5, 4 and 2; the last one is rejected, the second one skipped."""


def aided(*, others: bool = True, known: bool = True) -> Any:
    """Return the aided solution, with a smoothed and a backward one or without."""
    smoothed = SimpleNamespace(time=SMOOTHED, sigma=SMOOTHED_SIGMA) if others else None
    backward = SimpleNamespace(time=BACKWARD, sigma=BACKWARD_SIGMA) if others else None
    estimate = SimpleNamespace(
        time=TIME, sigma=SIGMA, model=SimpleNamespace(slices=SLICES, blocks=BLOCKS), parameters=ESTIMATES,
        innovations=[FIXES], smoothed=smoothed, backward=backward, divergence=None,
    )  # fmt: skip
    return SimpleNamespace(
        estimate=estimate, sensed=[], true_parameters_known=known,
        block_error=lambda name, rows: ERROR[rows][:, SLICES[name]], state_errors_at=lambda rows: ERROR[rows],
        smoothed_state_errors=SMOOTHED_ERROR if others else None,
        backward_state_errors=BACKWARD_ERROR if others else None,
    )  # fmt: skip
