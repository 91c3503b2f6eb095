"""Measures and navigates many inertial runs of one motion at once, where a batch supports the scenario's options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.arguments import checked_imu, checked_initial
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.gravity import gravity_number, parameters
from sinssim.errors import InputError, RunError, check_name
from sinssim.experiments.ensembles import batch_layout
from sinssim.experiments.ensembles.batch_kernel import engine, variables_of
from sinssim.experiments.ensembles.ensemble_errors import OnRun, RunErrors, check_finite, rows_at, store_errors
from sinssim.experiments.ensembles.ensemble_plan import Member, Plan, TruthCache, truth_key
from sinssim.scenario import Scenario
from sinssim.scenario.ensemble_section import EnsembleSection
from sinssim.scenario.navigation_section import initial_state_with_errors
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.imu.emulation import at_the_sensors, emulate
from sinssim.sensors.imu.emulation_kernel import pack
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sensor_set_readings import draw_true_errors
from sinssim.sensors.sensor_set_section import Gyros
from sinssim.simulation.navigation_stage import by_one
from sinssim.simulation.total_system_error import has_path
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.statistics.random_numbers import key
from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY
from sinssim.strapdown.coning_sculling import WINDOW, is_uniform, weight_table
from sinssim.strapdown.engine_assembly import algorithm_file
from sinssim.strapdown.frames.navigation_problem import Increments
from sinssim.strapdown.frames.vertical_channel import NUMBERS, Channel, height_reference
from sinssim.strapdown.mechanization import Mechanization, Options, chosen
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import axes_along, navigation_error
from sinssim.system.process import thread_pool

FRAME = "level"
"""The frame that the batch serves."""


def why_algorithm_unsupported(algorithm: str) -> str | None:
    """Return why the batch does not support an attitude algorithm, as a clause; None if it does."""
    if not REGISTRY[algorithm].sample_by_sample:
        return f"{algorithm} advances by several samples at once"
    if hasattr(algorithm_file(algorithm), "turn_k"):
        return f"{algorithm} computes the body's turns in its own way"
    if REGISTRY[algorithm].variant.get("ORTHONORMAL", False):
        return f"{algorithm} iterates to the nearest rotation after each step"
    if variables_of(algorithm) is None:
        return f"{algorithm} has attitude variables of its own kind"
    return None


def why_unsupported(scenario: Scenario) -> str | None:
    """Return the first reason why the batch does not support a scenario, as a clause; None if it does."""
    navigation, imu = scenario.navigation, scenario.imu
    if scenario.navigator:
        return "a navigator of somebody else is a program of each run"
    if scenario.one_component is not None:
        return "it has one component"
    if scenario.filter is not None:
        return "it has a filter"
    if not isinstance(imu.sensor_set, Gyros):
        return f'imu.sensor_set.type = "{imu.sensor_set.type}"'
    if imu.output != "increments":
        return f'imu.output = "{imu.output}"'
    if scenario.compensation is not None:
        return "its inertial data are compensated by a calibration of each run"
    if scenario.vibration or scenario.motion is not None:
        return "its motion within a sample acts on the errors of each run"
    if scenario.gravity is not None and scenario.gravity.remainder is not None:
        return "the remainder of its gravity is drawn in each run"
    if navigation.gravity_degree is not None:
        return "its navigator compensates the disturbance of gravity along its own path"
    if imu.rotation is not None:
        return "its IMU rotates in the vehicle"
    if has_path(scenario):
        return "its errors by the planned path are kept"
    if navigation.alignment is not None:
        return "each run aligns itself"
    if imu.faults:
        return "it has faults of the sensors"
    if navigation.frame != FRAME:
        return f'navigation.frame = "{navigation.frame}"'
    if navigation.rates_hz is not None:
        return "it has a three-rate schedule"
    altimeter = None if scenario.aiding is None else scenario.aiding.sensor(Barometer)
    if navigation.vertical == "baro-loop" and altimeter is not None:
        return "the barometer of its vertical channel has errors of each run"
    return next(filter(None, map(why_algorithm_unsupported, navigation.algorithms)), None)


@dataclass(frozen=True)
class BatchSolution:
    """Solutions of R runs at E epochs. The first axis is the run."""

    time: Array  # times of the epochs, (E,) s
    # (R, E) rad
    latitude: Array
    longitude: Array
    height: Array  # (R, E) m
    velocity_ned: Array  # (R, E, 3) m/s
    q_nb: Array  # attitude quaternion, (R, E, 4); of a direction cosine matrix, either of the two quaternions
    # the errors of the runs that failed, by run number; the rows of those are NaN
    failures: dict[int, RunError] = field(default_factory=dict)
    # numbers of the runs that left the range of the batch's kernel and were navigated one by one
    alone: tuple[int, ...] = ()

    def state(self, run: int) -> NavState:
        """Return the states of one run at the epochs, (E,)."""
        return NavState(
            self.latitude[run], self.longitude[run], self.height[run], self.velocity_ned[run], self.q_nb[run]
        )


def navigate_batch(
    ideal: ImuData,
    initial: NavState | Sequence[NavState],
    errors: Sequence[ImuErrors],
    seeds: Sequence[int],
    epochs: ArrayLike,
    mechanization: Mechanization | None = None,
    *,
    height: ArrayLike | None = None,
    threads: int = 1,
    progress: Callable[[int], None] | None = None,
    **options: Unpack[Options],
) -> BatchSolution:
    """Measure one motion by the sensors of many runs and navigate each in the level frame; keep the epochs only.

    Run i has the numbers of `navigate(emulate(ideal, errors[i], seeds[i], rounded=True), initial[i], …)` at the epochs.
    They do not depend on the number of threads or on the other runs. Memory is that of the epochs, 80 bytes each for
    every run.

    Args:
        ideal: error-free increments of all runs, N intervals.
        initial: initial state of all runs, or one for each, scalars.
        errors: errors of each run's sensors, R of them; correlation times, arms, delay, warm-up and null shift are the
            same in all, and there are no faults.
        epochs: numbers of the edges in ideal.time to keep, increasing, (E,).
        mechanization: of all runs; in the frame "level", at one rate, of an algorithm that `why_algorithm_unsupported`
            admits.
        height: as for `navigate`, the same in all runs, (N+1,) m.
        threads: number of threads; each takes `LANES` runs at a time.
        progress: called with the number of finished runs, from the threads.

    Returns:
        The solutions at the epochs. A run that leaves the range of the kernel (a rotation beyond 14° in an interval,
        for normal gravity heights outside −1…30 km, a latitude beyond 89.9°, diverging numbers) is navigated alone; if
        that fails, too, its error is among the failures.
    """
    of = chosen(mechanization, options)
    check_name("algorithm", of.algorithm, ALGORITHMS)
    if (reason := why_algorithm_unsupported(of.algorithm)) is not None:
        raise InputError(f"a batch cannot be navigated by {of.algorithm}: {reason}.")
    if of.frame != FRAME or of.rates_hz is not None:
        raise InputError(f'a batch is navigated in the frame "{FRAME}", at the rate of the data.')
    ideal = checked_imu(ideal)
    count, runs = len(ideal), len(errors)
    if count < WINDOW:
        raise InputError(f"a batch needs at least {WINDOW} samples; there are {count}.")
    reference, climb = height_reference(of.vertical, height, ideal.time)
    edges = _checked_epochs(epochs, count)
    _check_errors(errors, seeds)
    felt = at_the_sensors(ideal, errors[0])
    packed = pack(errors, float(ideal.time[0]), rounded=True)
    keys = np.array([key(int(seed)) for seed in seeds], dtype=np.uint64).T.copy()
    start = _initial(initial, runs)
    uniform = is_uniform(ideal.time)
    kernel = engine(of.algorithm, gravity_number(of.gravity), NUMBERS[of.vertical], of.curvature, packed.active)
    out, left = np.empty((10, len(edges), runs)), np.zeros(runs)
    time, dtheta, dvel = (np.ascontiguousarray(a, dtype=np.float64) for a in (ideal.time, felt.dtheta, felt.dvel))
    data = Increments(time, dtheta, dvel, weight_table(ideal.time, uniform), uniform, 0)
    earth, channel = parameters(of.earth), Channel(NUMBERS[of.vertical], reference, climb, of.baro_time_constant)

    def lane(first: int) -> None:
        last = min(first + batch_layout.LANES, runs)
        kernel(data, earth, channel, packed, keys, start, edges, first, last, out, left)
        if progress is not None:
            progress(last - first)

    with thread_pool(threads) as pool:
        for _ in pool.map(lane, range(0, runs, batch_layout.LANES)):
            pass

    alone = tuple(int(run) for run in np.flatnonzero(left))
    failures: dict[int, RunError] = {}
    for run in alone:
        start_of_run = initial if isinstance(initial, NavState) else initial[run]
        try:
            imu = emulate(ideal, errors[run], int(seeds[run]), rounded=True)
            out[:, :, run] = _rows_of(navigate(imu, start_of_run, of, height=height), edges)
        except RunError as error:
            failures[run] = error
            out[:, :, run] = np.nan
    return BatchSolution(
        ideal.time[edges], out[0].T, out[1].T, out[2].T, out[3:6].T, out[6:].T, failures, alone
    )  # fmt: skip


def _rows_of(solution: NavSolution, edges: NDArray[np.int64]) -> Array:
    """Return the rows of the result of a run that is navigated alone, (10, E)."""
    s = solution
    position = s.latitude[edges], s.longitude[edges], s.height[edges]
    return np.stack([*position, *s.velocity_ned[edges].T, *s.q_nb[edges].T])


def _checked_epochs(epochs: ArrayLike, count: int) -> NDArray[np.int64]:
    """Return the numbers of the epochs' edges."""
    edges = np.asarray(epochs)
    if edges.ndim != 1 or not len(edges) or edges.dtype.kind not in "iu":
        raise InputError("epochs must be a list of numbers of edges, at least one.")
    edges = edges.astype(np.int64)
    if edges[0] < 0 or edges[-1] > count or np.any(np.diff(edges) <= 0):
        raise InputError(f"epochs must increase and lie within 0 … {count}, the edges of the data.")
    return edges


