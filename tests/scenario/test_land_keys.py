"""Keys of land vehicles and real sensors: what is refused, with key and remedy, and a scenario with all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.errors import InputError
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario
from sinssim.scenario.filter_section import AidingSection, FilterSection

ROAD: dict[str, Any] = {
    "name": "road",
    "great_circle": {
        "latitude_deg": 50.0,
        "course_deg": 60.0,
        "altitude_m": 200.0,
        "speed_mps": 15.0,
        "duration_s": 30.0,
    },
    "imu": {"grade": "mems-tactical", "rate_hz": 50.0, "mounting_deg": [0.0, 4.0, -3.0]},
    "aiding": {"gnss": {"rate_hz": 2.0}},
    "filter": {},
}


def road(**tables: dict[str, Any]) -> Scenario:
    return Scenario.model_validate({**ROAD, **tables})


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"zero_velocity": {"detect": True}}, "detect = true needs learn_s"),
        ({"zero_rate": {"learn_s": [[0.0, 9.0]]}}, "learn_s is for detect = true"),
        ({"zero_rate": {"detect": True, "learn_s": [[0.0, 9.0]], "during_s": [[0.0, 9.0]]}}, "remove one of the two"),
        ({"dual_antenna": {"baseline_m": [0.0, 0.0, 1.0]}}, "the antennas are 1 m apart, but less than 0.01 m forward"),
        ({"gnss": {"time_offset_s": 30.0}}, "time_offset_s"),
    ],
)
def test_what_has_no_meaning_is_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        AidingSection.model_validate(tables)


def test_alignments_say_what_they_need() -> None:
    with pytest.raises(ValidationError, match='alignment = "by-course" needs alignment_s'):
        FilterSection.model_validate({"alignment": "by-course"})
    course = {"alignment": "by-course", "alignment_s": 10.0}
    with pytest.raises(ValidationError, match=r'"by-course" needs \[aiding.gnss\] with position and velocity'):
        road(filter=course, aiding={"gnss": {"velocity": False}})


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"filter": {"vibration_noise": 0.5}}, "filter.vibration_noise = 0.5 has no budget"),
        ({"filter": {"alignment": "by-course", "alignment_s": 5.0}}, '"by-course" has no budget'),
        ({"aiding": {"gnss": {"time_offset_sigma_s": 0.1}}}, r"\[aiding.gnss\] has no budget: .*'gnss time offset'"),
        ({"aiding": {"land_vehicle": {}}}, r"\[aiding.land_vehicle\] has no budget"),
        (
            {"aiding": {"zero_rate": {"detect": True, "learn_s": [[0.0, 9.0]]}}},
            r"\[aiding.zero_rate\] has no budget: stops are detected .*\(detect = true\)",
        ),
    ],
)
def test_what_the_budget_does_not_model_is_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        budget(road(**tables))


def test_a_scenario_with_all_of_them() -> None:
    """At a constant speed the time offset cannot be told from the position; the mounting is found to a degree."""
    result = run(
        road(
            aiding={
                "gnss": {"rate_hz": 4.0, "time_offset_sigma_s": 0.05, "velocity_averaging_s": 0.25},
                "land_vehicle": {"mounting_sigma_deg": 2.0, "lever_arm_sigma_m": 0.2, "slip_sigma_deg_per_g": 2.0},
                "dual_antenna": {"bias_sigma_deg": 0.1},
            },
            filter={"alignment": "by-course", "alignment_s": 5.0, "vibration_noise": 0.1},
        )
    )
    found, errors = result.aided.estimate, result.aided.state_errors
    assert found.divergence is None
    assert result.summary["filter"]["alignment"]["method"] == "by-course"
    assert np.all(np.abs(errors[-1]) < 4.5 * found.sigma[-1])
    assert {i.sensor for i in found.innovations} == {"gnss-position", "gnss-velocity", "land-vehicle", "dual-antenna"}
    where = found.model.slices["land-vehicle mounting"]
    assert found.sigma[-1, where].max() < np.radians(1.0) < found.sigma[0, where].max()
