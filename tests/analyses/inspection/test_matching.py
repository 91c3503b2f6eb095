"""The match of readings and fixes in parts, against closed forms and the drive whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sinssim import earth, rotation
from sinssim.analyses.inspection.clock_offset import coarse_offset, even_times
from sinssim.analyses.inspection.gnss_findings import velocity_delay
from sinssim.analyses.inspection.quiet_spans import motion_of
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact
from sinssim.analyses.inspection.stream_inspection import _apart, _mounting_finding
from sinssim.analyses.inspection.unit_axes import (
    Mounting,
    _mean_direction,
    _named,
    attitude_by_match,
    attitude_finding,
    mounting,
)
from sinssim.analyses.inspection.velocity_match import Match, Pushed, Seen, match, pushed, scatter, seen
from sinssim.data import Array
from sinssim.logs.recorded_streams import FixStream
from tests.analyses.inspection import worlds

_OMEGA = 7.292115e-5


def test_the_inertial_curve_of_a_steady_turn() -> None:
    """Turning by w about z with the force (f, g, h), α is the integral of the turning vector, and Θ that of C."""
    w, (f, g, h) = 0.4, (2.0, -3.0, -9.5)
    time = 5.0 + 0.002 * np.arange(2001)
    curve = pushed(time, np.tile((0.0, 0.0, w), (2001, 1)), np.tile((f, g, h), (2001, 1)))
    t = time - 5.0
    s, c = np.sin(w * t) / w, (1.0 - np.cos(w * t)) / w
    assert curve.time == pytest.approx(time)
    assert curve.q_b0b == pytest.approx(
        np.column_stack([np.cos(0.5 * w * t), 0.0 * t, 0.0 * t, np.sin(0.5 * w * t)]), abs=1e-9
    )
    assert curve.alpha == pytest.approx(np.column_stack([f * s - g * c, f * c + g * s, h * t]), abs=1e-5)
    theta = np.zeros((2001, 3, 3))
    theta[:, 0, 0] = theta[:, 1, 1] = s
    theta[:, 1, 0], theta[:, 0, 1], theta[:, 2, 2] = c, -c, t
    assert curve.by_accel_bias == pytest.approx(theta, abs=1e-5)
    joined = pushed(time, np.tile((0.0, 0.0, w), (2001, 1)), np.tile((f, g, h), (2001, 1)), 50.0)
    assert joined.time == pytest.approx(time[::10])
    assert joined.alpha == pytest.approx(curve.alpha[::10], abs=1e-3)


def test_biases_act_as_the_curve_says() -> None:
    """Readings without a small bias give a curve that differs by G b − Θ b."""
    rng = np.random.default_rng(2)
    time = 0.01 * np.arange(800)
    rate = 0.3 * np.cumsum(rng.normal(0.0, 0.02, (800, 3)), axis=0)
    force = np.array((1.0, -2.0, -9.0)) + np.cumsum(rng.normal(0.0, 0.05, (800, 3)), axis=0)
    of_gyro, of_accel = np.array((2e-6, -3e-6, 5e-6)), np.array((4e-5, 3e-5, -2e-5))
    curve = pushed(time, rate, force)
    by_gyro = pushed(time, rate - of_gyro, force).alpha - curve.alpha
    assert by_gyro == pytest.approx(curve.by_gyro_bias @ of_gyro, rel=1e-3, abs=2e-8)
    by_accel = pushed(time, rate, force - of_accel).alpha - curve.alpha
    assert by_accel == pytest.approx(-curve.by_accel_bias @ of_accel, rel=1e-3, abs=2e-8)


def _parked(**other: object) -> FixStream:
    time = 50.0 + 2.0 * np.arange(30)
    full = np.full(30, 1.0)
    given = FixStream(
        time, 0.8 * full, -1.3 * full, 700.0 * full, "ellipsoid", velocity_ned=np.zeros((30, 3)),
        velocity_sigma=np.tile((0.03, 0.04, 0.07), (30, 1)),
    )  # fmt: skip
    return replace(given, **other)  # type: ignore[arg-type]


def _turned(vector: Array, time: Array) -> Array:
    """Return a vector of Earth-fixed axes in axes that coincide with them at the first fix."""
    c, s = np.cos(_OMEGA * (time - time[0])), np.sin(_OMEGA * (time - time[0]))
    return np.column_stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2] + 0.0 * time])


def test_the_curve_of_a_parked_receiver() -> None:
    """Its force is gravity upwards, which turns with the Earth."""
    found = seen(_parked())
    assert found is not None
    up = np.array((np.cos(0.8) * np.cos(-1.3), np.cos(0.8) * np.sin(-1.3), np.sin(0.8)))
    north = np.array((-np.sin(0.8) * np.cos(-1.3), -np.sin(0.8) * np.sin(-1.3), np.cos(0.8)))
    assert found.up == pytest.approx(_turned(up, found.time), abs=1e-12)
    assert found.north == pytest.approx(_turned(north, found.time), abs=1e-12)
    assert found.speed.tolist() == [0.0] * 30
    assert found.relative == pytest.approx(np.zeros((30, 3)), abs=1e-12)
    assert found.sigma == pytest.approx(0.04)
    # normal gravity by Somigliana (WGS-84), less 3.086e-6 /s² of the height (to 1e-5 m/s²)
    sine2 = np.sin(0.8) ** 2
    gravity = 9.7803253359 * (1.0 + 0.00193185265241 * sine2) / np.sqrt(1.0 - 0.00669437999014 * sine2)
    gravity -= 3.086e-6 * 700.0
    push = 0.5 * (found.up[1:] + found.up[:-1]) * gravity * 2.0
    assert np.diff(found.beta, axis=0) == pytest.approx(push, abs=2e-4)


def test_the_curve_of_a_moving_receiver() -> None:
    """Velocity by the formula of the axes; without it by the differences; the climb by the heights."""
    time = 50.0 + 0.5 * np.arange(60)
    velocity = np.tile((6.0, -8.0, -2.0), (60, 1))
    r1, r2 = earth.radii(0.8)
    latitude = 0.8 + 6.0 * (time - 50.0) / (r1 + 700.0)
    longitude = -1.3 - 8.0 * (time - 50.0) / ((r2 + 700.0) * np.cos(0.8))
    fixes = FixStream(time, latitude, longitude, 700.0 + 2.0 * (time - 50.0), velocity_ned=velocity)
    found = seen(fixes)
    assert found is not None
    assert (found.sigma, found.speed[0]) == (0.05, pytest.approx(np.sqrt(104.0)))
    east = np.array((-np.sin(-1.3), np.cos(-1.3), 0.0))
    first = 6.0 * found.north[0] - 8.0 * east + 2.0 * found.up[0]
    assert found.relative[0] == pytest.approx(first, abs=1e-9)
    by_steps = seen(replace(fixes, velocity_ned=None))
    assert by_steps is not None
    assert by_steps.sigma == 0.1
    assert by_steps.relative[3:-3] == pytest.approx(found.relative[3:-3], abs=2e-3)
    level = velocity.copy()
    level[:, 2] = np.nan
    by_heights = seen(replace(fixes, velocity_ned=level))
    assert by_heights is not None
    assert by_heights.relative[25:-25] == pytest.approx(found.relative[25:-25], abs=1e-6)
    assert seen(fixes.rows(np.arange(7))) is None
    assert seen(fixes.rows(np.arange(8))) is not None


@cache
def _drive() -> tuple[Pushed, Seen, Match]:
    """Return the drive without noise, 0.25 s late by the unit's clock, and its match."""
    unit, given = worlds.readings(50.0, late=0.25, noise=0.0), worlds.fixes()
    given = replace(given, velocity_ned=worlds.drive().state(given.time).velocity_ned)
    curve, fixes = pushed(unit.time, unit.gyro, unit.accel), seen(given)
    assert fixes is not None
    return curve, fixes, match(curve, fixes, 0.25)


