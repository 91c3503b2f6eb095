"""One drive in the conventions of other loggers: every file is described so that a run reads the same sensors."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.recorded_log import RecordedLog, recorded_log
from sinssim.scenario import load_scenario
from tests.analyses.inspection import worlds
from tests.slow import slow

_G = 9.80665
_UNIX = 1_751_990_400  # 2025-07-08 16:00:00 UTC
RATE = 40.0


def _table(path: Path, columns: list[Array], names: str | None = None, delimiter: str = ",") -> Path:
    lines = [] if names is None else [names]
    lines += [delimiter.join(f"{value:.12g}" for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _unit() -> tuple[Array, Array, Array]:
    unit = worlds.readings(RATE)
    return unit.time, unit.gyro, unit.accel


def _seen() -> tuple[Array, Array, Array, Array, Array]:
    fixes = worlds.fixes()
    assert fixes.velocity_ned is not None
    return fixes.time, np.degrees(fixes.latitude), np.degrees(fixes.longitude), fixes.height, fixes.velocity_ned


def no_names(folder: Path) -> list[Path]:
    """Columns of numbers alone, with latitude and longitude in radians and the velocity north, east, down."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    place = [np.radians(latitude), np.radians(longitude), h]
    return [
        _table(folder / "imu.txt", [t, *w.T, *f.T], None, " "),
        _table(folder / "g.txt", [s, *place, *v.T], None, " "),
    ]


def increments_first(folder: Path) -> list[Path]:
    """Right, front, up; increments; times in the last column; velocity east, north, up before the position."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    rfu = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    unit = [*(w @ rfu.T / RATE).T, *(f @ rfu.T / RATE).T, t]
    return [
        _table(folder / "imu.txt", unit, None, " "),
        _table(folder / "gps.txt", [v[:, 1], v[:, 0], -v[:, 2], latitude, longitude, h, s], None, " "),
    ]


def commas(folder: Path) -> list[Path]:
    """A semicolon between the columns, a comma in the numbers, a mark and comments before them, km/h."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    imu = _table(folder / "imu.csv", [t, *f.T, *np.degrees(w).T], None, ";")
    gnss = _table(
        folder / "gnss.csv", [s, latitude, longitude, h, 3.6 * v[:, 1], 3.6 * v[:, 0], -3.6 * v[:, 2]], None, ";"
    )
    axes = "Acceleration {0} [m/s²]", "Angular rate {0} [°/s]"
    names = ";".join(["Time [s]", *(text.format(a) for text in axes for a in "XYZ")])
    of_gnss = (
        "Time [s];Latitude [°];Longitude [°];Altitude [m];Velocity East [km/h];Velocity North [km/h];Velocity Up [km/h]"
    )
    for path, head in ((imu, names), (gnss, of_gnss)):
        text = path.read_text(encoding="utf-8").replace(".", ",").replace("\n", "\r\n")
        path.write_bytes(f"\ufeff# a logger\r\n{head}\r\n{text}".encode())
    return [imu, gnss]


def phone(folder: Path) -> list[Path]:
    """Gyros and accelerometers in files of their own, at other instants; z, y, x; nanoseconds; speed and bearing."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    at = t[:-1] + 0.4 / RATE
    between = np.stack([np.interp(at, t, axis) for axis in f.T], axis=1)
    for name, stamps, values in (("Gyroscope", t, w), ("TotalAcceleration", at, between)):
        rows = [f"{_UNIX + int(x)}{round((x % 1) * 1e9):09d},{x - t[0]:.9f},{z:.9f},{y:.9f},{u:.9f}"
                for x, (u, y, z) in zip(stamps, values, strict=True)]  # fmt: skip
        (folder / f"{name}.csv").write_text("\n".join(["time,seconds_elapsed,z,y,x", *rows]) + "\n")
    speed, course = np.hypot(v[:, 0], v[:, 1]), np.degrees(np.arctan2(v[:, 1], v[:, 0])) % 360.0
    rows = [f"{_UNIX + int(a)}{round((a % 1) * 1e9):09d},0.5,5,3.9,{b:.4f},{c:.4f},{d:.3f},{e:.8f},{g:.8f}"
            for a, b, c, d, e, g in zip(s, speed, course, h, longitude, latitude, strict=True)]  # fmt: skip
    head = "time,speedAccuracy,verticalAccuracy,horizontalAccuracy,speed,bearing,altitude,longitude,latitude"
    (folder / "Location.csv").write_text("\n".join([head, *rows]) + "\n")
    (folder / "Annotation.csv").write_text("time,text\n")
    return sorted(folder.glob("*.csv"))


def dates(folder: Path, mirror: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> list[Path]:
    """Dates in UTC, and g."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()

    def stamp(at: float) -> str:
        return (datetime(2025, 7, 8, 23, 59, 0) + timedelta(seconds=at)).isoformat(timespec="microseconds") + "Z"

    for name, head, times, columns in (
        ("imu.csv", "gx,gy,gz,ax,ay,az", t, [*(w * mirror).T, *(f * mirror / _G).T]),
        ("gps.csv", "lat,lon,alt,vn,ve,vd", s, [latitude, longitude, h, *v.T]),
    ):
        rows = [",".join([stamp(float(a)), *(f"{x:.9f}" for x in b)]) for a, *b in zip(times, *columns, strict=True)]
        (folder / name).write_text("\n".join([f"timestamp,{head}", *rows]) + "\n")
    return [folder / "imu.csv", folder / "gps.csv"]


