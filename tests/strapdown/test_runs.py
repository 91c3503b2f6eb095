"""Runs on a platform: beside strapdown on the same sensors, recorded, reported, refused where they cannot be."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomli_w

from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from sinssim.experiments.run.finished_runs import load_streams
from sinssim.experiments.run.run_execution import run
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.units import ARCSEC, DEG, DEG_H, PPM
from tests.slow import slow

LEVEL = {"latitude_deg": 50.0, "course_deg": 40.0, "speed_mps": 200.0, "altitude_m": 5000.0, "duration_s": 60.0}
QUIET = {"grade": "ideal", "rate_hz": 50.0}


def scenario(sensor_set: dict[str, Any] | None = None, imu: dict[str, Any] | None = None, **more: Any) -> Scenario:
    given = {
        "grade": "laser-standard",
        "rate_hz": 50.0,
        **(imu or {}),
        "sensor_set": {"type": "platform", **(sensor_set or {})},
    }
    source = {} if any(key in more for key in ("parked", "motion")) else {"great_circle": LEVEL}
    return Scenario.model_validate({"name": "platform", **source, "imu": given, **more})


def test_by_default_it_flies_beside_strapdown() -> None:
    assert scenario().navigation.algorithms == ("platform", "quaternion")
    assert scenario(navigation={"frame": "wander"}).navigation.algorithms == ("platform", "quaternion")
    alone = scenario(navigation={"algorithms": ["platform"]})
    assert run(alone).summary["platform"].keys().isdisjoint({"strapdown"})


@pytest.mark.parametrize("solution", ["platform", "quaternion"])
def test_runs_of_an_ensemble_are_single_runs(solution: str) -> None:
    of = scenario(ensemble={"epoch_s": 10.0, "solution": solution})
    errors = errors_of_runs(make_plan(of), range(2), TruthCache())
    assert list(errors.failure) == ["", ""]
    for row, seed in enumerate(errors.seed):
        single = run(of.model_copy(update={"seed": int(seed)})).errors[solution]
        np.testing.assert_array_equal(errors.final[row, :3], single.position_ned[-1])


@pytest.mark.parametrize("frame", ["level", "wander", "free-azimuth", "transverse", "inertial"])
def test_perfect_sensors_close_the_loop(frame: str) -> None:
    result = run(scenario(imu=QUIET, navigation={"frame": frame}))
    for name in ("platform", "quaternion"):
        assert result.summary["algorithms"][name]["max_horizontal_error_m"] < 1e-5


def test_on_a_turntable_a_scale_factor_costs_strapdown_alone() -> None:
    """k Ω t about the vertical of the table, and nothing on the platform, which does not turn with it."""
    rate, seconds = 10.0, 100.0
    turn = {"type": "turn", "angle_deg": rate * seconds, "rate_deg_s": rate, "axis": [0.0, 0.0, 1.0]}
    motion = {"type": "rotation-table", "latitude_deg": 50.0, "steps": [turn]}
    sensors = {**QUIET, "gyro_scale_ppm": [0.0, 0.0, 50.0]}
    result = run(scenario({"torquer_scale_ppm": [0.0, 0.0, 0.0]}, sensors, motion=motion))
    turned = 50.0 * PPM * rate * DEG * seconds
    assert result.errors["quaternion"].angle[-1] == pytest.approx(turned, rel=0.01)
    assert result.errors["platform"].angle[-1] < 1e-4 * turned
    assert result.parts["platform"].without_errors_of_turns is not None
    assert result.parts["platform"].without_errors_of_turns.angle[-1] < 1e-4 * turned
    assert result.summary["platform"]["turned_deg"] == pytest.approx(rate * seconds, rel=0.01)


def test_turns_to_and_fro_cancel_and_a_platform_has_neither() -> None:
    """The scale factor's error kΘ is back at zero after the turn back; the platform has none in between either."""
    turn = {"type": "turn", "angle_deg": 720.0, "rate_deg_s": 10.0, "axis": [0.0, 0.0, 1.0]}
    motion = {"type": "rotation-table", "latitude_deg": 50.0, "steps": [turn, {**turn, "angle_deg": -720.0}]}
    result = run(
        scenario({"torquer_scale_ppm": [0.0] * 3}, {**QUIET, "gyro_scale_ppm": [0.0, 0.0, 50.0]}, motion=motion)
    )
    own, most = result.errors["quaternion"].angle, 50.0 * PPM * np.radians(720.0)
    assert own.max() == pytest.approx(most, rel=0.01)
    assert own[-1] < 0.01 * most  # what is left is k times the Earth's rate
    assert result.errors["platform"].angle.max() < 1e-4 * most


