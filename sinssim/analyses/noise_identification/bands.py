"""Cosine coefficients of a record, averaged over bands in which the noise terms hardly change.

The likelihood of a record of millions of samples needs only some 250 sums of squares: of the coefficients z_k (see
`terms`) one by one at low frequencies, then over bands whose width is 4 % of their frequency. In addition it needs the
sums of products with components of a record that are not noise with a spectrum: the ramp, and the two ends of the
quantisation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.noise_identification.terms import FEW, NoiseTerm, end_effects, ramp_coefficients
from sinssim.data import Array

_WIDTH = 1.04  # ratio of a band's last to its first frequency
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def rounding(count: int) -> float:
    """Return the relative rounding error of an increment: times of a record of n intervals are rounded to n ε T."""
    return 4.0 * float(np.finfo(np.float64).eps) * count


class Bands:
    """A record as bands of its cosine coefficients.

    Args:
        departures: the increments less their mean, (n,) rad or m/s.
        interval: T, s.
        largest: largest increment, whose digits limit those of the departures.

    Attributes:
        count: number of increments used; a few at the end may be dropped for a fast transform.
        interval: T, s.
        edges: first coefficient of each band, and the one after the last, (b+1,).
        number: coefficients in each band, (b,).
        power: sum of z² over each band.
        shapes_z: sums of ramp or end effect times z, (3, b).
        shapes: sums of products of ramp and end effects, (3, 3, b).
        ramp: ramp subtracted from z, SI.
        fourth: fourth cumulant of a single rounding error, if all white noise of the angle were such errors, SI.
        floor: power of floating-point rounding errors, including those of times.
        rounded: whether the record has no more power than that.
    """

    def __init__(self, departures: Array, interval: float, largest: float) -> None:
        from scipy.fft import dct, prev_fast_len

        self.count = prev_fast_len(len(departures), real=True)
        self.interval = interval
        self._basis = _basis(self.count, interval)
        self.edges, self.shapes = self._basis.edges, self._basis.products
        self.number = np.diff(self.edges).astype(np.float64)
        self._z = dct(departures[: self.count], norm="ortho")
        self.ramp = 0.0
        # The ramp for pure rate random walk: the rise between the ends.
        ramp = self._basis.ramp
        weights = np.arange(self.count, dtype=np.float64) ** 2 * ramp
        self.take_off(np.array([float(weights @ self._z / (weights @ ramp)), 0.0, 0.0]))
        self.floor = (rounding(self.count) * largest) ** 2
        self.rounded = float(self.power.sum()) < self.count * self.floor
        second = np.diff(departures)  # rounding errors of the angle q₂ − 2q₁ + q₀: 1 + 2⁴ + 1 fourth cumulants
        squares = second**2
        self.fourth = float(np.mean(squares**2) - 3.0 * np.mean(squares) ** 2) / 18.0

    def take_off(self, sizes: Array) -> None:
        """Subtract approximate ramp and end effects from the coefficients, to reduce rounding errors.

        Args:
            sizes: sizes of the ramp and of the end effects in even and odd coefficients, (3,).
        """
        z, basis = self._z, self._basis
        z -= float(sizes[0]) * basis.ramp
        z[0::2] -= float(sizes[1]) * basis.ends[0::2]
        z[1::2] -= float(sizes[2]) * basis.ends[1::2]
        self.ramp += float(sizes[0])
        starts = self.edges[:-1]
        self.power = np.add.reduceat(z**2, starts)
        both = basis.ends * z
        odd = both.copy()
        odd[0::2] = 0.0
        odd_sum = np.add.reduceat(odd, starts)
        self.shapes_z = np.stack(
            [np.add.reduceat(basis.ramp * z, starts), np.add.reduceat(both, starts) - odd_sum, odd_sum]
        )

    @property
    def angle(self) -> Array:
        """2πfT in the middle of each band."""
        return np.asarray(0.5 * np.pi * (self.edges[1:] + self.edges[:-1] - 1) / self.count)

    def column(self, term: NoiseTerm) -> Array:
        """Return a term's mean power in each band.

        Returns:
            (b,), by Gauss quadrature over wide bands.
        """
        low, high = self.edges[:-1], self.edges[1:]
        middle, half = 0.5 * (low + high - 1), 0.5 * (high - low) * (high - low > 1)
        k = middle[:, None] + half[:, None] * _NODES
        return np.asarray(term.power(k, self.count, self.interval) @ _WEIGHTS / 2.0)


@dataclass(frozen=True)
class _Basis:
    """Edges of the bands, the shapes of ramp and ends, and the sums of their products over the bands."""

    edges: NDArray[np.int64]
    ramp: Array
    ends: Array
    products: Array


@lru_cache(maxsize=1)
def _basis(count: int, interval: float) -> _Basis:
    """Return the basis common to all channels of a log."""
    edges = list(range(1, min(FEW, count)))
    edge = float(FEW)
    while edge < count:
        edges.append(int(edge))
        edge = max(edge * _WIDTH, edge + 1.0)
    bands = np.array([*edges, count], dtype=np.int64)
    ramp, ends = ramp_coefficients(count, interval), end_effects(count)
    odd = ends.copy()
    odd[0::2] = 0.0
    products = np.zeros((3, 3, len(bands) - 1))
    products[0, 0] = np.add.reduceat(ramp**2, bands[:-1])
    products[0, 2] = products[2, 0] = np.add.reduceat(ramp * odd, bands[:-1])
    products[2, 2] = np.add.reduceat(odd**2, bands[:-1])
    products[1, 1] = np.add.reduceat(ends**2, bands[:-1]) - products[2, 2]
    return _Basis(bands, ramp, ends, products)
