"""Every column of the logs of robots, written by hand after the published layouts with all numbers different."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from sinssim.logs.formats import read_file
from tests.logs.formats.whole import attitude, only, whole

NAN = float("nan")
ENU_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FLU_FRD = np.diag([1.0, -1.0, -1.0])
NEW_YEAR = 1767225600
"""Unix time of 2026-01-01, on which GPS time is 18 s ahead."""
GPS_NEW_YEAR = NEW_YEAR - 315964800 + 18


def ros_attitude(roll: float, pitch: float, heading: float) -> Array:
    """Return the quaternion from forward-left-up to east-north-up, x, y, z, w, of aeronautical angles in degrees."""
    c_nb = Rotation.from_euler("ZYX", [heading, pitch, roll], degrees=True).as_matrix()
    return np.asarray(Rotation.from_matrix(ENU_NED.T @ c_nb @ FLU_FRD).as_quat())


def _ulog(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), kind[0]) + body


def _ulog_file(
    path: Path, formats: dict[str, str], topics: list[tuple[str, int]], rows: list[tuple[int, bytes]]
) -> Path:
    """Write a log: formats, one subscription for each topic and instance, and rows of data by subscription."""
    raw = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000) + _ulog(b"B", bytes(40))
    for name, fields in formats.items():
        raw += _ulog(b"F", f"{name}:{fields}".encode())
    for number, (name, instance) in enumerate(topics):
        raw += _ulog(b"A", struct.pack("<BH", instance, number) + name.encode())
    for number, body in rows:
        raw += _ulog(b"D", struct.pack("<H", number) + body)
    raw += _ulog(b"O", struct.pack("<H", 250))
    path.write_bytes(raw)
    return path


LOCAL = (
    "uint64_t timestamp;double ref_lat;double ref_lon;float ref_alt;float x;float y;float z;float vx;float vy;float vz;"
    "bool xy_global;"
)


def test_ulog(tmp_path: Path) -> None:
    """Two units, a receiver, and the estimator between two attitudes; only the second fix has a date."""
    pytest.importorskip("pyulog")
    formats = {
        "vehicle_imu": "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
        "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
        "sensor_gps": "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;"
        "double altitude_ellipsoid_m;float eph;float epv;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;"
        "float vel_d_m_s;uint8_t fix_type;",
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": LOCAL,
    }
    topics = [
        ("vehicle_imu", 0),
        ("vehicle_imu", 1),
        ("sensor_gps", 0),
        ("vehicle_attitude", 0),
        ("vehicle_local_position", 0),
        ("sensor_gps", 1),
    ]
    imu, gps = "<QQ6fII", "<QQ3d6fB"
    angles = [[10.0, 0.0, 350.0], [10.0, 0.0, 30.0]]  # 40° of heading in 0.4 s, through north
    rows = [
        (0, struct.pack(imu, 2_300_000, 2_250_000, 0.125, 0.25, -0.375, 0.5, 0.625, -0.75, 4000, 4100)),
        (0, struct.pack(imu, 2_400_000, 2_500_000, 0.5, -0.25, 0.75, 1.5, 2.5, -9.5, 5000, 5100)),
        (1, struct.pack(imu, 2_310_000, 2_260_000, 1.125, 1.25, -1.375, 1.5, 1.625, -1.75, 6000, 6100)),
        (2, struct.pack(gps, 2_600_000, 0, -33.5, 151.25, 81.75, 0.5, 0.75, 0.125, 1.5, -2.5, 3.5, 3)),
        (2, struct.pack(gps, 3_500_000, NEW_YEAR * 1_000_000 + 250_000, -33.25, 151.5, 82.5, 1.5, 2.75, 0.625, 4.5, 5.5,
                        -6.5, 6)),
        (3, struct.pack("<Q4f", 2_000_000, *attitude(angles)[0])),
        (3, struct.pack("<Q4f", 2_400_000, *-attitude(angles)[1])),
        (5, struct.pack(gps, 2_700_000, 0, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 5)),
        (4, struct.pack("<Qdd7fB", 2_100_000, -33.5, 151.25, 81.5, 60_000.0, -120_000.0, -12.25, 1.5, -2.5, 3.5, 1)),
        (4, struct.pack("<Qdd7fB", 2_200_000, -33.5, 151.25, 81.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0)),
        (4, struct.pack("<Qdd7fB", 2_300_000, -33.5, 151.25, 81.5, 0.0, 0.0, 7.5, -4.5, 5.5, -6.5, 1)),
    ]  # fmt: skip
    path = _ulog_file(tmp_path / "x.ulg", formats, topics, rows)
    streams = only(
        read_file(path),
        GPS_NEW_YEAR - 4,  # new year + 0.25 s − 3.5 s is 0.75 s after this
        "machine",
        "the autopilot's clock, set to GPS time by the receiver's UTC (median)",
        notes=["The logger dropped messages for 250 ms."],
    )
    frd = "forward", "right", "down"
    whole(
        streams["imu"],
        digits=1e-7,
        time=[3.0, 3.25],
        gyro=[[0.125, 0.25, -0.375], [0.5, -0.25, 0.75]],
        accel=[[0.5, 0.625, -0.75], [1.5, 2.5, -9.5]],
        kind="increments",
        interval=[[0.004, 0.0041], [0.005, 0.0051]],
        axes=frd,
    )
    whole(
        streams["imu_1"],
        digits=1e-7,
        time=[3.01],
        gyro=[[1.125, 1.25, -1.375]],
        accel=[[1.5, 1.625, -1.75]],
        kind="increments",
        interval=[[0.006, 0.0061]],
        axes=frd,
    )
    whole(
        streams["gnss"],
        digits=1e-7,
        time=[3.35, 4.25],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="ellipsoid",
        position_sigma=[[0.5, 0.5, 0.75], [1.5, 1.5, 2.75]],
        velocity_ned=[[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]],
        velocity_sigma=[[0.125] * 3, [0.625] * 3],
        quality=[3, 6],
        quality_words={
            0: "no fix", 1: "no fix", 2: "2D", 3: "3D", 4: "differential", 5: "float", 6: "fixed", 8: "extrapolated",
        },
    )  # fmt: skip
    assert (streams["gnss_1"].height.tolist(), streams["gnss_1"].quality.tolist()) == ([3.5], [5])
    assert list(streams) == ["imu", "imu_1", "gnss", "gnss_1", "solution"]
    # a place at an angle of 134.16 km / 6371 km from the reference, as a turn of the reference on the sphere
    north_axis = np.array([-np.sin(-33.5 * np.pi / 180), 0.0, np.cos(-33.5 * np.pi / 180)])
    up = np.array([np.cos(-33.5 * np.pi / 180), 0.0, np.sin(-33.5 * np.pi / 180)])
    along = 60_000.0 * north_axis - 120_000.0 * np.array([0.0, 1.0, 0.0])
    x, y, z = Rotation.from_rotvec(np.cross(up, along) / 6371e3).apply(up)
    solution = streams["solution"]
    turned = Rotation.from_quat(solution.q_nb, scalar_first=True).as_euler("ZYX", degrees=True)
    np.testing.assert_allclose(turned, [[0.0, 0.0, 10.0], [20.0, 0.0, 10.0]], atol=1e-5)
    whole(
        solution,
        digits=1e-9,
        time=[2.85, 3.05],
        latitude=[np.arcsin(z), np.radians(-33.5)],
        longitude=[np.radians(151.25) + np.arctan2(y, x), np.radians(151.25)],
        height=[93.75, 74.0],
        datum="mean sea level",
        velocity_ned=[[1.5, -2.5, 3.5], [-4.5, 5.5, -6.5]],
        q_nb=solution.q_nb,
    )


def test_ulog_of_older_versions(tmp_path: Path) -> None:
    """sensor_combined instead of vehicle_imu; places as whole numbers of 1e-7° and mm; no UTC."""
    pytest.importorskip("pyulog")
    formats = {
        "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        "vehicle_gps_position": "uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt;int32_t "
        "alt_ellipsoid;float eph;"
        "float epv;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;",
    }
    rows = [
        (0, struct.pack("<Q6f", 2_250_000, 0.125, 0.25, -0.375, 0.5, 0.625, -0.75)),
        (1, struct.pack("<Q4i6fB", 2_500_000, -335_000_000, 1_512_500_000, 99_000, 81_750, 0.5, 0.75, 0.125, 1.5, -2.5,
                        3.5, 4)),
    ]  # fmt: skip
    path = _ulog_file(tmp_path / "x.ulg", formats, [("sensor_combined", 0), ("vehicle_gps_position", 0)], rows)
    streams = only(
        read_file(path),
        None,
        "machine",
        "seconds since the start of the autopilot",
        notes=["The logger dropped messages for 250 ms."],
    )
    whole(
        streams["imu"],
        time=[2.25],
        gyro=[[0.125, 0.25, -0.375]],
        accel=[[0.5, 0.625, -0.75]],
        axes=("forward", "right", "down"),
    )
    fix = streams["gnss"]
    whole(
        fix,
        time=[2.5],
        latitude_deg=[-33.5],
        longitude_deg=[151.25],
        height=[81.75],
        datum="ellipsoid",
        position_sigma=[[0.5, 0.5, 0.75]],
        velocity_ned=[[1.5, -2.5, 3.5]],
        velocity_sigma=[[0.125] * 3],
        quality=[4],
        quality_words=fix.quality_words,
    )


@pytest.mark.parametrize("known", [True, False])
def test_bag(tmp_path: Path, known: bool) -> None:
    """Odometry has its twist along its own axes; a fix without a status, and a covariance of unknown type."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    t = store.types
    vector, quaternion = t["geometry_msgs/msg/Vector3"], t["geometry_msgs/msg/Quaternion"]
    point = t["geometry_msgs/msg/Point"]

    def header(second: int, nanosecond: int) -> object:
        return t["std_msgs/msg/Header"](t["builtin_interfaces/msg/Time"](NEW_YEAR + second, nanosecond), "b")

    enu = np.array([[4.0, 0.5, -0.25], [0.5, 9.0, 0.75], [-0.25, 0.75, 16.0]])  # east, north, up
    level = quaternion(0.0, 0.0, 0.0, 1.0)
    twist = t["geometry_msgs/msg/Twist"](vector(12.0, 1.5, -0.5), vector(0.0, 0.0, 0.0))
    pose = t["geometry_msgs/msg/Pose"](point(7.5, -8.5, 9.5), quaternion(*ros_attitude(10.5, -20.25, 130.75)))
    status = t["sensor_msgs/msg/NavSatStatus"]
    fix = t["sensor_msgs/msg/NavSatFix"]
    messages = [
        ("/imu", "sensor_msgs/msg/Imu", t["sensor_msgs/msg/Imu"](
            header(1, 250_000_000), level, np.zeros(9), vector(0.125, -0.25, 0.375), np.zeros(9),
            vector(1.5, -2.5, 9.5), np.zeros(9))),
        ("/fix", "sensor_msgs/msg/NavSatFix",
         fix(header(0, 500_000_000), status(-1, 1), 1.0, 2.0, 3.0, enu.ravel(), 3)),
        ("/fix", "sensor_msgs/msg/NavSatFix",
         fix(header(2, 500_000_000), status(0, 1), -33.5, 151.25, 81.75, enu.ravel(), 3 if known else 0)),
        ("/fix", "sensor_msgs/msg/NavSatFix",
         fix(header(3, 750_000_000), status(2, 1), -33.25, 151.5, 82.5, enu.ravel(), 0)),
        ("/vel", "geometry_msgs/msg/TwistStamped", t["geometry_msgs/msg/TwistStamped"](
            header(3, 750_000_000), t["geometry_msgs/msg/Twist"](vector(-2.5, 1.5, -3.5), vector(0.0, 0.0, 0.0)))),
        ("/odom", "nav_msgs/msg/Odometry", t["nav_msgs/msg/Odometry"](
            header(4, 125_000_000), "base", t["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
            t["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)))),
    ]  # fmt: skip
    with Writer(tmp_path / "bag", version=9) as writer:
        topics = {}
        for number, (topic, name, message) in enumerate(messages):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, name, typestore=store)
            writer.write(topics[topic], number, store.serialize_cdr(message, name))
    streams = only(
        read_file(tmp_path / "bag"),
        GPS_NEW_YEAR,
        "machine",
        "stamps of the messages, taken as Unix time",
        notes=[
            "Axes taken as those of ROS: forward-left-up, east-north-up.",
            "1 messages of /fix without a fix were left out.",
        ],
    )
    whole(
        streams["imu"],
        time=[1.25],
        gyro=[[0.125, -0.25, 0.375]],
        accel=[[1.5, -2.5, 9.5]],
        axes=("forward", "left", "up"),
    )
    covariance = np.full((2, 3, 3), NAN)
    covariance[0] = [[9.0, 0.5, -0.75], [0.5, 4.0, 0.25], [-0.75, 0.25, 16.0]]
    given = {"covariance": covariance, "position_sigma": [[3.0, 2.0, 4.0], [NAN] * 3]} if known else {}
    whole(
        streams["gnss"],
        time=[2.5, 3.75],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="ellipsoid",
        velocity_ned=[[NAN] * 3, [1.5, -2.5, 3.5]],
        quality=[0, 2],
        quality_words={-1: "no fix", 0: "single", 1: "SBAS", 2: "differential"},
        **given,
    )
    c_nb = Rotation.from_euler("ZYX", [130.75, -20.25, 10.5], degrees=True)
    whole(
        streams["solution"],
        time=[4.125],
        latitude=[NAN],
        longitude=[NAN],
        height=[NAN],
        velocity_ned=[c_nb.apply([12.0, -1.5, 0.5])],
        attitude_deg=[[10.5, -20.25, 130.75]],
        local_enu=[[7.5, -8.5, 9.5]],
    )


def test_euroc(tmp_path: Path) -> None:
    """Both files of a folder on the clock of the first: the truth begins 2 s earlier, w before x, y, z."""
    for part in ("imu0", "state_groundtruth_estimate0"):
        (tmp_path / "mav0" / part).mkdir(parents=True)
    (tmp_path / "mav0" / "imu0" / "data.csv").write_text(
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y,w_RS_S_z,a_RS_S_x [m s^-2],a_RS_S_y,a_RS_S_z\n"
        f"{NEW_YEAR + 2}250000001,0.125,-0.25,0.375,1.5,-2.5,9.5\n"
    )
    x, y, z, w = ros_attitude(10.5, -20.25, 130.75)
    (tmp_path / "mav0" / "state_groundtruth_estimate0" / "data.csv").write_text(
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x, "
        "v_y, v_z,"
        " b_w_x, b_w_y, b_w_z, b_a_x, b_a_y, b_a_z\n"
        f"{NEW_YEAR}500000003,7.5,-8.5,9.5,{w:.17g},{x:.17g},{y:.17g},{z:.17g},1.5,-2.5,3.5,11,12,13,14,15,16\n"
    )
    streams = only(
        read_file(tmp_path),
        GPS_NEW_YEAR + 2,
        "machine",
        "nanoseconds, taken as Unix time",
        notes=["Axes of the truth taken as east-north-up and forward-left-up."],
    )
    whole(streams["imu"], time=[0.250000001], gyro=[[0.125, -0.25, 0.375]], accel=[[1.5, -2.5, 9.5]])
    whole(
        streams["solution"],
        time=[-1.499999997],
        latitude=[NAN],
        longitude=[NAN],
        height=[NAN],
        velocity_ned=[[-2.5, 1.5, -3.5]],
        attitude_deg=[[10.5, -20.25, 130.75]],
        local_enu=[[7.5, -8.5, 9.5]],
    )


@pytest.mark.parametrize(("start", "origin"), [(NEW_YEAR, GPS_NEW_YEAR), (100, None)])
def test_tum(tmp_path: Path, start: int, origin: int | None) -> None:
    """x, y, z before w; stamps before 1980 count from an unknown start."""
    angles = [[10.5, -20.25, 130.75], [-170.5, 35.5, 290.25]]
    lines = [
        f"{start + 2 * k}.2500000{k + 1} {7.5 + k} {-8.5 - 2 * k} {9.5 + 3 * k} "
        + " ".join(f"{value:.17g}" for value in ros_attitude(*one))
        for k, one in enumerate(angles)
    ]
    path = tmp_path / "x.txt"
    path.write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n")
    note = "seconds, taken as Unix time" if origin else "seconds, since an unknown start"
    said = "Axes taken as east-north-up and forward-left-up; the file does not define them."
    stream = only(read_file(path), origin, "machine", note, notes=[said])["solution"]
    first = 0.0 if origin else 100.0
    whole(
        stream,
        time=[first + 0.25000001, first + 2.25000002],
        latitude=[NAN] * 2,
        longitude=[NAN] * 2,
        height=[NAN] * 2,
        attitude_deg=angles,
        local_enu=[[7.5, -8.5, 9.5], [8.5, -10.5, 12.5]],
    )


def test_kitti(tmp_path: Path) -> None:
    """Roll is positive with the left side up, pitch with the front down, yaw from east to north (dataformat.txt)."""
    (tmp_path / "oxts" / "data").mkdir(parents=True)
    (tmp_path / "oxts" / "timestamps.txt").write_text(
        "2026-01-01 00:00:00.250000001\n2026-01-01 00:00:00.350000002\n2026-01-01 00:00:02.5\n"
    )
    row = "49.25 -8.75 116.5 {} {} {} -2.5 13.5 13.25 0.125 0.0625 1.5 -1.25 9.5 2.5 2.25 9.25 0.25 0.375 -0.5 "
    row += "0.75 0.875 -0.625 0.05 0.02 4 9 5 5 2\n"
    for k, angles in ((0, (10.5, 20.25, 319.25)), (2, (-5.5, -15.75, 45.5))):
        radians = (repr(float(np.radians(one))) for one in angles)
        (tmp_path / "oxts" / "data" / f"{k:010d}.txt").write_text(row.format(*radians))
    streams = only(
        read_file(tmp_path),
        GPS_NEW_YEAR,
        "machine",
        "dates of the logger, taken as Unix time",
        notes=["1 time stamps have no file and were left out."],
    )
    time = [0.250000001, 2.5]
    whole(
        streams["imu"],
        time=time,
        gyro=[[0.25, 0.375, -0.5]] * 2,
        accel=[[1.5, -1.25, 9.5]] * 2,
        axes=("forward", "left", "up"),
    )
    whole(
        streams["solution"],
        time=time,
        latitude_deg=[49.25] * 2,
        longitude_deg=[-8.75] * 2,
        height=[116.5] * 2,
        velocity_ned=[[-2.5, 13.5, -0.0625]] * 2,
        attitude_deg=[[10.5, -20.25, 130.75], [-5.5, 15.75, 44.5]],
        position_sigma=[[0.05] * 3] * 2,
        velocity_sigma=[[0.02] * 3] * 2,
    )