def _check_errors(errors: Sequence[ImuErrors], seeds: Sequence[int]) -> None:
    """Raise for errors that must be the same in all runs and are not."""
    if not errors or len(errors) != len(seeds):
        raise InputError(f"a batch needs errors and a seed for each run; there are {len(errors)} and {len(seeds)}.")
    first = errors[0]
    for run, of_run in enumerate(errors):
        if of_run.faults:
            raise InputError(f"run {run} has faults, which a batch does not support.")
        same = {
            "gyro.correlation_time": first.gyro.correlation_time == of_run.gyro.correlation_time,
            "accel.correlation_time": first.accel.correlation_time == of_run.accel.correlation_time,
            "arms": np.array_equal(first.arms, of_run.arms),
            "delay": first.delay == of_run.delay,
            "warm_up": first.warm_up == of_run.warm_up,
            "null_shift": first.null_shift == of_run.null_shift,
        }
        if not all(same.values()):
            names = ", ".join(name for name, equal in same.items() if not equal)
            raise InputError(f"{names} of run {run} differ from those of run 0; in a batch they are the same.")


def _initial(initial: NavState | Sequence[NavState], runs: int) -> Array:
    """Return the initial states of the runs, (10, R)."""
    states = [initial] if isinstance(initial, NavState) else list(initial)
    if len(states) not in (1, runs) or (len(states) == 1 and not isinstance(initial, NavState) and runs != 1):
        raise InputError(f"a batch needs one initial state, or one for each of {runs} runs; there are {len(states)}.")
    columns = [np.array([lat, lon, h, *v, *q]) for lat, lon, h, v, q in map(checked_initial, states)]
    # a copy: a view that may not be written would cause another compilation
    return np.array(np.broadcast_to(np.stack(columns, axis=1), (10, runs)), order="C")


