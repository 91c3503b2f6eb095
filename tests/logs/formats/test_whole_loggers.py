"""Every column of the files of loggers, written by hand after the published layouts with all numbers different."""

from __future__ import annotations

from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import read_file
from tests.logs.formats.whole import only, whole

NAN = float("nan")
DEGREE = np.pi / 180.0


def test_chc(tmp_path: Path) -> None:
    """Right, forward, up; over the end of week 2374; the first sentence has no position yet."""
    rows = (
        "2374,604799.75,0.0,0.0,0.0,1.5,-2.5,3.5,0.25,-0.125,0.75,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0,0,0,1,2",
        "2375,0.25,301.5,-20.25,10.75,4.5,5.5,-6.5,-0.5,0.375,1.25,-33.5,151.25,81.75,7.5,-8.5,9.5,11.3,18,12,42,1,2",
    )
    lines = [f"GPCHC,{row}" for row in rows]
    path = tmp_path / "x.txt"
    path.write_text("".join(f"${one}*{reduce(lambda a, b: a ^ b, one.encode()):02X}\r\n" for one in lines))
    streams = only(read_file(path), 2374 * 604800, "gps", "seconds of the GPS week 2374")
    whole(
        streams["imu"],
        time=[604799.75, 604800.25],
        gyro=np.array([[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]]) * DEGREE,
        accel=np.array([[0.25, -0.125, 0.75], [-0.5, 0.375, 1.25]]) * 9.80665,
        axes=("right", "forward", "up"),
    )
    whole(
        streams["solution"],
        time=[604800.25],
        latitude_deg=[-33.5],
        longitude_deg=[151.25],
        height=[81.75],
        velocity_ned=[[-8.5, 7.5, -9.5]],
        attitude_deg=[[10.75, -20.25, 301.5]],
    )


def test_flysight(tmp_path: Path) -> None:
    """Columns by their names in $COL, units by $UNIT; the device's clock is set by the median of three GPS times."""
    sensors = tmp_path / "SENSOR.CSV"
    rows = ["$FLYS,1", "$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature", "$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g,deg C"]
    rows += ["$COL,TIME,time,tow,week", "$UNIT,TIME,s,s,", "$DATA"]
    rows += ["$IMU,100.500,1.5,-2.5,3.5,0.25,-0.125,0.75,24.5", "$TIME,100.6,230400.85,2374"]
    rows += ["$TIME,101.0,230401.35,2374", "$TIME,101.5,230402.05,2374"]
    rows += ["$IMU,102.750,4.5,5.5,-6.5,-0.5,0.375,1.25,24.6"]
    sensors.write_text("\r\n".join(rows) + "\r\n")
    # GPS time minus that of the device: 1 436 025 900.25, .35, .55 → 2374 weeks + 230 300.35 s
    imu = only(
        read_file(sensors),
        2374 * 604800 + 230400,
        "gps",
        "clock of the device, set by its rows of GPS time (median)",
    )["imu"]
    whole(
        imu,
        digits=3e-7,  # GPS time as one double is exact to 0.12 µs
        time=[0.85, 3.1],
        gyro=np.array([[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]]) * DEGREE,
        accel=np.array([[0.25, -0.125, 0.75], [-0.5, 0.375, 1.25]]) * 9.80665,
    )
    track = tmp_path / "TRACK.CSV"
    rows = ["$FLYS,1", "$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV"]
    rows += ["$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m,m,m/s,", "$DATA"]
    rows += ["$GNSS,2025-07-08T16:00:01.250Z,-33.5,151.25,81.75,1.5,-2.5,3.5,0.25,0.75,0.125,7"]
    rows += ["$GNSS,2025-07-08T16:00:03.500Z,-33.25,151.5,82.5,4.5,5.5,-6.5,0.375,0.875,0.625,9"]
    track.write_text("\r\n".join(rows) + "\r\n")
    found = read_file(track)
    assert found.clock.kind == "utc"
    assert found.clock.origin_gps_s is not None
    # 16 620 days from 1980-01-06 to 2025-07-08, and 18 leap seconds
    stamp = 16620 * 86400 + 18 + 16 * 3600
    time = np.array([1.25, 3.5]) + (stamp - found.clock.origin_gps_s)
    whole(
        found.fixes["gnss"],
        time=time,
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="mean sea level",
        position_sigma=[[0.25, 0.25, 0.75], [0.375, 0.375, 0.875]],
        velocity_ned=[[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]],
        velocity_sigma=[[0.125] * 3, [0.625] * 3],
    )


KMH, KNOTS = "velocity kmh", "velocity knots\nvertical velocity m/s"


