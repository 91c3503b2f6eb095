"""What a session averages and what it does not: against closed forms and against emulated sessions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from sinssim import rotation
from sinssim.alignment import (
    AVERAGED,
    SOURCES,
    Angles,
    Attitude,
    InstrumentErrors,
    bias_takes_over,
    determine,
    error_budget,
    error_statistics,
    expected_errors,
    ideal_readings,
    mean_readings,
    total,
)
from sinssim.alignment.alignment_budget import reading_errors
from sinssim.analyses.alignment_result import align_session
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors, flicker
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyros
from sinssim.statistics.random_numbers import gauss_markov
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCMIN, ARCSEC, DEG_H, DEG_SQRT_H, G0, PPM, UG
from tests.slow import slow

LEVEL = Attitude(0.4, 0.0, 0.0)
LATITUDE = np.radians(50.0)


def test_expected_errors_are_those_of_the_grade():
    mean, sigma = expected_errors(Imu(grade="laser-standard"))
    np.testing.assert_allclose(sigma.gyro.bias, 0.01 * DEG_H)
    np.testing.assert_allclose(sigma.accel.scale, 50 * PPM)
    np.testing.assert_allclose(sigma.gyro.misalignment, 5 * ARCSEC * (1 - np.eye(3)))
    assert sigma.gyro.random_walk == pytest.approx(0.003 * DEG_SQRT_H)
    assert not np.any(mean.gyro.bias)


def test_what_is_fixed_has_a_mean_and_no_spread():
    section = Imu(
        gyro_bias_deg_h=(0.1, 0.2, 0.3), accel_scale_sigma_ppm=7.0, gyro_misalignment_arcsec=(1, 2, 3, 4, 5, 6)
    )
    mean, sigma = expected_errors(section)
    np.testing.assert_allclose(mean.gyro.bias, np.array([0.1, 0.2, 0.3]) * DEG_H)
    np.testing.assert_allclose(mean.gyro.misalignment, np.array([[0, 1, 2], [3, 0, 4], [5, 6, 0]]) * ARCSEC)
    assert not np.any(sigma.gyro.bias)
    assert not np.any(sigma.gyro.misalignment)
    np.testing.assert_allclose(sigma.accel.scale, 7 * PPM)


def test_biases_and_scale_factors_are_the_statistics_of_the_theory():
    expected = expected_errors(Imu(grade="laser-standard"))
    attitude = Attitude(0.7, 0.2, -0.3)
    budget = error_budget(attitude, LATITUDE, expected.sigma, 300.0)
    four = ("gyro bias", "gyro scale factor", "accelerometer bias", "accelerometer scale factor")
    theory = error_statistics(attitude, LATITUDE, None, expected.instrument_sigmas).sigma
    np.testing.assert_allclose(total(budget, four), theory, rtol=1e-13)
    assert set(budget) == set(SOURCES)


def test_laser_standard_at_50_degrees():
    """0.01 deg/h over the horizontal part of the Earth's rate; 0.003 deg/√h over five minutes is as much again."""
    budget = error_budget(LEVEL, LATITUDE, expected_errors(Imu()).sigma, 300.0)
    horizontal = 15.041067 * np.cos(LATITUDE)
    assert budget["gyro bias"].heading == pytest.approx(0.01 / horizontal, rel=1e-7)
    assert budget["gyro bias"].heading / ARCMIN == pytest.approx(3.6, abs=0.05)
    assert budget["angle random walk"].heading == pytest.approx(0.003 / np.sqrt(300 / 3600) / horizontal, rel=1e-7)
    assert budget["accelerometer bias"].pitch / ARCSEC == pytest.approx(10.3, abs=0.05)


def test_misalignment_brings_in_what_the_other_axes_read():
    sigma = ImuErrors(accel=TriadErrors(misalignment=5 * ARCSEC * (1 - np.eye(3))))
    budget = error_budget(LEVEL, LATITUDE, sigma, 300.0)
    assert budget["accelerometer misalignment"].pitch == pytest.approx(5 * ARCSEC, rel=1e-9)  # all of gravity, tilted
    one = TriadErrors(misalignment=np.array([[0, 1e-5, 0], [0, 0, 0], [0, 0, 0.0]]))  # forward axis towards right
    attitude = Attitude(0.3, 0.2, 0.1)
    gyro, accel = ideal_readings(*attitude, LATITUDE)
    moved = determine(gyro + np.array([1e-5 * gyro[1], 0, 0]), accel)
    budget = error_budget(attitude, LATITUDE, ImuErrors(gyro=one), 300.0)
    assert budget["gyro misalignment"].heading == pytest.approx(abs(moved.heading - 0.3), rel=1e-4)


