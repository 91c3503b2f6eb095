"""Analytic motions against differences, adaptive quadrature, published drift formulas and elementary integrals."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, quad_vec
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.truth.motions.analytic import AnalyticMotion, OnEarth, inertial_increments
from sinssim.truth.motions.coning_and_rocking import Sculling, SpinCone, SpinRock, classical_cone
from sinssim.truth.motions.multirotor import MultirotorMotion
from sinssim.truth.motions.turntable import Dwell, RotationTable, Turn
from sinssim.truth.motions.walk import WalkMotion
from tests.oracles import integrator as oracle
from tests.slow import slow

Array = np.ndarray
SPIN = np.array([0.0, 0.0, oracle.OMEGA])
DEG = np.pi / 180.0

TABLE = RotationTable(
    [
        Dwell(0.5),
        Turn((1.0, 0.0, 0.0), 90.0 * DEG, 60.0 * DEG, 0.3),
        Turn((0.0, 1.0, 1.0), -45.0 * DEG, 40.0 * DEG, 0.2, "trapezoidal"),
        Dwell(0.25),
        Turn((0.0, 0.0, -2.0), 200.0 * DEG, 150.0 * DEG, 0.5),
    ]
)
MOTIONS: dict[str, AnalyticMotion] = {
    "cone": classical_cone(1.0 * DEG, 2.0 * np.pi * 5.0),
    "wide cone": classical_cone(50.0 * DEG, 3.0),
    "spin-cone": SpinCone(0.3, 2.0 * np.pi, 7.0),
    "sculling": Sculling(0.02, 3e-3, 2.0 * np.pi * 8.0),
    "wild sculling": Sculling(1.5, 0.2, 5.0),
    "spin-rock": SpinRock([1.0, 2.0, -0.5], 0.7, 0.4, 2.0 * np.pi, [0.3, -0.2, 0.1]),
    "rock": SpinRock([0.0, 0.0, 1.0], 0.0, 0.1, 20.0),
    "table": TABLE,
    "walk": WalkMotion.model_validate(
        {"type": "walk", "legs": [{"type": "turn", "angle_deg": 70.0}, {"type": "straight", "distance_m": 2.5}]}
    ).motion(seed=5),
    "multirotor": MultirotorMotion.model_validate(
        {
            "type": "multirotor",
            "acceleration_mps2": 4.0,
            "speed_mps": 4.0,
            "climb_mps": 4.0,
            "drag_per_s": 0.3,
            "legs": [
                {"type": "take_off", "height_m": 2.0},
                {"type": "orbit", "angle_deg": 80.0, "radius_m": 3.0},
                {"type": "fly_to", "north_m": 8.0, "east_m": 1.0, "height_m": 3.0},
            ],
        }
    ).motion(),
}
DURATION = 4.0


@pytest.fixture(params=MOTIONS.values(), ids=MOTIONS.keys())
def motion(request: pytest.FixtureRequest) -> AnalyticMotion:
    return request.param


def on_earth(motion: AnalyticMotion, duration: float = DURATION, latitude: float = 0.8) -> OnEarth:
    q_nm = Rotation.from_euler("ZYX", [0.7, 0.3, -0.4]).as_quat(scalar_first=True)
    return OnEarth(motion, latitude, 0.5, 150.0, q_nm, duration)


def difference(values: list[Array], h: float) -> Array:
    """Seventh-point central difference, sixth order."""
    p = values
    return (45.0 * (p[3] - p[2]) - 9.0 * (p[4] - p[1]) + (p[5] - p[0])) / (60.0 * h)


def smooth_instants(motion: AnalyticMotion, count: int, margin: float) -> Array:
    t = np.linspace(0.1, DURATION - 0.1, count)
    near = np.abs(t[:, None] - motion.breaks[None, :]) if len(motion.breaks) else np.ones((count, 1))
    return t[near.min(axis=1) > margin]


def test_rates_are_those_of_the_attitude(motion: AnalyticMotion) -> None:
    h = 0.02 / motion.fastest
    t = smooth_instants(motion, 97, 4.0 * h)
    here = Rotation.from_quat(motion.attitude(t), scalar_first=True)
    around = [Rotation.from_quat(motion.attitude(t + k * h), scalar_first=True) for k in (-3, -2, -1, 1, 2, 3)]
    rate = difference([(here.inv() * r).as_rotvec() for r in around], h)
    assert np.abs(rate - motion.rate(t)).max() < 1e-12 * motion.fastest


def test_velocity_and_acceleration_are_those_of_the_position(motion: AnalyticMotion) -> None:
    h = 0.02 / motion.fastest
    t = smooth_instants(motion, 97, 4.0 * h)
    around = [motion.place(t + k * h) for k in (-3, -2, -1, 1, 2, 3)]
    r, v, a = motion.place(t)
    size = max(np.abs(r).max(), 1e-30)
    assert np.abs(difference([p[0] for p in around], h) - v).max() < 1e-12 * motion.fastest * size
    assert np.abs(difference([p[1] for p in around], h) - a).max() < 1e-12 * motion.fastest**2 * size


@pytest.mark.parametrize("rate_hz", [3.0, *slow(100.0)])
def test_closed_forms_against_adaptive_quadrature(motion: AnalyticMotion, rate_hz: float) -> None:
    """The integrals of rate and specific force, in inertial space."""
    imu = inertial_increments(motion, rate_hz, DURATION)

    def readings(t: float) -> Array:
        at = np.array([t])
        c_bm = Rotation.from_quat(motion.attitude(at)[0], scalar_first=True).inv()
        return np.concatenate([motion.rate(at)[0], c_bm.apply(motion.place(at)[2][0])])

    for k in np.linspace(0, len(imu) - 1, 3).astype(int):
        inside = [b for b in motion.breaks if imu.time[k] < b < imu.time[k + 1]]
        corners = [imu.time[k], *inside, imu.time[k + 1]]
        integral = sum(quad_vec(readings, a, b, epsabs=1e-15, epsrel=1e-13)[0] for a, b in pairwise(corners))
        assert np.abs(imu.dtheta[k] - integral[:3]).max() < 1e-15 + 1e-14 * motion.fastest / rate_hz
        scale = np.abs(motion.place(imu.time)[2]).max() / rate_hz
        assert np.abs(imu.dvel[k] - integral[3:]).max() <= 1e-16 + 3e-14 * scale


def test_increments_on_the_earth_against_adaptive_quadrature(motion: AnalyticMotion) -> None:
    trajectory = on_earth(motion)
    for rate_hz in (4.0, 100.0):
        imu = trajectory.increments(rate_hz)
        for k in (len(imu) // 2, len(imu) - 1):
            inside = [b for b in motion.breaks if imu.time[k] < b < imu.time[k + 1]]
            corners = [imu.time[k], *inside, imu.time[k + 1]]
            integral = sum(
                quad_vec(lambda t: np.concatenate(trajectory.rates(t)), a, b, epsabs=1e-15, epsrel=1e-13)[0]
                for a, b in pairwise(corners)
            )
            assert np.abs(imu.dtheta[k] - integral[:3]).max() < 1e-15 + 1e-14 * motion.fastest / rate_hz
            assert np.abs(imu.dvel[k] - integral[3:]).max() < 1e-13 * 30.0 / rate_hz


def test_specific_force_by_differences_of_the_velocity(motion: AnalyticMotion) -> None:
    """Newton's law in Earth-fixed axes with gravitation from a zonal series."""
    trajectory = on_earth(motion)

    def ecef(t: Array) -> tuple[Array, Array, Array]:
        s = trajectory.state(t)
        c_en = np.swapaxes(oracle.ned_axes(s.latitude, s.longitude), -1, -2)
        r = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
        return r, np.einsum("nij,nj->ni", c_en, s.velocity_ned), c_en @ oracle.matrix(s.q_nb)

    h = 0.05 / max(motion.fastest, 1.0)
    t = smooth_instants(motion, 51, 4.0 * h)
    r, v, c_eb = ecef(t)
    around = [ecef(t + k * h) for k in (-3, -2, -1, 1, 2, 3)]
    omega, force = trajectory.rates(t)
    turn = [(Rotation.from_matrix(c_eb).inv() * Rotation.from_matrix(p[2])).as_rotvec() for p in around]
    spin_b = np.einsum("nji,j->ni", c_eb, SPIN)
    assert np.abs(omega - spin_b - difference(turn, h)).max() < 1e-9 * max(motion.fastest, 1.0)
    gravitation = np.array([oracle.gravitation(*row, oracle.ZONAL) for row in r])
    f_e = difference([p[1] for p in around], h) + 2.0 * np.cross(SPIN, v) - gravitation
    f_e += np.cross(SPIN, np.cross(SPIN, r))
    size = 1.0 + np.abs(v).max() * motion.fastest
    assert np.abs(force - np.einsum("nji,nj->ni", c_eb, f_e)).max() < 3e-10 * size
    # the velocity is the derivative of the position, to the rounding of six thousand kilometres
    assert np.abs(difference([p[0] for p in around], h) - v).max() < 4e-9 / h


