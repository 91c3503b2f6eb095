"""Every column of the files of receivers, written by hand after the published layouts with all numbers different."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from sinssim.logs.formats import read_file
from sinssim.logs.formats.nmea_ubx import recognises_ubx
from sinssim.logs.formats.novatel import SCALES
from tests.logs.formats.samples import nmea_sentence, novatel_crc
from tests.logs.formats.whole import only, whole

NAN = float("nan")


def test_nmea(tmp_path: Path) -> None:
    """Over the leap second at the end of 2016; each instant has other sentences, the last one no date."""
    bodies = [
        "GNGGA,235959.25,3351.5000,S,15112.2500,W,5,11,0.8,58.25,M,23.5,M,,",
        "GNRMC,235959.25,A,3351.5000,S,15112.2500,W,12.5,210.0,311216,,",
        "GNGST,235959.25,9.0,7.0,6.0,5.0,0.25,0.5,0.75",
        "GNHDT,321.5,T",
        "GNGNS,000000.25,3351.2500,S,15112.7500,W,RR,12,0.7,59.5,24.25,,",
        "GNZDA,000000.25,01,01,2017,00,00",
        "GNVTG,121.0,T,118.0,M,7.5,N,13.89,K",
        "GNRMC,000001.5,V,,,,,,,010117,,",
        "GNGGA,000003.5,3351.1250,S,15113.5000,W,0,02,0.8,1.0,M,2.0,M,,",
        "GNGGA,000004.75,3351.1250,S,15113.5000,W,2,09,0.9,61.75,M,25.5,M,,",
        "GNRMC,000004.75,A,1111.0000,N,02222.0000,E,0.5,,,,",
        "GNVTG,99.0,T,,M,99.0,N,99.0,K",
    ]
    path = tmp_path / "x.nmea"
    path.write_text("".join(nmea_sentence(body) for body in bodies))
    speed = np.array([12.5, 7.5, 0.5]) * 1852.0 / 3600.0
    course = np.radians([210.0, 121.0, 0.0])
    # 13 509 days from 1980-01-06 to 2016-12-31, 17 leap seconds until then, and one before the second instant
    stream = only(
        read_file(path),
        86400 * 13509 + 17,
        "utc",
        "UTC with date, leap seconds removed",
        notes=["The velocity is speed and course over ground: the file has no vertical velocity."],
    )["gnss"]
    whole(
        stream,
        time=[86399.25, 86401.25, 86405.75],
        latitude_deg=-33.0 - np.array([51.5, 51.25, 51.125]) / 60.0,
        longitude_deg=-151.0 - np.array([12.25, 12.75, 13.5]) / 60.0,
        height=[81.75, 83.75, 87.25],
        datum="ellipsoid",
        position_sigma=[[0.25, 0.5, 0.75], [NAN] * 3, [NAN] * 3],
        velocity_ned=np.column_stack([speed * np.cos(course), speed * np.sin(course), [NAN] * 3]),
        quality=[5, -1, 2],
        quality_words={
            0: "no fix", 1: "single", 2: "differential", 3: "PPS", 4: "fixed", 5: "float", 6: "dead reckoning",
            7: "manual", 8: "simulated",
        },
        heading_deg=[321.5, NAN, NAN],
    )  # fmt: skip


def test_nmea_without_separation_and_date(tmp_path: Path) -> None:
    """Heights above mean sea level, and seconds of a day that count on over midnight."""
    path = tmp_path / "x.nmea"
    bodies = (
        "GPGGA,235958.50,1230.0000,N,00145.0000,E,1,08,0.9,545.5,M,,M,,",
        "GPGGA,000001.00,1230.6000,N,00145.3000,E,1,08,0.9,546.25,M,12.5,M,,",
    )
    path.write_text("".join(map(nmea_sentence, bodies)))
    stream = only(
        read_file(path),
        None,
        "utc",
        "seconds of a day in UTC; the file does not give the day",
        notes=[
            "No sentence gives the date.",
            "The geoid's separation is missing in some sentences: heights are above mean sea level there.",
        ],
    )["gnss"]
    whole(
        stream,
        time=[86398.5, 86401.0],
        latitude_deg=[12.5, 12.51],
        longitude_deg=[1.75, 1.755],
        height=[545.5, 558.75],
        datum="mean sea level",
        quality=[1, 1],
        quality_words=stream.quality_words,
    )


def _ubx(number: int, body: bytes) -> bytes:
    """Return a frame of the class NAV with its Fletcher checksum."""
    frame = bytes((1, number)) + struct.pack("<H", len(body)) + body
    a = b = 0
    for byte in frame:
        a = (a + byte) % 256
        b = (a + b) % 256
    return b"\xb5\x62" + frame + bytes((a, b))


def test_ubx(tmp_path: Path) -> None:
    """Frames packed after the tables of UBX-18010854, over the end of GPS week 2399, which began on 2025-12-28."""
    raw = b""
    # iTOW, date, flags of the date, nano, fixType, flags, lon, lat, height, hAcc, vAcc, velocity, sAcc
    for tow, date, valid, nano, kind, flags, lon, lat, height, hacc, vacc, velocity, sacc in (
        (604799800, (2026, 1, 3, 23, 59, 42), 0x00, -200_000_000, 3, 0x01,
         -1145123456, -501234567, 300123, 140, 270, (1234, -505, 707), 310),
        (0, (2026, 1, 3, 23, 59, 42), 0x03, 0, 3, 0x41,
         -1145123400, -501234500, 300200, 150, 280, (1300, -515, 717), 320),
        (200, (2026, 1, 3, 23, 59, 42), 0x03, 200_000_000, 4, 0x81,
         -1145123300, -501234400, 300300, 160, 290, (1400, -525, 727), 330),
        (400, (2026, 1, 3, 23, 59, 42), 0x03, 400_000_000, 0, 0x00,
         -1145123200, -501234300, 300400, 170, 295, (1500, -535, 737), 340),
        (600, (2026, 1, 3, 23, 59, 42), 0x03, 600_000_000, 2, 0x01,
         -1145123100, -501234200, 300500, 180, 299, (1600, -545, 747), 350),
    ):  # fmt: skip
        body = struct.pack("<IH5BBIi", tow, *date, valid, 25, nano)
        body += struct.pack("<4B4i2I3i2i2I", kind, flags, 0, 17, lon, lat, height, 255000, hacc, vacc, *velocity, 1390,
                            3_500_000, sacc, 180_000)  # fmt: skip
        raw += _ubx(0x07, body.ljust(92, b"\0"))
        if tow == 0:
            # 0.1 mm: 300.2007 m; 1e-9°: 0.25e-7 and −0.37e-7; σ 14.1 mm and 20.3 mm
            raw += _ubx(0x14, struct.pack("<B2xBI4i4b2I", 0, 0, tow, lon, lat, height, 1, 25, -37, 7, 0, 141, 203))
            raw += _ubx(
                0x36, struct.pack("<IBBB9x12f", tow, 0, 1, 1, 0.25, 0.125, -0.0625, 0.5, 0.375, 2.0, *[9.0] * 6)
            )
        if tow == 200:  # a message of high precision that says that it is invalid
            raw += _ubx(0x14, struct.pack("<B2xBI4i4b2I", 0, 1, tow, 0, 0, 0, 0, 0, 0, 0, 0, 9, 9))
            raw += _ubx(
                0x3C,
                struct.pack("<BxHI5i4x4b5I4xI", 1, 7, tow, 11, 12, 13, 20, 21_250_000, 1, 2, 3, 4, 5, 6, 7, 8, 75_000,
                            0x100),
            )  # fmt: skip
        if tow == 600:  # a heading that is not valid
            raw += _ubx(
                0x3C, struct.pack("<BxHI5i4x4b5I4xI", 1, 7, tow, 1, 2, 3, 4, 9_000_000, *[0] * 4, *[5] * 4, 100, 0)
            )
    path = tmp_path / "x.ubx"
    path.write_bytes(raw)
    stream = only(
        read_file(path),
        2399 * 604800,
        "gps",
        "seconds of the GPS week 2399",
        notes=["σ are the receiver's hAcc, vAcc and sAcc, the same for north and east."],
    )["gnss"]
    covariance = np.full((4, 3, 3), NAN)
    covariance[1] = [[0.25, 0.125, -0.0625], [0.125, 0.5, 0.375], [-0.0625, 0.375, 2.0]]
    whole(
        stream,
        time=[604799.8, 604800.0, 604800.2, 604800.6],
        longitude_deg=[-114.5123456, -114.512339975, -114.51233, -114.51231],
        latitude_deg=[-50.1234567, -50.123450037, -50.12344, -50.12342],
        height=[300.123, 300.2007, 300.3, 300.5],
        datum="ellipsoid",
        position_sigma=[[0.14, 0.14, 0.27], [0.0141, 0.0141, 0.0203], [0.16, 0.16, 0.29], [0.18, 0.18, 0.299]],
        velocity_ned=[[1.234, -0.505, 0.707], [1.3, -0.515, 0.717], [1.4, -0.525, 0.727], [1.6, -0.545, 0.747]],
        velocity_sigma=[[0.31] * 3, [0.32] * 3, [0.33] * 3, [0.35] * 3],
        quality=[3, 13, 14, 2],
        quality_words={
            0: "no fix", 1: "dead reckoning", 2: "2D", 3: "3D", 4: "GNSS and dead reckoning", 13: "float", 14: "fixed",
        },
        heading_deg=[NAN, NAN, 212.5, NAN],
        heading_sigma_deg=[NAN, NAN, 0.75, NAN],
        covariance=covariance,
    )  # fmt: skip


def _novatel(name: str, week: int, seconds: str, body: str) -> str:
    log = f"{name}A,COM1,0,73.5,FINESTEERING,{week},{seconds},02000040,4e77,43562;{body}"
    return f"#{log}*{novatel_crc(log.encode()):08x}"


def _novatel_file(path: Path) -> Path:
    """Logs after the tables of the OEM7 manual, over the end of week 2209; RAWIMUSX of an LN-200, type 8."""
    lines = []
    for week, seconds, z, y, x in ((2209, "604799.500000", 160_000, -3_000, 4_500), (2210, "0.250000", 161, -31, 46)):
        log = (
            f"RAWIMUSXA,{week},{float(seconds):.3f};00,8,{week},{seconds},ea59fe00,{z},{y},{x},{z + 1},{y - 2},{x + 3}"
        )
        lines.append(f"%{log}*{novatel_crc(log.encode()):08x}")
    sol = '"ABCD",1.500,2.500,35,30,29,28,00,06,39,33'
    place = "WGS84,0.0125,0.0250,0.0375," + sol
    lines += [
        _novatel("BESTPOS", 2209, "604799.500", f"SOL_COMPUTED,NARROW_INT,51.25,-114.5,1064.5,-16.75,{place}"),
        _novatel("BESTVEL", 2209, "604799.500", "SOL_COMPUTED,NARROW_INT,0.250,0.000,5.0,240.0,0.75,0.0"),
        _novatel("BESTPOS", 2209, "604799.750", f"INSUFFICIENT_OBS,NONE,51.75,-114.75,9.0,-9.0,{place}"),
        _novatel("BESTPOS", 2210, "0.250", f"SOL_COMPUTED,SINGLE,51.5,-114.25,1065.5,-17.25,{place}"),
    ]
    angles = "10.5,-20.25,130.75"
    sigma = "0.5,0.25,1.0,0.125,0.375,0.625,0.75,1.25,1.75,3,0"
    lines += [
        _novatel(
            "INSPVAX",
            2210,
            "0.250",
            f"INS_SOLUTION_GOOD,INS_PSRSP,51.375,-114.625,1063.5,-16.5,1.5,-2.5,3.5,{angles},{sigma}",
        )
    ]
    path.write_text("\r\n".join(lines) + "\r\n")
    return path


@pytest.mark.parametrize("binary", [False, True])
def test_novatel(tmp_path: Path, binary: bool) -> None:
    """As text by this package, and as binary logs that the manufacturer's library encodes; these have floats."""
    path = _novatel_file(tmp_path / "x.log")
    digits = 1e-12
    said = "IMU type 8, LN-200: counts of 1.90735e-06 rad and 6.10352e-05 m/s"
    if binary:
        oem = pytest.importorskip("novatel_edie.oem")
        raw = b"".join(bytes(m.to_binary().message) for m in oem.FileParser(str(path)))
        path = tmp_path / "x.gps"
        path.write_bytes(raw)
        digits = 1e-7
    streams = only(
        read_file(path),
        2209 * 604800,
        "gps",
        "seconds of the GPS week 2209",
        notes=[said + (", in the axes of the IMU." if binary else ".")],
    )
    assert list(streams) == ["imu", "gnss", "solution"]
    # counts: acceleration z, −y, x, then rates z, −y, x; 2⁻¹⁴ m/s and 2⁻¹⁹ rad ("Raw IMU Scale Factors")
    whole(
        streams["imu"],
        time=[604799.5, 604800.25],
        gyro=np.array([[4_503, 3_002, 160_001], [49, 33, 162]]) / 2.0**19,
        accel=np.array([[4_500, 3_000, 160_000], [46, 31, 161]]) / 2.0**14,
        kind="increments",
    )
    north, east = 5.0 * np.cos(np.radians(240.0)), 5.0 * np.sin(np.radians(240.0))
    whole(
        streams["gnss"],
        digits=digits,
        time=[604799.5, 604800.25],
        latitude_deg=[51.25, 51.5],
        longitude_deg=[-114.5, -114.25],
        height=[1047.75, 1048.25],
        datum="ellipsoid",
        position_sigma=[[0.0125, 0.025, 0.0375]] * 2,
        velocity_ned=[[north, east, -0.75], [NAN] * 3],
        quality=[50, 16],
        quality_words={16: "single", 50: "fixed"},
    )
    whole(
        streams["solution"],
        digits=digits,
        time=[604800.25],
        latitude_deg=[51.375],
        longitude_deg=[-114.625],
        height=[1047.0],
        datum="ellipsoid",
        velocity_ned=[[1.5, -2.5, -3.5]],
        attitude_deg=[[10.5, -20.25, 130.75]],
        position_sigma=[[0.5, 0.25, 1.0]],
        velocity_sigma=[[0.125, 0.375, 0.625]],
        attitude_sigma_deg=[[0.75, 1.25, 1.75]],
    )


