"""Specific force at points on lever arms: what a steady spin adds, and places that are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import SpinRock
from sinssim.truth.motions.mounted_block import velocity_increments
from sinssim.truth.motions.parked_and_great_circle import Parked

PLACE, LEVEL = (0.8, 0.5, 150.0), (1.0, 0.0, 0.0, 0.0)


def test_points_on_a_spinning_body_are_pulled_to_its_axis() -> None:
    """0.5 rad/s about the vertical: −ω² of the arms across, in steps of a quarter of a second; nothing along it.

    The Earth's rate adds 2 ω Ω of them, 2e-4 of a metre's ω².
    """
    spinning = OnEarth(SpinRock([0.0, 0.0, 1.0], 0.5, 0.0, 1.0), *PLACE, LEVEL, 2.0)
    arms = np.array([[0.0, 0.0, 0.0], [2.0, -3.0, 1.5]])
    time, dvel = velocity_increments(spinning, arms, 4.0)
    assert time.tolist() == [0.25 * k for k in range(9)]
    assert dvel.shape == (8, 2, 3)
    np.testing.assert_allclose(dvel[:, 0], spinning.increments(4.0).dvel, rtol=0, atol=1e-14)
    apart = dvel[:, 1] - dvel[:, 0]
    np.testing.assert_allclose(apart, np.tile(0.25 * -0.25 * np.array([2.0, -3.0, 0.0]), (8, 1)), atol=2e-4)


@pytest.mark.parametrize("places", [[1.0, 2.0, 3.0], np.zeros((2, 4)), np.zeros((0, 3)), [[0.0, np.nan, 0.0]]])
def test_places_that_cannot_be(places: Any) -> None:
    shape = np.asarray(places).shape
    with pytest.raises(InputError) as error:
        velocity_increments(Parked(*PLACE, LEVEL, 2.0), places, 4.0)
    assert str(error.value) == (f"accelerometers need (K, 3) finite positions, K ≥ 1; got an array of shape {shape}.")
