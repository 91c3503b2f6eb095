"""The covariance budget of a scenario: `budget`, and which scenarios have none, with the reason."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sinssim.alignment.initial_conditions import alignment_samples
from sinssim.analyses.error_budget.aligned_start import align, begin_aligned, samples_of_alignment
from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia
from sinssim.analyses.error_budget.budget_result import Added, BudgetResult, PredictedMiss, check_budgeted, times_of
from sinssim.analyses.error_budget.covariance_propagation import (
    STATES,
    Consider,
    FilterRun,
    HeightErrors,
    Vertical,
    propagate,
)
from sinssim.analyses.error_budget.error_dynamics import TrueMotion
from sinssim.analyses.error_budget.error_sources import (
    AidingSources,
    Constants,
    InitialErrors,
    SensorAngle,
    SensorGiven,
    SensorSource,
    Source,
    aiding_sources,
    angle_errors,
    constants,
    inertial_noises,
    initial_errors,
    of_turning,
)
from sinssim.analyses.error_budget.source_effects import (
    ALGORITHM,
    Marks,
    Shares,
    Snapshot,
    field_readings,
    given_readings,
    in_normal_gravity,
    of_algorithm,
    remainder_noise,
)
from sinssim.data import Array, ImuData, NavSolution
from sinssim.errors import InputError
from sinssim.progress import Progress, shown
from sinssim.recording.track_map import Track
from sinssim.scenario import Scenario
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.navigation_section import InitialErrorSection, initial_state_with_errors
from sinssim.scenario.planned_limits import check_times
from sinssim.scenario.true_motion import block_of, fly
from sinssim.sensors.aiding.air_data import Barometer
from sinssim.sensors.imu.emulation import digital
from sinssim.sensors.sensor_set_readings import draw_true_errors, read
from sinssim.simulation.truth_and_sensors import Truth, truth_along
from sinssim.statistics.requirements import Requirement, parse_requirements
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.system.files import check_directory
from sinssim.truth.flight.guidance import AIDED
from sinssim.truth.trajectory import Trajectory
from sinssim.truth.true_gravity_disturbance import Disturbed

_OTHER_SETS = {
    "accelerometers": "its angular rate comes from differences of accelerometers, which it integrates once more than "
    "the budget's error equations do",
    "attitude-sensor": "its attitude is measured and not integrated, so that the budget's error equations of the "
    "attitude do not hold",
    "platform": "its gimbals rotate the sensors relative to the sensor block, and the budget takes the inputs of the "
    "sensors from the motion of the block",
}
"""Why sets other than three gyros and three accelerometers have none."""


def check_kind(scenario: Scenario, solution: str | None) -> str:
    """Return the solution of which a budget is made, "inertial" or "filter": by default the filter's, if any."""
    if not scenario.source.in_space:
        raise InputError(
            f"the scenario {scenario.name} has [one_component], whose errors in a vertical plane have no budget; "
            "`sinssim run` prints their closed forms. Give a scenario with [flight], [parked], [great_circle], "
            "[motion] or [track]."
        )
    if scenario.source.recorded:
        raise InputError(
            f"the scenario {scenario.name} has [log]; a budget needs the true motion, and a recording has none. Give a "
            "scenario with [flight], [parked], [great_circle] or [motion]."
        )
    if scenario.imu.sensor_set.type == "redundant":
        if scenario.imu.faults:
            raise InputError(
                "imu.faults of a redundant set have no budget: the monitoring excludes sensors by the errors of each "
                "run, which is not linear. Remove them, or use an ensemble."
            )
    elif scenario.imu.sensor_set.type != "gyros":
        kind = scenario.imu.sensor_set.type
        raise InputError(
            f'imu.sensor_set.type = "{kind}" has no budget: {_OTHER_SETS[kind]}. Use an ensemble, or '
            'imu.sensor_set.type = "gyros".'
        )
    if solution not in (None, "inertial", "filter"):
        raise InputError(f'solution = {solution!r} must be "inertial" or "filter".')
    if solution == "filter" and scenario.filter is None:
        raise InputError('solution = "filter" needs a scenario with [filter].')
    chosen = solution or ("inertial" if scenario.filter is None else "filter")
    f = scenario.filter if chosen == "filter" else None
    if f is not None and f.vibration_noise:
        raise InputError(
            f"filter.vibration_noise = {f.vibration_noise:g} has no budget: it follows from the data of one run. "
            f"Remove it, or use an ensemble."
        )
    if f is not None and f.alignment_s is not None and f.alignment != "at-rest":
        raise InputError(
            f'filter.alignment = "{f.alignment}" has no budget: the alignment starts from an unknown attitude, for '
            "which linear theory is not valid. Remove filter.alignment_s, or use an ensemble."
        )
    return chosen