def test_novatel_inspva_and_bestnav_as_text(tmp_path: Path) -> None:
    """INSPVA has ellipsoidal heights and its state at the end; BESTNAV of Unicore has position and velocity."""
    nav = (
        "SOL_COMPUTED,L1_FLOAT,40.5,116.25,60.5,-8.25,WGS84,1.5,2.5,3.5,\"0\",1.0,0.0,20,19,18,17,00,06,39,33,"
        "SOL_COMPUTED,DOPPLER_VELOCITY,0.0,0.0,8.0,150.0,-0.5,0.1,0.2"
    )  # fmt: skip
    # port, sequence, idle, state, week, milliseconds …: the long heading
    lines = [
        _novatel("BESTNAV", 2300, "100.500", nav),
        _novatel("INSPVA", 2300, "100.500", "2300,100.500,40.25,116.5,61.5,1.5,-2.5,3.5,4.5,-5.5,276.5,INS_ALIGNING"),
        _novatel("INSPVA", 2300, "100.750", "2300,100.750,40.75,116.75,62.5,7.5,-8.5,9.5,14.5,-15.5,76.5,"
        "INS_SOLUTION_GOOD"),
    ]  # fmt: skip
    path = tmp_path / "x.log"
    path.write_text("\r\n".join(lines) + "\r\n")
    streams = only(read_file(path), 2300 * 604800, "gps", "seconds of the GPS week 2300")
    assert list(streams) == ["gnss", "solution"]
    whole(
        streams["gnss"],
        time=[100.5],
        latitude_deg=[40.5],
        longitude_deg=[116.25],
        height=[52.25],
        datum="ellipsoid",
        position_sigma=[[1.5, 2.5, 3.5]],
        velocity_ned=[[8.0 * np.cos(np.radians(150.0)), 4.0, 0.5]],
        quality=[32],
        quality_words={32: "float"},
    )
    whole(
        streams["solution"],
        time=[100.75],
        latitude_deg=[40.75],
        longitude_deg=[116.75],
        height=[62.5],
        datum="ellipsoid",
        velocity_ned=[[7.5, -8.5, -9.5]],
        attitude_deg=[[14.5, -15.5, 76.5]],
    )


