"""The σ of the covariance budget beside that of the runs."""

from __future__ import annotations

import numpy as np
import pytest

import sinssim
from sinssim.experiments.ensembles.ensemble_plan import make_plan, with_runs
from sinssim.experiments.ensembles.ensemble_summary import predicted_sigma
from tests.experiments.ensembles.examples import AIDED, scenario
from tests.slow import slow


@pytest.mark.parametrize("runs", [80, *slow(640)])
def test_runs_have_the_predicted_sigma(runs: int) -> None:
    """The standard error of σ is 2.8 % of 640 runs: off by 5.3 of them with a probability below 1e-6."""
    result = sinssim.ensemble(scenario(ensemble={"epoch_s": 7.0}), runs)
    sigma = predicted_sigma(result.plan)
    assert sigma is not None
    assert sigma.shape == (6, 9)
    found = np.concatenate([result.spread(name).sigma for name in ("position_ned", "velocity_ned", "attitude")], axis=1)
    large = sigma > np.repeat((1e-3, 1e-6, 1e-8), 3)  # below, only rounding is left
    assert large[-1].all()
    np.testing.assert_allclose(found[large], sigma[large], rtol=5.3 / np.sqrt(2 * runs))


def test_where_nothing_is_predicted() -> None:
    vary = ({"type": "uniform", "key": "parked.roll_deg", "low": 0.0, "high": 1.0},)
    assert predicted_sigma(make_plan(scenario(ensemble={"vary": vary}))) is None
    assert predicted_sigma(with_runs(make_plan(scenario(AIDED)), 19)) is None
    north = {"parked": {"latitude_deg": 89.9, "duration_s": 30.0}}
    assert predicted_sigma(make_plan(scenario(**north))) is None  # within half a degree of a pole


@pytest.mark.parametrize("runs", [20, *slow(60)])
def test_filtered_runs_have_the_predicted_sigma(runs: int) -> None:
    """The standard error of σ, 9 % of 60 runs: on average over the epochs and components within 1.6 of them."""
    result = sinssim.ensemble(scenario(AIDED, ensemble={"epoch_s": 10.0}), runs, threads=1)
    sigma = predicted_sigma(result.plan)
    assert sigma is not None
    found = np.concatenate([result.spread(name).sigma for name in ("position_ned", "velocity_ned", "attitude")], axis=1)
    ratio = found / sigma
    error = 1.0 / np.sqrt(2 * runs)
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=1.6 * error)
    assert ratio.min() > 1.0 - 4.3 * error
    assert ratio.max() < 1.0 + 5.4 * error
