"""A scenario with [track]: from the file to the run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim import InputError, load_scenario, run
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import fly
from sinssim.truth.track_curve import TrackCurve

ROUTE = """
waypoints = [
  {latitude_deg = 51.5, longitude_deg = -0.5, speed_mps = 15.0, stop_s = 10.0},
  {name = "corner", latitude_deg = 51.503, longitude_deg = -0.5, turn_radius_m = 20.0},
  {latitude_deg = 51.503, longitude_deg = -0.495, stop_s = 10.0},
]
"""


def table(seconds: int = 60) -> str:
    rows = [f"{t},{51.5 + 1e-4 * t:.6f},-0.1,{20 + 0.1 * t}" for t in range(seconds)]
    return "\n".join(["time_s,latitude_deg,longitude_deg,height_m", *rows])


def scenario(folder: Path, keys: str, text: str | None = None, *overrides: str) -> Any:
    (folder / "drive.csv").write_text(table() if text is None else text, encoding="utf-8")
    file = folder / "drive.toml"
    file.write_text(f"[track]\n{keys}\n", encoding="utf-8")
    return load_scenario(file, overrides)


def refusal(folder: Path, keys: str, text: str | None = None) -> str:
    with pytest.raises(InputError) as error:
        fly(scenario(folder, keys, text))
    return str(error.value)


def test_file_is_relative_to_the_scenario(tmp_path: Path) -> None:
    made = scenario(tmp_path, 'file = "drive.csv"')
    trajectory = fly(made)
    assert isinstance(trajectory, TrackCurve)
    assert expected_duration(made) == trajectory.end == 59.0
    assert made.navigation.vertical == "baro-loop"


def test_plan_says_how_it_fits_and_what_is_assumed(tmp_path: Path) -> None:
    text = "\n".join(plan_lines(scenario(tmp_path, 'file = "drive.csv"\nvehicle = "sea"')))
    assert "60 rows, median interval 1 s" in text
    assert "distance from the samples horizontal below 1 µm" in text
    assert "no pitch, no roll" in text


def test_doubtful_motion_is_warned_of(tmp_path: Path) -> None:
    rows = [f"{t},{51.5 + 1.5e-4 * t + 4e-5 * (t % 2)},-0.1,0" for t in range(30)]
    text = "\n".join(["time_s,latitude_deg,longitude_deg,height_m", *rows])
    made = scenario(tmp_path, 'file = "drive.csv"\nsmoothing_s = 0.0\nstandstill_mps = 5.0', text)
    notes = "\n".join(plan_lines(made))
    assert "WARNING: The largest acceleration" in notes
    assert "smooth more with track.smoothing_s" in notes


def test_cut_and_height_offset(tmp_path: Path) -> None:
    keys = ("start_s = 10.0", "end_s = 40.0", "height_offset_m = 47.5", "smoothing_s = 0.0")
    made = scenario(tmp_path, "\n".join(('file = "drive.csv"', *keys)))
    trajectory = fly(made)
    assert trajectory.end == pytest.approx(30.0)
    assert trajectory.state(0.0).height == pytest.approx(20.0 + 1.0 + 47.5, abs=1e-6)


def test_offset_is_the_height_where_none_is_recorded(tmp_path: Path) -> None:
    text = "\n".join(line.rsplit(",", 1)[0] for line in table().splitlines())
    trajectory = fly(scenario(tmp_path, 'file = "drive.csv"\nheight_offset_m = 47.5', text))
    assert trajectory.state(30.0).height == pytest.approx(47.5, abs=1e-6)


def test_sparse_samples_are_warned_of(tmp_path: Path) -> None:
    """A kilometre north in ten seconds between two stops of which only the ends are known: a spline swings."""
    rows = [f"{t},{51.5 + (0.01 if t >= 100 else 0.0)},-0.1,0" for t in (0, 30, 60, 90, 100, 130, 160, 190)]
    text = "\n".join(["time_s,latitude_deg,longitude_deg,height_m", *rows])
    assert "too far apart for their turns" in "\n".join(plan_lines(scenario(tmp_path, 'file = "drive.csv"', text)))


def test_wrong_unit_of_time_is_warned_of(tmp_path: Path) -> None:
    rows = [f"{1000 * t},{51.5 + 1e-4 * t},-0.1,0" for t in range(12)]
    text = "\n".join(["time_s,latitude_deg,longitude_deg,height_m", *rows])
    assert "Check the unit of the times" in "\n".join(plan_lines(scenario(tmp_path, 'file = "drive.csv"', text)))


def test_the_truth_of_a_run_is_a_track(tmp_path: Path) -> None:
    """The streams of a run, taken as a track, give the same truth."""
    first = run(scenario(tmp_path, ROUTE, None, "imu.grade=ideal"), tmp_path / "first")
    stream = tmp_path / "first" / "streams" / "truth.parquet"
    again = tmp_path / "again.toml"
    again.write_text(f'[track]\nfile = "{stream}"\nsmoothing_s = 0.0\nattitude_smoothing_s = 0.0\n', encoding="utf-8")
    second = fly(load_scenario(again))
    t = first.truth.time[50:-50:37] + 0.003
    one, other = first.truth.trajectory.state(t), second.state(t)
    assert np.abs(one.latitude - other.latitude).max() * 6.4e6 < 1e-6
    assert np.abs(one.velocity_ned - other.velocity_ned).max() < 1e-5
    assert np.abs(one.q_nb - other.q_nb).max() < 1e-9


def test_run_says_it_in_summary_report_and_events(tmp_path: Path) -> None:
    made = run(scenario(tmp_path, 'file = "drive.csv"'), tmp_path / "run")
    numbers = json.loads((tmp_path / "run" / "summary.json").read_text())["track"]
    assert numbers["samples"] == 60
    assert numbers["rms_horizontal_from_samples_m"] < 0.1
    report = (tmp_path / "run" / "report.html").read_text()
    assert "The recorded track" in report
    assert "Distance of the curve from the samples" in report
    assert made.summary["track"]["attitude"].startswith("assumed: heading along the track")


@pytest.mark.slow
def test_planned_route_in_the_report(tmp_path: Path) -> None:
    run(scenario(tmp_path, ROUTE), tmp_path / "run")
    report = (tmp_path / "run" / "report.html").read_text()
    assert "The planned route" in report
    assert "corner" in report


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    made = scenario(tmp_path, 'file = "drive.csv"')
    before, plan = expected_duration(made), make_plan(made)
    (tmp_path / "drive.csv").write_text(table(80), encoding="utf-8")
    assert (before, expected_duration(made)) == (59.0, 79.0)
    assert make_plan(made).digest != plan.digest


LINE = """<kml><Placemark><LineString><coordinates>
-0.1,51.5,10 -0.1,51.501,10 -0.1,51.501,10 -0.1,51.502,11 -0.1,51.503,12
</coordinates></LineString></Placemark></kml>
"""


def test_path_without_times_is_travelled_at_a_speed(tmp_path: Path) -> None:
    (tmp_path / "path.kml").write_text(LINE, encoding="utf-8")
    trajectory = fly(scenario(tmp_path, 'file = "path.kml"\nspeed_mps = 10.0'))
    assert trajectory.end == pytest.approx(33.38, abs=0.01)  # 333.8 m
    assert isinstance(trajectory, TrackCurve)
    assert "travelled at 10 m/s" in " ".join(trajectory.fit.notes)
    assert "left out: 1." in " ".join(trajectory.fit.notes)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("", "is needed"),
        ('file = "drive.csv"\nformat = "gps"', "unknown format 'gps'"),
        ('file = "nowhere.csv"', "cannot be read"),
        ('file = "drive.toml"', "is in no known format"),
        ('file = "drive.csv"\nacceleration_mps2 = 1.0', "no effect on a recorded track"),
        ('file = "drive.csv"\nspeed_mps = 1.0', "track.speed_mps = 1 would have no effect"),
        ('file = "drive.csv"\nstream = "gnss"', "Known: solution"),
        ('file = "drive.csv"\nsmoothing_s = 1.0\nposition_sigma_m = 1.0', "remove one of them"),
        ('file = "drive.csv"\nstart_s = 5.0\nend_s = 4.0', "end_s = 4 must be later"),
        ('file = "drive.csv"\nstart_s = 500.0', "leave no row"),
        ('file = "drive.csv"\nstart_s = 59.0', "single row"),
        (ROUTE + "gap_s = 3.0", "no effect on a planned route"),
        ('waypoints = [{latitude_deg = 1.0, longitude_deg = 2.0, speed_mps = 3.0}]', "at least two waypoints"),
    ],
)  # fmt: skip
def test_refusals(tmp_path: Path, keys: str, words: str) -> None:
    assert words in refusal(tmp_path, keys)
