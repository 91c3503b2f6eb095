"""Runs a comparison of algorithms, every one on identical samples, several at a time.

The instants of its errors, and errors in further coordinates. Finished navigations are kept in the study's directory,
so that an interrupted study can be continued.
"""

from __future__ import annotations

import functools
import itertools
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, RunError
from sinssim.experiments.experiment_directory import Experiment
from sinssim.experiments.run.run_streams import CoordinateStreams
from sinssim.experiments.studies import attitude_cost, step_cost
from sinssim.experiments.studies.attitude_claims import compare_headings
from sinssim.experiments.studies.claims import decide, picks
from sinssim.experiments.studies.study_directory import Navigated, Say, StudyDirectory, cases_of, digests
from sinssim.experiments.studies.study_exhibits import StudyMedia, write_study
from sinssim.experiments.studies.study_results import (
    Case,
    CoordinateError,
    Engine,
    ErrorGrowth,
    Row,
    StudyResult,
    fit_orders,
)
from sinssim.experiments.studies.study_schema import (
    Part,
    Study,
    StudyMotion,
    expected_seconds,
    motion_facts,
    scenario_of,
    trajectory_of,
    with_set,
)
from sinssim.experiments.workload import (
    LIMIT_MINUTES,
    Threads,
    check_duration,
    check_limit,
    check_workers,
    flight_wait,
    work_through,
)
from sinssim.progress import Progress, shown
from sinssim.sensors.sensor_set_readings import Readings, read
from sinssim.statistics.circular_error import mean_rate, rate_uncertainty
from sinssim.strapdown.attitude import REGISTRY
from sinssim.strapdown.frames.route_pole import route_pole
from sinssim.strapdown.mechanization import OF_TRUTH, Mechanization
from sinssim.strapdown.navigation_error import NavError, error_numbers, navigation_error
from sinssim.system.process import machine_memory
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, UG

Rows = NDArray[np.intp]

_EVALUATED = 4096  # evenly spread instants for statistics
_KEPT = 512  # of these, kept for plots over time
_EARLY = 128  # further instants for plots, evenly spread over the logarithm of time


class Instants(NamedTuple):
    """Rows at which errors are taken; which of these are evenly spread, for statistics; which are kept for plots."""

    taken: Rows
    even: Rows
    kept: Rows


def instants(count: int) -> Instants:
    """Return the rows at which errors are taken."""
    even = _spread(count, _EVALUATED)
    early = np.geomspace(1, max(count - 1, 1), min(count - 1, _EARLY)).round().astype(np.intp)
    taken = np.union1d(even, early)
    at = np.searchsorted(taken, even)
    return Instants(taken, at, np.union1d(at[_spread(len(at), _KEPT)], np.searchsorted(taken, early)))


def rows_of(solution: NavSolution, rows: Rows) -> NavSolution:
    """Return some rows of a solution."""
    names = ["time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect"]
    names += ["azimuth"] if solution.azimuth is not None else []
    return replace(solution, events=(), **{name: getattr(solution, name)[rows] for name in names})


def drifts(error: NavError, rows: Rows) -> dict[str, float]:
    """Return the slopes of velocity and attitude errors and their standard errors, as `results.Row` names them.

    Lines through the origin are fitted to the evenly spread `rows`; slopes do not depend on the duration of the motion.
    """
    time = error.time[rows] - error.time[0]
    slopes = {}
    for name, unit, values, scale in (
        ("velocity_drift", "ug", error.speed, UG),
        ("attitude_drift", "arcsec_h", error.angle, ARCSEC / 3600.0),
    ):
        slopes[f"{name}_{unit}"] = float(mean_rate(time, values[rows])) / scale
        slopes[f"{name}_uncertainty_{unit}"] = float(rate_uncertainty(time, values[rows])) / scale
    return slopes


