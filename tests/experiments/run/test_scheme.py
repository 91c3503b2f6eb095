"""The scheme of a run: it has the blocks of the scenario, and its words are legible."""

from __future__ import annotations

import itertools
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from sinssim.experiments.run.navigation_scheme import scheme, scheme_words
from sinssim.frames import FRAMES
from sinssim.scenario import Scenario, load_scenario

SVG = "{http://www.w3.org/2000/svg}"
LETTER = 6.4  # px, at most on average, at 12 px
SHIPPED = sorted(path.stem for path in Path("scenarios").glob("*.toml") if path.stem != "one_component")
PARKED = {"latitude_deg": 50.0, "longitude_deg": 14.5, "duration_s": 20.0}


def shown(**tables) -> str:
    return scheme(Scenario.model_validate({"name": "x", "parked": PARKED, "imu": {"grade": "ideal"}, **tables}))


def words_of(svg: str) -> list[str]:
    return ["".join(text.itertext()).replace("\u200b", "") for text in ET.fromstring(svg).iter(f"{SVG}text")]


def extents(svg: str) -> list[tuple[str, float, float, float, float]]:
    """Words with left, right, top and bottom, px."""
    boxes = []
    for text in ET.fromstring(svg).iter(f"{SVG}text"):
        words = "".join(text.itertext()).replace("\u200b", "")
        small = sum(len(part.text or "") for part in text if part.get("font-size"))
        width = LETTER * (len(words) - 0.25 * small)
        x, y = float(text.get("x", 0)), float(text.get("y", 0))
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.get("text-anchor", "start")] * width
        boxes.append((words, left, left + width, y - 9.0, y + 2.0))
    return boxes


@pytest.mark.parametrize("name", SHIPPED)
def test_words_lie_within_the_drawing_and_apart(name):
    scenario = load_scenario(f"scenarios/{name}.toml")
    svg = scheme(scenario)
    width, height = (float(v) for v in ET.fromstring(svg).get("viewBox", "").split()[2:])
    boxes = extents(svg)
    for words, left, right, top, bottom in boxes:
        assert left >= 0.0, words
        assert right <= width, words
        assert top >= 0.0, words
        assert bottom <= height, words
    for (a, l1, r1, t1, b1), (b, l2, r2, t2, b2) in itertools.combinations(boxes, 2):
        assert r1 <= l2 or r2 <= l1 or b1 <= t2 or b2 <= t1, (a, b)


@pytest.mark.parametrize("frame", FRAMES)
def test_every_frame_has_its_symbols(frame):
    words = words_of(shown(navigation={"frame": frame}))
    matrix = {"level": "Cnb", "inertial": "Cib"}.get(frame, "Cwb")
    assert f"attitude {matrix}" in words
    assert ("gravitation G(r)" in words) == (frame == "inertial")
    assert any("× v" in word for word in words) == (frame != "inertial")
    assert any("radii" in word for word in words) == (frame != "inertial")
    assert f"“{frame}”" in scheme_words(
        Scenario.model_validate(
            {"name": "x", "parked": PARKED, "imu": {"grade": "ideal"}, "navigation": {"frame": frame}}
        )
    )


def test_blocks_are_those_of_the_scenario():
    free = words_of(shown(navigation={"vertical": "free"}))
    assert not any("loop" in word or "height" in word or "filter" in word or "compensation" in word for word in free)
    held = words_of(shown(navigation={"vertical": "truth"}))
    assert "true height" in held
    loop = words_of(shown(navigation={"vertical": "baro-loop", "baro_time_constant_s": 20.0}))
    assert "baro loop, 20 s, on" in loop
    assert "the true height" in loop
    with_baro = words_of(shown(navigation={"vertical": "baro-loop"}, aiding={"baro": {}}))
    assert "the barometer" in with_baro
    compensated = words_of(shown(compensation={}))
    assert compensated.count("compensation") == 2
    filtered = words_of(shown(aiding={"gnss": {}, "baro": {}}, filter={}))
    assert "Kalman filter of the" in filtered
    assert "gnss, baro" in filtered


def test_sensors_and_algorithms_are_named():
    six = words_of(shown(imu={"grade": "ideal", "sensor_set": {"type": "accelerometers", "arm_m": 0.3}}))
    assert "three gyros" not in six
    redundant = words_of(shown(imu={"grade": "ideal", "sensor_set": {"type": "redundant", "layout": "cone-5"}}))
    assert "5 gyros," in redundant
    assert redundant.count("monitored") == 2
    several = words_of(shown(navigation={"algorithms": ["poisson", "euler"]}))
    assert "poisson, euler" in several
    many = words_of(shown(navigation={"algorithms": ["quaternion", "poisson", "euler", "two-quaternions"]}))
    assert "4 algorithms," in many


def test_rates_are_told_once_or_by_part():
    assert "sensors and navigation 100 Hz" in words_of(shown())
    rates = words_of(shown(navigation={"rates_hz": [100.0, 50.0, 10.0]}))
    assert {"attitude 100 Hz", "velocity 50 Hz", "position and rates 10 Hz"} <= set(rates)


def test_boxes_follow_the_page_in_the_dark():
    svg = shown()
    assert len(re.findall(r'<rect [^>]*class="block"', svg)) == len(re.findall("<rect ", svg)) > 5
