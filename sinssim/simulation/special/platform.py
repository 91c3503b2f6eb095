"""Navigation on a gimballed platform, the algorithm "platform", beside strapdown algorithms."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sinssim.algorithms import PLATFORM
from sinssim.errors import InputError
from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution
    from sinssim.simulation.setup import Setup
    from sinssim.strapdown.mechanization import Mechanization


def on_platform(setup: Setup) -> Setup:
    """Let the algorithm "platform" navigate by a platform's own loop, which needs the true motion.

    Returns:
        The setup; unchanged without that algorithm.
    """
    if PLATFORM not in setup.scenario.navigation.algorithms:
        return setup
    inner = setup.engine

    def engine(own: Setup, imu: ImuData, of: Mechanization) -> NavSolution:
        return _navigate(own, of) if of.algorithm == PLATFORM else inner(own, imu, of)

    return replace(setup, engine=engine)


def _navigate(setup: Setup, of: Mechanization) -> NavSolution:
    from sinssim.strapdown.platform.force import inertial_forces
    from sinssim.strapdown.platform.navigate import navigate_platform
    from sinssim.truth.gravity.disturbed import Disturbed

    time, errors, truth = setup.imu.time, setup.errors, setup.truth
    if errors is None or not isinstance(truth, Truth):
        raise InputError(
            f"{PLATFORM} computes its own loop from the errors of its sensors: give errors, the true errors of the run."
        )
    trajectory = truth.trajectory
    state = truth.state if len(time) == len(truth.time) else trajectory.state(time)
    felt = trajectory.disturbance_ned(time, state) if isinstance(trajectory, Disturbed) else None
    forces = inertial_forces(time, state, trajectory.gravity, trajectory.ellipsoid, felt)
    return navigate_platform(
        time, forces, setup.initial, errors.imu, errors.platform, setup.scenario.seed, of, height=setup.height
    )