_STAGES = {"flight": "Flying", "truth": "Fitting the true motion", "budget": "Propagating covariances"}

_NEGLIGIBLE = 0.01
"""Given errors of readings below this share of σ, everywhere, come from the interpolation of the motion."""

_ROUNDING = np.repeat((1e-3, 1e-6, 1e-8), 3)
"""Errors of the algorithm below these are no source: m, m/s, rad."""

_HIGHEST = np.radians(89.5)
"""Latitude beyond which the error equations in north, east, down are not used."""

EPOCHS = 500
"""Number of intervals between the instants of the results."""


@dataclass(frozen=True)
class _Task:
    """A budget to compute: the motion, the errors, and the instants of the results."""

    scenario: Scenario
    motion: TrueMotion
    constants: Constants
    one_run: list[Source]  # sources of one run
    series: tuple[Array, Array]  # their reading errors
    initial: InitialErrors
    aiding: AidingSources | None
    outputs: Array
    marks: Marks | None
    progress: Callable[[float], None]

    def shares(self, sensors: list[SensorSource], *, summed: bool = False) -> Shares:
        """Return all sources with those of the aiding sensors; `summed` as for `inertial_noises`."""
        noises = inertial_noises(self.scenario, summed=summed)
        noises += remainder_noise(self.scenario, self.motion.state)
        return Shares(self.constants, noises, self.one_run, self.initial, sensors)


def budget(
    scenario: Scenario | str | Path,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    times: Iterable[float] = (),
    require: str | Requirement | Iterable[str | Requirement] = (),
    free: Sequence[str] = (),
    solution: str | None = None,
    progress: Progress | bool | None = None,
    truth: Truth | None = None,
    marks: Iterable[float] = (),
) -> BudgetResult:
    """Compute the covariances of a scenario's navigation errors by source, without random numbers.

    The sources are propagated along the true motion by the linear error equations (linear covariance analysis); with a
    filter, by the gains of the covariance propagation of the filter (consider analysis).

    Args:
        scenario: the scenario, or its file or name.
        directory: directory to write; nothing is written if not given.
        overrides: settings "key=value", as for `load_scenario`.
        overwrite: whether an existing budget in the directory may be replaced.
        times: further times of the results, s since the start of the run.
        require: requirements, or their texts, whose times are further times of the results; the method `answers` tests
            them.
        free: names of sources that share one factor in the answers.
        solution: "inertial" or "filter"; by default the filter's if the scenario has one.
        progress: called with "flight", "truth" or "budget" and the fraction done, 0…1; True shows a bar for each.
        truth: the true motion of the scenario, if it is known already; by default it is computed.
        marks: times in s since the start of the run, which delimit the intervals of `BudgetResult.added`.

    Returns:
        The budget, at 501 times and at `times`.

    Raises:
        InputError: the scenario has no budget, one of the times lies outside the run, or the directory cannot be used.
    """
    scenario = as_scenario(scenario, overrides)
    check_directory(directory, overwrite)
    wanted, times = parse_requirements(require), tuple(times)
    for requirement in wanted:
        check_budgeted(requirement)
    with shown(progress, _STAGES) as say:
        result = _budget(scenario, times, wanted, solution, truth, tuple(marks), say)
    result = replace(result, requirements=wanted, free=tuple(free), times=times)
    return result if directory is None else replace(result, directory=result.save(directory, overwrite=overwrite))


