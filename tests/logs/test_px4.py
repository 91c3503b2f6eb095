"""A small aircraft's flight, where a folder with it is given: which attitude explains what no filter touched."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks import px4_attitude
from sinssim.analyses.inspection.inspected_files import inspect

FOLDER = os.environ.get("SINSSIM_PX4_FLIGHT")
REFERENCE = """
[log.reference]
file = "{}/ATT.txt"
format = "text"
delimiter = "whitespace"
time = 2
time_unit = "ms"
roll = {{ column = 3, unit = "deg" }}
pitch = {{ column = 4, unit = "deg" }}
heading = {{ column = 5, unit = "deg" }}
"""

pytestmark = pytest.mark.skipif(FOLDER is None, reason="SINSSIM_PX4_FLIGHT names no folder with the flight")


def test_the_filter_explains_velocity_airspeed_and_field_better_than_the_autopilot(tmp_path: Path) -> None:
    folder = Path(str(FOLDER))
    both = px4_attitude.attitudes(folder, tmp_path)
    own, given = both["smoothed"], both["autopilot"]
    assert px4_attitude.by_velocity(folder, own) < 0.7
    assert px4_attitude.by_velocity(folder, given) > 2.5
    assert px4_attitude.by_airspeed(folder, own) < 1.3
    assert px4_attitude.by_airspeed(folder, given) > 3.0
    field, inclination = px4_attitude.by_magnetometer(folder, own, 60.0)
    assert field < 0.6 * px4_attitude.by_magnetometer(folder, given, 60.0)[0]
    assert inclination == pytest.approx(63.2, abs=1.5)  # of the geomagnetic field near Zurich


def test_inspection_doubts_the_attitude_of_the_autopilot(tmp_path: Path) -> None:
    folder = Path(str(FOLDER)).resolve()
    described = px4_attitude.SCENARIO.replace('file = "', f'file = "{folder}/') + REFERENCE.format(folder)
    (tmp_path / "px4.toml").write_text(described)
    (said,) = (f for f in inspect([tmp_path / "px4.toml"]).inspection.findings if f.subject == "reference")
    assert said.grade == "doubt"
    assert said.numbers["heading_deg"] > 20.0
    assert said.numbers["tilt_deg"] > 8.0
