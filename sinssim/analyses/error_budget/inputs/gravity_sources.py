"""The true gravity field as a source of errors: the model minus the compensated part, and the random remainder.

The budget follows the motion in normal gravity. The field that the navigator does not know enters like errors of the
accelerometers: the deterministic part as readings that are −∫C_bn δg dt off, the same in every run; the remainder as a
random process over the distance travelled, in north, east and down.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim import earth
from sinssim.analyses.error_budget.inputs.processes import AlongWay
from sinssim.analyses.error_budget.inputs.sources import InertialNoise, Source
from sinssim.data import Array, ImuData, NavState
from sinssim.scenario.true_motion import unknown_field
from sinssim.truth.gravity.disturbed import Disturbed
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory

TRIAD = 2
"""Number of the three components of gravity beside those of gyros, 0, and accelerometers, 1."""


def in_normal_gravity(scenario: Scenario) -> Scenario:
    """Return a scenario without its gravity field."""
    if scenario.gravity is None:
        return scenario
    navigation = scenario.navigation.model_copy(update={"gravity_degree": None})
    return scenario.model_copy(update={"gravity": None, "navigation": navigation})


def field_readings(scenario: Scenario, trajectory: Trajectory, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return what the unknown field does to the readings.

    Args:
        ideal: increments along it, N intervals.

    Returns:
        The source, and its errors of the increments, (s, N, 3) rad and (s, N, 3) m/s; s is 0 without an unknown field.
    """
    field = unknown_field(scenario)
    if field is None:
        return [], np.zeros((0, len(ideal), 3)), np.zeros((0, len(ideal), 3))
    motion = Disturbed(trajectory, field)
    velocity = -motion.felt(ideal.time, ideal.dtheta)
    largest = float(np.linalg.norm(velocity, axis=1).max() / np.diff(ideal.time).mean() / MGAL)
    source = Source("gravity_model", "gravity field", "gravity", "given", float(f"{largest:.3g}"), "mGal")
    return [source], np.zeros((1, len(ideal), 3)), velocity[None]


def remainder_noise(scenario: Scenario, state: NavState) -> list[InertialNoise]:
    """Return the random remainder of gravity as a process.

    Args:
        state: true states, for normal gravity along the way.

    Returns:
        The process; none without [gravity.remainder].
    """
    model = None if scenario.gravity is None else scenario.gravity.remainder_model()
    if model is None or not any(model.sigma):
        return []
    some = slice(None, None, max(1, len(state.latitude) // 100))
    gamma = float(earth.gravity_ned(state.latitude[some], state.height[some])[:, 2].mean())
    sizes = np.array([gamma * model.sigma[0], gamma * model.sigma[1], model.sigma[2]])
    value = float(f"{max(model.sigma[:2]) / ARCSEC:.3g}")
    source = Source("gravity_remainder", "remainder of gravity, deflection", "gravity", "random", value, "arcsec")
    process = AlongWay(replace(model, sigma=(1.0, 1.0, 1.0)))
    return [InertialNoise(source, TRIAD, "process", float(sizes.max()), process=process, sizes=sizes)]
