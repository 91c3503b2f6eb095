"""The align command: scenarios and logs, tables, JSON, figures, refusals."""

from __future__ import annotations

import importlib
import json

import numpy as np
import pytest
from matplotlib.text import Text
from pyarrow import csv, table
from rerun.chunk import RrdReader

from scenarios.support.swaying import Sway, Swaying
from sinssim.alignment import Angles, Determination, ideal_readings
from sinssim.alignment.determination import Flags
from sinssim.analyses.alignment_result import AlignmentResult, align_session
from sinssim.analyses.alignment_session import _part, align
from sinssim.cli.app import main
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import runs_in
from sinssim.recording import figures
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from tests.recording.shown import curves_of
from tests.slow import slow

SCENARIO = """
name = "car"
seed = 3
[parked]
latitude_deg = 50.0
roll_deg = 1.0
pitch_deg = -2.0
heading_deg = 123.0
duration_s = 300.0
[imu]
grade = "laser-standard"
rate_hz = 10.0
"""


@pytest.fixture
def scenario(tmp_path):
    file = tmp_path / "car.toml"
    file.write_text(SCENARIO)
    return str(file)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as info:
        main(["align", *arguments])
    captured = capsys.readouterr()
    return info.value.code or 0, captured.out, captured.err


def write_log(path, imu):
    rates = np.hstack([imu.dtheta, imu.dvel]) / np.diff(imu.time)[:, None]
    csv.write_csv(table({"t": imu.time[1:], **dict(zip("abcdef", rates.T, strict=True))}), path)
    description = path.with_suffix(".toml")
    description.write_text(
        'kind = "rates"\ntime = "t"\ntime_unit = "s"\n[gyro]\ncolumns = ["a", "b", "c"]\nunit = "rad/s"\n'
        '[accel]\ncolumns = ["d", "e", "f"]\nunit = "m/s^2"\n'
    )
    return str(path), str(description)


def test_a_scenario_as_json(scenario, capsys):
    code, out, _ = run(capsys, scenario, "--json")
    assert code == 0
    result = json.loads(out)
    assert result["samples"] == 3000
    for name, true in (("heading", 123.0), ("roll", 1.0), ("pitch", -2.0), ("latitude", 50.0)):
        sigma, error = result["sigma_arcmin"][name], result["error_arcmin"][name]
        assert abs(error) < 4 * sigma
        assert (result[f"{name}_deg"] - true) * 60 == pytest.approx(error, abs=1e-6)
    # 0.01 deg/h over 15.041 cos 50° deg/h
    assert result["sigma_by_source_arcmin"]["gyro bias"]["heading"] == pytest.approx(3.556, abs=0.01)
    assert result["bias_takes_over_s"]["heading"] == pytest.approx(322, abs=1)


def test_a_scenario_as_tables(scenario, capsys):
    code, out, _ = run(capsys, scenario)
    assert code == 0
    for word in ("heading", "latitude", "gyro bias", "angle random walk", "total", "Earth rate", "true"):
        assert word in out


def test_a_log_gives_what_the_scenario_gives(scenario, tmp_path, capsys):
    from sinssim.scenario import load_scenario
    from sinssim.scenario.true_motion import fly

    plan = load_scenario(scenario)
    log, description = write_log(tmp_path / "log.csv", emulate(fly(plan).increments(10.0), plan.imu, plan.seed))
    from_log = align(log, columns=tmp_path / "log.toml", grade="laser-standard")
    direct = align(scenario)
    np.testing.assert_allclose(from_log.determination.attitude, direct.determination.attitude, rtol=1e-9)
    assert from_log.truth is None
    code, out, _ = run(capsys, log, "--columns", description, "--to", "120", "--json")
    assert code == 0
    assert json.loads(out)["duration_s"] == pytest.approx(120.0)
    assert "sigma_arcmin" not in json.loads(out)


