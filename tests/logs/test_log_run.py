"""Export and score of a run on recorded sensors: readings and dates against the raw files, errors of known size."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import sinssim
from sinssim.cli.app import main
from sinssim.errors import InputError
from sinssim.logs.formats.export_streams import date_of_run, export
from sinssim.logs.gps_time import date_from_gps
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun

DATA = Path(__file__).parents[1] / "data" / "drive"
SHORT = ["log.to_s=12", "filter.smooth=false"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run on twelve seconds of the recorded drive."""
    place = tmp_path_factory.mktemp("log") / "drive"
    sinssim.run(sinssim.load_scenario(DATA / "drive.toml", SHORT), place)
    return place


@pytest.fixture(scope="module")
def judge(folder: Path) -> Judge:
    run = RecordedRun(folder)
    return Judge(run, date_of_run(run, None))


def raw_fixes() -> tuple[list[str], np.ndarray]:
    """Return date and time, and latitude, longitude [°], height [m], of the rows of the receiver's own file."""
    rows = [
        line.split()
        for line in (DATA / "gnss.pos").read_text().splitlines()
        if line.strip() and not line.startswith("%")
    ]
    return [f"{row[0]} {row[1]}" for row in rows], np.array([[float(word) for word in row[2:5]] for row in rows])


def command(*words: object) -> int:
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return int(str(end.value.code))


def test_exported_fixes_are_those_of_the_receiver(folder: Path, tmp_path: Path) -> None:
    """Another program's file goes in and comes out: dates, latitudes, longitudes and heights are the same."""
    place = export(folder, "rtklib-pos", tmp_path / "out.pos", solution=["gnss"]).place
    dates, places = raw_fixes()
    raw = dict(zip(dates, places, strict=True))
    rows = [line.split() for line in place.read_text().splitlines() if line.strip() and not line.startswith("%")]
    assert 44 <= len(rows) <= 49  # four a second for twelve seconds
    for row in rows:
        np.testing.assert_allclose([float(word) for word in row[2:5]], raw[f"{row[0]} {row[1]}"], rtol=0, atol=1e-4)
        assert abs(float(row[2]) - raw[f"{row[0]} {row[1]}"][0]) < 2e-9


def test_exported_readings_are_those_of_the_unit(folder: Path, tmp_path: Path) -> None:
    """The increments are the trapezoids of the raw rates, in forward, right, down; times are the unit's own."""
    done = export(folder, "csv", tmp_path / "out")
    rows = np.genfromtxt(tmp_path / "out" / "imu.csv", delimiter=",", names=True)
    raw = np.loadtxt(DATA / "imu.csv", delimiter=",")
    time = (raw[:, 6] - raw[0, 6]) * 1e-3
    turned = np.radians(raw[:, 3:6]) * [-1.0, 1.0, -1.0]  # the unit's axes are backward, right, up
    gyro = 0.5 * (turned[1:] + turned[:-1]) * np.diff(time)[:, None]
    count = len(rows)
    np.testing.assert_allclose(rows["time_s"], time[1 : count + 1], rtol=0, atol=1e-9)
    found = np.stack([rows[f"dtheta_{axis}_rad"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(found, gyro[:count], rtol=0, atol=1e-12)
    assert any("aided stands for it" in sentence for sentence in done.sentences)
    assert any("2025-07-08T19:38:24.224Z, the first row of the log" in sentence for sentence in done.sentences)


def test_the_date_of_the_run_is_that_of_the_log(judge: Judge) -> None:
    """First row at 19:38:42.224 GPS time, 18 leap seconds ahead of UTC."""
    assert f"{date_from_gps(judge.start_gps_s):%Y-%m-%d %H:%M:%S}" == "2025-07-08 19:38:24"
    assert judge.start_gps_s % 1.0 == pytest.approx(0.224, abs=1e-6)
    assert date_of_run(judge.run, "2026-01-01") % 1.0 == 0.0


def test_the_receivers_own_file_has_no_error(judge: Judge) -> None:
    """Its dates bring it to the rows of the reference, which is the same file."""
    score = judge.score(DATA / "gnss.pos")
    assert score.error.horizontal.max() < 1e-5
    assert np.isnan(score.error.attitude).all()
    assert any("which has no attitude" in sentence for sentence in score.sentences)
    assert any(re.search(r"own σ is 0\.01\d* m", sentence) for sentence in score.sentences)


def test_a_known_error_is_found(judge: Judge, tmp_path: Path) -> None:
    """Three metres to the north and one up, at the fixes' own instants and without velocity."""
    dates, places = raw_fixes()
    rows = [(float(d[-6:]) - 42.224, p) for d, p in zip(dates, places, strict=True) if "19:38:4" in d[:18]]
    north = np.degrees(3.0 / 6_362_000.0)
    text = "".join(f"{t:.3f},{p[0] + north:.12f},{p[1]:.12f},{p[2] + 1.0:.6f}\n" for t, p in rows if t > 0.0)
    (tmp_path / "mine.csv").write_text("time_s,latitude_deg,longitude_deg,height_m\n" + text)
    error = judge.score(tmp_path / "mine.csv").error
    # the meridian's radius at 40.1° is 6 361 960 m plus 1.6 km of height, to 1e-3
    np.testing.assert_allclose(error.position_ned[:, 0], 3.0, rtol=1e-3)
    np.testing.assert_allclose(error.position_ned[:, 2], -1.0, rtol=0, atol=1e-4)
    assert np.isnan(error.velocity_ned).all()


def test_the_command_and_its_results(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = shutil.copytree(folder, tmp_path / "run")
    assert command("export", run, "--to", "kf-gins", "-o", tmp_path / "kf", "-q") == 0
    assert command("score", run, tmp_path / "kf" / "aided.nav", "--name", "again") == 0
    assert "errors against the reference gnss.pos" in capsys.readouterr().out
    found = json.loads((run / "scores" / "again" / "score.json").read_text())
    own = json.loads((run / "summary.json").read_text())["filter"]["aided"]
    assert found["errors"]["rms_horizontal_error_m"] == pytest.approx(own["rms_horizontal_error_m"], rel=0.01)
    assert found["errors"]["rms_attitude_error_arcsec"] is None


def test_what_cannot_be_scored_says_why(folder: Path, judge: Judge, tmp_path: Path) -> None:
    run = shutil.copytree(folder, tmp_path / "run")
    scenario = (run / "scenario.toml").read_text()
    (run / "scenario.toml").write_text(scenario.replace("[log.reference]\n", "[log.reference]\ngap_s = 0.1\n"))
    score = Judge(RecordedRun(run), judge.start_gps_s).score(DATA / "gnss.pos")
    assert np.isfinite(score.error.horizontal).all(), "rows of the reference are known also where it has gaps"
    summary = json.loads((run / "summary.json").read_text())
    summary["log"]["reference_file"] = None
    (run / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(InputError, match="without a reference"):
        Judge(RecordedRun(run), judge.start_gps_s).score(DATA / "gnss.pos")
    with pytest.raises(InputError, match="truth"):
        export(folder, "csv", tmp_path / "x", solution=["truth"])
    with pytest.raises(InputError, match="PSINS needs a constant one"):
        export(folder, "psins", tmp_path / "y")
