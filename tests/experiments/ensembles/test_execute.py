"""The runs of an ensemble are single runs, bit for bit."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles.ensemble_errors import VECTORS
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan, member, runs_in_a_file
from sinssim.scenario.load import load_scenario
from tests.experiments.ensembles.examples import AIDED, scenario
from tests.slow import slow

VARIED = (
    {"type": "uniform", "key": "parked.heading_deg", "low": 0.0, "high": 90.0},
    {"type": "choice", "key": "imu.rate_hz", "values": [10.0, 20.0, 40.0]},
    {"type": "normal", "key": "navigation.initial_error.north_m", "mean": 10.0, "sigma": 5.0},
)


@pytest.mark.parametrize(
    ("solution", "vary"), [("euler", ()), ("quaternion", VARIED), *slow(("euler", VARIED), ("quaternion", ()))]
)
def test_twenty_runs_are_twenty_single_runs(solution: str, vary: Any, tmp_path) -> None:
    """Each is run again from the scenario's file with the settings that the ensemble gives."""
    base = scenario(ensemble={"epoch_s": 0.5, "solution": solution, "vary": vary})
    file = tmp_path / "scenario.toml"
    file.write_text(base.to_toml(), encoding="utf-8")
    truths = TruthCache()
    plan = make_plan(base, truths)
    errors = errors_of_runs(plan, range(20), truths)
    assert not errors.failed.any()
    for number in range(20):
        one = member(base, number)
        assert errors.seed[number] == one.seed
        run = sinssim.run(load_scenario(file, one.settings))
        assert run.scenario.model_copy(update={"ensemble": None}) == one.scenario
        single = run.errors[solution]
        rows = np.searchsorted(single.time, plan.epochs + 1e-6, side="right") - 1
        for name in VECTORS:
            np.testing.assert_array_equal(getattr(errors, name)[number], getattr(single, name)[rows])
        final = run.summary["algorithms"][solution]["final_horizontal_error_m"]
        assert float(np.hypot(*errors.final[number, :2])) == final
    if vary:
        assert len(set(errors.values["imu.rate_hz"])) == 3
        assert 0.0 < errors.values["parked.heading_deg"].min() < errors.values["parked.heading_deg"].max() < 90.0


def test_runs_with_a_filter_are_single_runs() -> None:
    """The aided solution and its σ, though the ensemble neither smooths nor keeps the filter's history."""
    base = scenario(AIDED, filter={"smooth": True})
    truths = TruthCache()
    plan = make_plan(base, truths)
    assert plan.solution == "aided"
    assert plan.sensors == ("gnss-position", "gnss-velocity", "zero-velocity")
    errors = errors_of_runs(plan, range(3), truths)
    assert errors.failure == [""] * 3
    assert errors.sigma is not None
    for number in range(3):
        aided = sinssim.run(member(base, number).scenario).aided
        assert aided is not None
        single = aided.error
        rows = np.searchsorted(single.time, plan.epochs + 1e-6, side="right") - 1
        for name in VECTORS:
            np.testing.assert_array_equal(getattr(errors, name)[number], getattr(single, name)[rows])
        np.testing.assert_array_equal(errors.sigma[number], aided.estimate.sigma[rows, :9])
        nis = sum(float(np.nansum(i.nis)) for i in aided.estimate.innovations)
        assert sum(errors.nis[name][number].sum() for name in plan.sensors) == pytest.approx(nis, rel=1e-12)


def test_nees_is_that_of_the_covariance_in_full() -> None:
    """xᵀP⁻¹x by another solver, of a block and of all states."""
    from sinssim.experiments.ensembles.ensemble_execution import normalised

    rng = np.random.default_rng(8)
    root = rng.normal(size=(4, 6, 6)) * 10.0 ** np.arange(-3, 3)[:, None]
    p, x = root @ root.transpose(0, 2, 1), rng.normal(size=(4, 6)) * 10.0 ** np.arange(-3, 3)
    square, freedom = normalised(x, p)
    wanted = [float(a @ np.linalg.solve(b, a)) for a, b in zip(x, p, strict=True)]
    np.testing.assert_allclose(square, wanted, rtol=1e-6)
    assert freedom.tolist() == [6.0] * 4
    dependent = np.array([[[4.0, 4.0, 0.0], [4.0, 4.0, 0.0], [0.0, 0.0, 0.0]]])
    square, freedom = normalised(np.array([[2.0, 2.0, 0.0]]), dependent)
    assert (float(square[0]), float(freedom[0])) == (pytest.approx(1.0), 1.0)


