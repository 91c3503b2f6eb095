"""As `test_calls`, of the other commands: export, inspect, list, score, check and so on; codes and words of errors."""

from __future__ import annotations

import datetime
import json
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.errors import InputError, RunError
from sinssim.experiments.run.finished_runs import Entry
from tests.cli.commands.conftest import Put, Sinssim
from tests.cli.commands.test_calls import SUMMARY
from tests.recording.test_summary import ERROR


def test_export(sinssim: Sinssim, put: Put) -> None:
    done = SimpleNamespace(place=Path("p"), files=[Path("p/a.csv"), Path("p/b.csv")], sentences=("One.", "Two."))
    wrote = put("logs.formats.export_streams.export", done)
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
    inspected = put(
        "analyses.inspection.inspected_files.inspect", SimpleNamespace(inspection=good, scenario='name = "x"\n', why="")
    )
    put("cli.commands.analyses.show_findings")
    assert sinssim("inspect", "a.csv", "b.pos") == '\nA scenario to start from (--out FILE writes it):\n\nname = "x"\n'
    assert inspected.args == ([Path("a.csv"), Path("b.pos")], Path())
    assert (inspected.options["land"], inspected.options["trial"]) == (False, True)
    (tmp_path / "d").mkdir()
    assert sinssim("inspect", "a.csv", "--out", "d/x.toml", "--vehicle", "land") == "\nScenario: d/x.toml\n"
    assert (inspected.args[1], inspected.options["land"]) == (Path("d"), True)
    assert (tmp_path / "d/x.toml").read_text() == 'name = "x"\n'
    sinssim("inspect", "a.csv", "--no-trial")
    assert inspected.options["trial"] is False
    assert "there is such a file already" in sinssim("inspect", "a.csv", "--out", "d/x.toml", code=2)
    assert "ends with .toml" in sinssim("inspect", "a.csv", "--out", "x.csv", code=2)
    wanted = {**SUMMARY, "scenario": 'name = "x"\n', "why_no_scenario": None}
    assert json.loads(sinssim("inspect", "a.csv", "--json", "--out", "d/x.toml", "--overwrite")) == wanted
    bad = SimpleNamespace(usable=False, as_dict=lambda: SUMMARY)
    put("analyses.inspection.inspected_files.inspect", SimpleNamespace(inspection=bad, scenario=None, why="Because."))
    assert sinssim("inspect", "a.csv", code=2) == "\nBecause.\n"
    assert json.loads(sinssim("inspect", "a.csv", "--json", code=2))["why_no_scenario"] == "Because."


def test_new(sinssim: Sinssim, put: Put) -> None:
    made = put("content.new_project", [("README.md", "what"), ("grades/unit.toml", "sensors")])
    assert sinssim("new", "mine") == (
        "mine is ready:\n  README.md         what\n  grades/unit.toml  sensors\n"
        "Next: cd mine, then sinssim run scenario.toml\n"
    )
    assert made.args == (Path("mine"),)


