"""The offset of two clocks from matches whose residuals are known functions of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection import clock_offset
from sinssim.analyses.inspection.clock_offset import NEAR, WINDOWS, Coarse, Offset, _best, _stands_out, fine_offset
from sinssim.analyses.inspection.velocity_match import Match, scatter
from sinssim.data import Array

FIXES: Any = SimpleNamespace(time=np.arange(0.0, 60.0, 1.0), sigma=0.1)
BIAS = np.arange(1.0, 7.0)
ERRORS = np.array([0.05, -0.02, -0.04, 0.03, -0.05, 0.03])
"""By how much each window's own offset differs, s."""


def made(residual: float, each: Array, window: float, moved: float = 1e3) -> Match:
    nothing = np.zeros(len(each))
    return Match(residual, each, nothing, np.zeros((len(each), 4)), nothing, BIAS, window, moved)


def of_valley(place: float, noise: dict[float, float], floor: float = 0.1) -> Any:
    """Return a match with (e − place)² over a floor, and windows that differ by more or less noise."""

    def matched(curve: Any, fixes: Any, at: float, *, window: float, bias: Any = None, rounds: int = 3) -> Match:
        assert (curve, fixes is FIXES) == ("curve", True)
        assert bias is BIAS or (bias is None and rounds == 3)
        off = at - place - noise[window] * ERRORS
        return made(float(np.sqrt(floor**2 + (at - place) ** 2)), np.sqrt(floor**2 + off**2), window)

    return matched


