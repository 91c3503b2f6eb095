"""Figures of a budget: shares add up, and extreme budgets can be drawn."""

from __future__ import annotations

from typing import Any

import pytest

import sinssim
from sinssim.error_budget.limits import answers
from sinssim.recording.figures.budget import OTHERS, growth_figure, palette, ranking_figure, shares, sigma_figure
from sinssim.recording.figures.canvas import to_svg
from sinssim.requirements.requirement import parse_requirements
from tests.error_budget.worlds import SHORT_TURN, scenario

_MANY = {"grade": "tactical", "gyro_ramp_deg_h_per_h": [1.0, 0.0, 0.0], "accel_flicker_ug": 10.0,
         "gyro_g_sensitivity_sigma_deg_h_per_g": 0.1, "accel_quadratic_sigma_ug_per_g2": 10.0}  # fmt: skip


def result(**imu: Any) -> sinssim.BudgetResult:
    return sinssim.budget(scenario(motion=SHORT_TURN, imu=imu))


def test_shares_add_up() -> None:
    found = result(**_MANY)
    labels, parts = shares(found)
    assert parts.sum(axis=0)[1:] == pytest.approx(1.0)
    assert labels[-1] == OTHERS
    assert len(set(palette(labels))) == len(labels)
    assert "errors equal in every run" in labels or len(found.sources) > len(labels)


@pytest.mark.parametrize("imu", [_MANY, {}, {"gyro_bias_deg_h": [1.0, 0.0, 0.0]}], ids=["many", "none", "given"])
def test_any_budget_is_drawn(imu: dict[str, Any]) -> None:
    found = result(**imu)
    answered = answers(found, parse_requirements(["r95(end) <= 1 m", "cep <= 100 km"]))
    for number, figure in enumerate((growth_figure(found, answered), ranking_figure(found), sigma_figure(found))):
        assert to_svg(figure, f"figure{number}").startswith("<svg")
