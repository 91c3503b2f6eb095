"""A study in the viewer: growth of the errors, panels and words from rows that are written down."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.studies import study_exhibits
from sinssim.experiments.studies.study_charts import growth_over_time
from sinssim.experiments.studies.study_results import ErrorGrowth, Row, Verdict
from sinssim.recording.rerun_exhibits import markdown, record_charts
from tests.recording.spies import Drawn


def row(algorithm: str, rate: float, motion: str = "a turn, left", part: str = "one", **more: Any) -> Row:
    values = {"variant": "", "sensors": "ideal", "frame": "level", "gravity": "normal", "curvature": "exact",
              "schedule_hz": (), "slow": "hold"}  # fmt: skip
    return Row(**{**values, "algorithm": algorithm, "rate_hz": rate, "motion": motion, "part": part, **more})


def growth(factor: float, end: float) -> ErrorGrowth:
    """Horizontal 10 f, 100 f, 1000 f m at start, middle and end; attitude 0.1 f, 1 f, 10 f arcsec."""
    return ErrorGrowth(np.array([20.0, 0.5 * (20.0 + end), end]), factor * np.array([10.0, 100.0, 1000.0]),
                       factor * np.array([0.1, 1.0, 10.0]))  # fmt: skip


def study(rates: tuple[float, ...]) -> Any:
    rows = [
        row("poisson", 40.0), row("euler", 40.0), row("poisson", 10.0), row("poisson", 200.0),
        row("euler", 200.0, status="failed", message="it fell"),
    ]  # fmt: skip
    histories = {(one.algorithm, one.rate_hz): growth(k + 1.0, 420.0 + 100.0 * k) for k, one in enumerate(rows)}
    about = {"text": "", "decides": (), "coordinates": (), "sensors": ("ideal",), "variants": ("rate-gyros",),
             "schedules_hz": ()}  # fmt: skip
    parts = [SimpleNamespace(title=title, rates_hz=rates, **about) for title in ("none", "one")]
    return SimpleNamespace(
        study=SimpleNamespace(name="s", description="d", parts=parts, seed=1), rows=rows, status="finished",
        of_part=lambda title: rows if title == "one" else [], seconds=1.0, picks=[], orders=[], headings=[],
        coordinate_errors=[], costs={}, attitude_costs=[], motions={},
        history=lambda one: histories[one.algorithm, one.rate_hz], histories=histories, verdicts=[],
    )  # fmt: skip


PAINT = {"poisson": "#0a141e", "euler": "#ffc080"}


def test_growth_of_the_errors_at_one_rate() -> None:
    """The rate nearest to 50 Hz; up to the end of the shorter one; decades; no logarithm at the start."""
    for rates, kind, what in (
        ((10.0, 40.0, 200.0), "attitude", "attitude, log₁₀ ″"), ((40.0,), "horizontal", "horizontal, log₁₀ m"),
    ):  # fmt: skip
        drawn: Any = Drawn()
        panels, groups = growth_over_time(study(rates), PAINT)
        for charts in groups:
            record_charts(drawn, charts, "comparison/")
        entity = "comparison/growth/2/a_turn_left"
        assert panels == [(entity, f"a turn, left, 40 Hz: {what}", 420.0, True)]
        time, values, names, colors, _ = drawn.lines[entity]
        assert names == ["poisson", "euler"]
        assert colors == [(10, 20, 30), (255, 192, 128)]
        np.testing.assert_allclose(time, np.linspace(20.0, 420.0, 400))
        assert np.isnan(values[0]).all()
        least = 0.1 if kind == "attitude" else 10.0
        middle = 10.0 * least + 90.0 * least * (time - 220.0) / 200.0
        np.testing.assert_allclose(10.0 ** values[250:, 0], middle[250:])
        own = np.interp(time, [20.0, 270.0, 520.0], 2.0 * least * np.array([1.0, 10.0, 100.0]))
        np.testing.assert_allclose(10.0 ** values[1:, 1], own[1:])


def test_tables_as_text() -> None:
    """A claim with its reason and points, the tables of errors, and the failures with their reasons."""
    result = study((10.0, 40.0, 200.0))
    result.verdicts = [
        Verdict("coning", "it holds", "refuted", "No.", ("a point", "another"), judged=("confirmed", ""),
                measured="3 m", expected="2 m")
    ]  # fmt: skip
    result.rows[0] = row("poisson", 40.0, max_attitude_error_arcsec=0.0234)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Verdict, "title", "T")
        exhibits = study_exhibits.exhibits_of(result)
    lines = markdown(exhibits).splitlines()
    assert lines[:3] == ["# s", "", "d"]
    assert "| T | refuted | 3 m | 2 m |" in lines
    at = lines.index("### It holds: refuted")
    assert lines[at + 1 : at + 6] == ["", "No.", "", "- confirmed: a point", "- another"]
    assert "- **a turn, left · euler · 200 Hz**: it fell" in lines
    at = lines.index("### a turn, left: largest attitude error, ″")
    assert lines[at + 2 : at + 5] == ["|  | 10 Hz | 40 Hz | 200 Hz |", "|---|---:|---:|---:|",
                                      "| poisson | – | 0.0234 | – |"]  # fmt: skip
    assert exhibits.span == (0.0, 820.0)
    assert json.loads(exhibits.labels["panels"])[0][0] == "comparison/growth/2/a_turn_left"


def test_cases_as_text() -> None:
    rows = [
        row("poisson", 40.0, max_attitude_error_arcsec=0.0234, max_horizontal_error_m=12.5),
        row("euler", 10.0, max_attitude_error_arcsec=2.5, max_horizontal_error_m=345.6),
    ]
    columns, heads, texts = study_exhibits._cases(rows, ("recording",)).shown("recording")
    assert [", ".join(filter(None, head)) for head in heads] == [
        "algorithm", "rate, Hz", "horizontal max, m", "attitude max, ″",
    ]  # fmt: skip
    assert texts == [["poisson", "40", "12.5", "0.0234"], ["euler", "10", "346", "2.50"]]
    assert [column.words for column in columns] == [True, True, False, False]
