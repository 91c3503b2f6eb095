"""What each term of a sensor block is expected to do, against the navigator on emulated sensors, term by term."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim import earth
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import flicker
from sinssim.sensors.error_propagation import ACCELERATING, AT_REST, GATHERING, SPEED, TURN, TURN_RATE, TURNING, expect
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.laser_gyro import LaserGyros
from sinssim.sensors.sensor_set_section import SixAccelerometers
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.curve import Curve
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.truth.motions.turntable import Dwell, RotationTable, Turn
from sinssim.truth.trajectory import Trajectory
from tests.slow import slow

HOUR = 3600.0
PHYSICS = {
    "perimeter_mm": 420.0,
    "area_mm2": 8487.0,
    "lock_in_deg_h": 360.0,
    "dither_amplitude_arcsec": 140.0,
    "dither_frequency_hz": 400.0,
}
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
NORTHERN = np.radians(45.0)


def block(**errors: Any) -> Imu:
    return Imu(grade="ideal", **{"rate_hz": 1.0, **errors})


def end_error(truth: Trajectory, ideal: ImuData, measured: ImuData) -> np.ndarray:
    """Return the horizontal position error that the sensors' errors make by the end, (2,) m."""
    there = truth.state(ideal.time)
    errors = []
    for imu in (measured, ideal):  # less what the samples' rate leaves
        solution = navigate(imu, truth.state(0.0), vertical="truth", height=there.height)
        errors.append(navigation_error(there, solution, truth.ellipsoid).position_ned[-1, :2])
    return errors[0] - errors[1]


def standing(latitude: float) -> Trajectory:
    return Parked(latitude, 0.3, 0.0, LEVEL, HOUR)


def turning(latitude: float) -> Trajectory:
    table = RotationTable((Turn((0.0, 0.0, 1.0), TURN, TURN_RATE, 0.5), Dwell(HOUR - TURN / TURN_RATE - 0.5)))
    return OnEarth(table, latitude, 0.3, 0.0, LEVEL, HOUR)


def gathering(latitude: float) -> Trajectory:
    """North along the meridian: a quarter of g until 250 m/s, with ramps of 2 s, then on."""
    knots, ramp = np.arange(-2.0, HOUR + 2.5, 0.5), 2.0
    whole = SPEED / GATHERING

    def speed(t: float) -> float:
        def ramped(x: float) -> float:  # integral of a smooth step from 0 to 1 over the ramp
            x = min(max(x, 0.0), ramp) if x < ramp else x
            return 0.5 * x - ramp / (2.0 * np.pi) * np.sin(np.pi * x / ramp) if x < ramp else x - 0.5 * ramp

        return GATHERING * (ramped(t) - ramped(t - whole))

    def north(t: float, y: np.ndarray) -> list[float]:
        return [speed(t) / float(earth.radii(y[0])[0])]

    options: dict[str, Any] = {"t_eval": knots, "rtol": 1e-10, "atol": 1e-14, "max_step": 1.0}
    path = solve_ivp(north, (knots[0], knots[-1]), [latitude], **options).y[0]
    longitude = np.full_like(path, 0.3)
    position = earth.geodetic_to_ecef(path, longitude, np.zeros_like(path))
    return Curve(knots + 2.0, position, earth.q_en(path, longitude))


MOTIONS = {AT_REST: standing, TURNING: turning, ACCELERATING: gathering}
RATE = {AT_REST: 1.0, TURNING: 10.0, ACCELERATING: 10.0}

