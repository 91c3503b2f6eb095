"""What an ensemble keeps of a run, and where: drawn values, epochs, a filter's squares, keys of true motions."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from sinssim.errors import InputError, RunError
from sinssim.experiments.ensembles import batch_navigation, ensemble_execution, ensemble_plan, ensemble_run
from sinssim.experiments.ensembles.ensemble_errors import (
    RunErrors,
    check_finite,
    column_names,
    empty,
    groups_of,
    rows_at,
    spans_of,
    store_errors,
)
from sinssim.experiments.ensembles.ensemble_plan import (
    Member,
    _epochs,
    _with_times,
    make_plan,
    member,
    motions_differ,
    truth_key,
    with_runs,
)
from sinssim.experiments.ensembles.ensemble_summary import predicted_sigma
from sinssim.experiments.ensembles.ensemble_verdicts import check_kept
from sinssim.scenario.schema import Scenario
from sinssim.statistics.requirements import parse_requirements
from sinssim.strapdown.navigation_error import NavError
from sinssim.units import duration_text
from tests.experiments.ensembles.examples import AIDED, PARKED, scenario


def fake(**values: Any) -> Any:
    return SimpleNamespace(**values)


@pytest.mark.parametrize(("normal", "place"), [(1.2, 4), (-0.3, 1), (9.0, 4), (-9.0, 0)])
def test_values_follow_from_one_normal_number(normal: float, place: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Φ(1.2) = 0.885 is in the fifth fifth, Φ(−0.3) = 0.382 in the second."""
    asked: list[Any] = []
    monkeypatch.setattr(
        "sinssim.statistics.random_numbers.normals", lambda *given: asked.append(given) or np.array([normal])
    )
    vary = (
        {"type": "normal", "key": "navigation.initial_error.north_m", "mean": 10.0, "sigma": 5.0},
        {"type": "uniform", "key": "parked.heading_deg", "low": -30.0, "high": 90.0},
        {"type": "choice", "key": "parked.duration_s", "values": [10, 20, 30.0, 40, 50]},
    )
    one = member(scenario(ensemble={"vary": vary}), 3)
    assert one.values == pytest.approx({
        "navigation.initial_error.north_m": 10.0 + 5.0 * normal,
        "parked.heading_deg": -30.0 + 120.0 * norm.cdf(normal),
        "parked.duration_s": [10, 20, 30.0, 40, 50][place],
    })  # fmt: skip
    assert asked == [(one.seed, f"vary {key['key']}", 0, 1) for key in vary]


def test_settings_of_a_run() -> None:
    one = Member(3, 77, {"a.b": 0.1, "c": 3}, scenario())
    assert one.settings == ["seed=77", "a.b=0.1", "c=3"]


def test_the_last_row_at_or_before_each_epoch() -> None:
    """An instant that is later by less than 1 µs counts; epochs before the start and after the end are not reached."""
    time = np.array([2.0, 2.5, 3.0000005, 4.0, 6.0])
    epochs, rows = rows_at(np.array([1.0, 2.0, 2.9, 3.0, 3.9, 6.0000005, 7.0]), time)
    assert epochs.tolist() == [1, 2, 3, 4, 5]
    assert rows.tolist() == [0, 1, 2, 2, 4, 4]  # and the end


def test_a_run_is_put_into_its_row() -> None:
    errors = empty(2, 4, ())
    error = NavError(*(np.arange(3.0),), *(np.arange(9.0).reshape(3, 3) + 10.0 * k for k in (1, 2, 3)))
    store_errors(errors, 1, error, np.array([1, 3]))
    for k, values in enumerate((errors.position_ned, errors.velocity_ned, errors.attitude), start=1):
        assert values[1, [1, 3]].tolist() == (10.0 * k + np.arange(6.0).reshape(2, 3)).tolist()
        assert np.isnan(values[0]).all()
        assert np.isnan(values[1, [0, 2]]).all()
    assert errors.final[1].tolist() == [16, 17, 18, 26, 27, 28, 36, 37, 38]
    check_finite(error)
    error.attitude[1, 2] = np.inf
    with pytest.raises(RunError, match=r"its errors are not finite at t = 1\.00 s: it diverged\.") as raised:
        check_finite(error)
    assert raised.value.time == 1.0


