"""NovAtel OEM7: binary logs by novatel-edie (RAWIMUSX, BESTPOS with BESTVEL, INSPVAX), and logs as text.

Times are seconds of the GPS week, with the week. Heights of BESTPOS and INSPVAX are those above mean sea level plus the
undulation. RAWIMUSX has counts of increments along z, −y, x; their scale factors depend on the type of IMU ("Raw IMU
Scale Factors" of the OEM7 manual).
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.receivers.imu_counts import SCALES
from sinssim.logs.formats.receivers.novatel_ascii import WORDS, is_ascii, read_ascii
from sinssim.logs.gps_time import WEEK
from sinssim.logs.libraries import library, refused
from sinssim.logs.streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.user_file import open_file
from sinssim.units import DEG

_WANTED = ("RAWIMUSX", "BESTPOS", "BESTVEL", "INSPVAX")


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the head has a binary sync of a known length of header, or an ASCII log."""
    for at in range(min(len(head) - 3, 512)):
        if head[at : at + 3] in (b"\xaa\x44\x12", b"\xaa\x44\x13") and (head[at + 2] == 0x13 or head[at + 3] == 28):
            return True
    return is_ascii(head)


def read(path: Path) -> Streams:
    """Read the logs."""
    with open_file(path) as file:
        if is_ascii(file.read(4096)):
            return read_ascii(path)
    oem = library("novatel_edie.oem", "novatel-edie", str(path))
    found: dict[str, list[Any]] = {name: [] for name in _WANTED}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for message in _messages(oem, path):
                name = message.name.removesuffix("A").removesuffix("B")
                if name in found:
                    found[name].append((message.header, message))
        except Exception as error:  # the library raises various errors for damaged files
            raise refused(path, "NovAtel OEM7 logs", error) from error
    if not (found["RAWIMUSX"] or found["BESTPOS"] or found["INSPVAX"]):
        raise InputError(f"{path} holds none of RAWIMUSX, BESTPOS and INSPVAX.")
    weeks = [h.week for messages in found.values() for h, _ in messages if h.week]
    week = min(weeks, default=0)
    notes: list[str] = []
    inertial = _inertial(found["RAWIMUSX"], week, notes)
    fixes = _fixes(found["BESTPOS"], found["BESTVEL"], week)
    solutions = _solutions(found["INSPVAX"], week)
    if not (inertial or fixes or solutions):
        raise InputError(f"{path} contains no usable measurement. {' '.join(notes)}".rstrip())
    clock = Clock("gps", week * WEEK if week else None, f"seconds of the GPS week {week}")
    return Streams(path, "novatel", clock, inertial, fixes, solutions, notes=tuple(notes))


def _messages(oem: Any, path: Path) -> Iterator[Any]:
    """Yield the decoded messages."""
    for message in oem.FileParser(str(path)):
        if isinstance(message, oem.Message):
            yield message


def _time(messages: list[tuple[Any, Any]], week: int) -> Array:
    return np.array([(h.week - week) * float(WEEK) + h.milliseconds * 1e-3 for h, _ in messages])


def _inertial(messages: list[tuple[Any, Any]], week: int, notes: list[str]) -> dict[str, InertialStream]:
    """Return the increments of the IMU."""
    if not messages:
        return {}
    kind = int(messages[0][1].imu_type)
    if kind not in SCALES:
        notes.append(f"RAWIMUSX was left out: the scale factors of IMU type {kind} are not known here.")
        return {}
    name, turn, force = SCALES[kind]
    rows = np.array(
        [(m.gyro_x, -m.gyro_y, m.gyro_z, m.accel_x, -m.accel_y, m.accel_z) for _, m in messages], dtype=np.float64
    )
    time = np.array([(m.gps_week - week) * float(WEEK) + m.gps_seconds for _, m in messages])
    notes.append(f"IMU type {kind}, {name}: counts of {turn:.6g} rad and {force:.6g} m/s, in the axes of the IMU.")
    return {"imu": InertialStream(time, rows[:, :3] * turn, rows[:, 3:] * force, "increments")}


def _fixes(positions: list[tuple[Any, Any]], velocities: list[tuple[Any, Any]], week: int) -> dict[str, FixStream]:
    """Return the fixes, with the velocity of the same instant."""
    positions = [(h, m) for h, m in positions if int(m.solution_status) == 0]
    if not positions:
        return {}
    velocity = np.full((len(positions), 3), math.nan)
    speeds = {(h.week, h.milliseconds): m for h, m in velocities}
    for k, (h, _) in enumerate(positions):
        v = speeds.get((h.week, h.milliseconds))
        if v is not None:
            track = v.ground_track * DEG
            velocity[k] = v.horizontal_speed * math.cos(track), v.horizontal_speed * math.sin(track), -v.z
    quality = np.array([int(m.position_type) for _, m in positions], dtype=np.int64)
    stream = FixStream(
        time=_time(positions, week),
        latitude=np.array([m.latitude for _, m in positions]) * DEG,
        longitude=np.array([m.longitude for _, m in positions]) * DEG,
        height=np.array([m.orthometric_height + m.undulation for _, m in positions]),
        datum="ellipsoid",
        position_sigma=np.array(
            [(m.latitude_std_dev, m.longitude_std_dev, m.height_std_dev) for _, m in positions], dtype=np.float64
        ),
        velocity_ned=velocity if np.isfinite(velocity).any() else None,
        quality=quality,
        quality_words={code: WORDS.get(code, f"type {code}") for code in sorted(set(quality.tolist()))},
    )
    return {"gnss": stream}


def _solutions(messages: list[tuple[Any, Any]], week: int) -> dict[str, SolutionStream]:
    """Return the solution of the receiver's inertial navigator."""
    if not messages:
        return {}

    def rows(*names: str) -> Array:
        return np.array([[getattr(m, name) for name in names] for _, m in messages], dtype=np.float64)

    height = "orthometric_height" if hasattr(messages[0][1], "orthometric_height") else "height"
    place = rows("latitude", "longitude", height, "undulation")
    up = np.array([1.0, 1.0, -1.0])
    stream = SolutionStream(
        time=_time(messages, week),
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2] + place[:, 3],
        datum="ellipsoid",
        velocity_ned=rows("north_vel", "east_vel", "up_vel") * up,
        q_nb=rotation.quaternion_from_euler(*(rows("roll", "pitch", "azimuth") * DEG).T),
        position_sigma=rows("latitude_std_dev", "longitude_std_dev", "height_std_dev"),
        velocity_sigma=rows("north_vel_std_dev", "east_vel_std_dev", "up_vel_std_dev"),
        attitude_sigma=rows("roll_std_dev", "pitch_std_dev", "azimuth_std_dev") * DEG,
    )
    return {"solution": stream}
