"""Alignment on a disturbed base, on vehicles whose sway is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenarios.support.swaying import Sway, Swaying
from sinssim import rotation
from sinssim.alignment import Attitude, align_disturbed, error_budget, expected_errors, mean_readings, total
from sinssim.alignment.determination import solve
from sinssim.alignment.disturbed_base import (
    ConeFit,
    _check_stayed,
    _determination,
    _starts,
    _turn_about_vertical,
    cone_jacobian,
    inertial_curve,
    mean_blocks,
)
from sinssim.alignment.parked_theory import RANDOM_WALK_FACTOR
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCSEC, DEG_H

LATITUDE, HEADING = np.radians(50.0), np.radians(40.0)
LASER = Imu(grade="laser-standard")


def sways(seed):
    """Four sinusoids a coordinate at 0.1-1 Hz that reach ±0.5° of attitude and ±2 cm of heave together."""
    rng = np.random.default_rng(seed)
    return [
        Sway(name, size / 4, frequency, phase)
        for name, size in (("roll", 0.5), ("pitch", 0.5), ("heading", 0.5), ("down", 0.02))
        for size in ((np.radians(size) if name != "down" else size),)
        for frequency, phase in zip(np.exp(rng.uniform(*np.log([0.1, 1.0]), 4)), rng.uniform(0, 6.28, 4), strict=True)
    ]


@pytest.fixture(scope="module")
def vehicle():
    return Swaying(LATITUDE, 0.3, 0.0, 0.02, 0.03, HEADING, 300.0, sways(0))


@pytest.fixture(scope="module")
def ideal(vehicle):
    return vehicle.increments(50.0)


def angles_at(vehicle, time):
    roll, pitch, heading = rotation.euler_from_quaternion(vehicle.state(time).q_nb)
    return np.array([heading, roll, pitch])


def found(alignment):
    d = alignment.determination
    return np.array([d.heading, d.roll, d.pitch])


def test_attitude_in_the_inertial_frame_follows_the_truth(vehicle, ideal):
    q, velocity = inertial_curve(ideal)

    def inertial(t):
        state = vehicle.state(t)
        c_en = Rotation.from_euler("ZY", [0.3, -LATITUDE - np.pi / 2])  # of the mean place: within 5e-9 rad
        return Rotation.from_rotvec([0, 0, OMEGA_IE * t]) * c_en * Rotation.from_quat(state.q_nb, scalar_first=True)

    closed = inertial(0.0).inv() * inertial(300.0)
    assert (closed.inv() * Rotation.from_quat(q[-1], scalar_first=True)).magnitude() < 2e-8
    assert np.linalg.norm(velocity[-1]) == pytest.approx(9.81 * 300.0, rel=1e-2)


def test_coning_and_sculling_are_integrated_to_fourth_order():
    """Rotations and displacements at one frequency: without the sculling or the coning term the order is 2."""
    moving = Swaying(
        LATITUDE,
        0.3,
        0.0,
        0.02,
        0.03,
        1.0,
        20.0,
        [
            Sway(name, 0.05, 1.0, phase)
            for name, phase in (("roll", 0.3), ("pitch", 1.8), ("east", 0.2), ("north", 1.1))
        ],
    )
    q_end, v_end = (x[-1] for x in inertial_curve(moving.increments(800.0)))
    ends = [inertial_curve(moving.increments(rate)) for rate in (20.0, 40.0)]
    turns = [np.linalg.norm(q[-1] - q_end) for q, _ in ends]
    velocities = [np.linalg.norm(v[-1] - v_end) for _, v in ends]
    for coarse, fine in (turns, velocities):
        assert 3.7 < np.log2(coarse / fine) < 4.3
    assert velocities[0] < 3e-4  # m/s after 20 s; a missing sculling term makes it 3e-3


def test_perfect_instruments_leave_only_what_the_sway_adds(vehicle, ideal):
    alignment = align_disturbed(ideal)
    assert np.abs(found(alignment) - angles_at(vehicle, 300.0)).max() < 0.01 * ARCSEC
    assert abs(alignment.determination.latitude - LATITUDE) < 0.1 * ARCSEC
    assert alignment.determination.gravity == pytest.approx(9.810702, rel=1e-6)  # normal gravity at 50°
    assert alignment.determination.warnings == ()
    # the residual is the heave's own velocity
    heave = np.sqrt(
        sum((s.amplitude * 2 * np.pi * s.frequency_hz) ** 2 / 2 for s in sways(0) if s.coordinate == "down")
    )
    assert alignment.residual == pytest.approx(heave, rel=0.2)


def test_laser_gyros_align_on_the_swaying_base_as_theory_says_and_eq_1_does_not(vehicle, ideal):
    """Heading within twice the quiet base's σ; eq. (1) on the same data is degrees off."""
    runs = 25
    truth, errors, latitudes, means = angles_at(vehicle, 300.0), [], [], []
    for seed in range(runs):
        imu = emulate(ideal, LASER, seed)
        alignment = align_disturbed(imu)
        errors.append(found(alignment) - truth)
        latitudes.append(alignment.determination.latitude - LATITUDE)
        means.append(solve(*mean_readings(imu))[0].heading - HEADING)
    attitude, sigma = Attitude(truth[0], truth[1], truth[2]), expected_errors(LASER).sigma
    quiet = total(error_budget(attitude, LATITUDE, sigma, 300.0))
    predicted = total(error_budget(attitude, LATITUDE, sigma, 300.0, method="disturbed"))
    band = 4 / np.sqrt(2 * runs)
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    assert spread[0] < 2 * quiet.heading
    np.testing.assert_allclose(spread, [predicted.heading, predicted.roll, predicted.pitch], rtol=band)
    assert np.sqrt(np.mean(np.square(latitudes))) == pytest.approx(predicted.latitude, rel=band)
    assert np.abs(means).mean() > 20 * quiet.heading


