"""Files of KF-GINS (Wuhan University), read and written: IMU, GNSS, solution or truth, and its configuration, written.

All are text with blanks between the columns.

IMU: seconds of the GPS week at the end of the interval, Δθ about x, y, z [rad], Δv along x, y, z [m/s]; forward, right,
down. Further columns (odometer) are left out. Layout: src/fileio/imufileloader.h.

GNSS: seconds of the GPS week, latitude, longitude [°], height of the antenna above the ellipsoid [m], σ north, east,
down [m]. With 13 columns velocity north, east, down [m/s] follows the height, then σ of the position, then σ of the
velocity. Layout: src/fileio/gnssfileloader.h.

Solution, also the form of the truth that comes with its data: GPS week, seconds of the week, latitude, longitude [°],
height above the ellipsoid [m], velocity north, east, down [m/s], roll, pitch, heading [°] of forward-right-down axes.
KF-GINS itself writes 0 for the week. Layout: writeNavResult in src/kf_gins.cpp. Its standard deviations are in
KF_GINS_STD.txt beside it: seconds of the week, then 21 of its states, the first nine position and velocity north, east,
down [m, m/s], and the angles about north, east, down by which the attitude is wrong [°]. They are taken if the file has
a row for every row of the solution. Layout: writeSTD in the same source, which the README describes as roll, pitch,
yaw; the states are those of insPropagation in src/kf-gins/gi_engine.cpp.

Configuration: initial state, noise of the run's sensors, lever arm. KF-GINS has one first-order Gauss-Markov process
for each bias and scale factor, all with one correlation time T, and initial standard deviations apart from those of the
processes. The processes of a run are constants, Gauss-Markov processes and random walks, side by side. T is much longer
than any run, so that constants stay constant; a process that moves gets the standard deviation σ whose driving noise
2σ²/T is the run's. KF-GINS takes the first reading at or after its starttime only as the predecessor of the next one,
and the initial state as that at this reading; a starttime before the first reading is refused. Source: main() and
loadConfig() of src/kf_gins.cpp, insPropagation() of src/kf-gins/gi_engine.cpp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import InputError
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import WEEK, check_weeks, unrolled, week_and_seconds
from sinssim.logs.numeric_columns import check_finite, columns_of, head_numbers, read_numbers, rounded, write_columns
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.logs.reference_solution import TruthAt
from sinssim.logs.stored_run import RecordedRun
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.units import DEG, DEG_H, DEG_SQRT_H, MGAL, MPS_SQRT_H, PPM

_SOLUTION_WIDTHS = (11,)
STD_FILE = "KF_GINS_STD.txt"
_STD_WIDTHS = (22,)


def recognises_solution(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a week, seconds, a place, a velocity and angles."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in _SOLUTION_WIDTHS or not np.isfinite(rows).all():
        return False
    week, seconds, latitude, longitude = rows[:, :4].T
    return bool(
        (week == np.floor(week)).all()
        and ((week >= 0.0) & (week < 10000.0)).all()
        and ((seconds >= 0.0) & (seconds <= WEEK + 86400)).all()
        and (np.diff(unrolled(seconds, WEEK)) > 0.0).all()
        and (np.abs(latitude) <= 90.0).all()
        and (np.abs(longitude) <= 360.0).all()
        and (np.abs(rows[:, 8:11]) <= 360.0).all()
    )


def read_solution(path: Path) -> Streams:
    """Read the solution."""
    notes: list[str] = []
    rows = read_numbers(path, _SOLUTION_WIDTHS, notes)
    check_finite(path, rows, "time, position, velocity or angle")
    week = rows[:, 0]
    check_weeks(path, week)
    known = bool((week > 0.0).all())
    time = rows[:, 1] + (week - week[0]) * WEEK if known else unrolled(rows[:, 1], WEEK)
    sigma = _sigma(path, rows[:, 1], notes)
    stream = SolutionStream(
        time=time,
        latitude=rows[:, 2] * DEG,
        longitude=rows[:, 3] * DEG,
        height=rows[:, 4],
        datum="ellipsoid",
        velocity_ned=rows[:, 5:8],
        q_nb=rotation.quaternion_from_euler(*(rows[:, 8:11] * DEG).T),
        position_sigma=None if sigma is None else sigma[:, 0:3],
        velocity_sigma=None if sigma is None else sigma[:, 3:6],
        attitude_sigma=None if sigma is None else _heading_alone(sigma[:, 8] * DEG),
    )
    note = f"seconds of the GPS week {int(week[0])}" if known else "seconds of the GPS week; the file gives week 0"
    clock = Clock("gps", int(week[0]) * WEEK if known else None, note)
    return Streams(path, "kf-gins-solution", clock, solutions={"solution": stream}, notes=tuple(notes))


def _sigma(path: Path, seconds: Array, notes: list[str]) -> Array | None:
    """Return the standard deviations beside a solution as they are written, (N, 21), and add what there is to say."""
    beside = path.with_name(STD_FILE)
    if not beside.is_file():
        return None
    rows = read_numbers(beside, _STD_WIDTHS, notes)
    if len(rows) != len(seconds) or not np.array_equal(rows[:, 0], seconds):
        notes.append(f"{STD_FILE} in the same folder is not used: it has other times and belongs to another solution.")
        return None
    notes.append(f"The σ are those of {STD_FILE} in the same folder.")
    return rows[:, 1:]


def _heading_alone(heading: Array) -> Array:
    """Return σ of roll, pitch and heading, (N, 3); those of roll and pitch are not given."""
    return np.column_stack((np.full((len(heading), 2), np.nan), heading))


_IMU_WIDTHS = (7, 8)


def recognises_imu(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a time that grows by less than a second, and increments."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in _IMU_WIDTHS or not np.isfinite(rows).all():
        return False
    steps = np.diff(rows[:, 0])
    if not len(steps) or not (steps > 0.0).all():
        return False
    force = float(np.median(np.linalg.norm(rows[1:, 4:7], axis=1) / steps))  # increments: gravity over the interval
    return bool(
        (rows[:, 0] >= 0.0).all()
        and (rows[:, 0] <= WEEK + 86400).all()
        and (steps <= 1.0).all()
        and (np.abs(rows[:, 1:4]) < 1.0).all()
        and 2.0 < force < 100.0  # m/s²
    )


def read_imu(path: Path) -> Streams:
    """Read the increments."""
    notes: list[str] = []
    rows = read_numbers(path, _IMU_WIDTHS, notes)
    check_finite(path, rows[:, :7], "time or increment")
    stream = InertialStream(
        time=unrolled(rows[:, 0], WEEK),
        gyro=rows[:, 1:4],
        accel=rows[:, 4:7],
        kind="increments",
        axes=("forward", "right", "down"),
    )
    clock = Clock("gps", None, "seconds of the GPS week; the file does not give the week")
    return Streams(path, "kf-gins-imu", clock, inertial={"imu": stream}, notes=tuple(notes))


_GNSS_WIDTHS = (7, 13)


def recognises_gnss(path: Path, head: bytes) -> bool:
    """Return whether the first rows are a time, a place and positive standard deviations."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] not in _GNSS_WIDTHS or not np.isfinite(rows).all():
        return False
    sigma = rows[:, 4:7] if rows.shape[1] == 7 else rows[:, 7:13]
    return bool(
        (rows[:, 0] >= 0.0).all()
        and (rows[:, 0] <= WEEK + 86400).all()
        and (np.diff(rows[:, 0]) > 0.0).all()
        and (np.abs(rows[:, 1]) <= 90.0).all()
        and (np.abs(rows[:, 2]) <= 360.0).all()
        and (np.abs(rows[:, 3]) < 1e6).all()
        and (sigma > 0.0).all()
        and np.ptp(rows[:, 1]) < 0.1
    )


