"""Applanix SBET, read and written: records of 17 little-endian doubles without a header.

Time [s of the GPS week], latitude, longitude [rad], height above the ellipsoid [m], velocity x, y, z [m/s], roll,
pitch, platform heading, wander angle [rad], acceleration x, y, z [m/s²], angular rate x, y, z [rad/s] (POSPac; the PDAL
page on readers.sbet lists the same). Programs differ in the axes of the velocity and in the sign of the wander angle:
the reader takes those whose velocity is the derivative of the positions, and says which. The writer sets the wander
angle to 0, so that x, y, z of the velocity are north, east, down.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import radii
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format
from sinssim.logs.formats.run_export import Content, Export
from sinssim.logs.gps_time import WEEK, unrolled, week_and_seconds
from sinssim.logs.recorded_streams import Clock, SolutionStream, Streams
from sinssim.system.user_file import user_file

_RECORD = 17 * 8
_LOOKED_AT = 2000  # records for finding the axes


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first records are times in order and places on the Earth."""
    count = len(head) // _RECORD
    if count < 1 or (len(head) < 4096 and len(head) % _RECORD):
        return False
    rows = np.frombuffer(head[: count * _RECORD], dtype="<f8").reshape(-1, 17)
    if not np.isfinite(rows).all():
        return False
    time, latitude, longitude, height = rows[:, :4].T
    # text read as doubles has exponents far from these
    return bool(
        (time >= 0.0).all()
        and (time < 2.0 * WEEK).all()
        and (np.diff(time) > 0.0).all()
        and (np.abs(latitude) <= np.pi / 2.0).all()
        and (np.abs(longitude) <= 2.0 * np.pi).all()
        and (np.abs(height) < 1e6).all()
        and (np.abs(rows[:, 4:7]) < 1e4).all()
        and (np.abs(rows[:, 7:11]) < 7.0).all()
        and time[0] > 1e-9
    )


def read(path: Path) -> Streams:
    """Read the solution."""
    size = path.stat().st_size
    if size % _RECORD or not size:
        raise InputError(
            f"{path} has {size} bytes; a record of SBET has {_RECORD}, so that {size % _RECORD} bytes are left over."
        )
    rows = np.fromfile(user_file(path), dtype="<f8").reshape(-1, 17)
    bad = ~np.isfinite(rows[:, :11]).all(axis=1) | (np.abs(rows[:, 1]) > np.pi / 2.0 + 1e-9) | (rows[:, 0] < 0.0)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{path}, record {row + 1}: time {rows[row, 0]:g} s, latitude {rows[row, 1]:g} rad: damaged.")
    time = unrolled(rows[:, 0], WEEK)
    velocity, sign, note = _velocity(time, rows)
    heading = rows[:, 9] + sign * rows[:, 10]
    stream = SolutionStream(
        time=time,
        latitude=rows[:, 1],
        longitude=rows[:, 2],
        height=rows[:, 3],
        datum="ellipsoid",
        velocity_ned=velocity,
        q_nb=rotation.quaternion_from_euler(rows[:, 7], rows[:, 8], heading),
    )
    clock = Clock("gps", None, "seconds of the GPS week; the file does not give the week")
    return Streams(path, "sbet", clock, solutions={"solution": stream}, notes=(note,))


def _velocity(time: Array, rows: Array) -> tuple[Array | None, float, str]:
    """Return the velocity north-east-down, the sign with which the wander angle enters the heading, and a note."""
    x, y, z = rows[:, 4:7].T
    wander = rows[:, 10]
    turned = float(np.abs(wander).max()) > 1e-4
    choices = {}
    for sign in (-1.0, 1.0) if turned else (-1.0,):
        c, s = np.cos(sign * wander), np.sin(sign * wander)
        for word, down in (("down", z), ("up", -z)):
            choices[sign, word] = np.column_stack((c * x - s * y, s * x + c * y, down))
    if len(time) < 3:
        return choices[-1.0, "down"], -1.0, "Too few records to check the axes of the velocity: north, east, down."
    part = slice(0, _LOOKED_AT)
    moved = _from_positions(time[part], rows[part])
    off = {
        key: float(np.sqrt(np.mean(np.sum((v[part] - moved) ** 2, axis=1)))) for key, v in choices.items()
    }  # fmt: skip
    best = min(off, key=lambda key: off[key])
    usual = (-1.0, "down")
    if off[best] > 0.5 * off[usual] or off[usual] < 0.05:  # in level or slow motion the positions do not tell
        best = usual
    speed = float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
    if off[best] > 0.3 + 0.1 * speed:
        return None, best[0], (
            f"The velocity was left out: in all known axes it is {off[best]:.3g} m/s off that of the positions."
        )  # fmt: skip
    about = f"heading = platform heading {'−' if best[0] < 0 else '+'} wander angle; " if turned else ""
    return choices[best], best[0], f"Axes of the velocity, found from the positions: {about}z {best[1]}."


def _from_positions(time: Array, rows: Array) -> Array:
    """Return the derivative of the positions, north-east-down, (n, 3) m/s."""
    r1, r2 = radii(rows[:, 1])
    step = np.gradient(time)
    north = np.gradient(rows[:, 1]) * (r1 + rows[:, 3])
    east = np.gradient(np.unwrap(rows[:, 2])) * (r2 + rows[:, 3]) * np.cos(rows[:, 1])
    return np.column_stack((north, east, -np.gradient(rows[:, 3]))) / step[:, np.newaxis]


def write(content: Content, place: Path) -> list[str]:
    """Write the file."""
    s = content.solution
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError(f"SBET has velocity and attitude; {content.solution_name} lacks them.")
    week, start = week_and_seconds(content.start_gps_s)
    rows = np.zeros((len(s), 17), dtype="<f8")
    rows[:, 0] = start + s.time
    rows[:, 1], rows[:, 2], rows[:, 3] = s.latitude, s.longitude, s.height
    rows[:, 4:7] = s.velocity_ned
    rows[:, 7:10] = np.column_stack(rotation.euler_from_quaternion(s.q_nb))
    sentences = ["Accelerations and angular rates (records 12 to 17) are 0."]
    if content.imu_name is not None:
        imu = content.imu
        assert imu.interval is not None
        at = np.searchsorted(imu.time, s.time - 1e-9).clip(max=len(imu) - 1)
        rows[:, 11:14] = imu.accel[at] / imu.interval[at, 1:]
        rows[:, 14:17] = imu.gyro[at] / imu.interval[at, :1]
        sentences = [f"Specific force and inertial rate are the {content.imu_name} data, means over the last interval."]
    place.write_bytes(rows.tobytes())
    return [
        f"{content.solution_name}: latitude, longitude [rad], height above the ellipsoid, velocity north, east, down "
        "(wander angle 0), roll, pitch, heading [rad] of forward-right-down axes.",
        *sentences,
        f"Times are seconds of the GPS week {week}; the run's time 0 is {start}.",
    ]


FORMAT = Format(recognises, read)
EXPORT = Export(".sbet", "solution", write)
