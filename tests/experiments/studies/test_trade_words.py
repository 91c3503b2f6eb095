"""What a trade study says while it runs and when it stops, and what it writes, with known numbers."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments import workload
from sinssim.experiments.studies import trade_run as running
from sinssim.experiments.studies.trade_cells import CellNumbers
from sinssim.experiments.studies.trade_exhibits import write_trade
from sinssim.experiments.studies.trade_run import TradeDirectory, _contents, _numbers, trade
from sinssim.recording import figures
from sinssim.statistics.requirements import VerdictInUnit
from tests.experiments.studies.trade_examples import study
from tests.experiments.studies.trades_by_hand import BIAS, RISING, UNITS, made


class StopError(Exception):
    """Ends a study at its first step."""


@pytest.mark.parametrize(
    ("keys", "count", "what"),
    [
        ({}, 3, "3 budgets"),
        ({"cell": "ensemble", "runs": 70}, 3, "3 ensembles of 70 runs"),
        ({"cell": "ensemble", "set": ("ensemble.runs=33",)}, 3, "3 ensembles of 33 runs"),
    ],
)
def test_what_is_computed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keys: Any, count: int, what: str) -> None:
    seen: list[Any] = []

    def watch(*given: Any) -> None:
        seen.extend(given)
        raise StopError

    monkeypatch.setattr(running, "Watch", watch)
    with pytest.raises(StopError):
        trade(study(tmp_path, axes=(RISING,), **keys), limit_minutes=7.5)
    assert seen[:4] == ["small", what, count, 7.5]


def test_the_time_of_flights(monkeypatch: pytest.MonkeyPatch) -> None:
    """JSBSim flies 250 times as fast as real time; a flight in the cache takes no time, nor does another motion."""
    monkeypatch.setattr("sinssim.truth.flight.flight_cache.is_cached", lambda flight, seed: flight == "known")
    monkeypatch.setattr(workload, "expected_duration", lambda scenario: scenario.lasts)
    flights = (("new", 1000.0, 4.0), ("known", 2000.0, 0.0), (None, 3000.0, 0.0), ("other", 500.0, 2.0))
    for flight, lasts, wait in flights:
        assert workload.flight_wait(SimpleNamespace(flight=flight, seed=1, lasts=lasts)) == wait  # type: ignore[arg-type]


def test_cells_in_the_order_of_their_motions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells on one motion follow one another; two cells with the same numbers are computed once."""
    order: list[int] = []

    def compute(self: Any, one: Any, *_: Any) -> None:
        order.append(one.number)
        self._enter(one.digest, failure=f"cell {one.number} fell.")

    monkeypatch.setattr(running, "truth_key", lambda scenario: str(scenario.imu.grade))
    monkeypatch.setattr(running._Work, "_compute", compute)
    axes = ({"key": BIAS, "values": (0.01, 0.02)}, {"key": "imu.grade", "values": ("tactical", "laser-standard")})
    with pytest.raises(InputError, match=r"all 4 cells of the study small failed; cell 1: cell 1 fell\.$"):
        trade(study(tmp_path, axes=axes))
    assert order == [1, 3, 2, 4]
    axes = ({"key": BIAS, "values": (0.01,)},)
    with pytest.raises(InputError, match=r"all 1 cells of the study small failed; cell 1: cell 1 fell\. See .*made\."):
        trade(study(tmp_path, axes=axes), tmp_path / "made")


def test_what_is_said_of_an_interrupted_study() -> None:
    """Two of six cells are finished."""

    class Result(SimpleNamespace):
        def __len__(self) -> int:
            return 6

    result: Any = Result(finished=2)
    work = running._Work(result, None, None, None, None)  # type: ignore[arg-type]
    assert work.finished == "2 of 6 cells"
    work.conclude("interrupted")
    assert result.status == "interrupted"
    result.finished = 0
    assert work.finished == ""


