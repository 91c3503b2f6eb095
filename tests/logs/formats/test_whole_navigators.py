"""Every column of the files of navigation programs, written by hand with all numbers different."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.logs.formats import read_file
from tests.logs.formats.whole import only, whole

NAN = float("nan")
DEGREE = np.pi / 180.0
FRD = "forward", "right", "down"


def test_kf_gins_imu(tmp_path: Path) -> None:
    """An odometer in an eighth column; over the end of a week."""
    path = tmp_path / "imu.txt"
    rows = (
        "604799.5 1e-6 -2e-6 3e-6 0.5 -0.25 -4.5 7\n0.0 4e-6 5e-6 -6e-6 0.75 0.125 -4.75 8\n0.5 7e-6 8e-6 "
        "9e-6 1 2 -4 9\n"
    )
    path.write_text(rows)
    note = "seconds of the GPS week; the file does not give the week"
    imu = only(read_file(path, "kf-gins-imu"), None, "gps", note)["imu"]
    whole(
        imu,
        time=[604799.5, 604800.0, 604800.5],
        gyro=[[1e-6, -2e-6, 3e-6], [4e-6, 5e-6, -6e-6], [7e-6, 8e-6, 9e-6]],
        accel=[[0.5, -0.25, -4.5], [0.75, 0.125, -4.75], [1.0, 2.0, -4.0]],
        kind="increments",
        axes=FRD,
    )


@pytest.mark.parametrize("wide", [False, True])
def test_kf_gins_gnss(tmp_path: Path, wide: bool) -> None:
    path = tmp_path / "gnss.txt"
    moving = ("1.5 -2.5 3.5 ", " 0.125 0.375 0.625"), ("4.5 5.5 -6.5 ", " 0.25 0.875 0.75")
    rows = [
        f"{time} {place} {before if wide else ''}{sigma}{after if wide else ''}"
        for (time, place, sigma), (before, after) in zip(
            (("604799.5", "30.5 114.25 20.75", "0.5 0.25 0.75"), ("0.5", "30.25 114.5 21.5", "1.5 1.25 1.75")),
            moving,
            strict=True,
        )
    ]
    path.write_text("\n".join(rows) + "\n")
    note = "seconds of the GPS week; the file does not give the week"
    fixes = only(read_file(path, "kf-gins-gnss"), None, "gps", note)["gnss"]
    velocity = {
        "velocity_ned": [[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]],
        "velocity_sigma": [[0.125, 0.375, 0.625], [0.25, 0.875, 0.75]],
    }
    whole(
        fixes,
        time=[604799.5, 604800.5],
        latitude_deg=[30.5, 30.25],
        longitude_deg=[114.25, 114.5],
        height=[20.75, 21.5],
        datum="ellipsoid",
        position_sigma=[[0.5, 0.25, 0.75], [1.5, 1.25, 1.75]],
        **(velocity if wide else {}),
    )


def test_kf_gins_solution(tmp_path: Path) -> None:
    """With weeks, and the standard deviations beside it: the ninth state is the angle about down."""
    path = tmp_path / "truth.nav"
    path.write_text(
        "2200 604799.5 30.5 114.25 20.75 1.5 -2.5 3.5 10.5 -20.25 130.75\n"
        "2201 0.5 30.25 114.5 21.5 4.5 5.5 -6.5 -5.5 15.75 244.5\n"
    )
    (tmp_path / "KF_GINS_STD.txt").write_text(
        "604799.5 "
        + " ".join(str(0.25 + k) for k in range(21))
        + "\n0.5 "
        + " ".join(str(30.25 + k) for k in range(21))
        + "\n"
    )
    said = "The σ are those of KF_GINS_STD.txt in the same folder."
    solution = only(read_file(path), 2200 * 604800, "gps", "seconds of the GPS week 2200", notes=[said])["solution"]
    whole(
        solution,
        time=[604799.5, 604800.5],
        latitude_deg=[30.5, 30.25],
        longitude_deg=[114.25, 114.5],
        height=[20.75, 21.5],
        datum="ellipsoid",
        velocity_ned=[[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]],
        attitude_deg=[[10.5, -20.25, 130.75], [-5.5, 15.75, 244.5]],
        position_sigma=[[0.25, 1.25, 2.25], [30.25, 31.25, 32.25]],
        velocity_sigma=[[3.25, 4.25, 5.25], [33.25, 34.25, 35.25]],
        attitude_sigma_deg=[[NAN, NAN, 8.25], [NAN, NAN, 38.25]],
    )
    (tmp_path / "KF_GINS_STD.txt").write_text("1.5 " + " ".join("1" * 21) + "\n2.5 " + " ".join("1" * 21) + "\n")
    found = read_file(path)
    assert found.solutions["solution"].position_sigma is None
    assert found.notes == (
        "KF_GINS_STD.txt in the same folder is not used: it has other times and belongs to another solution.",
    )


def test_psins_imu(tmp_path: Path) -> None:
    """Scale factors of their own for every axis; 4 ms, and the deviation of each time in µs adds up."""
    path = tmp_path / "x.imu"
    path.write_text(
        "% PSINS-format SIMU log file.\n1.5 -0.5 -30.25 1 2 3 4\n34.5 108.25 380.5 100.5 4.0 9.75 0\n"
        "0.5 0.25 0.125 80 40 20 0\n8 -12 20 100 -150 250 30\n-7 11 19 -90 140 240 -50\n6 10 -18 80 130 -230 70\n"
    )
    said = (
        "The header gives the start: latitude 34.500000°, longitude 108.250000°, height 380.5 m, pitch 1.5°, "
        "roll -0.5°, "
        "yaw -30.25° (counter-clockwise from north); it may be inaccurate."
    )
    imu = only(read_file(path), None, "machine", "seconds from 100.5 s, the time of the header", notes=[said])["imu"]
    counts = np.array([[8, -12, 20, 100, -150, 250], [-7, 11, 19, -90, 140, 240], [6, 10, -18, 80, 130, -230]])
    second = DEGREE / 3600.0
    whole(
        imu,
        time=[100.50403, 100.50798, 100.51205],
        gyro=counts[:, :3] * np.array([0.5, 0.25, 0.125]) * second,
        accel=counts[:, 3:] * np.array([780e-6, 390e-6, 195e-6]),
        kind="increments",
        axes=("right", "forward", "up"),
    )


@pytest.mark.parametrize("tag", ["", "77 "])
@pytest.mark.parametrize("parts", [1, 2, 3])
def test_psins_avp(tmp_path: Path, parts: int, tag: str) -> None:
    """Pitch before roll, east before north; fewer columns leave out the attitude, and then the velocity."""
    path = tmp_path / "x.avp"
    first = ["-20.25 10.5 -130.75", "1.5 -2.5 3.5", "-33.5 151.25 81.75"][3 - parts :]
    other = ["15.75 -5.5 115.5", "4.5 5.5 -6.5", "-33.25 151.5 82.5"][3 - parts :]
    path.write_text(f"% PSINS-format AVP/GPS log file.\n{' '.join(first)} {tag}0.25\n{' '.join(other)} {tag}0.75\n")
    solution = only(read_file(path), None, "machine", "seconds of the program's own clock")["solution"]
    given: dict[str, object] = {"velocity_ned": [[-2.5, 1.5, -3.5], [5.5, 4.5, 6.5]]} if parts > 1 else {}
    given |= {"attitude_deg": [[10.5, -20.25, 130.75], [-5.5, 15.75, 244.5]]} if parts > 2 else {}
    whole(
        solution,
        time=[0.25, 0.75],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="ellipsoid",
        **given,
    )


@pytest.mark.parametrize(("sign", "up"), [(-1.0, True), (1.0, False), (-1.0, False), (1.0, True)])
def test_sbet(tmp_path: Path, sign: float, up: bool) -> None:
    """A climb along the equator in each choice of axes; its rate of longitude is v/(a + h) exactly."""
    count, wander = 9, np.radians(20.0)
    time = 604798.0 + 0.5 * np.arange(count)
    height = 100.0 + 2.0 * (time - 604798.0)
    rows = np.zeros((count, 17))
    rows[:, 0] = time % 604800.0
    rows[:, 2] = 1.0 - 30.0 / 2.0 * np.log((6378137.0 + height) / 6378237.0)  # ∫ 30 / (a + h) dt with dh = 2 dt, west
    rows[:, 3] = height
    north_east = np.array([0.0, -30.0])
    c, s = np.cos(sign * wander), np.sin(sign * wander)
    rows[:, 4:6] = np.array([[c, s], [-s, c]]) @ north_east  # from north, east to axes turned by the wander angle
    rows[:, 6] = 2.0 if up else -2.0
    rows[:, 7:11] = 0.125, -0.25, 2.0, wander
    rows[:, 11:] = 9.0
    path = tmp_path / "sbet.out"
    rows.astype("<f8").tofile(path)
    said = (
        f"Axes of the velocity, found from the positions: heading = platform heading {'−' if sign < 0 else '+'} wander "
    )
    said += f"angle; z {'up' if up else 'down'}."
    note = "seconds of the GPS week; the file does not give the week"
    solution = only(read_file(path, "sbet"), None, "gps", note, notes=[said])["solution"]
    angles = [np.degrees(0.125), np.degrees(-0.25), np.degrees(2.0) + sign * 20.0]
    whole(
        solution,
        digits=1e-11,
        time=time,
        latitude=np.zeros(count),
        longitude=rows[:, 2],
        height=height,
        datum="ellipsoid",
        velocity_ned=[[0.0, -30.0, -2.0]] * count,
        attitude_deg=[angles] * count,
    )


IE = """Project:     Test
Program:     Inertial Explorer Version 8.90

   Week   GPSTime         Latitude        Longitude {height} SDNorth SDEast SDHeight{more}
 (weeks)     (sec)       (+/-D M S)       (+/-D M S)   (m)     (m)    (m)      (m){units}
 2374 604799.50  -33 30 45.0  -151 15 22.5  81.75 0.5 0.25 0.75{one}
 2375 0.50  -33 15 36.0  -0 45 18.0  82.50 1.5 1.25 1.75{two}
