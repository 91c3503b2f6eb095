"""What passes between the autopilot and JSBSim, in its units, and the sentences about starts and failures."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.truth.flight import jsbsim_simulation
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.flight_log import CHANNELS
from sinssim.truth.flight.flight_plan import FlightPlan, Gust
from sinssim.truth.flight.jsbsim_model import Monitor
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import LegError

FOOT = 0.3048


class Node:
    def __init__(self, of: dict[str, float], name: str) -> None:
        self.of, self.name = of, name

    def get_double_value(self) -> float:
        return self.of.get(self.name, 0.0)

    def set_double_value(self, value: float) -> None:
        self.of[self.name] = value


class Model(dict[str, float]):
    """Properties of a model with two engines."""

    def get_property_manager(self) -> Any:
        return self

    get_propulsion = get_property_manager

    def get_num_engines(self) -> int:
        return 2

    def hasNode(self, name: str) -> bool:
        return name in self

    def get_node(self, name: str) -> Node:
        return Node(self, name)

    def run(self) -> None:
        self["ran"] = self.get("ran", 0.0) + 1.0


def flight(start: dict[str, Any] | None = None, **more: Any) -> FlightPlan:
    place = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, **(start or {})}
    leg = {"type": "take_off"} if place["on"] == "runway" else {"type": "hold", "duration_s": 9.0}
    return FlightPlan.model_validate({"aircraft": "737", "start": place, "legs": [leg], **more})


def link(section: FlightPlan, **values: float) -> tuple[Any, Model, Autopilot, AircraftState]:
    model = Model({name.replace("__", "/").replace("_", "-"): value for name, value in values.items()})
    pilot, motion = Autopilot(load_aircraft("737"), INTERVAL), AircraftState()
    return jsbsim_simulation._Link(model, section, pilot, motion, None), model, pilot, motion


def test_what_the_pilot_senses() -> None:
    made, model, pilot, m = link(flight())
    names = [
        "position/ecef-x-ft", "position/ecef-y-ft", "position/ecef-z-ft", "attitude/phi-rad", "attitude/theta-rad",
        "attitude/psi-rad", "velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec", "velocities/vc-fps",
        "velocities/vtrue-fps", "velocities/h-dot-fps", "position/geod-alt-ft", "aero/beta-rad",
    ]  # fmt: skip
    model.update({name: float(k + 1) for k, name in enumerate(names)})
    made.sense()
    assert list(made.poses) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert (m.phi, m.theta, m.psi, m.p, m.q, m.r) == (4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
    assert (m.cas, m.tas, m.climb, m.height) == pytest.approx((10 * FOOT, 11 * FOOT, 12 * FOOT, 13 * FOOT))
    assert m.beta == 14.0
    made.stand()
    assert list(made.poses[6:]) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    slow = ["aero/alpha-rad", "position/lat-geod-rad", "position/long-gc-rad", "flight-path/psi-gt-rad",
            "velocities/vg-fps", "position/h-agl-ft", "gear/wow"]  # fmt: skip
    model.update({name: 0.1 * (k + 1) for k, name in enumerate(slow)})
    model.update({"propulsion/engine[0]/thrust-lbs": 77.0, "propulsion/engine[1]/thrust-lbs": 88.0})
    model.update({"propulsion/engine[0]/set-running": 1.0})
    made.sense_slowly()
    assert (m.alpha, m.latitude, m.longitude, m.track) == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert (m.ground_speed, m.height_above_ground) == pytest.approx((0.5 * FOOT, 0.6 * FOOT))
    assert (m.on_wheels, m.engines_running) == (True, False)  # one of two engines
    assert list(made.channels) == [model.get(name, 0.0) for _, name, _, _ in CHANNELS] + [77.0, 88.0]
    pilot.engines = False
    model["gear/wow"] = 0.0
    made.sense_slowly()
    assert (m.on_wheels, m.engines_running) == (False, True)  # not all of them have stopped
    # beyond 500 m the reactions of the ground are off
    assert "simulation/models/FGGroundReactions/enabled" not in model
    model["position/h-agl-ft"] = 501.0 / FOOT
    made.sense_slowly()
    assert model["simulation/models/FGGroundReactions/enabled"] == 0.0
    model["position/h-agl-ft"] = 499.0 / FOOT
    made.sense_slowly()
    assert model["simulation/models/FGGroundReactions/enabled"] == 1.0


def test_what_the_pilot_commands() -> None:
    gusts = [
        {"start_s": 30.0, "rise_s": 2.0, "steady_s": 3.0, "fall_s": 1.0, "velocity_ned_mps": [1.0, 2.0, -2.0]},
        {"start_s": 10.0, "rise_s": 4.0, "steady_s": 5.0, "fall_s": 6.0, "velocity_ned_mps": [0.0, 3.0, 4.0]},
    ]
    made, model, pilot, m = link(flight(wind={"gusts": gusts}))
    pilot.elevator, pilot.aileron, pilot.rudder, pilot.throttle = 0.1, -0.2, 0.3, 0.4
    made.command()
    assert [model[f"fcs/{name}-cmd-norm"] for name in ("elevator", "aileron", "rudder")] == [0.1, -0.2, 0.3]
    assert [model[f"fcs/throttle-cmd-norm[{k}]"] for k in (0, 1)] == [0.4, 0.4]
    pilot.steer, pilot.brakes, pilot.gear, pilot.flaps = 0.5, 0.6, 0.7, 0.8
    pilot.runway_height, m.height, m.height_above_ground, m.time = 250.0, 9999.0, 9999.0, 9.9
    model["position/geod-alt-ft"], model["position/h-agl-ft"] = (
        600.0 / FOOT,
        400.0 / FOOT,
    )
    model["position/terrain-elevation-asl-ft"] = 200.0 / FOOT
    made.command_slowly()
    assert [model[f"fcs/{side}-brake-cmd-norm"] for side in ("left", "right", "center")] == [0.6, 0.6, 0.6]
    assert (model["fcs/steer-cmd-norm"], model["gear/gear-cmd-norm"], model["fcs/flap-cmd-norm"]) == (0.5, 0.7, 0.8)
    assert model["position/terrain-elevation-asl-ft"] == pytest.approx(250.0 / FOOT)
    assert "atmosphere/cosine-gust/start" not in model
    m.time = 10.0
    made.command_slowly()
    gust = {name: model[f"atmosphere/cosine-gust/{name}"] for name in (
        "startup-duration-sec", "steady-duration-sec", "end-duration-sec", "frame", "start", "magnitude-ft_sec",
        "X-velocity-ft_sec", "Y-velocity-ft_sec", "Z-velocity-ft_sec",
    )}  # fmt: skip
    assert gust == {
        "startup-duration-sec": 4.0, "steady-duration-sec": 5.0, "end-duration-sec": 6.0, "frame": 3, "start": 1,
        "magnitude-ft_sec": pytest.approx(5.0 / FOOT), "X-velocity-ft_sec": 0.0,
        "Y-velocity-ft_sec": pytest.approx(3.0 / FOOT), "Z-velocity-ft_sec": pytest.approx(4.0 / FOOT),
    }  # fmt: skip
    jsbsim_simulation._blow(model, Gust.model_validate(gusts[0]))
    assert model["atmosphere/cosine-gust/Z-velocity-ft_sec"] == pytest.approx(-2.0 / FOOT)


def test_a_wind_that_changes_with_height_is_set_before_each_step() -> None:
    """Half-way between 1000 and 2000 m, of (2, 4) and (6, −8) m/s."""
    profile = [
        {"height_m": 1000.0, "from_deg": 0.0, "speed_mps": 2.0},
        {"height_m": 2000.0, "from_deg": 90.0, "speed_mps": 8.0},
    ]
    made, model, _, _ = link(flight(wind={"profile": profile, "down_mps": 0.5}))
    model["position/geod-alt-ft"] = 1500.0 / FOOT
    made.steps()()
    wind = [FOOT * model[f"atmosphere/wind-{axis}-fps"] for axis in ("north", "east", "down")]
    assert wind == pytest.approx([-1.0, -4.0, 0.5])
    assert model["ran"] == 1.0
    steady, still, _, _ = link(flight(wind={"north_mps": 3.0}))
    steady.steps()()
    assert "atmosphere/wind-north-fps" not in still


def test_turbulence_and_progress() -> None:
    model: Any = {}
    turbulence = flight(turbulence={"severity": 3, "wind_at_6m_mps": 12.0}).turbulence
    assert turbulence is not None
    jsbsim_simulation._stir(model, turbulence)
    assert model == {
        "atmosphere/turb-type": 4, "atmosphere/turbulence/milspec/severity": 3,
        "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps": pytest.approx(12.0 / FOOT),
    }  # fmt: skip
    legs = [{"type": "hold", "duration_s": 9.0}] * 3
    three = FlightPlan.model_validate({**flight().model_dump(exclude_none=True), "legs": legs})
    assert jsbsim_simulation._fraction(three, 3, 500.0) == pytest.approx(2.0 / 3.0)
    until = three.model_validate(
        {**three.model_dump(exclude_none=True), "legs": [*legs, {"type": "hold", "until_s": 400.0}]}
    )
    assert jsbsim_simulation._fraction(until, 2, 100.0) == 0.25
    assert jsbsim_simulation._fraction(until, 2, 500.0) == 1.0


def test_a_start_in_words_and_what_to_change() -> None:
    assert jsbsim_simulation._start_words(flight({"airspeed_kt": 250.0, "heading_deg": 30.0})) == (
        "in the air, latitude_deg = 48, longitude_deg = 11, altitude_m = 3000, heading_deg = 30, airspeed_kt = 250"
    )
    remedy = jsbsim_simulation._start_remedy
    assert remedy(flight({"altitude_m": 4.9})) == (
        "The ground below a start in the air is at a height of 0 m: give a greater altitude_m."
    )
    assert remedy(flight({"altitude_m": 5.1})) == "Give an airspeed and a height at which it can fly."
    runway = {"on": "runway", "altitude_m": 300.0}
    assert remedy(flight(runway)) == "Choose another aircraft, or start in the air."
    assert remedy(flight(runway, wind={"north_mps": -0.001, "east_mps": 12.346})) == (
        "The likely cause is the wind of 0 m/s towards north and 12.35 m/s towards east, which may be too strong for "
        "the 737 on the ground. Give a weaker wind, or start in the air."
    )


def test_a_failure_says_when_where_and_how_the_aircraft_was(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(self: Monitor, leg: Any, pilot: Autopilot, state: AircraftState) -> None:
        state.time, state.height, state.height_above_ground, state.cas = 12.34, 1234.4, 987.6, 100.0
        state.alpha, state.phi, state.theta, state.psi = (math.radians(x) for x in (1.21, -2.54, 3.81, 200.21))
        raise LegError("it was told to", "another order")

    watch: Callable[..., None] = refuses
    monkeypatch.setattr(Monitor, "watch", watch)
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 1000.0}
    section = FlightPlan.model_validate(
        {"aircraft": "c172x", "start": start, "legs": [{"type": "hold", "duration_s": 9.0}]}
    )
    with pytest.raises(InputError) as error:
        fly_plan(section)
    assert str(error.value) == (
        "leg 1 (hold) failed at 12.3 s of the flight: it was told to. The c172x was at a height of 1234 m (988 m above "
        "ground), 194 kt calibrated, angle of attack 1.2°, roll -2.5°, pitch 3.8°, heading 200.2°. Use another order."
    )