def test_errors_that_a_scenario_fixes_are_told_beforehand(scenario, capsys):
    code, out, _ = run(
        capsys, scenario, "--json", "--set", "imu.gyro_bias_deg_h=[0.05, -0.03, 0.02]", "--set", "imu.grade=ideal",
        "--set", "imu.gyro_misalignment_arcsec=[90.0, -50.0, 70.0, 200.0, -30.0, 120.0]",
        "--set", "imu.accel_misalignment_arcsec=[40.0, 10.0, -20.0, 5.0, 60.0, -25.0]",
        "--set", "imu.accel_scale_ppm=[100.0, -200.0, 50.0]",
    )  # fmt: skip
    assert code == 0
    result = json.loads(out)
    for name in ("heading", "roll", "pitch", "latitude"):
        assert result["known_error_arcmin"][name] == pytest.approx(result["error_arcmin"][name], rel=0.01, abs=1e-6)


@pytest.mark.parametrize("method", ["quiet", "disturbed"])
def test_a_block_on_its_back_in_a_log_is_doubted(tmp_path, method):
    """Forward-left-up axes taken for forward-right-down, or accelerometers of the opposite sign, look like that."""
    gyro, accel = ideal_readings(0.3, 0.02, 0.1, 0.9)
    count, dt = 400, 0.25
    increments = [np.tile(reading * [1, -1, -1] * dt, (count, 1)) for reading in (gyro, accel)]
    flipped = ImuData(np.arange(count + 1) * dt, *increments)
    log, _ = write_log(tmp_path / "log.csv", flipped)
    report = align(log, columns=tmp_path / "log.toml", method=method)
    assert "is upside down (roll" in report.determination.warnings[-1]
    (tmp_path / "log.toml").write_text('axes = ["forward", "left", "up"]\n' + (tmp_path / "log.toml").read_text())
    report = align(log, columns=tmp_path / "log.toml", method=method)
    assert report.determination.warnings == ()
    np.testing.assert_allclose(report.determination.attitude, [0.3, 0.02, 0.1], rtol=0, atol=1e-6)


def test_a_swaying_vehicle_is_refused_and_then_aligned(tmp_path, capsys):
    sways = [Sway("roll", 0.005, 0.3117), Sway("pitch", 0.005, 0.1731, 1.0), Sway("heading", 0.005, 0.2319, 2.0)]
    truth = Swaying(np.radians(50.0), 0.3, 0.0, 0.0, 0.0, 1.0, 300.0, sways)
    imu = emulate(truth.increments(20.0), Imu(grade="laser-standard"), 1)
    log, description = write_log(tmp_path / "sway.csv", imu)
    code, _, err = run(capsys, log, "--columns", description)
    assert code == 2
    assert "moved during the session" in err
    code, out, _ = run(capsys, log, "--columns", description, "--disturbed", "--grade", "laser-standard", "--json")
    assert code == 0
    result = json.loads(out)
    at_end = 1.0 + 0.005 * np.sin(2 * np.pi * 0.2319 * 300.0 + 2.0)
    assert abs(result["heading_deg"] - np.degrees(at_end)) * 60 < 4 * result["sigma_arcmin"]["heading"]
    assert result["residual_velocity_mps"] < 0.05
    off = result["eq_1_on_the_same_data_deg"]["heading"] - np.degrees(1.0)
    assert abs(off) * 60 > 20 * result["sigma_arcmin"]["heading"]  # the same data, taken for a quiet base
    code, out, _ = run(
        capsys, log, "--columns", description, "--disturbed", "--grade", "laser-standard", "--latitude", "50"
    )
    assert code == 0
    assert "eq. (1)" in out


