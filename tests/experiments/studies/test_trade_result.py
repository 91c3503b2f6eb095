"""The result of a trade study: arrays over the grid, rows, tables, words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies.trade_cells import Cell, CellNumbers, cells_of
from sinssim.experiments.studies.trade_exhibits import exhibits_of, grids
from sinssim.experiments.studies.trade_result import (
    TradeResult,
    cell_table,
    headline,
    requirement_lines,
    unit_for,
)
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.recording.rerun_exhibits import markdown
from sinssim.statistics.requirements import Quantity, VerdictInUnit, Word
from sinssim.units import two_digits
from tests.experiments.studies.trade_examples import BIAS, GRADE, study

R95 = (10.0, 20.0, 30.0, 40.0, float("nan"), 60.0)


def made(folder: Path, band: bool = False) -> TradeResult:
    """Return a study of six cells, of which the fifth failed, with R95 of `R95` and a limit of 35 m."""
    plan = study(folder, require=("r95(end) <= 35 m",), cell="ensemble" if band else "budget")
    cells = []
    for cell, r95 in zip(cells_of(plan), R95, strict=True):
        word: Word = (
            "met" if r95 <= 25.0 else "undecided" if r95 <= 40.0 and band else "met" if r95 <= 35.0 else "not met"
        )
        verdict = VerdictInUnit("r95(end) <= 35 m", word, r95, 35.0, "m", 60.0, 500 if word == "undecided" else 0)
        values = {q.column: 0.5 * r95 for q in plan.quantities} | {"r95_end_m": r95, "heading_end_rad": 1e-5 * r95}
        if band:
            values |= {"r95_end_m_low": r95 - 5.0, "r95_end_m_high": float("inf"), "runs": 40.0, "failed_runs": 0.0}
        time = np.linspace(0.0, 60.0, 7)
        numbers = CellNumbers(values, (verdict,), time, 0.4 * r95 * time / 60.0, r95 * time / 60.0)
        failed = np.isnan(r95)
        cells.append(replace(cell, numbers=None if failed else numbers, failure="the flight failed." if failed else ""))
    return TradeResult(plan, tuple(cells), media=TradeMedia())


def test_arrays(tmp_path: Path) -> None:
    result = made(tmp_path)
    np.testing.assert_array_equal(result.values("r95(end)"), np.reshape(R95, (2, 3)))
    np.testing.assert_array_equal(result.values("r95_end_m"), result.values(Quantity("r95", "end")))
    assert np.isnan(result.band("r95(end)")[0]).all()
    assert result.verdicts().tolist() == [["met", "met", "met"], ["not met", "", "not met"]]
    assert result.verdicts("r95(end) <= 35 m").tolist() == result.verdicts().tolist()
    assert result.failures == {5: "the flight failed."}
    assert (result.finished, len(result), result.shape) == (5, 6, (2, 3))
    assert repr(result) == "TradeResult(small: 2 × 3 budget cells, 1 failed)"
    with pytest.raises(InputError, match=r"does not have 'r95\(7 s\)'.*times_s"):
        result.values("r95(7 s)")
    with pytest.raises(InputError, match="Did you mean 'r95'"):
        result.values("r59")
    with pytest.raises(InputError, match="unknown requirement"):
        result.verdicts("r95 <= 1 m")
    with pytest.raises(InputError, match="cells 1 to 6"):
        result.command(7)


def test_rows_and_parquet(tmp_path: Path) -> None:
    result = made(tmp_path)
    table = pq.read_table(result.to_parquet(tmp_path / "there" / "cells.parquet"))
    assert table.num_rows == 6
    assert table.column("cell").to_pylist() == [1, 2, 3, 4, 5, 6]
    assert table.column(GRADE).to_pylist() == ["laser-navigation"] * 3 + ["laser-standard"] * 3
    assert table.column(BIAS).to_pylist() == [0.001, 0.01, 0.1] * 2
    np.testing.assert_array_equal(table.column("r95_end_m").to_numpy(), R95)
    assert table.column("r95(end) <= 35 m").to_pylist() == ["met"] * 3 + ["not met", None, "not met"]
    assert table.column("status").to_pylist() == ["finished"] * 4 + ["failed", "finished"]
    assert table.column("failure").to_pylist()[4] == "the flight failed."


def test_an_axis_of_several_types_becomes_text(tmp_path: Path) -> None:
    arms = ((0.1, (1.0, 0.0, 0.0)), (1, (0.0, 0.0, 0.0)))
    linked = {"keys": (BIAS, "imu.lever_arm_m"), "values": arms, "labels": ("a", "b"), "label": "unit"}
    plan = study(tmp_path, axes=(linked, {"key": "filter.smooth", "values": (True, False)}))
    open_cells = tuple(Cell(k + 1, (k // 2, k % 2), (), None) for k in range(4))
    table = TradeResult(plan, open_cells, status="interrupted", media=TradeMedia()).to_table()
    assert table.column("unit").to_pylist() == ["a", "a", "b", "b"]
    assert table.column("imu.lever_arm_m").to_pylist()[0] == "[1, 0, 0]"
    assert table.column(BIAS).to_pylist() == [0.1, 0.1, 1.0, 1.0]
    assert table.column("filter.smooth").to_pylist() == [True, False, True, False]


def test_the_tables(tmp_path: Path) -> None:
    result = made(tmp_path)
    heads, rows, words = cell_table(result)
    assert heads[:5] == ["cell", "grade", "gyro bias σ, deg/h", "CEP, m", "R95, m"]
    assert heads[-1] == "r95(end) <= 35 m"
    assert words == 3
    assert rows[0][:5] == ["1", "laser-navigation", "0.001", "5.00", "10.0"]
    assert rows[3][-1] == "NOT MET"
    assert rows[4][3] == "failed"
    assert set(rows[4][4:]) == {""}
    (grid,) = grids(result, Quantity("r95", "end"))
    assert grid.title == "R95 at the end, m; * meets r95(end) <= 35 m"
    assert grid.columns[0].head == "grade \\ gyro bias σ, deg/h"
    assert grid.rows == [
        ["laser-navigation", "10.0 *", "20.0 *", "30.0 *"],
        ["laser-standard", "40.0", "failed", "60.0"],
    ]
    assert headline(result).startswith(
        "6 covariance budgets of standing.toml: 2 values of grade × 3 values of gyro bias σ."
    )
    assert "1 of 6 cells failed" in headline(result)
    assert requirement_lines(result) == [
        "r95(end) <= 35 m: met in 3 of 5 cells (grade laser-navigation, gyro bias σ 0.001 deg/h; grade "
        "laser-navigation, gyro bias σ 0.01 deg/h; grade laser-navigation, gyro bias σ 0.1 deg/h)."
    ]


def test_the_tables_of_ensembles(tmp_path: Path) -> None:
    """With bands, open ends above, and verdicts that are undecided."""
    result = made(tmp_path, band=True)
    _, rows, _ = cell_table(result, bands=True)
    assert rows[0][4] == "10.0 (5.00 … ∞)"
    assert rows[2][-1] == "undecided"
    low, high = result.band("r95(end)")
    assert low[0, 0] == 5.0
    assert np.isinf(high[0, 0])
    assert "of 40 runs" in headline(result)
    assert "no upper bound with fewer than" in headline(result)
    (line,) = requirement_lines(result)
    assert "met with 95 % confidence in 2 of 5 cells" in line
    assert "undecided in 2; about 500 more runs would decide them" in line


def test_units(tmp_path: Path) -> None:
    result = made(tmp_path)
    assert unit_for(result, Quantity("r95", "end")).name == "m"
    assert unit_for(result, Quantity("rate", "end")).name == "nmi/h"
    heading = unit_for(result, Quantity("heading", "end"))
    assert heading.text(6e-4) == {"arcmin": "2.06", "arcsec": "124"}[heading.name]


def test_markdown(tmp_path: Path) -> None:
    text = markdown(exhibits_of(made(tmp_path)))
    for line in text.splitlines():
        assert not line.startswith("|") or line.endswith("|")
    tables = [block for block in text.split("\n\n") if block.startswith("|")]
    assert len(tables) == 3  # with the definitions
    for block in tables:
        assert len({line.replace("\\|", "").count("|") for line in block.splitlines()}) == 1
    assert "cell 5, grade laser-standard, gyro bias σ 0.01 deg/h: failed: the flight failed." in text
    assert text.count("sinssim budget ") == 6


@pytest.mark.parametrize(("runs", "said"), [(7, 7), (98, 98), (137, 140), (1234, 1200), (98_765, 99_000)])
def test_further_runs_have_two_digits(runs: int, said: int) -> None:
    assert two_digits(runs) == said


def test_one_requirement_that_is_not_met_decides_for_all(tmp_path: Path) -> None:
    """Not met before undecided, undecided before met."""
    texts = ("r95(end) <= 35 m", "cep(end) <= 5 m")
    plan = study(tmp_path, require=texts)
    words: list[tuple[Word, Word]] = [
        ("met", "met"), ("met", "undecided"), ("undecided", "not met"), ("not met", "undecided"), ("undecided", "met"),
        ("not met", "met"),
    ]  # fmt: skip
    cells = []
    for cell, two in zip(cells_of(plan), words, strict=True):
        found = tuple(VerdictInUnit(t, w, 1.0, 2.0, "m", 60.0, 0) for t, w in zip(texts, two, strict=True))
        cells.append(replace(cell, numbers=CellNumbers({}, found, np.zeros(1), np.zeros(1), np.zeros(1))))
    result = TradeResult(plan, tuple(cells), media=TradeMedia())
    assert result.verdicts().tolist() == [["met", "undecided", "not met"], ["not met", "undecided", "not met"]]
    assert result.verdicts(texts[1]).ravel().tolist() == [two[1] for two in words]
