"""The numbers of a cell from a budget and from an ensemble whose errors are written by hand."""

from __future__ import annotations

from math import inf, nan, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.ensembles.ensemble_errors import RunErrors
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import Circles
from sinssim.experiments.ensembles.ensemble_verdicts import Estimate, estimate
from sinssim.experiments.studies.trade_cells import of_budget, of_ensemble
from sinssim.statistics.percentiles import Percentile, percentile
from sinssim.statistics.requirements import Exceeded, VerdictInUnit, parse_quantity
from tests.experiments.studies.trade_examples import study
from tests.recording.by_hand import ARCMIN, CEP, R95, hand_budget

AXIS = ({"key": "imu.grade", "values": ("tactical",)},)


def of_an_hour(name: str) -> tuple[float, float, float]:
    """Return root mean square, σ and mean of a component of the budget by hand after an hour, SI."""
    plane = sqrt(2500.01)
    return {
        "position_north": (plane, plane, 0.0), "position_east": (plane, plane, 0.0),
        "position_down": (25.0, 20.0, -15.0), "velocity_north": (5e-3, 5e-3, 0.0), "velocity_east": (5e-3, 5e-3, 0.0),
        "velocity_down": (13e-3, 13e-3, 0.0), "tilt_north": (0.25 * ARCMIN, 0.25 * ARCMIN, 0.0),
        "tilt_east": (0.5 * ARCMIN, 0.5 * ARCMIN, 0.0),
        "heading": (sqrt(1.1**2 + 0.6**2) * ARCMIN, 1.1 * ARCMIN, 0.6 * ARCMIN),
    }[name]  # fmt: skip


def test_every_number_of_a_budget(tmp_path: Path) -> None:
    """All errors grow with the time: half of an hour's at 1800 s, twice at 7200 s; the heading error is −φ_down."""
    ask = ("r95(run) <= 0.2 km", "heading(1800 s) <= 1 arcmin", "rate(end) <= 0.05 nmi/h")
    plan = study(tmp_path, axes=AXIS, times_s=(1800.0,), require=ask, draw=("velocity_down(run)",))
    budget = hand_budget(filtered=True)
    budget.mean["height"][:, 8] = -0.6 * ARCMIN * budget.time / 3600.0
    budget.scenario.aiding = SimpleNamespace(outages=((5000.0, 7000.0),))
    found = of_budget(plan, budget)
    plane = sqrt(2500.01)
    expected: dict[str, float] = {"filter_r95_end_m": nan, "r95_run_m": 2.0 * plane * R95,
                                  "velocity_down_run_mps": 26e-3}  # fmt: skip
    for when, hours in (("1800s", 0.5), ("end", 2.0)):
        expected |= {f"cep_{when}_m": plane * hours * CEP, f"r95_{when}_m": plane * hours * R95,
                     f"rate_{when}_nmi_h": plane * R95 / 1852.0}  # fmt: skip
        for kind, unit in (("position", "m"), ("velocity", "mps"), ("tilt", "rad"), ("heading", "rad")):
            axes = {"tilt": ("_north", "_east"), "heading": ("",)}.get(kind, ("_north", "_east", "_down"))
            for name in (f"{kind}{axis}" for axis in axes):
                rms, sigma, mean = (hours * value for value in of_an_hour(name))
                column = f"{name}_{when}_{unit}"
                expected |= {column: rms, f"sigma_{column}": sigma, f"mean_{column}": mean}
    own = found.values["filter_r95_end_m"]
    # the filter's own σ of 1 m/h north and 2 m/h east: the share of runs within the radius by many draws
    draws = np.random.default_rng(2).normal(size=(2, 200_000)) * [[2.0], [4.0]]
    assert np.mean(np.hypot(*draws) <= own) == pytest.approx(0.95, abs=2e-3)
    expected["filter_r95_end_m"] = own
    assert found.values == pytest.approx(expected, rel=1e-9, abs=1e-15)
    since = 3600.0 * 200.0 / (plane * R95)
    assert found.verdicts == (
        VerdictInUnit(ask[0], "not met", pytest.approx(2e-3 * plane * R95), pytest.approx(0.2), "km", 7200.0, 0,
                    pytest.approx(since), pytest.approx(since - 5000.0)),
        VerdictInUnit(ask[1], "met", pytest.approx(0.5 * sqrt(1.57)), pytest.approx(1.0), "arcmin", 1800.0),
        VerdictInUnit(ask[2], "not met", pytest.approx(plane * R95 / 1852.0), pytest.approx(0.05), "nmi/h", 7200.0),
    )  # fmt: skip
    np.testing.assert_array_equal(found.time, budget.time)
    np.testing.assert_allclose(found.cep, plane * CEP * budget.time / 3600.0, rtol=1e-9)
    np.testing.assert_allclose(found.r95, plane * R95 * budget.time / 3600.0, rtol=1e-9)


