"""Turning the vehicle between sessions: what cancels, and which heading is best."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.alignment import (
    Attitude,
    best_headings,
    determine,
    error_budget,
    expected_errors,
    ideal_readings,
    orientation,
    set_sigma,
    total,
)
from sinssim.earth.models import OMEGA_IE
from sinssim.errors import InputError
from sinssim.scenario.sections.imu import ImuSection
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.errors import WarmUp
from sinssim.units import DEG_H, PPM, UG

LATITUDE = np.radians(50.0)
GRADE = expected_errors(ImuSection(grade="laser-standard")).sigma
TILT = {"roll": 0.03, "pitch": -0.02}


def quarter_turns(first, count):
    return Attitude(first + 2 * np.pi * np.arange(count) / count, TILT["roll"], TILT["pitch"])


def test_one_position_is_a_plain_session():
    curved = ImuSection(
        grade="laser-standard",
        gyro_quadratic_sigma_ppm_per_deg_s=1e5,
        accel_quadratic_sigma_ug_per_g2=50.0,
        accel_cubic_sigma_ug_per_g3=50.0,
    )
    drifting = ImuSection(
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


@pytest.mark.parametrize(("field", "sizes"), [("scale", np.full(3, 1e-4)), ("misalignment", 1e-4 * (1.0 - np.eye(3)))])
def test_an_error_of_the_table_counts_by_what_it_multiplies(field, sizes, monkeypatch):
    """One that multiplies the reading, as scale factor and misalignment do, doubles their variance."""
    sigma = ImuErrors(gyro=TriadErrors(**{field: sizes}), accel=TriadErrors(**{field: 1e-2 * sizes}))
    alone = set_sigma(quarter_turns(0.7, 2), LATITUDE, sigma, 300.0)
    term = SimpleNamespace(field=field, size=sizes.size, multiplies=lambda ideal, force: ideal)
    of_force = SimpleNamespace(field=field, size=sizes.size, multiplies=lambda ideal, force: force)
    monkeypatch.setattr(orientation, "of_triad", lambda name: [term if name == "gyro" else of_force])
    together = set_sigma(quarter_turns(0.7, 2), LATITUDE, sigma, 300.0)
    np.testing.assert_allclose(together, np.sqrt(2.0) * np.array(alone), rtol=1e-12)


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


@pytest.mark.parametrize("count", [2, 4])
def test_sets_against_draws_through_the_determination(count):
    """Every error of a run is the same in all positions, noise is new in each."""
    runs, duration = 3000, 600.0
    attitude = quarter_turns(0.5, count)
    gyro, accel = ideal_readings(*attitude, LATITUDE)
    rng = np.random.default_rng(5)
    deltas = np.empty((runs, 4))
    for run in range(runs):
        errors = draw(ImuSection(grade="laser-standard"), run)
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