def left_handed(folder: Path) -> list[Path]:
    """The second axis of both triads the other way round."""
    return dates(folder, (1.0, -1.0, 1.0))


def one_file(folder: Path) -> list[Path]:
    """Both sensors in one table, the last fix held until there is a new one, latitude in 1e-7 degrees."""
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    last = np.searchsorted(s, t, side="right") - 1
    known = last >= 0
    place = [np.where(known, np.round(1e7 * x[last]), 0.0) for x in (latitude, longitude)]
    rest = [np.where(known, x[last], 0.0) for x in (h, *v.T)]
    return [_table(folder / "log.csv", [1e6 * t, *w.T, *f.T, *place, *rest],
                   "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,Lat,Lng,Alt,vel_n_m_s,vel_e_m_s,vel_d_m_s")]  # fmt: skip


CASES: list[Any] = [phone, *slow(no_names, increments_first, commas, dates, one_file)]
CASES += slow(left_handed)  # seconds: all readings at all offsets are tried


def _described(paths: list[Path], folder: Path) -> tuple[RecordedLog, str]:
    found = inspect(paths, folder)
    assert found.inspection.usable, [f.text for f in found.inspection.findings if f.grade == "wrong"]
    assert any(f.subject == "units and axes" and f.grade == "fact" for f in found.inspection.findings)
    assert found.scenario is not None
    (folder / "log.toml").write_text(found.scenario, encoding="utf-8")
    section = load_scenario(str(folder / "log.toml")).log
    assert section is not None
    return recorded_log(section), found.scenario


@pytest.mark.parametrize("case", CASES, ids=lambda case: getattr(case, "__name__", None))
def test_the_scenario_reads_the_same_sensors(case: Callable[[Path], list[Path]], tmp_path: Path) -> None:
    """The readings of a run are those of the drive, up to the named axes and to the digits of the file."""
    log, text = _described(case(tmp_path), tmp_path)
    time, gyro, accel = _unit()
    mean = np.sort(np.abs(accel.mean(axis=0)))
    read = log.imu.dvel.sum(axis=0) / (log.imu.time[-1] - log.imu.time[0])
    np.testing.assert_allclose(np.sort(np.abs(read)), mean, atol=0.01)
    turned = log.imu.dtheta.sum(axis=0)
    whole = 0.5 * (gyro[1:] + gyro[:-1]).sum(axis=0) / RATE
    np.testing.assert_allclose(np.sort(np.abs(turned)), np.sort(np.abs(whole)), atol=0.02)
    assert read[2] < -9.0  # the unit lies upright, and the axes say so
    fixes = log.fixes
    assert fixes is not None
    seen_time, latitude, longitude, height, velocity = _seen()
    row = np.argmin(np.abs(fixes.time[:, None] - (seen_time - time[0])[None, :]), axis=1)
    late = np.median(fixes.time - (seen_time - time[0])[row])
    assert abs(late) < 0.06  # the offset that the match finds, and half a sample
    np.testing.assert_allclose(fixes.latitude, np.radians(latitude[row]), atol=2e-9)
    np.testing.assert_allclose(fixes.longitude, np.radians(longitude[row]), atol=2e-9)
    np.testing.assert_allclose(fixes.height, height[row], atol=2e-3)
    assert fixes.velocity_ned is not None
    shown = slice(0, 2) if case is phone else slice(0, 3)
    np.testing.assert_allclose(fixes.velocity_ned[:, shown], velocity[row, shown], atol=2e-3)
    assert tomllib.loads(text)["log"]["gnss"]["format"] == "text"


