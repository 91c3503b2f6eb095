"""The units that data sheets use for the errors of inertial sensors, as their keys name them, in SI."""

from __future__ import annotations

from collections.abc import Mapping

from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, DEG_SQRT_H, FOOT, G0, MPS_SQRT_H, PPM, UG

ANGLE = {"arcsec": ARCSEC, "arcmin": ARCMIN, "mrad": 1e-3, "urad": 1e-6, "deg": DEG}
RATE = {"deg_h": DEG_H, "deg_s": DEG, "mdeg_s": 1e-3 * DEG, "urad_s": 1e-6, "rad_s": 1.0}
ACCELERATION = {"ug": UG, "mg": 1e3 * UG, "g": G0, "mps2": 1.0}
RATIO = {"ppm": PPM, "percent": 1e-2}
ANGLE_WALK = {
    "deg_sqrt_h": DEG_SQRT_H,
    "deg_h_sqrt_hz": DEG_H,
    "deg_s_sqrt_hz": DEG,
    "mdeg_s_sqrt_hz": 1e-3 * DEG,
    "rad_s_sqrt_hz": 1.0,
}
VELOCITY_WALK = {
    "ug_sqrt_hz": UG,
    "mg_sqrt_hz": 1e3 * UG,
    "mps_sqrt_h": MPS_SQRT_H,
    "ftps_sqrt_h": FOOT * MPS_SQRT_H,
    "mps2_sqrt_hz": 1.0,
}
PER_HOUR = {"h": 3600.0, "s": 1.0}
PER_DEGREE = {"c": 1.0}
PER_G = {"g": G0, "mps2": 1.0}


def per(units: Mapping[str, float], below: Mapping[str, float]) -> dict[str, float]:
    """Return the units of a quotient: every combination, for example "deg_h_per_g". `units`: units of the numerator,
    size in SI by name in a key."""
    return {f"{name}_per_{other}": size / unit for name, size in units.items() for other, unit in below.items()}


_WRITTEN = {
    "deg_h": "deg/h",
    "deg_sqrt_h": "deg/√h",
    "deg_h_sqrt_h": "deg/h/√h",
    "deg_s": "deg/s",
    "deg2_s2": "(deg/s)²",
    "ug": "µg",
    "ug_sqrt_hz": "µg/√Hz",
    "ug_sqrt_h": "µg/√h",
    "mm_s": "mm/s",
    "c": "°C",
    "g2": "g²",
    "g3": "g³",
}
"""Customary notation of units where it differs from that in keys."""
