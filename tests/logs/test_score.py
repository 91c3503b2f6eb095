"""Scores of solutions whose errors are known, and the truth between its samples against closed forms."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim import rotation
from sinssim.cli.app import main
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import InputError
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.formats.export_streams import export
from sinssim.logs.gps_time import match_clock, parse_date
from sinssim.logs.recorded_streams import Clock, SolutionStream
from sinssim.logs.reference_solution import TruthAt, interpolation_error
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario.schema import Scenario
from sinssim.scenario.true_motion import fly
from tests.logs.short_run import CONTENTS, short_run
from tests.recording.shown import still

START = parse_date(DEFAULT_START, "start")


@pytest.fixture(scope="module")
def judge() -> Judge:
    return Judge(RecordedRun(short_run()), START)


def call(*arguments: str) -> int:
    """Run the command line in this process and return its exit code."""
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    return stopped.value.code if isinstance(stopped.value.code, int) else 0


def write(path: Path, s: SolutionStream, *, velocity: bool = True, attitude: bool = True) -> Path:
    """Write a solution as CSV, independently of the package's writer."""
    names, parts = ["time_s", "latitude_rad", "longitude_rad", "height_m"], [s.time, s.latitude, s.longitude, s.height]
    if velocity:
        names += ["velocity_n_mps", "velocity_e_mps", "velocity_d_mps"]
        parts += list(s.velocity_ned.T)
    if attitude:
        names += ["q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"]
        parts += list(s.q_nb.T)
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack(parts).tolist())
    path.write_text(",".join(names) + "\n" + rows + "\n")
    return path


def test_the_truth_has_no_error(judge: Judge, tmp_path: Path) -> None:
    score = judge.score(write(tmp_path / "t.csv", judge.run.solution("truth")))
    assert score.error.horizontal.max() < 3e-9
    assert not score.error.velocity_ned.any()
    assert score.error.angle.max() < 3e-16
    assert "All rows are at samples of the truth." in score.sentences


def test_known_errors(judge: Judge, tmp_path: Path) -> None:
    """3 m north by the meridian's radius, 2 m high, 0.1 m/s down, 1 mrad about down."""
    t = judge.run.solution("truth")
    sine = np.sin(t.latitude)
    e2 = 1.0 / 298.257223563 * (2.0 - 1.0 / 298.257223563)
    r1 = 6378137.0 * (1.0 - e2) / (1.0 - e2 * sine**2) ** 1.5
    turn = rotation.quaternion_from_rotation_vector(np.array([0.0, 0.0, 1e-3]))
    off = replace(
        t,
        latitude=t.latitude + 3.0 / (r1 + t.height),
        height=t.height + 2.0,
        velocity_ned=t.velocity_ned + np.array([0.0, 0.0, 0.1]),
        q_nb=rotation.multiply(turn, t.q_nb),
    )
    e = judge.score(write(tmp_path / "off.csv", off)).error
    assert e.position_ned[:, 0] == pytest.approx(3.0, abs=3e-6)
    assert np.abs(e.position_ned[:, 1]).max() < 1e-8
    assert e.height == pytest.approx(2.0, abs=1e-9)
    assert e.velocity_ned[:, 2] == pytest.approx(0.1, abs=1e-14)
    assert e.attitude[:, 2] == pytest.approx(-1e-3, abs=1e-12)  # q_true = q(φ) q_solution


def test_same_numbers_as_the_runs_own_solution(judge: Judge, tmp_path: Path) -> None:
    """The run's own solution, exported and scored, has the errors that the run recorded."""
    for to in ("csv", "kf-gins", "psins"):
        export(judge.run.path, to, tmp_path / to, solution=["quaternion"])
    own = judge.run_errors(judge.span)["quaternion"]
    for file, metres in (
        ("csv/quaternion.csv", 1e-8),
        ("kf-gins/quaternion.nav", 1e-6),
        ("psins/quaternion.avp", 1e-6),
    ):
        e = judge.score(tmp_path / file).error
        assert np.abs(e.position_ned - own.position_ned).max() < metres
        assert np.abs(e.velocity_ned - own.velocity_ned).max() < 1e-10
        assert np.abs(e.attitude - own.attitude).max() < 1e-12


