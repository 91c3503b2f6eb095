"""Vibration and lever arms on top of a motion, against motions known otherwise, differences and quadrature."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.curve import Curve
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import Sculling, SpinRock, classical_cone
from sinssim.truth.motions.mounted_block import Vibrating, interpolated
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from sinssim.truth.motions.turntable import RotationTable, Turn
from sinssim.truth.motions.vibration import Tone, band_noise
from tests.oracles import integrator as oracle
from tests.slow import slow
from tests.truth.motions import synthetic_flight

Array = np.ndarray
SPIN = np.array([0.0, 0.0, oracle.OMEGA])
PLACE = (0.8, 0.5, 150.0)
Q = Rotation.from_euler("ZYX", [0.7, 0.3, -0.4]).as_quat(scalar_first=True)
MOUNTING = Rotation.from_euler("ZYX", [10.0, 20.0, 30.0], degrees=True).as_quat(scalar_first=True)
ARM = np.array([2.0, -0.7, 0.4])

TONES = (
    Tone("roll", 2e-3, 7.0, 0.3),
    Tone("roll", 1e-4, 31.0, 1.0),
    Tone("pitch", 1.5e-3, 7.0, 1.9),
    Tone("yaw", 5e-4, 23.0, -0.4),
    Tone("forward", 1e-4, 31.0, 0.2),
    Tone("right", 2e-3, 7.0, 0.3),
    Tone("down", 1e-3, 11.0, 2.2),
)


def flight(lever_arm: Sequence[float] = (0.0, 0.0, 0.0), q_bs: Sequence[float] = (1.0, 0.0, 0.0, 0.0)) -> Curve:
    time = np.arange(-2.0, 22.0, 1.0 / 30.0)
    return Curve(time, *synthetic_flight(time), lever_arm, q_bs)


def assert_same(a: Vibrating, b: object, rate_hz: float, angle: float, velocity: float, position: float = 5e-9) -> None:
    """Two motions have the same states and increments, to the rounding of phases of some hundred radians."""
    first, second = a.increments(rate_hz), b.increments(rate_hz)
    assert np.array_equal(first.time, second.time)
    assert np.abs(first.dtheta - second.dtheta).max() < angle
    assert np.abs(first.dvel - second.dvel).max() < velocity
    t = np.linspace(a.start, a.end, 101)
    s, q = a.state(t), b.state(t)
    apart = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    apart -= oracle.geodetic_to_ecef(q.latitude, q.longitude, q.height)
    assert np.abs(apart).max() < position
    assert np.abs(s.velocity_ned - q.velocity_ned).max() < 1e-12
    turn = Rotation.from_quat(s.q_nb, scalar_first=True).inv() * Rotation.from_quat(q.q_nb, scalar_first=True)
    assert turn.magnitude().max() < 1e-14


def test_two_turns_in_quadrature_are_the_cone() -> None:
    alpha, f = 0.03, 9.0
    tones = (Tone("pitch", alpha, f, np.pi / 2), Tone("yaw", alpha, f))
    vibrating = Vibrating(Parked(*PLACE, Q, 3.0), tones)
    cone = OnEarth(classical_cone(alpha, 2.0 * np.pi * f), *PLACE, Q, 3.0)
    for rate_hz in (5.0, 100.0):
        assert_same(vibrating, cone, rate_hz, 4e-15, 3e-14)
    t = np.linspace(0.0, 3.0, 77)
    for one, other in zip(vibrating.rates(t), cone.rates(t), strict=True):
        assert np.abs(one - other).max() < 1e-13  # of 1.7 rad/s and 10 m/s²


def test_turn_and_displacement_in_phase_are_sculling() -> None:
    theta, d, f = 0.05, 2e-3, 12.0
    vibrating = Vibrating(Parked(*PLACE, Q, 2.0), (Tone("roll", theta, f), Tone("right", d, f)))
    sculling = OnEarth(Sculling(theta, d, 2.0 * np.pi * f), *PLACE, Q, 2.0)
    assert_same(vibrating, sculling, 100.0, 2e-15, 3e-14)
    t = np.linspace(0.0, 2.0, 77)
    for one, other in zip(vibrating.rates(t), sculling.rates(t), strict=True):
        assert np.abs(one - other).max() < 3e-13  # of 11 m/s²


def test_lever_arm_on_a_rocking_body() -> None:
    """The arm's acceleration by parts, against the closed form of the size effect."""
    at = ([1.0, 2.0, -0.5], 0.7, 0.4, 2.0 * np.pi)
    vibrating = Vibrating(OnEarth(SpinRock(*at), *PLACE, Q, 3.0), lever_arm=ARM)
    closed = OnEarth(SpinRock(*at, ARM), *PLACE, Q, 3.0)
    assert_same(vibrating, closed, 50.0, 1e-15, 3e-14)
    t = np.linspace(0.0, 3.0, 77)
    assert np.abs(vibrating.rates(t)[1] - closed.rates(t)[1]).max() < 1e-10