def test_non_linearity_is_a_bias_of_what_each_axis_reads():
    """Nose up by 30°: the forward axis reads g/2, the down axis −g cos 30°; Δθ = Σ l_i (K₂x² + K₃x³), by hand."""
    g, s, c = 9.81, 0.5, np.sqrt(0.75)
    k2, k3 = 40.0 * UG / G0**2, 25.0 * UG / G0**3
    forward = np.array([1.0, 0.0, 0.0])
    attitude = Attitude(0.0, 0.0, np.radians(30.0))
    for triad, expected in (
        (TriadErrors(quadratic=k2 * forward), c / g * k2 * (g * s) ** 2),
        (TriadErrors(cubic=k3 * forward), c / g * k3 * (g * s) ** 3),
        (TriadErrors(quadratic=k2 * np.array([0.0, 0.0, 1.0])), s / g * k2 * (g * c) ** 2),
        (TriadErrors(cubic=k3 * np.array([0.0, 0.0, 1.0])), s / g * k3 * (g * c) ** 3),
        (TriadErrors(quadratic=k2 * np.array([0.0, 1.0, 0.0])), 0.0),
    ):
        budget = error_budget(attitude, LATITUDE, ImuErrors(accel=triad), 300.0, gravity=g)
        assert budget["accelerometer non-linearity"].pitch == pytest.approx(expected, rel=1e-12, abs=1e-20)
    # a gyro to the east of a vehicle that points north reads nothing; turned to the west-north-west, half of U cosφ
    k2 = 1000.0 * PPM / np.radians(1.0)
    horizontal = OMEGA_IE * np.cos(LATITUDE)
    level = Attitude(np.radians(-60.0), 0.0, 0.0)
    sigma = ImuErrors(gyro=TriadErrors(quadratic=k2 * forward))
    heading = error_budget(level, LATITUDE, sigma, 300.0)["gyro non-linearity"].heading
    assert heading == pytest.approx(np.sin(np.radians(60.0)) * k2 * (0.5 * horizontal) ** 2 / horizontal, rel=1e-12)
    assert heading < 0.2 * ARCSEC  # of a gyro ten times as bad as any: negligible at rest


@pytest.mark.parametrize("runs", [100, *slow(1500)])
def test_emulated_non_linearity_has_the_predicted_spread_and_mean(runs):
    """Through the emulator with K₂ and K₃ of both triads drawn, then fixed; the gyros' absurdly large, to be seen."""
    roll, pitch, heading = 0.4, -0.6, 1.2
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    ideal = Parked(LATITUDE, 0.5, 0.0, q_nb, 100.0).increments(1.0)
    section = Imu(
        grade="ideal",
        gyro_quadratic_sigma_ppm_per_deg_s=4e3,
        gyro_cubic_sigma_ppm_per_deg2_s2=1e6,
        accel_quadratic_sigma_ug_per_g2=4.0,
        accel_cubic_sigma_ug_per_g3=6.0,
    )
    readings = [mean_readings(emulate(ideal, section, seed)) for seed in range(runs)]
    result = determine(*(np.array(part) for part in zip(*readings, strict=True)))
    found = np.stack([result.heading - heading, result.roll - roll, result.pitch - pitch, result.latitude - LATITUDE])
    budget = error_budget(Attitude(heading, roll, pitch), LATITUDE, expected_errors(section).sigma, 100.0)
    for errors, sigma in zip(found, total(budget), strict=True):
        assert abs(errors.mean()) < 4 * sigma / np.sqrt(runs)
        assert errors.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * runs))
    for source in ("gyro non-linearity", "accelerometer non-linearity"):  # both are seen
        assert budget[source].heading > 0.2 * total(budget).heading
    fixed = Imu(
        grade="ideal",
        gyro_cubic_ppm_per_deg2_s2=(1e6, -1e6, 1e6),
        accel_quadratic_ug_per_g2=(3.0, -2.0, 1.0),
        accel_cubic_ug_per_g3=(-0.5, 1.5, 2.5),
    )
    report = align_session(emulate(ideal, fixed), "fixed", fixed, truth=Angles(heading, roll, pitch, LATITUDE))
    assert total(report.budget, SOURCES) == (0.0, 0.0, 0.0, 0.0)
    for error, mean in zip(report.error, report.mean, strict=True):
        # its coefficients are those of the determined angles, which are off by up to 4e-5 rad
        assert mean == pytest.approx(error, rel=1e-4)
        assert abs(mean) > 1e-8


