"""The limits of a model by trims: what is set, what is looked for, and the table of it, with trims that are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Self

import pytest

from sinssim.errors import InputError
from sinssim.truth.aircraft_design import trimmed_envelope
from sinssim.truth.aircraft_design.aircraft_design import design_aircraft
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.jsbsim_model import quiet


class Executive(dict[str, float]):
    """Properties of JSBSim that are only stored; running engines have what `engine` says."""

    def __init__(self, alpha_deg: float, **engine: float) -> None:
        super().__init__({"aero/alpha-deg": alpha_deg, "propulsion/engine[0]/thrust-lbs": engine.get("thrust", 1e3)})
        self["propulsion/total-fuel-lbs"] = engine.get("fuel", 500.0)

    def run_ic(self) -> None:
        self.at_ic = dict(self)


def model(flies: Callable[[float, float, float], bool] | None = None) -> Any:
    made = object.__new__(trimmed_envelope.TrimmedModel)
    made._steepest, made._stall, made._gear, made._fuel, made._glides = 30.0, 16.0, 1.0, 500.0, False
    if flies is not None:
        made.flies = flies  # type: ignore[method-assign]
    return made


def test_what_is_trimmed() -> None:
    """15 000 ft over ground 3 km below; trimmed below the stall; a spoiled model is loaded again and does not fly."""
    one = model()
    one._executive = executive = Executive(15.9)
    assert one.flies(4572.0, 210.0, -3.5) is True
    wanted = {
        "gear/gear-cmd-norm": 1.0, "gear/gear-pos-norm": 1.0, "ic/lat-geod-deg": 45.0, "ic/long-gc-deg": 0.0,
        "ic/psi-true-deg": 0.0, "ic/vc-kts": 210.0, "ic/gamma-deg": -3.5,
    }  # fmt: skip
    assert {key: executive.at_ic[key] for key in wanted} == wanted
    assert executive.at_ic["ic/h-sl-ft"] == pytest.approx(15_000.0)
    assert executive.at_ic["ic/terrain-elevation-ft"] == pytest.approx(1572.0 / 0.3048)
    assert (executive["propulsion/set-running"], executive["simulation/do_simple_trim"]) == (-1, 1)
    loaded = []
    one._load = lambda: loaded.append(True)
    one._executive = Executive(16.1)
    assert one.flies(4572.0, 210.0, -3.5) is False
    assert loaded == []
    for spoiled in ({"thrust": math.nan}, {"fuel": 499.0}):
        one._executive = Executive(15.0, **spoiled)
        assert one.flies(4572.0, 210.0, -3.5) is False
    assert loaded == [True, True]


def vertical_speed(angle_deg: float) -> float:
    """Return V sin γ/(1 + V/g dV/dh) of 150 kt CAS at 3 km, the slope by central differences over 20 m."""
    v, low, high = (Air().true_airspeed(150.0 * 1852.0 / 3600.0, h) for h in (3000.0, 2990.0, 3010.0))
    return v * math.sin(math.radians(angle_deg)) / (1.0 + v / 9.80665 * (high - low) / 20.0)


def test_the_steepest_climb_and_descent_are_bisected_from_an_angle_that_flies() -> None:
    """Nine bisections of 30°: angles are multiples of 0.0586° from the one that flies, inside of the limit."""
    asked = []

    def flies(height: float, speed_kt: float, angle_deg: float) -> bool:
        asked.append((height, speed_kt))
        return -7.3 <= angle_deg <= 11.9

    step = 30.0 / 512.0
    assert model(flies).steepest(3000.0, 150.0, 1.0) == pytest.approx(vertical_speed(203 * step), rel=1e-4)
    assert model(flies).steepest(3000.0, 150.0, -1.0) == pytest.approx(vertical_speed(124 * step), rel=1e-4)
    assert set(asked) == {(3000.0, 150.0)}
    # only descents of 4 to 8° fly, as above the ceiling: the best climb is a descent
    sinks = model(lambda h, v, angle: -8.0 <= angle <= -4.0)
    assert sinks.steepest(3000.0, 150.0, 1.0) == pytest.approx(-vertical_speed(6.0 - 28 * 36.0 / 512.0), rel=1e-4)
    assert sinks.steepest(3000.0, 150.0, -1.0) == pytest.approx(vertical_speed(6.0 + 42 * 24.0 / 512.0), rel=1e-4)
    assert model(lambda h, v, angle: angle > 5.0).steepest(3000.0, 150.0, 1.0) is None


def test_the_ends_of_level_flight_are_looked_for_beyond_the_given_speeds() -> None:
    at = []

    def flies(height: float, speed_kt: float, angle_deg: float) -> bool:
        at.append((height, angle_deg))
        return 93.7 <= speed_kt <= 221.3

    speeds = [80.0, 100.0, 150.0, 200.0]
    assert model(flies).end_of_level_flight(3000.0, speeds, slow=True) == 93.7
    assert model(flies).end_of_level_flight(3000.0, speeds, slow=False) == 221.3
    assert set(at) == {(3000.0, 0.0)}
    always = model(lambda h, v, angle: True)
    assert always.end_of_level_flight(3000.0, speeds, slow=True) == pytest.approx(0.7 * 80.0, abs=0.051)
    assert always.end_of_level_flight(3000.0, speeds, slow=False) == pytest.approx(1.4 * 200.0, abs=0.051)
    assert model(lambda h, v, angle: False).end_of_level_flight(3000.0, speeds, slow=True) == 0.0


def test_the_table_has_heights_in_rows_and_fills_what_cannot_be_trimmed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Known:
        def __init__(self, name: str, steepest_deg: float) -> None:
            assert (name, steepest_deg) == ("kite", 20.0)

        def __enter__(self) -> Self:
            return self

        def __exit__(self, *error: object) -> None: ...

        def end_of_level_flight(self, height: float, speeds: list[float], *, slow: bool) -> float:
            return (speeds[0] if slow else speeds[-1]) + height / 1000.0

        def steepest(self, height: float, speed: float, sign: float) -> float | None:
            return None if speed in (10.0, 30.0, 40.0) else (height / 1000.0 + speed) * (1.0 if sign > 0 else 2.0)

    monkeypatch.setattr(trimmed_envelope, "TrimmedModel", Known)
    found = trimmed_envelope.trimmed_envelope("kite", [500.0, 1500.0], [10.0, 20.0, 30.0, 40.0, 50.0], 20.0)
    assert found.height_m == (500.0, 1500.0)
    assert found.airspeed_kt == (10.0, 20.0, 30.0, 40.0, 50.0)
    assert (found.min_kt, found.max_kt) == ((10.5, 11.5), (50.5, 51.5))
    assert found.climb_mps == ((20.5, 20.5, 20.5, 50.5, 50.5), (21.5, 21.5, 21.5, 51.5, 51.5))
    assert found.descent_mps == ((41.0, 41.0, 41.0, 101.0, 101.0), (43.0, 43.0, 43.0, 103.0, 103.0))
    assert trimmed_envelope._filled([[1.23456, None]], [3.0]) == ((1.23, 1.23),)
    with pytest.raises(InputError, match=r"cannot be trimmed at 1500 m: give lower heights\."):
        trimmed_envelope._filled([[1.0], [None]], [500.0, 1500.0])


def test_a_height_without_any_trim_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """JSBSim finds no trim of the Boeing 314 at sea level, but at 1500 m and above."""

    class Known(trimmed_envelope.TrimmedModel):
        def __init__(self, name: str, steepest_deg: float) -> None: ...
        def __enter__(self) -> Self:
            return self

        def __exit__(self, *error: object) -> None: ...

        def quick_ends(self, height: float, speeds: list[float]) -> tuple[float, float]:
            return 100.0 + height / 100.0, 150.0

        def quick_steepest(self, height: float, speed_kt: float, sign: float) -> float | None:
            return None if height in missing else height / 1000.0 + sign

    monkeypatch.setattr(trimmed_envelope, "TrimmedModel", Known)
    missing = {0.0}
    envelope = trimmed_envelope.quick_envelope("boat", [0.0, 1500.0, 3000.0], [90.0, 140.0], 20.0, lambda part: None)
    assert (envelope.height_m, envelope.min_kt) == ((1500.0, 3000.0), (115.0, 130.0))
    assert envelope.climb_mps == ((2.5, 2.5), (4.0, 4.0))
    assert envelope.descent_mps == ((0.5, 0.5), (2.0, 2.0))
    missing = {0.0, 3000.0}
    with pytest.raises(InputError, match=r"cannot be trimmed at 0 m: give lower heights\."):
        trimmed_envelope.quick_envelope("boat", [0.0, 1500.0, 3000.0], [90.0, 140.0], 20.0, lambda part: None)


def test_the_quick_envelope_follows_the_throttle_to_its_ends() -> None:
    """The throttle is 0.5 + γ/20°: full at 10°, idle at −10°; another is full at 8° but fails to trim beyond 5°."""
    asked = list[float]()

    def made(most: float, slope: float) -> Any:
        def flies(height: float, speed_kt: float, angle_deg: float) -> bool:
            asked.append(angle_deg)
            return abs(angle_deg) <= most

        one = model(flies)
        one.throttle = lambda: 0.5 + slope * asked[-1]
        return one

    climb, descent = (made(10.001, 0.05).quick_steepest(3000.0, 150.0, sign) for sign in (1.0, -1.0))
    assert climb == pytest.approx(vertical_speed(10.0), rel=2e-3)
    assert descent == pytest.approx(-vertical_speed(-10.0), rel=2e-3)
    assert len(asked) < 10  # level flight, a first secant, and what it leads to
    stuck = made(5.0, 0.5 / 8.0).quick_steepest(3000.0, 150.0, 1.0)
    assert vertical_speed(4.5) < stuck <= vertical_speed(5.0)
    assert model(lambda height, speed, angle: False).quick_steepest(3000.0, 150.0, 1.0) is None


def test_the_quick_ends_are_known_to_an_eighth_of_a_gap() -> None:
    level = model(lambda height, speed, angle: 93.7 <= speed <= 221.3)
    slow, fast = level.quick_ends(3000.0, [80.0, 100.0, 200.0, 240.0])
    assert (slow, fast) == (95.0, 220.0)  # of steps of 2.5 and 5 kt
    assert level.quick_ends(3000.0, [100.0, 200.0]) == (100.0, 200.0)
    assert level.quick_ends(3000.0, [10.0, 20.0]) == (0.0, 0.0)


def test_full_thrust_is_that_of_the_engine_power() -> None:
    """160 hp through a propeller of 50 to 90 % at 90 kt; the P-51's throttle moves nothing in JSBSim alone."""
    with quiet(), trimmed_envelope.TrimmedModel("c172x", 30.0) as cessna:
        thrust = cessna.full_thrust(600.0, 90.0) * cessna._executive["inertia/weight-lbs"] * 4.448
    speed = Air().true_airspeed(90.0 * 1852.0 / 3600.0, 600.0)
    assert 0.5 < thrust * speed / (160.0 * 745.7) < 0.9
    with pytest.raises(InputError, match=r"p51d cannot be flown: its engines give only 0\.0 % of its weight as thrust"):
        design_aircraft("p51d", None, lambda text, part: None)
