"""Turning the vehicle between sessions: what cancels, and which heading is best."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.alignment import (
    Attitude,
    best_headings,
    coefficients,
    determine,
    error_budget,
    expected_errors,
    ideal_readings,
    set_sigma,
    total,
)
from sinssim.alignment.alignment_budget import reading_errors, reading_variances
from sinssim.alignment.parked_theory import linear
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.imu_errors import WarmUp
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import DEG_H, PPM, UG
from tests.slow import slow

LATITUDE = np.radians(50.0)
GRADE = expected_errors(Imu(grade="laser-standard")).sigma
TILT = {"roll": 0.03, "pitch": -0.02}


def quarter_turns(first, count):
    return Attitude(first + 2 * np.pi * np.arange(count) / count, TILT["roll"], TILT["pitch"])


def test_one_position_is_a_plain_session():
    curved = Imu(
        grade="laser-standard",
        gyro_quadratic_sigma_ppm_per_deg_s=1e5,
        accel_quadratic_sigma_ug_per_g2=50.0,
        accel_cubic_sigma_ug_per_g3=50.0,
    )
    drifting = Imu(
        gyro_bias_temperature_sigma_deg_h_per_c=0.002,
        gyro_scale_temperature_sigma_ppm_per_c=50.0,
        gyro_ramp_sigma_deg_h_per_h=0.1,
        gyro_rrw_deg_h_sqrt_h=0.02,
        gyro_flicker_deg_h=0.01,
        gyro_g_sensitivity_sigma_deg_h_per_g=0.01,
        gyro_asymmetry_sigma_ppm=100.0,
        accel_bias_temperature_sigma_ug_per_c=3.0,
        accel_ramp_sigma_ug_per_h=100.0,
        accel_rrw_ug_sqrt_h=30.0,
        accel_cross_axis_sigma_ug_per_g2=20.0,
        temperature_start_c=-10.0,
    )
    for sigma in (GRADE, expected_errors(curved).sigma, expected_errors(drifting).sigma):
        alone = set_sigma(quarter_turns(0.7, 1), LATITUDE, sigma, 300.0)
        plain = total(error_budget(Attitude(0.7, *TILT.values()), LATITUDE, sigma, 300.0))
        np.testing.assert_allclose(alone, plain, rtol=1e-12)


def test_a_grid_of_sets_is_each_set_alone():
    """Latitudes along two axes, durations along one."""
    latitudes = np.radians([[-50.0, 10.0, 70.0], [20.0, 30.0, 40.0]])
    grid = set_sigma(quarter_turns(0.7, 2), latitudes, GRADE, np.array([100.0, 200.0, 300.0]))
    assert np.shape(grid.heading) == (2, 3)
    for row in range(2):
        for column, duration in enumerate((100.0, 200.0, 300.0)):
            alone = set_sigma(quarter_turns(0.7, 2), latitudes[row, column], GRADE, duration)
            np.testing.assert_allclose([angle[row, column] for angle in grid], alone, rtol=1e-12)


def test_opposite_headings_do_not_cancel_what_is_even():
    """K₂ of a gyro along the heading: the square of its reading is the same both ways, the coefficient is not."""
    sigma = ImuErrors(gyro=TriadErrors(quadratic=np.full(3, 1e3)), accel=TriadErrors(cubic=np.full(3, 1e-6)))
    attitude = Attitude(np.array([0.7, 0.7 + np.pi]), 0.0, 0.0)
    result = set_sigma(attitude, LATITUDE, sigma, 300.0)
    assert result.heading < 1e-15
    # the down gyro's K₂ and the latitude's coefficient cosφ H_z/U stay
    down = -OMEGA_IE * np.sin(LATITUDE)
    assert result.latitude == pytest.approx(1e3 * down**2 * np.cos(LATITUDE) / OMEGA_IE, rel=1e-9)


def test_opposite_headings_cancel_the_horizontal_biases_of_a_level_vehicle():
    sigma = ImuErrors(gyro=TriadErrors(bias=np.full(3, 0.01 * DEG_H)), accel=TriadErrors(bias=np.full(3, 50 * UG)))
    attitude = Attitude(np.array([0.7, 0.7 + np.pi]), 0.0, 0.0)
    result = set_sigma(attitude, LATITUDE, sigma, 300.0)
    assert result.heading < 1e-15
    # of the latitude the vertical gyro's part stays, (24); turning about the vertical does not move that gyro
    assert result.latitude == pytest.approx(0.01 * DEG_H * np.cos(LATITUDE) / OMEGA_IE, rel=1e-12)


def test_slow_bias_instability_cancels_like_a_bias():
    slow = TriadErrors(instability=0.01 * DEG_H, correlation_time=1e6)
    two = Attitude(np.array([0.7, 0.7 + np.pi]), 0.0, 0.0)
    alone = set_sigma(Attitude(np.array([0.7]), 0.0, 0.0), LATITUDE, ImuErrors(gyro=slow), 300.0)
    assert alone.heading == pytest.approx(0.01 * DEG_H / (OMEGA_IE * np.cos(LATITUDE)), rel=1e-3)
    assert set_sigma(two, LATITUDE, ImuErrors(gyro=slow), 300.0).heading < 1e-15


@pytest.mark.parametrize(
    "errors",
    [
        {"ramp": np.full(3, 1e-11)},
        {"rate_walk": 1e-10},
        {"bias_temperature": np.full(3, 1e-9)},
        {"scale_temperature": np.full(3, 1e-6)},
        {"random_walk": 1e-6},
    ],
    ids=lambda errors: next(iter(errors)),
)
def test_positions_at_one_heading_are_one_long_session(errors):
    """Three in a row, without a pause: drifts and noise of the whole time."""
    sigma = ImuErrors(gyro=TriadErrors(**errors), warm_up=WarmUp(8.0, 0.0, 100.0))
    apart, whole = (set_sigma(Attitude(np.full(n, 0.7), 0.1, 0.2), LATITUDE, sigma, 600.0) for n in (3, 1))
    assert whole.heading > 0.0
    np.testing.assert_allclose(apart, whole, rtol=1e-12)


def test_a_drift_goes_on_between_opposite_headings():
    """Half the difference of two means a quarter of the time from the middle: RT/4, and K√(T/12) of a random walk."""
    two, horizontal = Attitude(np.array([0.7, 0.7 + np.pi]), 0.0, 0.0), OMEGA_IE * np.cos(LATITUDE)
    ramp, walk, time = 1e-11, 1e-10, 600.0
    found = set_sigma(two, LATITUDE, ImuErrors(gyro=TriadErrors(ramp=np.full(3, ramp))), time).heading
    assert found == pytest.approx(ramp * time / 4.0 / horizontal, rel=1e-12)
    found = set_sigma(two, LATITUDE, ImuErrors(gyro=TriadErrors(rate_walk=walk)), time).heading
    assert found == pytest.approx(walk * np.sqrt(time / 12.0) / horizontal, rel=1e-12)
    warm = WarmUp(8.0, 0.0, 100.0)  # means over each half, by hand
    halves = 8.0 * (100.0 / 300.0) * (1.0 - np.exp(-3.0)) * np.array([1.0, np.exp(-3.0)])
    sigma = ImuErrors(gyro=TriadErrors(bias_temperature=np.full(3, 1e-9)), warm_up=warm)
    found = set_sigma(two, LATITUDE, sigma, time).heading
    assert found == pytest.approx(1e-9 * (halves[0] - halves[1]) / 2.0 / horizontal, rel=1e-12)


def test_four_headings_cancel_the_scale_factors_too():
    sigma = ImuErrors(gyro=TriadErrors(scale=np.full(3, 100 * PPM)))
    two = set_sigma(Attitude(0.7 + np.array([0.0, np.pi]), 0.0, 0.0), LATITUDE, sigma, 300.0)
    four = set_sigma(Attitude(0.7 + np.pi / 2 * np.arange(4), 0.0, 0.0), LATITUDE, sigma, 300.0)
    assert two.heading == pytest.approx(100 * PPM * np.sqrt(0.5) * abs(np.sin(1.4)), rel=1e-9)  # (15)
    assert four.heading < 1e-15


@pytest.mark.parametrize("runs", [200, *slow(3000)])
@pytest.mark.parametrize("count", [2, 4])
def test_sets_against_draws_through_the_determination(count, runs):
    """Every error of a run is the same in all positions, noise is new in each."""
    duration = 600.0
    attitude = quarter_turns(0.5, count)
    gyro, accel = ideal_readings(*attitude, LATITUDE)
    rng = np.random.default_rng(5)
    deltas = np.empty((runs, 4))
    for run in range(runs):
        errors = draw(Imu(grade="laser-standard"), run)
        noise = [
            triad.random_walk / np.sqrt(duration / count) * rng.standard_normal((count, 3))
            for triad in (errors.gyro, errors.accel)
        ]
        measured = [
            (1 + triad.scale) * (ideal + ideal @ triad.misalignment.T) + triad.bias + white
            for triad, ideal, white in ((errors.gyro, gyro, noise[0]), (errors.accel, accel, noise[1]))
        ]
        result = determine(*measured)
        turned = (result.heading - attitude.heading + np.pi) % (2 * np.pi) - np.pi
        deltas[run] = [
            turned.mean(),
            (result.roll - attitude.roll).mean(),
            (result.pitch - attitude.pitch).mean(),
            (result.latitude - LATITUDE).mean(),
        ]
    predicted = set_sigma(attitude, LATITUDE, GRADE, duration)
    np.testing.assert_allclose(deltas.std(axis=0), np.array(predicted), rtol=4 / np.sqrt(2 * runs))


def test_the_better_gyro_faces_east():
    """Facing north the right gyro points east and alone decides the heading; facing east the forward one does."""
    good, bad = 0.001 * DEG_H, 0.05 * DEG_H
    right_is_good = ImuErrors(gyro=TriadErrors(bias=np.array([bad, good, good])))
    forward_is_good = ImuErrors(gyro=TriadErrors(bias=np.array([good, bad, good])))
    best = best_headings(1, LATITUDE, right_is_good, 300.0)
    assert np.degrees(best.headings[0]) % 180 == pytest.approx(0.0, abs=0.01)
    assert best.sigma.heading == pytest.approx(good / (OMEGA_IE * np.cos(LATITUDE)), rel=1e-6)
    assert best.worst == pytest.approx(bad / (OMEGA_IE * np.cos(LATITUDE)), rel=1e-3)
    best = best_headings(1, LATITUDE, forward_is_good, 300.0)
    assert np.degrees(best.headings[0]) == pytest.approx(90.0, abs=0.01)
    # what is best for the heading is worst for the latitude: (25)
    best = best_headings(1, LATITUDE, forward_is_good, 300.0, angle="latitude")
    assert np.degrees(best.headings[0]) == pytest.approx(0.0, abs=0.01)


def test_scale_factors_alone_want_a_cardinal_heading_and_the_best_is_never_worse_than_any():
    sigma = ImuErrors(gyro=TriadErrors(scale=np.full(3, 100 * PPM)))
    best = best_headings(1, LATITUDE, sigma, 300.0)
    assert best.sigma.heading < 1e-12
    for count in (1, 2, 4):
        best = best_headings(count, LATITUDE, GRADE, 300.0, **TILT)
        assert len(best.headings) == count
        for first in np.linspace(0, 2 * np.pi, 37):
            other = set_sigma(quarter_turns(first, count), LATITUDE, GRADE, 300.0).heading
            assert best.sigma.heading <= other * (1 + 1e-9)


@pytest.mark.parametrize(("count", "angle", "text"), [(0, "heading", "at least one"), (1, "roll", "heading or lat")])
def test_mistakes_are_named(count, angle, text):
    with pytest.raises(InputError, match=text):
        best_headings(count, LATITUDE, GRADE, 300.0, angle=angle)


OFF = 1.0 - np.eye(3)
SIZES = {
    "gyro": {"bias": 1e-8, "scale": 1e-4, "misalignment": 1e-4, "asymmetry": 1e-4, "quadratic": 1.0, "cubic": 1e4,
             "cross_axis": 1.0, "bias_temperature": 1e-9, "scale_temperature": 1e-5, "ramp": 1e-10,
             "g_sensitivity": 1e-9},
    "accel": {"bias": 1e-3, "scale": 1e-4, "misalignment": 1e-4, "asymmetry": 1e-4, "quadratic": 1e-5, "cubic": 1e-6,
              "cross_axis": 1e-5, "bias_temperature": 1e-4, "scale_temperature": 1e-5, "ramp": 1e-5},
}  # fmt: skip
"""Sizes of errors whose effects at rest are alike."""


def uneven(name: str) -> TriadErrors:
    """Return 1σ that differ for every axis and every pair of axes."""
    rng, found = np.random.default_rng(len(name)), {}
    for field, size in SIZES[name].items():
        whole = field in ("misalignment", "cross_axis", "g_sensitivity")
        found[field] = size * rng.uniform(0.5, 2.0, (3, 3) if whole else 3)
        if field in ("misalignment", "cross_axis"):
            found[field] *= OFF
    return TriadErrors(**found)


UNEVEN = ImuErrors(uneven("gyro"), uneven("accel"), warm_up=WarmUp(8.0, 3.0, 100.0))


def one_by_one(sigma: ImuErrors) -> list[ImuErrors]:
    """Return blocks with one error each, of 1σ."""
    found = []
    for name in ("gyro", "accel"):
        triad = getattr(sigma, name)
        for field in SIZES[name]:
            value = getattr(triad, field)
            for index in np.argwhere(value):
                alone = np.zeros_like(value)
                alone[tuple(index)] = value[tuple(index)]
                found.append(ImuErrors(**{name: TriadErrors(**{field: alone})}, warm_up=sigma.warm_up))
    return found


def test_every_error_alone_and_the_sum_of_their_squares() -> None:
    """The budget of one session, and the mean of three positions one after the other, from each error's own effect on
    each angle: 1σ of it through the readings and the first-order theory."""
    attitude = Attitude(np.array([0.7, 2.9, 4.4]), np.array([0.1, -0.3, 0.2]), np.array([-0.2, 0.05, 0.3]))
    gyro, accel = ideal_readings(*attitude, LATITUDE)
    every = one_by_one(UNEVEN)
    assert len(every) == 2 * (3 * 8 + 2 * 6) + 9
    square, of_set = np.zeros(4), np.zeros(4)
    for error in every:
        effects = []
        for k in range(3):
            c = coefficients(Attitude(*(angle[k] for angle in attitude)), LATITUDE)
            effects.append(linear(c, *reading_errors(error, gyro[k], accel[k], 80.0, 80.0 * k)))
        of_set += np.mean(effects, axis=0) ** 2
        c = coefficients(Attitude(*(angle[1] for angle in attitude)), LATITUDE)
        square += np.square(linear(c, *reading_errors(error, gyro[1], accel[1], 200.0, 50.0)))
    budget = error_budget(Attitude(*(angle[1] for angle in attitude)), LATITUDE, UNEVEN, 200.0, start=50.0)
    np.testing.assert_allclose(total(budget), np.sqrt(square), rtol=1e-9)
    np.testing.assert_allclose(set_sigma(attitude, LATITUDE, UNEVEN, 240.0), np.sqrt(of_set), rtol=1e-9)


def test_errors_of_readings_by_the_model_of_the_sensors() -> None:
    """Each axis by the sentence of its term, at rates and forces without symmetry; 50 s … 250 s after switching on."""
    g, a = UNEVEN.gyro, UNEVEN.accel
    x, f = np.array([0.3, -0.5, 0.7]), np.array([1.1, 2.3, -9.1])
    # 3 + 5 e^(−t/100), mean over the session
    warmth = 3.0 + 5.0 * 100.0 * (np.exp(-0.5) - np.exp(-2.5)) / 200.0

    def reading(t: TriadErrors, own: np.ndarray, force: np.ndarray | None) -> list[float]:
        found = []
        for i in range(3):
            one = t.bias[i] + t.scale[i] * own[i] + sum(t.misalignment[i, j] * own[j] for j in range(3))
            one += 0.5 * t.asymmetry[i] * abs(own[i]) + t.quadratic[i] * own[i] ** 2 + t.cubic[i] * own[i] ** 3
            one += own[i] * sum(t.cross_axis[i, j] * own[j] for j in range(3))
            one += (t.bias_temperature[i] + t.scale_temperature[i] * own[i]) * warmth + t.ramp[i] * 150.0
            if force is not None:
                one += sum(t.g_sensitivity[i, j] * force[j] for j in range(3))
            found.append(one)
        return found

    rates, forces = reading_errors(UNEVEN, x, f, 200.0, 50.0)
    np.testing.assert_allclose(rates, reading(g, x, f), rtol=1e-12)
    np.testing.assert_allclose(forces, reading(a, f, None), rtol=1e-12)


def test_sources_by_name_and_axis() -> None:
    """The variance of every axis by every source, written out."""
    x, f = np.array([0.3, -0.5, 0.7]), np.array([1.1, 2.3, -9.1])
    triads = [
        TriadErrors(**{name: getattr(own, name) for name in ("bias", "scale", "misalignment", "ramp")}, rate_walk=walk,
                    random_walk=white, quantum=quantum, instability=wander, correlation_time=40.0)
        for own, walk, white, quantum, wander in (
            (UNEVEN.gyro, 0.03, 0.7, 0.4, 0.2), (UNEVEN.accel, 0.05, 0.9, 0.6, 0.8),
        )
    ]  # fmt: skip
    found = reading_variances(ImuErrors(*triads), x, f, 20.0, start=70.0)
    shape = 2.0 * (0.5 - 1.0 + np.exp(-0.5)) / 0.25
    for name, integral, own, triad in (("gyro", "angle", x, triads[0]), ("accelerometer", "velocity", f, triads[1])):
        expected = {
            f"{name} bias": triad.bias**2,
            f"{name} scale factor": (triad.scale * own) ** 2,
            f"{name} misalignment": np.array([np.sum((triad.misalignment[i] * own) ** 2) for i in range(3)]),
            f"{name} ramp": (triad.ramp * 80.0) ** 2,
            f"{name} rate random walk": triad.rate_walk**2 * (70.0 + 20.0 / 3.0),
            f"{name} bias instability": triad.instability**2 * shape,
            f"{integral} random walk": triad.random_walk**2 / 20.0,
            f"{integral} quantisation": triad.quantum**2 / 6.0 / 400.0,
        }
        for source, variance in expected.items():
            own_value = found.pop(source)
            np.testing.assert_allclose(own_value, np.broadcast_to(variance, own_value.shape), rtol=1e-9, err_msg=source)
    assert not any(np.any(value) for value in found.values())
    disturbed = reading_variances(ImuErrors(*triads), x, f, 20.0, "disturbed")
    np.testing.assert_allclose(disturbed["angle random walk"], 0.49 / 20.0 * 10.0 / 7.0)
    np.testing.assert_allclose(disturbed["velocity random walk"], 0.81 / 20.0)
