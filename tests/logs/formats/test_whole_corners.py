"""Files that lack something, have several of something, or end in a remark: what is read of them, and what is said."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import read_file
from tests.logs.formats.samples import nmea_sentence
from tests.logs.formats.test_whole_receivers import _novatel, _ubx
from tests.logs.formats.whole import only, whole

NAN = float("nan")


def test_sentences_of_nmea_without_a_position(tmp_path: Path) -> None:
    """A GNS without a mode, a void RMC and a GGA of quality 0 are none; quality 9 and a position of RMC alone are."""
    bodies = [
        "GNGNS,000000.00,3351.25,S,15112.75,W,NN,12,0.7,59.5,24.25,,",
        "GNRMC,000001.00,V,3351.25,S,15112.75,W,1.0,2.0,010117,,",
        "GNRMC,000002.50,A,3330.00,N,15115.00,E,10.0,90.0,010117,,",
        "GNGGA,000003.50,3345.00,N,15130.00,E,9,02,0.8,1.5,M,2.25,M,,",
    ]
    path = tmp_path / "x.nmea"
    path.write_text("".join(map(nmea_sentence, bodies)))
    found = read_file(path)
    fixes = found.fixes["gnss"]
    # days from 1980-01-06 to 2017-01-01, and 18 leap seconds
    assert found.clock.origin_gps_s == 13510 * 86400 + 18
    assert fixes.time.tolist() == [2.5, 3.5]
    np.testing.assert_allclose(np.degrees(fixes.latitude), [33.5, 33.75], rtol=1e-14)
    np.testing.assert_array_equal(fixes.height, [NAN, 3.75])
    assert fixes.quality is not None
    assert fixes.quality.tolist() == [-1, 9]
    assert fixes.velocity_ned is not None
    np.testing.assert_allclose(fixes.velocity_ned[0, :2], [0.0, 18520.0 / 3600.0], atol=1e-12)
    assert np.isnan(fixes.velocity_ned[1]).all()


def test_ubx_without_a_date(tmp_path: Path) -> None:
    body = struct.pack("<IH5BBIi", 345600250, 2026, 1, 1, 0, 0, 0, 0x02, 25, 0)
    body += struct.pack(
        "<4B4i2I3i2i2I", 2, 1, 0, 17, -1145000000, 502500000, 300123, 255000, 140, 270, 1, 2, 3, 4, 5, 6, 7
    )
    path = tmp_path / "x.ubx"
    path.write_bytes(_ubx(0x07, body.ljust(92, b"\0")) + b"\xb5\x62\x01\x07\x02\x00\x01\x02\x00\x00")
    found = read_file(path)
    assert (found.clock.origin_gps_s, found.clock.note) == (
        None,
        "seconds of the GPS week; no message has a valid date",
    )
    assert found.fixes["gnss"].time.tolist() == [345600.25]
    assert found.fixes["gnss"].heading is None
    assert found.fixes["gnss"].covariance is None
    assert found.notes[-1] == "1 damaged messages were left out."


def test_increments_of_a_novatel_unit_that_is_not_named(tmp_path: Path) -> None:
    """At rest, 100 Hz: only with 2⁻²² m/s, of the STIM300, is the specific force near gravity."""
    size = 2.0**-22
    lines = []
    for k in range(3):
        z, y, x = round(-9.75 / 100.0 / size), round(0.25 / 100.0 / size), round(0.5 / 100.0 / size)
        lines.append(
            _novatel("RAWIMU", 2200, f"{100 + 0.01 * k:.3f}", f"2200,{100.0 + 0.01 * k:.6f},77,{z},{y},{x},11,12,13")
        )
    path = tmp_path / "x.asc"
    path.write_text("\n".join(lines) + "\n")
    found = only(
        read_file(path),
        2200 * 604800,
        "gps",
        "seconds of the GPS week 2200",
        notes=[
            "RAWIMU does not name the IMU; of the known ones, STIM300 measures gravity: counts of 8.32238e-09 rad and "
            "2.38419e-07 m/s."
        ],
    )["imu"]
    counts = np.array([round(0.5 / 100.0 / size), -round(0.25 / 100.0 / size), round(-9.75 / 100.0 / size)])
    whole(
        found,
        time=[100.0, 100.01, 100.02],
        gyro=[np.array([13.0, -12.0, 11.0]) * np.pi / 180.0 / 2.0**21] * 3,
        accel=[counts * size] * 3,
        kind="increments",
    )
    path.write_text("\n".join(line.replace(",77,-", ",77,-9") for line in lines).split("*", maxsplit=1)[0] + "\n")
    with pytest.raises(InputError, match="one RAWIMU is not enough"):
        read_file(path)


def test_sbet_whose_axes_the_positions_do_not_tell(tmp_path: Path) -> None:
    """Two records are too few; at rest the usual axes are taken; a velocity unlike the positions is left out."""
    rows = np.zeros((9, 17))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 9] = 100.0 + np.arange(9), 0.5, 1.5, 2.5
    rows[:, 4:7] = 0.01, -0.02, 0.03
    path = tmp_path / "sbet.out"
    rows.astype("<f8").tofile(path)
    found = read_file(path)
    assert found.notes == ("Axes of the velocity, found from the positions: z down.",)
    np.testing.assert_array_equal(found.solutions["solution"].velocity_ned, rows[:, 4:7])
    rows[:2].astype("<f8").tofile(path)
    found = read_file(path)
    assert found.notes == ("Too few records to check the axes of the velocity: north, east, down.",)
    np.testing.assert_array_equal(found.solutions["solution"].velocity_ned, rows[:2, 4:7])
    rows[:, 4:7] = 3.0, 4.0, 0.0
    rows.astype("<f8").tofile(path)
    found = read_file(path)
    assert found.notes == ("The velocity was left out: in all known axes it is 5 m/s off that of the positions.",)
    assert found.solutions["solution"].velocity_ned is None


def test_inertial_explorer_without_a_week_and_with_a_footer(tmp_path: Path) -> None:
    path = tmp_path / "ie.txt"
    path.write_text(
        "  GPSTime  UTCDate UTCTime Latitude Longitude H-MSL SDNorth SDEast SDHeight\n"
        "    (sec)    (dmy)   (hms)    (deg)     (deg)   (m)    (m)    (m)      (m)\n"
        " 100.5 01/02/2020 00:01:40 -33.5 151.25 81.75 0.5 0.25 0.75\n"
        " 101.5 01/02/2020 00:01:41 -33.25 151.5 82.5 1.5 1.25 1.75\n"
        " 102.5 01/02/2020 00:01:42 -33.125 151.75 83.5 2.5 2.25 2.75\n"
        "End of file\n"
    )
    found = read_file(path)
    assert (found.clock.kind, found.clock.origin_gps_s, found.clock.note) == ("gps", None, "GPS seconds")
    whole(
        found.fixes["gnss"],
        time=[100.5, 101.5, 102.5],
        latitude_deg=[-33.5, -33.25, -33.125],
        longitude_deg=[151.25, 151.5, 151.75],
        height=[81.75, 82.5, 83.5],
        datum="mean sea level",
        position_sigma=[[0.5, 0.25, 0.75], [1.5, 1.25, 1.75], [2.5, 2.25, 2.75]],
    )


def test_the_truth_of_euroc_alone(tmp_path: Path) -> None:
    """Position and attitude without a velocity: w of 1 is forward to the east."""
    path = tmp_path / "truth.csv"
    path.write_text(
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
        "1767225600250000001,7.5,-8.5,9.5,1.0,0.0,0.0,0.0\n1767225601500000001,1.5,2.5,3.5,0.0,0.0,0.0,1.0\n"
    )
    found = read_file(path)
    assert found.inertial == {}
    whole(
        found.solutions["solution"],
        time=[0.250000001, 1.500000001],
        latitude=[NAN, NAN],
        longitude=[NAN, NAN],
        height=[NAN, NAN],
        attitude_deg=[[0.0, 0.0, 90.0], [0.0, 0.0, 270.0]],
        local_enu=[[7.5, -8.5, 9.5], [1.5, 2.5, 3.5]],
    )


def test_flysight_and_vbox_without_a_date(tmp_path: Path) -> None:
    """The device's own seconds; times of day without the day; no speed and no height where they are not logged."""
    sensors = tmp_path / "SENSOR.CSV"
    sensors.write_text(
        "$FLYS,1\n$COL,IMU,time,wx,wy,wz,ax,ay,az\n$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g\n$DATA\n"
        "$IMU,100.5,1,2,3,4,5,6\n$IMU,100.75,1,2,3,4,5,6\n"
    )
    found = read_file(sensors)
    assert (found.clock.kind, found.clock.origin_gps_s) == ("machine", None)
    assert found.inertial["imu"].time.tolist() == [100.5, 100.75]
    path = tmp_path / "x.vbo"
    path.write_text("[header]\n[column names]\nsats time lat long\n[data]\n012 000001.50 +2011.5 -09072.75\n")
    found = read_file(path)
    assert (found.clock.kind, found.clock.origin_gps_s) == ("utc", None)
    whole(found.fixes["gnss"], time=[1.5], latitude_deg=[33.525], longitude_deg=[151.2125], height=[NAN])


