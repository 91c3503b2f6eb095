"""The disturbing potential: what the Earth's gravity has beyond that of the normal ellipsoid."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.coordinates import as_columns, as_vectors, geodetic_to_ecef, q_en
from sinssim.earth.gravity import gravity_ned
from sinssim.earth.harmonics.coefficients import Coefficients
from sinssim.earth.harmonics.synthesis import HarmonicTable, harmonic_rows, harmonic_table
from sinssim.earth.models import WGS84, Ellipsoid

GEOID_POTENTIAL = 62636855.69
"""W₀ of the geoid, m²/s²: with it the term of degree zero of undulations over WGS 84 is −0.41 m, as with the values of
the NGA for EGM2008, whose mean-earth ellipsoid has a = 6378136.58 m and 1/f = 298.257686."""

_ZONALS = 10
"""Even zonals of the normal ellipsoid that are taken: J₂₀ is 1e-26."""


def normal_zonals(ellipsoid: Ellipsoid) -> Array:
    """Return the fully normalised zonal coefficients of an ellipsoid's normal field.

    Returns:
        C̄₀₀, C̄₂₀, C̄₄₀ … C̄₂₀₎₀ over its own GM and a, (11,): C̄_2n = −J_2n/√(4n + 1) with
        J_2n = (−1)^(n+1) 3 e^2n/((2n + 1)(2n + 3)) (1 − n + 5 n J₂/e²) (Heiskanen and Moritz 2-92).
    """
    n = np.arange(_ZONALS + 1.0)
    e2 = ellipsoid.e2
    sign = (-1.0) ** (n + 1.0)
    j = sign * 3.0 * e2**n / ((2.0 * n + 1.0) * (2.0 * n + 3.0)) * (1.0 - n + 5.0 * n * ellipsoid.j2 / e2)
    return np.asarray(-j / np.sqrt(4.0 * n + 1.0))


def normal_potential(ellipsoid: Ellipsoid) -> float:
    """Return U₀, the potential of the ellipsoid's surface.

    Returns:
        U₀ = GM/E atan(E/b) + ω²a²/3, m²/s² (Heiskanen and Moritz 2-61).
    """
    distance = ellipsoid.linear_eccentricity
    centrifugal = ellipsoid.omega**2 * ellipsoid.a**2 / 3.0
    return ellipsoid.gm / distance * math.atan(distance / ellipsoid.b) + centrifugal


def less_normal(model: Coefficients, ellipsoid: Ellipsoid) -> Coefficients:
    """Return the coefficients of the disturbing potential T: the model's less those of the normal ellipsoid.

    Returns:
        Coefficients over the model's GM and R. The ellipsoid's are scaled to these by GM₀/GM (a/R)^2n.
    """
    c = model.c.copy()
    ratio, squeeze = ellipsoid.gm / model.gm, (ellipsoid.a / model.radius) ** 2
    for k, value in enumerate(normal_zonals(ellipsoid)):
        if 2 * k <= model.degree:
            c[2 * k, 0] -= ratio * squeeze**k * value
    return replace(model, c=c)


@dataclass(frozen=True)
class Disturbance:
    """What the gravity field has beyond the normal one, at points.

    Attributes:
        gravity_ned: δg = ∇T, north, east, down, (..., 3) m/s².
        xi, eta: deflection of the vertical, ξ = −δg_N/γ and η = −δg_E/γ, positive if the plumb line's upper end leans
            to the north and to the east, (...) rad.
        disturbance: gravity disturbance, the down component of δg, (...) m/s².
        anomaly: gravity anomaly Δg = δg_D − 2T/r, (...) m/s² (Heiskanen and Moritz 2-154, spherical approximation).
        potential: disturbing potential T, (...) m²/s².
    """

    gravity_ned: Array
    xi: Array
    eta: Array
    disturbance: Array
    anomaly: Array
    potential: Array


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

    @cached_property
    def shortest(self) -> float:
        """Length over which the field changes by its own size: that of the highest degree, R/N, m."""
        return self._coefficients.radius / self.degree

    def potential_and_gradient(self, r: ArrayLike) -> tuple[Array, Array]:
        """Return the disturbing potential and its gradient in Earth-fixed axes.

        Args:
            r: Earth-fixed positions, (..., 3) m.

        Returns:
            T, (...) m²/s², and ∇T, (..., 3) m/s².
        """
        shape, rows = as_vectors(r)
        out = np.empty((len(rows), 4))
        harmonic_rows(self.table, rows, out)
        return out[:, 0].reshape(shape), out[:, 1:].reshape(*shape, 3)

    def at(self, latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike) -> Disturbance:
        """Return deflections, disturbance and anomaly at points.

        Args:
            latitude, longitude: geodetic, (...) rad.
            height: above the ellipsoid, (...) m.

        Returns:
            The disturbance at those points, broadcast against each other.
        """
        shape, (lat, lon, h) = as_columns(latitude, longitude, height)
        r = geodetic_to_ecef(lat, lon, h, self.ellipsoid)
        potential, gradient = self.potential_and_gradient(r)
        ned = rotation.rotate(rotation.conjugate(q_en(lat, lon)), gradient)
        gamma = np.linalg.norm(gravity_ned(lat, h, "normal", self.ellipsoid), axis=-1)
        anomaly = ned[:, 2] - 2.0 * potential / np.linalg.norm(r, axis=-1)
        flat = (-ned[:, 0] / gamma, -ned[:, 1] / gamma, ned[:, 2], anomaly, potential)
        return Disturbance(ned.reshape(*shape, 3), *(values.reshape(shape) for values in flat))

    def undulation(self, latitude: ArrayLike, longitude: ArrayLike) -> Array:
        """Return the height of the geoid over the ellipsoid by Bruns' formula.

        On land the model's potential is continued to the ellipsoid through the topography, which matters by decimetres
        in mountains; degrees beyond the model's are missing.

        Args:
            latitude, longitude: geodetic, (...) rad.

        Returns:
            N = (T − (W₀ − U₀))/γ on the ellipsoid, (...) m (Heiskanen and Moritz 2-178).
        """
        shape, (lat, lon) = as_columns(latitude, longitude)
        potential, _ = self.potential_and_gradient(geodetic_to_ecef(lat, lon, np.zeros_like(lat), self.ellipsoid))
        gamma = np.linalg.norm(gravity_ned(lat, 0.0, "normal", self.ellipsoid), axis=-1)
        excess = GEOID_POTENTIAL - normal_potential(self.ellipsoid)
        return np.asarray(((potential - excess) / gamma).reshape(shape))
