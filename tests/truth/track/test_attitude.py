"""Attitude from motion at a standstill and at low speed."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.truth.track.attitude import _standstills
from sinssim.truth.track.curve import TrackCurve, from_samples
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


@pytest.mark.parametrize(("sigma", "correlation_s"), [(1.5, 0.0), (3.0, 5.0), (3.0, 30.0)])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_noisy_track_has_the_heading_of_its_motion_at_rest(sigma: float, correlation_s: float, seed: int) -> None:
    """A minute at rest, a drive with the heading 30°, another minute at rest in its middle; fixes at 1 Hz that wander.

    The heading at rest is that of the first 5 s of motion, about 20 m, so that it is off by σ·√2/20 m (1σ), 12° for
    3 m. The positions move at up to 3 m/s at rest, where the attitude must not turn.
    """
    t = np.arange(0.0, 281.0)
    speed = 1.5 * np.clip(np.minimum(t - 60.0, np.maximum(118.0 - t, t - 178.0)), 0.0, 8.0)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
    noise = np.random.default_rng(seed).standard_normal((2, len(t)))
    if correlation_s:
        kept = np.exp(-1.0 / correlation_s)
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
