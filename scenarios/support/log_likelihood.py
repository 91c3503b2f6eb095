"""Noise of a recorded unit in motion: what makes the filter's innovations most likely.

The innovations ν of a filter that is told the right noise are white with the covariance S that it computes. Their
likelihood, log L = −½ Σ (ln det S + νᵀS⁻¹ν), is largest there (Schweppe's form; Maybeck, Stochastic Models, Estimation
and Control, vol. 2, 10.2). A reading counts at most as much as the filter's gate lets pass, so that jumps of the fixes
do not decide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sinssim.estimation.filter_start import Start
from sinssim.simulation.recorded_filter_run import Prepared, aid_recorded

SETTLED = 20.0
"""Innovations after this time count, s: the first ones depend on the alignment."""
KEYS = ("accel_vrw_ug_sqrt_hz", "gyro_arw_deg_sqrt_h", "gyro_instability_deg_h", "accel_instability_ug")
"""Keys of [imu] that are searched for, the most influential first."""
GAIN = 0.5
"""Least gain of log L that counts: a noise that the log does not show is not followed down to zero."""
FACTORS = ("sigma_factor", "velocity_sigma_factor")
"""Keys of [log.gnss] that are searched for."""


def with_values(prepared: Prepared, values: dict[str, float]) -> Prepared:
    """Return a prepared log whose filter is told other noise.

    Args:
        prepared: the log.
        values: values of `KEYS` and `FACTORS`; the factors are relative to the prepared readings.

    Returns:
        The same data with other [imu] and other σ of the fixes.
    """
    imu = prepared.scenario.imu.model_copy(update={key: values[key] for key in KEYS if key in values})
    position, velocity = (values.get(key, 1.0) for key in FACTORS)
    factor = {"gnss-position": position, "gnss-velocity": velocity}
    sensed = tuple(
        replace(
            one, measurements=replace(one.measurements, sigma=one.measurements.sigma * factor[one.measurements.kind])
        )
        if one.measurements.kind in factor
        else one
        for one in prepared.log.sensed
    )
    return replace(
        prepared,
        scenario=prepared.scenario.model_copy(update={"imu": imu}),
        log=replace(prepared.log, sensed=sensed),
    )


def log_likelihood(prepared: Prepared) -> tuple[float, dict[str, float]]:
    """Return the log-likelihood of the innovations, and their mean square per component by sensor.

    Args:
        prepared: the log, and the noise that the filter is told.

    Returns:
        log L, and νᵀS⁻¹ν divided by its number of components, the mean of every sensor.
    """
    imu = prepared.log.imu
    estimate = aid_recorded(prepared, imu, Start(imu, prepared.start.state, None), history=False)
    total, squares = 0.0, {}
    if estimate.divergence is not None:
        return -np.inf, {}
    for one in estimate.innovations:
        rows = np.flatnonzero(np.isfinite(one.nis) & (one.time > SETTLED))
        nis = np.minimum(one.nis[rows], one.bound)
        total -= 0.5 * float(np.linalg.slogdet(one.covariance_at(rows))[1].sum() + nis.sum())
        squares[one.sensor] = float(np.mean(nis)) / one.value.shape[1]
    return total, squares


def most_likely(
    prepared: Prepared,
    first: dict[str, float],
    factors: tuple[str, ...],
    told: Callable[[str], None],
    finest: float = 0.3,
) -> tuple[dict[str, float], float]:
    """Return the noise under which the innovations are most likely.

    A search along one key after the other, by factors: 2 at first, the square root of it when neither helps.

    Args:
        prepared: the log.
        first: values to start from, of the keys that are searched for.
        factors: keys of `FACTORS` that are searched for, too.
        told: called with a sentence after every step forward.
        finest: step, as a power of two, below which the search along a key ends.

    Returns:
        The values, and log L.
    """
    base = {**dict.fromkeys(factors, 1.0), **first}
    best, squares = log_likelihood(with_values(prepared, base))
    # σ that explain the innovations if the unit is right: a start that saves steps
    guess = {**base}
    for key, sensor in zip(FACTORS, ("gnss-position", "gnss-velocity"), strict=True):
        if key in factors and sensor in squares:
            guess[key] = float(np.sqrt(np.clip(squares[sensor], 0.01, 100.0)))
    better, _ = log_likelihood(with_values(prepared, guess))
    values, best = (guess, better) if better > best else (base, best)
    steps = dict.fromkeys(values, 1.0)
    while any(step >= finest for step in steps.values()):
        for key in [key for key, step in steps.items() if step >= finest]:
            for power in (steps[key], -steps[key]):
                trial = {**values, key: values[key] * 2.0**power}
                found, squares = log_likelihood(with_values(prepared, trial))
                if found > best + GAIN:
                    values, best = trial, found
                    told(f"log L {best:.1f}: {key} {trial[key]:.4g}")
                    break
            else:
                steps[key] *= 0.5
    return values, best