def test_a_failed_run_is_a_result() -> None:
    """A start heading beyond the limits of its key fails the runs that draw it, by name, and no others."""
    vary = ({"type": "normal", "key": "parked.roll_deg", "mean": 0.0, "sigma": 400.0},)
    truths = TruthCache()
    plan = make_plan(scenario(ensemble={"vary": vary}), truths)
    errors = errors_of_runs(plan, range(12), truths)
    beyond = np.abs(errors.values["parked.roll_deg"]) > 180.0
    assert 0 < beyond.sum() < 12
    np.testing.assert_array_equal(errors.failed, beyond)
    assert all("parked.roll_deg" in text for text in errors.failure if text)
    np.testing.assert_array_equal(np.isnan(errors.final[:, 0]), beyond)


def test_an_unexpected_error_of_one_run_is_its_failure(monkeypatch) -> None:
    from sinssim.simulation import navigation_stage as navigation

    solve, calls = navigation.solve, []

    def sometimes(*arguments: Any) -> Any:
        calls.append(1)
        if len(calls) == 2:
            raise ZeroDivisionError("by chance")
        if len(calls) == 3:
            raise AssertionError
        return solve(*arguments)

    monkeypatch.setattr(navigation, "solve", sometimes)
    truths = TruthCache()
    errors = errors_of_runs(make_plan(scenario(), truths), range(3), truths)
    assert errors.failure[:2] == ["", "ZeroDivisionError: by chance"]
    assert re.fullmatch(r"AssertionError without a message in test_execute\.py, line \d+\.", errors.failure[2])


def test_runs_that_share_a_motion_compute_it_once(monkeypatch) -> None:
    from sinssim.experiments.ensembles import ensemble_plan as truth

    made = []
    once = truth._truth
    monkeypatch.setattr(truth, "_truth", lambda scenario: made.append(scenario.seed) or once(scenario))
    truths = TruthCache()
    errors_of_runs(make_plan(scenario(), truths), range(5), truths)
    assert len(made) == 1
    vibrating = scenario(vibration=({"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0},))
    truths = TruthCache()
    errors_of_runs(make_plan(vibrating, truths), range(3), truths)
    assert make_plan(scenario(), truths).chunk == 64
    assert make_plan(vibrating, truths).chunk == 8
    assert len(set(made)) == 1 + 3  # the ensemble's own seed, and that of each vibrating run


def test_flights_of_their_own_are_few_in_a_file() -> None:
    """A run that flies takes ten seconds: files of two, so that all cores end together."""
    guided, flown = load_scenario("heading_error"), load_scenario("first_flight")
    assert [runs_in_a_file(guided, False), runs_in_a_file(guided, True)] == [2, 2]
    assert [runs_in_a_file(flown, False), runs_in_a_file(flown, True)] == [64, 8]


def test_epochs() -> None:
    truths = TruthCache()
    parked = {"latitude_deg": 50.0, "duration_s": 7000.0}
    assert np.diff(make_plan(scenario(parked=parked), truths).epochs).tolist() == [14.0] * 500
    short = make_plan(scenario(ensemble={"epoch_s": 7.0}), truths).epochs
    assert short.tolist() == [0.0, 7.0, 14.0, 21.0, 28.0, 30.0]  # the end is always one
    for wrong in (0.01, 31.0):
        with pytest.raises(sinssim.InputError, match="epoch_s"):
            make_plan(scenario(ensemble={"epoch_s": wrong}), truths)


def test_one_component_is_refused() -> None:
    contents = {"name": "plane", "one_component": {"variant": "one-integral", "duration_s": 60.0, "gyro": {}}}
    with pytest.raises(sinssim.InputError, match="one_component"):
        make_plan(sinssim.Scenario.model_validate(contents))