def test_a_swaying_scenario_is_compared_with_its_last_instant(scenario, monkeypatch):
    turning = Swaying(np.radians(50.0), 0.3, 0.0, 0.0, 0.0, 1.0, 300.0, [Sway("heading", 0.01, 1 / 400)])
    monkeypatch.setattr(importlib.import_module("sinssim.scenario.true_motion"), "fly", lambda plan: turning)
    report = align(scenario, method="disturbed", latitude=np.radians(50.0), overrides=("imu.grade=ideal",))
    assert report.truth.heading == pytest.approx(1.0 + 0.01 * np.sin(1.5 * np.pi), abs=1e-9)
    assert abs(report.error.heading) < 1e-6


def test_figures_are_written_whole_or_not_at_all(scenario, tmp_path, capsys, monkeypatch):
    drawn, save = [], figures.save
    monkeypatch.setattr(figures, "save", lambda figure, path: (drawn.append(figure), save(figure, path)))
    code, _, _ = run(capsys, scenario, "--plot", str(tmp_path / "expected.svg"))
    assert code == 0
    assert "<svg" in (tmp_path / "expected.svg").read_text()
    written = {text.get_text() for text in drawn[0].findobj(Text)}
    for label in ("σ [arcmin]", "σ [arcsec]", "session length T [s]", "σ of the latitude [arcmin]", "total"):
        assert label in written
    code, _, err = run(capsys, scenario, "--plot", str(tmp_path / "expected.gif"))
    assert code == 2
    assert ".svg" in err
    assert not list(tmp_path.glob(".*part"))


def recorded(path):
    """The last row of every series of a recording, by entity, and the number of rows."""
    rows = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith("Scalars:scalars"):
                rows[chunk.entity_path] = (np.array(batch.column(name)[-1].as_py()), batch.num_rows)
    return rows


def test_a_session_is_recorded(scenario, tmp_path, capsys):
    code, out, _ = run(capsys, scenario, "--json", "--record", str(tmp_path / "new" / "session.rrd"))
    assert code == 0
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["session.rrd"]
    assert run(capsys, scenario, "--json", "-o", str(tmp_path / "whole"))[1] == out
    assert (tmp_path / "whole" / "recording.rrd").stat().st_size > 1000
    keys = [chart["key"] for chart in curves_of(tmp_path / "whole" / "report.html")]
    names = ("heading", "roll", "pitch", "latitude")
    assert keys == [*(f"angles/{name}" for name in names), "turn", "velocity", *(f"length/{name}" for name in names)]
    assert [entry.kind for entry in runs_in(tmp_path)] == ["alignment"]
    result, rows = json.loads(out), recorded(tmp_path / "new" / "session.rrd")
    for name, true in (("heading", 123.0), ("roll", 1.0), ("pitch", -2.0), ("latitude", 50.0)):
        value, sigma = result[f"{name}_deg"], result["sigma_arcmin"][name] / 60
        last, _ = rows[f"/session/angles/{name}"]
        np.testing.assert_allclose(last, [value, value + sigma, value - sigma, true], rtol=0, atol=1e-9)
    last, count = rows["/session/turn"]
    np.testing.assert_allclose(last, 0.0, rtol=0, atol=1e-6)  # the steady turn begins and ends with the session
    assert count == 3001
    code, out, _ = run(capsys, scenario, "--json", "--disturbed", "--record", str(tmp_path / "sway.rrd"))
    assert code == 0
    assert set(recorded(tmp_path / "sway.rrd")) == {"/session/turn", "/session/velocity"}


