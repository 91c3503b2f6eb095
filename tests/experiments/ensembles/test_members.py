"""Seeds and varied keys of the runs."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from sinssim.experiments.ensembles.ensemble_plan import member, run_seed
from tests.experiments.ensembles.examples import scenario


def test_seeds_follow_from_seed_and_number_alone() -> None:
    digest = int(hashlib.sha256(b"sinssim ensemble 7 run 3").hexdigest()[:16], 16)
    assert run_seed(7, 3) == digest >> 11
    seeds = {run_seed(seed, number) for seed in range(20) for number in range(1000)}
    assert len(seeds) == 20_000
    assert max(seeds) < 2**53


def test_values_have_their_distributions() -> None:
    """By Kolmogorov-Smirnov and χ² over 2000 runs, at 0.1 %; the seeds are fixed."""
    vary = (
        {"type": "normal", "key": "navigation.initial_error.north_m", "mean": 10.0, "sigma": 5.0},
        {"type": "uniform", "key": "parked.heading_deg", "low": -30.0, "high": 90.0},
        {"type": "choice", "key": "parked.duration_s", "values": [10, 20, 30.0]},
    )
    base = scenario(ensemble={"vary": vary})
    drawn = [member(base, number).values for number in range(2000)]
    north, heading, lasts = (np.array([one[key["key"]] for one in drawn]) for key in vary)
    assert kstest((north - 10.0) / 5.0, "norm").pvalue > 1e-3
    assert kstest((heading + 30.0) / 120.0, "uniform").pvalue > 1e-3
    assert chisquare([np.count_nonzero(lasts == value) for value in (10, 20, 30)]).pvalue > 1e-3
    assert abs(np.corrcoef(north, heading)[0, 1]) < 0.08  # 3.5 standard errors


def test_settings_give_the_same_doubles() -> None:
    base = scenario(ensemble={"vary": ({"type": "uniform", "key": "parked.heading_deg", "low": 0.0, "high": 1e-4},)})
    one = member(base, 11)
    seed, heading = one.settings
    assert seed == f"seed={one.seed}"
    assert float(heading.partition("=")[2]) == one.values["parked.heading_deg"] == one.scenario.parked.heading_deg


@pytest.mark.parametrize("number", range(3))
def test_a_member_without_varied_keys_is_the_scenario_with_another_seed(number: int) -> None:
    base = scenario()
    assert member(base, number).scenario == base.model_copy(update={"seed": run_seed(base.seed, number)})
