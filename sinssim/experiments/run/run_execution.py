"""One run from end to end: fly or read a log, sense, navigate, compare, filter, record."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import InputError, RunError, SinssimError
from sinssim.exhibits import Exhibits, Item
from sinssim.experiments.run.error_exhibits import (
    error_table,
    failure_numbers,
    figure_charts,
    horizontal_of,
    passage_numbers,
    requirement_numbers,
    requirement_verdicts,
    worse_than_inertial,
)
from sinssim.experiments.run.filter_exhibits import filter_exhibits
from sinssim.experiments.run.filter_summary import Moment, filter_numbers, moments
from sinssim.experiments.run.parts import parts_of
from sinssim.experiments.run.parts.motion_source import best_solution
from sinssim.experiments.run.run_files import RunWriter, about, keep, write_messages
from sinssim.experiments.run.run_report import FirstSections, first_sections, run_exhibits
from sinssim.experiments.run.run_result import PlaneRun, Reached, Run
from sinssim.experiments.run.run_streams import streams_of_run
from sinssim.experiments.run.sensor_exhibits import SensorComparison, sensor_comparisons
from sinssim.experiments.run.summary_types import RunSummary, StageEntries
from sinssim.logs.stored_run import ErrorRule
from sinssim.progress import Progress, shown
from sinssim.recording.page import page_of
from sinssim.recording.result import Media, RunDirectory, flagged, plain
from sinssim.recording.streams import Stream
from sinssim.scenario import Scenario
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.planned_limits import check_route, check_route_flown, check_times, warn_of_limits
from sinssim.simulation.foreign_navigator import check_programs, ended_with_errors, messages_of
from sinssim.simulation.navigation_stage import Navigated, aid, before_navigation, best_reference, navigate
from sinssim.simulation.total_system_error import check_path
from sinssim.simulation.truth_and_sensors import (
    STAGES,
    RecordedMotion,
    Stages,
    Truth,
    planned,
    sense,
    sense_recorded,
    truth_along,
)
from sinssim.statistics.requirements import Requirement, parse_requirements
from sinssim.strapdown.engine_assembly import check_own_files
from sinssim.strapdown.navigation_error import NO_NUMBERS, error_numbers_of, known_error_numbers_of
from sinssim.system.files import as_directory
from sinssim.system.process import give_back_memory, map_large_arrays
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.guidance import Guided
from sinssim.truth.flight.leg import not_attained
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.recording.rerun_file import Watching


def run(
    scenario: Scenario | str | Path,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    require: str | Requirement | Iterable[str | Requirement] = (),
    progress: Progress | bool | None = None,
    viewer: Watching | None = None,
    flown: FlightLog | None = None,
) -> Run | PlaneRun:
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
        require: requirements on the errors of this run, such as "tse(run) <= 4 nmi"; their verdicts are in the summary.
        progress: called with one of `STAGES` and the fraction done, 0…1; "filter: " and what is tried while
            `filter.diagnose` searches. True shows a bar for each stage.
        viewer: shows the recording of a directory while it is written, see `sinssim.recording.rerun_viewer.LiveViewer`.
        flown: the flight, if it has been flown already.

    Returns:
        The finished run; that of a one-component scenario is a `PlaneRun`.

    Raises:
        InputError: the scenario or the directory cannot be used, a leg cannot be flown, or the disk is full.
        RunError: navigation failed with every algorithm.

    Warns:
        SinssimWarning: a leg of the flight is beyond the limits of the aircraft.
    """
    scenario = as_scenario(scenario, overrides)
    check_own_files(scenario.navigation.algorithms, scenario.navigation.frame)
    check_programs(scenario)
    wanted = parse_requirements(require)
    if wanted and (scenario.log is not None or scenario.one_component is not None):
        raise InputError(
            f"{wanted[0].text!r} is judged by the true motion, which the scenario {scenario.name} has not."
        )
    check_path(scenario, wanted)
    with shown(progress, STAGES) as report, ended_with_errors():
        return _run(scenario, directory, overwrite, Stages(report), wanted, viewer, flown)