def test_cone_is_the_textbook_cone() -> None:
    """The rotation vector has constant length and goes round at the cone's frequency."""
    alpha, w = 2.0 * DEG, 11.0
    t = np.linspace(0.0, 3.0, 77)
    phi = Rotation.from_quat(classical_cone(alpha, w).attitude(t), scalar_first=True).as_rotvec()
    assert np.abs(phi - alpha * np.stack([0.0 * t, np.cos(w * t), np.sin(w * t)], axis=1)).max() < 1e-15
    mean = classical_cone(alpha, w).rate(t).mean(axis=0)[0]
    assert mean == pytest.approx(-w * (1.0 - math.cos(alpha)), rel=1e-12)


def test_cone_feels_gravity_in_closed_form() -> None:
    """f = −C_bm g for a cone about the vertical's normal, each element an elementary integral."""
    alpha, w, rate = 0.2, 9.0, 25.0
    trajectory = OnEarth(classical_cone(alpha, w), 0.8, 0.5, 150.0, [1.0, 0.0, 0.0, 0.0], 4.0)
    imu = trajectory.increments(rate)
    still = OnEarth(RotationTable([]), 0.8, 0.5, 150.0, [1.0, 0.0, 0.0, 0.0], 4.0)
    omega_n, force_n = still.rates(0.0)
    a, b = imu.time[:-1], imu.time[1:]
    h, s, c = b - a, np.sin(alpha), np.cos(alpha)
    sw, cw = (np.cos(w * a) - np.cos(w * b)) / w, (np.sin(w * b) - np.sin(w * a)) / w  # ∫sin, ∫cos
    s2 = (np.cos(2 * w * a) - np.cos(2 * w * b)) / (4 * w)  # ∫sin cos
    c2 = h / 2 + (np.sin(2 * w * b) - np.sin(2 * w * a)) / (4 * w)  # ∫cos²
    # C_mb of the rotation vector α (0, cos, sin): n nᵀ (1 − c) + c I + s [n×]
    c_mb = np.array(
        [
            [c * h, -s * sw, s * cw],
            [s * sw, c2 + c * (h - c2), s2 * (1 - c)],
            [-s * cw, s2 * (1 - c), (h - c2) + c * c2],
        ]
    )
    assert np.abs(imu.dvel - np.einsum("jin,j->ni", c_mb, force_n)).max() < 2e-15
    own = inertial_increments(classical_cone(alpha, w), rate, 4.0).dtheta
    assert np.abs(imu.dtheta - own - np.einsum("jin,j->ni", c_mb, omega_n)).max() < 1e-17


