"""What an ensemble says of itself, of failed runs and of why it does what it does, with all numbers different."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim.data import ImuData
from sinssim.errors import RunError
from sinssim.experiments.ensembles import batch_navigation, ensemble_execution
from sinssim.experiments.ensembles import ensemble_plan as plans
from sinssim.experiments.ensembles import ensemble_plan as truths_of
from sinssim.experiments.ensembles.ensemble_errors import empty
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_verdicts import LOOKS, Looks
from sinssim.simulation.truth_and_sensors import Sensed, Truth
from sinssim.statistics.percentiles import Percentile
from sinssim.statistics.requirements import parse_requirements
from tests.experiments.ensembles.examples import AIDED, PARKED, scenario
from tests.experiments.ensembles.test_result import straight
from tests.experiments.ensembles.test_served import reason


def test_a_failed_run_keeps_its_reason_alone() -> None:
    errors = empty(3, 2, (), ("bias",), ("gnss",))
    assert errors.sigma is not None
    every = [errors.position_ned, errors.velocity_ned, errors.attitude, errors.final, errors.sigma,
             *(kept[name] for kept, name in ((errors.nees, "bias"), (errors.nees_freedom, "bias"), (errors.nis, "gnss"),
                                            (errors.nis_freedom, "gnss")))]  # fmt: skip
    for k, values in enumerate(every):
        values[:] = 10.0 + k
    ensemble_execution._fail(errors, 1, "It <fell>.")
    assert errors.failure == ["", "It <fell>.", ""]
    for k, values in enumerate(every):
        assert np.isnan(values[1]).all()
        assert (values[[0, 2]] == 10.0 + k).all()
    ensemble_execution._fail(errors, 2, "")
    assert errors.failure[2] == "it failed without a message."


def test_an_ensemble_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last epoch counts: value, lower and upper end, in that order."""
    result = straight(np.linspace(0.1, 1.0, 7), failed=2)
    result = replace(
        result, verdicts=(SimpleNamespace(requirement=SimpleNamespace(text="r95 < 2 nmi"), verdict="met"),)
    )
    one = Percentile(0.5, np.array([1.0, 23.456]), np.array([2.0, 12.345]), np.array([3.0, 45.6789]), 0.95, np.ones(2))
    two = replace(one, share=0.95, value=np.array([4.0, 67.0]), low=np.array([5.0, 50.0]), high=np.array([6.0, np.inf]))
    monkeypatch.setattr(EnsembleResult, "cep", one)
    monkeypatch.setattr(EnsembleResult, "r95", two)
    assert repr(result) == "EnsembleResult(standing: 7 runs, 2 failed, 61 epochs)"
    rows = [("", "value (95 % band)"), ("CEP at the end, m", "23.46 (12.35 … 45.68)"),
            ("R95 at the end, m", "67 (50 … inf)"), ("r95 &lt; 2 nmi", "met")]  # fmt: skip
    left = 'style="text-align: left"'
    tags = ["th", "td", "td", "td"]
    table = "".join(
        "<tr>" + "".join(f"<{tag} {left}>{cell}</{tag}>" for cell in row) + "</tr>"
        for tag, row in zip(tags, rows, strict=True)
    )
    assert result._repr_html_() == f"<b>{result!r}</b><table>{table}</table>"