def test_the_fit_weighs_a_rate_by_30_x2_1_x2_and_random_walk_by_ten_sevenths():
    """One pulse of the east gyro's angle after another, and what it moves the heading by."""
    ideal = Parked(LATITUDE, 0.3, 0.0, rotation.quaternion_from_euler(0.0, 0.0, 0.0), 300.0).increments(4.0)
    undisturbed = align_disturbed(ideal, LATITUDE).determination.heading
    pulse, weights, x = 1e-6, [], (np.arange(40) + 0.5) / 40
    for at in x:
        dtheta = ideal.dtheta.copy()
        dtheta[int(at * len(ideal)), 1] += pulse
        heading = align_disturbed(ImuData(ideal.time, dtheta, ideal.dvel), LATITUDE).determination.heading
        moved = (heading - undisturbed + np.pi) % (2 * np.pi) - np.pi
        weights.append(-moved * OMEGA_IE * np.cos(LATITUDE) / (pulse / 300.0))  # of eq. (1) all are 1
    np.testing.assert_allclose(weights, 30 * x**2 * (1 - x) ** 2, rtol=0, atol=0.02)
    # independent increments of angle add up by the squares of their weights
    assert np.mean(np.square(weights)) == pytest.approx(RANDOM_WALK_FACTOR, rel=0.01)


@pytest.mark.parametrize("latitude", [-80.0, -50.0, -10.0, 10.0, 35.0, 80.0])
def test_latitude_and_its_sign_come_from_the_session(latitude):
    q_nb = rotation.quaternion_from_euler(0.1, -0.2, 4.0)
    imu = Parked(np.radians(latitude), 0.3, 0.0, q_nb, 300.0).increments(5.0)
    alignment = align_disturbed(imu)
    assert np.degrees(alignment.determination.latitude) == pytest.approx(latitude, abs=1e-4)
    np.testing.assert_allclose(found(alignment), [4.0, 0.1, -0.2], rtol=0, atol=1e-7)


def test_any_attitude_but_the_vertical_one():
    for roll, pitch in ((3.0, 0.5), (-1.6, -1.2)):
        q_nb = rotation.quaternion_from_euler(roll, pitch, 1.0)
        np.testing.assert_allclose(
            found(align_disturbed(Parked(LATITUDE, 0.3, 0.0, q_nb, 300.0).increments(5.0))),
            [1.0, roll, pitch],
            rtol=0,
            atol=1e-7,
        )
    q_nb = rotation.quaternion_from_euler(0.0, np.pi / 2, 1.0)
    d = align_disturbed(Parked(LATITUDE, 0.3, 0.0, q_nb, 300.0).increments(5.0)).determination
    assert np.isnan(d.heading)
    assert np.isnan(d.roll)
    assert d.pitch == pytest.approx(np.pi / 2, abs=1e-6)


def test_on_the_equator_the_latitude_is_marked_and_the_heading_stays():
    imu = Parked(0.0, 0.3, 0.0, rotation.quaternion_from_euler(0.0, 0.0, 1.0), 300.0).increments(5.0)
    d = align_disturbed(emulate(imu, LASER, 1)).determination
    assert np.isnan(d.latitude)
    assert d.heading == pytest.approx(1.0, abs=0.01)
    assert "equator" in d.warnings[0]
    assert align_disturbed(imu, 0.0).determination.warnings == ()