def test_misalignment_in_a_turn_is_that_of_its_closed_form() -> None:
    """A gyro x tilted by δ towards the axis of the turn reads δΩ: |φ| = 2δ |sin(Θ/2)| strapped down."""
    turn = {"type": "turn", "angle_deg": 540.0, "rate_deg_s": 10.0, "axis": [0.0, 0.0, 1.0]}
    motion = {"type": "rotation-table", "latitude_deg": 50.0, "steps": [turn]}
    tilt = {**QUIET, "gyro_misalignment_arcsec": [0.0, 30.0, 0.0, 0.0, 0.0, 0.0]}
    result = run(scenario({"torquer_scale_ppm": [0.0] * 3}, tilt, motion=motion))
    turned = np.concatenate([[0.0], np.cumsum(result.truth.ideal.dtheta[:, 2])])
    want = 2.0 * 30.0 * ARCSEC * np.abs(np.sin(0.5 * turned))
    np.testing.assert_allclose(result.errors["quaternion"].angle, want, atol=0.01 * want.max())
    assert result.errors["platform"].angle.max() < 1e-4 * want.max()


def test_coning_does_not_reach_a_platform() -> None:
    """Coning of 1° at 10 Hz and 50 Hz sampling costs strapdown metres in a minute, and a platform nothing."""
    motion = {"type": "coning", "latitude_deg": 50.0, "duration_s": 30.0, "half_angle_deg": 1.0, "frequency_hz": 10.0}
    result = run(scenario(imu=QUIET, motion=motion))
    assert result.errors["quaternion"].angle.max() > 100.0 * ARCSEC
    assert result.errors["platform"].angle.max() < 1e-4 * ARCSEC
    assert result.errors["platform"].horizontal.max() < 1e-6


@pytest.mark.parametrize("algorithm", [*slow("functional-iteration"), "rotation-vector-4"])
def test_beside_an_algorithm_with_fewer_rows(algorithm: str, tmp_path: Path) -> None:
    result = run(scenario(navigation={"algorithms": ["platform", algorithm]}), tmp_path / "run")
    assert result.summary["platform"]["strapdown"]["algorithm"] == algorithm
    assert not result.navigated.failures


