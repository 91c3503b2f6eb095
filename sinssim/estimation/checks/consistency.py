"""Consistency of a filter: NIS, whiteness of innovations and NEES against their χ² distributions.

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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from sinssim.data import Array
from sinssim.estimation.result import Estimate, Innovations
from sinssim.estimation.smoother import scaled_solve
from sinssim.statistics.quadratic_form import quantile, upper_tail

FALSE_ALARM = 0.01
"""Largest probability that a sound filter is called inconsistent, over all tests: half of it for those of the
innovations of all sensors, half for those with the truth, each divided by the number of tests (Bonferroni)."""

LAGS = 20
"""Lags of the test of whiteness."""

WINDOWS = (16, 64, 256)
"""Lengths of the windows of the slow part, readings."""

_FEWEST = 8
"""Fewest windows, or readings, that are tested."""

_BLOCK = 16384
"""Readings whose covariances are factored at once."""


@dataclass(frozen=True)
class ChiSquare:
    """One χ² test.

    Attributes:
        name: what is tested.
        value: the statistic over its degrees of freedom; 1 is expected of a sound filter.
        lower, upper: its 95 % band.
        probability: two-sided probability of a value at least as unlikely, for a sound filter.
    """

    name: str
    value: float
    lower: float
    upper: float
    probability: float


@dataclass(frozen=True)
class SensorConsistency:
    """Consistency of one sensor's innovations.

    Attributes:
        sensor: its name.
        count: readings that were compared with the prediction.
        rejected: number of them that the gate rejected.
        expected: expected number of rejections.
        tests: NIS, whiteness, slow parts; none with too few readings.
        autocorrelation: ρ of the lags 1 …, (m,); its 1σ is 1/√(Nk).
        autocorrelation_sigma: that 1σ.
        verdict: "consistent", "optimistic" (the noise is larger than the filter assumes), "pessimistic" (smaller),
            "outliers" (more rejected than expected, while the accepted ones are closer than assumed),
            "coloured" (NIS right, innovations not white), or "unknown" (too few readings).
    """

    sensor: str
    count: int
    rejected: int
    expected: float
    tests: tuple[ChiSquare, ...]
    autocorrelation: Array
    autocorrelation_sigma: float
    verdict: str


@dataclass(frozen=True)
class Consistency:
    """Consistency of all innovations of a run; the truth is not used.

    Attributes:
        sensors: one entry for each.
        consistent: whether no test speaks against the filter.
        sentences: the findings against it, as sentences.
    """

    sensors: tuple[SensorConsistency, ...]
    consistent: bool
    sentences: tuple[str, ...]


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
    found, count = np.empty((len(used), innovations.value.shape[1])), 0
    for start in range(0, len(used), _BLOCK):
        rows = used[start : start + _BLOCK]
        value, covariance = innovations.value[rows], innovations.covariance_at(rows)
        try:
            root = np.linalg.cholesky(covariance)
        except np.linalg.LinAlgError:  # the last row of a filter that diverged may be one
            size = np.linalg.eigvalsh(covariance)
            sound = size[:, 0] > 1e-12 * size[:, -1]
            root, value = np.linalg.cholesky(covariance[sound]), value[sound]
        found[count : count + len(value)] = np.linalg.solve(root, value[..., None])[..., 0]
        count += len(value)
    return found[:count]


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
        return SensorConsistency(
            innovations.sensor, count, rejected, allowed * count, (), np.zeros(0), np.nan, "unknown"
        )
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
    return SensorConsistency(
        innovations.sensor, count, rejected, allowed * count, tuple(tests), rho,
        float(1.0 / np.sqrt(max(e.size, 1))), verdict,
    )  # fmt: skip


_MEANING = {
    "optimistic": "the noise is larger than the filter assumes",
    "pessimistic": "the noise is smaller than the filter assumes",
    "outliers": "more measurements are rejected than noise explains, while the others are closer than assumed",
    "coloured": "the innovations are not white: the model lacks an error that is in them",
}


def consistency(estimate: Estimate) -> Consistency:
    """Judge a filter by its own innovations."""
    level = 0.5 * FALSE_ALARM / max(len(estimate.innovations), 1)
    sensors = tuple(sensor_consistency(i, level) for i in estimate.innovations)
    sentences = []
    for s in sensors:
        if s.verdict not in _MEANING:
            continue
        numbers = ", ".join(f"{t.name} {t.value:.3g} (95 % band {t.lower:.3g} … {t.upper:.3g})" for t in s.tests)
        gate = f"{s.rejected} of {s.count} measurements rejected where {s.expected:.2g} are expected"
        sentences.append(f"{s.sensor}: {s.verdict}, {_MEANING[s.verdict]}: {numbers or 'none accepted'}; {gate}.")
    if estimate.divergence is not None:
        sentences.append(f"The filter diverged at t = {estimate.divergence.time:.2f} s: {estimate.divergence.reason}.")
    return Consistency(sensors, not sentences, tuple(sentences))


def nees(errors: Array, covariance: Array, states: slice | None = None) -> Array:
    """Return the normalised squared errors of an estimate.

    Args:
        errors: actual errors, (..., n); see `sinssim.estimation.state_errors`.
        states: the states to use; all if not given.

    Returns:
        xᵀP⁻¹x, (...); states of zero variance and linearly dependent states do not count.
    """
    part = states or slice(0, errors.shape[-1])
    x, p = errors[..., part], covariance[..., part, part]
    p = np.broadcast_to(p, (*x.shape, x.shape[-1]))
    x = np.where(np.einsum("...ii->...i", p) > 0.0, x, 0.0)
    n = x.shape[-1]
    solved = scaled_solve(p.reshape(-1, n, n), x.reshape(-1, n, 1)).reshape(x.shape)
    return np.asarray(np.einsum("...i,...i->...", x, solved))
