"""Requirements as text: what is read, and what is refused by name."""

from __future__ import annotations

import math

import pytest

from sinssim.errors import InputError
from sinssim.statistics.requirements import parse_requirement


@pytest.mark.parametrize(
    ("text", "quantity", "when", "time", "limit"),
    [
        ("r95(3600 s) <= 1852 m", "r95", "at", 3600.0, 1852.0),
        ("R95( 1 h )<=1 nmi", "r95", "at", 3600.0, 1852.0),
        ("cep(end) < 0.5 NM", "cep", "end", math.nan, 926.0),
        ("cep <= 2 km", "cep", "run", math.nan, 2000.0),
        ("rate <= 0.8 nmi/h", "rate", "end", math.nan, 0.8 * 1852.0 / 3600.0),
        ("rate(90 min) ≤ 1 kt", "rate", "at", 5400.0, 1852.0 / 3600.0),
        ("heading(end) <= 3 arcmin", "heading", "end", math.nan, math.radians(0.05)),
        ("velocity_north(run) <= 1.5e-1 m/s", "velocity_north", "run", math.nan, 0.15),
        ("position_down(0 s) <= 10 ft", "position_down", "at", 0.0, 3.048),
        ("tilt_east <= .1mrad", "tilt_east", "run", math.nan, 1e-4),
    ],
)
def test_requirements_are_read(text: str, quantity: str, when: str, time: float, limit: float) -> None:
    found = parse_requirement(text)
    assert (found.quantity, found.when) == (quantity, when)
    assert found.time == pytest.approx(time, nan_ok=True)
    assert found.limit == pytest.approx(limit, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "cannot be read"),
        ("r95", "cannot be read"),
        ("r96(end) <= 1 m", "r96"),
        ("r95(end) >= 1 m", ">= is not a limit"),
        ("r95(end) <= many m", "'many' is not a number"),
        ("r95(end) <= -3 m", "positive"),
        ("r95(end) <= 3", "no unit follows"),
        ("r95(end) <= 3 deg", "'deg' is a unit of angle; r95 is a length. Known units: m, km"),
        ("heading(end) <= 3 m", "'m' is a unit of length; heading is an angle"),
        ("rate(end) <= 3 furlong", "'furlong' is not a known unit"),
        ("r95(3600) <= 1 m", "unit of time"),
        ("r95(soon) <= 1 m", "not a time, end or run"),
        ("r95(-1 s) <= 1 m", "from the start on"),
        ("rate(0 s) <= 1 nmi/h", "positive time"),
        ("rate(run) <= 1 nmi/h", "not limited over the whole run"),
        ("r95(1 day) <= 1 m", "unit of time"),
    ],
)
def test_others_are_refused_by_name(text: str, says: str) -> None:
    with pytest.raises(InputError) as error:
        parse_requirement(text)
    assert says in str(error.value)


def test_a_time_beyond_the_run_is_refused() -> None:
    with pytest.raises(InputError, match="7200 s lies outside the run, which lasts 5064 s"):
        parse_requirement("r95(2 h) <= 1 nmi").check_within(5064.0)


def test_a_rate_has_a_time_soon_after_the_start() -> None:
    assert parse_requirement("rate(0.5 s) <= 1 nmi/h").time == 0.5


def test_its_meaning_is_a_sentence() -> None:
    meaning = parse_requirement("heading(600 s) <= 3 arcmin").meaning
    assert meaning == "root mean square over all runs of the heading error, at 600 s, at most 3 arcmin"