def read_gnss(path: Path) -> Streams:
    """Read the fixes."""
    notes: list[str] = []
    rows = read_numbers(path, _GNSS_WIDTHS, notes)
    check_finite(path, rows[:, :4], "time or position")
    wide = rows.shape[1] == 13
    stream = FixStream(
        time=unrolled(rows[:, 0], WEEK),
        latitude=rows[:, 1] * DEG,
        longitude=rows[:, 2] * DEG,
        height=rows[:, 3],
        datum="ellipsoid",
        position_sigma=rows[:, 7:10] if wide else rows[:, 4:7],
        velocity_ned=rows[:, 4:7] if wide else None,
        velocity_sigma=rows[:, 10:13] if wide else None,
    )
    clock = Clock("gps", None, "seconds of the GPS week; the file does not give the week")
    return Streams(path, "kf-gins-gnss", clock, fixes={"gnss": stream}, notes=tuple(notes))


CORRELATION_H = 1000.0
"""Correlation time T in the configuration, h."""
_EDGE = 1e-9  # s: a reading this close to the first state is at it
_AXES = 3
_OWN = tuple(
    tuple(f"sigma_{what}_{axis}_{unit}" for axis in "ned")
    for what, unit in (("position", "m"), ("velocity", "mps"), ("phi", "rad"))
)
TYPICAL_START = np.full(_AXES, 1.0), np.full(_AXES, 0.1), np.array([0.1, 0.1, 0.5]) * DEG
"""1σ of an initial state whose accuracy is not known, as after an alignment with satellites; m, m/s, rad."""


