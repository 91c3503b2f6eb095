"""The field of one coefficient in closed form, the spline along a path of known field, sizes of what is left out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import earth
from sinssim.data import Array
from sinssim.earth import gravity_disturbance as module
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.gravity_disturbance import (
    DisturbanceAlong,
    DisturbingField,
    disturbance_along,
    geoid_along,
    less_normal,
    normal_zonals,
)
from sinssim.earth.harmonic_coefficients import Coefficients, degree_variances, omission, shipped

GM, R = 3.986e14, 6.4e6
EPSILON = 2e-6


def one_zonal() -> DisturbingField:
    """Return the field T = GM/r (R/r)³ ε √7 (5 sin³φ' − 3 sin φ')/2 of a single C̄₃₀ over the normal ellipsoid."""
    c = np.zeros((5, 5))
    scale = WGS84.gm / GM * (WGS84.a / R) ** (2.0 * np.arange(3))
    c[[0, 2, 4], 0] = scale * normal_zonals(WGS84)[:3]
    c[3, 0] = EPSILON
    return DisturbingField(Coefficients("zonal", GM, R, c, np.zeros((5, 5))))


def test_deflections_disturbance_and_anomaly_of_one_zonal() -> None:
    """At 90° east: T and its derivatives along the radius and to the north of the sphere, turned to the ellipsoid's."""
    field, latitude, height = one_zonal(), np.radians(35.0), 9000.0
    r = earth.geodetic_to_ecef(latitude, 0.5 * np.pi, height)
    radius, phi = float(np.linalg.norm(r)), float(np.arctan2(r[2], r[1]))
    s, c = np.sin(phi), np.cos(phi)
    size = GM / radius * (R / radius) ** 3 * EPSILON * np.sqrt(7.0)
    potential = size * (5.0 * s**3 - 3.0 * s) / 2.0
    radial = -4.0 / radius * potential
    north = size / radius * (15.0 * s * s - 3.0) / 2.0 * c
    tilt = latitude - phi  # of the ellipsoid's normal to the north... its down leans towards the equator
    g_north = north * np.cos(tilt) - radial * np.sin(tilt)
    g_down = -(radial * np.cos(tilt) + north * np.sin(tilt))
    found = field.at(latitude, 0.5 * np.pi, height)
    gamma = float(np.linalg.norm(earth.gravity_ned(latitude, height)))
    np.testing.assert_allclose(found.gravity_ned, [g_north, 0.0, g_down], rtol=0, atol=1e-14)
    assert float(found.xi) == pytest.approx(-g_north / gamma, rel=1e-8)
    assert float(found.eta) == pytest.approx(0.0, abs=1e-15)
    assert float(found.disturbance) == pytest.approx(g_down, rel=1e-8)
    assert float(found.potential) == pytest.approx(potential, rel=1e-8)
    assert float(found.anomaly) == pytest.approx(g_down - 2.0 * potential / radius, rel=1e-8)
    assert (field.name, field.degree) == ("zonal", 4)


def test_undulation_of_one_zonal() -> None:
    """(T − (W₀ − U₀))/γ on the ellipsoid, with W₀ − U₀ = 62636855.69 − 62636851.7146 m²/s²."""
    field, latitude = one_zonal(), np.radians(-20.0)
    r = earth.geodetic_to_ecef(latitude, 0.3, 0.0)
    potential = float(field.potential_and_gradient(r)[0])
    expected = (potential - (62636855.69 - 62636851.7146)) / float(earth.surface_gravity(latitude))
    assert float(field.undulation(latitude, 0.3)) == pytest.approx(expected, rel=1e-4)


def test_the_geoid_along_a_path_is_that_of_its_points() -> None:
    """Along 700 km in the Himalaya in steps of 70 m, to the millimetre; at rest it is one number."""
    latitude, longitude = np.radians(np.linspace(25.0, 31.0, 10_001)), np.radians(np.linspace(85.0, 87.0, 10_001))
    expected = DisturbingField(shipped()).undulation(latitude[::97], longitude[::97])
    np.testing.assert_allclose(geoid_along(latitude, longitude)[::97], expected, atol=1e-3)
    still = geoid_along(np.full(3, latitude[0]), np.full(3, longitude[0]))
    np.testing.assert_allclose(still, np.full(3, expected[0]), rtol=1e-15)


def test_the_degrees_above_one() -> None:
    """Of a field of C̄₃₀ and C̄₄₄, beyond 3 the latter is left, with its name and degree."""
    whole = shipped().to_degree(6)
    rest, low = DisturbingField(whole).beyond(4), DisturbingField(shipped().to_degree(4))
    place = (0.4, 1.2, 5000.0)
    np.testing.assert_allclose(
        rest.at(*place).gravity_ned,
        DisturbingField(whole).at(*place).gravity_ned - low.at(*place).gravity_ned,
        rtol=0, atol=1e-15,
    )  # fmt: skip
    assert (rest.name, rest.degree, rest.ellipsoid) == ("egm2008", 6, WGS84)
    assert rest._coefficients.c[4].any() == 0.0
    assert rest._coefficients.c[5].any()


