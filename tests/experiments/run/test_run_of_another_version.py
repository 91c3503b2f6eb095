"""A run directory of an older version: read with a warning that names the version, or refused with it."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import FinishedRun, load_streams, runs_in
from sinssim.experiments.run.run_comparison import compare_runs
from sinssim.logs.imu_samples import read_log
from sinssim.logs.stored_run import RecordedRun, version_of
from sinssim.scenario.schema import Scenario

NOW = sinssim.__version__
VERSIONS = f"was written by sinssim 0.0.1, and this is {NOW}"


@pytest.fixture(scope="module")
def new(tmp_path_factory: pytest.TempPathFactory) -> Path:
    circle = {"latitude_deg": 50.0, "course_deg": 30.0, "speed_mps": 200.0, "duration_s": 4.0}
    plan = {
        "name": "new", "great_circle": circle, "imu": {"grade": "tactical", "rate_hz": 20.0},
        "navigation": {"algorithms": ["quaternion"]}, "recording": {"detail": "none"},
    }  # fmt: skip
    found = sinssim.run(Scenario.model_validate(plan), tmp_path_factory.mktemp("runs") / "new")
    assert found.directory is not None
    return found.directory


@pytest.fixture
def old(new: Path, tmp_path: Path) -> Path:
    """A directory with other columns of the streams, and without most keys of the summary."""
    folder = tmp_path / "old"
    shutil.copytree(new, folder)
    numbers = {"rms_position_error_m": 3.0}
    summary = {"scenario": "new", "versions": {"sinssim": "0.0.1"}, "algorithms": {"quaternion": numbers}}
    (folder / "summary.json").write_text(json.dumps(summary))
    for name in ("truth", "nav_quaternion", "imu_measured"):
        file = folder / "streams" / f"{name}.parquet"
        table = pq.read_table(file)
        short = [c.replace("latitude", "lat").replace("dtheta", "angle") for c in table.column_names]
        pq.write_table(table.rename_columns(short).replace_schema_metadata(table.schema.metadata), file)
    return folder


def said(call: Callable[[], Any]) -> tuple[Any, list[str]]:
    """Return the result of a call, or its error, and its warnings."""
    found: Any
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = call()
        except InputError as error:
            found = error
    return found, [str(one.message) for one in caught if issubclass(one.category, sinssim.SinssimWarning)]


def test_the_version_of_a_run(new: Path, old: Path) -> None:
    assert version_of(new) == NOW
    assert version_of(old) == "0.0.1"
    (old / "summary.json").unlink()
    assert version_of(old) == NOW  # of the mark
    assert version_of(old.parent) == ""
    assert said(lambda: load_streams(new))[1] == []
    assert said(lambda: RecordedRun(new))[1] == []


def test_a_version_that_differs_in_its_last_part_is_the_same(new: Path, tmp_path: Path) -> None:
    shutil.copytree(new, tmp_path / "patch")
    summary = json.loads((new / "summary.json").read_text())
    summary["versions"]["sinssim"] = f"{NOW.rpartition('.')[0]}.99"
    (tmp_path / "patch" / "summary.json").write_text(json.dumps(summary))
    assert said(lambda: load_streams(tmp_path / "patch"))[1] == []


def test_streams_of_an_older_version_are_read_with_a_warning(old: Path) -> None:
    streams, warned = said(lambda: load_streams(old))
    assert [f"{VERSIONS}: its numbers" in one for one in warned] == [True]
    assert "lat_rad" in streams["truth"].arrow().column_names
    with pytest.raises(InputError, match=f"latitude_rad.*{VERSIONS}"):
        streams["error_quaternion"]


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda old: RecordedRun(old).solution("truth"), "truth.parquet has no column latitude_rad"),
        (lambda old: compare_runs([old.parent / "new", old]), "nav_quaternion.parquet cannot be read as the errors"),
        (lambda old: read_log(old / "streams" / "imu_measured.parquet"), "unknown column 'dtheta_x_rad'"),
    ],
)
def test_what_cannot_be_read_is_refused_with_the_version(
    call: Callable[[Path], Any], what: str, new: Path, old: Path
) -> None:
    shutil.copytree(new, old.parent / "new")
    error, warned = said(lambda: call(old))
    assert isinstance(error, InputError)
    assert what in str(error)
    assert [VERSIONS in one for one in warned] == [True]


def test_errors_that_do_not_follow_from_the_streams(old: Path) -> None:
    file = old / "streams" / "nav_quaternion.parquet"
    pq.write_table(pq.read_table(file).replace_schema_metadata(None), file)
    with pytest.raises(InputError, match=f"no errors over time: they do not follow from its streams.*{VERSIONS}"):
        FinishedRun(old).solution()


def test_the_place_of_a_run_of_an_older_version(old: Path) -> None:
    with pytest.raises(InputError, match=f"nav_quaternion.parquet cannot be read as a solution: .*{VERSIONS}"):
        FinishedRun(old).place()


def test_a_list_of_runs_has_the_version(old: Path) -> None:
    (entry,) = runs_in(old.parent)
    assert (entry.sinssim, entry.problem, entry.rms_horizontal_error_m) == ("0.0.1", "", None)


def test_a_run_with_a_changed_stream_is_not_taken_for_one_of_another_kind(new: Path, tmp_path: Path) -> None:
    shutil.copytree(new, tmp_path / "changed")
    pq.write_table(pa.table({"time_s": np.arange(3.0)}), tmp_path / "changed" / "streams" / "truth.parquet")
    with pytest.raises(InputError, match=r"no column latitude_rad.*was changed after the run, or belongs to"):
        RecordedRun(tmp_path / "changed").solution("truth")