def _run(
    scenario: Scenario,
    directory: Path | str | None,
    overwrite: bool,
    clock: Stages,
    require: Sequence[Requirement],
    viewer: Watching | None,
    flown: FlightLog | None,
) -> Run | PlaneRun:
    """Compute a run by what its scenario describes; leave what a failed one had."""
    folder = None if directory is None else RunDirectory(as_directory(directory), overwrite=overwrite)
    execution = Execution(scenario, folder, clock, require, viewer, flown)
    try:
        if scenario.one_component is not None:
            from sinssim.experiments.run.one_component_exhibits import compute_one_component

            return compute_one_component(scenario, folder, clock, PlaneMedia(), viewer)
        return execution.run()
    except BaseException as error:
        if folder is not None:
            _leave(folder, execution.reached, clock, error)
        raise


class Execution:
    """A run in progress.

    Attributes:
        reached: its complete stages.
    """

    def __init__(
        self,
        scenario: Scenario,
        folder: RunDirectory | None,
        clock: Stages,
        require: Sequence[Requirement] = (),
        viewer: Watching | None = None,
        flown: FlightLog | None = None,
    ) -> None:
        """Begin a run that is judged by some requirements; nothing is written or shown without a folder."""
        self.reached, self._require, self._viewer, self._flown = Reached(scenario), require, viewer, flown
        self._folder, self._clock = folder, clock
        self._streams = folder is not None and scenario.recording.has_streams
        self._report = folder is not None and scenario.recording.has_report
        self._stack = ExitStack()
        self._writer: RunWriter | None = None
        self._kinds: tuple[SensorComparison, ...] = ()
        self._drawn: FirstSections | None = None
        self._inertial: dict[str, tuple[Array, Array]] = {}  # horizontal errors beside the filter's
        self._numbers: dict[str, dict[str, float]] = {}
        self._found: StageEntries = {}

    @property
    def _scenario(self) -> Scenario:
        return self.reached.scenario

    @property
    def _navigated(self) -> Navigated:
        assert self.reached.navigated is not None  # the stage is complete
        return self.reached.navigated

    def run(self) -> Run:
        """Compute the run and write it.

        Raises:
            InputError: the scenario or the directory cannot be used.
            RunError: navigation failed with every algorithm.
        """
        simulated = self._scenario.log is None
        with self._stack:
            if simulated:
                self._simulate()
            else:
                self._read_log()
            self._navigate()
            if simulated:
                self._compare()
            if self._scenario.filter is not None:
                if simulated:
                    self._make_room()
                self._filter()
            if not simulated:
                self._compare()
            self._finish_writing()
        give_back_memory()
        return self._finished()

    def _simulate(self) -> None:
        """Fly and sense."""
        scenario = self._scenario
        check_times(scenario)
        if scenario.filter is not None:
            from sinssim.scenario import filter_model as filter_states
            from sinssim.scenario.run_memory import check_memory

            lines, scenario = filter_states.choice(scenario), filter_states.with_states(scenario)
            self.reached = replace(self.reached, scenario=scenario, about_filter=lines)
            check_memory(scenario, recorded=self._folder is not None)
            map_large_arrays()  # so that what the stages before the filter free leaves no gaps
        check_route(scenario)
        trajectory, guided = self._fly()
        with self._clock("truth"):
            truth = truth_along(trajectory, scenario, guided)
        self.reached = replace(self.reached, last=truth)
        check_route_flown(scenario, truth.time, truth.state)
        if self._streams:
            with self._clock("record"):
                writer = self._open(truth.time, truth.state, trajectory.events, truth.ellipsoid)
                writer.flown(truth, () if scenario.aiding is None else scenario.aiding.outages)
        with self._clock("imu"):
            sensed = sense(scenario, truth)
            parts = parts_of(before_navigation(scenario, sensed))
            self.reached = replace(self.reached, last=sensed, parts=parts)
            if self._folder is not None:
                self._kinds = sensor_comparisons(sensed)
            if self._writer is not None:
                self._writer.sensed(sensed, self._kinds, [event for part in parts.values() for event in part.events()])

    def _fly(self) -> tuple[Trajectory, Guided | None]:
        """Fly, and note whether the flight came from the cache; None for another motion."""
        from sinssim.scenario.true_motion import fly, true_motion
        from sinssim.simulation.guided_passes import closed_loop, is_guided

        flown: list[float] = []  # a cached flight jumps to 1

        def flying(fraction: float) -> None:
            flown.append(fraction)
            self._clock.report("flight", fraction)

        scenario, guided = self._scenario, None
        with self._clock("flight"):
            if self._flown is not None:
                trajectory = true_motion(scenario, flying, errors=self._flown)
                flying(1.0)
            elif is_guided(scenario):
                warn_of_limits(scenario)
                trajectory, guided = closed_loop(scenario, flying, partial(rehearse, scenario))
            else:
                trajectory = fly(scenario, flying, partial(rehearse, scenario))
        self._found["flight_cached"] = None if scenario.flight is None else min(flown) == 1.0
        if missed := not_attained(trajectory.events):
            self._found["not_attained"] = missed
        return trajectory, guided

    def _read_log(self) -> None:
        """Read recorded sensors."""
        with self._clock("imu"):
            plan = planned(self._scenario, recorded=self._folder is not None)
            self.reached = replace(self.reached, scenario=plan.scenario, about_filter=plan.about_filter)
            self.reached = replace(self.reached, last=sense_recorded(plan.scenario, plan.motion))

    def _navigate(self) -> None:
        """Navigate by each algorithm."""
        with self._clock("navigate"):
            assert self.reached.sensed is not None  # the stage is complete
            try:
                navigated = navigate(self._scenario, self.reached.sensed)
            except RunError:
                if self._writer is not None:
                    self._writer.parts(self.reached.parts)
                raise
        self.reached = replace(self.reached, last=navigated)
        if self._folder is not None:
            with self._folder.writing():
                write_messages(self._folder.path, messages_of(navigated.solutions, navigated.lacking))

    def _compare(self) -> None:
        """Compare the solutions with the truth or the best reference, and compute what only some runs have."""
        numbers_of = error_numbers_of
        with self._clock("navigate"):
            navigated = self._navigated
            if isinstance(navigated.truth, RecordedMotion):
                numbers_of = known_error_numbers_of
                best = best_reference(navigated.truth, self.reached.aided, navigated.solutions)
                navigated = navigated.compared_with(best)
                self.reached = replace(self.reached, last=navigated)
            errors = navigated.errors
            self._numbers = {
                name: numbers_of(partial(list, [errors[name]])) if name in errors else NO_NUMBERS
                for name in self._scenario.solution_names
            }
            self._found["failures"] = failure_numbers(navigated.failures)
            self._found["singularities"] = plain(passage_numbers(navigated.solutions))
            parts = parts_of(navigated)
            for part in parts.values():
                part.enter(part.numbers())
        for name, part in parts.items():
            if self._report and part.takes_long:
                with self._clock("budget"):
                    parts[name] = part.explain()
        self.reached = replace(self.reached, parts=parts)
        if self.reached.aided is not None:
            with self._clock("filter"):
                self._aid_parts()
        if self._scenario.filter is None:
            self._judge()
        if self._writer is not None:
            with self._clock("record"):
                self._writer.navigated(navigated, parts, self._error_rule())

    def _judge(self) -> None:
        """Judge the requirements by the errors of the last solution."""
        if self._require:
            verdicts = requirement_verdicts(self.reached, self._require)
            self._found["requirements"] = plain([requirement_numbers(verdict) for verdict in verdicts])

    def _error_rule(self) -> ErrorRule | None:
        """Return how the stored errors follow from truth and solution; None for recorded sensors."""
        if isinstance(self._navigated.truth, RecordedMotion):
            return None
        ellipsoid = self._navigated.truth.ellipsoid
        return ErrorRule(ellipsoid.a, ellipsoid.f, self._navigated.axes)

    def _make_room(self) -> None:
        """Draw what needs every sample, and let it go: the filter needs none of it, and takes the most memory."""
        self._draw()
        filters = {of.name for of in self._scenario.filters} | {of.name for of in self._scenario.navigator}
        inertial = {name: error for name, error in self._navigated.errors.items() if name not in filters}
        self._inertial = horizontal_of(inertial)
        self._kinds, navigated = (), self._navigated.light()
        parts = {name: part.on(navigated, None) for name, part in self.reached.parts.items()}
        self.reached = replace(self.reached, last=navigated, parts=parts)
        give_back_memory()

    def _draw(self) -> None:
        """Draw the sections of a simulation's report that need every sample, once."""
        if self._report and self._drawn is None and isinstance(self.reached.truth, Truth):
            with self._clock("record"):
                self._drawn = first_sections(self.reached, self._kinds)

    def _filter(self) -> None:
        """Run the filter."""
        with self._clock("filter"):
            aided = aid(self._scenario, self._navigated.sensed, self._clock.within("filter"))
            self.reached = replace(self.reached, aided=aided)
            self._found["filter"] = plain(filter_numbers(aided, self._scenario))
            if self._inertial:
                self._found["filter"]["remarks"] += worse_than_inertial(aided, self._inertial)
                self._aid_parts()
            self._judge()
        give_back_memory()
        if self._writer is not None:
            with self._clock("record"):
                assert isinstance(self.reached.truth, Truth)  # what was recorded is written later
                self._writer.filtered(aided, self._of_filter(), self._faults(), self.reached.truth.trajectory)
                self._writer.parts({name: part for name, part in self.reached.parts.items() if part.after_filter})

    def _faults(self) -> list[Moment]:
        time = self._navigated.truth.time
        return moments(self._scenario, self._found["filter"]["detections"], (float(time[0]), float(time[-1])))

    def _of_filter(self) -> list[Item]:
        """Return what the filter has to show."""
        time = self._navigated.truth.time
        assert self.reached.aided is not None  # the filter has run
        span = (float(time[0]), float(time[-1]))
        return list(filter_exhibits(self.reached.aided, self._found["filter"], plain(self._numbers), span))

    def _aid_parts(self) -> None:
        """Compute what the filter changes in what only some runs have."""
        parts = {name: part.on(self._navigated, self.reached.aided) for name, part in self.reached.parts.items()}
        for part in parts.values():
            part.enter(part.with_filter())
        self.reached = replace(self.reached, parts=parts)

    def _open(self, time: Array, motion: NavState, events: tuple[FlightEvent, ...], ellipsoid: Ellipsoid) -> RunWriter:
        """Begin to write streams and recording, with the motion that they show."""
        assert self._folder is not None  # streams are written to it
        self._stack.enter_context(self._folder.writing())
        self._writer = RunWriter(self._folder.path, self._scenario, time, motion, events, ellipsoid, self._viewer)
        return self._stack.enter_context(self._writer)

    def _finish_writing(self) -> None:
        """Write what is left, and wait until it is written."""
        if self._streams and isinstance(self._navigated.truth, RecordedMotion):
            with self._clock("record"):
                self._write_recorded(self._navigated.truth)
        self._draw()  # while the writer's threads write
        if self._writer is not None:
            with self._clock("record"):
                self._writer.finish(
                    [error_table(plain(self._numbers))], lambda fraction: self._clock.report("record", 0.99 * fraction)
                )

    def _write_recorded(self, motion: RecordedMotion) -> None:
        """Write a run on recorded sensors, whose best solution stands for the motion."""
        navigated, aided = self._navigated, self.reached.aided
        s = best_solution(navigated, aided)[1]
        shown = NavState(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)
        log, sensed = motion.prepared.log, navigated.sensed
        writer = self._open(s.time, shown, motion.events, motion.ellipsoid)
        writer.recorded(shown, sensed.measured, sensed.readings.compensated, log.reference)
        writer.without_satellites(s.time, shown, log.outages)
        writer.navigated(navigated, self.reached.parts, None)
        if aided is not None:
            writer.filtered(aided, self._of_filter(), self._faults(), None)

    def _finished(self) -> Run:
        """Return the run with its summary, and complete its directory."""
        reached, navigated = self.reached, self._navigated
        time = navigated.truth.time
        entries = {
            **about(self._scenario, self._clock, "finished"),
            "start_s": float(time[0]),
            "end_s": float(time[-1]),
            **self._entries(),
        }
        give_back_memory()
        summary, directory = cast("RunSummary", entries), None
        if self._folder is not None:
            report = page_of(run_exhibits(reached, summary, self._drawn)) if self._report else None
            directory = keep(self._folder, self._scenario, reached.about_filter, summary, report)
        return Run(
            self._scenario, navigated, reached.aided, reached.parts, entries, directory, reached.about_filter,
            media=RunMedia(),
        )  # fmt: skip

    def _entries(self) -> dict[str, object]:
        """Return the entries of the summary that follow from the stages, in order."""
        parts = {name: plain(part.entry) for name, part in self.reached.parts.items() if part.entry is not None}
        known = {
            **self._found, "algorithms": plain(self._numbers), **parts,
            "flagged_samples": flagged(self._navigated.sensed.measured),
        }  # fmt: skip
        first = ("flight_cached", "not_attained", "flagged_samples")
        if isinstance(self._navigated.truth, Truth):
            order = (*first, "algorithms", "singularities", "failures", *parts, "filter", "requirements")
        else:
            between = (name for name in parts if name != "outages")
            order = (*first, "singularities", "failures", *between, "algorithms", "filter", "outages")
        return {name: known[name] for name in order if name in known}


