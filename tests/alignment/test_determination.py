"""Eq. (1) on ideal readings, and what it does with readings that determine nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.alignment import InstrumentErrors, determine, ideal_readings, paper_axes
from sinssim.alignment.determination import doubt, solve
from sinssim.alignment.parked_theory import Angles
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.units import DEG_H, PPM, UG

G = 9.81


def printed_readings(K, gamma, theta, phi, U, g):
    """Eqs. (3) and (4) as they are printed, one vehicle at a time, X right, Y forward, Z up."""
    sK, cK, sg, cg = math.sin(K), math.cos(K), math.sin(gamma), math.cos(gamma)
    st, ct, sf, cf = math.sin(theta), math.cos(theta), math.sin(phi), math.cos(phi)
    rate = [
        U * (cf * (-sK * cg + cK * st * sg) - sf * ct * sg),
        U * (cf * cK * ct + sf * st),
        U * (cf * (-sK * sg - cK * st * cg) + sf * ct * cg),
    ]
    return rate, [-g * ct * sg, g * st, g * ct * cg]


def printed_determination(w, a):
    """Eq. (1) with the arcsines as printed, K in [-pi/2, 3pi/2)."""
    (wx, wy, wz), (ax, ay, az) = w, a
    gm, um = math.sqrt(ax**2 + ay**2 + az**2), math.sqrt(wx**2 + wy**2 + wz**2)
    A = (wx * az - wz * ax) * gm
    B = wy * (ax**2 + az**2) - (wx * ax + wz * az) * ay
    K0 = -math.asin(A / math.hypot(A, B))
    return (
        K0 if B >= 0 else math.pi - K0,
        -math.asin(ax / math.hypot(ax, az)),
        math.asin(ay / gm),
        math.asin((wx * ax + wy * ay + wz * az) / (gm * um)),
    )


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def test_axes_conversion_is_a_rotation_with_the_stated_axes():
    forward, right, down = np.eye(3)
    np.testing.assert_array_equal(paper_axes(right), [1, 0, 0])  # X right
    np.testing.assert_array_equal(paper_axes(forward), [0, 1, 0])  # Y forward
    np.testing.assert_array_equal(paper_axes(-down), [0, 0, 1])  # Z up
    assert np.linalg.det(paper_axes(np.eye(3))) == pytest.approx(1.0)  # both triads are right-handed
    np.testing.assert_array_equal(paper_axes(paper_axes([1.0, 2.0, 3.0])), [1, 2, 3])


@pytest.mark.parametrize(
    ("heading", "roll", "pitch", "forward_right_down"),
    [
        (0.0, 0.0, 0.0, (1.0, 0.0, -1.0)),  # level, to the north, at 45 deg: north part forward, up part against down
        (90.0, 0.0, 0.0, (0.0, -1.0, -1.0)),  # to the east: north is to the left
        (180.0, 0.0, 0.0, (-1.0, 0.0, -1.0)),
        (0.0, 90.0, 0.0, (1.0, -1.0, 0.0)),  # right wing down: up is to the left
        (0.0, 0.0, 45.0, (math.sqrt(2.0), 0.0, 0.0)),  # nose up along the Earth's axis
    ],
)
def test_ideal_rate_in_attitudes_that_need_no_formula(heading, roll, pitch, forward_right_down):
    gyro, accel = ideal_readings(*np.radians([heading, roll, pitch]), np.radians(45.0), gravity=G)
    np.testing.assert_allclose(gyro, OMEGA_IE / math.sqrt(2.0) * np.array(forward_right_down), rtol=0, atol=1e-19)
    assert np.linalg.norm(accel) == pytest.approx(G)


def test_ideal_readings_are_the_printed_equations():
    rng = np.random.default_rng(1)
    for K, gamma, theta, phi in zip(*(rng.uniform(-1, 1, (4, 200)).T * [3.1, 3.1, 1.57, 1.57]).T, strict=True):
        rate, force = printed_readings(K, gamma, theta, phi, OMEGA_IE, G)
        gyro, accel = ideal_readings(K, gamma, theta, phi, gravity=G)
        np.testing.assert_allclose(paper_axes(gyro), rate, rtol=0, atol=1e-15 * OMEGA_IE)
        np.testing.assert_allclose(paper_axes(accel), force, rtol=0, atol=1e-15 * G)


def test_default_gravity_is_normal_gravity_on_the_ellipsoid():
    latitude = np.radians([0.0, 45.0, 90.0])
    _, accel = ideal_readings(0.3, 0.1, 0.2, latitude)
    # WGS-84 normal gravity at the equator, 45 deg and the poles (NIMA TR8350.2 and Moritz 2000)
    np.testing.assert_allclose(np.linalg.norm(accel, axis=-1), [9.7803253359, 9.8061977694, 9.8321849379], rtol=1e-9)


def test_determination_is_exact_in_every_quadrant_up_to_89_9_degrees():
    heading = np.radians(np.r_[0.0:360.0:15.0, 0.001, 89.999, 90.001, 179.999, 180.001, 270.001, 359.999])
    roll = np.radians([-179.0, -135.0, -90.0, -89.9, -30.0, 0.0, 1e-6, 45.0, 90.0, 120.0, 180.0])
    pitch = np.radians([-89.9, -89.0, -45.0, -1e-6, 0.0, 10.0, 60.0, 89.9])
    latitude = np.radians([-89.9, -80.0, -45.0, -1e-6, 0.0, 30.0, 50.0, 89.9])
    K, gamma, theta, phi = np.meshgrid(heading, roll, pitch, latitude, indexing="ij")
    result = determine(*ideal_readings(K, gamma, theta, phi, gravity=G))
    assert result.warnings == ()
    assert np.abs(wrapped(result.heading - K)).max() < 1e-9
    assert np.abs(wrapped(result.roll - gamma)).max() < 1e-9
    assert np.abs(result.pitch - theta).max() < 1e-9
    assert np.abs(result.latitude - phi).max() < 1e-9
    np.testing.assert_allclose(result.earth_rate, OMEGA_IE, rtol=1e-14)
    np.testing.assert_allclose(result.gravity, G, rtol=1e-14)
    assert result.heading.min() >= 0.0
    assert result.heading.max() < 2 * np.pi


def test_arctangent_forms_agree_with_the_printed_arcsines_on_any_readings():
    rng = np.random.default_rng(2)
    K, gamma, theta, phi = rng.uniform([0, -1.5, -1.2, -1.2], [2 * np.pi, 1.5, 1.2, 1.2], (500, 4)).T
    gyro, accel = ideal_readings(K, gamma, theta, phi, gravity=G)
    gyro, accel = gyro * (1 + 0.02 * rng.standard_normal((500, 3))), accel * (1 + 0.01 * rng.standard_normal((500, 3)))
    result = determine(gyro, accel)
    for i in range(500):
        printed = printed_determination(paper_axes(gyro[i]), paper_axes(accel[i]))
        mine = (result.heading[i], result.roll[i], result.pitch[i], result.latitude[i])
        np.testing.assert_allclose(wrapped(np.subtract(mine, printed)), 0.0, rtol=0, atol=2e-13)


def test_no_printed_range_is_left_at_tiny_negative_headings():
    assert determine(*ideal_readings(-1e-18, 0.0, 0.0, 0.5)).heading < 2 * np.pi


def test_one_vehicle_gives_numbers_and_many_give_arrays():
    assert determine(*ideal_readings(1.0, 0.1, 0.2, 0.9)).heading.shape == ()
    assert determine(*ideal_readings(1.0, 0.1, np.zeros((4, 1)), np.full(5, 0.9))).latitude.shape == (4, 5)


def test_heading_is_marked_at_the_pole_and_the_rest_stays():
    result = determine(*ideal_readings([0.3, 0.3], 0.1, 0.2, np.radians([90.0, 50.0])))
    assert np.isnan(result.heading[0])
    np.testing.assert_allclose(
        [result.heading[1], *result.roll, *result.pitch], [0.3, 0.1, 0.1, 0.2, 0.2], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(result.latitude, np.radians([90.0, 50.0]), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(result.undetermined.heading, [True, False])
    (text,) = result.warnings
    assert "element [0]" in text
    assert "latitude 90.000" in text


@pytest.mark.parametrize("pitch", [90.0, -90.0, 89.97])
def test_heading_and_roll_are_marked_with_a_vertical_axis(pitch):
    result = determine(*ideal_readings(0.3, 0.1, np.radians(pitch), 0.8))
    assert np.isnan(result.heading)
    assert np.isnan(result.roll)
    assert result.pitch == pytest.approx(np.radians(pitch), abs=1e-12)
    assert result.latitude == pytest.approx(0.8, abs=1e-12)
    assert "vertical" in result.warnings[0]


def test_gyros_that_do_not_find_the_earth_rate_leave_roll_and_pitch():
    gyro, accel = ideal_readings(0.3, 0.1, 0.2, 0.8)
    result = determine(gyro + 20 * DEG_H, accel)
    assert np.isnan(result.heading)
    assert np.isnan(result.latitude)
    assert result.roll == pytest.approx(0.1, abs=1e-12)
    found = np.linalg.norm(gyro + 20 * DEG_H) / DEG_H
    assert f"{found:.4g} deg/h" in result.warnings[0]


def test_expected_accuracy_marks_what_the_instruments_cannot_determine():
    laser = InstrumentErrors(0.01 * DEG_H, 10 * PPM, 50 * UG, 50 * PPM)
    readings = ideal_readings(0.3, 0.0, 0.0, np.radians([50.0, 89.9, 89.945]))
    np.testing.assert_array_equal(determine(*readings).undetermined.heading, [False, False, False])
    result = determine(*readings, sigmas=laser)
    np.testing.assert_array_equal(np.isnan(result.heading), [False, False, True])  # 0.01 deg/h of 0.0144 deg/h
    assert not np.isnan(result.latitude).any()
    assert "standard deviation" in result.warnings[0]


GYRO, ACCEL = ideal_readings(0.3, 0.1, 0.2, 0.8)


def test_of_several_wrong_readings_the_first_is_named():
    gyro = np.stack([GYRO, 1.5 * GYRO, 1.7 * GYRO])
    (warning,) = determine(gyro, np.stack([ACCEL] * 3)).warnings
    assert f"{1.5 * OMEGA_IE / DEG_H:.4g} deg/h" in warning


@pytest.mark.parametrize(
    ("gyro", "accel", "text"),
    [
        (np.zeros(3), ACCEL, "gyros read zero"),
        (GYRO, np.zeros(3), "accelerometers read zero"),
        (GYRO * [1, np.nan, 1], ACCEL, "NaN"),
        (GYRO, ACCEL * [1, 1, np.inf], "infinity"),
        (GYRO, ACCEL / 9.80665, "1.00"),  # in g
        (GYRO, ACCEL / 0.3048, "32.1"),  # in ft/s²
        (np.degrees(GYRO) * 3600, ACCEL, "rad/s"),  # in deg/h
        (GYRO + 0.1, ACCEL, "the vehicle turned"),
        (GYRO[:2], ACCEL, "shape (2,)"),
        (np.stack([GYRO] * 4), np.stack([ACCEL] * 5), "do not fit"),
        ("north", ACCEL, "not an array of numbers"),
        (np.stack([GYRO, GYRO]), np.stack([ACCEL, 0.5 * ACCEL]), "element [1]"),
        (np.stack([GYRO, GYRO * [np.nan, 1, 1]]), np.stack([ACCEL] * 2), "NaN or infinity (element [1])"),
    ],
)
def test_unusable_readings_are_refused_with_what_was_found(gyro, accel, text):
    with pytest.raises(InputError) as info:
        determine(gyro, accel)
    assert text in str(info.value)
    assert "\n" not in str(info.value)


def test_what_a_parked_vehicle_may_read() -> None:
    """9.3 to 10.3 m/s² and 1000 deg/h, the bounds included; the first reading beyond is named."""
    down = np.array([0.0, 0.0, -1.0])
    for fits, beyond in ((9.3, 9.29), (10.3, 10.31)):
        assert determine(GYRO, fits * down).gravity == fits
        with pytest.raises(InputError, match=rf"is {beyond} m/s² \(element \[1\]\)"):
            determine(GYRO, np.stack([fits * down, beyond * down]))
    assert determine(1000.0 * DEG_H * down, ACCEL).earth_rate == 1000.0 * DEG_H
    with pytest.raises(InputError, match=r"is 1000.5 deg/h .*\(element \[1\]\)"):
        determine(np.stack([rate * DEG_H * down for rate in (1000.0, 1000.5, 2000.0)]), ACCEL)


@pytest.mark.parametrize(("part", "found"), [(0.749, False), (0.751, True), (1.249, True), (1.251, False)])
def test_the_earths_rate_is_found_within_a_quarter(part, found):
    assert np.isfinite(determine(part * GYRO, ACCEL).heading) == found


def test_thirty_degrees_are_the_largest_standard_deviation() -> None:
    determined = determine(GYRO, ACCEL)
    known = doubt(determined, Angles(*np.radians([29.9, 30.1, 29.9, 30.1])))
    assert [bool(flag) for flag in known.undetermined] == [False, True, False, True]
    assert [text[:8] for text in known.warnings] == ["the roll", "the lati"]


@pytest.mark.parametrize(
    ("angles", "text"),
    [
        ((0.0, 0.0, 1.6, 0.5), "pitch is 91.6732 deg"),
        ((0.0, 0.0, 0.5, [0.1, -1.6]), "latitude is -91.6732 deg (element [1])"),
        ((np.nan, 0.0, 0.5, 0.1), "heading is not a finite number"),
    ],
)
def test_angles_out_of_range_are_refused(angles, text):
    with pytest.raises(InputError) as info:
        ideal_readings(*angles)
    assert text in str(info.value)


def test_gravity_that_is_none_is_refused():
    with pytest.raises(InputError, match="gravity must be a positive"):
        ideal_readings(0.0, 0.0, 0.0, 0.5, gravity=-9.8)
    with pytest.raises(InputError, match=r"gravity must be a positive number of m/s² \(element \[1\]\)"):
        ideal_readings(0.0, 0.0, 0.0, 0.5, gravity=[9.8, -0.5, 9.8])


def test_zeros_have_no_sign_and_a_vehicle_upside_down_a_roll_of_plus_180_degrees():
    level, _, _ = solve([5e-5, 0.0, -5e-5], [0.0, 0.0, -9.81])
    assert [str(angle) for angle in (level.heading, level.roll)] == ["0.0", "0.0"]
    over, _, _ = solve([5e-5, 0.0, 5e-5], [0.0, 0.0, 9.81])
    assert (over.heading, over.roll) == (0.0, np.pi)


def test_why_an_angle_is_not_determined() -> None:
    """Each sentence, with the first element that it holds for, of four vehicles."""
    gyro, accel = ideal_readings(0.3, 0.1, np.radians([10.0, 10.0, 89.97, 10.0]), np.radians([40.0, 89.96, 40.0, 40.0]))
    gyro[3] *= 1.3
    found = determine(gyro, accel)
    assert found.warnings == (
        "heading and roll are not determined (element [2]): the longitudinal axis is vertical (pitch 89.970 deg).",
        "the heading is not determined (element [1]): at latitude 89.960 deg the Earth's rate has no horizontal part.",
        "heading and latitude are not determined (element [3]): the gyros read 19.55 deg/h, but the Earth turns at "
        "15.041 deg/h: their errors are too large, the vehicle turned, or their unit is wrong (for an array rad/s).",
    )
    flags = found.undetermined
    assert [flags.heading.tolist(), flags.roll.tolist(), flags.pitch.tolist(), flags.latitude.tolist()] == [
        [False, True, True, True], [False, False, True, False], [False] * 4, [False, False, False, True],
    ]  # fmt: skip
    for name in ("heading", "roll", "pitch", "latitude"):
        np.testing.assert_array_equal(np.isnan(getattr(found, name)), getattr(flags, name))
    doubted = doubt(
        found, Angles(np.radians(1.0), np.radians([1.0, 42.34, 50.0, 1.0]), np.radians(2.0), np.radians(3.0))
    )
    assert doubted.warnings[3:] == (
        "the roll is not determined (element [1]): with these instruments its standard deviation would be 42.3 deg.",
    )
    assert doubted.undetermined.roll.tolist() == [False, True, True, False]
    assert doubted.earth_rate is found.earth_rate
    assert doubted.gravity is found.gravity
