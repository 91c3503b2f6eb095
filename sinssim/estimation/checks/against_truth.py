"""Checks a run's filter against the truth: its errors against P, and the inertial noise against the assumed noise.

NEES of one run. The errors change slowly, so that their mean square is not a mean of independent numbers. The filter
itself gives their correlation. For its errors eₖ after the readings of row k,

    eₖ₊₁ = Ψₖ₊₁ eₖ + new noise,   Ψ = Π (I − K H) Φ from row to row,   E[eₖ eⱼᵀ] = Ψₖ … Ψⱼ₊₁ Pⱼ  for k > j.  (1)

With yₖ = Bₖ eₖ, the errors of a block in units of their covariance (Bₖ Pₖ Bₖᵀ = 1, b components), the sum of |yₖ|²
over R rows is Σ λᵢ χ²ᵢ with the eigenvalues λ of the covariance of all yₖ together,

    E[yₖ yⱼᵀ] = Bₖ Ψₖ … Ψⱼ₊₁ Gⱼ,   Gⱼ = Pⱼ Bⱼᵀ   for k ≥ j,                                                        (2)

whose distribution `sinssim.statistics.quadratic_form` gives. Its mean is Rb; (Rb)²/Σ λ² is the effective number of
independent numbers in it, b for constants that no reading shows and Rb for errors that are new in every row.

Noise of the inertial sensors. Between two rows the errors xₖ of inertial navigation and of the compensated parameters
follow xₖ₊₁ = Φ xₖ + w, with w independent from row to row. Differences of two neighbouring w are free of lasting errors
without a state. For attitude, velocity and instability they are compared with their covariance, the sum of both Q. The
test detects wrongly assumed inertial noise even where the noise of the readings hides it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array
from sinssim.estimation.checks.consistency import FALSE_ALARM, ChiSquare, chi2_test, weighted_test
from sinssim.estimation.checks.consistency import nees as normalised_squares
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.result import History

ALL = "all states"
"""Names of the blocks in the NEES tests."""

_ROWS = 400
"""Largest number of rows, evenly spread, times states of a block that its NEES uses: the size of the covariance (2)."""

_SECOND_ORDER = 0.3
"""A row counts if its noise exceeds the errors of the linear model by this factor."""

_MATTERS = 0.1
"""Relative error of an assumed variance that does not count as wrong: 5 % of a density; data sheets vary by more."""

_THERE = 1e-9
"""Least own part of Q for which a noise is tested; below it, Q is singular and stems from other sensors."""

_NOISES = {
    "attitude": "gyro noise",
    "velocity": "accelerometer noise",
    "gyro instability": "gyro instability",
    "accelerometer instability": "accelerometer instability",
}


class Judged(NamedTuple):
    """A test and its verdict, as those of `SensorConsistency`: "consistent", "optimistic" or "pessimistic"."""

    test: ChiSquare
    verdict: str


@dataclass(frozen=True)
class ActualConsistency:
    """Consistency of a filter with the truth.

    Attributes:
        nees: NEES of the run per state, by block and for all states. A block is never "pessimistic", because a start
            without errors is not a fault of the filter. All states together can fail alone: the sum of a tilt and a
            bias, which is known much better than either, may be wrong.
        noise: variance of each noise of the inertial sensors, relative to the variance that the filter assumes.
        sentences: findings against the filter, as sentences.
    """

    nees: dict[str, Judged]
    noise: dict[str, Judged]
    sentences: tuple[str, ...]


def actual_consistency(model: ErrorModel, history: History, errors: Array) -> ActualConsistency:
    """Judge a filter by its actual errors.

    Args:
        errors: actual errors of `history.navigation` and `history.compensated`, (R, n).

    Returns:
        The tests; a sound filter fails any of them with a probability of at most half of `FALSE_ALARM`.
    """
    squares, noises = dict(_nees(model, history, errors)), dict(_noise(model, history, errors))
    level = 0.5 * FALSE_ALARM / max(len(squares) + len(noises), 1)  # the innovations have the other half
    nees, noise, sentences = {}, {}, []
    for name, test in squares.items():
        # half of the two-sided probability: the upper tail
        larger = test.value > 1.0 and 0.5 * test.probability < level
        nees[name] = Judged(test, "optimistic" if larger else "consistent")
        if larger:
            sentences.append(
                f"{name}: the errors are larger than the filter states, NEES per state {test.value:.3g} (95 % band "
                f"{test.lower:.3g} … {test.upper:.3g})."
            )
    for name, (test, probability) in noises.items():
        wrong = probability < level
        verdict = "consistent" if not wrong else "optimistic" if test.value > 1.0 else "pessimistic"
        noise[name] = Judged(test, verdict)
        if wrong:
            sentences.append(
                f"{name}: {verdict}, the noise is {np.sqrt(test.value):.3g} times the assumed noise (95 % band "
                f"{np.sqrt(test.lower):.3g} … {np.sqrt(test.upper):.3g})."
            )
    return ActualConsistency(nees, noise, tuple(sentences))


_ROUNDING = 1e-13
"""Share of a state's variance that the others leave undetermined; below it, it is rounding of the covariance."""


