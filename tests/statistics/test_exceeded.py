"""Since when a requirement is exceeded: closed forms of the time, the last fix, the words."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.experiments.ensembles.ensemble_verdicts import verdict_text
from sinssim.statistics.requirements import Exceeded, first_exceeded, parse_requirement
from tests.statistics.verdicts import verdict

_TIME = np.linspace(0.0, 2000.0, 201)
_RUN = parse_requirement("r95(run) <= 50 m")


def test_the_time_of_a_growing_error() -> None:
    """r = (t − 1200 s)² / 283.22 m reaches 50 m after √(50 · 283.22) = 119 s; the line over 10 s errs by 0.1 s."""
    values = np.maximum(_TIME - 1200.0, 0.0) ** 2 / 283.22
    found = first_exceeded(_RUN, _TIME, values, ((1200.0, 1500.0), (1700.0, 1900.0)))
    assert found is not None
    assert found.time == pytest.approx(1319.0, abs=0.15)
    assert found.fixes_end == 1200.0
    assert found.text == "exceeded from 1319 s, 119 s after the fixes end"
    assert found.after_fixes_end == found.time - 1200.0


def test_outages_that_overlap_or_do_not_hold_the_time() -> None:
    values = np.where(_TIME >= 1000.0, 100.0, 0.0)  # the limit lies in the middle of the step: 995 s
    spans = ((700.0, 900.0), (850.0, 990.0), (980.0, 1010.0))
    assert first_exceeded(_RUN, _TIME, values, spans) == Exceeded(995.0, 700.0)
    assert first_exceeded(_RUN, _TIME, values, spans[:2]) == Exceeded(995.0)
    assert Exceeded(995.0).text == "exceeded from 995 s"


def test_from_the_start_and_never() -> None:
    found = first_exceeded(_RUN, _TIME, np.full(201, 60.0))
    assert found == Exceeded(0.0)
    assert found.text == "exceeded from the start"
    assert first_exceeded(_RUN, _TIME, np.full(201, 50.0)) is None
    assert first_exceeded(parse_requirement("r95(end) <= 50 m"), _TIME[-1:], np.array([60.0])) is None


def test_unknown_and_infinite_values() -> None:
    """Between epochs with failed runs, or before the filter begins, there is no line: the epoch itself counts."""
    values = np.full(201, 10.0)
    values[:50], values[120:] = np.nan, np.inf
    assert first_exceeded(_RUN, _TIME, values) == Exceeded(1200.0)


def test_the_verdict_of_runs_has_it() -> None:
    """R95 of radii that all grow by 0.1 m/s: 50 m after 500 s."""
    radii = np.full((200, 1), 0.1) * _TIME
    found = verdict(_RUN, _TIME, radii)
    assert (found.verdict, found.value, found.time) == ("not met", 200.0, 2000.0)
    assert found.exceeded is not None
    assert found.exceeded.time == pytest.approx(500.0, abs=1e-9)
    assert "the limit is 50 m. It is exceeded from 500 s." in verdict_text(found)
    assert verdict(parse_requirement("r95(run) <= 300 m"), _TIME, radii).exceeded is None
