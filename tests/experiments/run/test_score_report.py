"""The report of scored solutions: ranks by quantity, who is whose, what is left out of the plots."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.earth import WGS84
from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_scores as report
from sinssim.experiments.run.error_exhibits import Compared
from sinssim.recording.page import page_of
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


def nothing(size: float) -> NavError:
    return NavError(np.array([5.0, 95.0]), np.full((2, 3), size), np.zeros((2, 3)), np.zeros((2, 3)))


def scored(monkeypatch: pytest.MonkeyPatch, *names: str, span: tuple[float, float] = (5.0, 95.0)) -> Any:
    """Return solutions of which some, or all, are compared; their numbers are those above."""
    errors = {name: nothing(k) for k, name in enumerate(NUMBERS) if name in (names or NUMBERS)}
    of = {id(error): NUMBERS[name] for name, error in errors.items()}
    monkeypatch.setattr(report, "known_numbers", lambda error, span: of[id(error)])
    place = np.radians([44.0, 46.0])
    stream = SimpleNamespace(
        latitude=place, longitude=place, height=np.array([100.0, 300.0]), velocity_ned=np.zeros((2, 3)),
        q_nb=np.zeros((2, 4)),
    )  # fmt: skip
    run = SimpleNamespace(name="a run", motion="truth", solution=lambda name: stream if name == "truth" else None)
    judge: Any = SimpleNamespace(run=run, ellipsoid=WGS84, against="the truth", axes="north")
    scores: Any = [
        SimpleNamespace(name="theirs", path=Path("/data/t.csv"), seconds=None,
                        sentences=("The clock is GPS.", "3 rows < 4.")),
        SimpleNamespace(name="mine & co", path=Path("/data/m.pos"), seconds=None, sentences=("One.",)),
    ]  # fmt: skip
    return report.Scored(judge, [score for score in scores if score.name in errors], errors, span)


def test_only_far_algorithms_of_the_run_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten times the largest rms of a scored solution, 800 m, is the limit; a scored one is never left out."""
    of = scored(monkeypatch)
    assert of.far == ["euler"]
    assert list(of.drawn.errors) == ["mine & co", "theirs", "poisson", "lost"]
    assert of.drawn.time.tolist() == [5.0, 95.0]
    assert of.drawn.axes == "north"


def test_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, Any] = {}

    def plots(drawn: Compared, period: float, *, apart: bool) -> list[Sentence]:
        seen.update(names=list(drawn.errors), period=period, apart=apart)
        return [Sentence("(plots)")]

    monkeypatch.setattr(report, "error_exhibits", plots)
    html = page_of(report.score_exhibits(scored(monkeypatch)))
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
    errors = {row[1]: row[2:14] for row in rows if len(row) == 15}
    # units by the largest value of each group: m, m, m/s, and 480″ are 8 arcmin
    assert errors["theirs *"] == ["−120", "80", "160", "−13.5", "9", "18", "–", "–", "–", "−6", "4", "8"]
    assert list(errors)[1:] == ["mine &amp; co *", "theirs *", "poisson", "euler", "lost"]
    assert seen["names"] == ["mine & co", "theirs", "poisson", "lost"]
    assert not seen["apart"]
    # at 45° and 200 m: R = √(6367381.8 · 6388838.3) + 200 m, normal gravity 9.806199 − 3.086e-6 · 200 m/s²
    expected = 2.0 * np.pi * np.sqrt((np.sqrt(6367381.8 * 6388838.3) + 200.0) / (9.8061992 - 3.086e-6 * 200.0))
    assert seen["period"] == pytest.approx(expected, rel=1e-7)
    assert "theirs /data/t.csv The clock is GPS. 3 rows &lt; 4. mine &amp; co /data/m.pos One." in text


def test_the_best_may_be_the_runs_own(monkeypatch: pytest.MonkeyPatch) -> None:
    of = scored(monkeypatch, "poisson", "lost", span=(1.5, 2.5))
    monkeypatch.setattr(report, "error_exhibits", lambda *_, **__: [])
    words = read(page_of(report.score_exhibits(of)))
    assert "from 1.5 s to 2.5 s" in words
    assert "poisson (the run’s own) has the smallest rms horizontal error: 700.0 m." in words