def test_side_by_side(tmp_path: Path) -> None:
    result = run(scenario(imu={"gyro_scale_ppm": [500.0, 500.0, 500.0]}), tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    found = summary["platform"]
    assert found["torquer_scale_ppm"] == [0.0, 0.0, 0.0]  # by default as sure as the gyros' scale factor, here given
    strapdown = found["strapdown"]
    assert strapdown["algorithm"] == "quaternion"
    # without scale factor and misalignment, it is the run that has none: the same draws, the same flight
    none = {"gyro_scale_sigma_ppm": 0.0, "gyro_misalignment_sigma_arcsec": 0.0}
    other = run(scenario(imu=none, navigation={"algorithms": ["platform", "quaternion"]}))
    own = other.summary["algorithms"]["quaternion"]
    assert strapdown["without_errors_of_turns"]["max_horizontal_error_m"] == own["max_horizontal_error_m"]
    apart = result.errors["quaternion"].position_ned - other.errors["quaternion"].position_ned
    assert strapdown["final_distance_m"] == pytest.approx(np.hypot(*apart[-1, :2]))
    # the platform does not know of them
    assert summary["algorithms"]["platform"] == other.summary["algorithms"]["platform"]
    causes = found["final_horizontal_error_by_cause_m"]
    assert set(causes) == {"drift_of_the_gyros", "torquing_scale_factor", "accelerometers", "initial_state"}

    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    for words in (
        "Platform and strapdown",
        "It is level and points north",
        "strapdown, gyros without scale-factor error, misalignment and non-linearity",
        "Platform: commanded rate [deg/h]",
        "What each error contributes",
        "torquing scale factor x, y, z",
    ):
        assert words in report
    streams = tmp_path / "run" / "streams"
    own_stream = pq.read_table(streams / "platform.parquet")
    assert own_stream.column_names == [
        "time_s", "commanded_x_radps", "commanded_y_radps", "commanded_z_radps",
        "drift_x_radps", "drift_y_radps", "drift_z_radps", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps",
        "gimbal_roll_rad", "gimbal_pitch_rad", "gimbal_azimuth_rad", "q_ip_w", "q_ip_x", "q_ip_y", "q_ip_z",
    ]  # fmt: skip
    solution = result.solutions["platform"]
    assert solution is not None
    np.testing.assert_array_equal(own_stream["drift_y_radps"].to_numpy(), solution.drift[:, 1])
    without = pq.read_table(streams / "error_without_errors_of_turns.parquet")
    last = np.hypot(without["position_n_m"].to_numpy()[-1], without["position_e_m"].to_numpy()[-1])
    assert last == pytest.approx(strapdown["without_errors_of_turns"]["final_horizontal_error_m"], rel=1e-6)
    error = load_streams(tmp_path / "run")["error_platform"]
    np.testing.assert_array_equal(error["position_e_m"], result.errors["platform"].position_ned[:, 1])
    np.testing.assert_array_equal(error["phi_d_rad"], result.errors["platform"].attitude[:, 2])
    shown = find_run_info(tmp_path / "run" / "recording.rrd")
    for entity in ("horizontal", "attitude", "sensed", "commanded", "gimbals"):
        assert f"platform/{entity}" in shown.ranges
    assert all_views(shown, "platform").root_container.contents[-1].name == "platform"


def test_the_platform_is_commanded_the_earths_rate_and_that_of_the_flight() -> None:
    """15.04 cos φ and 200 m/s over the Earth's radius, here for 60 s along the great circle."""
    result = run(scenario(imu=QUIET))
    omega, v = 7.292115e-5, result.truth.state.velocity_ned[0]
    lat, h = result.truth.state.latitude[0], result.truth.state.height[0]
    r1 = 6378137.0 * (1 - 0.00669437999) / (1 - 0.00669437999 * np.sin(lat) ** 2) ** 1.5 + h
    r2 = 6378137.0 / np.sqrt(1 - 0.00669437999 * np.sin(lat) ** 2) + h
    want = [omega * np.cos(lat) + v[1] / r2, -v[0] / r1, -omega * np.sin(lat) - v[1] * np.tan(lat) / r2]
    np.testing.assert_allclose(result.solutions["platform"].commanded[0], want, rtol=1e-6)
    assert result.summary["platform"]["max_commanded_rate_deg_h"] == pytest.approx(
        np.linalg.norm(want) / DEG_H, rel=1e-3
    )


def test_pickoffs_are_no_error_of_the_start() -> None:
    result = run(scenario({"pickoff_arcsec": [100.0, -50.0, 200.0]}, QUIET))
    found = result.summary["platform"]
    assert found["final_horizontal_error_by_cause_m"]["initial_state"] < 1e-6
    assert result.errors["platform"].angle[-1] > 100.0 * ARCSEC
    moved = run(scenario({}, QUIET, navigation={"initial_error": {"pitch_arcmin": 1.0, "north_m": 100.0}}))
    found = moved.summary["platform"]
    assert found["final_horizontal_error_by_cause_m"]["initial_state"] > 90.0
    assert found["largest_difference_from_error_equations_m"] < 0.1


def test_errors_beyond_the_linear_equations_are_said_to_be(tmp_path: Path) -> None:
    """A platform that begins 90° off its heading."""
    off = {"initial_error": {"heading_arcmin": 5400.0}, "vertical": "truth"}
    run(scenario({}, QUIET, navigation=off), tmp_path / "run")
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "too large for the linear error equations" in report
    assert "What each error contributes" not in report


def test_given_and_random_errors_of_the_platform() -> None:
    def of(**sensor_set: Any) -> Any:
        return run(scenario(sensor_set, QUIET)).sensed.errors.platform

    np.testing.assert_allclose(of(torquer_scale_ppm=[1.0, 2.0, 3.0]).torquer_scale, [1e-6, 2e-6, 3e-6])
    both = of(torquer_scale_ppm=[1.0, 2.0, 3.0], torquer_scale_sigma_ppm=5.0).torquer_scale
    alone = of(torquer_scale_sigma_ppm=5.0).torquer_scale
    np.testing.assert_allclose(both - alone, [1e-6, 2e-6, 3e-6])
    assert not of().torquer_scale.any()  # the grade's gyros are ideal
    np.testing.assert_allclose(of(pickoff_arcsec=[1.0, 2.0, 3.0]).pickoff, np.array([1.0, 2.0, 3.0]) * ARCSEC)
    assert of(pickoff_sigma_arcsec=10.0).pickoff.any()


def test_the_1_sigma_of_the_torquers_is_that_of_the_gyros() -> None:
    """Over 200 seeds, 600 numbers: the 1σ of 10 ppm is met within 10 %, 3.5σ; p = 5e-4."""
    from sinssim.sensors.sensor_set_readings import draw_platform

    section = scenario().imu
    drawn = np.array([draw_platform(section, seed).torquer_scale for seed in range(200)]) / PPM
    assert np.std(drawn) == pytest.approx(10.0, rel=0.1)
    assert abs(np.mean(drawn)) < 1.5


def test_a_scenario_with_its_defaults_loads_again(tmp_path: Path) -> None:
    original = scenario({"torquer_scale_sigma_ppm": 30.0}, navigation={"frame": "free-azimuth"})
    file = tmp_path / "again.toml"
    file.write_text(original.to_toml(), encoding="utf-8")
    assert load_scenario(str(file)) == original
    assert "pickoff_arcsec" not in tomllib.loads(file.read_text(encoding="utf-8"))["imu"]["sensor_set"]


def test_what_check_says() -> None:
    lines = list(plan_lines(scenario({"torquer_scale_sigma_ppm": 30.0})))
    assert (
        "sensors     three accelerometers and three gyros on a gimballed platform, torquer_scale_sigma_ppm = 30"
        in lines
    )
    assert any(line.startswith("navigation  platform, quaternion") for line in lines)
    assert not any("torquer_scale_sigma_ppm is not given" in line for line in lines)
    lines = list(plan_lines(scenario()))
    assert any("torquer_scale_sigma_ppm is not given: 10, the 1σ of the gyros' scale factor" in line for line in lines)
    lines = list(plan_lines(scenario(imu={"gyro_scale_sigma_ppm": 25.0})))
    assert any("is not given: 25, the" in line for line in lines)
    for silent in (scenario(imu=QUIET), scenario(navigation={"frame": "inertial"})):
        assert not any("torquer_scale_sigma_ppm is not given" in line for line in plan_lines(silent))


def test_a_platform_that_fails_leaves_the_strapdown_solution() -> None:
    polar = {**LEVEL, "latitude_deg": 89.85, "course_deg": 0.0}
    with pytest.raises(RunError):  # neither follows the frame
        run(Scenario.model_validate({**scenario().model_dump(), "great_circle": polar}))


SPIKE = {"type": "spike", "at_s": 5.0, "gyro_arcsec": [1.0, 0.0, 0.0]}


@pytest.mark.parametrize(
    ("sensor_set", "imu", "more", "message"),
    [
        ({"torquer_scale_sigma_ppm": -1.0}, {}, {}, r"imu\.sensor_set\.torquer_scale_sigma_ppm.*-1"),
        ({"torquer_scale_ppm": [1.0, 2.0]}, {}, {}, r"imu\.sensor_set\.torquer_scale_ppm"),
        ({"pickoff_noise_arcsec": -0.1}, {}, {}, r"imu\.sensor_set\.pickoff_noise_arcsec.*-0\.1"),
        ({"layout": "cone-5"}, {}, {}, r"imu\.sensor_set\.layout"),
        ({}, {"accel_arms_mm": [[1.0, 0, 0], [0, 0, 0], [0, 0, 0]]}, {}, "accel_arms_mm .* remove it, or sensor_set"),
        ({}, {"accel_delay_ms": 1.0}, {}, "accel_delay_ms is not part of the model of a platform"),
        (
            {},
            {
                "laser_gyro": {
                    "perimeter_mm": 420.0,
                    "area_mm2": 8487.0,
                    "wavelength_nm": 632.8,
                    "lock_in_deg_h": 360.0,
                    "dither_amplitude_arcsec": 140.0,
                    "dither_frequency_hz": 400.0,
                }
            },
            {},
            "laser_gyro describes laser gyros, which cannot be torqued",
        ),
        ({}, {"faults": [SPIKE]}, {}, r"faults\.1: a spike of gyros has no effect on a platform"),
        ({}, {"faults": [{"type": "dropout", "from_s": 1.0}]}, {}, r"faults\.1: a dropout of gyros"),
        (
            {},
            {"faults": [{"type": "saturation", "from_s": 1.0, "gyro_deg_s": 1.0}]},
            {},
            r"faults\.1: a saturation of gyros",
        ),
        (
            {},
            {"faults": [{"type": "jitter", "from_s": 1.0, "sigma_ms": 0.1}]},
            {},
            r"faults\.1: a jitter of the time stamps .*any fault except jitter",
        ),
        ({}, {}, {"filter": {}, "aiding": {"gnss": {}}}, r"\[filter\] estimates .*remove \[filter\], or sensor_set"),
        ({}, {}, {"compensation": {"gyro_bias_sigma_deg_h": 0.1}}, r'\[compensation\] .*"platform" is another set'),
        ({}, {}, {"navigation": {"algorithms": ["quaternion"]}}, 'requires "platform" among navigation.algorithms'),
        ({"type": "gyros"}, {}, {"navigation": {"algorithms": ["platform"]}}, 'requires "platform" .*vice versa'),
        ({}, {}, {"navigation": {"rates_hz": [50.0, 10.0]}}, "on a platform has no fast part"),
        (
            {"torquer_scale_ppm": [1.0, 1.0, 1.0]},
            {},
            {"navigation": {"frame": "inertial"}},
            r"torquer_scale_ppm would have no effect: with navigation\.frame = \"inertial\"",
        ),
        (
            {},
            {"gyro_misalignment_sigma_arcsec": 5.0},
            {"navigation": {"algorithms": ["platform"]}},
            r"imu\.gyro_misalignment_sigma_arcsec would have no effect.*add a strapdown algorithm",
        ),
        (
            {"torquer_scale_sigma_ppm": 1.0},
            {"gyro_scale_sigma_ppm": 5.0},
            {"navigation": {"algorithms": ["platform"]}},
            r"imu\.gyro_scale_sigma_ppm would have no effect",
        ),
    ],
)
def test_what_is_refused(
    sensor_set: dict[str, Any], imu: dict[str, Any], more: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "wrong.toml"
    given = {"rate_hz": 50.0, **imu, "sensor_set": {"type": "platform", **sensor_set}}
    file.write_text(tomli_w.dumps({"name": "wrong", "great_circle": LEVEL, "imu": given, **more}), encoding="utf-8")
    with pytest.raises(InputError, match=f"(?s){message}"):
        load_scenario(str(file))


def test_accelerometers_can_fail_on_a_platform() -> None:
    fault = {"type": "dropout", "from_s": 20.0, "to_s": 20.1, "channels": ["accel_x"]}
    result = run(scenario(imu={**QUIET, "faults": [fault]}))
    assert result.solutions["platform"].flags is not None
    assert result.solutions["platform"].flags[:, 3].any()
    assert not result.solutions["platform"].flags[:, [0, 1, 2, 4, 5]].any()


def test_the_shipped_scenario() -> None:
    shipped = load_scenario("platform")
    assert shipped.imu.sensor_set.type == "platform"
    assert shipped.navigation.algorithms == ("platform", "quaternion")
