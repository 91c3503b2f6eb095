"""The page on a new error term of a gyro: its code verbatim, in a copy of the package."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sinssim.units import DEG, DEG_H, G0
from tests.extending.pages import Copy, read_page

WRITE_FIELDS = Path(__file__).parents[1] / "sensors" / "imu" / "write_fields.py"

AIM = 3
"""Files of the package that a new term may touch."""

CHECKS = """
import json
import sinssim
from sinssim.alignment.alignment_budget import SOURCES, error_budget, expected_errors, reading_errors
from sinssim.alignment.parked_theory import Attitude
from sinssim.errors import InputError
from sinssim.scenario.filter_model import filter_model
from sinssim.experiments.run.sensor_exhibits import sensor_errors
from sinssim.recording.page import parts_of
from sinssim.scenario.schema import Scenario
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.error_propagation import expect
from sinssim.sensors.sensor_set_readings import draw_true_errors

found = {}
H = np.arange(1.0, 10.0).reshape(3, 3)  # deg/h/g²
fixed = Imu(grade="ideal", gyro_g2_sensitivity_deg_h_per_g2=H.ravel().tolist())
other = Imu.model_validate(
    {"grade": "ideal", "gyro_g2_sensitivity_deg_s_per_g2": (H.ravel() / 3600.0).tolist()}
)
found["other unit"] = other.gyro_g2_sensitivity_deg_h_per_g2
measured = emulate(ideal, fixed)
found["rate"] = measured.dtheta.sum(axis=0).tolist()
found["force"] = float(np.abs(measured.dvel - ideal.dvel).max())
expected = expected_errors(fixed)
found["session"] = reading_errors(expected.mean, np.zeros(3), force[0], 1.0)[0].tolist()
section = Imu(grade="ideal", gyro_g2_sensitivity_sigma_deg_h_per_g2=0.5)
as_bias = Imu(grade="ideal", gyro_bias_sigma_deg_h=0.5 * (9.80665 / 9.80665) ** 2)
level = Attitude(*np.zeros(3))
for name, block in (("term", section), ("bias", as_bias)):
    budget = error_budget(level, 0.8, expected_errors(block).sigma, 60.0, gravity=9.80665)
    source = "gyro g²-sensitivity" if name == "term" else "gyro bias"
    found[f"budget {name}"] = [float(value) for value in budget[source]]
    found[f"navigation {name}"] = expect(block, 0.8).total
parked = {"latitude_deg": 50.0, "longitude_deg": 14.0, "duration_s": 60.0}
scenario = Scenario.model_validate(
    {"name": "page", "parked": parked, "imu": {"grade": "tactical", "gyro_g2_sensitivity_sigma_deg_h_per_g2": 0.5},
     "aiding": {"gnss": {}}, "filter": {}}
)
found["report"] = "".join(parts_of(sensor_errors(scenario, draw_true_errors(scenario.imu, scenario.seed), ()), 3))
found["filter"] = filter_model(scenario).untold
for name, key in (("term", "gyro_g2_sensitivity_sigma_deg_h_per_g2"), ("bias", "gyro_bias_sigma_deg_h")):
    plan = Scenario.model_validate(
        {"name": "page", "parked": parked, "imu": {"grade": "ideal", "rate_hz": 10.0, key: 0.5}}
    )
    result = sinssim.budget(plan)
    found[f"covariance {name}"] = [result.sources[0].name, *map(float, result.sigma()[-1, 6:])]
refused = []
for make in (
    lambda: Imu(gyro_g2_sensitivity_deg_h_per_g2=[1e7] * 9),
    lambda: Imu(gyro_g2_sensitivity_sigma_deg_h_per_g2=-1.0),
    lambda: emulate(ideal, ImuErrors(accel=TriadErrors(g2_sensitivity=np.eye(3)))),
    lambda: emulate(ideal, ImuErrors(gyro=TriadErrors(g2_sensitivity=np.ones(3)))),
):
    try:
        make()
        refused.append("")
    except ValueError as error:
        refused.append(str(error))
found["refused"] = refused
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    made = Copy(tmp_path_factory.mktemp("page"))
    made.apply(read_page("gyro-error-term"))
    made.run(f'import runpy; runpy.run_path({str(WRITE_FIELDS)!r}, run_name="__main__")')
    return made


def test_a_new_term_touches_few_files(copy):
    assert len(copy.touched) <= AIM, copy.touched
    assert copy.touched == [
        "sinssim/sensors/error_propagation.py", "sinssim/sensors/imu/error_term_table.py",
        "sinssim/sensors/imu/generated_imu_keys.py",
    ]  # fmt: skip


@pytest.mark.slow
def test_everything_follows_from_the_row(copy):
    (snippet,) = read_page("gyro-error-term").snippets
    drawn, answer = copy.run(f"{snippet}\n{CHECKS}").strip().rsplit("\n", 1)
    found = json.loads(answer)
    assert len(drawn.strip("[]").split()) == 3
    h = np.arange(1.0, 10.0).reshape(3, 3)
    assert found["other unit"] == pytest.approx(h.ravel(), rel=1e-14)
    # Σ_j H_ij f_j² for one second
    rate = h * DEG_H / G0**2 @ np.array([1.0, 4.0, 9.8**2])
    assert found["rate"] == pytest.approx(rate, rel=1e-12)
    assert found["session"] == pytest.approx(rate, rel=1e-12)
    assert found["force"] == 0.0
    # 0.5 deg/h/g² under one g is a bias of 0.5 deg/h, in the alignment as in the navigation
    assert found["budget term"] == pytest.approx(found["budget bias"], rel=1e-12)
    assert max(found["budget term"]) > 0.01 * DEG
    assert found["navigation term"] == pytest.approx(found["navigation bias"], rel=2e-3)  # g at 46° is not G0
    (source, *term), (_, *bias) = found["covariance term"], found["covariance bias"]
    assert source == "gyro_g2_sensitivity"
    assert term == pytest.approx(bias, rel=2e-3)
    assert min(term) > 0.0
    for axis in "xyz":
        assert f"g²-sensitivity to {axis}" in found["report"]
    assert "deg/h/g²" in found["report"]
    assert "sensitivity to g² of the gyros" in found["filter"]
    large, negative, accelerometer, shape = found["refused"]
    assert "larger than that of any sensor" in large
    assert "must be at least 0" in negative
    assert "accelerometer g2_sensitivity" in accelerometer
    assert "it is an error of gyros" in accelerometer
    assert "finite numbers of shape (3, 3)" in shape


def test_the_command_line_tells_the_new_term(copy):
    said = copy.command("sensors", "tactical", "--set", "gyro_g2_sensitivity_sigma_deg_h_per_g2=0.5", "--json")
    (term,) = [entry for entry in json.loads(said)["terms"] if entry["name"] == "gyro_g2_sensitivity"]
    assert (term["value"], term["unit"], term["si_unit"]) == (0.5, "deg/h/g²", "rad/s/(m/s²)²")
