"""An S-turn in closed form: truth, rates and increments that share no code with sinssim.

Constant speed V and height h over WGS-84, heading ψ = ψ₀ + A (1 − cos Ωt) with A = tan(bank) g/(VΩ), so that the
coordinated bank φ = atan(Vψ̇/g) swings smoothly between ±bank; pitch constant. The distance flown north,
∫V cos ψ dt, is a Fourier-Bessel series (Jacobi-Anger); latitude is where the meridian arc, raised by h, has that
length (series in the third flattening, Newton); longitude is a quadrature. Rate and specific force follow from
the exact kinematic equations, increments by Gauss-Legendre quadrature of them over each sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.special import jv

Array = NDArray[np.float64]
Gravity = Callable[[Array, float], tuple[Array, Array]]  # (latitude, height) -> (north, down)

A_AXIS = 6378137.0  # WGS-84
FLATTENING = 1 / 298.257223563
E2 = FLATTENING * (2 - FLATTENING)
OMEGA_IE = 7.292115e-5
NODES, WEIGHTS = leggauss(5)


def somigliana_free_air(latitude: Array, height: float) -> tuple[Array, Array]:
    """Return Somigliana's surface gravity times (1 − 2h/a), nothing north (NIMA TR8350.2 constants)."""
    s2 = np.sin(latitude) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - E2 * s2)
    return np.zeros_like(s2), surface * (1 - 2 * height / A_AXIS)


def meridian_arc(latitude: Array, a: float = A_AXIS, flattening: float = FLATTENING) -> Array:
    """Return the meridian arc from the equator, m (Helmert's series in the third flattening n, to n⁶)."""
    n = flattening / (2 - flattening)
    # R₁ = a (1−n)(1−n²) (1 + n² + 2n cos 2φ)^(−3/2), and that power is |1 + n e^{2iφ}|^(−3): with the binomial
    # coefficients g_j = (3/2)(5/2)…(3/2+j−1)/j! it is Σ_{i,j} g_i g_j (−n)^{i+j} cos 2(i−j)φ
    g = np.cumprod(np.concatenate([[1.0], (1.5 + np.arange(10)) / (1 + np.arange(10))]))
    p = g * (-n) ** np.arange(len(g))
    cosine = np.correlate(p, p, "full")[len(g) - 1 :]  # Σ_i p_i p_{i+k}
    scale = a * (1 - n) * (1 - n * n)
    arc = cosine[0] * latitude
    for k in range(1, 7):
        arc = arc + cosine[k] / k * np.sin(2 * k * latitude)
    return scale * arc


