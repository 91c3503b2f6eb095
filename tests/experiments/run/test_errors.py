"""The marks of the error plots, and the numbers of tables: what people read."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Axis, Chart, Line, Rule
from sinssim.experiments.run.error_exhibits import _schuler_marks, requirement_sentences
from sinssim.experiments.run.parts.phases import _cell
from sinssim.recording.svg_chart import svg_of
from sinssim.units import LENGTH_SCALE

PERIOD = 5066.0


@pytest.mark.parametrize(
    ("periods", "texts"),
    [
        (0.4, []),
        (0.5, ["T/2 = 42.2 min"]),
        (0.99, ["T/2 = 42.2 min", "T = 84.4 min"]),  # the axis goes on to the mark
        (3.2, ["T/2 = 42.2 min", "T = 84.4 min", "2 T", "3 T"]),
        (6.5, ["T = 84.4 min", "2 T", "3 T", "4 T", "5 T", "6 T"]),
        (17.05, ["2 T", "4 T", "6 T", "8 T", "10 T", "12 T", "14 T", "16 T"]),
    ],
)
def test_marks_of_schulers_period_reach_the_end_of_the_run(periods: float, texts: list[str]) -> None:
    span, marks = _schuler_marks(100.0, 100.0 + periods * PERIOD, PERIOD)
    assert [mark.text for mark in marks] == texts
    for mark in marks:
        factor = {"T/2": 0.5, "T": 1.0}.get(mark.text.partition(" =")[0]) or float(mark.text.partition(" ")[0])
        assert mark.at == pytest.approx(100.0 + factor * PERIOD)
    assert span[1] >= 100.0 + periods * PERIOD


def test_the_text_of_a_mark_is_not_on_the_axis() -> None:
    line = Line(label="a", x=np.array([0.0, 100.0]), y=np.array([0.0, 4.0]))
    mark = Rule(at=2.0, upright=True, text="T/2 = 42.2 min")
    svg = svg_of(Chart(key="c", title="error", y=Axis(units=LENGTH_SCALE), marks=(line, mark)), 560.0, 200.0)
    (x,) = re.findall(r'<text x="([\d.]+)"[^>]*>T/2', svg)
    (left,) = re.findall(r'</g>|<svg x="([\d.]+)"', svg)
    assert float(x) >= float(left)  # where the plot begins


def test_numbers_without_exponents() -> None:
    assert [_cell(v) for v in (2774.3, -0.01234, 35869.2, 74.0, 0.0)] == ["2774", "−0.0123", "35869", "74.0", "0"]


NUMBERS = {"requirement": "tse(run) <= 50 m", "verdict": "not met", "value": 63.217, "limit": 50.0, "unit": "m",
           "time_s": 1234.5, "exceeded_from_s": 1000.26}  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "text", "kind"),
    [
        ({}, "NOT MET in this run. The value is 63.2 m at 1234.5 s, exceeded from 1000 s.", "warning"),
        ({"verdict": "met", "exceeded_from_s": None}, "met in this run. The value is 63.2 m at 1234.5 s.", ""),
        ({"value": None}, "undecided. This run has no such value.", "warning"),
        ({"value": math.nan}, "undecided. This run has no such value.", "warning"),
    ],
)
def test_the_verdict_of_one_run_in_words(changed: dict[str, Any], text: str, kind: str) -> None:
    (said,) = requirement_sentences([{**NUMBERS, **changed}])  # type: ignore[typeddict-item]
    assert (said.text, said.kind) == (f"tse(run) <= 50 m: {text}", kind)
