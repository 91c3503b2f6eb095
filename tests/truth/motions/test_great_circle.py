"""Great-circle flight against differences, spherical trigonometry, adaptive quadrature and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.spatial.transform import Rotation

from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError
from sinssim.sensors.aiding_sensor import state_at
from sinssim.truth import sampling
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.oracles import integrator as oracle
from tests.truth.motions import ecef

V, H = 250.0, 9000.0
SPIN = np.array([0.0, 0.0, oracle.OMEGA])


FLIGHTS = {
    "oblique": (0.6, 0.2, 1.0),
    "equator": (0.0, -1.0, np.pi / 2),
    "over the north pole": (np.radians(89.0), 0.3, 0.0),
    "past the south pole": (np.radians(-89.0), 0.3, 3.1),
    "from the pole": (np.pi / 2, 0.4, 1.0),
}


@pytest.fixture(params=FLIGHTS.values(), ids=FLIGHTS.keys())
def flight(request: pytest.FixtureRequest) -> GreatCircle:
    return GreatCircle(request.param[0], request.param[1], H, request.param[2], V, 1800.0)


def test_constant_height_and_speed(flight: GreatCircle) -> None:
    s = flight.state(np.linspace(0.0, 1800.0, 901))
    assert np.abs(s.height - H).max() < 5e-9
    assert np.abs(np.linalg.norm(s.velocity_ned, axis=1) - V).max() < 1e-12
    assert np.abs(s.velocity_ned[:, 2]).max() < 1e-10


def test_the_bits_of_a_state_do_not_depend_on_how_many_are_asked_for(
    flight: GreatCircle, monkeypatch: pytest.MonkeyPatch
) -> None:
    t, arm = np.linspace(0.0, 1800.0, 1001), (1.0, 2.0, 3.0)
    whole = flight.state(t), state_at(flight, t, arm)
    monkeypatch.setattr(sampling, "_PART", 100)
    for before, now in zip(whole, (flight.state(t), state_at(flight, t, arm)), strict=True):
        for name, values in vars(now).items():
            np.testing.assert_array_equal(values, getattr(before, name))
    single = flight.state(t[517])
    assert (single.latitude, single.height) == (whole[0].latitude[517], whole[0].height[517])


def test_starts_where_it_was_told(flight: GreatCircle, request: pytest.FixtureRequest) -> None:
    latitude, longitude, course = next(v for k, v in FLIGHTS.items() if f"[{k}]" in request.node.name)
    s = flight.state(0.0)
    assert abs(float(s.latitude) - latitude) < 1e-15
    assert abs(float(s.longitude) - longitude) < 1e-12
    heading = Rotation.from_quat(s.q_nb, scalar_first=True).as_euler("ZYX")
    assert np.abs(heading - [course, 0.0, 0.0]).max() < 1e-12


def test_vertical_stays_on_the_circle_and_attitude_level(flight: GreatCircle) -> None:
    t = np.linspace(0.0, 1800.0, 901)
    s = flight.state(t)
    down = oracle.ned_axes(s.latitude, s.longitude)[:, 2]
    c_eb = ecef(flight, t)[2]
    pole = c_eb[0, :, 1]
    assert np.abs(down @ pole).max() < 1e-14  # the vertical stays on the circle,
    assert np.abs(c_eb[:, :, 2] - down).max() < 1e-14  # the vehicle level,
    assert np.abs(c_eb[:, :, 1] - pole).max() < 1e-14  # and its right wing points one way


def test_velocity_rates_and_force_by_differences(flight: GreatCircle) -> None:
    t, h = np.linspace(30.0, 1770.0, 201), 10.0

    def difference(values: list[np.ndarray]) -> np.ndarray:
        p = values
        return (45.0 * (p[3] - p[2]) - 9.0 * (p[4] - p[1]) + (p[5] - p[0])) / (60.0 * h)

    r, v, c_eb = ecef(flight, t)
    around = [ecef(flight, t + k * h) for k in (-3, -2, -1, 1, 2, 3)]
    assert np.abs(difference([p[0] for p in around]) - v).max() < 1e-9
    turn = [(Rotation.from_matrix(c_eb).inv() * Rotation.from_matrix(p[2])).as_rotvec() for p in around]
    omega, force = flight.rates(t)
    assert np.abs(omega - difference(turn) - np.einsum("nji,j->ni", c_eb, SPIN)).max() < 1e-16 * 5
    gravitation = np.array([oracle.gravitation(*row, oracle.ZONAL) for row in r])
    f_e = difference([p[1] for p in around]) + 2.0 * np.cross(SPIN, v) - gravitation
    f_e += np.cross(SPIN, np.cross(SPIN, r))
    assert np.abs(force - np.einsum("nji,nj->ni", c_eb, f_e)).max() < 3e-13


def test_increments_against_adaptive_quadrature(flight: GreatCircle) -> None:
    imu = flight.increments(0.1)
    for k in (0, 179):
        integral, _ = quad_vec(lambda t: np.concatenate(flight.rates(t)), imu.time[k], imu.time[k + 1], epsabs=1e-13)
        assert np.abs(imu.dtheta[k] - integral[:3]).max() < 1e-17
        assert np.abs(imu.dvel[k] - integral[3:]).max() < 1e-12  # of 98 m/s
    fast = flight.increments(10.0)
    assert np.abs(fast.dvel.reshape(-1, 100, 3).sum(axis=1) - imu.dvel).max() < 1e-12


def test_over_the_pole_and_down_the_other_side() -> None:
    """A meridian flight passes the pole when the meridian's arc is flown, and comes out on the other side."""
    latitude, longitude = np.radians(89.5), np.radians(30.0)
    flight = GreatCircle(latitude, longitude, 0.0, 0.0, 100.0, 1200.0)
    # the arc of half a degree at the pole has the polar radius of curvature a²/b, to (0.5°)² e²
    quarter = np.linspace(latitude, np.pi / 2, 2001)
    e2 = oracle.F * (2.0 - oracle.F)
    radius = oracle.A * (1.0 - e2) / (1.0 - e2 * np.sin(quarter) ** 2) ** 1.5
    arc = np.trapezoid(radius, quarter)
    passing = arc / 100.0
    before, at, after = (flight.state(passing + d) for d in (-100.0, 0.0, 100.0))
    assert abs(np.pi / 2 - float(at.latitude)) * radius[-1] < 1e-3
    assert abs(float(before.latitude) - float(after.latitude)) * radius[-1] < 1e-3
    assert abs(float(before.longitude) - longitude) < 1e-12
    assert abs(float(after.longitude) - (longitude - np.pi)) < 1e-12
    assert np.abs(before.velocity_ned - [100.0, 0.0, 0.0]).max() < 1e-9
    assert np.abs(after.velocity_ned - [-100.0, 0.0, 0.0]).max() < 1e-9
    heading = Rotation.from_quat(after.q_nb, scalar_first=True).as_euler("ZYX")[0]
    assert abs(abs(heading) - np.pi) < 1e-12