@dataclass(frozen=True)
class STurn:
    """The flight; every field in SI units and radians.

    Attributes:
        duration: s.
        period: of the heading's oscillation, s.
        bank: greatest bank angle.
        speed: m/s.
        heading: at the start.
        pitch: constant.
        latitude, longitude, height: at the start.
        gravity: model under which the specific force is made.
        a, flattening: ellipsoid.
        earth_rate: rad/s.
    """

    duration: float = 3600.0
    period: float = 30.0
    bank: float = np.pi / 4
    speed: float = 200.0
    heading: float = np.pi / 2
    pitch: float = 0.05
    latitude: float = np.deg2rad(50.0)
    longitude: float = np.deg2rad(30.0)
    height: float = 5000.0
    gravity: Gravity = somigliana_free_air
    a: float = A_AXIS
    flattening: float = FLATTENING
    earth_rate: float = OMEGA_IE

    @property
    def e2(self) -> float:
        """First eccentricity squared."""
        return self.flattening * (2 - self.flattening)

    def arc(self, latitude: Array) -> Array:
        """Return the meridian arc from the equator at this height, m."""
        return meridian_arc(latitude, self.a, self.flattening) + self.height * latitude

    @property
    def omega(self) -> float:
        """Angular frequency of the heading's oscillation, rad/s."""
        return 2 * np.pi / self.period

    @property
    def amplitude(self) -> float:
        """Amplitude A of the heading's oscillation, rad."""
        return float(np.tan(self.bank) * 9.8 / (self.speed * self.omega))

    def euler(self, t: Array) -> tuple[Array, Array, Array]:
        """Return roll, pitch and heading (not wrapped)."""
        turn_rate = self.amplitude * self.omega * np.sin(self.omega * t)
        roll = np.arctan(self.speed * turn_rate / 9.8)
        heading = self.heading + self.amplitude * (1 - np.cos(self.omega * t))
        return roll, np.full_like(roll, self.pitch), heading

    def northing(self, t: Array) -> Array:
        """Return ∫V cos ψ dt from 0, m: cos(c − A cos Ωt) by Jacobi and Anger."""
        c, a, w = self.heading + self.amplitude, self.amplitude, self.omega
        even, odd = jv(0, a) * t, np.zeros_like(t)
        for n in range(1, 40):
            sign = (-1) ** (n // 2)
            if n % 2 == 0:
                even = even + 2 * sign * jv(n, a) * np.sin(n * w * t) / (n * w)
            else:
                odd = odd + 2 * sign * jv(n, a) * np.sin(n * w * t) / (n * w)
            if jv(n, a) < 1e-19:
                break
        return self.speed * (np.cos(c) * even + np.sin(c) * odd)

    def latitude_at(self, t: Array) -> Array:
        """Return geodetic latitude: M(B) + hB = M(B₀) + hB₀ + northing."""
        arc = self.arc(np.asarray(self.latitude)) + self.northing(t)
        latitude = arc / self.arc(np.asarray(1.0))
        for _ in range(4):
            slope = self.a * (1 - self.e2) / (1 - self.e2 * np.sin(latitude) ** 2) ** 1.5 + self.height
            latitude = latitude - (self.arc(latitude) - arc) / slope
        return latitude

    def velocity_ned(self, t: Array) -> Array:
        """Return velocity, (..., 3) m/s."""
        _, _, heading = self.euler(t)
        zero = np.zeros_like(heading)
        return self.speed * np.stack([np.cos(heading), np.sin(heading), zero], axis=-1)

    def longitude_rate(self, t: Array, latitude: Array) -> Array:
        """Return the rate of longitude, rad/s."""
        _, _, heading = self.euler(t)
        normal = self.a / np.sqrt(1 - self.e2 * np.sin(latitude) ** 2) + self.height
        return self.speed * np.sin(heading) / (normal * np.cos(latitude))

    def q_nb(self, t: Array) -> Array:
        """Return the attitude quaternion, scalar first, (..., 4): product of turns about z, y and x."""
        roll, pitch, heading = (angle / 2 for angle in self.euler(t))
        qx = np.exp(1j * roll)
        cy, sy = np.cos(pitch), np.sin(pitch)
        cz, sz = np.cos(heading), np.sin(heading)
        # (cz + k sz)(cy + j sy)(cx + i sx)
        zy = (cz * cy, -sz * sy, cz * sy, sz * cy)
        return np.stack(
            [
                zy[0] * qx.real - zy[1] * qx.imag,
                zy[0] * qx.imag + zy[1] * qx.real,
                zy[2] * qx.real + zy[3] * qx.imag,
                zy[3] * qx.real - zy[2] * qx.imag,
            ],
            axis=-1,
        )

    def rates(self, t: Array) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force in body axes, (..., 3) rad/s and (..., 3) m/s²."""
        roll, pitch, heading = self.euler(t)
        w, x = self.omega, self.omega * t
        turn = self.amplitude * w * np.sin(x)  # ψ̇
        slope = self.speed * self.amplitude * w / 9.8  # tan φ = slope·sin x
        roll_rate = slope * w * np.cos(x) / (1 + (slope * np.sin(x)) ** 2)
        latitude = self.latitude_at(t)
        sb, cb = np.sin(latitude), np.cos(latitude)
        root = np.sqrt(1 - self.e2 * sb * sb)
        r1 = self.a * (1 - self.e2) / root**3 + self.height
        r2 = self.a / root + self.height
        vn, ve = self.speed * np.cos(heading), self.speed * np.sin(heading)
        en_n, en_e, en_d = ve / r2, -vn / r1, -ve * sb / (cb * r2)  # transport rate
        ie_n, ie_d = self.earth_rate * cb, -self.earth_rate * sb
        gravity_n, gravity_d = self.gravity(latitude, self.height)
        # f = v̇ + (2ω_ie + ω_en) × v − g, v_d = 0
        cor_n, cor_e, cor_d = 2 * ie_n + en_n, en_e, 2 * ie_d + en_d
        fn = -ve * turn - cor_d * ve - gravity_n
        fe = vn * turn + cor_d * vn
        fd = cor_n * ve - cor_e * vn - gravity_d
        cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
        ch, sh = np.cos(heading), np.sin(heading)

        def to_body(n: Array, e: Array, d: Array) -> tuple[Array, Array, Array]:
            x1, y1 = ch * n + sh * e, ch * e - sh * n
            x2, z2 = cp * x1 - sp * d, sp * x1 + cp * d
            return x2, cr * y1 + sr * z2, cr * z2 - sr * y1

        wx, wy, wz = to_body(ie_n + en_n, en_e, ie_d + en_d)
        rate = np.stack(
            [wx + roll_rate - turn * sp, wy + turn * cp * sr, wz + turn * cp * cr], axis=-1
        )  # ω_ib = C_bn ω_in + ω_nb
        return rate, np.stack(to_body(fn, fe, fd), axis=-1)

    def fly(self, rate_hz: float) -> Flight:
        """Return truth at the edges of the samples and the increments between them.

        Args:
            rate_hz: sampling rate; the duration is a whole number of samples.

        Returns:
            Truth and increments.
        """
        count = round(self.duration * rate_hz)
        time = np.arange(count + 1) / rate_hz
        dtheta, dvel, eastward = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
        half = 0.5 / rate_hz
        for first in range(0, count, 20_000):  # blocks that stay in the cache
            block = slice(first, min(first + 20_000, count))
            t = time[block, None] + half * (1 + NODES)
            rate, force = self.rates(t)
            dtheta[block] = half * np.einsum("j,njk->nk", WEIGHTS, rate)
            dvel[block] = half * np.einsum("j,njk->nk", WEIGHTS, force)
            eastward[block] = half * self.longitude_rate(t, self.latitude_at(t)) @ WEIGHTS
        longitude = self.longitude + np.concatenate([[0.0], np.cumsum(eastward)])
        return Flight(
            time,
            dtheta,
            dvel,
            self.latitude_at(time),
            longitude,
            np.full_like(time, self.height),
            self.velocity_ned(time),
            self.q_nb(time),
        )


@dataclass(frozen=True)
class Flight:
    """Truth at the edges of samples, (N+1, …), and increments over them, (N, 3), in NED and FRD, SI units."""

    time: Array
    dtheta: Array
    dvel: Array
    latitude: Array
    longitude: Array
    height: Array
    velocity_ned: Array
    q_nb: Array

    def horizontal_error(self, latitude: Array, longitude: Array) -> Array:
        """Return the horizontal distance of positions, (N+1,) rad, from this truth, (N+1,) m."""
        s = np.sin(self.latitude)
        root = np.sqrt(1 - E2 * s * s)
        north = (latitude - self.latitude) * (A_AXIS * (1 - E2) / root**3 + self.height)
        turn = np.mod(longitude - self.longitude + np.pi, 2 * np.pi) - np.pi
        east = turn * (A_AXIS / root + self.height) * np.cos(self.latitude)
        return np.hypot(north, east)

    def attitude_error(self, q_nb: Array) -> Array:
        """Return the angle between attitudes, (N+1, 4), and this truth, (N+1,) rad."""
        a, b = self.q_nb, q_nb
        vector = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
        return 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(vector, axis=1)))
