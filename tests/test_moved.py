"""Former names of modules still import, and say what to import instead."""

from __future__ import annotations

import importlib
import sys

import pytest

from sinssim.moved import MOVED


@pytest.mark.parametrize(("former", "now"), MOVED.items())
def test_every_new_name_exists(former: str, now: str) -> None:
    for name in now.split():
        importlib.import_module(f"sinssim.{name}")
    with pytest.raises(KeyError):
        sys.modules[f"sinssim.{former}"]


def test_a_former_name_warns_and_serves() -> None:
    from sinssim.truth.motions.parked import Parked

    with pytest.warns(DeprecationWarning, match=r"sinssim\.truth\.parked is now sinssim\.truth\.motions\.parked"):
        former = importlib.import_module("sinssim.truth.parked")
    assert former.Parked is Parked
    with pytest.raises(AttributeError, match=r"has no 'Flying'"):
        _ = former.Flying
    del sys.modules["sinssim.truth.parked"]


def test_a_divided_module_serves_names_of_every_part() -> None:
    with pytest.warns(DeprecationWarning, match=r"sinssim\.algorithms and sinssim\.frames"):
        former = importlib.import_module("sinssim.names")
    assert "level" in former.FRAMES
    assert "quaternion" in former.ALGORITHMS
    del sys.modules["sinssim.names"]


def test_a_former_name_in_a_module_warns_and_serves() -> None:
    from sinssim import simulation

    with pytest.warns(DeprecationWarning, match=r"initial_state is now initial_state_with_errors"):
        former = simulation.initial_state
    assert former is simulation.initial_state_with_errors
    with pytest.raises(AttributeError, match=r"no attribute 'initial_stat'"):
        _ = importlib.import_module("sinssim.simulation.initial_error").initial_stat
