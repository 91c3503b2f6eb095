"""Flights against JSBSim's own properties and against the physics of flight."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sinssim.errors import InputError
from sinssim.truth.flight import jsbsim_simulation
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import check_fuel
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from tests.cli.test_cli import call

Array = NDArray[np.float64]

G = 9.80665
DEG = np.pi / 180.0
KNOT = 0.514444
A, F = 6378137.0, 1.0 / 298.257223563
HEIGHT = {"737": 6000.0, "f16": 5000.0, "c172x": 1500.0}


def plan(aircraft: str, *legs: dict[str, Any], **extra: Any) -> FlightPlan:
    start = {
        "on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": HEIGHT.get(aircraft, 6000.0),
        "heading_deg": 30.0,
    }  # fmt: skip
    return FlightPlan.model_validate({"aircraft": aircraft, "start": start, "legs": list(legs), **extra})


@dataclass
class Flown:
    """A flight, and JSBSim's own account of it at every knot, written down beside the log."""

    log: FlightLog
    ecef_to_body: Array  # JSBSim's direction cosines
    geodetic: Array  # latitude, longitude, height
    euler: Array
    velocity: Array  # north, east, down

    @property
    def height(self) -> Array:
        return self.geodetic[:, 2]

    @property
    def heading(self) -> Array:
        return np.unwrap(self.euler[:, 2])

    def leg(self, number: int) -> slice:
        times = [e.time for e in self.log.events if e.text.startswith(f"leg {number} ")]
        return slice(round(times[0] * 30), round(times[1] * 30) + 1)

    def channel(self, name: str, part: slice) -> Array:
        channel = self.log.channels[name]
        time = self.log.time[part]
        values: Array = channel.values[(channel.time >= time[0]) & (channel.time <= time[-1])]
        return values


def fly(flight: FlightPlan, seed: int = 0) -> Flown:
    dcm, geodetic, euler, velocity = [], [], [], []
    plain, stand = jsbsim_simulation._Link.sense, jsbsim_simulation._Link.stand
    accounts = (dcm, geodetic, euler, velocity)

    def sense(link: Any) -> None:
        plain(link)
        e = link._executive
        dcm.append(np.array(e.get_propagate().get_Tec2b()))
        geodetic.append([e["position/lat-geod-rad"], e["position/long-gc-rad"], e["position/geod-alt-ft"] * 0.3048])
        euler.append([e["attitude/phi-rad"], e["attitude/theta-rad"], e["attitude/psi-rad"]])
        velocity.append([e[f"velocities/v-{axis}-fps"] * 0.3048 for axis in ("north", "east", "down")])

    def repeat(link: Any) -> None:
        stand(link)
        for account in accounts:
            account.append(account[-1])

    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # JSBSim makes a numpy.matrix
        patch.setattr(jsbsim_simulation._Link, "sense", sense)
        patch.setattr(jsbsim_simulation._Link, "stand", repeat)
        log = flight_log(fly_plan(flight, seed))
    return Flown(log, np.array(dcm), np.array(geodetic), np.array(euler), np.array(velocity))


def rotation_matrix(q: Array) -> Array:
    """Direction cosines by the textbook formula, element by element."""
    w, x, y, z = q.T
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    ).transpose(2, 0, 1)


def vertical(latitude: Array, longitude: Array) -> Array:
    """Down axis in ECEF."""
    return -np.column_stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)]
    )


@pytest.fixture(scope="module")
def airliner() -> Flown:
    return fly(
        plan(
            "737",
            {"type": "hold", "duration_s": 20.0},
            {"type": "climb", "altitude_m": 6100.0},
            {"type": "turn", "heading_deg": 120.0, "bank_deg": 25.0},
            {"type": "s_turns", "swing_deg": 15.0, "bank_deg": 20.0, "turns": 2},
            {"type": "speed", "airspeed_kt": 270.0},
            {"type": "descend", "altitude_m": 6050.0},
            {"type": "doublet", "control": "rudder", "amplitude": 0.3, "duration_s": 1.0, "recovery_s": 20.0},
            {"type": "racetrack", "leg_duration_s": 10.0, "bank_deg": 30.0, "direction": "left"},
            {"type": "waypoint", "latitude_deg": 48.0, "longitude_deg": 11.2, "capture_radius_m": 300.0},
            {"type": "hold", "until_s": 900.0},
        )
    )


