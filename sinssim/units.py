"""Units of scenarios, data sheets and reports in SI: multiply on input, divide on output."""

from __future__ import annotations

import math

DEG = math.pi / 180.0
"""degree [rad]"""
ARCMIN = DEG / 60.0
"""minute of arc [rad]"""
ARCSEC = DEG / 3600.0
"""second of arc [rad]"""
DEG_H = DEG / 3600.0
"""degree per hour [rad/s]"""
DEG_SQRT_H = DEG / 60.0
"""degree per square root of an hour [rad/√s]"""
G0 = 9.80665
"""standard gravity, exact by definition (CGPM 1901) [m/s²]"""
UG = 1e-6 * G0
"""micro-g [m/s²]; a noise density of 1 µg/√Hz is the same number in m/s/√s"""
MGAL = 1e-5
"""milligal [m/s²]"""
PPM = 1e-6
"""part per million"""
MPS_SQRT_H = 1.0 / 60.0
"""metre per second per square root of an hour [m/s/√s]"""
KNOT = 1852.0 / 3600.0
"""international knot [m/s]"""
FOOT = 0.3048
"""international foot [m]"""
NAUTICAL_MILE = 1852.0
"""international nautical mile [m]"""

LENGTHS = {"m": 1.0, "km": 1e3, "nmi": NAUTICAL_MILE, "NM": NAUTICAL_MILE, "ft": FOOT}
"""Units of length as people write them [m]."""
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "kt": KNOT, "nmi/h": KNOT, "NM/h": KNOT, "m/h": 1.0 / 3600.0, "ft/s": FOOT}
"""Units of velocity and of the growth of a position error [m/s]."""
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": DEG, "°": DEG, "arcmin": ARCMIN, "'": ARCMIN, "arcsec": ARCSEC, '"': ARCSEC}
"""Units of angle [rad]."""
TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Units of time [s]."""
