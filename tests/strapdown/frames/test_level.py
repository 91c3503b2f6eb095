"""Where the north-pointing frame's solutions are refused, and as what."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import RunError
from sinssim.strapdown.frames.level import POLAR_LIMIT, check, moved_k


def solved(*latitude_deg: float) -> Any:
    """Return what the check reads of a solution with rows half a second apart."""
    still = np.zeros((len(latitude_deg) - 1, 3))
    time = 0.5 * np.arange(len(latitude_deg))
    return SimpleNamespace(time=time, latitude=np.radians(latitude_deg), dtheta=still, dvel=still, algorithm="euler")


@pytest.mark.parametrize("change", [0.01, -0.01, 0.1])
def test_sine_and_cosine_of_the_latitude_after_a_step(change: float) -> None:
    """Up to the first terms of the series that are left out, x⁵/120 and x⁶/720."""
    for angle in (-1.2, 0.3, 1.0):
        left_out = np.abs(change**5 / 120.0 * np.cos(angle)) + np.abs(change**6 / 720.0 * np.sin(angle))
        sine, cosine = moved_k(np.sin(angle), np.cos(angle), change)
        assert abs(sine - np.sin(angle + change)) < 1.001 * left_out + 2e-16
        left_out = np.abs(change**5 / 120.0 * np.sin(angle)) + np.abs(change**6 / 720.0 * np.cos(angle))
        assert abs(cosine - np.cos(angle + change)) < 1.001 * left_out + 2e-16


def test_latitudes_up_to_a_tenth_of_a_degree_from_the_poles() -> None:
    assert np.degrees(POLAR_LIMIT) == pytest.approx(89.9, rel=1e-15)
    check(solved(-89.9, 0.0, 89.9), "level")


@pytest.mark.parametrize("latitude", [89.92, -89.92, 90.0, -90.0])
def test_a_pole_is_named_with_the_first_latitude_beyond(latitude: float) -> None:
    with pytest.raises(RunError, match=rf"within 0\.1° .* latitude {latitude:.4f}° at t = 1\.00 s.*wander") as found:
        check(solved(80.0, -89.9, latitude, -89.95), "level")
    assert found.value.time == 1.0


@pytest.mark.parametrize("latitude", [90.01, -91.0, 200.0, 1e9, np.nan])
def test_a_latitude_beyond_the_pole_has_run_away(latitude: float) -> None:
    with pytest.raises(RunError, match=r"latitude .* t = 0\.50 s.*too long for euler") as found:
        check(solved(80.0, latitude, 80.0), "level")
    assert found.value.time == 0.5
