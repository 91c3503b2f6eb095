"""Long-crested waves of a sea, by the spectrum of Bretschneider (ITTC, 7.5-02-07-01.1, two parameters).

The one-sided spectrum of the height over angular frequency is

    S(ω) = (5/16) H² ω_p⁴ ω⁻⁵ exp(−(5/4)(ω_p/ω)⁴)

with significant height H = 4√m₀ and the peak at ω_p. The spectrum of a fully developed sea, of Pierson and Moskowitz
(J. Geophys. Res. 69, 1964, 5181), S = 0.0081 g² ω⁻⁵ exp(…), is the case ω_p² H = 4√(0.0081/5) g, or ω_p = 0.401√(g/H).
In deep water the wave number is k = ω²/g, and the water moves on circles.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.jit import kernel
from sinssim.statistics.random_numbers import normals

G = 9.80665
"""Gravity of the waves, m/s²."""
WAVES = 256
"""Number of waves of different frequencies."""
_LOW, _HIGH = 0.5, 4.0  # range of frequencies in units of the peak's: all but 0.5 % of the variance


_FASTEST = 4.0 * np.pi  # largest frequency, which no hull follows [rad/s]


class Sea(NamedTuple):
    """The waves of a sea: angular frequencies (rad/s), wave numbers (rad/m), and amplitudes of cosine and sine (m)."""

    omega: Array
    k: Array
    cosine: Array
    sine: Array


def peak(height: float, period: float | None) -> float:
    """Return the angular frequency of the spectrum's peak, rad/s; without a period that of Pierson and Moskowitz."""
    if period is not None:
        return 2.0 * np.pi / period
    return float(np.sqrt(4.0 * np.sqrt(0.0081 / 5.0) * G / height))


def density(omega: ArrayLike, height: float, omega_p: float) -> Array:
    """Return the spectrum of Bretschneider.

    Args:
        omega: (...) rad/s, positive.
        height: significant height, m.
        omega_p: peak, rad/s.

    Returns:
        S, (...) m² s/rad.
    """
    x = np.asarray(omega, dtype=np.float64) / omega_p
    return np.asarray(5.0 / 16.0 * height**2 / omega_p * x**-5.0 * np.exp(-1.25 * x**-4.0))


def waves(height: float, omega_p: float, seed: int) -> Sea:
    """Return the waves of a Gaussian sea; their frequencies are drawn within equal bands, so that none repeats.

    Args:
        height: significant height, m.
        omega_p: peak, rad/s.
    """
    draws = normals(seed, "sea", 0, 3 * WAVES).reshape(3, -1)
    edges = np.linspace(_LOW * omega_p, max(min(_HIGH * omega_p, _FASTEST), 2.0 * omega_p), WAVES + 1)
    from scipy.special import ndtr

    omega = edges[:-1] + ndtr(draws[2]) * np.diff(edges)
    size = np.sqrt(density(omega, height, omega_p) * np.diff(edges))
    return Sea(omega, omega**2 / G, size * draws[0], size * draws[1])


@kernel
def ride(waves: Sea, time: Array, ahead: Array, height: Array, along: Array, slope: Array) -> None:
    """Compute the waves at a place that moves.

    Args:
        time: s, (K,).
        ahead: way of the place in the direction of the waves, m, (K,).
        height: receives the height of the water, m, (K,).
        along: receives the displacement of the water in the direction of the waves, on its circle, m, (K,).
        slope: receives the slope of the surface in that direction, (K,).
    """
    for row in range(len(time)):
        h = a = s = 0.0
        for i in range(len(waves.omega)):
            phase = waves.omega[i] * time[row] - waves.k[i] * ahead[row]
            cosine, sine = cos(phase), sin(phase)
            h += waves.cosine[i] * cosine + waves.sine[i] * sine
            beside = waves.cosine[i] * sine - waves.sine[i] * cosine
            a += beside
            s += waves.k[i] * beside
        height[row], along[row], slope[row] = h, a, s