def test_lever_arm_and_mounting_of_a_flight() -> None:
    """The curve moves its block by its own analytic angular acceleration."""
    assert_same(Vibrating(flight(), lever_arm=ARM, q_bs=MOUNTING), flight(ARM, MOUNTING), 50.0, 1e-15, 3e-13)


def test_the_angular_acceleration_beside_a_break_is_that_of_its_side() -> None:
    """A table speeds up by 2 rad/s² for half a second: 4 m/s² at two metres, and none a moment later."""
    table = OnEarth(RotationTable([Turn((0.0, 0.0, 1.0), 1.0, 1.0, 0.5, "trapezoidal")]), *PLACE, Q, 1.5)
    t = 0.5 + 1e-4 * np.array([-4.0, -1.0, 1.0, 4.0])
    across = Vibrating(table, lever_arm=(2.0, 0.0, 0.0)).rates(t)[1] - table.rates(t)[1]
    np.testing.assert_allclose(across[:, 1], [4.0, 4.0, 0.0, 0.0], atol=1e-3)  # the Earth's rate adds 3e-4


def test_polynomials_give_a_function_that_jumps_at_breaks() -> None:
    """A cosine that changes its sign at the break, and a sine, at many instants from few."""
    asked: list[int] = []

    def function(t: Array) -> Array:
        asked.append(len(t))
        sign = np.where(t < 1.7, 1.0, -1.0)
        return np.column_stack([sign * np.cos(9.0 * t), np.sin(9.0 * t)])

    t = np.linspace(0.3, 4.0, 20_000)
    values = interpolated(function, 9.0, [0.1, 1.7, 1.7, 9.0])(t)
    assert sum(asked) < 400
    np.testing.assert_allclose(values, function(t), rtol=0.0, atol=2e-14)  # the rounding of 36 rad


@pytest.fixture(params=["flight", "great circle", "parked"])
def vibrating(request: pytest.FixtureRequest) -> Vibrating:
    base = {
        "flight": flight,
        "great circle": lambda: GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 20.0),
        "parked": lambda: Parked(*PLACE, Q, 20.0),
    }[request.param]()
    noise = band_noise("pitch", 3e-4, 5.0, 40.0, 1) + band_noise("down", 2e-4, 5.0, 40.0, 1)
    return Vibrating(base, TONES + noise, ARM, MOUNTING)


def ecef(trajectory: Vibrating, t: Array) -> tuple[Array, Array, Array]:
    s = trajectory.state(t)
    c_en = np.swapaxes(oracle.ned_axes(s.latitude, s.longitude), -1, -2)
    r = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    return r, np.einsum("nij,nj->ni", c_en, s.velocity_ned), c_en @ oracle.matrix(s.q_nb)


def test_rates_and_force_by_differences(vibrating: Vibrating) -> None:
    h, t = 2e-4, np.linspace(1.0, 19.0, 301)

    def difference(p: list[Array]) -> Array:
        return (45.0 * (p[3] - p[2]) - 9.0 * (p[4] - p[1]) + (p[5] - p[0])) / (60.0 * h)

    r, v, c_eb = ecef(vibrating, t)
    around = [ecef(vibrating, t + k * h) for k in (-3, -2, -1, 1, 2, 3)]
    assert np.abs(difference([p[0] for p in around]) - v).max() < 3e-5  # 4e-9 m over 0.2 ms
    omega, force = vibrating.rates(t)
    turn = [(Rotation.from_matrix(c_eb).inv() * Rotation.from_matrix(p[2])).as_rotvec() for p in around]
    assert np.abs(omega - difference(turn) - np.einsum("nji,j->ni", c_eb, SPIN)).max() < 1e-11
    gravitation = np.array([oracle.gravitation(*row, oracle.ZONAL) for row in r])
    f_e = difference([p[1] for p in around]) + 2.0 * np.cross(SPIN, v) - gravitation
    f_e += np.cross(SPIN, np.cross(SPIN, r))
    assert np.abs(force - np.einsum("nji,nj->ni", c_eb, f_e)).max() < 3e-9  # of 100 m/s²


def test_velocity_is_the_derivative_of_the_position(vibrating: Vibrating) -> None:
    """Over a tenth of a second, where rounding of 6000 km is small: ∫v dt = Δr."""
    a = np.linspace(1.0, 18.0, 8)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    for start in a:
        t = start + 0.05 + 0.05 * nodes
        moved = 0.05 * weights @ ecef(vibrating, t)[1]
        ends = ecef(vibrating, np.array([start, start + 0.1]))[0]
        assert np.abs(moved - (ends[1] - ends[0])).max() < 5e-9


