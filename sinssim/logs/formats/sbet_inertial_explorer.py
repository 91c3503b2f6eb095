"""Trajectories of post-processing programs: Applanix SBET, read and written, and exports of Inertial Explorer, read.

SBET: records of 17 little-endian doubles without a header. Time [s of the GPS week], latitude, longitude [rad], height
above the ellipsoid [m], velocity x, y, z [m/s], roll, pitch, platform heading, wander angle [rad], acceleration x, y, z
[m/s²], angular rate x, y, z [rad/s] (POSPac; the PDAL page on readers.sbet lists the same). Programs differ in the axes
of the velocity and in the sign of the wander angle: the reader takes those whose velocity is the derivative of the
positions, and says which. The writer sets the wander angle to 0, so that x, y, z of the velocity are north, east, down.

Inertial Explorer and GrafNav (Waypoint, NovAtel): a line of names, a line of units, and rows. Columns are found by
their names: Week, GPSTime, Latitude, Longitude (degrees, or degrees, minutes and seconds), H-Ell or H-MSL, VEast,
VNorth, VUp or the velocity of the body VelBdyX, VelBdyY, VelBdyZ (right, forward, up), Roll, Pitch, Heading or Azimuth,
standard deviations, Q. Exports differ in the sense of Heading: the sense is the one that agrees with the direction of
motion.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import radii
from sinssim.errors import InputError
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import WEEK, check_weeks, unrolled, week_and_seconds
from sinssim.logs.numeric_columns import WHITESPACE, cut_rows, not_a_number, uneven
from sinssim.logs.recorded_streams import Clock, FixStream, HeightDatum, SolutionStream, Streams
from sinssim.system.files import read_text, user_file
from sinssim.units import DEG

_RECORD = 17 * 8
_LOOKED_AT = 2000  # records for finding the axes


def recognises_sbet(path: Path, head: bytes) -> bool:
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


def read_sbet(path: Path) -> Streams:
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
    velocity, sign, note = _sbet_velocity(time, rows)
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


def _sbet_velocity(time: Array, rows: Array) -> tuple[Array | None, float, str]:
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


def write_sbet(content: Content, place: Path) -> list[str]:
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


SBET = Format(recognises_sbet, read_sbet)
SBET_EXPORT = Export(".sbet", "solution", write_sbet)


_FASTER = 2.0  # m/s; above this a vehicle moves about where it points
_R = 6.371e6  # m; a course needs no ellipsoid
_UNITS = re.compile(r"\([^)]*\)")


def recognises_inertial_explorer(path: Path, head: bytes) -> bool:
    """Return whether a line names time, latitude and height as these programs do, with units below it."""
    lines = head.decode("latin-1").splitlines()
    return any(_is_heading(names, units) for names, units in pairwise(lines))


def _is_heading(names: str, units: str) -> bool:
    words = names.replace(",", " ").split()
    named = "Latitude" in words and "Longitude" in words and any(w in words for w in ("H-Ell", "H-MSL"))
    return named and units.count("(") >= 3


def read_inertial_explorer(path: Path) -> Streams:
    """Read the solution."""
    lines = read_text(path, encoding="latin-1").splitlines()
    at = next((k for k in range(len(lines) - 1) if _is_heading(lines[k], lines[k + 1])), None)
    if at is None:
        raise InputError(f"{path} has no line of names with Latitude, Longitude and H-Ell above a line of units.")
    columns = _columns(lines[at].replace(",", " "), lines[at + 1].replace(",", " "))
    width = sum(count for _, count in columns)
    rows: list[list[float]] = []
    cut = cut_rows(path, WHITESPACE, at + 2)
    for number, line in enumerate(lines[at + 2 :], start=at + 3):
        fields = line.replace(",", " ").split()
        if not fields or number in (cut.first, cut.last):
            continue
        if len(fields) not in (width, width - 1):
            if rows:
                break  # a footer
            raise uneven(path, number, len(fields), str(width), WHITESPACE, ", as the names say")
        try:
            rows.append([_number(field) for field in fields[:width]] + [np.nan] * (width - len(fields)))
        except ValueError as error:
            raise not_a_number(path, number, fields) from error
    if len(rows) < 2:
        raise InputError(f"{path} has {len(rows)} rows below its names; at least two are needed.")
    table = np.array(rows)
    of: dict[str, Array] = {}
    first = 0
    for name, count in columns:
        part = table[:, first : first + count]
        sign = np.where(np.signbit(part[:, 0]), -1.0, 1.0)
        value = part[:, 0] if count == 1 else sign * (np.abs(part[:, 0]) + part[:, 1] / 60.0 + part[:, 2] / 3600.0)
        of.setdefault(name, value)
        first += count
    return _inertial_explorer_streams(path, of, [*cut.notes])


def _columns(names: str, units: str) -> list[tuple[str, int]]:
    """Return the names, and how many numbers each has: three for degrees, minutes and seconds."""
    spans = [(m.group(), m.start(), m.end()) for m in re.finditer(r"\S+", names)]
    triple = set()
    for unit in _UNITS.finditer(units):
        if re.search(r"D\s+M\s+S", unit.group()):
            near = min(range(len(spans)), key=lambda k: abs(spans[k][2] - unit.end()))
            triple.add(near)
    return [(name, 3 if k in triple else 1) for k, (name, _, _) in enumerate(spans)]


def _number(text: str) -> float:
    if ":" in text or text.count("/") == 2:  # dates and times of day beside the GPS time
        return float("nan")
    return float(text)


def _inertial_explorer_streams(path: Path, of: dict[str, Array], notes: list[str]) -> Streams:
    if "GPSTime" not in of:
        raise InputError(f"{path} has no column GPSTime: export it, with Week.")
    if known := "Week" in of:
        check_weeks(path, of["Week"])
    week = int(of["Week"][0]) if known else 0
    time = of["GPSTime"] + ((of["Week"] - week) * WEEK if known else 0.0)
    latitude, longitude = of["Latitude"] * DEG, of["Longitude"] * DEG
    ellipsoidal = "H-Ell" in of
    height = of["H-Ell"] if ellipsoidal else of["H-MSL"]
    datum: HeightDatum = "ellipsoid" if ellipsoidal else "mean sea level"
    velocity = None
    if {"VEast", "VNorth", "VUp"} <= set(of):
        velocity = np.column_stack([of["VNorth"], of["VEast"], -of["VUp"]])
    q_nb = None
    heading = of.get("Azimuth", of.get("Heading"))
    if heading is not None and {"Roll", "Pitch"} <= set(of):
        sense = _sense(time, latitude, longitude, velocity, heading * DEG)
        notes += ["Heading is counted counter-clockwise, as the direction of motion shows."] if sense < 0.0 else []
        q_nb = rotation.quaternion_from_euler(of["Roll"] * DEG, of["Pitch"] * DEG, sense * heading * DEG)
        if velocity is None and {"VelBdyX", "VelBdyY", "VelBdyZ"} <= set(of):
            body = np.column_stack([of["VelBdyY"], of["VelBdyX"], -of["VelBdyZ"]])
            velocity = np.einsum("nij,nj->ni", rotation.dcm_from_quaternion(q_nb), body)
    sigma = None
    for names in (("SDNorth", "SDEast", "SDHeight"), ("SDHoriz", "SDHoriz", "SDHeight")):
        if sigma is None and set(names) <= set(of):
            sigma = np.column_stack([of[name] for name in names])
    clock = Clock("gps", week * WEEK if known else None, f"seconds of the GPS week {week}" if known else "GPS seconds")
    if q_nb is None:
        fixes = FixStream(time, latitude, longitude, height, datum, sigma, velocity)
        return Streams(path, "inertial-explorer", clock, fixes={"gnss": fixes}, notes=tuple(notes))
    solution = SolutionStream(time, latitude, longitude, height, datum, velocity, q_nb, sigma)
    return Streams(path, "inertial-explorer", clock, solutions={"solution": solution}, notes=tuple(notes))


def _sense(time: Array, latitude: Array, longitude: Array, velocity: Array | None, heading: Array) -> float:
    """Return 1 if the heading is clockwise from north, −1 if it is counter-clockwise, by the direction of motion."""
    if velocity is None:
        north = np.gradient(latitude, time) * _R
        east = np.gradient(np.unwrap(longitude), time) * _R * np.cos(latitude)
    else:
        north, east = velocity[:, 0], velocity[:, 1]
    moving = np.hypot(north, east) > _FASTER
    if not moving.any():
        return 1.0
    course = np.arctan2(east, north)[moving]
    with_it, against = (float(np.mean(np.cos(sense * heading[moving] - course))) for sense in (1.0, -1.0))
    return 1.0 if with_it >= against else -1.0


INERTIAL_EXPLORER = Format(recognises_inertial_explorer, read_inertial_explorer)
