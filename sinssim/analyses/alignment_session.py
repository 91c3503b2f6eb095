"""Aligns the simulated session of a scenario, or a recorded log: `align`."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from sinssim.alignment.alignment_budget import Method
from sinssim.alignment.parked_theory import Angles
from sinssim.analyses.alignment_result import AlignmentResult, align_session
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.logs.imu_samples import SUFFIXES, read_log, slow
from sinssim.progress import Progress, shown
from sinssim.rotation import shown_heading
from sinssim.scenario.load import Overrides, as_scenario
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.grades import find_grade
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.sensors.imu.size_effect import rectified
from sinssim.system.files import check_directory
from sinssim.units import DEG


def align(
    source: Scenario | str | Path,
    directory: Path | str | None = None,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    columns: Path | str | None = None,
    grade: str | None = None,
    start: float | None = None,
    end: float | None = None,
    method: Method = "quiet",
    latitude: float | None = None,
    progress: Progress | bool | None = None,
) -> AlignmentResult:
    """Align the simulated session of a scenario with a parked vehicle, or a recorded log.

    Args:
        source: a scenario, its file or name, or a log, recognised by its suffix
            (`sinssim.logs.imu_samples.SUFFIXES`).
        directory: directory to write; nothing is written if not given.
        overrides: settings "key=value" of a scenario, as for `load_scenario`.
        overwrite: whether an existing alignment in the directory may be replaced.
        columns: TOML file that names a log's columns, units and axes.
        grade: the grade of a log's sensors, for the expected error; in a scenario it replaces imu.grade.
        start, end: part of the session to use, in its own time, s.
        method: "quiet" or "disturbed".
        latitude: rad, if known, for "disturbed".
        progress: called with "Aligning" and the fraction done, 0…1; True shows a bar.

    Returns:
        Heading, roll, pitch and latitude, and the expected error of each by source.

    Raises:
        InputError: an argument or the directory cannot be used; the message names it.
        RunError: the scenario cannot be flown.
    """
    if method == "quiet" and latitude is not None:
        raise InputError(
            "--latitude is only for a disturbed base; eq. (1) on a quiet base determines the latitude "
            "itself. Add --disturbed, or omit --latitude."
        )
    check_directory(directory, overwrite)
    settings = [overrides] if isinstance(overrides, str) else list(overrides)
    solve = partial(align_session, method=method, latitude=latitude)
    with shown(progress) as report:
        report("Aligning", 0.0)
        if isinstance(source, str | Path) and Path(source).suffix.lower() in SUFFIXES:
            if settings:
                raise InputError(
                    f"{source} is a log, but --set {settings[0]} is for scenarios; give its sensors with --grade NAME."
                )
            result = _align_log(Path(source), columns, grade, (start, end), solve)
        else:
            _check_is_scenario(source, columns)
            settings += [] if grade is None else [f"imu.grade={json.dumps(grade)}"]
            # eq. (1) gives the mean attitude of a session, the cone that at its last instant
            result = _align_scenario(source, settings, (start, end), solve, at_end=method != "quiet")
        report("Aligning", 1.0)
    return result if directory is None else replace(result, directory=result.save(directory, overwrite=overwrite))


def _check_is_scenario(source: Scenario | str | Path, columns: Path | str | None) -> None:
    """Raise for a file that is neither a log nor a scenario, and for columns of a scenario."""
    suffixes, name = ", ".join(SUFFIXES), source.name if isinstance(source, Scenario) else str(source)
    path = Path(source if isinstance(source, str | Path) else "")
    got = ""
    if path.name and path.is_dir():
        got = f"a directory; for a run, give its log {path / 'streams' / 'imu_measured.parquet'}"
    elif path.suffix and path.suffix.lower() != ".toml":
        got = f"a file that ends in {path.suffix}"
    if got:
        raise InputError(
            f"{name} is neither a log nor a scenario, but {got}. A log ends in {suffixes}; text in columns "
            "with another suffix must be renamed and described with --columns. A scenario is a .toml file, or one of "
            "`sinssim list scenarios`."
        )
    if columns is not None:
        raise InputError(f"{name} is a scenario, which describes its own sensors; --columns is for logs ({suffixes}).")


def _align_scenario(
    source: Scenario | str | Path,
    settings: list[str],
    span: tuple[float | None, float | None],
    solve: Callable[..., AlignmentResult],
    *,
    at_end: bool,
) -> AlignmentResult:
    """Align the session of a scenario; its true angles are those at its end, or else in its middle."""
    from sinssim import rotation
    from sinssim.scenario.true_motion import fly

    scenario = as_scenario(source, settings)
    if scenario.imu.rotation is not None:
        raise InputError(
            f"the scenario {scenario.name} has [imu.rotation]; the alignment uses the mean measurements of an IMU "
            f"that does not rotate in the vehicle. Remove the table."
        )
    trajectory = fly(scenario)
    scenario.imu.require_gyros()
    errors = draw(scenario.imu, scenario.seed)
    felt = rectified(trajectory, trajectory.increments(scenario.imu.rate_hz), errors)
    name = scenario.name if isinstance(source, Scenario) else str(source)
    imu = _part(emulate(felt, errors, scenario.seed), *span, name)
    state = trajectory.state(imu.time[-1] if at_end else 0.5 * (imu.time[0] + imu.time[-1]))
    roll, pitch, heading = rotation.euler_from_quaternion(state.q_nb)
    truth = Angles(heading, roll, pitch, np.asarray(state.latitude))
    warmed = float(imu.time[0]) - trajectory.start
    result = solve(imu, scenario.name, scenario.imu, truth=truth, warmed=warmed)
    return _in_range(result, scenario.output.angles)


def _in_range(report: AlignmentResult, choice: str | None) -> AlignmentResult:
    """Return the alignment with its headings in the range that the scenario requests."""

    def heading(value: Array) -> Array:
        return value if np.isnan(value) else np.asarray(shown_heading(choice, value[None])[0])

    def within(angles: Angles | None) -> Angles | None:
        return None if angles is None else angles._replace(heading=heading(np.asarray(angles.heading)))

    d = report.determination
    return replace(
        report,
        determination=replace(d, heading=heading(d.heading)),
        truth=within(report.truth),
        mean_angles=within(report.mean_angles),
    )


def _align_log(
    path: Path,
    columns: Path | str | None,
    grade: str | None,
    span: tuple[float | None, float | None],
    solve: Callable[..., AlignmentResult],
) -> AlignmentResult:
    sensors = None
    if grade is not None:
        find_grade(grade)  # its message names the grades
        sensors = Imu(grade=grade)
    imu = _part(read_log(path, None if columns is None else Path(columns)), *span, str(path))
    report = solve(imu, path.name, sensors)
    d = report.determination
    doubts = [] if (rare := slow(imu.time)) is None else [rare]
    if np.abs(d.roll) > 0.5 * np.pi:
        doubts.append(
            f"the sensor block is upside down (roll {float(d.roll) / DEG:.1f} deg). If it is not mounted this way, "
            "the axes of the log are wrong, or its accelerometers have the opposite sign "
            "(at rest a specific force points up)."
        )
    return replace(report, determination=replace(d, warnings=(*d.warnings, *doubts)))


def _part(imu: ImuData, start: float | None, end: float | None, source: str) -> ImuData:
    """Return a part of a session."""
    first = 0 if start is None else int(np.searchsorted(imu.time, start - 1e-9))
    last = len(imu.time) if end is None else int(np.searchsorted(imu.time, end + 1e-9, side="right"))
    if last - first < 2:
        raise InputError(
            f"{source}: there is no session from {start} to {end} s; the data run from {imu.time[0]:.6g} to "
            f"{imu.time[-1]:.6g} s."
        )
    return ImuData(imu.time[first:last], imu.dtheta[first : last - 1], imu.dvel[first : last - 1])