def _spread(count: int, most: int) -> Rows:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def coordinate_errors(
    case: Case, kinds: Sequence[str], truth: NavState, solution: NavSolution, ellipsoid: Ellipsoid
) -> list[CoordinateError]:
    """Return the errors of a solution against true states in further coordinates, see `scenario.tables.COORDINATES`.

    Conditional coordinates are those of the great circle along the true initial velocity. Along a frame's axes both
    motions are resolved with the solution's azimuth.
    """
    if not kinds:
        return []
    begin = (float(truth.latitude[0]), float(truth.longitude[0]))
    pole = route_pole(None, *begin, truth.velocity_ned[0])
    engine_ellipsoid = ellipsoid if case.ellipsoid == OF_TRUTH else ellipsoid_by_name(case.ellipsoid)
    names = ("latitude", "longitude", "height", "velocity_ned", "q_nb")
    true = replace(solution, **{name: getattr(truth, name) for name in names})  # with the solution's azimuth
    differences = []
    for kind in kinds:
        values = [
            CoordinateStreams((kind,), None, of, pole, begin, float(solution.time[0])).of("", solution.time, motion)
            for of, motion in ((ellipsoid, true), (engine_ellipsoid, solution))
        ]
        for right, computed in zip(*values, strict=True):
            for vector, other in zip(right.vectors, computed.vectors, strict=True):
                every = slice(0, len(solution.time))
                errors = _errors(vector.columns, vector.values[every], other.values[every])
                differences += [
                    CoordinateError(case, kind, column, float(np.abs(error).max()), float(error[-1]))
                    for column, error in errors
                ]
    return differences


def _errors(columns: tuple[str, ...], true: Array, computed: Array) -> Iterator[tuple[str, Array]]:
    """Yield the error of each column: a difference, of an angle within ±π, of a quaternion the angle of rotation."""
    if len(columns) == 4:
        turn = rotation.multiply(computed, rotation.conjugate(true))
        yield "attitude_rad", np.linalg.norm(rotation.rotation_vector_from_quaternion(turn), axis=1)
        return
    for number, column in enumerate(columns):
        error = computed[:, number] - true[:, number]
        yield column, (np.mod(error + np.pi, 2.0 * np.pi) - np.pi if column.endswith("_rad") else error)


_SAMPLE_SECONDS = 1.5e-6  # time to make one sample of the truth
_CASE_SECONDS = 0.03  # time to check a sample, and to compare it with the truth
_SAMPLE_BYTES = 300  # memory per sample at a block's highest rate, with the solutions in progress


def compare(
    study: Study,
    directory: Path | str | None = None,
    *,
    resume: bool = False,
    overwrite: bool = False,
    limit_minutes: float = LIMIT_MINUTES,
    threads: int | None = None,
    progress: Progress | bool | None = None,
    say: Say | None = None,
) -> StudyResult:
    """Run a study, decide its claims, and write its report.

    An interrupted study keeps its finished navigations with a report of them, and can be continued. The options are
    those of `sinssim.compare`.
    """
    check_limit(limit_minutes)
    check_workers(threads)
    StudyDirectory.check_options(directory, resume=resume, overwrite=overwrite)
    comparison = StudyResult(study, media=StudyMedia())
    with (
        shown(progress) as report,
        StudyDirectory.opened(directory, study, resume=resume, overwrite=overwrite) as folder,
    ):
        comparison.directory = None if folder.is_draft else folder.path
        number = min(2, os.cpu_count() or 1) if threads is None else threads
        work = _Work(comparison, folder, number, report, say or (lambda text: None))
        with folder.reported(work, report):
            work.run(limit_minutes)
    return comparison


