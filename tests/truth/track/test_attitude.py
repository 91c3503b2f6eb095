"""Attitude from motion at a standstill and at low speed."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.geodetic_coordinates import q_en
from sinssim.earth.gravity import gravitation_ecef
from sinssim.truth.track_curve import TrackCurve, from_samples
from sinssim.truth.vehicle_attitude import (
    VEHICLES,
    _carried,
    _hold,
    _hold_pitch,
    _pointing,
    _reversals,
    _rising,
    _Span,
    _standstills,
    _wide_enough,
    attitude_from_motion,
)
from tests.slow import slow
from tests.truth.motions import Array

DEG = np.pi / 180.0
R = 6.37e6


def place(north: Array, east: Array) -> tuple[Array, Array]:
    return 0.8 + north / R, 0.2 + east / (R * np.cos(0.8))


def drive(turn: float, noise: float = 0.0) -> TrackCurve:
    """Drive 200 m north, stand for a minute, and leave in another direction; 1 Hz."""
    t = np.arange(0.0, 141.0)
    x = np.where(t < 40.0, t / 40.0, 1.0)
    along = 200.0 * (3.0 * x**2 - 2.0 * x**3)
    y = np.clip((t - 100.0) / 40.0, 0.0, 1.0)
    away = 200.0 * (3.0 * y**2 - 2.0 * y**3)
    rng = np.random.default_rng(11)
    north = along + away * np.cos(turn) + noise * rng.standard_normal(len(t))
    east = away * np.sin(turn) + noise * rng.standard_normal(len(t))
    return from_samples(t, *place(north, east), 0.0 * t, vehicle="land")


def heading(track: TrackCurve, t: Array) -> Array:
    return np.unwrap(rotation.euler_from_quaternion(track.state(t).q_nb)[2])


@pytest.mark.parametrize("turn", [60.0 * DEG, -150.0 * DEG])
def test_heading_holds_at_rest_and_then_turns(turn: float) -> None:
    track = drive(turn)
    assert heading(track, np.linspace(45.0, 85.0, 200)) == pytest.approx(0.0, abs=1e-3)
    after = heading(track, np.linspace(110.0, 130.0, 200)) - turn
    assert np.abs(np.angle(np.exp(1j * after))).max() < 3e-3  # the sphere of the test against the ellipsoid
    omega, _ = track.rates(np.linspace(50.0, 85.0, 300))
    assert np.abs(np.linalg.norm(omega, axis=1) - 7.2921e-5).max() < 1e-8  # the Earth's rate alone
    t = np.linspace(5.0, 135.0, 4000)
    assert np.abs(np.gradient(heading(track, t), t)).max() < 1.2 * 0.8  # the largest turn on the spot


def test_noise_at_rest_does_not_spin_the_heading() -> None:
    track = drive(0.0, noise=0.5)
    fit = track.fit
    assert fit.turn.largest < 30.0 * DEG
    t = np.linspace(48.0, 92.0, 300)
    assert np.ptp(heading(track, t)) < 1e-3


@pytest.mark.parametrize(
    ("sigma", "correlation_s", "rate"),
    [(1.5, 0.0, 1), (3.0, 30.0, 1), (0.5, 10.0, 10), *slow((3.0, 5.0, 1), (1.0, 5.0, 10), (3.0, 30.0, 5))],
)
@pytest.mark.parametrize("seed", [1, *slow(2)])
def test_a_noisy_track_has_the_heading_of_its_motion_at_rest(
    sigma: float, correlation_s: float, rate: int, seed: int
) -> None:
    """A minute at rest, a drive with the heading 30°, another minute at rest in its middle; fixes that wander.

    The heading at rest is that of the first 5 s of motion, about 20 m, so that it is off by σ·√2/20 m (1σ), 12° for
    3 m. The positions move at up to 3 m/s at rest, where the attitude must not turn. Several fixes a second that wander
    turn the course by tens of degrees from one to the next.
    """
    t = np.arange(0.0, 280.0 + 0.5 / rate, 1.0 / rate)
    speed = 1.5 * np.clip(np.minimum(t - 60.0, np.maximum(118.0 - t, t - 178.0)), 0.0, 8.0)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) / rate])
    noise = np.random.default_rng(seed).standard_normal((2, len(t)))
    if correlation_s:
        kept = np.exp(-1.0 / rate / correlation_s)
        noise[:, 1:] *= np.sqrt(1.0 - kept**2)
        for k in range(1, len(t)):
            noise[:, k] += kept * noise[:, k - 1]
    north, east = way * np.cos(30.0 * DEG) + sigma * noise[0], way * np.sin(30.0 * DEG) + sigma * noise[1]
    track = from_samples(t, *place(north, east), 0.0 * t, vehicle="land")
    for begin, end in ((0.0, 55.0), (124.0, 170.0)):
        inside = np.linspace(begin + 0.1, end, 400)
        assert np.ptp(heading(track, inside)) < 1e-3
        assert np.degrees(heading(track, inside)) % 360.0 == pytest.approx(30.0, abs=3.0 * np.degrees(sigma / 14.0))
    moving = np.linspace(70.0, 110.0, 300)
    assert np.degrees(heading(track, moving)) == pytest.approx(30.0, abs=25.0)


def test_a_slow_circle_without_noise_keeps_its_course() -> None:
    """A radius of 3 m at 1.2 m/s stays within 6 m for as long as it lasts; it is no standstill."""
    t = np.arange(0.0, 60.0, 0.25)
    angle = 0.4 * t
    track = from_samples(t, *place(3.0 * np.sin(angle), 3.0 * (1.0 - np.cos(angle))), 0.0 * t, vehicle="land")
    assert track.fit.standing == 0.0
    at = np.linspace(5.0, 55.0, 200)
    assert np.abs(heading(track, at) - 0.4 * at).max() < 0.02


def test_a_vehicle_that_never_moves_has_the_given_heading() -> None:
    t = np.arange(0.0, 60.0)
    track = from_samples(t, 0.8 + 0.0 * t, 0.2 + 0.0 * t, 100.0 + 0.0 * t, heading=1.0)
    assert heading(track, np.linspace(0.0, 59.0, 50)) == pytest.approx(1.0, abs=1e-9)
    assert track.fit.standing == 1.0


def test_slow_but_steady_motion_has_a_course() -> None:
    t = np.arange(0.0, 60.0)
    track = from_samples(t, *place(0.0 * t, 0.8 * t), 0.0 * t)
    assert heading(track, np.linspace(0.0, 59.0, 50)) == pytest.approx(np.pi / 2, abs=1e-4)


def test_hysteresis() -> None:
    speed = np.array([2.0, 0.9, 0.6, 0.4, 0.7, 0.99, 1.0, 0.6, 2.0, 0.49])
    assert _standstills(speed, 1.0) == [(3, 6), (9, 10)]
    assert _standstills(np.array([0.1, 0.7, 1.5]), 1.0) == [(0, 2)]
    assert _standstills(np.full(5, 0.1), 1.0) == [(0, 5)]
    assert _standstills(np.full(5, 3.0), 1.0) == []


def test_pitch_from_climb_and_flat() -> None:
    t = np.arange(0.0, 100.0)
    climb = 20.0 * t * np.tan(0.05)
    for pitch, expected in (("slope", 0.05), ("flat", 0.0)):
        track = from_samples(t, *place(20.0 * t, 0.0 * t), climb, pitch=pitch)
        _, found, _ = rotation.euler_from_quaternion(track.state(np.linspace(5.0, 95.0, 99)).q_nb)
        assert found == pytest.approx(expected, abs=3e-4)  # R of the test is a sphere's


def test_pitch_is_held_at_low_speed() -> None:
    track = drive(0.5, noise=0.3)
    _, pitch, _ = rotation.euler_from_quaternion(track.state(np.linspace(0.0, 140.0, 999)).q_nb)
    assert np.abs(pitch).max() < 1.0 * DEG


def test_sea_is_flat() -> None:
    t = np.arange(0.0, 600.0, 10.0)
    track = from_samples(t, *place(8.0 * t, 50.0 * np.sin(0.02 * t)), 3.0 * np.sin(0.1 * t), vehicle="sea")
    roll, pitch, _ = rotation.euler_from_quaternion(track.state(np.linspace(0.0, 590.0, 300)).q_nb)
    assert max(np.abs(roll).max(), np.abs(pitch).max()) < 1e-9


def test_a_held_pitch_goes_over_from_slope_to_slope() -> None:
    """2 m/s up a slope of 0.1 for 20 s, 20 s slow, 2 m/s down a slope of 0.05: both are held."""
    time = np.arange(0.0, 60.0)
    speed = np.where((time >= 20.0) & (time < 40.0), 0.2, 2.0)
    slope = np.where(time < 30.0, 0.1, -0.05)
    nose = np.arctan(slope)
    nose[20:40] = 9.0  # of a slow path, mostly noise
    _hold_pitch(time, nose, slope * speed, speed, _Span(20, 40))
    np.testing.assert_allclose(nose[:20], np.arctan(0.1))
    np.testing.assert_allclose(nose[20:36], np.arctan(0.1), atol=1e-12)
    np.testing.assert_allclose(nose[40:], np.arctan(-0.05))
    # the last 4 s before 40 s are a smooth step between them
    share = np.array([0.0, 0.25, 0.5, 0.75])
    step = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    np.testing.assert_allclose(nose[36:40], (1.0 - step) * np.arctan(0.1) + step * np.arctan(-0.05), atol=1e-12)


def test_pitch_at_an_edge_of_a_slow_part_turns_to_the_mean() -> None:
    """The slope before it grows by 0.01 each second to 0.15: the mean of the last five seconds is 0.125."""
    time = np.arange(0.0, 40.0)
    speed = np.where(time < 16.0, 2.0, 0.2)
    slope = np.where(time < 16.0, 0.01 * time, 0.0)
    nose = np.zeros(40)
    _hold_pitch(time, nose, slope * speed, speed, _Span(16, 40))
    mean = np.arctan(np.mean(slope[10:16]))
    edge, rate = np.arctan(0.15), np.arctan(0.15) - np.arctan(0.14)
    x = 0.5  # 1 s of 2 s on the way to the mean, while the rate died out over a second by half of it
    assert nose[16] == pytest.approx(0.5 * (edge + rate * 0.5) + 0.5 * mean, abs=1e-12)
    assert x**3 * (10.0 - 15.0 * x + 6.0 * x**2) == 0.5
    np.testing.assert_allclose(nose[18:], mean, atol=1e-12)
    back = np.zeros(40)
    _hold_pitch(time, back, (slope * speed)[::-1], speed[::-1], _Span(0, 24))
    np.testing.assert_allclose(back[:24], nose[:15:-1], atol=1e-12)


def test_a_turn_that_a_stop_interrupts() -> None:
    """A course of 0.2 rad/s before and 0.3 rad/s after a stop of 20 s: each dies out, and begins, in a second.

    The integral of what is left of a rate of 1 after a second is half a second.
    """
    time = np.arange(0.0, 60.0)
    up = np.tile([0.0, 0.0, 1.0], (60, 1))
    # clockwise from above: the course at angle a is (cos a, −sin a, 0)
    angle = np.where(time < 20.0, 0.2 * (time - 19.0), np.where(time >= 40.0, 1.5 + 0.3 * (time - 40.0), 9.0))
    course = np.column_stack([np.cos(angle), -np.sin(angle), 0.0 * angle])

    def held(most: float, mean_before: float) -> Array:
        ahead = course.copy()
        _hold(time, ahead, course, up, _Span(20, 40), most, mean_before, 0.0)
        found = np.unwrap(np.arctan2(-ahead[:, 1], ahead[:, 0]))
        return found - found[19]

    found = held(10.0, 0.0)
    np.testing.assert_allclose(found[20:38], 0.1, atol=1e-12)  # 0.2 rad/s · 0.5 s
    # the last 2 s (or 15/8 of 1.5/10 s) go over to 1.5 − 0.3 · 0.5 before the course goes on; at half of them, both
    assert found[39] == pytest.approx(0.5 * 0.1 + 0.5 * (1.5 - 0.15), abs=1e-12)
    np.testing.assert_allclose(found[40:] - found[40], 0.3 * (time[40:] - 40.0), atol=1e-9)
    # with a mean course, the heading at rest is that one: the rate at the edge is noise there, and dies out on the way
    np.testing.assert_allclose(held(10.0, 0.4)[21:38], 0.4, atol=1e-12)
    # the rate is limited to 0.1 rad/s; the turn by 1.5 rad then takes 28 s, more than the 20 s of the stop
    assert held(0.1, 0.0)[20] == pytest.approx(0.05, abs=0.01)


def test_the_roll_rises_away_from_standstills() -> None:
    """0 within, and a smooth step of 2 s on both sides."""
    time = np.arange(0.0, 12.0, 0.5)
    found = _rising(time, [_Span(8, 14)])  # 4 … 6.5 s
    np.testing.assert_allclose(found[8:14], 0.0)
    x = np.array([0.75, 0.5, 0.25])
    step = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    np.testing.assert_allclose(found[[5, 6, 7]], step)
    np.testing.assert_allclose(found[[16, 15, 14]], step)
    np.testing.assert_allclose(found[[0, 4, 17, 23]], 1.0)


def test_standstills_are_widened_for_the_turn_on_the_spot() -> None:
    """A turn of 1.6 rad at 0.8 rad/s takes 15/8 · 2 = 3.75 s; a stop of a second gains 1.375 s on either side."""
    time = np.arange(0.0, 20.0, 0.25)
    up = np.tile([0.0, 0.0, 1.0], (80, 1))
    angle = np.where(time < 10.0, 0.0, 1.6)
    course = np.column_stack([np.cos(angle), -np.sin(angle), 0.0 * angle])
    ((first, last),) = _wide_enough(time, course, up, [_Span(38, 42)], 0.8)  # 9.5 … 10.5 s
    assert time[last] - time[first] == pytest.approx(3.75, abs=0.51)
    assert time[last] - time[first] >= 3.75
    assert 0.5 * (time[first] + time[last]) == pytest.approx(10.0, abs=0.26)
    assert _wide_enough(time, course, up, [_Span(30, 34)], 0.8) == [_Span(30, 34)]  # no turn within


def test_headings_from_north_and_carried_along() -> None:
    """At 30° of longitude on the equator east is (−½, √¾, 0); 60° are half north and √¾ east."""
    up = np.array([np.cos(np.radians(30.0)), np.sin(np.radians(30.0)), 0.0])
    found = _pointing(up, np.radians(60.0))
    np.testing.assert_allclose(found, [-0.5 * np.sqrt(0.75), 0.75, 0.5], atol=1e-12)
    # a direction to the east, carried a quarter of the way around the equator, is still to the east
    there = np.array([[-np.sin(np.radians(30.0)), np.cos(np.radians(30.0)), 0.0]])
    np.testing.assert_allclose(_carried(_pointing(up, 0.5 * np.pi), up, there), [-up], atol=1e-12)
    np.testing.assert_allclose(_carried(_pointing(up, 0.0), up, there), [[0.0, 0.0, 1.0]], atol=1e-12)


def test_a_sharp_turn_between_two_knots_is_a_stop() -> None:
    """More than 0.3 rad."""
    angle = np.array([0.0, 0.29, 0.60, 0.61, 0.90, 0.61])
    course = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    assert _reversals(course).tolist() == [False, True, True, False, False, False]


def east_over_the_equator(speed: float, climb: float, lateral: float, lift: float, vehicle: str) -> Array:
    """Return roll and pitch of three equal knots at 0°, 0° to the east, with a specific force to the right and up."""
    position, velocity = np.tile([6378137.0, 0.0, 0.0], (3, 1)), np.tile([climb, speed, 0.0], (3, 1))
    omega = np.array([0.0, 0.0, 7.292115e-5])
    force = np.array([lift, 0.0, -lateral])  # to the right of east is south
    carried = 2.0 * np.cross(omega, velocity[0]) + np.cross(omega, np.cross(omega, position[0]))
    acceleration = np.tile(force - carried + gravitation_ecef(position[0]), (3, 1))
    found = attitude_from_motion(
        np.arange(3.0), position, velocity, acceleration, np.tile([1.0, 0.0, 0.0], (3, 1)), VEHICLES[vehicle], "normal",
        WGS84,
    )  # fmt: skip
    q_nb = rotation.multiply(rotation.conjugate(q_en(np.zeros(3), np.zeros(3))), found.q_eb)
    roll, pitch, heading = rotation.euler_from_quaternion(q_nb)
    np.testing.assert_allclose(heading, 0.5 * np.pi, atol=1e-12)
    return np.array([roll[1], pitch[1]])


@pytest.mark.parametrize(("lateral", "lift", "roll"), [
    (2.0, 9.0, np.arctan2(2.0, 9.0)), (-3.0, 9.0, np.arctan2(-3.0, 9.0)),
    (2.0, 0.3, np.arctan2(2.0, 1.0)),  # in free fall at least 1 m/s² counts
])  # fmt: skip
def test_the_roll_takes_the_lateral_force_away(lateral: float, lift: float, roll: float) -> None:
    np.testing.assert_allclose(east_over_the_equator(100.0, 0.0, lateral, lift, "aircraft"), [roll, 0.0], atol=1e-9)
    np.testing.assert_allclose(east_over_the_equator(100.0, 0.0, lateral, lift, "land"), [0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(("speed", "pitch"), [(2.6, np.arctan(0.1)), (2.4, 0.0)])
def test_the_slope_of_a_slow_path_is_no_pitch(speed: float, pitch: float) -> None:
    """On land below half of five times 1 m/s."""
    np.testing.assert_allclose(east_over_the_equator(speed, 0.1 * speed, 0.0, 9.8, "land"), [0.0, pitch], atol=1e-12)
