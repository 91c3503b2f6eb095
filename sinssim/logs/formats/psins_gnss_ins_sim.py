"""Files of the simulators PSINS (Gongmin Yan) and gnss-ins-sim (Aceinna), read and written.

PSINS has IMU (.imu) and solution or fixes (.avp); comments begin with %.

.imu, right-front-up axes: the first comment names PSINS and SIMU. Three rows of data follow: initial pitch, roll, yaw
[°] and velocity east, north, up; latitude, longitude [°], height, time t0 [s], sampling interval [ms], g [m/s²]; scale
factors of the gyros [arcsec] and accelerometers [µg s]. Then one row of counts of angle and velocity for each sample,
with the deviation of its time [µs] in a seventh column where the rate varies. Layout: base/io/imufile.m. (Its header
calls the seventh column milliseconds; its code reads microseconds, and so does this reader.)

.avp, east-north-up axes: the first comment names PSINS and AVP. Columns: latitude, longitude [°], height [m] (4 or 5
columns); before them velocity east, north, up [m/s] (7 or 8); before these pitch, roll, yaw [°] (10 or 11); a tag
before the time where their number is 5, 8 or 11; the time [s] is the last. Yaw is counter-clockwise from north. Layout:
base/io/avpfile.m.

gnss-ins-sim has a folder of CSV files: time, ref_*, gyro-0, accel-0, gps_time, gps-0. The units are in the headings:
"gyro_x (deg/s)". Body axes forward-right-down. Layout: gnss_ins_sim/sim/sim_data.py of gnss-ins-sim. Of several runs of
its errors the first is read.

A row of gnss-ins-sim is an instant: its rates lead from the state of this row to the state of the next one (path_gen in
pathgen.py computes the rates first and then moves; FreeIntegration takes row i − 1 for the step from i − 1 to i). A row
of a written folder is therefore the start of an interval.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import swapped
from sinssim.errors import InputError
from sinssim.logs.column_names import SPELLED
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.numeric_columns import check_finite, columns_of, read_numbers, rounded, write_columns
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.files import open_text
from sinssim.units import ARCSEC, DEG, G0


def recognises_imu(path: Path, head: bytes) -> bool:
    """Return whether the first line names PSINS and SIMU."""
    first = head.split(b"\n", 1)[0]
    return first.lstrip().startswith(b"%") and b"PSINS" in first and b"SIMU" in first


def read_imu(path: Path) -> Streams:
    """Read the increments."""
    notes: list[str] = []
    rows = read_numbers(path, (6, 7), notes)
    if len(rows) < 4:
        raise InputError(f"{path} has {len(rows)} rows; three rows of the header and at least one sample are needed.")
    check_finite(path, rows, "number")
    t0, interval, g = rows[1, 3], rows[1, 4] * 1e-3, rows[1, 5]
    if not 0.0 < interval <= 10.0:
        raise InputError(f"{path}, row 2: the sampling interval is {rows[1, 4]:g} ms; between 0 and 10000 is needed.")
    if not 9.0 < g < 11.0:
        raise InputError(f"{path}, row 2: g is {g:g} m/s²; a value near 9.8 is needed.")
    scale = rows[2, :6] * np.array([ARCSEC] * 3 + [1e-6 * g] * 3)
    if (scale == 0.0).any():
        raise InputError(f"{path}, row 3: a scale factor is 0.")
    counts = rows[3:]
    time = t0 + interval * np.arange(1, len(counts) + 1)
    if rows.shape[1] == 7:
        time += 1e-6 * np.cumsum(counts[:, 6])
    values = counts[:, :6] * scale
    stream = InertialStream(time, values[:, :3], values[:, 3:], "increments", axes=("right", "forward", "up"))
    place = f"latitude {rows[1, 0]:.6f}°, longitude {rows[1, 1]:.6f}°, height {rows[1, 2]:.1f} m"
    angles = f"pitch {rows[0, 0]:g}°, roll {rows[0, 1]:g}°, yaw {rows[0, 2]:g}° (counter-clockwise from north)"
    note = f"The header gives the start: {place}, {angles}; it may be inaccurate."
    clock = Clock("machine", None, f"seconds from {t0:g} s, the time of the header")
    return Streams(path, "psins-imu", clock, inertial={"imu": stream}, notes=(note, *notes))


_AVP_WIDTHS = (4, 5, 7, 8, 10, 11)


def recognises_avp(path: Path, head: bytes) -> bool:
    """Return whether the first line names PSINS and AVP."""
    first = head.split(b"\n", 1)[0]
    return first.lstrip().startswith(b"%") and b"PSINS" in first and b"AVP" in first


def read_avp(path: Path) -> Streams:
    """Read the solution."""
    notes: list[str] = []
    rows = read_numbers(path, _AVP_WIDTHS, notes)
    check_finite(path, rows, "number")
    tagged = rows.shape[1] in (5, 8, 11)
    parts = rows[:, : rows.shape[1] - 1 - tagged]
    position = parts[:, -3:]
    velocity = swapped(parts[:, -6:-3]) if parts.shape[1] >= 6 else None
    q_nb = None
    if parts.shape[1] == 9:
        pitch, roll, yaw = (parts[:, :3] * DEG).T
        q_nb = rotation.quaternion_from_euler(roll, pitch, -yaw)
    stream = SolutionStream(
        rows[:, -1], position[:, 0] * DEG, position[:, 1] * DEG, position[:, 2], "ellipsoid", velocity, q_nb
    )
    clock = Clock("machine", None, "seconds of the program's own clock")
    return Streams(path, "psins-avp", clock, solutions={"solution": stream}, notes=tuple(notes))


_GYRO_ARCSEC, _ACCEL_UG_S = 1e-4, 1e-3
"""Quanta of the counts: 4.8e-10 rad and 9.8e-9 m/s."""


def write_psins(content: Content, place: Path) -> list[str]:
    """Write imu.imu, the solution as .avp and the fixes as .avp."""
    start = content.motion
    _write_imu(content.imu, start, place / "imu.imu")
    name = f"{content.solution_name}.avp"
    _write_avp(content.solution, place / name)
    sentences = [
        f"imu.imu: {content.imu_name} data in counts of {_GYRO_ARCSEC:g} arcsec and {_ACCEL_UG_S:g} µg s, "
        "right-front-up. The sums of the counts are those of the readings, less than one count off.",
        f"{name}: pitch, roll, yaw (counter-clockwise from north) [°], velocity east, north, up, latitude, longitude "
        "[°], height [m], time [s].",
    ]
    for receiver in content.fixes:
        stream = replace(content, solution_name=receiver, rate_hz=None).solution
        _write_avp(stream, place / f"{receiver}.avp")
        sentences.append(f"{receiver}.avp: fixes of the antenna.")
    return [*sentences, "Times are the run's own."]


def _header(kind: str, lines: list[str]) -> str:
    return "".join(f"% {line}\n" for line in (f"PSINS-format {kind} log file. (DO NOT MODIFY!)", *lines)) + "\n"


def _write_imu(imu: InertialStream, truth: SolutionStream, path: Path) -> None:
    assert imu.interval is not None
    assert truth.q_nb is not None
    assert truth.velocity_ned is not None
    interval = imu.interval[:, 0]
    step = float((imu.time[-1] - (imu.time[0] - interval[0])) / len(imu))
    if np.abs(interval - step).max() > 1e-6:
        raise InputError(
            f"the sampling interval varies by {np.abs(interval - step).max():.2g} s; PSINS needs a constant one."
        )
    roll, pitch, heading = (float(a[0]) / DEG for a in rotation.euler_from_quaternion(truth.q_nb[:1]))
    yaw = (-heading + 180.0) % 360.0 - 180.0
    east, north, up = swapped(truth.velocity_ned[:1])[0]
    place = f"{truth.latitude[0] / DEG:.8f} {truth.longitude[0] / DEG:.8f} {truth.height[0]:.3f}"
    head = _header(
        "SIMU",
        [
            "1st line of data: pitch0, roll0, yaw0 (deg), VE0, VN0, VU0 (m/s)",
            "2nd line: latitude0, longitude0 (deg), height0 (m), t0 (s), sampling interval (ms), g (m/s^2)",
            "3rd line: scale factors of the gyros (arcsec) and accelerometers (ug*s)",
            "then g_x, g_y, g_z, a_x, a_y, a_z; x right, y front, z up",
        ],
    ) + (
        f"{pitch:f} {roll:f} {yaw:f} {east:f} {north:f} {up:f}\n"
        f"{place} {imu.time[0] - interval[0]:.8f} {1e3 * step:.8f} {G0:f}\n"
        f"{' '.join([f'{_GYRO_ARCSEC:f}'] * 3)} {' '.join([f'{_ACCEL_UG_S:.3f}'] * 3)}\n\n"
    )
    scale = np.array([_GYRO_ARCSEC * ARCSEC] * 3 + [_ACCEL_UG_S * 1e-6 * round(G0, 6)] * 3)
    values = np.hstack((swapped(imu.gyro), swapped(imu.accel))) / scale
    write_columns(path, columns_of(_counts(values)), header=head)


def _counts(values: Array) -> Array:
    """Return whole counts whose sums are the rounded sums of the values, (N, 6) int64."""
    sums = np.round(np.cumsum(values, axis=0)).astype(np.int64)
    return np.diff(sums, axis=0, prepend=np.zeros((1, values.shape[1]), np.int64))


def _write_avp(s: SolutionStream, path: Path) -> None:
    names = ["lat(deg)", "lon(deg)", "height(m)", "time(s)"]
    parts = [s.latitude / DEG, s.longitude / DEG, s.height, rounded(s.time)]
    if s.velocity_ned is not None:
        names = ["VE(m/s)", "VN(m/s)", "VU(m/s)", *names]
        parts.insert(0, swapped(s.velocity_ned))
        if s.q_nb is not None:
            roll, pitch, heading = rotation.euler_from_quaternion(s.q_nb)
            yaw = (-heading / DEG + 180.0) % 360.0 - 180.0
            names = ["pitch(deg)", "roll(deg)", "yaw(deg)", *names]
            parts.insert(0, np.column_stack((pitch / DEG, roll / DEG, yaw)))
    write_columns(path, columns_of(*parts), header=_header("AVP/GPS", [",".join(names)]))


IMU = Format(recognises_imu, read_imu)
AVP = Format(recognises_avp, read_avp)
PSINS_EXPORT = Export("", "run", write_psins)


_NAMES = ("time", "gps_time", "gyro-*", "accel-*", "gps-*", "mag-*", "ref_*", "algo_time")


def recognises_gnss_ins_sim(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with times, gyros and accelerometers."""
    return path.is_dir() and all((path / name).is_file() for name in ("time.csv", "gyro-0.csv", "accel-0.csv"))


