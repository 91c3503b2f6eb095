"""The normal gravity field as a zonal-harmonic series in extended precision: it shares no code with sinssim.

The even zonal coefficients of the Somigliana-Pizzetti field follow from J₂ (Heiskanen and Moritz 1967, eq. 2-92):
J₂ₙ = (−1)ⁿ⁺¹ 3e²ⁿ/((2n+1)(2n+3)) (1 − n + 5n J₂/e²). J₂ itself comes from no formula here but from the
definition of the field: the potential of gravity is the same at the equator and at the pole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Long = NDArray[np.longdouble]
Array = NDArray[np.float64]

TERMS = 20  # up to J40: e⁴⁰ is 3e-44, far below extended precision anywhere outside the foci


class NormalField:
    """The field of one ellipsoid: a [m], f, GM [m³/s²], ω [rad/s]."""

    def __init__(self, a: float, inverse_f: float, gm: float, omega: float) -> None:
        self.a = np.longdouble(a)
        self.f = 1 / np.longdouble(str(inverse_f))
        self.gm = np.longdouble(gm)
        self.omega = np.longdouble(str(omega))
        self.b = self.a * (1 - self.f)
        self.e2 = self.f * (2 - self.f)
        # The potential is linear in J2: two trial values give the one that levels equator and pole.
        gaps = []
        for trial in (np.longdouble(0), np.longdouble(1)):
            self._set(trial)
            equator = self.potential(np.array([self.a]), np.array([np.longdouble(0)]))
            pole = self.potential(np.array([np.longdouble(0)]), np.array([self.b]))
            gaps.append((equator - pole)[0])
        self._set(gaps[0] / (gaps[0] - gaps[1]))

    def _set(self, j2: np.longdouble) -> None:
        self.j2 = j2
        self.zonal = [
            (-1) ** (n + 1) * 3 * self.e2**n / np.longdouble((2 * n + 1) * (2 * n + 3)) * (1 - n + 5 * n * j2 / self.e2)
            for n in range(1, TERMS + 1)
        ]

    def _legendre(self, s: Long) -> tuple[list[Long], list[Long]]:
        p, d = [np.ones_like(s), s], [np.zeros_like(s), np.ones_like(s)]
        for n in range(2, 2 * TERMS + 1):
            p.append(((2 * n - 1) * s * p[-1] - (n - 1) * p[-2]) / n)
            d.append(d[-2] + (2 * n - 1) * p[-2])
        return p, d

    def potential(self, rho: Long, z: Long) -> Long:
        """Return the potential of gravity, m²/s², at ρ from the axis and z from the equator's plane."""
        r = np.sqrt(rho * rho + z * z)
        p, _ = self._legendre(z / r)
        total = np.ones_like(r)
        for n, j in enumerate(self.zonal, 1):
            total = total - j * (self.a / r) ** (2 * n) * p[2 * n]
        return self.gm / r * total + self.omega**2 * rho * rho / 2

    def gravity(self, rho: Long, z: Long) -> tuple[Long, Long]:
        """Return gravity's components away from the axis and along it, m/s²: the gradient of the potential."""
        r = np.sqrt(rho * rho + z * z)
        s = z / r
        p, d = self._legendre(s)
        radial, along = np.ones_like(r), np.zeros_like(r)
        for n, j in enumerate(self.zonal, 1):
            k = 2 * n
            factor = j * (self.a / r) ** k
            radial = radial - factor * ((k + 1) * p[k] + s * d[k])
            along = along - factor * d[k]
        g = self.gm / r**2
        return -g * radial * rho / r + self.omega**2 * rho, -g * radial * s + g * along

    def meridian_point(self, latitude: Array, height: Array) -> tuple[Long, Long]:
        """Return ρ and z, m, of a geodetic latitude, rad, and height, m."""
        latitude, height = np.asarray(latitude, np.longdouble), np.asarray(height, np.longdouble)
        normal = self.a / np.sqrt(1 - self.e2 * np.sin(latitude) ** 2)
        rho = (normal + height) * np.cos(latitude)
        return rho, (normal * (1 - self.e2) + height) * np.sin(latitude)

    def north_down(self, latitude: Array, height: Array) -> tuple[Array, Array]:
        """Return gravity's north and down components, m/s², at geodetic latitude, rad, and height, m."""
        g_rho, g_z = self.gravity(*self.meridian_point(latitude, height))
        s, c = np.sin(np.asarray(latitude, np.longdouble)), np.cos(np.asarray(latitude, np.longdouble))
        north, down = c * g_z - s * g_rho, -c * g_rho - s * g_z
        return np.asarray(north, np.float64), np.asarray(down, np.float64)


WGS84 = NormalField(6378137.0, 298.257223563, 3.986004418e14, 7.292115e-5)
