"""Small valid files of every format, made without this package's writers."""

from __future__ import annotations

import struct
from functools import reduce
from pathlib import Path

import numpy as np

from tests.logs.formats.loggers import LOGGERS

RNG = np.random.default_rng(7)


def nmea_sentence(body: str) -> str:
    """Return a sentence with its checksum."""
    return f"${body}*{reduce(lambda a, b: a ^ b, body.encode()):02X}\r\n"


def nmea(path: Path) -> Path:
    """The example of the standard's GGA, 48° 07.038' N 11° 31.000' E, 545.4 m + 46.9 m, over midnight."""
    lines = []
    for clock, date in (("235959.50", "230394"), ("000000.00", "240394"), ("000000.50", "240394")):
        lines.append(nmea_sentence(f"GPGGA,{clock},4807.038,N,01131.000,E,4,08,0.9,545.4,M,46.9,M,,"))
        lines.append(nmea_sentence(f"GPRMC,{clock},A,4807.038,N,01131.000,E,022.4,084.4,{date},003.1,W"))
        lines.append(nmea_sentence(f"GPGST,{clock},1.0,,,,0.010,0.020,0.030"))
    path.write_text("".join(lines))
    return path


def ubx(path: Path) -> Path:
    """Three fixes of NAV-PVT, the second with high precision, covariance and heading."""
    from pyubx2 import GET, UBXMessage

    raw = b""
    for k in range(3):
        tow = 345618200 + 200 * k
        raw += UBXMessage(
            "NAV", "NAV-PVT", GET, iTOW=tow, year=2026, month=1, day=1, hour=0, min=0, second=0, validDate=1,
            validTime=1, nano=200_000_000 * (k + 1), fixType=3, gnssFixOk=1, carrSoln=2 if k == 1 else 0, numSV=12,
            lon=14.5123456, lat=50.1, height=300123, hMSL=255000, hAcc=14, vAcc=20, velN=1234, velE=-5, velD=7, sAcc=30,
        ).serialize()  # fmt: skip
        if k == 1:
            raw += UBXMessage(
                "NAV",
                "NAV-HPPOSLLH",
                GET,
                iTOW=tow,
                lon=14.5123456,
                lat=50.1,
                height=300123,
                _HPlon=5e-9,
                _HPheight=0.4,
                hAcc=14.1,
                vAcc=20.2,
            ).serialize()
            raw += UBXMessage(
                "NAV", "NAV-COV", GET, iTOW=tow, posCovValid=1, posCovNN=0.25, posCovNE=0.125, posCovEE=0.5,
                posCovDD=2.0,
            ).serialize()  # fmt: skip
            raw += UBXMessage(
                "NAV", "NAV-RELPOSNED", GET, version=1, iTOW=tow, relPosHeading=12.5, accHeading=0.25,
                relPosHeadingValid=1,
            ).serialize()  # fmt: skip
    path.write_bytes(b"$GNTXT,mixed with NMEA*00\r\n" + raw)
    return path


def novatel_crc(text: bytes) -> int:
    """Return the checksum of the OEM7 manual ("32-Bit CRC")."""
    value = 0
    for byte in text:
        part = (value ^ byte) & 0xFF
        for _ in range(8):
            part = (part >> 1) ^ 0xEDB88320 if part & 1 else part >> 1
        value = (value >> 8) ^ part
    return value


NOVATEL_PUBLISHED = (
    "%RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,"
    "-1000837*038422a7"
)
"""The example of the OEM7 manual for RAWIMUSX, with its checksum."""


