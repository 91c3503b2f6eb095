"""Finished runs: listed with what they are, compared over their common time, refused by name where they cannot be."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sinssim.cli import app as cli
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import FinishedRun, load_streams, runs_in
from sinssim.experiments.run.run_comparison import compare_runs, comparison_exhibits
from sinssim.experiments.run.run_execution import run
from sinssim.recording.page import page_of
from sinssim.scenario.schema import Scenario
from tests.recording import fake_run


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a long run, a short one of another scenario, one without streams, and one of one component."""
    folder = tmp_path_factory.mktemp("finished") / "runs"
    with pytest.MonkeyPatch.context() as patch:
        fake_run.install(3000, patch.setattr)
        run(fake_run.scenario(detail="none"), folder / "long")
        fake_run.install(1000, patch.setattr)
        run(fake_run.scenario(("euler", "quaternion"), keep="streams"), folder / "deep" / "short")
        run(fake_run.scenario(keep="report"), folder / "bare")
    plane = {"variant": "one-integral", "duration_s": 20.0, "rate_hz": 10.0, "gyro": {}}
    run(Scenario.model_validate({"name": "plane", "one_component": plane, "recording": {"detail": "none"}}),
        folder / "plane")  # fmt: skip
    (folder / "others").mkdir()
    (folder / "others" / "thesis.tex").write_text("mine")
    return folder


def test_the_list_has_every_run_with_its_size(made: Path) -> None:
    entries = {entry.path.name: entry for entry in runs_in(made)}
    assert set(entries) == {"long", "short", "bare", "plane"}
    for name, entry in entries.items():
        files = [Path(where) / file for where, _, names in os.walk(entry.path) for file in names]
        assert entry.size_bytes == sum(os.path.getsize(file) for file in files), name
        assert entry.kind == "run"
    summary = json.loads((made / "long" / "summary.json").read_text())
    assert entries["long"].solution == "quaternion"
    assert entries["long"].rms_horizontal_error_m == summary["algorithms"]["quaternion"]["rms_horizontal_error_m"]
    assert entries["short"].solution == "euler"
    dates = [entry.date for entry in runs_in(made)]
    assert dates == sorted(dates, reverse=True)
    with pytest.raises(InputError, match="does not exist"):
        runs_in(made / "nowhere")


def test_errors_come_back_bit_by_bit(made: Path) -> None:
    stream = load_streams(made / "long")["error_poisson"]
    error = FinishedRun(made / "long").errors("poisson")
    np.testing.assert_array_equal(error.position_ned[:, 1], stream["position_e_m"])
    np.testing.assert_array_equal(error.attitude[:, 2], stream["phi_d_rad"])


def test_numbers_are_those_of_the_time_in_common(made: Path) -> None:
    compared = compare_runs([made / "long", made / "deep" / "short"])
    assert compared.span == (0.0, 10.0)
    assert compared.is_cut
    assert compared.solutions == {"long": "quaternion", "short": "euler"}
    east, north = (
        load_streams(made / "long")["error_quaternion"][name][:1001] for name in ("position_e_m", "position_n_m")
    )
    rms = np.sqrt(np.mean(north**2 + east**2))
    assert compared.numbers["long"]["rms_horizontal_error_m"] == pytest.approx(rms, rel=1e-12)
    own = json.loads((made / "deep" / "short" / "summary.json").read_text())["algorithms"]["euler"]
    for key, value in own.items():
        expected = abs(value) if key == "final_height_error_m" else value
        assert abs(compared.numbers["short"][key] or 0.0) == pytest.approx(expected, rel=1e-12), key
    assert list(compared.differences) == ["navigation.algorithms"]
    assert compared.differences["navigation.algorithms"] == ["quaternion, poisson, euler", "euler, quaternion"]


def test_the_report_draws_each_run_in_one_colour(made: Path) -> None:
    page = page_of(comparison_exhibits(compare_runs([made / "long", made / "deep" / "short"], "quaternion")))
    assert "A run that is longer is cut to it" in page
    assert page.count("<svg") >= 9
    first = page.split('class="swatch" style="background:')[1][:7]
    assert page.count(f'stroke="{first}"') >= 9
    assert "<th" in page.split("What differs in the scenarios")[1]


@pytest.mark.parametrize(
    ("folders", "solution", "words"),
    [
        (["long"], None, "at least two runs"),
        (["long", "long"], None, "is given twice"),
        (["long", "bare"], None, "bare has no errors over time.*run it again with --keep streams"),
        (["long", "plane"], None, "plane is a run of the one-component system"),
        (["long", "others"], None, "others holds no run"),
        (["long", "deep/short"], "poisson", r"solution of .*short.*poisson"),
    ],
)
def test_what_cannot_be_compared_is_refused_by_name(
    made: Path, folders: list[str], solution: str | None, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        compare_runs([made / folder for folder in folders], solution)


def test_runs_without_common_time_are_refused_by_their_times(made: Path, tmp_path: Path) -> None:
    shutil.copytree(made / "deep" / "short", tmp_path / "late")
    file = tmp_path / "late" / "streams" / "error_euler.parquet"
    table = load_streams(tmp_path / "late")["error_euler"].arrow()
    pq.write_table(table.set_column(0, "time_s", pa.array(table["time_s"].to_numpy() + 100.0)), file)
    with pytest.raises(InputError, match="no time in common: late begins when long has ended"):
        compare_runs([made / "long", tmp_path / "late"])


def test_a_directory_of_another_version_is_refused_by_name(made: Path, tmp_path: Path) -> None:
    shutil.copytree(made / "deep" / "short", tmp_path / "old")
    (tmp_path / "old" / "summary.json").write_text('{"result": 1}')
    with pytest.raises(InputError, match=r"summary.json lacks scenario and versions. The file was changed after"):
        compare_runs([made / "long", tmp_path / "old"])
    (entry,) = runs_in(tmp_path)
    assert "another version" in entry.problem
    shutil.copytree(made / "deep" / "short", tmp_path / "other")
    file = tmp_path / "other" / "streams" / "error_euler.parquet"
    table = load_streams(tmp_path / "other")["error_euler"].arrow()
    pq.write_table(table.rename_columns([name.replace("phi", "angle") for name in table.column_names]), file)
    with pytest.raises(InputError, match=r"error_euler.parquet cannot be read .* run its scenario.toml again"):
        compare_runs([made / "long", tmp_path / "other"])


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    return stopped.value.code if isinstance(stopped.value.code, int) else 0


def test_the_commands(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("runs", str(made), "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert {Path(one["path"]).name for one in found} == {"long", "short", "bare", "plane"}
    assert call("runs", str(made)) == 0
    assert "4 in" in capsys.readouterr().out
    assert call("runs", str(made / "others")) == 0
    said = capsys.readouterr().out
    assert "No runs in" in said
    assert "sinssim run SCENARIO" in said
    pair = (str(made / "long"), str(made / "deep" / "short"), "-o", str(tmp_path / "both"))
    assert call("compare-runs", *pair) == 0
    assert "errors from 0 s to 10 s" in capsys.readouterr().out
    assert {file.name for file in (tmp_path / "both").iterdir()} == {".sinssim.json", "comparison.json", "report.html"}
    contents = json.loads((tmp_path / "both" / "comparison.json").read_text())
    assert contents["runs"]["short"]["solution"] == "euler"
    assert call("compare-runs", *pair) == 2
    assert "already contains a run" in capsys.readouterr().err
    assert call("compare-runs", str(made / "long"), str(tmp_path / "both")) == 2
    assert "is a comparison of runs" in capsys.readouterr().err
