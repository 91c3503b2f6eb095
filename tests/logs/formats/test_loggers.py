"""Readers of loggers and receivers: the same numbers in every form of a log, and damaged rows that are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sinssim import earth, rotation
from sinssim.errors import InputError
from sinssim.logs.formats import detect, read_file
from sinssim.logs.formats.novatel import is_ascii
from sinssim.logs.recorded_streams import FixStream, InertialStream
from sinssim.units import DEG
from tests.logs.formats import loggers, samples
from tests.logs.formats.loggers import ACCEL, GYRO, PLACE, TOW, VELOCITY, WEEK


def _right(fix: FixStream, row: int = 0) -> None:
    """The place of a fix is right to a centimetre, and the velocity to a millimetre per second."""
    assert fix.latitude[row] == pytest.approx(PLACE[0] * DEG, abs=1e-9)
    assert fix.longitude[row] == pytest.approx(PLACE[1] * DEG, abs=1e-9)
    assert fix.height[row] == pytest.approx(PLACE[2], abs=0.01)
    assert fix.velocity_ned is not None
    known = np.isfinite(fix.velocity_ned[row])
    np.testing.assert_allclose(fix.velocity_ned[row][known], np.array(VELOCITY)[known], atol=1e-3)


def _same(imu: InertialStream, axes: tuple[str, str, str] | None = ("forward", "right", "down")) -> None:
    np.testing.assert_allclose(imu.gyro[0], GYRO, atol=1e-7)
    np.testing.assert_allclose(imu.accel[0], ACCEL, atol=1e-6)
    np.testing.assert_allclose(np.diff(imu.time), 0.25, atol=1e-9)
    assert imu.axes == axes


@pytest.mark.parametrize("make", [loggers.ardupilot, loggers.ardupilot_log, loggers.ardupilot_dump])
def test_ardupilot(tmp_path: Path, make: Callable[[Path], Path]) -> None:
    """Two units, one receiver; a fix without a solution is left out; the times of fixes are those of the receiver."""
    path = make(tmp_path / "log")
    assert detect(path) == "ardupilot"
    found = read_file(path)
    assert list(found.inertial) == ["imu0", "imu1"]
    _same(found.inertial["imu0"])
    np.testing.assert_allclose(found.inertial["imu1"].gyro[0], np.array(GYRO) + 1.0, rtol=1e-6)
    fixes = found.fixes["gps0"]
    assert len(fixes) == 3
    _right(fixes)
    assert found.clock.origin_gps_s is not None
    np.testing.assert_allclose(
        found.clock.origin_gps_s + fixes.time, WEEK * 604800 + TOW + np.array([0.25, 0.5, 0.75]), atol=1e-6
    )
    # the fixes arrive 0.12 s late: 20.37 s after the start is 0.25 s after the full second
    np.testing.assert_allclose(fixes.time[0], 20.25, atol=0.51)


@pytest.mark.parametrize("make", [loggers.ardupilot, loggers.ardupilot_log])
def test_ardupilot_of_2014(tmp_path: Path, make: Callable[..., Path]) -> None:
    """Milliseconds; TimeMS is the time of the autopilot in IMU and that of the GPS week in GPS, which has its own T."""
    found = read_file(make(tmp_path / "log", of_2014=True))
    assert list(found.inertial) == ["imu0"]
    _same(found.inertial["imu0"])
    np.testing.assert_allclose(found.inertial["imu0"].time, 20.0 + 0.25 * np.arange(4), atol=1e-9)
    fixes = found.fixes["gps0"]
    _right(fixes)
    assert found.clock.origin_gps_s is not None
    np.testing.assert_allclose(
        found.clock.origin_gps_s + fixes.time, WEEK * 604800 + TOW + np.array([0.25, 0.5, 0.75]), atol=1e-6
    )


def test_ardupilot_says_what_it_holds_instead(tmp_path: Path) -> None:
    """Messages without a time of the autopilot are named with their columns, and a cut last line by its number."""
    path = loggers.ardupilot_log(tmp_path / "log", of_2014=True)
    path.write_text(path.read_text().replace(",VZ,T", ",VZ,X"))
    assert any("4 GPS with Status, GMS, GWk" in note for note in read_file(path).notes)
    path.write_text(path.read_text().replace("TimeMS,GyrX", "Clock,GyrX"))
    with pytest.raises(InputError, match="4 IMU with Clock, GyrX"):
        read_file(path)
    path = loggers.ardupilot_log(tmp_path / "cut", of_2014=True)
    whole = len(path.read_text().splitlines())
    path.write_text(path.read_text() + "IMU, 21000, 0.01, -0.0")
    found = read_file(path)
    assert len(found.inertial["imu0"].time) == 4
    assert any(f"line {whole + 1}" in note for note in found.notes)


def test_ardupilot_resumes_after_damage(tmp_path: Path) -> None:
    path = loggers.ardupilot(tmp_path / "log.bin")
    data = path.read_bytes()
    path.write_bytes(data[:-40] + b"\x00\x01garbage" + data[-40:])
    found = read_file(path)
    assert any("no message" in note for note in found.notes)
    path.write_bytes(data[:4] + b"\x0a" + data[5:])  # the format of formats says that it has ten bytes
    again = read_file(path)
    assert [len(imu) for imu in again.inertial.values()] == [len(imu) for imu in found.inertial.values()]
    text = loggers.ardupilot_log(tmp_path / "log.log")
    lines = text.read_text().splitlines()
    lines[4] = lines[4].replace("0.01", "0.x1")
    text.write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 5: IMU: could not convert"):
        read_file(text)


def test_novatel_binary_and_text_agree(tmp_path: Path) -> None:
    """The library of the manufacturer reads the binary form; this package reads the text."""
    oem = pytest.importorskip("novatel_edie.oem")
    path = samples.novatel(tmp_path / "x.log")
    binary = tmp_path / "x.gps"
    binary.write_bytes(b"".join(bytes(m.to_binary().message) for m in oem.FileParser(str(path))))
    assert not is_ascii(binary.read_bytes())
    one, other = read_file(path), read_file(binary)
    assert one.clock.origin_gps_s == other.clock.origin_gps_s
    for name in ("time", "gyro", "accel"):
        np.testing.assert_allclose(getattr(one.inertial["imu"], name), getattr(other.inertial["imu"], name), rtol=1e-12)
    for name in ("time", "latitude", "longitude", "height", "velocity_ned", "position_sigma", "quality"):
        a, b = getattr(one.fixes["gnss"], name), getattr(other.fixes["gnss"], name)
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6)
    assert one.fixes["gnss"].quality_words == other.fixes["gnss"].quality_words
    for name in ("time", "latitude", "height", "velocity_ned", "q_nb", "attitude_sigma"):
        a, b = getattr(one.solutions["solution"], name), getattr(other.solutions["solution"], name)
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6)


def test_novatel_rawimu_without_a_type_is_scaled_by_gravity(tmp_path: Path) -> None:
    """Counts of an HG1900 at rest, along z, −y, x, and a line whose checksum is wrong."""
    size = 2.0**-27 * 0.3048
    lines = []
    for k in range(3):
        down, right, forward = (round(x / 100.0 / size) for x in (-9.75, 0.25, 0.5))
        counts = f"{down},{-right},{forward},1,2,3"
        body = f"%RAWIMUSA,{WEEK},{TOW + 0.01 * k:.3f};{WEEK},{TOW + 0.01 * k:.6f},00000077,{counts}"
        lines.append(f"{body}*{samples.novatel_crc(body[1:].encode()):08x}")
    path = tmp_path / "x.asc"
    path.write_text("\n".join([*lines, lines[0].replace("00000077", "00000078")]) + "\n")
    found = read_file(path)
    imu = found.inertial["imu"]
    assert len(imu) == 3
    np.testing.assert_allclose(imu.accel[0] * 100.0, [0.5, 0.25, -9.75], atol=1e-6)
    np.testing.assert_allclose(imu.gyro[0], np.array([3.0, -2.0, 1.0]) * 2.0**-33, rtol=1e-12)
    assert any("first line 4" in note for note in found.notes)


@pytest.mark.parametrize("kind", ["dms", "ecef"])
def test_rtklib_positions_in_other_forms(tmp_path: Path, kind: str) -> None:
    """The same solution in degrees, in degrees, minutes and seconds, and in Earth-fixed axes."""
    rest = "1 8 {} 0.00 3.5"
    sd = "0.03 0.04 0.05 0.01 -0.02 0.03"
    degrees = f"2374 5.0 {PLACE[0]:.12f} {PLACE[1]:.12f} {PLACE[2]} {rest.format(sd)}"
    (tmp_path / "deg.pos").write_text(f"% GPST latitude(deg) longitude(deg) height(m)\n{degrees}\n")
    plain = read_file(tmp_path / "deg.pos").fixes["gnss"]
    assert plain.covariance is not None
    if kind == "dms":
        head, row = (
            "% GPST latitude(d'\") longitude(d'\") height(m)",
            "48 06 03.6 -11 30 07.2 520.25 " + rest.format(sd),
        )
    else:
        x = earth.geodetic_to_ecef(PLACE[0] * DEG, PLACE[1] * DEG, PLACE[2])
        c = rotation.dcm_from_quaternion(earth.q_en(PLACE[0] * DEG, PLACE[1] * DEG))
        p = c @ plain.covariance[0] @ c.T
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
        spread = " ".join(f"{np.sign(p[i, j]) * np.sqrt(abs(p[i, j])):.12f}" for i, j in pairs)
        head, row = "% GPST x-ecef(m) y-ecef(m) z-ecef(m)", " ".join(f"{v:.6f}" for v in x) + " " + rest.format(spread)
    (tmp_path / "other.pos").write_text(f"{head}\n2374 5.0 {row}\n")
    other = read_file(tmp_path / "other.pos").fixes["gnss"]
    np.testing.assert_allclose(other.latitude, plain.latitude, atol=1e-12)
    np.testing.assert_allclose(other.longitude, plain.longitude, atol=1e-12)
    np.testing.assert_allclose(other.height, plain.height, atol=1e-5)
    np.testing.assert_allclose(other.covariance, plain.covariance, atol=1e-9)


def test_vbox(tmp_path: Path) -> None:
    found = read_file(loggers.vbox(tmp_path / "x.vbo"))
    _right(found.fixes["gnss"])
    assert found.clock.origin_gps_s == 1751932800 - 315964800 + 18  # midnight of 2025-07-08
    assert found.fixes["gnss"].time[1] == pytest.approx(16 * 3600.0 + 0.25)


def test_flysight(tmp_path: Path) -> None:
    """The rows of GPS time date those of the sensors; the fixes are in UTC."""
    path = loggers.flysight(tmp_path / "SENSOR.CSV")
    found, track = read_file(path), read_file(tmp_path / "TRACK.CSV")
    _same(found.inertial["imu"], None)
    assert found.clock.origin_gps_s + found.inertial["imu"].time[0] == pytest.approx(WEEK * 604800 + TOW)
    fixes = track.fixes["gnss"]
    _right(fixes)
    np.testing.assert_allclose(fixes.position_sigma, [[1.5, 1.5, 2.5]] * 4)
    np.testing.assert_allclose(fixes.velocity_sigma, [[0.25, 0.25, 0.25]] * 4)
    assert track.clock.origin_gps_s == 1751990400 - 315964800 + 18
    path.write_text(path.read_text() + "$IMU,1,2\n$IMU,1,2\n")
    with pytest.raises(InputError, match="it has 3 fields; 9 separated by ',' are needed, as \\$COL says"):
        read_file(path)


def test_chc(tmp_path: Path) -> None:
    path = loggers.chc(tmp_path / "x.txt")
    found = read_file(path)
    imu, solution = found.inertial["imu"], found.solutions["solution"]
    turned = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    np.testing.assert_allclose(imu.gyro[0] @ turned, GYRO, atol=1e-9)
    np.testing.assert_allclose(imu.accel[0] @ turned, ACCEL, atol=1e-7)
    assert np.degrees([a[0] for a in rotation.euler_from_quaternion(solution.q_nb)]) == pytest.approx([10, 20, 30])
    np.testing.assert_allclose(solution.velocity_ned[0], VELOCITY)
    path.write_text(path.read_text().replace("*", "*0", 1))
    assert any("line 1" in note for note in read_file(path).notes)


def test_android(tmp_path: Path) -> None:
    """Accelerometers are interpolated to the gyros; fixes of the network are not used."""
    found = read_file(loggers.android(tmp_path / "x.txt"))
    imu = found.inertial["imu"]
    np.testing.assert_allclose(imu.accel[:, 0], 0.5 + 0.125 * (np.arange(1, 4) - 0.008), atol=1e-9)
    _right(found.fixes["gnss"])
    assert found.clock.origin_gps_s + found.fixes["gnss"].time[0] == pytest.approx(1751990400 - 315964800 + 18)


def test_the_accuracies_of_an_android_log(tmp_path: Path) -> None:
    """The vertical accuracy of a row without one is taken for twice the horizontal one."""
    path = loggers.android(tmp_path / "x.txt")
    fixes = read_file(path).fixes["gnss"]
    assert fixes.position_sigma is not None
    np.testing.assert_allclose(fixes.position_sigma[0], [2.5, 2.5, 3.5])
    assert fixes.velocity_sigma is not None
    np.testing.assert_allclose(fixes.velocity_sigma[0, :2], 0.2)
    path.write_text(path.read_text().replace(",3.5\n", ",\n"))
    fixes = read_file(path).fixes["gnss"]
    assert fixes.position_sigma is not None
    np.testing.assert_allclose(fixes.position_sigma[:, 2], 5.0)


def test_inertial_explorer_takes_the_sense_of_the_heading_from_the_motion(tmp_path: Path) -> None:
    found = read_file(loggers.inertial_explorer(tmp_path / "x.txt"))
    solution = found.solutions["solution"]
    heading = rotation.euler_from_quaternion(solution.q_nb)[2]
    assert np.degrees(heading[0]) == pytest.approx(loggers.COURSE)
    np.testing.assert_allclose(solution.velocity_ned[0], [3.0, 4.0, 0.0], atol=1e-9)
    assert solution.latitude[0] == pytest.approx(PLACE[0] * DEG, abs=1e-12)
    assert solution.longitude[0] == pytest.approx(PLACE[1] * DEG, abs=1e-12)
    assert found.clock.origin_gps_s + solution.time[0] == WEEK * 604800 + TOW


def test_gnss_ins_sim(tmp_path: Path) -> None:
    path = loggers.gnss_ins_sim(tmp_path / "demo")
    assert detect(path) == "gnss-ins-sim"
    found = read_file(path)
    _same(found.inertial["imu"])
    _right(found.fixes["gnss"])
    (path / "gyro-0.csv").write_text("gyro_x (furlong),gyro_y (deg/s),gyro_z (deg/s)\n1,2,3\n")
    with pytest.raises(InputError, match=r"gyro-0\.csv, line 1: 3 names with units"):
        read_file(path)


@pytest.mark.parametrize(
    ("make", "old", "new", "said"),
    [
        (loggers.vbox, "012 160000.50", "012 x", "line 14: 'x' is not a number"),
        (
            loggers.android,
            "UncalGyro,1751990400250,9000250000000,0.01",
            "UncalGyro,1751990400250,9000250000000,a",
            "line 12",
        ),
        (loggers.inertial_explorer, "230401.00", "what", "line 7: 'what' is not a number"),
        (loggers.ardupilot_dump, "GyrY : -0.02", "GyrY : -0.02, GyrY : 1", "line 3: IMU has 8 fields"),
    ],
)
def test_wrong_rows_are_named(tmp_path: Path, make: Callable[[Path], Path], old: str, new: str, said: str) -> None:
    path = make(tmp_path / "x.txt")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=said):
        read_file(path)