@dataclass(frozen=True)
class Noise:
    """Errors of three gyros or accelerometers in the terms of KF-GINS, SI."""

    white: float  # density of the white noise, one number
    bias: Array  # 1σ of the bias at the beginning, (3,)
    wandering: float  # density of the white noise that drives the bias, one number
    scale: Array  # 1σ of the relative scale-factor errors, (3,)


TYPICAL = (
    Noise(0.2 * DEG_SQRT_H, np.full(_AXES, 50.0 * DEG_H), 0.0, np.full(_AXES, 1000.0 * PPM)),
    Noise(0.1 * MPS_SQRT_H, np.full(_AXES, 250.0 * MGAL), 0.0, np.full(_AXES, 1000.0 * PPM)),
)
"""Gyros and accelerometers of a MEMS unit, for a run whose sensors are not known."""


def noise_of(run: RecordedRun) -> tuple[Noise, Noise] | None:
    """Return the noise of a run's gyros and accelerometers, as its [imu] section and its filter's factor give it; None
    if the run has no [imu] section, or its grade is not found any more."""
    from sinssim.sensors.imu.imu_section import Imu

    given = run.scenario.get("imu")
    if given is None:
        return None
    factor = float(run.scenario.get("filter", {}).get("inertial_noise_factor", 1.0))
    try:
        section = Imu.model_validate(given)
        noises = []
        for triad in ("gyro", "accel"):
            size: dict[str, Any] = {term.field: np.hypot(*section.stated(term)) for term in of_triad(triad)}
            driven = float(factor * size["instability"]) ** 2 * 2.0 / float(size["correlation_time"])
            walk = math.sqrt(driven + float(size["rate_walk"]) ** 2)
            bias = np.hypot(size["bias"], factor * size["instability"])
            noises.append(Noise(factor * float(size["random_walk"]), bias, walk, np.asarray(size["scale"])))
    except (InputError, ValueError):
        return None
    return noises[0], noises[1]


def start_of(content: Content) -> tuple[float, NavState]:
    """Return the run's time, s, of the first reading at which the chosen solution has a state, and that state."""
    known = content.run.solution(content.solution_name)
    time = content.imu.time
    at = time[(time >= known.time[0] - _EDGE) & (time <= known.time[-1])][:1]
    if not len(at):
        raise InputError(f"{content.solution_name} of {content.run.path} has no state at any inertial sample.")
    return float(at[0]), TruthAt(known, ellipsoid_by_name(content.run.ellipsoid)).state(at)


def initial_sigma(content: Content, time: float) -> tuple[Array, Array, Array]:
    """Return the 1σ of the state at the run's time, s: of position, m, of velocity, m/s, and of the angles about north,
    east, down, rad, (3,) each. They are what the run's own filter assumes at this instant; for the truth, or without a
    filter, `TYPICAL_START`. KF-GINS calls the angles roll, pitch and heading. It puts their squares into the covariance
    of the angles about north, east and down."""
    if content.solution_name != "truth" and "filter" in content.run.streams(""):
        table = content.run.table("filter")
        row = int(np.searchsorted(table["time_s"], time - _EDGE).clip(max=len(table["time_s"]) - 1))
        sigma = tuple(np.array([table[name][row] for name in names]) for names in _OWN)
        if all(np.isfinite(part).all() and (part > 0.0).all() for part in sigma):
            return sigma[0], sigma[1], sigma[2]
    return TYPICAL_START


