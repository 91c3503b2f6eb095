"""The estimated end and duration of each leg, worked out by hand."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from sinssim.truth.flight.leg import DeadReckoning, LegBase
from sinssim.truth.flight.legs.ground import ParkedLeg, TakeoffLeg, TaxiLeg
from sinssim.truth.flight.legs.landing import LandLeg
from sinssim.truth.flight.legs.manoeuvres import BarrelRollLeg, DoubletLeg, LoopLeg
from sinssim.truth.flight.legs.straight import AltitudeLeg, HoldLeg, SpeedLeg
from sinssim.truth.flight.legs.turns import RacetrackLeg, STurnsLeg, TurnLeg
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from tests.truth.flight.test_dead_reckoning import PERFORMANCE, Thinning

KNOT, R = 1852.0 / 3600.0, 6371e3
WIND = (6.0, -8.0)


def plan(airspeed: float = 100.0, wind: tuple[float, float] = WIND, **more: Any) -> DeadReckoning:
    """Return a plan on heading 30° at latitude 0 and longitude 0.3, where the sphere is flat to 1e-6 for 10 km."""
    state = {"altitude": 0.0, "heading": math.radians(30.0), "latitude": 0.0, "longitude": 0.3, **more}
    return DeadReckoning(PERFORMANCE, 0.2, airspeed, air=Thinning(((0.0, (*wind, 0.0)),)), **state)


def after(leg: LegBase, state: DeadReckoning) -> tuple[float, float, float, float]:
    """Return the duration, the way north and east, and the heading in degrees at the end."""
    seconds = leg.reckon(state)
    return seconds, state.latitude * R, (state.longitude - 0.3) * R, math.degrees(state.heading)


def way(ahead: float, seconds: float, heading_deg: float = 30.0) -> tuple[float, float]:
    """Return the way north and east of one through the air in the wind."""
    heading = math.radians(heading_deg)
    return ahead * math.cos(heading) + 6.0 * seconds, ahead * math.sin(heading) - 8.0 * seconds


def test_taxi() -> None:
    """35 s for the engines, 100 s at 5 m/s, and 0.5 (5 − 2)²/(0.5 · 5) = 1.8 s for the change of speed."""
    state = plan(2.0, engines=False)
    leg = TaxiLeg(type="taxi", distance_m=500.0, heading_deg=90.0)
    north, east = 40.0 * 0.5, 40.0 * math.sqrt(0.75) + 500.0 - 40.0 * math.pi / 3.0  # a chord of 40 m to 60°, ahead
    assert after(leg, state) == pytest.approx((136.8, north, east, 90.0), rel=1e-6)
    assert (state.airspeed, state.engines) == (5.0, True)
    assert state.turning == pytest.approx(math.pi / 3.0 * 5.0 / 40.0)
    fast = plan(8.0)  # 6 s from 8 to 5 m/s are 39 m, the other 461 m take 92.2 s
    assert TaxiLeg(type="taxi", distance_m=500.0).reckon(fast) == pytest.approx(6.0 + 461.0 / 5.0, rel=1e-12)
    left = plan(4.0)
    leg = TaxiLeg(type="taxi", distance_m=10.0, heading_deg=-60.0, speed_mps=4.0, radius_m=20.0)
    chord = 2.0 * 20.0 * math.sin(math.radians(45.0))
    assert after(leg, left) == pytest.approx((2.5, chord * math.cos(math.radians(15.0)),
                                              -chord * math.sin(math.radians(15.0)), 300.0), rel=1e-6)  # fmt: skip


def test_park() -> None:
    """From 5 m/s at 0.5 m/s²: 10 s and 25 m; 10 s for the gear, 30 s for the thrust, 60 s at rest."""
    state = plan(5.0)
    assert after(ParkedLeg(type="park", duration_s=60.0, engines="off"), state) == pytest.approx(
        (110.0, 25.0 * math.sqrt(0.75), 12.5, 30.0), rel=1e-6
    )
    assert (state.airspeed, state.engines) == (0.0, False)
    assert ParkedLeg(type="park", duration_s=60.0).reckon(state) == 60.0
    assert ParkedLeg(type="park", duration_s=60.0, engines="off").reckon(state) == 60.0
    assert ParkedLeg(type="park", duration_s=60.0, engines="running").reckon(state) == 85.0
    assert state.engines


def test_takeoff() -> None:
    """35 s for the engines; 90 kt by a quarter of g; 300 m at 4 m/s, with the mean of both ends' airspeed."""
    state, v = plan(0.0, engines=False), 90.0 * KNOT
    run = v / (0.25 * 9.81)
    north, east = way(0.5 * v * run + 75.0 * v * 1.015, 75.0)
    leg = TakeoffLeg(type="take_off", height_m=300.0)
    assert after(leg, state) == pytest.approx((35.0 + run + 75.0, north, east, 30.0), rel=1e-6)
    assert (state.altitude, state.airspeed) == (300.0, v)
    assert leg.end_height(120.0) == 420.0


