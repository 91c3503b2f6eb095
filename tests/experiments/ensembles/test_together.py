"""Runs that are computed together have the numbers of runs that are computed one by one, but for rounding."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.data import Array
from sinssim.experiments.ensembles import batch_navigation, ensemble_execution
from sinssim.experiments.ensembles.ensemble_errors import VECTORS, RunErrors
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan, member
from sinssim.scenario import Scenario
from tests.experiments.ensembles.examples import AIDED, scenario
from tests.experiments.ensembles.test_navigate_batch import SECTIONS

GREAT_CIRCLE = {
    "name": "across",
    "great_circle": {
        "latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 220.0, "altitude_m": 9000.0, "duration_s": 60.0,
    },
    "imu": {**SECTIONS["laser-standard in full"], "rate_hz": 20.0},  # whose kernel other tests compile
    "navigation": {"initial_error": {"position_sigma_m": 3.0, "heading_sigma_arcmin": 2.0}},
}  # fmt: skip

NORTH = {"type": "normal", "key": "navigation.initial_error.north_m", "mean": 0.0, "sigma": 9.0}


def errors_by(monkeypatch: pytest.MonkeyPatch, base: Scenario, reason: str | None) -> RunErrors:
    """Return the errors of eight runs, computed together or one by one."""
    truths = TruthCache()
    plan = make_plan(base, truths)
    monkeypatch.setattr(batch_navigation, "PAYS", 0.0)
    assert batch_navigation.why_not_batch(plan, truths) is None
    monkeypatch.setattr(ensemble_execution, "why_not_batch", lambda plan, truths: reason)
    return errors_of_runs(plan, range(3, 11), truths)


@pytest.mark.parametrize("latest", ["quaternion", pytest.param("poisson-2", marks=pytest.mark.slow)])
def test_together_and_one_by_one(latest: str, monkeypatch: pytest.MonkeyPatch) -> None:
    base = scenario(GREAT_CIRCLE, seed=11)
    navigation = base.navigation.model_copy(update={"algorithms": (latest,)})
    base = base.model_copy(update={"navigation": navigation})
    one_by_one, all_at_once = (errors_by(monkeypatch, base, reason) for reason in ("told so", None))
    assert not one_by_one.failed.any()
    for name in (*VECTORS, *(field.name for field in fields(RunErrors) if field.name != "table")):
        value = getattr(one_by_one, name)
        if isinstance(value, np.ndarray):
            # rounding: 1e-9 of the largest value; an attitude error of 1e-13 rad
            limit = 1e-9 * np.abs(value, where=np.isfinite(value), out=np.zeros(value.shape)).max(initial=1e-4)
            np.testing.assert_allclose(getattr(all_at_once, name), value, rtol=0, atol=limit, err_msg=name)


def test_a_run_that_leaves_the_batch_is_computed_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    base = scenario(GREAT_CIRCLE, seed=12)
    found: list[int] = []
    single = ensemble_execution.errors_of_run

    def counted(plan: Any, one: Any, truths: Any, errors: Any, row: int) -> None:
        found.append(row)
        single(plan, one, truths, errors, row)

    def some_alone(*given: Any, **options: Any) -> Any:
        solution = together_batch(*given, **options)
        bad: Array = solution.latitude.copy()
        bad[5] = np.nan  # diverged
        return type(solution)(**{**vars(solution), "alone": (2,), "latitude": bad})

    together_batch = batch_navigation.navigate_batch
    whole = errors_by(monkeypatch, base, None)
    monkeypatch.setattr(batch_navigation, "navigate_batch", some_alone)
    monkeypatch.setattr(ensemble_execution, "errors_of_run", counted)
    again = errors_by(monkeypatch, base, None)
    assert found == [2, 5]
    for name in VECTORS:
        np.testing.assert_allclose(getattr(again, name), getattr(whole, name), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("contents", "changes", "reason"),
    [
        (AIDED, {}, "it has a filter"),
        (GREAT_CIRCLE, {"navigation": {"algorithms": ("euler",)}}, "euler has attitude variables of its own kind"),
        (GREAT_CIRCLE, {"navigation": {"frame": "wander"}}, 'navigation.frame = "wander"'),
        (GREAT_CIRCLE, {}, "2.4e+04 samples are too few to compensate for compiling the batch"),
        (
            GREAT_CIRCLE,
            {
                "ensemble": {
                    "vary": [{"type": "normal", "key": "navigation.initial_error.north_m", "mean": 0.0, "sigma": 9.0}]
                }
            },
            "keys vary from run to run",
        ),
    ],
)
def test_why_runs_are_computed_one_by_one(contents: Any, changes: Any, reason: str) -> None:
    truths = TruthCache()
    base = scenario(contents, **changes)
    if base.ensemble is None:
        base = base.model_copy(update={"ensemble": scenario(contents, ensemble={"runs": 20}).ensemble})
    assert batch_navigation.why_not_batch(make_plan(base, truths), truths) == reason


def test_runs_on_a_platform_are_single_runs() -> None:
    base = scenario(GREAT_CIRCLE, imu={"grade": "laser-standard", "rate_hz": 20.0, "sensor_set": {"type": "platform"}})
    truths = TruthCache()
    plan = make_plan(base, truths)
    errors = errors_of_runs(plan, range(2), truths)
    assert errors.failure == ["", ""]
    run = sinssim.run(member(base, 1).scenario)
    single = run.errors["platform"]
    rows = np.searchsorted(single.time, plan.epochs + 1e-6, side="right") - 1
    np.testing.assert_array_equal(errors.position_ned[1], single.position_ned[rows])
