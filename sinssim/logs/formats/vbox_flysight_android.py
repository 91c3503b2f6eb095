"""Receivers of satellites: Racelogic VBOX (.vbo), FlySight 2, GnssLogger of Android (Google).

VBOX: sections in brackets, column names, and rows of numbers with blanks between them. Latitude and longitude are
minutes, west positive; times are hhmmss.ss in UTC, with the date in the first line; speeds are km/h unless the heading
says otherwise. Layout: "VBO file format", Racelogic support centre.

FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers; lines $COL and $UNIT describe the rows. The
sensors' times are seconds since the start of the device; a row $TIME gives the GPS week and the seconds of the week of
such a time. Fixes are dated in UTC, with heights above mean sea level. Layout: FlySight documentation, "CSV files".

GnssLogger: lines of several kinds, each with its names in a comment: "# UncalGyro,utcTime…". Used are Accel or
UncalAccel, Gyro or UncalGyro, and Fix of the satellites. All times are those since the start of the phone
(elapsedRealtimeNanos); its offset from UTC is that of the fixes. Accelerometers are interpolated to the times of the
gyros. Layout: the comments that the application writes.
"""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.column_names import SPELLED
from sinssim.logs.formats import Format
from sinssim.logs.gps_time import DAY, EPOCH_UNIX, WEEK, date_seconds, gps_from_unix, unrolled
from sinssim.logs.numeric_columns import (
    WHITESPACE,
    check_finite,
    cut_row,
    cut_rows,
    numbers_of,
    text_rows,
    uneven,
)
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.system.files import open_text, read_text
from sinssim.units import DEG, KNOT

_ANDROID_KINDS = ("Accel", "UncalAccel", "Gyro", "UncalGyro", "Fix")
_ANDROID_PROVIDERS = ("gps", "fused", "flp", "gt")
"""Sources of a fix in the order of preference; positions of the network are not used."""


def read_android(path: Path) -> Streams:
    """Read the sensors and the fixes."""
    names: dict[str, list[str]] = {}
    rows: dict[str, list[tuple[int, list[str]]]] = {}
    lines = read_text(path, encoding="utf-8", errors="replace").splitlines()
    notes: list[str] = []
    for number, line in enumerate(lines, start=1):
        fields = [field.strip() for field in line.lstrip("# ").split(",")]
        if fields[0] not in _ANDROID_KINDS:
            continue
        if line.startswith("#"):
            names[fields[0]] = fields
        elif number == len(lines) and len(fields) < (width := len(names.get(fields[0], ()))):
            notes.append(cut_row(path.name, number, "last", len(fields), width))
        else:
            rows.setdefault(fields[0], []).append((number, fields))
    tables = {kind: _android_table(path, kind, names, rows[kind]) for kind in rows if kind in names}
    fixes, origin = _android_fixes(path, names.get("Fix", []), rows.get("Fix", []), tables)
    gyro = next((tables[kind] for kind in ("Gyro", "UncalGyro") if kind in tables), None)
    accel = next((tables[kind] for kind in ("Accel", "UncalAccel") if kind in tables), None)
    inertial: dict[str, InertialStream] = {}
    if gyro is not None and accel is not None:
        time = gyro[:, 1] * 1e-9
        force = np.stack([np.interp(time, accel[:, 1] * 1e-9, axis) for axis in accel[:, 2:5].T], axis=1)
        inside = (time >= accel[0, 1] * 1e-9) & (time <= accel[-1, 1] * 1e-9)
        inertial["imu"] = InertialStream(time[inside], gyro[inside, 2:5], force[inside])
        notes.append("Accelerometers are interpolated linearly to the times of the gyros.")
    if not (inertial or fixes):
        raise InputError(f"{path} has neither Gyro and Accel lines nor a Fix of the satellites.")
    if origin is None:
        clock = Clock("machine", None, "time since the start of the phone")
    else:
        clock = Clock("utc", int(gps_from_unix(origin)), "time since the start of the phone, in UTC by the fixes")
    return Streams(path, "android-gnss", clock, inertial, {"gnss": fixes} if fixes else {}, notes=tuple(notes))


def _android_table(path: Path, kind: str, names: dict[str, list[str]], rows: list[tuple[int, list[str]]]) -> Array:
    """Return utcTimeMillis, elapsedRealtimeNanos and x, y, z of a sensor, (N, 5); nothing for fixes."""
    if kind == "Fix":
        return np.empty((0, 5))
    numbers = []
    for number, fields in rows:
        try:
            numbers.append([float(field) for field in fields[1:6]])
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {kind}: {error}.") from error
        if len(numbers[-1]) < 5 or not np.isfinite(numbers[-1]).all():
            raise InputError(f"{path}, line {number}: {kind} needs two times and three finite numbers.")
    if names[kind][1:3] != ["utcTimeMillis", "elapsedRealtimeNanos"]:
        raise InputError(f"{path}: {kind} has the columns {', '.join(names[kind])}; the two times come first.")
    table = np.array(numbers)
    return np.asarray(table[np.append(True, np.diff(table[:, 1]) > 0.0)])


