"""Quantities as people write them."""

from __future__ import annotations

import pytest

from sinssim.errors import InputError
from sinssim.statistics.requirements import Quantity, parse_quantity, parse_requirement, quantity_of


@pytest.mark.parametrize(
    ("text", "found", "column"),
    [
        ("r95(3600 s)", Quantity("r95", "at", 3600.0), "r95_3600s_m"),
        ("R95(1 h)", Quantity("r95", "at", 3600.0), "r95_3600s_m"),
        ("cep", Quantity("cep", "end"), "cep_end_m"),
        ("heading(run)", Quantity("heading", "run"), "heading_run_rad"),
        (" rate ( end ) ", Quantity("rate", "end"), "rate_end_nmi_h"),
        ("velocity_east(1.5 min)", Quantity("velocity_east", "at", 90.0), "velocity_east_90s_mps"),
    ],
)
def test_reading(text: str, found: Quantity, column: str) -> None:
    assert parse_quantity(text) == found
    assert found.column == column
    assert parse_quantity(found.text) == found


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("r96(end)", "Did you mean 'r95'"),
        ("r95(3600)", "needs a unit of time"),
        ("r95(end) <= 3 m", "cannot be read"),
        ("rate(run)", "not limited over the whole run"),
        ("", "cannot be read"),
    ],
)
def test_mistakes(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said.replace("(", r"\(")):
        parse_quantity(text)


def test_the_quantity_of_a_requirement() -> None:
    assert quantity_of(parse_requirement("heading(end) <= 3 arcmin")) == Quantity("heading", "end")
    assert quantity_of(parse_requirement("r95(10 min) <= 3 m")) == Quantity("r95", "at", 600.0)