@pytest.mark.parametrize("method", ["quiet", *slow("disturbed")])
def test_headings_lie_in_the_range_of_the_scenario(scenario, tmp_path, capsys, method):
    """300.12° is −59.88° in the range −90°…270° of the formulas: as numbers, in the tables and in the recording."""
    settings = ["--set", "parked.heading_deg=300.12", "--set", 'output.angles="-90..270"']
    options = [*settings, *(["--disturbed"] if method == "disturbed" else [])]
    code, out, _ = run(capsys, scenario, "--json", "--record", str(tmp_path / "session.rrd"), *options)
    assert code == 0
    result = json.loads(out)
    found = result["heading_deg"]
    assert found == pytest.approx(-59.88, abs=4 * result["sigma_arcmin"]["heading"] / 60)
    assert (found + 59.88) * 60 == pytest.approx(result["error_arcmin"]["heading"], abs=1e-6)
    code, out, _ = run(capsys, scenario, *options)
    assert f"{found:.5f}" in out
    assert "-59.88000" in out  # the true one
    assert "300." not in out.split("Measured:")[0].split("\n", 1)[1]
    if method == "quiet":
        last, _ = recorded(tmp_path / "session.rrd")["/session/angles/heading"]
        np.testing.assert_allclose(last[[0, 3]], [found, -59.88], rtol=0, atol=1e-9)
    else:
        assert result["eq_1_on_the_same_data_deg"]["heading"] == pytest.approx(found, abs=1.0)


@pytest.mark.parametrize(("option", "name"), [("--record", "session.rrd"), *slow(("--plot", "expected.svg"))])
def test_what_cannot_be_written_is_named(scenario, tmp_path, capsys, option, name):
    (tmp_path / "file").write_text("")  # where a folder would have to be
    code, _, err = run(capsys, scenario, option, str(tmp_path / "file" / name))
    assert code == 1
    assert "cannot be written" in err


def test_nothing_is_plotted_where_nothing_is_expected(scenario):
    report = align(scenario, overrides=("parked.latitude_deg=90",))
    assert np.isnan(report.determination.heading)
    with pytest.raises(InputError, match="nothing to plot"):
        report.plot()


def test_what_is_not_determined_is_said_and_null(scenario, capsys):
    code, out, _ = run(capsys, scenario, "--json", "--set", "parked.pitch_deg=90")
    result = json.loads(out)
    assert code == 0
    assert result["heading_deg"] is None
    assert any("vertical" in warning for warning in result["warnings"])
    code, out, _ = run(capsys, scenario, "--set", "parked.pitch_deg=90")
    assert "not determined" in out


def test_gyros_that_cannot_see_the_earth_turn(scenario, capsys):
    code, out, _ = run(capsys, scenario, "--json", "--set", "imu.grade=mems-industrial")
    result = json.loads(out)
    assert code == 0
    assert result["heading_deg"] is None
    assert abs(result["roll_deg"] - 1.0) < np.degrees(4 * 2e-3)  # of 2 mg


@pytest.mark.parametrize("options", [[], ["--grade", "tactical"], ["--columns", "columns.toml"]])
@pytest.mark.parametrize("name", ["FILE.pos", "run"])
def test_what_is_neither_log_nor_scenario_is_said(tmp_path, capsys, name, options):
    (tmp_path / "FILE.pos").write_text("% solution of a receiver\n")
    (tmp_path / "run").mkdir()
    code, out, err = run(capsys, str(tmp_path / name), *options)
    assert (code, out) == (2, "")
    said = " ".join(err.split())
    assert "is neither a log nor a scenario" in said
    assert ("ends in .pos" if name == "FILE.pos" else "imu_measured.parquet") in said
    for suffix in (".csv", ".parquet", ".npz", ".toml"):
        assert suffix in said
    assert "describes its own sensors" not in said


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nothing.csv"], "cannot be read"),
        (["nothing.toml"], "nothing"),
        (["SCENARIO", "--grade", "tactcal"], "Did you mean 'tactical'?"),
        (["SCENARIO", "--from", "400"], "no session from 400"),
        (["SCENARIO", "--to", "1"], "samples"),
        (["SCENARIO", "--disturbed", "--latitude", "95"], "between -90 and 90"),
        (["SCENARIO", "--disturbed", "--to", "30"], "at least 60 s"),
        (["SCENARIO", "--latitude", "50"], "determines the latitude itself"),
        (["LOG", "--set", "imu.grade=tactical"], "for scenarios"),
        (["LOG", "--grade", "best"], "best"),
    ],
)
def test_mistakes_are_named(scenario, tmp_path, capsys, arguments, text):
    (tmp_path / "log.csv").write_text("time_s\n1\n")
    names = {"SCENARIO": scenario, "LOG": str(tmp_path / "log.csv")}
    code, out, err = run(capsys, *(names.get(argument, argument) for argument in arguments))
    assert code == 2
    assert text in err
    assert out == ""


