"""Runs on each of the three sets of sensors: recorded, in step with the theory, refused where they cannot be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomli_w

from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_result import PlaneRun, Run
from sinssim.experiments.run.sensor_exhibits import sensor_errors
from sinssim.scenario import Scenario, load_scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import draw_attitude_sensor, draw_true_errors
from sinssim.sensors.sensor_set_section import AttitudeSensor
from sinssim.sensors.single_sensors import draw_accelerometers
from sinssim.units import ARCSEC, DEG_H, UG
from tests.recording.spies import html

FLIGHT = {"latitude_deg": 50.0, "course_deg": 40.0, "speed_mps": 200.0, "altitude_m": 5000.0, "duration_s": 60.0}
LEVEL = {"latitude_deg": 50.0, "duration_s": 60.0}
SIX = {"type": "accelerometers", "arm_m": 0.5}
ATTITUDE = {"type": "attitude-sensor"}
BY_ATTITUDE = {"algorithms": ["measured-attitude"], "frame": "inertial"}
ONLY_BIAS = {
    "accel_scale_sigma_ppm": 0.0,
    "accel_misalignment_sigma_arcsec": 0.0,
    "accel_vrw_ug_sqrt_hz": 0.0,
    "accel_instability_ug": 0.0,
}


def scenario(sensor_set: dict[str, Any], navigation: dict[str, Any], imu: dict[str, Any], **more: Any) -> Scenario:
    source = more or {"great_circle": FLIGHT}
    data = {"name": "set", "imu": {"grade": "ideal", **imu, "sensor_set": sensor_set}, "navigation": navigation}
    return Scenario.model_validate({**data, **source})


def worst(result: Run | PlaneRun) -> float:
    (numbers,) = result.summary["algorithms"].values()
    return float(numbers["max_horizontal_error_m"])


def test_ideal_sensors_of_every_set_close_the_loop() -> None:
    """As the engine closes on gyros, so on a measured attitude; without gyros gravitation differs over the arm."""
    by_gyros = worst(run(scenario({"type": "gyros"}, {}, {})))
    by_attitude = worst(run(scenario(ATTITUDE, BY_ATTITUDE, {})))
    assert by_gyros < 1e-6
    assert by_attitude < 1e-6
    # ½ δf t² of half the difference that 0.5 m make in gravitation, 3.1e-6 s⁻², and of its moment
    assert worst(run(scenario(SIX, {}, {}))) < 0.5 * 3.1e-6 * 60.0**2


@pytest.mark.parametrize(("arm", "bias_ug"), [(0.3, 0.1), (2.0, 1.0)])
def test_without_gyros_the_error_grows_by_the_law(arm: float, bias_ug: float) -> None:
    """Δp = ½ δf t² ∓ g δω̇ t⁴/24 of the biases that this run drew, combined by hand for the cube.

    To first order in the tilt and in the Earth's turn, each half a hundredth of a radian at the end, by which one
    axis shows in the other: within 1 % of the whole.
    """
    imu = {**ONLY_BIAS, "accel_bias_sigma_ug": bias_ug, "rate_hz": 20.0}
    result = run(scenario({"type": "accelerometers", "arm_m": arm}, {"vertical": "truth"}, imu, parked=LEVEL))
    a = np.concatenate([triad.bias for triad in draw_accelerometers(result.scenario.imu, 6, 0)])
    assert np.std(a) == pytest.approx(bias_ug * UG, rel=0.6)
    root8 = 2.0 * np.sqrt(2.0)
    growth = np.array([a[2] - a[3] - a[4] - a[5], -a[0] - a[1] + a[4] - a[5]]) / (root8 * arm)  # ω̇ about x, y
    push = np.array([a[2] - a[3] + a[4] + a[5], a[0] + a[1] + a[4] - a[5]]) / root8  # along x, y
    error = result.errors["quaternion"]
    for t in (30.0, 60.0):
        row = int(np.searchsorted(error.time, t))
        north = 0.5 * push[0] * t**2 - 9.811 * growth[1] * t**4 / 24.0
        east = 0.5 * push[1] * t**2 + 9.811 * growth[0] * t**4 / 24.0
        assert np.abs(error.position_ned[row, :2] - [north, east]).max() < 0.01 * np.hypot(north, east)
        # the sensors' own error: a ramp of the rate, its integral
        made = np.cumsum(result.sensed.measured.dtheta - result.truth.ideal.dtheta, axis=0)[row - 1]
        assert made[:2] == pytest.approx(0.5 * growth * t**2, rel=1e-6)


def test_a_measured_attitude_errs_as_its_sensor_does() -> None:
    """A drift of 1°/h about the inertial x axis and a bias about z, seen from where the vehicle is after a minute."""
    given = {**ATTITUDE, "drift_deg_h": [1.0, 0.0, 0.0], "bias_arcsec": [0.0, 0.0, 5.0]}
    result = run(scenario(given, BY_ATTITUDE, {}))
    off = np.array([60.0 * DEG_H, 0.0, 5.0 * ARCSEC])
    lat, lon = result.truth.state.latitude[-1], result.truth.state.longitude[-1] + 7.292115e-5 * 60.0
    north = [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]
    east, down = (
        [-np.sin(lon), np.cos(lon), 0.0],
        [-np.cos(lat) * np.cos(lon), -np.cos(lat) * np.sin(lon), -np.sin(lat)],
    )
    error = result.errors["measured-attitude"]
    assert error.time[-1] == 60.0
    # q_true = q(φ) ⊗ q_solution: φ is minus the sensor's rotation, but for 5 m of position error, 1e-6 rad
    assert error.attitude[-1] == pytest.approx(-np.array([north, east, down]) @ off, rel=0.0, abs=1e-6)
    assert np.abs(off).max() > 2.9e-4


def test_what_an_attitude_sensor_draws() -> None:
    """Its drift as the gyros of the grade are biased unless said otherwise, its bias with the given 1σ."""
    imu = {"grade": "tactical", "sensor_set": {**ATTITUDE, "bias_sigma_arcsec": 20.0}}
    other = {**imu, "sensor_set": {**ATTITUDE, "drift_sigma_deg_h": 0.3}}
    found: dict[str, list[Any]] = {"bias": [], "drift": [], "own drift": []}
    for seed in range(100):
        a, b = (
            draw_attitude_sensor(Scenario.model_validate(
                {"name": "x", "parked": LEVEL, "imu": i, "navigation": BY_ATTITUDE}).imu, seed)
            for i in (imu, other)
        )  # fmt: skip
        found["bias"].append(a.bias / ARCSEC)
        found["drift"].append(a.drift / DEG_H)
        found["own drift"].append(b.drift / DEG_H)
        assert not b.bias.any()
    for name, sigma in (("bias", 20.0), ("drift", 1.0), ("own drift", 0.3)):  # 300 draws: 4.1 % of spread
        assert np.std(found[name]) == pytest.approx(sigma, rel=0.14)
    given = {"bias_arcsec": (30.0, -20.0, 10.0), "drift_deg_h": (1.0, 2.0, -3.0)}
    for seed in range(3):  # given values add to those drawn from a 1σ, and alone leave nothing to draw
        alone, spread, both = (
            draw_attitude_sensor(Imu(grade="tactical", sensor_set=AttitudeSensor(**keys)), seed)
            for keys in (
                {**ATTITUDE, **given},
                {**ATTITUDE, "bias_sigma_arcsec": 20.0, "drift_sigma_deg_h": 0.3},
                {**ATTITUDE, **given, "bias_sigma_arcsec": 20.0, "drift_sigma_deg_h": 0.3},
            )
        )
        np.testing.assert_allclose(alone.bias, np.array(given["bias_arcsec"]) * ARCSEC, rtol=1e-15)
        np.testing.assert_allclose(alone.drift, np.array(given["drift_deg_h"]) * DEG_H, rtol=1e-15)
        np.testing.assert_allclose(both.bias, alone.bias + spread.bias, rtol=1e-14)
        np.testing.assert_allclose(both.drift, alone.drift + spread.drift, rtol=1e-14)


@pytest.mark.parametrize(("kind", "navigation"), [(SIX, {}), (ATTITUDE, BY_ATTITUDE)], ids=["six", "attitude"])
def test_streams(tmp_path: Path, kind: dict[str, Any], navigation: dict[str, Any]) -> None:
    result = run(scenario(kind, navigation, {"grade": "tactical"}, parked={**LEVEL, "duration_s": 5.0}), tmp_path / "r")
    folder = tmp_path / "r" / "streams"
    if kind is SIX:
        names = [f"dvel_{i}_mps" for i in range(1, 7)]
        for stream, readings in (("ideal", result.sensed.perfect), ("measured", result.sensed.readings)):
            table = pq.read_table(folder / f"accelerometers_{stream}.parquet")
            assert table.column_names == ["time_s", *names]
            assert np.array_equal(np.stack([table[n].to_numpy() for n in names], axis=1), readings.accelerometers)
            assert np.array_equal(table["time_s"].to_numpy(), result.truth.ideal.time[1:])
        # level: the cube's accelerometers 1 to 4 stand half across gravity, 5 and 6 lie in the horizon
        down = result.sensed.perfect.accelerometers.mean(axis=0) * 100.0
        assert down == pytest.approx(-9.811 / np.sqrt(2.0) * np.array([1.0, -1.0, 1.0, 1.0, 0.0, 0.0]), abs=0.01)
        assert "dtheta_x_rad" in pq.read_schema(folder / "imu_measured.parquet").names
    else:
        names = ["q_ib_w", "q_ib_x", "q_ib_y", "q_ib_z"]
        for stream, readings in (("ideal", result.sensed.perfect), ("measured", result.sensed.readings)):
            table = pq.read_table(folder / f"attitude_{stream}.parquet")
            assert table.column_names == ["time_s", *names]
            assert np.array_equal(np.stack([table[n].to_numpy() for n in names], axis=1), readings.attitude)
            assert np.array_equal(table["time_s"].to_numpy(), result.truth.ideal.time)
        # without gyros no angles were measured, and none are written
        measured = pq.read_schema(folder / "imu_measured.parquet").names
        assert measured == ["time_s", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps"]
        assert np.isnan(result.sensed.measured.dtheta).all()
    assert load_scenario(tmp_path / "r" / "scenario.toml") == result.scenario


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"imu": {"sensor_set": {"type": "accelerometers"}}}, "imu.sensor_set.arm_m is missing"),
        ({"imu": {"sensor_set": {**SIX, "arm_m": 0.0}}}, "arm_m = 0.0 must be greater than 0"),
        ({"imu": {"sensor_set": {**SIX, "noise_arcsec": 1.0}}}, "unknown key 'imu.sensor_set.noise_arcsec'"),
        ({"imu": {"sensor_set": {"type": "accelerometer"}}}, "Did you mean 'accelerometers'?"),
        ({"imu": {"sensor_set": SIX, "gyro_bias_sigma_deg_h": 1.0}}, 'gyro_bias_sigma_deg_h is given, but sensor_set'),
        ({"imu": {"sensor_set": SIX, "accel_bias_ug": [1.0, 0.0, 0.0]}}, "six accelerometers with random errors"),
        ({"imu": {"sensor_set": ATTITUDE}}, 'navigation.algorithms = ["measured-attitude"]'),
        ({"navigation": BY_ATTITUDE}, 'here imu.sensor_set.type = "gyros"'),
        ({"imu": {"sensor_set": ATTITUDE}, "navigation": {**BY_ATTITUDE, "frame": "level"}}, 'frame = "inertial"'),
        ({"navigation": {**BY_ATTITUDE, "algorithms": ["euler", "measured-attitude"]}}, "no other algorithm"),
        (
            {"imu": {"sensor_set": ATTITUDE}, "navigation": {**BY_ATTITUDE, "rates_hz": [100.0, 50.0, 10.0]}},
            "navigation.rates_hz: navigation with a measured attitude cannot run at three rates",
        ),
        ({"imu": {"sensor_set": SIX}, "compensation": {}}, "[compensation] needs gyros and accelerometers"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said_when_the_scenario_is_loaded(tmp_path: Path, tables: dict[str, Any], said: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(tomli_w.dumps({"great_circle": FLIGHT, **tables}))
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    assert said in str(caught.value)


def test_a_block_of_gyros_is_not_emulated_for_another_set() -> None:
    import sinssim

    given = scenario(SIX, {}, {})
    with pytest.raises(InputError, match="sensor_set"):
        sinssim.emulate(sinssim.fly(given).increments(100.0), given.imu)


def test_a_report_calls_no_set_without_gyros_by_its_gyros() -> None:
    """A grade's description is that of a unit with gyros."""
    grade = {"grade": "laser-standard"}
    texts = {
        kind: html(*sensor_errors(given := scenario(sensor_set, navigation, grade), draw_true_errors(given.imu), ()))
        for kind, sensor_set, navigation in (
            ("gyros", {"type": "gyros"}, {}),
            ("six", SIX, {}),
            ("attitude", ATTITUDE, BY_ATTITUDE),
        )
    }
    assert {kind: "laser-gyro IMU" in text for kind, text in texts.items()} == {
        "gyros": True, "six": False, "attitude": False,
    }  # fmt: skip
    assert all("laser-standard" in text for text in texts.values())