@pytest.fixture(scope="module")
def fighter() -> Flown:
    return fly(
        plan(
            "f16",
            {"type": "turn", "angle_deg": 120.0, "direction": "left", "bank_deg": 70.0},
            {"type": "speed", "airspeed_kt": 420.0},
            {"type": "loop", "load_factor_g": 4.5, "recovery_s": 10.0},
            {"type": "barrel_roll", "direction": "left", "duration_s": 7.0, "recovery_s": 10.0},
        )
    )


@pytest.fixture(scope="module")
def trainer() -> Flown:
    return fly(
        FlightPlan.model_validate(
            {
                "aircraft": "c172x",
                "start": {
                    "on": "runway",
                    "latitude_deg": -33.9,
                    "longitude_deg": 151.2,
                    "altitude_m": 120.0,
                    "heading_deg": 340.0,
                },
                "wind": {"north_mps": 4.0, "east_mps": 1.0},
                "legs": [
                    {"type": "parked", "duration_s": 10.0},
                    {"type": "takeoff", "height_m": 150.0},
                    {"type": "speed", "airspeed_kt": 95.0},
                    {"type": "turn", "heading_deg": 60.0, "bank_deg": 20.0},
                    {"type": "hold", "duration_s": 15.0},
                ],
            }
        )
    )


@pytest.fixture(scope="module", params=["airliner", "fighter", "trainer"])
def any_flight(request: pytest.FixtureRequest) -> Flown:
    flown: Flown = request.getfixturevalue(request.param)
    return flown


def test_attitude_is_jsbsims(any_flight: Flown) -> None:
    c_eb = rotation_matrix(any_flight.log.q_eb)
    theirs = any_flight.ecef_to_body.transpose(0, 2, 1)
    # JSBSim's own matrix is a rotation to 4e-10 only: the nearest rotation to it, to first order in that.
    theirs = 1.5 * theirs - 0.5 * theirs @ theirs.transpose(0, 2, 1) @ theirs
    assert np.abs(c_eb - theirs).max() < 5e-11
    assert np.abs(np.linalg.norm(any_flight.log.q_eb, axis=1) - 1.0).max() < 1e-14


def test_attitude_quaternion_does_not_jump(any_flight: Flown) -> None:
    q = any_flight.log.q_eb
    assert np.sum(q[1:] * q[:-1], axis=1).min() > 0.99


def test_position_is_at_jsbsims_geodetic_coordinates(airliner: Flown) -> None:
    latitude, longitude, height = airliner.geodetic.T
    prime = A / np.sqrt(1.0 - F * (2.0 - F) * np.sin(latitude) ** 2)
    expected = np.column_stack(
        [
            (prime + height) * np.cos(latitude) * np.cos(longitude),
            (prime + height) * np.cos(latitude) * np.sin(longitude),
            (prime * (1.0 - F) ** 2 + height) * np.sin(latitude),
        ]
    )
    assert np.abs(airliner.log.position_ecef - expected).max() < 1e-4


def test_position_moves_at_jsbsims_velocity(airliner: Flown) -> None:
    r = airliner.log.position_ecef
    # Fourth-order central difference at 30 Hz.
    velocity = (8.0 * (r[3:-1] - r[1:-3]) - (r[4:] - r[:-4])) * (30.0 / 12.0)
    latitude, longitude, _ = airliner.geodetic[2:-2].T
    down = vertical(latitude, longitude)
    east = np.column_stack([-np.sin(longitude), np.cos(longitude), np.zeros_like(longitude)])
    north = np.cross(east, down)
    ned = np.column_stack([np.sum(velocity * axis, axis=1) for axis in (north, east, down)])
    # JSBSim steps position with an integrator of its own: it is its velocity to a millimetre a second.
    assert np.abs(ned - airliner.velocity[2:-2]).max() < 3e-3


