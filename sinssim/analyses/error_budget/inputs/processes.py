"""Random processes of the sensors over steps of any length: states, means over a step, driving numbers.

A process of one axis with the states s takes a step by

    s ← A s + E ν,    m = c s + d ν        with independent normal numbers ν of variance 1,

m being the mean of the process over the step. The emulator's own recursions are such steps of one sample
(`sinssim.sensors.imu.error_kernel`); the means over longer steps have the same covariances, except that a rate random
walk is exact here and off by 0.29 T in variance there, T the sampling interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.sensors.noise.flicker import DIRECT, RATES, STATIONARY, WEIGHTS
from sinssim.sensors.noise.gauss_markov import mean_step
from sinssim.truth.gravity.remainder import RemainderModel


class Step(NamedTuple):
    """One step of a process of one axis with p states, driven by q numbers.

    Attributes:
        keep: A, (p, p).
        fresh: E, (p, q).
        mean_of_state: c, (p,).
        mean_of_fresh: d, (q,).
    """

    keep: Array
    fresh: Array
    mean_of_state: Array
    mean_of_fresh: Array


@dataclass(frozen=True)
class GaussMarkov:
    """A stationary first-order process of variance 1.

    Attributes:
        correlation_time: τ, s.
    """

    correlation_time: float

    @property
    def start(self) -> Array:
        """Covariance of the state at the start, (1, 1)."""
        return np.ones((1, 1))

    @property
    def value(self) -> Array:
        """Weights of the states in the process's value, (1,)."""
        return np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]; `mean_step` has the formula."""
        keep, fresh, of_state, of_fresh = mean_step(interval / self.correlation_time)
        return Step(np.array([[keep]]), np.array([[fresh]]), np.array([of_state]), np.array([of_fresh]))


@dataclass(frozen=True)
class Walk:
    """A random walk of density 1, zero at the start."""

    @property
    def start(self) -> Array:
        """Covariance of the state at the start, (1, 1)."""
        return np.zeros((1, 1))

    @property
    def value(self) -> Array:
        """Weights of the states in the process's value, (1,)."""
        return np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]."""
        root = math.sqrt(interval)
        # the mean's departure from half the increment is independent of it and has the variance T/12
        return Step(np.ones((1, 1)), np.array([[root, 0.0]]), np.ones(1), root * np.array([0.5, 1.0 / math.sqrt(12.0)]))


@dataclass(frozen=True)
class Sum:
    """White noise of density 1 with its own integral as the state, which readings of a mean rate contain."""

    @property
    def start(self) -> Array:
        """Covariance of the state at the start, (1, 1)."""
        return np.zeros((1, 1))

    @property
    def value(self) -> Array:
        """Weights of the state in the integral, (1,)."""
        return np.ones(1)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s]: the mean of white noise is its integral over the interval."""
        root = math.sqrt(interval)
        return Step(np.ones((1, 1)), np.array([[root]]), np.zeros(1), np.array([1.0 / root]))


@dataclass(frozen=True)
class Flicker:
    """Flicker noise of B = 1, the sum of ten processes that `sinssim.sensors.noise.flicker` defines for samples.

    Attributes:
        sample: sampling interval, s.
    """

    sample: float

    @property
    def start(self) -> Array:
        """Covariance of the states at the start, (10, 10)."""
        return np.asarray(STATIONARY @ STATIONARY.T)

    @property
    def value(self) -> Array:
        """Weights of the states in the process's value, (10,)."""
        return np.array(WEIGHTS)

    def step(self, interval: float) -> Step:
        """Return the step over an interval [s], rounded to whole samples."""
        return _flicker_step(max(round(interval / self.sample), 1))


@lru_cache(maxsize=64)
def _flicker_step(count: int) -> Step:
    """Return the step over n samples: the n numbers are replaced by eleven with the same joint covariance."""
    kept = 1.0 - np.array(RATES)
    weights = np.array(WEIGHTS)
    power = kept ** np.arange(count + 1)[:, None]  # d_m^k, (n+1, 10)
    sums = np.cumsum(power, axis=0)  # Σ d_m^i for i = 0 … k
    # the number of sample j is still in x_m at the end by d^(n−1−j), and in the sum of outputs by w₀ + Σ w_m Σ d^i
    left = np.arange(count - 1, -1, -1)
    to_end = power[left]
    to_mean = (DIRECT + sums[left] @ weights) / count
    driven = np.column_stack([to_end, to_mean])
    covariance = driven.T @ driven
    size = np.sqrt(covariance.diagonal())
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    root = size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    of_state = weights * (sums[count] - 1.0) / count  # x after j samples is d^j x
    return Step(np.diag(power[count]), root[:-1], of_state, root[-1])


@dataclass(frozen=True)
class AlongWay:
    """The remainder of gravity over the distance travelled, of variance 1; its steps are distances, not times.

    Attributes:
        model: order and correlation distance.
    """

    model: RemainderModel

    @property
    def start(self) -> Array:
        """Covariance of the value and its derivatives at the start, (p, p)."""
        return self.model.dynamics()[1]

    @property
    def value(self) -> Array:
        """Weights of the states in the process's value, (p,)."""
        return np.asarray(np.eye(self.model.order)[0])

    def step(self, interval: float) -> Step:
        """Return the step over a distance [m].

        The mean over the step is that of its ends: over a hundredth of the correlation distance, 1e-5 of it is missing.
        """
        f, stationary = self.model.dynamics()
        b, eye, x = self.model.beta, np.eye(len(f)), f * interval
        # the eigenvalues of F are all −β: exp(F d) = e^(−βd) Σ (F + β)^k d^k/k!, k < p
        nilpotent = x + b * interval * eye
        keep = eye + nilpotent + (0.5 * nilpotent @ nilpotent if len(f) == 3 else 0.0)
        keep = keep * math.exp(-b * interval)
        scale = np.sqrt(np.diag(stationary))
        rest = (stationary - keep @ stationary @ keep.T) / np.outer(scale, scale)
        values, vectors = np.linalg.eigh(0.5 * (rest + rest.T))
        fresh = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return Step(keep, fresh, 0.5 * (eye[0] + keep[0]), 0.5 * fresh[0])


Process = GaussMarkov | Walk | Sum | Flicker | AlongWay