def test_names_of_the_columns() -> None:
    """The nine errors with their units, each with the σ that a filter states, then the squares."""
    plain = column_names((), (), False)
    assert plain == (
        "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
        "attitude_n_rad", "attitude_e_rad", "attitude_d_rad",
    )  # fmt: skip
    whole = column_names(("all states", "bias"), ("gnss",), True)
    assert whole[:4] == ("position_n_m", "sigma_position_n_m", "position_e_m", "sigma_position_e_m")
    assert whole[18:] == (
        "nees all states", "nees bias", "nees_freedom all states", "nees_freedom bias", "nis gnss", "nis_freedom gnss",
    )  # fmt: skip
    errors = empty(2, 3, (), ("bias",), ("gnss",))
    errors.velocity_ned[:] = np.arange(18.0).reshape(2, 3, 3)
    errors.nis_freedom["gnss"][:] = np.arange(6.0).reshape(2, 3)
    assert errors.column("velocity_e_mps").tolist() == [[1.0, 4.0, 7.0], [10.0, 13.0, 16.0]]
    assert errors.column("velocity_d_mps", slice(1, 3), slice(1, 2)).tolist() == [[14.0, 17.0]]
    assert errors.column("nis_freedom gnss", slice(0, 1)).tolist() == [[0.0], [3.0]]
    assert errors.names == column_names(("bias",), ("gnss",), True)


def test_parts_of_nearly_the_same_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sinssim.experiments.ensembles.ensemble_errors.AT_ONCE", 100)
    assert spans_of(30, 10) == [slice(0, 3), slice(3, 6), slice(6, 10)]  # 300 numbers in three parts
    assert spans_of(1000, 7) == [slice(0, 2), slice(2, 4), slice(4, 7)]  # of two epochs at least
    assert groups_of(7, 50) == [slice(0, 1), slice(1, 3), slice(3, 5), slice(5, 7)]


def test_squares_of_innovations_belong_to_the_next_epoch() -> None:
    """Epochs at 2, 4, 7 s: a reading at an epoch counts there, one after the last one counts at the last."""
    plan = fake(sensors=("gnss", "baro"), epochs=np.array([2.0, 4.0, 7.0]))
    two = fake(sensor="gnss", time=np.array([0.5, 2.0, 2.1, 4.0, 6.0]), nis=np.array([1.0, 2.0, np.nan, 5.0, 7.0]),
               value=np.zeros((5, 3)))  # fmt: skip
    late = fake(sensor="gnss", time=np.array([7.5]), nis=np.array([11.0]), value=np.zeros((1, 2)))
    baro = fake(sensor="baro", time=np.array([3.0]), nis=np.array([13.0]), value=np.zeros((1, 1)))
    errors = empty(2, 3, (), ("x",), ("gnss", "baro"))
    ensemble_execution._store_nis(plan, fake(innovations=(two, late, baro)), errors, 1)
    assert errors.nis["gnss"][1].tolist() == [3.0, 5.0, 18.0]
    assert errors.nis_freedom["gnss"][1].tolist() == [6.0, 3.0, 5.0]
    assert errors.nis["baro"][1].tolist() == [0.0, 13.0, 0.0]
    assert errors.nis_freedom["baro"][1].tolist() == [0.0, 1.0, 0.0]


def test_squares_of_errors_at_the_covariance_before_each_epoch() -> None:
    """Covariances at rows 2 and 5; epochs at rows 1 (before any), 4 and 5: 9/4 + 16/8, 25/2 + 1/4."""
    covariance = np.array([np.diag([4.0, 8.0, 1.0]), np.diag([2.0, 4.0, 1.0])])
    estimate = fake(
        rows=np.array([2, 5]),
        covariance=covariance,
        model=fake(compared={"position": np.eye(3)[:2], "x": np.eye(3)[2:]}),
    )
    states = {2: [3.0, 4.0, 0.5], 5: [5.0, 1.0, 2.0]}
    aided = fake(estimate=estimate, state_errors_at=lambda rows: np.array([states[k] for k in rows.tolist()]))
    errors: RunErrors = empty(2, 4, (), ("all states", "position", "bias"))
    ensemble_execution._store_nees(aided, errors, 1, np.array([0, 1, 3]), np.array([1, 4, 5]))
    nan = math.nan
    assert errors.nees["position"][1] == pytest.approx([nan, 4.25, nan, 12.75], nan_ok=True)
    assert errors.nees["all states"][1] == pytest.approx([nan, 4.5, nan, 16.75], nan_ok=True)
    assert errors.nees_freedom["position"][1] == pytest.approx([nan, 2.0, nan, 2.0], nan_ok=True)
    assert errors.nees_freedom["all states"][1] == pytest.approx([nan, 3.0, nan, 3.0], nan_ok=True)
    assert np.isnan(errors.nees["bias"]).all()  # a block that this run's filter does not have


def truth(lasts: float, sample: float, start: float = 5.0) -> Any:
    return fake(time=start + sample * np.arange(round(lasts / sample) + 1))


