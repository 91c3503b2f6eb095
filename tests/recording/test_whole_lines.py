"""Lines below the tables of the console: which there are, and in which order."""

from __future__ import annotations

import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.experiments.run import run_comparison as runs
from sinssim.experiments.run.finished_runs import Entry
from sinssim.experiments.studies import study_exhibits as study
from sinssim.recording.console import show, show_items
from sinssim.sensors import error_propagation as expectation
from sinssim.sensors.error_propagation import Contribution, Expectation, Term
from sinssim.sensors.imu.imu_section import Imu
from tests.recording.by_hand import printed


def test_runs_of_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "is_of_another", lambda path: path.name == "b")
    date = datetime.datetime(2024, 5, 6, 7, 8, 9).astimezone()
    entries = [Entry(Path(name), "run", "s", "finished", "", None, 5, date, sinssim="0.7") for name in "abc"]
    lines = printed(lambda console: show_items(runs.list_exhibits(entries, Path("here")), console))
    assert lines[-2:] == ["3 in here, 15 B.", "b was written by sinssim 0.7."]


def test_keys_without_effect_on_an_expectation() -> None:
    """They come after the class of the unit."""
    notes = ["imu.x has no effect in 1800 s."]
    terms = (Term("gyro_bias", 0.01, "deg/h", 5e-8, "rad/s", "bias"),)
    own = Expectation(Imu(grade="ideal"), 0.5, 1800.0, terms, (Contribution("bias", "at rest", 926.0),))
    lines = printed(lambda console: show_items(expectation.expectation_exhibits(own, notes), console))
    # 0.8326 · 926 m are 0.4163 nmi in half an hour
    assert lines[-2:] == [
        "Half of all runs end within 0.83 nmi per hour, which is called the class of a unit.",
        "imu.x has no effect in 1800 s.",
    ]  # fmt: skip


def test_one_draw_of_a_study(monkeypatch: pytest.MonkeyPatch) -> None:
    """Said below the tables of its part."""
    monkeypatch.setattr(
        study.charts, "one_draw", lambda part, study: f"One draw of {study}." if part.title == "b" else ""
    )
    parts = [SimpleNamespace(title=title, decides=("x",), text="", schedules_hz=()) for title in "abc"]
    rows = [SimpleNamespace(status=status) for status in ("failed", "failed", "done")]
    plan = type("Study", (SimpleNamespace,), {"__str__": lambda self: "all"})(
        parts=parts, name="s", description="", seed=1
    )
    found: Any = SimpleNamespace(
        verdicts=[], picks=[], rows=rows, of_part=lambda title: [], study=plan, status="finished", seconds=1.0,
        costs={}, attitude_costs=[], motions={}, histories={},
    )  # fmt: skip
    assert printed(lambda console: show(study.exhibits_of(found), console)) == [
        "b:", "One draw of all.", "2 of 3 navigations failed; the report gives the reasons.",
    ]  # fmt: skip