@pytest.mark.parametrize("to", ["tum", "euroc", "mcap", "sbet"])
def test_every_format_of_a_solution(judge: Judge, tmp_path: Path, to: str) -> None:
    if to == "mcap":
        pytest.importorskip("rosbags")
        pytest.importorskip("mcap")
    place = tmp_path / f"x.{to}"
    export(judge.run.path, to, place, solution=["quaternion"])
    own = judge.run_errors(judge.span)["quaternion"]
    e = judge.score(place).error
    assert np.abs(e.position_ned - own.position_ned).max() < 2e-6
    assert np.abs(e.attitude - own.attitude).max() < 1e-9
    if to != "tum":
        assert np.abs(e.velocity_ned - own.velocity_ned).max() < 1e-9


def test_between_samples_against_the_closed_form(judge: Judge) -> None:
    """A great circle known in closed form, at instants between the samples."""
    trajectory = fly(Scenario.model_validate(CONTENTS))
    time = np.random.default_rng(4).uniform(0.0, 20.0, 500)
    time[:3] = 0.0, 20.0, 0.011
    found, true = judge.truth.state(time), trajectory.state(time)
    here = geodetic_to_ecef(found.latitude, found.longitude, found.height)
    assert np.abs(here - geodetic_to_ecef(true.latitude, true.longitude, true.height)).max() < 1e-8
    assert np.abs(found.velocity_ned - true.velocity_ned).max() < 1e-9
    turn = rotation.multiply(found.q_nb, rotation.conjugate(true.q_nb))
    assert np.abs(rotation.rotation_vector_from_quaternion(turn)).max() < 1e-12


def rocking(step: float) -> SolutionStream:
    """A vehicle that goes in a circle of 100 m every 20 s and rocks by 20° every 4 s, in closed form."""
    time = np.arange(0.0, 20.0 + 1e-9, step)
    w, a = 2.0 * np.pi / 20.0, 100.0
    north, east = a * np.sin(w * time), a * (1.0 - np.cos(w * time))
    radius = 6378137.0
    r1 = radius * (1.0 - 0.0066943799901413165)
    velocity = np.column_stack((a * w * np.cos(w * time), a * w * np.sin(w * time), np.zeros_like(time)))
    roll = np.radians(20.0) * np.sin(2.0 * np.pi / 4.0 * time)
    q_nb = rotation.quaternion_from_euler(roll, 0.3 * roll, w * time)
    return SolutionStream(time, north / r1, east / radius, np.zeros_like(time), "ellipsoid", velocity, q_nb)


def test_error_falls_with_the_fourth_power_of_the_interval() -> None:
    exact = rocking(0.005)
    errors, estimates = [], []
    for every in (20, 10):
        part = replace(exact, **{k: v[::every] for k, v in vars(exact).items() if isinstance(v, np.ndarray)})
        found = TruthAt(part).state(exact.time)
        turn = rotation.multiply(found.q_nb, rotation.conjugate(exact.q_nb))
        place = geodetic_to_ecef(found.latitude, found.longitude, found.height)
        errors.append(
            (
                np.linalg.norm(place - geodetic_to_ecef(exact.latitude, exact.longitude, exact.height), axis=1).max(),
                np.linalg.norm(rotation.rotation_vector_from_quaternion(turn), axis=1).max(),
            )
        )
        estimates.append(interpolation_error(part))
    order = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert order == pytest.approx([4.0, 4.0], abs=0.3)
    # the estimate, which knows the samples only, is right within a factor of three
    assert np.array(estimates[1]) / np.array(errors[1]) == pytest.approx([1.0, 1.0], abs=0.67)


def test_antenna(judge: Judge, tmp_path: Path) -> None:
    """Fixes scored at the antenna have the noise of the receiver; at the block the lever arm besides."""
    export(judge.run.path, "kf-gins", tmp_path / "k")
    at_antenna = judge.score(tmp_path / "k" / "gnss.txt", antenna="gnss").error
    at_block = judge.score(tmp_path / "k" / "gnss.txt").error
    assert at_block.height.mean() - at_antenna.height.mean() == pytest.approx(1.5, abs=1e-3)
    sigma = judge.run.fix("gnss").position_sigma[0]
    # 100 fixes: the mean is within 4σ/10 with a probability of 0.9999 for each of three axes
    assert (np.abs(at_antenna.position_ned.mean(axis=0)) < 0.4 * sigma).all()
    with pytest.raises(InputError, match="GNSS receiver"):
        judge.score(tmp_path / "k" / "gnss.txt", antenna="glonass")


def test_what_is_missing_is_not_scored(judge: Judge, tmp_path: Path) -> None:
    path = write(tmp_path / "p.csv", judge.run.solution("truth"), velocity=False, attitude=False)
    score = judge.score(path)
    assert np.isnan(score.error.velocity_ned).all()
    assert np.isnan(score.error.attitude).all()
    assert any("no velocity and no attitude" in sentence for sentence in score.sentences)


