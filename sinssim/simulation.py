"""One run from end to end: fly, sense, navigate, compare, record."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth import Ellipsoid, geodetic_to_ecef, radii
from sinssim.errors import InputError, RunError, SinssimError
from sinssim.nav_error import NavError, navigation_error
from sinssim.recording.directory import RunDirectory, write_text
from sinssim.recording.filter_summary import filter_markdown, filter_numbers
from sinssim.recording.report import Material, run_report
from sinssim.recording.sensed import sensed
from sinssim.recording.summary import (
    NO_NUMBERS,
    diverged,
    error_numbers,
    failures,
    flagged,
    markdown_table,
    plain,
    singularities,
    versions,
)
from sinssim.scenario.duration import check_times

if TYPE_CHECKING:
    from sinssim.aided import Aided
    from sinssim.scenario import Scenario
    from sinssim.scenario.schema import InitialErrorSection
    from sinssim.strapdown.sensor_sets import Readings
    from sinssim.truth.trajectory import Trajectory

Progress = Callable[[str, float], None]
STAGES = ("flight", "truth", "imu", "navigate", "filter", "record")


@dataclass(frozen=True)
class RunResult:
    """Everything that a run computed.

    Attributes:
        scenario: what was run.
        trajectory: the true motion.
        truth: true states at the IMU's interval edges, `ideal.time`.
        ideal: ideal increments.
        measured: measured increments; those of angle are NaN where sensors measure the attitude instead, and come from
            the differences of accelerometers where there are six.
        readings: everything that the sensors read.
        perfect: what they would have read without errors.
        compensated: measured increments freed of what the calibration knows, the measured ones without a calibration.
        solutions: navigation solutions by algorithm; of those that have one.
        errors: their errors by algorithm.
        aided: the aided solution and all about it, of a scenario with a filter.
        summary: what `summary.json` holds.
        directory: the run directory, None if nothing was recorded.
    """

    scenario: Scenario
    trajectory: Trajectory
    truth: NavState
    ideal: ImuData
    measured: ImuData
    readings: Readings
    perfect: Readings
    compensated: ImuData
    solutions: dict[str, NavSolution]
    errors: dict[str, NavError]
    aided: Aided | None
    summary: dict[str, Any]
    directory: Path | None


def run(
    scenario: Scenario,
    directory: Path | str | None = None,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> RunResult:
    """Run a scenario: fly, sense, navigate by each algorithm, compare with the truth, and record.

    An algorithm that fails where others do not is among the summary's failures, its numbers are None, and the run goes
    on without it.

    A run that fails or is interrupted once the flight is done leaves a valid run directory with what there was, its
    `summary.json` saying so; it never replaces a run that was there, but goes beside it, with `-failed` or
    `-interrupted` at the end of its name. If the disk is full nothing is left.

    Args:
        scenario: what to run.
        directory: run directory to write; nothing is written if not given.
        overwrite: whether a run that is in the directory already may be replaced.
        progress: called with one of `STAGES` and its done fraction 0…1.

    Returns:
        Everything that was computed.

    Raises:
        InputError: the scenario or the directory cannot be used, a leg cannot be flown, the disk is full.
        RunError: the navigation failed by every algorithm.
    """
    stages = _Stages(progress or (lambda stage, fraction: None))
    material = Material(scenario)
    if directory is None:
        return _compute(material, None, stages)
    folder = RunDirectory(Path(directory), overwrite=overwrite)
    try:
        return _compute(material, folder, stages)
    except BaseException as error:
        _leave(folder, material, stages, error)
        raise


def _compute(material: Material, folder: RunDirectory | None, stages: _Stages) -> RunResult:
    from sinssim.sensors.compensation import compensate, draw_calibration
    from sinssim.strapdown.sensor_sets import read
    from sinssim.truth import fly

    scenario = material.scenario
    check_times(scenario)
    flown: list[float] = []  # a kept flight goes to 1 at once

    def flying(fraction: float) -> None:
        flown.append(fraction)
        stages.report("flight", fraction)

    with stages("flight"):
        trajectory = fly(scenario, flying, partial(_rehearse, scenario, folder is not None))
    with stages("truth"):
        ideal = trajectory.increments(scenario.imu.rate_hz)
        truth = trajectory.state(ideal.time)
    material.trajectory, material.time, material.truth = trajectory, ideal.time, truth
    with ExitStack() as stack:
        writer = None
        if folder is not None:
            with stages("record"):
                from sinssim.recording.writer import RunWriter

                stack.enter_context(folder.writing())
                writer = stack.enter_context(RunWriter(folder.path, scenario, trajectory, ideal.time, truth, ideal))
        with stages("imu"):
            perfect, readings = read(trajectory, ideal, scenario.imu, scenario.seed)
            measured = compensated = readings.imu
            if scenario.compensation is not None:
                compensated = compensate(measured, draw_calibration(scenario.imu, scenario.compensation, scenario.seed))
            freed = None if compensated is measured else compensated
            if writer is not None:
                material.sensed = tuple(sensed(readings, perfect, ideal, freed))
                writer.sensed(readings, perfect, freed, material.sensed)
        with stages("navigate"):
            height = _height_reference(scenario, trajectory, truth, ideal.time)
            solutions, errors, failed = _navigate(
                scenario, trajectory, truth, height, replace(readings, imu=compensated)
            )
            numbers = {
                name: error_numbers(errors[name]) if name in errors else NO_NUMBERS
                for name in scenario.navigation.algorithms
            }
            failed |= diverged(errors)
        material.solutions, material.errors = solutions, errors
        if writer is not None:
            with stages("record"):
                writer.navigated(solutions, errors, failed)
        aided, of_filter = None, None
        if scenario.filter is not None:
            with stages("filter"):
                aided = material.aided = _aid(scenario, trajectory, compensated)
                of_filter = plain(filter_numbers(aided, scenario))
            if writer is not None:
                with stages("record"):
                    writer.filtered(aided, filter_markdown(of_filter))
        if writer is not None:
            with stages("record"):
                writer.finish(markdown_table(numbers), lambda fraction: stages.report("record", 0.99 * fraction))
    summary: dict[str, Any] = {
        **_about(scenario, stages, "finished"),
        "start_s": float(ideal.time[0]),
        "end_s": float(ideal.time[-1]),
        "flight_cached": None if scenario.flight is None else min(flown) == 1.0,
        "flagged_samples": flagged(measured),
        "algorithms": plain(numbers),
        "singularities": plain(singularities(solutions)),
        "failures": failures(failed),
        **({} if of_filter is None else {"filter": of_filter}),
    }
    place = _keep(folder, material, summary, run_report(material, summary)) if folder is not None else None
    return RunResult(
        scenario,
        trajectory,
        truth,
        ideal,
        measured,
        readings,
        perfect,
        compensated,
        solutions,
        errors,
        aided,
        summary,
        place,
    )


def _rehearse(scenario: Scenario, recorded: bool) -> None:
    """Load what a run needs after its flight, and compile what is not compiled yet, by going through it once.

    Args:
        scenario: says which parts; a hundred samples of straight flight stand in for its own truth.
        recorded: whether the run will be recorded.
    """
    if recorded:
        from sinssim.recording import writer  # noqa: F401
    from sinssim.strapdown.sensor_sets import read
    from sinssim.truth.curve import Curve

    interval = 1.0 / scenario.imu.rate_hz
    knots = interval * np.arange(101)
    position = geodetic_to_ecef(0.8 + 1e-5 * knots, 0.2 + 1e-5 * knots, np.full(len(knots), 1000.0))
    trajectory = Curve(knots, position, np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1)))
    with suppress(SinssimError):  # what is wrong with the scenario shows in the run itself
        ideal = trajectory.increments(scenario.imu.rate_hz)
        _, readings = read(trajectory, ideal, scenario.imu, scenario.seed)
        there = trajectory.state(ideal.time)
        _navigate(scenario, trajectory, there, there.height, readings)
        if scenario.filter is not None:
            _aid(scenario, trajectory, readings.imu)


def _height_reference(scenario: Scenario, trajectory: Trajectory, truth: NavState, time: Array) -> Array | None:
    """Return what the vertical channel goes by: for a loop with a barometer its readings, else the true height."""
    section = None if scenario.aiding is None else scenario.aiding.baro
    if scenario.navigation.vertical != "baro-loop" or section is None:
        return truth.height
    from sinssim.sensors.aiding import barometer

    given = barometer(trajectory, section, scenario.seed).measurements
    if not len(given.time):
        if scenario.filter is not None:  # which says that no reading came
            return None
        raise InputError(
            'navigation.vertical = "baro-loop" has no height to go by: [aiding.baro] has its outages all the time.'
        )
    # between readings, and through outages, along straight lines: the loop is slower than either
    return np.asarray(np.interp(time, given.time, given.value[:, 0]))


def _navigate(
    scenario: Scenario, trajectory: Trajectory, truth: NavState, height: Array | None, readings: Readings
) -> tuple[dict[str, NavSolution], dict[str, NavError], dict[str, RunError]]:
    """Navigate by every algorithm, side by side: the kernels release the interpreter's lock.

    Args:
        scenario: says how.
        trajectory: the true motion.
        truth: true states at the samples' edges.
        height: what the vertical channel goes by there, m; None leaves it free.
        readings: what the sensors give.

    Returns:
        Solutions and errors of the algorithms that have them, and why the others have none, by algorithm.

    Raises:
        InputError: an option that the data or the engine do not admit.
        RunError: no algorithm has a solution.
    """
    section, imu = scenario.navigation, readings.imu
    initial = initial_state(trajectory.state(imu.time[0]), section.initial_error, trajectory.ellipsoid, scenario.seed)
    route = None if section.route_deg is None else tuple(np.radians(section.route_deg))

    def one(algorithm: str) -> tuple[NavSolution, NavError] | RunError:
        try:
            solution = navigated(algorithm)
        except RunError as error:
            return error
        # an algorithm that takes several samples at once has fewer rows
        there = truth if len(solution.time) == len(imu.time) else trajectory.state(solution.time)
        return solution, navigation_error(there, solution, trajectory.ellipsoid)

    def navigated(algorithm: str) -> NavSolution:
        return readings.navigate(
            initial,
            algorithm=algorithm,
            frame=section.frame,
            gravity=section.gravity,
            ellipsoid=trajectory.ellipsoid.name,
            curvature=section.curvature,
            vertical="free" if height is None else section.vertical,
            height=None if section.vertical == "free" else height,
            baro_time_constant=section.baro_time_constant_s,
            rates_hz=section.rates_hz,
            slow_quantities=section.slow_quantities,
            route=route,
        )

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = dict(zip(section.algorithms, pool.map(one, section.algorithms), strict=True))
    failed = {name: result for name, result in results.items() if isinstance(result, RunError)}
    if len(failed) == len(results):
        raise next(iter(failed.values()))
    found = {name: result for name, result in results.items() if not isinstance(result, RunError)}
    return {name: r[0] for name, r in found.items()}, {name: r[1] for name, r in found.items()}, failed


def _aid(scenario: Scenario, trajectory: Trajectory, imu: ImuData) -> Aided:
    """Estimate by the scenario's filter, from the state that the inertial solutions start from."""
    from sinssim.aided import aid_run

    start = trajectory.state(trajectory.start)
    initial = initial_state(start, scenario.navigation.initial_error, trajectory.ellipsoid, scenario.seed)
    return aid_run(scenario, trajectory, imu, initial)