def test_a_bag_of_two_units_on_a_clock_without_a_date(tmp_path: Path) -> None:
    """Streams have the names of their topics, and times those of the stamps; velocities without fixes are left out."""
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    t = store.types
    vector, level = t["geometry_msgs/msg/Vector3"], t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    with Writer(tmp_path / "bag", version=9) as writer:
        for k, topic in enumerate(("/a", "/b")):
            header = t["std_msgs/msg/Header"](t["builtin_interfaces/msg/Time"](100 + 2 * k, 250_000_000), "b")
            none = np.zeros(9)
            imu = t["sensor_msgs/msg/Imu"](
                header, level, none, vector(1.0 + k, 2.0, 3.0), none, vector(4.0, 5.0, 6.0), none
            )
            place = writer.add_connection(topic, "sensor_msgs/msg/Imu", typestore=store)
            writer.write(place, k, store.serialize_cdr(imu, "sensor_msgs/msg/Imu"))
        twist = t["geometry_msgs/msg/Twist"](vector(1.0, 2.0, 3.0), vector(0.0, 0.0, 0.0))
        stamped = t["geometry_msgs/msg/TwistStamped"](header, twist)
        place = writer.add_connection("/v", "geometry_msgs/msg/TwistStamped", typestore=store)
        writer.write(place, 9, store.serialize_cdr(stamped, "geometry_msgs/msg/TwistStamped"))
    streams = only(
        read_file(tmp_path / "bag"),
        None,
        "machine",
        "stamps of the messages, since an unknown start",
        notes=[
            "Axes taken as those of ROS: forward-left-up, east-north-up.",
            "TwistStamped was left out: no fix has the same stamps.",
        ],
    )
    axes = "forward", "left", "up"
    whole(streams["/a"], time=[100.25], gyro=[[1.0, 2.0, 3.0]], accel=[[4.0, 5.0, 6.0]], axes=axes)
    whole(streams["/b"], time=[102.25], gyro=[[2.0, 2.0, 3.0]], accel=[[4.0, 5.0, 6.0]], axes=axes)
