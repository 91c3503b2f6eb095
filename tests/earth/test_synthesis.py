"""Potential and gradient of EGM2008: against pyshtools, at the poles, Laplace's equation, published undulations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.gravity_disturbance import (
    DisturbingField,
    harmonic_rows,
    harmonic_table,
    normal_potential,
    normal_zonals,
)
from sinssim.earth.harmonic_coefficients import Coefficients, shipped
from sinssim.errors import InputError
from sinssim.units import ARCSEC, MGAL

REFERENCE = np.load(Path(__file__).with_name("pyshtools_reference.npz"))


def without_centre(model: Coefficients) -> Coefficients:
    c = model.c.copy()
    c[0, 0] = 0.0
    return replace(model, c=c)


def evaluated(model: Coefficients, r: Array) -> Array:
    out = np.empty((len(r), 4))
    harmonic_rows(harmonic_table(model), np.ascontiguousarray(r), out)
    return out


def spherical_axes(latitude: Array, longitude: Array) -> Array:
    """Return the directions of radius, colatitude and longitude, (N, 3, 3)."""
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    nothing = np.zeros_like(s)
    rows = [[c * cl, c * sl, s], [s * cl, s * sl, -c], [-sl, cl, nothing]]
    return np.moveaxis(np.array(rows), 2, 0)


def test_a_thousand_points_of_pyshtools_and_both_poles() -> None:
    latitude, longitude = np.radians(REFERENCE["points"][:, :2]).T
    axes = spherical_axes(latitude, longitude)
    found = evaluated(without_centre(shipped()), axes[:, 0] * REFERENCE["points"][:, 2:])
    assert (np.abs(REFERENCE["points"][:2, 0]) == 90.0).all()
    scale = np.abs(REFERENCE["potential"]).max()
    np.testing.assert_allclose(found[:, 0], REFERENCE["potential"], rtol=0, atol=1e-12 * scale)
    gradient = np.einsum("nij,nj->ni", axes, found[:, 1:])
    scale = np.linalg.norm(REFERENCE["gradient"], axis=1).max()
    np.testing.assert_allclose(gradient, REFERENCE["gradient"], rtol=0, atol=1e-12 * scale)


def test_pyshtools_itself_where_it_is_installed() -> None:
    pysh = pytest.importorskip("pyshtools")
    model = without_centre(shipped())
    latitude, longitude, radius = 46.0, 8.0, 6.38e6
    cilm = np.stack([model.c, model.s])
    wanted = pysh.gravmag.MakeGravGridPoint(cilm, model.gm, model.radius, radius, latitude, longitude)
    axes = spherical_axes(np.radians([latitude]), np.radians([longitude]))
    found = axes[0] @ evaluated(model, axes[:, 0] * radius)[0, 1:]
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * np.linalg.norm(wanted))


def test_the_divergence_of_the_gradient_vanishes() -> None:
    """By central differences of the fourth order: the three parts of some 1e-9 1/s² cancel to rounding."""
    field, step = DisturbingField(shipped()), 2000.0
    for r in (np.array([[4.1e6, 6e5, 4.9e6]]), np.array([[0.0, 0.0, 6.36e6]]), np.array([[3e3, -2e3, -6.36e6]])):
        parts = []
        for axis in range(3):
            e = step * np.eye(3)[axis]
            g = [field.potential_and_gradient(r + k * e)[1][0, axis] for k in (-2, -1, 1, 2)]
            parts.append((g[0] - 8.0 * g[1] + 8.0 * g[2] - g[3]) / (12.0 * step))
        assert abs(sum(parts)) < 1e-6 * max(map(abs, parts))
        assert max(map(abs, parts)) > 1e-11


def test_the_gradient_is_that_of_the_potential() -> None:
    field, step = DisturbingField(shipped()), 1000.0
    r = earth.geodetic_to_ecef(np.radians([28.0, 89.99, -90.0]), np.radians([85.0, 10.0, 0.0]), [5e3, 1e4, 0.0])
    gradient = field.potential_and_gradient(r)[1]
    for axis in range(3):
        e = step * np.eye(3)[axis]
        t = [field.potential_and_gradient(r + k * e)[0] for k in (-2, -1, 1, 2)]
        slope = (t[0] - 8.0 * t[1] + 8.0 * t[2] - t[3]) / (12.0 * step)
        np.testing.assert_allclose(slope, gradient[:, axis], rtol=0, atol=1e-9)


def test_the_pole_has_one_vector_whatever_the_longitude() -> None:
    field = DisturbingField(shipped())
    longitude = np.radians([0.0, 57.0, 180.0, -90.0])
    for latitude in (0.5 * np.pi, -0.5 * np.pi):
        ned = field.at(np.full(4, latitude), longitude, 1000.0).gravity_ned
        in_e = rotation.rotate(earth.q_en(np.full(4, latitude), longitude), ned)
        np.testing.assert_allclose(in_e, in_e[[0, 0, 0, 0]], rtol=0, atol=1e-16)


def test_zonals_and_potential_of_wgs84_are_the_published_ones() -> None:
    """NIMA TR8350.2 (2000), tables 3.3 and 3.5: C20 from the geometry, C40 ... C80, U0."""
    published = [-0.484166774985e-3, 0.790303733511e-6, -0.168724961151e-8, 0.346052468394e-11]
    np.testing.assert_allclose(normal_zonals(WGS84)[1:5], published, rtol=2e-10)
    assert normal_potential(WGS84) == pytest.approx(62636851.7146, abs=1e-4)


def test_model_and_rotation_are_normal_gravity_and_disturbance() -> None:
    """The whole field without the ellipsoid: gradient of the model plus centrifugal force, in north, east, down."""
    latitude, longitude, height = (
        np.radians([45.0, -80.0, 3.0]),
        np.radians([7.0, 120.0, -75.0]),
        np.array([0, 8e3, 2e4]),
    )
    r = earth.geodetic_to_ecef(latitude, longitude, height)
    whole = evaluated(shipped(), r)[:, 1:] + WGS84.omega**2 * r * [1.0, 1.0, 0.0]
    ned = rotation.rotate(rotation.conjugate(earth.q_en(latitude, longitude)), whole)
    disturbance = DisturbingField(shipped()).at(latitude, longitude, height)
    normal = earth.gravity_ned(latitude, height)
    np.testing.assert_allclose(ned, normal + disturbance.gravity_ned, rtol=0, atol=1e-12)
    gamma = np.linalg.norm(normal, axis=1)
    np.testing.assert_allclose(disturbance.xi, -(ned - normal)[:, 0] / gamma, rtol=0, atol=1e-12)
    np.testing.assert_allclose(disturbance.eta, -(ned - normal)[:, 1] / gamma, rtol=0, atol=1e-12)


def test_the_plumb_line_is_perpendicular_to_the_geoid() -> None:
    """ξ = −∂N/(R₁ ∂φ), η = −∂N/(R₂ cosφ ∂λ) over the sea at the equator's Indian low, where N slopes by 1e-4."""
    field, d = DisturbingField(shipped()), 1e-4
    latitude, longitude = np.radians(8.0), np.radians(90.0)
    at = field.at(latitude, longitude, 0.0)
    r1, r2 = earth.radii(latitude)
    north = (field.undulation(latitude + d, longitude) - field.undulation(latitude - d, longitude)) / (2.0 * d * r1)
    east = (field.undulation(latitude, longitude + d) - field.undulation(latitude, longitude - d)) / (
        2.0 * d * r2 * np.cos(latitude)
    )
    assert float(at.xi) == pytest.approx(-float(north), abs=0.05 * ARCSEC)
    assert float(at.eta) == pytest.approx(-float(east), abs=0.05 * ARCSEC)
    assert abs(float(at.eta)) > 1.0 * ARCSEC


