"""Observability of the states along a motion: singular values of the observability matrix, reduction of σ.

With Ψₖ = Φ(tₖ, t₀), the readings depend on x(t₀) through the matrix with the rows R^(−½) Hₖ Ψₖ. Its information matrix
is O = Σ Ψₖᵀ Hₖᵀ R⁻¹ Hₖ Ψₖ. Scaled by the initial standard deviations σ₀, D = diag(σ₀), the singular values √eig(D O D)
are pure numbers: the effect of a deviation by one σ₀ along a direction, in standard deviations of the measurement noise
(normalised as by Ham and Brown, IEEE Trans. AES 19, 1983, 269). This analysis has no process noise and gives what the
motion makes observable. The reduction of the filter's own σ includes the process noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.filter_result import History
from sinssim.estimation.state_model import ErrorModel

HALVED = 0.5
"""Fraction of σ₀ to which σ must fall for a state to count as observable."""


@dataclass(frozen=True)
class Observability:
    """Observability of the states at the beginning of a period from the readings of the period."""

    states: tuple[str, ...]  # their names, n
    time: Array  # instants up to which readings count, (R,) s
    singular: Array  # singular values up to each instant, the largest first, (R, n)
    directions: Array  # directions of the singular values at the last instant, in units of σ₀, one row each, (n, n)
    limit: Array  # 1σ over σ₀ of each state from the readings without process noise, (n,)
    reduction: Array  # 1σ of the filter at the end over σ₀, (n,)
    seen: NDArray[np.bool_]  # whether the limit is at most `HALVED`, (n,)
    observable: NDArray[np.bool_]
    """Whether the reduction is at most `HALVED` too, (n,); process noise hides a state that is seen but not observable.
    """


def observability(
    model: ErrorModel, history: History, begin: float = -np.inf, end: float = np.inf, *, every: int = 10
) -> Observability:
    """Analyse the observability of the states over a part of a run, whose σ₀ are those of the model.

    The singular values are computed at every `every`-th row of the history.
    """
    rows = np.flatnonzero((history.time >= begin) & (history.time <= end))
    n = model.size
    transition, gramian = np.eye(n), np.zeros((n, n))
    known = np.where(model.sigma > 0.0, model.sigma, 0.0)
    times, singular, directions = [], [], np.eye(n)
    for k, row in enumerate(rows):
        if k:
            gramian += transition.T @ history.information[row] @ transition
            transition = history.transition[row] @ transition
        if k % every == 0 or k == len(rows) - 1:
            values, vectors = np.linalg.eigh(known[:, None] * gramian * known)
            times.append(history.time[row])
            singular.append(np.sqrt(np.maximum(values[::-1], 0.0)))
            directions = vectors[:, ::-1].T
    last = singular[-1] if singular else np.zeros(n)
    # diagonal of (I + D O D)⁻¹, by its eigenvectors
    limit = np.sqrt(np.sum(directions**2 / (1.0 + last[:, None] ** 2), axis=0))
    sigma = np.sqrt(history.covariance[rows[-1]].diagonal()) if len(rows) else model.sigma
    reduction = np.divide(sigma, model.sigma, out=np.ones(n), where=model.sigma > 0.0)
    seen = (limit <= HALVED) & (model.sigma > 0.0)
    observable = seen & (reduction <= HALVED)
    every_one = np.array(singular).reshape(-1, n)
    return Observability(model.states, np.array(times), every_one, directions, limit, reduction, seen, observable)
