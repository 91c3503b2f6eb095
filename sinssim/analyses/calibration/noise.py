"""The noise that a calibration assumes: white noise, bias instability, and quantisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.imu.terms import of_triad


@dataclass(frozen=True)
class TriadNoise:
    """The noise of three sensors, each with the same figures.

    Attributes:
        white: random walk N of the integral, rad/√s or m/s/√s.
        instability: 1σ of the bias instability, rad/s or m/s².
        correlation_time: its correlation time, s.
        quantum: weight of a pulse, rad or m/s.
        untold: names of the noises that the scenario has and the calibration does not model.
    """

    white: float
    instability: float
    correlation_time: float
    quantum: float
    untold: tuple[str, ...]


def noise_of(imu: Imu, triad: str) -> TriadNoise:
    """Return the noise of the gyros or of the accelerometers.

    Args:
        triad: "gyro" or "accel".
    """
    own: TriadErrors = getattr(imu.sigma, triad)
    untold = tuple(
        term.label for term in of_triad(triad) if term.field in ("flicker", "rate_walk") and getattr(own, term.field)
    )
    return TriadNoise(own.random_walk, own.instability, own.correlation_time, own.quantum, untold)


def covariance_of_integrals(noise: TriadNoise, spans: Array, floor: float) -> Array:
    """Return the covariance of the integrals of one sensor over separate spans.

    The white noise gives N²T. The instability, of covariance σ² e^(−|t−u|/τ), gives for two spans with begin a and end
    b the double integral σ²τ² (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−(a₂−b₁)/τ) for b₁ ≤ a₂, and 2σ²τ² (T/τ − 1 +
    e^(−T/τ)) for the same span. The integral between two readings of a counter has Q²/6.

    Args:
        spans: beginning and end of each span, without overlap, (K, 2) s.
        floor: 1σ that is added to each, against an observation without any noise, rad or m/s.

    Returns:
        (K, K), rad² or m²/s².
    """
    length = spans[:, 1] - spans[:, 0]
    found = np.diag(noise.white**2 * length + noise.quantum**2 / 6.0 + floor**2)
    if noise.instability > 0.0:
        tau, power = noise.correlation_time, (noise.instability * noise.correlation_time) ** 2
        own = 2.0 * power * (length / tau + np.expm1(-length / tau))
        gap = spans[None, :, 0] - spans[:, None, 1]  # from the end of the first to the beginning of the second
        decay = np.exp(-np.maximum(gap, gap.T) / tau)
        lost = -np.expm1(-length / tau)
        mixed = power * lost[:, None] * lost[None, :] * decay
        np.fill_diagonal(mixed, own)
        found = found + mixed
    return found
