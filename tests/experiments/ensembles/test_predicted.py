"""The σ of the covariance budget beside that of the runs."""

from __future__ import annotations

import numpy as np

import sinssim
from sinssim.experiments.ensembles.ensemble_plan import make_plan, with_runs
from sinssim.experiments.ensembles.ensemble_statistics import predicted_sigma
from tests.experiments.ensembles.examples import AIDED, scenario


def test_runs_have_the_predicted_sigma() -> None:
    """Of 640 runs, whose σ has a standard error of 2.8 %: off by more than 15 % with a probability below 1e-6."""
    result = sinssim.ensemble(scenario(ensemble={"epoch_s": 7.0}), 640)
    sigma = predicted_sigma(result.plan)
    assert sigma is not None
    assert sigma.shape == (6, 9)
    found = np.concatenate([result.spread(name).sigma for name in ("position_ned", "velocity_ned", "attitude")], axis=1)
    large = sigma > np.repeat((1e-3, 1e-6, 1e-8), 3)  # below, only rounding is left
    assert large[-1].all()
    np.testing.assert_allclose(found[large], sigma[large], rtol=0.15)


def test_where_nothing_is_predicted() -> None:
    vary = ({"type": "uniform", "key": "parked.roll_deg", "low": 0.0, "high": 1.0},)
    assert predicted_sigma(make_plan(scenario(ensemble={"vary": vary}))) is None
    assert predicted_sigma(with_runs(make_plan(scenario(AIDED)), 19)) is None
    north = {"parked": {"latitude_deg": 89.9, "duration_s": 30.0}}
    assert predicted_sigma(make_plan(scenario(**north))) is None  # within half a degree of a pole


def test_filtered_runs_have_the_predicted_sigma() -> None:
    """Of 60 runs, whose σ has a standard error of 9 %, on average over the epochs and components within 15 %."""
    result = sinssim.ensemble(scenario(AIDED, ensemble={"epoch_s": 10.0}), 60, threads=1)
    sigma = predicted_sigma(result.plan)
    assert sigma is not None
    found = np.concatenate([result.spread(name).sigma for name in ("position_ned", "velocity_ned", "attitude")], axis=1)
    ratio = found / sigma
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.15
    assert ratio.min() > 0.6
    assert ratio.max() < 1.5
