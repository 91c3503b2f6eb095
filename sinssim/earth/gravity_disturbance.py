"""Disturbance of gravity and disturbing potential of a spherical harmonic model, at points and along a path.

The synthesis has Pines' form, without a singularity at the poles. With s, u, t the direction cosines x/r, y/r, z/r, and
Ā_nm(t) = P̄_nm/cos^m φ',

    V = GM/r Re Σ_m z^m Σ_n ρ^(n−m) Ā_nm (C̄_nm − i S̄_nm),   z = ρ (s + i u),   ρ = R/r

    ∇V = GM/r² [ (a₁, a₂, a₃) − (s, u, t) a₄ ],   a₄ = Σ (n + m + 1) v_nm + t a₃

with a₁, a₂, a₃ the derivatives by s, u and t (Pines, Uniform representation of the gravitational potential and its
derivatives, AIAA Journal 11, 1973, 1508-1511). The Ā_nm of one order follow from each other by the recursion with
increasing degree, and the sum over the orders is Horner's in z; all Ā_mm begin with a factor 10⁻²⁸⁰, so that neither
overflow nor underflow matters up to degree 2700 (Holmes and Featherstone, A unified approach to the Clenshaw summation
and the recursive computation of very high degree and order normalised associated Legendre functions, Journal of Geodesy
76, 2002, 279-299). Along a path the disturbance is evaluated at knots and interpolated by a cubic spline, whose error
is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim import rotation
from sinssim.arguments import as_columns, as_vectors
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef, q_en
from sinssim.earth.gravity import gravity_ned
from sinssim.earth.harmonic_coefficients import Coefficients, shipped
from sinssim.jit import inline, kernel

_SMALL, _LARGE = 1e-280, 1e280


class HarmonicTable(NamedTuple):
    """Coefficients and factors of the recursion, order by order and within an order by degree."""

    gm: float  # gravitational parameter, m³/s²
    radius: float  # reference radius, m
    first: NDArray[np.intp]  # position of degree m of order m, (N+2,), N the highest degree
    sectoral: Array  # Ā_mm times 10⁻²⁸⁰, (N+1,)
    # factors of Ā_(n−1)m and Ā_(n−2)m, C̄_nm, S̄_nm, and C̄_n(m−1), S̄_n(m−1) times the factor k_n(m−1) of dĀ_n(m−1)/dt
    # = k_n(m−1) Ā_nm, (K, 6)
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
            factor_1 = np.sqrt((2.0 * n + 1.0) * (2.0 * n - 1.0) / ((n - m) * (n + m)))
            second = np.sqrt((2.0 * n + 1.0) * (n - m - 1.0) * (n + m - 1.0) / ((2.0 * n - 3.0) * (n + m) * (n - m)))
        rows[1:, 0], rows[2:, 1] = factor_1[1:], second[2:]
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
    """Write the potential, m²/s², and its gradient, m/s², (N, 4), of points in Earth-fixed axes, (N, 3) m."""
    for i in range(len(r)):
        v, gx, gy, gz = harmonic_k(table, r[i, 0], r[i, 1], r[i, 2])
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = v, gx, gy, gz


GEOID_POTENTIAL = 62636855.69
"""W₀ of the geoid, m²/s²: with it the term of degree zero of undulations over WGS 84 is −0.41 m, as with the values of
the NGA for EGM2008, whose mean-earth ellipsoid has a = 6378136.58 m and 1/f = 298.257686."""

_ZONALS = 10
"""Even zonals of the normal ellipsoid that are taken: J₂₀ is 1e-26."""


def normal_zonals(ellipsoid: Ellipsoid) -> Array:
    """Return the fully normalised zonal coefficients of an ellipsoid's normal field: C̄₀₀, C̄₂₀, C̄₄₀ … C̄₂₀₎₀ over its
    own GM and a, (11,): C̄_2n = −J_2n/√(4n + 1) with J_2n = (−1)^(n+1) 3 e^2n/((2n + 1)(2n + 3)) (1 − n + 5 n J₂/e²)
    (Heiskanen and Moritz 2-92)."""
    n = np.arange(_ZONALS + 1.0)
    e2 = ellipsoid.e2
    sign = (-1.0) ** (n + 1.0)
    j = sign * 3.0 * e2**n / ((2.0 * n + 1.0) * (2.0 * n + 3.0)) * (1.0 - n + 5.0 * n * ellipsoid.j2 / e2)
    return np.asarray(-j / np.sqrt(4.0 * n + 1.0))


def normal_potential(ellipsoid: Ellipsoid) -> float:
    """Return U₀, the potential of the ellipsoid's surface: U₀ = GM/E atan(E/b) + ω²a²/3, m²/s² (Heiskanen and Moritz
    2-61)."""
    distance = ellipsoid.linear_eccentricity
    centrifugal = ellipsoid.omega**2 * ellipsoid.a**2 / 3.0
    return ellipsoid.gm / distance * math.atan(distance / ellipsoid.b) + centrifugal


def less_normal(model: Coefficients, ellipsoid: Ellipsoid) -> Coefficients:
    """Return the coefficients of the disturbing potential T, the model's less those of the normal ellipsoid, over GM
    and R of the model; the ellipsoid's are scaled to these by GM₀/GM (a/R)^2n."""
    c = model.c.copy()
    ratio, squeeze = ellipsoid.gm / model.gm, (ellipsoid.a / model.radius) ** 2
    for k, value in enumerate(normal_zonals(ellipsoid)):
        if 2 * k <= model.degree:
            c[2 * k, 0] -= ratio * squeeze**k * value
    return replace(model, c=c)


