"""Gravity and gravitation on a rotating ellipsoid: normal gravity and the other models, as kernels and over arrays.

Kernels take the ellipsoid as the tuple from `parameters(ellipsoid)`, and a gravity model as its number in
`GRAVITY_NUMBERS`.
"""

from __future__ import annotations

from functools import cache
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import as_columns, as_vectors
from sinssim.data import Array
from sinssim.earth.ellipsoids import GRAVITY_MODELS, WGS84, Ellipsoid
from sinssim.errors import check_name
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import Vector

GRAVITY_NUMBERS: dict[str, int] = {name: number for number, name in enumerate(GRAVITY_MODELS)}


_LOWEST, _HIGHEST = -1e3, 30e3
"""Range of heights [m] in which normal gravity is computed by `near_gravity_k`."""
_DOWN_DEGREES, _NORTH_DEGREES = (5, 3, 3, 3, 2, 1), (2, 2, 2, 1, 0)
"""Degrees in sin²φ of its coefficients of the powers of height; the truncation error is below 5e-16 of gravity."""


class EarthParameters(NamedTuple):
    """The constants of an ellipsoid that kernels need, all in SI units."""

    a: float
    e2: float
    f: float
    gm: float
    omega: float
    e_lin2: float  # squared linear eccentricity E²
    q_scale: float  # ω²a²/q₀
    j2: float
    gamma_e: float
    k: float
    m: float
    beta: float  # the chapter's β = 5q/2 − e²/2
    gravity_fit: Array  # coefficients of `near_gravity_k`


@cache
def parameters(ellipsoid: Ellipsoid) -> EarthParameters:
    """Return the constants of an ellipsoid in the order that kernels expect.

    Args:
        ellipsoid: the ellipsoid.

    Returns:
        The constants, SI units.
    """
    e = ellipsoid
    p = EarthParameters(
        a=e.a,
        e2=e.e2,
        f=e.f,
        gm=e.gm,
        omega=e.omega,
        e_lin2=e.linear_eccentricity**2,
        q_scale=e.omega**2 * e.a**2 / e.q0,
        j2=e.j2,
        gamma_e=e.gamma_e,
        k=e.k,
        m=e.m,
        beta=e.beta,
        gravity_fit=np.zeros(0),
    )
    return p._replace(gravity_fit=_gravity_fit(p))


def _gravity_fit(p: EarthParameters) -> Array:
    """Return the coefficients of `near_gravity_k`.

    Least squares on the closed form at Chebyshev points, twice: the second round corrects the rounding errors of the
    first. The fit is nearer to the field than single values of the closed form, because their rounding errors average
    out.
    """
    points = 0.5 + 0.5 * np.cos(np.pi * (np.arange(20) + 0.5) / 20)
    x, y = (grid.ravel() for grid in np.meshgrid(points, (_LOWEST + (_HIGHEST - _LOWEST) * points) / _HIGHEST))
    s, c = np.sqrt(x), np.sqrt(1.0 - x)
    exact = np.empty((len(x), 2))
    _closed_rows(p, s, c, _HIGHEST * y, exact)
    parts = []
    for column, degrees, factor in ((1, _DOWN_DEGREES, np.ones_like(s)), (0, _NORTH_DEGREES, s * c * y)):
        terms = np.stack([factor * x**k * y**n for n, degree in enumerate(degrees) for k in range(degree + 1)], axis=1)
        coefficients, left = np.zeros(terms.shape[1]), exact[:, column]
        for _ in range(2):
            coefficients = coefficients + np.linalg.lstsq(terms, left, rcond=None)[0]
            left = exact[:, column] - terms @ coefficients
        parts.append(coefficients)
    return np.concatenate(parts)


@inline
def normal_gravitation_k(p: EarthParameters, rho2: float, z: float) -> tuple[float, float]:
    """Gravitation of the normal field at distance √ρ² from the axis and height z above the equator's plane.

    Closed form in ellipsoidal-harmonic coordinates u, β (Heiskanen and Moritz, Physical Geodesy, 1967, eqs. 2-62,
    2-66, 2-67), converted to cylindrical ones. Returns (g_ρ/ρ, g_z), without the centrifugal part. The functions q
    and dq/du are summed as series in E²/u² (first neglected term below 1e-17 of gravity at the Earth's surface).
    """
    z2 = z * z
    w = rho2 + z2 - p.e_lin2
    d = sqrt(w * w + 4.0 * p.e_lin2 * z2)
    u2 = 0.5 * (w + d)
    u = sqrt(u2)
    c2 = u2 + p.e_lin2
    inverse = 1.0 / (u2 * c2 * d)  # one division for all three
    inv_u2, inv_c2, inv_d = inverse * c2 * d, inverse * u2 * d, inverse * u2 * c2
    inv_u = u * inv_u2
    y = p.e_lin2 * inv_u2  # x² = (E/u)²
    s2 = z2 * inv_u2  # sin²β
    # q/x³ = 2 Σ (−1)^(n+1) n x^(2n−2)/((2n+1)(2n+3))   and   (dq/dx)/x² = 2 Σ (−1)^(n+1) n x^(2n−2)/(2n+3)
    q = 2 / 15 - y * (4 / 35 - y * (6 / 63 - y * (8 / 99 - y * (10 / 143 - y * (12 / 195 - y * (14 / 255))))))
    dq = 2 / 5 - y * (4 / 7 - y * (6 / 9 - y * (8 / 11 - y * (10 / 13 - y * (12 / 15 - y * (14 / 17))))))
    scale = p.q_scale * sqrt(p.e_lin2) * inv_u * y  # ω²a²/q₀ x³
    q_over = scale * q  # ω²a² q/q₀
    # ∂V/∂u, with dq/du = −(x/u) dq/dx
    v_u = -p.gm * inv_c2 - 0.5 * scale * dq * inv_u * (s2 - 1.0 / 3.0)
    g_rho = (u * v_u - q_over * s2) * inv_d
    g_z = (c2 * v_u * inv_u + q_over * rho2 * inv_c2) * z * inv_d
    return g_rho, g_z


