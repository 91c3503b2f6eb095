"""PSINS (Gongmin Yan): .imu with counts, .avp of the truth and of the fixes; east-north-up and right-front-up axes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.local_level import swapped
from sinssim.logs.recorded_streams import InertialStream, SolutionStream
from sinssim.logs.text.numeric_columns import columns_of, rounded, write_columns
from sinssim.logs.writers.run_export import Content
from sinssim.units import ARCSEC, DEG, G0

SUFFIX = ""
HOLDS = "run"
_GYRO_ARCSEC, _ACCEL_UG_S = 1e-4, 1e-3
"""Quanta of the counts: 4.8e-10 rad and 9.8e-9 m/s."""


def write(content: Content, place: Path) -> list[str]:
    """Write imu.imu, the solution as .avp and the fixes as .avp.

    Raises:
        InputError: the sampling interval varies.
    """
    start = content.motion
    _write_imu(content.imu, start, place / "imu.imu")
    name = f"{content.solution_name}.avp"
    _write_avp(content.solution, place / name)
    said = [
        f"imu.imu: {content.imu_name} data in counts of {_GYRO_ARCSEC:g} arcsec and {_ACCEL_UG_S:g} µg s, "
        "right-front-up. The sums of the counts are those of the readings, less than one count off.",
        f"{name}: pitch, roll, yaw (counter-clockwise from north) [°], velocity east, north, up, latitude, longitude "
        "[°], height [m], time [s].",
    ]
    for receiver in content.fixes:
        stream = replace(content, solution_name=receiver, rate_hz=None).solution
        _write_avp(stream, place / f"{receiver}.avp")
        said.append(f"{receiver}.avp: fixes of the antenna.")
    return [*said, "Times are the run's own."]


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
