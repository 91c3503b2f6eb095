"""The files of a covariance budget, from covariances with circular errors: their radii are those of ncx²."""

from __future__ import annotations

from math import inf, log, nan, pi, sqrt
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.stats import ncx2

from sinssim.analyses.error_budget.budget_exhibits import BudgetMedia, _write_parquet, to_json
from sinssim.analyses.error_budget.budget_result import Allowance, Answer, BudgetResult
from sinssim.analyses.error_budget.error_sources import Source
from sinssim.statistics.requirements import Exceeded, parse_requirement

TIME = np.array([10.0, 20.0, 40.0, 72.0])
SOURCES = (
    Source("start", "start, in words", "initial state", "random", nan, "m"),
    Source("gyro_bias", "bias of the gyros", "gyros", "random", 0.3, "deg/h"),
    Source("accel_scale", "scale of the accelerometers", "accelerometers", "given", -40.0, "ppm"),
)
NAMES = ("position_north_m", "position_east_m", "position_down_m", "velocity_north_mps", "velocity_east_mps",
         "velocity_down_mps", "tilt_north_rad", "tilt_east_rad", "heading_rad")  # fmt: skip
START = np.outer([1.0, 2.0, 3.0, 4.0], [3.0, 3.0, 5.0, 0.6, 0.7, 0.8, 0.01, 0.02, 0.03])
GYRO = np.outer([1.0, 3.0, 5.0, 7.0], [4.0, 4.0, 9.0, 1.1, 1.2, 1.3, 0.04, 0.05, 0.06])
MEAN = np.outer([1.0, 4.0, 6.0, 9.0], [1.5, -2.0, 2.5, 0.3, -0.35, 0.45, -0.07, 0.08, 0.09])
TURNED = MEAN * [1, 1, 1, 1, 1, 1, 1, 1, -1]
"""The heading error is −φ_down."""


def result() -> BudgetResult:
    covariance = {name: np.stack([np.diag(row**2) for row in s]) for name, s in (("start", START), ("gyro_bias", GYRO))}
    scenario = SimpleNamespace(name="x", description="two words")
    return BudgetResult(scenario, "inertial", TIME, SOURCES, covariance, {"accel_scale": MEAN}, media=BudgetMedia())


def radius(share: float, sigma: float, mean: float) -> float:
    """Return the radius of a circle about zero with a share of the errors, equal in both axes with σ about a mean."""
    if sigma == 0.0:
        return mean
    return sigma * sqrt(ncx2.ppf(share, 2, (mean / sigma) ** 2)) if mean else sigma * sqrt(-2.0 * log(1.0 - share))


SIGMA = np.hypot(START, GYRO)
SIZE = np.hypot(MEAN[:, 0], MEAN[:, 1])
CEP = [radius(0.5, s, m) for s, m in zip(SIGMA[:, 0], SIZE, strict=True)]
R95 = [radius(0.95, s, m) for s, m in zip(SIGMA[:, 0], SIZE, strict=True)]


def by_name(values: np.ndarray) -> object:
    return pytest.approx(dict(zip(NAMES, values, strict=True)), rel=1e-12)


def test_the_numbers_of_a_budget() -> None:
    """Six even times from 10 to 72 s are nearest to 20, 40 and 72 s; 10 s is asked for."""
    found = to_json(result(), times=(10.0,))
    assert (found["name"], found["description"], found["solution"]) == ("x", "two words", "inertial")
    assert found["duration_s"] == 72.0
    assert (found["cep_m"], found["r95_m"]) == pytest.approx((CEP[3], R95[3]), rel=1e-6)
    assert found["r95_over_time_nmi_per_h"] == pytest.approx(R95[3] / 1852.0 / 0.02, rel=1e-6)
    assert [row["time_s"] for row in found["table"]] == [10.0, 20.0, 40.0, 72.0]
    assert [row["time_s"] for row in to_json(result())["table"]] == [20.0, 40.0, 72.0]
    for k, row in enumerate(found["table"]):
        assert (row["cep_m"], row["r95_m"]) == pytest.approx((CEP[k], R95[k]), rel=1e-6)
        assert row["sigma"] == by_name(SIGMA[k])
        assert row["mean"] == by_name(TURNED[k])
    assert found["requirements"] == []
    assert "sinssim" in found["versions"]