@inline
def j2_gravitation_k(p: EarthParameters, rho2: float, z: float) -> tuple[float, float]:
    """Gravitation of a point mass with its second zonal harmonic: (g_ρ/ρ, g_z)."""
    r2 = rho2 + z * z
    inv_r2 = 1.0 / r2
    mu = p.gm * inv_r2 * sqrt(inv_r2)
    c = 1.5 * p.j2 * p.a * p.a * inv_r2
    s = 5.0 * z * z * inv_r2
    return -mu * (1.0 + c * (1.0 - s)), -mu * (1.0 + c * (3.0 - s)) * z


@inline
def closed_gravity_k(
    p: EarthParameters, model: int, sin_lat: float, cos_lat: float, r2: float, height: float
) -> tuple[float, float]:
    """Gravity of the models with gravitation and centrifugal force, normal and J2; north and down."""
    rho = (r2 + height) * cos_lat
    z = (r2 * (1.0 - p.e2) + height) * sin_lat
    if model == 0:
        g_rho, g_z = normal_gravitation_k(p, rho * rho, z)
    else:
        g_rho, g_z = j2_gravitation_k(p, rho * rho, z)
    g_rho = (g_rho + p.omega * p.omega) * rho
    return cos_lat * g_z - sin_lat * g_rho, -cos_lat * g_rho - sin_lat * g_z


@inline
def near_gravity_k(p: EarthParameters, sin_lat: float, cos_lat: float, height: float) -> tuple[float, float]:
    """Normal gravity near the ground, north and down: polynomials in sin²φ and height that equal the closed form to
    rounding."""
    c = p.gravity_fit
    x, y = sin_lat * sin_lat, height / _HIGHEST
    d0 = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))
    d1 = c[6] + x * (c[7] + x * (c[8] + x * c[9]))
    d2 = c[10] + x * (c[11] + x * (c[12] + x * c[13]))
    d3 = c[14] + x * (c[15] + x * (c[16] + x * c[17]))
    d4 = c[18] + x * (c[19] + x * c[20])
    d5 = c[21] + x * c[22]
    n0 = c[23] + x * (c[24] + x * c[25])
    n1 = c[26] + x * (c[27] + x * c[28])
    n2 = c[29] + x * (c[30] + x * c[31])
    n3 = c[32] + x * c[33]
    n4 = c[34]
    north = sin_lat * cos_lat * y * (n0 + y * (n1 + y * (n2 + y * (n3 + y * n4))))
    return north, d0 + y * (d1 + y * (d2 + y * (d3 + y * (d4 + y * d5))))


@inline
def gravity_ned_k(
    p: EarthParameters, model: int, sin_lat: float, cos_lat: float, r2: float, height: float
) -> tuple[float, float]:
    """Gravity, north and down components; r2 is the prime-vertical radius of curvature at the latitude."""
    if model == 0 and height > _LOWEST and height < _HIGHEST:
        return near_gravity_k(p, sin_lat, cos_lat, height)
    if model <= 1:
        return closed_gravity_k(p, model, sin_lat, cos_lat, r2, height)
    s2 = sin_lat * sin_lat
    x = height / p.a
    if model == 2:  # Somigliana at the surface, free-air gradient 2g/a
        return 0.0, p.gamma_e * (1.0 + p.k * s2) / sqrt(1.0 - p.e2 * s2) * (1.0 - 2.0 * x)
    if model == 3:
        f, m = p.f, p.m
        f2 = -f + 2.5 * m + 0.5 * f * f - 26.0 / 7.0 * f * m + 3.75 * m * m
        f4 = -0.5 * f * f + 2.5 * f * m
        down = p.gamma_e * (1.0 + f2 * s2 + f4 * s2 * s2)
        down *= 1.0 - 2.0 * (1.0 + f + m - 2.0 * f * s2) * x + 3.0 * x * x
        return -p.gamma_e * p.beta * x * 2.0 * sin_lat * cos_lat, down
    if model == 4:
        return 0.0, p.gamma_e * (1.0 + p.beta * s2 - 2.0 * x)
    return 0.0, p.gamma_e * (1.0 - 2.0 * x)