WARMING = {"temperature_start_c": -20.0, "temperature_steady_c": 5.0, "warm_up_time_s": 300.0}
FIXED: list[tuple[str, str, float, dict[str, Any]]] = [
    # term, motion, latitude, error
    ("gyro bias, north", AT_REST, NORTHERN, {"gyro_bias_deg_h": (0.01, 0.0, 0.0)}),
    ("gyro bias, east", AT_REST, -NORTHERN, {"gyro_bias_deg_h": (0.0, 0.01, 0.0)}),
    ("gyro bias, down", AT_REST, NORTHERN, {"gyro_bias_deg_h": (0.0, 0.0, 0.1)}),
    ("gyro scale factor, of the Earth's rate", AT_REST, NORTHERN, {"gyro_scale_ppm": (100.0, 0.0, 0.0)}),
    ("gyro scale factor, of the Earth's rate", AT_REST, NORTHERN, {"gyro_scale_ppm": (0.0, 0.0, 1000.0)}),
    ("gyro scale factor, of a turn", TURNING, 0.0, {"gyro_scale_ppm": (0.0, 0.0, 100.0)}),
    ("gyro asymmetry, of the Earth's rate", AT_REST, NORTHERN, {"gyro_asymmetry_ppm": (2000.0, 0.0, 0.0)}),
    (
        "gyro quadratic non-linearity, of the Earth's rate",
        AT_REST,
        NORTHERN,
        {"gyro_quadratic_ppm_per_deg_s": (1e5, 0.0, 0.0)},
    ),
    (
        "gyro cubic non-linearity, of the Earth's rate",
        AT_REST,
        NORTHERN,
        {"gyro_cubic_ppm_per_deg2_s2": (1e6, 0.0, 0.0)},
    ),
    (
        "gyro scale factor by temperature, of a turn",
        TURNING,
        0.0,
        {"gyro_scale_temperature_ppm_per_c": (0.0, 0.0, 10.0), **WARMING},
    ),
    ("gyro asymmetry, of a turn", TURNING, 0.0, {"gyro_asymmetry_ppm": (0.0, 0.0, 100.0)}),
    ("gyro quadratic non-linearity, of a turn", TURNING, 0.0, {"gyro_quadratic_ppm_per_deg_s": (0.0, 0.0, 30.0)}),
    ("gyro cubic non-linearity, of a turn", TURNING, 0.0, {"gyro_cubic_ppm_per_deg2_s2": (0.0, 0.0, 10.0)}),
    ("gyro misalignment, to the Earth's rate", AT_REST, NORTHERN, {"gyro_misalignment_arcsec": (0, 50.0, 0, 0, 0, 0)}),
    ("gyro misalignment, to the Earth's rate", AT_REST, NORTHERN, {"gyro_misalignment_arcsec": (0, 0, 50.0, 0, 0, 0)}),
    ("gyro misalignment, to the Earth's rate", AT_REST, NORTHERN, {"gyro_misalignment_arcsec": (0, 0, 0, 0, 500.0, 0)}),
    ("gyro misalignment, to a turn", TURNING, 0.0, {"gyro_misalignment_arcsec": (0, 20.0, 0, 0, 0, 0)}),
    ("gyro misalignment, to a turn", TURNING, 0.0, {"gyro_misalignment_arcsec": (0, 0, 0, 20.0, 0, 0)}),
    ("gyro g-sensitivity", AT_REST, NORTHERN, {"gyro_g_sensitivity_deg_h_per_g": (0, 0, 0, 0, 0, 0.01, 0, 0, 0)}),
    ("gyro ramp, level", AT_REST, NORTHERN, {"gyro_ramp_deg_h_per_h": (0.01, 0.0, 0.0)}),
    ("gyro ramp, down", AT_REST, NORTHERN, {"gyro_ramp_deg_h_per_h": (0.0, 0.0, 0.1)}),
    ("accelerometer bias, north", AT_REST, NORTHERN, {"accel_bias_ug": (50.0, 0.0, 0.0)}),
    ("accelerometer bias, east", AT_REST, 0.0, {"accel_bias_ug": (0.0, 50.0, 0.0)}),
    ("accelerometer misalignment, to gravity", AT_REST, NORTHERN, {"accel_misalignment_arcsec": (0, 5.0, 0, 0, 0, 0)}),
    ("accelerometer misalignment, to gravity", AT_REST, 0.0, {"accel_misalignment_arcsec": (0, 0, 0, 5.0, 0, 0)}),
    ("accelerometer ramp", AT_REST, NORTHERN, {"accel_ramp_ug_per_h": (50.0, 0.0, 0.0)}),
    ("accelerometer scale factor", ACCELERATING, NORTHERN, {"accel_scale_ppm": (50.0, 0.0, 0.0)}),
    (
        "accelerometer scale factor by temperature",
        ACCELERATING,
        NORTHERN,
        {"accel_scale_temperature_ppm_per_c": (5.0, 0.0, 0.0), **WARMING},
    ),
    ("accelerometer asymmetry", ACCELERATING, NORTHERN, {"accel_asymmetry_ppm": (50.0, 0.0, 0.0)}),
    ("accelerometer quadratic non-linearity", ACCELERATING, NORTHERN, {"accel_quadratic_ug_per_g2": (100.0, 0.0, 0.0)}),
    ("accelerometer cubic non-linearity", ACCELERATING, NORTHERN, {"accel_cubic_ug_per_g3": (1000.0, 0.0, 0.0)}),
    (
        "accelerometer misalignment, to an acceleration",
        ACCELERATING,
        NORTHERN,
        {"accel_misalignment_arcsec": (0, 0, 20.0, 0, 0, 0)},
    ),
    ("accelerometer cross-axis term", ACCELERATING, NORTHERN, {"accel_cross_axis_ug_per_g2": (0, 50.0, 0, 0, 0, 0)}),
]