def initial_state(truth: NavState, error: InitialErrorSection, ellipsoid: Ellipsoid, seed: int = 0) -> NavState:
    """Return the state that navigation starts from: the true one with errors added.

    Args:
        truth: true state at the start, scalars.
        error: what to add; with all zeros the true state comes back bit for bit.
        ellipsoid: reference ellipsoid.
        seed: the run's seed, for the errors to draw.

    Returns:
        The state, scalars.
    """
    from sinssim.sensors.random_numbers import normals

    def draw(term: str, *sigma: float) -> Array:
        return np.array([s * normals(seed, f"initial {term}", i, 1)[0] if s else 0.0 for i, s in enumerate(sigma)])

    position = np.array([error.north_m, error.east_m, error.height_m])
    position += draw("position", error.position_sigma_m, error.position_sigma_m, error.height_sigma_m)
    velocity = np.array([error.velocity_north_mps, error.velocity_east_mps, error.velocity_down_mps])
    velocity += draw("velocity", *[error.velocity_sigma_mps] * 3)
    r1, r2 = radii(truth.latitude, ellipsoid)
    longitude = truth.longitude
    if position[1]:
        longitude = longitude + position[1] / ((r2 + truth.height) * np.cos(truth.latitude))
    q_nb = truth.q_nb
    turn = np.array([error.roll_arcmin, error.pitch_arcmin, error.heading_arcmin]) * units.ARCMIN
    if turn.any():
        roll, pitch, heading = rotation.euler_from_quaternion(q_nb)
        q_nb = rotation.quaternion_from_euler(roll + turn[0], pitch + turn[1], heading + turn[2])
    phi = units.ARCMIN * draw("attitude", error.tilt_sigma_arcmin, error.tilt_sigma_arcmin, error.heading_sigma_arcmin)
    if phi.any():
        q_nb = rotation.multiply(rotation.quaternion_from_rotation_vector(-phi), q_nb)  # q_true = q(φ) ⊗ q_solution
    return NavState(
        truth.latitude + position[0] / (r1 + truth.height),
        longitude,
        truth.height + position[2],
        truth.velocity_ned + velocity,
        q_nb,
    )