def rehearse(scenario: Scenario) -> None:
    """Load the modules that a run needs after its flight, and compile missing kernels, by a short flight."""
    from sinssim.truth.curve import Curve

    scenario = scenario.model_copy(update={"navigator": ()})
    interval = 1.0 / scenario.imu.rate_hz
    knots = interval * np.arange(101)
    position = geodetic_to_ecef(0.8 + 1e-5 * knots, 0.2 + 1e-5 * knots, np.full(len(knots), 1000.0))
    with suppress(SinssimError):  # errors of the scenario appear in the run itself
        curve = Curve(knots, position, np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1)))
        sensed = sense(scenario, truth_along(curve, scenario))
        navigate(scenario, sensed)
        if scenario.filter is not None:
            aid(scenario, sensed)


def _leave(folder: RunDirectory, reached: Reached, clock: Stages, error: BaseException) -> None:
    """Keep the recorded part of a run that ended early, if the flight was done; otherwise remove it."""
    scenario, kept = reached.scenario, reached.scenario.recording
    begun = folder.path / ("recording.rrd" if kept.has_recording else "streams")
    if not (begun.exists() if kept.has_streams else reached.last is not None):
        folder.discard()
        return
    status = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
    message = str(error) if isinstance(error, SinssimError) else f"{type(error).__name__} {error}".rstrip()
    summary = cast("RunSummary", about(scenario, clock, status, message))
    try:
        simulated = scenario.one_component is None and scenario.log is None
        report = page_of(run_exhibits(reached, summary)) if simulated and kept.has_report else None
    except Exception:  # the report itself may have failed: its error is the one being raised
        report = None
    place = keep(folder, scenario, reached.about_filter, summary, report, beside=status)
    error.add_note(f"The {'recording' if kept.has_recording else 'run'} up to that time is in {place}.")


