"""`sinssim run` with recorded files instead of a scenario: one step, and a scenario that repeats the run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from sinssim.cli.app import app
from sinssim.errors import InputError
from sinssim.scenario import load_scenario
from tests.analyses.inspection import worlds

_GPX = '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>{}</trkseg></trk></gpx>'


def sinssim(*arguments: str | Path) -> str:
    """Run a command, and return what it prints."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0
    return result.output


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Return a track north at 5.56 m/s, 1e-5 rad/s of latitude in degrees: 40 points, 1 Hz."""
    points = "".join(
        f'<trkpt lat="{47.37 + 5e-5 * k:.7f}" lon="8.54"><ele>450</ele><time>2026-01-01T00:00:{k:02d}Z</time></trkpt>'
        for k in range(40)
    )
    (tmp_path / "drive.gpx").write_text(_GPX.format(points))
    return tmp_path / "drive.gpx"


@pytest.fixture
def log(tmp_path: Path) -> tuple[Path, Path]:
    """Return two and a half minutes of a unit at 20 Hz and of fixes at 2 Hz."""
    unit, fixes = worlds.readings(20.0), worlds.fixes(2.0)
    rows = np.column_stack([unit.time, unit.gyro, unit.accel])
    names = "t_s,gx,gy,gz,ax,ay,az"
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", header=names, comments="")
    assert fixes.velocity_ned is not None
    place = [np.degrees(fixes.latitude), np.degrees(fixes.longitude), fixes.height]
    rows = np.column_stack([fixes.time, *place, fixes.velocity_ned])
    names = "t_s,lat,lon,alt,vn,ve,vd"
    np.savetxt(tmp_path / "gnss.csv", rows, delimiter=",", header=names, comments="", fmt="%.10g")
    return tmp_path / "imu.csv", tmp_path / "gnss.csv"


def _numbers(run: Path) -> dict[str, Any]:
    summary = json.loads((run / "summary.json").read_text())
    return {key: summary[key] for key in ("algorithms", "filter") if key in summary}


KEEP = ("--keep", "report")


def test_a_track_in_one_step(drive: Path, tmp_path: Path) -> None:
    shown = sinssim("run", drive, "-o", tmp_path / "run", *KEEP)
    suggested = tmp_path / "run" / "suggested.toml"
    assert str(suggested) in shown
    track = json.loads((tmp_path / "run" / "summary.json").read_text())["track"]
    assert track["max_speed_mps"] == pytest.approx(5.56, abs=0.01)  # 5e-5° of a meridian of 111.2 km/°
    sinssim("run", suggested, "-o", tmp_path / "again", *KEEP)
    assert _numbers(tmp_path / "again") == _numbers(tmp_path / "run")


@pytest.mark.parametrize(("option", "tried"), [((), True), (("--no-trial",), False)])
def test_whether_the_suggested_scenario_is_tried(
    option: tuple[str, ...], tried: bool, log: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def suggest(*_: object, trial: bool) -> None:
        raise InputError(f"trial: {trial}")

    monkeypatch.setattr("sinssim.analyses.inspection.inspected_files.suggest", suggest)
    with pytest.raises(InputError, match=f"trial: {tried}"):
        sinssim("run", *log, *option, "--debug")


def test_a_scenario_of_ones_own_has_no_trial_to_leave_out() -> None:
    with pytest.raises(InputError, match="no effect on the scenario first_flight"):
        sinssim("run", "first_flight", "--no-trial", "--debug")


def test_inertial_data_and_fixes_in_one_step(
    log: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scenario is run as `inspect` suggests it; the next test repeats it."""
    monkeypatch.setattr("sinssim.analyses.inspection.suggestion_trial._LONGEST_S", 22.0)  # one pass, with one outage
    shown = sinssim("run", *log, "-o", tmp_path / "run", *KEEP, "--set", "log.to_s=45")
    assert "Doubts:" in shown
    assert "aided" in shown
    assert (tmp_path / "run" / "suggested.toml").is_file()
    assert "filter" in _numbers(tmp_path / "run")


def test_settings_are_in_the_scenario_that_repeats_the_run(log: tuple[Path, Path], tmp_path: Path) -> None:
    settings = ("--set", "imu.grade=consumer", "--set", "filter.initial_sigma.heading_arcmin=300",
                "--set", "log.to_s=45")  # fmt: skip
    sinssim("run", *log, "-o", tmp_path / "run", *KEEP, *settings, "--outage", "5/20", "--no-trial")
    text = (tmp_path / "run" / "suggested.toml").read_text()
    assert "# description of the IMU for the filter" in text
    scenario = load_scenario(tmp_path / "run" / "suggested.toml")
    assert scenario.imu.grade == "consumer"
    assert scenario.filter is not None
    assert scenario.filter.initial_sigma.heading_arcmin == 300.0
    assert scenario.log is not None
    assert (scenario.log.outages.length_s, scenario.log.outages.every_s) == (5.0, 20.0)
    assert "filter" in _numbers(tmp_path / "run")
    sinssim("run", tmp_path / "run" / "suggested.toml", "-o", tmp_path / "again", *KEEP)
    assert _numbers(tmp_path / "again") == _numbers(tmp_path / "run")


def test_what_cannot_be_run(log: tuple[Path, Path], drive: Path, tmp_path: Path) -> None:
    """Each message says what is wrong with which file, and what would be right."""
    (tmp_path / "junk.txt").write_text("hello world\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "mine.txt").write_text("mine")
    for arguments, words in (
        ([log[0], tmp_path / "missing.pos"], "missing.pos does not exist"),
        ([tmp_path / "missing.csv"], "missing.csv does not exist; give a scenario, or recorded files"),
        ([tmp_path / "junk.txt"], "junk.txt is not a table of numbers"),
        ([tmp_path / "folder"], "folder is a folder, but of no format that is a folder"),
        ([log[0]], "no position to start from: give log.start.latitude_deg"),
        ([drive, drive], "no inertial data. A single file of fixes or of a solution is run as a track"),
        (["first_flight.toml", log[0]], "first_flight.toml is a scenario, one of 2 arguments"),
        ([*log, "-o", tmp_path / "taken"], "is not empty and holds no run"),
    ):
        out = () if "-o" in arguments else ("-o", tmp_path / "out")
        with pytest.raises(InputError, match=words):
            sinssim("run", *arguments, *out)
    assert not (tmp_path / "out").exists()
    assert (tmp_path / "taken" / "mine.txt").read_text() == "mine"