class _Work(Experiment):
    """The computation of the navigations of a study that are not finished."""

    def __init__(self, result: StudyResult, folder: StudyDirectory, threads: int, report: Progress, say: Say) -> None:
        self._result, self._folder, self._threads, self._report, self._say = result, folder, threads, report, say
        self._blocks: list[_Block] = []
        self._begin = time.perf_counter()

    @property
    def finished(self) -> str:
        finished = sum(len(block.navigated) for block in self._blocks)
        return f"{finished} of {sum(block.part.cases for block in self._blocks)} navigations" if finished else ""

    def conclude(self, status: str) -> None:
        result = self._result
        result.status, result.seconds = status, time.perf_counter() - self._begin
        result.orders = [order for part in result.study.parts for order in fit_orders(result.of_part(part.title))]
        result.verdicts = decide(result)
        result.picks = picks(result)

    def write(self, place: Path) -> None:
        if not self._result.rows:
            raise InputError("the study stopped before its first motion was there: there is no new report.")
        write_study(self._result, place)

    def run(self, limit_minutes: float) -> None:
        """Run the navigations that are not finished, those of one motion after one another."""
        study = self._result.study
        expected = {id(m): expected_seconds(m) for part in study.parts for m in part.motions}  # also finds mistakes
        for part, motion in _pairs(study):
            _check_part(part)
            flown = motion.scenario is not None and motion.duration_s is None  # its duration is known after the flight
            if not flown:
                _check_length(part, motion, expected[id(motion)])
        for part, motion in _pairs(study):
            names = digests(study, part, motion)
            kept = ((case, self._folder.read(case, digest, self._say)) for case, digest in names.items())
            navigated = {case: navigated for case, navigated in kept if navigated is not None}
            self._blocks.append(_Block(part, motion, expected[id(motion)], self._folder, names, navigated))
        self._measure_costs()
        seen: set[tuple[str | None, tuple[str, ...]]] = set()
        for block in self._blocks:
            motion = block.motion
            whole = _seconds(block.part, motion, block.lasts, self._result.costs, self._threads)
            block.seconds = whole * block.open / block.part.cases
            if (motion.scenario, motion.set) not in seen:
                block.seconds += flight_wait(scenario_of(motion))
            seen.add((motion.scenario, motion.set))
        self._check_size(limit_minutes)
        total, done = sum(block.seconds for block in self._blocks), 0.0
        for block in self._blocks:
            share = block.seconds / total if total else 1.0
            self._run_block(block, 0.02 + 0.98 * done, 0.98 * share)
            done += share

    def _measure_costs(self) -> None:
        """Measure what the study's engines cost, before the threads are busy."""
        result, report = self._result, self._report
        engines = list(dict.fromkeys(itertools.chain.from_iterable(map(_engines, result.study.parts))))
        for number, (algorithm, frame, schedule) in enumerate(engines):
            report(f"Timing {algorithm}", 0.02 * number / len(engines))
            result.costs[algorithm, frame, schedule] = step_cost.measure_cost(algorithm, frame, schedule)
        for algorithm in dict.fromkeys(algorithm for algorithm, *_ in engines):
            report(f"Timing the attitude of {algorithm}", 0.02)
            result.attitude_costs += attitude_cost.attitude_costs(algorithm)

    def _check_size(self, limit_minutes: float) -> None:
        """Raise for a study that would take too long or too much memory."""
        name, blocks = self._result.study.name, self._blocks
        cases = sum(block.open for block in blocks)
        steps = sum(b.lasts * rate * b.open / len(b.part.pace) for b in blocks for rate, *_ in b.part.pace)
        navigations = "1 navigation" if cases == 1 else f"{cases} navigations"
        what, remedy = (
            f"{navigations} of {steps / 1e6:.3g} million samples",
            "Compare fewer rates, algorithms or motions",
        )
        check_duration(name, what, sum(block.seconds for block in blocks), limit_minutes, remedy, self._say)
        largest = max(blocks, key=lambda block: block.lasts * block.part.highest_hz)
        samples = largest.lasts * largest.part.highest_hz
        if samples * _SAMPLE_BYTES > machine_memory():
            raise InputError(
                f"the study {name} would need too much memory: {samples / 1e6:.3g} million samples of "
                f"{largest.motion.label} at {largest.part.highest_hz:g} Hz need about "
                f"{samples * _SAMPLE_BYTES / 1e9:.0f} GB, and this machine has {machine_memory() / 1e9:.0f} GB. Use a "
                "shorter motion or a lower highest rate."
            )

    def _run_block(self, block: _Block, before: float, share: float) -> None:
        """Run the cases of a block; `before` it, and in it, what shares of the whole are done."""
        result, part, motion = self._result, block.part, block.motion
        self._report(f"Motion: {motion.label}", before)
        trajectory = trajectory_of(motion)
        _check_length(part, motion, trajectory.end - trajectory.start)
        result.motions[part.title, motion.label] = motion_facts(motion, trajectory)
        try:
            if block.open or "euler-heading" in part.decides:
                ideal = trajectory.increments(part.highest_hz)
            if "euler-heading" in part.decides:
                ratios = {rate: round(part.highest_hz / rate) for rate in part.rates_hz}
                result.headings += compare_headings(part.title, motion.label, trajectory, ideal, ratios)
            if block.open:
                self._navigate(block, _Truth(trajectory, ideal.time), ideal, before, share)
        finally:
            for case in (case for case in cases_of(part, motion) if case in block.navigated):
                row, history, in_coordinates = block.navigated[case]
                result.rows.append(replace(row, **_costs(case, result)))
                result.coordinate_errors += in_coordinates
                if history is not None:
                    result.histories[case] = history
        order = {part.title: number for number, part in enumerate(result.study.parts)}
        result.rows.sort(key=lambda row: order[row.part])

    def _navigate(self, block: _Block, truth: _Truth, ideal: ImuData, before: float, share: float) -> None:
        """Run the cases of a block that are not finished, those of the same sensors together."""
        part, study = block.part, self._result.study
        todo = [case for case in cases_of(part, block.motion) if case not in block.navigated]
        finished = itertools.count(1)
        for (grade, variant), cases in itertools.groupby(todo, lambda case: (case.sensors, case.variant)):
            imu = with_set(study.block(grade), variant, part.highest_hz)
            _, readings = read(truth.trajectory, ideal, imu, study.seed)
            slower = functools.cache(lambda rate, readings=readings: readings.at(round(part.highest_hz / rate)))

            def keep(task: tuple[Case, Readings], navigated: Navigated) -> None:
                block.keep(task[0], navigated)
                done = before + share * next(finished) / len(todo)
                self._report(f"{block.motion.label}: {task[0].algorithm}", done)

            threads = Threads[tuple[Case, Readings]](
                self._threads, lambda stop: lambda task, part_of_it: _navigated(*task, part, truth, self._result)
            )
            with threads:
                work_through([(case, slower(case.rate_hz)) for case in cases], threads, keep)


