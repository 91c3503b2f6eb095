"""Another, better inertial system on the same vehicle: velocity and attitude for transfer alignment."""

from __future__ import annotations

import numpy as np

from sinssim import rotation
from sinssim.data import NavSolution
from sinssim.scenario.aiding import MasterSection
from sinssim.sensors.aiding.lever_arm import state_at
from sinssim.sensors.aiding.noise import turn_on, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCMIN


def master(trajectory: Trajectory, section: MasterSection, solution: NavSolution, seed: int = 0) -> list[Sensed]:
    """Return what a better inertial system gives to the sensor block that is to be aligned.

    Args:
        trajectory: the true motion of the sensor block.
        section: the better system.
        solution: what it navigates at its own place, with its own errors, in the block's axes; at least as often as
            it is read.
        seed: the run's seed.

    Returns:
        Its velocities, which are to be compared at the lever arm, and its attitudes, which are the block's but for
        what the two are mounted askew; the section may want only one of them.

    Raises:
        InputError: the motion is over before the first reading, or the seed cannot be used.
    """
    s = section
    rows = np.searchsorted(solution.time, epochs(trajectory, s, "master") - 1e-9).clip(max=len(solution.time) - 1)
    time = solution.time[rows]
    given = []
    if s.velocity:
        sigma = (s.velocity_sigma_mps,) * 3
        value = solution.velocity_ned[rows] + white(seed, "master velocity noise", sigma, len(time))
        drift = solution.velocity_ned[rows] - state_at(trajectory, time, s.lever_arm_m).velocity_ned
        true = {"master-velocity bias": drift}
        given.append(sensed("master-velocity", "gnss-velocity", s, time, value, sigma, true, lever_arm=s.lever_arm_m))
    if s.attitude:
        askew = np.array(
            [turn_on(seed, "master mounting", None, ARCMIN * s.mounting_sigma_arcmin, i) for i in range(3)]
        )
        sigma = (ARCMIN * s.attitude_sigma_arcmin,) * 3
        turn = askew + white(seed, "master attitude noise", sigma, len(time))
        value = rotation.multiply(solution.q_nb[rows], rotation.quaternion_from_rotation_vector(turn))
        given.append(sensed("master-attitude", "attitude", s, time, value, sigma, {"master-attitude bias": askew}))
    return given
