"""The main magnetic field against the published test values of the World Magnetic Model."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.sensors.aiding import magnetometer as declination
from sinssim.sensors.aiding.magnetometer import decimal_year, field_along, magnetic_field

# NOAA NCEI, WMM2025_TEST_VALUES.txt and WMM2020testvalues.pdf: year, height km, latitude, longitude, D in degrees.
DECLINATION = [
    (2025.0, 0, 80, 0, 1.28), (2025.0, 0, 0, 120, -0.16), (2025.0, 0, -80, 240, 68.78),
    (2025.0, 100, 80, 0, 0.85), (2025.0, 100, 0, 120, -0.15), (2025.0, 100, -80, 240, 68.21),
    (2027.5, 0, 80, 0, 2.59), (2027.5, 0, 0, 120, -0.24), (2027.5, 0, -80, 240, 68.49),
    (2027.5, 100, 80, 0, 2.16), (2027.5, 100, 0, 120, -0.23), (2027.5, 100, -80, 240, 67.93),
    (2020.0, 0, 80, 0, -1.28), (2020.0, 0, -80, 240, 69.36), (2022.5, 0, 80, 0, 0.01),
    (2022.5, 100, 80, 0, -0.41), (2022.5, 0, 0, 120, -0.06), (2022.5, 100, -80, 240, 68.55),
]  # fmt: skip

# WMM2020testvalues.pdf: year, height km, latitude, longitude, X, Y, Z in nT.
FIELD = [
    (2020.0, 0, 80, 0, 6570.4, -146.3, 54606.0), (2020.0, 0, 0, 120, 39624.3, 109.9, -10932.5),
    (2020.0, 0, -80, 240, 5940.6, 15772.1, -52480.8), (2020.0, 100, 80, 0, 6261.8, -185.5, 52429.1),
    (2022.5, 0, 0, 120, 39684.7, -42.2, -10809.5), (2022.5, 100, -80, 240, 5815.0, 14803.0, -49755.3),
]  # fmt: skip


@pytest.mark.parametrize(("year", "km", "latitude", "longitude", "declination"), DECLINATION)
def test_declination_is_the_published_one(
    year: float, km: float, latitude: float, longitude: float, declination: float
) -> None:
    north, east, _ = magnetic_field(np.radians(latitude), np.radians(longitude), 1e3 * km, year)
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(declination, abs=0.0051)  # rounded to 0.01°


@pytest.mark.parametrize(("year", "km", "latitude", "longitude", "x", "y", "z"), FIELD)
def test_field_is_the_published_one(
    year: float, km: float, latitude: float, longitude: float, x: float, y: float, z: float
) -> None:
    found = magnetic_field(np.radians(latitude), np.radians(longitude), 1e3 * km, year)
    np.testing.assert_allclose(1e9 * found, (x, y, z), rtol=0, atol=0.051)  # rounded to 0.1 nT


def test_field_along_a_path_is_that_of_its_points() -> None:
    """Straight over the pole, and in circles of 100 m."""
    s = np.linspace(-0.005, 0.005, 601)  # 64 km over the pole
    over = (np.pi / 2 - np.abs(s), np.where(s < 0.0, 0.3, 0.3 - np.pi), np.full_like(s, 9e3))
    turn = np.linspace(0.0, 12.0 * np.pi, 400)
    circles = (0.9 + 100.0 / 6.4e6 * np.sin(turn), 0.2 + 160.0 / 6.4e6 * np.cos(turn), np.linspace(0.0, 1e3, 400))
    for path in (over, circles):
        north, east, _ = field_along(*path, 2026.0).T
        n, e, _ = magnetic_field(*path, 2026.0).T
        off = np.degrees(np.angle(np.exp(1j * (np.arctan2(east, north) - np.arctan2(e, n)))))
        assert np.abs(off).max() < 0.003
    standing = field_along(np.full(3, 0.9), np.full(3, 0.2), np.zeros(3), 2026.0)
    once = magnetic_field(0.9, 0.2, 0.0, 2026.0)
    np.testing.assert_allclose(standing, np.tile(once, (3, 1)), rtol=1e-14, atol=0)  # rotated there and back


def test_dates() -> None:
    assert decimal_year("2027-07-02") == 2027.0 + 182.0 / 365.0
    assert decimal_year("2028-12-31") == 2028.0 + 365.0 / 366.0
    assert decimal_year("2025-01-01") == decimal_year(2025.0) == 2025.0
    with pytest.raises(InputError, match=r"'2030-01-02' is outside the validity of the World Magnetic Model"):
        decimal_year("2030-01-02")
    with pytest.raises(InputError, match=r"2014\.9 is outside the validity .* from 2015\.0 to 2030\.0"):
        decimal_year(2014.9)
    with pytest.raises(InputError, match="0000 is outside the validity"):
        decimal_year(10**400)
    with pytest.raises(InputError, match="'1 May' is not a date"):
        decimal_year("1 May")


def test_models_meet_at_their_limits() -> None:
    """At 2025.0 the successor differs from the former model by less than its stated accuracy; 2030.0 is the last."""
    place = (0.9, 0.2, 0.0)
    before, after = magnetic_field(*place, 2024.999), magnetic_field(*place, 2025.0)
    assert 0.0 < np.abs(1e9 * (after - before)).max() < 140.0
    late = magnetic_field(*place, 2029.999), magnetic_field(*place, 2030.0)
    assert 0.0 < np.abs(1e9 * (late[1] - late[0])).max() < 0.2


def test_the_model_is_evaluated_every_two_hundred_metres(monkeypatch: pytest.MonkeyPatch) -> None:
    """1 km to the east on the equator with a point each 31 m: the first, the first beyond each 200 m, the last.

    Between them the field is straight in Earth-fixed axes, which hardly turn.
    """
    asked: list[np.ndarray] = []

    def known(latitude: np.ndarray, longitude: np.ndarray, height: np.ndarray, year: float) -> np.ndarray:
        assert year == 2026.5
        np.testing.assert_array_equal(height, 100.0)
        asked.append(longitude * (6.371e6 + 100.0))
        return np.column_stack([np.cumsum(np.ones(len(latitude))) ** 2, 0.0 * latitude, 0.0 * latitude])

    monkeypatch.setattr(declination, "magnetic_field", known)
    way = 31.0 * np.arange(34.0)
    found = field_along(0.0 * way, way / (6.371e6 + 100.0), np.full(34, 100.0), 2026.5)
    np.testing.assert_allclose(asked[0], [0.0, 217.0, 403.0, 620.0, 806.0, 1023.0], atol=1e-6)
    expected = np.interp(way, [0.0, 217.0, 403.0, 620.0, 806.0, 1023.0], [1.0, 4.0, 9.0, 16.0, 25.0, 36.0])
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-6)
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-2)
    assert declination.BLACKOUT == 2e-6  # the WMM's blackout zone: 2000 nT


def test_models_by_year_and_longitudes_round_the_earth() -> None:
    """241° east is 119° west; each model serves from its year on, and the last one until 2030."""
    east, west = (magnetic_field(0.6, np.radians(x), 0.0, 2026.0) for x in (241.0, -119.0))
    np.testing.assert_allclose(east, west, rtol=1e-9)
    grid = magnetic_field(np.array([[0.1], [0.2]]), np.array([0.3, 0.4, 0.5]), 100.0, 2026.0)
    assert grid.shape == (2, 3, 3)
    np.testing.assert_array_equal(grid[1, 2], magnetic_field(0.2, 0.5, 100.0, 2026.0))
