"""The reference page of the scenario file: up to date, and itself a scenario that loads."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from sinssim.scenario import Scenario
from sinssim.sensors.imu.imu import Imu

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("scenario_reference", DOCS / "scenario_reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_is_up_to_date(script: ModuleType) -> None:
    assert (DOCS / "scenario.md").read_text(encoding="utf-8") == script.reference(), (
        "the schema has changed: python docs/scenario_reference.py"
    )


GROUND = ("takeoff", "take_off", "parked", "park", "taxi", "land")
SOURCES = {
    "flight", "parked", "great_circle", "motion", "track", "drive", "voyage", "turntable", "log", "one_component",
}  # fmt: skip


@pytest.mark.parametrize("motion", sorted(SOURCES))
def test_examples_load(script: ModuleType, motion: str) -> None:
    blocks = [tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", script.reference(), re.DOTALL)]
    data = {key: value for block in blocks for key, value in block.items()}
    for other in SOURCES - {motion}:
        del data[other]
    if motion != "turntable":
        del data["calibration"]
    if motion == "one_component":
        data = {key: value for key, value in data.items() if key in ("name", "description", "seed", motion)}
    if motion == "log":  # the other tables of the page are for simulated sensors
        data = {key: value for key, value in data.items() if key in ("name", "description", "seed", motion)}
        scenario = Scenario.model_validate({**data, "imu": {"grade": "mems-industrial"}, "filter": {}})
        assert scenario.log is not None
        assert scenario.log.gnss is not None
        assert scenario.log.gnss.latitude is not None
        return
    if motion == "flight":  # the page shows every kind of leg; on the ground it starts only from a runway
        data["flight"]["legs"] = [leg for leg in data["flight"]["legs"] if leg["type"] not in GROUND]
    if "imu" in data:  # the other tables of the page are for a block at rest
        turning = {**data["imu"], "rotation": data["imu"].pop("rotation")}
        assert Imu.model_validate(turning).rotation is not None
    scenario = Scenario.model_validate(data)
    shown = set(scenario.as_written())
    assert set(data) == {key for key in shown if getattr(scenario, key) is not None} - (
        {"use", "views", "recording"} - set(data)
    )
