"""The roughness of a road and the waves of a sea: spectral densities, and random realisations of them.

Road: ISO 8608:1995, Mechanical vibration - Road surface profiles. Sea: long-crested waves by the spectrum of
Bretschneider (ITTC, 7.5-02-07-01.1, two parameters).

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


def wave_density(omega: ArrayLike, height: float, omega_p: float) -> Array:
    """Return the spectrum of Bretschneider at ω > 0 for a significant height, m, and a peak, rad/s: S, (...) m²
    s/rad."""
    x = np.asarray(omega, dtype=np.float64) / omega_p
    return np.asarray(5.0 / 16.0 * height**2 / omega_p * x**-5.0 * np.exp(-1.25 * x**-4.0))


def waves(height: float, omega_p: float, seed: int) -> Sea:
    """Return the waves of a Gaussian sea of a significant height, m, and a peak, rad/s; their frequencies are drawn
    within equal bands, so that none repeats."""
    draws = normals(seed, "sea", 0, 3 * WAVES).reshape(3, -1)
    edges = np.linspace(_LOW * omega_p, max(min(_HIGH * omega_p, _FASTEST), 2.0 * omega_p), WAVES + 1)
    from scipy.special import ndtr

    omega = edges[:-1] + ndtr(draws[2]) * np.diff(edges)
    size = np.sqrt(wave_density(omega, height, omega_p) * np.diff(edges))
    return Sea(omega, omega**2 / G, size * draws[0], size * draws[1])


@kernel
def ride(waves: Sea, time: Array, ahead: Array, height: Array, along: Array, slope: Array) -> None:
    """Compute the waves at a place that moves `ahead`, m, in their direction: height of the water, m, its displacement
    along the waves, on its circle, m, and the slope of the surface in that direction, (K,)."""
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


REFERENCE = 0.1
"""Wave number of the class limits, cycles/m."""
LOWEST, HIGHEST = 0.011, 2.83
"""Range of wave numbers of the standard's classes, cycles/m."""
STEP = 0.1
"""Distance between samples of the road, m: 3.5 samples for the shortest wave."""


def road_density(wave_number: ArrayLike, at_reference: float) -> Array:
    """Return the one-sided spectral density of the height, G(n) = G(0.1)·(n/0.1)⁻² at wave numbers n, (...) cycles/m:
    (...) m³; zero outside of the standard's range."""
    n = np.asarray(wave_number, dtype=np.float64)
    inside = (n >= LOWEST) & (n <= HIGHEST)
    return np.where(inside, at_reference * (np.where(inside, n, 1.0) / REFERENCE) ** -2.0, 0.0)


def heights(length: float, at_reference: float, highest: float, seed: int) -> Array:
    """Return the heights of a road at every `STEP`: Gaussian, with the spectral density of the standard up to a largest
    wave number, cycles/m; its period is longer than its length, m."""
    count = 1 << int(np.ceil(np.log2(max(length / STEP + 2.0, 2.0 / (LOWEST * STEP)))))
    n = np.fft.rfftfreq(count, STEP)
    power = road_density(n, at_reference) * (n <= highest)
    draws = normals(seed, "road", 0, 2 * len(n)).reshape(2, -1)
    # amplitudes of cosine and sine with the variance G Δn each; irfft divides by count/2
    size = 0.5 * count * np.sqrt(power * (n[1] - n[0]))
    return np.asarray(np.fft.irfft(size * (draws[0] - 1j * draws[1]), count))