WARM = {"temperature_start_c": -20.0, "temperature_steady_c": 5.0, "warm_up_time_s": 60.0}
DRIFTS: list[tuple[str, dict[str, float]]] = [
    ("gyro temperature", {"gyro_bias_temperature_sigma_deg_h_per_c": 0.001, **WARM}),
    ("gyro temperature", {"gyro_scale_temperature_sigma_ppm_per_c": 100.0, **WARM}),
    ("gyro ramp", {"gyro_ramp_sigma_deg_h_per_h": 1.0}),
    ("gyro rate random walk", {"gyro_rrw_deg_h_sqrt_h": 0.1}),
    ("gyro flicker", {"gyro_flicker_deg_h": 0.01}),
    ("gyro g-sensitivity", {"gyro_g_sensitivity_sigma_deg_h_per_g": 0.01}),
    ("gyro non-linearity", {"gyro_asymmetry_sigma_ppm": 2000.0}),
    ("accelerometer temperature", {"accel_bias_temperature_sigma_ug_per_c": 5.0, **WARM}),
    ("accelerometer temperature", {"accel_scale_temperature_sigma_ppm_per_c": 10.0, **WARM}),
    ("accelerometer ramp", {"accel_ramp_sigma_ug_per_h": 1000.0}),
    ("accelerometer rate random walk", {"accel_rrw_ug_sqrt_h": 300.0}),
    ("accelerometer flicker", {"accel_flicker_ug": 30.0}),
    ("accelerometer non-linearity", {"accel_asymmetry_sigma_ppm": 100.0}),
    ("accelerometer non-linearity", {"accel_cross_axis_sigma_ug_per_g2": 30.0}),
]


@pytest.mark.parametrize("runs", [80, *slow(800)])
@pytest.mark.parametrize(("source", "errors"), DRIFTS, ids=lambda value: str(value)[:40])
def test_emulated_drifts_have_the_predicted_spread(source: str, errors: dict[str, float], runs: int) -> None:
    """A session of 100 s that begins 80 s after the sensors were switched on, through the emulator, each term alone."""
    roll, pitch, heading, rate_hz, begin = 0.4, -0.6, 1.2, 1.0, 80
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    ideal = Parked(LATITUDE, 0.5, 0.0, q_nb, 180.0).increments(rate_hz)
    section = Imu(grade="ideal", rate_hz=rate_hz, **errors)

    def session(seed: int) -> tuple[np.ndarray, np.ndarray]:
        imu = emulate(ideal, section, seed)
        return mean_readings(ImuData(imu.time[begin:], imu.dtheta[begin:], imu.dvel[begin:]))

    result = determine(*(np.array(part) for part in zip(*(session(seed) for seed in range(runs)), strict=True)))
    found = np.stack([result.heading - heading, result.roll - roll, result.pitch - pitch, result.latitude - LATITUDE])
    sigma = expected_errors(section).sigma
    budget = error_budget(Attitude(heading, roll, pitch), LATITUDE, sigma, 100.0, start=float(begin), rate_hz=rate_hz)
    assert [name for name in SOURCES if any(budget[name])] == [source]
    for spread, predicted in zip(found, budget[source], strict=True):
        assert spread.std() == pytest.approx(predicted, rel=4 / np.sqrt(2 * runs), abs=1e-12)


