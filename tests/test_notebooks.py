"""The notebooks run from top to bottom, show what their text speaks of, and are kept without outputs."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

FOLDER = Path(__file__).parent.parent / "docs" / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))


def cells_of(name: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return found


def run_cell(source: str, names: dict[str, Any]) -> Any:
    """Run a cell as a notebook does: the value of a last line that is an expression is shown."""
    code = ast.parse(source)
    last = code.body.pop() if isinstance(code.body[-1], ast.Expr) else None
    exec(compile(code, "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # type: ignore[attr-defined]


def run_notebook(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[dict[str, Any], list[Any]]:
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    shown = [run_cell("".join(c["source"]), names) for c in cells_of(name) if c["cell_type"] == "code"]
    return names, [one for one in shown if one is not None]


def test_the_three_are_there() -> None:
    assert NAMES == ["filter", "first_flight", "own_sensor"]


@pytest.mark.parametrize("name", NAMES)
def test_kept_without_outputs_and_with_links_that_exist(name: str) -> None:
    for cell in cells_of(name):
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
        for link in re.findall(r"\]\(([^)#]+)\)", "".join(cell["source"]) if cell["cell_type"] == "markdown" else ""):
            assert (FOLDER / link).exists(), link


def test_first_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    names, shown = run_notebook("first_flight", tmp_path, monkeypatch)
    plan, result, budget = (one._repr_html_() for one in shown)
    assert "leg 2   turn" in plan
    assert result.count("245.4") == 6  # three algorithms, at the end and the largest, m
    assert "accelerometers, bias" in budget
    assert isinstance(names["figure"], Figure)
    out = capsys.readouterr().out
    assert "10 min:   245.4 m horizontally" in out
    assert "height 3000 to 3501 m" in out


@pytest.mark.slow  # as the blocks of code of the tutorials, which have the same steps
def test_own_sensor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    names, _ = run_notebook("own_sensor", tmp_path, monkeypatch)
    r95, budget = names["r95"], names["budget"]
    # two ways to the same radius, and the bias of the accelerometers is the largest part: b t²/2, with R95 of 2.45 σ
    assert r95.low[-1] < budget.r95[-1] < r95.high[-1]
    (answer,) = budget.answers("r95(600 s) <= 200 m")
    assert answer.value == pytest.approx(budget.r95[-1])
    assert not answer.met
    assert answer.allowances[0].sources[0].name == "accel_bias"
    alone = 2.4477 * 60e-6 * 9.81 * 600.0**2 / 2.0
    assert answer.allowances[0].factor < 1.0
    assert float(radius_alone(budget)) == pytest.approx(alone, rel=0.4)  # the turn spreads it over both axes
    assert "accelerometers, bias: at most" in capsys.readouterr().out


def radius_alone(budget: Any) -> float:
    return float(next(one.alone for one in budget.improvements(600.0) if one.source.name == "accel_bias"))


@pytest.mark.slow  # as the blocks of code of the tutorials, which have the same steps
def test_filter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    names, shown = run_notebook("filter", tmp_path, monkeypatch)
    table = shown[0]._repr_html_()
    assert re.findall(r"left\">(\w+)</td>", table)[0] == "quaternion"
    assert "aided" in table
    assert "smoothed" in table
    for test in names["tests"].values():
        assert test["lower_95"] < test["value"] < test["upper_95"]
    forward, smoothed = (float(text) for text in re.findall(r"(?:aided|smoothed) +([\d.]+) m", capsys.readouterr().out))
    assert smoothed < forward / 2.0
    assert len(names["many"]) == 20
