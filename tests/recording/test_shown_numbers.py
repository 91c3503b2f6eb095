"""Numbers in tables, reports and files, from results whose values are chosen: units, factors, shares, signs."""

from __future__ import annotations

import re
from math import inf
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.error_budget.budget_exhibits import lines_of
from sinssim.analyses.error_budget.budget_result import Allowance, Answer
from sinssim.experiments.run.filter_remedies import with_sigma
from sinssim.experiments.run.sensor_exhibits import platform_errors
from sinssim.experiments.studies.step_cost import Cost, Operations
from sinssim.experiments.studies.study_exhibits import _costs
from sinssim.recording.page import parts_of
from sinssim.sensors.error_propagation import expect, expectation_numbers
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import PlatformErrors
from sinssim.statistics.requirements import parse_requirement
from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, PPM
from tests.recording.spies import html


def cells(page: str) -> list[list[str]]:
    """Return the texts of the cells of the rows of a table."""
    rows = re.findall(r"<tr>(.*?)</tr>", page, re.S)
    return [
        [re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row, re.S)] for row in rows
    ]


@pytest.mark.parametrize(
    ("require", "value", "words"),
    [
        ("r95(60 s) <= 200 m", 300.0, "It is 300 m at 60 s, 100 m (50 %) above the limit."),
        ("r95(60 s) <= 200 m", 150.0, "It is 150 m at 60 s, 50 m (25 %) below the limit."),
        ("heading(end) <= 4 arcmin", 5.0 * ARCMIN, "It is 5 arcmin at 60 s, 1 arcmin (25 %) above the limit."),
    ],
)
def test_a_budgets_answer_in_its_unit(require: str, value: float, words: str) -> None:
    answer = Answer(parse_requirement(require), value, 60.0, (), None, Allowance((), inf, 0.0))
    assert words in list(lines_of(answer))


def test_an_estimate_and_its_sigma_have_one_unit() -> None:
    cause = SimpleNamespace(value=(2.0 * DEG_H, -0.5 * DEG_H), sigma=(0.1 * DEG_H, 0.2 * DEG_H))
    assert with_sigma(cause, DEG_H, "deg/h") == "[2 ± 0.1, -0.5 ± 0.2] deg/h"


def test_the_errors_of_a_platform_in_their_units() -> None:
    """20, −30 and 40 ppm with σ = 50 ppm; gimbal angles 1″, 2″ and −3″ with σ = 4″."""
    section = Imu(
        grade="ideal",
        sensor_set={"type": "platform", "torquer_scale_sigma_ppm": 50.0, "pickoff_sigma_arcsec": 4.0},
    )
    errors = PlatformErrors(np.array([20.0, -30.0, 40.0]) * PPM, np.array([1.0, 2.0, -3.0]) * ARCSEC, 0.0)
    _, torquers, gimbals = cells(html(*platform_errors(section, errors, "level")))
    assert torquers[0].startswith("torquing scale factor")
    assert torquers[1:] == ["ppm", "20.00", "−30.00", "40.00", "50"]
    assert gimbals[1:] == ["arcsec", "1.000", "2.000", "−3.000", "4"]


def test_the_cost_of_a_schedule() -> None:
    """250 ns a step, 200 steps per second of motion: 50 µs, four million steps per second of the processor."""
    cost = Cost("quaternion", "level", 250.0, Operations(10.0, 20.0, 3.0, 4.0, 5.0), (200.0, 50.0, 10.0))
    table = "".join(parts_of(_costs(SimpleNamespace(costs={"one": cost}, attitude_costs=[])), 3))
    heads, row = (line for line in cells(table) if len(line) > 4)
    shown = dict(zip(heads, row, strict=True))
    assert shown["ns per step"] == "250"
    assert shown["million steps/s"] == "4.00"
    assert shown["µs per s of motion"] == "50.0"


def test_an_expectation_as_numbers() -> None:
    """An accelerometer's bias of 100 µg alone: b (1 − cos ω t)/ω² after a quarter of Schuler's period is b R/g."""
    section = Imu(grade="ideal", accel_bias_sigma_ug=100.0)
    quarter = 0.25 * 5064.0
    numbers = expectation_numbers(expect(section, 45.0 * DEG, quarter))
    assert numbers["latitude_deg"] == pytest.approx(45.0)
    assert numbers["duration_s"] == quarter
    assert [one["position_m"] for one in numbers["contributions"]] == pytest.approx([100e-6 * 6371e3] * 2, rel=5e-3)
    assert numbers["root_sum_square_m"] == pytest.approx(np.sqrt(2.0) * 100e-6 * 6371e3, rel=5e-3)
    growth = 0.5 * (np.cosh(np.sqrt(2.0) * 0.5 * np.pi) - 1.0)  # of the unaided height: ω² = 2 g/R, unstable
    assert numbers["unaided_height_from_accelerometer_bias_m"] == pytest.approx(100e-6 * 6371e3 * growth, rel=1e-2)
    assert numbers["root_sum_square_nmi"] == pytest.approx(numbers["root_sum_square_m"] / 1852.0)