@pytest.mark.parametrize(("header", "speed", "climb"), [(KMH, 1.0 / 3.6, 1.0 / 3.6), (KNOTS, 1852.0 / 3600.0, 1.0)])
def test_vbox(tmp_path: Path, header: str, speed: float, climb: float) -> None:
    """Minutes, west positive; over midnight; a row without a fix has zeros."""
    text = "File created on 31/12/2016 at 23:59:59\n\n[header]\nsatellites\ntime\n" + header
    text += "\n\n[column names]\nsats time lat long velocity heading height vert-vel\n\n[data]\n"
    text += "000 235958.25 +0000.00000 +00000.00000 000.000 000.00 +0000.00 +000.00\n"
    text += "012 235959.75 -2011.50000 -09072.75000 036.500 210.00 +0081.75 +004.50\n"
    text += "013 000001.50 -2011.25000 -09072.25000 018.250 135.00 +0082.50 -002.25\n"
    path = tmp_path / "x.vbo"
    path.write_text(text)
    fixes = only(read_file(path), 13509 * 86400 + 17, "utc", "time of day in UTC, date of the file")["gnss"]
    fast, course = np.array([36.5, 18.25]) * speed, np.radians([210.0, 135.0])
    down = np.array([-4.5, 2.25]) * climb
    whole(
        fixes,
        digits=1e-11,
        time=[86399.75, 86401.5],
        latitude_deg=[-33.525, -2011.25 / 60.0],
        longitude_deg=[151.2125, 9072.25 / 60.0],
        height=[81.75, 82.5],
        velocity_ned=np.column_stack([fast * np.cos(course), fast * np.sin(course), down]),
    )


ANDROID = """# Version: v3.1
# UncalAccel,utcTimeMillis,elapsedRealtimeNanos,UncalAccelXMps2,UncalAccelYMps2,UncalAccelZMps2,BiasXMps2
# UncalGyro,utcTimeMillis,elapsedRealtimeNanos,UncalGyroXRadPerSec,UncalGyroYRadPerSec,UncalGyroZRadPerSec
# Raw,utcTimeMillis,TimeNanos
# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,UnixTimeMillis,\
SpeedAccuracyMps,BearingAccuracyDegrees,elapsedRealtimeNanos,VerticalAccuracyMeters
UncalAccel,1751990400000,9000250000000,1.0,-2.0,9.0,0.5
UncalGyro,1751990400100,9000000000000,0.5,0.5,0.5
UncalGyro,1751990400250,9000350000000,0.01,-0.02,0.03
Fix,FLP,10.0,20.0,30.0,1.0,1.0,1.0,1751990400250,1.0,1.0,9000250000000,1.0
Fix,GPS,-33.5,151.25,81.75,5.5,2.5,210.0,1751990400750,0.25,9.0,9000500000000,3.5
UncalAccel,1751990401250,9001250000000,2.0,-6.0,13.0,0.5
UncalGyro,1751990401250,9001000000000,0.04,0.05,-0.06
UncalGyro,1751990401250,9001500000000,0.7,0.7,0.7
Fix,GPS,-33.25,151.5,82.5,0.0,4.5,,1751990403250,0.75,9.0,9003000000000,
"""


def test_android(tmp_path: Path) -> None:
    """The fixes of the satellites come before those of other sources; gyros before the first reading are left out."""
    path = tmp_path / "gnss.txt"
    path.write_text(ANDROID)
    # Unix time minus that of the phone: 1 751 981 400.25 s; its nearest second on 2025-07-08 is 18 s behind GPS time
    streams = only(
        read_file(path),
        1751981400 - 315964800 + 18,
        "utc",
        "time since the start of the phone, in UTC by the fixes",
        notes=["Accelerometers are interpolated linearly to the times of the gyros."],
    )
    whole(
        streams["imu"],
        time=[9000.35, 9001.0],
        gyro=[[0.01, -0.02, 0.03], [0.04, 0.05, -0.06]],
        accel=[[1.1, -2.4, 9.4], [1.75, -5.0, 12.0]],
    )
    whole(
        streams["gnss"],
        time=[9000.5, 9003.0],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="ellipsoid",
        position_sigma=[[2.5, 2.5, 3.5], [4.5, 4.5, 9.0]],
        velocity_ned=[[-5.5 * np.sqrt(0.75), -2.75, NAN], [0.0, 0.0, NAN]],
        velocity_sigma=[[0.25] * 3, [0.75] * 3],
    )


def test_readings_of_android_that_are_repeated(tmp_path: Path) -> None:
    """A reading of an instant that was read already is left out."""
    path = tmp_path / "gnss.txt"
    lines = ANDROID.splitlines()
    again = next(k for k, line in enumerate(lines) if line.startswith("UncalGyro,1751990400250"))
    path.write_text("\n".join([*lines[: again + 1], lines[again], *lines[again + 1 :]]) + "\n")
    assert read_file(path).inertial["imu"].time.tolist() == pytest.approx([9000.35, 9001.0])


