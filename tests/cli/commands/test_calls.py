"""What each command hands on, and what it prints: options in the right units, paths, and files that are named."""

from __future__ import annotations

import datetime
import importlib
import json
from collections.abc import Callable
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.cli.process import main
from sinssim.errors import InputError
from sinssim.recording.finished.run_list import Entry
from tests.recording.store.test_summary import ERROR


class Called:
    """A function that remembers its arguments and returns a given value."""

    def __init__(self, value: Any = None) -> None:
        self.value, self.calls = value, list[tuple[tuple[Any, ...], dict[str, Any]]]()

    def __call__(self, *args: Any, **options: Any) -> Any:
        self.calls.append((args, options))
        return self.value

    @property
    def args(self) -> tuple[Any, ...]:
        return self.calls[-1][0]

    @property
    def options(self) -> dict[str, Any]:
        return self.calls[-1][1]


Put = Callable[..., Called]
Sinssim = Callable[..., str]


@pytest.fixture
def put(monkeypatch: pytest.MonkeyPatch) -> Put:
    """Return a function that puts a `Called` in place of a name, such as "sinssim.simulation.execute.run"."""

    def place(name: str, value: Any = None) -> Called:
        module, called = f"sinssim.{name}".rsplit(".", 1)[0], Called(value)
        monkeypatch.setattr(importlib.import_module(module), name.rsplit(".", 1)[1], called)
        return called

    return place