def test_climb_and_descent() -> None:
    state = plan(altitude=1000.0)
    assert AltitudeLeg(type="climb", altitude_m=3000.0).reckon(state) == 500.0
    assert AltitudeLeg(type="descend", altitude_m=2000.0).reckon(state) == 400.0
    assert AltitudeLeg(type="descend", altitude_m=1500.0, vertical_speed_mps=8.0).reckon(state) == 62.5
    assert state.altitude == 1500.0
    with pytest.raises(ValueError, match=r'goes down, from 500 m to altitude_m = 300: .* type = "descend"'):
        AltitudeLeg(type="climb", altitude_m=300.0).end_height(500.0)
    with pytest.raises(ValueError, match=r'goes up, from 300 m to altitude_m = 500: .* type = "climb"'):
        AltitudeLeg(type="descend", altitude_m=500.0).end_height(300.0)
    assert AltitudeLeg(type="climb", altitude_m=300.0).end_height(300.0) == 300.0


def test_hold() -> None:
    north, east = way(1500.0, 15.0)
    assert after(HoldLeg(type="hold", duration_s=15.0), plan()) == pytest.approx((15.0, north, east, 30.0), rel=1e-6)
    assert HoldLeg(type="hold", until_s=80.0).reckon(plan(elapsed=65.0)) == 15.0
    assert HoldLeg(type="hold", until_s=80.0).reckon(plan(elapsed=85.0)) == 0.0


@pytest.mark.parametrize(
    ("keys", "turn_deg"),
    [
        ({"heading_deg": 100.0}, 70.0), ({"heading_deg": 340.0}, -50.0),
        ({"heading_deg": 20.0, "direction": "right"}, 350.0),
        ({"heading_deg": 40.0, "direction": "left"}, -350.0), ({"angle_deg": 400.0, "direction": "left"}, -400.0),
        ({"angle_deg": 45.0, "direction": "right"}, 45.0), ({"heading_deg": 30.0, "direction": "left"}, 0.0),
    ],
)  # fmt: skip
def test_turn(keys: dict[str, Any], turn_deg: float) -> None:
    """At 45° of bank and 100 m/s the rate is 0.0981 rad/s."""
    state = plan(wind=(0.0, 0.0))
    seconds, north, east, heading = after(TurnLeg(type="turn", bank_deg=45.0, **keys), state)
    assert seconds == pytest.approx(math.radians(abs(turn_deg)) / 0.0981, abs=1e-9)
    assert (heading - 30.0 - turn_deg + 180.0) % 360.0 == pytest.approx(180.0)
    chord = 2.0 * 100.0 / 0.0981 * math.sin(math.radians(0.5 * abs(turn_deg)))
    to = math.radians(30.0 + 0.5 * turn_deg)
    assert (north, east) == pytest.approx((chord * math.cos(to), chord * math.sin(to)), rel=1e-5, abs=1e-3)


def test_racetrack() -> None:
    """One lap of straight legs of 3 km over the ground: into the wind's two directions, and two half circles."""
    state = plan()
    first = math.hypot(100.0 * math.cos(math.radians(30.0)) + 6.0, 50.0 - 8.0)
    second = math.hypot(-100.0 * math.cos(math.radians(30.0)) + 6.0, -50.0 - 8.0)
    straight, circle = (3000.0 / first, 3000.0 / second), math.pi / 0.0981
    leg = RacetrackLeg(type="racetrack", leg_length_m=3000.0, bank_deg=45.0)
    total = sum(straight) + 2.0 * circle
    drift_n, drift_e = way(100.0 * (straight[0] - straight[1]), total)  # the half circles close the rest
    assert after(leg, state) == pytest.approx((total, drift_n, drift_e, 30.0), rel=1e-5)
    timed = RacetrackLeg(type="racetrack", leg_duration_s=20.0, bank_deg=45.0, direction="left", laps=3)
    assert timed.reckon(plan()) == pytest.approx(6.0 * (20.0 + circle))


def test_s_turns() -> None:
    """A swing out and back by 30° at 0.0981 rad/s; on average it advances by sin(30°)/(π/6)."""
    state, swing = plan(), math.pi / 6.0
    seconds = 3.0 * 2.0 * swing / 0.0981
    north, east = way(100.0 * seconds * 0.5 / swing, seconds)
    leg = STurnsLeg(type="s_turns", swing_deg=30.0, bank_deg=45.0, turns=3)
    assert after(leg, state) == pytest.approx((seconds, north, east, 30.0), rel=1e-6)
    each = (2.0 * swing) ** 2 / (seconds / 3.0) + 2.0 * 0.25 * math.pi * 0.2
    assert state.turning == pytest.approx(3.0 * each)
    timed = plan()
    assert STurnsLeg(type="s_turns", swing_deg=30.0, bank_deg=45.0, duration_s=50.0).reckon(timed) == 50.0
    assert timed.turning == pytest.approx(50.0 / (seconds / 3.0) * each)


