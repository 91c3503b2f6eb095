"""The Earth's main magnetic field by the World Magnetic Model (WMM), and its declination along a path.

The coefficients and the synthesis are those of the package `pygeomag`. Each model serves five years: WMM-2015v2 from
2015.0, WMM-2020 from 2020.0, WMM-2025 from 2025.0 to 2030.0. The model describes the field of the core; its stated 1σ
of the declination, which contains the field of the crust, is √(0.26² + (5417 nT/H)²) degrees with the horizontal
intensity H (WMM2025 report, NOAA NCEI).
"""

from __future__ import annotations

import calendar
import datetime
import math

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError

VALID = (2015.0, 2030.0)
"""First and last decimal year of the models."""

BLACKOUT = 2e-6
"""Horizontal field below which a compass is useless: the blackout zone of the WMM, T."""

_KNOT = 200.0
"""Distance between places at which the model is evaluated, m."""

_RADIUS = 6.371e6
_NANO = 1e-9


def decimal_year(date: float | str) -> float:
    """Return a date, "YYYY-MM-DD" or a decimal year, as a decimal year."""
    if isinstance(date, str):
        try:
            day = datetime.date.fromisoformat(date)
        except ValueError as error:
            raise InputError(f'{date!r} is not a date; give a decimal year or "YYYY-MM-DD"') from error
        elapsed = day.timetuple().tm_yday - 1
        year = day.year + elapsed / (366 if calendar.isleap(day.year) else 365)
    else:
        year = date  # not converted yet: an integer may be too large
    if not VALID[0] <= year <= VALID[1]:
        raise InputError(
            f"{date!r} is outside the validity of the World Magnetic Model, which is known here from {VALID[0]} to "
            f"{VALID[1]}"
        )
    return float(year)


def magnetic_field(latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike, year: float) -> Array:
    """Return the main field, north, east, down, (..., 3) T, at geodetic places on WGS-84 in a decimal year of
    `VALID`."""
    from pygeomag import GeoMag

    first = min(5 * int(decimal_year(year) // 5), int(VALID[1]) - 5)  # 2030.0 is the end of WMM-2025
    model = GeoMag(base_year=first)
    lat, lon, h = np.broadcast_arrays(np.degrees(latitude), np.degrees(longitude), height)
    out = np.empty((lat.size, 3))
    for i, (phi, lam, z) in enumerate(zip(lat.flat, lon.flat, h.flat, strict=True)):
        field = model.calculate(float(phi), math.remainder(lam, 360.0), 1e-3 * float(z), year)
        out[i] = field.x, field.y, field.z
    return _NANO * out.reshape(*lat.shape, 3)


def field_along(latitude: Array, longitude: Array, height: Array, year: float) -> Array:
    """Return the main field along a path of geodetic points on WGS-84, (M,): north, east, down, (M, 3) T. It is
    evaluated every 200 m and interpolated in Earth-fixed axes between."""
    axes = _axes(latitude, longitude)
    gone = np.concatenate(
        ([0.0], np.cumsum(np.linalg.norm(np.diff(axes[:, 2] * (_RADIUS + height)[:, None], axis=0), axis=1)))
    )
    # a point is a knot if it is the first of its stretch of 200 m, or the last of the path
    knot = np.flatnonzero(np.diff(np.floor(gone / _KNOT), prepend=-1.0))
    knot = np.unique(np.append(knot, len(gone) - 1))
    ned = magnetic_field(latitude[knot], longitude[knot], height[knot], year)
    fixed = np.einsum("kij,ki->kj", axes[knot], ned)
    between = np.column_stack([np.interp(gone, gone[knot], axis) for axis in fixed.T])
    return np.asarray(np.einsum("kij,kj->ki", axes, between))


def _axes(latitude: Array, longitude: Array) -> Array:
    """Return the axes north, east, down in Earth-fixed axes, one in each row, (M, 3, 3)."""
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    rows = [[-s * cl, -s * sl, c], [-sl, cl, np.zeros_like(s)], [-c * cl, -c * sl, -s]]
    return np.moveaxis(np.array(rows), 2, 0)