@pytest.fixture
def sinssim(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Sinssim:
    """Return a function that runs the command line in an empty folder, and returns standard output."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("shutil.which", lambda name: f"/bin/{name}")

    def run(*arguments: object, code: int = 0) -> str:
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert end.value.code == code, err
        return out if code in (0, 2) and not err else out + err

    return run


def view(folder: str) -> str:
    return f"View:   sinssim view {folder}    (--web: in a browser)\n"


def report(folder: str) -> str:
    return f"Report: {folder}/report.html    (in any browser)\n"


SUMMARY = {"name": "µ", "value": 1.5}


def test_run(sinssim: Sinssim, put: Put) -> None:
    """The summary is named if there is no report; the recording only if there is one."""
    ran = put("simulation.execute.run", SimpleNamespace(summary=SUMMARY))
    shown, opened = put("recording.tables.run.show"), put("recording.rerun.viewer.open_viewer")
    assert sinssim("run", "parked") == report("runs/parked") + view("runs/parked")
    plan, place = ran.args
    assert (plan.name, place, ran.options) == ("parked", Path("runs/parked"), {"overwrite": False, "progress": None})
    assert shown.args[:2] == (plan, SUMMARY)
    assert shown.args[2].width >= 120
    assert sinssim("run", "parked", "-o", "a/b", "--keep", "summary") == "Summary: a/b/summary.json\n"
    assert (ran.args[1], ran.args[0].recording.keep) == (Path("a/b"), "summary")
    assert sinssim("run", "parked", "-o", "a", "--keep", "report", "--overwrite") == report("a")
    assert ran.options["overwrite"] is True
    assert sinssim("run", "parked", "-o", "a", "--recording", "none") == report("a")
    assert sinssim("run", "parked", "--recording", "full", "--quiet", "--set", "seed=7", "--grade", "tactical") == ""
    own = ran.args[0]
    assert (own.recording.detail, own.recording.keep, own.seed, own.imu.grade) == ("full", "all", 7, "tactical")
    assert json.loads(sinssim("run", "parked", "--json", "--view", "navigation")) == SUMMARY
    assert (opened.args, opened.options) == ((Path("runs/parked"),), {"view": "navigation"})
    assert "this run keeps none" in sinssim("run", "parked", "--view", "navigation", "--keep", "streams", code=2)
    assert "aiding.gnss.outages_s" in sinssim("run", "parked", "--outage", "40:55", code=2)
    said = sinssim("run", "parked", "--keep", "report", "--recording", "full", code=2)
    assert "--keep report keeps no recording, so that --recording full would have no effect" in said
    plane = put("recording.tables.one_component.show")
    assert sinssim("run", "one_component") == report("runs/one_component") + view("runs/one_component")
    assert plane.args[1] == SUMMARY


def test_run_with_recorded_files(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    put("simulation.execute.run", SimpleNamespace(summary=SUMMARY))
    put("recording.tables.run.show")
    put("inspection.raw_files.are_raw", True)
    text = 'name = "own"\n[parked]\nlatitude_deg = 50.0\nduration_s = 5.0\n'
    suggested = put("inspection.raw_files.suggest", SimpleNamespace(text=text, doubts=["First.", "Second."]))
    (tmp_path / "d").mkdir()
    assert sinssim("run", "a.csv", "b.pos", "-o", "d") == (
        "Scenario: d/suggested.toml    (suggested by `inspect`; sinssim run d/suggested.toml -o DIR repeats the run)\n"
        "Doubts:   2 about the files; sinssim inspect a.csv b.pos tells all. The first: First.\n"
        + report("d") + view("d")
    )  # fmt: skip
    assert suggested.args == ([Path("a.csv"), Path("b.pos")],)
    assert (tmp_path / "d/suggested.toml").read_text() == text


def test_align(sinssim: Sinssim, put: Put) -> None:
    found = SimpleNamespace(to_json=lambda: SUMMARY)
    aligned, shown = put("alignment.report.align_source", found), put("recording.tables.alignment.show")
    drawn, saved = put("recording.figures.alignment.session_figure", "figure"), put("recording.figures.canvas.save")
    recorded = put("recording.rerun.alignment.record_alignment")
    assert sinssim("align", "parked") == ""
    assert aligned.args == ("parked",)
    assert aligned.options == {
        "columns": None, "grade": None, "start": None, "end": None, "method": "quiet", "latitude": None, "settings": (),
    }  # fmt: skip
    assert shown.args[0] is found
    options = ("--from", 3, "--to", 70, "--disturbed", "--latitude", -30, "--columns", "c.toml", "--grade", "tactical",
               "--set", "seed=5", "--plot", "p.svg", "--record", "r.rrd", "--json")  # fmt: skip
    assert json.loads(sinssim("align", "log.csv", *options)) == SUMMARY
    assert aligned.options == {
        "columns": Path("c.toml"), "grade": "tactical", "start": 3.0, "end": 70.0, "method": "disturbed",
        "latitude": pytest.approx(-pi / 6.0), "settings": ("seed=5",),
    }  # fmt: skip
    assert (drawn.args, saved.args, recorded.args) == ((found,), ("figure", Path("p.svg")), (Path("r.rrd"), found))


def test_allan(sinssim: Sinssim, put: Put) -> None:
    found = SimpleNamespace(to_json=lambda: SUMMARY)
    reported, shown = put("noise_identification.report.noise_report", found), put("recording.tables.noise.show")
    saved, recorded = put("recording.figures.canvas.save"), put("recording.rerun.noise.record_noise")
    put("recording.figures.noise.noise_figure", "figure")
    put("noise_identification.imu_block.block_text", "[imu]\n")
    assert sinssim("allan", "log.csv") == ""
    assert shown.args[0] is found
    options = ("--channel", "gyro", "--channel", "p=hPa", "--from", 3, "--to", 70, "--correlation-time", 40,
               "--columns", "c.toml", "--plot", "p.svg", "--record", "r.rrd")  # fmt: skip
    assert sinssim("allan", "log.csv", *options, "--imu") == "[imu]\n"
    assert (reported.args, reported.options) == (
        (Path("log.csv"),),
        {"columns": Path("c.toml"), "channels": ("gyro", "p=hPa"), "start": 3.0, "end": 70.0, "correlation_time": 40.0,
         "progress": None},
    )  # fmt: skip
    assert (saved.args, recorded.args) == (("figure", Path("p.svg")), (Path("r.rrd"), found))
    assert json.loads(sinssim("allan", "log.csv", "--json")) == SUMMARY
    assert sinssim("allan", "log.csv", "--quiet") == ""
    assert len(shown.calls) == 1
    assert "--imu and --json exclude each other" in sinssim("allan", "log.csv", "--imu", "--json", code=2)


def test_budget(sinssim: Sinssim, put: Put) -> None:
    found, answered = put("error_budget.analyse.budget", "result"), put("error_budget.limits.answers", ("answer",))
    wrote = put("recording.store.budget.write_budget", Path("place"))
    numbers, shown = put("recording.store.budget.to_json", SUMMARY), put("recording.tables.budget.show")
    assert sinssim("budget", "parked") == report("place") + view("place")
    plan = found.args[0]
    assert found.options == {"times": (), "require": (), "solution": None, "progress": None}
    assert wrote.args == ("result", ("answer",), Path("runs/parked-budget"))
    assert wrote.options == {"times": (), "overwrite": False}
    assert shown.args[:2] == ("result", ("answer",))
    assert plan.name == "parked"
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
    assert answered.args == ("result", (one,), ["gyro_bias", "accel_bias"])
    assert (wrote.args[2], wrote.options) == (Path("d"), {"times": [7.0, 9.0], "overwrite": True})
    assert numbers.args == ("result", ("answer",), [7.0, 9.0])
    assert "needs a --require" in sinssim("budget", "parked", "--free", "gyro_bias", code=2)
    assert "names no source" in sinssim("budget", "parked", "--free", " , ", code=2)


def test_calibrate(sinssim: Sinssim, put: Put) -> None:
    found = put("calibration.calibrate.calibrate", "result")
    wrote = put("recording.store.calibration.write_calibration", Path("place"))
    put("recording.store.calibration.to_json", SUMMARY)
    shown = put("recording.tables.calibration.show")
    assert sinssim("calibrate", "calibration_table") == (
        "Report:       place/report.html    (in any browser)\n"
        'Compensation: place/compensation.toml    ([compensation] with file = "…")\n'
    )
    assert (found.args[0].name, found.options) == ("calibration_table", {"method": None, "progress": None})
    assert (wrote.args, wrote.options) == (("result", Path("runs/calibration_table-calibration")), {"overwrite": False})
    assert shown.args[0] == "result"
    more = ("--method", "systematic", "-o", "d", "--overwrite", "--json")
    assert json.loads(sinssim("calibrate", "calibration_table", *more)) == SUMMARY
    assert (found.options["method"], wrote.args[1], wrote.options) == ("systematic", Path("d"), {"overwrite": True})


def test_compare(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    compared, shown = put("trades.running.compare.compare", "result"), put("recording.tables.study.show")
    put("recording.store.study.results", SUMMARY)
    assert sinssim("compare", "coning") == report("runs/coning")  # there is no recording
    plan, place = compared.args
    options = dict(compared.options)
    options.pop("say")
    assert (plan.name, place) == ("coning", Path("runs/coning"))
    assert options == {"resume": False, "overwrite": False, "limit_minutes": 30.0, "threads": None, "progress": None}
    assert shown.args[0] == "result"
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
    compared = put("recording.finished.compared_runs.compare_runs", SimpleNamespace(runs=names))
    put("recording.finished.report.compare_runs_report", "page")
    wrote = put("recording.finished.comparison.write_comparison", (SUMMARY, Path("place")))
    shown = put("recording.tables.runs.show_comparison")
    assert sinssim("compare-runs", "a", "b") == report("place")
    assert compared.args == ([Path("a"), Path("b")], None)
    assert wrote.args == (compared.value, "page", Path("runs/compare-first-" + "s" * 106))  # 120 characters
    assert wrote.options == {"overwrite": False}
    assert shown.args[0] is compared.value
    more = ("--solution", "aided", "-o", "d", "--overwrite", "--json")
    assert json.loads(sinssim("compare-runs", "a", "b", *more)) == SUMMARY
    assert (compared.args[1], wrote.args[2], wrote.options) == ("aided", Path("d"), {"overwrite": True})


def test_ensemble(sinssim: Sinssim, put: Put) -> None:
    found = put("ensembles.running.run.ensemble", "result")
    put("ensembles.summary.ensemble_numbers", {**SUMMARY, "unknown": float("nan")})
    shown, sheet = put("recording.tables.ensemble.show"), put("recording.tables.ensemble.show_sheet")
    assert sinssim("ensemble", "parked") == report("runs/parked-ensemble") + view("runs/parked-ensemble")
    plan, runs, place = found.args
    options = dict(found.options)
    options.pop("say")
    assert (plan.name, runs, place) == ("parked", None, Path("runs/parked-ensemble"))
    assert options == {
        "resume": False, "overwrite": False, "threads": None, "workers": None, "scheduler": None, "require": (),
        "until_decided": False, "times": (), "progress": None,
    }  # fmt: skip
    assert (shown.args[0], shown.args[3]) == ("result", "sinssim")
    more = ("-n", 12, "-o", "d", "--resume", "--overwrite", "--threads", 3, "--workers", 4, "--scheduler", "tcp://x",
            "--require", "r95(60 s) <= 2 km", "--until-decided", "--at", 7, "--at", 9)  # fmt: skip
    assert sinssim("ensemble", "parked", *more, "--sheet") == report("d") + view("d")
    assert (found.args[1:], len(sheet.calls), len(shown.calls)) == ((12, Path("d")), 1, 1)
    options = {key: value for key, value in found.options.items() if key not in ("say", "require", "progress")}
    assert options == {
        "resume": True, "overwrite": True, "threads": 3, "workers": 4, "scheduler": "tcp://x", "until_decided": True,
        "times": [7.0, 9.0],
    }  # fmt: skip
    assert [one.limit for one in found.options["require"]] == [2000.0]
    assert json.loads(sinssim("ensemble", "parked", "--json")) == {**SUMMARY, "unknown": None}
    assert sinssim("ensemble", "parked", "-q") == ""


def test_export(sinssim: Sinssim, put: Put) -> None:
    done = SimpleNamespace(place=Path("p"), files=[Path("p/a.csv"), Path("p/b.csv")], sentences=("One.", "Two."))
    wrote = put("logs.writers.export.export", done)
    assert sinssim("export", "runs/a", "--to", "kml") == "p\n  One.\n  Two.\n"
    assert wrote.args == (Path("runs/a"), "kml", None)
    assert wrote.options == {"solution": [], "start": None, "rate_hz": None, "outages": (), "overwrite": False}
    more = ("-o", "d", "--solution", "aided", "--solution", "ideal", "--start", "2024-02-03", "--rate", 5, "--outage",
            "40:55", "--overwrite", "--json")  # fmt: skip
    assert json.loads(sinssim("export", "runs/a", "--to", "kml", *more)) == {
        "place": "p", "files": ["p/a.csv", "p/b.csv"], "contents": ["One.", "Two."],
    }  # fmt: skip
    assert wrote.args[2] == Path("d")
    assert wrote.options == {
        "solution": ["aided", "ideal"], "start": "2024-02-03", "rate_hz": 5.0, "outages": ["40:55"], "overwrite": True,
    }  # fmt: skip


def test_inspect(sinssim: Sinssim, put: Put, tmp_path: Path) -> None:
    good = SimpleNamespace(usable=True, as_dict=lambda: SUMMARY)
    inspected = put("inspection.files.inspect", SimpleNamespace(inspection=good, scenario='name = "x"\n', why=""))
    put("recording.tables.inspection.show")
    assert sinssim("inspect", "a.csv", "b.pos") == '\nA scenario to start from (--out FILE writes it):\n\nname = "x"\n'
    assert (inspected.args, inspected.options) == (([Path("a.csv"), Path("b.pos")], Path()), {"land": False})
    (tmp_path / "d").mkdir()
    assert sinssim("inspect", "a.csv", "--out", "d/x.toml", "--vehicle", "land") == "\nScenario: d/x.toml\n"
    assert (inspected.args[1], inspected.options) == (Path("d"), {"land": True})
    assert (tmp_path / "d/x.toml").read_text() == 'name = "x"\n'
    assert "there is such a file already" in sinssim("inspect", "a.csv", "--out", "d/x.toml", code=2)
    assert "ends with .toml" in sinssim("inspect", "a.csv", "--out", "x.csv", code=2)
    wanted = {**SUMMARY, "scenario": 'name = "x"\n', "why_no_scenario": None}
    assert json.loads(sinssim("inspect", "a.csv", "--json", "--out", "d/x.toml", "--overwrite")) == wanted
    bad = SimpleNamespace(usable=False, as_dict=lambda: SUMMARY)
    put("inspection.files.inspect", SimpleNamespace(inspection=bad, scenario=None, why="Because."))
    assert sinssim("inspect", "a.csv", code=2) == "\nBecause.\n"
    assert json.loads(sinssim("inspect", "a.csv", "--json", code=2))["why_no_scenario"] == "Because."


def test_new(sinssim: Sinssim, put: Put) -> None:
    made = put("own_content.new_project.new_project", [("README.md", "what"), ("grades/unit.toml", "sensors")])
    assert sinssim("new", "mine") == (
        "mine is ready:\n  README.md         what\n  grades/unit.toml  sensors\n"
        "Next: cd mine, then sinssim run scenario.toml\n"
    )
    assert made.args == (Path("mine"),)


def test_runs(sinssim: Sinssim, put: Put) -> None:
    date = datetime.datetime(2024, 2, 3, 4, 5, 6, 789)
    entry = Entry(Path("runs/a"), "run", "s", "finished", "aided", 2.5, 12345, date)
    listed, shown = put("recording.finished.run_list.runs_in", [entry]), put("recording.tables.runs.show_list")
    assert sinssim("runs") == ""
    assert (listed.args, shown.args[:2]) == ((Path("runs"),), ([entry], Path("runs")))
    (found,) = json.loads(sinssim("runs", "other", "--json"))
    assert listed.args == (Path("other"),)
    assert found == {
        "path": "runs/a", "kind": "run", "scenario": "s", "status": "finished", "solution": "aided",
        "rms_horizontal_error_m": 2.5, "size_bytes": 12345, "date": "2024-02-03T04:05:06", "problem": "", "sinssim": "",
    }  # fmt: skip


def test_score(sinssim: Sinssim, put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solution has the name of its file, unless one is given; errors count between the common instants."""
    scored = []

    class Judge:
        axes, against = "north", "the truth"
        run = SimpleNamespace(name="flight", solutions={"euler": None})

        def __init__(self, run: object, start_gps_s: float) -> None:
            self.begun = (run, start_gps_s)

        def score(self, path: Path, **options: Any) -> SimpleNamespace:
            scored.append((self.begun, path, options))
            return SimpleNamespace(name=options["name"], error=ERROR)

        def run_errors(self, span: tuple[float, float]) -> dict[str, Any]:
            return {"euler": ERROR}

    monkeypatch.setattr("sinssim.logs.scoring.score.Judge", Judge)
    put("logs.recorded_run.RecordedRun", "recorded")
    dated, common = put("logs.writers.export.date_of_run", 77.0), put("logs.scoring.score.common_span", (6.0, 8.0))
    reported = put("recording.report.score.score_report", "page")
    wrote = put("recording.store.score.write_scores", Path("runs/a/scores/report.html"))
    put("recording.store.score.to_json", SUMMARY)
    shown = put("recording.tables.score.show")
    assert sinssim("score", "runs/a", "x/mine.csv", "rtk.pos") == (
        "Report: runs/a/scores/report.html\nCurves and map: sinssim view runs/a/scores\n"
    )
    usual = {"format_name": None, "antenna": None, "seconds": None}
    assert scored == [(("recorded", 77.0), Path("x/mine.csv"), {"name": "mine", **usual}),
                      (("recorded", 77.0), Path("rtk.pos"), {"name": "rtk", **usual})]  # fmt: skip
    assert dated.args == ("recorded", None)
    name, against, numbers, scores, span, _ = shown.args
    assert (name, against, span, [one.name for one in scores]) == ("flight", "the truth", (6.0, 8.0), ["mine", "rtk"])
    assert list(numbers) == ["euler", "mine", "rtk"]
    assert numbers["rtk"]["final_horizontal_error_m"] == 17.0  # at 8 s
    compared = reported.args[2]
    assert (compared.time.tolist(), list(compared.errors), compared.axes) == ([6.0, 8.0], list(numbers), "north")
    assert wrote.args[2:4] == ((6.0, 8.0), "page")
    assert common.args == (scores,)
    more = ("--name", "n", "--time-s", 3.5, "--format", "csv", "--antenna", "gnss", "--start", "2024-02-03", "--json")
    found = json.loads(sinssim("score", "runs/a", "mine.csv", *more))
    assert scored[-1][2] == {"name": "n", "format_name": "csv", "antenna": "gnss", "seconds": 3.5}
    assert dated.args == ("recorded", "2024-02-03")
    assert (found["scores"], found["report"], list(found["errors"])) == (
        [SUMMARY],
        "runs/a/scores/report.html",
        ["euler", "n"],
    )
    said = sinssim("score", "runs/a", "a.csv", "b.csv", "--name", "n", code=2)
    assert "--name is given 1 times for 2 solutions; give one for each." in said
    assert "the time must be positive" in sinssim("score", "runs/a", "a.csv", "--time-s", 0, code=2)


def test_sensors(sinssim: Sinssim, put: Put) -> None:
    expected = put("sensors.expectation.expect", "result")
    shown, numbers = put("recording.tables.expectation.show"), put("recording.tables.expectation.to_json", SUMMARY)
    assert sinssim("sensors", "tactical") == ""
    assert expected.args[1] == pytest.approx(pi / 4.0)
    assert shown.args[0] == "result"
    more = ("--latitude", -30, "--set", "imu.gyro_bias_sigma_deg_h=0.75", "--set", "rate_hz=40", "--json")
    assert json.loads(sinssim("sensors", "tactical", *more)) == SUMMARY
    section, latitude = expected.args
    assert (section.grade, section.rate_hz, latitude) == ("tactical", 40.0, pytest.approx(-pi / 6.0))
    assert section.gyro_bias_sigma_deg_h in (0.75, (0.75, 0.75, 0.75))
    assert numbers.args == ("result",)


def test_view(sinssim: Sinssim, put: Put) -> None:
    opened, served = put("recording.rerun.viewer.open_viewer"), put("recording.rerun.viewer.serve")
    drawn = put("recording.rerun.viewer.screenshot")
    sinssim("view", "runs/a", "--view", "sensors")
    assert (opened.args, opened.options) == ((Path("runs/a"),), {"view": "sensors"})
    sinssim("view", "runs/b", "--web")
    assert (served.args, served.options) == ((Path("runs/b"),), {"view": None})
    sinssim("view", "runs/c", "--view", "map", "--screenshot", "p.png")
    assert (drawn.args, drawn.options) == ((Path("runs/c"), Path("p.png")), {"view": "map"})
    assert [len(one.calls) for one in (opened, served, drawn)] == [1, 1, 1]
    said = sinssim("view", "runs/c", "--web", "--screenshot", "p.png", code=2)
    assert "--web and --screenshot exclude each other" in said


def test_list(sinssim: Sinssim, monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.cli.commands import list as listing

    monkeypatch.setattr(listing, "names_of", lambda kind: {"a": "first", "longer": "second", "bare": ""})
    assert sinssim("list", "frames") == "a       first\nlonger  second\nbare\n"
    assert json.loads(sinssim("list", "frames", "--json")) == {"a": "first", "longer": "second", "bare": ""}


def test_check(sinssim: Sinssim, put: Put) -> None:
    put("scenario.summary.plan_lines", ["one", "two"])
    expected = put("scenario.duration.expected_duration", 61.7)
    drawn, saved = put("recording.figures.plan.plan_figure", "figure"), put("recording.figures.canvas.save")
    assert sinssim("check", "parked", "--plot", "p.png") == "one\ntwo\nplot        p.png\n"
    assert (drawn.args[0].name, saved.args) == ("parked", ("figure", Path("p.png")))
    found = json.loads(sinssim("check", "parked", "--json", "--set", "seed=7"))
    assert (found["expected_duration_s"], found["scenario"]["seed"]) == (62, 7)
    assert expected.args[0].seed == 7


def test_an_error_of_a_command_is_told_with_its_notes(sinssim: Sinssim, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        error = InputError("It is wrong.")
        error.add_note("It is in place.")
        raise error

    monkeypatch.setattr("sinssim.simulation.execute.run", fail)
    assert sinssim("run", "parked", code=2) == "sinssim: It is wrong. It is in place.\n"
    monkeypatch.setattr("sinssim.simulation.execute.run", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
    assert sinssim("run", "parked", code=130) == "Interrupted. Nothing had been recorded.\n"
