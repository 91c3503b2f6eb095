"""Results whose every number is written by hand, and what the console prints of them."""

from __future__ import annotations

import io
from collections.abc import Callable
from math import pi
from types import SimpleNamespace

import numpy as np
from rich.console import Console

from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia
from sinssim.analyses.error_budget.budget_result import BudgetResult
from sinssim.analyses.error_budget.error_sources import Source

ARCMIN = pi / 10_800.0
CEP, R95 = (2.0 * np.log(2.0)) ** 0.5, (2.0 * np.log(20.0)) ** 0.5
"""Radii of the circles that hold 50 % and 95 % of a normal distribution with the same σ = 1 north and east."""


def printed(show: Callable[[Console], None], width: int = 400) -> list[str]:
    """Return the lines that a table prints, without rules, white space reduced to single blanks."""
    text = io.StringIO()
    show(Console(file=text, width=width, highlight=False))
    lines = (" ".join(line.replace("│", " ").replace("┃", " ").split()) for line in text.getvalue().splitlines())
    return [line for line in lines if line.strip("━─═┏┓┗┛┡┩└┘├┤╇┼┴┬┳ ")]


def plain_text(show: Callable[[Console], None]) -> str:
    """Return the text that a table prints: lines of at most 120 characters."""
    text = io.StringIO()
    show(Console(file=text, width=120, highlight=False))
    return text.getvalue()


SOURCES = (
    Source("accel_bias", "bias", "accelerometers", "random", 45.0, "µg"),
    Source("gyro_bias", "bias", "gyros", "one run", 0.0123, "deg/h"),
    Source("height", "height", "initial_state", "given", -15.0, "m"),
    Source("gyro_walk", "random walk", "gyros", "random", 0.002, "deg/√h"),
)
A_HOUR = {
    "accel_bias": (30.0, 30.0, 12.0, 3e-3, 4e-3, 5e-3, 0.2 * ARCMIN, 0.3 * ARCMIN, 1.1 * ARCMIN),
    "gyro_bias": (40.0, 40.0, 16.0, 4e-3, 3e-3, 12e-3, 0.15 * ARCMIN, 0.4 * ARCMIN, 0.0),
    "gyro_walk": (0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
"""Standard deviations of the components that each random source adds in an hour; all grow with the time."""


def hand_budget(end: float = 7200.0, filtered: bool = False) -> BudgetResult:
    """Return a budget in which all errors grow with the time.

    In an hour: σ of 50 m north and east, 20 m down with a mean of −15 m; of 5, 5 and 13 mm/s; of 0.25′, 0.5′ and 1.1′.
    """
    time = np.linspace(0.0, end, 13)
    hours = (time / 3600.0)[:, np.newaxis, np.newaxis]
    covariance = {name: np.diag(np.square(sigma)) * hours**2 for name, sigma in A_HOUR.items()}
    mean = np.zeros((13, 9))
    mean[:, 2] = -15.0 * time / 3600.0
    own = None if not filtered else np.diag(np.arange(1.0, 10.0) ** 2) * hours**2
    solution = "filter" if filtered else "inertial"
    return BudgetResult(
        SimpleNamespace(name="by hand", description="a trial", filter=None),
        solution,
        time,
        SOURCES,
        covariance,
        {"height": mean},
        own,
        media=BudgetMedia(),
    )
