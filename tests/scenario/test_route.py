"""A plan that leads too near to the pole of its route is refused before it is flown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.scenario.planned_limits import check_route, check_route_flown
from sinssim.scenario.schema import Scenario
from sinssim.truth.motions.parked_and_great_circle import GreatCircle

ROUTE = [0.0, 90.0, -50.0, 0.0]  # along a great circle with its poles at 40° N, 0° and 40° S, 180°
METRE = np.degrees(1.0 / 6371e3)  # of latitude, degrees


def planned(route: list[float] | None = ROUTE, rate_hz: float = 100.0, **source: Any) -> Scenario:
    navigation = {"frame": "transverse", **({"route_deg": route} if route else {})}
    return Scenario.model_validate({"name": "n", "imu": {"rate_hz": rate_hz}, "navigation": navigation, **source})


def passing(metres: float, latitude: float = 40.0, longitude: float = 0.0, **more: Any) -> dict[str, Any]:
    """Northwards at 200 m/s past a place, so many metres to the east of it, after 250 s."""
    beside = longitude + metres * METRE / np.cos(np.radians(latitude))
    start = {"latitude_deg": latitude - 50e3 * METRE, "longitude_deg": beside, "course_deg": 0.0}
    return {"great_circle": {**start, "speed_mps": 200.0, "duration_s": 500.0, **more}}


@pytest.mark.parametrize("pole", [(40.0, 0.0), (-40.0, 180.0)])
def test_a_great_circle(pole: tuple[float, float]) -> None:
    """The limit is 0.005 rad in a step of 10 ms: 400 m at 200 m/s."""
    place = rf"pole at {pole[0]:.4f}°, -?{pole[1]:.4f}°"
    with pytest.raises(InputError, match=rf"navigation\.route_deg: .*within 400 m.*{place}.* 39\d\.?\d* m .*t = 250 s"):
        check_route(planned(**passing(395.0, *pole)))
    check_route(planned(**passing(405.0, *pole)))
    with pytest.raises(InputError, match="within 800 m"):
        check_route(planned(rate_hz=50.0, **passing(405.0, *pole)))
    check_route(planned(**passing(0.0, *pole, duration_s=247.0)))  # it ends 600 m before
    with pytest.raises(InputError, match="t = 249 s"):
        check_route(planned(**passing(0.0, *pole, duration_s=249.0)))
    check_route(planned(route=[40.0, 0.0, 41.0, 0.0], **passing(0.0, *pole)))
    check_route(planned(route=None, **passing(0.0, *pole)))


def test_a_vehicle_at_rest() -> None:
    with pytest.raises(InputError, match=r"within 0\.001 m .*: the vehicle is .* m from there all the time"):
        check_route(planned(parked={"latitude_deg": 40.0, "duration_s": 10.0}))
    check_route(planned(parked={"latitude_deg": 40.0 + 0.01 * METRE, "duration_s": 10.0}))


def test_a_flights_start_and_waypoints() -> None:
    def flight(latitude: float, leg: dict[str, Any]) -> dict[str, Any]:
        start = {"on": "air", "latitude_deg": latitude, "longitude_deg": 0.0, "altitude_m": 0.0, "airspeed_kt": 240.0}
        return {"flight": {"aircraft": "737", "start": start, "legs": [leg]}}

    hold = {"type": "hold", "duration_s": 10.0}
    with pytest.raises(InputError, match="at the start"):
        check_route(planned(**flight(40.0 + 200.0 * METRE, hold)))
    check_route(planned(**flight(40.0 + 300.0 * METRE, hold)))
    # 123.5 m/s through the air are 73.5 m/s against the wind at the least: 147 m instead of 247 m
    windy = flight(40.0 + 200.0 * METRE, hold)
    windy["flight"]["wind"] = {"from_deg": 270.0, "speed_mps": 50.0}
    check_route(planned(**windy))
    windy["flight"]["start"]["latitude_deg"] = 40.0 + 140.0 * METRE
    with pytest.raises(InputError, match=r"with 73\.4\d? m/s .* at the start"):
        check_route(planned(**windy))
    there = {"type": "waypoint", "latitude_deg": 40.0, "longitude_deg": 0.0, "capture_radius_m": 200.0}
    with pytest.raises(InputError, match=r"200 m from there or less at the end of leg 1, a waypoint"):
        check_route(planned(**flight(39.5, there)))
    windy = flight(39.5, there)
    windy["flight"]["wind"] = {"from_deg": 270.0, "speed_mps": 50.0}
    check_route(planned(**windy))  # 147 m at 73.5 m/s
    check_route(planned(**flight(39.5, {**there, "capture_radius_m": 500.0})))  # it may or may not come near


def test_a_motion_that_is_known() -> None:
    """As a flight is once it has been flown; its time is that of the first sample within the limit."""
    start = 40.0 - 50e3 * METRE
    circle = GreatCircle(np.radians(start), 0.0, 0.0, 0.0, 200.0, 500.0)
    time = np.arange(0.0, 500.0, 0.01)
    with pytest.raises(
        InputError, match=r"navigation\.route_deg: .*: the vehicle is (400|39\d.*) m from there at t = 24\d\.\d+ s"
    ):
        check_route_flown(planned(**passing(0.0)), time, circle.state(time))
    check_route_flown(planned(route=[40.0, 0.0, 41.0, 0.0], **passing(0.0)), time, circle.state(time))
    check_route_flown(planned(route=None, **passing(0.0)), time, circle.state(time))
