"""Sentences about the models of the Earth, ellipsoids in reverse time, and displacements, with known answers."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sinssim.earth.ellipsoids import (
    ELLIPSOIDS,
    GRAVITY_MODELS,
    WGS84,
    describe_ellipsoids,
    ellipsoid_by_name,
    in_reverse_time,
)
from sinssim.earth.geodetic_coordinates import displaced, ecef_to_eci, ecef_to_geodetic, geodetic_to_ecef
from sinssim.errors import InputError


def test_constants_in_words() -> None:
    """Radii and flattenings as published; gravity at the equator: TR8350.2, Helmert, Cassinis, the chapter."""
    assert describe_ellipsoids() == {
        "wgs84": "a = 6378137 m, 1/f = 298.257224, 9.7803253 m/s² at the equator, 7.292115e-05 rad/s",
        "krasovsky-1940": "a = 6378245 m, 1/f = 298.3, 9.7803000 m/s² at the equator, 7.292115e-05 rad/s",
        "international-1924": "a = 6378388 m, 1/f = 297, 9.7804900 m/s² at the equator, 7.292115e-05 rad/s",
        "pz-90.11": "a = 6378136 m, 1/f = 298.25784, 9.7803284 m/s² at the equator, 7.292115e-05 rad/s",
        # 1/f of e² = 6.73e-3: (1 + √(1 − e²))/e²
        "chapter": "a = 6378388 m, 1/f = 296.675976, 9.7804900 m/s² at the equator, 7.27e-05 rad/s",
    }


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_an_earth_that_turns_the_other_way(name: str) -> None:
    forward, back = ellipsoid_by_name(name), ellipsoid_by_name(in_reverse_time(name))
    assert back.omega == -forward.omega < 0.0
    assert (back.a, back.f, back.gm, back.q) == (forward.a, forward.f, forward.gm, forward.q)
    assert back.gamma_e == forward.gamma_e


def test_small_displacements_are_over_the_radii_of_curvature() -> None:
    """30 m north and 50 m east, at 40°, 100°, 2 km; over the pole they lead down the meridian ahead."""
    lat, lon, h = np.radians([40.0]), np.radians([100.0]), np.array([2000.0])
    found = displaced(lat, lon, h, np.array([30.0]), np.array([50.0]))
    w2 = 1.0 - WGS84.e2 * np.sin(lat[0]) ** 2
    assert found[0] - lat == pytest.approx(30.0 / (WGS84.a * (1.0 - WGS84.e2) / w2**1.5 + 2000.0), rel=2e-5)
    assert found[1] - lon == pytest.approx(50.0 / ((WGS84.a / np.sqrt(w2) + 2000.0) * np.cos(lat[0])), rel=2e-5)
    pole = displaced(np.array([0.5 * np.pi]), lon, np.zeros(1), np.array([20.0]), np.zeros(1))
    # north at the pole is along the meridian opposite to that of the longitude
    assert np.degrees(pole[1]) == pytest.approx([-80.0])
    assert (0.5 * np.pi - pole[0]) * 6399593.6 == pytest.approx([20.0], rel=1e-6)


def test_places_that_cannot_be_used_are_named() -> None:
    with pytest.raises(InputError, match=r"arrays of the shapes \(2,\), \(3,\), \(\) do not fit together\."):
        geodetic_to_ecef([0.1, 0.2], [0.1, 0.2, 0.3], 0.0)
    with pytest.raises(InputError, match=r"vectors of 3 components in the last axis, got an array of shape \(2, 2\)\."):
        ecef_to_eci([[1.0, 2.0], [3.0, 4.0]], 0.0)
    with pytest.raises(InputError, match=r"position \[1000\.\s+2000\.\s+3000\.\] m \(row 2\) lies within 1000 km of"):
        ecef_to_geodetic([[7e6, 0.0, 0.0], [0.0, 6.4e6, 0.0], [1e3, 2e3, 3e3], [0.0, 0.0, 6.4e6]])


def test_names_of_gravity_in_words() -> None:
    """The errors that the table promises are measured in the tests of gravity; here that they stand at their names."""
    stated = {name: re.findall(r"[\d.]+e-\d+", text) for name, text in GRAVITY_MODELS.items()}
    assert stated == {
        "normal": [], "j2": [], "somigliana": [], "order-1e-5": ["2e-7", "1.6e-5"], "order-1e-4": ["3.2e-5", "5.5e-4"],
        "order-1e-2": ["5.3e-3", "6e-3"],
    }  # fmt: skip
