"""Verdicts of an ensemble: confidence, coverage, and the number of further runs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sinssim.errors import InputError
from sinssim.statistics.requirements import columns_of, errors_of, joined, parse_requirement, tally, verdict_of
from tests.statistics.verdicts import verdict

_TIME = np.array([0.0, 1800.0, 3600.0])


def radial(runs: int, seed: int, sigma: float = 1.0) -> np.ndarray:
    """Radial errors that grow with time, (N, 3)."""
    errors = np.random.default_rng(seed).normal(0.0, sigma, (2, runs, 1)) * np.array([0.0, 0.5, 1.0])
    return np.hypot(*errors)


_R95 = float(np.sqrt(-2.0 * np.log(0.05)))


@pytest.mark.parametrize(
    ("limit", "expected"), [(1.5 * _R95, "met"), (0.6 * _R95, "not met"), (1.001 * _R95, "undecided")]
)
def test_far_from_the_limit_it_is_decided(limit: float, expected: str) -> None:
    """Of 400 runs; each verdict is wrong by chance with less than 1e-6 for the first two."""
    found = verdict(parse_requirement(f"r95(end) <= {limit} m"), _TIME, radial(400, 3))
    assert found.verdict == expected
    assert found.value == pytest.approx(_R95, rel=0.12)
    assert (found.more_runs == 0) == (expected != "undecided")


def test_the_binomial_interval_decides() -> None:
    """The smallest number of runs, all inside, that shows R95: 0.95^N < 2.5 %, N = 72; with 71 it is open."""
    requirement = parse_requirement("r95(end) <= 1 m")
    small = np.full((72, 3), 0.1)
    assert verdict(requirement, _TIME, small).verdict == "met"
    assert verdict(requirement, _TIME, small[:71]).verdict == "undecided"
    assert verdict(requirement, _TIME, small[:71]).more_runs in (1, 2)


def test_a_failed_run_is_infinitely_far_off() -> None:
    requirement, errors = parse_requirement("r95(end) <= 10 m"), np.full((100, 3), 0.1)
    assert verdict(requirement, _TIME, errors).verdict == "met"
    errors[:20] = np.nan
    assert verdict(requirement, _TIME, errors).verdict == "not met"


def test_at_the_limit_five_per_cent_of_ensembles_decide() -> None:
    """A true percentile exactly at the limit: both verdicts together are wrong with at most 5 %.

    600 ensembles of 200 runs: more than 8.2 % by chance with 5e-4.
    """
    requirement = parse_requirement(f"cep(end) <= {np.sqrt(-2.0 * np.log(0.5))} m")
    decided = [verdict(requirement, _TIME, radial(200, 100 + k)).verdict != "undecided" for k in range(600)]
    assert np.mean(decided) < 0.082
    assert np.mean(decided) > 0.02  # and it is not needlessly timid


def test_the_number_of_further_runs_decides() -> None:
    """A true R95 of 0.9 of the limit: about as many runs as announced decide."""
    requirement = parse_requirement(f"r95(end) <= {_R95 / 0.9} m")
    first = verdict(requirement, _TIME, radial(150, 8))
    assert first.verdict == "undecided"
    assert first.more_runs is not None
    assert verdict(requirement, _TIME, radial(150 + 2 * first.more_runs, 8)).verdict == "met"


def test_a_rate_is_divided_by_the_time() -> None:
    found = verdict(parse_requirement("rate(1800 s) <= 1 m/h"), _TIME, np.full((100, 3), 0.4))
    assert found.verdict == "met"
    assert found.value == pytest.approx(0.4 / 1800.0)


def test_a_component_by_chi_square() -> None:
    """The interval of a root mean square, at its edge."""
    count = 50
    low = np.sqrt(count / stats.chi2.ppf(0.975, count))
    errors = np.ones((count, 3))
    for limit, expected in ((0.999 * low, "not met"), (1.001 * low, "undecided")):
        assert verdict(parse_requirement(f"velocity_east(end) <= {limit} m/s"), _TIME, errors).verdict == expected


def test_over_the_run_every_instant_counts() -> None:
    errors = np.full((200, 3), 0.1)
    errors[:, 1] = 5.0
    found = verdict(parse_requirement("r95(run) <= 1 m"), _TIME, errors)
    assert (found.verdict, found.time, found.value) == ("not met", 1800.0, 5.0)
    assert verdict(parse_requirement("r95(end) <= 1 m"), _TIME, errors).verdict == "met"


def test_wrong_shapes_and_times_are_refused() -> None:
    with pytest.raises(InputError, match="shape"):
        verdict(parse_requirement("r95(end) <= 1 m"), _TIME, np.zeros((5, 2)))


def test_the_errors_that_a_requirement_judges() -> None:
    errors = np.random.default_rng(2).normal(size=(9, 4, 3))

    def judged(text: str) -> np.ndarray:
        return errors_of([errors[place] for place in columns_of(parse_requirement(text))])

    assert judged("cep <= 1 m") == pytest.approx(np.linalg.norm(errors[:2], axis=0))
    assert judged("velocity_down <= 1 m/s") == pytest.approx(errors[5])
    assert judged("heading <= 1 deg") == pytest.approx(errors[8])


@pytest.mark.parametrize("text", ["r95(run) <= 2 m", "velocity_east(run) <= 1.1 m/s", "heading(run) <= 1 deg"])
def test_a_tally_of_some_instants_after_others_is_that_of_all(text: str) -> None:
    """Bit for bit, with runs that end early and failed ones."""
    rng = np.random.default_rng(3)
    time, errors = np.linspace(0.0, 3600.0, 31), rng.normal(size=(300, 31))
    errors[:9, 20:], errors[10] = np.nan, np.inf
    counts = ~np.isnan(errors)
    one = parse_requirement(text)
    parts = [tally(one, time[part], errors[:, part], counts[:, part]) for part in (slice(7), slice(7, 9), slice(9, 31))]
    whole = verdict(one, time, errors, counts)
    assert verdict_of(one, time, joined(parts)) == whole
    assert np.isfinite(whole.time)


def test_a_failed_run_fails_a_component() -> None:
    errors = np.full((50, 3), 0.1)
    errors[7] = np.inf
    found = verdict(parse_requirement("velocity_east(end) <= 1 m/s"), _TIME, errors)
    assert (found.verdict, found.value) == ("not met", np.inf)
