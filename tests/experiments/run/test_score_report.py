"""The report of scored solutions: ranks by quantity, who is whose, what is left out of the plots."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.earth import WGS84
from sinssim.experiments.run import run_scores as report
from sinssim.experiments.run.error_exhibits import Compared
from sinssim.strapdown.navigation_error import NavError
from tests.recording.spies import cells, read


def numbers(horizontal: float | None, height: float | None, velocity: float | None, attitude: float | None) -> Any:
    values = {"horizontal_error_m": horizontal, "height_error_m": height, "velocity_error_mps": velocity,
              "attitude_error_arcsec": attitude}  # fmt: skip
    own = {f"rms_{name}": value for name, value in values.items()}
    twice = {f"max_{name}": value and 2.0 * value for name, value in values.items()}
    return own | twice | {f"final_{name}": value and -1.5 * value for name, value in values.items()}


NUMBERS = {
    "poisson": numbers(700.0, 3.0, 0.8, 70.0),
    "theirs": numbers(80.0, 9.0, None, 240.0),
    "euler": numbers(900.0, 6.0, 0.5, 30.0),
    "mine & co": numbers(23.456, 1.5, 0.9, None),
    "lost": numbers(None, None, None, None),
}
THEIRS = {"theirs", "mine & co"}


def nothing(size: float) -> NavError:
    return NavError(np.array([5.0, 95.0]), np.full((2, 3), size), np.zeros((2, 3)), np.zeros((2, 3)))


COMPARED = Compared(np.array([5.0, 95.0]), {name: nothing(k) for k, name in enumerate(NUMBERS)}, "north")


def test_only_far_algorithms_of_the_run_are_left_out() -> None:
    """Ten times the largest rms of a scored solution, 800 m, is the limit; a scored one is never left out."""
    drawn, far = report.near_the_scored(COMPARED, NUMBERS, THEIRS)
    assert far == ["euler"]
    assert list(drawn.errors) == ["poisson", "theirs", "mine & co", "lost"]
    assert drawn.time is COMPARED.time
    assert drawn.axes == "north"


def test_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, Any] = {}

    def plots(drawn: Compared, period: float, *, apart: bool) -> list[str]:
        seen.update(names=list(drawn.errors), period=period, apart=apart)
        return ["(plots)"]

    monkeypatch.setattr(report, "error_plots", plots)
    place = np.radians([44.0, 46.0])
    stream = SimpleNamespace(
        latitude=place, longitude=place, height=np.array([100.0, 300.0]), velocity_ned=np.zeros((2, 3)),
        q_nb=np.zeros((2, 4)),
    )  # fmt: skip
    run = SimpleNamespace(name="a run", motion="truth", solution=lambda name: stream if name == "truth" else None)
    judge: Any = SimpleNamespace(run=run, ellipsoid=WGS84)
    scores: Any = [
        SimpleNamespace(name="theirs", path=Path("/data/t.csv"), sentences=("The clock is GPS.", "3 rows < 4.")),
        SimpleNamespace(name="mine & co", path=Path("/data/m.pos"), sentences=("One.",)),
    ]
    html = report.score_report(judge, scores, COMPARED, NUMBERS)
    text = read(html)
    assert "Compared from 5 s to 95 s, which every scored solution covers." in text
    assert "mine &amp; co (scored) has the smallest rms horizontal error: 23.46 m." in text
    assert "Not plotted, because the errors are much larger: euler." in text
    rows = cells(html)
    first = rows.index(["algorithm", "from", "horizontal", "height", "velocity", "attitude"])
    assert rows[first + 1 : first + 6] == [
        ["mine &amp; co", "scored", "1", "1", "3", "–"],
        ["theirs", "scored", "2", "4", "–", "3"],
        ["poisson", "run", "3", "2", "2", "2"],
        ["euler", "run", "4", "3", "1", "1"],
        ["lost", "run", "–", "–", "–", "–"],
    ]
    errors = {row[0]: row[1:] for row in rows if len(row) == 13}
    # units by the largest value of each group: m, m, m/s, and 480″ are 8 arcmin
    assert errors["theirs"] == ["−120.0", "80.00", "160.0", "−13.50", "9.000", "18.00", "–", "–", "–", "−6.000",
                                "4.000", "8.000"]  # fmt: skip
    assert list(errors)[1:] == ["mine &amp; co", "theirs", "poisson", "euler", "lost"]
    assert seen["names"] == ["mine & co", "theirs", "poisson", "lost"]
    assert not seen["apart"]
    # at 45° and 200 m: R = √(6367381.8 · 6388838.3) + 200 m, normal gravity 9.806199 − 3.086e-6 · 200 m/s²
    expected = 2.0 * np.pi * np.sqrt((np.sqrt(6367381.8 * 6388838.3) + 200.0) / (9.8061992 - 3.086e-6 * 200.0))
    assert seen["period"] == pytest.approx(expected, rel=1e-7)
    assert "theirs /data/t.csv The clock is GPS. 3 rows &lt; 4. mine &amp; co /data/m.pos One." in text


def test_the_best_may_be_the_runs_own() -> None:
    words = "".join(report._in_short(NUMBERS, ["poisson", "theirs"], THEIRS, (1.5, 2.5)))
    assert "from 1.5 s to 2.5 s" in words
    assert "poisson (the run’s own) has the smallest rms horizontal error: 700.0 m." in words
