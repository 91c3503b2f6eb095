"""The tables of a budget whose every number follows from circles of equal σ north and east."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace

import pytest

from sinssim.analyses.error_budget.budget_exhibits import (
    _FIXED_GAINS,
    _over_time,
    _ranking,
    _waypoints,
    allowance_cells,
    exhibits_of,
    lines_of,
    when,
)
from sinssim.analyses.error_budget.budget_result import Allowance, Answer, PredictedMiss
from sinssim.exhibits import Table, four_digits
from sinssim.recording.console import show
from sinssim.statistics.requirements import Exceeded, parse_requirement
from tests.recording.by_hand import CEP, R95, SOURCES, hand_budget, printed

BIAS, GYRO, HEIGHT, WALK = SOURCES
NONE = Allowance((), inf, 0.0)
HEADS = ["t, s", "CEP, m", "R95, m", "north, m", "east, m", "down, m", "v north, mm/s", "v east, mm/s", "v down, mm/s",
         "tilt n, arcmin", "tilt e, arcmin", "heading, arcmin"]  # fmt: skip


def page(table: Table) -> tuple[list[str], list[list[str]]]:
    """Return heads with units, and the texts of the rows, as on a page."""
    _, heads, rows = table.shown("page")
    return [", ".join(filter(None, head)) for head in heads], rows


def row(hours: float) -> list[str]:
    """Return the errors after some hours."""
    values = (50.0 * CEP, 50.0 * R95, 50.0, 50.0, 25.0, 5.0, 5.0, 13.0, 0.25, 0.5, 1.1)
    return [f"{3600.0 * hours:g}", *(f"{value * hours:.4g}" for value in values)]


def halved(a: float, b: float) -> str:
    """Return by how much R95 after two hours is less with σ of a and b m/h, and the 0.1 m/h of the walk."""
    return f"{2.0 * R95 * (2500.01**0.5 - (a * a + b * b + 0.01) ** 0.5):.4g}"


RANKED = [
    ["gyro_bias", "gyros", "0.0123", "deg/h", "64.00 %", f"{80.0 * R95:.4g}", halved(30.0, 20.0), "from one run"],
    ["accel_bias", "accelerometers", "45", "µg", "36.00 %", f"{60.0 * R95:.4g}", halved(15.0, 40.0), ""],
]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (12_345.6, "12,346"), (9999.6, "1e+04"), (123.456, "123.5"), (0.00123456, "0.001235"), (nan, "–"),
     (2.34567e-5, "0.00002346"), (-2.34567e-6, "-0.000002346"), (5e-9, "5e-09"), (3e7, "3e+07"), (-25_000.0, "-25,000"),
     (inf, "inf")],
)  # fmt: skip
def test_numbers(value: float, text: str) -> None:
    assert four_digits(value) == text


def test_errors_over_time() -> None:
    """Six evenly spaced instants, and those that are asked for."""
    heads, cells = page(_over_time(hand_budget(), (600.0, 3600.0)))
    assert heads == HEADS
    third = 1.0 / 3.0
    assert cells == [row(0.5 * third), row(third), row(2.0 * third), row(1.0), row(4.0 * third), row(5.0 * third),
                     row(2.0)]  # fmt: skip


def test_the_ranking() -> None:
    """Of the mean square of 2 · 50², gyros have 40²/50² and accelerometers 30²/50²; two sources are negligible."""
    result = hand_budget()
    heads, cells = page(_ranking(result, 7200.0))
    assert heads == ["source", "group", "value", "unit", "share", "R95 alone, m", "R95 decrease if halved, m", ""]
    assert cells == RANKED
    assert _ranking(result, 7200.0).note == "2 sources below 0.01 % of the mean square."
    assert when(result, 7200.0) == "at the end, 7200 s"
    assert when(result, 600.0) == "where R95 is largest, at 600 s"


def test_everything_on_the_console() -> None:
    answer = Answer(parse_requirement("r95(end) <= 200 m"), 2.0 * R95 * 50.0, 7200.0,
                    (Allowance((GYRO,), 0.75, 150.0), Allowance((BIAS,), nan, 210.0)), None,
                    Allowance((), 0.8, 0.0))  # fmt: skip
    lines = printed(lambda console: show(exhibits_of(hand_budget(), [answer], (600.0,)), console))
    names = [head.partition(", ")[0] for head in HEADS]
    units = [head.partition(", ")[2] for head in HEADS]
    third = 1.0 / 3.0
    over = 2.0 * R95 * 50.0 - 200.0
    assert lines == [
        "by hand: covariance budget of inertial navigation",
        "Errors over time: root mean square over all runs; CEP and R95 are the radii of 50 % and 95 % of the runs",
        " ".join(names),
        " ".join(units),
        *(" ".join(row(k * third)) for k in (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        "What to improve first, at the end, 7200 s",
        "R95 alone R95 decrease if halved",
        "source group value unit share m m",
        *(" ".join(cells).strip() for cells in RANKED),
        "2 sources below 0.01 % of the mean square.",
        f"Rate at the end: {50.0 * R95 / 1852.0:.4g} nmi/h (R95 divided by the time since the start).",
        "r95(end) <= 200 m: NOT MET. Radius of the circle that contains 95 % of all runs, at the end, at most 200 m.",
        f"It is {100.0 * R95:.4g} m at 7200 s, {over:.4g} m ({over / 2.0:.3g} %) above the limit.",
        "It is met with all sources in the table 0.8 times as large as they are.",
        "Largest value of each source with which the requirement is met, if all others do not change",
        "source now at most",
        "gyro_bias 0.0123 deg/h 0.009225 deg/h 0.75 times the present value",
        "accel_bias 45 µg – not even at zero, because the other sources give 210 m",
    ]
    aided = printed(lambda console: show(exhibits_of(hand_budget(filtered=True)), console))
    assert aided[0] == "by hand: covariance budget of inertial navigation with the filter"
    assert aided[-1] == _FIXED_GAINS
    other = hand_budget(filtered=True)
    other.scenario.filter = SimpleNamespace(kind="unscented")
    assert printed(lambda console: show(exhibits_of(other), console))[0] == (
        "by hand: covariance budget of inertial navigation with the linear filter in place of the unscented one"
    )


def answer(require: str, value: float, **changes: object) -> list[str]:
    """Return the sentences of an answer."""
    kept = {"allowances": (Allowance((GYRO,), 0.5, 3.0),), "joint": None, "everything": NONE} | changes
    return list(lines_of(Answer(parse_requirement(require), value, 1234.0, **kept)))


def test_sentences_of_an_answer() -> None:
    joint = Allowance((GYRO, BIAS), 0.4, 500.0)
    assert answer("rate(1234 s) <= 2 kt", 1.5 * 1852.0 / 3600.0)[1:] == [
        "It is 1.5 kt at 1234 s, 0.5 kt (25 %) below the limit."
    ]
    assert answer("r95(run) <= 4 km", 5000.0, joint=joint, exceeded=Exceeded(700.0, 600.0))[1:] == [
        "The largest value is 5 km at 1234 s, 1 km (25 %) above the limit.",
        "It is exceeded from 700 s, 100 s after the fixes end.",
        "Together, by the common factor 0.4, they may be at most: gyro_bias 0.00492 deg/h, accel_bias 18 µg.",
        "It is met with all sources in the table inf times as large as they are.",
    ]
    assert answer("r95(run) <= 4 km", 4000.0 - 1e-7)[1] == "The largest value is 4 km at 1234 s, which is the limit."
    nothing = answer("r95(end) <= 4 km", 5000.0, joint=Allowance((GYRO, BIAS), nan, 4500.0),
                     allowances=(Allowance((GYRO,), nan, 4800.0),), everything=Allowance((), nan, 4200.0))  # fmt: skip
    assert nothing[2:] == [
        "Not even with gyro_bias and accel_bias at zero: the other sources alone give 4.5 km.",
        "No single source can be made small enough: even with any one of them at zero, the limit is exceeded.",
    ]
    assert answer("r95(end) <= 4 km", 2000.0, joint=Allowance((GYRO,), inf, 1.0))[2:] == [
        "gyro_bias have no effect on it."
    ]


def test_the_largest_values_of_sources() -> None:
    allowances = (Allowance((GYRO,), 1000.0, 1.0), Allowance((BIAS,), 1000.1, 1.0), Allowance((WALK,), nan, 6000.0))
    one = Answer(parse_requirement("r95(end) <= 4 km"), 5000.0, 60.0, allowances, None, NONE)
    assert allowance_cells(one) == [
        ["gyro_bias", "0.0123 deg/h", "12.3 deg/h", "1000 times the present value"],
        ["accel_bias", "45 µg", "any", "more than 1000 times the present value"],
        ["gyro_walk", "0.002 deg/√h", "–", "not even at zero, because the other sources give 6 km"],
    ]


def test_the_predicted_misses_of_waypoints() -> None:
    missed = replace(hand_budget(), waypoints=(PredictedMiss("N", 61.5, 1.5, -58.25, 29.5),))
    (section,) = _waypoints(missed)
    table = section.items[0]
    assert isinstance(table, Table)
    assert page(table) == (
        ["waypoint", "at, s", "perfect navigator, m", "mean of all runs, m", "1σ, m"],
        [["N", "61.5", "1.5", "−58.25", "29.5"]],
    )
    assert list(_waypoints(hand_budget())) == []
