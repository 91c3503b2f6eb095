"""Composition of error models: blocks by name, their processes, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.alignment.alignment_budget import expected_errors
from sinssim.alignment.initial_conditions import STATES
from sinssim.errors import InputError
from sinssim.estimation import BLOCKS, Block, ErrorModel, error_model
from sinssim.sensors import flicker
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp
from sinssim.sensors.imu.imu_section import Imu

NAVIGATION = (Block("position", 10.0), Block("velocity", 0.1), Block("attitude", (1e-3, 1e-3, 1e-2)))


def test_the_states_are_those_of_the_alignment() -> None:
    sigma = expected_errors(Imu(grade="laser-standard")).sigma
    assert error_model(sigma).states == STATES[:15]
    constant = [f"{triad} {what}" for what in ("bias", "scale", "misalignment") for triad in ("gyro", "accelerometer")]
    assert error_model(sigma, imu=constant).states == STATES


def test_noise_and_sigmas_come_from_the_sensor_description() -> None:
    model = error_model(expected_errors(Imu(grade="mems-industrial")).sigma)
    deg_h = np.pi / 180 / 3600
    assert [block.name for block in model.blocks][3:] == ["gyro bias", "accelerometer bias", "gyro instability"]
    assert model.gyro_noise == pytest.approx(0.1 * np.pi / 180 / 60)
    assert model.accel_noise == pytest.approx(0.1 / 60)
    np.testing.assert_allclose(model.sigma[model.slices["gyro bias"]], 25 * deg_h)
    np.testing.assert_allclose(model.sigma[model.slices["accelerometer bias"]], 2e-3 * 9.80665)
    np.testing.assert_allclose(model.sigma[model.slices["gyro instability"]], 2 * deg_h)
    # A stationary Gauss-Markov process: variance σ² = q τ/2.
    density = model.density[model.slices["gyro instability"]]
    np.testing.assert_allclose(density**2 * 3600.0 / 2.0, (2 * deg_h) ** 2)
    assert not model.fed_back[model.slices["gyro instability"]].any()
    assert model.fed_back[:15].all()


def test_a_rate_random_walk_makes_the_bias_walk() -> None:
    model = error_model(expected_errors(Imu(gyro_rrw_deg_h_sqrt_h=0.02)).sigma)
    where = model.slices["gyro bias"]
    # after an hour it has walked by 0.02 deg/h
    np.testing.assert_allclose(model.density[where] * 60.0, 0.02 * np.pi / 180 / 3600)
    assert model.fed_back[where].all()


def test_what_drifts_is_told_as_a_walk_of_the_bias() -> None:
    deg_h = np.pi / 180.0 / 3600.0

    def walk(duration: float = 3600.0, **imu: float) -> tuple[float, float]:
        model = error_model(
            expected_errors(Imu(grade="ideal", accel_bias_sigma_ug=1.0, **imu)).sigma, duration=duration
        )
        first = model.slices["gyro bias"].start
        return float(model.sigma[first]), float(model.density[first])

    # after the whole run as large as the ramp, before that larger
    start, density = walk(1600.0, gyro_ramp_sigma_deg_h_per_h=0.9)
    assert (start, density * 40.0) == pytest.approx((0.0, 0.9 * deg_h * 1600.0 / 3600.0))
    # five degrees of warm-up by e^(-t/τ): 1 - e^(-x) <= √x
    start, density = walk(
        gyro_bias_temperature_sigma_deg_h_per_c=0.1,
        temperature_start_c=-2.0,
        temperature_steady_c=3.0,
        warm_up_time_s=900.0,
    )
    assert (start, density * 30.0) == pytest.approx((0.2 * deg_h, 0.5 * deg_h))
    # Allan deviations 0.2/√τ and 0.664 B meet at (0.2/0.0664)² h = 9.06 h, and there the walk's K √(τ/3)
    start, density = walk(gyro_arw_deg_sqrt_h=0.2, gyro_flicker_deg_h=0.1)
    floor = np.sqrt(2.0 * np.log(2.0) / np.pi) * 0.1
    assert density * 60.0 / deg_h == pytest.approx(floor * np.sqrt(3.0) / (0.2 / floor), rel=1e-6)
    assert 0.05 * deg_h < start < 0.15 * deg_h


def test_what_no_block_knows_is_said() -> None:
    section = Imu(grade="tactical", gyro_g_sensitivity_sigma_deg_h_per_g=1.0, accel_range_g=20.0)
    model = error_model(expected_errors(section).sigma, imu=("gyro bias", "accelerometer bias", "gyro scale"))
    assert model.untold == (
        "misalignments of the gyros",
        "sensitivity to g of the gyros",
        "scale factors of the accelerometers",
        "misalignments of the accelerometers",
        "range of the accelerometers",
    )


def test_what_a_scenario_fixes_is_known_and_needs_no_spread() -> None:
    sigma = expected_errors(Imu(grade="laser-standard", gyro_bias_deg_h=(0.1, 0.0, 0.0))).sigma
    model = error_model(sigma, imu=("gyro bias", "gyro misalignment", "gyro scale"))
    np.testing.assert_array_equal(model.sigma[model.slices["gyro bias"]], 0.0)
    assert model.slices["gyro misalignment"] == slice(12, 18)
    np.testing.assert_allclose(model.sigma[12:18], 5 * np.pi / 180 / 3600)
    np.testing.assert_allclose(model.sigma[18:21], 10e-6)


def test_a_sensors_block_is_as_large_as_its_sigma() -> None:
    model = ErrorModel((*NAVIGATION, Block("gnss-position bias", (2.0, 2.0, 4.0), correlation_time=300.0)), 0.0, 0.0)
    assert model.size == 12
    assert model.states[-1] == "gnss-position bias 3"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ErrorModel((*NAVIGATION, Block("gyro bias", 1.0), Block("gyro bias", 1.0)), 0.0, 0.0), "given twice"),
        (lambda: ErrorModel((Block("gyro bias", 1.0), *NAVIGATION), 0.0, 0.0), "begins with"),
        (lambda: ErrorModel(NAVIGATION, -1.0, 0.0), "gyro_noise = -1"),
        (lambda: Block("gyro biass", 1.0), "gyro bias"),
        (lambda: Block("gyro bias", -1.0), "not negative"),
        (lambda: Block("gyro bias", (1.0, 2.0)), "one for each"),
        (lambda: Block("gyro bias", np.nan), "finite"),
        (lambda: Block("gyro bias", 1.0, correlation_time=0.0), "must be positive"),
        (lambda: Block("gyro bias", 1.0, random_walk=1.0, correlation_time=9.0), "Gauss-Markov"),
        (lambda: error_model(expected_errors(Imu()).sigma, imu=("position",)), "inertial sensors"),
    ],
)
def test_refused(make: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()  # type: ignore[operator]


def test_axes_units_and_limits_of_the_blocks() -> None:
    body, ned, pairs = ("forward", "right", "down"), ("north", "east", "down"), ("xy", "xz", "yx", "yz", "zx", "zy")
    expected = {
        "position": (ned, "m"), "velocity": (ned, "m/s"), "attitude": (ned, "rad"),
        "gravity disturbance": (ned, "m/s²"),
        "gnss lever arm": (body, "m"), "gnss time offset": (("",), "s"),
        "gyro asymmetry": (body, ""), "accelerometer asymmetry": (body, ""),
        "gyro quadratic": (body, "s/rad"), "accelerometer quadratic": (body, "s²/m"),
        "gyro cubic": (body, "s²/rad²"), "accelerometer cubic": (body, "s⁴/m²"),
        "accelerometer cross-axis": (pairs, "s²/m"),
        "gyro g-sensitivity": (("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"), "rad/s/(m/s²)"),
    }  # fmt: skip
    for triad, unit in (("gyro", "rad/s"), ("accelerometer", "m/s²")):
        for what in ("bias", "instability", *(f"flicker {k}" for k in range(1, 10))):
            expected[f"{triad} {what}"] = (body, unit)
        expected[f"{triad} scale"], expected[f"{triad} misalignment"] = (body, ""), (pairs, "rad")
    assert expected == BLOCKS
    for name, (axes, unit) in expected.items():
        block = Block(name, 1.0)
        assert (block.size, block.unit) == (len(axes), unit)
        assert block.states == ((name,) if len(axes) == 1 else tuple(f"{name} {axis}" for axis in axes))
    own = [
        Block("gyro bias", 0.1), Block("baro delay", 1.0), Block("gnss time offset", 1.0),
        Block("wheels mounting", np.ones(2)), Block("radar delay", 1.0, correlation_time=9.0),
    ]  # fmt: skip
    model = ErrorModel((*NAVIGATION, *own), 0.0, 0.0)
    # 100 m, 5 m/s, 1 mrad; 5 ms of a constant delay, 10 mrad of mounting
    expected_largest = [*[100.0] * 3, *[5.0] * 3, *[1e-3] * 3, *[np.inf] * 3, 5e-3, 5e-3, 1e-2, 1e-2, np.inf]
    np.testing.assert_array_equal(model.largest, expected_largest)
    np.testing.assert_allclose(model.decay, [*[0.0] * 16, 1.0 / 9.0])
    np.testing.assert_allclose(model.density[-1], np.sqrt(2.0 / 9.0))


def test_covariance_between_blocks() -> None:
    """A matrix of 2 × 3 stands at its rows and columns, and mirrored; that of a block that is not there nowhere."""
    matrix = np.arange(1.0, 7.0).reshape(2, 3)
    blocks = (*NAVIGATION, Block("gp bias", (2.0, 3.0)), Block("gyro bias", (4.0, 5.0, 6.0)))
    model = ErrorModel(
        blocks, 0.0, 0.0, correlations=(("gp bias", "gyro bias", matrix), ("gp bias", "gyro scale", matrix))
    )
    expected = np.diag([100.0] * 3 + [0.01] * 3 + [1e-6, 1e-6, 1e-4, 4.0, 9.0, 16.0, 25.0, 36.0])
    expected[9:11, 11:], expected[11:, 9:11] = matrix, matrix.T
    np.testing.assert_allclose(model.covariance, expected)


def test_start_of_a_drifting_bias() -> None:
    """Bias 3, temperature 0.4 per kelvin at 10 K and flicker 12 whose mean over a second has its own variance: 13."""
    one = np.ones(3)
    rate = np.sqrt(flicker.variance_of_mean(100.0))
    sigma = ImuErrors(
        TriadErrors(bias=3e-6 * one, bias_temperature=0.4e-6 * one, flicker=12e-6 / rate, ramp=1e-8 * one,
                    rate_walk=2e-8),
        TriadErrors(), warm_up=WarmUp(10.0, 30.0, 400.0),
    )  # fmt: skip
    block = error_model(sigma, duration=900.0).blocks[3]
    np.testing.assert_allclose(block.sigma, 13e-6 * one, rtol=1e-9)
    # K² + R²T + (βΔΘ)²/τ + 3 (2 ln 2/π) B² over the second from which an estimate takes that long at least
    walk = 4e-16 + 1e-16 * 900.0 + (0.4e-6 * 20.0) ** 2 / 400.0 + 3.0 * 2.0 * np.log(2.0) / np.pi * (12e-6 / rate) ** 2
    np.testing.assert_allclose(block.density, np.sqrt(walk) * one, rtol=1e-9)
    hour = error_model(sigma).blocks[3]  # the usual time
    np.testing.assert_allclose(hour.density, np.sqrt(walk + 1e-16 * 2700.0) * one, rtol=1e-9)