def test_known_drifts_are_known_errors() -> None:
    q_nb = rotation.quaternion_from_euler(0.4, -0.6, 1.2)
    imu = emulate(Parked(LATITUDE, 0.5, 0.0, q_nb, 180.0).increments(10.0), fixed := Imu(
        grade="ideal",
        rate_hz=10.0,
        gyro_ramp_deg_h_per_h=(0.1, -0.2, 0.3),
        gyro_bias_temperature_deg_h_per_c=(1e-4, 2e-4, -1e-4),
        gyro_scale_temperature_ppm_per_c=(10.0, 20.0, -30.0),
        gyro_g_sensitivity_deg_h_per_g=(1e-3, 2e-3, -1e-3, 3e-3, 0.0, 1e-3, -2e-3, 1e-3, 2e-3),
        gyro_asymmetry_ppm=(300.0, 200.0, -100.0),
        accel_ramp_ug_per_h=(90.0, -60.0, 30.0),
        accel_bias_temperature_ug_per_c=(0.3, 0.2, -0.1),
        accel_cross_axis_ug_per_g2=(10.0, 20.0, -30.0, 5.0, 15.0, -5.0),
        accel_asymmetry_ppm=(30.0, 20.0, -10.0),
        **WARM,
    ))  # fmt: skip
    later = ImuData(imu.time[800:], imu.dtheta[800:], imu.dvel[800:])
    truth = Angles(np.asarray(1.2), np.asarray(0.4), np.asarray(-0.6), np.asarray(LATITUDE))
    report = align_session(later, "fixed", fixed, truth=truth, warmed=80.0)
    assert total(report.budget, SOURCES) == (0.0, 0.0, 0.0, 0.0)
    for error, mean in zip(report.error, report.mean, strict=True):
        assert mean == pytest.approx(error, rel=3e-3)
        assert abs(mean) > 1e-6


def test_known_null_shift_is_a_known_error() -> None:
    """The means of the rates over a session that begins 80 s after the laser gyros."""
    ring = LaserGyros(
        perimeter_mm=420.0, area_mm2=8487.0, lock_in_deg_h=0.0, dither_amplitude_arcsec=140.0,
        dither_frequency_hz=400.0, gas_flow_mps=1e-3, gain_percent=0.8, expansion_ppm_per_c=0.1,
    )  # fmt: skip
    known = expected_errors(Imu(grade="ideal", laser_gyro=ring, **WARM)).mean
    edges = np.arange(1801) * 0.1
    still = ImuData(edges, np.zeros((1800, 3)), np.zeros((1800, 3)))
    rates, forces = reading_errors(known, np.zeros(3), np.zeros(3), 100.0, 80.0)
    np.testing.assert_allclose(rates, emulate(still, known).dtheta[800:].sum(axis=0) / 100.0, rtol=1e-6)
    assert np.abs(rates).min() > 0.05 * DEG_H
    assert not forces.any()


@pytest.mark.parametrize("count", [1, 2, 7, 400])
def test_mean_of_flicker_noise_by_summing_its_covariances(count: int) -> None:
    weights, kept = np.array(flicker.WEIGHTS), 1.0 - np.array(flicker.RATES)
    state = 1.0 / (1.0 - np.multiply.outer(kept, kept))
    here = weights @ state @ weights + flicker.DIRECT**2 + 2.0 * flicker.DIRECT * weights.sum()
    lagged = [(weights * kept**lag) @ (state @ weights + flicker.DIRECT) for lag in range(1, count)]
    square = count * here + 2.0 * sum((count - lag) * value for lag, value in enumerate(lagged, start=1))
    assert flicker.variance_of_mean(count) == pytest.approx(square / count**2, rel=1e-9)


def test_quantisation_at_both_ends_of_a_session():
    rng = np.random.default_rng(3)
    quantum, duration, rate = 2 * ARCSEC, 100.0, 7e-5
    start = rng.uniform(0, quantum, 200_000)  # the phase of a counter that ran before
    counted = np.rint((start + rate * duration) / quantum) - np.rint(start / quantum)
    sigma = np.std(counted * quantum / duration - rate)
    budget = error_budget(
        Attitude(np.pi / 2, 0.0, 0.0), LATITUDE, ImuErrors(gyro=TriadErrors(quantum=quantum)), duration
    )
    predicted = budget["angle quantisation"].heading * OMEGA_IE * np.cos(LATITUDE)
    phase = (rate * duration / quantum) % 1.0  # this one session's variance: Q² x(1 - x), on average over x Q²/6
    assert sigma == pytest.approx(quantum / duration * np.sqrt(phase * (1 - phase)), rel=0.02)
    assert predicted == pytest.approx(quantum / duration / np.sqrt(6), rel=1e-12)


