"""How often a filter whose model is right is called inconsistent, over all its tests, and whether faults are found."""

from __future__ import annotations

from typing import Any

import pytest

import sinssim
from sinssim.experiments.run.filter_summary import filter_numbers
from sinssim.scenario import Scenario

GNSS = {"rate_hz": 1.0, "latency_s": 0.2, "lever_arm_m": [-4.0, 0.0, -3.0], "outages_s": [[400.0, 500.0]]}
TURNS = {"type": "s_turns", "bank_deg": 25.0, "turns": 6}
SCENARIOS: dict[str, dict[str, Any]] = {
    "parked": {
        "parked": {"latitude_deg": 50.0, "heading_deg": 30.0, "duration_s": 500.0},
        "imu": {"grade": "laser-navigation", "rate_hz": 10.0},
        "aiding": {"zero_velocity": {}, "zero_rate": {}},
        "filter": {"alignment_s": 120.0},
    },
    "mems": {
        "flight": {
            "aircraft": "c172x",
            "start": {
                "on": "air", "latitude_deg": 46.5, "longitude_deg": 7.5, "heading_deg": 300.0, "altitude_m": 1500.0,
                "airspeed_kt": 95.0,
            },
            "legs": [
                {"type": "hold", "duration_s": 30.0},
                {**TURNS, "swing_deg": 60.0},
                {"type": "hold", "until_s": 240.0},
            ],
        },
        "imu": {"grade": "mems-industrial", "rate_hz": 25.0},
        "navigation": {
            "initial_error": {
                "position_sigma_m": 3.0, "height_sigma_m": 5.0, "velocity_sigma_mps": 0.3,
                "tilt_sigma_arcmin": 30.0, "heading_sigma_arcmin": 60.0,
            }
        },
        "aiding": {"gnss": {"rate_hz": 2.0, "latency_s": 0.1, "lever_arm_m": [0.5, 0.0, -1.5]}, "baro": {}},
    },
    "airliner": {
        "flight": {
            "aircraft": "737",
            "start": {
                "on": "air", "latitude_deg": 48.0, "longitude_deg": 11.0, "heading_deg": 20.0, "altitude_m": 3000.0,
                "airspeed_kt": 250.0,
            },
            "legs": [
                {"type": "hold", "duration_s": 60.0},
                {**TURNS, "swing_deg": 45.0},
                {"type": "hold", "until_s": 900.0},
            ],
        },
        "imu": {"grade": "laser-standard", "rate_hz": 20.0},
        "navigation": {
            "initial_error": {
                "position_sigma_m": 5.0, "height_sigma_m": 5.0, "velocity_sigma_mps": 0.1,
                "tilt_sigma_arcmin": 0.5, "heading_sigma_arcmin": 6.0,
            }
        },
        "aiding": {"gnss": GNSS, "baro": {}},
    },
}  # fmt: skip
FAULTS = {
    "measurement noise 1.5 times assumed": {"measurement_noise_factor": 1.0 / 1.5},
    "inertial noise 3 times assumed": {"inertial_noise_factor": 1.0 / 3.0},
}


def consistent(name: str, seed: int, **told: float) -> bool:
    own = SCENARIOS[name]
    tables = {**own, "name": name, "seed": seed, "filter": {**own.get("filter", {}), **told}}
    result = sinssim.run(Scenario.model_validate(tables))
    return bool(filter_numbers(result.aided, result.scenario)["consistent"])


def test_few_runs_of_a_right_model_and_of_a_wrong_one() -> None:
    """A run fails with a probability of at most 1 %; this one is fixed, and passes."""
    assert consistent("parked", 1)
    assert not consistent("parked", 1, measurement_noise_factor=1.0 / 1.5)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_at_most_one_run_in_a_hundred_is_called_inconsistent(name: str) -> None:
    """Of 100 runs at 1 %, more than 4 fail with a probability of 0.3 %."""
    failed = [seed for seed in range(1, 101) if not consistent(name, seed)]
    assert len(failed) <= 4, failed


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_faults_are_found(name: str, fault: str) -> None:
    """Nineteen of twenty runs or more."""
    found = [seed for seed in range(1, 21) if not consistent(name, seed, **FAULTS[fault])]
    assert len(found) >= 19, found
