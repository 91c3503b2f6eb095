"""One run from end to end: fly, sense, navigate, compare, record."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.algorithms import PLATFORM
from sinssim.data import Array
from sinssim.earth.coordinates import geodetic_to_ecef
from sinssim.errors import SinssimError
from sinssim.logs.stored.error_rule import ErrorRule
from sinssim.progress import Progress, shown, silent
from sinssim.recording.report.run_report import draw_sections, run_report
from sinssim.recording.store.directory import RunDirectory
from sinssim.recording.store.summaries.against_inertial import horizontal_of, worse_than_inertial
from sinssim.recording.store.summaries.filter_summary import filter_markdown, filter_numbers
from sinssim.recording.store.summaries.phase_summary import phase_numbers, phases_of
from sinssim.recording.store.summaries.platform_summary import platform_numbers
from sinssim.recording.store.summaries.redundancy_summary import redundancy_numbers
from sinssim.recording.store.summaries.rotation_summary import rotation_numbers
from sinssim.recording.store.summary import (
    NO_NUMBERS,
    diverged,
    error_numbers,
    failures,
    flagged,
    markdown_table,
    plain,
    singularities,
)
from sinssim.scenario.duration import check_times
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.route import check_route, check_route_flown
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.simulation.execute_log import compute_log
from sinssim.simulation.execute_one_component import compute_one_component
from sinssim.simulation.finish import about, keep
from sinssim.simulation.initial_error import initial_state_with_errors
from sinssim.simulation.navigation import height_reference, solve
from sinssim.simulation.phase_sources import add_sources, budgets_of_phases
from sinssim.simulation.result import Run
from sinssim.simulation.stages import STAGES, Stages
from sinssim.strapdown.files import check_own_files
from sinssim.system.memory import give_back_memory, map_large_arrays
from sinssim.truth.flight.shortfall import not_attained

if TYPE_CHECKING:
    from sinssim.error_budget.result import BudgetResult
    from sinssim.estimation.from_scenario.truth_comparison import Aided
    from sinssim.scenario import Scenario
    from sinssim.strapdown.frames.vertical import HeightReadings
    from sinssim.truth.trajectory import Trajectory


def run(
    scenario: Scenario | str | Path,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    progress: Progress | bool | None = None,
) -> Run:
    """Run a scenario: fly, sense, navigate by each algorithm, compare with the truth, and record.

    If an algorithm fails and others do not, the summary lists the failure, the numbers of the algorithm are None, and
    the run continues without it.

    A run that fails or is interrupted after the flight leaves a valid run directory with the results until then, and
    its `summary.json` gives the status. It never replaces an existing run but is kept beside it, with `-failed` or
    `-interrupted` at the end of its name. If the disk is full, nothing is left.

    Args:
        scenario: the scenario, or its file or name.
        directory: run directory to write; nothing is written if not given.
        overrides: settings "key=value", as for `load_scenario`.
        overwrite: whether an existing run in the directory may be replaced.
        progress: called with one of `STAGES` and the fraction done, 0…1; "filter: " and what is tried while
            `filter.diagnose` searches. True shows a bar for each stage.

    Returns:
        The finished run; that of a one-component scenario has `one_component` instead of trajectory and solutions, that
        of recorded sensors has `prepared` and `reference` instead of a trajectory.

    Raises:
        InputError: the scenario or the directory cannot be used, a leg cannot be flown, or the disk is full.
        RunError: navigation failed with every algorithm.

    Warns:
        SinssimWarning: a leg of the flight is beyond the limits of the aircraft.
    """
    scenario = as_scenario(scenario, overrides)
    check_own_files(scenario.navigation.algorithms, scenario.navigation.frame)
    with shown(progress, STAGES) as report:
        return _run(scenario, directory, overwrite, Stages(report))


def _run(scenario: Scenario, directory: Path | str | None, overwrite: bool, stages: Stages) -> Run:
    """Compute a run by what its scenario describes; leave what a failed one had."""
    result = Run(scenario, recorded=directory is not None)
    compute = _compute
    if scenario.one_component is not None:
        compute = compute_one_component
    elif scenario.log is not None:
        compute = compute_log
    if directory is None:
        return compute(result, None, stages)
    folder = RunDirectory(Path(directory), overwrite=overwrite)
    try:
        return compute(result, folder, stages)
    except BaseException as error:
        _leave(folder, result, stages, error)
        raise


# Long: the stages of a run in order, each of which fills in its part of the run.
def _compute(run: Run, folder: RunDirectory | None, stages: Stages) -> Run:
    check_times(run.scenario)
    if run.scenario.filter is not None:
        from sinssim.estimation.from_scenario import filter_states
        from sinssim.estimation.from_scenario.memory import check_memory

        run.about_filter = filter_states.choice(run.scenario)
        run.scenario = filter_states.with_states(run.scenario)
        check_memory(run.scenario, recorded=run.recorded)
        map_large_arrays()  # so that what the stages before the filter free leaves no gaps
    check_route(run.scenario)
    kept = run.scenario.recording
    cached = _fly(run, folder is not None and kept.has_streams, stages)
    check_route_flown(run.scenario, run.time, run.truth)
    of_filter = drawn = None
    of_set: dict[str, Any] = {}
    phases = phases_of(run.trajectory.events, driven=run.scenario.flight is None)
    of_phases: dict[str, Any] = {}
    budgets: dict[str, BudgetResult | str] = {}
    with ExitStack() as stack:
        writer = None
        if folder is not None and kept.has_streams:
            with stages("record"):
                from sinssim.recording.rerun.writer import RunWriter

                stack.enter_context(folder.writing())
                writer = stack.enter_context(
                    RunWriter(folder.path, run.scenario, run.trajectory, run.time, run.truth, run.ideal)
                )
        with stages("imu"):
            _sense(run)
            if writer is not None:
                compensated = None if run.compensated is run.measured else run.compensated
                writer.sensed(run.readings, run.perfect, compensated, run.sensed)
        with stages("navigate"):
            _navigate(run, height_reference(run.scenario, run.trajectory, run.truth.height))
            numbers = {
                name: error_numbers(run.errors[name]) if name in run.errors else NO_NUMBERS
                for name in run.scenario.navigation.algorithms
            }
            run.failures = {**run.failures, **diverged(run.errors)}
            if phases:
                for name, error in run.errors.items():
                    of_phases[name] = phase_numbers(phases, error.time, error.rows)
            section = run.scenario.imu.sensor_set
            if isinstance(section, Redundant):
                found = redundancy_numbers(section, run.readings.monitored, run.without_monitoring)
                of_set = {"redundancy": plain(found)}
            if run.platform is not None and run.true_errors.platform is not None:
                without = run.without_errors_of_turns
                own, by_cause = run.true_errors.platform, run.platform_errors_by_cause
                simulated = run.errors[PLATFORM]
                of = platform_numbers(run.platform, own, run.ideal, run.strapdown, without, by_cause, simulated)
                of_set = {"platform": plain(of)}
            if run.encoders is not None:
                of_set = {"rotation": plain(rotation_numbers(run.without_rotation))}
        if phases and folder is not None and kept.has_report:
            with stages("budget"):
                budgets = budgets_of_phases(run, phases)
            for rows in of_phases.values():
                add_sources(rows, budgets["inertial"], float(run.time[0]))
        if writer is not None:
            with stages("record"):
                if run.encoders is not None:
                    writer.turned(run.encoders, run.without_rotation)
                ellipsoid = run.trajectory.ellipsoid
                rule = ErrorRule(ellipsoid.a, ellipsoid.f, run.axes)
                writer.navigated(run.solutions, run.errors, run.failures, run.without_monitoring, rule)
                if run.platform is not None:
                    without = run.without_errors_of_turns
                    writer.on_platform(run.platform, run.errors[PLATFORM], run.strapdown, without, run.ideal)
        passages = singularities(run.solutions)
        if run.scenario.filter is not None:
            if folder is not None and kept.has_report:
                with stages("record"):
                    drawn = draw_sections(run)
            horizontal = horizontal_of(run.errors)
            run.forget()  # the filter needs none of it, and takes the most memory itself
            give_back_memory()
            with stages("filter"):
                run.aided = _aid(run, stages.within("filter"))
                of_filter = plain(filter_numbers(run.aided, run.scenario))
                of_filter["remarks"] += worse_than_inertial(run.aided, horizontal)
                if phases:
                    fine = run.scenario.aiding is not None and "zero_velocity" in run.scenario.aiding.sensors()
                    of_phases["aided"] = phase_numbers(
                        phases, run.aided.estimate.solution.time, run.aided.error_at, fine
                    )
                    if "filter" in budgets:
                        add_sources(of_phases["aided"], budgets["filter"], float(run.time[0]))
            give_back_memory()
            if writer is not None:
                with stages("record"):
                    writer.filtered(run.aided, filter_markdown(of_filter))
        if folder is not None and kept.has_report and drawn is None:
            with stages("record"):
                drawn = draw_sections(run)  # while the writer's threads write
        if writer is not None:
            with stages("record"):
                writer.finish(markdown_table(numbers), lambda fraction: stages.report("record", 0.99 * fraction))
    run.summary = {
        **about(run.scenario, stages, "finished"),
        "start_s": float(run.time[0]),
        "end_s": float(run.time[-1]),
        "flight_cached": cached,
        **({"not_attained": missed} if (missed := not_attained(run.trajectory.events)) else {}),
        "flagged_samples": flagged(run.measured),
        "algorithms": plain(numbers),
        "singularities": plain(passages),
        "failures": failures(run.failures),
        **_about_track(run.scenario),
        **_about_gravity(run.trajectory),
        **of_set,
        **({"phases": plain(of_phases)} if of_phases else {}),
        **({} if of_filter is None else {"filter": of_filter}),
    }
    give_back_memory()
    if folder is not None:
        run.directory = keep(folder, run, run_report(run, run.summary, drawn) if kept.has_report else None)
    return run


def _fly(run: Run, recorded: bool, stages: Stages) -> bool | None:
    """Fly, and return whether the flight came from the cache; None for another motion."""
    from sinssim.scenario.true_motion import fly

    flown: list[float] = []  # a cached flight jumps to 1

    def flying(fraction: float) -> None:
        flown.append(fraction)
        stages.report("flight", fraction)

    with stages("flight"):
        trajectory = fly(run.scenario, flying, partial(rehearse, run.scenario, recorded))
    with stages("truth"):
        _follow(run, trajectory)
    return None if run.scenario.flight is None else min(flown) == 1.0


def _about_track(scenario: Scenario) -> dict[str, Any]:
    """Return the entry of a track in the summary."""
    if scenario.track is None:
        return {}
    from sinssim.truth.track.fit import fit_numbers

    track = scenario.track.prepared(scenario.truth)
    return {"track": plain(fit_numbers(track.fit))}


def _about_gravity(trajectory: Trajectory) -> dict[str, Any]:
    """Return the entry of the true gravity field in the summary."""
    from sinssim.truth.gravity.disturbed import Disturbed
    from sinssim.truth.gravity.values import gravity_numbers

    return {"gravity": plain(gravity_numbers(trajectory))} if isinstance(trajectory, Disturbed) else {}


def _follow(run: Run, trajectory: Trajectory) -> None:
    """Fill in the true motion and its ideal increments."""
    from sinssim.sensors.imu.emulate import digital

    run.trajectory = trajectory
    ideal = digital(run.block.increments(run.scenario.imu.rate_hz))
    run.time, run.ideal, run.truth = ideal.time, ideal, trajectory.state(ideal.time)


def _sense(run: Run) -> None:
    """Fill in the readings of the sensors, and the compensated increments."""
    from sinssim.sensors.sets.reading import read

    section, true = run.scenario.imu, run.true_errors
    run.perfect, run.readings = read(run.block, run.ideal, section, run.scenario.seed, true)
    run.compensated = run.readings.compensated or run.measured


def rehearse(scenario: Scenario, recorded: bool) -> None:
    """Load the modules that a run needs after its flight, and compile missing kernels, by a short run.

    Args:
        scenario: the scenario, which determines the parts; a hundred samples of straight flight replace its truth.
        recorded: whether the run will be recorded.
    """
    if recorded:
        from sinssim.recording.rerun import rrd, writer  # noqa: F401
    from sinssim.truth.curve import Curve

    interval = 1.0 / scenario.imu.rate_hz
    knots = interval * np.arange(101)
    position = geodetic_to_ecef(0.8 + 1e-5 * knots, 0.2 + 1e-5 * knots, np.full(len(knots), 1000.0))
    run = Run(scenario)
    with suppress(SinssimError):  # errors of the scenario appear in the run itself
        _follow(run, Curve(knots, position, np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1))))
        _sense(run)
        _navigate(run, run.truth.height)
        if scenario.filter is not None:
            _aid(run)


def _navigate(run: Run, height: Array | HeightReadings | None) -> None:
    """Fill in the solutions of the algorithms, and the failures of the others."""
    run.solutions, run.failures = solve(
        run.scenario, run.trajectory, run.compensated, run.readings.attitude, height, run.true_errors, run.truth
    )


def _aid(run: Run, progress: Progress = silent) -> Aided:
    """Run the scenario's filter from the initial state of the inertial solutions."""
    from sinssim.estimation.from_scenario.aided_run import aid_run

    scenario, trajectory = run.scenario, run.trajectory
    start = trajectory.state(trajectory.start)
    error, ellipsoid = scenario.navigation.initial_error, trajectory.ellipsoid
    initial = initial_state_with_errors(start, error, ellipsoid, scenario.seed, run.axes)
    monitored = run.readings.monitored
    return aid_run(
        scenario, trajectory, run.compensated, initial, run.true_errors, monitored=monitored, progress=progress
    )


def _leave(folder: RunDirectory, run: Run, stages: Stages, error: BaseException) -> None:
    """Keep the recorded part of a run that ended early, if the flight was done; otherwise remove it."""
    kept = run.scenario.recording
    begun = folder.path / ("recording.rrd" if kept.has_recording else "streams")
    if not (begun.exists() if kept.has_streams else run.has("time")):
        folder.discard()
        return
    status = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
    message = str(error) if isinstance(error, SinssimError) else f"{type(error).__name__} {error}".rstrip()
    run.summary = about(run.scenario, stages, status, message)
    try:
        simulated = run.scenario.one_component is None and run.scenario.log is None
        report = run_report(run, run.summary) if simulated and kept.has_report else None
    except Exception:  # the report itself may have failed: its error is the one being raised
        report = None
    place = keep(folder, run, report, beside=status)
    error.add_note(f"The {'recording' if kept.has_recording else 'run'} up to that time is in {place}.")
