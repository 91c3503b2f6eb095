"""GnssLogger of Android (Google): lines of several kinds, each with its names in a comment: "# UncalGyro,utcTime…".

Used are Accel or UncalAccel, Gyro or UncalGyro, and Fix of the satellites. All times are those since the start of the
phone (elapsedRealtimeNanos); its offset from UTC is that of the fixes. Accelerometers are interpolated to the times of
the gyros. Layout: the comments that the application writes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.gps_time import gps_from_unix
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, Streams
from sinssim.logs.text.rows import cut_row
from sinssim.system.user_file import read_text
from sinssim.units import DEG

_KINDS = ("Accel", "UncalAccel", "Gyro", "UncalGyro", "Fix")
_PROVIDERS = ("gps", "fused", "flp", "gt")
"""Sources of a fix in the order of preference; positions of the network are not used."""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first lines name the columns of satellites' data or of fixes."""
    return b"# Raw," in head or b"# Fix,Provider" in head


def read(path: Path) -> Streams:
    """Read the sensors and the fixes."""
    names: dict[str, list[str]] = {}
    rows: dict[str, list[tuple[int, list[str]]]] = {}
    lines = read_text(path, encoding="utf-8", errors="replace").splitlines()
    notes: list[str] = []
    for number, line in enumerate(lines, start=1):
        fields = [field.strip() for field in line.lstrip("# ").split(",")]
        if fields[0] not in _KINDS:
            continue
        if line.startswith("#"):
            names[fields[0]] = fields
        elif number == len(lines) and len(fields) < (width := len(names.get(fields[0], ()))):
            notes.append(cut_row(path.name, number, "last", len(fields), width))
        else:
            rows.setdefault(fields[0], []).append((number, fields))
    tables = {kind: _table(path, kind, names, rows[kind]) for kind in rows if kind in names}
    fixes, origin = _fixes(path, names.get("Fix", []), rows.get("Fix", []), tables)
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


def _table(path: Path, kind: str, names: dict[str, list[str]], rows: list[tuple[int, list[str]]]) -> Array:
    """Return utcTimeMillis, elapsedRealtimeNanos and x, y, z of a sensor, (N, 5); nothing for fixes."""
    if kind == "Fix":
        return np.empty((0, 5))
    found = []
    for number, fields in rows:
        try:
            found.append([float(field) for field in fields[1:6]])
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {kind}: {error}.") from error
        if len(found[-1]) < 5 or not np.isfinite(found[-1]).all():
            raise InputError(f"{path}, line {number}: {kind} needs two times and three finite numbers.")
    if names[kind][1:3] != ["utcTimeMillis", "elapsedRealtimeNanos"]:
        raise InputError(f"{path}: {kind} has the columns {', '.join(names[kind])}; the two times come first.")
    table = np.array(found)
    return np.asarray(table[np.append(True, np.diff(table[:, 1]) > 0.0)])


def _fixes(
    path: Path, names: list[str], rows: list[tuple[int, list[str]]], tables: dict[str, Array]
) -> tuple[FixStream | None, int | None]:
    """Return the fixes of the satellites, and the Unix time of the start of the phone, whole seconds."""
    sources = {fields[1].lower() for _, fields in rows if len(fields) > 1}
    source = next((one for one in _PROVIDERS if one in sources), None)
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