def test_epochs_at_whole_seconds_and_samples() -> None:
    """About 500: of 1700 s each 3 s, of 40 s with samples of 50 ms each 0.05 s, of 62 s with 0.04 s each 0.12 s."""
    assert np.diff(_epochs(truth(1700.0, 0.5), None)).tolist() == [3.0] * 566 + [2.0]
    assert np.diff(_epochs(truth(40.0, 0.05), None)) == pytest.approx(0.05)
    assert np.diff(_epochs(truth(62.0, 0.04), None))[:-1] == pytest.approx(0.12)
    given = _epochs(truth(10.0, 0.5), 3.2)
    assert given.tolist() == [5.0, 8.0, 11.5, 14.5, 15.0]  # the samples nearest to 3.2, 6.4 and 9.6 s, and the end
    for step, words in ((0.49, "from one sample, 0.5 s, to the length of the run, 10 s"), (10.1, "10.1 must be from")):
        with pytest.raises(InputError, match=words):
            _epochs(truth(10.0, 0.5), step)
    with pytest.raises(InputError, match=r"gives 200000 epochs over 1e\+06 s; at most 100000 are kept: at least 10 s"):
        _epochs(truth(1e6, 5.0), 5.0)


def test_times_since_the_start_become_epochs() -> None:
    motion, epochs = truth(10.0, 0.5), np.array([5.0, 10.0, 15.0])
    asked = [(2.5, "a"), (5.0, "b"), (10.0, "c"), (0.0, "d")]
    found, extra = _with_times(motion, epochs, asked, None)
    assert (found.tolist(), extra) == ([5.0, 7.5, 10.0, 15.0], (7.5,))
    kept, extra = _with_times(motion, epochs, [(2.5, "a")], [6.5, 6.7])  # one that is no sample is not taken
    assert (kept.tolist(), extra) == ([5.0, 6.5, 10.0, 15.0], (6.5,))
    with pytest.raises(
        InputError, match=r"b: 2\.6 s is between two samples of the run, which are 0\.5 s apart; .* at 2\.5 s"
    ):
        _with_times(motion, epochs, [(2.6, "b")], None)
    with pytest.raises(InputError, match=r"b: 10\.1 s lies outside the run, which lasts 10 s"):
        _with_times(motion, epochs, [(10.1, "b")], None)


def test_what_a_plan_says_of_its_runs() -> None:
    """A great circle of the vertical to the east-south-east at the equator, and no course at rest.

    East the radius of curvature is a, north it is a (1 − e²).
    """
    circle = {"latitude_deg": 0.0, "course_deg": 120.0, "speed_mps": 200.0, "duration_s": 20.0}
    moving = {**PARKED, "great_circle": circle}
    del moving["parked"]
    plan = make_plan(scenario(moving))
    course = math.atan2(math.sin(math.radians(120.0)), (1.0 - 0.00669438) * math.cos(math.radians(120.0)))
    assert plan.course == pytest.approx(course, abs=1e-5)
    assert (plan.solution, plan.filtered, plan.keys, plan.start, plan.chunk) == ("euler", False, (), 0.0, 64)
    rest = make_plan(scenario(ensemble={"solution": "quaternion"}))
    assert math.isnan(rest.course)
    assert rest.solution == "quaternion"
    assert with_runs(rest, 17).scenario.ensemble is not None
    assert with_runs(rest, 17).scenario.ensemble.runs == 17  # type: ignore[union-attr]
    assert with_runs(rest, 17).digest == rest.digest
    for other in (replace(rest, epochs=rest.epochs[1:]), replace(rest, chunk=8), replace(rest, flight="x"),
                  make_plan(scenario(seed=9, ensemble={"solution": "quaternion"}))):  # fmt: skip
        assert other.digest != rest.digest
    assert make_plan(scenario(description="words", ensemble={"solution": "quaternion"})).digest == rest.digest
    aided = make_plan(scenario(AIDED))
    assert aided.filtered
    assert aided.blocks["all states"] == sum(n for name, n in aided.blocks.items() if name != "all states")
    assert {"position": 3, "velocity": 3, "attitude": 3}.items() <= aided.blocks.items()


