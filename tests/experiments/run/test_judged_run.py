"""Requirements judged by one run, from errors whose every value is written by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.run import error_exhibits
from sinssim.experiments.run.error_exhibits import (
    _judged_error,
    _missed,
    _verdict,
    requirement_numbers,
    requirement_sentences,
    requirement_verdicts,
)
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.statistics.requirements import parse_requirement
from sinssim.strapdown.navigation_error import NavError

TIME = np.array([10.0, 20.0, 40.0])
NMI_H = 1852.0 / 3600.0


def errors(factor: float = 1.0) -> NavError:
    """Return errors whose nine components are 1, −2, 3 … at 10 s, 20 and 30 times as large at 20 and 40 s."""
    signs = np.where(np.arange(9) % 2, -1.0, 1.0)
    rows = factor * np.array([1.0, 20.0, 30.0])[:, None] * np.arange(1.0, 10.0) * signs
    return NavError(TIME, rows[:, :3], rows[:, 3:6], rows[:, 6:])


def test_the_error_that_a_quantity_limits() -> None:
    for size, name in enumerate(error_exhibits.COMPONENTS, start=1):
        np.testing.assert_array_equal(_judged_error(errors(), name), size * np.array([1.0, 20.0, 30.0]))
    for circle in ("cep", "r95", "rate"):
        np.testing.assert_allclose(_judged_error(errors(), circle), math.sqrt(5.0) * np.array([1.0, 20.0, 30.0]))


@pytest.mark.parametrize(
    ("text", "word", "value", "time", "since"),
    [
        ("r95 <= 7 m", "not met", 9.0, 6.0, 3.0),  # from 5 m at 2 s to 9 m at 6 s: 7 m at 4 s, less a second before
        ("r95(end) <= 7 m", "met", 4.0, 8.0, None),
        ("r95(4 s) <= 6.9 m", "not met", 7.0, 4.0, None),
        ("r95 <= 9 m", "met", 9.0, 6.0, None),
        ("rate(6 s) <= 1.5 m/s", "met", 1.5, 6.0, None),
        ("rate <= 0.4 m/s", "not met", 0.5, 8.0, None),
    ],
)
def test_a_requirement_at_its_instant(text: str, word: str, value: float, time: float, since: float | None) -> None:
    """Errors of 3, 5, 9 and 4 m at 0, 2, 6 and 8 s; that at 7 s is not known."""
    requirement = parse_requirement(text)
    at, size = np.array([0.0, 2.0, 6.0, 7.0, 8.0]), np.array([3.0, 5.0, 9.0, math.nan, 4.0])
    found = _verdict(requirement, at, size)
    assert (found.verdict, found.value, found.time, found.runs) == (word, pytest.approx(value), time, 0)
    assert (None if found.exceeded is None else found.exceeded.time) == (None if since is None else 4.0)
    with pytest.raises(InputError, match="9 s lies outside the run, which lasts 8 s"):
        _verdict(parse_requirement("r95(9 s) <= 1 m"), at, size)
    none = _verdict(requirement, at, np.full(5, math.nan)) if requirement.when != "at" else None
    assert none is None or (none.verdict, math.isnan(none.value), none.runs) == ("undecided", True, 1)


def test_each_requirement_has_its_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """The aided solution if there is one, otherwise the first; times are since the start, those by the path once a
    second; a miss is that of its waypoint."""
    truth = Truth.__new__(Truth)
    vars(truth).update(time=np.array([10.0, 40.5]))
    navigated = SimpleNamespace(
        errors={"first": errors(), "other": errors(9.0)}, solutions={"first": "its", "other": 0}
    )
    estimate = SimpleNamespace(solution="aided")
    aided = SimpleNamespace(error_at=lambda rows: errors(2.0), estimate=estimate)
    asked: list[Any] = []

    def values(scenario: Any, of: Any, solution: Any, time: Any) -> dict[str, Any]:
        asked.append((solution, time.tolist()))
        return {"tse_m": -0.5 * time, "nse_m": 0.25 * time}

    monkeypatch.setattr(error_exhibits, "path_values", values)
    monkeypatch.setattr(error_exhibits, "_missed", lambda requirement, scenario, of: f"missed {requirement.place}")
    texts = ("position_north(end) <= 1 m", "tse(end) <= 1 m", "nse(end) <= 1 m", "miss(N) <= 1 m")
    require = [parse_requirement(text) for text in texts]
    for filtered, factor, name in ((None, 1.0, "its"), (aided, 2.0, "aided")):
        reached: Any = SimpleNamespace(navigated=navigated, truth=truth, aided=filtered, scenario=None)
        north, tse, nse, missed = requirement_verdicts(reached, require)
        assert (north.value, north.time) == (30.0 * factor, 30.0)
        assert [(one.value, one.time) for one in (tse, nse)] == [(20.25, 30.5), (10.125, 30.5)]
        assert missed == "missed N"  # type: ignore[comparison-overlap]
        ((solution, time),) = asked
        assert (solution, time[:2], time[-2:]) == (name, [10.0, 11.0], [40.0, 40.5])
        asked.clear()


def test_the_miss_of_a_waypoint(monkeypatch: pytest.MonkeyPatch) -> None:
    missed = [SimpleNamespace(number=1, right=9.0, time=90.0), SimpleNamespace(number=2, right=-7.5, time=95.0)]
    monkeypatch.setattr(error_exhibits, "misses", lambda *given: missed)
    monkeypatch.setattr(error_exhibits, "pieces_of", lambda *given: None)
    monkeypatch.setattr(error_exhibits, "path_column", lambda flight, requirement: f"miss_{requirement.place}_m")
    scenario: Any = SimpleNamespace(flight=0)
    truth: Any = SimpleNamespace(time=np.array([50.0, 100.0]))
    found = _missed(parse_requirement("miss(2) <= 8 m"), scenario, truth)
    assert (found.verdict, found.value, found.time, found.exceeded) == ("met", 7.5, 45.0, None)
    none = _missed(parse_requirement("miss(3) <= 8 m"), scenario, truth)
    assert (none.verdict, none.runs) == ("undecided", 1)
    assert [said.text for said in requirement_sentences([requirement_numbers(none)])] == [
        "miss(3) <= 8 m: undecided. This run has no such value."
    ]
