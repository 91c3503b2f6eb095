"""A multirotor: the push of its rotors, times and places by hand, rest on the ground, closure, refusals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from sinssim.earth import radii
from sinssim.errors import InputError
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.true_motion import fly
from sinssim.truth.motions.multirotor import MultirotorFlight, MultirotorMotion
from sinssim.units import G0
from tests.slow import slow
from tests.truth.test_independent_integration import closure

UP = {"type": "take_off", "height_m": 20.0}


def gravity(r: Any) -> Any:
    """Return gravity along the vertical of each place, which turns by x/M and y/N from that of the take-off."""
    north, east = (float(of) for of in radii(np.radians(45.0)))
    return G0 * np.column_stack([-r[:, 0] / north, -r[:, 1] / east, np.ones(len(r))])


def multirotor(*legs: dict[str, Any], **keys: Any) -> MultirotorMotion:
    return MultirotorMotion.model_validate({"type": "multirotor", "legs": list(legs), **keys})


def test_rotors_push_along_the_body_and_air_brakes() -> None:
    """r̈ − g + c ṙ has no component across the rotors, also while it turns; in steady flight tan θ = −c v/g."""
    section = multirotor(
        UP, {"type": "fly_to", "north_m": 120.0, "east_m": 0.0}, {"type": "orbit", "angle_deg": -200.0},
        {"type": "yaw", "angle_deg": 50.0}, drag_per_s=0.3, heading_deg=25.0, rotor_lag_s=0.0,
    )  # fmt: skip
    motion = section.motion()
    time = np.linspace(0.0, section.duration_s, 2001)
    r, v, a = motion.place(time)
    attitude = Rotation.from_quat(motion.attitude(time), scalar_first=True)
    force = attitude.inv().apply(a + 0.3 * v - gravity(r))
    np.testing.assert_allclose(force[:, :2], 0.0, atol=1e-12)
    assert (force[:, 2] < 0.0).all()
    # 120 m at 8 m/s with 1.5 m/s²: in the middle it flies steadily to the north
    middle = np.argmin(np.abs(time - (section._plan.events[2].time + 0.5 * (120.0 / 8.0 + 8.0 / 1.5))))
    down = attitude[middle].apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(down[:2] / down[2], [-0.3 * 8.0 / G0, 0.0], atol=2e-5)  # the vertical turns by 60 m/M
    assert np.linalg.norm(v, axis=1).max() == pytest.approx(8.0, abs=1e-8)
    assert np.abs(a).max() < 2.0 * 1.5 + 8.0**2 / 30.0
    assert np.degrees(np.abs(motion.rate(time)[time > section._plan.events[6].time, 2]).max()) == pytest.approx(
        60.0, rel=1e-3
    )


def test_legs_lead_where_they_say_and_last_as_long() -> None:
    """By hand: 20 m at 2 m/s, s/v + v/a; a grid of five lines; an arc of a quarter turn."""
    section = multirotor(
        {"type": "stop", "duration_s": 3.0}, UP,
        {"type": "survey", "length_m": 100.0, "width_m": 40.0, "spacing_m": 10.0},
        {"type": "orbit", "angle_deg": 90.0, "radius_m": 20.0},
        {"type": "fly_to", "north_m": 0.0, "east_m": 0.0, "height_m": 30.0}, {"type": "land"}, rotor_lag_s=0.0,
    )  # fmt: skip
    events = [event.time for event in section.trajectory().events]
    climb = 20.0 / 2.0 + 2.0 / 1.5
    short = 2.0 * np.sqrt(10.0 / 1.5)  # 10 m to the next line, too short for 8 m/s
    grid = 5 * (100.0 / 8.0 + 8.0 / 1.5) + 4 * short
    arc = 10.0 * np.pi / 8.0 + 8.0 / 1.5 if 10.0 * np.pi > 64.0 / 1.5 else 2.0 * np.sqrt(10.0 * np.pi / 1.5)
    assert np.diff(events)[::2][:4] == pytest.approx([3.0, climb, grid, arc])
    motion = section.motion()
    place = motion.moves(np.array(events))[0]
    np.testing.assert_allclose(place[3], [0.0, 0.0, -20.0], atol=1e-12)
    np.testing.assert_allclose(place[5], [100.0, 40.0, -20.0], atol=1e-9)  # an odd number of lines ends far away
    np.testing.assert_allclose(place[7], [120.0, 60.0, -20.0], atol=1e-9)
    np.testing.assert_allclose(place[9], [0.0, 0.0, -30.0], atol=1e-9)
    np.testing.assert_allclose(place[11], 0.0, atol=1e-9)
    assert np.degrees(euler_from_quaternion(motion.attitude(np.array(events)))[2])[[5, 7, 11]] == pytest.approx(
        [0, 90, 90]
    )
    within = motion.moves(np.linspace(events[4], events[5], 4001))[0]
    assert sorted({round(float(y), 6) for x, y, _ in within if 5.0 < x < 95.0}) == [0.0, 10.0, 20.0, 30.0, 40.0]


def test_it_stands_level_on_the_ground_and_closes() -> None:
    section = multirotor(
        {"type": "stop", "duration_s": 2.0}, UP, {"type": "orbit", "angle_deg": 90.0}, heading_deg=70.0
    )
    motion = section.trajectory()
    state = motion.state(np.array([0.0, 1.9]))
    assert np.abs(state.velocity_ned).max() == 0.0
    np.testing.assert_allclose(np.degrees(euler_from_quaternion(state.q_nb))[:, 0], [0.0, 0.0, 70.0], atol=1e-12)
    horizontal, attitude = closure(motion, 400.0)
    assert horizontal < 1e-5
    assert attitude < 1e-10


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["motion.pitch_deg=3.0"], "pitch_deg has no meaning for a multirotor"),
        (["motion.acceleration_mps2=5.0"], "acceleration_mps2 = 5: the rotors would have to push downwards"),
        (
            ["motion.legs=[{type='land'}]"],
            r"legs\.1 \(land\): a multirotor takes off, flies, lands, and stops on the ground",
        ),
        (["motion.legs=[{type='yaw', angle_deg=0.0}]"], "0 is no turn"),
    ],
)
def test_what_no_multirotor_does_is_refused(settings: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_scenario("survey_drone", settings)


BLOWN = {"wind_mps": 6.0, "wind_from_deg": 180.0, "gust_sigma_mps": 1.5, "gust_s": 2.0, "rotor_lag_s": 0.2}


def test_it_leans_against_the_wind_and_the_gusts() -> None:
    """r̈ − g + c (ṙ − w) has no component across the rotors; in a calm hover tan θ = −c w/g, into the wind."""
    section = multirotor(UP, {"type": "orbit", "angle_deg": 90.0}, {"type": "land"}, heading_deg=35.0, **BLOWN)
    motion, time = section.motion(7), np.linspace(0.0, section.duration_s, 4001)
    r, v, a = motion.place(time)
    wind, _ = motion._blown(time)
    attitude = Rotation.from_quat(motion.attitude(time), scalar_first=True)
    force = attitude.inv().apply(a + 0.2 * (v - wind[0]) - gravity(r))
    np.testing.assert_allclose(force[:, :2], 0.0, atol=1e-12)
    standing = [0, -1]
    np.testing.assert_allclose(wind[0][standing], 0.0, atol=1e-12)  # none acts on the ground
    np.testing.assert_allclose(motion.place(time)[0][0], 0.0, atol=1e-12)
    hover = multirotor(UP, {"type": "hover", "duration_s": 20.0}, wind_mps=6.0, wind_from_deg=180.0)
    down = Rotation.from_quat(hover.motion().attitude(np.array([25.0])), scalar_first=True).apply([0.0, 0.0, 1.0])[0]
    np.testing.assert_allclose(down[:2] / down[2], [0.2 * 6.0 / G0, 0.0], atol=1e-12)  # thrust to the south


def test_places_rates_and_derivatives_of_a_blown_flight_agree() -> None:
    section = multirotor(UP, {"type": "fly_to", "north_m": 40.0, "east_m": 20.0}, {"type": "land"}, **BLOWN)
    motion, h = section.motion(3), 1e-4
    time = np.linspace(0.3, section.duration_s - 0.3, 57)
    before, at, after = (motion.place(time + step) for step in (-h, 0.0, h))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), at[1], atol=1e-6)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), at[2], atol=1e-5)
    turned = Rotation.from_quat(motion.attitude(time - h), scalar_first=True).inv() * Rotation.from_quat(
        motion.attitude(time + h), scalar_first=True
    )
    np.testing.assert_allclose(turned.as_rotvec() / (2 * h), motion.rate(time), atol=1e-5)


def test_gusts_displace_it_as_its_loop_and_its_rotors_allow() -> None:
    """The loop in gusts, integrated by scipy from the state that the closed form has after the take-off."""
    section = multirotor(UP, {"type": "hover", "duration_s": 60.0}, **BLOWN)
    wind, (begin, end) = section.wind(5), (14.0, 40.0)
    c, lag, loop = 0.2, 0.2, 1.0

    def gust(t: float) -> Any:
        return wind.at(np.array([t]))[0][0, 0] - wind.mean

    def moves(t: float, state: Any) -> Any:
        r, v, u = state.reshape(3, 2)
        return np.concatenate([v, u + c * (gust(t) - v), (-u - loop**2 * r - np.sqrt(2.0) * loop * v) / lag])

    _, (r, v, a, _) = wind.at(np.array([begin, end]))
    start = np.concatenate([r[0], v[0], a[0] - c * (gust(begin) - v[0])])
    found = solve_ivp(moves, (begin, end), start, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1]
    np.testing.assert_allclose(found[:4], np.concatenate([r[1], v[1]]), atol=1e-8)
    assert 0.02 < np.hypot(*r[1]) < 2.0
    place = section.motion(5).moves(np.array([end]))[0][0]
    np.testing.assert_allclose(place[:2], r[1], atol=1e-12)


@pytest.mark.parametrize("lag", [0.15, *slow(0.02, 0.8)])
def test_rotors_lag_behind_the_legs_as_their_loop_allows(lag: float) -> None:
    """The loop that follows the commands, with u after its lag, integrated by scipy from rest; at the end of a line it
    has overshot, and then it comes to rest there."""
    legs = (UP, {"type": "fly_to", "north_m": 60.0, "east_m": 30.0}, {"type": "orbit", "angle_deg": 120.0},
            {"type": "hover", "duration_s": 80.0})  # fmt: skip
    section = multirotor(*legs, rotor_lag_s=lag, loop_rad_s=0.8)
    planned, motion, c = multirotor(*legs, rotor_lag_s=0.0), section.motion(), 0.2
    line, arc, end = (section._plan.events[k].time for k in (3, 5, 7))

    def moves(t: float, y: Any) -> Any:
        r, v, u = y.reshape(3, 3)
        place, speed, push, _ = (of[0] for of in planned.motion().moves(np.array([t])))
        wanted = push + c * speed - 0.64 * (r - place) - np.sqrt(2.0) * 0.8 * (v - speed)
        return np.concatenate([v, u - c * v, (wanted - u) / lag])

    state, corners = np.zeros(9), [t for t in planned.motion().breaks if t < arc]
    for a, b in pairwise([*corners, arc]):
        state = solve_ivp(moves, (a, b), state, rtol=1e-9, atol=1e-11, method="DOP853").y[:, -1]
    r, v, _, _ = (of[0] for of in motion.moves(np.array([arc])))
    np.testing.assert_allclose(np.concatenate([r, v]), state[:6], atol=1e-7)
    off = motion.moves(np.array([line, end]))[0] - planned.motion().moves(np.array([line, end]))[0]
    assert 0.05 * lag < np.linalg.norm(off[0]) < 3.0 * lag
    np.testing.assert_allclose(off[1], 0.0, atol=1e-9)


def test_on_a_long_arc_it_lags_as_the_response_to_a_rotating_command() -> None:
    """Closed form with s = iκv, the tangent as real and the normal as imaginary axis."""
    legs = (UP, {"type": "orbit", "angle_deg": 3600.0, "radius_m": 100.0}, {"type": "hover", "duration_s": 4000.0})
    motion, time = multirotor(*legs).motion(), np.array([400.0])
    (r, v, a), moved = (of[0] for of in motion.path(time)[:3]), motion.moves(time)[0][0]
    off, c, lag, s = moved - r, 0.2, 0.15, 0.08j
    command = 8.0 * s**2 + c * 8.0 * s  # r⃛ + c r̈
    response = -lag * command / (lag * s**3 + (1.0 + c * lag) * s**2 + (c + np.sqrt(2.0)) * s + 1.0)
    along, across = v / np.linalg.norm(v), a / np.linalg.norm(a)
    np.testing.assert_allclose([off @ along, off @ across], [response.real, response.imag], atol=1e-12)
    assert abs(response) > 0.01


def test_it_keeps_its_height_above_the_ellipsoid() -> None:
    """25 km away the plane of the take-off is 50 m above the level."""
    section = multirotor(
        UP, {"type": "fly_to", "north_m": 15e3, "east_m": 20e3}, {"type": "land"}, speed_mps=40.0, altitude_m=100.0
    )
    trajectory, events = section.trajectory(), section._plan.events
    state = trajectory.state(np.array([events[2].time + 300.0, section.duration_s]))
    np.testing.assert_allclose(state.height, [120.0, 100.0], atol=0.05)
    assert np.degrees(euler_from_quaternion(state.q_nb))[:2, 1] == pytest.approx([0.0, 0.0], abs=0.01)


def test_rotors_shake_it_in_flight() -> None:
    """The imbalance at 95 turns a second across, the two blades at twice that along the push; none on the ground."""
    legs = ({"type": "stop", "duration_s": 3.0}, UP, {"type": "hover", "duration_s": 12.0})
    keys = {"rotor_rms_g": 0.4, "rotor_rms_arcsec": 30.0}
    scenario = {"name": "m", "motion": {"type": "multirotor", "legs": list(legs), **keys}, "seed": 4}
    motion = fly(Scenario.model_validate(scenario))
    calm = multirotor(*legs).trajectory()
    ground = np.linspace(0.0, 3.0, 50)
    np.testing.assert_array_equal(motion.rates(ground)[1], calm.rates(ground)[1])
    time = 16.0 + np.arange(8000) / 1000.0
    shaken = (motion.rates(time)[1] - calm.rates(time)[1]) / G0
    np.testing.assert_allclose(shaken.std(axis=0), 0.4, rtol=0.15)  # the four lines beat
    turned = motion.rates(time)[0] - calm.rates(time)[0]
    size = 2.0 * np.pi * 190.0 * np.radians(30.0 / 3600.0)
    np.testing.assert_allclose(turned.std(axis=0), [size, size, 0.0], rtol=0.15, atol=0.02 * size)
    lines = np.abs(np.fft.rfft(shaken, axis=0)) ** 2
    f = np.fft.rfftfreq(len(time), 1e-3)
    for axis, line in ((0, 95.0), (1, 95.0), (2, 190.0)):
        assert lines[np.abs(f - line) < 0.05 * line, axis].sum() > 0.99 * lines[:, axis].sum()


@pytest.mark.parametrize("arm", [[0.0, 0.0, 0.0], [0.1, 0.0, 0.05]])
def test_a_shaken_flight_is_evaluated_at_few_instants(arm: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """The increments are those with the flight evaluated at each instant of the quadrature, twelve in a sample."""
    motion = {"type": "multirotor", "legs": [{**UP, "height_m": 2.0}], "rotor_rms_g": 0.4, "rotor_rms_arcsec": 30.0}
    motion |= BLOWN | {"rotor_lag_s": 0.15}
    scenario = {"name": "m", "motion": motion, "seed": 4, "imu": {"rate_hz": 400.0, "lever_arm_m": arm}}
    shaken, asked, moves = fly(Scenario.model_validate(scenario)), [0, 0], MultirotorFlight.moves

    def counted(flight: MultirotorFlight, t: Any) -> Any:
        asked[-1] += len(t)
        return moves(flight, t)

    monkeypatch.setattr(MultirotorFlight, "moves", counted)
    direct = fly(Scenario.model_validate(scenario))
    quick = shaken.increments(400.0)
    asked.append(0)
    monkeypatch.setattr("sinssim.truth.motions.mounted_block.interpolated", lambda of, *_: of)
    exact = direct.increments(400.0)
    np.testing.assert_allclose(quick.dtheta, exact.dtheta, rtol=0.0, atol=1e-17)
    np.testing.assert_allclose(quick.dvel, exact.dvel, rtol=0.0, atol=1e-15)
    assert asked[1] < 0.2 * asked[2]


def test_gusts_have_their_sigma_and_their_correlation() -> None:
    """Over an hour: 1.5 m/s in each component, e⁻¹ after 2 s; another seed has others, and a run of an ensemble too."""
    section = multirotor(UP, **BLOWN)
    time = np.arange(0.0, 3600.0, 0.1)
    gusts = section.wind(1).at(time)[0][0] - section.wind(1).mean
    np.testing.assert_allclose(gusts.std(axis=0), 1.5, rtol=0.02)
    correlation = np.mean(gusts[20:] * gusts[:-20], axis=0) / np.mean(gusts**2, axis=0)
    np.testing.assert_allclose(correlation, np.exp(-1.0), atol=0.06)
    assert np.abs(section.wind(2).at(time)[0][0] - section.wind(1).at(time)[0][0]).max() > 1.0
    assert section.is_drawn
    assert not multirotor(UP, wind_mps=3.0).is_drawn


def test_a_blown_flight_closes() -> None:
    horizontal, attitude = closure(multirotor({**UP, "height_m": 3.0}, **BLOWN).trajectory(), 400.0)
    assert horizontal < 1e-5
    assert attitude < 1e-10


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"wind_from_deg": 90.0}, "wind_from_deg has no effect without wind_mps"),
        ({"rotor_lag_s": 0.001}, "rotor_lag_s = 0.001 is shorter than that of any rotor"),
        ({"blades": 3}, "blades has no effect without vibration by the rotors"),
        ({"gust_s": 2.0}, "gust_s has no effect without gusts: give gust_sigma_mps"),
        (
            {"gust_sigma_mps": 1.0, "loop_rad_s": 5.0, "rotor_lag_s": 0.5},
            "rotor_lag_s = 0.5 is too long for loop_rad_s",
        ),
    ],
)
def test_winds_that_make_no_sense(keys: dict[str, Any], said: str) -> None:
    with pytest.raises((InputError, ValueError), match=said):
        multirotor(UP, **keys)