def _unit_attitude(at: float) -> Array:
    """Return the true attitude of the unit, C_ns."""
    return np.asarray(rotation.dcm_from_quaternion(worlds.drive().state(np.array([at])).q_nb[0]) @ worlds.TO_UNIT)


def test_the_match_of_the_drive() -> None:
    """Fixes from 1 to 148.75 s at 4 Hz give 14 windows of 10 s, in which the two curves hardly differ."""
    _, fixes, found = _drive()
    assert found.window == 10.0
    assert found.centre == pytest.approx(np.arange(6.0, 137.0, 10.0))
    assert found.residual == pytest.approx(np.sqrt(np.mean(found.each**2)))
    assert found.residual < 0.003
    bias = np.radians((0.1, -0.2, 0.15)) @ worlds.TO_UNIT
    assert np.degrees(found.bias[:3] - bias) == pytest.approx(np.zeros(3), abs=0.005)
    assert found.bias[3:] == pytest.approx(np.zeros(3), abs=0.02)
    moved = [np.var(fixes.relative[(fixes.time >= c - 5.0) & (fixes.time < c + 5.0)], axis=0) for c in found.centre]
    assert found.moved == pytest.approx(np.sqrt(np.mean(moved)), rel=1e-9)
    fewer = match(*_drive()[:2], 0.25, most=3)
    assert len(fewer.centre) == 3
    assert set(fewer.centre) <= set(found.centre)
    outside = match(*_drive()[:2], 900.0)
    assert (outside.residual, len(outside.each)) == (np.inf, 0)


