"""Colours and line widths by hand."""

from __future__ import annotations

import pytest

from sinssim.experiments.run.one_component_exhibits import EQUATION_COLORS, EQUATION_NAMES, ROW_NAMES, SIMULATION_COLOR
from sinssim.recording.style import COLORS, colors, css, stacked_widths, tint


def test_notation_and_paler_shade() -> None:
    """Two fifths of the colour and three of the grey 150, rounded down."""
    assert css((1, 160, 255)) == "#01a0ff"
    assert tint((86, 180, 233)) == (124, 162, 183)


def test_a_name_in_the_table_has_its_colour_and_others_the_next_free_one() -> None:
    """The others have their own list: green, vermilion, blue; the first that is not in the table is the first there."""
    green, vermilion = (0, 158, 115), (213, 94, 0)
    assert colors(["own", "euler", "mine"]) == [green, COLORS["euler"], vermilion]
    many = colors([f"own {k}" for k in range(17)])
    assert len(set(many)) == 17
    assert many[8] == (round(0.4 * 255), 158 + round(0.4 * 97), 115 + round(0.4 * 140))  # 40 % towards white
    assert many[16] == (0, 111, 80)  # 30 % towards black


@pytest.mark.parametrize(
    ("name", "of", "shade"),
    [
        ("odometer scale", "odometer", -0.25),
        ("gnss-position bias", "gnss-position", 0.15),
        ("gyro bias", "gyro bias", 0),
    ],
)
def test_errors_of_an_aiding_sensor_are_shades_of_its_colour(name: str, of: str, shade: float) -> None:
    own = COLORS[of]
    expected = tuple(round(c + shade * ((255 - c) if shade > 0 else c)) for c in own)
    assert colors([name]) == [expected]


def test_lines_that_coincide_are_seen_under_one_another() -> None:
    assert stacked_widths(1) == [1.5]
    assert stacked_widths(3) == pytest.approx([4.86, 2.7, 1.5])
    assert stacked_widths(4) == [1.5] * 4


def test_each_error_equation_has_a_name_and_a_colour_of_its_own() -> None:
    assert EQUATION_NAMES == {
        "equation_8_10": "equation (8.10)", "equation_8_11": "equation (8.11)", "equation_8_12": "first order (8.12)",
        "closed_form": "closed form at rest",
    }  # fmt: skip
    assert ROW_NAMES == {"simulation": "simulation", "perfect_sensors": "perfect sensors", **EQUATION_NAMES}
    assert list(EQUATION_COLORS) == list(EQUATION_NAMES)
    assert len({*EQUATION_COLORS.values(), SIMULATION_COLOR}) == 5