@pytest.fixture(scope="module")
def motions() -> dict[tuple[str, float], tuple[Trajectory, ImuData]]:
    return {}


@pytest.mark.parametrize(("term", "assumes", "latitude", "errors"), FIXED, ids=lambda value: str(value)[:40])
def test_each_term_alone(
    motions: dict[tuple[str, float], tuple[Trajectory, ImuData]],
    term: str,
    assumes: str,
    latitude: float,
    errors: dict[str, Any],
) -> None:
    if (assumes, latitude) not in motions:
        truth = MOTIONS[assumes](latitude)
        motions[assumes, latitude] = truth, truth.increments(RATE[assumes])
    truth, ideal = motions[assumes, latitude]
    section = block(rate_hz=RATE[assumes], **errors)
    found = np.linalg.norm(end_error(truth, ideal, emulate(ideal, section)))
    (expected,) = [c for c in expect(section, latitude).contributions if c.term == term and c.assumes == assumes]
    assert expected.position > 2.0
    assert found == pytest.approx(expected.position, rel=0.035)


NOISES: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"gyro_arw_deg_sqrt_h": 0.003}, ("angle random walk, level", "angle random walk, down")),
    ({"accel_vrw_ug_sqrt_hz": 100.0}, ("velocity random walk",)),
    (
        {"gyro_instability_deg_h": 0.01, "gyro_correlation_time_s": 1200.0},
        ("gyro bias instability, level", "gyro bias instability, down"),
    ),
    ({"accel_instability_ug": 50.0, "accel_correlation_time_s": 600.0}, ("accelerometer bias instability",)),
    ({"gyro_rrw_deg_h_sqrt_h": 0.01}, ("gyro rate random walk, level", "gyro rate random walk, down")),
    ({"accel_rrw_ug_sqrt_h": 50.0}, ("accelerometer rate random walk",)),
    ({"gyro_flicker_deg_h": 0.01}, ("gyro flicker, level", "gyro flicker, down")),
    ({"accel_flicker_ug": 20.0}, ("accelerometer flicker",)),
]


@pytest.mark.parametrize("runs", [60, *slow(300)])
@pytest.mark.parametrize(("errors", "terms"), NOISES, ids=lambda value: str(value)[:40])
def test_each_noise_alone(errors: dict[str, Any], terms: tuple[str, ...], runs: int) -> None:
    """Root mean square over N runs: twice as many numbers, which tell it to 1/√(4N), 2.9 % for 300."""
    truth = standing(NORTHERN)
    ideal = truth.increments(0.1)
    section = block(rate_hz=0.1, **errors)
    there, start = truth.state(ideal.time), truth.state(0.0)
    square = 0.0
    for seed in range(runs):
        solution = navigate(emulate(ideal, section, seed), start, vertical="truth", height=there.height)
        square += float(np.sum(navigation_error(there, solution, truth.ellipsoid).position_ned[-1, :2] ** 2)) / runs
    expected = expect(section, NORTHERN)
    assert {c.term for c in expected.contributions} == set(terms)
    assert np.sqrt(square) == pytest.approx(expected.total, rel=3.0 / np.sqrt(4 * runs))