def test_speed() -> None:
    """From 100 m/s to 120 kt at 0.5 m/s²."""
    state, v = plan(), 120.0 * KNOT
    seconds = (100.0 - v) / 0.5
    north, east = way(seconds * 0.5 * (100.0 + v), seconds)
    assert after(SpeedLeg(type="speed", airspeed_kt=120.0), state) == pytest.approx(
        (seconds, north, east, 30.0), rel=1e-6
    )
    assert state.airspeed == v


def test_doublet_loop_and_barrel_roll() -> None:
    leg: LegBase = DoubletLeg(type="doublet", control="rudder", amplitude=-0.3, duration_s=2.0, recovery_s=7.0)
    state = plan()
    assert after(leg, state)[0] == 11.0
    assert state.turning == pytest.approx(0.06**2 * 4.0)
    state = plan()
    leg = DoubletLeg(type="doublet", control="rudder", amplitude=0.3, duration_s=2.0, shape="step")
    assert after(leg, state) == pytest.approx((12.0, *way(1200.0, 12.0), 30.0), rel=1e-6)
    assert state.turning == pytest.approx(0.06**2 * 2.0)
    state, circle = plan(), 2.0 * math.pi * 100.0 / (9.81 * 4.5)
    north, east = way(800.0, circle + 8.0)  # the circle does not advance, but drifts
    assert after(LoopLeg(type="loop", load_factor_g=4.5, recovery_s=8.0), state) == pytest.approx(
        (circle + 8.0, north, east, 30.0), rel=1e-6
    )
    assert state.turning == pytest.approx(4.0 * math.pi**2 / circle)
    state = plan()
    leg = BarrelRollLeg(type="barrel_roll", duration_s=6.0, recovery_s=5.0)
    assert after(leg, state) == pytest.approx((11.0, *way(1100.0, 11.0), 30.0), rel=1e-6)
    assert state.turning == pytest.approx(4.0 * math.pi**2 / 6.0)


def test_a_waypoint_straight_ahead() -> None:
    """20 km north with a tailwind of 10 m/s: 500 m before it at 110 m/s; then the place is 500 m short of it."""
    state = plan(wind=(10.0, 0.0), heading=0.0)
    place = {"latitude_deg": math.degrees(20e3 / R), "longitude_deg": math.degrees(0.3)}
    assert after(WaypointLeg(type="waypoint", **place), state) == pytest.approx(
        (19_500.0 / 110.0, 19_500.0, 0.0, 0.0), abs=1e-3
    )
    assert WaypointLeg(type="waypoint", **place).reckon(plan(wind=(-101.0, 0.0), heading=0.0)) == math.inf
    near = plan(heading=0.0)
    leg = WaypointLeg(type="waypoint", capture_radius_m=20_000.0, height_m=700.0, **place)
    near.latitude = 1e3 / R
    assert leg.reckon(near) == 0.0
    assert near.altitude == 700.0


def test_a_waypoint_in_a_climb() -> None:
    """From 0 to 1000 m in 19.5 km: a mean of 105 m/s through the air, to the parabolas' and the steps' hundredth."""
    state = plan(wind=(0.0, 0.0), heading=0.0, trace=[])
    leg = WaypointLeg(
        type="waypoint", latitude_deg=math.degrees(20e3 / R), longitude_deg=math.degrees(0.3), height_m=1000.0
    )  # fmt: skip
    assert leg.reckon(state) == pytest.approx(100.0 * 19.5 * math.log(1.1) / 1.0, rel=2e-3)  # ∫dx/V = L ln(1.1)/10
    assert state.altitude == 1000.0
    assert state.trace is not None
    heights = [height for _, _, height in state.trace[-21:-1]]
    assert heights == sorted(heights)
    assert heights[10] == pytest.approx(1000.0 * 10.5 / 20.0, abs=8.0)
    assert state.trace[-11][0] * R == pytest.approx(19_500.0 * 10.5 / 20.0, rel=1e-3)