def test_a_line_of_android_that_was_cut_short(tmp_path: Path) -> None:
    """The sixteenth line has three of seven fields."""
    path = tmp_path / "gnss.txt"
    path.write_text(ANDROID + "UncalAccel,1751990402250,9002250")
    assert read_file(path).notes[0] == (
        "gnss.txt, line 15: the last row was cut short (3 of 7 fields) and is left out."
    )


def test_android_fixes_without_the_phones_time(tmp_path: Path) -> None:
    """The offset between the clocks is then that of the sensors: UTC minus the time since the start."""
    path = tmp_path / "gnss.txt"
    head = (
        "Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,"
        "(UTC)TimeInMs"
    )
    rows = [line for line in ANDROID.splitlines() if "Fix" not in line and "Gyro,1751990400100" not in line]
    rows += [f"# {head}", "Fix,gps,-33.5,151.25,81.75,5.5,2.5,210.0,1751990402000"]
    path.write_text("\n".join(rows) + "\n")
    found = read_file(path)
    # UTC minus time since the start, of the gyros and accelerometers: 1 751 981 399.75 or .9 to 400.25
    assert found.clock.origin_gps_s is not None
    fix = found.fixes["gnss"]
    instant = found.clock.origin_gps_s + float(fix.time[0])
    assert instant == pytest.approx(1751990402.0 - 315964800 + 18, abs=0.51)
    accelerometers = np.median([1751990400.0 - 9000.25, 1751990401.25 - 9001.25])
    assert float(fix.time[0]) == pytest.approx(1751990402.0 - accelerometers, abs=1e-6)


ARDUPILOT = """FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns
FMT, 200, 50, IMU, QBffffff, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ
FMT, 201, 50, GPS, QBBIHBcLLeffffB, TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U
FMT, 202, 50, GPA, QBCCCC, TimeUS,I,VDop,HAcc,VAcc,SAcc
IMU, 20500000, 1, 0.5, -0.25, 0.75, 1.5, -2.5, -9.5
IMU, 20250000, 0, 0.125, 0.375, -0.625, 2.5, 3.5, -9.25
GPS, 20600000, 0, 1, 230400000, 2374, 5, 3.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 1
GPS, 20900000, 0, 6, 230400250, 2374, 12, 0.75, -33.5, 151.25, 81.75, 5.5, 210.0, -0.5, 0.0, 1
GPA, 20900000, 0, 9.0, 0.25, 0.375, 0.125
GPS, 20950000, 1, 3, 230400250, 2374, 9, 0.95, -33.75, 151.75, 91.75, 2.5, 120.0, 0.75, 0.0, 1
GPA, 20950000, 1, 9.0, 1.25, 2.375, 0.625
IMU, 20750000, 1, 0.0625, 0.5, 0.25, -1.5, 2.25, -9.75
GPS, 21050000, 0, 5, 230400500, 2374, 11, 0.85, -33.25, 151.5, 82.5, 7.5, 30.0, 1.5, 0.0, 1
GPA, 21050000, 0, 9.0, 0.5, 0.875, 0.75
"""


def test_ardupilot(tmp_path: Path) -> None:
    """Two units and two receivers with their accuracies; the second fix of the first receiver arrives soonest."""
    path = tmp_path / "x.log"
    path.write_text(ARDUPILOT)
    # 230 400.5 s − 21.05 s = 230 379.45 s, the latest start of the autopilot that a fix allows
    streams = only(
        read_file(path),
        2374 * 604800 + 230379,
        "machine",
        "time since the start of the autopilot, by the receiver's GPS time",
        notes=["There are 2 IMUs: imu0, imu1."],
    )
    axes = "forward", "right", "down"
    whole(streams["imu0"], time=[20.25], gyro=[[0.125, 0.375, -0.625]], accel=[[2.5, 3.5, -9.25]], axes=axes)
    whole(
        streams["imu1"],
        time=[20.5, 20.75],
        gyro=[[0.5, -0.25, 0.75], [0.0625, 0.5, 0.25]],
        accel=[[1.5, -2.5, -9.5], [-1.5, 2.25, -9.75]],
        axes=axes,
    )
    whole(
        streams["gps0"],
        digits=1e-9,
        time=[21.25, 21.5],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="mean sea level",
        position_sigma=[[0.25, 0.25, 0.375], [0.5, 0.5, 0.875]],
        velocity_ned=[[-5.5 * np.sqrt(0.75), -2.75, -0.5], [7.5 * np.sqrt(0.75), 3.75, 1.5]],
        velocity_sigma=[[0.125] * 3, [0.75] * 3],
        quality=[6, 5],
        quality_words={5: "float", 6: "fixed"},
    )
    whole(
        streams["gps1"],
        digits=1e-9,
        time=[21.25],
        latitude_deg=[-33.75],
        longitude_deg=[151.75],
        height=[91.75],
        datum="mean sea level",
        position_sigma=[[1.25, 1.25, 2.375]],
        velocity_ned=[[-1.25, 2.5 * np.sqrt(0.75), 0.75]],
        velocity_sigma=[[0.625] * 3],
        quality=[3],
        quality_words={3: "single"},
    )


