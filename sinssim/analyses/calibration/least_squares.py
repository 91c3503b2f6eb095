"""Least squares of a calibration: estimates, covariance, and what the observations do not determine.

The observations are whitened: r = A d + B n + ν with ν of unit covariance. d are the corrections of the parameters, n
nuisances with unit covariance, such as the errors of the table. The nuisances are eliminated exactly: with the rows
[B; I] of observations and prior knowledge, Q an orthonormal basis of what is orthogonal to them gives Qᵀr = QᵀA d + ν'.
The columns of QᵀA are multiplied by the sizes s of the parameters, their 1σ before the calibration:

    QᵀA diag(s) = U diag(λ) Vᵀ

A direction v_k of the scaled parameters is then determined to 1/λ_k of its size. Directions with λ_k < 1 are called not
observable: the observations say less about them than the data sheet. They are set to zero, and their size is in the
covariance s V diag(1/λ² or 1) Vᵀ s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array

OBSERVABLE = 1.0
"""Least singular value of an observable direction."""
_SHARE = 0.01
"""Squared share in directions that are not observable from which a parameter counts as not observable."""
_NAMED = 0.1
"""Coefficient, relative to the largest, from which a parameter is named in a combination."""


@dataclass(frozen=True)
class Solution:
    """A solution of the least squares."""

    correction: Array  # d, (p,) SI
    covariance: Array  # of the parameters, (p, p) SI
    singular: Array  # λ, in falling order, (p,)
    directions: Array  # V, one column each, in sizes of the parameters, (p, p)
    rank: int  # number of directions that are observable
    observable: NDArray[np.bool_]  # whether each parameter is determined, (p,)
    chi_square: float  # sum of the squares of the remaining residuals
    degrees: int  # their degrees of freedom


def solve(r: Array, a: Array, b: Array, prior: Array, size: Array, values: Array, final: bool = True) -> Solution:
    """Solve the whitened observations r = A d + B n for the parameters' correction d, and the nuisances n in their 1σ.

    With q nuisances and p parameters, r is (m,), A (m, p) and B (m, q). `prior` are the residuals of the nuisances'
    prior knowledge, less their current values, (q,); `size` and `values` are those of the parameters, (p,) SI. In the
    `final` solution, observable directions are free and the others zero. Otherwise the sizes are prior knowledge of all
    parameters: the steps of an iteration then cannot run away, and no direction changes sides between them.
    """
    m, p = a.shape
    q = b.shape[1]
    rest, scaled = r, a * size
    if q:
        whole, _ = np.linalg.qr(np.vstack([b, np.eye(q)]))
        rows = np.concatenate([r, prior])
        columns = np.vstack([scaled, np.zeros((q, p))])
        rest = rows - whole @ (whole.T @ rows)
        scaled = columns - whole @ (whole.T @ columns)
    u, singular, vt = np.linalg.svd(scaled, full_matrices=False)
    if len(singular) < p:  # fewer observations than parameters
        _, _, vt = np.linalg.svd(scaled, full_matrices=True)
        singular, u = np.append(singular, np.zeros(p - len(singular))), np.pad(u, ((0, 0), (0, p - u.shape[1])))
    seen = singular >= OBSERVABLE
    inverse = np.where(seen, 1.0 / np.where(seen, singular, 1.0), 0.0)
    now = vt @ (values / size)
    if final:
        along = np.where(seen, inverse * (u.T @ rest), -now)
    else:
        along = (singular * (u.T @ rest) - now) / (singular**2 + 1.0)
    spread = vt.T * np.where(seen, inverse, 1.0)
    left = rest - scaled @ (vt.T @ along)
    share = np.sum(vt[~seen] ** 2, axis=0)
    return Solution(
        size * (vt.T @ along),
        (size[:, None] * (spread @ spread.T)) * size,
        singular,
        vt.T,
        int(np.count_nonzero(seen)),
        share < _SHARE,
        float(left @ left),
        m - int(np.count_nonzero(seen)),
    )


def nuisances(r: Array, b: Array, prior: Array) -> Array:
    """Return the nuisances' corrections, (q,) in their 1σ, by the residuals r after the parameters' correction."""
    corrections, *_ = np.linalg.lstsq(np.vstack([b, np.eye(b.shape[1])]), np.concatenate([r, prior]), rcond=None)
    return np.asarray(corrections)


def unobservable(solution: Solution, names: list[str]) -> list[str]:
    """Name what the observations do not determine.

    One text stands for each direction: a parameter, or a combination such as "accel bias x + 0.7 gyro scale y", in
    which each parameter is in units of its size.
    """
    lost = solution.directions[:, solution.rank :].T
    # a basis with as few parameters in each direction as there can be: Gauss and Jordan with the largest pivot
    texts, rows, done = [], lost.copy(), 0
    while done < len(rows):
        k, j = np.unravel_index(np.argmax(np.abs(rows[done:])), rows[done:].shape)
        rows[[done, done + int(k)]] = rows[[done + int(k), done]]
        rows[done] /= rows[done, j]
        for other in range(len(rows)):
            if other != done:
                rows[other] -= rows[other, j] * rows[done]
        done += 1
    for row in rows:
        row = row / np.abs(row).max()
        pairs = [(value, name) for value, name in zip(row, names, strict=True) if abs(value) >= _NAMED]
        terms = sorted(pairs, key=lambda term: -abs(term[0]))
        words = ""
        for value, name in terms:
            factor = "" if round(abs(value), 1) == 1.0 else f"{abs(value):.1f} "
            sign = " − " if value * terms[0][0] < 0.0 else " + "
            words += (sign if words else "") + factor + name
        texts.append(words)
    order = {name: number for number, name in enumerate(names)}
    return sorted(texts, key=lambda words: min(place for name, place in order.items() if name in words))
