"""NovAtel OEM7 and Unicore: binary logs (novatel-edie: RAWIMUSX, BESTPOS with BESTVEL, INSPVAX), and logs as text.

Times are seconds of the GPS week, with the week. Heights of BESTPOS and INSPVAX are those above mean sea level plus the
undulation. RAWIMUSX has counts of increments along z, −y, x; their scale factors depend on the type of IMU ("Raw IMU
Scale Factors" of the OEM7 manual).

Text: RAWIMU, BESTPOS with BESTVEL, BESTNAV, INSPVA, as "#NAME,port,…,week,seconds,…;body*checksum" with a long heading,
"%NAME,week,seconds;body*checksum" with a short one (OEM7 Commands and Logs Reference Manual, "Message Formats").
RAWIMUA and RAWIMUSA do not name the IMU; its scale factors are then those of the only known IMU that measures gravity.
"""

from __future__ import annotations

import math
import warnings
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats import Format, library, refused
from sinssim.logs.gps_time import WEEK
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.files import open_file, read_text
from sinssim.units import ARCSEC, DEG, FOOT, G0

_EPSON = 1e-3 * G0 / 65536.0
SCALES: dict[int, tuple[str, float, float]] = {
    5: ("HG1900-CA29", 2.0**-33, 2.0**-27 * FOOT),
    8: ("LN-200", 2.0**-19, 2.0**-14),
    11: ("HG1700-AG58", 2.0**-33, 2.0**-27 * FOOT),
    12: ("HG1700-AG62", 2.0**-33, 2.0**-26 * FOOT),
    13: ("iMAR-FSAS", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    16: ("CPT", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    26: ("ISA-100C", 1e-9, 2e-8),
    27: ("HG1900-CA50", 2.0**-33, 2.0**-27 * FOOT),
    31: ("ADIS16488", 720.0 / 2.0**31 * DEG, 200.0 / 2.0**31),
    32: ("STIM300", 2.0**-21 * DEG, 2.0**-22),
    33: ("KVH 1750", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    41: ("EG320N", 0.008 / 65536.0 / 125.0 * DEG, 0.2 * _EPSON / 125.0),
    58: ("HG4930", 2.0**-33, 2.0**-29),
}
"""Name, rad and m/s of a count, by the type of IMU. Type 41 agrees with the manual's example: |f| = 9.86 m/s²."""


TYPES = {
    "NONE": 0, "FIXEDPOS": 1, "FIXEDHEIGHT": 2, "DOPPLER_VELOCITY": 8, "SINGLE": 16, "PSRDIFF": 17, "WAAS": 18,
    "PROPAGATED": 19, "L1_FLOAT": 32, "NARROW_FLOAT": 34, "L1_INT": 48, "WIDE_INT": 49, "NARROW_INT": 50,
    "RTK_DIRECT_INS": 51, "INS_SBAS": 52, "INS_PSRSP": 53, "INS_PSRDIFF": 54, "INS_RTKFLOAT": 55, "INS_RTKFIXED": 56,
    "PPP_CONVERGING": 68, "PPP": 69,
}  # fmt: skip
"""Codes of the types of a position by their names ("Position or Velocity Type" of the manual)."""
WORDS = {0: "none", 16: "single", 17: "differential", 18: "SBAS", 32: "float", 34: "float", 48: "fixed", 49: "fixed",
         50: "fixed", 52: "SBAS", 53: "single", 54: "differential", 55: "float", 56: "fixed"}  # fmt: skip
_OTHER = 999
_WITHOUT = ("INS_INACTIVE", "INS_ALIGNING", "DETERMINING", "WAITING")
"""Beginnings of the states in which the receiver's navigator has no solution."""
_NEAR_G = 0.03
"""Relative departure from gravity up to which scale factors fit; those of different IMUs differ by 20 % or more."""

Fields = list[str]
Row = tuple[int, float, int, Fields]
"""Week, seconds and line number of a log, and the fields of its body."""


def is_ascii(head: bytes) -> bool:
    """Return whether the first bytes are logs as text."""
    return any(
        line[:1] in (b"#", b"%") and b";" in line and line[1:].split(b",")[0].endswith(b"A") and line[1:4].isupper()
        for line in head.splitlines()[:20]
    )


def read_ascii(path: Path) -> Streams:
    """Read logs as text."""
    logs, notes = _logs(path)
    imu = [(name, logs[name]) for name in ("RAWIMUSX", "RAWIMUX", "RAWIMUS", "RAWIMU") if name in logs]
    positions = next((logs[n] for n in ("BESTGNSSPOS", "BESTPOS", "BESTNAV") if n in logs), [])
    velocities = [row for n in ("BESTGNSSVEL", "BESTVEL") for row in logs.get(n, ())]
    solutions = next(((n, logs[n]) for n in ("INSPVAX", "INSPVAS", "INSPVA", "INSPVASX") if n in logs), None)
    rows = [row for many in logs.values() for row in many]
    weeks = [row[0] for row in rows if row[0]]
    week = min(weeks, default=0)
    try:
        inertial = {} if not imu else {"imu": _inertial_of_rows(path, *imu[0], week, notes)}
        fixes = _fixes_of_rows(positions, velocities, week)
        solved = {} if solutions is None else _solution(*solutions, week)
    except _WrongLineError as error:
        raise InputError(f"{path}, line {error.args[0]}: {error.args[1]}") from error
    if not (inertial or fixes or solved):
        raise InputError(f"{path} holds none of RAWIMU, BESTPOS, BESTNAV and INSPVA with a solution.")
    clock = Clock("gps", week * WEEK if week else None, f"seconds of the GPS week {week}")
    return Streams(path, "novatel", clock, inertial, fixes, solved, notes=tuple(notes))


class _WrongLineError(Exception):
    """A line that cannot be read: its number, and why."""


def _logs(path: Path) -> tuple[dict[str, list[Row]], list[str]]:
    """Return the logs by name, without the A of ASCII, and notes on damaged lines."""
    rows_of: dict[str, list[Row]] = {}
    damaged: list[int] = []
    lines = read_text(path, encoding="latin-1").splitlines()
    for number, line in enumerate(lines, start=1):
        at = max(line.find("#"), line.find("%")) if line[:1] not in "#%" else 0
        text, star, check = line[at:].partition("*")
        head, semicolon, body = text.partition(";")
        if at < 0 or not semicolon:
            continue
        fields = head[1:].split(",")
        cut = number == len(lines) and not star and "*" in lines[number - 2]
        if cut or (star and not _right(text[1:], check)):
            damaged.append(number)
            continue
        try:
            week, seconds = (fields[5], fields[6]) if text[0] == "#" else (fields[1], fields[2])
            row = int(week), float(seconds), number, [field.strip('" ') for field in body.split(",")]
        except (ValueError, IndexError):
            damaged.append(number)
            continue
        rows_of.setdefault(fields[0].removesuffix("A"), []).append(row)
    notes = []
    if damaged:
        notes.append(f"{len(damaged)} damaged lines are left out, first line {damaged[0]}: their checksums are wrong.")
    return rows_of, notes


def _right(text: str, check: str) -> bool:
    """Return whether a checksum is right: CRC-32 with the initial value 0 and no final inversion."""
    try:
        return int(check.strip()[:8], 16) == zlib.crc32(text.encode("latin-1"), 0xFFFFFFFF) ^ 0xFFFFFFFF
    except ValueError:
        return False


def _numbers(row: Row, first: int, count: int) -> list[float]:
    """Return numbers of the body of a log."""
    try:
        values = [float(field) for field in row[3][first : first + count]]
    except ValueError as error:
        raise _WrongLineError(row[2], f"{error}.") from error
    if len(values) < count:
        raise _WrongLineError(row[2], f"the log has {len(row[3])} fields; {first + count} are needed.")
    return values


def _time_of_rows(rows: list[Row], week: int) -> Array:
    return np.array([(row[0] - week) * float(WEEK) + row[1] for row in rows])


def _inertial_of_rows(path: Path, name: str, rows: list[Row], week: int, notes: list[str]) -> InertialStream:
    """Return the increments of the IMU: RAWIMUX has its type before the time, RAWIMU has not."""
    typed = name.endswith("X")
    values = np.array([_numbers(row, 2 if typed else 0, 9 if not typed else 2) for row in rows])
    if typed:
        kind = int(_numbers(rows[0], 1, 1)[0])
        if kind not in SCALES:
            raise InputError(f"{path}: the scale factors of the IMU of type {kind} ({name}) are not known here.")
        counts = np.array([_numbers(row, 5, 6) for row in rows])
        scale = SCALES[kind]
        notes.append(f"IMU type {kind}, {scale[0]}: counts of {scale[1]:.6g} rad and {scale[2]:.6g} m/s.")
    else:
        counts = values[:, 3:]
    time = (values[:, 0] - week) * float(WEEK) + values[:, 1]
    if not typed:
        scale = _scale_of(path, name, time, counts)
        notes.append(
            f"{name} does not name the IMU; of the known ones, {scale[0]} measures gravity: counts of {scale[1]:.6g} "
            f"rad and {scale[2]:.6g} m/s."
        )
    sign = np.array([1.0, -1.0, 1.0])
    accel, gyro = counts[:, 2::-1] * sign, counts[:, :2:-1] * sign  # z, −y, x
    return InertialStream(time, gyro * scale[1], accel * scale[2], "increments")


def _scale_of(path: Path, name: str, time: Array, counts: Array) -> tuple[str, float, float]:
    """Return the scale factors of the IMU with which the specific force is gravity."""
    if len(time) < 2:
        raise InputError(f"{path}: one {name} is not enough.")
    size = float(np.median(np.linalg.norm(counts[:, :3], axis=1))) / float(np.median(np.diff(time)))
    best = min(SCALES.values(), key=lambda scale: abs(size * scale[2] / G0 - 1.0))
    if abs(size * best[2] / G0 - 1.0) > _NEAR_G:
        raise InputError(
            f"{path}: {name} does not name the IMU, and with no known scale factors its specific force is gravity "
            f"(nearest {best[0]}: {size * best[2]:.4g} m/s²). Log RAWIMUSX, which names the IMU."
        )
    return best


def _fixes_of_rows(positions: list[Row], velocities: list[Row], week: int) -> dict[str, FixStream]:
    """Return the fixes, with the velocity of the same instant."""
    positions = [row for row in positions if row[3][0] == "SOL_COMPUTED"]
    if not positions:
        return {}
    place = np.array([_numbers(row, 2, 4) for row in positions])
    sigma = np.array([_numbers(row, 7, 3) for row in positions])
    speeds: Mapping[tuple[int, float], list[float]] = {
        (row[0], row[1]): _numbers(row, 4, 3) for row in velocities if row[3][0] == "SOL_COMPUTED"
    }
    velocity = np.full((len(positions), 3), math.nan)
    for k, row in enumerate(positions):
        status = next((j for j in range(10, len(row[3])) if row[3][j] == "SOL_COMPUTED"), None)  # BESTNAV has both
        given = _numbers(row, status + 4, 3) if status is not None else speeds.get((row[0], row[1]))
        if given is not None:
            north, east = given[0] * math.cos(given[1] * DEG), given[0] * math.sin(given[1] * DEG)
            velocity[k] = north, east, -given[2]
    types = [TYPES.get(row[3][1], _OTHER) for row in positions]
    return _gnss(_time_of_rows(positions, week), place, sigma, velocity, types)


def _gnss(time: Array, place: Array, sigma: Array, velocity: Array, types: list[int]) -> dict[str, FixStream]:
    """Return fixes from latitudes, longitudes, heights and undulations, (M, 4), in degrees and m."""
    stream = FixStream(
        time=time,
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2] + place[:, 3],
        datum="ellipsoid",
        position_sigma=sigma,
        velocity_ned=velocity if np.isfinite(velocity).any() else None,
        quality=np.array(types, dtype=np.int64),
        quality_words={code: WORDS.get(code, f"type {code}") for code in sorted(set(types))},
    )
    return {"gnss": stream}


def _solution(name: str, rows: list[Row], week: int) -> dict[str, SolutionStream]:
    """Return the solution of the receiver's inertial navigator, where it has one."""
    extended = name.endswith("X")
    rows = [row for row in rows if not row[3][0 if extended else -1].startswith(_WITHOUT)]
    if not rows:
        return {}
    values = np.array([_numbers(row, 2, 10) for row in rows] if extended else [_numbers(row, 2, 9) for row in rows])
    height = values[:, 2] + (values[:, 3] if extended else 0.0)  # INSPVA has ellipsoidal heights
    rest = values[:, 4:] if extended else values[:, 3:]
    time = _time_of_rows(rows, week)
    sigma = np.array([_numbers(row, 12, 9) for row in rows]) if extended else None
    return _solved(time, np.column_stack((values[:, :2], height)), rest[:, :3], rest[:, 3:6], sigma)


def _solved(
    time: Array, place: Array, velocity: Array, angles: Array, sigma: Array | None
) -> dict[str, SolutionStream]:
    """Return a solution from latitudes, longitudes and heights, velocities north, east, up, and roll, pitch and
    heading, (M, 3) each, in degrees, m and m/s, and their 1σ, (M, 9)."""
    stream = SolutionStream(
        time=time,
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2],
        datum="ellipsoid",
        velocity_ned=velocity * np.array([1.0, 1.0, -1.0]),
        q_nb=rotation.quaternion_from_euler(*(angles * DEG).T),
        position_sigma=None if sigma is None else sigma[:, :3],
        velocity_sigma=None if sigma is None else sigma[:, 3:6],
        attitude_sigma=None if sigma is None else sigma[:, 6:9] * DEG,
    )
    return {"solution": stream}


_POSITION_SIGMA = ("latitude_std_dev", "longitude_std_dev", "height_std_dev")
_OTHER_SIGMA = (
    "north_vel_std_dev", "east_vel_std_dev", "up_vel_std_dev", "roll_std_dev", "pitch_std_dev", "azimuth_std_dev",
)  # fmt: skip
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
    decoded: dict[str, list[Any]] = {name: [] for name in _WANTED}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for message in filter(lambda entry: isinstance(entry, oem.Message), oem.FileParser(str(path))):
                name = message.name.removesuffix("A").removesuffix("B")
                if name in decoded:
                    decoded[name].append((message.header, message))
        except Exception as error:  # the library raises various errors for damaged files
            raise refused(path, "NovAtel OEM7 logs", error) from error
    if not (decoded["RAWIMUSX"] or decoded["BESTPOS"] or decoded["INSPVAX"]):
        raise InputError(f"{path} holds none of RAWIMUSX, BESTPOS and INSPVAX.")
    weeks = [h.week for messages in decoded.values() for h, _ in messages if h.week]
    week = min(weeks, default=0)
    notes: list[str] = []
    inertial = _inertial(decoded["RAWIMUSX"], week, notes)
    fixes = _fixes(decoded["BESTPOS"], decoded["BESTVEL"], week)
    solutions = _solutions(decoded["INSPVAX"], week)
    if not (inertial or fixes or solutions):
        raise InputError(f"{path} contains no usable measurement. {' '.join(notes)}".rstrip())
    clock = Clock("gps", week * WEEK if week else None, f"seconds of the GPS week {week}")
    return Streams(path, "novatel", clock, inertial, fixes, solutions, notes=tuple(notes))


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
    place = _columns(positions, "latitude", "longitude", "orthometric_height", "undulation")
    sigma = _columns(positions, *_POSITION_SIGMA)
    return _gnss(_time(positions, week), place, sigma, velocity, [int(m.position_type) for _, m in positions])


def _columns(messages: list[tuple[Any, Any]], *names: str) -> Array:
    return np.array([[getattr(m, name) for name in names] for _, m in messages], dtype=np.float64)


def _solutions(messages: list[tuple[Any, Any]], week: int) -> dict[str, SolutionStream]:
    """Return the solution of the receiver's inertial navigator."""
    if not messages:
        return {}
    height = "orthometric_height" if hasattr(messages[0][1], "orthometric_height") else "height"
    place = _columns(messages, "latitude", "longitude", height, "undulation")
    place[:, 2] += place[:, 3]
    velocity = _columns(messages, "north_vel", "east_vel", "up_vel")
    angles = _columns(messages, "roll", "pitch", "azimuth")
    sigma = _columns(messages, *_POSITION_SIGMA, *_OTHER_SIGMA)
    return _solved(_time(messages, week), place, velocity, angles, sigma)


FORMAT = Format(recognises, read)
