"""PX4 ULog by pyulog: vehicle_imu or sensor_combined, sensor_gps, the estimator's position and attitude.

Times are microseconds since the start of the autopilot. UTC of the receiver's messages gives them a date, as good as
the delay of those messages.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.registry import Format, library, refused
from sinssim.logs.gps_time import gps_from_unix
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.user_file import user_file
from sinssim.units import DEG

MAGIC = b"\x55\x4c\x6f\x67\x01\x12\x35"
AXES = ("forward", "right", "down")
QUALITY = {0: "no fix", 1: "no fix", 2: "2D", 3: "3D", 4: "differential", 5: "float", 6: "fixed", 8: "extrapolated"}
"""Meaning of fix_type of sensor_gps."""
_TOPICS = [
    "vehicle_imu", "sensor_combined", "sensor_gps", "vehicle_gps_position", "vehicle_attitude",
    "vehicle_local_position",
]  # fmt: skip
_HEADER = 3  # bytes: size and type of a message
_RADIUS = 6371000.0  # m, of PX4's map projection


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the file has ULog's magic."""
    return head.startswith(MAGIC)


class _OnlyForward(io.BufferedReader):
    """A file that ends where its reader turns back.

    pyulog seeks back by the length that a damaged message claims, also where the file ends before: from there it reads
    the same messages for ever. Every message begins with a header of 3 bytes. No reading of a sound file takes a header
    from before the last one; the last one itself is read again where the definitions end.
    """

    _last = -1

    def read(self, size: int | None = -1, /) -> bytes:
        """Return the next bytes; none for a header before the last one."""
        if size == _HEADER:
            place = self.tell()
            if place < self._last:
                return b""
            self._last = place
        return super().read(size)


def read(path: Path) -> Streams:
    """Read inertial readings, fixes, and the estimator's solution."""
    module = library("pyulog", "pyulog", str(path))
    printed = io.StringIO()  # pyulog prints what it finds damaged
    try:
        with contextlib.redirect_stdout(printed), user_file(path).open("rb", buffering=0) as raw:
            log = module.ULog(_OnlyForward(raw), _TOPICS)
    except Exception as error:  # pyulog raises various errors for a damaged file
        raise refused(path, "a PX4 ULog", error) from error
    topics: dict[str, list[dict[str, Any]]] = {}
    for data in sorted(log.data_list, key=lambda topic: int(topic.multi_id)):
        if len(data.data.get("timestamp", ())):
            topics.setdefault(data.name, []).append(data.data)
    try:
        inertial = _inertial(topics)
        fixes = {
            "gnss" if k == 0 else f"gnss_{k}": _fixes(topic)
            for k, topic in enumerate(topics.get("sensor_gps") or topics.get("vehicle_gps_position") or [])
        }
        solutions = _solution(topics)
    except KeyError as error:
        raise InputError(
            f"{path}: a topic lacks the field {error}; the log is of an unknown version of PX4."
        ) from error
    if not (inertial or fixes):
        names = ", ".join(sorted(topics)) or "none of them"
        raise InputError(f"{path} holds neither vehicle_imu, sensor_combined nor sensor_gps; it has {names}.")
    clock, shift = _clock(topics)
    for streams in (inertial, fixes, solutions):
        for topic in streams.values():
            topic.time[:] += shift
    dropped = sum(int(d.duration) for d in getattr(log, "dropouts", []))
    notes = [f"The logger dropped messages for {dropped} ms."] if dropped else []
    if "corrupt" in printed.getvalue():
        notes.append("The file is damaged; what could be read was read.")
    return Streams(path, "ulog", clock, inertial, fixes, solutions, notes=tuple(notes))


def _seconds(topic: dict[str, Any]) -> Array:
    """Return the stamps of the samples where the topic has them, else those of the messages, (N,) s."""
    stamps = topic.get("timestamp_sample")
    if stamps is None or not np.any(stamps):
        stamps = topic["timestamp"]
    return np.asarray(stamps, dtype=np.float64) * 1e-6


def _vector(topic: dict[str, Any], name: str, count: int = 3) -> Array:
    return np.column_stack([np.asarray(topic[f"{name}[{i}]"], dtype=np.float64) for i in range(count)])


def _inertial(topics: dict[str, list[dict[str, Any]]]) -> dict[str, InertialStream]:
    """Return increments of vehicle_imu, or rates of sensor_combined."""
    streams = {}
    for k, topic in enumerate(topics.get("vehicle_imu", [])):
        dt = [np.asarray(topic[f"delta_{what}_dt"], dtype=np.float64) for what in ("angle", "velocity")]
        size = 1e-6 if np.median(dt[0]) > 1.0 else 1.0  # older logs have seconds
        streams["imu" if k == 0 else f"imu_{k}"] = InertialStream(
            _seconds(topic), _vector(topic, "delta_angle"), _vector(topic, "delta_velocity"), "increments",
            np.column_stack(dt) * size, AXES,
        )  # fmt: skip
    if not streams:
        for k, topic in enumerate(topics.get("sensor_combined", [])):
            streams["imu" if k == 0 else f"imu_{k}"] = InertialStream(
                _seconds(topic), _vector(topic, "gyro_rad"), _vector(topic, "accelerometer_m_s2"), "rates", axes=AXES
            )
    return streams


