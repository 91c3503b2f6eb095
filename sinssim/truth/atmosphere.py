"""The air of a flight: wind over height, and the standard atmosphere with a temperature and a pressure of its own.

Source of the atmosphere: ICAO Doc 7488, Manual of the ICAO Standard Atmosphere, 3rd edition, 1993. On a warm day every
temperature is higher by the same deviation, and the pressure follows from the hydrostatic equation. Above, a rocket has
the density of the U.S. Standard Atmosphere 1976 up to 100 km.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import numpy as np

STANDARD_PRESSURE = 101_325.0
"""Pressure of the standard atmosphere at sea level [Pa]."""
STANDARD_TEMPERATURE = 288.15
"""Its temperature at sea level [K]."""

_G0, _R, _GAMMA = 9.80665, 287.05287, 1.4  # m/s², J/(kg K), ratio of the specific heats
_RADIUS = 6_356_766.0  # radius of the geopotential height [m]
_LAYERS = ((0.0, 288.15, -6.5e-3), (11_000.0, 216.65, 0.0), (20_000.0, 216.65, 1e-3))  # base m, K, lapse rate K/m
_SOUND = math.sqrt(_GAMMA * _R * STANDARD_TEMPERATURE)  # speed of sound at sea level [m/s]
_SONIC_IMPACT = math.pow(1.2, 3.5) - 1.0  # impact pressure over static pressure at the speed of sound
_RAYLEIGH = math.sqrt(math.pow(7.0 / 6.0, 2.5) / math.pow(1.2, 3.5))
_MACH_ROUNDS = 30

WindVector = tuple[float, float, float]
"""Velocity of the air, north, east, down, m/s: the direction towards which it moves."""


@dataclass(frozen=True)
class Air:
    """The air of a flight."""

    # heights above the ellipsoid with their wind, m and m/s, heights increasing
    levels: tuple[tuple[float, WindVector], ...] = ((0.0, (0.0, 0.0, 0.0)),)
    isa_deviation: float = 0.0  # temperature less that of the standard atmosphere, K
    sea_level_pressure: float = STANDARD_PRESSURE  # pressure at height 0, Pa

    @property
    def varies(self) -> bool:
        """Whether the wind changes with height."""
        return len(self.levels) > 1

    @property
    def standard(self) -> bool:
        """Whether temperature and pressure are those of the standard atmosphere."""
        return self.isa_deviation == 0.0 and self.sea_level_pressure == STANDARD_PRESSURE

    def wind(self, height: float) -> WindVector:
        """Return the wind at a height above the ellipsoid: linear in its components between two levels, constant beyond
        the outer ones."""
        levels = self.levels
        if height <= levels[0][0]:
            return levels[0][1]
        if height >= levels[-1][0]:
            return levels[-1][1]
        above = bisect_right(levels, height, key=lambda level: level[0])
        (low, below), (high, over) = levels[above - 1], levels[above]
        share = (height - low) / (high - low)
        return (
            below[0] + share * (over[0] - below[0]),
            below[1] + share * (over[1] - below[1]),
            below[2] + share * (over[2] - below[2]),
        )

    def temperature(self, height: float) -> float:
        """Return the static temperature at a height above the ellipsoid of at most 32 km, K."""
        geopotential = _geopotential(height)
        base, temperature, lapse = _layer(geopotential)
        return temperature + lapse * (geopotential - base) + self.isa_deviation

    def pressure(self, height: float) -> float:
        """Return the static pressure at a height above the ellipsoid of at most 32 km, Pa."""
        return self.sea_level_pressure * _ratio(_geopotential(height), self.isa_deviation)

    def pressure_altitude(self, height: float) -> float:
        """Return what a barometric altimeter without errors, set to 1013.25 hPa, reads at a height above the ellipsoid
        of at most 32 km, m.

        It is the height at which the standard atmosphere has the pressure. In the troposphere, with the standard
        pressure at sea level, it is T0/(T0 + ΔT) times the height, apart from the change of gravity with height.
        """
        if self.standard:
            return height
        ratio = self.pressure(height) / STANDARD_PRESSURE
        at_base = 1.0
        for number, (base, temperature, lapse) in enumerate(_LAYERS):
            over = _LAYERS[number + 1][0] if number + 1 < len(_LAYERS) else math.inf
            at_top = at_base * _change(over - base, temperature, lapse) if over < math.inf else 0.0
            if ratio > at_top:
                break
            at_base = at_top
        if lapse:
            rise = temperature / lapse * (math.pow(ratio / at_base, -_R * lapse / _G0) - 1.0)
        else:
            rise = -_R * temperature / _G0 * math.log(ratio / at_base)
        geopotential = base + rise
        return _RADIUS * geopotential / (_RADIUS - geopotential)

    def true_airspeed(self, calibrated: float, height: float) -> float:
        """Return the true airspeed of a calibrated airspeed at a height, by compressible flow, m/s.

        Below the speed of sound the flow to the pitot tube is isentropic; above it a normal shock stands before the
        tube, and Rayleigh's pitot formula holds (W. Gracey, Measurement of Aircraft Speed and Altitude, NASA RP-1046,
        1980).
        """
        impact = _impact(calibrated / _SOUND)  # over the pressure of the standard
        ratio = impact * STANDARD_PRESSURE / self.pressure(height)
        sound = math.sqrt(_GAMMA * _R * self.temperature(height))
        if ratio > _SONIC_IMPACT:
            return sound * _supersonic_mach(ratio)
        return sound * math.sqrt(5.0 * (math.pow(ratio + 1.0, 2.0 / 7.0) - 1.0))

    def ground_speed(self, calibrated: float, height: float, track: float) -> float:
        """Return the speed made good along a track, rad, at a calibrated airspeed and a height, m/s; negative if the
        wind is too strong."""
        north, east, _ = self.wind(height)
        along = north * math.cos(track) + east * math.sin(track)
        across = east * math.cos(track) - north * math.sin(track)
        return along + math.sqrt(max(self.true_airspeed(calibrated, height) ** 2 - across**2, 0.0))


def wind_from(direction_deg: float, speed: float, down: float = 0.0) -> WindVector:
    """Return the velocity of a wind from the direction from which it blows, degrees clockwise from true north, and its
    horizontal speed, m/s."""
    direction = math.radians(direction_deg)
    return -speed * math.cos(direction), -speed * math.sin(direction), down


def _impact(mach: float) -> float:
    """Return the impact pressure of a pitot tube over the static pressure, for γ = 1.4."""
    if mach <= 1.0:
        return math.pow(1.0 + 0.2 * mach**2, 3.5) - 1.0
    return math.pow(1.2 * mach**2, 3.5) * math.pow(6.0 / (7.0 * mach**2 - 1.0), 2.5) - 1.0


def _supersonic_mach(impact: float) -> float:
    """Invert Rayleigh's pitot formula: M = 0.88128 ((impact + 1)(1 − 1/(7M²))^2.5)^½, which contracts fourfold."""
    mach = 1.0
    for _ in range(_MACH_ROUNDS):
        mach = _RAYLEIGH * math.sqrt((impact + 1.0) * math.pow(1.0 - 1.0 / (7.0 * mach**2), 2.5))
    return mach


