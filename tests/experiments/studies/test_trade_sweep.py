"""Values of a sweep as people write them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies.trade_schema import MOST_CELLS
from sinssim.experiments.studies.trade_sweep import sweep


def values(written: str, key: str = "imu.rate_hz") -> tuple[Any, ...]:
    return sweep("parked", [f"{key}={written}"]).axes[0].values


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("50,100,200", (50, 100, 200)),
        ("laser-navigation, laser-standard", ("laser-navigation", "laser-standard")),
        ("0.5:2:0.25", (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)),
        (
            "0:0.3:0.1",
            (0.0, 0.1, 0.2, 0.3),
        ),  # sums of binary fractions would miss the stop, and give 0.30000000000000004
        ("1:2:0.3", (1.0, 1.3, 1.6, 1.9)),  # the stop is not on the grid
        ("10:4:-3", (10, 7, 4)),
        ("1:1:5", (1,)),
        ("1e-3:3e-3:1e-3", (0.001, 0.002, 0.003)),
        ("0.1:10:log5", (0.1, 0.3162, 1.0, 3.162, 10.0)),
        ("100:1:log3", (100.0, 10.0, 1.0)),
        ("1,4:8:2,20", (1, 4, 6, 8, 20)),
        ("[1, 2, 3],[4.0, 5.0, 6.0]", ((1, 2, 3), (4.0, 5.0, 6.0))),
        ("\"a, b\",'c]',true", ("a, b", "c]", True)),
        ('"1:2:3"', ("1:2:3",)),
    ],
)
def test_values(written: str, expected: tuple[Any, ...]) -> None:
    found = values(written)
    assert found == expected
    assert list(map(type, found)) == list(map(type, expected))


def test_equal_ratios() -> None:
    """Of N values, N − 1 ratios are equal to the rounding to four digits, and the ends are those that were written."""
    found = np.array(values("0.00123456:7.5:log9"))
    assert (found[0], found[-1], len(found)) == (0.00123456, 7.5, 9)
    np.testing.assert_allclose(np.diff(np.log(found)), np.log(7.5 / 0.00123456) / 8.0, atol=1e-3)


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("", "write KEY=VALUES"),
        ("5,,6", "a value is missing beside a comma"),
        ("5:6", "'5:6' is not a range of numbers"),
        ("a:b:c", "is not a range of numbers"),
        ("1:2:0", "must not be 0"),
        ("1:2:-1", "leads away from 2, so that there is no value"),
        ("0:1:log5", "two different positive ends"),
        ("1:10:log1", "at least log2"),
        ("0:1:1e-9", "1000000001 values, and a study has at most 1000 cells"),
        ("1:2:log999999", "999999 values"),
        ("5.0Hz", "the unit is part of the key's name"),
        ("[1, 2", "is not a TOML value"),
    ],
)
def test_mistakes(written: str, said: str) -> None:
    with pytest.raises(InputError) as found:
        values(written)
    assert said in str(found.value)


def test_settings_of_study_and_scenario() -> None:
    found = sweep("parked", ["imu.grade=tactical"], ["cell=ensemble", "runs=7", "imu.rate_hz=20", "seed=3"])
    assert (found.name, found.scenario, found.cell, found.runs) == ("parked-trade", "parked", "ensemble", 7)
    assert found.set == ("imu.rate_hz=20", "seed=3")


def test_as_many_values_as_a_study_has_cells() -> None:
    written = ",".join(map(str, range(1, MOST_CELLS + 1)))
    assert [*values(written, "seed")] == list(range(1, MOST_CELLS + 1))
