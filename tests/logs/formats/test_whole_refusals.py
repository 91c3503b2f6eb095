"""Files with one mistake: the whole message, with the row or line counted by hand."""

from __future__ import annotations

import re
from math import nan, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs import numeric_columns as number_table
from sinssim.logs.formats import novatel, read_file, ros_mcap, vbox_flysight_android
from sinssim.logs.formats import novatel as novatel_ascii
from sinssim.logs.formats.euroc_tum_kitti import split_first, unit
from sinssim.logs.numeric_columns import read_numbers
from tests.logs.formats.whole import whole

NAV = "2200 {} 30.5 114.25 20.75 1.5 -2.5 3.5 10.5 -20.25 130.75\n"
IE = "Week GPSTime Latitude Longitude H-Ell\n(weeks) (sec) (deg) (deg) (m)\n"
VBO = "File created on 05/06/2023\n[column names]\ntime lat long velocity\n[data]\n"
FLY = "$FLYS,1\n$COL,IMU,time,wx,wy,wz,ax,ay,az\n$COL,TIME,time,tow,week\n"
CSV = "time_s,latitude_deg,longitude_deg,height_m\n"


@pytest.mark.parametrize(
    ("name", "text", "form", "said"),
    [
        ("a.nav", NAV.format(100.5) + NAV.format(101.5) + NAV.format(102.5).replace("2200", "2200.5"),
         "kf-gins-solution", ", row 3: 2200.5 is not a GPS week; that column has the week, or 0."),
        ("a.nav", NAV.format(100.5) + "-3" + NAV.format(101.5)[4:] + "7.5" + NAV.format(102.5)[4:],
         "kf-gins-solution", ", row 2: -3 is not a GPS week; that column has the week, or 0."),
        ("a.txt", "remark\n" + IE + 2 * "2200 1.5 30 40 50 60\n", "inertial-explorer",
         ", line 4: it has 6 fields; 5 separated by blanks are needed, as the names say."),
        ("a.txt", "remark\n" + IE + "2200 1.5 30 40 50\n2200 2.5 x 40 50\n2200 3.5 30 40 50\n", "inertial-explorer",
         ", line 5: 'x' is not a number."),
        ("a.txt", IE + "2200 1.5 30 40\n", "inertial-explorer",
         " has 1 rows below its names; at least two are needed."),
        ("a.txt", IE + "2200 1.5\n2200 2.5\n", "inertial-explorer",
         ", line 3: it has 2 fields; 5 separated by blanks are needed, as the names say."),
        ("a.txt", IE.replace("GPSTime", "UTCTime") + "2200 1.5 30 40 50\n2200 2.5 30 40 50\n", "inertial-explorer",
         " has no column GPSTime: export it, with Week."),
        ("a.txt", IE + "inf 1.5 30 40 50\n2200 2.5 30 40 50\n", "inertial-explorer",
         ", row 1: inf is not a GPS week; that column has the week, or 0."),
        ("a.csv", FLY + "$DATA\n$IMU,1.5,1,2,3,4,5,6\n$IMU,1e999,1,2,3,4,5,6\n", "flysight",
         ", row 2: the time of an $IMU row is missing or not finite."),
        ("a.csv", FLY + "$DATA\n$IMU,1.5,1,2,3,4,5,6\n$TIME,1,nan,2200\n$IMU,2.5,1,2,3,4,5,6\n", "flysight",
         ", row 1: the time of a $TIME row is missing or not finite."),
        ("a.vbo", VBO + "120000.5 0 0 7\n120001.5 0 0 8\n", "vbox", " has no position."),
        ("a.vbo", VBO + "120000.5 30 40 7\n120001.5 30 x 8\n120002.5 30 40 9\n", "vbox",
         ", line 6: 'x' is not a number."),
        ("a.vbo", VBO + "120000.5 30 40 7\n120001.5 30 40 8 9\n120002.5 30 40 9\n", "vbox",
         ", line 6: it has 5 fields; 4 separated by blanks are needed."),
        ("a.vbo", VBO.replace("long", "east") + "120000.5 30 40 7\n", "vbox",
         " has no [column names] with time, lat and long, or no [data]."),
        ("a.csv", "# nothing\n\n", "track-csv", " is empty."),
        ("a.csv", "time_s,latitude_deg,time_s\n1,2,3\n", "track-csv",
         ": the column 'time_s' appears twice."),
        ("a.csv", CSV + "1,2,3,4\n2,3\n3,4,5,6\n", "track-csv",
         ", line 3: it has 2 fields; 4 separated by ',' are needed, as in line 1 (skip_lines = 0)."),
    ],
)  # fmt: skip
def test_mistakes_by_row_and_line(tmp_path: Path, name: str, text: str, form: str, said: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=f"^{re.escape(str(path) + said)}$"):
        read_file(path, form)


