"""Speed and heading along the legs of a vehicle, against finite differences and the plan."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sinssim.errors import InputError
from sinssim.truth.motions.surface_vehicles import Drive, Profile


def section(*legs: dict[str, Any], **keys: float) -> Drive:
    return Drive.model_validate({"latitude_deg": 50.0, "heading_deg": 30.0, "legs": list(legs), **keys})


def stops(profile: Profile) -> Iterator[tuple[float, float]]:
    """Yield beginning and end of each standstill of a profile, s."""
    for start, lasting, speed, change, *_ in profile._rows:
        if speed == 0.0 and change == 0.0:
            yield start, start + lasting


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
    profile = section(*LEGS).profile
    time = np.linspace(0.0, profile.duration, 200_001)
    at = profile.at(time)
    step = time[1] - time[0]
    for whole, rate in ((at.way, at.speed), (at.speed, at.acceleration), (at.heading, at.rate)):
        assert np.abs(np.gradient(whole, step)[1:-1] - rate[1:-1]).max() < 1e-3
    assert np.abs(np.diff(at.acceleration)).max() < 0.01  # no jump: the second derivatives are continuous
    assert np.abs(np.diff(at.rate)).max() < 1e-3


def test_plan_is_kept() -> None:
    profile = section(*LEGS).profile
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
        assert section(*legs).profile


def test_straight_ends_once() -> None:
    with pytest.raises(ValidationError, match="after distance_m or after duration_s: give exactly one"):
        section({"type": "straight", "speed_mps": 3.0})


def test_a_drive_by_hand() -> None:
    """At 2 m/s² and 3 m/s²: 10 s at rest; 12 m/s in 6 s and 36 m, 264 m at it; a turn by −90° at 0.25 rad/s.

    The turn lasts π/2/0.25 s and a ramp of at least 2 s more; then 20 s, of which 2 s to 8 m/s; then 4 s to rest.
    """
    profile = section(*LEGS[:4], LEGS[6], acceleration_mps2=2.0, lateral_mps2=3.0).profile
    turn = 0.5 * np.pi / 0.25
    edges = np.cumsum([0.0, 10.0, 6.0 + 264.0 / 12.0, turn + 2.0, 20.0, 4.0 + 5.0])
    assert [event.time for event in profile.events] == pytest.approx(np.repeat(edges, 2)[1:-1].tolist())
    assert [event.text for event in profile.events[:4]] == [
        "leg 1 (stop) begins", "leg 1 (stop) ends", "leg 2 (straight) begins", "leg 2 (straight) ends",
    ]  # fmt: skip
    assert profile.duration == pytest.approx(edges[-1])
    at = profile.at(
        np.array([5.0, 13.0, 20.0, edges[2] + 0.5 * turn + 1.0, edges[3] + 1.0, edges[3] + 10.0, edges[-1]])
    )
    way = 300.0 + 12.0 * (turn + 2.0)
    assert at.speed == pytest.approx([0.0, 6.0, 12.0, 12.0, 10.0, 8.0, 0.0])
    assert at.acceleration == pytest.approx([0.0, 4.0, 0.0, 0.0, -4.0, 0.0, 0.0], abs=1e-12)
    # the integral of S from 0 to its middle is 1/8 − 2/4π²
    half = 0.125 - 0.5 / np.pi**2
    assert at.way == pytest.approx([
        0.0, 12.0 * 6.0 * half, 36.0 + 48.0, 300.0 + 6.0 * (turn + 2.0), way + 12.0 - 8.0 * half, way + 20.0 + 64.0,
        way + 20.0 + 144.0 + 16.0,
    ])  # fmt: skip
    assert np.degrees(at.heading) == pytest.approx([30.0, 30.0, 30.0, -15.0, -60.0, -60.0, -60.0])
    assert at.rate == pytest.approx([0.0, 0.0, 0.0, -0.25, 0.0, 0.0, 0.0], abs=1e-12)
    # ∫ω² dt with the mean rate of each ramp
    assert profile.turning == pytest.approx(2.0 * 0.125**2 * 2.0 + 0.0625 * (turn - 2.0))
    assert [*sum(stops(profile), ())] == pytest.approx([0.0, 10.0, edges[4] + 4.0, edges[5]])


def test_a_small_turn_only_begins_and_ends() -> None:
    """10° at up to 12°/s would take 0.8 s: two ramps of 2 s at up to 5°/s instead. By 480° a ramp is a quarter."""
    small = section({"type": "straight", "distance_m": 50.0, "speed_mps": 5.0},
                            {"type": "turn", "angle_deg": 10.0, "rate_deg_s": 12.0}).profile  # fmt: skip
    begin = small.events[2].time
    assert small.duration - begin == pytest.approx(4.0)
    assert np.degrees(small.at(np.array([begin + 2.0])).rate) == pytest.approx([5.0])
    wide = section({"type": "straight", "distance_m": 50.0, "speed_mps": 5.0},
                           {"type": "turn", "angle_deg": 480.0, "rate_deg_s": 12.0}).profile  # fmt: skip
    begin = wide.events[2].time
    assert wide.duration - begin == pytest.approx(50.0)
    assert np.degrees(wide.at(begin + np.array([5.0, 10.0, 40.0, 45.0])).rate) == pytest.approx([6.0, 12.0, 12.0, 6.0])


def test_messages_have_their_numbers() -> None:
    with pytest.raises(InputError) as error:
        assert section({"type": "straight", "duration_s": 9.0, "speed_mps": 20.0}, acceleration_mps2=2.0).profile
    assert str(error.value) == (
        "drive.legs.1 (straight): duration_s = 9 is too short for the change of speed from 0 to 20 m/s, which takes "
        "10 s; give a larger value, or a larger acceleration_mps2."
    )
    with pytest.raises(InputError, match=r"distance_m = 90 is too short .* from 0 to 20 m/s, which takes 100 m; give"):
        assert section({"type": "straight", "distance_m": 90.0, "speed_mps": 20.0}, acceleration_mps2=2.0).profile
    with pytest.raises(InputError, match=r"legs\.2 .* from 10 to 20 m/s, which takes 75 m; give"):  # (20² − 10²)/(2·2)
        assert section(
            {"type": "straight", "distance_m": 60.0, "speed_mps": 10.0},
            {"type": "straight", "distance_m": 70.0, "speed_mps": 20.0},
            acceleration_mps2=2.0,
        ).profile
