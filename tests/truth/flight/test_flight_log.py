"""A flight's log in SI units, and its start and engines in JSBSim's properties, worked out by hand."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.truth.atmosphere import Air
from sinssim.truth.flight import jsbsim_model
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import CHANNELS, FlightRecord, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import Engines
from sinssim.truth.sampling import FlightEvent

FOOT, POUND = 0.3048, 4.4482216152605
A_FT = 6378137.0 / FOOT

# name of the channel, JSBSim's property, metres or so in its unit, unit of the channel
WANTED = [
    ("airspeed_mps", "velocities/vtrue-fps", FOOT, "m/s"),
    ("calibrated_airspeed_mps", "velocities/vc-fps", FOOT, "m/s"),
    ("alpha_rad", "aero/alpha-rad", 1.0, "rad"), ("beta_rad", "aero/beta-rad", 1.0, "rad"),
    ("load_factor", "accelerations/Nz", 1.0, "g"), ("vertical_speed_mps", "velocities/h-dot-fps", FOOT, "m/s"),
    ("height_above_ground_m", "position/h-agl-ft", FOOT, "m"), ("elevator_rad", "fcs/elevator-pos-rad", 1.0, "rad"),
    ("aileron_rad", "fcs/left-aileron-pos-rad", 1.0, "rad"), ("rudder_rad", "fcs/rudder-pos-rad", 1.0, "rad"),
    ("throttle", "fcs/throttle-cmd-norm", 1.0, ""),
    ("wind_north_mps", "atmosphere/total-wind-north-fps", FOOT, "m/s"),
    ("wind_east_mps", "atmosphere/total-wind-east-fps", FOOT, "m/s"),
    ("wind_down_mps", "atmosphere/total-wind-down-fps", FOOT, "m/s"),
]  # fmt: skip


def test_a_log_in_si_units() -> None:
    """Four knots at 30 Hz on the equator, heading east, rolling over on the back; two rows at 10 Hz, two engines."""
    poses = [
        [A_FT, 0.0, 0.0, 0.0, 0.0, 0.5 * math.pi], [A_FT, 30.0, 0.0, math.pi - 0.01, 0.0, 0.5 * math.pi],
        [A_FT, 60.0, 0.0, -math.pi + 0.01, 0.0, 0.5 * math.pi], [A_FT, 90.0, 0.0, math.pi - 0.02, 0.0, 0.5 * math.pi],
    ]  # fmt: skip
    rows = [[float(k + 1) for k in range(16)], [100.0 + 2.0 * k for k in range(16)]]
    events = (FlightEvent(0.05, "something"),)
    log = flight_log(FlightRecord(array("d", np.ravel(poses)), array("d", np.ravel(rows)), events))
    assert log.time == pytest.approx([0.0, 1.0 / 30.0, 2.0 / 30.0, 0.1])
    np.testing.assert_allclose(log.position_ecef, [[6378137.0, 0.3048 * 30.0 * k, 0.0] for k in range(4)], rtol=1e-15)
    assert log.events == events
    assert log.derivatives is None
    # heading east: forward is y, right is −z, down is −x of the Earth's axes
    east = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    for k, roll in enumerate((0.0, math.pi - 0.01, -math.pi + 0.01, math.pi - 0.02)):
        expected = Rotation.from_matrix(east) * Rotation.from_euler("X", roll)
        off = (expected.inv() * Rotation.from_quat(log.q_eb[k], scalar_first=True)).magnitude()
        assert off < 1e-5  # 27 m farther east, the local level has turned by 4e-6
    assert np.sum(log.q_eb[2:] * log.q_eb[1:-1], axis=1).min() > 0.99  # no jump of sign
    assert list(log.channels) == [*(name for name, *_ in WANTED), "thrust_n"]
    for column, (name, _, factor, unit) in enumerate(WANTED):
        channel = log.channels[name]
        assert channel.values == pytest.approx([factor * (column + 1), factor * (100.0 + 2.0 * column)])
        assert channel.unit == unit
        assert channel.time == pytest.approx([0.0, 0.1])
    thrust = log.channels["thrust_n"]
    assert thrust.values == pytest.approx([POUND * (15.0 + 16.0), POUND * (128.0 + 130.0)])
    assert thrust.unit == "N"
    assert [tuple(row) for row in CHANNELS] == WANTED


class Node:
    def __init__(self, of: dict[str, float], name: str) -> None:
        self.of, self.name = of, name

    def get_double_value(self) -> float:
        return self.of[self.name]


class Executive(dict[str, Any]):
    """Properties that are only stored, and written down at each `run_ic`."""

    def __init__(self, engines: int = 2, **values: float) -> None:
        super().__init__(values)
        self.count, self.began, self.ran = engines, [], 0

    def run_ic(self) -> None:
        self.began.append(dict(self))

    def run(self) -> None:
        self.ran += 1

    def get_property_manager(self) -> Any:
        return self

    def get_propulsion(self) -> Any:
        return self

    def get_num_engines(self) -> int:
        return self.count

    def hasNode(self, name: str) -> bool:
        return name in self

    def get_node(self, name: str) -> Node:
        return Node(self, name)


def test_switches_of_the_engines() -> None:
    """The fuel is opened when every shaft has 15 % of N2; the starter stays on until all run."""
    state = {f"propulsion/engine[{k}]/{name}": 0.0 for k in (0, 1) for name in ("set-running", "n2")}
    e = Executive(**state, **{"fcs/mixture-cmd-norm": 0.8})
    engines = Engines(e)
    assert (engines.running, engines.stopped) == (False, True)
    engines.switch(True)
    names = [f"propulsion/{name}" for name in ("active_engine", "starter_cmd", "magneto_cmd", "cutoff_cmd")]
    assert [e[name] for name in names] == [-1, 1.0, 3, 1.0]
    assert e["fcs/mixture-cmd-norm"] == 0.8
    e["propulsion/engine[0]/n2"] = 20.0
    engines.switch(True)
    assert e["propulsion/cutoff_cmd"] == 1.0
    e["propulsion/engine[1]/n2"] = 15.0
    engines.switch(True)
    assert e["propulsion/cutoff_cmd"] == 0.0
    e["propulsion/engine[0]/set-running"] = 1.0
    assert (engines.running, engines.stopped) == (False, False)
    e["propulsion/engine[1]/set-running"] = 1.0
    engines.switch(True)
    assert (engines.running, e["propulsion/starter_cmd"]) == (True, 0.0)
    engines.switch(False)
    assert [e[name] for name in names] == [-1, 0, 0, 1]
    assert e["fcs/mixture-cmd-norm"] == 0.0
    assert not Engines(Executive(0)).running


def test_atmosphere_and_wind_in_jsbsims_units() -> None:
    e = Executive()
    jsbsim_model._set_atmosphere(e, Air(isa_deviation=15.0, sea_level_pressure=100_000.0))
    assert e["atmosphere/delta-T"] == pytest.approx(27.0)  # degrees Rankine
    assert e["atmosphere/P-sl-psf"] == pytest.approx(2088.543, abs=1e-3)  # of 2116.217 at 1013.25 hPa
    jsbsim_model._set_wind(e, (3.0, -4.0, 1.0))
    assert e["ic/vw-mag-fps"] == pytest.approx(5.0 / FOOT)
    assert e["ic/vw-dir-deg"] == pytest.approx(360.0 - math.degrees(math.atan2(4.0, 3.0)))
    jsbsim_model.best_attitude_integrators(e)
    names = [f"simulation/integrator/{what}/rotational" for what in ("rate", "position")]
    assert [e[name] for name in names] == [5, 6]
    jsbsim_model.default_attitude_integrators(e)
    assert [e[name] for name in names] == [1, 1]


def test_the_trim_is_widened_to_the_stall() -> None:
    e = Executive(**{"aero/alpha-max-rad": 0.0, "aero/alpha-min-rad": 0.0})
    assert jsbsim_model.widen_trim(e, 14.0)
    assert [math.degrees(e[f"aero/alpha-{end}-rad"]) for end in ("min", "max")] == pytest.approx([-5.0, 14.0])
    assert not jsbsim_model.widen_trim(e, 20.0)
    assert math.degrees(e["aero/alpha-max-rad"]) == pytest.approx(14.0)


def flight(**start: Any) -> FlightPlan:
    place = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 200.0, "altitude_m": 3048.0, "heading_deg": -30.0}
    leg = {"type": "take_off"} if start.get("on") == "runway" else {"type": "hold", "duration_s": 9.0}
    return FlightPlan.model_validate({
        "aircraft": "737", "start": {**place, **start}, "legs": [leg],
        "wind": {"north_mps": 3.0, "east_mps": -4.0, "down_mps": 0.5},
    })  # fmt: skip


def test_a_start_in_the_air() -> None:
    """Trimmed in calm air at the ellipsoid's height, then put into the wind with its attitude and commands."""
    known = {
        "position/geod-alt-ft": 10_002.0, "attitude/phi-rad": 0.01, "attitude/theta-rad": 0.05, "attitude/psi-rad": 5.7,
        "velocities/v-north-fps": 400.0, "velocities/v-east-fps": -200.0, "velocities/v-down-fps": 1.0,
        "fcs/elevator-cmd-norm": -0.1, "fcs/throttle-cmd-norm[0]": 0.6,
    }  # fmt: skip
    e = Executive(**known)
    jsbsim_model.bring_to_start(e, flight(airspeed_kt=250.0), load_aircraft("737"), 2**31 + 17)
    calm, level, windy = e.began
    assert calm["ic/lat-geod-deg"] == 48.0
    assert calm["ic/long-gc-deg"] == pytest.approx(-160.0)
    assert calm["ic/psi-true-deg"] == 330.0
    assert calm["simulation/randomseed"] == 17
    assert calm["gear/gear-cmd-norm"] == calm["gear/gear-pos-norm"] == 0.0
    assert (calm["ic/vc-kts"], calm["ic/gamma-deg"]) == (250.0, 0.0)
    assert calm["ic/h-sl-ft"] == pytest.approx(10_000.0)
    assert level["ic/h-sl-ft"] == pytest.approx(9_998.0)  # the ellipsoid is 2 ft above JSBSim's sea level
    assert e["simulation/do_simple_trim"] == 1
    assert windy["ic/vw-mag-fps"] == pytest.approx(5.0 / FOOT)
    assert [windy[f"ic/{name}-rad"] for name in ("phi", "theta", "psi-true")] == [0.01, 0.05, 5.7]
    assert [windy[f"ic/v{axis}-fps"] for axis in "ned"] == pytest.approx(
        [400.0 + 3.0 / FOOT, -200.0 - 4.0 / FOOT, 1.0 + 0.5 / FOOT]
    )
    assert e["atmosphere/wind-down-fps"] == pytest.approx(0.5 / FOOT)
    assert (e["fcs/elevator-cmd-norm"], e["fcs/throttle-cmd-norm[0]"]) == (-0.1, 0.6)
    assert "fcs/rudder-cmd-norm" not in e
    usual = Executive(**known)
    jsbsim_model.bring_to_start(usual, flight(), load_aircraft("737"), 1)
    assert usual.began[0]["ic/vc-kts"] == load_aircraft("737").performance.cruise_kt


@pytest.mark.parametrize("engines", ["running", "off"])
def test_a_start_on_the_runway(engines: str) -> None:
    """30 s at 120 Hz with the brakes set."""
    e = Executive()
    jsbsim_model.bring_to_start(e, flight(on="runway", altitude_m=304.8, engines=engines), load_aircraft("737"), 3)
    (begun,) = e.began
    assert begun["ic/terrain-elevation-ft"] == pytest.approx(1000.0)
    assert begun["ic/h-agl-ft"] == 6.0
    assert begun["ic/vw-mag-fps"] == pytest.approx(5.0 / FOOT)
    assert begun["gear/gear-cmd-norm"] == 1.0
    assert [e[f"fcs/{side}-brake-cmd-norm"] for side in ("left", "right", "center")] == [1.0, 1.0, 1.0]
    assert e["simulation/do_simple_trim"] == 2
    assert e.ran == 3600
    assert ("propulsion/set-running" in e) == (engines == "running")
