"""The car of docs/your-navigator.md, flown once for the comparisons with the programs of others."""

from __future__ import annotations

from pathlib import Path

import pytest

from sinssim.experiments.run.run_execution import run
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.gps_time import parse_date
from sinssim.logs.solution_score import Judge
from sinssim.logs.stored_run import RecordedRun
from sinssim.scenario import load_scenario

CAR = Path(__file__).parents[2] / "docs" / "programs" / "car.toml"


@pytest.fixture(scope="session")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Judge:
    """The page's run of the car."""
    place = tmp_path_factory.mktemp("car")
    run(load_scenario(CAR), place / "car")
    return Judge(RecordedRun(place / "car"), parse_date(DEFAULT_START, ""))