def test_sculling_rectifies_by_the_bessel_function() -> None:
    from scipy.special import jv

    theta, d, f = 0.1, 2e-3, 20.0
    w = 2.0 * np.pi * f
    imu = inertial_increments(Sculling(theta, d, w), 400.0, 3.0)
    assert imu.dvel.sum(axis=0)[2] == pytest.approx(3.0 * jv(1, theta) * d * w * w, rel=1e-12)
    # to first order ½ θ₀ D Ω² (Savage 1998, part 2)
    assert imu.dvel.sum(axis=0)[2] == pytest.approx(3.0 * 0.5 * theta * d * w * w, rel=theta**2 / 7.0)
    # and a single interval against adaptive quadrature of the textbook's expression
    force = quad(lambda t: d * w * w * math.sin(w * t) * math.sin(theta * math.sin(w * t)), 0.0025, 0.005, epsabs=0)[0]
    assert imu.dvel[1, 2] == pytest.approx(force, rel=1e-13)


def test_spin_and_cone_compose_as_euler_angles() -> None:
    t = np.linspace(0.0, 2.0, 41)
    c = Rotation.from_quat(SpinCone(0.4, 2.0, 5.0).attitude(t), scalar_first=True)
    expected = Rotation.from_euler("XYX", np.stack([2.0 * t, 0.4 + 0.0 * t, 5.0 * t], axis=1))
    assert (c.inv() * expected).magnitude().max() < 1e-14