def _budget(
    scenario: Scenario,
    times: tuple[float, ...],
    wanted: tuple[Requirement, ...],
    solution: str | None,
    truth: Truth | None,
    marks: tuple[float, ...],
    say: Progress,
) -> BudgetResult:
    """Compute a budget; see `budget`."""
    kind = check_kind(scenario, solution)
    check_times(scenario)
    from sinssim.simulation.guided_passes import closed_loop, is_guided

    if scenario.filter is not None:
        from sinssim.scenario.filter_model import with_states

        scenario = with_states(scenario)
    say("flight", 0.0)
    normal = in_normal_gravity(scenario)  # what the field does is a source
    if truth is None and is_guided(scenario):
        path, guided = closed_loop(scenario, lambda fraction: say("flight", fraction))
        truth = truth_along(path, scenario, guided)
    trajectory = truth.trajectory if truth else fly(normal, lambda fraction: say("flight", fraction))
    if isinstance(trajectory, Disturbed):
        trajectory, truth = trajectory.base, None
    say("truth", 0.0)
    for requirement in wanted:
        requirement.check_within(trajectory.end - trajectory.start)
    block = truth.block if truth else block_of(trajectory, scenario.imu)
    ideal = truth.ideal if truth else digital(block.increments(scenario.imu.rate_hz))
    state = truth.state if truth and block is trajectory else block.state(ideal.time)
    motion = TrueMotion(block, ideal, state, scenario.imu.warm_up, scenario.navigation.gravity)
    say("truth", 1.0)
    highest = float(np.abs(state.latitude).max())
    if highest > _HIGHEST:
        raise InputError(
            f"the motion reaches the latitude {np.degrees(highest):.3f} deg; the budget's error equations have north, "
            f"east, down axes, which turn too fast within {90.0 - np.degrees(_HIGHEST):g} deg of a pole. Use an "
            "ensemble."
        )
    one_run, *given = given_readings(scenario, ideal)
    of_field, *by_field = field_readings(scenario, block, ideal)
    theta, velocity = (np.concatenate(parts) for parts in zip(given, by_field, strict=True))
    task = _Task(
        scenario,
        motion,
        constants(scenario),
        [*one_run, *of_field],
        (theta, velocity),
        initial_errors(scenario, _given_start(scenario, trajectory)),
        None if scenario.aiding is None else aiding_sources(scenario, trajectory),
        _instants(ideal.time, (*times, *marks, *times_of(wanted))),
        Marks(_instants(ideal.time, marks, 0)) if marks else None,
        lambda fraction: say("budget", fraction),
    )
    result = _aided(task) if kind == "filter" else _inertial(task, normal)
    result = replace(result, track=Track.of("true", ideal.time - trajectory.start, state, "truth"))
    return result if truth is None else replace(result, waypoints=_waypoints(result, truth))


def _waypoints(result: BudgetResult, truth: Truth) -> tuple[PredictedMiss, ...]:
    """Return how the flights by the navigator of a budget miss their waypoints.

    The autopilot leads the solution to the waypoint: the true path is off by the miss of a perfect navigator, less the
    error of the solution across.
    """
    flight = result.scenario.flight
    if flight is None or truth.guided is None or "position" not in flight.guidance.quantities:
        return ()
    if (flight.guidance.source == AIDED) != (result.solution == "filter"):
        return ()
    from sinssim.simulation.total_system_error import passages

    misses, total, bias = [], result.total, result.bias
    for miss, time, right in passages(result.scenario, truth):
        across = np.einsum("eij,i,j->e", total[:, :2, :2], right, right)
        sigma = math.sqrt(max(float(np.interp(time, result.time, across)), 0.0))
        mean = miss.right - float(np.interp(time, result.time, bias[:, :2] @ right))
        misses.append(PredictedMiss(miss.name, time, miss.right, mean, sigma))
    return tuple(misses)


def _instants(edges: Array, times: Iterable[float], epochs: int = EPOCHS + 1) -> Array:
    """Return the instants of the results at edges of samples, those that are asked for included, (E,) s."""
    start, end = float(edges[0]), float(edges[-1])
    chosen = np.array([float(t) for t in times]) + start
    if len(chosen) and not (np.isfinite(chosen).all() and chosen.min() >= start and chosen.max() <= end + 1e-6):
        wrong = chosen[~((chosen >= start) & (chosen <= end + 1e-6))][0] - start
        raise InputError(f"t = {wrong:g} s lies outside the run, which lasts {end - start:g} s.")
    wanted = np.concatenate([np.linspace(start, end, epochs), chosen])
    rows = np.searchsorted(edges, wanted - 0.5 * float(edges[1] - edges[0]))
    return np.asarray(edges[np.unique(np.minimum(rows, len(edges) - 1))])