def test_a_quaternion_that_is_none() -> None:
    q = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.6, 0.8, 0.005], [0.5, 0.5, 0.5, 0.6], [2.0, 0.0, 0.0, 0.0]])
    size = sqrt(0.75 + 0.36)
    with pytest.raises(InputError, match=rf"^x, row 3: the quaternion has the norm {size:.4g}, not 1\.$"):
        unit(Path("x"), q)
    np.testing.assert_allclose(unit(Path("x"), q[:2])[1], np.array([0.0, 0.6, 0.8, 0.005]) / sqrt(1.000025))

    def message(w: float) -> Any:
        place = SimpleNamespace(x=1.0, y=2.0, z=3.0)
        turn = SimpleNamespace(w=w, x=0.0, y=0.0, z=0.0)
        return SimpleNamespace(pose=SimpleNamespace(pose=SimpleNamespace(position=place, orientation=turn)),
                               twist=SimpleNamespace(twist=SimpleNamespace(linear=place)))  # fmt: skip

    with pytest.raises(ValueError, match=r"^a quaternion of the odometry has the norm 0\.7, not 1$"):
        ros_mcap._read_odometry([message(1.005), message(0.98), message(0.7), message(1.2)], np.arange(4.0))


def test_stamps(tmp_path: Path) -> None:
    """Seconds, nanoseconds of 16 digits, powers of ten; a minus before a decimal number counts for its decimals."""
    path = tmp_path / "stamps.txt"
    path.write_text("names\n# remark\n1403636579763555584,x\n12.5,y\n-3.25,z\n1.5e3,a\n7,b\n.125,c\n")
    assert split_first(path, ",", 1).tolist() == [
        1403636579763555584, 12_500_000_000, -3_250_000_000, 1_500_000_000_000, 7_000_000_000, 125_000_000,
    ]  # fmt: skip
    path.write_text("names\n12.5,y\n1.2.3,z\n14.5,z\n")
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}, line 3: '1\.2\.3' is not a stamp\.$"):
        split_first(path, ",", 1)
    path.write_text("12.5\n99999999999999999999\n14.5\n")
    with pytest.raises(InputError, match=r", line 2: the stamp 99999999999999999999 is out of range\.$"):
        split_first(path, None, 0)


