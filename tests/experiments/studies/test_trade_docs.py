"""docs/trades.md: its example loads, its code runs, its table has every key."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from sinssim.experiments.studies.trade_cells import cells_of
from sinssim.experiments.studies.trade_schema import Axis, TradeStudy
from sinssim.experiments.study import load_study
from tests.experiments.studies.trade_examples import SCENARIO

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "trades.md").read_text(encoding="utf-8")


def test_the_example_loads(tmp_path: Path) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "my_trade.toml").write_text(text, encoding="utf-8")
    made = load_study(tmp_path / "my_trade.toml")
    assert made.shape == (3, 2)
    assert all(cell.scenario is not None for cell in cells_of(made))


def test_every_key_is_in_the_tables() -> None:
    parts = PAGE.split("## The file")[1].split("## Output")[0].split("| key of an axis")
    of_study, of_axis = (re.findall(r"^\| `(\w+)`(?:, `(\w+)`)? \|", part, re.MULTILINE) for part in parts)
    assert {name for pair in of_study for name in pair if name} == set(TradeStudy.model_fields)
    assert {name for pair in of_axis for name in pair if name} == set(Axis.model_fields)


def test_the_code_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "standing.toml").write_text(SCENARIO, encoding="utf-8")
    names: dict[str, Any] = {}
    exec(code.replace("first_flight", "standing.toml").replace("3600 s", "60 s"), names)
    assert names["table"].num_rows == 3
    assert names["found"].values("r95(60 s)").shape == (3,)
    assert "'met' 'met' 'met'" in capsys.readouterr().out
    assert (tmp_path / "runs" / "bias" / "report.html").is_file()


def test_links() -> None:
    for link in re.findall(r"\]\(([\w./-]+)(?:#\w+)?\)", PAGE):
        assert (DOCS / link).exists(), link