def _given_start(scenario: Scenario, trajectory: Trajectory) -> Array:
    """Return the errors at the start by the given initial errors alone, (9,)."""
    section: InitialErrorSection = scenario.navigation.initial_error
    given = section.model_copy(update={name: 0.0 for name, _ in section if "sigma" in name})
    start = trajectory.state(np.array([trajectory.start]))
    true = trajectory.state(trajectory.start)
    wrong = initial_state_with_errors(true, given, trajectory.ellipsoid, scenario.seed)
    solution = NavSolution(
        np.array([trajectory.start]), np.array([wrong.latitude]), np.array([wrong.longitude]),
        np.array([wrong.height]), wrong.velocity_ned[None], wrong.q_nb[None], np.zeros(1), "",
    )  # fmt: skip
    if not any(value for name, value in given if "sigma" not in name):
        return np.zeros(9)
    error = navigation_error(start, solution, trajectory.ellipsoid)
    return np.concatenate([error.position_ned[0], error.velocity_ned[0], error.attitude[0]])


def _inertial(task: _Task, normal: Scenario) -> BudgetResult:
    """Return the budget without a filter; `normal` is the scenario without its gravity field."""
    scenario, motion, marks = task.scenario, task.motion, task.marks
    section, time = scenario.navigation, motion.ideal.time
    readings, sensors = None, list[SensorSource]()
    if section.vertical == "baro-loop" and scenario.aiding is not None:
        altimeter = scenario.aiding.sensor(Barometer)
        if altimeter is not None and task.aiding is not None:
            m = next(m for m in task.aiding.measurements if m.label == "baro")
            sensors = [s for s in task.aiding.sources if s.source.group == "baro"]
            at_arrival = motion.trajectory.state(np.minimum(m.arrival, time[-1])).height
            read = m.value[:, 0]
            readings = HeightErrors(m.arrival, read, read - at_arrival, 1.0 / altimeter.rate_hz, "baro")
    shares = task.shares(sensors)
    vertical = Vertical(section.vertical, section.baro_time_constant_s, readings)
    outputs, begun = task.outputs, None
    if count := samples_of_alignment(scenario, motion):
        begun = count, begin_aligned(scenario, motion, shares, task.series, count, STATES)
        outputs = np.union1d(time[count], outputs[outputs > time[count] + 1e-9])
    snapshots = propagate(motion, shares, task.series, vertical, outputs, task.progress, begun, marks)
    result = _result(scenario, "inertial", time[0], outputs, shares, snapshots, None)
    result = replace(result, added=_added(shares, marks, time[0]))
    result = _with_algorithm(result, of_algorithm(normal, motion, outputs))
    sources, covariance, mean = of_turning(scenario, motion.trajectory, outputs)
    return replace(
        result,
        sources=(*result.sources, *sources),
        covariance={**result.covariance, **covariance},
        mean={**result.mean, **mean},
    )


def _aided(task: _Task) -> BudgetResult:
    """Return the budget with the filter."""
    from sinssim.estimation.filter_start import at_rest
    from sinssim.scenario.filter_model import filter_model, inertial_sigma, with_declination

    scenario, motion, aiding, marks = task.scenario, task.motion, task.aiding, task.marks
    section, ideal, time = scenario.filter, motion.ideal, motion.ideal.time
    assert section is not None
    assert aiding is not None
    model = with_declination(filter_model(scenario, float(time[-1] - time[0])), scenario, motion.trajectory)
    angles = [SensorAngle(error.source, error) for error in angle_errors(scenario, motion.trajectory)]
    shares = task.shares([*aiding.sources, *angles], summed="zero_rate" in aiding.tables)
    covariance, start = model.covariance, 0
    propagation = shares.begin(model.size)
    if section.alignment_s is not None:
        start = alignment_samples(time, section.alignment_s, "filter.alignment_s", "the filter")
        state = motion.trajectory.state(motion.trajectory.start)
        aligned = at_rest(
            _sensed(scenario, ideal, motion.trajectory), state, model, inertial_sigma(scenario), start,
            inertial_sigma(scenario, 1.0), motion.gravity, motion.trajectory.ellipsoid.name,
        )  # fmt: skip
        if aligned.covariance is not None:
            covariance = aligned.covariance
        align(motion, shares, task.series, start, propagation)
    factor = section.measurement_noise_factor
    measurements = [
        replace(m, time=m.time[late], arrival=m.arrival[late], value=m.value[late], sigma=factor * m.sigma[late])
        for m in aiding.measurements
        for late in [m.time > time[start] + 1e-9]
    ]
    filter_run = FilterRun(model, covariance, measurements, section.rate_hz, start)
    consider = Consider(motion, shares, task.series, filter_run, aiding.blocks)
    epochs = consider.on_edge

    def nearest(instants: Array) -> Array:
        return np.asarray(epochs[np.unique(np.clip(np.searchsorted(epochs, instants - 1e-7), 0, len(epochs) - 1))])

    outputs = nearest(task.outputs[task.outputs >= time[start] - 1e-9])
    if marks is not None:  # the filter's epochs are the nearest
        marks.time = nearest(marks.time)
    snapshots = consider.run(propagation, outputs, task.progress, marks)
    by_filter = np.array([snapshot.covariance for snapshot in snapshots])
    at_outputs = [snapshot.shares for snapshot in snapshots]
    result = _result(scenario, "filter", time[0], outputs, shares, at_outputs, by_filter)
    return replace(result, added=_added(shares, marks, time[0]))


