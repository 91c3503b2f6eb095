"""The page that adds an aiding sensor: its code is run, its sensor aids a filter, its files are counted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page

MORE = """
from sinssim.experiments.run.run_streams import filter_streams
from sinssim.recording.page import page_of
columns = {stream.name: [c for v in stream.vectors for c in v.columns] for stream in filter_streams(result.aided)}
print("aiding_radar_altimeter" in columns, "height_m" in columns["aiding_radar_altimeter"])
print("sigma_radar_altimeter_bias_m" in columns["filter"], abs(result.aided.error.position_ned[-1, 2]))
print("radar-altimeter" in page_of(result.exhibits))
"""


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    made = Copy(tmp_path)
    made.apply(read_page("aiding-sensor"))
    return made


def test_page(copy: Copy) -> None:
    assert copy.touched == ["sinssim/sensors/aiding/radar_altimeter.py"]
    listed, checked = copy.commands(("list", "aiding"), ("check", "scenarios/sea_flight.toml"))
    assert "radar_altimeter  A radar altimeter over the sea, up to 2500 ft." in listed
    assert "aiding      radar_altimeter, 2 Hz; all by default" in checked


@pytest.mark.slow  # test_measurement_kind.py runs a filter with the sensor of a page, too
def test_the_sensor_aids_a_filter(copy: Copy) -> None:
    lines = copy.run(read_page("aiding-sensor").snippets[0] + MORE).splitlines()
    assert lines[0] == "80 of 80 readings taken"
    error, sigma = map(float, re.findall(r"-?[\d.]+(?= m)", lines[1]))
    # 20 m at first; what is left is the height of the sea, 1 m, less what its changes tell beside those of the climb
    assert 0.3 < sigma < 1.1
    assert abs(error) < 4.0 * sigma
    assert lines[2] == "True True"
    assert lines[3].startswith("True ")
    assert lines[4] == "True"