def test_a_filter_that_diverges_fails_its_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A covariance is kept each second unless epochs are closer; the σ of the row of an epoch is that of its errors."""
    asked: list[float] = []
    rows = np.array([1.0, 2.0, 3.0])[:, None]
    estimate = SimpleNamespace(divergence=None, time=np.array([20.0, 20.5, 21.0]), sigma=rows * np.arange(1.0, 12.0),
                               rows=np.empty(0, int), innovations=())  # fmt: skip
    error = SimpleNamespace(time=np.arange(3.0), position_ned=rows * np.arange(3.0),
                            velocity_ned=rows * np.arange(3, 6.0), attitude=rows * np.arange(6, 9.0))  # fmt: skip
    aided = SimpleNamespace(estimate=estimate, error_at=lambda at: SimpleNamespace(
        **{name: value[at] for name, value in vars(error).items()}))  # fmt: skip
    monkeypatch.setattr("sinssim.simulation.aided_run.aid_run",
                        lambda *_, row_s, **more: asked.append(row_s) or aided)  # fmt: skip
    truth = Truth(SimpleNamespace(ellipsoid=None, state=lambda t: t), None, 1.0, np.array([20.0]))  # type: ignore[arg-type]
    monkeypatch.setattr("sinssim.scenario.navigation_section.initial_state_with_errors", lambda *_: "initial")
    readings = SimpleNamespace(monitored=(), imu=None, compensated=None)
    run = Sensed(scenario(AIDED), truth, readings, "errors")  # type: ignore[arg-type]
    plan: Any = SimpleNamespace(epochs=np.array([20.0, 21.0]), sensors=())
    errors = empty(2, 2, (), ("all states",), ())
    ensemble_execution.compute_filtered(plan, run, errors, 1)
    assert errors.sigma[1].tolist() == [list(np.arange(1.0, 10.0)), list(3.0 * np.arange(1.0, 10.0))]
    assert errors.velocity_ned[1].tolist() == [[3.0, 4.0, 5.0], [9.0, 12.0, 15.0]]
    assert np.isnan(errors.sigma[0]).all()
    plan.epochs = np.array([20.0, 20.5, 21.0])
    estimate.divergence = SimpleNamespace(time=20.678, reason="the heading left its linear range.")
    with pytest.raises(RunError, match=r"^the filter diverged at t = 20\.68 s: the heading left its linear range\.$"):
        ensemble_execution.compute_filtered(plan, run, errors, 0)
    assert asked == [1.0, 0.0]


def test_a_run_without_a_covariance_has_no_squares() -> None:
    errors = empty(1, 2, (), ("bias", "scale"), ())
    estimate = SimpleNamespace(rows=np.empty(0, int))
    ensemble_execution._store_nees(SimpleNamespace(estimate=estimate), errors, 0, np.array([0]), np.array([0]))  # type: ignore[arg-type]
    assert np.isnan(errors.nees["bias"]).all()
    # of two blocks of states, a run that varies its filter may have one alone: 4/16 + 36/9
    estimate = SimpleNamespace(rows=np.array([0]), covariance=np.array([np.diag([16.0, 9.0])]),
                               model=SimpleNamespace(compared={"bias": np.eye(2)}))  # fmt: skip
    aided: Any = SimpleNamespace(estimate=estimate, state_errors_at=lambda rows: np.array([[2.0, 6.0]]))
    ensemble_execution._store_nees(aided, errors, 0, np.array([1]), np.array([0]))
    assert errors.nees["bias"][0, 1] == pytest.approx(4.25)
    assert errors.nees_freedom["bias"][0, 1] == 2.0
    assert np.isnan(errors.nees["scale"]).all()


def test_gravity_of_each_run_is_felt_as_a_change_of_the_increments(monkeypatch: pytest.MonkeyPatch) -> None:
    """The motion of all runs, before it is rounded, is computed once; what a run feels is subtracted."""
    time = np.array([5.0, 5.5, 6.5])
    dtheta, dvel = np.arange(6.0).reshape(2, 3) * 1e-3, np.arange(10.0, 16.0).reshape(2, 3)
    made: list[float] = []
    block: Any = SimpleNamespace(increments=lambda rate: made.append(rate) or ImuData(time, dtheta, dvel))
    base = Truth.along("smooth", block, 20.0, ImuData(time, dtheta, dvel), "state")  # type: ignore[arg-type]
    size = [0.125]

    def felt(at: Any, turn: Any) -> Any:
        np.testing.assert_array_equal(at, time)
        return size[0] + 100.0 * turn

    def drawn(own: Any, motion: Any, seed: int) -> Any:
        assert (own.remainder is not None, motion, seed) == (True, "smooth", gravity.seed)
        return SimpleNamespace(felt=felt)

    monkeypatch.setattr("sinssim.truth.motion.TrueGravity.felt", drawn)
    monkeypatch.setattr("sinssim.sensors.imu.emulation.digital", lambda imu: imu)
    cache = TruthCache()
    gravity = scenario(gravity={"remainder": {"order": 2}})
    cache.keep(gravity.model_copy(update={"gravity": None}), base)
    found = cache._in_drawn_gravity(gravity)
    np.testing.assert_allclose(found.ideal.dvel, dvel - 0.125 - 100.0 * dtheta)
    np.testing.assert_array_equal(found.ideal.dtheta, dtheta)
    assert (found.state, found.trajectory is found.block) == ("state", True)
    size[0] = -0.25
    np.testing.assert_allclose(cache._in_drawn_gravity(gravity).ideal.dvel, dvel + 0.25 - 100.0 * dtheta)
    assert made == [20.0]
    assert truths_of.has_remainder(gravity)
    assert not truths_of.has_remainder(scenario())


def test_why_runs_are_computed_alone() -> None:
    truths = TruthCache()
    for contents, words in (
        (
            {"vibration": [{"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0}]},
            "each run has its own motion",
        ),
        ({"parked": {"latitude_deg": 50.0, "duration_s": 0.2}}, "there are fewer than 5 samples"),
    ):
        plan = make_plan(scenario({**PARKED, "navigation": {"algorithms": ("quaternion",)}, **contents}), truths)
        assert batch_navigation.why_not_batch(plan, truths) == words


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["imu.output=mean-rates"], 'imu.output = "mean-rates"'),
        (["imu.sensor_set.type=redundant"], 'imu.sensor_set.type = "redundant"'),
        (["compensation.gyro_bias_sigma_deg_h=0.01"],
         "its inertial data are compensated by a calibration of each run"),
        (['imu.rotation={type="indexed", sequence="16-position", rate_deg_s=10.0, dwell_s=120.0}'],
         "its IMU rotates in the vehicle"),
    ],
)  # fmt: skip
def test_what_a_batch_does_not_serve(changes: list[str], words: str) -> None:
    assert reason('navigation.algorithms=["quaternion"]', *changes) == words


def test_an_ensemble_that_stops_early_is_judged_by_its_finished_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A verdict that was reached stands; the other requirement is judged by all runs, at a fifth of the error."""
    asked: list[Any] = []

    def judge(result: Any, requirement: Any, runs: Any, error: float) -> Any:
        asked.append((requirement.text, runs, error))
        return SimpleNamespace(verdict="undecided" if "cep" in requirement.text else "not met", runs=runs)

    monkeypatch.setattr("sinssim.experiments.ensembles.ensemble_verdicts.judge", judge)
    looks = Looks(parse_requirements(["cep(end) <= 3 nmi", "r95(end) <= 5 nmi"]), 50, until_decided=True)
    looks.look(straight(np.full(60, 0.5)), 50)
    assert [one[:2] for one in asked] == [("cep(end) <= 3 nmi", 50), ("r95(end) <= 5 nmi", 50)]
    assert not looks.decided
    found = looks.so_far(straight(np.full(60, 0.5)))
    assert asked[2:] == [("cep(end) <= 3 nmi", None, pytest.approx(0.05 / LOOKS))]
    assert found[1] is looks.verdicts[1]
    assert looks.done == [50]
    once = Looks(parse_requirements("cep(end) <= 3 nmi"), 50, until_decided=False)
    once.so_far(straight(np.full(60, 0.5)))
    assert asked[3] == ("cep(end) <= 3 nmi", None, pytest.approx(0.05))
    assert LOOKS == 5