@inline
def geodetic_sincos_k(p: EarthParameters, rho: float, z: float, iterations: int = 3) -> tuple[float, float, float]:
    """sin and cos of geodetic latitude, and height, of a point at ρ from the axis and z from the equator's plane.

    Bowring's iteration on the reduced latitude (Survey Review 1976) converges quadratically, ε → e² ε² R/(R+h), from
    ε = ½e² h/(R+h). Three iterations are exact to rounding from 5000 km below the surface to beyond the geostationary
    orbit, two from 2000 km below.
    """
    ratio = sqrt(1.0 - p.e2)
    b = p.a * ratio
    # initial value: reduced latitude of the direction of the point
    sb, cb = z, ratio * rho
    s, c = sb, cb
    for _ in range(iterations):
        n = 1.0 / sqrt(sb * sb + cb * cb)
        sb *= n
        cb *= n
        s = z + p.e2 / (1.0 - p.e2) * b * sb * sb * sb
        c = rho - p.e2 * p.a * cb * cb * cb
        sb, cb = ratio * s, c
    n = 1.0 / sqrt(s * s + c * c)
    s *= n
    c *= n
    return s, c, rho * c + z * s - p.a * sqrt(1.0 - p.e2 * s * s)


@inline
def gravitation_ecef_k(p: EarthParameters, model: int, x: float, y: float, z: float) -> Vector:
    """Gravitation (gravity without the centrifugal part) in Earth-fixed axes, any model."""
    rho2 = x * x + y * y
    if model == 0:
        g_rho, g_z = normal_gravitation_k(p, rho2, z)
        return g_rho * x, g_rho * y, g_z
    if model == 1:
        g_rho, g_z = j2_gravitation_k(p, rho2, z)
        return g_rho * x, g_rho * y, g_z
    rho = sqrt(rho2)
    s, c, height = geodetic_sincos_k(p, rho, z)
    g_n, g_d = gravity_ned_k(p, model, s, c, p.a / sqrt(1.0 - p.e2 * s * s), height)
    cos_lon, sin_lon = (x / rho, y / rho) if rho > 0.0 else (1.0, 0.0)
    outward = -s * g_n - c * g_d
    w2 = p.omega * p.omega
    return outward * cos_lon - w2 * x, outward * sin_lon - w2 * y, c * g_n - s * g_d


@kernel
def _closed_rows(p: EarthParameters, s: Array, c: Array, height: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = closed_gravity_k(p, 0, s[i], c[i], p.a / sqrt(1.0 - p.e2 * s[i] * s[i]), height[i])


def gravity_number(model: str) -> int:
    """Return the number of a gravity model in the kernels.

    Args:
        model: one of `GRAVITY_MODELS`.

    Returns:
        Its number.

    Raises:
        InputError: the name is unknown; the message lists the known names.
    """
    check_name("gravity model", model, GRAVITY_MODELS)
    return GRAVITY_NUMBERS[model]


@kernel
def _gravity_rows(p: EarthParameters, model: int, latitude: Array, height: Array, out: Array) -> None:
    for i in range(latitude.shape[0]):
        s, c = sin(latitude[i]), cos(latitude[i])
        north, down = gravity_ned_k(p, model, s, c, p.a / sqrt(1.0 - p.e2 * s * s), height[i])
        out[i] = (north, 0.0, down)


@kernel
def _gravitation_rows(p: EarthParameters, model: int, r: Array, out: Array) -> None:
    for i in range(out.shape[0]):
        out[i] = gravitation_ecef_k(p, model, r[i, 0], r[i, 1], r[i, 2])


def surface_gravity(latitude: ArrayLike, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return normal gravity on the ellipsoid by Somigliana's formula.

    Args:
        latitude: geodetic, (...) rad.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravity, (...) m/s².
    """
    return gravity_ned(latitude, 0.0, "somigliana", ellipsoid)[..., 2]


def gravity_ned(latitude: ArrayLike, height: ArrayLike, model: str = "normal", ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return gravity (gravitation plus centrifugal) in north-east-down axes.

    Args:
        latitude: geodetic, (...) rad.
        height: above the ellipsoid, (...) m.
        model: one of `GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravity, (..., 3) m/s².

    Raises:
        InputError: the model is unknown.
    """
    shape, (lat, h) = as_columns(latitude, height)
    out = np.empty((len(lat), 3))
    _gravity_rows(parameters(ellipsoid), gravity_number(model), lat, h, out)
    return out.reshape(*shape, 3)


def gravitation_ecef(r: ArrayLike, model: str = "normal", ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return gravitation (gravity without the centrifugal part) in Earth-fixed axes.

    Args:
        r: Earth-fixed positions, (..., 3) m.
        model: one of `GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Returns:
        Gravitation, (..., 3) m/s².

    Raises:
        InputError: the model is unknown.
    """
    shape, rows = as_vectors(r)
    out = np.empty_like(rows)
    _gravitation_rows(parameters(ellipsoid), gravity_number(model), rows, out)
    return out.reshape(*shape, 3)