def test_the_sources_of_a_budget() -> None:
    """Each alone, and the gain in R95 if it were half as large; shares of the mean square add up to one."""
    found = {one["source"]: one for one in to_json(result())["sources"]}
    start, gyro, mean = START[3, 0], GYRO[3, 0], SIZE[3]
    halved = {
        "start": radius(0.95, np.hypot(start / 2, gyro), mean),
        "gyro_bias": radius(0.95, np.hypot(start, gyro / 2), mean),
        "accel_scale": radius(0.95, np.hypot(start, gyro), mean / 2),
    }
    alone = {"start": radius(0.95, start, 0.0), "gyro_bias": radius(0.95, gyro, 0.0), "accel_scale": mean}
    squares = {"start": 2 * start**2, "gyro_bias": 2 * gyro**2, "accel_scale": mean**2}
    assert list(found) == sorted(halved, key=lambda name: halved[name])
    for name, one in found.items():
        assert one["r95_alone_m"] == pytest.approx(alone[name], rel=1e-6), name
        assert one["r95_gain_if_halved_m"] == pytest.approx(R95[3] - halved[name], rel=1e-5), name
        assert one["share_of_horizontal_mean_square"] == pytest.approx(squares[name] / sum(squares.values())), name
    assert found["gyro_bias"]["sigma"] == by_name(GYRO[3])
    assert found["start"]["sigma"] == by_name(START[3])
    assert found["accel_scale"]["mean"] == by_name(TURNED[3])
    assert found["accel_scale"]["sigma"] is found["start"]["mean"] is found["gyro_bias"]["mean"] is None
    told = [[one[key] for key in ("label", "group", "kind", "value", "unit")] for one in found.values()]
    assert sorted(told) == [
        ["bias of the gyros", "gyros", "random", 0.3, "deg/h"],
        ["scale of the accelerometers", "accelerometers", "given", -40.0, "ppm"],
        ["start, in words", "initial state", "random", None, "m"],
    ]


def test_the_answers_of_a_budget_are_in_the_unit_of_the_requirement() -> None:
    """A heading of 8′ where 5′ are allowed: the gyros may be 0.25 times as large, 0.075 deg/h; the start is no help."""
    minute = pi / 10_800.0
    start, gyro, scale = SOURCES
    answer = Answer(
        parse_requirement("heading(run) <= 5 arcmin"), 8.0 * minute, 60.0,
        (Allowance((gyro,), 0.25, 2.0 * minute), Allowance((scale,), inf, 7.0 * minute)),
        Allowance((gyro, scale), nan, 6.0 * minute), Allowance((gyro, scale), 0.5, 0.0), Exceeded(44.0, 30.0),
    )  # fmt: skip
    (found,) = to_json(result(), (answer,))["requirements"]
    sources = found.pop("sources")
    assert found.pop("free_together") == {
        "sources": ["gyro_bias", "accel_scale"], "possible": False, "factor": None,
        "largest": [{"value": None, "unit": "deg/h"}, {"value": None, "unit": "ppm"}],
        "without_them": pytest.approx(6.0),
    }  # fmt: skip
    assert found == {
        "requirement": "heading(run) <= 5 arcmin",
        "meaning": "root mean square over all runs of the heading error, at every time of the run, at most 5 arcmin",
        "met": False, "value": pytest.approx(8.0), "limit": pytest.approx(5.0), "margin": pytest.approx(-3.0),
        "unit": "arcmin", "time_s": 60.0, "exceeded_from_s": 44.0, "after_fixes_end_s": 14.0,
        "factor_of_all_sources": 0.5,
    }  # fmt: skip
    assert sources == [
        {"sources": ["gyro_bias"], "possible": True, "factor": 0.25,
         "largest": [{"value": pytest.approx(0.075), "unit": "deg/h"}], "without_them": pytest.approx(2.0)},
        {"sources": ["accel_scale"], "possible": True, "factor": None, "largest": [{"value": None, "unit": "ppm"}],
         "without_them": pytest.approx(7.0)},
    ]  # fmt: skip
    met = Answer(parse_requirement("r95(20 s) <= 2 km"), 500.0, 20.0, (), None, Allowance((start,), inf, 0.0))
    (found,) = to_json(result(), (met,))["requirements"]
    assert (found["met"], found["value"], found["margin"], found["unit"]) == (True, 0.5, 1.5, "km")
    assert found["exceeded_from_s"] is found["after_fixes_end_s"] is found["free_together"] is None
    assert found["factor_of_all_sources"] is None


def test_the_table_of_a_budget(tmp_path: Path) -> None:
    """A row for each instant: all sources first, then each one."""
    _write_parquet(result(), tmp_path / "b.parquet")
    table = pq.read_table(tmp_path / "b.parquet")
    assert table.column_names == [
        "source", "kind", "time_s", "cep_m", "r95_m", *(f"sigma_{n}" for n in NAMES), *(f"mean_{n}" for n in NAMES),
    ]  # fmt: skip
    held = table.to_pydict()
    assert held["source"] == [name for name in ("total", "start", "gyro_bias", "accel_scale") for _ in range(4)]
    assert held["kind"] == [kind for kind in ("total", "random", "random", "given") for _ in range(4)]
    assert held["time_s"] == [10.0, 20.0, 40.0, 72.0] * 4
    none = np.zeros((4, 9))
    sigma, mean = np.vstack([SIGMA, START, GYRO, none]), np.vstack([TURNED, none, none, TURNED])
    spread, off = sigma[:, 0], np.hypot(mean[:, 0], mean[:, 1])
    for key, share in (("cep_m", 0.5), ("r95_m", 0.95)):
        assert held[key] == pytest.approx([radius(share, s, m) for s, m in zip(spread, off, strict=True)], rel=1e-6)
    for k, name in enumerate(NAMES):
        assert held[f"sigma_{name}"] == pytest.approx(sigma[:, k], rel=1e-12), name
        assert held[f"mean_{name}"] == pytest.approx(mean[:, k], rel=1e-12), name