def test_runs_with_a_motion_of_their_own() -> None:
    """By vibration that is drawn, gravity's remainder, or a varied key of the motion; not by the sensors."""
    heading = {"type": "uniform", "key": "parked.heading_deg", "low": 0.0, "high": 1.0}
    start = {"type": "normal", "key": "navigation.initial_error.north_m", "mean": 0.0, "sigma": 1.0}
    shaking = ({"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0},)
    for changes, own in (
        ({}, False), ({"ensemble": {"vary": (start,)}}, False), ({"ensemble": {"vary": (heading,)}}, True),
        ({"vibration": shaking}, True), ({"gravity": {"remainder": {"anomaly_sigma_mgal": 9.0}}}, True),
    ):  # fmt: skip
        assert motions_differ(scenario(**changes)) == own, changes
    base = scenario()
    assert truth_key(base) != truth_key(scenario(parked={**PARKED["parked"], "heading_deg": 1.0}))
    assert truth_key(base) != truth_key(scenario(imu={**PARKED["imu"], "rate_hz": 10.0}))
    assert truth_key(base) != truth_key(scenario(imu={**PARKED["imu"], "lever_arm_m": [1.0, 0.0, 0.0]}))
    assert truth_key(base) == truth_key(scenario(imu={**PARKED["imu"], "grade": "ideal"}, seed=99))
    start_of_flight = {"on": "air", "latitude_deg": 5.0, "longitude_deg": 6.0, "altitude_m": 3000.0}
    legs = [{"type": "hold", "duration_s": 9.0}]
    flight: dict[str, Any] = {"aircraft": "737", "legs": legs, "start": start_of_flight}
    for turbulence, own in (({}, False), ({"turbulence": {"severity": 3}}, True)):
        one, other = (
            Scenario.model_validate({"name": "n", "seed": seed, "flight": {**flight, **turbulence}}) for seed in (1, 2)
        )
        assert (truth_key(one) != truth_key(other)) == own


def test_members_draw_from_their_own_seed() -> None:
    assert ensemble_plan.run_seed(7, 3) != ensemble_plan.run_seed(7, 4)
    assert ensemble_plan.run_seed(7, 3) != ensemble_plan.run_seed(8, 3)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (89.4, "89 s"), (90.0, "2 min"), (5399.0, "90 min"), (5400.0, "1.5 h")]
)
def test_time_left_in_words(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


def test_the_prediction_is_that_of_the_time_since_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Epochs at 10, 13 and 40 s of a run that starts at 10 s; the budget has a further instant."""
    asked: dict[str, Any] = {}

    def budget(scenario: Any, **given: Any) -> Any:
        asked.update(given)
        return fake(time=np.array([0.0, 1.0, 3.0, 30.0]), sigma=lambda: np.arange(36.0).reshape(4, 9))

    monkeypatch.setattr("sinssim.analyses.error_budget.covariance_budget.budget", budget)
    plan = replace(make_plan(scenario()), epochs=np.array([10.0, 13.0, 40.0]), start=10.0)
    found = predicted_sigma(plan)
    assert found is not None
    assert found[:, 0].tolist() == [0.0, 18.0, 27.0]
    assert asked == {"times": [0.0, 3.0, 30.0], "solution": "inertial"}
    predicted_sigma(replace(plan, solution="aided"))
    assert asked["solution"] == "filter"


def test_how_many_runs_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cores, or as many runs as the memory holds: each has 600 samples of 30 s, and a file of 64 runs."""
    plan = replace(make_plan(scenario()), epochs=np.array([0.0, 10.0, 30.0]), start=0.0)
    each = ensemble_run._SAMPLE_BYTES * 600.0 + ensemble_run._OF_FILE * 64 * 8.0 * 9 * 3
    monkeypatch.setattr("os.cpu_count", lambda: 5)
    for memory, count in ((3.5 * each, 3), (0.5 * each, 1), (99.0 * each, 5)):
        monkeypatch.setattr(ensemble_run, "machine_memory", lambda memory=memory: memory / ensemble_run._OF_MEMORY)
        assert ensemble_run.runs_at_a_time(plan) == count


def test_the_next_epochs_of_an_ensemble_that_is_continued() -> None:
    plan = replace(make_plan(scenario()), epochs=np.array([10.0, 13.5, 40.0]), start=10.0)
    check_kept(plan, parse_requirements(["r95(3.5 s) <= 1 m", "r95(end) <= 1 m"]), [30.0])
    with pytest.raises(InputError, match=r"times \(--at\): 20 s: .* nearest epochs are 3\.5 s and 30 s"):
        check_kept(plan, (), [20.0])


def test_samples_from_which_a_batch_pays() -> None:
    """(n + 7000) runs from 4e7 on: of 1000 samples 5000 runs, of 93 000 samples 400 runs."""
    base = scenario(great_circle={"latitude_deg": 0.0, "course_deg": 9.0, "speed_mps": 9.0, "duration_s": 30.0},
                    parked=None, navigation={})  # fmt: skip
    for samples, runs, reason in (
        (1000, 5000, None), (1000, 4999, "5e+06 samples are too few to compensate for compiling the batch"),
        (93_000, 400, None), (93_000, 399, "3.71e+07 samples are too few to compensate for compiling the batch"),
    ):  # fmt: skip
        truths: Any = fake(of=lambda scenario, n=samples: fake(ideal=range(n)))
        assert batch_navigation.why_not_batch(with_runs(make_plan(base), runs), truths) == reason
