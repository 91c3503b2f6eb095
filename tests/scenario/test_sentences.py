"""What is said of a plan, whole, on an aircraft whose ceiling, airspeeds and climbs are round numbers."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.scenario import planned_limits
from sinssim.scenario.planned_limits import Finding, _Judge

KNOT = 1852.0 / 3600.0


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch) -> _Judge:
    """At 6000 m from 156 to 394 kt; a climb at 16 m/s there and none at 22 km, a descent at 11 m/s."""
    for name, of in (
        ("speed_range", lambda envelope, height: (150.0 + height / 1e3, 400.0 - height / 1e3)),
        ("best_ceiling", lambda envelope: (23_400.0, 310.0)),
        ("ceiling", lambda envelope, speed: 22_000.0),
        ("climb_rate", lambda envelope, height, speed: 22.0 - height / 1e3),
        ("descent_rate", lambda envelope, height, speed: 5.0 + height / 1e3),
    ):
        monkeypatch.setattr(planned_limits, name, of)
    performance: Any = SimpleNamespace(
        max_load_factor_g=2.5, climb_mps=10.0, descent_mps=7.0, bank_deg=25.0, glider=False
    )
    return _Judge(SimpleNamespace(aircraft="737"), None, performance)  # type: ignore[arg-type]


def test_airspeeds(judge: _Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three percent beyond the table are allowed: from 151.5 to 405.8 kt."""

    def said(knots: float, height: float = 6000.0) -> list[Finding]:
        return list(judge.airspeed("flight.start.airspeed_kt", knots * KNOT, height))

    assert said(152.0) == said(405.0) == []
    text = "at 6000 m: level flight of the 737 (flaps up) is possible from 156 to 394 kt there."
    assert said(151.0) == [Finding(True, f"flight.start.airspeed_kt = 151 {text}")]
    assert said(406.5) == [Finding(True, f"flight.start.airspeed_kt = 406.5 {text}")]
    monkeypatch.setattr(planned_limits, "speed_range", lambda envelope, height: (0.0, 0.0))
    assert said(250.0, 25_000.0) == [
        Finding(
            True,
            "flight.start.airspeed_kt = 250 at 25000 m: the 737 has no level flight at this height; its ceiling is "
            "about 23400 m at 310 kt.",
        )
    ]


def test_banks(judge: _Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    """66.4° are 2.5 g; at 60° the 156 kt of level flight become 156 √2 = 220.6 kt."""

    def said(bank: float, knots: float) -> list[Finding]:
        return list(judge.bank("leg 3", bank, knots * KNOT, 6000.0))

    assert said(66.4, 300.0) == said(60.0, 214.5) == []
    assert said(67.0, 300.0) == [
        Finding(
            True,
            "leg 3: bank_deg = 67 needs 2.6 g to stay level; the autopilot of the 737 allows 2.5 g: give at most 66.",
        )
    ]
    allowed = math.degrees(math.acos((156.0 / 214.0) ** 2))
    assert 57.0 < allowed < 58.4
    assert said(60.0, 214.0) == [
        Finding(
            True,
            f"leg 3: at bank_deg = 60 the 737 stalls below 221 kt, and it flies at 214 kt: give at most {allowed:.0f}, "
            "or a higher airspeed.",
        )
    ]
    assert said(20.0, 140.0)[0].text.endswith("give at most 0, or a higher airspeed.")  # below that of level flight
    monkeypatch.setattr(planned_limits, "speed_range", lambda envelope, height: (0.0, 0.0))
    assert said(60.0, 214.0) == []


def climbed(judge: _Judge, low: float, high: float, wished: float | None = None, timeout: float = 1e4) -> list[Finding]:
    leg: Any = SimpleNamespace(timeout_s=timeout) if wished is None else SimpleNamespace(
        timeout_s=timeout, vertical_speed_mps=wished
    )  # fmt: skip
    before, after = (SimpleNamespace(altitude=height, airspeed=280.0 * KNOT) for height in (low, high))
    return list(judge.climb("leg 2", leg, before, after))  # type: ignore[arg-type]


def test_descents(judge: _Judge) -> None:
    """The least rate on the way counts, 8 m/s at 3000 m."""
    assert climbed(judge, 6000.0, 3000.0) == climbed(judge, 6000.0, 3000.0, 8.2) == []
    end = "A faster descent increases its airspeed; to avoid this, give a slower descent."
    assert climbed(judge, 6000.0, 3000.0, 8.3) == [
        Finding(
            False,
            f"leg 2: vertical_speed_mps = 8.3: with idle engines the 737 descends at 8.0 m/s at 280 kt. {end}",
        )
    ]
    (usual,) = climbed(judge, 6000.0, 1000.0)
    assert usual.text.startswith("leg 2: vertical_speed_mps = 7: with idle engines the 737 descends at 6.0 m/s")


def test_climbs(judge: _Judge) -> None:
    """From 6000 to 12 000 m: 600 s at the usual 10 m/s. At 14 m/s the last four of the twelve steps are slower, with
    13.75, 13.25, … m/s on average."""
    assert climbed(judge, 6000.0, 12_000.0, timeout=600.5) == []
    assert climbed(judge, 6000.0, 12_000.0, timeout=599.5) == [
        Finding(
            True,
            "leg 2: timeout_s = 599.5: the climb to 12000 m at 280 kt takes 600 s with full throttle; give a longer "
            "time, or a lower altitude_m.",
        )
    ]
    seconds = 4000.0 / 12.0 + sum(500.0 / rate for rate in (11.75, 11.25, 10.75, 10.25))
    assert climbed(judge, 6000.0, 12_000.0, 12.0, math.floor(seconds)) == [
        Finding(
            True,
            f"leg 2: timeout_s = {math.floor(seconds)}: the climb to 12000 m at 280 kt takes {seconds:.0f} s with full "
            "throttle; give a longer time, or a lower altitude_m.",
        )
    ]
    assert climbed(judge, 6000.0, 12_000.0, 12.0, math.ceil(seconds)) == [
        Finding(
            False,
            "leg 2: vertical_speed_mps = 12: the 737 climbs at 10.0 m/s at most at 12000 m and 280 kt; the climb takes "
            "longer.",
        )
    ]
    assert climbed(judge, 6000.0, 12_000.0, 10.2) == []


def test_ceilings(judge: _Judge, monkeypatch: pytest.MonkeyPatch) -> None:
    """22 km; what is above it by less than three percent is flown as far as it goes."""

    def said(height: float) -> list[Finding]:
        return list(judge.above_ceiling("leg 4: altitude_m", height, 280.0))

    text = "is above the ceiling of the 737 at 280 kt, about 22000 m: give a lower height"
    better = ", or fly at 310 kt, where it is about 23400 m."
    assert said(21_900.0) == []
    assert said(22_600.0) == [Finding(False, f"leg 4: altitude_m = 22600 {text}{better}")]
    assert said(22_700.0) == [Finding(True, f"leg 4: altitude_m = 22700 {text}{better}")]
    monkeypatch.setattr(planned_limits, "best_ceiling", lambda envelope: (22_199.0, 310.0))
    assert said(22_700.0) == [Finding(True, f"leg 4: altitude_m = 22700 {text}.")]
    assert climbed(judge, 6000.0, 22_700.0) == [Finding(True, f"leg 2: altitude_m = 22700 {text}.")]
