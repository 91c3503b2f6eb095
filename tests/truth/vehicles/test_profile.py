"""Speed and heading along the legs of a vehicle, against finite differences and the plan."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sinssim.errors import InputError
from sinssim.truth.vehicles.profile import Profile, stops
from sinssim.truth.vehicles.section import DriveSection


def section(*legs: dict[str, Any]) -> DriveSection:
    return DriveSection.model_validate({"latitude_deg": 50.0, "heading_deg": 30.0, "legs": list(legs)})


LEGS = (
    {"type": "stop", "duration_s": 10.0},
    {"type": "straight", "distance_m": 300.0, "speed_mps": 12.0},
    {"type": "turn", "angle_deg": -90.0},
    {"type": "straight", "duration_s": 20.0, "speed_mps": 8.0},
    {"type": "turn", "angle_deg": 720.0, "rate_deg_s": 12.0},
    {"type": "turn", "angle_deg": 2.0},
    {"type": "stop", "duration_s": 5.0},
)


def test_way_speed_and_heading_are_integrals_of_each_other() -> None:
    profile = Profile(section(*LEGS), 1.0, 1.5)
    time = np.linspace(0.0, profile.duration, 200_001)
    at = profile.at(time)
    step = time[1] - time[0]
    for whole, rate in ((at.way, at.speed), (at.speed, at.acceleration), (at.heading, at.rate)):
        assert np.abs(np.gradient(whole, step)[1:-1] - rate[1:-1]).max() < 1e-3
    assert np.abs(np.diff(at.acceleration)).max() < 0.01  # no jump: the second derivatives are continuous
    assert np.abs(np.diff(at.rate)).max() < 1e-3


def test_plan_is_kept() -> None:
    profile = Profile(section(*LEGS), 1.0, 1.5)
    edges = np.array([event.time for event in profile.events]).reshape(-1, 2)
    at = profile.at(np.append(edges[:, 0], profile.duration))
    assert np.diff(at.way)[1] == pytest.approx(300.0, rel=1e-12)
    assert np.diff(edges, axis=1)[3, 0] == pytest.approx(20.0)
    assert np.degrees(np.diff(at.heading)) == pytest.approx([0.0, 0.0, -90.0, 0.0, 720.0, 2.0, 0.0], abs=1e-9)
    assert np.degrees(at.heading[0]) == pytest.approx(30.0)
    inside = profile.at(np.linspace(*edges[4], 1001))
    assert np.degrees(np.abs(inside.rate).max()) == pytest.approx(12.0)
    corner = profile.at(np.linspace(*edges[2], 1001))
    assert np.abs(corner.rate * corner.speed).max() == pytest.approx(1.5)  # lateral acceleration
    (_, first), (begin, end) = stops(profile)
    assert first == 10.0
    assert end - begin == pytest.approx(5.0)
    assert profile.at(np.linspace(begin, end, 50)).speed.max() == 0.0


@pytest.mark.parametrize(
    ("legs", "words"),
    [
        (
            [{"type": "straight", "distance_m": 10.0}],
            r"drive.legs.1 \(straight\): the vehicle is at rest; give speed_mps",
        ),
        ([{"type": "turn", "angle_deg": 90.0}], r"drive.legs.1 \(turn\): the vehicle is at rest; a turn needs"),
        (
            [{"type": "straight", "distance_m": 10.0, "speed_mps": 20.0}],
            r"drive.legs.1 \(straight\): distance_m = 10 is too short for the change of speed from 0 to 20",
        ),
    ],
)
def test_leg_that_cannot_be_is_named(legs: list[dict[str, Any]], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Profile(section(*legs), 1.0, 1.5)


def test_straight_ends_once() -> None:
    with pytest.raises(ValidationError, match="after distance_m or after duration_s: give exactly one"):
        section({"type": "straight", "speed_mps": 3.0})
