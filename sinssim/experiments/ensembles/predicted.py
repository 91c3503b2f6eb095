"""The σ that the covariance budget predicts for an ensemble."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.errors import SinssimError, SinssimWarning
from sinssim.scenario.sections.ensemble import EnsembleSection

_FEW = 20

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.plan import Plan


def predicted_sigma(plan: Plan) -> Array | None:
    """Return σ of the errors at the epochs by the propagation of covariances, without any run.

    Returns:
        (K, 9): position, velocity and attitude, north, east, down: m, m/s, rad; of the filter's solution if the runs
        have a filter. None with varied keys, which the budget does not know; for fewer than 20 runs with a filter,
        whose budget takes as long as one or two of them; and if the scenario has no budget.
    """
    runs = (plan.scenario.ensemble or EnsembleSection()).runs
    if plan.keys or (plan.filtered and runs < _FEW):
        return None
    from sinssim.analyses.error_budget.analyse import budget

    elapsed = plan.epochs - plan.start
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SinssimWarning)  # the ensemble itself has warned
            found = budget(plan.scenario, times=elapsed.tolist(), solution="filter" if plan.filtered else "inertial")
    except SinssimError:
        return None
    rows = np.abs(found.time[:, None] - elapsed).argmin(axis=0)
    return np.asarray(found.sigma()[rows])