def test_a_budget_without_a_filter(tmp_path: Path) -> None:
    budget = hand_budget()
    budget.scenario.aiding = None
    assert "filter_r95_end_m" not in of_budget(study(tmp_path, axes=AXIS), budget).values


RUNS = 40


def ensemble() -> EnsembleResult:
    """Return forty runs from 100 s to 3700 s, of which the last failed.

    After an hour run k has errors of 3k m north, −4k m east and 12k m down, velocities and angles of k and −2k times
    (0.1, 0.2, 0.3) m/s and (1, 2, 3) mrad; a third of it after 1200 s.
    """
    k = np.arange(1.0, RUNS + 1.0)[:, np.newaxis]
    final = np.hstack((k * [3.0, -4.0, 12.0], k * [0.1, 0.2, 0.3], -2.0 * k * [1e-3, 2e-3, 3e-3]))
    final[-1] = nan
    growth = np.array([600.0, 1200.0, 3600.0]) / 3600.0
    course = final[:, np.newaxis, :] * growth[:, np.newaxis]
    errors = RunErrors(
        np.arange(RUNS), np.arange(RUNS), np.full(RUNS, 3700.0), [""] * (RUNS - 1) + ["it fell."], {}, final, (), (),
        np.moveaxis(course, -1, 0).copy(),
    )  # fmt: skip
    scenario = SimpleNamespace(name="by hand", aiding=None, seed=1)
    plan = SimpleNamespace(epochs=100.0 + 3600.0 * growth, start=100.0, scenario=scenario, filtered=False, keys=())
    return EnsembleResult(plan, errors, notes=["A remark."], media=EnsembleMedia())


def with_band(column: str, values: Any, share: float) -> dict[str, float]:
    band = percentile(values, share)
    return {column: float(band.value), f"{column}_low": float(band.low), f"{column}_high": float(band.high)}


