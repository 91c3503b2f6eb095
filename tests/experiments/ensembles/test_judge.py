"""Verdicts of an ensemble: whose errors count, at which instants, and how often it may be looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import sinssim
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import summary_of
from sinssim.experiments.ensembles.ensemble_verdicts import LOOKS, Looks, check_kept, judge, looks_of
from sinssim.statistics.requirements import parse_requirement, parse_requirements
from tests.experiments.ensembles.examples import scenario
from tests.experiments.ensembles.test_result import NMI_H, straight
from tests.slow import slow


def drifting(runs: int, seed: int) -> EnsembleResult:
    """Return runs that drift north at normal rates with a σ of 1 nmi/h for an hour."""
    return straight(np.random.default_rng(seed).normal(size=runs))


def test_the_value_is_the_r95_that_is_shown() -> None:
    result = drifting(300, 1)
    for when in ("end", "3600 s", "1800 s", "run"):
        found = judge(result, parse_requirement(f"r95({when}) <= 10 nmi"))
        assert found.verdict == "met"
        assert found.value == result.r95.value[30 if when == "1800 s" else 60]
    rate = judge(result, parse_requirement("rate(end) <= 10 nmi/h"))
    assert rate.value / NMI_H == pytest.approx(summary_of(result)["rate_nmi_h"]["end"]["r95"]["value"], rel=1e-12)


def test_a_component_is_judged_by_its_root_mean_square() -> None:
    result = drifting(300, 2)
    found = judge(result, parse_requirement("position_north(end) <= 0.5 nmi"))
    assert found.verdict == "not met"
    assert found.value == pytest.approx(np.sqrt(np.mean(result.errors.final[:, 0] ** 2)), rel=1e-12)
    assert judge(result, parse_requirement("heading <= 1 arcsec")).verdict == "met"


def test_failed_runs_are_infinitely_far_off() -> None:
    """Of 200 runs 30 failed: a share of 85 % lies within any limit, which refutes 95 % and shows 50 %."""
    result = straight(np.full(200, 0.1), failed=30)
    assert judge(result, parse_requirement("r95(run) <= 100 nmi")).verdict == "not met"
    assert judge(result, parse_requirement("cep(run) <= 100 nmi")).verdict == "met"
    assert judge(result, parse_requirement("velocity_north(end) <= 100 m/s")).value == np.inf


def test_a_run_that_has_ended_does_not_count() -> None:
    """Half of the runs end after half an hour: they count until then, and at the end with their own."""
    result = straight(np.full(400, 1.0))
    result.errors.position_ned[:200, 31:] = np.nan
    result.errors.final[:200, 0] = result.errors.position_ned[:200, 30, 0]
    result.errors.end[:200] = 1800.0
    after = judge(result, parse_requirement("r95(2700 s) <= 1 nmi"))
    assert (after.verdict, after.value) == ("met", pytest.approx(0.75 * 1852.0))
    assert judge(result, parse_requirement("r95(run) <= 1.01 nmi")).verdict == "met"
    assert judge(result, parse_requirement("rate(end) <= 1.01 nmi/h")).value == pytest.approx(NMI_H)
    # 200 runs, not 400, decide after their end: 80 of them alone would not
    few = straight(np.full(80, 1.0))
    few.errors.position_ned[:40, 31:] = np.nan
    assert judge(few, parse_requirement("r95(1800 s) <= 1 nmi")).verdict == "met"
    assert judge(few, parse_requirement("r95(2700 s) <= 1 nmi")).verdict == "undecided"


def test_the_rate_of_a_run_is_that_of_its_own_time() -> None:
    """The worst two of ten runs end after a quarter of the hour, with 9 and 10 nmi/h: 2.25 and 2.5 nmi."""
    result = straight(np.arange(1.0, 11.0))
    result.errors.position_ned[8:, 16:] = np.nan
    result.errors.final[8:, 0] = result.errors.position_ned[8:, 15, 0]
    result.errors.end[8:] = 900.0
    found = judge(result, parse_requirement("rate(end) <= 30 nmi/h"))
    assert found.value / NMI_H == pytest.approx(np.percentile(np.arange(1.0, 11.0), 95.0, method="median_unbiased"))
    assert found.time == 3600.0
    r95 = judge(result, parse_requirement("r95(end) <= 30 nmi")).value / 1852.0
    assert r95 == pytest.approx(8.0)  # the largest of 1 … 8, 2.25 and 2.5 nmi


def test_rates_by_the_time_since_the_start() -> None:
    """Of a run that begins at 5000 s of its clock."""
    result = straight(np.full(100, 1.0))
    result.plan = replace(result.plan, epochs=result.plan.epochs + 5000.0, start=5000.0)
    result.errors.end += 5000.0
    for when, time in (("1800 s", 1800.0), ("end", 3600.0)):
        found = judge(result, parse_requirement(f"rate({when}) <= 2 nmi/h"))
        assert (found.value / NMI_H, found.time) == pytest.approx((1.0, time))


def test_before_a_filter_has_begun_there_is_nothing_to_judge() -> None:
    result = straight(np.full(200, 1.0), failed=1)
    result.errors.position_ned[:, :10] = np.nan
    assert judge(result, parse_requirement("r95(run) <= 1.01 nmi")).verdict == "met"
    none = judge(result, parse_requirement("r95(60 s) <= 1.01 nmi"))
    assert none.verdict == "undecided"
    assert np.isnan(none.value)


def test_looks_double_the_number_of_runs() -> None:
    assert looks_of(100) == (100, 200, 400, 800, 1600)
    assert looks_of(6_000_000) == (6_000_000, 10_000_000)


def test_a_verdict_that_is_reached_stands_and_judges_the_first_runs() -> None:
    """The second look is at more runs, of which the further ones would refute the first requirement."""
    rates = np.concatenate([np.full(200, 0.1), np.full(200, 5.0)])
    result = straight(rates)
    looks = Looks(parse_requirements(["r95(end) <= 1 nmi", "cep(end) <= 100 nmi"]), 200, until_decided=True)
    looks.look(result, 200)
    assert looks.decided
    assert [one.verdict for one in looks.verdicts if one] == ["met", "met"]
    assert [one.runs for one in looks.verdicts if one] == [200, 200]
    once = Looks(parse_requirements("r95(end) <= 1 nmi"), 200, until_decided=False)
    once.look(result, 200)
    assert [(one.verdict, one.runs) for one in once.verdicts if one] == [("not met", 400)]


def test_each_look_has_a_fifth_of_the_probability_of_error() -> None:
    """All inside: R95 is shown by N with 0.95^N below half the probability of error, 72 once and 104 at 1 %."""
    assert 0.95**104 < 0.005 < 0.95**103
    requirement = "r95(end) <= 1 nmi"
    for runs, decided in ((103, False), (104, True)):
        looks = Looks(parse_requirements(requirement), runs, until_decided=True)
        looks.look(straight(np.full(runs, 0.1)), runs)
        assert looks.decided == decided


@pytest.mark.parametrize("count", [100, *slow(400)])
def test_all_looks_together_err_with_at_most_five_per_cent(count: int) -> None:
    """CEP exactly at its limit, looked at up to five times: any verdict is an error of either side.

    With a true probability of 5 % there are more errors than that by chance with 2e-3; the binomial interval errs less.
    """
    limit = 0.6744897501960817  # median of |x| of a normal x
    base, wrong = straight(np.ones(25 * 16)), 0
    for seed in range(count):
        rates = np.random.default_rng(1000 + seed).normal(size=25 * 16)
        errors = replace(base.errors, final=base.errors.final * rates[:, None])
        looks = Looks(parse_requirements(f"cep(end) <= {limit} nmi"), 25, until_decided=True)
        for number in looks.numbers:
            looks.look(EnsembleResult(base.plan, errors, media=EnsembleMedia()), number)
        wrong += looks.decided
    assert len(looks.done) == LOOKS
    assert wrong <= binom.isf(2e-3, count, 0.05)


def test_the_time_of_a_requirement_becomes_an_epoch() -> None:
    base = scenario(ensemble={"epoch_s": 7.0})
    plain = make_plan(base)
    plan = make_plan(base, None, parse_requirements(["r95(10 s) <= 1 m", "cep(14 s) <= 1 m", "heading <= 1 deg"]))
    assert plain.epochs.tolist() == [0.0, 7.0, 14.0, 21.0, 28.0, 30.0]
    assert plan.epochs.tolist() == [0.0, 7.0, 10.0, 14.0, 21.0, 28.0, 30.0]
    assert plan.extra == (10.0,)
    assert plan.regular.tolist() == [True, True, False, True, True, True, True]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("r95(31 s) <= 1 m", r"'r95\(31 s\) <= 1 m': 31 s lies outside the run, which lasts 30 s"),
        ("r95(10.02 s) <= 1 m", r"10\.02 s is between two samples of the run, which are 0\.05 s apart; .* at 10 s"),
    ],
)
def test_times_without_a_sample_are_refused(text: str, words: str) -> None:
    with pytest.raises(sinssim.InputError, match=words):
        make_plan(scenario(), None, parse_requirements(text))


def test_an_ensemble_that_is_continued_keeps_its_epochs() -> None:
    base, other = scenario(ensemble={"epoch_s": 7.0}), parse_requirements("r95(11 s) <= 1 m")
    plan = make_plan(base, None, other, stored=[10.0])
    assert plan.extra == (10.0,)
    with pytest.raises(sinssim.InputError, match=r"no errors at 11 s, .* nearest epochs are 10 s and 14 s"):
        check_kept(plan, other)
    check_kept(plan, parse_requirements(["r95(10 s) <= 1 m", "cep <= 1 m"]))