def test_at_the_pole_there_is_no_heading():
    imu = Parked(np.pi / 2, 0.3, 0.0, rotation.quaternion_from_euler(0.0, 0.0, 1.0), 300.0).increments(5.0)
    d = align_disturbed(emulate(imu, LASER, 1), np.pi / 2).determination
    assert np.isnan(d.heading)
    assert "no north" in d.warnings[0]


def test_a_vehicle_that_keeps_turning_cannot_tell_north_from_south():
    turning = Swaying(LATITUDE, 0.3, 0.0, 0.0, 0.0, 1.0, 300.0, [Sway("heading", np.radians(3.0), 1 / 1200)])
    d = align_disturbed(turning.increments(10.0)).determination
    assert np.isnan(d.heading)
    assert np.isnan(d.latitude)
    assert "give the latitude" in d.warnings[0]
    known = align_disturbed(turning.increments(10.0), LATITUDE)
    np.testing.assert_allclose(found(known), angles_at(turning, 300.0), rtol=0, atol=0.1 * ARCSEC)


def test_a_vehicle_that_drives_about_is_found_out():
    driven = Swaying(LATITUDE, 0.3, 0.0, 0.0, 0.0, 1.0, 300.0, [Sway("north", 100.0, 1 / 100)])  # to and fro
    with pytest.raises(InputError, match="travelled"):
        align_disturbed(driven.increments(10.0))


def test_gyros_that_cannot_see_the_earth_turn_are_refused(ideal):
    with pytest.raises(InputError, match="too large for an alignment"):
        align_disturbed(emulate(ideal, Imu(grade="consumer"), 1))
    with pytest.raises(InputError, match="at latitude 85 deg"):  # and a latitude that is wrong
        align_disturbed(ideal, np.radians(85.0))


@pytest.mark.parametrize(
    ("spoil", "latitude", "text"),
    [
        (
            lambda d: ImuData(d.time[:2001], d.dtheta[:2000], d.dvel[:2000]),
            None,
            "lasts 40 s; the cone that gravity describes needs at least 60 s",
        ),
        (lambda d: d, 2.0, "between -90 and 90"),
        (lambda d: ImuData(d.time, d.dtheta, 3 * d.dvel), None, "m/s²"),
        (lambda d: ImuData(d.time, d.dtheta * np.nan, d.dvel), None, "not a finite number"),
    ],
)
def test_unusable_sessions_are_refused(ideal, spoil, latitude, text):
    with pytest.raises(InputError) as info:
        align_disturbed(spoil(ideal), latitude)
    assert text in str(info.value)


def cone(t: np.ndarray, latitude: float, begin: float = 0.0) -> np.ndarray:
    """Integral of the vertical in i from `begin`, by small steps: (cosφ cos Ut, cosφ sin Ut, sinφ)."""
    total = np.zeros((len(t), 3))
    for row, end in enumerate(t):
        x, w = np.polynomial.legendre.leggauss(8)
        at = begin + 0.5 * (end - begin) * (x + 1.0)
        up = np.stack([np.cos(latitude) * np.cos(OMEGA_IE * at), np.cos(latitude) * np.sin(OMEGA_IE * at),
                       np.full(8, np.sin(latitude))])  # fmt: skip
        total[row] = 0.5 * (end - begin) * (up @ w)
    return total


C = Rotation.from_euler("ZYX", [0.7, -0.4, 1.9]).as_matrix()
TIMES = np.array([0.0, 40.0, 130.0, 300.0])


def test_residual_and_derivatives_of_the_fitted_curve() -> None:
    fit = ConeFit(C, 0.6, 9.81, np.array([0.3, -0.2, 0.1]))
    curve = fit.v0 + 9.81 * cone(TIMES, 0.6) @ C.T
    extra = np.arange(12.0).reshape(4, 3)
    np.testing.assert_allclose(fit.residual(TIMES, curve + extra), extra, rtol=0, atol=1e-9)

    def moved(k: int, step: float) -> np.ndarray:
        c = Rotation.from_rotvec(step * np.eye(8)[k, :3]).as_matrix() @ C
        latitude, gravity = 0.6 + step * (k == 3), 9.81 + step * (k == 4)
        return fit.v0 + step * np.eye(8)[k, 5:] + gravity * cone(TIMES, latitude) @ c.T

    for fixed in (False, True):
        found = cone_jacobian(fit, TIMES, fixed)
        for k in range(8):
            slope = (moved(k, 1e-5) - moved(k, -1e-5)) / 2e-5 * (0.0 if fixed and k == 3 else 1.0)
            np.testing.assert_allclose(found[:, :, k], slope, rtol=1e-7, atol=1e-6)