def novatel(path: Path) -> Path:
    """The manual's RAWIMUSX, and BESTPOS, BESTVEL and INSPVAX of the same second."""
    head = "COM1,0,73.5,FINESTEERING,2209,491674.000,02000040,4e77,43562"
    logs = (
        f"#BESTPOSA,{head};SOL_COMPUTED,NARROW_INT,51.11636937989,-114.03825348307,1064.533,-16.9000,WGS84,0.0125,"
        '0.0250,0.0375,"",0.000,0.000,35,30,30,30,00,06,39,33',
        f"#BESTVELA,{head};SOL_COMPUTED,NARROW_INT,0.250,0.000,5.0,90.0,0.25,0.0",
        f"#INSPVAXA,{head};INS_SOLUTION_GOOD,INS_PSRSP,51.11637873403,-114.03825114994,1063.6093,-16.9000,1.0,2.0,"
        "3.0,10.0,20.0,30.0,0.5,0.25,1.0,0.1,0.2,0.3,0.4,0.5,0.6,3,0",
    )
    lines = [NOVATEL_PUBLISHED, *(f"{log}*{novatel_crc(log[1:].encode()):08x}" for log in logs)]
    path.write_text("\r\n".join(lines) + "\r\n")
    return path


def _ulog_message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), kind[0]) + body


def ulog(path: Path) -> Path:
    """A log of 10 samples of vehicle_imu, two fixes, attitude and local position (ULog file format, PX4 guide)."""
    formats = {
        "vehicle_imu": "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
        "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
        "sensor_gps": "uint64_t timestamp;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;"
        "double altitude_ellipsoid_m;float eph;float epv;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;"
        "float vel_d_m_s;uint8_t fix_type;",
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": "uint64_t timestamp;double ref_lat;double ref_lon;float ref_alt;float x;float y;"
        "float z;float vx;float vy;float vz;bool xy_global;",
    }
    raw = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)
    raw += _ulog_message(b"B", bytes(40))
    for name, fields in formats.items():
        raw += _ulog_message(b"F", f"{name}:{fields}".encode())
    for number, name in enumerate(formats):
        raw += _ulog_message(b"A", struct.pack("<BH", 0, number) + name.encode())
    for k in range(10):
        t = 2_000_000 + 4000 * k
        raw += _ulog_message(
            b"D", struct.pack("<HQQ6fII", 0, t + 300, t, 0.001, 0.002, 0.003, 0.01, 0.02, -0.04, 4000, 4100)
        )
        raw += _ulog_message(b"D", struct.pack("<HQ4f", 2, t, 1.0, 0.0, 0.0, 0.0))
        raw += _ulog_message(
            b"D", struct.pack("<HQddf6fB", 3, t, 50.0, 14.0, 300.0, 100.0, 200.0, -5.0, 1.0, 2.0, 3.0, 1)
        )
    for k in range(2):
        t = 2_000_000 + 20000 * k
        body = (t, 1_767_225_600_000_000 + 20000 * k, 50.1, 14.5, 350.0, 0.5, 1.0, 0.1, 1.0, 2.0, 3.0, 3)
        raw += _ulog_message(b"D", struct.pack("<HQQ3d6fB", 1, *body))
    path.write_bytes(raw)
    return path


