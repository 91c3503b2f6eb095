"""What is said of fixes by themselves: whole findings, with the numbers written down here."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim import earth
from sinssim.analyses.inspection.gnss_findings import Delay, delay_findings, fix_findings
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, wrong
from sinssim.earth.gravity_disturbance import geoid_along
from sinssim.logs.recorded_streams import FixStream

_COUNT = 40


def _fixes(**other: Any) -> FixStream:
    """Return fixes every 0.5 s from 30 s on, of a straight motion by 3 m/s north and 4 m/s east.

    North and east of the fixes are off by +7 mm and −7 mm by turns, and the velocities by nothing.
    """
    time = 30.0 + 0.5 * np.arange(_COUNT)
    off = 0.007 * (-1.0) ** np.arange(_COUNT)
    r1, r2 = earth.radii(0.9)
    north, east = 3.0 * (time - 30.0) + off, 4.0 * (time - 30.0) - off
    given = FixStream(
        time, 0.9 + north / (r1 + 250.0), 0.3 + east / ((r2 + 250.0) * np.cos(0.9)), np.full(_COUNT, 250.0),
        "ellipsoid", position_sigma=np.full((_COUNT, 3), 0.03), velocity_ned=np.tile((3.0, 4.0, 0.0), (_COUNT, 1)),
    )  # fmt: skip
    return replace(given, **other)


def _beside_the_place(fixes: FixStream, delay: float = 0.0) -> list[Finding]:
    return [f for f in fix_findings(fixes, delay) if not f.text.startswith("Place")]


def test_place() -> None:
    """Fixes without a position are counted and left out; latitude and longitude are °, heights m."""
    height = np.linspace(-12.25, 431.5, _COUNT)
    longitude = np.linspace(-2.75, -2.125, _COUNT)
    latitude = np.linspace(0.5, 0.625, _COUNT)
    latitude[0] = np.nan
    fixes = _fixes(latitude=latitude, longitude=longitude, height=height, velocity_ned=None)
    first = np.degrees(0.5 + 0.125 / 39.0)
    assert fix_findings(fixes, 0.0)[:2] == [
        fact("fixes", "1 of 40 fixes have no position."),
        fact(
            "fixes",
            f"Place: latitude {first:.6f}° to 35.809862°, longitude {np.degrees(-2.75 + 0.625 / 39.0):.6f}° to "
            "-121.753531°, height -12.25 to 431.5 m.",
        ),
    ]


def test_places_that_are_none() -> None:
    none = np.full(_COUNT, np.nan)
    assert fix_findings(_fixes(longitude=none), 0.0)[:1] == [
        wrong("fixes", "No fix has a position.", "Give another file.")
    ]
    latitude = np.full(_COUNT, 0.7)
    latitude[17] = np.radians(-97.25)
    fix = "Latitude and longitude are swapped, or in another unit."
    assert wrong("fixes", "The latitude reaches -97.25° (row 18).", fix) in fix_findings(_fixes(latitude=latitude), 0.0)
    zero = _fixes(latitude=np.linspace(-4e-4, 3e-4, _COUNT), longitude=np.linspace(1e-4, 5.9e-4, _COUNT))
    text = "All fixes are within 6 km of latitude 0, longitude 0."
    fix = "The numbers may be in another unit, or the receiver had no fix."
    assert fix_findings(zero, 0.0)[0] == doubt("fixes", text, fix)
    beyond = replace(zero, longitude=zero.longitude + 2e-5)
    assert fix_findings(beyond, 0.0)[0].text.startswith("Place")


def test_quality_datum_and_missing_sigmas() -> None:
    quality = np.repeat([1, 2, 7], [29, 10, 1])
    fixes = _fixes(
        quality=quality, quality_words={1: "fixed", 2: "float"}, datum="mean sea level", position_sigma=None,
        velocity_ned=None,
    )  # fmt: skip
    fix = f"Give geoid_height_m = {geoid_along(fixes.latitude, fixes.longitude)[20]:.1f}, the geoid of EGM2008 there."
    expected = [
        fact("fixes", "Quality: fixed 72.5 %, float 25 %, code 7 2.5 %.", codes={1: 29, 2: 10, 7: 1}),
        doubt("fixes", "The heights refer to mean sea level.", fix),
        doubt("fixes", "The fixes have no standard deviations.", "Give the filter those of the receiver's datasheet."),
    ]
    assert _beside_the_place(fixes) == expected
    unknown = doubt("fixes", "The heights refer to an unknown surface.", f"If it is mean sea level, give{fix[4:]}")
    assert unknown in fix_findings(replace(fixes, datum="unknown"), 0.0)


@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_steps_agree_with_the_velocities(delay: float) -> None:
    """Each step is off by 14 mm in both components, 1.4826 times that as 1σ: 20.8 mm."""
    (found,) = _beside_the_place(_fixes(), delay)
    assert found.text == "Steps of the horizontal position agree with the velocities to 20.8 mm (1σ per component)."
    assert found.grade == "fact"
    assert found.numbers == {"step_sigma_m": pytest.approx(1.4826 * 0.014, rel=1e-3)}


def test_velocities_are_taken_in_the_middle_of_a_step_or_as_much_later_as_they_are_older() -> None:
    """A velocity to the north that grows by 0.8 m/s², 0.25 s older than its stamp."""
    time = 30.0 + 0.5 * np.arange(_COUNT)
    r1, _ = earth.radii(0.9)
    velocity = np.column_stack([0.8 * (time - 0.25 - 30.0), 0.0 * time, 0.0 * time])
    latitude = 0.9 + 0.4 * (time - 30.0) ** 2 / (r1 + 250.0)
    fixes = _fixes(latitude=latitude, longitude=np.full(_COUNT, 0.3), velocity_ned=velocity, position_sigma=None)
    sizes = [_beside_the_place(fixes, delay)[-1].numbers["step_sigma_m"] for delay in (0.0, 0.25)]
    # the north is off by 0.8 · 0.25 m/s in 0.5 s, the east by nothing: half of the median of all
    assert sizes[0] == pytest.approx(1.4826 * 0.5 * 0.1, rel=0.02)
    assert sizes[1] < 1e-3


def test_steps_against_the_claimed_precision() -> None:
    """Steps of 0.35 m north and 0.3 m east stand out from 6 √2 · 0.03 m = 25 cm; the rarer code is doubtful.

    An error of 14 mm adds to both steps to the north, and is opposite to that to the east.
    """
    r1, r2 = earth.radii(0.9)
    latitude, longitude = _fixes().latitude.copy(), _fixes().longitude.copy()
    latitude[12] += 0.35 / (r1 + 250.0)
    longitude[25:] -= 0.3 / ((r2 + 250.0) * np.cos(0.9))
    quality = np.full(_COUNT, 4)
    quality[12] = 5
    quality[33] = 1
    fixes = _fixes(latitude=latitude, longitude=longitude, quality=quality)
    found = _beside_the_place(fixes)[-1]
    assert found == doubt(
        "fixes",
        "3 steps of the position contradict the claimed precision and the velocities; the largest: 36.4 cm at 36 s, "
        "36.4 cm at 36.5 s, 28.6 cm at 42.5 s. They are at fixes of quality 5.",
        "The filter's gate has to refuse such fixes, or their standard deviations have to be larger.",
        steps=3,
        doubtful_codes=[5],
    )
    claims = [_beside_the_place(replace(fixes, position_sigma=np.full((_COUNT, 3), s))) for s in (0.042, 0.044)]
    assert claims[0][-1].text.startswith("2 steps of")  # 6 √2 · 0.042 m = 35.6 cm
    assert claims[1][-1].text.startswith("Steps of the horizontal position agree")
    one = replace(fixes, latitude=_fixes().latitude, quality=None)
    assert _beside_the_place(one)[-1].text == (
        "1 step of the position contradicts the claimed precision and the velocities; the largest: 28.6 cm at 42.5 s."
    )


def test_a_speed_of_no_vehicle() -> None:
    r1, _ = earth.radii(0.9)
    latitude = _fixes().latitude.copy()
    latitude[20] += 700.0 / (r1 + 250.0)
    found = next(f for f in _beside_the_place(_fixes(latitude=latitude)) if "moves at" in f.text)
    assert found.text.startswith("Between 39.5 s and 40 s the position moves at 140")
    assert found.fix == "One of the two fixes is wrong, or the times are."
    assert found.numbers == {"time_s": 39.5}
    assert not any("moves at" in f.text for f in _beside_the_place(_fixes(latitude=_fixes().latitude)))


_DELAYED = "The velocities are {} ms older than the positions of the same stamp"


@pytest.mark.parametrize(
    ("value", "sigma", "described", "grade", "text", "fix"),
    [
        (0.12, 0.084, 0.0, "doubt", "The motion does not show whether the velocities are older than the positions; no "
         "delay is described.", "See the manual of the receiver."),
        (0.12, 0.02, 0.0, "doubt", _DELAYED.format("120 ± 20") + ".", "Describe a velocity delay of 0.120 s."),
        (0.12, 0.041, 0.0, "fact", _DELAYED.format("120 ± 41") + ": no delay is described.", ""),
        (0.049, 0.01, 0.0, "fact", _DELAYED.format("49 ± 10") + ": no delay is described.", ""),
        (0.27, 0.02, 0.0, "doubt", _DELAYED.format("270 ± 20") + " (half an interval: they are means over it).",
         "Describe a velocity delay of 0.270 s."),
        (0.33, 0.02, 0.0, "doubt", _DELAYED.format("330 ± 20") + ".", "Describe a velocity delay of 0.330 s."),
        (0.27, 0.02, 0.23, "fact", _DELAYED.format("270 ± 20") + "; 230 ms are described.", ""),
        (0.17, 0.02, 0.23, "doubt", _DELAYED.format("170 ± 20") + "; 230 ms are described.",
         "Describe a velocity delay of 0.170 s."),
    ],
)  # fmt: skip
def test_the_delay_of_velocities(value: float, sigma: float, described: float, grade: str, text: str, fix: str) -> None:
    """Fixes come every 0.5 s: a 1σ of a sixth of that shows a delay, and a tenth of it is none."""
    found = delay_findings(_fixes(), Delay(value, sigma), described)
    assert found == [Finding("fixes", grade, text, fix, {"velocity_delay_s": value, "sigma_s": sigma})]  # type: ignore[arg-type]
    assert delay_findings(_fixes(), None, described) == []


def test_a_receiver_that_is_wrong_for_some_time() -> None:
    """4 km off for 5 s, and back: the longest part without a jump is used.

    Three wrong fixes are left to the gate, but not at the beginning, where the navigation would start from them.
    """
    good = _fixes(velocity_ned=None, position_sigma=None)
    for wrong_fixes, begin, said in (
        (10, 35.0, "the longest part without one, 35 to 49.5 s."),
        (3, 31.5, "The first fixes are wrong: the scenario begins at 31.5 s."),
    ):
        height = np.where(np.arange(_COUNT) < wrong_fixes, 4250.0, 250.0)
        (jump,) = (f for f in fix_findings(replace(good, height=height), 0.0) if "time_s" in f.numbers)
        assert jump.numbers == {"time_s": 29.5 + 0.5 * wrong_fixes, "sound_s": (begin, 49.5)}
        assert jump.fix.endswith(said)
    height = np.full(_COUNT, 250.0)
    height[20:22] = 4250.0  # two outliers in the middle: what comes before and after fits together
    (jump,) = (f for f in fix_findings(replace(good, height=height), 0.0) if "time_s" in f.numbers)
    assert "sound_s" not in jump.numbers


def test_rows_without_a_fix_count_only_as_such() -> None:
    """Ten rows of zeros before the first fix are no place and no jump."""
    before = np.arange(_COUNT) < 10
    good = _fixes(velocity_ned=None, position_sigma=None, quality_words={0: "no fix", 1: "3D"})
    rows = replace(
        good, quality=np.where(before, 0, 1), latitude=np.where(before, 0.0, good.latitude),
        longitude=np.where(before, 0.0, good.longitude), height=np.where(before, 0.0, good.height),
    )  # fmt: skip
    place, quality, *others = fix_findings(rows, 0.0)
    assert place == fix_findings(good.rows(~before), 0.0)[0]
    assert quality.text == "Quality: no fix 25 %, 3D 75 %."
    assert not any("time_s" in f.numbers for f in others)


def test_stated_sigmas_that_are_far_too_small() -> None:
    """Fixes of 0.5 m that claim 0.02 m: a factor of 25, which 40 steps show to 20 %."""
    rng = np.random.default_rng(3)
    good = _fixes(position_sigma=np.full((_COUNT, 3), 0.02), velocity_sigma=np.full((_COUNT, 3), 0.05))
    r1, r2 = earth.radii(0.9)
    noise = 0.5 * rng.standard_normal((2, _COUNT))
    noisy = replace(good, latitude=good.latitude + noise[0] / (r1 + 250.0),
                    longitude=good.longitude + noise[1] / ((r2 + 250.0) * np.cos(0.9)))  # fmt: skip
    (finding,) = (f for f in fix_findings(noisy, 0.0) if "sigma_factor" in f.numbers)
    assert finding.numbers["sigma_factor"] == pytest.approx(25.0, rel=0.2)
    assert finding.text.startswith("Are the stated 1σ of the positions too small? Their steps scatter by ")
    said = re.search(r"scatter by (\S+) m .*, (\S+) times the stated (\S+) m", finding.text)
    assert said is not None
    scatter, ratio, stated = map(float, said.groups())
    assert stated == pytest.approx(0.02 * 2.0**0.5, rel=2e-3)  # a step has two ends
    assert ratio == pytest.approx(finding.numbers["sigma_factor"], rel=5e-3)
    assert scatter == pytest.approx(ratio * stated, rel=5e-3)
    assert not [f for f in fix_findings(good, 0.0) if "sigma_factor" in f.numbers]
    rough = replace(noisy, velocity_sigma=np.full((_COUNT, 3), 1.0))  # velocities that explain such steps
    assert not [f for f in fix_findings(rough, 0.0) if "sigma_factor" in f.numbers]