def test_counts_of_novatel_units() -> None:
    """Degrees, arcseconds, feet and milli-g of "Raw IMU Scale Factors" of the OEM7 manual, worked out to decimals."""
    found = {kind: (turn, force) for kind, (_, turn, force) in SCALES.items()}
    published = {
        5: (1.16415321826935e-10, 2.27093696594238e-09),
        8: (1.90734863281250e-06, 6.10351562500000e-05),
        11: (1.16415321826935e-10, 2.27093696594238e-09),
        12: (1.16415321826935e-10, 4.54187393188477e-09),
        13: (1.89380344183413e-09, 1.52587890625000e-06),
        16: (1.89380344183413e-09, 1.52587890625000e-06),
        26: (1.00000000000000e-09, 2.00000000000000e-08),
        27: (1.16415321826935e-10, 2.27093696594238e-09),
        31: (5.85167231706864e-09, 9.31322574615479e-08),
        32: (8.32237840649762e-09, 2.38418579101562e-07),
        33: (1.89380344183413e-09, 1.52587890625000e-06),
        41: (1.70442309765071e-11, 2.39420166015625e-10),
        58: (1.16415321826935e-10, 1.86264514923096e-09),
    }
    assert set(found) == set(published)
    for kind, pair in published.items():
        assert found[kind] == pytest.approx(pair, rel=1e-12, abs=0.0), kind


