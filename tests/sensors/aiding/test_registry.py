"""A sensor is one file that the registry finds by its table's name, and one broken file leaves the others alone."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.scenario.filter_section import AidingSection, describe_sensors
from sinssim.sensors import aiding
from sinssim.sensors.aiding_registry import BROKEN, CLASSES, KINDS, SENSORS, measurement_kind

FOLDER = Path(aiding.__file__).parent


def test_every_sensor_of_a_file_is_a_table() -> None:
    """A file has one sensor, whose table has its name, or several, which name their tables."""
    classes = {}
    for path in FOLDER.glob("[!_]*.py"):
        found = re.findall(r"^class (\w+)\((?:AidingSensor|Standstill)\):", path.read_text(encoding="utf-8"), re.M)
        classes |= dict.fromkeys(set(found) - {"Standstill"}, path.stem)
    assert set(classes) == {sensor.__name__ for sensor in CLASSES.values()}
    alone = {name: file for name, file in classes.items() if list(classes.values()).count(file) == 1}
    assert {sensor.__name__: table for table, sensor in CLASSES.items() if sensor.__name__ in alone} == alone
    assert set(CLASSES) == set(SENSORS)
    assert not BROKEN
    assert list(AidingSection.model_fields) == list(SENSORS) == list(describe_sensors())
    assert {name: sensor.table for name, sensor in CLASSES.items()} == {name: name for name in CLASSES}


def test_every_kind_has_one_sensor() -> None:
    names = [kind.name for sensor in CLASSES.values() for kind in sensor.kinds]
    assert sorted(names) == sorted(KINDS)


def test_an_unknown_kind_is_named() -> None:
    with pytest.raises(InputError, match=r"unknown kind of measurement 'sped'.*Did you mean 'speed'"):
        measurement_kind("sped")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("import sextants", "ModuleNotFoundError: No module named 'sextants'"),
        ("", "it must have one class that derives from AidingSensor; there is none."),
        ("class A(AidingSensor): ...\n\n\nclass B(AidingSensor): ...", "derives from AidingSensor; A and B."),
        ("class A(AidingSensor): ...", "A needs a docstring, whose first line describes it."),
        ('class A(AidingSensor):\n    """Stars."""', "A needs a method read(self, vehicle)"),
    ],
)
def test_a_broken_file_leaves_the_other_sensors_alone(tmp_path: Path, text: str, reason: str) -> None:
    head = "from sinssim.sensors.aiding_sensor import AidingSensor\n"
    (tmp_path / "sextant.py").write_text(head + text + "\n", encoding="utf-8")
    code = f"""
from sinssim.sensors import aiding
aiding.__path__.append({str(tmp_path)!r})
from sinssim.scenario import Scenario
from sinssim.scenario.filter_section import describe_sensors
print(describe_sensors()["sextant"])
base = {{"name": "x", "parked": {{"latitude_deg": 50.0, "heading_deg": 0.0, "duration_s": 60.0}}, "filter": {{}}}}
print(list(Scenario.model_validate({{**base, "aiding": {{"gnss": {{}}}}}}).aiding.sensors()))
try:
    Scenario.model_validate({{**base, "aiding": {{"sextant": {{}}}}}})
except ValueError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    listed, sensors, refused = done.stdout.split("\n", 2)
    assert listed.startswith(f"(cannot be used: {tmp_path}")
    assert reason in listed
    assert sensors == "['gnss']"
    assert "[aiding.sextant]: " in refused
    assert "sextant.py cannot be used: " in refused