@pytest.mark.parametrize("at", [20.0, 25.9, 63.0])
def test_the_attitude_by_the_match(at: float) -> None:
    curve, fixes, found = _drive()
    given = attitude_by_match(curve, fixes, found, 0.25, at + 0.25)
    assert given is not None
    angles, sigma = given
    error = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(*angles)) @ _unit_attitude(at).T
    turn = np.degrees(rotation.rotation_vector_from_quaternion(rotation.quaternion_from_dcm(error)))
    assert np.abs(turn).max() < 0.6
    # 1σ of a window: 2 s of fixes at 4 Hz are alike, so that an error counts √8 times
    sure = np.sqrt(8.0) * found.each / np.sqrt(found.turning)
    first = np.flatnonzero((sure < np.radians(10.0)) & (found.centre >= at))[0]
    assert sigma == pytest.approx(sure[first])
    assert attitude_by_match(curve, fixes, found, 0.25, 149.0) is None
    apart = attitude_by_match(replace(curve, time=curve.time + 1e4), fixes, found, 1e4 + 0.25, at + 1e4 + 0.25)
    assert apart is not None  # clocks that differ by hours change nothing
    assert (apart[0], apart[1]) == (pytest.approx(angles, abs=1e-9), sigma)


def test_the_mean_direction_of_windows() -> None:
    """A long window 60° off counts as one that is 1.5 times as far off as the median one, not with its distance."""
    off = np.radians([0.0, 0.0, 1.0, 1.0, -1.0, -1.0, 60.0, 60.0])
    along = np.column_stack([np.cos(off), np.sin(off), np.zeros(8)])
    found, each = _mean_direction(along, np.ones(8), np.repeat(np.arange(4), 2))
    assert np.degrees(np.arctan2(each[:, 1], each[:, 0])) == pytest.approx([0.0, 1.0, -1.0, 60.0])
    assert 0.3 < np.degrees(np.arctan2(found[1], found[0])) < 1.5  # the mean of all four is 15°


def _compared(off: tuple[float, float, float], late: float = 0.0) -> Finding | None:
    """Return the finding on a reference that is off by a rotation, north, east, down, °."""
    time = np.arange(2.0, 147.0, 0.05)
    q_nb = rotation.multiply(worlds.drive().state(time).q_nb, rotation.quaternion_from_dcm(worlds.TO_UNIT))
    turned = rotation.multiply(rotation.quaternion_from_rotation_vector(np.radians(off)), q_nb)
    return attitude_finding(*_drive(), 0.25, time + 0.25 + late, turned)


def test_a_reference_is_compared_with_the_match() -> None:
    right = _compared((0.0, 0.0, 0.0))
    assert right is not None
    assert right.grade == "fact"
    assert max(right.numbers["tilt_deg"], right.numbers["heading_deg"]) < 0.15
    wrong = _compared((6.0, -8.0, 0.0))
    assert wrong is not None
    numbers = wrong.numbers
    assert numbers["tilt_deg"] == pytest.approx(10.0, abs=0.05)
    assert numbers["heading_deg"] < 0.5  # turns about north and east do not commute
    assert wrong == doubt(
        "reference",
        "The attitude of the reference differs from that of inertial data and fixes without a filter by "
        f"{numbers['tilt_deg']:.2f}° in tilt and {numbers['heading_deg']:.2f}° in heading (rms over "
        f"{numbers['windows']} windows of 10 s, uncertain by about {numbers['uncertain_deg']:.2g}°).",
        "Its axes or its clock differ from the description, or it is wrong: do not judge attitudes by it.",
        **numbers,
    )
    _, _, found = _drive()
    sure = np.degrees(np.sqrt(8.0) * found.each / np.sqrt(found.turning))
    assert numbers["windows"] == np.sum(sure < 5.0)
    of_fix = sure[np.argmin(np.abs(_drive()[1].time[:, None] - found.centre), axis=1)]
    used = np.abs(_drive()[1].time[:, None] - found.centre).min(axis=1) <= 5.0
    used &= (_drive()[1].time >= 2.0) & (of_fix < 5.0)
    assert numbers["uncertain_deg"] == pytest.approx(np.sqrt(np.mean(of_fix[used] ** 2)), rel=0.02)
    turned = _compared((0.0, 0.0, -6.0))
    assert turned is not None
    assert turned.grade == "doubt"
    assert turned.numbers["heading_deg"] == pytest.approx(6.0, abs=0.02)
    less = _compared((3.0, -4.0, 0.0))  # within three times the uncertainty
    assert less is not None
    assert less.grade == "fact"
    assert _compared((0.0, 0.0, 0.0), 200.0) is None


