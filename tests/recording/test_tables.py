"""Files of studies and events, row groups, and streams of a run in memory, from contents that are chosen."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, fields
from math import nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.experiments.run import run_scores
from sinssim.experiments.run import run_scores as score
from sinssim.experiments.run.run_execution import PlaneMedia
from sinssim.experiments.run.run_result import PlaneRun
from sinssim.experiments.run.run_streams import streams_of_run
from sinssim.experiments.studies import study_exhibits as study
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_results import Case, CoordinateError, Heading, Order, Pick, Row, Verdict
from sinssim.logs.solution_score import Score
from sinssim.recording import result as run_directory
from sinssim.recording import streams
from sinssim.recording import streams as parquet
from sinssim.recording.streams import Stream, Streams, StreamTable, Vector
from sinssim.simulation.truth_and_sensors import RecordedMotion, Truth
from sinssim.system.files import written
from sinssim.truth.sampling import FlightEvent
from tests.experiments.run.test_filter_streams import error, motion
from tests.recording.test_motion_streams import TIME, rows

CASE = (
    "part one",
    "coning",
    "gyros",
    "ideal",
    "euler",
    "level",
    "normal",
    "exact",
    200.0,
    (400.0, 50.0, 2.5),
    "hold",
    "e",
)
HEADING = Heading("part one", "turns", "sum", 50.0, 2.5, 7.0, -3.0, 4, 0.25, 12.0, np.zeros(2), np.ones(2), np.ones(2))


@dataclass(frozen=True)
class AttitudeCost:
    algorithm: str
    operations: Operations
    matrix: Operations


def result() -> SimpleNamespace:
    done = Row(*CASE, samples=7, final_height_error_m=-3.5, max_defect=2e-16)
    failed = Row(*CASE[:4], "poisson", *CASE[5:9], (), *CASE[10:], status="failed", message="why")
    cost = Cost("euler", "level", 250.0, Operations(10.0, 20.0, 3.0, 4.0, 5.0), (400.0, 50.0))
    parts = Operations(1.0, 2.0, 3.0, 4.0, 5.0), Operations(2.0, 2.0, 3.0, 4.0, 5.0)
    return SimpleNamespace(
        study=SimpleNamespace(name="s", description="two words", seed=11), status="finished", seconds=12.3456,
        verdicts=[Verdict("c", "sentence", "partly", "reason", ("p",), {"n": nan}, ("no",), "3 m", "4 m")],
        picks=[Pick("part one", "ideal", "gyros", "euler at 200 Hz", "because", {"m": 2.5})],
        motions={("part one", "coning"): parts[0]},
        costs={"any": cost},
        attitude_costs=[AttitudeCost("euler", parts[0], parts[1])], headings=[HEADING],
        coordinate_errors=[CoordinateError(Case(*CASE), "inertial", "x_i_m", 8.0, -6.0)],
        orders=[Order("part one", "coning", "euler", "drift", 4.25, 0.125, 6, 50.0, 800.0)], rows=[done, failed],
    )  # fmt: skip


def test_the_results_of_a_study() -> None:
    found = json.loads(json.dumps(study.to_json(result()), allow_nan=False))
    told = {key: found.pop(key) for key in ("study", "description", "status", "seed", "seconds")}
    assert told == {"study": "s", "description": "two words", "status": "finished", "seed": 11, "seconds": 12.35}
    assert found.pop("verdicts") == [
        {"claim": "c", "sentence": "sentence", "verdict": "partly", "reason": "reason", "points": ["p"],
         "numbers": {"n": None}, "judged": ["no"], "measured": "3 m", "expected": "4 m"}
    ]  # fmt: skip
    assert found.pop("picks") == [
        {"part": "part one", "sensors": "ideal", "variant": "gyros", "choice": "euler at 200 Hz", "reason": "because",
         "numbers": {"m": 2.5}}
    ]  # fmt: skip
    (facts,) = found.pop("motions")
    assert (facts.pop("part"), facts.pop("motion")) == ("part one", "coning")
    assert list(facts.values()) == [1.0, 2.0, 3.0, 4.0, 5.0]
    (cost,) = found.pop("costs")
    assert (cost["ns_per_step"], cost["operations_per_step"], cost["schedule_hz"]) == (
        250.0,
        157.0,
        [400.0, 50.0],
    )  # a function is 24
    (attitude,) = found.pop("attitude_costs")
    assert (attitude["operations_per_step"], attitude["matrix_operations_per_step"]) == (130.0, 131.0)
    assert found.pop("headings") == [
        {"part": "part one", "motion": "turns", "form": "sum", "rate_hz": 50.0, "turns": 2.5, "max_error_arcsec": 7.0,
         "final_error_arcsec": -3.0, "jumps": 4, "wrong": 0.25, "least_hz": 12.0}
    ]  # fmt: skip
    case = {field.name: value for field, value in zip(fields(Case), CASE, strict=True)} | {
        "schedule_hz": [400.0, 50.0, 2.5]
    }
    assert found.pop("coordinate_errors") == [
        {**case, "coordinates": "inertial", "column": "x_i_m", "max_error": 8.0, "final_error": -6.0}
    ]  # fmt: skip
    assert found.pop("orders") == [
        {"part": "part one", "motion": "coning", "algorithm": "euler", "quantity": "drift", "order": 4.25,
         "uncertainty": 0.125, "points": 6, "low_hz": 50.0, "high_hz": 800.0}
    ]  # fmt: skip
    done, failed = found.pop("cases")
    assert {key: done[key] for key in case} == case
    assert (done["samples"], done["final_height_error_m"], done["max_defect"], done["status"]) == (
        7,
        -3.5,
        2e-16,
        "done",
    )
    assert done["rms_height_error_m"] is None
    assert (failed["algorithm"], failed["status"], failed["message"], failed["schedule_hz"]) == (
        "poisson",
        "failed",
        "why",
        [],
    )
    assert list(found.pop("guarantees")) == ["euler", "poisson"]
    assert list(found) == ["versions"]


def test_the_tables_of_a_study() -> None:
    table = study._columns(Row, result().rows)
    assert list(table) == [field.name for field in fields(Row)]
    assert table["schedule_hz"] == ["400/50/2.5", ""]
    assert (table["algorithm"], table["rate_hz"], table["samples"]) == (["euler", "poisson"], [200.0, 200.0], [7, 0])
    assert table["final_height_error_m"][0] == -3.5
    held = study._coordinate_columns(result())
    wanted = {field.name: [value] for field, value in zip(fields(Case), CASE, strict=True)} | {
        "schedule_hz": ["400/50/2.5"]
    }
    assert held == {
        **wanted,
        "coordinates": ["inertial"],
        "column": ["x_i_m"],
        "max_error": [8.0],
        "final_error": [-6.0],
    }


def test_events_and_metadata(tmp_path: Path) -> None:
    path = parquet.write_events((FlightEvent(2.5, "climb"), FlightEvent(7.0, "turn")), tmp_path)
    assert path == tmp_path / "events.parquet"
    assert pq.read_table(path).to_pydict() == {"time_s": [2.5, 7.0], "text": ["climb", "turn"]}
    empty = pq.read_table(parquet.write_events((), tmp_path))
    assert empty.schema == pa.schema([("time_s", pa.float64()), ("text", pa.string())])
    stream = Stream("s", TIME, (Vector("v", ("a_m", "b_m"), rows(3.0, 2)),))
    held = pq.read_table(parquet.write_stream(stream, tmp_path, {"run": "x"}))
    assert held.schema.metadata[b"run"] == b"x"
    assert held.to_pydict() == {
        "time_s": TIME.tolist(),
        "a_m": rows(3.0, 2)[:, 0].tolist(),
        "b_m": rows(3.0, 2)[:, 1].tolist(),
    }


def test_row_groups_are_as_large_as_a_page_or_24_mib() -> None:
    """Ten columns of doubles: 80 bytes a row, 314 572 rows in 24 MiB, more than a page; 40 columns: 78 643 rows; 300
    columns: at least one block."""
    assert [parquet._rows_together(columns) for columns in (10, 40, 300)] == [262_144, 78_643, 16_384]
    tables = [pa.table({"a": list(range(10 * k, 10 * k + 4))}) for k in range(5)]
    assert [group["a"].to_pylist() for group in parquet._groups(iter(tables), 9)] == [
        [0, 1, 2, 3, 10, 11, 12, 13], [20, 21, 22, 23, 30, 31, 32, 33], [40, 41, 42, 43]
    ]  # fmt: skip
    assert [len(group) for group in parquet._groups(iter(tables), 8)] == [8, 8, 4]


def run(recorded: bool) -> SimpleNamespace:
    imu = ImuData(TIME, rows(1.0, 3, 2), rows(2.0, 3, 2))
    state = SimpleNamespace(latitude=TIME, longitude=TIME, height=TIME, velocity_ned=rows(7.0, 3), q_nb=rows(8.0, 4))
    reference = SimpleNamespace(**vars(state), time=TIME, position_sigma=None)
    truth = Truth(None, None, 1.0, TIME)  # type: ignore[arg-type]
    vars(truth).update(state=state, ideal=imu)
    return SimpleNamespace(
        truth=RecordedMotion(None, reference) if recorded else truth,  # type: ignore[arg-type]
        sensed=SimpleNamespace(measured=ImuData(TIME, *(2.0 * rows(1.0, 3, 2),) * 2)),
        solutions={"euler": motion(40.0, "euler"), "poisson": motion(60.0, "poisson")},
        errors={"euler": error(50.0)},
        aided=None,
    )


def test_the_streams_of_a_run_in_memory() -> None:
    found = Streams(streams_of_run(run(recorded=False)))
    assert list(found) == ["truth", "imu_ideal", "imu_measured", "nav_euler", "error_euler", "nav_poisson"]
    assert list(Streams(streams_of_run(run(recorded=True)))) == [
        "reference",
        "imu_measured",
        "nav_euler",
        "error_euler",
        "nav_poisson",
    ]
    assert (len(found), "nav_euler" in found, "nav_x" in found) == (6, True, False)
    assert found["imu_ideal"]["dvel_z_mps"].tolist() == [2.03, 3.03]
    assert found["imu_measured"]["dvel_z_mps"].tolist() == [2.06, 4.06]
    assert found["imu_measured"]["time_s"].tolist() == [3.5, 4.5]
    assert found["nav_euler"]["height_m"].tolist() == rows(40.0, 3)[:, 2].tolist()
    assert found["error_euler"]["phi_e_rad"].tolist() == rows(70.0, 3)[:, 1].tolist()
    assert found["truth"].arrow()["velocity_e_mps"].to_pylist() == rows(7.0, 3)[:, 1].tolist()
    assert repr(found) == "Streams(truth, imu_ideal, imu_measured, nav_euler, error_euler, nav_poisson)"
    assert "<td>imu_ideal</td><td>2</td><td>7</td>" in found._repr_html_().replace(
        '<td style="text-align: left">', "<td>"
    )
    with pytest.raises(InputError, match="Did you mean 'nav_euler'"):
        found["nav_eulr"]
    plane = PlaneRun(SimpleNamespace(name="p"), None, {}, media=PlaneMedia())  # type: ignore[arg-type]
    with pytest.raises(InputError, match="one_component"):
        _ = plane.streams
    with pytest.raises(InputError, match="the run p has no solution in three dimensions"):
        plane.plot()


def test_a_stream_as_a_table() -> None:
    table = StreamTable(
        Stream("s", TIME, (Vector("v", ("a_m", "b_m"), rows(3.0, 2)), Vector("w", tuple("cdefghi"), rows(5.0, 7))))
    )
    assert table.columns == ("time_s", "a_m", "b_m", *"cdefghi")
    assert (table.name, len(table)) == ("s", 3)
    assert repr(table) == "StreamTable(s: 3 rows, 3 … 4.5 s; time_s, a_m, b_m, c, d, e, f, g, … 10 columns in all)"
    short = StreamTable(Stream("t", TIME[:0], (Vector("v", ("a_m",), rows(3.0, 1, 0)),)))
    assert repr(short) == "StreamTable(t: 0 rows; time_s, a_m)"
    assert table["i"].tolist() == rows(5.0, 7)[:, 6].tolist()
    assert table.arrow().column_names == list(table.columns)
    with pytest.raises(InputError, match="column of the stream s"):
        table["z"]


def test_a_library_that_is_not_installed() -> None:
    with pytest.raises(InputError, match=r"pip install 'sinssim\[no_such_library\]', or take arrow\(\)"):
        streams._needed("no_such_library")


def test_scores_beside_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """RUN/scores has the report, the recording, and a folder of each solution; the run's files stay."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "summary.json").write_text("{}")
    (folder / ".sinssim.json").write_text('{"files": ["summary.json"]}')
    judge: Any = SimpleNamespace(run=SimpleNamespace(path=folder, solutions={}))
    one = Score("mine", Path("m.csv"), "csv", motion(40.0, "x"), error(50.0), 2.5, ())
    monkeypatch.setattr(run_scores, "page_of", lambda exhibits: f"<p>{exhibits}</p>")
    monkeypatch.setattr(run_scores, "score_exhibits", lambda scored: "page")
    monkeypatch.setattr(run_scores, "record_scores", lambda scored, path: path.write_text("recording"))
    found = run_scores.write_scores(score.Scored(judge, [one], {}, (5.0, 6.0)))
    assert found == folder / "scores/report.html"
    held = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    assert held == [
        ".sinssim.json", "scores/mine/error_mine.parquet", "scores/mine/nav_mine.parquet", "scores/mine/score.json",
        "scores/recording.rrd", "scores/report.html", "summary.json",
    ]  # fmt: skip
    numbers = json.loads((folder / "scores/mine/score.json").read_text())
    assert (numbers["name"], numbers["compared_to_s"], numbers["compute_s"]) == ("mine", 6.0, 2.5)
    assert (found.read_text(), (folder / "scores/recording.rrd").read_text()) == ("<p>page</p>", "recording")
    nav = pq.read_table(folder / "scores/mine/nav_mine.parquet").to_pydict()
    assert nav["height_m"] == rows(40.0, 3)[:, 2].tolist()
    wrong = pq.read_table(folder / "scores/mine/error_mine.parquet").to_pydict()
    assert wrong["position_e_m"] == rows(50.0, 3)[:, 1].tolist()
    assert sorted(written(folder)) == [name for name in held if name != ".sinssim.json"]


def test_the_name_of_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "processor : 0\nvendor_id : V\nmodel : 6\nmodel name\t: Fast CPU: 3 GHz\nmodel name\t: Second\n"
    monkeypatch.setattr(run_directory, "open", lambda *_, **__: io.StringIO(text), raising=False)
    assert run_directory.processor() == "Fast CPU: 3 GHz"
    monkeypatch.setattr(run_directory, "open", lambda *_, **__: io.StringIO(""), raising=False)
    monkeypatch.setattr(run_directory.platform, "processor", lambda: "arm")
    assert run_directory.processor() == "arm"
