"""Datums: against PROJ, with the parameters of the EPSG registry for the two steps from WGS-84 (G1150) to PZ-90.11."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.earth import change_datum
from sinssim.errors import InputError

# PROJ 9.5.1: +proj=helmert with the parameters of EPSG 7961, then that of EPSG 7703 (+convention=coordinate_frame)
WGS84 = np.array([[2850000.0, 2200000.0, 5250000.0], [-6378137.0, 10.0, -20.0], [1000.0, -3000.0, 6356800.0]])
PZ_90_11 = np.array(
    [
        [2849999.829193937, 2200000.0880291276, 5250000.05344443],
        [-6378136.961974761, 9.975818193984134, -20.08746388683745],
        [999.8779552629564, -2999.964838441768, 6356799.971129317],
    ]
)


def test_the_transformation_is_that_of_proj() -> None:
    """PROJ turns by the whole rotation: products of the angles move a place by 1e-8 m."""
    np.testing.assert_allclose(change_datum(WGS84, "wgs84", "pz-90.11"), PZ_90_11, rtol=0.0, atol=3e-8)
    np.testing.assert_allclose(change_datum(PZ_90_11, "pz-90.11", "wgs84"), WGS84, rtol=0.0, atol=3e-8)


def test_one_place_or_many_and_the_same_datum() -> None:
    one = change_datum(WGS84[0], "wgs84", "pz-90.11")
    assert one.shape == (3,)
    grid = change_datum(np.tile(WGS84[0], (2, 4, 1)), "wgs84", "pz-90.11")
    np.testing.assert_array_equal(grid, np.broadcast_to(one, (2, 4, 3)))
    np.testing.assert_array_equal(change_datum(WGS84, "wgs84", "wgs84"), WGS84)


def test_an_unknown_datum_is_refused() -> None:
    with pytest.raises(InputError, match=r"unknown datum 'wgs-84'.*wgs84"):
        change_datum(WGS84, "wgs-84", "pz-90.11")