def test_every_number_of_an_ensemble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 1…39 and ∞, CEP is at the place 20.5 and R95 at 38.65; χ² has 39 degrees of freedom."""

    def band(value: float, low: float, high: float) -> Percentile:
        return Percentile(0.5, *map(np.array, (value, low, high)), 0.95, np.array(40.0))

    line = {1.0: Circles(band(1.0, 2.0, 3.0), band(4.0, 5.0, 6.0))}
    squares = {"of all": SimpleNamespace(mean=1.25, share_in_band=0.75)}
    statistics = "sinssim.experiments.ensembles.ensemble_summary"
    monkeypatch.setattr(EnsembleResult, "mean_rates", np.array([1852.0 / 3600.0]))
    monkeypatch.setattr(EnsembleResult, "nees", {"all": "of all", "other": "of one"})
    monkeypatch.setattr(f"{statistics}.circles", lambda rates: line[round(float(rates[0]), 9)])
    monkeypatch.setattr(f"{statistics}.square_numbers", squares.__getitem__)
    ask = ("cep(end) <= 0.05 km", "heading(1200 s) <= 5 deg")
    plan = study(tmp_path, axes=AXIS, cell="ensemble", times_s=(1200.0,), require=ask,
                 draw=("r95(run)", "heading(run)"))  # fmt: skip
    found = of_ensemble(plan, ensemble())
    numbers = np.append(np.arange(1.0, 40.0), inf)
    expected: dict[str, float] = {
        "runs": 40.0, "failed_runs": 1.0, "nees_mean": 1.25, "nees_share_in_band": 0.75, "r95_run_m": 5.0 * 38.65,
    }  # fmt: skip
    for name, (value, low, high) in {"cep": (1.0, 2.0, 3.0), "r95": (4.0, 5.0, 6.0)}.items():
        expected |= {f"rate_line_{name}_nmi_h": value, f"rate_line_{name}_nmi_h_low": low,
                     f"rate_line_{name}_nmi_h_high": high}  # fmt: skip
    k = np.arange(1.0, 40.0)
    rms, sigma = sqrt(np.sum(k**2) / 39.0), sqrt(39.0 * 40.0 / 12.0)
    assert sigma == pytest.approx(np.std(k, ddof=1))
    low, high = sqrt(39.0 / 58.1201), sqrt(39.0 / 23.6543)  # χ² at 97.5 % and 2.5 %
    for when, part in (("1200s", 1.0 / 3.0), ("end", 1.0)):
        expected |= with_band(f"cep_{when}_m", 5.0 * part * numbers, 0.5)
        expected |= with_band(f"r95_{when}_m", 5.0 * part * numbers, 0.95)
        expected |= with_band(f"rate_{when}_nmi_h", 5.0 / 1852.0 * numbers, 0.95)
        assert expected[f"cep_{when}_m"] == pytest.approx(5.0 * part * 20.5)
        for name, size in (("position_north", 3.0), ("position_east", -4.0), ("position_down", 12.0),
                           ("velocity_north", 0.1), ("velocity_east", 0.2), ("velocity_down", 0.3),
                           ("tilt_north", -2e-3), ("tilt_east", -4e-3), ("heading", 6e-3)):  # fmt: skip
            unit = {"p": "m", "v": "mps"}.get(name[0], "rad")
            column, one = f"{name}_{when}_{unit}", abs(size) * part
            expected |= {column: one * rms, f"{column}_low": one * rms * low, f"{column}_high": one * rms * high,
                         f"sigma_{column}": one * sigma, f"mean_{column}": size * part * 20.0}  # fmt: skip
    expected["heading_run_rad"] = 6e-3 * rms
    assert found.values == pytest.approx(expected, rel=2e-6)
    first, second = found.verdicts
    # 10 of 40 within 50 m, the interval of their share ends at 41 %; three failures of 40 beyond the largest
    assert first == VerdictInUnit(ask[0], "not met", pytest.approx(0.1025), 0.05, "km", 3600.0, 0)
    assert (second.requirement, second.value, second.time_s, second.unit) == (ask[1], inf, 1200.0, "deg")
    assert found.time.tolist() == [600.0, 1200.0, 3600.0]
    np.testing.assert_allclose(found.cep, 5.0 * 20.5 * found.time / 3600.0)
    np.testing.assert_allclose(found.r95, 5.0 * 38.65 * found.time / 3600.0)
    assert found.notes == ("A remark.",)


def test_words_of_a_verdict() -> None:
    """Value, unit and instant; since when; nothing where no run has a solution."""
    kept = {"requirement": "r", "verdict": "not met", "limit": 1.0, "unit": "nmi"}
    assert VerdictInUnit(value=2.345, time_s=1800.5, **kept).text == "2.35 nmi at 1800.5 s"
    assert VerdictInUnit(value=inf, time_s=60.0, **kept).text == "∞ at 60 s"
    assert VerdictInUnit(value=nan, time_s=nan, **kept).text == ""
    later = VerdictInUnit(value=2.0, time_s=900.0, exceeded_from_s=650.0, after_fixes_end_s=50.0, **kept)
    assert later.text == f"2.00 nmi at 900 s, {Exceeded(650.0, 600.0).text}"
    assert later.text.endswith("exceeded from 650 s, 50 s after the fixes end")


def test_a_component_without_values_and_with_late_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that has not begun does not count; a single one has no σ."""
    result = ensemble()
    result.errors.velocity_ned[1:, 0, 2] = nan
    found = estimate(result, parse_quantity("velocity_down(600 s)"))
    assert found.value == pytest.approx(0.05)
    assert found.mean == pytest.approx(0.05)
    assert found.sigma is not None
    assert np.isnan(found.sigma)
    result.errors.velocity_ned[0, 0, 2] = nan
    found = estimate(result, parse_quantity("velocity_down(600 s)"))
    np.testing.assert_equal(vars(found), vars(Estimate(nan)))
