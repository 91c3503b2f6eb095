"""One run fills one `Run`; its errors are drawn once; what is forgotten comes back with the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.scenario import Scenario
from sinssim.sensors.imu import emulate as emulation
from sinssim.sensors.imu import errors
from sinssim.simulation import Run, RunResult, run

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
    triad, emulate = errors._triad, emulation.emulate

    def counted_triad(section, name, seed):
        drawn.append((section.grade, name, seed))
        return triad(section, name, seed)

    def counted_emulate(ideal, spec, seed=0, **options):
        if len(ideal) == 2000:  # the rehearsal before the run has fewer samples
            emulated.append(spec)
        return emulate(ideal, spec, seed, **options)

    monkeypatch.setattr(errors, "_triad", counted_triad)
    monkeypatch.setattr(emulation, "emulate", counted_emulate)
    result = run(Scenario.model_validate(SCENARIO), tmp_path / "run")
    # the block's own errors, and what the calibration is wrong by; the same again in the rehearsal, if there is one
    assert drawn.count(("mems-industrial", "gyro", 5)) == 1
    assert len(drawn) == 4
    # the run itself by way of `sinssim.sensors`, and for the filter's truth: drift, flicker and instability
    assert len(emulated) <= 4
    assert result.aided.estimate.smoothed is not None
    true, known = result.true_errors.imu, result.true_errors.calibration
    assert np.all(np.abs(true.gyro.bias - known.gyro.bias) > 0.0)


def test_a_run_has_what_its_stages_have_computed():
    assert RunResult is Run
    result = Run(Scenario.model_validate(SCENARIO))
    assert result.has("scenario")
    assert not result.has("truth")
    assert not result.has("solutions")
    assert not result.has("scenario", "truth")
    assert result.directory is None
    finished = run(result.scenario.model_copy(update={"filter": None, "aiding": None}))
    assert finished.has("trajectory", "truth", "ideal", "readings", "perfect", "compensated", "solutions", "errors")
    assert finished.measured is finished.readings.imu
    assert finished.time is finished.ideal.time
    assert finished.compensated is not finished.measured
    assert finished.failures == {}


@pytest.mark.parametrize(
    ("sensors", "algorithm"),
    [
        ({}, "quaternion"),
        ({}, "rotation-vector-4"),
        ({"sensor_set": {"type": "accelerometers", "arm_m": 0.5}}, "euler"),
    ],
)
def test_what_is_forgotten_comes_back_with_the_same_bits(tmp_path, sensors, algorithm):
    plan = {**SCENARIO, "imu": {"grade": "tactical", **sensors}, "navigation": {"algorithms": [algorithm]}}
    for absent in ("aiding", "filter", "compensation"):
        plan.pop(absent)
    result = run(Scenario.model_validate(plan), tmp_path / "run")
    kept = {name: getattr(result, name) for name in ("truth", "ideal", "perfect", "sensed", "solutions", "errors")}
    result.forget()
    assert not set(kept) & set(vars(result))
    assert result.has(*kept)
    for name in ("truth", "ideal"):
        for part, values in vars(kept[name]).items():
            np.testing.assert_array_equal(getattr(getattr(result, name), part), values)
    np.testing.assert_array_equal(result.perfect.imu.dvel, kept["perfect"].imu.dvel)
    for now, before in zip(result.sensed, kept["sensed"], strict=True):
        np.testing.assert_array_equal(now.error, before.error)
    for found in ("solutions", "errors"):
        for part, values in vars(kept[found][algorithm]).items():
            np.testing.assert_array_equal(getattr(getattr(result, found)[algorithm], part), values)


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
    assert found.axes == "transported"
    for name, slack in (("position_ned", 1e-3), ("velocity_ned", 1e-4), ("attitude", 1e-6)):
        own, other = getattr(found.without_errors_of_turns, name), getattr(found.errors["quaternion"], name)
        np.testing.assert_allclose(own, other, rtol=0, atol=slack, err_msg=name)