def bag(path: Path, version: int = 1) -> Path:
    """Two messages of Imu and one NavSatFix in a bag of ROS 1, or 2."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    t = store.types
    if version == 1:
        from rosbags.rosbag1 import Writer

        writer = Writer(path)
        make_header = lambda k: t["std_msgs/msg/Header"](k, t["builtin_interfaces/msg/Time"](1767225600 + k, 5000), "b")  # noqa: E731
    else:
        from rosbags.rosbag2 import Writer as Writer2

        writer = Writer2(path, version=9)
        make_header = lambda k: t["std_msgs/msg/Header"](t["builtin_interfaces/msg/Time"](1767225600 + k, 5000), "b")  # noqa: E731
    vector, quaternion = t["geometry_msgs/msg/Vector3"], t["geometry_msgs/msg/Quaternion"]
    with writer:
        imu = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        fix = writer.add_connection("/fix", "sensor_msgs/msg/NavSatFix", typestore=store)
        serialize = store.serialize_ros1 if version == 1 else store.serialize_cdr
        for k in range(2):
            message = t["sensor_msgs/msg/Imu"](
                make_header(k), quaternion(0.0, 0.0, 0.0, 1.0), np.zeros(9), vector(0.1, 0.2, 0.3), np.zeros(9),
                vector(0.0, 0.0, 9.81), np.zeros(9),
            )  # fmt: skip
            writer.write(imu, (1767225600 + k) * 10**9, serialize(message, "sensor_msgs/msg/Imu"))
        covariance = np.diag([4.0, 9.0, 16.0]).ravel()  # east, north, up
        message = t["sensor_msgs/msg/NavSatFix"](
            make_header(0), t["sensor_msgs/msg/NavSatStatus"](2, 1), 50.1, 14.5, 350.0, covariance, 2
        )
        writer.write(fix, 1767225600 * 10**9, serialize(message, "sensor_msgs/msg/NavSatFix"))
    return path


def mcap(path: Path) -> Path:
    """The messages of `bag` as one MCAP file."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    t = store.types
    vector = t["geometry_msgs/msg/Vector3"]
    name = "sensor_msgs/msg/Imu"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        text, _ = store.generate_msgdef(name, ros_version=2)
        schema = writer.register_schema(name=name, encoding="ros2msg", data=text.encode())
        channel = writer.register_channel(topic="/imu", message_encoding="cdr", schema_id=schema)
        for k in range(3):
            header = t["std_msgs/msg/Header"](t["builtin_interfaces/msg/Time"](1767225600, 1000 * k), "b")
            message = t[name](
                header, t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0), np.zeros(9), vector(0.1, 0.2, 0.3),
                np.zeros(9), vector(0.0, 0.0, 9.81), np.zeros(9),
            )  # fmt: skip
            writer.add_message(
                channel_id=channel, log_time=k, publish_time=k, data=bytes(store.serialize_cdr(message, name))
            )
        writer.finish()
    return path


def kf_gins_imu(path: Path) -> Path:
    """Rows as those of the data that come with KF-GINS: 200 Hz, forward-right-down."""
    rows = [
        f"{456300.0 + 0.005 * k:.9f}  {1e-6 * k:.12f}  -2.0e-06  {3e-6:.12f}  0.000123  -0.0004  -0.0489600000"
        for k in range(12)
    ]
    path.write_text("\n".join(rows) + "\n")
    return path


def kf_gins_gnss(path: Path) -> Path:
    """Rows as those of GNSS-RTK.txt of KF-GINS."""
    rows = [f"{456300 + k}  30.4447{k}  114.4718{k}  20.899 0.005 0.004 0.008" for k in range(5)]
    path.write_text("\n".join(rows) + "\n")
    return path


def kf_gins_solution(path: Path) -> Path:
    """Rows as KF-GINS writes them, the week 0, over the end of a week."""
    rows = [f"0 {(604799 + k) % 604800:.6f} 30.44 114.47 20.9 1.0 2.0 3.0 0.85 -2.03 185.7" for k in range(4)]
    path.write_text("\n".join(rows) + "\n")
    return path


def psins_imu(path: Path) -> Path:
    """Counts with their header, time dither in the last column."""
    text = "% PSINS-format SIMU log file. (DO NOT MODIFY!)\n%   more\n\n1.5 0.5 -30.0 0 0 0 0\n"
    text += "34.0 108.0 380.0 100.0 10.0 9.8 0\n"
    text += "0.1 0.1 0.1 125 125 125 0\n\n" + "".join(f"{k} {2 * k} {-k} 3 4 78{k} {k % 2}\n" for k in range(8))
    path.write_text(text)
    return path


def psins_avp(path: Path) -> Path:
    """Attitude, velocity, position and time."""
    text = "% PSINS-format AVP/GPS log file. (DO NOT MODIFY!)\n% names\n\n"
    text += "".join(f"1.0 2.0 -30.0 5.0 6.0 7.0 34.0 108.0 380.0 {k}\n" for k in range(5))
    path.write_text(text)
    return path