def test_table_goes_where_it_was_told() -> None:
    """Angles, durations and the smoothness of both profiles."""
    turns = [(([1, 0, 0]), 90.0), ([0, 1, 1], -45.0), ([0, 0, -2], 200.0)]
    expected = Rotation.identity()
    for axis, angle in turns:
        expected = expected * Rotation.from_rotvec(np.radians(angle) * np.array(axis) / np.linalg.norm(axis))
    last = Rotation.from_quat(TABLE.attitude(np.array([TABLE.duration, 100.0])), scalar_first=True)
    assert (last.inv() * expected).magnitude().max() < 1e-15
    seconds = 0.5 + (90 / 60 + 0.3) + (45 / 40 + 0.2) + 0.25 + (200 / 150 + 0.5)
    assert TABLE.duration == pytest.approx(seconds, rel=1e-15)
    t = np.array([0.2, 0.65, 1.2, 3.0, 2.3 + 0.1])
    rates = np.linalg.norm(TABLE.rate(t), axis=1) / DEG
    # still; half-way up a smooth ramp; full rate; full rate; half-way up a linear ramp
    assert rates == pytest.approx([0.0, 30.0, 60.0, 40.0, 20.0], rel=0.0, abs=1e-12)
    assert np.abs(TABLE.rate(TABLE.breaks)[0]).max() == 0.0
    # a ramp is half a wave: of 60°/s and 0.3 s, 40°/s and 0.2 s, 150°/s and 0.5 s, the second is the quickest
    assert TABLE.fastest == pytest.approx(40.0 * DEG + np.pi / 0.2)


@pytest.mark.parametrize(("samples", "alpha", "phase"), [(1, 1.0, 0.2), (2, 1.0, 0.2), (3, 0.1, 0.2), (4, 0.03, 0.3)])
def test_coning_drift_of_the_n_sample_algorithms(samples: int, alpha: float, phase: float) -> None:
    """ε = α²Ω (Ωh)²ⁿ n!/(2ⁿ⁺¹ (2n+1)!!): the residual of the coning-optimal algorithms (Ignagni 1990, Park 1999).

    The corrections are written out here; nothing but the increments comes from the package. The cones are so narrow
    that triple products, which the formula leaves out, weigh less than a hundredth.
    """
    weights = {1: [], 2: [2 / 3], 3: [9 / 20, 27 / 20], 4: [54 / 105, 92 / 105, 214 / 105]}[samples]
    half_angle, omega = alpha * DEG, 2.0 * np.pi * 5.0
    h = phase / omega
    count = 2000 * samples
    imu = inertial_increments(classical_cone(half_angle, omega), 1.0 / h, count * h)
    theta = imu.dtheta.reshape(-1, samples, 3)
    phi = theta.sum(axis=1)
    for i, weight in enumerate(weights):
        phi = phi + weight * np.cross(theta[:, i], theta[:, -1])
    q = Rotation.from_quat(classical_cone(half_angle, omega).attitude(imu.time[::samples]), scalar_first=True)
    # what each step leaves over, in the axes of m; its mean is the drift
    left_over = (q[:-1].apply(phi) - q[:-1].apply((q[:-1].inv() * q[1:]).as_rotvec())) / (samples * h)
    drift = left_over.mean(axis=0)[0]
    double_factorial = math.prod(range(1, 2 * samples + 2, 2))
    expected = half_angle**2 * omega * phase ** (2 * samples)
    expected *= math.factorial(samples) / (2 ** (samples + 1) * double_factorial)
    assert abs(drift) == pytest.approx(expected, rel=0.015)


