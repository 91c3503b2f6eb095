"""ROS 1 and 2 bags and MCAP, read by rosbags, and MCAP with messages of ROS 2 in CDR, written by mcap and rosbags.

Read are sensor_msgs/Imu, NavSatFix, geometry_msgs/TwistStamped, nav_msgs/Odometry; written are /imu, /gnss/fix,
/gnss/velocity and the solution as Odometry. Stamps are those of the headers, Unix time of the machine. Axes are those
of ROS (REP 103): body forward-left-up, fixed axes east-north-up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import flipped, swapped
from sinssim.errors import InputError
from sinssim.logs.formats import Format, library, refused
from sinssim.logs.formats.euroc_tum_kitti import (
    LOCAL,
    NS,
    clock_of,
    local_solution,
    origin_words,
    pose,
    unix_ns,
    velocity,
)
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.recorded_streams import FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.files import read_bytes, user_file
from sinssim.units import DEG

BAG1, MCAP, SQLITE = b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"SQLite format 3\0"
_KINDS = {
    "sensor_msgs/msg/Imu": "imu",
    "sensor_msgs/msg/NavSatFix": "fix",
    "geometry_msgs/msg/TwistStamped": "twist",
    "nav_msgs/msg/Odometry": "odometry",
}
QUALITY = {-1: "no fix", 0: "single", 1: "SBAS", 2: "differential"}
"""Meaning of NavSatStatus.status."""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether it is a bag of ROS 1 or 2, or an MCAP file."""
    if path.is_dir():
        file = path / "metadata.yaml"
        return file.is_file() and b"rosbag2" in read_bytes(file)[:4096]
    return head.startswith((BAG1, MCAP)) or (head.startswith(SQLITE) and path.suffix == ".db3")


