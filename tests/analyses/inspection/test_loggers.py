"""What loggers write around their numbers: several units, kinds of rows, rows of other sensors, headings, no names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.file_layouts import Guessed, guess_files
from sinssim.analyses.inspection.text_columns import read_table
from sinssim.logs.log_files import fix_stream, inertial_stream
from sinssim.logs.log_settings import LogGnss, LogImu
from sinssim.logs.recorded_streams import FixStream, InertialStream

_RATE, _COUNT = 50.0, 2000
_G = 9.80665


def _unit() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, rates and specific forces of a unit that turns and stands by turns, with its noise."""
    rng = np.random.default_rng(11)
    time = 10.0 + np.arange(_COUNT) / _RATE
    on = np.sin(0.2 * time) > 0.0
    rate = (
        np.stack([0.2 * np.sin(1.3 * time), 0.1 * np.cos(0.9 * time), 0.5 * np.sin(0.7 * time)], axis=1) * on[:, None]
    )
    force = np.stack([1.5 * np.sin(0.5 * time), 0.8 * np.cos(0.4 * time), np.full(_COUNT, -_G)], axis=1)
    return time, rate + rng.normal(0.0, 1e-3, rate.shape), force + rng.normal(0.0, 0.02, force.shape)


def _place() -> tuple[np.ndarray, np.ndarray]:
    """Return times and latitude, longitude [°], height of fixes at 5 Hz."""
    time = 10.0 + 0.2 * np.arange(_COUNT // 10)
    way = 30.0 * np.sin(0.05 * time)
    return time, np.stack([48.1 + 9e-6 * way, 11.5 + 1.3e-5 * time, 520.0 + 0.1 * np.sin(time)], axis=1)


def _rows(path: Path, rows: list[list[object]], head: list[str], delimiter: str = ",", encoding: str = "utf-8") -> Path:
    lines = [delimiter.join(f"{x:.9g}" if isinstance(x, float) else str(x) for x in row) for row in rows]
    path.write_bytes(("\n".join(head + lines) + "\n").encode(encoding))
    return path


def _read(*paths: Path) -> tuple[Guessed, InertialStream | None, FixStream | None]:
    """Return the guess, and what a run reads by its description."""
    found = guess_files([read_table(path) for path in paths])
    imu = fixes = None
    if found.unit is not None:
        keys = found.unit[1].description(found.unit[0], paths[0].parent)
        for name in ("gyro", "accel"):
            if "file" in keys[name]:
                keys[name]["file"] = str(paths[0].parent / keys[name]["file"])
        imu = inertial_stream(LogImu.model_validate({"file": str(found.unit[0].path), **keys}))[0]
    for table, layout in found.fixes:
        fixes = fix_stream(LogGnss.model_validate({"file": str(table.path), **layout.description(table)}))[0]
    return found, imu, fixes


def _same(imu: InertialStream | None, rows: slice = slice(None), atol: float = 1e-6) -> None:
    _, rate, force = _unit()
    assert imu is not None
    np.testing.assert_allclose(imu.gyro, rate[rows], atol=atol)
    np.testing.assert_allclose(imu.accel, force[rows], atol=atol)


def test_the_first_of_several_units_is_read(tmp_path: Path) -> None:
    """A column I numbers the units, whose rows alternate; so it does for the receivers."""
    time, rate, force = _unit()
    rows: list[list[object]] = []
    for t, w, f in zip(time, rate, force, strict=True):
        rows += [[round(1e6 * t), unit, *(w + unit), *(f + 0.1 * unit), 45] for unit in (0, 1, 2)]
    imu = _rows(tmp_path / "IMU.csv", rows, ["TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"])
    at, place = _place()
    rows = [[round(1e6 * t), unit, 3, *(p + 1e-6 * unit)] for t, p in zip(at, place, strict=True) for unit in (0, 1)]
    gps = _rows(tmp_path / "GPS.csv", rows, ["TimeUS,I,Status,Lat,Lng,Alt"])
    found, stream, fixes = _read(imu, gps)
    _same(stream)
    assert fixes is not None
    np.testing.assert_allclose(fixes.latitude, np.radians(place[:, 0]), atol=1e-9)
    assert sum("of which I = 0 is used" in text for text in found.left) == 2


def test_gyros_and_accelerometers_in_rows_of_their_own(tmp_path: Path) -> None:
    """A word in the first column says what a row is; the accelerometers come at other instants."""
    time, rate, force = _unit()
    rows: list[list[object]] = []
    for t, w, f in zip(time, rate, force, strict=True):
        rows += [
            ["UncalAccel", round(1e9 * (t - 0.01)), *f],
            ["UncalGyro", round(1e9 * t), *w],
            ["Mag", 0, 1.0, 2.0, 3.0],
        ]
    for k, row in enumerate(rows[2::3]):
        row[1] = round(1e9 * time[k])
    path = _rows(tmp_path / "device_imu.csv", rows, ["MessageType,elapsedNanos,MeasurementX,MeasurementY,MeasurementZ"])
    _, stream, _ = _read(path)
    assert stream is not None
    np.testing.assert_allclose(stream.gyro, rate[:-1], atol=1e-6)
    np.testing.assert_allclose(stream.accel, 0.5 * (force[1:] + force[:-1]), atol=1e-6)


def test_rows_of_the_receiver_between_those_of_the_unit(tmp_path: Path) -> None:
    """Fields without readings are empty, and ticks of 0.1 ms are known by their name."""
    time, rate, force = _unit()
    at, place = _place()
    rows: list[tuple[float, list[object]]] = [
        (t, [round(1e4 * t), *f, *w, "", "", ""]) for t, w, f in zip(time, rate, force, strict=True)
    ]
    rows += [(t + 1e-3, [round(1e4 * (t + 1e-3)), *[""] * 6, *p]) for t, p in zip(at, place, strict=True)]
    head = ["// MT Manager", "SampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tLatitude\tLongitude\tAltitude"]
    path = _rows(tmp_path / "mt.txt", [row for _, row in sorted(rows, key=lambda one: one[0])], head, "\t")
    _, stream, fixes = _read(path)
    _same(stream)
    assert stream is not None
    np.testing.assert_allclose(np.diff(stream.time), 1.0 / _RATE, atol=1e-9)
    assert fixes is not None
    assert len(fixes) == len(at)


@pytest.mark.parametrize("kind", ["units below", "repeated names", "latin-1", "bars"])
def test_headings(tmp_path: Path, kind: str) -> None:
    """Units in a second line, names that repeat, names that are not in UTF-8, bars between the columns."""
    time, rate, force = _unit()
    rows: list[list[object]] = [
        [t, 7.0, *np.degrees(w), 7.0, *(f / _G)] for t, w, f in zip(time, rate, force, strict=True)
    ]
    names = ["timestamp", "rate", "gyro_x", "gyro_y", "gyro_z", "rate", "x_acc", "y_acc", "z_acc"]
    units = ["s", "Hz", "deg/s", "deg/s", "deg/s", "Hz", "g", "g", "g"]
    delimiter, encoding, head = ",", "utf-8", [names, units]
    if kind == "repeated names":
        head = [["Logger", "1"], names]
    elif kind == "latin-1":
        encoding = "latin-1"
        head = [[f"{n} [{u.replace('deg', '°')}]" for n, u in zip(names, units, strict=True)]]
        head[0][1] = "Häufigkeit"
    elif kind == "bars":
        delimiter, head = "|", [[*names[:1], "count", *names[2:5], "other", *names[6:]]]
    path = _rows(tmp_path / "log.csv", rows, [delimiter.join(line) for line in head], delimiter, encoding)
    _, stream, _ = _read(path)
    assert stream is not None
    _same(stream, atol=1e-4 if kind != "bars" else 20.0)
    assert np.std(stream.accel[:, 2]) < 0.1


@pytest.mark.parametrize("order", ["attitude first", "magnetometer first"])
def test_no_names(tmp_path: Path, order: str) -> None:
    """Quaternion, angles and magnetic field beside the sensors: the noise and the middle tell them apart."""
    time, rate, force = _unit()
    heading = 0.6 + 0.3 * np.sin(0.05 * time)
    q = np.stack([np.cos(0.5 * heading), 0.0 * time, 0.0 * time, np.sin(0.5 * heading)], axis=1)
    noise = np.random.default_rng(12).normal(0.0, 1e-3, (_COUNT, 3))
    field = np.stack([0.4 * np.cos(heading), -0.4 * np.sin(heading), np.full(_COUNT, 0.8)], axis=1) + noise
    angles = np.stack([0.01 * np.sin(time), 0.02 * np.cos(time), heading], axis=1)
    if order == "attitude first":
        columns = np.column_stack([time, q, angles, rate, force, field])
    else:
        columns = np.column_stack([time, field, force, rate])
    path = tmp_path / "imu.csv"
    path.write_text("\n".join(",".join(f"{x:.9g}" for x in row) for row in columns) + "\n")
    _, stream, _ = _read(path)
    _same(stream)


def test_the_time_of_fixes_is_no_second_of_the_minute(tmp_path: Path) -> None:
    """Milliseconds of the week beside calendar columns, millimetres and millimetres per second."""
    at, place = _place()
    rows: list[list[object]] = [
        [
            round(1e3 * (t + 230_000.0)),
            2025,
            7,
            int(t % 60),
            *(round(1e7 * x) for x in p[[1, 0]]),
            round(1e3 * p[2]),
            1200,
            100,
        ]
        for t, p in zip(at, place, strict=True)
    ]
    path = _rows(tmp_path / "pvt.csv", rows, ["iTOW,year,month,second,lon,lat,height,hAcc,sAcc"])
    _, _, fixes = _read(path)
    assert fixes is not None
    np.testing.assert_allclose(fixes.time, at + 230_000.0, atol=1e-6)
    assert fixes.position_sigma is not None
    assert fixes.position_sigma[0, 0] == pytest.approx(1.2)


def test_gravity_decides_between_files_of_accelerometers(tmp_path: Path) -> None:
    """A phone writes accelerations without gravity, with gravity, and uncalibrated ones."""
    time, rate, force = _unit()
    for name, values in (
        ("Accelerometer", force + np.array([1.5, 0.0, _G])),
        ("AccelerometerUncalibrated", force + 0.05),
        ("Gyroscope", rate),
        ("TotalAcceleration", force),
    ):
        _rows(tmp_path / f"{name}.csv", [[t, *v[::-1]] for t, v in zip(time, values, strict=True)], ["seconds,z,y,x"])
    found, stream, _ = _read(*sorted(tmp_path.glob("*.csv")))
    _same(stream)
    assert len(found.left) == 2


def test_the_accuracy_of_phyphox_is_the_sigma(tmp_path: Path) -> None:
    """Names with blanks, quotation marks and units in brackets."""
    at, place = _place()
    names = ["Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)"]
    names += ["Horizontal Accuracy (m)", "Vertical Accuracy (m)"]
    rows: list[list[object]] = [[t, *p, 4.0, 90.0, 3.5, 6.25] for t, p in zip(at, place, strict=True)]
    path = _rows(tmp_path / "Location.csv", rows, [",".join(f'"{name}"' for name in names)])
    _, _, fixes = _read(path)
    assert fixes is not None
    assert fixes.position_sigma is not None
    np.testing.assert_allclose(fixes.position_sigma[0], [3.5, 3.5, 6.25])
    assert fixes.velocity_ned is not None
    np.testing.assert_allclose(fixes.velocity_ned[0, :2], [0.0, 4.0], atol=1e-9)


@pytest.mark.parametrize("name", ["[" * 3000, "_" * 3000, "x" * 3000])
def test_names_of_thousands_of_letters_are_no_names(tmp_path: Path, name: str) -> None:
    """Their comparison with the patterns of names would take minutes."""
    rows = "".join(f"{0.01 * k:.2f},0.001,0,0.002,0.1,0,{-9.81 + 1e-3 * (k % 7)}\n" for k in range(300))
    (tmp_path / "imu.csv").write_text(f"t,gx,{name},gz,ax,ay,az\n{rows}", encoding="utf-8")
    table = read_table(tmp_path / "imu.csv")
    assert table.words is None
    assert table.values.shape == (300, 7)
