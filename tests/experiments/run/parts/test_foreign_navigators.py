"""What navigators of others state, in a table from entries by hand, and in the streams."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.exhibits import Sentence, Table
from sinssim.experiments.run.parts import foreign_navigators
from sinssim.experiments.run.parts.foreign_navigators import Navigators
from sinssim.simulation.navigator_protocol import ForeignSolution


def solution(time: list[float], **stated: Any) -> ForeignSolution:
    none = np.zeros(len(time))
    return ForeignSolution(
        np.array(time), none, none, none, np.zeros((len(time), 3)), np.zeros((len(time), 4)), none, "mine", **stated
    )


def test_the_table() -> None:
    part = Navigators(SimpleNamespace(scenario=None))  # type: ignore[arg-type]
    shares = {"position": 0.75, "velocity": 0.5, "attitude": 0.25}
    stated = {"solutions": 1201, "interval_s": 0.05, "within_sigma": shares, "status": {"1": 3, "2": 5},
              "started": "once", "last_message": "bye"}  # fmt: skip
    part.enter({"mine": stated})
    table, normal, last = part.exhibits()
    assert isinstance(table, Table)
    assert isinstance(normal, Sentence)
    assert isinstance(last, Sentence)
    columns, heads, rows = table.shown("page")
    assert [column.group for column in columns] == [*[""] * 3, *["errors within its 1σ"] * 3, *[""] * 2]
    assert [", ".join(filter(None, head)) for head in heads] == [
        "navigator", "solutions", "every, s", "position", "velocity", "attitude", "status", "started",
    ]  # fmt: skip
    assert rows == [["mine", "1201", "0.05000", "0.750", "0.500", "0.250", "1 × 3, 2 × 5", "once"]]
    assert normal.text == "Of normal errors a share of 0.683 is within 1σ."
    assert last.text == "mine said last: bye"


def test_the_share_within_sigma_and_the_status() -> None:
    """Of six errors of position three do not exceed 1σ; nothing is known of the velocity."""
    sigma = np.full((2, 9), np.nan)
    sigma[:, :3] = 2.0
    errors = SimpleNamespace(position_ned=np.array([[1.0, -2.0, 3.0], [-5.0, 4.0, 0.0]]), velocity_ned=np.zeros((2, 3)),
                             attitude=np.full((2, 3), np.nan))  # fmt: skip
    run: Any = SimpleNamespace(axes="north", errors={"mine": errors})
    assert Navigators(run)._within("mine", sigma) == {"position": 0.5}
    assert foreign_navigators._counts(np.array([2.0, 1.0, 2.0, np.nan])) == {"1": 1, "2": 2}
