"""The verdict on a filter over all runs: sound filters pass, others fail with their worst test and its cause."""

from __future__ import annotations

import html
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import chi2

import sinssim
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, empty
from sinssim.experiments.ensembles.ensemble_plan import Plan, make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult, MeanSquare, _with_common
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import consistency, consistency_sentences, ensemble_numbers
from sinssim.recording.console import show
from sinssim.recording.page import page_of
from sinssim.statistics.chi_square import extreme, mean_square_band
from tests.experiments.ensembles.examples import AIDED, scenario

RUNS, EPOCHS = 30, 41
STATES = {"all states": 6, "position": 3, "attitude": 3}


@cache
def aided_plan() -> Plan:
    return replace(make_plan(scenario(AIDED)), epochs=np.linspace(0.0, 40.0, EPOCHS))


def drawn(seed: int, attitude: float = 1.0, innovations: float = 1.0) -> EnsembleResult:
    """Return runs of a filter whose errors and innovations are so many times as large as it states.

    Errors are half constant in each run and half new at each epoch: the verdict assumes no independence in time.
    """
    rng = np.random.default_rng(seed)
    plan = aided_plan()
    errors = empty(RUNS, EPOCHS, (), tuple(STATES), ("gnss-position",))
    errors.number[:], errors.end[:] = np.arange(RUNS), 40.0
    for vectors in (errors.position_ned, errors.velocity_ned, errors.attitude, errors.final):
        vectors[:] = 0.0
    x = np.sqrt(0.5) * (rng.standard_normal((RUNS, 1, 6)) + rng.standard_normal((RUNS, EPOCHS, 6)))
    x[:, :, 3:] *= attitude
    for name, part in (("all states", x), ("position", x[:, :, :3]), ("attitude", x[:, :, 3:])):
        errors.nees[name][:], errors.nees_freedom[name][:] = np.sum(part**2, axis=2), part.shape[2]
    errors.nis["gnss-position"][:] = innovations**2 * rng.chisquare(3, (RUNS, EPOCHS))
    errors.nis_freedom["gnss-position"][:] = 3.0
    return EnsembleResult(plan, errors, media=EnsembleMedia())


def test_a_sound_filter_fails_rarely() -> None:
    """At most 1 % of false alarms: over 100 ensembles at most 5, which would be by chance once in 1600 times."""
    wrong = sum(consistency(drawn(seed)).verdict != "consistent" for seed in range(100))
    assert wrong <= 5


def test_errors_larger_than_stated_name_the_worst_test() -> None:
    """Of 1.5 times the stated size: ANEES of the attitude about 2.25, each number against χ² by hand."""
    for seed in range(10):
        result = drawn(seed, attitude=1.5)
        found = consistency(result)
        worst = found.worst
        assert (found.verdict, worst.test, worst.name) == ("not consistent", "ANEES", "attitude")
        value = result.nees["attitude"].value
        assert worst.value == value.max()
        assert worst.time_s == result.time[np.argmax(value)]
        tests = len(STATES) * EPOCHS + 1
        assert worst.tests == tests
        by_chance = tests * chi2.sf(value.max() * 3 * RUNS, 3 * RUNS)
        assert worst.probability == pytest.approx(by_chance, rel=1e-9, abs=0.0)
        assert worst.limit == pytest.approx(chi2.isf(0.01 / tests, 3 * RUNS) / (3 * RUNS), rel=1e-9)


@pytest.mark.parametrize(("probability", "verdict"), [(0.008, "not consistent"), (0.012, "consistent")])
def test_both_sides_of_one_per_cent(probability: float, verdict: str) -> None:
    """All 124 tests at what is expected, but one: the attitude at one instant, with 90 degrees of freedom."""
    result = drawn(3)
    for name, size in STATES.items():
        result.errors.nees[name][:] = float(size)
    result.errors.nis["gnss-position"][:] = 3.0
    result.errors.nees["attitude"][:, 20] = chi2.isf(probability / 124.0, 90) / RUNS
    found = consistency(result)
    assert found is not None
    assert (found.verdict, found.worst.time_s) == (verdict, 20.0)
    assert found.worst.probability == pytest.approx(probability, rel=1e-6)


