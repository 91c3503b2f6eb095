"""What each command hands on, and what it prints: options in the right units, paths, and files that are named."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.cli.commands.conftest import Put, Sinssim


def view(folder: str) -> str:
    return f"View:   sinssim view {folder}    (--web: in a browser)\n"


def report(folder: str) -> str:
    return f"Report: {folder}/report.html    (in any browser)\n"


SUMMARY = {"name": "µ", "value": 1.5}


def test_run(sinssim: Sinssim, put: Put) -> None:
    """The summary is named if there is no report; the recording only if there is one."""
    ran = put("experiments.run.run_execution.run", SimpleNamespace(summary=SUMMARY))
    brief, opened = put("experiments.run.run_report.brief", "brief"), put("recording.rerun_viewer.open_viewer")
    shown = put("recording.console.show_items")
    assert sinssim("run", "parked") == report("runs/parked") + view("runs/parked")
    plan, place = ran.args
    assert (plan.name, place) == ("parked", Path("runs/parked"))
    assert ran.options == {"overwrite": False, "require": (), "progress": False, "viewer": None}
    assert (brief.args[0].summary, brief.args[1], shown.args[0]) == (SUMMARY, SUMMARY, "brief")
    assert shown.args[1].width >= 120
    assert sinssim("run", "parked", "-o", "a/b", "--keep", "summary") == "Summary: a/b/summary.json\n"
    assert (ran.args[1], ran.args[0].recording.keep) == (Path("a/b"), "summary")
    assert sinssim("run", "parked", "-o", "a", "--keep", "report", "--overwrite") == report("a")
    assert ran.options["overwrite"] is True
    assert sinssim("run", "parked", "--require", "r95(end) <= 1 nmi", "--quiet") == ""
    assert [requirement.limit for requirement in ran.options["require"]] == [1852.0]
    assert sinssim("run", "parked", "-o", "a", "--recording", "none") == report("a")
    last = ("--grade", "tactical", "--set", 'imu.grade="laser-standard"')  # --grade wins
    assert sinssim("run", "parked", "--recording", "full", "--quiet", "--set", "seed=7", *last) == ""
    own = ran.args[0]
    assert (own.recording.detail, own.recording.keep, own.seed, own.imu.grade) == ("full", "all", 7, "tactical")
    assert json.loads(sinssim("run", "parked", "--json", "--view", "navigation")) == SUMMARY
    assert (opened.args, opened.options) == ((Path("runs/parked"),), {"view": "navigation"})
    assert "this run keeps none" in sinssim("run", "parked", "--view", "navigation", "--keep", "streams", code=2)
    assert "aiding.gnss.outages_s" in sinssim("run", "parked", "--outage", "40:55", code=2)
    said = sinssim("run", "parked", "--keep", "report", "--recording", "full", code=2)
    assert "--keep report keeps no recording, so that --recording full would have no effect" in said
    plane = put("experiments.run.one_component_exhibits.plane_brief", "plane")
    assert sinssim("run", "one_component") == report("runs/one_component") + view("runs/one_component")
    assert (plane.args[0].name, plane.args[1], shown.args[0]) == ("one_component", SUMMARY, "plane")


def test_run_with_recorded_files(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    put("experiments.run.run_execution.run", SimpleNamespace(summary=SUMMARY))
    put("experiments.run.run_report.brief")
    put("recording.console.show_items")
    put("analyses.inspection.inspected_files.are_raw", True)
    text = 'name = "own"\n[parked]\nlatitude_deg = 50.0\nduration_s = 5.0\n'
    suggested = put(
        "analyses.inspection.inspected_files.suggest", SimpleNamespace(text=text, doubts=["First.", "Second."])
    )
    (tmp_path / "d").mkdir()
    assert sinssim("run", "a.csv", "b.pos", "-o", "d") == (
        "Scenario: d/suggested.toml    (suggested by `inspect`; sinssim run d/suggested.toml -o DIR repeats the run)\n"
        "Doubts:   2 about the files; sinssim inspect a.csv b.pos tells all. The first: First.\n"
        + report("d") + view("d")
    )  # fmt: skip
    assert suggested.args[0] == [Path("a.csv"), Path("b.pos")]
    assert (tmp_path / "d/suggested.toml").read_text() == text


def test_align(sinssim: Sinssim, put: Put) -> None:
    found = SimpleNamespace(summary=SUMMARY, exhibits="exhibits", plot=lambda: "figure", directory=None)
    aligned, shown = put("analyses.alignment_session.align", found), put("recording.console.show")
    saved, recorded = put("recording.figures.save"), put("recording.rerun_exhibits.record")
    assert sinssim("align", "parked") == ""
    assert aligned.args == ("parked",)
    assert aligned.options == {
        "columns": None, "grade": None, "start": None, "end": None, "method": "quiet", "latitude": None,
        "overrides": (), "directory": None, "overwrite": False,
    }  # fmt: skip
    assert shown.args[0] == "exhibits"
    options = ("--from", 3, "--to", 70, "--disturbed", "--latitude", -30, "--columns", "c.toml", "--grade", "tactical",
               "--set", "seed=5", "--plot", "p.svg", "--record", "r.rrd", "--json")  # fmt: skip
    assert json.loads(sinssim("align", "log.csv", *options)) == SUMMARY
    assert aligned.options == {
        "columns": Path("c.toml"), "grade": "tactical", "start": 3.0, "end": 70.0, "method": "disturbed",
        "latitude": pytest.approx(-pi / 6.0), "overrides": ("seed=5",), "directory": None, "overwrite": False,
    }  # fmt: skip
    assert (saved.args, recorded.args) == (("figure", Path("p.svg")), ("exhibits", Path("r.rrd")))
    found.directory = Path("place")
    assert sinssim("align", "parked", "-o", "a", "--overwrite") == report("place") + view("place")
    assert (aligned.options["directory"], aligned.options["overwrite"]) == (Path("a"), True)


def test_allan(sinssim: Sinssim, put: Put) -> None:
    found = SimpleNamespace(to_json=lambda: SUMMARY)
    reported, shown = put("analyses.noise_report.noise_report", found), put("recording.console.show")
    saved, recorded = put("recording.figures.save"), put("recording.rerun_exhibits.record")
    exhibits = SimpleNamespace(figure="key", chosen=lambda key: f"charts {key}")
    made = put("analyses.noise_exhibits.exhibits_of", exhibits)
    drawn = put("recording.figures.figure_of", "figure")
    put("analyses.noise_imu_table.block_text", "[imu]\n")
    assert sinssim("allan", "log.csv") == ""
    assert (made.args[0], shown.args[0]) == (found, exhibits)
    options = ("--channel", "gyro", "--channel", "p=hPa", "--from", 3, "--to", 70, "--correlation-time", 40,
               "--columns", "c.toml", "--plot", "p.svg", "--record", "r.rrd")  # fmt: skip
    assert sinssim("allan", "log.csv", *options, "--imu") == "[imu]\n"
    assert callable(reported.options.pop("progress"))
    assert (reported.args, reported.options) == (
        (Path("log.csv"),),
        {"columns": Path("c.toml"), "channels": ("gyro", "p=hPa"), "start": 3.0, "end": 70.0, "correlation_time": 40.0},
    )  # fmt: skip
    assert (saved.args, recorded.args) == (("figure", Path("p.svg")), (exhibits, Path("r.rrd")))
    assert drawn.args == ("charts key",)
    assert json.loads(sinssim("allan", "log.csv", "--json")) == SUMMARY
    assert sinssim("allan", "log.csv", "--quiet") == ""
    assert len(shown.calls) == 1
    written = put("analyses.noise_exhibits.save_report", Path("place"))
    assert sinssim("allan", "log.csv", "-o", "a") == report("place") + view("place")
    assert (written.args, written.options) == ((found, exhibits, Path("a")), {"overwrite": False})
    assert sinssim("allan", "log.csv", "-o", "a", "--quiet") == ""
    assert len(written.calls) == 2
    assert "--imu and --json exclude each other" in sinssim("allan", "log.csv", "--imu", "--json", code=2)


def test_budget(sinssim: Sinssim, put: Put) -> None:
    result = SimpleNamespace(directory=Path("place"), summary=SUMMARY, exhibits="exhibits")
    found, shown = put("analyses.error_budget.covariance_budget.budget", result), put("recording.console.show")
    assert sinssim("budget", "parked") == report("place") + view("place")
    plan, directory = found.args
    assert found.options == {
        "overwrite": False, "times": (), "require": (), "free": [], "solution": None, "progress": False,
    }  # fmt: skip
    assert (plan.name, directory) == ("parked", Path("runs/parked-budget"))
    assert shown.args[0] == "exhibits"
    assert sinssim("budget", "parked", "--at", 7, "--at", 9) == report("place") + view("place")
    assert found.options["times"] == [7.0, 9.0]
    options = ("--require", "r95(60 s) <= 2 km", "--free", "gyro_bias, accel_bias", "--at", 7, "--at", 9, "--inertial",
               "--overwrite", "-o", "d", "--json")  # fmt: skip
    assert json.loads(sinssim("budget", "parked", *options)) == SUMMARY
    (one,) = found.options["require"]
    assert (one.limit, one.time, found.options["times"], found.options["solution"]) == (
        2000.0,
        60.0,
        [7.0, 9.0],
        "inertial",
    )
    assert (found.args[1], found.options["overwrite"]) == (Path("d"), True)
    assert found.options["free"] == ["gyro_bias", "accel_bias"]
    assert "needs a --require" in sinssim("budget", "parked", "--free", "gyro_bias", code=2)
    assert "names no source" in sinssim("budget", "parked", "--free", " , ", code=2)


def test_calibrate(sinssim: Sinssim, put: Put) -> None:
    result = SimpleNamespace(directory=Path("place"), summary=SUMMARY, exhibits="exhibits")
    found, shown = put("analyses.turntable_calibration.calibrate", result), put("recording.console.show")
    assert sinssim("calibrate", "calibration_table") == (
        "Report:       place/report.html    (in any browser)\n"
        'Compensation: place/compensation.toml    ([compensation] with file = "…")\n'
    )
    plan, directory = found.args
    assert (plan.name, directory) == ("calibration_table", Path("runs/calibration_table-calibration"))
    assert found.options == {"method": None, "overwrite": False, "progress": False}
    assert shown.args[0] == "exhibits"
    more = ("--method", "systematic", "-o", "d", "--overwrite", "--json")
    assert json.loads(sinssim("calibrate", "calibration_table", *more)) == SUMMARY
    assert (found.args[1], found.options["method"], found.options["overwrite"]) == (Path("d"), "systematic", True)


def test_compare(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    compared, shown = (
        put("experiments.study.compare", SimpleNamespace(exhibits="exhibits", summary=SUMMARY)),
        put("recording.console.show"),
    )
    assert sinssim("compare", "coning") == report("runs/coning")  # there is no recording
    plan, place = compared.args
    options = dict(compared.options)
    options.pop("say")
    assert (plan.name, place) == ("coning", Path("runs/coning"))
    assert options == {"resume": False, "overwrite": False, "limit_minutes": 30.0, "threads": None, "progress": False}
    assert shown.args[0] == "exhibits"
    (tmp_path / "d").mkdir()
    (tmp_path / "d/recording.rrd").touch()
    more = ("--resume", "--overwrite", "--limit-minutes", 7, "--threads", 3, "--set", "seed=11")
    assert sinssim("compare", "coning", "-o", "d", *more) == report("d") + view("d")
    given = {key: compared.options[key] for key in ("resume", "overwrite", "limit_minutes", "threads")}
    assert given == {"resume": True, "overwrite": True, "limit_minutes": 7.0, "threads": 3}
    assert compared.args[0].seed == 11
    assert json.loads(sinssim("compare", "coning", "--json")) == SUMMARY
    assert sinssim("compare", "coning", "--quiet") == ""
    said = sinssim("compare", "coning", "--require", "r95 <= 1 km", code=2)
    assert "--require belongs to trade studies, which have axes; the study coning compares algorithms." in said
    sinssim("compare", "parked", "--vary", "imu.rate_hz=50,100", "--require", "r95(60 s) <= 1 km", "--quiet")
    trade = compared.args[0]
    assert [axis.values for axis in trade.axes] == [(50, 100)]
    assert [str(one) for one in trade.require] == ["r95(60 s) <= 1 km"]


def test_compare_runs(sinssim: Sinssim, put: Put) -> None:
    names = {"1": SimpleNamespace(name="first"), "2": SimpleNamespace(name="s" * 200)}
    compared = put("experiments.run.run_comparison.compare_runs", SimpleNamespace(runs=names))
    wrote = put("experiments.run.run_comparison.write_comparison", (SUMMARY, Path("place")))
    put("experiments.run.run_comparison.comparison_exhibits", "exhibits")
    shown = put("recording.console.show")
    second = "s" * 200
    assert sinssim("compare-runs", "a/first", second) == report("place")
    assert compared.args == ([Path("a/first"), Path(second)], None)
    assert wrote.args == (compared.value, Path("runs/compare-first-" + "s" * 106))  # 120 characters
    assert wrote.options == {"overwrite": False}
    assert shown.args[0] == "exhibits"
    more = ("--solution", "aided", "-o", "d", "--overwrite", "--json")
    assert json.loads(sinssim("compare-runs", "a", "b", *more)) == SUMMARY
    assert (compared.args[1], wrote.args[1], wrote.options) == ("aided", Path("d"), {"overwrite": True})


def test_ensemble(sinssim: Sinssim, put: Put) -> None:
    result = SimpleNamespace(command=lambda run, program: f"{program} run of {run}")
    found = put("experiments.ensembles.ensemble_run.ensemble", result)
    named = [SimpleNamespace(rank=rank, run=run) for rank, run in (("worst", 7), ("worst 2", 8), ("best", 5))]
    numbers = SimpleNamespace(named_runs=named)
    put("experiments.ensembles.ensemble_summary.ensemble_numbers", numbers)
    put("experiments.ensembles.ensemble_summary.summary_of", {**SUMMARY, "unknown": float("nan")})
    whole = put("experiments.ensembles.ensemble_exhibits.exhibits_of", "exhibits")
    sheet = put("experiments.ensembles.ensemble_exhibits.sheet_of", "sheet")
    shown = put("recording.console.show")
    commands = "worst  sinssim run of 7\nbest   sinssim run of 5\n"
    assert sinssim("ensemble", "parked") == commands + report("runs/parked-ensemble") + view("runs/parked-ensemble")
    plan, runs, place = found.args
    options = dict(found.options)
    options.pop("say")
    assert (plan.name, runs, place) == ("parked", None, Path("runs/parked-ensemble"))
    assert options == {
        "resume": False, "overwrite": False, "threads": None, "workers": None, "scheduler": None, "require": (),
        "until_decided": False, "times": (), "progress": False,
    }  # fmt: skip
    assert (shown.args[0], whole.args) == ("exhibits", (result, numbers))
    more = ("-n", 12, "-o", "d", "--resume", "--overwrite", "--threads", 3, "--workers", 4, "--scheduler", "tcp://x",
            "--require", "r95(60 s) <= 2 km", "--until-decided", "--at", 7, "--at", 9)  # fmt: skip
    assert sinssim("ensemble", "parked", *more, "--sheet") == report("d") + view("d")
    assert (found.args[1:], len(sheet.calls), len(whole.calls)) == ((12, Path("d")), 1, 1)
    assert shown.args[0] == "sheet"
    options = {key: value for key, value in found.options.items() if key not in ("say", "require", "progress")}
    assert options == {
        "resume": True, "overwrite": True, "threads": 3, "workers": 4, "scheduler": "tcp://x", "until_decided": True,
        "times": [7.0, 9.0],
    }  # fmt: skip
    assert [one.limit for one in found.options["require"]] == [2000.0]
    assert json.loads(sinssim("ensemble", "parked", "--json")) == {**SUMMARY, "unknown": None}
    assert sinssim("ensemble", "parked", "-q") == ""
