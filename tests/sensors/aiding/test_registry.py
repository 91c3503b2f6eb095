"""A sensor is one file that the registry finds by its table's name, and one broken file leaves the others alone."""

from __future__ import annotations

import json
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


UNUSABLE = {
    "import sextants": "ModuleNotFoundError: No module named 'sextants'",
    "": "it must have one class that derives from AidingSensor; there is none.",
    "class A(AidingSensor): ...\n\n\nclass B(AidingSensor): ...": "derives from AidingSensor; A and B.",
    "class A(AidingSensor): ...": "A needs a docstring, whose first line describes it.",
    'class A(AidingSensor):\n    """Stars."""': "A needs a method read(self, vehicle)",
}
"""Files of sensors, without their import, and what is wrong with each."""


def test_broken_files_leave_the_other_sensors_alone(tmp_path: Path) -> None:
    head = "from sinssim.sensors.aiding_sensor import AidingSensor\n"
    for number, text in enumerate(UNUSABLE):
        (tmp_path / f"sextant_{number}.py").write_text(head + text + "\n", encoding="utf-8")
    code = f"""
import json
from sinssim.sensors import aiding
aiding.__path__.append({str(tmp_path)!r})
from sinssim.scenario import Scenario
from sinssim.scenario.filter_section import describe_sensors
base = {{"name": "x", "parked": {{"latitude_deg": 50.0, "heading_deg": 0.0, "duration_s": 60.0}}, "filter": {{}}}}
sensors = list(Scenario.model_validate({{**base, "aiding": {{"gnss": {{}}}}}}).aiding.sensors())
refused = []
for number in range({len(UNUSABLE)}):
    try:
        Scenario.model_validate({{**base, "aiding": {{f"sextant_{{number}}": {{}}}}}})
    except ValueError as error:
        refused.append(str(error))
print(json.dumps([describe_sensors(), sensors, refused]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    listed, sensors, refused = json.loads(done.stdout)
    assert sensors == ["gnss"]
    for number, (reason, text) in enumerate(zip(UNUSABLE.values(), refused, strict=True)):
        said = listed[f"sextant_{number}"]
        assert said.startswith(f"(cannot be used: {tmp_path}")
        assert reason in said
        assert f"[aiding.sextant_{number}]: " in text
        assert f"sextant_{number}.py cannot be used: " in text