def test_tables_of_groups_of_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Parts of two and three runs follow each other in the file."""
    result = straight(np.array([0.5, 1.0, 1.5, 2.0, 2.5]))
    monkeypatch.setattr(type(result.errors), "groups", lambda self: [slice(0, 2), slice(2, 5)])
    by_epoch, by_run = result.to_parquet(tmp_path / "new")
    table = pq.read_table(by_epoch)
    assert table["run"].to_pylist() == [k for k in range(5) for _ in range(61)]
    np.testing.assert_allclose(
        table["position_n_m"].to_numpy()[60::61], np.array([0.5, 1.0, 1.5, 2.0, 2.5]) * 1852.0, rtol=1e-12
    )
    assert pq.read_table(by_run).num_rows == 5


def test_a_plan_knows_the_motion_that_its_runs_are_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed track or flight is another ensemble; a vehicle at rest has neither."""
    recorded = SimpleNamespace(digest=lambda: "digest of a")
    monkeypatch.setattr(
        "sinssim.truth.flight.flight_cache.flight_key", lambda flight, seed: f"key of {flight} with {seed}"
    )
    for track, flown, said in ((recorded, None, "digest of a"), (None, "b", "key of b with 7"), (None, None, "")):
        assert plans.flight_digest(SimpleNamespace(track=track, flight=flown, seed=7)) == said  # type: ignore[arg-type]


def test_content_of_ones_own_is_part_of_an_ensemble(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = make_plan(scenario())
    before = plan.digest
    assert "own_content" not in plan.contents
    monkeypatch.setattr(plans, "own_digests", lambda scenario: {"a.py": "0123"})
    changed = make_plan(scenario())
    assert changed.contents["own_content"] == {"a.py": "0123"}
    assert changed.digest != before
