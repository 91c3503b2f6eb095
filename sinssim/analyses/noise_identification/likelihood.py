"""The likelihood of a record for given noise terms, and its maximum.

The cosine coefficients z of a band b are n_b independent normal numbers, plus three shapes (ramp and ends) of unknown
sizes u, with the variance

    v_b = Σ_i c_i² p_i(b),   c = Q, N, B, K and, if need be, σ_b                        (1)

With the sum P_b of z² and the products s_b of the shapes, the sizes and their covariance are

    u = C Σ_b (s·z)_b w_b/(n_b v_b),   C⁻¹ = Σ_b s_b w_b/(n_b v_b)                     (2)

and the restricted likelihood, which accounts for the degrees of freedom of u (Patterson and Thompson, Biometrika 58,
1971), is

    ℓ = −½ Σ_b w_b [ln v_b + P_b(u)/(n_b v_b)] + ½ ln det C                           (3)

where P_b(u) is P_b without ramp and ends. The weight w_b is the number n_b of coefficients, or less for a band that the
terms describe less well. The maximum over c_i² ≥ 0 is found by Fisher scoring; each step is a weighted least-squares
fit with non-negative unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sinssim.analyses.noise_identification.bands import Bands
from sinssim.analyses.noise_identification.terms import NoiseTerm
from sinssim.data import Array

_STEPS = 200  # maximum number of scoring steps
_CLOSE = 1e-5  # tolerance of the log-likelihood


class Likelihood:
    """The likelihood of a record for given terms, at its maximum and elsewhere.

    Args:
        bands, terms, columns, weight: as the attributes.
        start: initial c², (p,); from the record's power if not given.

    Attributes:
        bands: the record.
        terms: p noise terms.
        columns: mean power of each term in each band, (p, b).
        weight: degrees of freedom of each band, (b,); the number of its coefficients, or fewer.
        best: c² at the maximum of the likelihood, (p,).
        top: the log-likelihood there.
    """

    def __init__(
        self, bands: Bands, terms: Sequence[NoiseTerm], columns: Array, weight: Array, start: Array | None = None
    ) -> None:
        self.bands, self.terms, self.columns, self.weight = bands, list(terms), columns, weight
        self.best, self.top = self.solve({}, start=start)

    def index(self, symbol: str) -> int:
        """Return the number of the term with a symbol."""
        return [term.symbol for term in self.terms].index(symbol)

    def variance(self, squares: Array) -> Array:
        """Return the variance v of every band's coefficients, (b,), for given c², (p,)."""
        return np.asarray(squares @ self.columns + self.bands.floor)  # (1)

    def weighed(self, weight: Array) -> Likelihood:
        """Return the likelihood with other weights, (b,)."""
        return Likelihood(self.bands, self.terms, self.columns, weight)

    def extended(self, term: NoiseTerm) -> Likelihood:
        """Return the likelihood with an additional term."""
        columns = np.concatenate([self.columns, self.bands.column(term)[None]])
        return Likelihood(self.bands, [*self.terms, term], columns, self.weight, np.append(self.best, 0.0))

    def ramp_and_ends(self, v: Array) -> tuple[Array, Array]:
        """Return the sizes of ramp and ends by generalised least squares, (3,), and their covariance, (3, 3)."""
        w = self.weight / self.bands.number / v
        covariance = np.asarray(np.linalg.inv(self.bands.shapes @ w), dtype=np.float64)
        return covariance @ (self.bands.shapes_z @ w), covariance  # (2)

    def eliminated(self, v: Array) -> tuple[Array, Array, float]:
        """Eliminate ramp and ends, given the variances.

        Returns:
            The remaining power in each band; the expected power absorbed by the fit; the logarithm of the determinant
            of their covariance.
        """
        bands = self.bands
        size, covariance = self.ramp_and_ends(v)
        power = bands.power - 2.0 * size @ bands.shapes_z + np.einsum("i,ijb,j->b", size, bands.shapes, size)
        taken = np.einsum("ij,ijb->b", covariance, bands.shapes)
        return np.maximum(power, 0.0), taken, float(np.linalg.slogdet(covariance)[1])

    def evaluate(self, v: Array) -> tuple[Array, float]:
        """Return the mean power of every band for scoring, and the log-likelihood.

        Args:
            v: variance of every band's coefficients, (b,).

        Returns:
            Each band's mean power without ramp and ends, (b,), corrected for the noise that these absorb; and the
            restricted log-likelihood.
        """
        power, taken, determinant = self.eliminated(v)
        terms = self.weight * (np.log(v) + power / (self.bands.number * v))
        return (power + taken) / self.bands.number, -0.5 * (float(terms.sum()) - determinant)  # (3)

    def solve(self, held: Mapping[int, float], start: Array | None = None) -> tuple[Array, float]:
        """Maximise the likelihood over c² ≥ 0.

        Returns:
            c², (p,), and the log-likelihood.
        """
        bands = self.bands
        free = [i for i in range(len(self.terms)) if i not in held]
        squares = np.zeros(len(self.terms)) if start is None else start.copy()
        squares[list(held)] = list(held.values())
        fixed = squares[list(held)] @ self.columns[list(held)] + bands.floor
        v = self.variance(squares)
        if start is None:  # smoothed power of the record
            few = np.ones(9)
            v = np.convolve(bands.power, few, "same") / np.convolve(bands.number, few, "same") + bands.floor
        power, top = self.evaluate(v)
        if start is None:
            top = -math.inf
        for _ in range(_STEPS):
            scaled = self.columns[free] / v
            right = scaled @ (self.weight * (power - fixed) / v)
            wanted = squares.copy()
            wanted[free] = _non_negative((scaled * self.weight) @ scaled.T, right)
            before, part = top, 1.0
            while True:
                trial = squares + part * (wanted - squares) if math.isfinite(before) else wanted
                v = self.variance(trial)
                power, top = self.evaluate(v)
                if top >= before or part < 1e-3:
                    break
                part *= 0.5
            if top < before:  # no step increases it: this is the maximum, to rounding
                return squares, before
            squares = trial
            if top - before < _CLOSE:
                break
        return squares, top

    def loss(self, held: Mapping[int, float]) -> float:
        """Return twice the loss of the log-likelihood with c² of some terms held fixed, by their numbers."""
        return 2.0 * (self.top - self.solve(held, start=self.best)[1])


def _non_negative(normal: Array, right: Array) -> Array:
    """Solve a least-squares problem with non-negative unknowns, given its normal equations.

    If not all are positive, all subsets are tried: five unknowns have 32, and the best feasible one is the solution. No
    iteration that could fail is needed.
    """
    count = len(right)
    if count == 0:
        return np.zeros(0)
    size = np.sqrt(np.diag(normal))
    # the small addition handles two terms that the record cannot distinguish
    normal, right = normal / np.outer(size, size) + 1e-12 * np.eye(count), right / size
    solution = np.linalg.solve(normal, right)
    if np.all(solution >= 0.0):
        return np.asarray(solution / size)
    chosen = (np.arange(1, 2**count)[:, None] >> np.arange(count)) & 1 == 1
    matrices = np.where(chosen[:, :, None] & chosen[:, None, :], normal, np.eye(count))
    solutions = np.linalg.solve(matrices, np.where(chosen, right, 0.0)[:, :, None])[:, :, 0]
    gain = np.where(np.all(solutions >= 0.0, axis=1), solutions @ right, 0.0)
    best = int(np.argmax(gain))
    return np.asarray(solutions[best] / size if gain[best] > 0.0 else np.zeros(count))