def _android_fixes(
    path: Path, names: list[str], rows: list[tuple[int, list[str]]], tables: dict[str, Array]
) -> tuple[FixStream | None, int | None]:
    """Return the fixes of the satellites, and the Unix time of the start of the phone, whole seconds."""
    sources = {fields[1].lower() for _, fields in rows if len(fields) > 1}
    source = next((provider for provider in _ANDROID_PROVIDERS if provider in sources), None)
    rows = [(number, fields) for number, fields in rows if len(fields) > 1 and fields[1].lower() == source]
    sensors = [table for table in tables.values() if len(table)]
    if not rows or ("UnixTimeMillis" not in names and "(UTC)TimeInMs" not in names):
        return None, None

    def column(name: str) -> Array:
        k = names.index(name) if name in names else -1
        values = []
        for number, fields in rows:
            text = fields[k] if 0 <= k < len(fields) else ""
            try:
                values.append(float(text) if text else np.nan)
            except ValueError as error:
                raise InputError(f"{path}, line {number}: {name}: {error}.") from error
        return np.array(values)

    unix = column("UnixTimeMillis" if "UnixTimeMillis" in names else "(UTC)TimeInMs") * 1e-3
    since = column("elapsedRealtimeNanos") * 1e-9
    if not np.isfinite(since).all():
        offset = float(np.median(sensors[0][:, 0] * 1e-3 - sensors[0][:, 1] * 1e-9)) if sensors else float(unix[0])
        since = unix - offset
    if not (np.isfinite(unix).all() and np.isfinite(since).all()):
        k = int(np.argmin(np.isfinite(unix) & np.isfinite(since)))
        raise InputError(f"{path}, line {rows[k][0]}: Fix has no time.")
    origin = round(float(np.median(unix - since)))
    speed, course = column("SpeedMps"), column("BearingDegrees") * DEG
    course = np.where((speed == 0.0) & ~np.isfinite(course), 0.0, course)
    accuracy, vertical, fast = (
        column(name) for name in ("AccuracyMeters", "VerticalAccuracyMeters", "SpeedAccuracyMps")
    )
    vertical = np.where(np.isfinite(vertical), vertical, 2.0 * accuracy)
    velocity = np.column_stack([speed * np.cos(course), speed * np.sin(course), np.full(len(speed), np.nan)])
    fixes = FixStream(
        since,
        column("LatitudeDegrees") * DEG,
        column("LongitudeDegrees") * DEG,
        column("AltitudeMeters"),
        "ellipsoid",
        np.column_stack([accuracy, accuracy, vertical]) if np.isfinite(accuracy).all() else None,
        velocity if np.isfinite(speed).any() else None,
        np.column_stack([fast, fast, fast]) if np.isfinite(fast).all() else None,
    )
    return fixes, origin


_FLYSIGHT_IMU = ("time", "wx", "wy", "wz", "ax", "ay", "az")
_FLYSIGHT_GNSS = ("lat", "lon", "hMSL", "velN", "velE", "velD", "hAcc", "vAcc", "sAcc")


def read_flysight(path: Path) -> Streams:
    """Read the fixes, or the gyros and accelerometers."""
    cut = cut_rows(path, ",", _flysight_first_row(path))
    rows: dict[str, list[list[str]]] = {}
    columns: dict[str, list[str]] = {}
    units: dict[str, list[str]] = {}
    for number, fields in text_rows(path, ",", 0, cut, comments=False):
        if fields[0] in ("$COL", "$UNIT") and len(fields) > 2:
            (columns if fields[0] == "$COL" else units)[fields[1]] = fields[2:]
        elif (kind := fields[0].removeprefix("$")) in columns:
            if len(fields) != len(columns[kind]) + 1:
                raise uneven(path, number, len(fields), str(len(columns[kind]) + 1), ",", ", as $COL says")
            rows.setdefault(kind, []).append(fields[1:])

    def of(kind: str, name: str) -> Array:
        if name not in columns[kind]:
            raise InputError(f"{path}: $COL,{kind} has no column {name}.")
        k = columns[kind].index(name)
        unit = dict(enumerate(units.get(kind, ()))).get(k, "")
        try:
            return np.array([float(row[k]) for row in rows[kind]]) * SPELLED.get(unit, 1.0)
        except ValueError as error:
            raise InputError(f"{path}: the column {name} of {kind}: {error}.") from error

    if "GNSS" in rows:
        texts = [row[columns["GNSS"].index("time")] for row in rows["GNSS"]]
        time, dated = date_seconds(texts)
        place = {name: of("GNSS", name) for name in _FLYSIGHT_GNSS}
        sigma = np.column_stack([place["hAcc"], place["hAcc"], place["vAcc"]])
        velocity = np.column_stack([place["velN"], place["velE"], place["velD"]])
        speed_sigma = np.repeat(place["sAcc"][:, None], 3, axis=1)
        at = place["lat"], place["lon"], place["hMSL"]
        fixes = FixStream(time, *at, "mean sea level", sigma, velocity, speed_sigma)
        clock = dated or Clock("utc", None, "times of day in UTC")
        return Streams(path, "flysight", clock, fixes={"gnss": fixes}, notes=cut.notes)
    if "IMU" not in rows:
        raise InputError(f"{path} has neither rows $GNSS nor rows $IMU.")
    readings = np.column_stack([of("IMU", name) for name in _FLYSIGHT_IMU])
    clock, time = Clock("machine", None, "seconds since the start of the device"), readings[:, 0]
    check_finite(path, time, "time of an $IMU row")
    if "TIME" in rows:
        offsets = of("TIME", "week") * WEEK + of("TIME", "tow") - of("TIME", "time")
        check_finite(path, offsets, "time of a $TIME row")
        ahead = float(np.median(offsets))
        origin = int(np.floor(ahead + time[0]))
        clock, time = (
            Clock("gps", origin, "clock of the device, set by its rows of GPS time (median)"),
            time + (ahead - origin),
        )
    return Streams(
        path,
        "flysight",
        clock,
        inertial={"imu": InertialStream(time, readings[:, 1:4], readings[:, 4:])},
        notes=cut.notes,
    )