def test_the_mounting_of_the_drive() -> None:
    found = mounting(*_drive(), 0.25)
    assert found is not None
    assert found.known
    assert found.axes == ("forward", "right", "down")
    assert np.degrees(found.angles) == pytest.approx([0.0, -4.0, 6.0], abs=0.35)  # the body pitches by 0.9° and rolls
    of_vehicle = found.of_vehicle(np.array(rotation.euler_from_quaternion(
        rotation.quaternion_from_dcm(_unit_attitude(63.0)))))  # fmt: skip
    true = rotation.euler_from_quaternion(worlds.drive().state(np.array([63.0])).q_nb[0])
    assert np.degrees(of_vehicle - np.array(true)) == pytest.approx(np.zeros(3), abs=0.35)


def test_names_of_axes_and_angles_that_remain() -> None:
    """x, y, z of a unit point up, forward, left, and are turned by roll 2°, pitch −5°, yaw 8°."""
    angles = np.radians((2.0, -5.0, 8.0))
    c_vs = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(*angles))
    named = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    c_vb = c_vs @ named
    ahead = np.array([[1.0, 0.03, -0.01], [1.0, -0.03, 0.02], [1.0, 0.0, 0.01], [1.0, 0.05, 0.0], [1.0, 0.01, -0.06]])
    found = _named(c_vb.T, ahead @ named)
    assert found.axes == ("up", "forward", "left")
    assert found.angles == pytest.approx(angles, abs=1e-12)
    assert found.windows == 5
    # medians of the departures from the medians: 0.01 of z, and 0.02 of y, over √4
    assert found.sigma == pytest.approx(1.4826 * np.array((0.01, 0.02)) / 2.0)
    level = np.array(rotation.euler_from_quaternion(rotation.quaternion_from_dcm(c_vb)))
    assert found.of_vehicle(level) == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize(("windows", "sigma", "known"), [(3, 4.9, True), (2, 4.9, False), (3, 5.1, False)])
def test_what_is_said_of_the_mounting(windows: int, sigma: float, known: bool) -> None:
    found = Mounting(("up", "forward", "right"), np.radians((1.25, -2.5, 3.75)), np.radians((0.5, sigma)), windows)
    text = (
        "If the vehicle moves where it points, x, y, z of the unit point up, forward, right, turned by roll 1.25°, "
        f"pitch -2.50 ± 0.50°, yaw 3.75 ± {sigma:.2f}° (from {windows} windows)."
    )
    numbers = {"axes": ["up", "forward", "right"], "mounting_deg": [pytest.approx(a) for a in (1.25, -2.5, 3.75)]}
    expected = fact("mounting", text, **numbers)
    if not known:
        fix = "The motion hardly shows it: see how it is."
        expected = doubt("mounting", f"Is this the mounting? {text}", fix, **numbers)
    assert _mounting_finding(found) == expected
    assert found.known == known


def _velocities(noise: float, step: float) -> Seen:
    """Return fixes that move by 0.3 m/s and 0.4 m/s along level axes, off by ±noise by turns, and by 7 m/s down."""
    time = 20.0 + step * np.arange(60)
    off = noise * (-1.0) ** np.arange(60)
    relative = np.column_stack([0.3 + off, 0.4 - off, np.full(60, -7.0)])
    up = np.tile((0.0, 0.0, 1.0), (60, 1))
    return Seen(time, relative, relative, up, up[:, [2, 0, 1]], np.full(60, 9.0), 0.05)


