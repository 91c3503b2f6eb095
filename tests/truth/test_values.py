"""The true field along a motion in the numbers of geodesy, by hand: four instants on the equator."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.truth.true_gravity_disturbance import gravity_numbers, gravity_values

GAMMA, A = 9.7803253359, 6378137.0  # TR8350.2
HEIGHT = np.array([100.0, 200.0, 500.0, 300.0])
NORTH, EAST, DOWN = 1e-4 * np.array([[1.0, -2.0, 3.0, -5.0], [4.0, 1.0, -6.0, 2.0], [-3.0, 7.0, 1.0, -8.0]])
POTENTIAL = np.array([10.0, -20.0, 40.0, 70.0])
UNDULATION = np.array([-30.0, -31.0, -33.0, -36.0])


def motion(field: bool) -> Any:
    """Return a motion from 10.25 to 13.9 s whose field is known."""

    def state(t: np.ndarray) -> NavState:
        assert t.tolist() == [10.25, 11.25, 12.25, 13.25]
        return NavState(np.zeros(4), np.full(4, 0.3), HEIGHT, np.zeros((4, 3)), np.zeros((4, 4)))

    def along_the_path(r: np.ndarray) -> tuple[np.ndarray, None]:
        expected = (A + HEIGHT)[:, None] * [np.cos(0.3), np.sin(0.3), 0.0]
        np.testing.assert_allclose(r, expected, rtol=0, atol=1e-8)
        return POTENTIAL, None

    def undulation(latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        assert latitude.tolist() == [0.0] * 4
        assert longitude.tolist() == [0.3] * 4
        return UNDULATION

    own = SimpleNamespace(
        name="egm", degree=70, potential_and_gradient=along_the_path, undulation=undulation
    )  # fmt: skip
    return SimpleNamespace(
        start=10.25, end=13.9, gravity="somigliana", ellipsoid=WGS84, state=state, field=own if field else None,
        along=SimpleNamespace(evaluations=17, error=3e-8) if field else None,
        disturbance_ned=lambda t, s: np.column_stack((NORTH, EAST, DOWN)),
    )  # fmt: skip


@pytest.mark.parametrize("field", [True, False])
def test_values_of_geodesy(field: bool) -> None:
    """ξ = −δg_N/γ, η = −δg_E/γ, Δg = δg_D − 2T/r with γ(h) = γ_e (1 − 2h/a); heights less the geoid's."""
    found = gravity_values(motion(field))
    gamma = GAMMA * (1.0 - 2.0 * HEIGHT / A)
    assert found.time.tolist() == [10.25, 11.25, 12.25, 13.25]
    np.testing.assert_allclose(found.xi, -NORTH / gamma, rtol=1e-10)
    np.testing.assert_allclose(found.eta, -EAST / gamma, rtol=1e-10)
    np.testing.assert_array_equal(found.disturbance, DOWN)
    if not field:
        np.testing.assert_array_equal(found.anomaly, DOWN)
        assert found.undulation is None
        assert found.altitude_msl is None
        return
    np.testing.assert_allclose(found.anomaly, DOWN - 2.0 * POTENTIAL / (A + HEIGHT), rtol=1e-12)
    np.testing.assert_array_equal(found.undulation, UNDULATION)
    np.testing.assert_array_equal(found.altitude_msl, [130.0, 231.0, 533.0, 336.0])


def test_numbers_of_the_summary() -> None:
    """Sums of squares of 1e-4 m/s²: 39 north, 57 east, 123 down; 10 mGal are 1e-4 m/s²."""
    found = gravity_numbers(motion(True))
    arcsec = 1e-4 / GAMMA * 180.0 / np.pi * 3600.0
    assert found == {
        "model": "egm", "degree": 70, "evaluations": 17, "interpolation_error_mgal": pytest.approx(3e-3),
        "rms_xi_arcsec": pytest.approx(arcsec * np.sqrt(39.0 / 4.0), rel=2e-4),
        "max_xi_arcsec": pytest.approx(arcsec * 5.0, rel=2e-4),
        "rms_eta_arcsec": pytest.approx(arcsec * np.sqrt(57.0 / 4.0), rel=2e-4),
        "max_eta_arcsec": pytest.approx(arcsec * 6.0, rel=2e-4),
        "rms_disturbance_mgal": pytest.approx(10.0 * np.sqrt(123.0 / 4.0)),
        "max_disturbance_mgal": pytest.approx(80.0),
    }  # fmt: skip
    keys = set(found) - {"degree", "evaluations", "interpolation_error_mgal"}
    plain = gravity_numbers(motion(False))
    assert set(plain) == keys
    assert plain["model"] == "normal"