def test_numbers_come_back_in_their_places() -> None:
    """All different, so that none can take the place of another."""
    verdict = VerdictInUnit("r95 <= 1 m", "not met", 2.5, 1.5, "km", 30.0, None, 12.0, 4.0)
    numbers = CellNumbers({"b": 2.0, "a": 1.0}, (verdict,), np.array([3.0, 4.0]), np.array([5.0, 6.0]),
                          np.array([7.0, 8.0]), ("One.", "Two."))  # fmt: skip
    contents = _contents(numbers)
    assert contents == {
        "values": {"b": 2.0, "a": 1.0},
        "verdicts": [{"requirement": "r95 <= 1 m", "verdict": "not met", "value": 2.5, "limit": 1.5, "unit": "km",
                      "time_s": 30.0, "more_runs": None, "exceeded_from_s": 12.0, "after_fixes_end_s": 4.0}],
        "time": [3.0, 4.0], "cep": [5.0, 6.0], "r95": [7.0, 8.0], "notes": ["One.", "Two."],
        "sources": [], "instants": {},
    }  # fmt: skip
    found = _numbers(json.loads(json.dumps(contents)))
    assert (found.values, found.verdicts, found.notes) == (numbers.values, numbers.verdicts, numbers.notes)
    assert (found.time.tolist(), found.cep.tolist(), found.r95.tolist()) == ([3.0, 4.0], [5.0, 6.0], [7.0, 8.0])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"name": "other"}, "it is the study other, not small"),
        ({"cell": "ensemble"}, "it has ensemble cells, not budget cells"),
        ({"scenario": {}}, "it is of another scenario"),
    ],
)
def test_another_study_is_named(tmp_path: Path, changed: dict[str, Any], said: str) -> None:
    TradeDirectory(place := tmp_path / "made", study(tmp_path)).close()
    about = json.loads((place / "trade.json").read_text())
    (place / "trade.json").write_text(json.dumps(about | changed))
    with pytest.raises(InputError, match=rf"the study in {place} cannot be continued: {said}.*replace it with --over"):
        TradeDirectory(place, study(tmp_path), resume=True)
    (place / "trade.json").write_text(json.dumps(about))
    TradeDirectory(place, study(tmp_path), resume=True).close()


def test_the_files_of_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every file that is named is there; study.toml loads to the study."""
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, to, **_: Path(to).write_bytes(b"x"))
    monkeypatch.setattr("sinssim.recording.page.page_of", lambda exhibits: "page")
    monkeypatch.setattr("sinssim.recording.rerun_exhibits.record", lambda exhibits, path: path.write_bytes(b"y"))
    result = made(tmp_path)
    place = tmp_path / "out"
    place.mkdir()
    write_trade(result, place)
    drawn = [f"{name}{ending}" for name in ("r95_end", "r95_end_map", "r95_30s", "r95_30s_map", "heading_run",
             "heading_run_map", "growth") for ending in (".svg", ".png")]  # fmt: skip
    assert {file.name for file in place.iterdir()} == {
        "study.toml", "results.json", "results.parquet", "summary.md", "report.html", *drawn, "recording.rrd",
    }  # fmt: skip
    loaded = tomllib.loads((place / "study.toml").read_text())
    assert {name: value for name, value in loaded["axes"][1].items() if value} == {
        "key": BIAS, "values": [0.02, 0.01, 0.05],
    }  # fmt: skip
    assert loaded["times_s"] == [30.0]


def test_the_plot_of_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first drawn quantity, or the one that is asked for; a notebook gets a picture."""
    result = made(tmp_path, (UNITS, RISING), draw=("cep(end)", "r95(end)"))
    monkeypatch.setattr(figures, "to_png", lambda figure: figure.axes[0].get_ylabel().encode())
    first = result.plot()
    assert first.axes[0].get_ylabel() == "CEP at the end [m]"
    assert result.plot("r95(30 s)").axes[0].get_ylabel() == "R95 at 30 s [m]"
    assert first._repr_png_() == b"CEP at the end [m]"