def test_starts_where_the_plan_says(airliner: Flown) -> None:
    latitude, longitude, height = airliner.geodetic[0]
    assert latitude == pytest.approx(48.0 * DEG, abs=1e-10)
    assert longitude == pytest.approx(11.0 * DEG, abs=1e-10)
    assert height == pytest.approx(6000.0, abs=1e-3)
    assert airliner.euler[0, 2] == pytest.approx(30.0 * DEG, abs=1e-6)
    assert airliner.log.channels["calibrated_airspeed_mps"].values[0] == pytest.approx(280.0 * KNOT, abs=0.01)


def test_starts_without_a_transient(airliner: Flown) -> None:
    hold = airliner.leg(1)
    assert np.abs(airliner.height[hold] - 6000.0).max() < 0.5
    assert np.abs(airliner.heading[hold] - 30.0 * DEG).max() < 0.1 * DEG
    assert np.abs(airliner.channel("load_factor", hold) - 1.0).max() < 0.01


@pytest.mark.parametrize("aircraft", ["737", "f16", "c172x"])
def test_starts_without_a_transient_in_wind(aircraft: str) -> None:
    wind = {"north_mps": 12.0, "east_mps": -9.0, "down_mps": 0.0}
    log = flight_log(fly_plan(plan(aircraft, {"type": "hold", "duration_s": 15.0}, wind=wind)))
    assert np.abs(log.channels["load_factor"].values - 1.0).max() < 0.02
    assert np.abs(log.channels["beta_rad"].values).max() < 0.3 * DEG
    assert log.channels["wind_north_mps"].values == pytest.approx(12.0, abs=1e-9)
    assert log.channels["wind_east_mps"].values == pytest.approx(-9.0, abs=1e-9)
    # Over the ground it moves with the air and the wind.
    ground = np.diff(log.position_ecef[:: len(log.time) - 1], axis=0)[0] / 15.0
    up = log.position_ecef[0] / np.linalg.norm(log.position_ecef[0])
    east = np.cross([0.0, 0.0, 1.0], up) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], up))
    north = np.cross(up, east)
    speed = log.channels["airspeed_mps"].values.mean()
    assert ground @ north == pytest.approx(speed * np.cos(30.0 * DEG) + 12.0, abs=0.5)
    assert ground @ east == pytest.approx(speed * np.sin(30.0 * DEG) - 9.0, abs=0.5)


def test_climb_and_descent_reach_their_height_and_stay(airliner: Flown) -> None:
    for number, height in ((2, 6100.0), (6, 6050.0)):
        end = airliner.leg(number).stop
        assert airliner.height[end] == pytest.approx(height, abs=3.1)
        assert np.abs(airliner.height[end : end + 60] - height).max() < 5.0


def test_height_is_held_in_turns(airliner: Flown) -> None:
    turns = slice(airliner.leg(3).start, airliner.leg(5).stop)
    assert np.abs(airliner.height[turns] - 6100.0).max() < 5.0


@pytest.mark.parametrize(
    ("flight", "leg", "bank_deg"), [("airliner", 3, 25.0), ("fighter", 1, -70.0), ("trainer", 4, 20.0)]
)
def test_turn_is_coordinated(flight: str, leg: int, bank_deg: float, request: pytest.FixtureRequest) -> None:
    flown: Flown = request.getfixturevalue(flight)
    part = flown.leg(leg)
    roll = flown.euler[part, 0]
    banked = np.flatnonzero(np.abs(roll - bank_deg * DEG) < 1.0 * DEG)
    steady = slice(part.start + banked[0] + 60, part.start + banked[-1])
    assert np.abs(roll).max() < (abs(bank_deg) + 2.0) * DEG
    rate = np.gradient(flown.heading[steady]) * 30.0
    bank = flown.euler[steady, 0].mean()
    speed = flown.channel("airspeed_mps", steady).mean()
    # ψ̇ = g tanφ / V, to the few per cent that thrust and angle of attack carry.
    assert rate.mean() == pytest.approx(G * np.tan(bank) / speed, rel=0.04)