def _flysight_first_row(path: Path) -> int:
    """Return the number of lines before the rows."""
    with open_text(path, encoding="latin-1") as file:
        return next((k for k, line in enumerate(file, start=1) if line.strip() == "$DATA"), 0)


_VBOX_EPOCH = datetime(1980, 1, 6)
_VBOX_MINUTE = DEG / 60.0


def recognises_vbox(path: Path, head: bytes) -> bool:
    """Return whether the first lines have the sections of a VBOX file."""
    text = head.lower()
    return b"[column names]" in text or (path.suffix.lower() == ".vbo" and b"[header]" in text)


def read_vbox(path: Path) -> Streams:
    """Read the fixes."""
    lines = read_text(path, encoding="latin-1").splitlines()
    sections: dict[str, list[tuple[int, str]]] = {}
    name = ""
    for number, line in enumerate(lines, start=1):
        if line.strip().startswith("["):
            name = line.strip().lower()
        elif line.strip():
            sections.setdefault(name, []).append((number, line.strip()))
    columns = " ".join(line for _, line in sections.get("[column names]", ())).lower().split()
    if not {"time", "lat", "long"} <= set(columns) or not sections.get("[data]"):
        raise InputError(f"{path} has no [column names] with time, lat and long, or no [data].")
    cut = cut_rows(path, WHITESPACE, sections["[data]"][0][0] - 1, len(columns))
    rows = ((k, line.split()) for k, line in sections["[data]"] if k not in (cut.first, cut.last))
    table = numbers_of(path, rows, len(columns))
    table = table[(table[:, columns.index("lat")] != 0.0) | (table[:, columns.index("long")] != 0.0)]
    if not len(table):
        raise InputError(f"{path} has no position.")
    of = {key: table[:, k] for k, key in enumerate(columns)}
    heading = " ".join(line for _, line in sections.get("[header]", ())).lower()
    speed_unit = KNOT if "velocity knots" in heading else 1.0 / 3.6
    clock, time = _vbox_clock(of["time"], lines[0])
    velocity = None
    if {"velocity", "heading"} <= set(columns):
        speed, course = of["velocity"] * speed_unit, of["heading"] * DEG
        vertical = next((of[key] for key in ("vert-vel", "vertical_velocity", "vert_vel") if key in of), None)
        scale = 1.0 if "vertical velocity m/s" in heading else 1.0 / 3.6
        down = np.full(len(table), np.nan) if vertical is None else -vertical * scale
        velocity = np.column_stack([speed * np.cos(course), speed * np.sin(course), down])
    height = of.get("height", np.full(len(table), np.nan))
    fixes = FixStream(time, of["lat"] * _VBOX_MINUTE, -of["long"] * _VBOX_MINUTE, height, velocity_ned=velocity)
    return Streams(path, "vbox", clock, fixes={"gnss": fixes}, notes=cut.notes)


def _vbox_clock(stamps: np.ndarray[tuple[int], np.dtype[np.float64]], first: str) -> tuple[Clock, np.ndarray]:
    """Return the clock and the times of stamps such as 160001.25."""
    whole = np.floor(stamps + 1e-6)
    seconds = unrolled(whole // 10000 * 3600 + whole // 100 % 100 * 60 + whole % 100 + (stamps - whole), DAY)
    date = re.search(r"(\d{1,2})[/.-](\d{1,2})[/.-](\d{4})", first)
    if date is None:
        return Clock("utc", None, "time of day in UTC, without a date"), seconds
    try:
        day = (datetime(int(date[3]), int(date[2]), int(date[1])) - _VBOX_EPOCH).days * DAY
    except ValueError:
        return Clock("utc", None, "time of day in UTC, without a date"), seconds
    return Clock("utc", int(gps_from_unix(day + EPOCH_UNIX)), "time of day in UTC, date of the file"), seconds


VBOX = Format(recognises_vbox, read_vbox)
FLYSIGHT = Format(lambda _, head: head.lstrip(b"\xef\xbb\xbf").startswith(b"$FLYS"), read_flysight)
ANDROID = Format(lambda _, head: b"# Raw," in head or b"# Fix,Provider" in head, read_android)
