"""Consistency of a filter (NIS, whiteness of innovations, NEES, noise) against χ², and observability of its states.

If all assumed noise is true, the innovations νₖ are independent and have the covariances Sₖ of the filter (Bar-Shalom,
Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4). The tests are

    NIS         Σ νᵀS⁻¹ν is χ² with as many degrees of freedom as there are components in all
    whiteness   of e = L⁻¹ν with S = LLᵀ, N readings of k components, the autocorrelations ρ(l) = Σ eᵢᵀeᵢ₊ₗ/Σ eᵢᵀeᵢ
                are normal with the variance (N−l)k/(Nk(Nk+2)), and Σ ρ² over this variance is χ² with m degrees of
                freedom for m lags (Ljung and Box, Biometrika 65, 1978)
    slow part   the sum of e over W readings has the variance W. Its mean square over windows reveals errors of the
                process noise and slow drifts of the readings, which the noise of single readings hides (the
                averaged innovations of Diesel and Luu, GPS/IRS AIME, Proc. ION GPS 1995)
    NEES        with the truth: xᵀP⁻¹x is χ² with n degrees of freedom, its mean over independent runs too

NEES of one run. The errors change slowly, so that their mean square is not a mean of independent numbers. The filter
itself gives their correlation. For its errors eₖ after the readings of row k,

    eₖ₊₁ = Ψₖ₊₁ eₖ + new noise,   Ψ = Π (I − K H) Φ from row to row,   E[eₖ eⱼᵀ] = Ψₖ … Ψⱼ₊₁ Pⱼ  for k > j.  (1)

With yₖ = Bₖ eₖ, the errors of a block in units of their covariance (Bₖ Pₖ Bₖᵀ = 1, b components), the sum of |yₖ|²
over R rows is Σ λᵢ χ²ᵢ with the eigenvalues λ of the covariance of all yₖ together,

    E[yₖ yⱼᵀ] = Bₖ Ψₖ … Ψⱼ₊₁ Gⱼ,   Gⱼ = Pⱼ Bⱼᵀ   for k ≥ j,                                                        (2)

whose distribution `sinssim.statistics.chi_square` gives. Its mean is Rb; (Rb)²/Σ λ² is the effective number of
independent numbers in it, b for constants that no reading shows and Rb for errors that are new in every row.

Noise of the inertial sensors. Between two rows the errors xₖ of inertial navigation and of the compensated parameters
follow xₖ₊₁ = Φ xₖ + w, with w independent from row to row. Differences of two neighbouring w are free of lasting errors
without a state. For attitude, velocity and instability they are compared with their covariance, the sum of both Q. The
test detects wrongly assumed inertial noise even where the noise of the readings hides it.

Observability. With Ψₖ = Φ(tₖ, t₀), the readings depend on x(t₀) through the matrix with the rows R^(−½) Hₖ Ψₖ. Its
information matrix is O = Σ Ψₖᵀ Hₖᵀ R⁻¹ Hₖ Ψₖ. Scaled by the initial standard deviations σ₀, D = diag(σ₀), the singular
values √eig(D O D) are pure numbers: the effect of a deviation by one σ₀ along a direction, in standard deviations of
the measurement noise (normalised as by Ham and Brown, IEEE Trans. AES 19, 1983, 269). This analysis has no process
noise and gives what the motion makes observable. The reduction of the filter's own σ includes the process noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim import units
from sinssim.data import Array, blocks
from sinssim.estimation.filter_result import Estimate, History, Innovations
from sinssim.estimation.state_model import ErrorModel
from sinssim.statistics.chi_square import quantile, upper_tail

FALSE_ALARM = 0.01
"""Largest probability that a sound filter is called inconsistent, over all tests: half of it for those of the
innovations of all sensors, half for those with the truth, each divided by the number of tests (Bonferroni)."""

LAGS = 20
"""Lags of the test of whiteness."""

WINDOWS = (16, 64, 256)
"""Lengths of the windows of the slow part, readings."""

_FEWEST = 8
"""Fewest windows, or readings, that are tested."""


@dataclass(frozen=True)
class ChiSquare:
    """One χ² test."""

    name: str  # what is tested
    value: float  # the statistic over its degrees of freedom; 1 is expected of a sound filter
    lower: float  # of its 95 % band
    upper: float
    probability: float  # two-sided probability of a value at least as unlikely, for a sound filter


@dataclass(frozen=True)
class SensorConsistency:
    """Consistency of one sensor's innovations."""

    sensor: str
    count: int  # readings that were compared with the prediction
    rejected: int  # number of them that the gate rejected
    expected: float  # expected number of rejections
    tests: tuple[ChiSquare, ...]  # NIS, whiteness, slow parts; none with too few readings
    autocorrelation: Array  # ρ of the lags 1 …, (m,); its 1σ is 1/√(Nk)
    verdict: str
    """One of `MEANING`, "consistent", or "unknown" with too few readings."""