def test_turn_ends_on_its_heading(airliner: Flown) -> None:
    end = airliner.leg(3).stop
    assert np.abs(airliner.heading[end] - 120.0 * DEG) < 1.0 * DEG


def test_s_turns_swing_to_both_sides_and_come_back(airliner: Flown) -> None:
    swing = airliner.heading[airliner.leg(4)] / DEG - 120.0
    assert swing.max() == pytest.approx(15.0, abs=4.0)
    assert swing.min() == pytest.approx(-15.0, abs=4.0)
    assert abs(swing[-1]) < 1.0


def test_speed_is_reached(airliner: Flown) -> None:
    speed = airliner.channel("calibrated_airspeed_mps", airliner.leg(5))
    assert speed[-1] == pytest.approx(270.0 * KNOT, abs=0.6)


def test_rudder_doublet_yaws_left_and_right(airliner: Flown) -> None:
    part = airliner.leg(7)
    rudder = airliner.channel("rudder_rad", part)
    # Right pedal first: JSBSim's rudder is positive nose left. The full travel is 0.35 rad, but the airliner's own
    # yaw damper takes its part.
    assert -0.3 * 0.35 - 0.01 < rudder[5] < -0.05
    assert 0.05 < rudder[15] < 0.3 * 0.35 + 0.01
    rate = np.gradient(airliner.heading[part]) * 30.0
    assert rate[15:30].mean() > 0.1 * DEG
    assert rate[-30:].mean() == pytest.approx(0.0, abs=0.05 * DEG)


def test_racetrack_comes_round(airliner: Flown) -> None:
    part = airliner.leg(8)
    turned = airliner.heading[part.stop - 1] - airliner.heading[part.start]
    assert turned == pytest.approx(-2.0 * np.pi, abs=1.5 * DEG)


def test_waypoint_is_captured(airliner: Flown) -> None:
    latitude, longitude, _ = airliner.geodetic[airliner.leg(9).stop - 1]
    north = (latitude - 48.0 * DEG) * 6.37e6
    east = (longitude - 11.2 * DEG) * 6.37e6 * np.cos(latitude)
    assert np.hypot(north, east) < 305.0


def test_lasts_exactly_until_the_last_hold_says(airliner: Flown) -> None:
    assert airliner.log.time[-1] == 900.0
    assert len(airliner.log.time) == 900 * 30 + 1


def test_events_name_each_leg(airliner: Flown) -> None:
    texts = [event.text for event in airliner.log.events]
    assert texts[:4] == ["leg 1 (hold) begins", "leg 1 (hold) ends", "leg 2 (climb) begins", "leg 2 (climb) ends"]
    assert len(texts) == 20
    times = [event.time for event in airliner.log.events]
    assert times == sorted(times)


def test_no_limit_cycle_in_level_flight(airliner: Flown) -> None:
    steady = slice(-30 * 30, None)
    q = airliner.log.q_eb[steady]
    relative = np.abs(np.sum(q[1:] * q[:-1], axis=1))
    # The rates themselves from the rotation between knots, by the vector part of conj(q_k) q_k+1.
    w, v = q[:, :1], q[:, 1:]
    step = w[:-1] * v[1:] - w[1:] * v[:-1] - np.cross(v[:-1], v[1:])
    rates = 2.0 * step * 30.0
    assert relative.min() > 1.0 - 1e-6
    detrended = rates - np.column_stack(
        [np.polyval(np.polyfit(np.arange(len(c)), c, 2), np.arange(len(c))) for c in rates.T]
    )
    assert detrended.std(axis=0).max() < 0.002 * DEG


