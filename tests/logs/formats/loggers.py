"""Small valid files of loggers and receivers, made without this package's readers: two units, three fixes, 4 Hz."""

from __future__ import annotations

import struct
from functools import reduce
from pathlib import Path

WEEK, TOW = 2374, 230_400.0
PLACE = 48.0 + 6.0 / 60.0 + 3.6 / 3600.0, -(11.0 + 30.0 / 60.0 + 7.2 / 3600.0), 520.25
"""48° 06' 03.6" north, 11° 30' 07.2" west, 520.25 m."""
GYRO, ACCEL = (0.01, -0.02, 0.03), (0.5, -0.25, -9.75)
VELOCITY = 3.0, 4.0, -0.5
"""North, east, down: 5 m/s with the course 53.13°."""
COURSE = 53.13010235415598

ARDUPILOT = {
    "IMU": ("QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 200),
    "GPS": ("QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U", 201),
    "MSG": ("QZ", "TimeUS,Message", 203),
}


ARDUPILOT_2014 = {
    "IMU": ("Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 200),
    "GPS": ("BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T", 201),
    "MSG": ("Z", "Message", 203),
}
"""The messages of ArduCopter 3.1 and 3.2: milliseconds."""


def _ardupilot_2014() -> list[tuple[str, tuple[float | str, ...]]]:
    """One unit of the same log; the times of the autopilot in the first column, or in the last one."""
    rows: list[tuple[str, tuple[float | str, ...]]] = []
    for name, values in _ardupilot():
        if name == "MSG":
            rows.append((name, values[1:]))
        elif name == "IMU" and values[1] == 0:
            rows.append((name, (int(values[0]) // 1000, *values[2:])))
        elif name == "GPS":
            us, _, status, ms, week, sats, hdop, lat, lon, alt, speed, course, down, *_ = values
            place = (lat, lon, 0.25, alt, speed, course, down)
            rows.append((name, (status, ms, week, sats, hdop, *place, int(us) // 1000)))
    return rows


def _ardupilot() -> list[tuple[str, tuple[float | str, ...]]]:
    rows: list[tuple[str, tuple[float | str, ...]]] = [("MSG", (1, "ArduPlane"))]
    for k in range(4):
        us = 20_000_000 + 250_000 * k
        rows += [("IMU", (us + unit, unit, *(x + unit for x in GYRO), *ACCEL)) for unit in (0, 1)]
        ms = round(TOW * 1e3) + 250 * k
        fix = (PLACE[0], PLACE[1], PLACE[2], 5.0, COURSE, VELOCITY[2])
        # the first fix arrives after 0.1 s, the others after 0.12 s
        rows.append(("GPS", (us + 100_000 + 20_000 * bool(k), 0, 6 if k else 1, ms, WEEK, 12, 0.7, *fix, 0.0, 1)))
    return rows


def ardupilot(path: Path, *, of_2014: bool = False) -> Path:
    """A DataFlash log, with the scaled integers of its format letters."""
    codes = {"c": "h", "L": "i", "e": "i", "E": "I", "Z": "64s", "n": "4s", "N": "16s"}
    scale = {"c": 100, "e": 100, "E": 100, "L": 10_000_000}
    layouts, rows = (ARDUPILOT_2014, _ardupilot_2014()) if of_2014 else (ARDUPILOT, _ardupilot())

    def formatted(number: int, name: str, letters: str, columns: str) -> bytes:
        size = 3 + struct.calcsize("<" + "".join(codes.get(c, c) for c in letters))
        texts = (text.encode() for text in (name, letters, columns))
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, size, *texts)

    data = formatted(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    data += b"".join(formatted(number, name, letters, columns) for name, (letters, columns, number) in layouts.items())
    for name, values in rows:
        letters, _, number = layouts[name]
        packed = [
            v.encode() if isinstance(v, str) else round(v * scale[c]) if c in scale else v
            for v, c in zip(values, letters, strict=True)
        ]
        data += bytes((0xA3, 0x95, number))
        data += struct.pack("<" + "".join(codes.get(c, c) for c in letters), *packed)
    path.write_bytes(data)
    return path


def ardupilot_log(path: Path, *, of_2014: bool = False) -> Path:
    """The same log as text."""
    layouts, rows = (ARDUPILOT_2014, _ardupilot_2014()) if of_2014 else (ARDUPILOT, _ardupilot())
    lines = [f"FMT, {n}, 50, {name}, {letters}, {columns}" for name, (letters, columns, n) in layouts.items()]
    lines += [", ".join(map(str, (name, *values))) for name, values in rows]
    path.write_text("\r\n".join(lines) + "\r\n")
    return path


def ardupilot_dump(path: Path) -> Path:
    """The same log as mavlogdump prints it."""
    lines = []
    for name, values in _ardupilot():
        pairs = zip(ARDUPILOT[name][1].split(","), values, strict=True)
        lines.append(f"2025-07-08 16:00:00.25: {name} {{{', '.join(f'{key} : {value}' for key, value in pairs)}}}")
    path.write_text("\n".join(lines) + "\n")
    return path


def vbox(path: Path) -> Path:
    """Minutes, west positive."""
    head = ["File created on 08/07/2025 at 16:00:00", "", "[header]", "satellites", "time", "velocity kmh", ""]
    head += ["[column names]", "sats time lat long velocity heading height vert-vel", "", "[data]"]
    minutes = PLACE[0] * 60.0, -PLACE[1] * 60.0
    rows = [
        f"012 1600{k // 4:02d}.{25 * (k % 4):02d} {minutes[0]:+013.7f} {minutes[1]:+014.7f} 018.000 {COURSE:.9f} "
        f"{PLACE[2]:+09.2f} {-VELOCITY[2] * 3.6:+08.3f}"
        for k in range(4)
    ]
    path.write_text("\r\n".join(head + rows) + "\r\n")
    return path


def flysight(path: Path) -> Path:
    """Kinds of rows with columns of their own; the fixes in TRACK.CSV beside it."""
    head = ["$FLYS,1", "$VAR,DEVICE_ID,1", "$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature"]
    head += ["$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g,deg C", "$COL,TIME,time,tow,week", "$UNIT,TIME,s,s,", "$DATA"]
    gyro, accel = [f"{57.29577951308232 * x:.9f}" for x in GYRO], [f"{x / 9.80665:.9f}" for x in ACCEL]
    rows = [",".join(["$IMU", f"{100.0 + 0.25 * k:.3f}", *gyro, *accel, "24.6"]) for k in range(4)]
    path.write_text("\r\n".join([*head, *rows[:2], f"$TIME,100.4,{TOW + 0.4},{WEEK}", *rows[2:]]) + "\r\n")
    head = ["$FLYS,1", "$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV"]
    head += ["$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m,m,m/s,", "$DATA"]
    place = ",".join(f"{x:.9f}" for x in (*PLACE, *VELOCITY, 1.5, 2.5, 0.25))
    rows = [f"$GNSS,2025-07-08T16:00:0{0.25 * k:.3f}Z,{place},7" for k in range(4)]
    path.with_name("TRACK.CSV").write_text("\r\n".join(head + rows) + "\r\n")
    return path


def chc(path: Path) -> Path:
    """Right, forward, up; °/s and g; attitude heading, pitch, roll."""
    lines = []
    for k in range(4):
        gyro = [f"{57.29577951308232 * x:.9f}" for x in (GYRO[1], GYRO[0], -GYRO[2])]
        accel = [f"{x / 9.80665:.9f}" for x in (ACCEL[1], ACCEL[0], -ACCEL[2])]
        place, velocity = [f"{x:.9f}" for x in PLACE], [f"{x:.3f}" for x in (VELOCITY[1], VELOCITY[0], -VELOCITY[2])]
        fields = [str(WEEK), f"{TOW + 0.25 * k:.2f}", "30.0", "20.0", "10.0", *gyro, *accel, *place, *velocity, "5.0"]
        body = ",".join(["GPCHC", *fields, "18", "20", "42", "1", "2"])
        lines.append(f"${body}*{reduce(lambda a, b: a ^ b, body.encode()):02X}")
    path.write_text("\r\n".join(lines) + "\r\n")
    return path


def android(path: Path) -> Path:
    """Accelerometers 2 ms after the gyros, fixes of satellites and of the network."""
    text = [
        "# Version: v3.1",
        "# UncalAccel,utcTimeMillis,elapsedRealtimeNanos,UncalAccelXMps2,UncalAccelYMps2,UncalAccelZMps2,BiasXMps2",
        "# UncalGyro,utcTimeMillis,elapsedRealtimeNanos,UncalGyroXRadPerSec,UncalGyroYRadPerSec,UncalGyroZRadPerSec",
        "# Raw,utcTimeMillis,TimeNanos",
        "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,"
        "UnixTimeMillis,SpeedAccuracyMps,BearingAccuracyDegrees,elapsedRealtimeNanos,VerticalAccuracyMeters",
    ]
    for k in range(4):
        utc, since = 1_751_990_400_000 + 250 * k, 9_000_000_000_000 + 250_000_000 * k
        text.append(f"UncalAccel,{utc},{since + 2_000_000},{0.5 + 0.125 * k},-0.25,-9.75,0")
        text.append(f"UncalGyro,{utc},{since},0.01,-0.02,0.03")
        text.append(f"Fix,GPS,{PLACE[0]},{PLACE[1]},{PLACE[2]},5.0,2.5,{COURSE},{utc},0.2,2.0,{since},3.5")
        text.append(f"Fix,NLP,{PLACE[0] + 1},{PLACE[1]},,,30.0,,{utc},,,{since},")
        text.append(f"Raw,{utc},{since}")
    path.write_text("\n".join(text) + "\n")
    return path


def inertial_explorer(path: Path) -> Path:
    """Degrees, minutes and seconds; the velocity of the body; a heading counted counter-clockwise, as the motion shows.

    The body moves forwards at 5 m/s, level, while latitude and longitude say north-east.
    """
    head = ["Project:     Test", "Program:     Inertial Explorer Version 8.90", ""]
    head += [
        "      UTCTime       Week   GPSTime         Latitude        Longitude        H-Ell VelBdyX VelBdyY VelBdyZ"
        "           Roll          Pitch        Heading Q",
        "        (sec)    (weeks)     (sec)       (+/-D M S)       (+/-D M S)          (m)   (m/s)   (m/s)   (m/s)"
        "          (deg)          (deg)          (deg)  ",
    ]
    rows = []
    for k in range(4):
        north = 3.6 + k * 3.0 / 6.371e6 * 206264.80624709636
        east = 7.2 - k * 4.0 / 6.371e6 / 0.6678 * 206264.80624709636
        rows.append(
            f" 1751990400.00 {WEEK}.00000 {TOW + k:.2f}   48 06 {north:.9f}  -11 30 {east:.9f} {PLACE[2]:.3f} "
            f"0.000 5.000   0.000   0.0   0.0  {-COURSE:.9f} 1"
        )
    path.write_text("\n".join(head + rows) + "\n")
    return path


def gnss_ins_sim(path: Path) -> Path:
    """A folder; rates in °/s."""
    path.mkdir()
    degrees = [57.29577951308232 * x for x in GYRO]
    for name, heads, row in (
        ("time", "time (sec)", None),
        ("gps_time", "gps_time (sec)", None),
        ("gyro-0", "gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)", degrees),
        ("accel-0", "accel_x (m/s^2),accel_y (m/s^2),accel_z (m/s^2)", ACCEL),
        (
            "gps-0",
            "gps_lat (deg),gps_lon (deg),gps_alt (m),gps_vN (m/s),gps_vE (m/s),gps_vD (m/s)",
            (*PLACE, *VELOCITY),
        ),
    ):
        lines = [",".join(map(repr, row or (0.25 * k,))) for k in range(4)]
        (path / f"{name}.csv").write_text("\n".join([heads, *lines]) + "\n")
    return path


LOGGERS = {
    "ardupilot": (ardupilot, "x.bin"),
    "vbox": (vbox, "x.vbo"),
    "flysight": (flysight, "SENSOR.CSV"),
    "chc": (chc, "chc.txt"),
    "android-gnss": (android, "gnss_log.txt"),
    "inertial-explorer": (inertial_explorer, "ie.txt"),
}
"""What makes a file of each format, and its name."""