def test_the_log_that_counts_if_there_are_several(tmp_path: Path) -> None:
    """Positions of the satellites alone before those of the navigator; its extended logs before short ones."""
    names = {
        "BESTNAV": 1, "BESTPOS": 2, "BESTGNSSPOS": 3, "INSPVASX": 4, "INSPVA": 5, "INSPVAS": 6, "INSPVAX": 7,
    }  # fmt: skip
    place = 'WGS84,1.0,1.0,1.0,"",0.0,0.0,9,9,9,9,00,00,00,00'
    rest = "-16.5,1.5,-2.5,3.5,10.5,-20.25,130.75,1,1,1,1,1,1,1,1,1,3,0"
    logs = {
        name: f"SOL_COMPUTED,SINGLE,51.5,-114.25,{number}.5,0.0,{place}"
        if name.startswith("BEST")
        else f"INS_SOLUTION_GOOD,INS_PSRSP,51.375,-114.625,{number}.5,{rest}"
        if name.endswith("X")
        else f"2300,100.500,40.25,116.5,{number}.5,1.5,-2.5,3.5,4.5,-5.5,276.5,INS_SOLUTION_GOOD"
        for name, number in names.items()
    }
    path = tmp_path / "x.log"
    for fixes, solution in (
        ("BESTGNSSPOS", "INSPVAX"),
        ("BESTPOS", "INSPVAS"),
        ("BESTNAV", "INSPVA"),
        (None, "INSPVASX"),
    ):
        path.write_text("".join(_novatel(name, 2300, "100.500", body) + "\r\n" for name, body in logs.items()))
        found = read_file(path)
        heights = [float(one.height[0]) for one in (*found.fixes.values(), *found.solutions.values())]
        undulation = 16.5 if solution.endswith("X") else 0.0
        assert heights == [*([names[fixes] + 0.5] if fixes else []), names[solution] + 0.5 - undulation]
        for name in (fixes, solution):
            logs.pop(name, None)


def test_a_frame_after_a_false_beginning(tmp_path: Path) -> None:
    """Bytes that look like the beginning of a frame, and other text, come before one that is whole."""
    frame, path = _ubx(0x07, bytes(8)), tmp_path / "x"
    assert recognises_ubx(path, b"$GN\xb5\x62\x01\x07\x00\x00" + frame)
    assert recognises_ubx(path, b"\xb5\x62 cut")
    assert not recognises_ubx(path, b"$GN" + frame[:-1])
    assert not recognises_ubx(path, b"$GN" + frame[:-1] + b"\xff\xff")
