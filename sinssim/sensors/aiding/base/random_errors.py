"""The random errors of aiding sensors; every axis of every term has its own random numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sinssim.data import Array


def white(seed: int, term: str, sigma: Sequence[float] | Array, count: int) -> Array:
    """Return white noise.

    Args:
        seed: the run's seed.
        term: name of the sensor and the error, for example "gnss position noise".
        sigma: 1σ of each axis, (k,).

    Returns:
        (M, k).
    """
    from sinssim.statistics.random_numbers import normals  # needs the compiler

    return np.column_stack([s * normals(seed, term, i, count) for i, s in enumerate(sigma)])


def correlated(seed: int, term: str, sigma: Sequence[float] | Array, time: Array, correlation_time: float) -> Array:
    """Return a stationary first-order Gauss-Markov process.

    Args:
        seed: the run's seed.
        sigma: 1σ of each axis, (k,).
        time: times of the readings, (M,) s.
        correlation_time: s.

    Returns:
        (M, k).
    """
    if not np.any(sigma):
        return np.zeros((len(time), len(sigma)))
    from sinssim.sensors.noise.gauss_markov import gauss_markov

    fresh = white(seed, term, sigma, len(time))
    interval = np.diff(time)
    return np.column_stack([gauss_markov(interval, correlation_time, axis.copy()) for axis in fresh.T])


def turn_on(seed: int, term: str, fixed: float | None, sigma: float, axis: int = 0) -> float:
    """Return an error that is constant during a run: a given value, plus a random one.

    Args:
        seed: the run's seed.
        fixed: the given value, which is the mean over all runs; None is zero.
        sigma: 1σ of the random error; 0 for none.

    Returns:
        The error, in the units of `fixed` and `sigma`.
    """
    if fixed is not None and not sigma:
        return fixed
    from sinssim.statistics.random_numbers import normals

    drawn = sigma * float(normals(seed, term, axis, 1)[0])
    return drawn if fixed is None else fixed + drawn