def test_a_line_that_never_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of blocks of ten bytes, seventeen without an end of a line are 170 bytes."""
    path = tmp_path / "x.txt"
    path.write_text("1 " * 200)
    monkeypatch.setattr(number_table, "_BLOCK", 10)
    with pytest.raises(InputError, match=r"x\.txt: a line has over 170 bytes; this is not text in columns\.$"):
        read_numbers(path, (3,), [])
    monkeypatch.setattr(number_table, "machine_memory", lambda: 5 * 400 - 1)
    with pytest.raises(InputError, match=r"x\.txt does not fit into this machine's memory\. Split it into parts\.$"):
        read_numbers(path, (3,), [])
    monkeypatch.setattr(number_table, "machine_memory", lambda: 5 * 400)
    with pytest.raises(InputError, match="a line has over 170 bytes"):
        read_numbers(path, (3,), [])


def test_kitti_by_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "timestamps.txt").write_text("2011-09-26 13:02:25.5\n2011-09-26 13:02:26.5\n")
    for number, words in enumerate((["1"] * 30, ["1"] * 29 + ["nan"])):
        (tmp_path / "data" / f"000000000{number}.txt").write_text(" ".join(words))
    with pytest.raises(InputError, match=r"0000000001\.txt, line 1: a number is not finite\.$"):
        read_file(tmp_path, "kitti-oxts")
    (tmp_path / "data" / "0000000001.txt").write_text(" ".join(["1"] * 30))
    (tmp_path / "timestamps.txt").write_text("2011-09-26 13:02:25.5\n26.9.2011 13:02:26.5\n")
    said = r"timestamps\.txt, line 2: '26\.9\.2011 13:02:26\.5' is not a date like 2011-09-26 13:02:25\.964\.$"
    with pytest.raises(InputError, match=said):
        read_file(tmp_path, "kitti-oxts")


@pytest.mark.parametrize("first", ["File created yesterday", "File created on 31/02/2023"])
def test_times_of_day_without_a_date(tmp_path: Path, first: str) -> None:
    """13:02:03.5 and a second later; a minute of arc is a sixtieth of a degree, west is positive."""
    path = tmp_path / "a.vbo"
    path.write_text(f"{first}\n[column names]\ntime lat long height\n[data]\n130203.50 3000.0 -600.0 12.5\n"
                    "130204.50 3001.5 -601.5 13.5\n130205.50 0 0 13.5\n")  # fmt: skip
    found = read_file(path, "vbox")
    assert (found.clock.kind, found.clock.origin_gps_s, found.clock.note) == (
        "utc", None, "time of day in UTC, without a date",
    )  # fmt: skip
    whole(found.fixes["gnss"], time=[46923.5, 46924.5], latitude_deg=[50.0, 50.025], longitude_deg=[10.0, 10.025],
          height=[12.5, 13.5], datum=found.fixes["gnss"].datum)  # fmt: skip
    day, second = vbox_flysight_android._vbox_clock(np.array([130203.5, 130204.5]), "on 5.6.2023")
    # the GPS week 2265 began on Sunday, 4 June 2023; 18 leap seconds
    assert day.origin_gps_s == 2265 * 604800 + 86400 + 18
    np.testing.assert_allclose(second, [46923.5, 46924.5])


def raw(kind: int) -> Any:
    return SimpleNamespace(imu_type=kind, gyro_x=1, gyro_y=2, gyro_z=3, accel_x=4, accel_y=5, accel_z=6, gps_week=2201,
                           gps_seconds=7.5)  # fmt: skip


def test_novatel_units_that_are_not_known() -> None:
    notes: list[str] = []
    assert novatel._inertial([(None, raw(999))], 2200, notes) == {}
    assert notes == ["RAWIMUSX was left out: the scale factors of IMU type 999 are not known here."]
    assert novatel._inertial([], 2200, notes) == novatel._fixes([], [], 2200) == novatel._solutions([], 2200) == {}
    kind, (name, turn, force) = next(iter(novatel.SCALES.items()))
    imu = novatel._inertial([(None, raw(kind))], 2200, notes)["imu"]
    whole(imu, time=[604807.5], gyro=[[turn, -2.0 * turn, 3.0 * turn]],
          accel=[[4.0 * force, -5.0 * force, 6.0 * force]], kind="increments", axes=imu.axes)  # fmt: skip
    assert notes[1] == f"IMU type {kind}, {name}: counts of {turn:.6g} rad and {force:.6g} m/s, in the axes of the IMU."


def test_novatel_scale_by_gravity(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 4 ms and 3, 4, 12 counts of 7 mm/s, the specific force is 13 · 0.007/0.004 = 22.75 m/s²."""
    time, counts = np.array([10.0, 10.004, 10.008, 10.012]), np.tile([3.0, 4.0, 12.0, 9.0, 9.0, 9.0], (4, 1))
    scales = {5: ("five", 1e-6, 0.007), 9: ("nine", 2e-6, 0.1)}
    monkeypatch.setattr(novatel_ascii, "SCALES", scales)
    said = (r"^x: RAWIMU does not name the IMU, and with no known scale factors its specific force is gravity "
            r"\(nearest five: 22\.75 m/s²\)\. Log RAWIMUSX, which names the IMU\.$")  # fmt: skip
    with pytest.raises(InputError, match=said):
        novatel_ascii._scale_of(Path("x"), "RAWIMU", time, counts)
    with pytest.raises(InputError, match=r"^x: one RAWIMU is not enough\.$"):
        novatel_ascii._scale_of(Path("x"), "RAWIMU", time[:1], counts[:1])
    scales[7] = ("seven", 3e-6, 0.003)  # 9.75 m/s²
    assert novatel_ascii._scale_of(Path("x"), "RAWIMU", time, counts) == scales[7]


def test_points_of_a_kml_file(tmp_path: Path) -> None:
    path = tmp_path / "a.kml"
    path.write_text("<kml><Placemark><LineString><coordinates>1,2,3 4,5 6,x,7</coordinates></LineString></Placemark>"
                    "</kml>")  # fmt: skip
    from sinssim.logs.formats.gpx_kml_geojson import path_of_lines, read_xml

    root = read_xml(path)
    with pytest.raises(InputError, match=r"a\.kml, point 3: '6 x 7' is not longitude, latitude and height\.$"):
        path_of_lines(root, path)
    path.write_text(path.read_text().replace("6,x,7", "6,8,7"))
    np.testing.assert_array_equal(path_of_lines(read_xml(path)), [[1, 2, 3], [4, 5, nan], [6, 8, 7]])
    path.write_text("<kml><Placemark>")
    with pytest.raises(InputError, match=r"^.*a\.kml, line 1: no element found; the file is not complete XML\.$"):
        read_xml(path)
