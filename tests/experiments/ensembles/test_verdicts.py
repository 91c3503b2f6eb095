"""Verdicts in words: value, limit, unit, instant, runs needed, probability of error."""

from __future__ import annotations

from math import inf, nan
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.experiments.ensembles.ensemble_verdicts import looks_text, requirement_lines, verdict_text
from sinssim.statistics.requirements import Exceeded, Verdict, parse_requirement


def judged(text: str, verdict: Any, value: float, time: float, more: int | None, exceeded: Any = None) -> Verdict:
    return Verdict(parse_requirement(text), verdict, value, time, 240, more, exceeded)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (judged("r95(120 s) <= 2 km", "met", 1234.5, 120.0, 0),
         "In 240 runs it is 1.23 km at 120 s; the limit is 2 km."),
        (judged("heading(end) <= 4 arcmin", "undecided", 3.5 / 60.0 * 0.017453292519943295, 77.0, None),
         "In 240 runs it is 3.50 arcmin at the end; the limit is 4 arcmin. The value lies at the limit: the necessary "
         "number of runs cannot be predicted."),
        (judged("cep(run) <= 30 m", "undecided", 28.7, 45.5, 1264),
         "In 240 runs the largest value is 28.7 m at 45.5 s; the limit is 30 m. About 1300 more runs are needed for a "
         "decision if they are similar."),
        (judged("cep(run) <= 30 m", "not met", 47.0, 45.5, 0, Exceeded(12.0)),
         "In 240 runs the largest value is 47.0 m at 45.5 s; the limit is 30 m. It is exceeded from 12 s."),
        (judged("r95(120 s) <= 2 km", "undecided", inf, 120.0, 87),
         "In 240 runs it is ∞ (failed runs) at 120 s; the limit is 2 km. About 87 more runs are needed for a decision "
         "if they are similar."),
        (judged("r95(120 s) <= 2 km", "undecided", nan, nan, None), "No run has a solution at 120 s."),
    ],
)  # fmt: skip
def test_a_verdict_in_words(found: Verdict, words: str) -> None:
    assert verdict_text(found) == words


def result(looks: tuple[int, ...], *verdicts: Verdict) -> Any:
    return SimpleNamespace(looks=looks, verdicts=verdicts)


def test_the_looks_share_five_per_cent() -> None:
    """Five looks at most, each of 5 %/5."""
    met = judged("cep(end) <= 30 m", "met", 20.0, 60.0, 0)
    still = judged("cep(end) <= 30 m", "undecided", 29.0, 60.0, 70)
    common = "Each of at most 5 tests errs with at most 1 %, all together with at most 5 %."
    assert looks_text(result((), still)) == ""
    assert looks_text(result((50,), met)) == f"Tested after 50 runs. {common}"
    assert looks_text(result((50, 100, 200), met)) == f"Tested after 50, 100 and 200 runs. {common}"
    assert looks_text(result((50, 100), met, still)) == (
        f"Tested after 50 and 100 runs. {common} 100 runs are the most for this --runs; a further series of tests has "
        "its own probability of error of 5 %."
    )


def test_lines_of_all_verdicts() -> None:
    both = (
        judged("r95(120 s) <= 2 km", "met", 1234.5, 120.0, 0),
        judged("heading(end) <= 4 arcmin", "not met", 5.25 / 60.0 * 0.017453292519943295, 77.0, 0),
        judged("cep(end) <= 30 m", "undecided", 29.0, 60.0, 45),
    )
    values = ["it is 1.23 km at 120 s; the limit is 2 km.", "it is 5.25 arcmin at the end; the limit is 4 arcmin."]
    lines = requirement_lines(result((60, 120), *both))
    assert lines[:2] == [
        f"r95(120 s) <= 2 km: met, with 95 % confidence. In 240 runs {values[0]}",
        f"heading(end) <= 4 arcmin: NOT MET, with 95 % confidence. In 240 runs {values[1]}",
    ]
    assert lines[2].startswith("cep(end) <= 30 m: undecided. In 240 runs it is 29.0 m")
    assert lines[3:] == [looks_text(result((60, 120), *both))]