@pytest.mark.parametrize("runs", [50, *slow(300)])
@pytest.mark.parametrize("errors", [{"gyro_quantum_arcsec": 100.0}, {"accel_quantum_mm_s": 500.0}], ids=str)
def test_quantisation_alone(errors: dict[str, Any], runs: int) -> None:
    """What the pulses add to a noise that runs over many of them, so that every remainder is as likely."""
    truth = standing(NORTHERN)
    ideal = truth.increments(0.1)
    noise = {"gyro_arw_deg_sqrt_h": 0.5} if "gyro_quantum_arcsec" in errors else {"accel_vrw_ug_sqrt_hz": 1e5}
    there, start = truth.state(ideal.time), truth.state(0.0)
    square = 0.0
    for seed in range(runs):
        ends = []
        for section in (block(rate_hz=0.1, **noise), block(rate_hz=0.1, **noise, **errors)):
            solution = navigate(emulate(ideal, section, seed), start, vertical="truth", height=there.height)
            ends.append(navigation_error(there, solution, truth.ellipsoid).position_ned[-1, :2])
        square += float(np.sum((ends[1] - ends[0]) ** 2)) / runs
    (contribution,) = expect(block(rate_hz=0.1, **errors), NORTHERN).contributions
    assert np.sqrt(square) == pytest.approx(contribution.position, rel=3.0 / np.sqrt(4 * runs))


def test_velocity_quantisation_swings_with_schulers_period() -> None:
    """A rounded velocity is an error of position that swings: q²/12 of each sample times ∫cos²(ωt) dt, in two axes."""
    (found,) = expect(block(rate_hz=0.1, accel_quantum_mm_s=500.0), NORTHERN).contributions
    schuler = np.sqrt(9.806 / 6.378e6)
    time = np.linspace(0.0, HOUR, 100_001)
    swing = np.mean(np.cos(schuler * time) ** 2) * HOUR
    assert found.position == pytest.approx(np.sqrt(2.0 * 0.5**2 / 12.0 / 0.1 * swing), rel=5e-3)


@pytest.mark.parametrize("duration", [200.0, HOUR])
def test_unaided_height_runs_away_with_the_accelerometers_bias(duration: float) -> None:
    """ḧ = 2ω²h + b, integrated: gravity falls with height."""
    bias, schuler = 50e-6 * 9.80665, 9.806 / 6.378e6
    run = solve_ivp(lambda _, y: (y[1], 2.0 * schuler * y[0] + bias), (0.0, duration), (0.0, 0.0), rtol=1e-10)
    found = expect(block(accel_bias_ug=(50.0, 50.0, 50.0)), NORTHERN, duration).height
    assert found == pytest.approx(run.y[0, -1], rel=0.02)
    assert expect(block(gyro_arw_deg_sqrt_h=0.003), NORTHERN).height == 0.0


def test_warm_up() -> None:
    truth = standing(NORTHERN)
    ideal = truth.increments(0.1)
    for errors in (
        {"gyro_bias_temperature_deg_h_per_c": (0.001, 0.0, 0.0)},
        {"gyro_bias_temperature_deg_h_per_c": (0.0, 0.0, 0.02)},
        {"gyro_scale_temperature_ppm_per_c": (100.0, 0.0, 0.0)},
        {"gyro_scale_temperature_ppm_per_c": (0.0, 0.0, 1000.0)},
        {"accel_bias_temperature_ug_per_c": (0.0, 5.0, 0.0)},
    ):
        section = block(
            rate_hz=0.1, temperature_start_c=-20.0, temperature_steady_c=5.0, warm_up_time_s=900.0, **errors
        )
        (contribution,) = (c for c in expect(section, NORTHERN).contributions if c.assumes == AT_REST)
        found = np.linalg.norm(end_error(truth, ideal, emulate(ideal, section)))
        assert found == pytest.approx(contribution.position, rel=0.03)


def test_the_turn_sees_the_mean_temperature_of_its_time() -> None:
    """Θ∞ + (Θ₀ − Θ∞)(1 − e^(−x)) / x over a turn of x = 3 time constants; midpoints of hundredths are 4e-5 off it."""
    x, sigma = 3.0, {"gyro_scale_ppm": (0.0, 0.0, 100.0), "gyro_scale_temperature_ppm_per_c": (0.0, 0.0, 10.0)}
    time_constant = TURN / TURN_RATE / x
    section = block(temperature_start_c=-20.0, temperature_steady_c=5.0, warm_up_time_s=time_constant, **sigma)
    found = {c.term: c.position for c in expect(section, NORTHERN).contributions}
    warmth = 5.0 - 25.0 * (1.0 - np.exp(-x)) / x
    ratio = found["gyro scale factor by temperature, of a turn"] / found["gyro scale factor, of a turn"]
    assert ratio == pytest.approx(0.1 * abs(warmth), rel=5e-4)


