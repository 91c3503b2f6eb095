"""MCAP with messages of ROS 2 in CDR: /imu, /gnss/fix, /gnss/velocity and the solution as Odometry.

Needs the libraries mcap and rosbags: rosbags has the definitions of the messages and writes them as CDR.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.logs.formats.registry import library
from sinssim.logs.local_level import flipped, swapped
from sinssim.logs.recorded_streams import FixStream
from sinssim.logs.writers.euroc import unix_ns
from sinssim.logs.writers.local import LOCAL, origin_words, pose, velocity
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

SUFFIX = ".mcap"
HOLDS = "run"
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
    said = []
    streams = []
    if content.imu_name is not None:
        streams.append(_imu(content, types))
        said.append(f"/imu, sensor_msgs/Imu: {content.imu_name} data, mean rates over the last interval, "
                    "forward-left-up.")  # fmt: skip
    for name, fixes in content.fixes.items():
        streams += _fixes(content, types, name, fixes)
        said.append(
            f"/{name}/fix, sensor_msgs/NavSatFix, and /{name}/velocity, TwistStamped east-north-up: the antenna."
        )
    if content.solution.q_nb is not None and content.solution.velocity_ned is not None:
        streams.append(_odometry(content, types))
        said.append(f"/{content.solution_name}, nav_msgs/Odometry. {LOCAL} {origin_words(content)}")
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
    return [*said, "Stamps are Unix time."]


_Messages = tuple[str, str, NDArray[np.int64], Iterator[Any]]


def _imu(content: Content, types: _Types) -> _Messages:
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


def _fixes(content: Content, types: _Types, name: str, f: FixStream) -> Iterator[_Messages]:
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


def _odometry(content: Content, types: _Types) -> _Messages:
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