def test_loop_goes_all_the_way_round(fighter: Flown) -> None:
    part = fighter.leg(3)
    pitch = fighter.euler[part, 1]
    assert pitch.max() > 85.0 * DEG
    assert pitch.min() < -85.0 * DEG
    roll = fighter.euler[part, 0]
    top = np.argmax(fighter.height[part])
    assert np.abs(np.abs(roll[top]) - np.pi) < 5.0 * DEG  # inverted at the top
    assert abs(pitch[top]) < 20.0 * DEG
    assert (
        abs(np.remainder(fighter.euler[part, 2][-1] - fighter.euler[part, 2][0] + np.pi, 2 * np.pi) - np.pi) < 3 * DEG
    )
    assert abs(roll[-1]) < 5.0 * DEG
    assert fighter.channel("load_factor", part).max() == pytest.approx(4.5, rel=0.15)


def test_barrel_roll_rolls_a_full_turn(fighter: Flown) -> None:
    part = fighter.leg(4)
    roll = np.unwrap(fighter.euler[part, 0])
    assert roll[-1] - roll[0] == pytest.approx(-2.0 * np.pi, abs=3.0 * DEG)
    assert np.abs(fighter.euler[part, 1]).max() < 40.0 * DEG
    assert fighter.channel("load_factor", part).min() > 0.3


def test_parked_aircraft_does_not_move(trainer: Flown) -> None:
    part = trainer.leg(1)
    assert np.all(trainer.log.position_ecef[part] == trainer.log.position_ecef[0])
    assert np.all(trainer.log.q_eb[part] == trainer.log.q_eb[0])
    assert trainer.height[0] - 120.0 == pytest.approx(1.3, abs=0.3)  # the centre of gravity above the runway


def test_takeoff_leaves_rest_gently_and_keeps_straight(trainer: Flown) -> None:
    step = np.linalg.norm(np.diff(trainer.log.position_ecef, axis=0), axis=1)
    start = trainer.leg(2).start
    assert step[start : start + 15].max() < 0.01
    ends = trainer.leg(2).stop
    assert trainer.height[ends] == pytest.approx(trainer.height[0] + 150.0, abs=4.0)
    assert np.abs(trainer.heading[:ends] - trainer.heading[0]).max() < 4.0 * DEG


def test_gust_has_its_shape() -> None:
    gust = {"start_s": 2.0, "rise_s": 2.0, "steady_s": 3.0, "fall_s": 1.0, "velocity_ned_mps": [0.0, 3.0, -1.0]}
    log = flight_log(
        fly_plan(plan("737", {"type": "hold", "duration_s": 12.0}, wind={"east_mps": 2.0, "gusts": [gust]}))
    )
    east, down = log.channels["wind_east_mps"].values, log.channels["wind_down_mps"].values
    assert east[10] == pytest.approx(2.0, abs=1e-9)
    assert east[30] == pytest.approx(2.0 + 1.5, abs=0.3)  # half way up at 3 s
    assert east[50] == pytest.approx(5.0, abs=1e-6)
    assert down[50] == pytest.approx(-1.0, abs=1e-6)
    assert east[-1] == pytest.approx(2.0, abs=1e-6)


def digest(log: FlightLog) -> str:
    parts = [log.time, log.position_ecef, log.q_eb, *(channel.values for channel in log.channels.values())]
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


TURBULENT = {"turbulence": {"severity": 4}, "wind": {"north_mps": 3.0}}


def turbulent(seed: int) -> FlightLog:
    return flight_log(fly_plan(plan("737", {"type": "hold", "duration_s": 8.0}, **TURBULENT), seed))


def test_turbulence_follows_the_seed() -> None:
    here = digest(turbulent(5))
    assert digest(turbulent(5)) == here
    assert digest(turbulent(6)) != here


@pytest.mark.slow
def test_turbulence_is_the_same_in_another_process() -> None:
    here = digest(turbulent(5))
    program = "from tests.truth.flight.test_jsbsim_flight import digest, turbulent; print(digest(turbulent(5)))"
    root = Path(__file__).parents[3]
    there = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True)
    assert there.stdout == here + "\n"  # and nothing of JSBSim's chatter
    assert there.stderr == ""