@dataclass(frozen=True)
class Consistency:
    """Consistency of all innovations of a run; the truth is not used."""

    sensors: tuple[SensorConsistency, ...]  # one entry for each
    consistent: bool  # whether no test speaks against the filter
    sentences: tuple[str, ...]  # the findings against it, as sentences


def chi2_test(name: str, statistic: float, freedom: float) -> ChiSquare:
    """Compare a statistic with its χ² distribution."""
    lower, upper = (float(scipy.special.chdtri(freedom, tail)) / freedom for tail in (0.975, 0.025))
    probability = 2.0 * min(scipy.special.chdtr(freedom, statistic), scipy.special.chdtrc(freedom, statistic))
    return ChiSquare(name, statistic / freedom, lower, upper, min(float(probability), 1.0))


def weighted_test(name: str, statistic: float, weights: Array) -> ChiSquare:
    """Compare a statistic with the distribution of a sum of squares of correlated numbers."""
    upper = upper_tail(weights, statistic)
    low, high = (quantile(weights, tail) for tail in (0.975, 0.025))
    size = float(np.sum(weights))
    return ChiSquare(name, statistic / size, low / size, high / size, min(2.0 * min(upper, 1.0 - upper), 1.0))


def _whitened(innovations: Innovations) -> Array:
    """Return e = L⁻¹ν of the accepted readings, (N, k)."""
    used = np.flatnonzero(innovations.accepted).astype(np.int32)
    white, count = np.empty((len(used), innovations.value.shape[1])), 0
    for block in blocks(len(used)):
        rows = used[block]
        value, covariance = innovations.value[rows], innovations.covariance_at(rows)
        try:
            root = np.linalg.cholesky(covariance)
        except np.linalg.LinAlgError:  # the last row of a filter that diverged may be one
            size = np.linalg.eigvalsh(covariance)
            sound = size[:, 0] > 1e-12 * size[:, -1]
            root, value = np.linalg.cholesky(covariance[sound]), value[sound]
        white[count : count + len(value)] = np.linalg.solve(root, value[..., None])[..., 0]
        count += len(value)
    return white[:count]


def _dot(a: Array, b: Array) -> float:
    """Return the sum of the products of two arrays, (N, k), without an array of them."""
    return float(np.einsum("ij,ij->", a, b))