@pytest.mark.parametrize("ratio", [1e-4, 0.3, 3.0])
def test_bias_instability_is_the_mean_of_a_gauss_markov_process(ratio):
    rng = np.random.default_rng(4)
    tau, count, runs = 1000.0, 200, 4000
    duration = ratio * tau
    interval = np.full(count, duration / count)
    means = [gauss_markov(interval, tau, rng.standard_normal(count + 1)).mean() for _ in range(runs)]
    sigma = ImuErrors(gyro=TriadErrors(instability=1.0, correlation_time=tau))
    budget = error_budget(LEVEL, LATITUDE, sigma, duration)
    predicted = budget["gyro bias instability"].heading * OMEGA_IE * np.cos(LATITUDE)
    assert np.std(means) == pytest.approx(predicted, rel=4 / np.sqrt(2 * runs))


@pytest.mark.parametrize("x", [1e-5, 0.9e-3, 1.1e-3, 0.7, 40.0])
def test_the_mean_of_a_gauss_markov_process_by_quadrature(x: float) -> None:
    """σ² 2/T² ∫(T − t) e^(−t/τ) dt: the mean over T of the correlation of two instants."""
    share, _ = quad(lambda t: 2.0 * (1.0 - t) * np.exp(-t * x), 0.0, 1.0, epsabs=1e-13, epsrel=1e-13)
    sigma = ImuErrors(gyro=TriadErrors(instability=1.0, correlation_time=1000.0))
    heading = error_budget(LEVEL, LATITUDE, sigma, 1000.0 * x)["gyro bias instability"].heading
    assert heading * OMEGA_IE * np.cos(LATITUDE) == pytest.approx(np.sqrt(share), rel=1e-7)


def test_noise_falls_with_the_session_and_bias_does_not():
    sigma = expected_errors(Imu(gyro_quantum_arcsec=1.0)).sigma
    budget = error_budget(LEVEL, LATITUDE, sigma, np.array([100.0, 400.0]))
    for source, power in (("angle random walk", 0.5), ("angle quantisation", 1.0), ("gyro bias", 0.0)):
        heading = np.broadcast_to(budget[source].heading, 2)
        assert heading[0] / heading[1] == pytest.approx(4.0**power, rel=1e-12)


def test_bias_takes_over_where_the_parts_are_equal():
    sigma = ImuErrors(gyro=TriadErrors(bias=np.full(3, 0.01 * DEG_H), random_walk=0.003 * DEG_SQRT_H))
    crossing = bias_takes_over(LEVEL, LATITUDE, sigma)
    assert crossing.heading == pytest.approx(3600 * (0.003 / 0.01) ** 2, rel=1e-9)  # 324 s
    assert crossing.roll == 0.0  # nothing acts on it at all
    only_noise = ImuErrors(gyro=TriadErrors(random_walk=0.003 * DEG_SQRT_H))
    assert bias_takes_over(LEVEL, LATITUDE, only_noise).heading == np.inf
    pulses = ImuErrors(gyro=TriadErrors(bias=np.full(3, 0.01 * DEG_H), quantum=ARCSEC))
    # Q²/6T² = σ²
    assert bias_takes_over(LEVEL, LATITUDE, pulses).heading == pytest.approx(
        ARCSEC / np.sqrt(6) / (0.01 * DEG_H), rel=1e-9
    )


@pytest.mark.parametrize("runs", [100, *slow(1500)])
def test_emulated_sessions_of_a_parked_truth_have_the_predicted_spread(runs):
    """Truth, sensors, session, determination against the theory, all sources of the grade together."""
    roll, pitch, heading = 0.05, -0.1, 1.2
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    ideal = Parked(LATITUDE, 0.5, 0.0, q_nb, 300.0).increments(2.0)
    section = Imu(grade="laser-standard")
    readings = [mean_readings(emulate(ideal, section, seed)) for seed in range(runs)]
    result = determine(*(np.array(part) for part in zip(*readings, strict=True)))
    found = np.stack([result.heading - heading, result.roll - roll, result.pitch - pitch, result.latitude - LATITUDE])
    budget = error_budget(Attitude(heading, roll, pitch), LATITUDE, expected_errors(section).sigma, 300.0)
    for errors, sigma in zip(found, total(budget), strict=True):
        assert abs(errors.mean()) < 4 * sigma / np.sqrt(runs)
        assert errors.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * runs))