@dataclass(frozen=True)
class Disturbance:
    """What the gravity field has beyond the normal one, at points."""

    gravity_ned: Array  # δg = ∇T, north, east, down, (..., 3) m/s²
    # deflection of the vertical, ξ = −δg_N/γ and η = −δg_E/γ, positive if the plumb line's upper end leans to the north
    # and to the east, (...) rad
    xi: Array
    eta: Array
    disturbance: Array  # gravity disturbance, the down component of δg, (...) m/s²
    anomaly: Array  # gravity anomaly Δg = δg_D − 2T/r, (...) m/s² (Heiskanen and Moritz 2-154, spherical approximation)
    potential: Array  # disturbing potential T, (...) m²/s²


class DisturbingField:
    """The disturbing potential of a model over a normal ellipsoid, and what follows from it.

    Args:
        model: coefficients of the model, cut off where wanted.
        ellipsoid: the reference ellipsoid, whose normal gravity the rest of the package has.
    """

    def __init__(self, model: Coefficients, ellipsoid: Ellipsoid = WGS84) -> None:
        self.name, self.degree = model.name, model.degree
        self.ellipsoid = ellipsoid
        self._coefficients = less_normal(model, ellipsoid)

    def beyond(self, degree: int) -> DisturbingField:
        """Return the part of this field above a degree."""
        rest = DisturbingField.__new__(DisturbingField)
        c, s = self._coefficients.c.copy(), self._coefficients.s.copy()
        c[: degree + 1], s[: degree + 1] = 0.0, 0.0
        rest.name, rest.degree, rest.ellipsoid = self.name, self.degree, self.ellipsoid
        rest._coefficients = replace(self._coefficients, c=c, s=s)
        return rest

    @cached_property
    def table(self) -> HarmonicTable:
        """The coefficients for the kernels."""
        return harmonic_table(self._coefficients)

    def potential_and_gradient(self, r: ArrayLike) -> tuple[Array, Array]:
        """Return the disturbing potential T, (...) m²/s², and its gradient, (..., 3) m/s², at positions in Earth-fixed
        axes, (..., 3) m."""
        shape, rows = as_vectors(r)
        out = np.empty((len(rows), 4))
        harmonic_rows(self.table, rows, out)
        return out[:, 0].reshape(shape), out[:, 1:].reshape(*shape, 3)

    def at(self, latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike) -> Disturbance:
        """Return deflections, disturbance and anomaly at geodetic points that broadcast against each other."""
        shape, (lat, lon, h) = as_columns(latitude, longitude, height)
        r = geodetic_to_ecef(lat, lon, h, self.ellipsoid)
        potential, gradient = self.potential_and_gradient(r)
        ned = rotation.rotate(rotation.conjugate(q_en(lat, lon)), gradient)
        gamma = np.linalg.norm(gravity_ned(lat, h, "normal", self.ellipsoid), axis=-1)
        anomaly = ned[:, 2] - 2.0 * potential / np.linalg.norm(r, axis=-1)
        flat = (-ned[:, 0] / gamma, -ned[:, 1] / gamma, ned[:, 2], anomaly, potential)
        return Disturbance(ned.reshape(*shape, 3), *(values.reshape(shape) for values in flat))

    def undulation(self, latitude: ArrayLike, longitude: ArrayLike) -> Array:
        """Return the height of the geoid over the ellipsoid by Bruns' formula, N = (T − (W₀ − U₀))/γ on the ellipsoid,
        (...) m (Heiskanen and Moritz 2-178).

        On land the model's potential is continued to the ellipsoid through the topography, which matters by decimetres
        in mountains; degrees beyond the model's are missing.
        """
        shape, (lat, lon) = as_columns(latitude, longitude)
        potential, _ = self.potential_and_gradient(geodetic_to_ecef(lat, lon, np.zeros_like(lat), self.ellipsoid))
        gamma = np.linalg.norm(gravity_ned(lat, 0.0, "normal", self.ellipsoid), axis=-1)
        excess = GEOID_POTENTIAL - normal_potential(self.ellipsoid)
        return np.asarray(((potential - excess) / gamma).reshape(shape))