def test_readings_without_gravity_are_named(tmp_path: Path) -> None:
    """Linear acceleration is no specific force: the sentence says what is missing."""
    paths = [path for path in phone(tmp_path) if path.stem != "Annotation"]
    rows = (tmp_path / "TotalAcceleration.csv").read_text().splitlines()
    values = np.array([row.split(",")[2:] for row in rows[1:]], dtype=float)
    values -= values[: int(20.0 * RATE)].mean(axis=0)
    less = [
        ",".join([*row.split(",")[:2], *(f"{x:.6f}" for x in value)])
        for row, value in zip(rows[1:], values, strict=True)
    ]
    (tmp_path / "TotalAcceleration.csv").write_text("\n".join([rows[0], *less]) + "\n")
    with pytest.raises(InputError, match=r"removed gravity"):
        inspect(paths, tmp_path)


@pytest.mark.slow
def test_a_receiver_that_starts_late_begins_the_run(tmp_path: Path) -> None:
    (t, w, f), (s, latitude, longitude, h, v) = _unit(), _seen()
    late = s > 20.0
    imu = _table(tmp_path / "imu.csv", [t, *w.T, *f.T], "t,wx,wy,wz,fx,fy,fz")
    columns = [s[late], latitude[late], longitude[late], h[late], *v[late].T]
    log, text = _described([imu, _table(tmp_path / "gnss.csv", columns, "t,lat,lon,height,vn,ve,vd")], tmp_path)
    begin = tomllib.loads(text)["log"]["from_s"]
    assert abs(begin - (s[late][0] - t[0])) < 0.1
    assert log.fixes is not None
    assert log.fixes.time[0] - log.imu.time[0] < 0.5


@pytest.mark.slow
def test_a_slow_log_with_a_solution_alone_has_emulated_satellites(tmp_path: Path) -> None:
    """A folder of KITTI at 10 Hz: the solution stands for the fixes, and what needs faster samples is left out."""
    (tmp_path / "oxts" / "data").mkdir(parents=True)
    drive, unit = worlds.drive(), worlds.readings(100.0, noise=0.1)
    at = np.arange(1.0, 148.0, 0.1)
    state = drive.state(at)
    flu = worlds.TO_UNIT.T @ np.diag((1.0, -1.0, -1.0))
    w, f = (np.stack([np.interp(at, unit.time, x) for x in (y @ flu).T], axis=1) for y in (unit.gyro, unit.accel))
    roll, pitch, heading = rotation.euler_from_quaternion(state.q_nb)
    stamps = []
    for k, t in enumerate(at):
        stamps.append(f"{datetime(2011, 9, 26) + timedelta(seconds=float(t)):%Y-%m-%d %H:%M:%S.%f}000")
        v = state.velocity_ned[k]
        place = np.degrees(state.latitude[k]), np.degrees(state.longitude[k]), state.height[k]
        angles = roll[k], -pitch[k], 0.5 * np.pi - heading[k]
        row = [*place, *angles, v[0], v[1], 0.0, 0.0, -v[2], *f[k], *f[k], *w[k], *w[k], 0.05, 0.02]
        text = " ".join(f"{x:.12g}" for x in row)
        (tmp_path / "oxts" / "data" / f"{k:010d}.txt").write_text(f"{text} 4 11 6 6 6\n")
    (tmp_path / "oxts" / "timestamps.txt").write_text("\n".join(stamps) + "\n")
    found = inspect([tmp_path / "oxts"], tmp_path, land=True)
    assert any(f.subject == "units and axes" and f.grade == "fact" for f in found.inspection.findings)
    assert found.scenario is not None
    data = tomllib.loads(found.scenario)
    assert set(data["aiding"]) == {"gnss"}
    assert data["log"]["reference"]["format"] == "kitti-oxts"
    assert np.abs(data["imu"]["mounting_deg"]).max() < 1.0
