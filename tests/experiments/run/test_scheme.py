"""The scheme of a run: it has the blocks of the scenario, and its words are legible."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sinssim.experiments.run.navigation_scheme import scheme, scheme_words
from sinssim.scenario import Scenario, load_scenario
from sinssim.strapdown.frames import FRAMES
from tests.recording.drawings import check_words, words_of

SHIPPED = sorted(path.stem for path in Path("scenarios").glob("*.toml") if path.stem != "one_component")
PARKED = {"latitude_deg": 50.0, "longitude_deg": 14.5, "duration_s": 20.0}


def shown(**tables) -> str:
    return scheme(Scenario.model_validate({"name": "x", "parked": PARKED, "imu": {"grade": "ideal"}, **tables}))


@pytest.mark.parametrize("name", SHIPPED)
def test_words_lie_within_the_drawing_and_apart(name):
    check_words(scheme(load_scenario(f"scenarios/{name}.toml")))


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
