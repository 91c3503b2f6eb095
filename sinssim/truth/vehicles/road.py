"""The height of a rough road along the way, by ISO 8608:1995, Mechanical vibration - Road surface profiles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.statistics.random_numbers import normals

REFERENCE = 0.1
"""Wave number of the class limits, cycles/m."""
LOWEST, HIGHEST = 0.011, 2.83
"""Range of wave numbers of the standard's classes, cycles/m."""
STEP = 0.1
"""Distance between samples of the road, m: 3.5 samples for the shortest wave."""


def density(wave_number: ArrayLike, at_reference: float) -> Array:
    """Return the one-sided spectral density of the height, G(n) = G(0.1)·(n/0.1)⁻².

    Args:
        wave_number: n, (...) cycles/m.
        at_reference: G(0.1), m³.

    Returns:
        (...) m³; zero outside of the standard's range.
    """
    n = np.asarray(wave_number, dtype=np.float64)
    inside = (n >= LOWEST) & (n <= HIGHEST)
    return np.where(inside, at_reference * (np.where(inside, n, 1.0) / REFERENCE) ** -2.0, 0.0)


def heights(length: float, at_reference: float, highest: float, seed: int) -> Array:
    """Return the heights of a road at every `STEP`: Gaussian, with the spectral density of the standard.

    Args:
        length: of the road, m.
        at_reference: G(0.1), m³.
        highest: largest wave number that the road has, cycles/m; the standard's at most.
        seed: seed of the random numbers.

    Returns:
        Heights, m; a period of the road is longer than its length.
    """
    count = 1 << int(np.ceil(np.log2(max(length / STEP + 2.0, 2.0 / (LOWEST * STEP)))))
    n = np.fft.rfftfreq(count, STEP)
    power = density(n, at_reference) * (n <= highest)
    draws = normals(seed, "road", 0, 2 * len(n)).reshape(2, -1)
    # amplitudes of cosine and sine with the variance G Δn each; irfft divides by count/2
    size = 0.5 * count * np.sqrt(power * (n[1] - n[0]))
    return np.asarray(np.fft.irfft(size * (draws[0] - 1j * draws[1]), count))