def test_the_ellipsoids_zonals_are_scaled_to_the_model() -> None:
    c = np.zeros((5, 5))
    left = less_normal(Coefficients("none", 2.0 * WGS84.gm, 3.0 * WGS84.a, c, c), WGS84).c
    zonals = normal_zonals(WGS84)
    assert left[0, 0] == pytest.approx(-0.5)
    assert left[2, 0] == pytest.approx(-0.5 / 9.0 * zonals[1])
    assert left[4, 0] == pytest.approx(-0.5 / 81.0 * zonals[2])
    assert not c.any()


def waves(omega: float) -> tuple[Any, list[int]]:
    """Return a field that is 1e-4 m/s² times sines of the first coordinate, and the numbers of points asked for."""
    asked = []

    def at(r: Array) -> tuple[None, Array]:
        asked.append(len(r))
        return None, 1e-4 * np.sin(omega * r[:, :1] + np.array([0.0, 1.0, 2.0]))

    return SimpleNamespace(potential_and_gradient=at), asked


def path(t: Array) -> Array:
    return np.column_stack([t, 0.0 * t, 0.0 * t])


def test_a_smooth_field_has_knots_of_four_seconds_halved_once() -> None:
    """From 100 to 180 s: 20 intervals of 4 s, and their middles; a spline's error is 5/384 of h⁴ times the fourth
    derivative between its knots, far below 1e-8 m/s² for a period of 600 s."""
    field, asked = waves(2.0 * np.pi / 600.0)
    found = disturbance_along(field, path, 100.0, 180.0)
    assert asked == [21, 20]
    assert (found.start, found.step, found.panels.shape, found.evaluations) == (100.0, 2.0, (40, 4, 3), 41)
    assert 0.0 < found.error < module.TOLERANCE
    t = np.array([100.0, 101.3, 140.0, 179.9, 180.0])
    expected = 1e-4 * np.sin(2.0 * np.pi / 600.0 * t[:, None] + np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(found.at(t), expected, rtol=0, atol=1e-9)


def test_a_rough_field_has_more_knots_until_the_error_is_small() -> None:
    field, asked = waves(2.0 * np.pi / 20.0)
    found = disturbance_along(field, path, 0.0, 80.0)
    # 5/384 of h⁴ω⁴ times 1e-4 m/s² is 1.3e-8 at 1 s and 8e-10 at half a second
    assert asked == [21, 20, 40, 80, 160]
    assert (found.step, found.evaluations) == (0.25, 321)
    before = disturbance_along(*(waves(2.0 * np.pi / 20.0)[0], path, 0.0, 80.0), tolerance=1e-6)
    assert 1e-8 < before.error <= 1e-6
    noise: Any = SimpleNamespace(
        potential_and_gradient=lambda r: (None, np.random.default_rng(len(r)).standard_normal((len(r), 3)))
    )
    assert disturbance_along(noise, path, 0.0, 8.0).step == pytest.approx(8.0 / 512.0)  # below 1/32 s it ends
    assert disturbance_along(noise, path, 0.0, 1.0).step == pytest.approx(1.0 / 64.0)  # eight intervals at first


def test_a_spline_is_a_polynomial_in_each_interval() -> None:
    panels = np.arange(24.0).reshape(2, 4, 3)
    spline = DisturbanceAlong(10.0, 2.0, panels, 0.0, 0)
    u = 0.5
    expected = [panels[k, 0] + u * (panels[k, 1] + u * (panels[k, 2] + u * panels[k, 3])) for k in (0, 1)]
    np.testing.assert_allclose(spline.at(np.array([10.5, 12.5])), expected)


def test_sizes_at_a_height() -> None:
    """A single degree falls with (R/(R + h))^(2n+4); of the sums, those of a few degrees worked out by hand."""
    n, ground = degree_variances(120)
    _, high = degree_variances(120, 10e3)
    assert n[0] == 121.0
    np.testing.assert_allclose(high / ground, (6371e3 / 6381e3) ** (2.0 * n + 4.0), rtol=1e-9)
    assert ground[0] / 1e-10 == pytest.approx(425.28 * 120.0 / (119.0 * 145.0) * 0.999617**123)
    n, c = degree_variances(120, 50e3)
    left = omission(120, 50e3)
    assert left.anomaly == pytest.approx(np.sqrt(c.sum()))
    assert left.deflection == pytest.approx(np.sqrt(0.5 * np.sum(n * (n + 1.0) / (n - 1.0) ** 2 * c)) / 9.81)
    from scipy.special import j0

    psi = left.distance / 6371e3
    assert np.sum(c * j0((n + 0.5) * psi)) / c.sum() == pytest.approx(np.exp(-1.0), rel=1e-6)
    assert np.all(np.diff([np.sum(c * j0((n + 0.5) * x)) for x in np.linspace(0.0, psi, 20)]) < 0.0)  # the first time