def sensor_consistency(innovations: Innovations, level: float = FALSE_ALARM) -> SensorConsistency:
    """Test the innovations of one sensor."""
    compared = ~np.isnan(innovations.nis)
    count, rejected = int(compared.sum()), int((compared & ~innovations.accepted).sum())
    e = _whitened(innovations)
    k, bound = e.shape[1], innovations.bound
    allowed = float(scipy.special.chdtrc(k, bound)) if np.isfinite(bound) else 0.0
    # a gate truncates χ²: x f_k(x) = k f_{k+2}(x), so that E(χ² | χ² ≤ b) = k F_{k+2}/F_k
    e /= np.sqrt(scipy.special.chdtr(k + 2, bound) / scipy.special.chdtr(k, bound))
    if len(e) < _FEWEST and not rejected:
        return SensorConsistency(innovations.sensor, count, rejected, allowed * count, (), np.zeros(0), "unknown")
    tests, rho = [], np.zeros(0)
    if len(e) >= _FEWEST:
        tests.append(chi2_test("NIS", _dot(e, e), e.size))
        lags = min(LAGS, len(e) // 4)
        # over the actual mean square: over the assumed one, the chance in it would be in all lags, and alarms be more
        rho = np.array([_dot(e[:-lag], e[lag:]) for lag in range(1, lags + 1)]) / (_dot(e, e) or 1.0)
        variance = (len(e) - np.arange(1, lags + 1)) / (len(e) * (e.size + 2.0))
        tests.append(chi2_test("whiteness", float(np.sum(rho**2 / variance)), lags))
        for window in WINDOWS:
            number = len(e) // window
            if number >= _FEWEST:
                sums = e[: number * window].reshape(number, window, k).sum(axis=1) / np.sqrt(window)
                tests.append(chi2_test(f"slow part, {window} readings", float(np.sum(sums**2)), number * k))
    too_many = float(scipy.special.bdtrc(rejected - 1, count, allowed)) if rejected else 1.0
    each = level / (len(tests) + 1)
    verdict = "consistent"
    if too_many < each:
        smaller = bool(tests) and tests[0].value < 1.0 and tests[0].probability < each
        verdict = "outliers" if smaller else "optimistic"
    elif tests and tests[0].probability < each:
        verdict = "optimistic" if tests[0].value > 1.0 else "pessimistic"
    else:
        failed = [test for test in tests[1:] if test.probability < each]
        slow = [test for test in failed if test.name != "whiteness"]
        if slow:
            verdict = "optimistic" if slow[-1].value > 1.0 else "pessimistic"
        elif failed and failed[0].value > 1.0:
            verdict = "coloured"
    return SensorConsistency(innovations.sensor, count, rejected, allowed * count, tuple(tests), rho, verdict)


MEANING = {
    "optimistic": "the noise is larger than assumed",
    "pessimistic": "the noise is smaller than assumed",
    "outliers": "single measurements have large errors, and the others have smaller errors than assumed",
    "coloured": "innovations that are not white",
}
"""Verdicts on a sensor's innovations that speak against a filter, and their meaning."""


def consistency(estimate: Estimate) -> Consistency:
    """Judge a filter by its own innovations."""
    level = 0.5 * FALSE_ALARM / max(len(estimate.innovations), 1)
    sensors = tuple(sensor_consistency(i, level) for i in estimate.innovations)
    sentences = []
    for s in sensors:
        if s.verdict not in MEANING:
            continue
        numbers = ", ".join(f"{t.name} {t.value:.3g} (95 % band {t.lower:.3g} … {t.upper:.3g})" for t in s.tests)
        gate = f"{s.rejected} of {s.count} measurements rejected where {s.expected:.2g} are expected"
        sentences.append(f"{s.sensor}: {s.verdict}, {MEANING[s.verdict]}: {numbers or 'none accepted'}; {gate}.")
    if estimate.divergence is not None:
        sentences.append(f"The filter diverged at t = {estimate.divergence.time:.2f} s: {estimate.divergence.reason}.")
    return Consistency(sensors, not sentences, tuple(sentences))


def scaled_solve(covariance: Array, right: Array) -> Array:
    """Solve P X = B, (K, n, n) and (K, n, m), through the correlation matrix.

    The variances of the states span twenty powers of ten. States that are known exactly are left out. The solution is
    that of least norm where P is singular, which happens with dependent states without noise.
    """
    scale = np.sqrt(np.einsum("kii->ki", covariance))
    scale[scale == 0.0] = 1.0
    correlation = covariance / (scale[:, :, None] * scale[:, None, :])
    diagonal = np.arange(correlation.shape[1])
    correlation[:, diagonal, diagonal] = 1.0
    scaled = right / scale[:, :, None]
    try:
        solution = np.linalg.solve(correlation, scaled)
    except np.linalg.LinAlgError:
        solution = np.linalg.pinv(correlation, hermitian=True) @ scaled
    return np.asarray(solution / scale[:, :, None])


def nees(errors: Array, covariance: Array, states: slice | None = None) -> Array:
    """Return the normalised squared errors xᵀP⁻¹x, (...), from actual errors, (..., n), of some or all states.

    States of zero variance and linearly dependent states do not count.
    """
    part = states or slice(0, errors.shape[-1])
    x, p = errors[..., part], covariance[..., part, part]
    p = np.broadcast_to(p, (*x.shape, x.shape[-1]))
    x = np.where(np.einsum("...ii->...i", p) > 0.0, x, 0.0)
    n = x.shape[-1]
    solved = scaled_solve(p.reshape(-1, n, n), x.reshape(-1, n, 1)).reshape(x.shape)
    return np.asarray(np.einsum("...i,...i->...", x, solved))


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
    """Consistency of a filter with the truth."""

    nees: dict[str, Judged]
    """NEES of the run per state, by block and for all states.

    A block is never "pessimistic", because a start without errors is not a fault of the filter. All states together can
    fail alone: the sum of a tilt and a bias, which is known much better than either, may be wrong.
    """
    noise: dict[str, Judged]
    """Variance of each noise of the inertial sensors, relative to the variance that the filter assumes."""
    sentences: tuple[str, ...]  # findings against the filter, as sentences


def actual_consistency(model: ErrorModel, history: History, errors: Array) -> ActualConsistency:
    """Judge a filter by the actual errors of `history.navigation` and `history.compensated`, (R, n).

    A sound filter fails any of the tests with a probability of at most half of `FALSE_ALARM`.
    """
    squares, noises = dict(_nees_of_run(model, history, errors)), dict(_noise(model, history, errors))
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


def _nees_of_run(model: ErrorModel, history: History, errors: Array) -> Iterator[tuple[str, ChiSquare]]:
    """Yield the NEES of all states and of each block."""
    e, p = errors - history.state, history.covariance
    unknown = np.einsum("kii->ki", p).min(axis=0, initial=np.inf) > 0.0  # states with an uncertainty
    if not len(e) or not np.isfinite(e).all():
        return
    thinned: dict[int, tuple[NDArray[np.intp], Array]] = {}
    for name, every in ((ALL, np.vstack(list(model.compared.values()))), *model.compared.items()):
        seen = every[np.any(every[:, unknown], axis=1)]
        if not len(seen):
            continue
        step = math.ceil(len(e) * len(seen) / _ROWS)
        if step not in thinned:
            rows = np.arange(len(e) - 1, -1, -step)[::-1]
            thinned[step] = rows, _thinned(history.decay[1:], rows)
        rows, decay = thinned[step]
        try:
            yield name, _of_block(name, e[rows], p[rows], decay, seen)
        except np.linalg.LinAlgError:  # linearly dependent states: their errors have no density
            continue


def _of_block(name: str, e: Array, p: Array, decay: Array, seen: Array) -> ChiSquare:
    """Return the NEES of what a matrix, (m, n), makes of the states."""
    count, n = e.shape
    size = len(seen)
    block = seen @ p @ seen.T
    scale = np.sqrt(np.einsum("kii->ki", block))
    root = np.linalg.cholesky(block / (scale[:, :, None] * scale[:, None, :]))
    if np.min(np.einsum("kii->ki", root)) ** 2 < _ROUNDING:
        raise np.linalg.LinAlgError("the states depend linearly on each other to rounding")
    b = (np.linalg.inv(root) / scale[:, None, :]) @ seen
    covariance = np.eye(count * size)
    since = np.empty((n, count * size))
    for k in range(count):  # (2), the lower triangle
        if k:
            since[:, : k * size] = decay[k - 1] @ since[:, : k * size]
        since[:, k * size : (k + 1) * size] = p[k] @ b[k].T
        covariance[k * size : (k + 1) * size, : k * size] = b[k] @ since[:, : k * size]
    weights = np.asarray(np.linalg.eigvalsh(covariance), dtype=np.float64)
    squares = float(np.sum(nees(e @ seen.T, block)))
    return weighted_test(f"NEES, {name}", squares, weights[weights > 0.0])


def _thinned(decay: Array, rows: NDArray[np.intp]) -> Array:
    """Return Ψ from each of some rows to the next of them."""
    products = np.empty((len(rows) - 1, *decay.shape[1:]))
    for i, (first, last) in enumerate(pairwise(rows.tolist())):
        product = decay[first]
        for k in range(first + 1, last):
            product = decay[k] @ product
        products[i] = product
    return products


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
        assumed = q[:, part, part] + np.eye(3) * pulse.get(block, 0.0) ** 2 / 6.0
        least = np.einsum("kii->ki", assumed).min(axis=1)
        there = (least > 0.0) & (noise.get(block, np.inf) ** 2 * interval + pulse.get(block, 0.0) ** 2 > _THERE * least)
        pairs = pair[usable[pair] & usable[pair + 1] & there[pair]]
        if not len(pairs):
            continue
        difference = w[pairs + 1, part] - w[pairs, part]
        squares = nees(difference, assumed[pairs] + assumed[pairs + 1])
        test = chi2_test(name, float(squares.sum()), 3 * len(squares))
        tolerated = np.clip(test.value, 1.0 - _MATTERS, 1.0 + _MATTERS)
        yield name, (test, chi2_test(name, float(squares.sum() / tolerated), 3 * len(squares)).probability)


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