_GEOID_STEP = 1000.0
"""Distance between points of a path at which the geoid is evaluated, m. A gradient of gravity of 1e-8 1/s² bends it by
1e-9 1/m, so that straight lines between the points are right to 0.1 mm."""


@cache
def _shipped_field() -> DisturbingField:
    return DisturbingField(shipped())


def geoid_along(latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """Return the height of the geoid above the ellipsoid WGS 84 along a path, (N,) m: EGM2008 to degree 120.

    The degrees beyond are missing: 64 m/120 = 0.5 m rms by Kaula's rule, metres in high mountains.

    Args:
        latitude, longitude: geodetic, one point after another, (N,) rad.
    """
    _, (lat, lon) = as_columns(latitude, longitude)
    place = geodetic_to_ecef(lat, lon, np.zeros_like(lat))
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1))])
    knots = np.unique(np.concatenate([[0], np.flatnonzero(np.diff(way // _GEOID_STEP)) + 1, [len(lat) - 1]]))
    return np.asarray(np.interp(way, way[knots], _shipped_field().undulation(lat[knots], lon[knots])))


GEOID_WORDS = (
    "Mean sea level is the geoid of EGM2008 to degree 120, which is right to half a metre (1σ), in high mountains to "
    "some metres."
)

TOLERANCE = 1e-8
"""Largest error of the spline where it is measured, m/s²: 0.001 mGal."""
_COARSEST, _FINEST = 4.0, 0.03125
"""Largest and smallest interval between knots, s."""
_FEWEST = 8
"""Intervals at least."""


@dataclass(frozen=True, eq=False)
class DisturbanceAlong:
    """Disturbance of gravity as a function of time, a cubic spline over equal intervals."""

    # first knot and interval, s
    start: float
    step: float
    panels: Array  # coefficients by power of the time since the interval's knot, (K, 4, 3), Earth-fixed axes, m/s²
    # largest difference from the field between the knots of the spline before the last halving, m/s²; that of this
    # spline is about a sixteenth of it
    error: float
    evaluations: int  # number of points at which the field was evaluated

    def at(self, t: Array) -> Array:
        """Return the disturbance in Earth-fixed axes at instants (N,) s, (N, 3) m/s²."""
        panel = np.clip(((t - self.start) / self.step).astype(np.intp), 0, len(self.panels) - 1)
        u = (t - self.start - panel * self.step)[:, None]
        c = self.panels[panel]
        return np.asarray(c[:, 0] + u * (c[:, 1] + u * (c[:, 2] + u * c[:, 3])))


def _panels(time: Array, values: Array) -> Array:
    from scipy.interpolate import CubicSpline

    return np.ascontiguousarray(np.moveaxis(CubicSpline(time, values).c[::-1], 0, 1))


def disturbance_along(
    field: DisturbingField, path: Callable[[Array], Array], start: float, end: float, tolerance: float = TOLERANCE
) -> DisturbanceAlong:
    """Return the disturbance of gravity along a path, a function from instants, (N,) s, to positions in Earth-fixed
    axes, (N, 3) m.

    Knots lie at most 4 s and an eighth of the way apart. The interval is halved until the spline through the old knots
    meets the field at all the new ones within the tolerance, m/s²; the new ones become knots, too.
    """
    count = max(_FEWEST, int(np.ceil((end - start) / _COARSEST)))
    time = np.linspace(start, end, count + 1)
    values = field.potential_and_gradient(path(time))[1]
    while True:
        before = DisturbanceAlong(start, (end - start) / count, _panels(time, values), 0.0, 0)
        between = 0.5 * (time[1:] + time[:-1])
        between_values = field.potential_and_gradient(path(between))[1]
        error = float(np.abs(before.at(between) - between_values).max())
        both = np.empty((2 * count + 1, 3))
        both[::2], both[1::2] = values, between_values
        count *= 2
        time, values = np.linspace(start, end, count + 1), both
        if error <= tolerance or (end - start) / count < _FINEST:
            return DisturbanceAlong(start, (end - start) / count, _panels(time, values), error, count + 1)