def test_blocks_are_means_of_times_and_velocities() -> None:
    """601 edges in 300 blocks: of two or three rows; 81 edges, each its own block."""
    for rows in (601, 81):
        time = 5.0 + np.arange(rows) ** 1.5
        imu = ImuData(time, np.zeros((rows - 1, 3)), np.zeros((rows - 1, 3)))
        velocity = np.random.default_rng(1).normal(size=(rows, 3))
        edges, t, v = mean_blocks(imu, velocity)
        assert edges[0] == 0
        assert edges[-1] == rows
        assert len(edges) == min(rows, 300) + 1
        assert set(np.diff(edges)) == ({2, 3} if rows == 601 else {1})
        for k in range(len(t)):
            own = slice(edges[k], edges[k + 1])
            np.testing.assert_allclose([t[k], *v[k]], [np.mean(time[own]) - 5.0, *velocity[own].mean(axis=0)])


@pytest.mark.parametrize(("v0", "bump", "found"), [
    ((0.6, -1.2, 1.4), (0.0, 0.0, 1.0), None),
    ((1.2, -1.6, 0.5), (0.0, 0.0, 2.0), "2.06 m/s at 7 s"),
    ((1.2, -1.6, 0.5), (-1.2, 1.6, 1.5), "2.5 m/s at 137 s"),
    ((0.1, 0.2, 0.2), (0.0, -2.01, 0.0), "2.01 m/s at 137 s"),
])  # fmt: skip
def test_of_a_vehicle_that_travelled_the_largest_speed_is_told(v0, bump, found) -> None:
    fit = ConeFit(C, 0.6, 9.81, np.array(v0))
    imu = ImuData(TIMES + 7.0, np.zeros((3, 3)), np.zeros((3, 3)))
    velocity = fit.v0 + 9.81 * cone(TIMES, 0.6) @ C.T
    velocity[2] += bump
    velocity[3] += np.array([0.0, 0.01, 0.0])
    if found is None:
        _check_stayed(fit, imu, velocity)
        return
    with pytest.raises(InputError) as info:
        _check_stayed(fit, imu, velocity)
    assert str(info.value) == (
        f"the vehicle travelled during the session: {found}, but a swaying base has less than 2 m/s; use a part of the "
        "session in which it stays at its place."
    )


def last_of(latitude: float, pitch: float = -0.3) -> tuple[ImuData, np.ndarray, ConeFit]:
    """A session of 300 s, its last attitude in ib0, and the cone of a block with heading 1.1, roll 0.4 at its end."""
    gyro = np.array([3e-5, -4e-5, 0.0])  # of a length of 5e-5 rad/s
    imu = ImuData(7.0 + np.arange(301.0), np.tile(gyro, (300, 1)), np.zeros((300, 3)))
    c_in = Rotation.from_euler("ZY", [OMEGA_IE * 300.0, -latitude - np.pi / 2])
    c_nb = Rotation.from_euler("ZYX", [1.1, pitch, 0.4])
    last = Rotation.from_euler("ZYX", [0.5, 0.2, -0.9])
    c = last * c_nb.inv() * c_in.inv()  # ib0 from b, b from n, n from i
    return imu, last.as_quat(scalar_first=True), ConeFit(c.as_matrix(), latitude, 9.83, np.zeros(3))


def test_the_determination_is_that_of_the_last_instant() -> None:
    imu, last, fit = last_of(0.6)
    d = _determination(imu, last, fit, OMEGA_IE * np.sin(0.6) * 1.49, free=True)
    np.testing.assert_allclose([d.heading, d.roll, d.pitch, d.latitude], [1.1, 0.4, -0.3, 0.6], rtol=0, atol=1e-12)
    assert (d.earth_rate, d.gravity) == (pytest.approx(5e-5, rel=1e-12), 9.83)
    assert not any(d.undetermined)
    assert d.warnings == ()


