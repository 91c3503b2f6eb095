"""Calibrations of drawn blocks, for the tests of both methods."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import chi2

from sinssim.analyses.calibration_result import CalibrationResult
from sinssim.analyses.turntable_calibration import calibrate
from sinssim.data import Array
from sinssim.scenario import Scenario

ARCSECONDS = {"position_sigma_arcsec": 2.0, "tilt_sigma_arcsec": 10.0}
DEGREES = {"position_sigma_arcsec": 3600.0, "tilt_sigma_arcsec": 3600.0}


def scenario(method: str, sequence: str, seed: int = 0, **more: Any) -> Scenario:
    """Return a calibration; `more` has keys of [turntable], and tables "imu" and "calibration"."""
    imu = {"grade": "laser-standard", "rate_hz": 20.0, **more.pop("imu", {})}
    how = {"method": method, **more.pop("calibration", {})}
    table = {"latitude_deg": 50.0, "longitude_deg": 14.0, "altitude_m": 300.0, "sequence": sequence, **more}
    return Scenario.model_validate({"name": "c", "seed": seed, "turntable": table, "imu": imu, "calibration": how})


def drawn(count: int, method: str, sequence: str, **more: Any) -> list[CalibrationResult]:
    """Return calibrations of blocks with different errors on tables with different errors."""
    return [calibrate(scenario(method, sequence, seed, **more)) for seed in range(count)]


def check(results: list[CalibrationResult], one_in: float) -> None:
    """Check that the errors of observable parameters have the stated covariance; fails by chance once in `one_in`.

    Two tests share the probability: the sum of all errors' squares by their covariances, in both directions, and the
    mean square of each parameter over the draws in which it is observable, upwards.
    """
    total = np.sum([one.chi_square_of_errors for one in results], axis=0)
    low, high = chi2.ppf([0.25 / one_in, 1.0 - 0.25 / one_in], total[1])
    assert low < total[0] < high, (total, low, high)
    names = results[0].names
    for k, name in enumerate(names):
        own: Array = np.array([one.normalised_error[k] for one in results if one.observable[k]])  # type: ignore[index]
        if len(own):
            assert np.sum(own**2) < chi2.isf(0.5 / one_in / len(names), len(own)), (name, own)
