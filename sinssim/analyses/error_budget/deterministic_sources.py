"""Sources that are the same in every run: reading errors, the gravity field, the algorithm.

Each is computed in one run with it alone.

Reading errors that no constant describes linearly (faults, a limited range, arms and delay of the accelerometers, the
null shift of laser gyros) are the emulated readings less the true increments, and drive the linear error equations. The
budget follows the motion in normal gravity: the part of the field that the navigator does not know enters as readings
that are −∫C_bn δg dt off, and its random remainder as a process over the distance travelled, in north, east and down.
The error of the navigation algorithm is that of a run on perfect increments.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim import earth
from sinssim.analyses.error_budget.error_dynamics import TrueMotion
from sinssim.analyses.error_budget.error_sources import InertialNoise, Source
from sinssim.analyses.error_budget.share_propagation import AlongWay
from sinssim.data import Array, ImuData, NavState
from sinssim.errors import InputError
from sinssim.scenario.navigation_section import InitialErrorSection
from sinssim.scenario.true_motion import unknown_field
from sinssim.sensors.imu.emulation import perfect_increments
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sets.sensor_set import Redundant, along
from sinssim.simulation.navigation_stage import solve
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.truth.true_gravity_disturbance import Disturbed
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory


def given_readings(scenario: Scenario, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return reading errors of one run: the sources, and their series of rad and m/s, (s, N, 3) each."""
    from sinssim.sensors.imu.compensation import compensate
    from sinssim.sensors.imu.emulation import emulate

    block = scenario.imu.with_triads(TriadErrors(), TriadErrors())
    limits = {
        term.triad: TriadErrors(limit=float(scenario.imu.stated(term)[0])) for term in TERMS if term.field == "limit"
    }
    if isinstance(sensors := scenario.imu.sensor_set, Redundant):
        for (kind, limit), increments in zip(limits.items(), (ideal.dtheta, ideal.dvel), strict=True):
            largest = float(np.abs(along(increments, sensors.axes) / np.diff(ideal.time)[:, None]).max())
            if 0.0 < limit.limit < largest:
                raise InputError(
                    f"the {kind} range of a redundant set has no budget: single sensors reach it. Remove the range, or "
                    "use an ensemble."
                )
        return [], _stacked([], ideal), _stacked([], ideal)
    left = scenario.compensation is None  # which removes arms and delay
    warming = ImuErrors(null_shift=block.null_shift, warm_up=block.warm_up)
    alone = (
        (any(limit.limit for limit in limits.values()), "range", "range of the sensors", "gyros",
         ImuErrors(limits["gyro"], limits["accel"])),
        (bool(block.faults), "faults", "faults", "gyros", ImuErrors(faults=block.faults)),
        (block.null_shift is not None, "null_shift", "null shift", "gyros", warming),
        (left and np.any(block.arms), "accel_arms", "arms", "accelerometers", ImuErrors(arms=block.arms)),
        (left and block.delay, "accel_delay", "delay", "accelerometers", ImuErrors(delay=block.delay)),
    )  # fmt: skip
    sources, theta, velocity = [], [], []
    for there, name, label, group, errors in alone:
        if not there:
            continue
        read = emulate(ideal, errors, scenario.seed)
        if scenario.compensation is not None:
            read = compensate(read, ImuErrors())
        read = replace(read, time=ideal.time)
        error = read.dtheta - ideal.dtheta, read.dvel - ideal.dvel
        if not (error[0].any() or error[1].any()):
            continue
        sources.append(Source(name, label, group, "one run", float("nan"), ""))
        theta.append(error[0])
        velocity.append(error[1])
    return sources, _stacked(theta, ideal), _stacked(velocity, ideal)


def _stacked(series: list[Array], ideal: ImuData) -> Array:
    return np.array(series) if series else np.zeros((0, len(ideal), 3))


TRIAD = 2
"""Number of the three components of gravity beside those of gyros, 0, and accelerometers, 1."""


def in_normal_gravity(scenario: Scenario) -> Scenario:
    """Return a scenario without its gravity field."""
    if scenario.gravity is None:
        return scenario
    navigation = scenario.navigation.model_copy(update={"gravity_degree": None})
    return scenario.model_copy(update={"gravity": None, "navigation": navigation})


def field_readings(scenario: Scenario, trajectory: Trajectory, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return what the unknown field, if there is one, does to the readings, as `given_readings` does."""
    field = unknown_field(scenario)
    if field is None:
        return [], np.zeros((0, len(ideal), 3)), np.zeros((0, len(ideal), 3))
    motion = Disturbed(trajectory, field)
    velocity = -motion.felt(ideal.time, ideal.dtheta)
    largest = float(np.linalg.norm(velocity, axis=1).max() / np.diff(ideal.time).mean() / MGAL)
    source = Source("gravity_model", "gravity field", "gravity", "given", float(f"{largest:.3g}"), "mGal")
    return [source], np.zeros((1, len(ideal), 3)), velocity[None]


def remainder_noise(scenario: Scenario, state: NavState) -> list[InertialNoise]:
    """Return the random remainder of gravity, if there is one, as a process, with normal gravity at the true states."""
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


ALGORITHM = Source("algorithm", "algorithm, gravity model, ellipsoid", "navigation", "one run", float("nan"), "")
"""The algorithm as a source."""


def of_algorithm(scenario: Scenario, motion: TrueMotion, outputs: Array) -> Array:
    """Return the errors of the scenario's first algorithm with perfect sensors, from the true state.

    Position, velocity and attitude errors at `outputs`, (E,) s, are (E, 9) SI.
    """
    exact = scenario.navigation.model_copy(
        update={"algorithms": scenario.navigation.algorithms[:1], "initial_error": InitialErrorSection()}
    )
    # that of the block, whose attitude is not turned out: errors of its encoders are sources of their own
    block = scenario.imu.model_copy(update={"rotation": None})
    plain = scenario.model_copy(update={"navigation": exact, "navigator": (), "imu": block})
    trajectory, height = motion.trajectory, motion.state.height
    increments = perfect_increments(trajectory, motion.ideal, scenario.imu)
    truth = Truth.along(trajectory, trajectory, scenario.imu.rate_hz, motion.ideal, motion.state)
    (solution,) = solve(plain, truth, increments, None, height)[0].values()
    error = truth.error_of(solution, "north")
    columns = np.hstack([error.position_ned, error.velocity_ned, error.attitude])
    return np.column_stack([np.interp(outputs, solution.time, column) for column in columns.T])
