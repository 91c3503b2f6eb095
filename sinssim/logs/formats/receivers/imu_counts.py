"""Scale factors of counts in raw logs of NovAtel receivers, by type of IMU ("Raw IMU Scale Factors", OEM7 manual)."""

from __future__ import annotations

from sinssim.units import ARCSEC, DEG, FOOT, G0

_EPSON = 1e-3 * G0 / 65536.0
SCALES: dict[int, tuple[str, float, float]] = {
    5: ("HG1900-CA29", 2.0**-33, 2.0**-27 * FOOT),
    8: ("LN-200", 2.0**-19, 2.0**-14),
    11: ("HG1700-AG58", 2.0**-33, 2.0**-27 * FOOT),
    12: ("HG1700-AG62", 2.0**-33, 2.0**-26 * FOOT),
    13: ("iMAR-FSAS", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    16: ("CPT", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    26: ("ISA-100C", 1e-9, 2e-8),
    27: ("HG1900-CA50", 2.0**-33, 2.0**-27 * FOOT),
    31: ("ADIS16488", 720.0 / 2.0**31 * DEG, 200.0 / 2.0**31),
    32: ("STIM300", 2.0**-21 * DEG, 2.0**-22),
    33: ("KVH 1750", 0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    41: ("EG320N", 0.008 / 65536.0 / 125.0 * DEG, 0.2 * _EPSON / 125.0),
    58: ("HG4930", 2.0**-33, 2.0**-29),
}
"""Name, rad and m/s of a count, by the type of IMU. Type 41 agrees with the manual's example: |f| = 9.86 m/s²."""
