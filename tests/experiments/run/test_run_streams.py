"""Streams of a finished run: stored ones and errors that follow from them, with the bits of the run in memory."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import FinishedRun, load_streams
from sinssim.experiments.run.run_result import Run
from sinssim.logs.formats.export_streams import export
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario.schema import Scenario


def _scenario(**changes: object) -> Scenario:
    """A minute and a half along a great circle near the pole, where errors are compared in transported axes."""
    circle = {
        "latitude_deg": 89.9, "longitude_deg": 20.0, "altitude_m": 300.0, "course_deg": 30.0, "speed_mps": 200.0,
        "duration_s": 90.0,
    }  # fmt: skip
    algorithms = ["quaternion", "euler"]
    return Scenario.model_validate(
        {
            "name": "streams",
            "great_circle": circle,
            "imu": {"grade": "mems-industrial", "rate_hz": 50.0},
            "navigation": {"algorithms": algorithms, "frame": "free-azimuth"},
            "truth": {"ellipsoid": "pz-90.11"},
            "recording": {"detail": "none"},
            **changes,
        }
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return sinssim.run(_scenario(), tmp_path_factory.mktemp("streams") / "run")


def _place(run: Run) -> Path:
    assert run.directory is not None
    return run.directory


def test_every_stream_has_the_bits_of_the_run_in_memory(made: Run) -> None:
    streams = load_streams(_place(made))
    assert {f"error_{name}" for name in made.solutions} <= set(streams)
    assert not list((_place(made) / "streams").glob("error_*"))
    assert made.navigated.axes == "transported"
    for name, own in made.streams.items():
        found = streams[name]
        assert found.columns == own.columns
        for column in own.columns:
            assert found[column].tobytes() == np.ascontiguousarray(own[column]).tobytes(), (name, column)


def test_errors_are_those_of_a_difference_in_place_by_hand(made: Run) -> None:
    """Velocity and height errors are plain differences of the stored columns where north is that of the meridian."""
    run = RecordedRun(_place(made))
    truth, own = run.solution("truth"), run.solution("euler")
    rows = run.errors("euler")
    np.testing.assert_array_equal(rows[0], truth.time)
    np.testing.assert_array_equal(-rows[3], own.height - truth.height)
    assert truth.velocity_ned is not None
    assert own.velocity_ned is not None
    np.testing.assert_array_equal(rows[6], own.velocity_ned[:, 2] - truth.velocity_ned[:, 2])
    # the distance: the radius of a parallel and of the meridian near the pole are a²/b times the colatitude
    polar = 6378136.0 / (1.0 - 1.0 / 298.25784)
    x, y = (
        polar * (np.pi / 2 - one.latitude) * np.array([np.cos(one.longitude), np.sin(one.longitude)])
        for one in (truth, own)
    )
    np.testing.assert_allclose(np.hypot(rows[1], rows[2])[-1], np.hypot(*(y - x)[:, -1]), rtol=1e-3)


def test_a_run_of_an_older_version_has_stored_errors(made: Run, tmp_path: Path) -> None:
    shutil.copytree(_place(made), tmp_path / "old")
    stored = pa.table({"time_s": [0.0, 1.0], **{name: [1.0, 2.0] for name in _ERRORS}})
    pq.write_table(stored, tmp_path / "old" / "streams" / "error_euler.parquet")
    assert FinishedRun(tmp_path / "old").errors("euler").position_ned.tolist() == [[1.0] * 3, [2.0] * 3]
    np.testing.assert_array_equal(
        FinishedRun(tmp_path / "old").errors("quaternion").attitude,
        FinishedRun(_place(made)).errors("quaternion").attitude,
    )


_ERRORS = (
    "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
    "phi_n_rad", "phi_e_rad", "phi_d_rad",
)  # fmt: skip


def test_changed_files_and_other_versions_are_refused_by_name(made: Run, tmp_path: Path) -> None:
    shutil.copytree(_place(made), tmp_path / "cut")
    file = tmp_path / "cut" / "streams" / "truth.parquet"
    pq.write_table(pq.read_table(file).slice(5), file)
    with pytest.raises(InputError, match=r"nav_euler.parquet and .*truth.parquet have different times"):
        load_streams(tmp_path / "cut")["error_euler"]
    shutil.copytree(_place(made), tmp_path / "newer")
    file = tmp_path / "newer" / "streams" / "nav_euler.parquet"
    table = pq.read_table(file)
    rule = json.loads(table.schema.metadata[b"sinssim.error"]) | {"version": 99}
    pq.write_table(table.replace_schema_metadata({"sinssim.error": json.dumps(rule)}), file)
    with pytest.raises(InputError, match=r"nav_euler.parquet is of another version of sinssim: .* 99"):
        load_streams(tmp_path / "newer")


def test_an_export_has_the_errors_as_files(made: Run, tmp_path: Path) -> None:
    done = export(_place(made), "parquet", tmp_path / "tables")
    streams = load_streams(_place(made))
    assert {file.stem for file in done.files} == {*streams, "events"}
    for name in ("error_quaternion", "nav_quaternion", "truth"):
        table = pq.read_table(tmp_path / "tables" / f"{name}.parquet")
        assert table.equals(streams[name].arrow()), name


def test_what_is_not_there_is_refused_by_name(made: Run, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"error_eular.*error_euler"):
        load_streams(_place(made))["error_eular"]
    shutil.copytree(_place(made), tmp_path / "bare")
    shutil.rmtree(tmp_path / "bare" / "streams")
    with pytest.raises(InputError, match=r"has no streams.*--keep streams"):
        load_streams(tmp_path / "bare")


def test_the_example_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    code = re.findall(r"```python\n(.*?)```", page.split("## The streams of a run directory")[1], re.DOTALL)[0]
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    stored, in_memory = capsys.readouterr().out.split()
    assert stored == in_memory
