"""The file of a trade study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies.trade_schema import MOST_CELLS, Axis, TradeStudy
from sinssim.statistics.requirements import Quantity
from tests.experiments.studies.trade_examples import BIAS, GRADE, study


def test_axes_and_their_words(tmp_path: Path) -> None:
    made = study(tmp_path)
    assert made.shape == (2, 3)
    assert made.size == 6
    grade, bias = made.axes
    assert (grade.heading, grade.numeric) == ("grade", False)
    assert (bias.heading, bias.numeric, bias.logarithmic) == ("gyro bias σ, deg/h", True, True)
    assert bias.name_of(2) == "0.1"


def test_linked_keys_change_together() -> None:
    axis = Axis(keys=(BIAS, "imu.gyro_arw_deg_sqrt_h"), values=((0.01, 0.002), (0.1, 0.02)), labels=("good", "bad"))
    assert axis.settings(1) == ((BIAS, 0.1), ("imu.gyro_arw_deg_sqrt_h", 0.02))
    assert not axis.numeric
    assert [axis.name_of(k) for k in (0, 1)] == ["good", "bad"]
    assert Axis(keys=axis.keys, values=axis.values).name_of(0) == "0.01 & 0.002"


def test_quantities_of_a_study(tmp_path: Path) -> None:
    made = study(tmp_path, times_s=(30.0,), require=("r95(40 s) <= 1 km", "heading <= 1 deg"), draw=("cep(50 s)",))
    texts = [q.text for q in made.quantities]
    assert len(texts) == len(set(texts))
    assert {"r95(end)", "heading(30 s)", "rate(30 s)", "r95(40 s)", "heading(run)", "cep(50 s)"} <= set(texts)
    assert made.instants == (30.0, 40.0, 50.0)
    assert made.drawn == (Quantity("cep", "at", 50.0),)
    assert study(tmp_path, require=("rate <= 1 kt",)).drawn == (Quantity("rate", "end"),)
    assert study(tmp_path).drawn == (Quantity("r95", "end"),)
    at_start = study(tmp_path, times_s=(0.0,))
    assert "rate(0 s)" not in [q.text for q in at_start.quantities]


def test_further_requirements(tmp_path: Path) -> None:
    made = study(tmp_path, require=("r95 <= 1 km",))
    assert made.with_requirements(()) is made
    assert made.with_requirements(["r95 <= 1 km", "cep <= 1 m"]).require == ("r95 <= 1 km", "cep <= 1 m")
    with pytest.raises(InputError, match="no unit follows the number 3"):
        made.with_requirements(["r95 <= 3"])


@pytest.mark.parametrize(
    ("axes", "keys", "said"),
    [
        ((), {}, "axes must have at least 1 entry"),
        (({"key": BIAS, "values": ()},), {}, "values must have at least 1 entry"),
        (({"key": BIAS, "values": (0.1, 0.2, 0.1)},), {}, "values.1 and values.3 are both 0.1"),
        (({"key": BIAS, "values": (1, 1.0)},), {}, "values.1 and values.2 are both 1"),
        (({"values": (1, 2)},), {}, "an axis needs key = …, or keys"),
        (({"key": BIAS, "keys": (GRADE, BIAS), "values": (1, 2)},), {}, "here key and keys are given"),
        (({"keys": (BIAS,), "values": (1, 2)},), {}, "keys has a single key"),
        (({"keys": (BIAS, BIAS), "values": ((1, 2),)},), {}, "twice"),
        (({"keys": (BIAS, GRADE), "values": (1, 2)},), {}, "values.1 = 1 must be an array of 2 values"),
        (({"key": BIAS, "values": (1, 2), "labels": ("a",)},), {}, "labels has 1 names for 2 values"),
        (({"key": BIAS, "values": (1, 2), "labels": ("a", "a")},), {}, "labels contains 'a' twice"),
        (({"key": "name", "values": ("a",)},), {}, "'name' cannot be varied"),
        (({"key": "output.rows", "values": (1,)},), {}, "'output.rows' cannot be varied: a cell writes no streams"),
        (({"key": "ensemble.runs", "values": (1,)},), {"cell": "ensemble"}, "'ensemble.runs' cannot be varied"),
        (({"key": "ensemble.epoch_s", "values": (1.0,)},), {}, "has no effect on a budget"),
        (({"key": BIAS, "values": (1,)}, {"key": BIAS, "values": (2,)}), {}, "is varied by axes.1, too"),
        (({"key": "imu", "values": (1,)}, {"key": BIAS, "values": (2,)}), {}, "is varied by axes.1, too"),
        (({"key": BIAS, "values": (1,)},), {"set": (f"{BIAS}=2",)}, "is fixed by set"),
        (({"key": BIAS, "values": (1,)},), {"runs": 5}, "runs = 5 has no effect on budgets"),
        (({"key": BIAS, "values": (1,)},), {"cell": "ensemble", "runs": 0}, "runs = 0 must be at least 1"),
        (({"key": BIAS, "values": (1,)},), {"cell": "ensemble", "inertial": True}, "belongs to budgets"),
        (({"key": BIAS, "values": (1,)},), {"times_s": (3.0, 3.0)}, "times_s contains 3.0 twice"),
        (({"key": BIAS, "values": (1,)},), {"draw": ("r96",)}, "Did you mean 'r95'"),
        (({"key": BIAS, "values": (1,)},), {"require": ("r95 < 3",)}, "no unit follows"),
        (
            ({"key": BIAS, "values": tuple(range(40))}, {"key": "seed", "values": tuple(range(30))}),
            {},
            f"40 × 30 = 1200 cells, which take 20 min at one second each, and at most {MOST_CELLS}",
        ),
        (
            ({"key": BIAS, "values": (1,), "label": "x"}, {"key": "seed", "values": (1,), "label": "x"}),
            {},
            "two axes have the name 'x'",
        ),
    ],
)  # fmt: skip
def test_mistakes(tmp_path: Path, axes: tuple[dict[str, Any], ...], keys: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        TradeStudy(**{"name": "small", "scenario": "parked", "axes": axes, **keys})
    assert said in str(error.value)
