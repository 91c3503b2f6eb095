"""The references themselves, against published values, quadrature and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from tests.oracles.gravity import WGS84
from tests.oracles.s_turn import A_AXIS, E2, OMEGA_IE, STurn, meridian_arc
from tests.oracles.turntable import cone, spin, transposed_times


def ecef(latitude, longitude, height):
    normal = A_AXIS / np.sqrt(1 - E2 * np.sin(latitude) ** 2)
    rho = (normal + height) * np.cos(latitude)
    return np.stack(
        [rho * np.cos(longitude), rho * np.sin(longitude), (normal * (1 - E2) + height) * np.sin(latitude)], -1
    )


def about_z(v, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1], v[..., 2]], -1)


def c_en(latitude, longitude):
    sb, cb, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sb * cl, -sl, -cb * cl], [-sb * sl, cl, -cb * sl], [cb, 0.0, -sb]])


def matrix(q):
    a, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * a * cross + 2 * cross @ cross


def hamilton(a, b):
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def test_gravity_series_has_the_published_constants():
    # NIMA TR8350.2 (2000), tables 3.1 to 3.4
    assert float(WGS84.j2) == pytest.approx(0.484166774985e-3 * np.sqrt(5), rel=2e-12)
    _, down = WGS84.north_down(np.array([0.0, np.pi / 2]), np.zeros(2))
    # to a unit of the last published digit: the table cuts 9.83218493786 to 9.8321849378
    assert down == pytest.approx([9.7803253359, 9.8321849378], abs=1e-10)
    assert float(WGS84.potential(np.array([WGS84.a]), np.zeros(1, np.longdouble))[0]) == pytest.approx(
        62636851.7146, abs=6e-5
    )


def test_gravity_series_field_is_level_on_the_ellipsoid_and_is_the_gradient():
    latitude = np.linspace(-1.55, 1.55, 41)
    rho, z = WGS84.meridian_point(latitude, np.zeros(41))
    potential = WGS84.potential(rho, z)
    assert float(np.ptp(potential) / potential[0]) < 1e-17
    north, _ = WGS84.north_down(latitude, np.zeros(41))
    assert np.max(np.abs(north)) < 1e-17
    rho, z = WGS84.meridian_point(latitude, np.full(41, 25e3))
    g_rho, g_z = WGS84.gravity(rho, z)
    step = np.longdouble(50.0)
    for direction, value in (((step, 0), g_rho), ((0, step), g_z)):
        dr, dz = direction
        wide = WGS84.potential(rho + 2 * dr, z + 2 * dz) - WGS84.potential(rho - 2 * dr, z - 2 * dz)
        near = WGS84.potential(rho + dr, z + dz) - WGS84.potential(rho - dr, z - dz)
        np.testing.assert_allclose(np.float64((8 * near - wide) / (12 * step)), np.float64(value), atol=1e-12, rtol=0)


def test_meridian_arc():
    assert meridian_arc(np.array(np.pi / 2)) == pytest.approx(10001965.7293, abs=5e-5)  # quadrant of WGS-84
    for latitude in (0.3, 0.9, 1.4):
        arc, _ = quad(lambda x: A_AXIS * (1 - E2) / (1 - E2 * np.sin(x) ** 2) ** 1.5, 0, latitude, epsrel=1e-12)
        assert meridian_arc(np.array(latitude)) == pytest.approx(arc, abs=2e-8)


def test_s_turn_northing_and_bank():
    turn = STurn()
    northing, _ = quad(lambda t: float(turn.velocity_ned(np.array(t))[0]), 0, 100, epsrel=1e-12, limit=200)
    assert turn.northing(np.array(100.0)) == pytest.approx(northing, abs=1e-7)
    roll, _, _ = turn.euler(np.arange(0, 30, 0.01))
    assert np.rad2deg([roll.min(), roll.max()]) == pytest.approx([-45, 45], abs=1e-4)


def test_s_turn_specific_force_is_the_second_difference_of_inertial_position():
    turn = STurn(duration=60)
    flight = turn.fly(2)
    r_i = about_z(ecef(flight.latitude, flight.longitude, flight.height), OMEGA_IE * flight.time)
    weights = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]) / 0.5**2
    for k in range(10, 110, 9):
        acceleration = weights @ r_i[k - 4 : k + 5]
        lat, lon = flight.latitude[k], flight.longitude[k]
        to_i = c_en(lat, lon + OMEGA_IE * flight.time[k])
        north, down = turn.gravity(np.array(lat), turn.height)
        gravity_i = to_i @ np.array([north, 0.0, down])
        centrifugal = OMEGA_IE**2 * r_i[k] * [1, 1, 0]
        force = (to_i @ matrix(flight.q_nb[k])).T @ (acceleration - gravity_i + centrifugal)
        _, expected = turn.rates(flight.time[k])
        # 8th-order difference: truncation (Ωh)⁸·g·8/… < 2e-9, rounding of positions 1e-9 m / h²
        np.testing.assert_allclose(force, expected, atol=4e-8, rtol=0)


def test_s_turn_rates_lead_back_to_its_truth():
    """DOP853 on attitude, velocity and position in the inertial frame, driven by the rates alone."""
    turn = STurn(duration=120)
    flight = turn.fly(10)

    def geodetic(r):
        rho = np.hypot(r[0], r[1])
        latitude = np.arctan2(r[2], rho * (1 - E2))
        for _ in range(12):
            normal = A_AXIS / np.sqrt(1 - E2 * np.sin(latitude) ** 2)
            latitude = np.arctan2(r[2] + E2 * normal * np.sin(latitude), rho)
        normal = A_AXIS / np.sqrt(1 - E2 * np.sin(latitude) ** 2)
        return latitude, np.arctan2(r[1], r[0]), rho / np.cos(latitude) - normal

    def slope(t, y):
        rate, force = turn.rates(np.array(t))
        q, v, r = y[:4], y[4:7], y[7:]
        latitude, right_ascension, height = geodetic(r)
        north, down = turn.gravity(np.array(latitude), height)
        gravity = c_en(latitude, right_ascension) @ np.array([north, 0.0, down])
        return np.concatenate(
            [
                hamilton(q, np.array([0.0, *rate])) / 2,
                matrix(q) @ force + gravity - OMEGA_IE**2 * r * [1, 1, 0],
                v,
            ]
        )

    def inertial(k):
        t, lat, lon = flight.time[k], flight.latitude[k], flight.longitude[k]
        axes = c_en(lat, lon + OMEGA_IE * t)
        r = about_z(ecef(lat, lon, flight.height[k]), OMEGA_IE * t)
        return axes @ matrix(flight.q_nb[k]), axes @ flight.velocity_ned[k] + np.cross([0, 0, OMEGA_IE], r), r

    attitude, v0, r0 = inertial(0)
    trace = np.trace(attitude)
    q0 = np.array(
        [
            1 + trace,
            attitude[2, 1] - attitude[1, 2],
            attitude[0, 2] - attitude[2, 0],
            attitude[1, 0] - attitude[0, 1],
        ]
    )
    start = np.concatenate([q0 / np.linalg.norm(q0), v0, r0])
    end = solve_ivp(slope, (0, 120), start, method="DOP853", rtol=1e-12, atol=1e-12, max_step=1.0).y[:, -1]
    attitude, velocity, position = inertial(-1)
    np.testing.assert_allclose(matrix(end[:4] / np.linalg.norm(end[:4])), attitude, atol=1e-11, rtol=0)
    np.testing.assert_allclose(end[4:7], velocity, atol=1e-8, rtol=0)
    np.testing.assert_allclose(end[7:], position, atol=1e-6, rtol=0)


def test_s_turn_increments_are_converged():
    """Sums of samples equal the integrals of longer ones: 100 Hz against 25 Hz, five nodes each."""
    turn = STurn(duration=8)
    fine, coarse = turn.fly(100), turn.fly(25)
    np.testing.assert_allclose(fine.dtheta.reshape(-1, 4, 3).sum(axis=1), coarse.dtheta, atol=1e-16, rtol=1e-14)
    np.testing.assert_allclose(fine.dvel.reshape(-1, 4, 3).sum(axis=1), coarse.dvel, atol=1e-15, rtol=1e-14)
    np.testing.assert_allclose(fine.longitude[::4], coarse.longitude, atol=1e-15, rtol=0)


def test_turntable_rates_are_the_derivative_of_its_attitude():
    start = np.array([0.5, -0.5, 0.1, 0.7])
    start /= np.linalg.norm(start)
    h = 1e-3
    for motion in (cone(0.3, 2.0), spin(np.array([0.4, -1.0, 0.2]), start)):
        for t in (0.0, 1.3, 7.7):
            near, wide = (motion(np.array(t + k * h))[0] - motion(np.array(t - k * h))[0] for k in (1, 2))
            q, rate = motion(np.array(t))
            q_dot = (8 * near - wide) / (12 * h)
            np.testing.assert_allclose(hamilton(q * [1, -1, -1, -1], q_dot), [0, *rate / 2], atol=1e-11, rtol=0)
            np.testing.assert_allclose(transposed_times(q, rate), matrix(q).T @ rate, atol=1e-15, rtol=0)
