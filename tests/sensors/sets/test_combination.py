"""Errors of a redundant set's combination: against single readings, against a plain triad, against draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.sensors import sensor_set_section as sensor_set
from sinssim.sensors.fault_detection import combine
from sinssim.sensors.imu.compensation import Compensation, compensate
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.redundant_set_errors import combined_errors, combined_sigma, spread
from sinssim.sensors.sensor_set_readings import draw_true_errors, read
from sinssim.sensors.single_sensors import draw_single_sensors, emulate_single_sensors
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.slow import slow

RATE = 50.0
PARKED = Parked(0.8, 0.2, 100.0, (1.0, 0.0, 0.0, 0.0), 8.0)
"""The block does not vibrate; its increments are given."""
LINEAR = {
    "gyro_bias_sigma_deg_h": 5.0, "gyro_scale_sigma_ppm": 800.0, "gyro_misalignment_sigma_arcsec": 300.0,
    "gyro_g_sensitivity_sigma_deg_h_per_g": 2.0, "accel_bias_sigma_ug": 700.0, "accel_scale_sigma_ppm": 400.0,
    "accel_misalignment_sigma_arcsec": 200.0,
}  # fmt: skip
BENT = {
    "gyro_asymmetry_sigma_ppm": 50.0,
    "accel_quadratic_sigma_ug_per_g2": 20.0,
    "accel_cross_axis_sigma_ug_per_g2": 9,
}
SKEWED = [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]


def section(own: dict[str, Any] | None = None, **errors: Any) -> Imu:
    given = {"type": "redundant", "monitoring": "none", **(own or {})}
    return Imu.model_validate({"grade": "ideal", "rate_hz": RATE, "sensor_set": given, **errors})


def motion(samples: int = 400) -> ImuData:
    """Increments of a lively motion."""
    random = np.random.default_rng(5)
    time = np.arange(samples + 1) / RATE
    return ImuData(time, 0.02 * random.normal(size=(samples, 3)), 0.2 * random.normal(size=(samples, 3)))


@pytest.mark.parametrize("axes", [*sensor_set.READY.values(), sensor_set._cone(8)], ids=[*sensor_set.READY, "octad"])
def test_noise_of_n_equal_sensors_is_smaller_by_the_root_of_3_over_n(axes: Array) -> None:
    assert spread(axes) == pytest.approx(3.0 / len(axes) * np.eye(3), abs=1e-15)


@pytest.mark.parametrize("axes", [np.array(SKEWED), sensor_set.READY["dodecahedron"]], ids=["skewed", "dodecahedron"])
def test_combination_has_the_errors_of_the_triad(axes: Array) -> None:
    """To first order: products of scale factors and misalignments are at most 4e-3 of the errors."""
    plan = section({"directions": axes.tolist()}, **LINEAR)
    blocks, ideal = draw_single_sensors(plan, len(axes), 3), motion()
    single = emulate_single_sensors(ideal, plan, blocks, 3)
    triad = combined_errors(blocks, axes)
    expected = emulate(ideal, triad)
    for mine, theirs, true in (
        (single.dtheta, expected.dtheta, ideal.dtheta),
        (single.dvel, expected.dvel, ideal.dvel),
    ):
        error = theirs - true
        assert combine(mine, axes) - true == pytest.approx(error, abs=4e-3 * np.abs(error).max())


def test_three_orthogonal_sensors_are_a_plain_triad(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same errors, noise included, and the same calibration; axes across differ only in their directions."""
    monkeypatch.setitem(sensor_set.READY, "cone-5", np.eye(3))
    errors = {k: v for k, v in LINEAR.items() if "misalign" not in k and "g_sens" not in k} | {
        "gyro_arw_deg_sqrt_h": 0.1, "accel_vrw_ug_sqrt_hz": 100.0, "gyro_flicker_deg_h": 1.0, "accel_quantum_mm_s": 0.1,
    }  # fmt: skip
    calibration = Compensation(gyro_bias_sigma_deg_h=0.5, accel_scale_sigma_ppm=30.0)
    ideal = motion()
    plain = Imu.model_validate({"grade": "ideal", "rate_hz": RATE, **errors})
    one, three = (
        read(PARKED, ideal, own, 4, draw_true_errors(own, 4, calibration))[1]
        for own in (plain, section({"layout": "cone-5"}, **errors))
    )
    assert one.compensated is not None
    assert three.compensated is not None
    for mine, theirs in ((three.imu, one.imu), (three.compensated, one.compensated)):
        assert mine.dtheta == pytest.approx(theirs.dtheta, rel=1e-13, abs=1e-15)
        assert mine.dvel == pytest.approx(theirs.dvel, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("axes", [np.array(SKEWED), *slow(sensor_set.READY["cone-4"])], ids=["skewed", "cone-4"])
@pytest.mark.parametrize("draws", [100, *slow(800)])
def test_standard_deviations_are_those_of_draws(axes: Array, draws: int) -> None:
    """A standard deviation is within 4.4σ, 11 % of 800 draws, for all of 24 numbers but with 2e-4."""
    plan = section({"directions": axes.tolist()}, **LINEAR)
    sigma = combined_sigma(
        ImuErrors(TriadErrors(bias=np.full(3, 1.0), scale=np.full(3, 2.0), misalignment=3.0 * (1.0 - np.eye(3)))), plan
    ).gyro
    random, found = np.random.default_rng(1), []
    for _ in range(draws):
        blocks = tuple(
            ImuErrors(
                TriadErrors(
                    bias=random.normal(size=3), scale=2.0 * random.normal(size=3),
                    misalignment=3.0 * random.normal(size=(3, 3)) * (1.0 - np.eye(3)),
                )
            )
            for _ in range(2)
        )  # fmt: skip
        one = combined_errors(blocks, axes).gyro
        found.append(np.concatenate([one.bias, one.scale, one.misalignment.ravel()]))
    expected = np.concatenate([sigma.bias, sigma.scale, sigma.misalignment.ravel()])
    assert np.std(found, axis=0) == pytest.approx(expected, rel=4.4 / np.sqrt(2 * draws))


@pytest.mark.parametrize("seed", [1, 2])
def test_perfect_calibration_restores_the_ideal_increments(seed: int) -> None:
    plan, ideal = section(**LINEAR, **BENT), motion()
    errors = draw_true_errors(plan, seed, Compensation())
    readings = read(PARKED, ideal, plan, seed, errors)[1]
    assert readings.compensated is not None
    assert np.abs(readings.imu.dtheta - ideal.dtheta).max() > 1e-6
    assert readings.compensated.dtheta == pytest.approx(ideal.dtheta, abs=1e-15)
    assert readings.compensated.dvel == pytest.approx(ideal.dvel, abs=1e-14)


def test_errors_of_the_calibration_remain() -> None:
    """The combination of what the calibration of each sensor leaves, to first order: the errors are a few mrad."""
    plan, ideal = section(**LINEAR), motion()
    left = Compensation(gyro_bias_sigma_deg_h=0.5, gyro_scale_sigma_ppm=100.0, accel_misalignment_sigma_arcsec=20.0)
    errors = draw_true_errors(plan, 2, left)
    readings = read(PARKED, ideal, plan, 2, errors)[1]
    axes = sensor_set.READY["dodecahedron"]
    truth = combined_errors(errors.single_sensors, axes)
    known = combined_errors(errors.single_calibrations, axes)
    expected = (truth.gyro.bias - known.gyro.bias) / RATE
    expected = expected + ideal.dtheta @ _matrix(truth.gyro, known.gyro).T
    assert readings.compensated is not None
    assert readings.compensated.dtheta - ideal.dtheta == pytest.approx(expected, abs=1e-2 * np.abs(expected).max())
    force = ideal.dvel @ _matrix(truth.accel, known.accel).T
    assert readings.compensated.dvel - ideal.dvel == pytest.approx(force, abs=1e-2 * np.abs(force).max())


def _matrix(true: TriadErrors, known: TriadErrors) -> Array:
    return np.asarray(np.diag(true.scale - known.scale) + true.misalignment - known.misalignment)


def test_a_lost_sensor_does_not_spoil_the_compensation_of_the_others() -> None:
    """Without the excluded accelerometer, the calibration is as good as with all."""
    fault = {"type": "dropout", "from_s": 2.0, "channels": ["accel_5"]}
    plan = section({"monitoring": "exclude", "windows_s": [1.0]}, faults=[fault], **LINEAR)
    ideal = motion()
    ideal = ImuData(ideal.time, ideal.dtheta, ideal.dvel - np.array([0.0, 0.0, 0.2]))
    readings = read(PARKED, ideal, plan, 6, draw_true_errors(plan, 6, Compensation()))[1]
    accel = readings.monitored[1]
    (alarm,) = accel.excluded
    assert alarm.sensor == 5
    assert readings.compensated is not None
    after = ~accel.used[:, 4]
    assert readings.compensated.dvel[after] == pytest.approx(ideal.dvel[after], abs=1e-13)
    assert readings.compensated.dtheta == pytest.approx(ideal.dtheta, abs=1e-11)


def test_monitoring_tests_what_the_compensation_leaves() -> None:
    """A bias of 40 deg/h hides behind uncalibrated biases of 20 deg/h, but not behind calibrated ones."""
    fault = {"type": "bias-step", "from_s": 2.0, "gyro_deg_h": [0.0, 40.0, 0.0, 0.0, 0.0, 0.0]}
    plan = section(
        {"monitoring": "exclude", "windows_s": [1.0]}, faults=[fault], **{**LINEAR, "gyro_bias_sigma_deg_h": 20}
    )
    found = []
    for calibration in (None, Compensation(gyro_bias_sigma_deg_h=0.1)):
        errors = draw_true_errors(plan, 1, calibration)
        readings = read(PARKED, motion(), plan, 1, errors)[1]
        found.append([alarm.sensor for alarm in readings.monitored[0].excluded])
    assert found == [[], [2]]


def test_compensation_of_a_plain_triad_is_as_before() -> None:
    plan = Imu.model_validate({"grade": "tactical", "rate_hz": RATE})
    errors = draw_true_errors(plan, 1, Compensation(gyro_bias_sigma_deg_h=0.1))
    readings = read(PARKED, motion(), plan, 1, errors)[1]
    assert errors.calibration is not None
    assert readings.compensated is not None
    assert np.array_equal(readings.compensated.dvel, compensate(readings.imu, errors.calibration).dvel)
