"""Alignment of one session with its expected errors, from a scenario or a log, as text or JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.alignment.axes import Angles
from sinssim.alignment.base_motion import motion_errors, stillness
from sinssim.alignment.budget import (
    MOTION,
    Method,
    bias_takes_over,
    error_budget,
    expected_errors,
    reading_errors,
    total,
)
from sinssim.alignment.determination import Determination, determine, doubt, solve
from sinssim.alignment.disturbed import align_disturbed
from sinssim.alignment.session import mean_readings
from sinssim.alignment.theory import coefficients, linear
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.units import ARCMIN, DEG, DEG_H

if TYPE_CHECKING:
    from sinssim.scenario.sections.imu import ImuSection
    from sinssim.sensors.imu.errors import ImuErrors


@dataclass(frozen=True, eq=False)
class AlignmentReport:
    """One session's alignment.

    Attributes:
        source: name of the scenario or of the log's file.
        method: method of alignment.
        imu: the session.
        determination: the angles and the latitude; the heading in the range of the scenario's [output], if it has one.
        sigma: standard deviations of the sensor block's errors, if known.
        mean: known part of the determination's error (from errors that a scenario fixes), rad, if known.
        budget: standard deviations by source, if known and if the theory holds, rad.
        crossing: session lengths from which bias dominates, s, likewise.
        truth: heading, roll, pitch and latitude of a simulated session, rad.
        residual: root mean square of the residual velocity on a disturbed base, m/s.
        residual_velocity: residual velocity over time, in the block's axes at the first instant, (N+1, 3) m/s.
        mean_angles: result of eq. (1) for a disturbed session, for comparison, rad.
        warmed: time from when the sensors were switched on to the session's first sample, s.
    """

    source: str
    method: Method
    imu: ImuData
    determination: Determination
    sigma: ImuErrors | None = None
    mean: Angles | None = None
    budget: dict[str, Angles] | None = None
    crossing: Angles | None = None
    truth: Angles | None = None
    residual: float | None = None
    residual_velocity: Array | None = None
    mean_angles: Angles | None = None
    warmed: float = 0.0

    @property
    def duration(self) -> float:
        """Length of the session, s."""
        return float(self.imu.time[-1] - self.imu.time[0])

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.imu)

    @property
    def error(self) -> Angles | None:
        """Determined minus true angles, rad."""
        if self.truth is None:
            return None
        d = self.determination
        determined = (d.heading, d.roll, d.pitch, d.latitude)
        return Angles(*((a - b + np.pi) % (2.0 * np.pi) - np.pi for a, b in zip(determined, self.truth, strict=True)))

    def to_json(self) -> dict[str, Any]:
        """Return plain numbers with units in the names; undetermined values are None."""
        d = self.determination
        result: dict[str, Any] = {
            "source": self.source,
            "method": self.method,
            "duration_s": self.duration,
            "samples": self.samples,
            **{f"{name}_deg": _plain(getattr(d, name) / DEG) for name in Angles._fields},
            "earth_rate_deg_h": _plain(d.earth_rate / DEG_H),
            "gravity_mps2": _plain(d.gravity),
            "warnings": list(d.warnings),
        }
        if self.residual is not None:
            result["residual_velocity_mps"] = self.residual
        if self.mean_angles is not None:
            result["eq_1_on_the_same_data_deg"] = _by_name(self.mean_angles, DEG)
        for name, angles in (("error", self.error), ("known_error", self.mean)):
            if angles is not None:
                result[f"{name}_arcmin"] = _by_name(angles, ARCMIN)
        if self.budget is not None:
            result["sigma_arcmin"] = _by_name(total(self.budget), ARCMIN)
            result["sigma_by_source_arcmin"] = {source: _by_name(self.budget[source], ARCMIN) for source in self.budget}
        if self.crossing is not None:
            result["bias_takes_over_s"] = _by_name(self.crossing, 1.0)
        return result


# Long: checks, determination, budget and report of one session in sequence.
def align_session(
    imu: ImuData,
    source: str,
    sensors: ImuSection | None = None,
    *,
    method: Method = "quiet",
    latitude: float | None = None,
    truth: Angles | None = None,
    warmed: float = 0.0,
) -> AlignmentReport:
    """Align one session and state the expected errors.

    Args:
        imu: the session.
        source: name of the session.
        sensors: the sensor block's grade and errors, if known.
        method: "quiet" for eq. (1), otherwise gravity's cone, for a moving base.
        latitude: rad, if known; used by the disturbed method.
        truth: true heading, roll, pitch and latitude of a simulated session, rad.
        warmed: time from when the sensors were switched on to the session's first sample, s.

    Returns:
        The report.

    Raises:
        InputError: the increments are unusable, or the vehicle moved and the method does not allow it.
    """
    expected = None if sensors is None else expected_errors(sensors)
    residual = residual_velocity = mean_angles = still = None
    if method == "quiet":
        determination = determine(*mean_readings(imu), None if expected is None else expected.instrument_sigmas)
        still = stillness(imu, expected, warmed)
        still.require()
    else:
        alignment = align_disturbed(imu, latitude)
        determination, residual = alignment.determination, alignment.residual
        residual_velocity = alignment.residual_velocity
        mean_angles, _, _ = solve(*mean_readings(imu))
        method = "disturbed" if latitude is None else "disturbed, latitude known"
    report = AlignmentReport(
        source,
        method,
        imu,
        determination,
        truth=truth,
        residual=residual,
        residual_velocity=residual_velocity,
        mean_angles=mean_angles,
        warmed=warmed,
    )
    where = determination.latitude if latitude is None else np.asarray(latitude)
    if expected is None or not all(map(np.isfinite, (*determination.attitude, where))):
        return report
    known: dict[str, Any] = {
        "method": method,
        "gravity": determination.gravity,
        "start": warmed,
        "rate_hz": len(imu) / report.duration,
    }
    try:
        budget = error_budget(determination.attitude, where, expected.sigma, report.duration, **known)
        crossing = bias_takes_over(determination.attitude, where, expected.sigma, **known)
    except InputError:  # too near a singularity for a first-order theory; the determination has its own warnings
        return report
    by_reading = coefficients(determination.attitude, where, gravity=determination.gravity)
    if still is not None:
        budget[MOTION] = motion_errors(by_reading, still)
    mean = linear(
        by_reading,
        *reading_errors(expected.mean, *mean_readings(imu), report.duration, warmed),
    )
    return replace(
        report,
        determination=doubt(determination, total(budget)),
        sigma=expected.sigma,
        mean=mean,
        budget=budget,
        crossing=crossing,
    )


def align_source(
    source: str,
    *,
    columns: Path | None = None,
    grade: str | None = None,
    start: float | None = None,
    end: float | None = None,
    method: Method = "quiet",
    latitude: float | None = None,
    settings: tuple[str, ...] = (),
) -> AlignmentReport:
    """Align a scenario's simulated session, or a recorded log.

    Args:
        source: a scenario's file or name, or a log, recognised by its suffix (`sinssim.logs.text.samples.SUFFIXES`).
        columns: TOML file that names a log's columns, units and axes.
        grade: the grade of a log's sensors, for the expected error; in a scenario it replaces imu.grade.
        start, end: part of the session to use, in its own time, s.
        method: "quiet" or "disturbed".
        latitude: rad, if known, for "disturbed".
        settings: "key=value" replacements in a scenario.

    Returns:
        The report.

    Raises:
        InputError: an argument cannot be used; the message names it.
        RunError: the scenario cannot be flown.
    """
    from sinssim.logs.text.samples import SUFFIXES

    if method == "quiet" and latitude is not None:
        raise InputError(
            "--latitude is only for a disturbed base; eq. (1) on a quiet base determines the latitude "
            "itself. Add --disturbed, or omit --latitude."
        )
    if Path(source).suffix.lower() in SUFFIXES:
        if settings:
            raise InputError(
                f"{source} is a log, but --set {settings[0]} is for scenarios; give its sensors with --grade NAME."
            )
        return _align_log(Path(source), columns, grade, (start, end), method, latitude)
    _check_is_scenario(source)
    if columns is not None:
        raise InputError(
            f"{source} is a scenario, which describes its own sensors; --columns is for logs ({', '.join(SUFFIXES)})."
        )
    if grade is not None:
        settings = (*settings, f"imu.grade={json.dumps(grade)}")
    return _align_scenario(source, settings, (start, end), method, latitude)


def _check_is_scenario(source: str) -> None:
    """Raise for a file that is neither a log nor a scenario."""
    from sinssim.logs.text.samples import SUFFIXES

    path = Path(source)
    if path.is_dir():
        got = f"a directory; for a run, give its log {path / 'streams' / 'imu_measured.parquet'}"
    elif path.suffix and path.suffix.lower() != ".toml":
        got = f"a file that ends in {path.suffix}"
    else:
        return
    raise InputError(
        f"{source} is neither a log nor a scenario, but {got}. A log ends in {', '.join(SUFFIXES)}; text in columns "
        "with another suffix must be renamed and described with --columns. A scenario is a .toml file, or one of "
        "`sinssim list scenarios`."
    )


def _align_scenario(
    source: str,
    settings: tuple[str, ...],
    span: tuple[float | None, float | None],
    method: Method,
    latitude: float | None,
) -> AlignmentReport:
    from sinssim import rotation
    from sinssim.scenario import load_scenario
    from sinssim.sensors.imu.emulate import check_gyro_block, emulate
    from sinssim.sensors.imu.errors import draw
    from sinssim.sensors.imu.rectification import rectified
    from sinssim.truth.source import fly

    scenario = load_scenario(source, settings)
    if scenario.imu.rotation is not None:
        raise InputError(
            f"the scenario {scenario.name} has [imu.rotation]; the alignment uses the mean measurements of an IMU "
            f"that does not rotate in the vehicle. Remove the table."
        )
    trajectory = fly(scenario)
    check_gyro_block(scenario.imu)
    errors = draw(scenario.imu, scenario.seed)
    felt = rectified(trajectory, trajectory.increments(scenario.imu.rate_hz), errors)
    imu = _part(emulate(felt, errors, scenario.seed), *span, source)
    # eq. (1) gives the mean attitude of a session, the cone that at its last instant
    state = trajectory.state(imu.time[-1] if method != "quiet" else 0.5 * (imu.time[0] + imu.time[-1]))
    roll, pitch, heading = rotation.euler_from_quaternion(state.q_nb)
    truth = Angles(heading, roll, pitch, np.asarray(state.latitude))
    warmed = float(imu.time[0]) - trajectory.start
    report = align_session(
        imu, scenario.name, scenario.imu, method=method, latitude=latitude, truth=truth, warmed=warmed
    )
    return _in_range(report, scenario.output.angles)


def _in_range(report: AlignmentReport, choice: str | None) -> AlignmentReport:
    """Return the alignment with its headings in the range that the scenario requests."""
    from sinssim.rotation import shown_heading

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
    columns: Path | None,
    grade: str | None,
    span: tuple[float | None, float | None],
    method: Method,
    latitude: float | None,
) -> AlignmentReport:
    from sinssim.logs.text.samples import read_log, slow
    from sinssim.scenario.sections.imu import ImuSection
    from sinssim.sensors.imu.grades import find_grade

    sensors = None
    if grade is not None:
        find_grade(grade)  # its message names the grades
        sensors = ImuSection(grade=grade)
    imu = _part(read_log(path, columns), *span, str(path))
    report = align_session(imu, path.name, sensors, method=method, latitude=latitude)
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


def _plain(value: Array) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def _by_name(angles: Angles, unit: float) -> dict[str, float | None]:
    return {name: _plain(np.asarray(value) / unit) for name, value in zip(Angles._fields, angles, strict=True)}
