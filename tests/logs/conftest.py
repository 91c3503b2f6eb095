"""The car of docs/your-navigator.md, flown once for the comparisons with the programs of others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sinssim.experiments.run.execute import run
from sinssim.logs.formats.registry import DEFAULT_START
from sinssim.logs.gps_time import parse_date
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario import load_scenario

PAGE = (Path(__file__).parents[2] / "docs" / "your-navigator.md").read_text(encoding="utf-8")


def _page(kind: str, number: int = 0) -> str:
    return str(re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)[number])


@pytest.fixture(scope="session")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Judge:
    """The page's run of the car."""
    place = tmp_path_factory.mktemp("car")
    (place / "car.toml").write_text(_page("toml", 1))
    run(load_scenario(place / "car.toml"), place / "car")
    return Judge(RecordedRun(place / "car"), parse_date(DEFAULT_START, ""))
