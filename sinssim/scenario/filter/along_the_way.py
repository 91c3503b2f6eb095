"""What the error model of a filter owes to the way: the declination of the start, which does not stay right."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from sinssim.estimation.model import ErrorModel
from sinssim.sensors.aiding.magnetometer import Magnetometer

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

_BLOCK = "magnetometer bias"


def with_declination(model: ErrorModel, scenario: Scenario, trajectory: Trajectory) -> ErrorModel:
    """Return the error model with a compass whose declination is that of the start, and changes along the way.

    As for other drifts, the change is a random walk whose 1σ bounds it: K = R/√T for the largest change R over the
    duration T. At t < T its 1σ R √(t/T) is more than a steady change R t/T.

    Args:
        model: the model of the scenario, from `filter_model`.

    Returns:
        The model; the same one where nothing changes, or where it has no state of the compass.
    """
    compass = None if scenario.aiding is None else scenario.aiding.sensor(Magnetometer)
    change = 0.0 if compass is None or _BLOCK not in model.slices else compass.largest_change(trajectory)
    if not change:
        return model
    walk = change / math.sqrt(trajectory.end - trajectory.start)
    return replace(model, blocks=tuple(replace(b, random_walk=walk) if b.name == _BLOCK else b for b in model.blocks))