class RunMedia(Media[Run]):
    """Numbers, streams, figure and files of a run."""

    def streams(self, result: Run) -> Iterator[Stream]:
        yield from streams_of_run(result)

    def exhibits(self, result: Run) -> Exhibits:
        return run_exhibits(result, cast("RunSummary", result.summary))

    def figure(self, result: Run, quantity: str | None = None) -> Any:
        from sinssim.recording.figures import figure_of

        return figure_of(figure_charts(result))

    def save(self, result: Run, directory: Path, *, overwrite: bool) -> Path:
        return _saved(result.scenario, directory, overwrite)


class PlaneMedia(Media[PlaneRun]):
    """Exhibits and files of a run in a vertical plane."""

    def streams(self, result: PlaneRun) -> Iterator[Stream]:
        raise InputError(
            "a run with [one_component] has its streams in its run directory alone: run it with one, and read "
            "streams/*.parquet."
        )

    def figure(self, result: PlaneRun, quantity: str | None = None) -> Any:
        raise InputError(
            f"the run {result.scenario.name} has no solution in three dimensions with errors to draw; its report and "
            "its recording show what it has."
        )

    def exhibits(self, result: PlaneRun) -> Exhibits:
        from sinssim.experiments.run.one_component_exhibits import plane_exhibits

        return plane_exhibits(result.scenario, result.one_component, cast("RunSummary", result.summary))

    def save(self, result: PlaneRun, directory: Path, *, overwrite: bool) -> Path:
        return _saved(result.scenario, directory, overwrite)


def _saved(scenario: Scenario, directory: Path, overwrite: bool) -> Path:
    """Compute a run again, with the same numbers, into a directory."""
    place = run(scenario, directory, overwrite=overwrite).directory
    assert place is not None
    return place
