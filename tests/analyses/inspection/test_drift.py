"""The drift of a unit's clock from matches whose residuals are known functions of offset and drift."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from sinssim.analyses.inspection import clock_offset
from sinssim.analyses.inspection.clock_offset import Offset, clock_drift
from sinssim.analyses.inspection.velocity_match import Match
from sinssim.data import Array

TIME = np.linspace(100.0, 700.0, 31)
RATE, FORCE, BIAS = np.ones((31, 3)), np.full((31, 3), 2.0), np.arange(1.0, 7.0)
PLACES = np.linspace(-0.5, 0.5, 12)
"""Middles of the windows from the middle of the log, as parts of its length."""
MISSED = np.array([3.0, -1.0, -4.0, 2.0, 5.0, -6.0, 1.0, -3.0, 4.0, 1.0, -2.0, 0.5]) * 1e-3
"""What else shifts each window, s."""
STEEP, FLOOR = 4.0, 0.01


def made(each: Array, window: float = 8.0, bias: Array = BIAS) -> Match:
    nothing = np.zeros(len(each))
    return Match(float(np.sqrt(np.mean(each**2))), each, nothing, np.zeros((len(each), 4)), nothing, bias, window)


def found(
    monkeypatch: pytest.MonkeyPatch,
    offset: float,
    change: float,
    missed: Array = MISSED,
    good: float = 0.3,
    first: float | None = None,
    windows: int = 12,
) -> Any:
    """Return the drift of clocks that are apart by an offset in the middle of the log, and by `change` more at its end
    than at its begin: the square of each residual is FLOOR + STEEP e², e the time by which the window is off."""
    places = PLACES[:windows]

    def push(time: Array, rate: Array, force: Array, rate_hz: float) -> Array:
        assert rate is RATE
        assert force is FORCE
        assert rate_hz == 25.0
        assert 0.5 * (time[0] + time[-1]) == pytest.approx(400.0, rel=1e-14)
        return time

    def matched(curve: Array, fixes: Any, at: float, window: float, bias: Array, rounds: int) -> Match:
        assert (fixes, window, rounds) == ("fixes", 8.0, 1)
        assert bias is BIAS
        tried = 600.0 * (600.0 / (curve[-1] - curve[0]) - 1.0)
        off = at - offset + places * (tried - change) - missed[:windows]
        return made(np.sqrt(FLOOR + STEEP * off**2))

    monkeypatch.setattr(clock_offset, "pushed", push)
    monkeypatch.setattr(clock_offset, "match", matched)
    begin = made(np.array([matched(TIME, "fixes", offset, 8.0, BIAS, 1).residual if first is None else first]))
    return clock_drift((TIME, RATE, FORCE), "fixes", Offset(offset, 0.01, begin, True), good)  # type: ignore[arg-type]


@pytest.mark.parametrize("change", [0.25, -0.13])
def test_drift_and_its_sigma_are_those_of_a_straight_line(change: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least residuals are the straight line through the windows. Its slope's 1σ from the scatter: √(Σ x²e² 12/10)
    over Σ x², with the places x."""
    one = found(monkeypatch, 0.4, change)
    slope, level = np.polyfit(PLACES, MISSED, 1)
    left = MISSED - level - slope * PLACES
    sigma = np.sqrt(np.sum((PLACES * left) ** 2) * 12.0 / 10.0) / np.sum(PLACES**2)
    assert one.value == pytest.approx((change + slope) / 600.0, rel=1e-9)
    assert one.sigma == pytest.approx(sigma / 600.0, rel=1e-6)


def test_far_from_a_good_match_drifts_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clocks 1.3 s apart at the ends, a first residual of up to ten trusted ones, and steps of at most 0.6 s."""
    one = found(monkeypatch, -0.2, 1.3)
    slope = np.polyfit(PLACES, MISSED, 1)[0]
    assert one.value == pytest.approx((1.3 + slope) / 600.0, rel=1e-9)


def test_what_is_no_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    assert found(monkeypatch, 0.4, 0.25, first=2.99) is not None
    assert found(monkeypatch, 0.4, 0.25, first=3.01) is None  # ten trusted ones: something else is wrong
    assert found(monkeypatch, 0.4, 0.018, 0.0 * MISSED) is None  # too little to matter
    assert found(monkeypatch, 0.4, 0.022, 0.0 * MISSED) is not None
    assert found(monkeypatch, 0.4, 0.25, good=0.09) is None  # no match is that good
    assert found(monkeypatch, 0.4, 0.25, good=0.12) is not None
    assert found(monkeypatch, 0.4, 0.25, windows=7) is None
    # a slope that could be chance: t of 10 degrees of freedom, both sides together 1e-4
    slope, level = np.polyfit(PLACES, MISSED, 1)
    left = MISSED - level - slope * PLACES
    least = student.ppf(1.0 - 0.5e-4, 10) * np.sqrt(np.sum((PLACES * left) ** 2) * 12.0 / 10.0) / np.sum(PLACES**2)
    assert 0.02 < 8.0 * least < 1.0
    assert found(monkeypatch, 0.4, 0.99 * 8.0 * least, 8.0 * left, good=1.0) is None
    assert found(monkeypatch, 0.4, 1.01 * 8.0 * least, 8.0 * left, good=1.0) is not None


def test_a_step_where_the_residual_is_no_valley() -> None:
    """Ten steps of the differences downhill where it bends the other way, and none where nothing overlaps."""

    def hill(at: Array) -> Match:
        return made(np.array([np.sqrt(9.0 - (at[0] - 0.1) ** 2 - 3.0 * (at[1] + 0.2) ** 2)]))

    np.testing.assert_allclose(clock_offset._step(hill, np.zeros(2)), [-0.3, 0.6], rtol=1e-12)
    np.testing.assert_allclose(clock_offset._step(hill, np.array([0.3, -0.5])), [0.3, -0.6], rtol=1e-12)

    def nothing(at: Array) -> Match:
        return made(np.array([np.inf]))

    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(clock_offset._step(nothing, np.zeros(2)), 0.0)