def test_null_shift() -> None:
    """Laser gyros that warm by 25 °C, on the equator, where north and east know nothing of each other."""
    truth = standing(0.0)
    ideal = truth.increments(0.1)
    ring = {**PHYSICS, "lock_in_deg_h": 0.0, "gas_flow_mps": 3e-4, "gain_percent": 0.8}
    section = block(rate_hz=0.1, temperature_start_c=-25.0, warm_up_time_s=900.0, laser_gyro=LaserGyros(**ring))
    expected = {c.term: c.position for c in expect(section, 0.0).contributions}
    assert set(expected) == {"gyro null shift, level", "gyro null shift, down", "angle quantisation"}
    assert expected["angle quantisation"] < 1e-3 * expected["gyro null shift, level"]
    north, east = np.abs(end_error(truth, ideal, emulate(ideal, section)))
    level = expected["gyro null shift, level"] / np.sqrt(2.0)
    assert east == pytest.approx(level, rel=0.03)
    assert north == pytest.approx(level + expected["gyro null shift, down"], rel=0.03)  # alike on the three axes


def test_flicker_by_the_sum_over_its_samples() -> None:
    """σ² = Σᵢ Σⱼ hᵢ hⱼ C(|i − j|) Δt² with the response h of a sample to the end, for 1200 samples at 2 Hz."""
    rate, count = 2.0, 1200
    (found,) = expect(block(rate_hz=rate, accel_flicker_ug=20.0), NORTHERN, count / rate).contributions
    left = (np.arange(count)[::-1] + 0.5) / rate
    response = np.sin(np.sqrt(9.806 / 6.378e6) * left) / np.sqrt(9.806 / 6.378e6) / rate
    lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    variance = response @ flicker.covariance(lags) @ response
    both = np.sqrt(2.0 * variance) * 20e-6 * 9.80665
    assert found.position == pytest.approx(both, rel=4e-3)  # its quadrature is 2e-3 off at the cusp of C


def test_grade_of_one_nautical_mile_an_hour() -> None:
    """By hand: 0.01° of arc an hour, 1113.2 m, on which Schuler rides; 50 µg are 50e-6 R (1 − cos ωt)."""
    expected = expect(Imu(grade="laser-standard"), NORTHERN)
    found = {c.term: c.position for c in expected.contributions}
    omega_t = 3600.0 * np.sqrt(9.806 / 6.378e6)  # √(6367.4 · 6388.8) km, the two radii at 45°
    assert found["gyro bias, north"] == pytest.approx(1113.2 * (1.0 - np.sin(omega_t) / omega_t), rel=1e-3)
    assert found["accelerometer bias, east"] == pytest.approx(50e-6 * 6.378e6 * (1.0 - np.cos(omega_t)), rel=1e-3)
    assert expected.total / 1852.0 * 0.8326 == pytest.approx(0.97, abs=0.01)
    assert [c.position for c in expected.contributions] == sorted(found.values(), reverse=True)
    assert expected.total == pytest.approx(np.sqrt(sum(position**2 for position in found.values())), rel=1e-12)


def test_half_of_all_runs_is_said_of_what_differs_from_run_to_run() -> None:
    assert expect(Imu(grade="tactical", gyro_flicker_deg_h=0.1), NORTHERN).drawn
    assert not expect(Imu(grade="tactical", gyro_bias_deg_h=(0.0, 0.0, 1.0)), NORTHERN).drawn
    assert expect(Imu(grade="tactical", gyro_bias_deg_h=(0.0, 0.0, 0.0)), NORTHERN).drawn


def test_a_mean_and_a_sigma_add_as_mean_squares() -> None:
    both = {"gyro_bias_deg_h": (0.03, 0.0, 0.0), "gyro_bias_sigma_deg_h": 0.04}
    found = {c.term: c.position for c in expect(Imu(grade="ideal", **both), NORTHERN).contributions}
    one = {c.term: c.position for c in expect(block(gyro_bias_deg_h=(0.05, 0.04, 0.04)), NORTHERN).contributions}
    assert found == pytest.approx(one, rel=1e-12)
    assert not expect(Imu(grade="ideal", **both), NORTHERN).drawn


def test_a_set_without_gyros_has_no_closed_forms() -> None:
    six = SixAccelerometers(type="accelerometers", arm_m=0.3)
    with pytest.raises(InputError, match=r'sensor_set\.type = "accelerometers" is a different set'):
        expect(Imu(grade="tactical", sensor_set=six), NORTHERN)


