"""What the algorithms of a run navigate with, which special systems change before they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData, NavSolution, NavState
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.simulation.truth import RecordedMotion, Truth
    from sinssim.strapdown.frames.vertical import HeightReadings
    from sinssim.strapdown.mechanization import Mechanization

Engine = Callable[["Setup", "ImuData", "Mechanization"], "NavSolution"]
"""Navigates by a mechanization on increments, with attitude, start and height of a setup."""


@dataclass(frozen=True)
class Setup:
    """What the algorithms of a run navigate with.

    Attributes:
        scenario: the scenario.
        truth: the true motion, or what is known of a recorded one.
        errors: the true errors of the sensors, None if they are not known.
        imu: increments.
        attitude: measured q_ib of a set with an attitude sensor, (N+1, 4), else None.
        initial: state that navigation starts from.
        height: height reference of the vertical channel.
        engine: navigates.
    """

    scenario: Scenario
    truth: Truth | RecordedMotion
    errors: TrueErrors | None
    imu: ImuData
    attitude: Array | None
    initial: NavState
    height: Array | HeightReadings | None
    engine: Engine