def test_runs(sinssim: Sinssim, put: Put) -> None:
    date = datetime.datetime(2024, 2, 3, 4, 5, 6, 789)
    entry = Entry(Path("runs/a"), "run", "s", "finished", "aided", 2.5, 12345, date)
    listed = put("experiments.run.finished_runs.runs_in", [entry])
    exhibits, shown = put("experiments.run.run_comparison.list_exhibits", "list"), put("recording.console.show_items")
    assert sinssim("runs") == ""
    assert (listed.args, exhibits.args, shown.args[0]) == ((Path("runs"),), ([entry], Path("runs")), "list")
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

    monkeypatch.setattr("sinssim.logs.solution_score.Judge", Judge)
    put("logs.stored_run.RecordedRun", "recorded")
    dated, common = (
        put("logs.formats.export_streams.date_of_run", 77.0),
        put("logs.solution_score.common_span", (6.0, 8.0)),
    )
    wrote = put("experiments.run.run_scores.write_scores", Path("runs/a/scores/report.html"))
    put("experiments.run.run_scores.to_json", SUMMARY)
    exhibits, shown = put("experiments.run.run_scores.score_exhibits", "exhibits"), put("recording.console.show")
    assert sinssim("score", "runs/a", "x/mine.csv", "rtk.pos") == (
        "Report: runs/a/scores/report.html\nCurves and map: sinssim view runs/a/scores\n"
    )
    usual = {"format_name": None, "antenna": None, "seconds": None}
    assert scored == [(("recorded", 77.0), Path("x/mine.csv"), {"name": "mine", **usual}),
                      (("recorded", 77.0), Path("rtk.pos"), {"name": "rtk", **usual})]  # fmt: skip
    assert dated.args == ("recorded", None)
    (found,) = exhibits.args
    assert (found.span, [one.name for one in found.scores]) == ((6.0, 8.0), ["mine", "rtk"])
    assert (wrote.args, shown.args[0]) == ((found,), "exhibits")
    assert list(found.numbers) == ["euler", "mine", "rtk"]
    assert found.numbers["rtk"]["final_horizontal_error_m"] == 17.0  # at 8 s
    assert common.args == (found.scores,)
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
    result = SimpleNamespace(duration=1800.0)
    expected = put("sensors.error_propagation.expect", result)
    notes = put("scenario.notes.keys_without_effect", ["a note"])
    exhibits = put("sensors.error_propagation.expectation_exhibits", "exhibits")
    numbers = put("sensors.error_propagation.expectation_numbers", SUMMARY)
    shown = put("recording.console.show_items")
    assert sinssim("sensors", "tactical") == ""
    assert expected.args[1] == pytest.approx(pi / 4.0)
    assert (exhibits.args, shown.args[0]) == ((result, ["a note"]), "exhibits")
    assert (notes.args[0].grade, notes.args[1]) == ("tactical", 1800.0)
    more = ("--latitude", -30, "--set", "imu.gyro_bias_sigma_deg_h=0.75", "--set", "rate_hz=40", "--json")
    assert json.loads(sinssim("sensors", "tactical", *more)) == SUMMARY
    section, latitude = expected.args
    assert (section.grade, section.rate_hz, latitude) == ("tactical", 40.0, pytest.approx(-pi / 6.0))
    assert section.gyro_bias_sigma_deg_h in (0.75, (0.75, 0.75, 0.75))
    assert numbers.args == (result,)


def test_view(sinssim: Sinssim, put: Put) -> None:
    opened, served = put("recording.rerun_viewer.open_viewer"), put("recording.rerun_viewer.serve")
    drawn = put("recording.rerun_viewer.screenshot")
    sinssim("view", "runs/a", "--view", "sensors")
    assert (opened.args, opened.options) == ((Path("runs/a"),), {"view": "sensors", "time_s": None})
    sinssim("view", "runs/b", "--web")
    assert (served.args, served.options) == ((Path("runs/b"),), {"view": None, "time_s": None})
    sinssim("view", "runs/c", "--view", "map", "--screenshot", "p.png", "--time", "12.5")
    assert (drawn.args, drawn.options) == ((Path("runs/c"), Path("p.png")), {"view": "map", "time_s": 12.5})
    assert [len(one.calls) for one in (opened, served, drawn)] == [1, 1, 1]
    said = sinssim("view", "runs/c", "--web", "--screenshot", "p.png", code=2)
    assert "--web and --screenshot exclude each other" in said
    sinssim("view", "runs/b", "--web", "--time", "1")
    assert served.options == {"view": None, "time_s": 1.0}
    for time in ("nan", "inf", "-1e10"):
        assert "is no time of a run; give seconds" in sinssim("view", "runs/c", "--time", time, code=2)


