"""Scenarios of analytic motions and of vibration: they fly what they say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import fly

DEG = np.pi / 180.0
MOTIONS: dict[str, dict[str, Any]] = {
    "coning": {"half_angle_deg": 1.0, "frequency_hz": 5.0, "duration_s": 4.0},
    "sculling": {"angle_deg": 1.0, "displacement_mm": 2.0, "frequency_hz": 5.0, "duration_s": 4.0},
    "spin-cone": {"angle_deg": 10.0, "precession_deg_s": 90.0, "spin_deg_s": 60.0, "duration_s": 4.0},
    "spin-rock": {"axis": [0.0, 0.0, 1.0], "angle_deg": 5.0, "frequency_hz": 1.0, "duration_s": 4.0},
    "rotation-table": {
        "steps": [
            {"type": "dwell", "duration_s": 1.0},
            {"type": "turn", "axis": [1.0, 0.0, 0.0], "angle_deg": -90.0, "rate_deg_s": 45.0, "ramp_s": 1.0},
        ]
    },
}


def scenario(type_: str, **more: Any) -> Scenario:
    motion = {"type": type_, "latitude_deg": 56.0, "heading_deg": 30.0, **MOTIONS[type_]}
    return Scenario.model_validate({"name": "m", "motion": motion, "imu": {"grade": "ideal", "rate_hz": 200.0}, **more})


@pytest.mark.parametrize("name", MOTIONS)
def test_every_motion_flies_and_is_navigated(name: str) -> None:
    """Ideal sensors, the whole way through: the navigator stays with the truth."""
    described = scenario(name)
    assert expected_duration(described) == pytest.approx(4.0)
    assert any(line.startswith("motion") and name in line for line in plan_lines(described))
    result = run(described)
    assert result.truth.trajectory.end == pytest.approx(4.0)
    error = result.errors["quaternion"]
    assert np.abs(error.position_ned).max() < 1e-5
    assert np.linalg.norm(error.attitude, axis=1).max() < 1e-8


def test_coning_is_about_the_heading() -> None:
    """At the start the cone stands half an angle above the heading: pitch α, then yaw α a quarter of a turn later."""
    state = fly(scenario("coning")).state([0.0, 0.05])
    heading, pitch, _ = Rotation.from_quat(state.q_nb, scalar_first=True).as_euler("ZYX", degrees=True).T
    assert pitch == pytest.approx([1.0, 0.0], rel=0.0, abs=1e-9)
    assert heading == pytest.approx([30.0, 31.0], rel=0.0, abs=1e-9)


def test_rotation_table_ends_on_its_side() -> None:
    trajectory = fly(scenario("rotation-table"))
    heading, pitch, roll = Rotation.from_quat(trajectory.state(4.0).q_nb, scalar_first=True).as_euler("ZYX") / DEG
    assert [heading, pitch, roll] == pytest.approx([30.0, 0.0, -90.0], rel=0.0, abs=1e-9)


def test_lever_arm_and_mounting_of_the_block() -> None:
    """A block 2 m ahead on a rocking body feels φ̇² r inwards; turned about, on another axis."""
    at = {"grade": "ideal", "rate_hz": 100.0, "lever_arm_m": [2.0, 0.0, 0.0]}
    bare = fly(scenario("spin-rock"))
    armed = fly(scenario("spin-rock", imu=at))
    turned = fly(scenario("spin-rock", imu={**at, "mounting_deg": [0.0, 0.0, 90.0]}))
    rate = 5.0 * DEG * 2.0 * np.pi  # at t = 0
    extra = armed.rates(0.0)[1] - bare.rates(0.0)[1]
    assert extra == pytest.approx(
        [-2.0 * rate**2, 0.0, 0.0], rel=0.0, abs=2e-4
    )  # Earth rate and gravity's gradient left out
    assert turned.rates(0.0)[1] == pytest.approx(armed.rates(0.0)[1][[1, 0, 2]] * [1.0, -1.0, 1.0], rel=0.0, abs=1e-12)


def test_vibration_on_top_of_a_parked_vehicle() -> None:
    described = Scenario.model_validate(
        {
            "name": "v",
            "seed": 3,
            "parked": {"latitude_deg": 56.0, "duration_s": 20.0},
            "vibration": [
                {"coordinate": "roll", "rms_arcsec": 100.0, "low_hz": 10.0, "phase_deg": 90.0},
                {"coordinate": "down", "rms_mm": 0.5, "low_hz": 5.0, "high_hz": 20.0},
                {"coordinate": "right", "rms_mm": 0.5, "low_hz": 5.0, "high_hz": 20.0},
            ],
        }
    )
    assert sum(line.startswith("vibration") for line in plan_lines(described)) == 3
    t = np.linspace(0.0, 20.0, 4001)
    state = fly(described).state(t)
    roll = Rotation.from_quat(state.q_nb, scalar_first=True).as_euler("ZYX")[:, 2]
    # a millimetre to the right turns the local level by 2e-10 rad
    assert roll == pytest.approx(100.0 / 3600.0 * DEG * np.sqrt(2.0) * np.cos(20.0 * np.pi * t), rel=0.0, abs=1e-9)
    assert np.std(state.height) == pytest.approx(5e-4, rel=0.15)
    again = fly(described).state(t)
    assert np.array_equal(state.height, again.height)
    assert not np.array_equal(state.height, fly(described.model_copy(update={"seed": 4})).state(t).height)


def test_scenario_survives_its_own_toml(tmp_path: Path) -> None:
    for name in MOTIONS:
        described = scenario(name, vibration=[{"coordinate": "yaw", "rms_arcsec": 5.0, "low_hz": 10.0}])
        file = tmp_path / f"{name}.toml"
        file.write_text(described.to_toml())
        assert load_scenario(file) == described


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[motion]\ntype = "conning"\n', "conning"),
        ('[motion]\ntype = "coning"\nhalf_angle_deg = -1.0\nfrequency_hz = 1.0\nduration_s = 1.0\n', "greater than 0"),
        (
            '[motion]\ntype = "rotation-table"\n[[motion.steps]]\ntype = "turn"\naxis = [0.0, 0.0, 1.0]\n'
            "angle_deg = 10.0\nrate_deg_s = 20.0\n",
            "never reaches 20°/s with ramps of 1 s",
        ),
        (
            '[motion]\ntype = "spin-rock"\naxis = [0.0, 0.0, 0.0]\nangle_deg = 1.0\nfrequency_hz = 1.0\nduration_s = 1',
            "no usable direction",
        ),
        (
            '[parked]\nlatitude_deg = 1.0\nduration_s = 1.0\n[[vibration]]\ncoordinate = "roll"\nlow_hz = 1.0',
            "rms_arcsec",
        ),
        (
            '[parked]\nlatitude_deg = 1.0\nduration_s = 1.0\n[[vibration]]\ncoordinate = "down"\nrms_mm = 1.0\n'
            "low_hz = 5.0\nhigh_hz = 2.0\n",
            "is empty",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(f'name = "bad"\n{text}')
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    assert message in str(caught.value)
    assert "line " in str(caught.value)