"""


@pytest.mark.parametrize("height", ["H-Ell", "H-MSL"])
def test_inertial_explorer(tmp_path: Path, height: str) -> None:
    """Degrees, minutes and seconds west of Greenwich; Azimuth along the course; fixes without an attitude."""
    path = tmp_path / "ie.txt"
    place = {
        "time": [604799.5, 604800.5],
        "latitude_deg": [-33.5125, -33.26],
        "longitude_deg": [-151.25625, -0.755],
        "height": [81.75, 82.5],
        "datum": "ellipsoid" if height == "H-Ell" else "mean sea level",
        "position_sigma": [[0.5, 0.25, 0.75], [1.5, 1.25, 1.75]],
    }
    path.write_text(IE.format(height=height, more="", units="", one="", two=""))
    whole(only(read_file(path), 2374 * 604800, "gps", "seconds of the GPS week 2374")["gnss"], **place)
    path.write_text(
        IE.format(
            height=height,
            more=" VEast VNorth VUp Roll Pitch Azimuth Q",
            units=" (m/s) (m/s) (m/s) (deg) (deg) (deg)  ",
            one=" 7.5 -2.5 3.5 10.5 -20.25 110.75 1",
            two=" -5.5 4.5 -6.5 -5.5 15.75 300.5 2",
        )
    )
    whole(
        only(read_file(path), 2374 * 604800, "gps", "seconds of the GPS week 2374")["solution"],
        velocity_ned=[[-2.5, 7.5, -3.5], [4.5, -5.5, 6.5]],
        attitude_deg=[[10.5, -20.25, 110.75], [-5.5, 15.75, 300.5]],
        **place,
    )


def test_inertial_explorer_with_the_velocity_of_the_body(tmp_path: Path) -> None:
    """A heading counter-clockwise; right, forward, up of a vehicle that climbs; one σ for north and east."""
    path = tmp_path / "ie.txt"
    path.write_text(
        "   Week   GPSTime   Latitude   Longitude  H-Ell SDHoriz SDHeight VelBdyX VelBdyY VelBdyZ Roll Pitch Heading\n"
        " (weeks)     (sec)     (deg)       (deg)    (m)     (m)      (m)   (m/s)   (m/s)   (m/s) (deg) (deg)  (deg)\n"
        " 2374 100.0 48.0 11.0 520.25 0.5 0.75 1.5 12.0 -0.5 4.5 10.5 -60.0\n"
        " 2374 101.0 48.0001 11.00026 521.25 0.5 0.75 1.5 12.0 -0.5 4.5 10.5 -60.0\n"
        " 2374 102.0 48.0002 11.00052 522.25 1.5 1.75 1.5 12.0 -0.5 4.5 10.5 -60.0\n"
    )
    said = "Heading is counted counter-clockwise, as the direction of motion shows."
    solution = only(read_file(path), 2374 * 604800, "gps", "seconds of the GPS week 2374", notes=[said])["solution"]
    velocity = Rotation.from_euler("ZYX", [60.0, 10.5, 4.5], degrees=True).apply([12.0, 1.5, 0.5])
    whole(
        solution,
        time=[100.0, 101.0, 102.0],
        latitude_deg=[48.0, 48.0001, 48.0002],
        longitude_deg=[11.0, 11.00026, 11.00052],
        height=[520.25, 521.25, 522.25],
        datum="ellipsoid",
        velocity_ned=[velocity] * 3,
        attitude_deg=[[4.5, 10.5, 60.0]] * 3,
        position_sigma=[[0.5, 0.5, 0.75], [0.5, 0.5, 0.75], [1.5, 1.5, 1.75]],
    )
