"""Readers on files that were not made by this package, with numbers known beforehand."""

from __future__ import annotations

import contextlib
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.formats import FORMATS, candidates, detect, read_file
from sinssim.logs.gps_time import gps_from_date
from sinssim.logs.recorded_streams import FixStream, SolutionStream, Streams
from sinssim.units import DEG, KNOT
from tests.logs.formats import samples
from tests.logs.formats.samples import FILES, LIBRARIES

NEW_YEAR = gps_from_date(datetime(2026, 1, 1, tzinfo=UTC))


def made(name: str, folder: Path) -> Path:
    """Return a sample of a format; the test is skipped without the library."""
    if name in LIBRARIES:
        pytest.importorskip(LIBRARIES[name])
    make, file = FILES[name]
    return make(folder / file)


def angles(s: SolutionStream) -> np.ndarray:
    """Return roll, pitch, heading of the first row, °."""
    return np.degrees([a[0] for a in rotation.euler_from_quaternion(s.q_nb)])


@pytest.mark.parametrize("name", FILES)
def test_found_by_content_alone(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    other = path.rename(tmp_path / "file")
    assert candidates(other) == [name]


def test_every_sample_has_a_format() -> None:
    assert {*FILES, "kitti-oxts"} <= set(FORMATS)


def test_kf_gins(tmp_path: Path) -> None:
    imu = read_file(made("kf-gins-imu", tmp_path)).inertial["imu"]
    assert imu.time[1] == 456300.005
    assert imu.gyro[3].tolist() == [3e-6, -2e-6, 3e-6]
    assert imu.accel[0].tolist() == [0.000123, -0.0004, -0.04896]
    assert imu.axes == ("forward", "right", "down")
    gnss = read_file(made("kf-gins-gnss", tmp_path)).fixes["gnss"]
    assert gnss.latitude[2] == 30.44472 * DEG
    assert gnss.position_sigma[0].tolist() == [0.005, 0.004, 0.008]
    streams = read_file(made("kf-gins-solution", tmp_path))
    s = streams.solutions["solution"]
    assert streams.clock.origin_gps_s is None
    assert s.time.tolist() == [604799.0, 604800.0, 604801.0, 604802.0]
    assert angles(s) == pytest.approx([0.85, -2.03, 185.7], abs=1e-12)


def test_kf_gins_gnss_with_velocity(tmp_path: Path) -> None:
    path = tmp_path / "g.txt"
    path.write_text("1.0 30 114 20 1 2 3 0.1 0.2 0.3 0.01 0.02 0.03\n2.0 30 114 20 1 2 3 0.1 0.2 0.3 0.01 0.02 0.03\n")
    gnss = read_file(path).fixes["gnss"]
    assert gnss.velocity_ned[0].tolist() == [1.0, 2.0, 3.0]
    assert gnss.position_sigma[0].tolist() == [0.1, 0.2, 0.3]
    assert gnss.velocity_sigma[1].tolist() == [0.01, 0.02, 0.03]


def test_psins(tmp_path: Path) -> None:
    """By imufile.m: counts × 0.1″ and × 125 µg s of the header's g; time t0 + k ts + Σ dither."""
    imu = read_file(made("psins-imu", tmp_path)).inertial["imu"]
    assert imu.gyro[2] == pytest.approx(np.array([2, 4, -2]) * 0.1 / 3600.0 * DEG, rel=1e-12)
    assert imu.accel[2] == pytest.approx(np.array([3, 4, 782]) * 125e-6 * 9.8, rel=1e-12)
    assert imu.time[:3].tolist() == pytest.approx([100.01, 100.020001, 100.030001], abs=1e-12)
    assert imu.axes == ("right", "forward", "up")
    s = read_file(made("psins-avp", tmp_path)).solutions["solution"]
    assert angles(s) == pytest.approx([2.0, 1.0, 30.0], abs=1e-12)  # yaw −30° counter-clockwise
    assert s.velocity_ned[0].tolist() == [6.0, 5.0, -7.0]


def test_sbet_finds_the_axes(tmp_path: Path) -> None:
    streams = read_file(made("sbet", tmp_path))
    s = streams.solutions["solution"]
    assert angles(s)[2] == pytest.approx(60.0, abs=1e-9)
    assert s.velocity_ned[0] == pytest.approx([25.0, 50.0 * np.sin(np.pi / 3), -4.0], abs=1e-12)
    assert "z up" in streams.notes[0]


def test_nmea(tmp_path: Path) -> None:
    """The GGA of the standard's example: 48° 7.038' N, 11° 31' E; 545.4 m + 46.9 m."""
    streams = read_file(made("nmea", tmp_path))
    fix = streams.fixes["gnss"]
    assert fix.latitude[0] == pytest.approx((48.0 + 7.038 / 60.0) * DEG, abs=2e-12)
    assert fix.height[0] == pytest.approx(592.3)
    assert fix.time.tolist() == [86399.5, 86400.0, 86400.5]
    assert streams.clock.origin_gps_s == gps_from_date(datetime(1994, 3, 23, tzinfo=UTC))  # 9 leap seconds
    assert np.hypot(*fix.velocity_ned[0, :2]) == pytest.approx(22.4 * KNOT)
    assert np.arctan2(fix.velocity_ned[0, 1], fix.velocity_ned[0, 0]) == pytest.approx(84.4 * DEG)
    assert fix.position_sigma[0].tolist() == [0.01, 0.02, 0.03]
    assert fix.quality_words[int(fix.quality[0])] == "fixed"


def test_nmea_names_damaged_sentences(tmp_path: Path) -> None:
    path = made("nmea", tmp_path)
    path.write_text(path.read_text().replace("4807.038", "4907.038", 1))  # the checksum of line 1 is wrong now
    assert "line 1" in read_file(path).notes[0]


def test_ubx(tmp_path: Path) -> None:
    streams = read_file(made("ubx", tmp_path))
    fix = streams.fixes["gnss"]
    assert streams.clock.origin_gps_s == 2399 * 604800
    assert fix.time.tolist() == pytest.approx([345618.2, 345618.4, 345618.6])
    assert fix.longitude[:2] == pytest.approx(np.array([14.5123456, 14.512345605]) * DEG, abs=1e-13)
    assert fix.height[:2] == pytest.approx([300.123, 300.1234])
    assert fix.velocity_ned[0].tolist() == [1.234, -0.005, 0.007]
    assert fix.covariance[1, 0].tolist() == [0.25, 0.125, 0.0]
    assert fix.heading[1] == pytest.approx(12.5 * DEG)
    assert [fix.quality_words[int(q)] for q in fix.quality] == ["3D", "fixed", "3D"]


def test_novatel_published_example(tmp_path: Path) -> None:
    """The manual's RAWIMUSX of a unit at rest: specific force of 1 g, the week 2209."""
    assert samples.novatel_crc(samples.NOVATEL_PUBLISHED[1:-9].encode()) == 0x038422A7
    streams = read_file(made("novatel", tmp_path))
    imu = streams.inertial["imu"]
    assert np.linalg.norm(imu.accel[0]) * 125.0 == pytest.approx(9.80665, rel=0.006)
    assert imu.accel[0, 1] > 0.0  # the log has −y
    assert imu.time[0] == 491674.013699
    assert streams.clock.origin_gps_s == 2209 * 604800
    fix, s = streams.fixes["gnss"], streams.solutions["solution"]
    assert fix.height[0] == pytest.approx(1064.533 - 16.9, abs=1e-5)
    assert fix.velocity_ned[0] == pytest.approx([0.0, 5.0, -0.25], abs=1e-12)
    assert angles(s) == pytest.approx([10.0, 20.0, 30.0], abs=1e-10)
    assert s.velocity_ned[0].tolist() == [1.0, 2.0, -3.0]


def test_ulog(tmp_path: Path) -> None:
    streams = read_file(made("ulog", tmp_path))
    imu = streams.inertial["imu"]
    assert imu.kind == "increments"
    assert imu.interval[0] == pytest.approx([0.004, 0.0041])
    assert imu.accel[0] == pytest.approx([0.01, 0.02, -0.04], rel=1e-6)
    fix, s = streams.fixes["gnss"], streams.solutions["solution"]
    assert fix.height.tolist() == [350.0, 350.0]
    # the receiver's UTC gives 2 s after the start of the autopilot the date of the new year
    assert streams.clock.origin_gps_s + imu.time[0] == pytest.approx(NEW_YEAR, abs=1e-6)
    # 100 m north on PX4's sphere of 6371 km
    assert (s.latitude[0] - 50.0 * DEG) * 6371000.0 == pytest.approx(100.0, abs=0.02)
    assert s.height[0] == 305.0


@pytest.mark.parametrize("version", [1, 2])
def test_bags(tmp_path: Path, version: int) -> None:
    pytest.importorskip("rosbags")
    path = samples.bag(tmp_path / ("x.bag" if version == 1 else "bag2"), version)
    assert detect(path) == "ros"
    streams = read_file(path)
    imu, fix = streams.inertial["imu"], streams.fixes["gnss"]
    assert streams.clock.origin_gps_s == NEW_YEAR
    assert imu.time.tolist() == [5e-6, 1.000005]
    assert imu.accel[0].tolist() == [0.0, 0.0, 9.81]
    assert imu.axes == ("forward", "left", "up")
    assert fix.position_sigma[0].tolist() == [3.0, 2.0, 4.0]  # the message has east, north, up


def test_euroc_keeps_nanoseconds(tmp_path: Path) -> None:
    streams = read_file(made("euroc", tmp_path))
    imu = streams.inertial["imu"]
    assert imu.time[0] == pytest.approx(0.758555392, abs=1e-15)
    assert imu.time[1] - imu.time[0] == pytest.approx(0.005000192, abs=1e-15)
    assert imu.gyro[0, 1] == 0.14730578886832138
    assert streams.clock.origin_gps_s == gps_from_date(datetime(2014, 6, 24, 19, 2, 59, tzinfo=UTC))


def test_tum(tmp_path: Path) -> None:
    s = read_file(made("tum", tmp_path)).solutions["solution"]
    assert s.time.tolist() == pytest.approx([0.6659, 0.6758], abs=1e-15)
    assert s.local_enu[0].tolist() == [1.3563, 0.6305, 1.638]
    assert np.isnan(s.latitude).all()
    headings = np.degrees(rotation.euler_from_quaternion(s.q_nb)[2])
    assert headings == pytest.approx([90.0, 0.0], abs=1e-9)  # x east; then turned to north


def test_kitti(tmp_path: Path) -> None:
    path = samples.kitti(tmp_path / "drive" / "oxts").parent
    assert detect(path) == "kitti-oxts"
    streams = read_file(path)
    s, imu = streams.solutions["solution"], streams.inertial["imu"]
    assert angles(s) == pytest.approx([np.degrees(0.035), -np.degrees(0.001), 90.0 - np.degrees(1.5)], abs=1e-9)
    assert s.velocity_ned[0].tolist() == [-2.5, 13.0, -0.1]
    assert imu.accel[0].tolist() == [0.5, -0.1, 9.9]
    assert np.diff(s.time)[0] == pytest.approx(0.100016878, abs=1e-12)
    (path / "oxts" / "data" / "0000000001.txt").write_text("1 2 3")
    with pytest.raises(InputError, match=r"0000000001\.txt, line 1: it has 3 numbers; 30"):
        read_file(path)


def test_columns(tmp_path: Path) -> None:
    streams = read_file(made("columns", tmp_path))
    s = streams.solutions["solution"]
    assert streams.clock.origin_gps_s == NEW_YEAR
    assert s.time[:3].tolist() == [0.0, 0.5, 1.0]
    assert angles(s) == pytest.approx([10.0, 20.0, 30.0])
    assert "temperature_c" in streams.notes[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "time_s,latitude_deg,longitude_deg,height_m\n1,50,14,x\n",
            "line 2\\): the column 'height_m' holds 'x', not a number\\.$",
        ),
        (
            "time_s,latitude_deg,longitude_deg,height_m,roll_deg\n1,50,14,2,3\n",
            "has roll_deg but not pitch_deg and heading_deg: give all",
        ),
        ("time_s,latitude_deg,longitude_deg,height_m,time_s\n1,50,14,2,3\n", "appears twice"),
        ("time_s,latitude_deg,longitude_deg,height_m\n,50,14,2\n", "row 1: the column time_s is missing"),
        ("time_s,latitude_deg,longitude_deg,height_m,q_nb_w,q_nb_x,q_nb_y,q_nb_z\n1,5,1,2,3,0,0,0\n", "norm 3"),
    ],
)
def test_bad_columns(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_file(path)


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_missing_library_is_named(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made(name, tmp_path)
    if name == "novatel":  # its text is read without the library
        path.write_bytes(b"\xaa\x44\x12\x1c" + bytes(60))
    for module in [m for m in sys.modules if m.split(".")[0] == LIBRARIES[name]]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, LIBRARIES[name], None)
    assert detect(path) == name, "a file is recognised without the library"
    with pytest.raises(InputError, match=r"pip install 'sinssim\[logs\]'"):
        read_file(path)


def test_ambiguous_files_ask_for_the_format(tmp_path: Path) -> None:
    """Seven small numbers with positive last columns may be increments, and fixes near the Gulf of Guinea."""
    path = tmp_path / "x.txt"
    path.write_text("".join(f"{0.5 * k} 0.1 0.1 0.1 3.0 2.0 3.0\n" for k in range(1, 5)))
    with pytest.raises(InputError, match=r"kf-gins-imu or kf-gins-gnss.*--format"):
        read_file(path)
    assert isinstance(read_file(path, "kf-gins-gnss").fixes["gnss"], FixStream)


def test_unknown_and_empty_files(tmp_path: Path) -> None:
    for contents, said in (
        (b"", "is empty"),
        (b" \n \n", "is empty but for blanks"),
        (b"hello\n", "none of the known"),
    ):
        path = tmp_path / "x"
        path.write_bytes(contents)
        with pytest.raises(InputError, match=said):
            read_file(path)
    with pytest.raises(InputError, match="does not exist"):
        read_file(tmp_path / "nothing")
    with pytest.raises(InputError, match="none of the known"):
        read_file(tmp_path)
    with pytest.raises(InputError, match="unknown format 'rinex'"):
        read_file(path, "rinex")


@pytest.mark.parametrize("name", [name for name in FILES if name not in ("nmea", "ubx", "novatel")])
def test_cut_files_are_refused_or_read_to_the_cut(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    with contextlib.suppress(InputError):
        assert isinstance(read_file(path, name), Streams)