def configuration(content: Content, start: float) -> str:
    """Return the configuration file. `start`: seconds of the week of the run's time 0."""
    imu = content.imu
    rate = round((len(imu) - 1) / float(imu.time[-1] - imu.time[0])) if len(imu) > 1 else 1
    time, state = start_of(content)
    angles = np.array(rotation.euler_from_quaternion(state.q_nb)).ravel() / DEG
    place = (state.latitude[0] / DEG, state.longitude[0] / DEG, state.height[0])
    receiver = next(iter(content.fixes), "")
    arm = content.run.lever_arm(receiver) if receiver else (0.0, 0.0, 0.0)
    position, velocity, attitude = initial_sigma(content, time)
    gyro, accel = noise_of(content.run) or TYPICAL
    walk = math.sqrt(CORRELATION_H * 3600.0 / 2.0)  # σ = √(S T/2) of the density S of the driving noise

    def row(values: object, unit: float = 1.0) -> str:
        return "[" + ", ".join(f"{v / unit:.9g}" for v in np.broadcast_to(np.asarray(values), _AXES)) + "]"

    def exact(values: object) -> str:
        return "[" + ", ".join(repr(float(v)) for v in np.asarray(values).tolist()) + "]"

    return "\n".join(
        [
            "# KF-GINS configuration for a run of sinssim",
            'imupath: "./imu.txt"',
            f'gnsspath: "./{receiver or "gnss"}.txt"',
            'outputpath: "."',
            "imudatalen: 7",
            f"imudatarate: {rate}",
            f"starttime: {round(start + time, 9)!r}   # the first sample",
            "endtime: -1",
            f"initpos: {exact(place)}   # deg, deg, m",
            f"initvel: {exact(state.velocity_ned[0])}   # north, east, down, m/s",
            f"initatt: {exact(angles)}   # roll, pitch, heading, deg",
            f"initgyrbias: {row(0.0)}   # deg/h",
            f"initaccbias: {row(0.0)}   # mGal",
            f"initgyrscale: {row(0.0)}   # ppm",
            f"initaccscale: {row(0.0)}   # ppm",
            f"initposstd: {row(position)}   # m",
            f"initvelstd: {row(velocity)}   # m/s",
            f"initattstd: {row(attitude, DEG)}   # deg",
            f"initbgstd: {row(gyro.bias, DEG_H)}   # deg/h",
            f"initbastd: {row(accel.bias, MGAL)}   # mGal",
            f"initsgstd: {row(gyro.scale, PPM)}   # ppm",
            f"initsastd: {row(accel.scale, PPM)}   # ppm",
            "imunoise:",
            f"  arw: {row(gyro.white, DEG_SQRT_H)}   # deg/sqrt(h)",
            f"  vrw: {row(accel.white, MPS_SQRT_H)}   # m/s/sqrt(h)",
            f"  gbstd: {row(gyro.wandering * walk, DEG_H)}   # deg/h; 0 is a constant bias",
            f"  abstd: {row(accel.wandering * walk, MGAL)}   # mGal",
            f"  gsstd: {row(0.0)}   # ppm",
            f"  asstd: {row(0.0)}   # ppm",
            f"  corrtime: {CORRELATION_H!r}   # h",
            f"antlever: {exact(arm)}   # forward, right, down, m",
            "",
        ]
    )


def write(content: Content, place: Path) -> list[str]:
    """Write imu.txt, gnss.txt, truth.nav and kf-gins.yaml."""
    week, start = week_and_seconds(content.start_gps_s)
    imu = content.imu
    if start + float(imu.time[-1]) > WEEK:
        raise InputError(
            f"the run ends {start + float(imu.time[-1]) - WEEK:.0f} s after the end of the GPS week {week}, beyond "
            "which KF-GINS does not read. Choose an earlier date with --start."
        )
    write_columns(place / "imu.txt", columns_of(rounded(start + imu.time), imu.gyro, imu.accel))
    sentences = [f"imu.txt: {content.imu_name} increments; seconds of week, Δθ [rad], Δv [m/s], forward-right-down."]
    for name, fixes in content.fixes.items():
        _write_gnss(fixes, start, place / f"{name}.txt")
        sentences.append(
            f"{name}.txt: fixes of the antenna; seconds of week, latitude, longitude [°], height [m], σ [m]."
        )
    file = "truth.nav" if content.solution_name == "truth" else f"{content.solution_name}.nav"
    _write_solution(content.solution, week, start, place / file)
    sentences.append(f"{file}: week, seconds, latitude, longitude [°], height [m], velocity, roll, pitch, heading [°].")
    if np.abs(np.diff(content.motion.longitude)).max() > np.pi:
        sentences.append("The run crosses the antimeridian, where KF-GINS fails because it subtracts longitudes.")
    known = noise_of(content.run) is not None
    noise = "and the noise of the run's sensors" if known else "and the noise of a MEMS IMU; set that of your sensors"
    (place / "kf-gins.yaml").write_text(configuration(content, start), encoding="utf-8")
    return [
        *sentences,
        f"kf-gins.yaml: initial state of {content.solution_name}, lever arm of the antenna, {noise}.",
        f"Times are seconds of the GPS week {week}; the time 0 of the run is {start}.",
    ]


def _write_gnss(f: FixStream, start: float, path: Path) -> None:
    sigma = f.position_sigma if f.position_sigma is not None else np.ones((len(f), 3))
    columns = columns_of(rounded(start + f.time), f.latitude / DEG, f.longitude / DEG, f.height, sigma)
    write_columns(path, columns)


def _write_solution(s: SolutionStream, week: int, start: float, path: Path) -> None:
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError("the solution of KF-GINS has velocity and attitude; choose the truth or an algorithm.")
    angles = np.column_stack(rotation.euler_from_quaternion(s.q_nb)) / DEG
    place = s.latitude / DEG, s.longitude / DEG, s.height
    first = np.full(len(s), week, dtype=np.int64)
    write_columns(path, [first, *columns_of(rounded(start + s.time), *place, s.velocity_ned, angles)])


IMU = Format(recognises_imu, read_imu)
GNSS = Format(recognises_gnss, read_gnss)
SOLUTION = Format(recognises_solution, read_solution)
EXPORT = Export("", "run", write)
