"""Runs a scenario with recorded sensors and writes its run directory."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.recording.store.summary import NO_NUMBERS, failures, known_error_numbers_of, plain, singularities
from sinssim.simulation.finish import about, keep
from sinssim.simulation.navigation import solve
from sinssim.simulation.outages import first_of, judged_outages
from sinssim.truth.channel import Channel, FlightEvent

if TYPE_CHECKING:
    from sinssim.estimation.from_scenario.recorded_run import Prepared, RecordedAided
    from sinssim.logs.reference import Reference
    from sinssim.progress import Progress
    from sinssim.recording.store.directory import RunDirectory
    from sinssim.simulation.result import Run
    from sinssim.simulation.stages import Stages
    from sinssim.strapdown.frames.vertical import HeightReadings
    from sinssim.truth.trajectory import Trajectory


@dataclass(frozen=True)
class RecordedMotion:
    """What is drawn of a recorded motion beside its states, and where navigation on it starts.

    Attributes:
        first: state that navigation starts from.
        start, end: of the run, s.
        events: events to mark.
        ellipsoid: reference ellipsoid.
        channels: none.
    """

    first: NavState
    start: float
    end: float
    events: tuple[FlightEvent, ...] = ()
    ellipsoid: Ellipsoid = WGS84
    channels: dict[str, Channel] = field(default_factory=dict)

    def state(self, t: Any) -> NavState:
        """Return the state at the start, whatever the instants: nothing else is known before navigation."""
        if np.ndim(t) == 0:
            return self.first
        s, count = self.first, np.shape(t)
        one = np.ones(count)
        return NavState(
            s.latitude * one, s.longitude * one, s.height * one,
            np.tile(s.velocity_ned, (*count, 1)), np.tile(s.q_nb, (*count, 1)),
        )  # fmt: skip


# Long: the stages of a run in order, each of which fills in its part of the run.
def compute_log(run: Run, folder: RunDirectory | None, stages: Stages) -> Run:
    """Navigate on recorded sensors by each algorithm, run the filter, compare, and record.

    Args:
        run: the run to fill, whose scenario has [log].
        folder: run directory to write; nothing is written if None.
        stages: the clock of the run.

    Returns:
        The run, with `prepared` and `reference` in place of a true trajectory.

    Raises:
        InputError: the scenario, a file or the directory cannot be used.
        RunError: navigation failed with every algorithm.
    """
    from sinssim.estimation.from_scenario import filter_states
    from sinssim.estimation.from_scenario.memory import check_memory
    from sinssim.estimation.from_scenario.recorded_run import prepare
    from sinssim.scenario.duration import check_times
    from sinssim.sensors.imu.compensation import compensate
    from sinssim.sensors.sets.reading import Readings

    given = run.scenario
    with stages("imu"):
        run.prepared = prepared = prepare(given)
        run.scenario = prepared.scenario
        if given.filter is not None:
            run.about_filter = filter_states.choice(given, prepared.moved)
        check_times(run.scenario)
        log = prepared.log
        run.time, run.readings = log.imu.time, Readings(log.imu)
        run.compensated = log.imu
        if run.scenario.compensation is not None:
            run.compensated = compensate(log.imu, _known_errors(run))
    motion = RecordedMotion(
        prepared.start.state,
        float(run.time[0]),
        float(run.time[-1]),
        tuple(
            FlightEvent(at, f"GNSS {word}")
            for begin, end in log.outages
            for at, word in ((begin, "withheld"), (end, "available again"))
        ),
    )
    trajectory = cast("Trajectory", motion)
    with stages("navigate"):
        run.solutions, run.failures = solve(run.scenario, trajectory, run.compensated, None, _height(run, prepared))
    if run.scenario.filter is not None:
        check_memory(run.scenario, recorded=run.recorded, of_log=log.rates)
        with stages("filter"):
            run.aided = _aid(run, prepared, trajectory, stages.within("filter"))
    run.reference, whose = _compared_with(run, log.reference)
    run.errors = {name: _error(run.reference, solution) for name, solution in run.solutions.items()}
    numbers = {
        name: known_error_numbers_of(partial(list, [run.errors[name]])) if name in run.errors else NO_NUMBERS
        for name in run.scenario.navigation.algorithms
    }
    about_log = {
        "reference_file": None if log.reference is None else log.reference.name,
        "compared_with": whose,
        "knows": [] if run.reference is None else list(run.reference.knows),
        "notes": [*log.notes, prepared.start.words],
        "time_0_gps_s": None if log.zero is None else round(log.zero.seconds + log.zero.fraction, 6),
    }
    found: dict[str, Any] = {"log": about_log, "algorithms": plain(numbers)}
    if run.aided is not None:
        from sinssim.recording.store.summaries.filter_summary import filter_numbers

        found["filter"] = plain(filter_numbers(run.aided, run.scenario))
        with stages("filter"):
            run.outages = judged_outages(run, prepared)
        if run.outages is not None:
            found["outages"] = plain(run.outages.numbers)
    kept = run.scenario.recording
    if folder is not None and kept.has_streams:
        _record(run, folder, motion, found, stages)
    run.summary = {
        **about(run.scenario, stages, "finished"),
        "start_s": float(run.time[0]),
        "end_s": float(run.time[-1]),
        "flagged_samples": {},
        "singularities": plain(singularities(run.solutions)),
        "failures": failures(run.failures),
        **found,
    }
    if folder is not None:
        from sinssim.recording.report.log_report import log_report

        run.directory = keep(folder, run, log_report(run, run.summary) if kept.has_report else None)
    return run


def _known_errors(run: Run) -> Any:
    """Return the calibration: the errors of the unit that the scenario gives as numbers."""
    from sinssim.alignment.budget import expected_errors

    return expected_errors(run.scenario.imu).mean


def _height(run: Run, prepared: Prepared) -> Array | HeightReadings | None:
    """Return the height reference of the vertical channel: readings of a barometer."""
    if run.scenario.navigation.vertical != "baro-loop":
        return None
    from sinssim.strapdown.frames.vertical import HeightReadings

    for readings in prepared.log.sensed:
        m = readings.measurements
        if m.kind == "baro-height" and len(m) > 1:
            return HeightReadings(m.arrival, m.value[:, 0], float(np.median(np.diff(m.time))))
    raise InputError(
        'navigation.vertical = "baro-loop" needs heights: add an entry of [[log.others]] with kind = "baro-height", or '
        'choose vertical = "free".'
    )


def _aid(run: Run, prepared: Prepared, trajectory: Trajectory, progress: Progress) -> RecordedAided:
    """Run the filter; without a reference it is compared with its own smoothed solution, which has no error then."""
    from sinssim.estimation.from_scenario.recorded_run import (
        aid_recorded,
        all_readings,
        as_reference,
        compare_recorded,
    )
    from sinssim.strapdown.nav_error import NavError

    estimate = aid_recorded(prepared, run.compensated, first_of(run, prepared), progress=progress)
    reference = prepared.log.reference
    if reference is None and estimate.smoothed is not None:
        reference = as_reference("the smoothed solution", estimate.smoothed.solution)
    aided = compare_recorded(estimate, all_readings(prepared), reference, float(run.time[-1]))
    if prepared.log.reference is None and (own := aided.smoothed_error) is not None:
        # it would be zero, up to rounding
        unknown = [np.full_like(error, np.nan) for error in (own.position_ned, own.velocity_ned, own.attitude)]
        aided = replace(aided, smoothed_error=NavError(own.time, *unknown))
    return aided


def _compared_with(run: Run, reference: Reference | None) -> tuple[Reference | None, str | None]:
    """Return what the inertial solutions are compared with, and its name."""
    from sinssim.estimation.from_scenario.recorded_run import as_reference

    if reference is not None:
        return reference, reference.name
    if run.aided is not None and len(run.aided.estimate.time) > 1:
        smoothed = run.aided.estimate.smoothed
        name = "the aided solution" if smoothed is None else "the smoothed solution"
        return as_reference(name, (smoothed or run.aided.estimate).solution), name
    if len(run.solutions) > 1:
        name, solution = next(iter(run.solutions.items()))
        return as_reference(name, solution), f"the solution {name}"
    return None, None


def _error(reference: Reference | None, solution: NavSolution) -> Any:
    from sinssim.strapdown.nav_error import NavError

    if reference is None:
        return NavError(solution.time, *(np.full((len(solution.time), 3), np.nan) for _ in range(3)))
    return reference.error_of(solution)


def _record(run: Run, folder: RunDirectory, motion: RecordedMotion, found: dict[str, Any], stages: Stages) -> None:
    """Write recording and streams."""
    from sinssim.recording.rerun.writer import RunWriter
    from sinssim.recording.store.summaries.filter_summary import filter_markdown
    from sinssim.recording.store.summaries.log_summary import best_solution
    from sinssim.recording.store.summary import markdown_table

    solution = best_solution(run)[1]
    shown = NavState(solution.latitude, solution.longitude, solution.height, solution.velocity_ned, solution.q_nb)
    prepared = run.prepared
    assert prepared is not None
    numbers = {
        name: {key: np.nan if value is None else value for key, value in own.items()}
        for name, own in found["algorithms"].items()
    }
    with stages("record"), ExitStack() as stack:
        stack.enter_context(folder.writing())
        writer = stack.enter_context(
            RunWriter(folder.path, run.scenario, cast("Trajectory", motion), solution.time, shown, None)
        )
        compensated = None if run.compensated is run.measured else run.compensated
        writer.recorded(run.measured, compensated, prepared.log.reference)
        writer.without_satellites(solution.time, shown, prepared.log.outages)
        writer.navigated(run.solutions, run.errors, run.failures, None)
        if run.aided is not None:
            writer.filtered(run.aided, filter_markdown(found["filter"]))
        writer.finish(markdown_table(numbers), lambda fraction: stages.report("record", 0.99 * fraction))