def test_published_undulations_to_the_truncation_error() -> None:
    """EGM2008 to degree 2190: the NGA's test points for its programs, and values of GeographicLib's grid.

    Beyond degree 120 Kaula's rule leaves 64 m/120 = 0.53 m rms; 3σ of it is allowed, and 0.53 m for all together.
    """
    places = np.radians([[37.0, 241.0], [36.0, 242.983333], [90.0, 0.0], [-90.0, 0.0], [0.0, 0.0], [20.0, 50.0]])
    published = np.array([-26.151, -29.171, 14.899, -30.150, 17.226, -30.7048])
    difference = DisturbingField(shipped()).undulation(*places.T) - published
    assert np.abs(difference).max() < 3.0 * 0.53
    assert np.sqrt(np.mean(difference**2)) < 0.53 * 1.5


def test_size_of_deflections_and_anomalies_on_the_globe() -> None:
    """By quadrature on a grid, against Parseval's sum over the coefficients on the sphere of the same mean radius."""
    field = DisturbingField(shipped())
    latitude, weight = np.polynomial.legendre.leggauss(122)
    longitude = np.arange(0.0, 2.0 * np.pi, 2.0 * np.pi / 242)
    phi, lam = np.meshgrid(np.arcsin(latitude), longitude, indexing="ij")
    r = 6371000.8 * spherical_axes(phi.ravel(), lam.ravel())[:, 0]
    gradient = field.potential_and_gradient(r)[1]
    parts = np.einsum("nij,nj->ni", spherical_axes(phi.ravel(), lam.ravel()), gradient).reshape(*phi.shape, 3)
    share = (weight[:, None] / (2.0 * len(longitude)))[..., None]
    mean = (share * parts**2).sum(axis=(0, 1))
    c = field._coefficients
    n = np.arange(c.degree + 1.0)
    power = (c.c**2 + c.s**2).sum(axis=1) * (c.gm / 6371000.8**2 * (c.radius / 6371000.8) ** n) ** 2
    assert mean[0] == pytest.approx(float(((n + 1.0) ** 2 * power).sum()), rel=1e-10)
    assert mean[1] + mean[2] == pytest.approx(float((n * (n + 1.0) * power).sum()), rel=1e-10)
    assert np.sqrt(0.5 * (mean[1] + mean[2])) / 9.798 / ARCSEC == pytest.approx(4.1, abs=0.2)
    assert np.sqrt(mean[0]) / MGAL == pytest.approx(29.5, abs=0.5)