def test_what_is_not_determined_and_why() -> None:
    d = _determination(*last_of(-0.6), OMEGA_IE * np.sin(-0.6) - 5.0 * DEG_H, free=True)
    assert list(map(bool, d.undetermined)) == [True, False, False, True]
    assert np.isnan([d.heading, d.latitude]).all()
    np.testing.assert_allclose([d.roll, d.pitch], [0.4, -0.3])
    assert d.warnings == (
        # 15.041 deg/h sin 0.6 = 8.493 deg/h
        "heading and latitude are not determined: the vehicle turned about the vertical at -13.5 deg/h, but the "
        "Earth's rate gives -8.49 or 8.49 deg/h, so that north and south latitude cannot be distinguished; give the "
        "latitude.",
    )
    assert _determination(*last_of(-0.6), 5.0 * DEG_H, free=False).warnings == ()
    d = _determination(*last_of(np.radians(4.9)), 0.0, free=True)
    assert list(map(bool, d.undetermined)) == [False, False, False, True]
    assert d.warnings == (
        "the latitude is not determined: within 5 deg of the equator gravity's cone hardly depends on it; give the "
        "latitude if it is known.",
    )
    d = _determination(*last_of(np.radians(-89.96)), 0.0, free=False)
    assert list(map(bool, d.undetermined)) == [True, False, False, False]
    assert d.warnings == ("the heading is not determined: at latitude -89.960 deg there is no north.",)
    d = _determination(*last_of(0.6, np.radians(-89.97)), 0.0, free=False)
    assert list(map(bool, d.undetermined)) == [True, True, False, False]
    assert d.warnings == (
        "heading and roll are not determined: the longitudinal axis is vertical (pitch -89.970 deg).",
    )


@pytest.mark.parametrize("turn", [-2e-5, 5e-5])
def test_the_turn_about_the_vertical_is_the_slope_of_the_angle(turn: float) -> None:
    """A steady turn about the plumb line of the first instant, and a sway at right angles to it."""
    _, _, fit = last_of(0.6)
    up = fit.c @ [np.cos(0.6), 0.0, np.sin(0.6)]
    across = np.cross(up, [0.3, 0.5, -0.8])
    t = np.linspace(0.0, 300.0, 31)
    attitude = rotation.quaternion_from_rotation_vector(np.outer(turn * t, up) + np.outer(1e-3 * np.sin(t), across))
    assert _turn_about_vertical(t, attitude, fit) == pytest.approx(turn, rel=1e-9)


@pytest.mark.parametrize("latitude", [None, 0.6])
def test_what_the_cone_must_open_to(latitude: float | None) -> None:
    """A parabola whose second derivative is g times 20 deg/h across: more than the Earth's 15.04 (12.41 at 0.6 rad)."""
    t = np.linspace(10.0, 290.0, 15)
    v = np.outer(t, [0.0, 0.0, 9.8]) + 0.5 * np.outer(t**2, [9.8 * 20.0 * DEG_H, 0.0, 0.0])
    with pytest.raises(InputError) as info:
        _starts(t, v, latitude)
    earth = (
        "the Earth makes it turn at most 15.04" if latitude is None
        else "the Earth at latitude 34.4 deg makes it turn at 12.41"
    )  # fmt: skip
    assert str(info.value) == (
        f"the measured gravity turns in inertial space at 20 deg/h, but {earth} deg/h: the gyros' errors are too large "
        "for an alignment, or the vehicle travelled."
    )


def test_where_the_fit_begins() -> None:
    """Up along a, east along b: 10 deg/h is cosφ = 10/15.041; both hemispheres, or the given one."""
    t = np.linspace(10.0, 290.0, 15)
    v = np.array([0.3, 0.2, -0.1]) + np.outer(t, [0.0, 0.0, 9.8]) + 0.5 * np.outer(t**2, [9.8 * 10.0 * DEG_H, 0.0, 0.0])
    size = np.arccos(10.0 / (OMEGA_IE / DEG_H))
    for latitude, expected in ((None, [size, -size]), (0.7, [0.7])):
        starts = _starts(t, v, latitude)
        assert [one.latitude for one in starts] == pytest.approx(expected, rel=1e-9)
        for one in starts:
            # east x, north y, up z of ib0: axes cosφ up − sinφ north, east, sinφ up + cosφ north
            s, c = np.sin(one.latitude), np.cos(one.latitude)
            np.testing.assert_allclose(one.c, np.array([[0, 1, 0], [-s, 0, c], [c, 0, s]]), rtol=0, atol=1e-9)
            assert one.gravity == pytest.approx(9.8, rel=1e-9)
            np.testing.assert_allclose(one.v0, [0.3, 0.2, -0.1], rtol=1e-7)