def _nees(model: ErrorModel, history: History, errors: Array) -> Iterator[tuple[str, ChiSquare]]:
    """Yield the NEES of all states and of each block."""
    e, p = errors - history.state, history.covariance
    known = np.einsum("kii->ki", p).min(axis=0, initial=np.inf) <= 0.0  # states without any uncertainty
    if not len(e) or not np.isfinite(e).all():
        return
    thinned: dict[int, tuple[NDArray[np.intp], Array]] = {}
    for name, part in ((ALL, slice(0, model.size)), *model.slices.items()):
        states = np.arange(model.size)[part][~known[part]]
        if not len(states):
            continue
        step = math.ceil(len(e) * len(states) / _ROWS)
        if step not in thinned:
            rows = np.arange(len(e) - 1, -1, -step)[::-1]
            thinned[step] = rows, _thinned(history.decay[1:], rows)
        rows, decay = thinned[step]
        try:
            yield name, _of_block(name, e[rows], p[rows], decay, states)
        except np.linalg.LinAlgError:  # linearly dependent states: their errors have no density
            continue


def _of_block(name: str, e: Array, p: Array, decay: Array, states: NDArray[np.intp]) -> ChiSquare:
    count, n = e.shape
    size = len(states)
    own = p[:, states][:, :, states]
    scale = np.sqrt(np.einsum("kii->ki", own))
    root = np.linalg.cholesky(own / (scale[:, :, None] * scale[:, None, :]))
    if np.min(np.einsum("kii->ki", root)) ** 2 < _ROUNDING:
        raise np.linalg.LinAlgError("the states depend linearly on each other to rounding")
    b = np.zeros((count, size, n))
    b[:, :, states] = np.linalg.inv(root) / scale[:, None, :]
    together = np.eye(count * size)
    since = np.empty((n, count * size))
    for k in range(count):  # (2), the lower triangle
        if k:
            since[:, : k * size] = decay[k - 1] @ since[:, : k * size]
        since[:, k * size : (k + 1) * size] = p[k] @ b[k].T
        together[k * size : (k + 1) * size, : k * size] = b[k] @ since[:, : k * size]
    weights = np.asarray(np.linalg.eigvalsh(together), dtype=np.float64)
    squares = float(np.sum(normalised_squares(e[:, states], own)))
    return weighted_test(f"NEES, {name}", squares, weights[weights > 0.0])


def _thinned(decay: Array, rows: NDArray[np.intp]) -> Array:
    """Return Ψ from each of some rows to the next of them."""
    found = np.empty((len(rows) - 1, *decay.shape[1:]))
    for i, (first, last) in enumerate(pairwise(rows.tolist())):
        product = decay[first]
        for k in range(first + 1, last):
            product = decay[k] @ product
        found[i] = product
    return found


def _between_edges(history: History, errors: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return instants and errors of the rows at the end of a sample, and Φ, Q and feedback from each to the next.

    Between two ends the attitude is interpolated linearly. Its error, ω̇ Δt²/8, may exceed the noise of a few samples.
    """
    rows = np.flatnonzero(np.ones(len(errors), dtype=bool) if history.on_edge is None else history.on_edge)
    transition, noise, fed = (getattr(history, name)[rows[1:]] for name in ("transition", "noise", "fed_back"))
    for k in np.flatnonzero(np.diff(rows) > 1).tolist():
        for row in range(int(rows[k + 1]) - 1, int(rows[k]), -1):
            noise[k] += transition[k] @ history.noise[row] @ transition[k].T
            fed[k] += transition[k] @ history.fed_back[row]
            transition[k] = transition[k] @ history.transition[row]
    return history.time[rows], errors[rows], transition, noise, fed


def _noise(model: ErrorModel, history: History, errors: Array) -> Iterator[tuple[str, tuple[ChiSquare, float]]]:
    """Yield the noises of the inertial sensors, each relative to the assumed noise.

    The probability beside the test is that of a variance that differs from the assumed one by `_MATTERS`.
    """
    time, errors, transition, q, fed = _between_edges(history, errors)
    interval = np.diff(time)
    w = errors[1:] + fed - np.einsum("kij,kj->ki", transition, errors[:-1])
    attitude = model.slices["attitude"]
    turned = np.linalg.norm(errors[:-1, attitude], axis=1)
    # second-order terms: composed rotations, and the specific force along a tilted axis
    left_out = {
        "attitude": 0.5 * turned * np.linalg.norm(fed[:, attitude], axis=1),
        "velocity": 0.5 * units.G0 * turned**2 * interval,
    }
    pulse = {"attitude": model.gyro_quantum, "velocity": model.accel_quantum}
    noise = {"attitude": model.gyro_noise, "velocity": model.accel_noise}
    usable, pair = np.isfinite(w).all(axis=1), np.arange(0, len(w) - 1, 2)
    for block in ("attitude", "velocity"):
        least = np.sqrt(np.einsum("kii->ki", q[:, model.slices[block], model.slices[block]]).min(axis=1))
        usable &= left_out[block] <= _SECOND_ORDER * least
    for block, name in _NOISES.items():
        part = model.slices.get(block)
        if part is None:
            continue
        # rounding of a pulse at both ends
        own = q[:, part, part] + np.eye(3) * pulse.get(block, 0.0) ** 2 / 6.0
        least = np.einsum("kii->ki", own).min(axis=1)
        there = (least > 0.0) & (noise.get(block, np.inf) ** 2 * interval + pulse.get(block, 0.0) ** 2 > _THERE * least)
        pairs = pair[usable[pair] & usable[pair + 1] & there[pair]]
        if not len(pairs):
            continue
        difference = w[pairs + 1, part] - w[pairs, part]
        squares = normalised_squares(difference, own[pairs] + own[pairs + 1])
        found = chi2_test(name, float(squares.sum()), 3 * len(squares))
        tolerated = np.clip(found.value, 1.0 - _MATTERS, 1.0 + _MATTERS)
        yield name, (found, chi2_test(name, float(squares.sum() / tolerated), 3 * len(squares)).probability)
