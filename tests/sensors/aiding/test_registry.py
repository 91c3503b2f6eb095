"""Every sensor's file has its line in the registry, and one broken file leaves the other sensors alone."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.scenario.sections.aiding import AidingSection, describe_sensors
from sinssim.sensors import aiding
from sinssim.sensors.aiding.base.sensor import AidingSensor
from sinssim.sensors.aiding.registry import SENSORS, load_class

FOLDER = Path(aiding.__file__).parent
FILES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem not in ("__init__", "registry"))


@pytest.mark.parametrize("name", FILES)
def test_every_file_has_its_line(name: str) -> None:
    module = importlib.import_module(f"sinssim.sensors.aiding.{name}")
    classes = [c for c in vars(module).values() if inspect.isclass(c) and c.__module__ == module.__name__]
    sensors = {
        f"{name}.{c.__name__}" for c in classes if issubclass(c, AidingSensor) and not c.__name__.startswith("_")
    }
    assert sensors, f"sinssim/sensors/aiding/{name}.py holds no class that derives from AidingSensor"
    missing = sensors - set(SENSORS.values())
    assert not missing, f"SENSORS in sinssim/sensors/aiding/registry.py has no line for {sorted(missing)}"


def test_every_line_has_its_file_and_its_table() -> None:
    assert len(set(SENSORS.values())) == len(SENSORS)
    for entry in SENSORS.values():
        assert issubclass(load_class("sinssim.sensors.aiding", entry, AidingSensor), AidingSensor)
    assert list(AidingSection.model_fields) == list(SENSORS) == list(describe_sensors())


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("sextant.Sextant", r"sextant\.py cannot be used: ModuleNotFoundError"),
        ("gnss.Sextant", r"gnss\.py cannot be used: AttributeError: .*Sextant"),
        ("gnss.Jump", r"gnss\.py cannot be used: Jump must be a class that derives from AidingSensor"),
        ("gnss._DOWN", r"gnss\.py cannot be used: _DOWN must be a class"),
    ],
)
def test_a_line_that_fits_no_file_is_named_with_the_path(entry: str, reason: str) -> None:
    with pytest.raises(InputError, match=rf"sensors.aiding.{reason}"):
        load_class("sinssim.sensors.aiding", entry, AidingSensor)


def test_a_broken_file_leaves_the_other_sensors_alone() -> None:
    code = """
from sinssim.sensors.aiding.registry import SENSORS
SENSORS.shipped["sextant"] = "sextant.Sextant"
from sinssim.scenario import Scenario
from sinssim.scenario.sections.aiding import describe_sensors
print(describe_sensors()["sextant"])
base = {"name": "x", "parked": {"latitude_deg": 50.0, "heading_deg": 0.0, "duration_s": 60.0}, "filter": {}}
print(list(Scenario.model_validate({**base, "aiding": {"gnss": {}}}).aiding.sensors()))
try:
    Scenario.model_validate({**base, "aiding": {"sextant": {}}})
except ValueError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    listed, sensors, refused = done.stdout.split("\n", 2)
    assert listed.startswith("(cannot be used: ")
    assert listed.endswith("No module named 'sinssim.sensors.aiding.sextant')")
    assert sensors == "['gnss']"
    assert "[aiding.sextant]: " in refused
    assert "sextant.py cannot be used: ModuleNotFoundError" in refused
