"""Runs on a redundant set: with and without monitoring, recorded, reported, refused where they cannot be."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim.errors import InputError, RunError
from sinssim.experiments.run.parts.redundancy import sentences as redundancy_sentences
from sinssim.experiments.run.run_execution import run
from sinssim.recording.rerun_viewer import find_run_info
from sinssim.recording.rerun_views import all_views
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.strapdown.mechanization import Mechanization
from sinssim.units import DEG_H

LEVEL = {"latitude_deg": 50.0, "course_deg": 40.0, "speed_mps": 200.0, "altitude_m": 5000.0, "duration_s": 60.0}
STEP = {"type": "bias-step", "from_s": 20.0, "gyro_deg_h": [0.0, 0.0, 50.0, 0.0, 0.0, 0.0]}


def scenario(sensor_set: dict[str, Any], imu: dict[str, Any] | None = None, **more: Any) -> Scenario:
    given = {
        "grade": "laser-standard",
        "rate_hz": 50.0,
        **(imu or {}),
        "sensor_set": {"type": "redundant", **sensor_set},
    }
    return Scenario.model_validate({"name": "redundant", "great_circle": LEVEL, "imu": given, **more})


@pytest.mark.parametrize("layout", ["cone-4", "cone-5", "dodecahedron", "skewed-triads"])
def test_perfect_sensors_close_the_loop(layout: str) -> None:
    result = run(scenario({"layout": layout}, {"grade": "ideal"}))
    assert result.summary["algorithms"]["quaternion"]["max_horizontal_error_m"] < 1e-6
    assert not any(result.summary["redundancy"][kind]["alarms"] for kind in ("gyro", "accel"))


def test_the_noise_of_the_estimate_is_that_of_the_law() -> None:
    """σ² tr (HᵀH)⁻¹ = 1.5 σ² of six sensors; 3 σ² of three. 9000 numbers: the ratio is within 4 % at 2.7σ."""
    only = {"gyro_bias_sigma_deg_h": 0.0, "gyro_scale_sigma_ppm": 0.0, "gyro_misalignment_sigma_arcsec": 0.0}
    six = run(scenario({}, only))
    three = run(scenario({"type": "gyros"}, only))
    variance = [np.var(r.sensed.measured.dtheta - r.truth.ideal.dtheta, axis=0).sum() for r in (six, three)]
    assert variance[0] / variance[1] == pytest.approx(0.5, rel=0.06)


def test_with_and_without_monitoring(tmp_path: Path) -> None:
    result = run(scenario({}, {"faults": [STEP]}), tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    found = summary["redundancy"]
    (alarm,) = found["gyro"]["alarms"]
    assert alarm["sensor"] == 3
    assert 20.0 < alarm["detected_s"] <= alarm["excluded_s"] < 21.0
    assert found["gyro"]["used_at_end"] == [1, 2, 4, 5, 6]
    assert found["trace_of_covariance"] == pytest.approx(1.5)
    # without monitoring, it is the run that has none: the same draws, the same flight
    alone = run(scenario({"monitoring": "none"}, {"faults": [STEP]}))
    own = alone.summary["algorithms"]["quaternion"]
    assert found["without_monitoring"]["final_horizontal_error_m"] == pytest.approx(own["final_horizontal_error_m"])
    assert found["without_monitoring"]["max_attitude_error_arcsec"] == pytest.approx(own["max_attitude_error_arcsec"])
    assert alone.summary["redundancy"] == {
        "monitoring": "none", "sensors": 6, "trace_of_covariance": pytest.approx(1.5), "least_trace": 1.5
    }  # fmt: skip
    # f h/2 of the fault acts on the block: (HᵀH)⁻¹ Hᵀ = Hᵀ/2; it turns it for 40 s
    turned = 40.0 * 0.5 * 50.0 * DEG_H / DEG_H  # arcsec
    grown = own["max_attitude_error_arcsec"] - summary["algorithms"]["quaternion"]["max_attitude_error_arcsec"]
    assert grown == pytest.approx(turned, rel=0.01)

    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    for words in (
        "Monitoring of the redundant sensors",
        "A fault of gyro 3 was detected at",
        "bias step of gyro 3 from 20 s to the end",
        "With and without monitoring: quaternion",
        "3 excluded",
        "the least that is possible with this number of sensors",
    ):
        assert words in report
    streams = tmp_path / "run" / "streams"
    tests = pq.read_table(streams / "redundancy.parquet")
    assert tests.column_names == [
        "time_s", "gyro_statistic_sample", "gyro_statistic_1s", "gyro_statistic_10s", "gyro_statistic_100s",
        "gyro_threshold", *(f"gyro_used_{i}" for i in range(1, 7)),
        "accel_statistic_sample", "accel_statistic_1s", "accel_statistic_10s", "accel_statistic_100s",
        "accel_threshold", *(f"accel_used_{i}" for i in range(1, 7)),
    ]  # fmt: skip
    gyros = result.sensed.readings.monitored[0]
    np.testing.assert_array_equal(tests["gyro_statistic_1s"].to_numpy(), gyros.statistic[1])
    np.testing.assert_array_equal(tests["gyro_used_3"].to_numpy(), gyros.used[:, 2])
    single = pq.read_table(streams / "gyros_measured.parquet")
    np.testing.assert_array_equal(single["dtheta_3_rad"].to_numpy(), result.sensed.readings.single.dtheta[:, 2])
    without = pq.read_table(streams / "error_without_monitoring.parquet")
    last = np.hypot(without["position_n_m"].to_numpy()[-1], without["position_e_m"].to_numpy()[-1])
    assert last == pytest.approx(own["final_horizontal_error_m"], rel=1e-6)
    texts = pq.read_table(streams / "events.parquet")["text"].to_pylist()
    assert "gyro 3 excluded" in texts
    shown = find_run_info(tmp_path / "run" / "recording.rrd")
    assert shown.label("redundancy/horizontal title") == "Horizontal error of quaternion"
    for entity in ("gyro/statistic", "accel/used", "horizontal", "attitude"):
        assert f"redundancy/{entity}" in shown.ranges
    assert shown.ranges["redundancy/gyro/statistic"][1] > gyros.threshold.max()
    assert all_views(shown, "redundancy").root_container.contents[-1].name == "redundancy"


def test_a_failed_first_algorithm_leaves_the_comparison_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.strapdown import measured_attitude

    navigate_set = measured_attitude.navigate_set

    def euler_fails(imu: Any, attitude: Any, initial: Any, of: Mechanization, *height: Any) -> Any:
        if of.algorithm == "euler":
            raise RunError("it fails.", time=1.0)
        return navigate_set(imu, attitude, initial, of, *height)

    monkeypatch.setattr(measured_attitude, "navigate_set", euler_fails)
    result = run(scenario({}, {"faults": [STEP]}, navigation={"algorithms": ["euler", "quaternion"]}))
    assert list(result.navigated.failures) == ["euler"]
    numbers = {"quaternion": result.summary["algorithms"]["quaternion"]}
    *_, sentence = redundancy_sentences(result.summary["redundancy"], numbers)
    assert sentence.startswith("Horizontal error of quaternion with monitoring: ")
    alone = run(scenario({"monitoring": "none"}, {"faults": [STEP]}))
    assert result.parts["redundancy"].without_monitoring is not None
    np.testing.assert_array_equal(
        result.parts["redundancy"].without_monitoring.horizontal, alone.errors["quaternion"].horizontal
    )


def test_a_run_without_a_fault_says_so(tmp_path: Path) -> None:
    run(scenario({"layout": "cone-5"}), tmp_path / "run")
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "The monitoring of the redundant set found no fault." in report
    assert "With and without monitoring" not in report
    assert not (tmp_path / "run" / "streams" / "error_without_monitoring.parquet").exists()


def test_a_scenario_with_its_defaults_loads_again(tmp_path: Path) -> None:
    original = scenario({}, {"faults": [STEP, {"type": "dropout", "from_s": 30.0, "channels": ["accel_6"]}]})
    file = tmp_path / "again.toml"
    file.write_text(original.to_toml(), encoding="utf-8")
    assert load_scenario(str(file)) == original
    assert "layout" not in tomllib.loads(file.read_text(encoding="utf-8"))["imu"]["sensor_set"]


def test_what_check_says() -> None:
    lines = list(plan_lines(scenario({"layout": "cone-4"})))
    assert (
        "sensors     four single gyros and four single accelerometers on a cone, monitored: faults are detected"
        in lines
    )
    given = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.6, 0.8, 0], [0, 0.6, 0.8], [0.8, 0, 0.6], [0.0, 0.8, -0.6]]
    (line,) = [line for line in plan_lines(scenario({"directions": given})) if line.startswith("sensors")]
    assert line.endswith("7 single gyros and 7 single accelerometers along given directions, monitored: faulty "
                         "sensors are excluded")  # fmt: skip


TWINS = [[1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0, 0.6, 0.8]]


def steps(*sensors: int) -> list[dict[str, Any]]:
    return [{"type": "bias-step", "from_s": 5.0, "gyro_deg_h": [float(i in sensors) for i in range(1, 7)]}]


@pytest.mark.parametrize(
    ("sensor_set", "imu", "message"),
    [
        ({"layout": "cone-7"}, {}, r"imu\.sensor_set\.layout"),
        ({"directions": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]}, {}, "4 to 12 unit vectors"),
        (
            {"directions": [[1.0, 0, 0], [0, 1.0, 0], [0.6, 0.8, 0], [0.8, 0.6, 0]]},
            {},
            "rank 2: all 4 lie in one plane",
        ),
        (
            {"directions": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.6, 0.6, 0.6]]},
            {},
            r"directions\.4 .*length 1\.039",
        ),
        ({"directions": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0, 0, 0]]}, {}, r"directions\.4 .*has no direction"),
        ({"layout": "cone-4", "directions": TWINS}, {}, "layout and directions both give the sensitive axes"),
        ({"layout": "cone-4", "monitoring": "exclude"}, {}, "four sensors detect a fault.* or take five sensors"),
        ({"directions": TWINS, "monitoring": "exclude"}, {}, 'sensor 2 looks like one of sensor 1; give .* "detect"'),
        ({"windows_s": [10.0, 1.0]}, {}, r"windows_s = \[10\.0, 1\.0\] must increase"),
        ({"windows_s": [0.02]}, {}, r"windows_s\.1 = 0\.02 is not longer than a sample.* at least 0\.04 s"),
        ({"false_alarm_probability": 0.0}, {}, "false_alarm_probability"),
        ({}, {"faults": [{**STEP, "gyro_deg_h": [0.0, 0.0, 1.0]}]}, r"gyro_deg_h = .* has 3 numbers; give .* set: 6"),
        (
            {},
            {"faults": [{"type": "dropout", "from_s": 1.0, "channels": ["gyro_7"]}]},
            r"'gyro_7' is not known.*gyro_6",
        ),
        (
            {},
            {"faults": [{"type": "dropout", "from_s": 1.0, "channels": ["gyro_x"]}]},
            r"'gyro_x' is not known.*gyro_1",
        ),
        (
            {},
            {"faults": [{"type": "dropout", "from_s": 1.0, "channels": ["left"]}]},
            r"'left' is not known\. Known: gyro_x",
        ),
        ({"type": "gyros"}, {"faults": [STEP]}, r"faults\.1\.gyro_deg_h = .* has 6 numbers; give one per axis: 3"),
        ({"type": "gyros"}, {"faults": [{"type": "freeze", "from_s": 1.0, "channels": ["gyro_1"]}]}, "Known: gyro_x"),
        (
            {},
            {"faults": steps(1, 2, 4, 6)},
            r"4 of the 6 sensors of the kind 'gyro' .*numbers 1, 2, 4, 6\).* at most 3",
        ),
        ({}, {"gyro_bias_deg_h": [0.0, 0.0, 1.0]}, "gyro_bias_deg_h has one number per axis of a triad.*bias_sigma"),
        ({}, {"accel_delay_ms": 1.0}, "accel_delay_ms needs a block of two triads"),
    ],
)
def test_what_is_refused(sensor_set: dict[str, Any], imu: dict[str, Any], message: str, tmp_path: Path) -> None:
    import tomli_w

    file = tmp_path / "wrong.toml"
    if sensor_set.get("type") == "gyros":
        given: dict[str, Any] = {**imu, "rate_hz": 50.0}
    else:
        given = {"rate_hz": 50.0, **imu, "sensor_set": {"type": "redundant", **sensor_set}}
    file.write_text(tomli_w.dumps({"name": "wrong", "great_circle": LEVEL, "imu": given}), encoding="utf-8")
    with pytest.raises(InputError, match=f"(?s){message}"):
        load_scenario(str(file))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"filter": {"backward": True}, "aiding": {"gnss": {}}}, r"filter\.backward is not possible with a redundant"),
        ({"filter": {"vibration_noise": 0.4}, "aiding": {"gnss": {}}}, r"filter\.vibration_noise is not possible with"),
        (
            {"compensation": {"gyro_bias_deg_h": (0.1, 0.0, 0.0), "gyro_bias_sigma_deg_h": 0.1}},
            r"compensation\.gyro_bias_deg_h is a value for a block of two triads.*_sigma_",
        ),
    ],
)
def test_what_needs_another_set(more: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scenario({}, **more)


def test_notes_on_windows_that_do_nothing() -> None:
    lines = [line for line in plan_lines(scenario({"windows_s": [1.0, 90.0]})) if line.startswith("note")]
    assert any("imu.sensor_set.windows_s.2 = 90 has no effect: the window is longer than the run" in x for x in lines)
    lines = list(plan_lines(scenario({"windows_s": [1.0], "monitoring": "none"})))
    assert any('windows_s has no effect: there is no test with monitoring = "none"' in line for line in lines)
    assert not any("windows_s" in line for line in plan_lines(scenario({})))


def test_the_shipped_scenario_has_faults_that_the_set_survives() -> None:
    shipped = load_scenario("redundant_set")
    assert shipped.imu.sensor_set.mode == "exclude"
    assert len(shipped.imu.faults) == 3