def files_of(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    return [file for name in _NAMES for file in folder.glob(f"{name}.csv")]


def read_gnss_ins_sim(path: Path) -> Streams:
    """Read the readings and the fixes."""
    notes: list[str] = []
    time = _read_table(path / "time.csv", 1, notes)[:, 0]
    gyro, accel = _read_table(path / "gyro-0.csv", 3, notes), _read_table(path / "accel-0.csv", 3, notes)
    if not len(time) == len(gyro) == len(accel):
        raise InputError(
            f"{path}: time.csv, gyro-0.csv and accel-0.csv have {len(time)}, {len(gyro)} and {len(accel)} rows; they "
            "belong to the same instants."
        )
    fixes = {}
    if (path / "gps-0.csv").is_file() and (path / "gps_time.csv").is_file():
        at, place = _read_table(path / "gps_time.csv", 1, notes)[:, 0], _read_table(path / "gps-0.csv", 6, notes)
        if len(at) != len(place):
            raise InputError(f"{path}: gps_time.csv has {len(at)} rows, gps-0.csv {len(place)}.")
        fixes["gnss"] = FixStream(at, place[:, 0], place[:, 1], place[:, 2], "ellipsoid", velocity_ned=place[:, 3:])
    imu = InertialStream(time, gyro, accel, axes=("forward", "right", "down"))
    clock = Clock("machine", None, "seconds of the simulation")
    return Streams(path, "gnss-ins-sim", clock, {"imu": imu}, fixes, notes=tuple(notes))


def _read_table(path: Path, width: int, notes: list[str]) -> Array:
    """Return the columns of a file in SI units, by its heading."""
    with open_text(path, encoding="utf-8", errors="replace") as file:
        heads = file.readline().split(",")
    units = [match[1] if (match := re.search(r"\(([^)]*)\)\s*$", head.strip())) else "" for head in heads]
    if len(units) != width or any(unit not in SPELLED for unit in units):
        raise InputError(
            f"{path}, line 1: {width} names with units are needed, such as 'gyro_x (deg/s)'; it has {heads!r}."
        )
    values = read_numbers(path, (width,), notes, delimiter=",", skip=1)
    check_finite(path, values, "number")
    return np.asarray(values * np.array([SPELLED[unit] for unit in units]))


_LLA = ("lat (deg)", "lon (deg)", "alt (m)")
_XYZ = ("x", "y", "z")


def write_gnss_ins_sim(content: Content, place: Path) -> list[str]:
    """Write the folder."""
    imu, truth = content.imu, content.motion
    assert imu.interval is not None
    start = imu.time - imu.interval[:, 0]
    rows = np.searchsorted(truth.time, start - 1e-6)
    if len(truth) <= rows.max() or np.abs(truth.time[rows] - start).max() > 1e-6:
        raise InputError("the truth is not known at the times of the data; gnss-ins-sim needs both.")
    _write_table(place / "time.csv", ("time (sec)",), rounded(start))
    gyro, accel = imu.gyro / imu.interval[:, :1] / DEG, imu.accel / imu.interval[:, 1:]
    _write_table(place / "gyro-0.csv", [f"gyro_{a} (deg/s)" for a in _XYZ], gyro)
    _write_table(place / "accel-0.csv", [f"accel_{a} (m/s^2)" for a in _XYZ], accel)
    _write_truth(truth, rows, place)
    sentences = [
        f"gyro-0.csv, accel-0.csv: {content.imu_name} data as mean rates over the interval that begins at time.csv.",
        "ref_pos.csv, ref_vel.csv (north-east-down), ref_att_euler.csv (yaw, pitch, roll): the truth at time.csv.",
    ]
    if "ideal" in content.run.inertial:
        ideal = content.run.increments("ideal")
        assert ideal.interval is not None
        _write_table(
            place / "ref_gyro.csv", [f"ref_gyro_{a} (deg/s)" for a in _XYZ], ideal.gyro / ideal.interval[:, :1] / DEG
        )
        _write_table(
            place / "ref_accel.csv", [f"ref_accel_{a} (m/s^2)" for a in _XYZ], ideal.accel / ideal.interval[:, 1:]
        )
    for receiver, fixes in list(content.fixes.items())[:1]:
        _write_fixes(fixes, place)
        sentences.append(f"gps-0.csv, gps_time.csv: fixes of {receiver}, of its antenna.")
    return [*sentences, "Body axes forward-right-down, as its default frame. Times are the run's own."]


def _write_table(path: Path, heads: list[str] | tuple[str, ...], *parts: Array) -> None:
    write_columns(path, columns_of(*parts), header=",".join(heads) + "\n", delimiter=",")


def _write_truth(truth: SolutionStream, rows: NDArray[np.intp], place: Path) -> None:
    assert truth.velocity_ned is not None
    assert truth.q_nb is not None
    position = truth.latitude[rows] / DEG, truth.longitude[rows] / DEG, truth.height[rows]
    _write_table(place / "ref_pos.csv", [f"ref_pos_{name}" for name in _LLA], *position)
    _write_table(place / "ref_vel.csv", [f"ref_vel_{a} (m/s)" for a in _XYZ], truth.velocity_ned[rows])
    roll, pitch, heading = rotation.euler_from_quaternion(truth.q_nb[rows])
    angles = np.column_stack((heading, pitch, roll)) / DEG
    _write_table(place / "ref_att_euler.csv", ("ref_Yaw (deg)", "ref_Pitch (deg)", "ref_Roll (deg)"), angles)


def _write_fixes(f: FixStream, place: Path) -> None:
    velocity = f.velocity_ned if f.velocity_ned is not None else np.full((len(f), 3), np.nan)
    heads = [f"gps_{name}" for name in _LLA] + [f"gps_v{a} (m/s)" for a in "NED"]
    _write_table(place / "gps-0.csv", heads, f.latitude / DEG, f.longitude / DEG, f.height, velocity)
    _write_table(place / "gps_time.csv", ("gps_time (sec)",), rounded(f.time))
    _write_table(place / "gps_visibility.csv", ("gps_visibility",), np.ones(len(f)))


GNSS_INS_SIM = Format(recognises_gnss_ins_sim, read_gnss_ins_sim, files_of)
GNSS_INS_SIM_EXPORT = Export("", "run", write_gnss_ins_sim)