def test_ardupilot_units_by_the_name_of_their_message(tmp_path: Path) -> None:
    """IMU and IMU2 of older logs have no number; a fix that repeats the instant of the one before is left out."""
    text = ARDUPILOT.replace("IMU, QBffffff, TimeUS,I,", "IMU, Qffffff, TimeUS,").replace(
        "IMU, 20250000, 0,", "IMU, 20250000,"
    )
    lines = [line for line in text.splitlines() if not line.startswith(("IMU, 20500000", "IMU, 20750000", "GP"))]
    lines.insert(2, "FMT, 203, 50, IMU2, Qffffff, TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    lines += ["IMU2, 20375000, 0.25, 0.5, -0.75, 3.5, 4.5, -9.125"]
    lines = [line.replace("TimeUS,I,Status", "TimeUS,Status").replace("QBBIHB", "QBIHB") for line in lines]
    fix = "GPS, {}, 3, {}, 2374, 12, 0.75, -33.5, 151.25, {}, 5.5, 210.0, -0.5, 0.0, 1"
    lines += [
        fix.format(20900000, 230400250, 1.5),
        fix.format(20990000, 230400250, 2.5),
        fix.format(21100000, 230400500, 3.5),
    ]
    path = tmp_path / "x.log"
    path.write_text("\n".join(lines) + "\n")
    found = read_file(path)
    assert [(name, one.gyro[0, 0], one.time[0]) for name, one in found.inertial.items()] == [
        ("imu0", 0.125, 20.25),
        ("imu1", 0.25, 20.375),
    ]
    fixes = found.fixes["gps0"]
    assert fixes.height.tolist() == [1.5, 3.5]
    # 230 400.25 s − 20.9 s = 230 379.35 s; the other 230 379.4 s
    assert found.clock.origin_gps_s == 2374 * 604800 + 230379
    assert fixes.time == pytest.approx([21.25, 21.5], abs=1e-6)
    assert fixes.position_sigma is None


def test_gnss_ins_sim(tmp_path: Path) -> None:
    """Units of every heading: deg/hr and rad/s, g and m/s², deg and rad."""
    folder = tmp_path / "demo"
    folder.mkdir()
    for name, text in (
        ("time", "time (sec)\n0.25\n0.75\n"),
        ("gyro-0", "gyro_x (deg/hr),gyro_y (rad/s),gyro_z (deg/s)\n7200,0.5,-3\n-3600,0.25,4.5\n"),
        ("accel-0", "accel_x (g),accel_y (m/s^2),accel_z (m/s2)\n0.5,1.5,-9.5\n-0.25,2.5,-9.25\n"),
        ("gps_time", "gps_time (sec)\n0.5\n"),
        ("gps-0", "gps_lat (deg),gps_lon (rad),gps_alt (m),gps_vN (m/s),gps_vE (m/s),gps_vD (m/s)\n"
                  "-33.5,2.5,81.75,1.5,-2.5,3.5\n"),
    ):  # fmt: skip
        (folder / f"{name}.csv").write_text(text)
    streams = only(read_file(folder), None, "machine", "seconds of the simulation")
    whole(
        streams["imu"],
        time=[0.25, 0.75],
        gyro=[[2.0 * DEGREE, 0.5, -3.0 * DEGREE], [-DEGREE, 0.25, 4.5 * DEGREE]],
        accel=[[4.903325, 1.5, -9.5], [-2.4516625, 2.5, -9.25]],
        axes=("forward", "right", "down"),
    )
    whole(
        streams["gnss"],
        time=[0.5],
        latitude_deg=[-33.5],
        longitude=[2.5],
        height=[81.75],
        datum="ellipsoid",
        velocity_ned=[[1.5, -2.5, 3.5]],
    )
    (folder / "gps_time.csv").write_text("gps_time (sec)\n0.5\n0.75\n1\n")
    with pytest.raises(InputError, match=r"gps_time\.csv has 3 rows, gps-0\.csv 1"):
        read_file(folder)
    (folder / "time.csv").write_text("time (sec)\n0.25\n0.75\n1\n")
    with pytest.raises(InputError, match="have 3, 2 and 2 rows"):
        read_file(folder)