def test_on_the_equator_in_closed_form() -> None:
    """Eastward on the equator: a circle of radius a + h in inertial space."""
    flight = GreatCircle(0.0, 0.0, H, np.pi / 2, V, 600.0)
    omega, force = flight.rates([0.0, 300.0])
    radius = oracle.A + H
    inertial = V / radius + oracle.OMEGA
    gravitation = -oracle.gravitation(radius, 0.0, 0.0, oracle.ZONAL)[0]
    assert np.abs(omega - [0.0, -inertial, 0.0]).max() < 1e-19
    assert np.abs(force - [0.0, 0.0, inertial**2 * radius - gravitation]).max() < 2e-14
    assert abs(float(flight.state(600.0).longitude) - V * 600.0 / radius) < 1e-15


def test_on_a_sphere_it_is_spherical_trigonometry() -> None:
    """With almost no flattening: latitude by the sine rule, course by Clairaut's relation."""
    ball = Ellipsoid("ball", oracle.A, 1e-12, oracle.GM)
    latitude, course = 0.6, 1.0
    flight = GreatCircle(latitude, 0.2, H, course, V, 7200.0, ellipsoid=ball)
    t = np.linspace(0.0, 7200.0, 73)
    s = flight.state(t)
    arc = V * t / (oracle.A + H)
    expected = np.arcsin(np.sin(latitude) * np.cos(arc) + np.cos(latitude) * np.sin(arc) * np.cos(course))
    assert np.abs(s.latitude - expected).max() < 1e-11
    azimuth = np.arctan2(s.velocity_ned[:, 1], s.velocity_ned[:, 0])
    assert np.abs(np.sin(azimuth) * np.cos(s.latitude) - np.sin(course) * np.cos(latitude)).max() < 1e-11


@pytest.mark.parametrize(
    ("start", "end"), [((0.6, 0.2), (0.9, -1.4)), ((1.2, 0.0), (1.3, 3.0)), ((np.pi / 2, 0.0), (0.3, 2.0))]
)
def test_between_two_places(start: tuple[float, float], end: tuple[float, float]) -> None:
    flight = GreatCircle.between(start, end, H, V)
    first, last = flight.state(flight.start), flight.state(flight.end)
    assert abs(float(first.latitude) - start[0]) < 1e-14
    assert abs(float(last.latitude) - end[0]) < 1e-14
    assert abs(float(last.longitude) - end[1]) < 1e-14
    assert V * flight.end < np.pi * (oracle.A + H)  # the shorter arc
    assert float(last.height) == pytest.approx(H, abs=5e-9)


