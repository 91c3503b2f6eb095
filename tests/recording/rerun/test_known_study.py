"""A study in the viewer: growth of the errors, panels and tables from rows that are written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.experiments.studies import study_files as view
from sinssim.experiments.studies.study_results import ErrorGrowth, Row
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
    part = SimpleNamespace(title="one", rates_hz=rates, schedules_hz=())
    return SimpleNamespace(
        study=SimpleNamespace(name="s", description="d", parts=[SimpleNamespace(title="none"), part]), rows=rows,
        of_part=lambda title: rows if title == "one" else [],
        history=lambda one: histories[one.algorithm, one.rate_hz], verdicts=[],
    )  # fmt: skip


PAINT = {"poisson": "#0a141e", "euler": "#ffc080"}


def test_growth_of_the_errors_at_one_rate() -> None:
    """The rate nearest to 50 Hz; up to the end of the shorter one; decades; no logarithm at the start."""
    for rates, kind, what in (
        ((10.0, 40.0, 200.0), "attitude", "attitude, log₁₀ ″"), ((40.0,), "horizontal", "horizontal, log₁₀ m"),
    ):  # fmt: skip
        drawn: Any = Drawn()
        panels = view._draw_growth(drawn, study(rates), PAINT)
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
    rows = [
        row("poisson", 40.0, max_attitude_error_arcsec=0.0234, max_horizontal_error_m=12.5),
        row("euler", 10.0, max_attitude_error_arcsec=2.5, max_horizontal_error_m=345.6),
    ]
    assert view._rates_table(rows) == [
        "| a turn, left: attitude, ″ | 10 Hz | 40 Hz |", "|---|---|---|", "| poisson | – | 0.023 |",
        "| euler | 2.5 | – |", "",
    ]  # fmt: skip
    assert view._cases_table(rows) == [
        "| motion | | horizontal, m | attitude, ″ |", "|---|---|---|---|",
        "| a turn, left | poisson · 40 Hz | 12.5 | 0.0234 |", "| a turn, left | euler · 10 Hz | 346 | 2.50 |",
    ]  # fmt: skip


def test_verdicts_and_failures_as_text() -> None:
    found = study((40.0,))
    found.verdicts = [
        SimpleNamespace(title="T", verdict="refuted", measured="3 m", expected="2 m", sentence="it holds",
                        reason="No.", lines=(("a point", "confirmed"), ("another", "")))
    ]  # fmt: skip
    lines = view._markdown(found).splitlines()
    assert lines[:2] == ["# s", ""]
    assert "| T | refuted | 3 m | 2 m |" in lines
    assert "**REFUTED**: It holds. No." in lines
    assert "- *confirmed*: a point" in lines
    assert "- another" in lines
    assert "- **a turn, left · euler · 200 Hz** failed: it fell" in lines
    assert "## none" not in lines
