"""Navigates on the readings of a run by every algorithm of its scenario."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.algorithms import PLATFORM
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.models import ellipsoid_by_name
from sinssim.errors import InputError, RunError
from sinssim.frames import BARO_TIME_CONSTANT
from sinssim.sensors.aiding.barometer import BarometerSection
from sinssim.sensors.aiding.base.sensor import Vehicle
from sinssim.simulation.initial_error import initial_state_with_errors
from sinssim.strapdown.polar import axes_along
from sinssim.system.threads import thread_pool

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.true_errors import TrueErrors
    from sinssim.strapdown.frames.vertical import HeightReadings
    from sinssim.truth.trajectory import Trajectory


def height_reference(scenario: Scenario, trajectory: Trajectory, true_height: Array) -> Array | HeightReadings | None:
    """Return the height reference of the vertical channel: a barometer's readings for its loop, else the true height.

    Args:
        scenario: the scenario.
        trajectory: the true motion.
        true_height: height at the samples' edges, (N+1,) m.

    Returns:
        Heights at the samples' edges, m, or readings; None if the barometer has none, which leaves the channel free.

    Raises:
        InputError: the barometer has no reading, and there is no filter to report it.
    """
    altimeter = None if scenario.aiding is None else scenario.aiding.sensor(BarometerSection)
    if scenario.navigation.vertical != "baro-loop" or altimeter is None:
        return true_height
    from sinssim.strapdown.frames.vertical import HeightReadings

    readings = altimeter.read(Vehicle(trajectory, scenario.seed))[0].measurements
    if not len(readings.time):
        if scenario.filter is not None:  # its remarks report that there was no reading
            return None
        raise InputError(
            'navigation.vertical = "baro-loop" has no height reference: the outages of [aiding.baro] cover the whole '
            "run."
        )
    return HeightReadings(readings.arrival, readings.value[:, 0], 1.0 / altimeter.rate_hz)


def solve(
    scenario: Scenario,
    trajectory: Trajectory,
    imu: ImuData,
    attitude: Array | None,
    height: Array | HeightReadings | None,
    errors: TrueErrors | None = None,
    truth: NavState | None = None,
) -> tuple[dict[str, NavSolution], dict[str, RunError]]:
    """Navigate by every algorithm in parallel, as the kernels release the interpreter's lock.

    Args:
        scenario: the scenario.
        trajectory: the true motion of the vehicle, for the initial state.
        imu: compensated increments.
        attitude: measured q_ib of a set with an attitude sensor, (N+1, 4).
        height: result of `height_reference`.
        errors: the true errors of the sensors, which a platform needs.
        truth: true states at the samples' edges, if they are known.

    Returns:
        The solutions of the successful algorithms, with the vehicle's attitude, and the errors of the others.

    Raises:
        InputError: the data or the engine do not admit an option, a platform has no errors, or the navigator's own
            alignment fails.
        RunError: no algorithm has a solution.
    """
    from sinssim.scenario.true_motion import block_of, known_field
    from sinssim.sensors.imu.encoder import encoders_of, turned_in
    from sinssim.strapdown.disturbance import navigate_in_field
    from sinssim.strapdown.measured_attitude import navigate_set
    from sinssim.truth.gravity.disturbed import Disturbed

    section = scenario.navigation
    axes = axes_along(section.frame, trajectory.state, trajectory.start, trajectory.end)
    initial = initial_state_with_errors(
        trajectory.state(imu.time[0]), section.initial_error, trajectory.ellipsoid, scenario.seed, axes
    )
    encoders = None
    if scenario.imu.rotation is not None:
        block = block_of(trajectory, scenario.imu)
        initial = turned_in(initial, block, float(imu.time[0]))
        encoders = encoders_of(block, None if errors is None else errors.encoders, imu.time)
    if section.alignment is not None:
        from sinssim.simulation.own_alignment import align_itself, without_alignment

        own = ellipsoid_by_name(section.ellipsoid_over(trajectory.ellipsoid.name))
        count, initial = align_itself(scenario, imu, initial, own)
        imu = without_alignment(imu, count)
        height = height[count:] if isinstance(height, np.ndarray) else height

    field = known_field(scenario)
    if section.vertical == "free":
        height = None

    def by(algorithm: str) -> NavSolution | RunError:
        of = section.mechanization(algorithm, trajectory.ellipsoid.name)
        if height is None:
            of = replace(of, vertical="free", baro_time_constant=BARO_TIME_CONSTANT)
        try:
            if algorithm == PLATFORM:
                from sinssim.platform.force import inertial_forces
                from sinssim.platform.navigate import navigate_platform

                if errors is None:
                    raise InputError(
                        f"{PLATFORM} computes its own loop from the errors of its sensors: give errors, the true "
                        "errors of the run."
                    )
                true = trajectory.state(imu.time) if truth is None else truth
                felt = trajectory.disturbance_ned(imu.time, true) if isinstance(trajectory, Disturbed) else None
                forces = inertial_forces(imu.time, true, trajectory.gravity, trajectory.ellipsoid, felt)
                return navigate_platform(
                    imu.time, forces, initial, errors.imu, errors.platform, scenario.seed, of, height=height
                )

            def on(felt: ImuData) -> NavSolution:
                return navigate_set(felt, attitude, initial, of, height)

            found = on(imu) if field is None else navigate_in_field(imu, field, of.earth, on)
            return found if encoders is None else encoders.turned_out(found)
        except RunError as error:
            return error

    with thread_pool(os.cpu_count()) as pool:
        results = dict(zip(section.algorithms, pool.map(by, section.algorithms), strict=True))
    failures = {name: result for name, result in results.items() if isinstance(result, RunError)}
    if len(failures) == len(results):
        raise next(iter(failures.values()))
    return {name: result for name, result in results.items() if not isinstance(result, RunError)}, failures
