"""Files of both kinds of study."""

from __future__ import annotations

from pathlib import Path

import pytest

from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.experiments.studies.study_schema import Study
from sinssim.experiments.studies.trade_cells import cells_of
from sinssim.experiments.studies.trade_schema import TradeStudy
from sinssim.experiments.study import load_study
from tests.experiments.studies.trade_examples import SCENARIO

FILE = """\
scenario = "standing.toml"
require = ["r95(end) <= 1 km"]
[[axes]]
key = "imu.grade"
values = ["tactical", "laser-standard"]
"""


@pytest.mark.parametrize("name", sorted(list_content("studies")))
def test_shipped_studies(name: str) -> None:
    found = load_study(name)
    assert found.name == name
    assert found.description
    if isinstance(found, TradeStudy):
        assert all(cell.scenario is not None for cell in cells_of(found))


def test_the_kind_follows_from_the_file() -> None:
    assert isinstance(load_study("coning"), Study)
    assert isinstance(load_study("gyro_trade"), TradeStudy)


def test_scenario_beside_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "studies"
    folder.mkdir()
    (folder / "standing.toml").write_text(SCENARIO, encoding="utf-8")
    (folder / "mine.toml").write_text(FILE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    made = load_study(folder / "mine.toml", ['axes.1.values=["ideal"]', "cell=ensemble", "runs=7"])
    assert isinstance(made, TradeStudy)
    assert made.name == "mine"
    assert made.scenario == str((folder / "standing.toml").resolve())
    assert (made.axes[0].values, made.cell, made.runs) == (("ideal",), "ensemble", 7)


def _cells_of_file(file: Path) -> None:
    found = load_study(file)
    assert isinstance(found, TradeStudy)
    cells_of(found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FILE + "[[parts]]\ntitle = 'x'\n", "has parts and axes"),
        ("name = 'x'\n", "neither [[parts]]"),
        ('scenario = "parked"\n', "axes is missing"),
        (FILE.replace("key =", "ky ="), "line 4"),
        (FILE.replace("scenario =", "scenrio ="), "scenario"),
        (FILE.replace("standing", "sitting"), "no scenario file"),
    ],
)
def test_mistakes(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        _cells_of_file(file)
    assert said in str(error.value)