def test_turbulence_has_the_strength_of_the_specification() -> None:
    log = flight_log(fly_plan(plan("737", {"type": "hold", "duration_s": 300.0}, turbulence={"severity": 3}), 1))
    # MIL-F-8785C, probability of exceedance 1e-3: about 5 ft/s above 2000 ft.
    sigma = [log.channels[f"wind_{axis}_mps"].values.std() for axis in ("north", "east", "down")]
    assert np.all(np.array(sigma) > 0.8)
    assert np.all(np.array(sigma) < 2.2)


def test_progress_rises_to_one() -> None:
    seen: list[float] = []
    fly_plan(plan("737", {"type": "hold", "duration_s": 20.0}, {"type": "hold", "until_s": 40.0}), 0, seen.append)
    assert seen == sorted(seen)
    assert seen[0] == 0.0  # which tells a flight from one that was kept
    assert seen[-1] == 1.0
    assert len(seen) >= 4


@pytest.mark.parametrize(
    ("aircraft", "legs", "words"),
    [
        ("737", [{"type": "speed", "airspeed_kt": 90.0}], ["leg 1 (speed) failed", "stalled", "kt calibrated"]),
        (
            "c172x",
            [
                {"type": "hold", "duration_s": 1.0},
                {"type": "descend", "altitude_m": -100.0, "vertical_speed_mps": 40.0},
            ],
            ["leg 2 (descend) failed", "hit the ground", "height of"],
        ),
        (
            "c172x",
            [{"type": "climb", "altitude_m": 9000.0, "timeout_s": 20.0}],
            ["leg 1 (climb) failed at 20.", "timeout_s of 20 s", "longer timeout_s"],
        ),
        (
            "f16",
            [{"type": "hold", "duration_s": 10.0}, {"type": "hold", "until_s": 5.0}],
            ["leg 2 (hold)", "must end at 5 s", "later until_s"],
        ),
    ],
)
def test_what_cannot_be_flown_fails_with_leg_time_and_state(aircraft: str, legs: list[Any], words: list[str]) -> None:
    with pytest.raises(InputError) as failure:
        fly_plan(plan(aircraft, *legs))
    for word in words:
        assert word in str(failure.value)


def wild_aircraft(folder: Path, replaced: str, by: str, more: str = "") -> str:
    text = Path("aircraft/737/aircraft.toml").read_text().replace(replaced, by)
    (folder / "wild").mkdir()
    (folder / "wild" / "aircraft.toml").write_text(text + more)
    return str(folder / "wild")


@pytest.mark.parametrize("leg", [{"type": "hold", "duration_s": 20.0}, {"type": "climb", "altitude_m": 9000.0}])
def test_diverging_model_fails_with_leg_and_time(tmp_path: Path, leg: dict[str, Any]) -> None:
    path = ".//function[@name='aero/coefficient/Cmq']/product/value"
    name = wild_aircraft(tmp_path, "", "", f'\n[model_changes]\n"{path}" = "3e9"\n')
    with pytest.raises(InputError, match=r"leg 1 \(\w+\) failed at 0\.\d s of the flight: the model diverged"):
        fly_plan(plan(name, leg))


def test_missing_model_is_named(tmp_path: Path) -> None:
    name = wild_aircraft(tmp_path, 'jsbsim_model = "737"', 'jsbsim_model = "no-such"')
    with pytest.raises(InputError, match="no model 'no-such'"):
        fly_plan(plan(name, {"type": "hold", "duration_s": 1.0}))


def test_start_that_cannot_be_trimmed_is_refused() -> None:
    flight = plan("737", {"type": "hold", "duration_s": 1.0})
    slow = flight.model_copy(update={"start": flight.start.model_copy(update={"airspeed_kt": 60.0})})
    with pytest.raises(InputError, match=r"cannot trim the 737 at the start .*in the air, .*airspeed_kt = 60\)"):
        fly_plan(slow)


