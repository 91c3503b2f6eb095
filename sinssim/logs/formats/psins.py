"""Files of PSINS (Gongmin Yan), read and written: IMU (.imu) and solution or fixes (.avp); comments begin with %.

.imu, right-front-up axes: the first comment names PSINS and SIMU. Three rows of data follow: initial pitch, roll, yaw
[°] and velocity east, north, up; latitude, longitude [°], height, time t0 [s], sampling interval [ms], g [m/s²]; scale
factors of the gyros [arcsec] and accelerometers [µg s]. Then one row of counts of angle and velocity for each sample,
with the deviation of its time [µs] in a seventh column where the rate varies. Layout: base/io/imufile.m. (Its header
calls the seventh column milliseconds; its code reads microseconds, and so does this reader.)

.avp, east-north-up axes: the first comment names PSINS and AVP. Columns: latitude, longitude [°], height [m] (4 or 5
columns); before them velocity east, north, up [m/s] (7 or 8); before these pitch, roll, yaw [°] (10 or 11); a tag
before the time where their number is 5, 8 or 11; the time [s] is the last. Yaw is counter-clockwise from north. Layout:
base/io/avpfile.m.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format
from sinssim.logs.formats.run_export import Content, Export
from sinssim.logs.local_level import swapped
from sinssim.logs.recorded_streams import Clock, InertialStream, SolutionStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, columns_of, read_numbers, rounded, write_columns
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


def write(content: Content, place: Path) -> list[str]:
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
EXPORT = Export("", "run", write)