def _with_algorithm(result: BudgetResult, error: Array) -> BudgetResult:
    """Add the algorithm's own error, unless it is negligible."""
    if (np.abs(error) <= np.maximum(_NEGLIGIBLE * result.sigma(), _ROUNDING)).all():
        return result
    return replace(result, sources=(*result.sources, ALGORITHM), mean={**result.mean, ALGORITHM.name: error})


def _sensed(scenario: Scenario, ideal: ImuData, trajectory: Trajectory) -> ImuData:
    """Return the readings of the scenario's own run, from which its filter judges whether the vehicle stands still."""
    errors = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    readings = read(trajectory, ideal, scenario.imu, scenario.seed, errors)[1]
    return readings.compensated or readings.imu


def _result(
    scenario: Scenario,
    kind: str,
    start: float,
    outputs: Array,
    shares: Shares,
    snapshots: Sequence[Snapshot],
    by_filter: Array | None,
) -> BudgetResult:
    """Combine the columns of each source."""
    sources, covariance, mean = _by_source(shares, snapshots)
    result = BudgetResult(
        scenario, kind, outputs - start, tuple(sources), covariance, mean, by_filter, media=BudgetMedia()
    )
    sigma = result.sigma()
    small = {  # rounding and interpolation, in readings without errors of this kind
        name
        for name, error in mean.items()
        if any(isinstance(s, SensorGiven) and s.source.name == name for s in shares.sensors)
        and (np.abs(error) <= _NEGLIGIBLE * sigma).all()
    }
    return replace(
        result,
        sources=tuple(source for source in sources if source.name not in small),
        mean={name: error for name, error in mean.items() if name not in small},
    )


def _by_source(
    shares: Shares, snapshots: Sequence[Snapshot]
) -> tuple[list[Source], dict[str, Array], dict[str, Array]]:
    """Return the sources with an effect, the covariances of the random ones, and the errors of the others."""
    sensitivity = np.array([snapshot.sensitivity for snapshot in snapshots])
    covariance: dict[str, Array] = {}
    mean: dict[str, Array] = {}
    sources = []
    for source in shares.sources:
        if source.name not in shares.parts:
            covariance[source.name] = np.array([snapshot.covariances[source.name] for snapshot in snapshots])
            sources.append(source)
            continue
        columns, size = shares.parts[source.name]
        part = sensitivity[:, :, columns]
        part = part * size
        if not part.any():
            continue
        sources.append(source)
        if source.kind == "random":
            covariance[source.name] = part @ part.transpose(0, 2, 1)
        else:
            mean[source.name] = part.sum(axis=2)
    return sources, covariance, mean


def _added(shares: Shares, marks: Marks | None, start: float) -> Added | None:
    """Return what the intervals between the marks add."""
    if marks is None or not marks.changes:
        return None
    _, covariance, mean = _by_source(shares, marks.changes)
    edges = np.array([marks.begin, *marks.reached]) - start
    return Added(edges[:-1], edges[1:], covariance, mean)