def angles(*values: float) -> Angles:
    return Angles(*(np.asarray(value) for value in values))


def test_every_number_of_the_report_with_its_unit() -> None:
    """By hand: an error across north, a sum of squares of 3 and 4, an undetermined latitude."""
    found = Determination(
        *(np.asarray(x) for x in (np.radians(0.5), np.radians(-2.0), np.radians(3.0), np.nan, 5e-5, 9.81)),
        Flags(*(np.asarray(flag) for flag in (False, False, False, True))), ("one.", "two."),
    )  # fmt: skip
    report = AlignmentResult(
        "car.csv", "disturbed", ImuData(np.array([7.0, 8.5, 11.0, 20.0]), np.zeros((3, 3)), np.zeros((3, 3))), found,
        mean=angles(*np.radians([1.0, 2.0, 3.0, 4.0]) / 60.0),
        budget={"gyro bias": angles(*np.radians([3.0, 6.0, 9.0, 0.0]) / 60.0),
                "angle random walk": angles(*np.radians([4.0, 8.0, 12.0, 5.0]) / 60.0)},
        crossing=angles(100.0, np.inf, 0.0, 300.0),
        truth=angles(*np.radians([359.75, -2.5, 3.5, 50.0])),
        residual=0.0123, mean_angles=angles(*np.radians([10.0, 20.0, 30.0, 40.0])),
    )  # fmt: skip

    def named(*values: float | None) -> dict[str, object]:
        numbers = [None if value is None else pytest.approx(value, rel=1e-9) for value in values]
        return dict(zip(("heading", "roll", "pitch", "latitude"), numbers, strict=True))

    assert report.summary == {
        "source": "car.csv", "method": "disturbed", "duration_s": 13.0, "samples": 3,
        "heading_deg": pytest.approx(0.5), "roll_deg": pytest.approx(-2.0), "pitch_deg": pytest.approx(3.0),
        "latitude_deg": None,
        "earth_rate_deg_h": pytest.approx(np.degrees(5e-5) * 3600.0), "gravity_mps2": 9.81,
        "warnings": ["one.", "two."],
        "residual_velocity_mps": 0.0123, "eq_1_on_the_same_data_deg": named(10.0, 20.0, 30.0, 40.0),
        "error_arcmin": named(45.0, 30.0, -30.0, None), "known_error_arcmin": named(1.0, 2.0, 3.0, 4.0),
        "sigma_arcmin": named(5.0, 10.0, 15.0, 5.0),
        "sigma_by_source_arcmin": {"gyro bias": named(3.0, 6.0, 9.0, 0.0),
                                   "angle random walk": named(4.0, 8.0, 12.0, 5.0)},
        "bias_takes_over_s": named(100.0, None, 0.0, 300.0),
    }  # fmt: skip


def test_a_part_of_a_session_holds_both_its_ends() -> None:
    imu = ImuData(
        np.array([7.0, 7.5, 8.5, 10.0, 12.0]), np.arange(12.0).reshape(4, 3), 20.0 + np.arange(12.0).reshape(4, 3)
    )
    for start, end, first, last in ((7.5, 10.0, 1, 3), (None, 8.5, 0, 2), (8.0, None, 2, 4), (7.4, 11.9, 1, 3)):
        part = _part(imu, start, end, "car")
        np.testing.assert_array_equal(part.time, imu.time[first : last + 1])
        np.testing.assert_array_equal(part.dtheta, imu.dtheta[first:last])
        np.testing.assert_array_equal(part.dvel, imu.dvel[first:last])
    with pytest.raises(InputError) as info:
        _part(imu, 8.6, 11.0, "car")
    assert str(info.value) == "car: there is no session from 8.6 to 11.0 s; the data run from 7 to 12 s."


