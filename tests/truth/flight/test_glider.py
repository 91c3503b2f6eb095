"""Gliders: the balance of forces in their trim, the energy of their flights, their plans by dead reckoning."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.scenario.planned_limits import findings
from sinssim.system.files import Draft
from sinssim.truth.aircraft_design.acceptance_flight import acceptance_plans
from sinssim.truth.aircraft_design.model_survey import find_model, survey
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan, planned_path
from sinssim.truth.flight.jsbsim_model import loaded_model, quiet, trim_glide
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import not_attained

NAME, FOOT, KNOT, G = "sgs233", 0.3048, 1852.0 / 3600.0, 9.80665


def plan(*legs: dict[str, Any], **extra: Any) -> FlightPlan:
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 1500.0, "airspeed_kt": 58.0}
    return FlightPlan.model_validate({"aircraft": NAME, "start": start, "legs": list(legs), **extra})


def test_lift_and_drag_of_the_trim_balance_the_weight() -> None:
    """In a steady glide at γ, L = W cos γ and D = −W sin γ, with the lift and drag that JSBSim computes."""
    with quiet(), Draft() as folder:
        executive = loaded_model(NAME, load_aircraft(NAME), str(folder.path))
        executive["ic/lat-geod-deg"] = 45.0  # where gravity is g
        executive["ic/h-sl-ft"], executive["ic/vc-kts"] = 1500.0 / FOOT, 58.0
        assert trim_glide(executive, 10.8)
        gamma, weight = math.radians(executive["ic/gamma-deg"]), executive["inertia/weight-lbs"]
        assert executive["forces/fwz-aero-lbs"] == pytest.approx(weight * math.cos(gamma), rel=1e-3)
        assert executive["forces/fwx-aero-lbs"] == pytest.approx(-weight * math.sin(gamma), rel=5e-3)
        assert executive["velocities/vc-kts"] == pytest.approx(58.0, abs=1e-6)
        executive["ic/vc-kts"] = 25.0  # √(2 W/(ρ S C)) with its greatest coefficient is 31 kt
        assert not trim_glide(executive, 10.8)


def flown(*legs: dict[str, Any], **extra: Any) -> FlightLog:
    log = flight_log(fly_plan(plan(*legs, **extra)))
    assert not_attained(log.events) == []
    return log


def height(log: FlightLog) -> Any:
    from sinssim.earth.geodetic_coordinates import ecef_to_geodetic

    return ecef_to_geodetic(log.position_ecef)[2]


def test_a_glider_holds_its_airspeed_and_sinks_as_its_trim_says() -> None:
    log = flown({"type": "hold", "duration_s": 60.0})
    speed = log.channels["calibrated_airspeed_mps"].values
    assert np.abs(speed - 58.0 * KNOT).max() < 0.05
    envelope = load_aircraft(NAME).envelope
    assert envelope is not None
    sinks = [np.interp(58.0, envelope.airspeed_kt, row) for row in envelope.descent_mps]
    at = height(log)
    assert at[0] - at[-1] == pytest.approx(60.0 * np.interp(1420.0, envelope.height_m, sinks), rel=0.02)
    assert not log.channels["throttle"].values.any()


def test_speed_comes_from_height() -> None:
    """ΔE = Δh + Δ(V²)/2g is what the drag takes: the integral of the polar's sink, by trims, over the airspeeds."""
    log = flown({"type": "speed", "airspeed_kt": 75.0}, {"type": "speed", "airspeed_kt": 58.0})
    tas, cas = (log.channels[f"{name}airspeed_mps"].values for name in ("", "calibrated_"))
    time = log.channels["airspeed_mps"].time
    energy = np.interp(time, log.time, height(log)) + tas**2 / (2.0 * G)
    envelope = load_aircraft(NAME).envelope
    assert envelope is not None
    low, high, _ = np.array(envelope.descent_mps)
    sink = np.interp(cas / KNOT, envelope.airspeed_kt, low + 1440.0 / 1500.0 * (high - low))
    lost = np.concatenate([[0.0], np.cumsum(0.5 * (sink[1:] + sink[:-1]) * np.diff(time))])
    fastest = int(np.argmax(cas))
    assert energy[0] - energy[fastest] == pytest.approx(lost[fastest], rel=0.02)
    assert energy[0] - energy[-1] == pytest.approx(lost[-1], rel=0.02)
    gained = (tas[fastest] ** 2 - tas[0] ** 2) / (2.0 * G)
    assert gained > 30.0  # m, which are fifteen times the tolerance


def test_a_plan_sinks_and_what_needs_an_engine_is_refused() -> None:
    sink = load_aircraft(NAME).performance.descent_mps
    one = plan({"type": "hold", "duration_s": 100.0}, {"type": "turn", "angle_deg": 360.0, "direction": "left"})
    (_, hold, _), (_, turn, end) = list(one.reckoned())
    assert end.altitude == pytest.approx(1500.0 - sink * (hold + turn))
    assert planned_path(one).height[-1] == end.altitude
    assert planned_path(one).ceiling == []
    place = {"type": "waypoint", "latitude_deg": 48.05, "longitude_deg": 11.0}
    ((_, seconds, end),) = plan(place).reckoned()
    assert end.altitude == pytest.approx(1500.0 - sink * seconds)
    flight = plan({**place, "height_m": 1200.0})
    (finding,) = findings(SimpleNamespace(flight=flight))  # type: ignore[arg-type]
    assert (finding.refused, "is a glider, whose height is not chosen" in finding.text) == (True, True)
    *_, (_, _, end) = plan({"type": "descend", "altitude_m": 1200.0}).reckoned()
    assert end.altitude == 1200.0
    with pytest.raises(InputError, match=r"flight\.legs\.1 \(climb\): the aircraft sgs233 is a glider, which only"):
        list(plan({"type": "climb", "altitude_m": 1800.0}).reckoned())
    start = {"on": "runway", "latitude_deg": 48.0, "longitude_deg": 11.0}
    with pytest.raises(InputError, match=r"flight\.legs\.1 \(take_off\): the aircraft sgs233 does not take off"):
        list(plan({"type": "take_off", "height_m": 300.0}, start=start).reckoned())


def test_the_acceptance_flight_of_a_glider_begins_with_a_descent() -> None:
    performance = load_aircraft(NAME).performance
    (plain, names), _ = acceptance_plans(NAME, performance, 3000.0)
    assert names[1::2] == ["descent", "turn right", "turn left", "slower", "faster"]
    assert plain.legs[1].altitude_m == pytest.approx(3000.0 - 100.0 * performance.descent_mps)  # type: ignore[attr-defined]
    assert survey(find_model(NAME)).engines == ()