@pytest.mark.parametrize(("rate_hz", "samples"), [(10.0, 1), *slow((200.0, 1), (10.0, 4), (200.0, 4))])
def test_increments_against_adaptive_quadrature(vibrating: Vibrating, rate_hz: float, samples: int) -> None:
    imu = vibrating.increments(rate_hz)
    knots = np.arange(-2.0, 22.0, 1.0 / 30.0)
    for k in np.linspace(len(imu) // 5, len(imu) - len(imu) // 5, samples).astype(int):
        inside = knots[(knots > imu.time[k] + 1e-9) & (knots < imu.time[k + 1] - 1e-9)]
        corners = np.concatenate([[imu.time[k]], inside, [imu.time[k + 1]]])
        integral = np.zeros(6)
        for a, b in pairwise(corners):
            integral += quad_vec(lambda t: np.concatenate(vibrating.rates(t)), a, b, epsabs=1e-14, epsrel=1e-13)[0]
        assert np.abs(imu.dtheta[k] - integral[:3]).max() < 1e-14
        assert np.abs(imu.dvel[k] - integral[3:]).max() < 3e-12  # ω̇ of `rates` is a difference


def test_closed_loop_through_the_navigator() -> None:
    """Error after 10 s of a vibrating flight: rounding at 1 kHz, and steeply up from there as the rate falls."""
    motion = Vibrating(GreatCircle(0.9, 0.3, 9000.0, 1.0, 250.0, 10.0), TONES)
    tilt = {}
    for rate_hz in (125.0, 250.0, 1000.0):
        imu = motion.increments(rate_hz)
        truth = motion.state(imu.time)
        error = navigation_error(truth, navigate(imu, motion.state(0.0)), motion.ellipsoid)
        tilt[rate_hz] = np.linalg.norm(error.attitude, axis=1).max()
        if rate_hz == 1000.0:
            assert np.abs(error.position_ned).max() < 1e-5
            assert np.abs(error.velocity_ned).max() < 1e-6
            assert tilt[rate_hz] < 2e-12
    assert tilt[125.0] / tilt[250.0] > 2.0**4


def test_noise_has_its_power_in_its_band() -> None:
    rms, low, high = 3e-3, 10.0, 30.0
    noise = band_noise("yaw", rms, low, high, 7)
    motion = Vibrating(Parked(0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 200.0), noise)
    t = np.arange(0.0, 200.0, 0.004)
    yaw = Rotation.from_quat(motion.state(t).q_nb, scalar_first=True).as_rotvec()[:, 2]
    assert np.sqrt(np.mean(yaw**2)) == pytest.approx(rms, rel=0.02)
    power = np.abs(np.fft.rfft(yaw * np.hanning(len(yaw)))) ** 2
    f = np.fft.rfftfreq(len(yaw), 0.004)
    assert power[(f < low - 0.1) | (f > high + 0.1)].sum() < 1e-6 * power.sum()
    assert 0.45 < power[(f > low) & (f < 20.0)].sum() / power.sum() < 0.55
    kurtosis = np.mean(yaw**4) / np.mean(yaw**2) ** 2
    assert kurtosis == pytest.approx(3.0, rel=0.0, abs=0.15)  # nearly Gaussian


def test_noise_is_reproducible_and_independent() -> None:
    assert band_noise("yaw", 1.0, 1.0, 2.0, 7) == band_noise("yaw", 1.0, 1.0, 2.0, 7)
    assert band_noise("yaw", 1.0, 1.0, 2.0, 7) != band_noise("yaw", 1.0, 1.0, 2.0, 8)
    assert band_noise("yaw", 1.0, 1.0, 2.0, 7)[0].phase != band_noise("roll", 1.0, 1.0, 2.0, 7)[0].phase


def test_bad_input() -> None:
    parked = Parked(*PLACE, Q, 3.0)
    with pytest.raises(InputError, match="Did you mean 'pitch'"):
        Vibrating(parked, [Tone("pich", 1.0, 1.0)])
    with pytest.raises(InputError, match="tone 1 on yaw"):
        Vibrating(parked, [Tone("yaw", np.nan, 1.0)])
    with pytest.raises(InputError, match="the band must begin"):
        band_noise("yaw", 1.0, 2.0, 1.0, 0)
    with pytest.raises(InputError, match="Known: down"):
        band_noise("up", 1.0, 1.0, 2.0, 0)


def test_the_phases_of_noise_are_those_of_a_whole_turn() -> None:
    """4000 phases: a quarter of them in each quadrant, within 4σ."""
    phases = np.array([tone.phase for tone in band_noise("roll", 1e-3, 5.0, 50.0, seed=3, count=4000)])
    quarters = np.bincount((phases // (0.5 * np.pi)).astype(int), minlength=4)
    np.testing.assert_allclose(quarters, 1000.0, rtol=0, atol=4.0 * np.sqrt(4000 * 0.25 * 0.75))