def test_a_degree_of_two_thousand_neither_overflows_nor_vanishes() -> None:
    """One sectoral coefficient of degree 2000: |∇V| on its sphere, against the closed form of P̄_nn."""
    n = 2000
    c = np.zeros((n + 1, n + 1))
    c[n, n] = 1.0
    model = Coefficients("one", 1.0, 1.0, c, np.zeros_like(c))
    latitude = np.radians([0.0, 3.0, 10.0, 60.0])
    r = np.column_stack([np.cos(latitude), np.zeros(4), np.sin(latitude)])
    k = np.arange(1.0, n + 1.0)
    sectoral = np.sqrt(2.0 * np.prod((2.0 * k + 1.0) / (2.0 * k)))
    np.testing.assert_allclose(evaluated(model, r)[:, 0], sectoral * np.cos(latitude) ** n, rtol=1e-10, atol=1e-40)


def test_the_shipped_model_is_the_published_one() -> None:
    """Pavlis et al. 2012: constants, and the tide-free coefficients of degree 2 and the first of degree 3."""
    model = shipped()
    assert (model.name, model.gm, model.radius, model.degree) == ("egm2008", 3.986004415e14, 6378136.3, 120)
    assert model.c[2, 0] == pytest.approx(-0.484165143790815e-3, rel=1e-12)
    assert (model.c[2, 2], model.s[2, 2]) == pytest.approx((2.43938357328313e-6, -1.40027370385934e-6), rel=1e-12)
    assert model.c[3, 0] == pytest.approx(0.957161207093473e-6, rel=1e-12)
    assert np.triu(model.c, 1).any() == np.triu(model.s, 1).any() == model.s[:, 0].any() == 0.0
    cut = model.to_degree(3)
    assert (cut.degree, cut.c.shape, cut.s[2, 2]) == (3, (4, 4), model.s[2, 2])
    for degree in (1, 121):
        with pytest.raises(InputError) as error:
            model.to_degree(degree)
        assert str(error.value) == f"degree = {degree}: egm2008 has coefficients to degree 120; give 2 to 120."


def test_a_degree_that_the_model_does_not_have() -> None:
    with pytest.raises(InputError, match="egm2008 has coefficients to degree 120"):
        shipped().to_degree(121)