def test_the_offset_of_the_window_that_tells_it_best(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = {window: 1.0 + abs(k - 1) for k, window in enumerate(WINDOWS)}
    monkeypatch.setattr(clock_offset, "match", of_valley(3.37, noise))
    found = fine_offset("curve", FIXES, 3.0)  # type: ignore[arg-type]
    assert found is not None
    assert found.value == pytest.approx(3.37, abs=2e-3)
    assert found.inside
    assert found.match.window == WINDOWS[1]
    assert found.match.residual == pytest.approx(0.1, abs=1e-4)
    squares = [(found.value + d - 3.37 - ERRORS) ** 2 for d in (-0.05, 0.0, 0.05)]
    assert found.sigma == pytest.approx(scatter(*squares, 0.05), rel=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_offset_outside_of_the_range_is_none(side: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least of the range is then at its end."""
    monkeypatch.setattr(clock_offset, "match", of_valley(3.0 + side * (NEAR + 0.3), dict.fromkeys(WINDOWS, 1.0)))
    found = fine_offset("curve", FIXES, 3.0)  # type: ignore[arg-type]
    assert found is not None
    assert not found.inside
    assert found.value == pytest.approx(3.0 + side * NEAR, abs=0.11)
    flat = of_valley(3.0, dict.fromkeys(WINDOWS, 1.0), floor=50.0)
    monkeypatch.setattr(clock_offset, "match", flat)
    found = fine_offset("curve", FIXES, 3.0)  # type: ignore[arg-type]
    assert found is not None
    assert not found.inside  # the residual is hardly larger at the ends
    monkeypatch.setattr(clock_offset, "match", lambda *a, **k: made(np.inf, np.zeros(0), 1.0))
    assert fine_offset("curve", FIXES, 3.0) is None  # type: ignore[arg-type]


def tried(
    monkeypatch: pytest.MonkeyPatch,
    by_guess: dict[float, tuple[float, float] | None],
    *,
    stated: float | None,
    leap: float = 0.0,
    coarse: float | None = None,
    stands_out: bool = True,
    moved: float = 1e3,
) -> Any:
    """Return the guess and the offset that are chosen; by guess the value and the residual of the offset near it."""
    asked: list[float] = []

    def fine(curve: Any, fixes: Any, about: float) -> Offset | None:
        assert (curve, fixes is FIXES) == ("curve", True)
        asked.append(about)
        given = by_guess[about]
        return None if given is None else Offset(given[0], 0.001, made(given[1], np.zeros(9), 10.0, moved), True)

    monkeypatch.setattr(clock_offset, "pushed", lambda *readings: "curve")
    monkeypatch.setattr(clock_offset, "fine_offset", fine)
    monkeypatch.setattr(clock_offset, "_stands_out", lambda *a: stands_out)
    none: Any = (None, None, None)
    turns = None if coarse is None else Coarse(coarse, 0.9)
    found = _best(none, FIXES, stated, leap, turns)
    return (None if found is None else (found[0], found[1].value, found[1].inside)), asked


def test_which_offset_is_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stated one if it fits; one with leap seconds, or that of the turns, if it fits clearly better."""
    good = clock_offset.GOOD * FIXES.sigma
    plain = tried(monkeypatch, {5.0: (5.01, 0.9 * good)}, stated=5.0, leap=18.0, coarse=40.0)
    assert plain == ((5.0, 5.01, True), [5.0])
    others = {5.0: (5.01, 4.0 * good), -13.0: (-12.9, 3.9 * good), 23.0: (23.1, good), 40.0: (40.2, 0.2 * good)}
    assert tried(monkeypatch, others, stated=5.0, leap=18.0)[0] == (23.0, 23.1, True)
    assert tried(monkeypatch, others, stated=5.0, leap=18.0, coarse=40.0) == (
        (40.0, 40.2, True),
        [5.0, -13.0, 23.0, 40.0],
    )
    hidden = tried(monkeypatch, others, stated=5.0, leap=18.0, coarse=40.0, stands_out=False)
    assert hidden[0] == (40.0, 40.2, False)  # other offsets far away fit as well
    # the turns near another guess add nothing, and without a common origin they alone tell
    assert tried(monkeypatch, others, stated=5.0, leap=18.0, coarse=23.4)[1] == [5.0, -13.0, 23.0]
    assert tried(monkeypatch, {40.0: (40.2, good)}, stated=None, coarse=40.0) == ((40.0, 40.2, True), [40.0])
    assert tried(monkeypatch, {5.0: None, -13.0: None, 23.0: (23.1, 9.0)}, stated=5.0, leap=18.0)[0] == (
        23.0,
        23.1,
        True,
    )
    assert tried(monkeypatch, {5.0: None}, stated=5.0)[0] is None
    # hardly better is not better
    near = clock_offset._BETTER
    for ratio, value in ((0.99 / near, 23.1), (1.01 / near, 5.01)):
        two = {5.0: (5.01, 4.0 * good), -13.0: None, 23.0: (23.1, 4.0 * good * ratio)}
        chosen = tried(monkeypatch, two, stated=5.0, leap=18.0)[0]
        assert chosen[1] == value
    # with a wrong unit nothing explains the velocities: an offset must leave over at most half of their change
    for moved, value in ((1.99 * good, 5.01), (2.01 * good, 23.1)):
        assert tried(monkeypatch, others, stated=5.0, leap=18.0, moved=moved)[0][1] == value


def test_what_stands_out_of_offsets_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 3, 6 and 9 s to both sides; the median of those that overlap counts."""
    asked: list[float] = []
    residuals = {-9.0: np.inf, -6.0: 1.0, -3.0: 5.0, 3.0: 2.0, 6.0: 8.0, 9.0: 4.0}

    def matched(curve: Any, fixes: Any, at: float, *, window: float, bias: Any, rounds: int) -> Match:
        assert (window, bias is BIAS, rounds) == (10.0, True, 0)
        asked.append(round(at - 40.2, 6))
        return made(residuals[asked[-1]], np.zeros(2), window)

    monkeypatch.setattr(clock_offset, "match", matched)
    for own, out in ((3.99 / clock_offset._BETTER, True), (4.01 / clock_offset._BETTER, False)):
        found = Offset(40.2, 0.001, made(own, np.zeros(9), 10.0), True)
        assert _stands_out("curve", FIXES, found) is out  # type: ignore[arg-type]
    assert asked[:6] == list(residuals)