def sbet(path: Path) -> Path:
    """A climb at course 60° with a wander angle of 20°: heading = platform heading − wander angle, z up."""
    count = 40
    time = 1000.0 + 0.5 * np.arange(count)
    rows = np.zeros((count, 17), dtype="<f8")
    rows[:, 0] = time
    vn, ve, vu = 50.0 * np.cos(np.pi / 3), 50.0 * np.sin(np.pi / 3), 4.0
    radius = 6378137.0
    rows[:, 1] = 0.5 / radius * vn * (time - 1000.0) * 2.0 * 1.0067395  # near the equator R1 = a(1-e²)
    rows[:, 2] = 1.0 + ve * (time - 1000.0) / radius
    rows[:, 3] = vu * (time - 1000.0)
    wander = np.radians(20.0)
    # axes turned by -wander from north: x = N cos w - E sin w
    rows[:, 4] = vn * np.cos(wander) - ve * np.sin(wander)
    rows[:, 5] = vn * np.sin(wander) + ve * np.cos(wander)
    rows[:, 6] = vu
    rows[:, 8] = np.arctan2(4.0, 50.0)
    rows[:, 9] = np.pi / 3 + wander
    rows[:, 10] = wander
    path.write_bytes(rows.tobytes())
    return path


def euroc(path: Path) -> Path:
    """First rows in the layout of MH_01_easy/mav0/imu0/data.csv."""
    path.write_text(
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
        "a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
        "1403636579758555392,-0.099134701513277898,0.14730578886832138,0.02722713633111154,8.1476917083333333,"
        "-0.37592158333333331,-2.4026292499999999\n"
        "1403636579763555584,-0.099134701513277898,0.14032447186034408,0.029321531433504733,8.033280791666666,"
        "-0.40861041666666664,-2.4026292499999999\n"
    )
    return path


def tum(path: Path) -> Path:
    """Rows in the layout of the TUM benchmark's groundtruth.txt."""
    path.write_text(
        "# ground truth trajectory\n# timestamp tx ty tz qx qy qz qw\n"
        "1305031098.665900 1.3563 0.6305 1.6380 0.0 0.0 0.0 1.0\n"
        "1305031098.675800 1.3543 0.6306 1.6360 0.0 0.0 0.7071067811865476 0.7071067811865476\n"
    )
    return path


def kitti(path: Path) -> Path:
    """Two instants in the layout of 2011_09_26_drive_0001/oxts."""
    (path / "data").mkdir(parents=True)
    (path / "timestamps.txt").write_text("2011-09-26 13:02:25.964389445\n2011-09-26 13:02:26.064406323\n")
    row = "49.015 8.434 116.4 0.035 0.001 1.5 -2.5 13.0 13.2 0.02 0.1 0.5 -0.1 9.9 0.4 0.3 9.8 0.01 0.02 0.03 "
    row += "0.011 0.021 0.031 0.05 0.02 4 9 5 5 2"
    for k in range(2):
        (path / "data" / f"{k:010d}.txt").write_text(row + "\n")
    return path


def columns(path: Path) -> Path:
    """Columns named with their units, a semicolon between them."""
    path.write_text(
        "unix_s;latitude_deg;longitude_deg;height_m;velocity_n_mps;velocity_e_mps;velocity_d_mps;roll_deg;pitch_deg;"
        "heading_deg;temperature_c\n"
        + "".join(f"{1767225600 + 0.5 * k};50;14.5;300;1;2;3;10;20;30;{k}\n" for k in range(6))
    )
    return path


FILES = {
    "kf-gins-imu": (kf_gins_imu, "imu.txt"),
    "kf-gins-gnss": (kf_gins_gnss, "gnss.txt"),
    "kf-gins-solution": (kf_gins_solution, "truth.nav"),
    "psins-imu": (psins_imu, "x.imu"),
    "psins-avp": (psins_avp, "x.avp"),
    "sbet": (sbet, "sbet.out"),
    "nmea": (nmea, "x.nmea"),
    "ubx": (ubx, "x.ubx"),
    "novatel": (novatel, "x.log"),
    "ulog": (ulog, "x.ulg"),
    "ros": (mcap, "x.mcap"),
    "euroc": (euroc, "data.csv"),
    "tum": (tum, "groundtruth.txt"),
    "columns": (columns, "mine.csv"),
    **LOGGERS,
}
"""What makes a file of each format, and its name."""

LIBRARIES = {"nmea": "pynmeagps", "ubx": "pyubx2", "novatel": "novatel_edie", "ulog": "pyulog", "ros": "rosbags"}
"""The library that a format needs."""
