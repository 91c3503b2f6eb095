"""Potential and gradient of a spherical harmonic model at a point, without a singularity at the poles.

Pines' form: with s, u, t the direction cosines x/r, y/r, z/r, and Ā_nm(t) = P̄_nm/cos^m φ',

    V = GM/r Re Σ_m z^m Σ_n ρ^(n−m) Ā_nm (C̄_nm − i S̄_nm),   z = ρ (s + i u),   ρ = R/r

    ∇V = GM/r² [ (a₁, a₂, a₃) − (s, u, t) a₄ ],   a₄ = Σ (n + m + 1) v_nm + t a₃

with a₁, a₂, a₃ the derivatives by s, u and t (Pines, Uniform representation of the gravitational potential and its
derivatives, AIAA Journal 11, 1973, 1508-1511). The Ā_nm of one order follow from each other by the recursion with
increasing degree, and the sum over the orders is Horner's in z; all Ā_mm begin with a factor 10⁻²⁸⁰, so that neither
overflows nor underflows matter up to degree 2700 (Holmes and Featherstone, A unified approach to the Clenshaw summation
and the recursive computation of very high degree and order normalised associated Legendre functions, Journal of Geodesy
76, 2002, 279-299).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.earth.harmonics.coefficients import Coefficients
from sinssim.jit import inline, kernel

_SMALL, _LARGE = 1e-280, 1e280


class HarmonicTable(NamedTuple):
    """Coefficients and factors of the recursion, order by order and within an order by degree.

    Attributes:
        gm: gravitational parameter, m³/s².
        radius: reference radius, m.
        first: position of degree m of order m, (N+2,), N the highest degree.
        sectoral: Ā_mm times 10⁻²⁸⁰, (N+1,).
        terms: factors of Ā_(n−1)m and Ā_(n−2)m, C̄_nm, S̄_nm, and C̄_n(m−1), S̄_n(m−1) times the factor k_n(m−1) of
            dĀ_n(m−1)/dt = k_n(m−1) Ā_nm, (K, 6).
    """

    gm: float
    radius: float
    first: NDArray[np.intp]
    sectoral: Array
    terms: Array


def harmonic_table(model: Coefficients) -> HarmonicTable:
    """Return the table of a model for the kernels."""
    degree = model.degree
    first = np.concatenate([[0], np.cumsum(np.arange(degree + 1, 0, -1))]).astype(np.intp)
    terms = np.zeros((int(first[-1]), 6))
    sectoral = np.ones(degree + 1)
    for m in range(degree + 1):
        if m:
            sectoral[m] = sectoral[m - 1] * sqrt((2.0 * m + 1.0) / (2.0 * m) * (2.0 if m == 1 else 1.0))
        n = np.arange(m, degree + 1, dtype=np.float64)
        rows = terms[first[m] : first[m + 1]]
        with np.errstate(divide="ignore", invalid="ignore"):
            one = np.sqrt((2.0 * n + 1.0) * (2.0 * n - 1.0) / ((n - m) * (n + m)))
            two = np.sqrt((2.0 * n + 1.0) * (n - m - 1.0) * (n + m - 1.0) / ((2.0 * n - 3.0) * (n + m) * (n - m)))
        rows[1:, 0], rows[2:, 1] = one[1:], two[2:]
        rows[:, 2], rows[:, 3] = model.c[m:, m], model.s[m:, m]
        if m:
            k = np.sqrt((n - m + 1.0) * (n + m) * (0.5 if m == 1 else 1.0))
            rows[:, 4], rows[:, 5] = k * model.c[m:, m - 1], k * model.s[m:, m - 1]
    return HarmonicTable(model.gm, model.radius, first, _SMALL * sectoral, terms)


@inline
def harmonic_k(table: HarmonicTable, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Potential, m²/s², and its gradient in Earth-fixed axes, m/s²."""
    inverse = 1.0 / sqrt(x * x + y * y + z * z)
    s, u, t = x * inverse, y * inverse, z * inverse
    rho = table.radius * inverse
    rho2, rho_t = rho * rho, rho * t
    zx, zy = rho * s, rho * u
    degree = len(table.sectoral) - 1
    # complex sums over the orders: V, its derivative by z, the sum with n + m + 1, and the derivative by t
    v_x = v_y = d_x = d_y = w_x = w_y = h_x = h_y = 0.0
    for m in range(degree, -1, -1):
        c_sum = s_sum = c_weighted = s_weighted = c_slope = s_slope = 0.0
        before, now = 0.0, table.sectoral[m]
        weight = 2.0 * m + 1.0
        start = table.first[m]
        for i in range(start, table.first[m + 1]):
            if i > start:
                before, now = now, table.terms[i, 0] * rho_t * now - table.terms[i, 1] * rho2 * before
            c, d = table.terms[i, 2] * now, table.terms[i, 3] * now
            c_sum += c
            s_sum += d
            c_weighted += weight * c
            s_weighted += weight * d
            c_slope += table.terms[i, 4] * now
            s_slope += table.terms[i, 5] * now
            weight += 1.0
        # Horner's scheme: sum ← sum · z + (C − iS)
        v_x, v_y = v_x * zx - v_y * zy + c_sum, v_x * zy + v_y * zx - s_sum
        w_x, w_y = w_x * zx - w_y * zy + c_weighted, w_x * zy + w_y * zx - s_weighted
        if m:
            d_x, d_y = d_x * zx - d_y * zy + m * c_sum, d_x * zy + d_y * zx - m * s_sum
            h_x, h_y = h_x * zx - h_y * zy + c_slope, h_x * zy + h_y * zx - s_slope
    a1, a2, a3 = rho * d_x * _LARGE, -rho * d_y * _LARGE, rho * h_x * _LARGE
    a4 = w_x * _LARGE + t * a3
    scale = table.gm * inverse
    per_metre = scale * inverse
    return scale * v_x * _LARGE, per_metre * (a1 - s * a4), per_metre * (a2 - u * a4), per_metre * (a3 - t * a4)


@kernel
def harmonic_rows(table: HarmonicTable, r: Array, out: Array) -> None:
    """Write potential and gradient of points.

    Args:
        r: Earth-fixed positions, (N, 3) m.
        out: potential, m²/s², and gradient, m/s², (N, 4).
    """
    for i in range(len(r)):
        v, gx, gy, gz = harmonic_k(table, r[i, 0], r[i, 1], r[i, 2])
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = v, gx, gy, gz