def test_a_waypoint_in_a_climb_of_a_given_speed() -> None:
    """10 m/s at the speed of half the height, 105 m/s; the steps of 975 m are in the middle of the slope."""
    state = plan(wind=(0.0, 0.0), heading=0.0, trace=[])
    leg = WaypointLeg(
        type="waypoint", latitude_deg=math.degrees(20e3 / R), longitude_deg=math.degrees(0.3), height_m=1000.0,
        vertical_speed_mps=10.0,
    )  # fmt: skip
    leg.reckon(state)
    assert state.trace is not None
    heights = [height for _, _, height in state.trace[-21:-1]]
    assert [b - a for a, b in pairwise(heights[4:10])] == pytest.approx([975.0 * 10.0 / 105.0] * 5, rel=1e-6)
    assert heights[-1] == pytest.approx(1000.0)


def test_slopes_at_the_places_of_a_route() -> None:
    """Three legs of 10, 20 and 10 km with 300, 400 and −100 m: the first place is passed at the flatter 0.02."""
    places = [
        {"latitude_deg": math.degrees(r / R), "longitude_deg": 0.0, "height_m": h, "name": name}
        for r, h, name in ((10e3, 800.0, "A"), (30e3, 1200.0, "B"), (40e3, 1100.0, "C"))
    ]
    leg = WaypointLeg(type="waypoint", waypoints=places)
    assert leg.slopes_at(500.0, 0.0, 0.0) == pytest.approx([0.02, 0.0, 0.0], rel=1e-9)
    assert [leg.label(k) for k in range(3)] == ["A", "B", "C"]
    assert leg.end_height(500.0) == 1100.0
    with_angle = WaypointLeg(type="waypoint", waypoints=[places[0], {**places[1], "path_deg": 3.0}, places[2]])
    assert with_angle.slopes_at(500.0, 0.0, 0.0) == [0.0, 0.0, 0.0]
    for radius, slope in ((4990.0, 0.02), (5010.0, 0.0)):  # a way of less than two radii has no slope of its own
        near = WaypointLeg(type="waypoint", waypoints=places, capture_radius_m=radius)
        assert near.slopes_at(500.0, 0.0, 0.0) == pytest.approx([slope, 0.0, 0.0], rel=1e-9)
    unnamed = WaypointLeg(type="waypoint", waypoints=[{k: v for k, v in p.items() if k != "name"} for p in places])
    assert unnamed.label(1) == "waypoint 2"
    assert WaypointLeg(type="waypoint", latitude_deg=1.0, longitude_deg=2.0).label(0) is None


def test_what_is_too_short_for_a_climb_says_how_far_it_would_take() -> None:
    """400 m at 5 m/s and 100 m/s: a slope of 0.05, 8 km and 0.05 · 100²/0.3 = 1.67 km of parabolas."""
    place = {"latitude_deg": 0.1, "longitude_deg": 0.0, "height_m": 900.0}
    by_rate = WaypointLeg(type="waypoint", vertical_speed_mps=5.0, **place)
    assert by_rate.shortage(0, 500.0, 7400.0, 100.0) == (
        "from 500 m to height_m = 900 at vertical_speed_mps = 5 takes 9.7 km; 7.4 km are left"
    )
    by_angle = WaypointLeg(type="waypoint", path_deg=2.0, **place)
    slope = math.tan(math.radians(2.0))
    assert by_angle.shortage(0, 500.0, 7400.0, 100.0) == (
        f"from 500 m to height_m = 900 at path_deg = 2 takes {(400.0 / slope + slope * 1e4 / 0.3) / 1e3:.1f} km; "
        "7.4 km are left"
    )
    assert WaypointLeg(type="waypoint", **place).shortage(0, 500.0, 7400.0, 100.0) == (
        "there is no path from 500 m to height_m = 900 within 7.4 km"
    )


def test_land() -> None:
    """30 km north to a threshold on a runway to the north-east: slow down, then to 300 m beyond it, and brake."""
    state = plan(wind=(0.0, 0.0), heading=0.0, altitude=1000.0)
    leg = LandLeg(
        type="land", latitude_deg=math.degrees(30e3 / R), longitude_deg=math.degrees(0.3), altitude_m=200.0,
        heading_deg=40.0, exit_mps=6.0,
    )  # fmt: skip
    v = 70.0 * KNOT
    slowing = (100.0 - v) / 0.5
    fast = 0.5 * (100.0 + v) * slowing
    seconds = slowing + (30_300.0 - fast) / (v * 1.02) + (v - 6.0) / 2.0
    roll = 300.0 + 0.5 * (v**2 - 36.0) / 2.0
    found = after(leg, state)
    assert found == pytest.approx((seconds, 30e3 + roll * math.cos(math.radians(40.0)),
                                   roll * math.sin(math.radians(40.0)), 40.0), rel=3e-5)  # fmt: skip
    assert (state.altitude, state.airspeed) == (200.0, 6.0)
    assert leg.end_height(400.0) == 200.0
    with pytest.raises(ValueError, match=r"begins at 290 m, and the runway is at altitude_m = 200"):
        leg.end_height(290.0)
