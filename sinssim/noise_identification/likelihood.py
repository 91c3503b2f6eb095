"""The likelihood of a record for given noise terms, and its maximum.

The cosine coefficients z of a band b are n_b independent normal numbers, on top of three shapes (ramp and ends) of
unknown sizes u, and of the variance

    v_b = Σ_i c_i² p_i(b),   c = Q, N, B, K and, if need be, σ_b                        (1)

With P_b the sum of z² and s_b the products of the shapes, the sizes and their covariance are

    u = C Σ_b (s·z)_b w_b/(n_b v_b),   C⁻¹ = Σ_b s_b w_b/(n_b v_b)                     (2)

and the restricted likelihood, which leaves the noise the degrees of freedom that u does not take (Patterson and
Thompson, Biometrika 58, 1971), is

    ℓ = −½ Σ_b w_b [ln v_b + P_b(u)/(n_b v_b)] + ½ ln det C                           (3)

P_b(u) being what is left of P_b without ramp and ends. The weight w_b is the number n_b of coefficients, or less for
a band that the terms do not describe as well. The maximum over c_i² ≥ 0 is found by Fisher's scoring, each step of
which is a weighted least-squares fit with non-negative unknowns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sinssim.data import Array
from sinssim.noise_identification.bands import Bands
from sinssim.noise_identification.terms import NoiseTerm

_STEPS = 200  # of the scoring, at most
_CLOSE = 1e-5  # of the logarithm of the likelihood


class Likelihood:
    """The likelihood of a record under some terms, at its maximum and anywhere else.

    Args:
        bands, terms, columns, weight: as the attributes.
        start: c² to begin with, (p,); the record's own power if not given.

    Attributes:
        bands: the record.
        terms: p noise terms.
        columns: mean power of each term in each band, (p, b).
        weight: degrees of freedom that a band counts for, (b,); the number of its coefficients, or fewer.
        best: c² at the maximum of the likelihood, (p,).
        top: the logarithm of the likelihood there.
    """

    def __init__(
        self, bands: Bands, terms: Sequence[NoiseTerm], columns: Array, weight: Array, start: Array | None = None
    ) -> None:
        self.bands, self.terms, self.columns, self.weight = bands, list(terms), columns, weight
        self.best, self.top = self.solve({}, start=start)

    def index(self, symbol: str) -> int:
        """Return which of the terms has a symbol."""
        return [term.symbol for term in self.terms].index(symbol)

    def variance(self, squares: Array) -> Array:
        """Return the variance v of every band's coefficients, (b,), under some c², (p,)."""
        return np.asarray(squares @ self.columns + self.bands.floor)  # (1)

    def weighed(self, weight: Array) -> Likelihood:
        """Return the same terms with other weights, (b,)."""
        return Likelihood(self.bands, self.terms, self.columns, weight)

    def extended(self, term: NoiseTerm) -> Likelihood:
        """Return the same weights with one more term."""
        columns = np.concatenate([self.columns, self.bands.column(term)[None]])
        return Likelihood(self.bands, [*self.terms, term], columns, self.weight, np.append(self.best, 0.0))

    def ramp_and_ends(self, v: Array) -> tuple[Array, Array]:
        """Return the sizes of ramp and ends by generalised least squares, (3,), and their covariance, (3, 3)."""
        w = self.weight / self.bands.number / v
        covariance = np.asarray(np.linalg.inv(self.bands.shapes @ w), dtype=np.float64)
        return covariance @ (self.bands.shapes_z @ w), covariance  # (2)

    def eliminated(self, v: Array) -> tuple[Array, Array, float]:
        """Take ramp and ends off, given the variances.

        Returns:
            The remaining power in each band; the part of it that the fit took, expected; the logarithm of the
            determinant of their covariance.
        """
        bands = self.bands
        size, covariance = self.ramp_and_ends(v)
        power = bands.power - 2.0 * size @ bands.shapes_z + np.einsum("i,ijb,j->b", size, bands.shapes, size)
        taken = np.einsum("ij,ijb->b", covariance, bands.shapes)
        return np.maximum(power, 0.0), taken, float(np.linalg.slogdet(covariance)[1])

    def evaluate(self, v: Array) -> tuple[Array, float]:
        """Return the mean power of every band for scoring, and the logarithm of the likelihood.

        Args:
            v: variance of every band's coefficients, (b,).

        Returns:
            Each band's mean power without ramp and ends, (b,), with what of the noise these have taken put back; and
            the logarithm of the restricted likelihood.
        """
        power, taken, determinant = self.eliminated(v)
        terms = self.weight * (np.log(v) + power / (self.bands.number * v))
        return (power + taken) / self.bands.number, -0.5 * (float(terms.sum()) - determinant)  # (3)

    def solve(self, held: Mapping[int, float], start: Array | None = None) -> tuple[Array, float]:
        """Maximise the likelihood over c² ≥ 0.

        Args:
            held: terms that are held, and their c².
            start: c² to begin with.

        Returns:
            c², (p,), and the logarithm of the likelihood.
        """
        bands = self.bands
        free = [i for i in range(len(self.terms)) if i not in held]
        squares = np.zeros(len(self.terms)) if start is None else start.copy()
        squares[list(held)] = list(held.values())
        fixed = squares[list(held)] @ self.columns[list(held)] + bands.floor
        v = self.variance(squares)
        if start is None:  # the record's own power, smoothed
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
            if top < before:  # no step leads up: this is the top, to rounding
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

    If not all are positive, every subset is tried: five unknowns have 32, of which the best feasible one is the
    solution, with no iteration that could go astray.
    """
    count = len(right)
    if count == 0:
        return np.zeros(0)
    size = np.sqrt(np.diag(normal))
    # the small part lets two terms be alike that the record cannot tell apart
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