def test_list(sinssim: Sinssim, monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.cli.commands import content as listing

    monkeypatch.setattr(listing, "names_of", lambda kind: {"a": "first", "longer": "second", "bare": ""})
    assert sinssim("list", "frames") == "a       first\nlonger  second\nbare\n"
    assert json.loads(sinssim("list", "frames", "--json")) == {"a": "first", "longer": "second", "bare": ""}


def test_check(sinssim: Sinssim, put: Put) -> None:
    put("scenario.plan_summary.plan_lines", ["one", "two"])
    expected = put("scenario.planned_limits.expected_duration", 61.7)
    drawn, saved = put("experiments.run.motion_exhibits.plan_charts"), put("recording.figures.save")
    put("recording.figures.figure_of", "figure")
    assert sinssim("check", "parked", "--plot", "p.png") == "one\ntwo\nplot        p.png\n"
    assert (drawn.args[0].name, saved.args) == ("parked", ("figure", Path("p.png")))
    sinssim("check", "one_component", "--plot", "p.png", code=2)  # it has no plan to draw
    assert len(saved.calls) == 1
    found = json.loads(sinssim("check", "parked", "--json", "--set", "seed=7"))
    assert (found["expected_duration_s"], found["scenario"]["seed"]) == (62, 7)
    assert expected.args[0].seed == 7


def test_an_error_of_a_command_is_told_with_its_notes(sinssim: Sinssim, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        error = InputError("It is wrong.")
        error.add_note("It is in place.")
        raise error

    monkeypatch.setattr("sinssim.experiments.run.run_execution.run", fail)
    assert sinssim("run", "parked", code=2) == "sinssim: It is wrong. It is in place.\n"
    monkeypatch.setattr(
        "sinssim.experiments.run.run_execution.run", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    assert sinssim("run", "parked", code=130) == "Interrupted. Nothing had been recorded.\n"


def test_check_of_a_scenario_with_a_filter(sinssim: Sinssim, put: Put) -> None:
    """The states of the filter are those of the check; its notes follow the plan."""
    resolved = SimpleNamespace(as_written=lambda: SUMMARY)
    put("scenario.filter_model.with_states", resolved)
    put("scenario.filter_model.choice", ["states      chosen"])
    put("scenario.filter_model.notes", ["One.", "Two."])
    memory = put("scenario.run_memory.check_memory")
    lines = put("scenario.plan_summary.plan_lines", ["plan"])
    put("scenario.planned_limits.expected_duration", 99.4)
    assert sinssim("check", "aided_airliner") == "plan\nstates      chosen\nnote        One.\nnote        Two.\n"
    assert lines.args == memory.args == (resolved,)
    assert json.loads(sinssim("check", "aided_airliner", "--json")) == {"expected_duration_s": 99, "scenario": SUMMARY}


def test_check_of_recorded_sensors(sinssim: Sinssim, put: Put, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text('name = "x"\n[log.imu]\nfile = "a.csv"\n[imu]\ngrade = "tactical"\n[filter]\n')
    resolved = SimpleNamespace(as_written=lambda: SUMMARY)
    prepared = SimpleNamespace(
        log=SimpleNamespace(rates={"imu": 99.98765, "gnss": 5.0}, notes=("A note.",)), scenario=resolved, moved="moved",
        start=SimpleNamespace(words="It starts."),
    )  # fmt: skip
    plan = SimpleNamespace(source=SimpleNamespace(recorded=True), filter="f")
    monkeypatch.setattr("sinssim.scenario.load_scenario", lambda *_: plan)
    put("simulation.recorded_filter_run.prepare", prepared)
    memory, chosen = (
        put("scenario.run_memory.check_memory"),
        put("scenario.filter_model.choice", ["states"]),
    )
    put("scenario.plan_summary.plan_lines", ["plan"])
    put("scenario.planned_limits.expected_duration", 99.6)
    assert sinssim("check", "x.toml") == (
        "plan\nrecorded    imu, 99.99 Hz\nrecorded    gnss, 5 Hz\nstates\nnote        A note.\nnote        It starts.\n"
    )
    assert (memory.args, memory.options) == ((resolved,), {"of_log": prepared.log.rates})
    assert chosen.args == (plan, "moved")
    assert json.loads(sinssim("check", "x.toml", "--json")) == {
        "expected_duration_s": 100, "notes": ["A note.", "It starts."], "scenario": SUMMARY,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (MemoryError("4 GB"), 1, "not enough memory: 4 GB. A shorter scenario or log, or a lower rate, needs less."),
        (
            OSError(28, "No space left on device"),
            1,
            "the operating system reported an error: [Errno 28] No space left on device.",
        ),
        (RunError("It failed."), 1, "It failed."),
        (InputError("It is wrong."), 2, "It is wrong."),
    ],
)
def test_codes_and_words_of_errors(
    sinssim: Sinssim, monkeypatch: pytest.MonkeyPatch, error: Exception, code: int, said: str
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("sinssim.content.new_project", fail)
    assert sinssim("new", "x", code=code) == f"sinssim: {said}\n"


def test_the_order_of_the_commands() -> None:
    from sinssim.cli.app import command_names

    names = command_names()
    assert names[:4] == ["run", "view", "check", "compare"]
    assert names[4:] == sorted(names[4:])
    assert "compare-runs" in names