@pytest.mark.parametrize(
    ("noise", "step", "count", "limit"),
    # third differences of ±a are ±8a; over 0.6745 √20 they are the noise n; (3 n/0.1)² fixes show 0.1 m/s
    [(0.002, 0.5, 1, 0.1), (0.02, 0.5, 3, 0.1), (0.05, 2.0, 8, 3.0 * 0.4 / (0.6745 * np.sqrt(20.0)) / np.sqrt(8.0))],
)
def test_speed_above_the_noise_of_fixes(noise: float, step: float, count: int, limit: float) -> None:
    found = motion_of(_velocities(noise, step), 3.5)
    assert found.time == pytest.approx(23.5 + step * np.arange(60))
    assert found.limit == pytest.approx(limit)
    off = noise * (-1.0) ** 30 * (count % 2) / count  # the mean of an even number is right
    speed = found.speed[30]
    assert speed == pytest.approx(np.hypot(0.3 + off, 0.4 - off), abs=1e-9) or count == 3
    assert abs(speed - 0.5) < 0.01


def test_the_scatter_of_a_minimum() -> None:
    """Eight windows in five parts: (0, 1), (2, 3), (4, 5), 6 and 7."""
    low = np.array([4.0, 3.0, 5.0, 2.0, 3.0, 4.0, 2.0, 6.0])
    high = np.array([5.0, 3.5, 4.0, 2.5, 3.0, 6.0, 1.0, 7.0])
    middle = np.full(8, 1.0)
    gradients = np.array([1.5, -0.5, 2.0, -1.0, 1.0]) / (2.0 * 0.2)
    bend = (29.0 + 32.0 - 16.0) / 0.2**2
    student = 1.1416  # 84.13 % of Student's t with 4 degrees of freedom
    expected = student * np.sqrt(5.0 / 4.0 * np.sum(gradients**2)) / bend
    assert scatter(low, middle, high, 0.2) == pytest.approx(expected, rel=1e-3)
    assert np.isnan(scatter(low[:2], middle[:2], high[:2], 0.2))
    assert np.isnan(scatter(middle, low, middle, 0.2))


def test_the_offset_by_the_turns() -> None:
    """A unit whose clock is ahead by 812.4 s, at any attitude and with another rate."""
    unit = worlds.readings(50.0)
    fixes = seen(worlds.fixes())
    assert fixes is not None
    found = coarse_offset(unit.time + 812.4, unit.gyro, fixes)
    assert found is not None
    assert found.value == pytest.approx(812.4, abs=0.25)  # a step of the fixes
    assert 0.8 < found.alike <= 1.0
    assert coarse_offset(unit.time, 0.0 * unit.gyro, fixes) is None


@pytest.mark.parametrize("delay", [-0.1, 0.0, 0.125, 0.3])
def test_the_delay_of_velocities(delay: float) -> None:
    found = velocity_delay(worlds.fixes(delay=delay, sigma=0.002))
    assert found is not None
    assert found.value == pytest.approx(delay, abs=0.005)
    assert 0.0 < found.sigma < 0.005


def test_times_without_a_drift() -> None:
    """A clock that runs fast by a quarter shows 15 s in 12 s."""
    assert even_times(np.array([7.0, 12.0, 22.0]), 0.25) == pytest.approx([7.0, 11.0, 19.0])


def test_what_nothing_joins() -> None:
    time = np.linspace(100.0, 130.0, 60)
    fixes = replace(_velocities(0.0, 0.5), time=20.0 + 0.5 * np.arange(60))  # to 49.5 s
    assert _apart(time, fixes, None) == doubt(
        "clocks",
        "The clocks of unit and receiver have no common origin, and the turns of both show no offset.",
        "Which was the time of the first row? Give it as first_row.",
    )
    assert _apart(time, fixes, 40.0) == doubt(
        "clocks",
        "Unit and receiver do not overlap: 100 to 130 s and 60 to 89.5 s on the unit's clock.",
        "Give the offset of the clocks, and see that the files are of the same day.",
    )
    assert _apart(time, fixes, 53.25) == doubt(
        "clocks",
        "Unit and receiver overlap by 2.75 s with 6 fixes (100 to 130 s and 73.25 to 102.75 s on the unit's clock), "
        "too little to compare them.",
        "A comparison needs 10 s or more with at least 8 fixes: give a longer log.",
    )
