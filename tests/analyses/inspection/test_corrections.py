"""Logs that are mangled as people mangle them: the scenario that inspect writes runs, and stays at the fixes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim import earth
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.analyses.inspection.log_corrections import bridges
from sinssim.data import Array
from sinssim.scenario import load_scenario
from sinssim.units import G0

DRIVE = Path(__file__).parents[2] / "data" / "drive"
FLIGHT = os.environ.get("SINSSIM_PX4_FLIGHT")
Mangle = Callable[[Array], Array]


def _si(rows: Array) -> Array:
    """The drive with specific forces and rates in SI units, the first 100 s."""
    rows = rows[:10000].copy()
    rows[:, :3] *= G0
    rows[:, 3:6] = np.radians(rows[:, 3:6])
    return rows


def _degrees(rows: Array) -> Array:
    return rows * (1.0, 1.0, 1.0, *[180.0 / np.pi] * 3, 1.0)


def _in_g(rows: Array) -> Array:
    return rows / (G0, G0, G0, 1.0, 1.0, 1.0, 1.0)


def _swapped(rows: Array) -> Array:
    return rows[:, [1, 0, 2, 4, 3, 5, 6]]


def _gyros_swapped(rows: Array) -> Array:
    return rows[:, [0, 1, 2, 4, 3, 5, 6]]


def _flipped(rows: Array) -> Array:
    return rows * (1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0)


def _gap(rows: Array) -> Array:
    return np.delete(rows, slice(6000, 6400), axis=0)


def _late(rows: Array) -> Array:
    return rows + np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 700.0))


def _ahead(rows: Array) -> Array:
    return rows + np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 18000.0))


ONE_BY_ONE = (_degrees, _in_g, _swapped, _gyros_swapped, _flipped, _gap, _late, _ahead)


def _write(path: Path, rows: Array, names: str = "") -> Path:
    np.savetxt(path, rows, delimiter=",", fmt=["%.6f"] * 6 + ["%d"], header=names, comments="")
    return path


def _beyond_fixes(scenario: Path) -> float:
    """Run a scenario; return the horizontal rms of the aided solution about the fixes, over their σ."""
    run = sinssim.run(load_scenario(str(scenario)))
    assert run.aided is not None
    assert run.aided.estimate.divergence is None
    log = run.truth.prepared.log
    position = next(r.measurements for r in log.sensed if r.measurements.kind == "gnss-position")
    found = run.aided.estimate.solution
    latitude, longitude = (np.interp(position.time, found.time, x) for x in (found.latitude, found.longitude))
    r1, r2 = earth.radii(position.value[:, 0])
    north = (latitude - position.value[:, 0]) * (r1 + position.value[:, 2])
    east = (longitude - position.value[:, 1]) * (r2 + position.value[:, 2]) * np.cos(latitude)
    return float(np.sqrt(np.mean((north / position.sigma[:, 0]) ** 2 + (east / position.sigma[:, 1]) ** 2) / 2.0))


def _of_files(folder: Path, *mangles: Mangle) -> Path:
    """Write the mangled drive in files whose names claim SI units; return the suggested scenario."""
    rows = _si(np.loadtxt(DRIVE / "imu.csv", delimiter=","))
    for mangle in mangles:
        rows = mangle(rows)
    log = _write(folder / "imu.csv", rows, "ax_m_s2,ay_m_s2,az_m_s2,gx_rad_s,gy_rad_s,gz_rad_s,t_ms")
    found = inspect([log, DRIVE / "gnss.pos"], folder)
    assert found.inspection.usable
    assert found.scenario is not None
    (folder / "out.toml").write_text(found.scenario)
    return folder / "out.toml"


def _of_scenario(folder: Path, *mangles: Mangle) -> tuple[Path, str]:
    """Write a scenario that describes the drive before it was mangled; return the corrected one, and its text."""
    rows = _si(np.loadtxt(DRIVE / "imu.csv", delimiter=","))
    for mangle in mangles:
        rows = mangle(rows)
    _write(folder / "imu.csv", rows)
    text = (DRIVE / "drive.toml").read_text().replace('"deg/s"', '"rad/s"').replace('"g"', '"m/s^2"')
    text = text.replace('"gnss.pos"', f'"{DRIVE.resolve() / "gnss.pos"}"')
    if _late in mangles or _ahead in mangles:  # the times are read as those of the file before
        text = text.replace("42.224", "42.924" if _late in mangles else "60.224").replace(":38:60", ":39:00")
    (folder / "drive.toml").write_text(text)
    found = inspect([folder / "drive.toml"], folder)
    assert found.scenario is not None, found.why
    (folder / "out.toml").write_text(found.scenario)
    return folder / "out.toml", found.scenario


@pytest.mark.slow
def test_a_suggested_scenario_carries_unit_gap_and_offset(tmp_path: Path) -> None:
    """°/s in columns that claim rad/s, 4 s without a row, and stamps 0.7 s late."""
    scenario = _of_files(tmp_path, _degrees, _gap, _late)
    log = load_scenario(str(scenario)).log
    assert log is not None
    assert log.imu.gyro is not None
    assert log.imu.gyro.unit == "deg/s"
    assert log.imu.max_gap_s >= 4.0
    assert _beyond_fixes(scenario) < 1.0


@pytest.mark.slow
def test_a_described_log_is_corrected_with_its_comments(tmp_path: Path) -> None:
    """The scenario keeps what is right; unit, sign and clock change, each with its reason."""
    scenario, text = _of_scenario(tmp_path, _in_g, _flipped, _ahead)
    log = load_scenario(str(scenario)).log
    assert log is not None
    assert log.imu.accel is not None
    assert log.imu.gyro is not None
    assert (log.imu.accel.unit, log.imu.gyro.signs) == ("g", (1, 1, -1))
    assert log.imu.time_offset_s == pytest.approx(-18.0, abs=0.02)
    assert "# fixed ambiguities only" in text
    assert "#   log.imu.gyro.signs = [1, 1, -1]: the z gyro has the opposite sign" in text


@pytest.mark.slow
@pytest.mark.parametrize("mangle", ONE_BY_ONE)
def test_each_mangling_of_files(tmp_path: Path, mangle: Mangle) -> None:
    assert _beyond_fixes(_of_files(tmp_path, mangle)) < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("mangle", ONE_BY_ONE)
def test_each_mangling_of_a_described_log(tmp_path: Path, mangle: Mangle) -> None:
    assert _beyond_fixes(_of_scenario(tmp_path, mangle)[0]) < 1.0


@pytest.mark.slow
@pytest.mark.skipif(FLIGHT is None, reason="SINSSIM_PX4_FLIGHT names no folder with the flight")
@pytest.mark.parametrize("mangle", [None, _degrees, _in_g, _gyros_swapped, _flipped, _late])
def test_each_mangling_of_the_flight(tmp_path: Path, mangle: Mangle | None) -> None:
    raw = np.loadtxt(Path(str(FLIGHT)) / "IMU.txt")
    rows = np.column_stack([raw[:, 5:8], raw[:, 2:5], raw[:, 1]])
    log = _write(tmp_path / "imu.csv", rows if mangle is None else mangle(rows), "ax,ay,az,gx,gy,gz,t_ms")
    found = inspect([log, Path(str(FLIGHT)) / "GPSraw.txt"], tmp_path)
    assert found.scenario is not None
    (tmp_path / "out.toml").write_text(found.scenario)
    assert _beyond_fixes(tmp_path / "out.toml") < 1.0


def test_a_right_scenario_needs_no_correction() -> None:
    found = inspect([DRIVE / "drive.toml"])
    assert found.scenario is None
    assert found.why == "drive.toml needs no correction."


def test_gaps_are_bridged_or_left_out() -> None:
    time = np.arange(0.0, 100.0, 0.01)
    assert bridges(time, 0.1) == (None, None)
    short = np.delete(time, slice(2000, 2230))
    assert bridges(short, 0.1) == (pytest.approx(2.3, abs=0.1), None)
    bridge, span = bridges(np.delete(short, slice(5000, 6500)), 0.1)
    assert bridge == pytest.approx(2.3, abs=0.1)  # within the longest part
    assert span == (0.0, pytest.approx(52.3, abs=0.02))


def test_a_drift_of_the_clock_adds_to_the_one_that_is_described() -> None:
    """30 ppm are described and 20 ppm more are seen: 50.0006 ppm, to a tenth."""
    from types import SimpleNamespace

    from sinssim.analyses.inspection.log_corrections import _of_clocks

    log: Any = SimpleNamespace(imu=SimpleNamespace(clock_drift_ppm=30.0, time_offset_s=0.0), gnss=None)
    seen: Any = SimpleNamespace(offset=None, inertial=None, drift=2e-5, velocity_delay=None, findings=())
    clocks: Any = (SimpleNamespace(origin_gps_s=None), None)
    assert [(key, value) for key, value, _ in _of_clocks(seen, log, clocks)] == [
        (("log", "imu", "clock_drift_ppm"), 50.0)
    ]