@dataclass
class _Block:
    """All cases of one part on one motion, which `lasts` s, and the `seconds` that the open ones take.

    `digests` are the names of all in the study's directory, `navigated` those that are finished.
    """

    part: Part
    motion: StudyMotion
    lasts: float
    folder: StudyDirectory
    digests: dict[Case, str]
    navigated: dict[Case, Navigated]
    seconds: float = 0.0

    @property
    def open(self) -> int:
        """Number of cases to be navigated."""
        return self.part.cases - len(self.navigated)

    def keep(self, case: Case, navigated: Navigated) -> None:
        """Keep a finished case."""
        self.folder.write(self.digests[case], navigated)
        self.navigated[case] = navigated


def _pairs(study: Study) -> Iterator[tuple[Part, StudyMotion]]:
    return ((part, motion) for part in study.parts for motion in part.motions)


def _engines(part: Part) -> Iterator[Engine]:
    """Yield algorithm, frame and schedule of every cost of a part."""
    schedules = dict.fromkeys(schedule or () for _, schedule, _ in part.pace)
    return itertools.product(part.algorithms, part.frames, schedules)


def _check_part(part: Part) -> None:
    """Raise for algorithms and frames that cannot run at a schedule's rates."""
    if not part.schedules_hz:
        return
    for algorithm, frame in itertools.product(part.algorithms, part.frames):
        try:
            Mechanization(algorithm=algorithm, frame=frame, rates_hz=part.schedules_hz[0])
        except InputError as mistake:
            raise InputError(f"part {part.title!r}: {mistake}") from mistake


def _check_length(part: Part, motion: StudyMotion, duration: float) -> None:
    """Raise for a motion that is shorter than one update of an algorithm or one step of a schedule's slow part."""
    from sinssim.strapdown.iteration_windows import WINDOW

    for rate, schedule, _ in part.pace:
        slowest = schedule[2] if schedule else rate
        for algorithm in part.algorithms:
            entry = REGISTRY[algorithm]
            needed = WINDOW if entry.windowed else entry.samples
            if duration * slowest < needed - 1e-6:
                raise InputError(
                    f"part {part.title!r}: the motion {motion.label!r} lasts {duration:g} s; {algorithm} at "
                    f"{slowest:g} Hz needs at least {needed / slowest:g} s"
                    + (f", {needed} samples" if needed > 1 else "")
                    + ". Use a longer motion or a higher rate."
                )


