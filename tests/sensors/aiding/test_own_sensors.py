"""Readings of a user's own sensor are checked before they are used."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from sinssim.sensors.aiding_registry import _check


def test_readings_that_are_not_finite_are_named_with_their_time() -> None:
    readings = SimpleNamespace(time=[3.0, 4.0, 5.0], value=[[1.0, 2.0], [1.0, float("nan")], [float("inf"), 2.0]])
    with pytest.raises(ValueError, match="2 of 3 measurements are not finite, the first at t = 4 s"):
        _check(readings)


def test_readings_need_a_row_for_each_instant() -> None:
    with pytest.raises(ValueError, match=r"the shape \(2, 1\); \(3, components\) is needed"):
        _check(SimpleNamespace(time=[3.0, 4.0, 5.0], value=[[1.0], [2.0]]))