def _fixes(gps: dict[str, Any]) -> FixStream:
    """Return the fixes of a receiver; older logs have whole numbers of 1e-7° and mm."""

    def column(name: str, old: str, size: float) -> Array:
        values = gps[name] if name in gps else np.asarray(gps[old], dtype=np.float64) * size
        return np.asarray(values, dtype=np.float64)

    eph, epv, speed = (np.asarray(gps[name], dtype=np.float64) for name in ("eph", "epv", "s_variance_m_s"))
    velocity = [np.asarray(gps[f"vel_{axis}_m_s"], dtype=np.float64) for axis in "ned"]
    return FixStream(
        time=_seconds(gps),
        latitude=column("latitude_deg", "lat", 1e-7) * DEG,
        longitude=column("longitude_deg", "lon", 1e-7) * DEG,
        height=column("altitude_ellipsoid_m", "alt_ellipsoid", 1e-3),
        datum="ellipsoid",
        position_sigma=np.column_stack((eph, eph, epv)),
        velocity_ned=np.column_stack(velocity),
        velocity_sigma=np.column_stack((speed, speed, speed)),
        quality=np.asarray(gps["fix_type"], dtype=np.int64),
        quality_words=QUALITY,
    )


def _solution(topics: dict[str, list[dict[str, Any]]]) -> dict[str, SolutionStream]:
    """Return the estimator's position and velocity, with its attitude at the same instants."""
    if "vehicle_local_position" not in topics:
        return {}
    topic = topics["vehicle_local_position"][0]
    x, y, z, ref_lat, ref_lon, ref_alt = (
        np.asarray(topic[name], dtype=np.float64) for name in ("x", "y", "z", "ref_lat", "ref_lon", "ref_alt")
    )
    known = np.isfinite(ref_lat) & np.isfinite(ref_lon) & (np.asarray(topic["xy_global"]) > 0) & np.isfinite(x + y)
    if not known.any():
        return {}
    latitude, longitude = _unprojected(x[known], y[known], ref_lat[known] * DEG, ref_lon[known] * DEG)
    time = _seconds(topic)[known]
    velocity = np.column_stack([np.asarray(topic[f"v{axis}"], dtype=np.float64)[known] for axis in "xyz"])
    q_nb = None
    if "vehicle_attitude" in topics:
        attitude = topics["vehicle_attitude"][0]
        q_nb = _attitude_at(_seconds(attitude), _vector(attitude, "q", 4), time)
    stream = SolutionStream(time, latitude, longitude, ref_alt[known] - z[known], "mean sea level", velocity, q_nb)
    return {"solution": stream}


def _unprojected(x: Array, y: Array, latitude: Array, longitude: Array) -> tuple[Array, Array]:
    """Return the places of PX4's local positions: azimuthal equidistant on a sphere (geo.cpp of PX4)."""
    c = np.hypot(x, y) / _RADIUS
    share = np.where(c > 0.0, np.sin(c) / np.where(c > 0.0, c, 1.0), 1.0)
    north, east = x / _RADIUS * share, y / _RADIUS * share
    sin0, cos0 = np.sin(latitude), np.cos(latitude)
    return (
        np.arcsin((np.cos(c) * sin0 + north * cos0).clip(-1.0, 1.0)),
        longitude + np.arctan2(east, cos0 * np.cos(c) - north * sin0),
    )


def _attitude_at(time: Array, q: Array, wanted: Array) -> Array:
    """Return attitudes between samples, along the shortest rotation."""
    if len(time) < 2:
        return np.repeat(rotation.normalize(q), len(wanted), axis=0)
    after = np.searchsorted(time, wanted).clip(1, len(time) - 1)
    before = after - 1
    step = np.maximum(time[after] - time[before], 1e-9)
    share = ((wanted - time[before]) / step).clip(0.0, 1.0)[:, np.newaxis]
    q = rotation.normalize(q)
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(q[before]), q[after]))
    return rotation.multiply(q[before], rotation.quaternion_from_rotation_vector(share * turn))


def _clock(topics: dict[str, list[dict[str, Any]]]) -> tuple[Clock, float]:
    """Return the clock, and what makes the times count from its origin, s."""
    for gps in topics.get("sensor_gps") or topics.get("vehicle_gps_position") or []:
        utc = np.asarray(gps.get("time_utc_usec", ()), dtype=np.float64) * 1e-6
        dated = utc > 1e9
        if dated.any():
            seconds = np.asarray(gps["timestamp"], dtype=np.float64)[dated] * 1e-6
            offset = float(np.median(gps_from_unix(utc[dated]) - seconds))
            origin = int(np.floor(offset))
            note = "the autopilot's clock, set to GPS time by the receiver's UTC (median)"
            return Clock("machine", origin, note), offset - origin
    return Clock("machine", None, "seconds since the start of the autopilot"), 0.0


FORMAT = Format(recognises, read)