def _seconds(
    part: Part, motion: StudyMotion, duration: float, costs: dict[Engine, step_cost.Cost], threads: int
) -> float:
    """Estimate how long a block takes."""
    each = len(part.gravities) * len(part.curvatures) * len(part.ellipsoids) * len(part.sensors) * len(part.variants)
    ns = sum(
        duration * rate * costs[algorithm, frame, schedule or ()].ns_per_step
        for rate, schedule, _ in part.pace
        for algorithm in part.algorithms
        for frame in part.frames
    )
    seconds = (ns * 1e-9 * each + _CASE_SECONDS * part.cases) / threads
    vibrating = 1 + 40 * bool(motion.vibration)
    seconds += duration * part.highest_hz * _SAMPLE_SECONDS * (vibrating + 0.5 * len(part.sensors))
    return seconds


def _costs(case: Case, comparison: StudyResult) -> dict[str, Any]:
    """Return the costs of a case per sample, as measured in this process, by attribute of its row."""
    step = comparison.costs[case.algorithm, case.frame, case.schedule_hz]
    costs = {"ns_per_step": step.ns_per_step, "operations_per_step": step.operations.total}
    for alone in comparison.attitude_costs:
        if alone.algorithm == case.algorithm and not alone.by_functions:
            costs["attitude_ns_per_step"] = alone.ns_per_step
            costs["attitude_operations_per_step"] = alone.operations.total
    return costs


class _Truth:
    """The true motion, and its heights at the samples."""

    def __init__(self, trajectory: Trajectory, time: Array) -> None:
        self.trajectory = trajectory
        self.initial = trajectory.state(time[0])
        self.height = trajectory.state(time).height

    def reference(self, imu: ImuData) -> Array:
        """Return the true height at the edges of samples, (N+1,) m."""
        ratio = round((len(self.height) - 1) / len(imu))
        return np.ascontiguousarray(self.height[::ratio][: len(imu.time)])


# Long: it computes the many numbers of a case's row.
def _navigated(case: Case, readings: Readings, part: Part, truth: _Truth, comparison: StudyResult) -> Navigated:
    """Run one case and compare it with the truth."""
    from sinssim.strapdown.measured_attitude import navigate_set

    imu = readings.imu
    about: dict[str, Any] = {
        **asdict(case),
        **_costs(case, comparison),
        "samples": len(imu),
        "duration_s": float(imu.time[-1] - imu.time[0]),
    }
    trajectory = truth.trajectory
    height = None if part.vertical == "free" else truth.reference(imu)
    try:
        mechanization = Mechanization(
            algorithm=case.algorithm,
            frame=case.frame,
            gravity=case.gravity,
            ellipsoid=trajectory.ellipsoid.name if case.ellipsoid == OF_TRUTH else case.ellipsoid,
            curvature=case.curvature,
            rates_hz=case.schedule_hz or None,
            slow_quantities=case.slow or "hold",
            vertical=part.vertical,
        )
        solution = navigate_set(readings.imu, readings.attitude, truth.initial, mechanization, height)
    except RunError as failure:
        return Navigated(Row(**about, status="failed", message=str(failure)), None, [])
    except InputError as mistake:
        raise InputError(
            f"part {case.part!r}, motion {case.motion}, {case.algorithm} in the frame {case.frame} at {case.pace} Hz: "
            f"{mistake}"
        ) from mistake
    keep, even, shown = instants(len(solution.time))
    thin = rows_of(solution, keep)
    true = trajectory.state(thin.time)
    error = navigation_error(true, thin, trajectory.ellipsoid)
    numbers: dict[str, Any] = {**error_numbers(NavError(*(getattr(error, f.name)[even] for f in fields(error))))}
    row = Row(
        **about,
        **{**numbers, **drifts(error, even)},
        max_defect=float(np.max(solution.defect)),
        passages=len(solution.events),
        max_damage_arcsec=max((event.damage for event in solution.events), default=0.0) / ARCSEC,
        message=" ".join(event.text for event in solution.events),
    )
    growth = ErrorGrowth(error.time[shown], error.horizontal[shown], error.angle[shown] / ARCSEC)
    return Navigated(row, growth, coordinate_errors(case, part.coordinates, true, thin, trajectory.ellipsoid))