def test_terms_in_both_units() -> None:
    """A line a person can check: 10 µg/√Hz and 0.003 deg/√h in SI, worked out by hand."""
    terms = {term.name: term for term in expect(Imu(grade="laser-standard"), NORTHERN).terms}
    assert (terms["gyro_arw"].value, terms["gyro_arw"].unit) == (pytest.approx(0.003), "deg/√h")
    assert (terms["gyro_arw"].si, terms["gyro_arw"].si_unit) == (pytest.approx(8.7266e-7, rel=1e-4), "rad/√s")
    assert (terms["accel_vrw"].value, terms["accel_vrw"].unit) == (pytest.approx(10.0), "µg/√Hz")
    assert (terms["accel_vrw"].si, terms["accel_vrw"].si_unit) == (pytest.approx(9.80665e-5), "m/s/√s")
    assert "gyro_correlation_time" not in terms  # there is no instability
    assert expect(Imu(grade="ideal"), NORTHERN).terms == ()
    assert expect(Imu(grade="ideal"), NORTHERN).total == 0.0


def test_physics_of_a_laser_gyro() -> None:
    expected = expect(Imu.model_validate({"grade": "laser-standard", "laser_gyro": PHYSICS}), NORTHERN)
    terms = {term.name: term.value for term in expected.terms}
    assert terms["gyro_quantum"] == pytest.approx(1.61483, rel=1e-5)
    assert terms["gyro_arw"] == pytest.approx(0.0051279, rel=1e-4)
    assert "angle quantisation" in {c.term for c in expected.contributions}


SIZES: dict[str, tuple[float, ...]] = {
    "gyro_bias_deg_h": (0.01, -0.02, 0.05), "gyro_scale_ppm": (100.0, -200.0, 500.0),
    "gyro_asymmetry_ppm": (70.0, -90.0, 300.0), "gyro_quadratic_ppm_per_deg_s": (1e3, -3e3, 2e3),
    "gyro_cubic_ppm_per_deg2_s2": (2e3, -5e3, 3e3), "gyro_misalignment_arcsec": (5.0, 7.0, -11.0, 13.0, 17.0, -19.0),
    "gyro_g_sensitivity_deg_h_per_g": (0.01, 0.02, 0.03, 0.05, 0.07, -0.09, 0.04, 0.06, 0.11),
    "gyro_ramp_deg_h_per_h": (0.01, 0.03, -0.2), "gyro_bias_temperature_deg_h_per_c": (1e-3, -3e-3, 2e-3),
    "gyro_scale_temperature_ppm_per_c": (2.0, 3.0, -7.0), "accel_bias_ug": (30.0, -70.0, 50.0),
    "accel_scale_ppm": (20.0, -30.0, 70.0), "accel_misalignment_arcsec": (3.0, 5.0, -7.0, 11.0, 2.0, -13.0),
    "accel_ramp_ug_per_h": (20.0, 50.0, 30.0), "accel_bias_temperature_ug_per_c": (2.0, -5.0, 3.0),
    "accel_scale_temperature_ppm_per_c": (1.0, 3.0, 2.0),
}  # fmt: skip


@pytest.mark.parametrize("key", SIZES)
def test_axes_add_in_squares(key: str) -> None:
    """Errors on several axes, each of its own size, are independent of one another."""
    size = SIZES[key]

    def expected(values: tuple[float, ...]) -> dict[str, float]:
        found = expect(block(**{key: values}, **WARMING), NORTHERN).contributions
        return {f"{one.term}, {one.assumes}": one.position for one in found}

    alone = [expected(tuple(value if k == i else 0.0 for k, value in enumerate(size))) for i in range(len(size))]
    together = expected(size)
    squares = {term: float(np.sqrt(sum(one.get(term, 0.0) ** 2 for one in alone))) for term in together}
    assert together == pytest.approx(squares, rel=1e-12)
    assert max(together.values()) > 1.0


def test_a_term_has_the_size_of_its_largest_axis() -> None:
    terms = expect(Imu(grade="ideal", gyro_bias_deg_h=(0.01, -0.03, 0.02)), NORTHERN).terms
    assert [(term.name, term.value, term.unit) for term in terms] == [("gyro_bias", pytest.approx(0.03), "deg/h")]