@pytest.mark.parametrize(
    ("shift", "said"), [(0.0, "those of the run"), (START % 604800, "GPS week"), (START % 86400, "day, GPS time")]
)
def test_clocks_without_a_date(judge: Judge, tmp_path: Path, shift: float, said: str) -> None:
    t = judge.run.solution("truth")
    moved = replace(t, time=np.round(t.time[200:800] + shift, 6), **{
        k: v[200:800] for k, v in vars(t).items() if isinstance(v, np.ndarray) and k != "time"
    })  # fmt: skip
    score = judge.score(write(tmp_path / "m.csv", moved))
    assert any(said in sentence for sentence in score.sentences), score.sentences
    assert score.error.time[0] == pytest.approx(4.0, abs=1e-6) if shift > 100 else True


def test_no_overlap_is_refused() -> None:
    clock = Clock("gps", START + 10_000, "seconds")
    with pytest.raises(InputError, match=r"does not overlap the run.*2026-01-01T02:46:40Z.*--start"):
        match_clock(clock, np.array([0.0, 5.0]), START, (0.0, 20.0), "x")
    with pytest.raises(InputError, match="clock without a date"):
        match_clock(Clock("machine"), np.array([5e5, 5.1e5]), START, (0.0, 20.0), "x")


def test_time_in_order(judge: Judge, tmp_path: Path) -> None:
    t = judge.run.solution("truth")
    time = t.time.copy()
    time[500] = time[499]
    with pytest.raises(InputError, match="row 501: its time is not after"):
        judge.score(write(tmp_path / "d.csv", replace(t, time=time)))


def test_readings_are_no_solution(judge: Judge, tmp_path: Path) -> None:
    export(judge.run.path, "csv", tmp_path / "c")
    with pytest.raises(InputError, match="holds no positions"):
        judge.score(tmp_path / "c" / "imu.csv")


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The whole way: a copy of the run, three solutions, the report, and the mark of the directory."""
    run = tmp_path / "short"
    shutil.copytree(short_run(), run)
    before = {p: p.read_bytes() for p in run.rglob("*") if p.is_file() and p.name != ".sinssim.json"}
    for arguments in (["--to", "nmea"], ["--to", "kf-gins", "--solution", "aided"]):
        assert call("export", str(run), *arguments) == 0
    capsys.readouterr()
    files = [str(tmp_path / "short-kf-gins" / "aided.nav"), str(tmp_path / "short.nmea")]
    names = ["--name", "kf", "--name", "mine", "--time-s", "2", "--time-s", "1.5"]
    assert call("score", str(run), *files, *names, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["errors"]["kf"]["rms_horizontal_error_m"] == pytest.approx(
        found["errors"]["aided"]["rms_horizontal_error_m"], abs=1e-6
    )
    assert found["errors"]["mine"]["rms_attitude_error_arcsec"] is None
    assert found["scores"][1]["compute_s"] == 1.5
    page = (run / "scores" / "report.html").read_text()
    for word in ("mine", "kf", "aided", "quaternion", "Ranking", "no attitude"):
        assert word in page
    # a name has one colour: in the table's swatch and in every legend
    swatches = {name: color for color, name in re.findall(r'background:(#\w+)"></span>([\w ]+?)(?: \*)?</td>', page)}
    for name in ("mine", "kf"):
        drawn = re.findall(rf'stroke="(#\w+)" stroke-width[^<]*/><text[^>]*>{name}</text>', page)
        assert set(drawn) == {swatches[name]}, name
    assert "nan" not in still(page).lower().replace("navigation", "")
    assert all(p.read_bytes() == raw for p, raw in before.items()), "the run stays as it was"
    marked = json.loads((run / ".sinssim.json").read_text())["files"]
    assert {
        "scores/mine/score.json",
        "scores/kf/error_kf.parquet",
        "scores/report.html",
        "scores/recording.rrd",
    } <= set(marked)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--name", "truth"], "already"),
        (["--name", "../x"], "letters, digits"),
        (["--name", "a", "--name", "b"], "2 times for 1"),
        (["--time-s", "-1"], "must be positive"),
        (["--format", "rinex"], "unknown format"),
        (["--start", "2020-01-01"], "does not overlap"),
    ],
)
def test_bad_input(tmp_path: Path, options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "s.tum"
    export(short_run(), "tum", path)
    assert call("score", str(short_run()), str(path), *options) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not (short_run() / "scores").exists()