def test_independent_integration_comes_back() -> None:
    """A cone of 2 Hz on the Earth, integrated at 400 Hz by code that knows nothing of it."""
    trajectory = on_earth(classical_cone(2.0 * DEG, 2.0 * np.pi * 2.0), 6.0)
    imu = trajectory.increments(400.0)
    s = trajectory.state(imu.time)
    c_en = np.swapaxes(oracle.ned_axes(s.latitude, s.longitude), -1, -2)
    c_eb = c_en @ oracle.matrix(s.q_nb)
    position = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    q0 = Rotation.from_matrix(c_eb[0]).as_quat(scalar_first=True)
    r, v, c = oracle.integrate(imu.time, imu.dtheta, imu.dvel, position[0], np.zeros(3), q0)
    assert np.abs(r - position).max() < 1e-6
    assert np.abs(v).max() < 1e-7
    assert Rotation.from_matrix(np.swapaxes(c_eb, 1, 2) @ c).magnitude().max() < 1e-9


def test_at_the_pole() -> None:
    trajectory = on_earth(classical_cone(2.0 * DEG, 10.0), latitude=np.pi / 2)
    imu = trajectory.increments(50.0)
    assert np.linalg.norm(trajectory.rates(1.0)[1]) == pytest.approx(9.8317, rel=0.0, abs=1e-4)
    assert np.isfinite(imu.dvel).all()


def test_bad_input() -> None:
    with pytest.raises(InputError, match="latitude = 95°"):
        on_earth(classical_cone(0.1, 1.0), latitude=95.0 * DEG)
    with pytest.raises(InputError, match=r"duration = -1\.0 must be one positive number, s"):
        on_earth(classical_cone(0.1, 1.0), -1.0)
    with pytest.raises(InputError, match="gravity model"):
        OnEarth(classical_cone(0.1, 1.0), 0.0, 0.0, 0.0, [1, 0, 0, 0], 1.0, gravity="flat")
    with pytest.raises(InputError, match="lies outside"):
        on_earth(classical_cone(0.1, 1.0)).state(5.0)
    with pytest.raises(InputError, match="not all zero"):
        SpinRock([0.0, 0.0, 0.0], 1.0, 0.1, 1.0)
    with pytest.raises(InputError, match=r"step 2 .* never reaches 60°/s"):
        RotationTable([Dwell(1.0), Turn((1, 0, 0), 10.0 * DEG, 60.0 * DEG, 1.0)])
    with pytest.raises(InputError, match=r"step 1 .* dwell of 0\.0 s must be positive"):
        RotationTable([Dwell(0.0)])
    with pytest.raises(InputError, match="Did you mean 'smooth'"):
        RotationTable([Turn((1, 0, 0), 1.0, 1.0, 0.1, "smoth")])
    with pytest.raises(InputError, match="axis"):
        RotationTable([Turn((0, 0, 0), 1.0, 1.0, 0.1)])
    with pytest.raises(InputError, match="ramp"):
        RotationTable([Turn((1, 0, 0), 1.0, 1.0, 0.0)])