@pytest.mark.slow
def test_wind_that_is_too_strong_on_the_runway_is_named() -> None:
    legs = [{"type": "parked", "duration_s": 5.0}, {"type": "takeoff"}]
    start = {"on": "runway", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 120.0, "heading_deg": 90.0}
    flight = FlightPlan.model_validate({"aircraft": "c172x", "start": start, "legs": legs, "wind": {"north_mps": 11.0}})
    said = (
        r"on the runway, .*The likely cause is the wind of 11 m/s towards north and 0 m/s towards east.*a weaker wind"
    )
    with pytest.raises(InputError, match=said):
        fly_plan(flight)


def test_model_that_is_not_xml_is_named(tmp_path: Path) -> None:
    name = wild_aircraft(tmp_path, 'jsbsim_model = "737"', 'jsbsim_model = "broken"')
    (tmp_path / "wild" / "broken").mkdir()
    (tmp_path / "wild" / "broken" / "broken.xml").write_text('<fdm_config name="broken">\n')
    with pytest.raises(InputError, match=r"broken\.xml is not XML: no element found: line 2"):
        fly_plan(plan(name, {"type": "hold", "duration_s": 1.0}))


def test_fuel_beyond_the_tanks_is_refused_before_the_flight(capsys: pytest.CaptureFixture[str]) -> None:
    """The tanks of the 737's model hold 10 200, 10 200 and 15 000 lb, 0.45359237 kg each."""
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 6000.0}
    leg = {"type": "hold", "duration_s": 1.0}
    check_fuel(plan("737", leg, start={**start, "fuel_kg": 35400.0 * 0.45359237}))
    check_fuel(plan("737", leg))
    with pytest.raises(InputError, match=r"fuel_kg = 16058: the tanks of the model 737 hold 16057 kg\."):
        check_fuel(plan("737", leg, start={**start, "fuel_kg": 16058.0}))
    assert call("check", "first_flight", "--set", "flight.start.fuel_kg=16058") == 2
    assert "the tanks of the model 737 hold 16057 kg." in " ".join(capsys.readouterr().err.split())


def test_the_fuel_of_the_model_may_be_written_out() -> None:
    """The tanks of the Cessna's model are full: 130 lb each. With less fuel it flies another way."""
    start = {"on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 1000.0, "airspeed_kt": 100.0}
    records = [
        fly_plan(plan("c172x", {"type": "hold", "duration_s": 2.0}, start={**start, **fuel})).poses
        for fuel in ({}, {"fuel_kg": 260.0 * 0.45359237}, {"fuel_kg": 60.0})
    ]
    assert records[0] == records[1] != records[2]


def test_flight_that_is_over_at_once_is_refused() -> None:
    with pytest.raises(InputError, match=r"over after 0\.20 s, at the end of leg 1 \(hold\)"):
        fly_plan(plan("737", {"type": "hold", "duration_s": 0.2}))


def test_fuel_at_the_start(tmp_path: Path) -> None:
    """The weight grows by that of the fuel; the tanks of the 737 hold 35,400 lb, of which the model fills 24,000."""
    weights = []
    for fuel in (None, 16000.0):
        folder = tmp_path / str(fuel)
        folder.mkdir()
        executive = jsbsim_simulation.loaded_model("737", load_aircraft("737"), str(folder), fuel)
        executive.run_ic()
        executive.run()
        weights.append(0.45359237 * executive["inertia/weight-lbs"])
    assert weights[1] - weights[0] == pytest.approx(16000.0 - 24000.0 * 0.45359237, abs=1.0)
    with pytest.raises(InputError, match=r"flight\.start\.fuel_kg = 16100: the tanks of the model 737 hold 16057 kg"):
        fly_plan(
            plan(
                "737",
                {"type": "hold", "duration_s": 1.0},
                start={
                    "on": "air",
                    "latitude_deg": 48.0,
                    "longitude_deg": 11.0,
                    "altitude_m": 6000.0,
                    "fuel_kg": 16100.0,
                },
            )
        )