@pytest.mark.parametrize("size", [1.0 / 1.1, 1.1])
def test_innovations_of_another_size_on_both_sides(size: float) -> None:
    """3690 degrees of freedom have a σ of 2.3 % of the mean, and the mean is off by 17 or 21 %."""
    found = consistency(drawn(3, innovations=size))
    assert (found.verdict, found.worst.test, found.worst.time_s) == ("not consistent", "NIS", None)
    assert (found.worst.value < found.worst.limit) == (size < 1.0)
    assert "NIS of gnss-position over all epochs" in next(consistency_sentences(found, RUNS))


def test_errors_smaller_than_stated_do_not_count() -> None:
    assert consistency(drawn(3, attitude=0.3)).verdict == "consistent"


def test_a_diverged_run_speaks_against_the_filter() -> None:
    result = drawn(3)
    result.errors.failure[4] = "the filter diverged at t = 3.00 s: its covariance is not positive."
    for values in (result.errors.nees, result.errors.nees_freedom, result.errors.nis, result.errors.nis_freedom):
        for one in values.values():
            one[4] = np.nan
    numbers = ensemble_numbers(result)
    assert numbers.consistency.verdict == "not consistent"
    (sentence,) = consistency_sentences(numbers.consistency, len(result))
    assert sentence.startswith(f"The filter is not consistent over {RUNS - 1} runs: it diverged in 1 of {RUNS} runs; ")


def test_without_a_filter_there_is_no_verdict() -> None:
    result = drawn(3)
    errors = result.errors
    table = np.stack([errors.column(name) for name in COMPONENTS])
    result.errors = replace(errors, blocks=(), sensors=(), table=table)
    assert consistency(result) is None
    assert not list(consistency_sentences(ensemble_numbers(result).consistency, RUNS))


def test_probabilities_too_small_for_a_number_are_ranked() -> None:
    found = extreme([1.0, 50.0, 80.0, np.nan], [1e3, 1e3, 1e3, 1e3], [False] * 4, 0.01)
    assert (found.place, found.probability, found.tests) == (2, 0.0, 3)
    assert extreme([np.nan], [0.0], [True], 0.01) is None


def test_runs_with_gravity_that_the_filter_does_not_know() -> None:
    """A parked laser unit: consistent in normal gravity, not in another field, which is named as by a single run."""
    from sinssim.scenario.filter_model import notes
    from tests.scenario.test_unknown_gravity import INERTIAL, parked

    sound = sinssim.ensemble(parked(), 3)
    assert ensemble_numbers(sound).consistency.verdict == "consistent"
    other = parked(gravity={"model": "egm2008"}, filter={"alignment_s": 60.0, "states": INERTIAL})
    result = sinssim.ensemble(other, 3)
    numbers = ensemble_numbers(result)
    found, (note,) = numbers.consistency, notes(other)
    assert found.verdict == "not consistent"
    assert found.worst.probability < 1e-6
    assert note in found.hints
    assert note in list(consistency_sentences(numbers.consistency, 3))
    console = Console(record=True, width=10_000)
    show(result.exhibits, console)
    for text in (console.export_text(), page_of(result.exhibits)):
        assert note in html.unescape(text.replace("\n", " "))
        assert "Therefore the filter is not consistent over 3 runs: the worst of " in text


def test_gravity_that_all_runs_share_counts_once() -> None:
    """Of 12 states 3 have the same errors in 40 runs: spread of the mean square, and its band, by chance."""
    rng = np.random.default_rng(12)
    own, common = rng.chisquare(9.0 * 40.0, 4000), 40.0 * rng.chisquare(3.0, 4000)
    value = (own + common) / (12.0 * 40.0)
    plain = MeanSquare("all states", value, mean_square_band(np.full(4000, 480.0)), np.full(4000, 480.0))
    square = _with_common(plain, np.full((40, 4000), 12.0), 3)
    assert square.freedom[0] == pytest.approx(480.0**2 / (9.0 * 40.0 + 3.0 * 1600.0))
    assert np.var(value) == pytest.approx(2.0 / square.freedom[0], rel=0.1)
    inside = (square.band.low < value) & (value < square.band.high)
    assert 0.93 < np.mean(inside) < 0.97  # about ±2.3 of its own σ of 0.34 %, and χ² has another shape
    assert np.mean((plain.band.low < value) & (value < plain.band.high)) < 0.6
    few = _with_common(plain, np.vstack([np.full((1, 4000), 12.0), np.zeros((39, 4000))]), 3)
    np.testing.assert_array_equal(few.freedom, plain.freedom)  # one run alone shares nothing
