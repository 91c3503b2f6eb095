"""Values between the points of an envelope, worked out by hand from a table of three heights and three speeds."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.truth.flight.aircraft import Envelope, best_ceiling, ceiling, climb_rate, descent_rate, speed_range

ENVELOPE = Envelope(
    height_m=(200.0, 2000.0, 5000.0),
    min_kt=(60.0, 70.0, 0.0),
    max_kt=(140.0, 128.0, 0.0),
    airspeed_kt=(100.0, 150.0, 250.0),
    climb_mps=((10.0, 8.0, 3.0), (7.0, 6.0, 1.5), (-1.0, 1.0, -4.0)),
    descent_mps=((4.0, 5.0, 9.0), (6.0, 8.0, 13.0), (11.0, 12.0, 21.0)),
)


@pytest.mark.parametrize(
    ("height", "speed", "climb", "descent"),
    [
        # 3/10 of the way up and 4/10 of the way between 150 and 250 kt: rows 4.2 and -1, 10 and 15.6
        (2900.0, 190.0, 0.7 * 4.2 - 0.3 * 1.0, 0.7 * 10.0 + 0.3 * 15.6),
        # a quarter of the way up and a fifth between 100 and 150 kt: rows 9.6 and 6.8, 4.2 and 6.4
        (650.0, 110.0, 0.75 * 9.6 + 0.25 * 6.8, 0.75 * 4.2 + 0.25 * 6.4),
        (2000.0, 150.0, 6.0, 8.0),
        (-50.0, 300.0, 3.0, 9.0),  # beyond the table: its edge
        (6000.0, 90.0, -1.0, 11.0),
    ],
)
def test_rates_are_linear_in_height_and_airspeed(height: float, speed: float, climb: float, descent: float) -> None:
    assert climb_rate(ENVELOPE, height, speed) == pytest.approx(climb, rel=1e-14)
    assert descent_rate(ENVELOPE, height, speed) == pytest.approx(descent, rel=1e-14)


@pytest.mark.parametrize(
    ("height", "slow", "fast"),
    [
        (650.0, 62.5, 137.0), (200.0, 60.0, 140.0), (2000.0, 70.0, 128.0),
        (3400.0, 70.0, 128.0),  # above 2000 m there is no level flight at the next height: the nearer one counts
        (3600.0, 0.0, 0.0),
        (9000.0, 0.0, 0.0),
    ],
)  # fmt: skip
def test_speeds_of_level_flight(height: float, slow: float, fast: float) -> None:
    assert speed_range(ENVELOPE, height) == pytest.approx((slow, fast), rel=1e-14)


def test_no_level_flight_at_the_lower_height() -> None:
    upside_down = ENVELOPE.model_copy(update={"min_kt": (0.0, 70.0, 80.0), "max_kt": (0.0, 128.0, 110.0)})
    assert speed_range(upside_down, 650.0) == (0.0, 0.0)
    assert speed_range(upside_down, 1200.0) == (70.0, 128.0)
    assert speed_range(upside_down, 2300.0) == pytest.approx((71.0, 126.2))


def test_ceilings_are_on_the_safe_side_of_the_rate_by_a_two_hundredth() -> None:
    """Steps of 24 m from 200 m: 0.5 m/s is left at 250 kt up to 2545 m, 0 m/s up to 2818 m; at 100 kt up to 4437 m."""
    assert ceiling(ENVELOPE, 250.0) == pytest.approx(200.0 + 97 * 24.0)
    assert ceiling(ENVELOPE, 250.0, 0.0) == pytest.approx(200.0 + 109 * 24.0)
    assert ceiling(ENVELOPE, 100.0) == pytest.approx(200.0 + 176 * 24.0)
    assert ceiling(ENVELOPE, 150.0) == 5000.0  # 1 m/s is left at the highest height
    assert ceiling(ENVELOPE, 150.0, 1.0) == 5000.0
    assert ceiling(ENVELOPE, 150.0, 20.0) == 200.0
    assert best_ceiling(ENVELOPE) == (5000.0, 150.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"min_kt": (60.0, 70.0)}, "min_kt needs 3 entries, one for each height_m"),
        ({"descent_mps": ((4.0, 5.0, 9.0),) * 4}, "descent_mps needs 3 entries, one for each height_m"),
        ({"airspeed_kt": (100.0, 150.0)}, "each row of climb_mps needs 2 values, one for each airspeed_kt"),
        ({"descent_mps": ((4.0, 5.0),) * 3}, "each row of descent_mps needs 3 values, one for each airspeed_kt"),
        ({"height_m": (200.0, 5000.0, 2000.0)}, "the values of height_m must increase"),
        ({"airspeed_kt": (100.0, 100.0, 250.0)}, "the values of airspeed_kt must increase"),
    ],
)
def test_tables_that_do_not_fit(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Envelope(**{**ENVELOPE.model_dump(), **change})