def files_of(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    return [file for pattern in ("metadata.yaml", "*.db3*", "*.mcap*") for file in folder.glob(pattern)]


def read(path: Path) -> Streams:
    """Read the messages of the known kinds, one stream for each topic."""
    highlevel = library("rosbags.highlevel", "rosbags", str(path))
    typesys = library("rosbags.typesys", "rosbags", str(path))
    messages: dict[str, dict[str, list[Any]]] = {kind: {} for kind in _KINDS.values()}
    try:
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        with highlevel.AnyReader([user_file(path)], default_typestore=store) as reader:
            wanted = [c for c in reader.connections if c.msgtype in _KINDS]
            if wanted:
                for connection, _, raw in reader.messages(connections=wanted):
                    message = reader.deserialize(raw, connection.msgtype)
                    messages[_KINDS[connection.msgtype]].setdefault(connection.topic, []).append(message)
            kinds = sorted({c.msgtype for c in reader.connections})
    except Exception as error:  # rosbags raises various errors for a damaged file
        raise refused(path, "a ROS bag or MCAP file", error) from error
    if not any(messages[kind] for kind in ("imu", "fix", "odometry")):
        raise InputError(
            f"{path} holds none of sensor_msgs/Imu, NavSatFix and nav_msgs/Odometry; it has "
            f"{', '.join(kinds) or 'nothing'}."
        )
    try:
        return _streams(path, messages)
    except (ValueError, OverflowError, AttributeError, TypeError, IndexError) as error:  # a damaged definition
        raise refused(path, "a ROS bag or MCAP file", error) from error


def _streams(path: Path, by_topic: dict[str, dict[str, list[Any]]]) -> Streams:
    """Return the streams of the messages."""
    every = [m for topics in by_topic.values() for messages in topics.values() for m in messages]
    first = min(m.header.stamp.sec for m in every)
    clock, _ = clock_of(np.array([first * NS], dtype=np.int64), "stamps of the messages")

    def times(messages: list[Any]) -> Array:
        start = first if clock.origin_gps_s is not None else 0
        return np.array([m.header.stamp.sec - start + m.header.stamp.nanosec * 1e-9 for m in messages])

    notes = ["Axes taken as those of ROS: forward-left-up, east-north-up."]
    inertial = {topic: _read_imu(messages, times(messages)) for topic, messages in by_topic["imu"].items()}
    speeds = {t: v for m in by_topic["twist"].values() for t, v in zip(times(m).tolist(), _twists(m), strict=True)}
    fixes: dict[str, FixStream] = {}
    for topic, messages in by_topic["fix"].items():
        good = [m for m in messages if m.status.status >= 0 and math.isfinite(m.latitude + m.longitude)]
        if good:
            fixes[topic] = _read_fixes(good, times(good), speeds)
        if len(good) < len(messages):
            notes.append(f"{len(messages) - len(good)} messages of {topic} without a fix were left out.")
    if by_topic["twist"] and not any(fix.velocity_ned is not None for fix in fixes.values()):
        notes.append("TwistStamped was left out: no fix has the same stamps.")
    solutions = {topic: _read_odometry(messages, times(messages)) for topic, messages in by_topic["odometry"].items()}
    return Streams(path, "ros", clock, _named(inertial, "imu"), _named(fixes, "gnss"), _named(solutions, "solution"),
                   notes=tuple(notes))  # fmt: skip


def _named(streams: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a single stream under its usual name, several under their topics."""
    return {name: next(iter(streams.values()))} if len(streams) == 1 else streams


def _xyz(v: Any) -> tuple[float, float, float]:
    return v.x, v.y, v.z


def _read_imu(messages: list[Any], time: Array) -> InertialStream:
    gyro = np.array([_xyz(m.angular_velocity) for m in messages])
    accel = np.array([_xyz(m.linear_acceleration) for m in messages])
    return InertialStream(time, gyro, accel, "rates", axes=("forward", "left", "up"))


def _twists(messages: list[Any]) -> Array:
    """Return velocities north-east-down, (N, 3) m/s."""
    return swapped(np.array([_xyz(m.twist.linear) for m in messages]))


def _read_fixes(messages: list[Any], time: Array, speeds: dict[float, Array]) -> FixStream:
    """Return fixes, with the velocities of the same stamps."""
    place = np.array([(m.latitude, m.longitude, m.altitude) for m in messages])
    enu = np.array([np.asarray(m.position_covariance, dtype=np.float64).reshape(3, 3) for m in messages])
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    covariance = turn @ enu @ turn.T
    unknown = np.array([m.position_covariance_type == 0 for m in messages])
    covariance[unknown] = np.nan
    known = not unknown.all()
    velocity = np.array([speeds.get(t, np.full(3, np.nan)) for t in time.tolist()])
    with np.errstate(invalid="ignore"):
        sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return FixStream(
        time=time,
        latitude=place[:, 0] * DEG,
        longitude=place[:, 1] * DEG,
        height=place[:, 2],
        datum="ellipsoid",
        position_sigma=sigma if known else None,
        velocity_ned=velocity if np.isfinite(velocity).any() else None,
        quality=np.array([m.status.status for m in messages], dtype=np.int64),
        quality_words=QUALITY,
        covariance=covariance if known else None,
    )


def _read_odometry(messages: list[Any], time: Array) -> SolutionStream:
    """Return a local solution; the twist is in body axes."""
    position = np.array([_xyz(m.pose.pose.position) for m in messages])
    q = np.array([(o.w, o.x, o.y, o.z) for o in (m.pose.pose.orientation for m in messages)])
    norm = np.linalg.norm(q, axis=1)
    if not (np.abs(norm - 1.0) < 0.01).all():
        raise ValueError(f"a quaternion of the odometry has the norm {norm[np.argmax(np.abs(norm - 1.0))]:.4g}, not 1")
    q = q / norm[:, np.newaxis]
    velocity = rotation.rotate(q, np.array([_xyz(m.twist.twist.linear) for m in messages]))
    return local_solution(time, position, q, velocity)


_TURN = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


class _Types:
    """Makes messages of ROS 2."""

    def __init__(self) -> None:
        typesys = library("rosbags.typesys", "rosbags", "--to mcap")
        self.store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)

    def make(self, name: str, *values: Any) -> Any:
        """Return a message: "sensor_msgs/msg/Imu" and its fields in order."""
        return self.store.types[name](*values)

    def header(self, ns: int, frame: str) -> Any:
        stamp = self.make("builtin_interfaces/msg/Time", *divmod(ns, 1_000_000_000))
        return self.make("std_msgs/msg/Header", stamp, frame)

    def vector(self, v: Any) -> Any:
        return self.make("geometry_msgs/msg/Vector3", *v)

    def definition(self, name: str) -> bytes:
        """Return the definition of a message with those of its parts, as MCAP's schema ros2msg."""
        text, _ = self.store.generate_msgdef(name, ros_version=2)
        return str(text).encode()


def write(content: Content, place: Path) -> list[str]:
    """Write the file."""
    types = _Types()
    writer_module = library("mcap.writer", "mcap", "--to mcap")
    sentences = []
    streams = []
    if content.imu_name is not None:
        streams.append(_imu_messages(content, types))
        sentences.append(f"/imu, sensor_msgs/Imu: {content.imu_name} data, mean rates over the last interval, "
                    "forward-left-up.")  # fmt: skip
    for name, fixes in content.fixes.items():
        streams += _fix_messages(content, types, name, fixes)
        sentences.append(
            f"/{name}/fix, sensor_msgs/NavSatFix, and /{name}/velocity, TwistStamped east-north-up: the antenna."
        )
    if content.solution.q_nb is not None and content.solution.velocity_ned is not None:
        streams.append(_odometry_messages(content, types))
        sentences.append(f"/{content.solution_name}, nav_msgs/Odometry. {LOCAL} {origin_words(content)}")
    with place.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start(profile="ros2", library="sinssim")
        for topic, name, stamps, messages in streams:
            schema = writer.register_schema(name=name, encoding="ros2msg", data=types.definition(name))
            channel = writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)
            for ns, message in zip(stamps.tolist(), messages, strict=True):
                raw = bytes(types.store.serialize_cdr(message, name))
                writer.add_message(channel_id=channel, log_time=ns, publish_time=ns, data=raw)
        writer.finish()
    return [*sentences, "Stamps are Unix time."]


_Messages = tuple[str, str, NDArray[np.int64], Iterator[Any]]


def _imu_messages(content: Content, types: _Types) -> _Messages:
    imu = content.imu
    assert imu.interval is not None
    stamps = unix_ns(content, imu.time)
    gyro, accel = flipped(imu.gyro / imu.interval[:, :1]), flipped(imu.accel / imu.interval[:, 1:])
    unknown = types.make("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    without = np.array([-1.0] + [0.0] * 8)  # sensor_msgs/Imu: element 0 is -1 if the attitude is not given
    zeros = np.zeros(9)

    def messages() -> Iterator[Any]:
        for ns, w, f in zip(stamps.tolist(), gyro.tolist(), accel.tolist(), strict=True):
            yield types.make(
                "sensor_msgs/msg/Imu", types.header(ns, "base_link"), unknown, without, types.vector(w), zeros,
                types.vector(f), zeros,
            )  # fmt: skip

    return "/imu", "sensor_msgs/msg/Imu", stamps, messages()


def _fix_messages(content: Content, types: _Types, name: str, f: FixStream) -> Iterator[_Messages]:
    stamps = unix_ns(content, f.time)
    status = types.make("sensor_msgs/msg/NavSatStatus", 0, 1)
    sigma = f.position_sigma if f.position_sigma is not None else np.zeros((len(f), 3))
    covariance = _TURN @ (sigma[:, :, np.newaxis] ** 2 * np.eye(3)) @ _TURN.T
    place = np.column_stack((f.latitude / DEG, f.longitude / DEG, f.height))

    def positions() -> Iterator[Any]:
        for ns, p, c in zip(stamps.tolist(), place.tolist(), covariance.reshape(-1, 9), strict=True):
            kind = 2 if f.position_sigma is not None else 0
            yield types.make("sensor_msgs/msg/NavSatFix", types.header(ns, name), status, *p, c, kind)

    yield f"/{name}/fix", "sensor_msgs/msg/NavSatFix", stamps, positions()
    if f.velocity_ned is None:
        return
    enu = swapped(f.velocity_ned)

    def velocities() -> Iterator[Any]:
        still = types.vector((0.0, 0.0, 0.0))
        for ns, v in zip(stamps.tolist(), enu.tolist(), strict=True):
            twist = types.make("geometry_msgs/msg/Twist", types.vector(v), still)
            yield types.make("geometry_msgs/msg/TwistStamped", types.header(ns, name), twist)

    yield f"/{name}/velocity", "geometry_msgs/msg/TwistStamped", stamps, velocities()


def _odometry_messages(content: Content, types: _Types) -> _Messages:
    stamps = unix_ns(content, content.solution.time)
    position, q = pose(content)
    body = rotation.rotate(rotation.conjugate(q), velocity(content))
    zeros = np.zeros(36)

    def messages() -> Iterator[Any]:
        still = types.vector((0.0, 0.0, 0.0))
        for ns, p, (w, x, y, z), v in zip(stamps.tolist(), position.tolist(), q.tolist(), body.tolist(), strict=True):
            pose_of = types.make(
                "geometry_msgs/msg/Pose",
                types.make("geometry_msgs/msg/Point", *p),
                types.make("geometry_msgs/msg/Quaternion", x, y, z, w),
            )
            yield types.make(
                "nav_msgs/msg/Odometry", types.header(ns, "map"), "base_link",
                types.make("geometry_msgs/msg/PoseWithCovariance", pose_of, zeros),
                types.make(
                    "geometry_msgs/msg/TwistWithCovariance",
                    types.make("geometry_msgs/msg/Twist", types.vector(v), still), zeros,
                ),
            )  # fmt: skip

    return f"/{content.solution_name}", "nav_msgs/msg/Odometry", stamps, messages()


FORMAT = Format(recognises, read, files_of)
EXPORT = Export(".mcap", "run", write)
