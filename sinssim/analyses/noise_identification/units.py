"""Order, names, units and digits of noise terms in tables."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sinssim.logs.text.samples import TriadName
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, UG

SYMBOLS = ("Q", "N", "B", "K", "R", "sigma_b")
"""Noise terms in the order of display."""
NAMES: dict[str, str] = {
    "Q": "quantisation",
    "N": "random walk",
    "B": "bias instability, flicker",
    "K": "rate random walk",
    "R": "rate ramp",
    "sigma_b": "Gauss-Markov bias, 1σ",
}
"""Names of the noise terms."""
_HOUR = 3600.0


@dataclass(frozen=True)
class Units:
    """The units in which a channel's noise is given.

    Attributes:
        rate: unit of the reading itself and of its Allan deviation, and its size in SI.
        terms: unit and size of each noise term.
        key: ending of the names of numbers in JSON; "" if the unit is given separately.
    """

    rate: tuple[str, float]
    terms: dict[str, tuple[str, float]]
    key: str = ""

    def named(self, what: str) -> str:
        """Return the name of a number in the unit of the reading for JSON, for example mean_deg_h."""
        return f"{what}_{self.key}" if self.key else what


UNITS: dict[TriadName, Units] = {
    "gyro": Units(
        ("deg/h", DEG_H),
        {
            "Q": ("arcsec", ARCSEC),
            "N": ("deg/√h", DEG_SQRT_H),
            "B": ("deg/h", DEG_H),
            "K": ("deg/h/√h", DEG_H / math.sqrt(_HOUR)),
            "R": ("deg/h/h", DEG_H / _HOUR),
            "sigma_b": ("deg/h", DEG_H),
        },
        "deg_h",
    ),
    "accel": Units(
        ("µg", UG),
        {
            "Q": ("mm/s", 1e-3),
            "N": ("µg/√Hz", UG),
            "B": ("µg", UG),
            "K": ("µg/√h", UG / math.sqrt(_HOUR)),
            "R": ("µg/h", UG / _HOUR),
            "sigma_b": ("µg", UG),
        },
        "ug",
    ),
}
"""Units of gyros and accelerometers: those of data sheets."""

_AT_THE_END = {
    "c": "°C", "degc": "°C", "pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mbar": "mbar", "m": "m", "mm": "mm", "km": "km",
    "ft": "ft", "mps": "m/s", "mps2": "m/s²", "ug": "µg", "deg": "deg", "rad": "rad", "arcsec": "arcsec",
    "arcmin": "arcmin", "mrad": "mrad", "urad": "µrad", "dps": "deg/s", "deg_s": "deg/s", "rad_s": "rad/s",
    "deg_h": "deg/h", "hz": "Hz", "mv": "mV", "nt": "nT", "ut": "µT", "percent": "%",
}  # fmt: skip


def unit_in_name(name: str) -> str | None:
    """Return the unit at the end of a column's name.

    Returns:
        For example "Pa" for pressure_pa, "deg/h" for rate_deg_h; None if there is no known unit.
    """
    words = name.lower().split("_")
    for count in (2, 1):
        if len(words) > count and (unit := _AT_THE_END.get("_".join(words[-count:]))) is not None:
            return unit
    return None


def units_of(unit: str) -> Units:
    """Return the units of a quantity's noise terms: the quantity's unit times powers of a second.

    Args:
        unit: unit of the quantity, any text; "1" for a plain number.

    Returns:
        The units, all of size 1.
    """
    terms = {"Q": "·s", "N": "/√Hz", "B": "", "K": "/√s", "R": "/s", "sigma_b": ""}
    return Units((unit, 1.0), {symbol: (unit + power, 1.0) for symbol, power in terms.items()})


def four_digits(value: float) -> str:
    """Write a number with four significant digits, without an exponent for moderate sizes.

    Returns:
        For example "0.1500", "1234", "2.100e-06".
    """
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.3e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def symbol_text(symbol: str) -> str:
    """Return the printed symbol of a term.

    Args:
        symbol: one of `SYMBOLS`.
    """
    return "σ_b" if symbol == "sigma_b" else symbol
