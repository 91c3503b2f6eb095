"""Noise terms as people write them: their order, names, units and digits."""

from __future__ import annotations

import math

from sinssim.sensors.log import TriadName
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, UG

SYMBOLS = ("Q", "N", "B", "K", "R", "sigma_b")
"""Noise terms in the order in which they are shown."""
NAMES: dict[str, str] = {
    "Q": "quantisation",
    "N": "random walk",
    "B": "bias instability, flicker",
    "K": "rate random walk",
    "R": "rate ramp",
    "sigma_b": "Gauss-Markov bias, 1σ",
}
"""Noise terms in words."""
RATE_UNIT: dict[TriadName, tuple[str, float]] = {"gyro": ("deg/h", DEG_H), "accel": ("µg", UG)}
"""Unit of rates, and its size in SI."""

_HOUR = 3600.0
UNITS: dict[TriadName, dict[str, tuple[str, float]]] = {
    "gyro": {
        "Q": ("arcsec", ARCSEC),
        "N": ("deg/√h", DEG_SQRT_H),
        "B": ("deg/h", DEG_H),
        "K": ("deg/h/√h", DEG_H / math.sqrt(_HOUR)),
        "R": ("deg/h/h", DEG_H / _HOUR),
        "sigma_b": ("deg/h", DEG_H),
    },
    "accel": {
        "Q": ("mm/s", 1e-3),
        "N": ("µg/√Hz", UG),
        "B": ("µg", UG),
        "K": ("µg/√h", UG / math.sqrt(_HOUR)),
        "R": ("µg/h", UG / _HOUR),
        "sigma_b": ("µg", UG),
    },
}
"""Unit of each term, and its size in SI."""


def number(value: float) -> str:
    """Write a number with four significant digits, and no exponent where a person can do without.

    Args:
        value: any.

    Returns:
        For example "0.1500", "1234", "2.100e-06".
    """
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.3e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def label(symbol: str) -> str:
    """Return a term's symbol as it is printed.

    Args:
        symbol: of `SYMBOLS`.

    Returns:
        The same, but for σ_b.
    """
    return "σ_b" if symbol == "sigma_b" else symbol