def _about(scenario: Scenario, stages: _Stages, status: str, message: str = "") -> dict[str, Any]:
    """Return what a summary says whether a run ended well or not."""
    return {
        "scenario": scenario.name,
        "status": status,
        **({"message": message} if message else {}),
        "seed": scenario.seed,
        "rate_hz": scenario.imu.rate_hz,
        "timing": stages.timing(),
        "versions": versions(),
    }


def _keep(
    folder: RunDirectory, material: Material, summary: dict[str, Any], report: str | None, *, beside: str = ""
) -> Path:
    """Complete the run directory and put it in its place."""
    with folder.writing():
        write_text(folder.path / "scenario.toml", material.scenario.to_toml())
        if report is not None:
            write_text(folder.path / "report.html", report)
        write_text(folder.path / "summary.json", json.dumps(summary, indent=2, allow_nan=False) + "\n")
        return folder.keep(beside=beside)


def _leave(folder: RunDirectory, material: Material, stages: _Stages, error: BaseException) -> None:
    """Keep what a run recorded before it broke off, if the flight was done; else leave no trace."""
    if not (folder.path / "recording.rrd").exists():
        folder.discard()
        return
    status = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
    message = str(error) if isinstance(error, SinssimError) else f"{type(error).__name__} {error}".rstrip()
    summary = _about(material.scenario, stages, status, message)
    try:
        report = run_report(material, summary)
    except Exception:  # the report may be what failed: its error is the one that is on its way
        report = None
    place = _keep(folder, material, summary, report, beside=status)
    error.add_note(f"What was recorded until then is in {place}.")


class _Stages:
    """Reports the stages of a run and measures how long each takes."""

    def __init__(self, progress: Progress) -> None:
        self.report = progress
        self._seconds = dict.fromkeys(STAGES, 0.0)
        self._begin = time.perf_counter()

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        begin = time.perf_counter()
        if not self._seconds[stage]:
            self.report(stage, 0.0)
        try:
            yield
        finally:
            self._seconds[stage] += time.perf_counter() - begin
        self.report(stage, 1.0)

    def timing(self) -> dict[str, float]:
        """Return the wall-clock time of each stage and of all of them together, s."""
        total = time.perf_counter() - self._begin
        return {f"{stage}_s": round(s, 4) for stage, s in (*self._seconds.items(), ("total", total))}
