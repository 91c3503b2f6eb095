"""Headings in a range, and angles that count turns."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import rotation
from sinssim.errors import InputError


@pytest.mark.parametrize(
    ("range_", "least", "expected"),
    [
        ("0..360", 0.0, [0.0, 350.0, 10.0, 180.0, 270.0, 0.0]),
        ("-180..180", -180.0, [0.0, -10.0, 10.0, -180.0, -90.0, 0.0]),
        ("-90..270", -90.0, [0.0, -10.0, 10.0, 180.0, -90.0, 0.0]),
    ],
)
def test_headings_in_a_range(range_: str, least: float, expected: list[float]) -> None:
    given = np.radians([0.0, -10.0, 730.0, 180.0, 270.0, 360.0])
    np.testing.assert_allclose(np.degrees(rotation.heading_in(range_, given)), expected, atol=1e-12)
    tiny = float(np.degrees(rotation.heading_in(range_, np.radians(least) - 1e-18)))
    assert least <= tiny < least + 360.0


def test_an_unknown_range_is_refused() -> None:
    with pytest.raises(InputError, match=r"unknown range of the heading '0\.\.180'"):
        rotation.heading_in("0..180", 1.0)


def test_angles_count_turns() -> None:
    """Three turns to the left while the vehicle rolls twice to the right, pitched."""
    turned = np.linspace(0.0, 1.0, 301)
    roll, pitch, heading = 4.0 * np.pi * turned, 0.3 * np.sin(9.0 * turned), 1.0 - 6.0 * np.pi * turned
    found = rotation.continuous_angles(rotation.quaternion_from_euler(roll, pitch, heading))
    for one, expected in zip(found, (roll, pitch, heading), strict=True):
        np.testing.assert_allclose(one, expected, atol=1e-12)


def test_headings_as_a_scenario_wants_to_see_them() -> None:
    heading = np.radians([350.0, 10.0, 100.0, 200.0, 300.0, 20.0])
    choices = (None, *rotation.HEADING_RANGES, "continuous")
    shown = {choice: np.degrees(rotation.shown_heading(choice, heading)) for choice in choices}
    assert shown[None] == pytest.approx([350.0, 10.0, 100.0, 200.0, 300.0, 20.0])
    assert shown["0..360"] == pytest.approx(shown[None])
    assert shown["-180..180"] == pytest.approx([-10.0, 10.0, 100.0, -160.0, -60.0, 20.0])
    assert shown["-90..270"] == pytest.approx([-10.0, 10.0, 100.0, 200.0, -60.0, 20.0])
    assert shown["continuous"] == pytest.approx([350.0, 370.0, 460.0, 560.0, 660.0, 740.0])