def test_mean_and_sigma_of_one_error_have_the_statistics_of_the_paper():
    """Sessions of a scenario with means and standard deviations against (11), (12), (16), (17), (19), (20), (22), (23).

    Eight tests at four standard deviations: 5e-4 by chance.
    """
    roll, pitch, heading, runs = 0.05, -0.1, 1.2, 200
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    ideal = Parked(LATITUDE, 0.5, 0.0, q_nb, 300.0).increments(1.0)
    section = Imu(
        grade="ideal",
        rate_hz=1.0,
        gyro_bias_deg_h=(0.03, -0.02, 0.01),
        gyro_bias_sigma_deg_h=0.01,
        accel_bias_ug=(100.0, -200.0, 150.0),
        accel_bias_sigma_ug=50.0,
        accel_scale_ppm=(100.0, 200.0, -300.0),
    )
    mean, sigma = (expected := expected_errors(section))
    np.testing.assert_allclose(mean.gyro.bias, np.array([0.03, -0.02, 0.01]) * DEG_H)
    np.testing.assert_allclose(sigma.gyro.bias, 0.01 * DEG_H)
    readings = [mean_readings(emulate(ideal, section, seed)) for seed in range(runs)]
    result = determine(*(np.array(part) for part in zip(*readings, strict=True)))
    found = np.stack([result.heading - heading, result.roll - roll, result.pitch - pitch, result.latitude - LATITUDE])
    attitude = Attitude(heading, roll, pitch)
    gyro, accel = expected.mean.gyro, expected.mean.accel
    means = InstrumentErrors(gyro.bias, gyro.scale, accel.bias, accel.scale)
    theory = error_statistics(attitude, LATITUDE, means, expected.instrument_sigmas)
    for errors, by_mean, by_sigma in zip(found, theory.mean, theory.sigma, strict=True):
        assert abs(by_mean) > 0.5 * by_sigma  # far from zero in 200 sessions
        assert errors.mean() == pytest.approx(by_mean, abs=4 * by_sigma / np.sqrt(runs) + 1e-3 * abs(by_mean))
        assert errors.std() == pytest.approx(by_sigma, rel=4 / np.sqrt(2 * runs))


def test_bias_takes_over_on_a_map_as_at_each_of_its_points():
    sigma = expected_errors(Imu(gyro_quantum_arcsec=1.0)).sigma
    heading, latitude = np.array([0.1, 1.0, 2.0, 4.0]), np.radians([[10.0], [50.0], [80.0]])
    attitude = Attitude(heading, 0.1, -0.2)
    on_map = bias_takes_over(attitude, latitude, sigma)
    assert on_map.latitude.shape == (3, 4)
    alone = bias_takes_over(Attitude(2.0, 0.1, -0.2), latitude[1, 0], sigma)
    np.testing.assert_allclose([angle[1, 2] for angle in on_map], alone, rtol=1e-12)
    at_crossing = error_budget(Attitude(2.0, 0.1, -0.2), latitude[1, 0], sigma, alone.latitude)
    lasting = tuple(source for source in SOURCES if source not in AVERAGED)
    assert total(at_crossing, AVERAGED).latitude == pytest.approx(total(at_crossing, lasting).latitude, rel=1e-9)


@pytest.mark.parametrize("duration", [0.0, -5.0, np.nan])
def test_a_session_has_a_length(duration):
    with pytest.raises(InputError, match="must be positive"):
        error_budget(LEVEL, LATITUDE, expected_errors(Imu()).sigma, duration)


def test_the_cone_does_not_tell_the_latitude_on_the_equator():
    with pytest.raises(InputError, match="the latitude is within 5 deg of the equator, where"):
        error_budget(LEVEL, 0.01, expected_errors(Imu()).sigma, 300.0, method="disturbed")


def test_a_known_latitude_has_no_error_and_changes_no_heading():
    sigma = expected_errors(Imu()).sigma
    found = total(error_budget(LEVEL, LATITUDE, sigma, 300.0, method="disturbed"))
    known = total(error_budget(LEVEL, LATITUDE, sigma, 300.0, method="disturbed, latitude known"))
    assert known.latitude == 0.0
    assert known.heading == pytest.approx(found.heading, rel=1e-14)
    on_the_equator = total(error_budget(LEVEL, 0.0, sigma, 300.0, method="disturbed, latitude known"))
    assert on_the_equator.heading == pytest.approx(known.heading * np.cos(LATITUDE), rel=0.01)


def test_instrument_sigmas_carry_over():
    sigmas = expected_errors(Imu(grade="laser-standard")).instrument_sigmas
    assert isinstance(sigmas, InstrumentErrors)
    np.testing.assert_allclose(sigmas.accel_bias, 50 * UG)
