"""What is said of the offset of two clocks: whole findings, and what the files state."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.inspection.clock_offset import Agreement, Offset, offset_finding, stated_offset
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact
from sinssim.analyses.inspection.velocity_match import Match
from sinssim.logs.recorded_streams import Clock

GPS = Clock("gps", 1_400_000_000)
UTC = Clock("utc", 1_400_000_000)
_NONE = np.zeros(0)
_MATCH = Match(0.1, _NONE, _NONE, np.zeros((0, 4)), _NONE, np.zeros(6), 10.0)


def _said(
    value: float, stated: float | None, *, sigma: float = 0.004, inside: bool = True, unit: Clock = GPS,
    receiver: Clock = GPS,
) -> Finding:  # fmt: skip
    offset = Offset(value - 0.125, sigma, _MATCH, inside)  # of the velocities
    found = Agreement(offset, stated, stated, None, (), np.eye(3), np.eye(3))
    return offset_finding(found, value, unit, receiver)


def _numbers(value: float, sigma: float | None = 0.004, shown: bool = True) -> dict[str, object]:
    return {"imu_clock_minus_gnss_clock_s": value, "sigma_s": sigma, "shown": shown}


def test_what_files_state() -> None:
    """A receiver whose time 0 is later by 250 s is behind by that."""
    assert stated_offset(Clock("gps", 1_400_000_000), Clock("utc", 1_400_000_250)) == 250.0
    assert stated_offset(Clock("machine"), Clock("gps")) == 0.0
    assert stated_offset(Clock("machine"), GPS) is None
    assert stated_offset(GPS, Clock("machine")) is None


@pytest.mark.parametrize(
    ("late", "sigma", "ok"),
    [(0.009, 0.002, True), (0.011, 0.002, False), (0.011, 0.004, True), (-0.013, 0.004, False)],
)
def test_a_small_offset_is_what_is_stated(late: float, sigma: float, ok: bool) -> None:
    """Up to 10 ms or three times the 1σ nothing has to be described."""
    found = _said(3.0 + late, 3.0, sigma=sigma)
    word = "late" if late > 0.0 else "early"
    text = f"The stamps of the unit are {abs(1e3 * late):.0f} ms ± {1e3 * sigma:.0f} ms {word} relative to those of the"
    if ok:
        assert found == fact("clocks", f"{text} positions.", **_numbers(3.0 + late, sigma))
    else:
        text = f"{text} positions, by the match of the velocities."
        assert found == doubt("clocks", text, "Describe this offset.", **_numbers(3.0 + late, sigma))


def test_clocks_without_a_common_origin() -> None:
    fix = "Describe this offset: the clocks have no common origin."
    text = "The unit's clock is 5321.750 s ± 4 ms ahead of that of the positions, by the match of the velocities."
    assert _said(5321.75, None) == doubt("clocks", text, fix, **_numbers(5321.75))
    text = "The unit's clock is 0.750 s ± 4 ms behind that of the positions, by the match of the velocities."
    assert _said(-0.75, None) == doubt("clocks", text, fix, **_numbers(-0.75))


def test_an_offset_that_the_motion_does_not_show() -> None:
    """A 1σ of a sixth of a second, or a least residual at the end of the range, shows nothing."""
    ask = "Do you know it? Otherwise record a drive with turns and stops."
    text = "The motion does not show the offset of the clocks within 1 s ({}); none is described."
    small, others = "the motion is too small, or too short", "other offsets fit as well"
    assert _said(0.4, 0.0, sigma=0.17) == doubt("clocks", text.format(small), ask, **_numbers(0.4, 0.17, False))
    assert _said(0.4, 0.0, sigma=0.16).grade == "fact"  # within three times the 1σ
    assert _said(0.4, 0.0, sigma=0.16).numbers["shown"] is True
    assert _said(0.4, 0.0, inside=False).text == text.format(others)
    found = _said(2.5, 0.0, sigma=float("nan"))
    text = "Is it so that the unit's clock is 2.500 s ahead of that of the positions? The data do not show it: "
    assert found == doubt("clocks", text + f"{small}.", ask, **_numbers(2.5, None, False))


_LEAP = "18 s are the leap seconds between UTC and GPS time: "


@pytest.mark.parametrize(
    ("late", "unit", "receiver", "why"),
    [
        (18.2, UTC, UTC, "the times of the unit are GPS time, but are taken for UTC"),
        (-17.8, UTC, UTC, "the times of the receiver are GPS time, but are taken for UTC"),
        (18.2, GPS, GPS, "the times of the receiver are UTC, but are taken for GPS time"),
        (-17.8, GPS, GPS, "the times of the unit are UTC, but are taken for GPS time"),
        (18.2, GPS, UTC, "one of the files confuses UTC and GPS time"),
    ],
)
def test_leap_seconds(late: float, unit: Clock, receiver: Clock, why: str) -> None:
    """May 2024 has 18 of them. UTC that is taken for GPS time runs behind."""
    sixteen = [Clock(one.kind, 1_400_000_000) for one in (unit, receiver)]
    found = _said(late, 0.0, unit=sixteen[0], receiver=sixteen[1])
    assert found.fix == f"Describe this offset: {_LEAP}{why}."


def test_before_2017_there_were_17_leap_seconds() -> None:
    """1 150 000 000 s of GPS time are in June 2016."""
    of_2016 = Clock("gps", 1_150_000_000)
    assert ": 17 s are the leap seconds" in _said(17.3, 0.0, unit=of_2016, receiver=of_2016).fix


@pytest.mark.parametrize(("late", "hours"), [(7200.4, "2"), (-19_800.6, "-5.5"), (3618.5, "1")])
def test_time_zones(late: float, hours: str) -> None:
    why = f"{hours} h are the difference of a time zone: local time is taken for UTC or GPS time"
    assert _said(late, 0.0).fix == f"Describe this offset: {why}."


def test_an_offset_that_nothing_explains() -> None:
    assert _said(620.0, 0.0).fix == "Describe this offset."
    assert _said(3620.0, 0.0).fix == "Describe this offset."  # an hour, but for more than leap seconds
