"""One run has its stages; its errors are drawn once; what was let go comes back with the same bits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_result import Reached, Run
from sinssim.scenario import Scenario
from sinssim.sensors.imu import compensation, emulation, imu_errors
from sinssim.sensors.imu import imu_section as block

SCENARIO = {
    "name": "short",
    "seed": 5,
    "parked": {"latitude_deg": 50.0, "longitude_deg": 14.0, "duration_s": 20.0},
    "imu": {"grade": "mems-industrial", "gyro_rrw_deg_h_sqrt_h": 1.0, "gyro_flicker_deg_h": 1.0},
    "compensation": {"gyro_bias_sigma_deg_h": 1.0},
    "navigation": {"algorithms": ["quaternion"]},
    "aiding": {"gnss": {}},
    "filter": {"smooth": True},
}


def test_errors_are_drawn_once_and_drifts_emulated_once(tmp_path, monkeypatch):
    drawn, emulated = [], []
    triad, emulate = imu_errors.draw_triad, emulation.emulate

    def counted_triad(terms, seed):
        drawn.append(seed)
        return triad(terms, seed)

    def counted_emulate(ideal, spec, seed=0, **options):
        if len(ideal) == 2000:  # the rehearsal before the run has fewer samples
            emulated.append(spec)
        return emulate(ideal, spec, seed, **options)

    for module in (block, compensation):
        monkeypatch.setattr(module, "draw_triad", counted_triad)
    monkeypatch.setattr(emulation, "emulate", counted_emulate)
    result = run(Scenario.model_validate(SCENARIO), tmp_path / "run")
    # the block's own errors, and what the calibration is wrong by; the same again in the rehearsal, if there is one
    assert drawn.count(5) == 2  # gyros and accelerometers
    assert len(drawn) == 4
    # the run itself by way of `sinssim.sensors`, and for the filter's truth: drift, flicker and instability
    assert len(emulated) <= 4
    assert result.aided.estimate.smoothed is not None
    true, known = result.sensed.errors.imu, result.sensed.errors.calibration
    assert np.all(np.abs(true.gyro.bias - known.gyro.bias) > 0.0)


def test_a_run_is_its_stages():
    scenario = Scenario.model_validate(SCENARIO).model_copy(update={"filter": None, "aiding": None})
    finished = run(scenario)
    assert isinstance(finished, Run)
    assert finished.directory is None
    assert finished.aided is None
    navigated, sensed, truth = finished.navigated, finished.sensed, finished.truth
    assert navigated.sensed is sensed
    assert sensed.truth is truth
    assert (finished.solutions, finished.errors) == (navigated.solutions, navigated.errors)
    assert sensed.measured is sensed.readings.imu
    assert sensed.imu is sensed.readings.compensated
    assert sensed.imu is not sensed.measured
    assert truth.time is truth.ideal.time
    assert navigated.failures == {}
    for stage in (finished, navigated, sensed, truth):
        with pytest.raises(dataclasses.FrozenInstanceError):
            stage.time = None
    stages = [Reached(scenario, (), last) for last in (None, truth, sensed, navigated)]
    assert [reached.truth for reached in stages] == [None, truth, truth, truth]
    assert [reached.sensed for reached in stages] == [None, None, sensed, sensed]
    assert [reached.navigated for reached in stages] == [None, None, None, navigated]


@pytest.mark.parametrize(
    ("sensors", "algorithm"),
    [
        ({}, "quaternion"),
        ({}, "rotation-vector-4"),
        ({"accel_arms_mm": [[30.0, 0.0, 0.0], [0.0, 30.0, 0.0], [0.0, 0.0, 30.0]]}, "quaternion"),
        ({"sensor_set": {"type": "accelerometers", "arm_m": 0.5}}, "euler"),
    ],
)
def test_what_was_let_go_comes_back_with_the_same_bits(sensors, algorithm):
    plan = {**SCENARIO, "imu": {"grade": "tactical", **sensors}, "navigation": {"algorithms": [algorithm]}}
    for absent in ("aiding", "filter", "compensation"):
        plan.pop(absent)
    plan["parked"] = {**plan["parked"], "duration_s": 5.0}
    kept = run(Scenario.model_validate(plan)).navigated
    light = kept.light()
    fields = {field.name for stage in (light, light.sensed, light.truth) for field in dataclasses.fields(stage)}
    for stage in (light, light.sensed, light.truth):
        assert set(vars(stage)) <= fields
    for name in ("state", "ideal"):
        for part, values in vars(getattr(kept.truth, name)).items():
            np.testing.assert_array_equal(getattr(getattr(light.truth, name), part), values)
    np.testing.assert_array_equal(light.sensed.perfect.imu.dvel, kept.sensed.perfect.imu.dvel)
    for found in ("solutions", "errors"):
        for part, values in vars(getattr(kept, found)[algorithm]).items():
            np.testing.assert_array_equal(getattr(getattr(light, found)[algorithm], part), values)


def test_a_run_with_a_filter_has_let_go_of_what_comes_back(tmp_path):
    result = run(Scenario.model_validate(SCENARIO), tmp_path / "run")
    assert "_solved" not in vars(result.navigated)
    assert "state" not in vars(result.truth)
    assert result.errors["quaternion"].horizontal[-1] == pytest.approx(
        result.summary["algorithms"]["quaternion"]["final_horizontal_error_m"], rel=0, abs=0
    )


def test_near_a_pole_the_comparison_beside_a_platform_has_the_axes_of_the_run():
    """30 m to the east at 1 km from the pole turn north by 0.03 rad, 6 m/s of 200 m/s; in the run's axes nothing turns.

    The flight hardly turns, so that the solution without the errors of turns has nearly the errors of the other one."""
    path = {"latitude_deg": 89.99, "longitude_deg": 10.0, "altitude_m": 1000.0, "course_deg": 30.0, "speed_mps": 200.0}
    scenario = {
        "name": "pole",
        "great_circle": {**path, "duration_s": 5.0},
        "imu": {"grade": "laser-standard", "rate_hz": 10.0, "sensor_set": {"type": "platform"}},
        "navigation": {
            "algorithms": ["platform", "quaternion"],
            "frame": "wander",
            "initial_error": {"east_m": 30.0},
        },
    }
    found = run(Scenario.model_validate(scenario))
    assert found.navigated.axes == "transported"
    without = found.parts["platform"].without_errors_of_turns
    for name, slack in (("position_ned", 1e-3), ("velocity_ned", 1e-4), ("attitude", 1e-6)):
        own, other = getattr(without, name), getattr(found.errors["quaternion"], name)
        np.testing.assert_allclose(own, other, rtol=0, atol=slack, err_msg=name)
