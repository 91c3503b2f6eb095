"""The files that results are written in, by stand-ins for their contents, and what is left where one fails."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.parquet as pq
import pytest

from sinssim.analyses import calibration_result as calibration
from sinssim.analyses.error_budget import budget_exhibits as budget
from sinssim.experiments.studies import study_exhibits as study
from sinssim.experiments.studies.study_results import Case, CoordinateError
from sinssim.system.files import MARK


def texts(folder: Path) -> dict[str, str]:
    """Return the texts of all files but the mark."""
    return {file.name: file.read_text(encoding="utf-8") for file in folder.iterdir() if file.name != MARK}


def writes(text: str) -> Any:
    """Return what writes a text, with its plain arguments, to the path among its arguments."""

    def write(*given: Any, **more: Any) -> None:
        (path,) = (one for one in given if isinstance(one, Path))
        said = [one for one in given if isinstance(one, tuple | str | dict)]
        path.write_text(f"{text}{''.join(f' {one}' for one in said)}", encoding="utf-8")

    return write


def test_a_budget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "to_json", lambda result, answers, times: {"σ": [answers, times]})
    monkeypatch.setattr(budget, "_write_parquet", writes("table"))
    monkeypatch.setattr("sinssim.analyses.error_budget.budget_exhibits.exhibits_of",
                        lambda result, answers, times: f"{answers} {times}")  # fmt: skip
    monkeypatch.setattr("sinssim.recording.page.page_of", lambda exhibits: f"report {exhibits}")
    monkeypatch.setattr("sinssim.recording.rerun_exhibits.record", writes("recording"))
    scenario, media = SimpleNamespace(to_toml=lambda: "seed = 3\n"), budget.BudgetMedia()
    result: Any = SimpleNamespace(scenario=scenario, answers=lambda: ("answer",), times=(5.0,))
    place = media.save(result, tmp_path / "b", overwrite=False)
    assert texts(place) == {
        "budget.json": '{\n  "σ": [\n    [\n      "answer"\n    ],\n    [\n      5.0\n    ]\n  ]\n}\n',
        "scenario.toml": "seed = 3\n", "budget.parquet": "table", "report.html": "report ('answer',) (5.0,)",
        "recording.rrd": "recording ('answer',) (5.0,)",
    }  # fmt: skip
    assert place == tmp_path / "b"

    def fails(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("sinssim.recording.rerun_exhibits.record", fails)
    with pytest.raises(ZeroDivisionError):
        media.save(result, tmp_path / "b", overwrite=True)
    assert texts(place)["recording.rrd"] == "recording ('answer',) (5.0,)"
    with pytest.raises(ZeroDivisionError):
        media.save(result, tmp_path / "c", overwrite=False)
    assert [one.name for one in tmp_path.iterdir()] == ["b"]


def test_a_calibration(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration, "to_json", lambda result: {"unit": "µg"})
    monkeypatch.setattr(calibration, "compensation_text", lambda result: "[compensation]\n")
    monkeypatch.setattr("sinssim.analyses.calibration_result.exhibits_of", lambda result: "exhibits")
    monkeypatch.setattr("sinssim.recording.page.page_of", lambda exhibits: f"page of {exhibits}")
    result: Any = SimpleNamespace(scenario=SimpleNamespace(to_toml=lambda: "seed = 3\n"))
    media = calibration.CalibrationMedia()
    place = media.save(result, tmp_path / "c", overwrite=False)
    assert texts(place) == {
        "calibration.json": '{\n  "unit": "µg"\n}\n', "compensation.toml": "[compensation]\n",
        "scenario.toml": "seed = 3\n", "report.html": "page of exhibits",
    }  # fmt: skip
    monkeypatch.setattr("sinssim.recording.page.page_of", lambda exhibits: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        media.save(result, tmp_path / "d", overwrite=False)
    assert [one.name for one in tmp_path.iterdir()] == ["c"]


def test_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "to_json", lambda comparison: {"°": 1})
    monkeypatch.setattr(study, "exhibits_of", lambda comparison: "exhibits")
    monkeypatch.setattr("sinssim.recording.page.page_of", lambda exhibits: f"page of {exhibits}")
    monkeypatch.setattr("sinssim.recording.rerun_exhibits.record", writes("recording of"))
    contents = {True: {"name": "all", "parts": ({"title": "one", "rates_hz": (1.0, 2.0)},)}}
    case = Case("one", "cone", "gyros", "ideal", "euler", "level", "normal", "exact", 50.0, (50.0, 12.5, 2.0), "hold")
    error = CoordinateError(case, "ecef", "x_m", 3.5, 1.25)
    result: Any = SimpleNamespace(
        study=SimpleNamespace(model_dump=lambda exclude_none: contents[exclude_none]),
        rows=[],
        coordinate_errors=[error],
    )
    study.write_study(result, tmp_path)
    assert (tmp_path / "study.toml").read_text() == (
        'name = "all"\n\n[[parts]]\ntitle = "one"\nrates_hz = [\n    1.0,\n    2.0,\n]\n'
    )
    assert (tmp_path / "results.json").read_text(encoding="utf-8") == '{\n  "°": 1\n}\n'
    assert (tmp_path / "report.html").read_text() == "page of exhibits"
    assert (tmp_path / "recording.rrd").read_text() == "recording of exhibits"
    (row,) = pq.read_table(tmp_path / "coordinates.parquet").to_pylist()
    assert row == {
        "part": "one", "motion": "cone", "variant": "gyros", "sensors": "ideal", "algorithm": "euler", "frame": "level",
        "gravity": "normal", "curvature": "exact", "rate_hz": 50.0, "schedule_hz": "50/12.5/2", "slow": "hold",
        "ellipsoid": "truth", "coordinates": "ecef", "column": "x_m", "max_error": 3.5, "final_error": 1.25,
    }  # fmt: skip
    result.coordinate_errors = []
    (tmp_path / "b").mkdir()
    study.write_study(result, tmp_path / "b")
    assert not (tmp_path / "b" / "coordinates.parquet").exists()