def test_a_quiet_scenario_is_compared_with_the_middle_of_its_part(scenario, monkeypatch):
    """A heading that moves by 2 mas is within rounding of the test for motion."""
    turning = Swaying(np.radians(50.0), 0.3, 0.0, 0.01, 0.02, 1.0, 300.0, [Sway("heading", 1e-8, 1 / 1200)])
    monkeypatch.setattr(importlib.import_module("sinssim.scenario.true_motion"), "fly", lambda plan: turning)
    report = align(scenario, start=60.0, end=260.0, overrides=("imu.grade=ideal",))
    assert float(report.truth.heading) - 1.0 == pytest.approx(1e-8 * np.sin(2 * np.pi * 160.0 / 1200.0), rel=1e-6)
    np.testing.assert_allclose(
        [report.truth.roll, report.truth.pitch, report.truth.latitude], [0.01, 0.02, np.radians(50)]
    )
    assert (report.warmed, report.duration, report.samples) == (60.0, 200.0, 2000)


def test_the_expected_errors_of_a_session_that_begins_warm() -> None:
    """Level, to the north: a ramp R of the right gyro is R (t + T/2)/(U cos φ) of heading, a bias of the forward
    accelerometer b/g of pitch; the noise is that of T, the crossing that of both."""
    imu = session_to_the_north()
    section = Imu(
        grade="ideal", gyro_ramp_sigma_deg_h_per_h=0.5, accel_bias_sigma_ug=30.0, gyro_arw_deg_sqrt_h=0.001,
        gyro_bias_deg_h=(0.0, 0.002, 0.0),
    )  # fmt: skip
    report = align_session(imu, "here", section, warmed=70.0)
    horizontal = np.radians(15.041067 / 3600.0) * np.cos(0.9)
    ramp = np.radians(0.5 / 3600.0) / 3600.0 * (70.0 + 50.0)
    walk = np.radians(0.001) / 60.0 / np.sqrt(100.0)
    assert report.budget is not None
    assert report.budget["gyro ramp"].heading == pytest.approx(ramp / horizontal, rel=1e-4)
    assert report.budget["angle random walk"].heading == pytest.approx(walk / horizontal, rel=1e-4)
    assert report.budget["accelerometer bias"].pitch == pytest.approx(30e-6 * 9.80665 / 9.81, rel=1e-3)
    assert report.mean is not None
    assert report.mean.heading == pytest.approx(-np.radians(0.002 / 3600.0) / horizontal, rel=1e-4)
    # N/√T = √(R² (70 s + T/2)²), with the tilts' part by tan φ and the accelerometer to the right
    tilt = np.tan(0.9) * 30e-6
    length = report.crossing.heading
    lasting = np.hypot(np.radians(0.5 / 3600.0) / 3600.0 * (70.0 + 0.5 * length) / horizontal, tilt)
    assert walk * np.sqrt(100.0 / length) / horizontal == pytest.approx(lasting, rel=2e-3)
    assert (report.method, report.warmed, report.samples) == ("quiet", 70.0, 400)
    for latitude, method in ((None, "disturbed"), (0.9, "disturbed, latitude known")):
        report = align_session(imu, "here", section, method="disturbed", latitude=latitude)
        assert report.method == method
        assert report.mean_angles is not None
        assert (report.budget["angle random walk"].latitude == 0.0) == (latitude is not None)


def session_to_the_north() -> ImuData:
    gyro, accel = ideal_readings(0.0, 0.0, 0.0, 0.9)
    return ImuData(3.0 + 0.25 * np.arange(401), np.tile(gyro * 0.25, (400, 1)), np.tile(accel * 0.25, (400, 1)))
