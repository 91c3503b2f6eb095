"""A platform's run of four instants whose every number is chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.run.parts.imu_mounting import OnPlatform
from sinssim.sensors.sensor_set_section import Platform
from sinssim.strapdown.navigation_error import NavError
from sinssim.strapdown.platform_theory import ACCELEROMETERS, GYROS, START, TORQUERS, ErrorsByCause

TIME = np.array([100.0, 102.0, 106.0, 110.0])
ARCSEC, ARCMIN = np.pi / 648_000.0, np.pi / 10_800.0


def error(east: list[float], tilt: list[float]) -> NavError:
    """North and east 3 : 4, horizontal 5/4 of east; angles 8 : 15 : 0, 17 arcmin times the factor."""
    place = np.outer(east, (0.75, 1.0, 9.0))
    return NavError(TIME, place, np.zeros_like(place), np.outer(tilt, (8.0, 15.0, 0.0)) * ARCMIN)


PLATFORM = error([4.0, 40.0, 80.0, 60.0], [0.1, 0.2, 0.5, 0.3])
STRAPDOWN = error([8.0, 400.0, 800.0, 1200.0], [1.0, 2.0, 3.0, 4.0])
FREE = error([4.0, 44.0, 88.0, 64.0], [0.2, 0.3, 0.1, 0.05])
BY_CAUSE = ErrorsByCause(
    TIME,
    {
        GYROS: np.array([[0.0, 0.0], [12.0, 16.0], [27.0, 36.0], [21.0, 28.0]]),
        TORQUERS: np.full((4, 2), 1e-10),
        ACCELEROMETERS: np.array([[0.0, 0.0], [9.0, 12.0], [18.0, 24.0], [-3.0, -4.0]]),
        START: np.array([[3.0, 4.0], [6.0, 8.0], [12.0, 16.0], [24.0, 32.0]]),
    },
)
"""Lengths 0, 20, 45, 35; 0, 15, 30, 5; 5, 10, 20, 40; together 5, 45, 95, 70, which the simulation leaves at 5 m."""
COMMANDED = np.array([[1.0, -2.0, 4.0], [3.0, 5.0, -6.0], [7.0, 9.0, 11.0]])
GIMBALS = np.array([[10.0, -1.0, 350.0], [178.0, 2.0, 355.0], [-179.0, 3.0, 4.0], [-170.0, -4.0, 9.0]])
SENSED = np.array([[2.0, -4.0, 6.0], [4.0, 12.0, -20.0], [-8.0, 16.0, 28.0]])
"""deg of each interval of 2, 4 and 4 s: 1, −2, 3; 1, 3, −5; −2, 4, 7 deg/s."""
RATES = np.array([[1.0, -2.0, 3.0], [1.0, 3.0, -5.0], [-2.0, 4.0, 7.0]])


def solution() -> Any:
    return SimpleNamespace(time=TIME, commanded=COMMANDED * ARCSEC, gimbals=np.radians(GIMBALS))


class Made(OnPlatform):
    """A part whose numbers are chosen."""

    solution: Any = solution()
    true_increments: Any = SimpleNamespace(dtheta=np.radians(SENSED))


def part(frame: str, strapdown: NavError | None = STRAPDOWN, free: NavError | None = FREE) -> Any:
    scenario = SimpleNamespace(
        imu=SimpleNamespace(sensor_set=Platform(type="platform")), navigation=SimpleNamespace(frame=frame)
    )
    errors = {"platform": PLATFORM} | ({} if strapdown is None else {"poisson": strapdown})
    run: Any = SimpleNamespace(scenario=scenario, time=TIME, errors=errors)
    made = Made(run)
    vars(made).update(without_errors_of_turns=free, errors_by_cause=BY_CAUSE)
    return made