PAYS = 4e7
"""Samples of all runs from which the batch pays: its kernel compiles once in about ten seconds for each combination of
options, in which single runs pass 4·10⁷ samples."""
_BEGIN = 7000
"""Samples that take as long as what a single run needs once and a batch saves: 1.3 ms."""


def why_not_batch(plan: Plan, truths: TruthCache) -> str | None:
    """Return why the runs of an ensemble are computed one by one, as a clause; None if they are computed at once."""
    if plan.filtered:
        return "it has a filter"
    if plan.keys:
        return "keys vary from run to run"
    if truth_key(plan.scenario) != truth_key(plan.scenario.model_copy(update={"seed": plan.scenario.seed + 1})):
        return "each run has its own motion"
    if (reason := why_unsupported(by_one(plan.scenario, plan.solution))) is not None:
        return reason
    samples, runs = len(truths.of(plan.scenario).ideal), (plan.scenario.ensemble or EnsembleSection()).runs
    if samples < WINDOW:
        return f"there are fewer than {WINDOW} samples"
    if (samples + _BEGIN) * runs < PAYS:
        return f"{samples * runs:.3g} samples are too few to compensate for compiling the batch"
    return None


def compute_as_batch(
    plan: Plan, members: Sequence[Member], truths: TruthCache, errors: RunErrors, on_run: OnRun | None
) -> list[int]:
    """Compute runs of a plan that `why_not_batch` admits, and store those that can be finished.

    The rows of the others are returned: runs that leave the range of the batch, and those that fail.
    """
    truth = truths.of(plan.scenario)
    epochs, rows = rows_at(plan.epochs, truth.time)
    edges, where = np.unique(rows, return_inverse=True)
    solution = _navigate(plan, members, truth, edges)
    there = replace(truth.state, **{name: value[rows] for name, value in vars(truth.state).items()})
    axes = axes_along(plan.scenario.navigation.frame, truth.trajectory.state, truth.trajectory.start, truth.time[-1])
    left = []
    for row in range(len(members)):
        if row in solution.alone:
            left.append(row)
            continue
        state = solution.state(row)
        reduced = NavSolution(
            truth.time[rows], state.latitude[where], state.longitude[where], state.height[where],
            state.velocity_ned[where], state.q_nb[where], np.zeros(len(rows)), plan.solution,
        )  # fmt: skip
        error = navigation_error(there, reduced, truth.trajectory.ellipsoid, axes)
        try:
            check_finite(error)
        except RunError:
            left.append(row)
            continue
        errors.end[row] = truth.time[-1]
        store_errors(errors, row, error, epochs)
        if on_run is not None:
            on_run()
    return left


def _navigate(plan: Plan, members: Sequence[Member], truth: Truth, edges: NDArray[np.intp]) -> BatchSolution:
    """Return the solutions of runs at some edges of the samples."""
    scenario, trajectory = plan.scenario, truth.trajectory
    navigation = scenario.navigation
    axes = axes_along(navigation.frame, trajectory.state, trajectory.start, trajectory.end)
    start: NavState = trajectory.state(truth.time[0])
    initial = [
        initial_state_with_errors(start, navigation.initial_error, trajectory.ellipsoid, run.seed, axes)
        for run in members
    ]
    return navigate_batch(
        truth.ideal,
        initial,
        [draw_true_errors(scenario.imu, run.seed).imu for run in members],
        [run.seed for run in members],
        edges,
        navigation.mechanization(plan.solution, trajectory.ellipsoid.name),
        height=None if navigation.vertical == "free" else truth.state.height,
    )
