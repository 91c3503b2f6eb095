"""Figures of a budget: shares add up, and extreme budgets can be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.budget_exhibits import OTHERS, _palette, exhibits_of, shares, units_of_budget
from sinssim.analyses.error_budget.budget_result import answers
from sinssim.exhibits import Section, Table
from sinssim.recording.figures import to_png
from sinssim.recording.svg_chart import html_of
from sinssim.statistics.requirements import parse_requirements
from tests.analyses.error_budget.worlds import SHORT_TURN, scenario
from tests.recording.drawn import figure
from tests.slow import slow

_MANY = {"grade": "tactical", "gyro_ramp_deg_h_per_h": [1.0, 0.0, 0.0], "accel_flicker_ug": 10.0,
         "gyro_g_sensitivity_sigma_deg_h_per_g": 0.1, "accel_quadratic_sigma_ug_per_g2": 10.0}  # fmt: skip


def result(**imu: Any) -> sinssim.BudgetResult:
    return sinssim.budget(scenario(motion=SHORT_TURN, imu=imu))


def test_shares_add_up() -> None:
    found = result(**_MANY)
    labels, parts = shares(found)
    assert parts.sum(axis=0)[1:] == pytest.approx(1.0)
    assert labels[-1] == OTHERS
    assert len(set(_palette(labels))) == len(labels)
    assert "errors equal in every run" in labels or len(found.sources) > len(labels)


@pytest.mark.parametrize("imu", [*slow(_MANY), {}, {"gyro_bias_deg_h": [1.0, 0.0, 0.0]}], ids=["many", "none", "given"])
def test_any_budget_is_drawn(imu: dict[str, Any]) -> None:
    found = result(**imu)
    wanted = ["r95(end) <= 1 m", "cep <= 100 km", "rate <= 1 nmi/h", "heading <= 1 arcmin"]
    answered = answers(found, parse_requirements(wanted))
    exhibits = exhibits_of(found, answered)
    for charts in exhibits.charts():
        assert to_png(figure(exhibits, charts.key)).startswith(b"\x89PNG")
        assert html_of(charts).count('role="img"') == len(list(charts))
    units = [unit for unit, _ in units_of_budget(found)]
    assert [chart.unit(True)[0] for chart in exhibits.chosen("sigma")] == units  # those of the table
    (growth,) = (item for item in exhibits.items if isinstance(item, Section) and item.title == "Growth of the error")
    (table,) = (item for item in growth.items if isinstance(item, Table))
    assert [unit for _, unit in table.shown("page")[1][2::3]] == units[:1] + units


def test_curves_are_the_budgets_sigma_in_the_unit_of_the_axis() -> None:
    """North position, east velocity and heading at the end, in the unit that the panel names."""
    size = {"m": 1.0, "mm": 1e-3, "m/s": 1.0, "mm/s": 1e-3, "deg": np.pi / 180.0, "arcmin": np.pi / 10_800.0,
            "arcsec": np.pi / 648_000.0}  # fmt: skip
    found = result(grade="tactical")
    for number, (panel, line) in enumerate(zip(figure(exhibits_of(found), "sigma").axes, (0, 1, 2), strict=True)):
        shown = float(np.asarray(panel.lines[line].get_ydata())[-1]) * size[panel.get_ylabel()]
        assert shown == pytest.approx(float(found.sigma()[-1, 3 * number + line]), rel=1e-12)


def test_limits_lie_where_the_requirements_say() -> None:
    """A line throughout the run, a mark at an instant, a rate times its time; a far one is only named."""
    found = result(grade="tactical")
    end = float(found.time[-1])
    metres, high = 1.2 * float(found.r95.max()), float(found.r95.max()) * 2.0
    texts = (f"r95(run) <= {metres} m", f"rate(end) <= {metres / end} m/s", f"cep(end) <= {high} m")
    axes = figure(exhibits_of(found, answers(found, parse_requirements(texts))), "growth").axes[0]
    lines = {str(line.get_label()): line for line in axes.lines}
    unit = float(found.r95[-1]) / lines["R95: 95 % of all runs"].get_ydata()[-1]
    line = lines[f"{texts[0]}: met"]
    assert line.get_ydata()[0] * unit == pytest.approx(metres)
    mark = lines[f"{texts[1]}: met"]
    assert mark.get_xdata() == pytest.approx(lines["R95: 95 % of all runs"].get_xdata()[-1:])
    assert mark.get_ydata()[0] * unit == pytest.approx(metres)
    assert len(lines[f"{texts[2]}: met (above the plot)"].get_xdata()) == 0
    assert axes.get_ylim()[1] * unit > metres


def test_large_numbers_are_written_out() -> None:
    small = result(accel_bias_sigma_ug=1000.0)
    size = 1000.0 * 2344.0 / float(small.r95[-1])  # the budget is linear: R95 is 2344 m
    drawn = figure(exhibits_of(result(accel_bias_sigma_ug=size)), "ranking0")
    texts = [text.get_text() for panel in drawn.axes for text in panel.texts]
    assert texts == ["1172", "2344"]