def _geopotential(height: float) -> float:
    return _RADIUS * height / (_RADIUS + height)


def _layer(geopotential: float) -> tuple[float, float, float]:
    """Return base, m, its temperature, K, and lapse rate, K/m, of the standard atmosphere's layer at a height."""
    return next(layer for layer in reversed(_LAYERS) if geopotential >= layer[0] or layer is _LAYERS[0])


def _change(rise: float, temperature: float, lapse: float) -> float:
    """Return the ratio of pressures over a rise in a layer, dp/p = −g dH/(R T)."""
    if lapse:
        return math.pow(1.0 + lapse * rise / temperature, -_G0 / (_R * lapse))
    return math.exp(-_G0 * rise / (_R * temperature))


def _ratio(geopotential: float, deviation: float) -> float:
    """Return the pressure at a geopotential height over that at sea level."""
    ratio = 1.0
    for number, (base, temperature, lapse) in enumerate(_LAYERS):
        over = _LAYERS[number + 1][0] if number + 1 < len(_LAYERS) else math.inf
        ratio *= _change(min(geopotential, over) - base, temperature + deviation, lapse)
        if geopotential <= over:
            break
    return ratio


SPACE_M = 100e3
"""Height from which there is no air, m."""

# U.S. Standard Atmosphere 1976, density every 5 km from 0 to 100 km, kg/m³
_DENSITY = (
    1.2250, 0.73643, 0.41351, 0.19476, 0.088910, 0.040084, 0.018410, 8.4634e-3, 3.9957e-3, 1.9663e-3, 1.0269e-3,
    5.6810e-4, 3.0968e-4, 1.6321e-4, 8.2829e-5, 3.9921e-5, 1.8458e-5, 8.2196e-6, 3.4160e-6, 1.3930e-6, 5.6040e-7,
)  # fmt: skip
_FIT = np.polyfit(np.linspace(0.0, 1.0, 21), np.log(_DENSITY), 9)


def density(height: Any) -> Any:
    """Return the density of the air at heights above the ellipsoid below 100 km, kg/m³; the kind of the argument."""
    x, value = np.maximum(height, -2e3) / SPACE_M, _FIT[0]
    for coefficient in _FIT[1:]:
        value = value * x + coefficient
    return np.exp(value)
