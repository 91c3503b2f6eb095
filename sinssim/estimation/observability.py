"""Which states a flight makes observable: singular values of the observability matrix, and what σ has come down to.

With Ψₖ = Φ(tₖ, t₀) the readings tell of x(t₀) what the matrix with the rows R^(−½) Hₖ Ψₖ tells; its information is
O = Σ Ψₖᵀ Hₖᵀ R⁻¹ Hₖ Ψₖ. Scaled by the standard deviations σ₀ from which the states start, D = diag(σ₀), its singular
values √eig(D O D) are pure numbers: how many standard deviations of the measurement noise a deviation by one σ₀ along
that direction makes (normalised as Ham and Brown do, IEEE Trans. AES 19, 1983, 269). No noise drives the states in
this: it is what the motion would let be seen. What the filter made of it, noise and all, is how its own σ came down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.result import History

SEEN = 10.0
"""A direction is seen if its singular value is above this: σ₀ stands out of the noise ten times."""

SHARE = 0.99
"""A state is observable if so much of it (of its square) lies in the directions that are seen."""


@dataclass(frozen=True)
class Observability:
    """What the readings of a time say about the states at its beginning.

    Attributes:
        states: their names, n.
        time: instants up to which readings count, (R,) s.
        singular: singular values up to each, the largest first, (R, n).
        directions: the directions of the last ones in units of σ₀, a row each, (n, n).
        share: of each state that lies in directions that are seen in the end, 0 … 1, (n,).
        observable: whether that is enough, (n,).
        reduction: 1σ by the filter at the end over σ₀, (n,).
    """

    states: tuple[str, ...]
    time: Array
    singular: Array
    directions: Array
    share: Array
    observable: NDArray[np.bool_]
    reduction: Array


def observability(
    model: ErrorModel, history: History, begin: float = -np.inf, end: float = np.inf, *, every: int = 10
) -> Observability:
    """Return what a flight, or a part of it, makes observable.

    Args:
        model: the error model; its sigma is σ₀.
        history: of an estimate.
        begin, end: the part, s.
        every: singular values are computed at every so many of the history's rows.

    Returns:
        The observability.
    """
    rows = np.flatnonzero((history.time >= begin) & (history.time <= end))
    n = model.size
    transition, gramian = np.eye(n), np.zeros((n, n))
    known = np.where(model.sigma > 0.0, model.sigma, 0.0)
    times, singular, directions = [], [], np.eye(n)
    for k, row in enumerate(rows):
        if k:
            transition = history.transition[row] @ transition
            gramian += transition.T @ history.information[row] @ transition
        if k % every == 0 or k == len(rows) - 1:
            values, vectors = np.linalg.eigh(known[:, None] * gramian * known)
            times.append(history.time[row])
            singular.append(np.sqrt(np.maximum(values[::-1], 0.0)))
            directions = vectors[:, ::-1].T
    last = singular[-1] if singular else np.zeros(n)
    share = np.sum(directions[last > SEEN] ** 2, axis=0)
    sigma = np.sqrt(history.covariance[rows[-1]].diagonal()) if len(rows) else model.sigma
    reduction = np.divide(sigma, model.sigma, out=np.ones(n), where=model.sigma > 0.0)
    return Observability(
        model.states,
        np.array(times),
        np.array(singular).reshape(-1, n),
        directions,
        share,
        np.asarray((share >= SHARE) & (model.sigma > 0.0)),
        reduction,
    )