def test_lever_arm_and_mounting() -> None:
    """Rigid-body kinematics of a block 20 m ahead, 5 m to the right and 3 m up, turned in its mounting."""
    arm = np.array([20.0, 5.0, -3.0])
    mounting = Rotation.from_euler("ZYX", [10.0, 20.0, 30.0], degrees=True)
    t = np.linspace(1.0, 1799.0, 51)
    bare = GreatCircle(1.2, 0.3, H, 0.8, V, 1800.0)
    armed = GreatCircle(1.2, 0.3, H, 0.8, V, 1800.0, arm, mounting.as_quat(scalar_first=True))
    r, v, c_eb = ecef(bare, t)
    rs, vs, c_es = ecef(armed, t)
    omega_eb = bare.rates(t)[0] - np.einsum("nji,j->ni", c_eb, SPIN)
    assert np.abs(rs - (r + c_eb @ arm)).max() < 5e-9
    assert np.abs(vs - (v + np.einsum("nij,nj->ni", c_eb, np.cross(omega_eb, arm)))).max() < 1e-11
    assert np.abs(c_es - c_eb @ mounting.as_matrix()).max() < 1e-14
    # force: that of the point, less the change of gravitation, plus the arm's own acceleration in inertial space
    omega, force = bare.rates(t)
    h = 1.0
    growth = (bare.rates(t + h)[0] - bare.rates(t - h)[0]) / (2.0 * h)
    change = np.array(
        [
            np.array(oracle.gravitation(*a, oracle.ZONAL)) - np.array(oracle.gravitation(*b, oracle.ZONAL))
            for a, b in zip(rs, r, strict=True)
        ]
    )
    expected = force + np.cross(growth, arm) + np.cross(omega, np.cross(omega, arm))
    expected -= np.einsum("nji,nj->ni", c_eb, change)
    assert np.abs(armed.rates(t)[1] - mounting.inv().apply(expected)).max() < 1e-12
    assert np.abs(armed.rates(t)[0] - mounting.inv().apply(omega)).max() < 1e-18


def test_independent_integration_over_the_pole() -> None:
    flight = GreatCircle(np.radians(88.0), 0.3, H, 0.01, V, 1800.0)
    imu = flight.increments(10.0)
    position, velocity, c_eb = ecef(flight, imu.time)
    q0 = Rotation.from_matrix(c_eb[0]).as_quat(scalar_first=True)
    r, _, c = oracle.integrate(imu.time, imu.dtheta, imu.dvel, position[0], velocity[0], q0)
    down = c_eb[:, :, 2]
    difference = r - position
    horizontal = difference - np.einsum("ni,ni->n", difference, down)[:, None] * down
    assert np.linalg.norm(horizontal, axis=1).max() < 1e-6
    assert Rotation.from_matrix(np.swapaxes(c_eb, 1, 2) @ c).magnitude().max() < 1e-12


def test_standing_still_is_allowed() -> None:
    flight = GreatCircle(0.5, 0.1, 0.0, 0.7, 0.0, 10.0)
    omega, _ = flight.rates(5.0)
    assert abs(np.linalg.norm(omega) - oracle.OMEGA) < 1e-19
    assert np.all(flight.state(5.0).velocity_ned == 0.0)


def test_bad_input() -> None:
    with pytest.raises(InputError, match="latitude = 91°"):
        GreatCircle(np.radians(91.0), 0.0, 0.0, 0.0, 100.0, 10.0)
    with pytest.raises(InputError, match="speed = -1"):
        GreatCircle(0.0, 0.0, 0.0, 0.0, -1.0, 10.0)
    with pytest.raises(InputError, match="duration = nan"):
        GreatCircle(0.0, 0.0, 0.0, 0.0, 100.0, np.nan)
    with pytest.raises(InputError, match="coincide or are antipodal"):
        GreatCircle.between((0.3, 0.1), (-0.3, 0.1 + np.pi), H, V)
    with pytest.raises(InputError, match="must be positive and finite"):
        GreatCircle.between((0.3, 0.1), (0.3, 0.2), H, 0.0)
    with pytest.raises(InputError, match="gravity model"):
        GreatCircle(0.0, 0.0, 0.0, 0.0, 100.0, 10.0, gravity="flat")
