"""The engine's building blocks one by one, where a flight of ordinary rates would hide their higher orders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import logm
from scipy.spatial.transform import Rotation

from sinssim.earth import WGS84
from sinssim.earth.gravity import GRAVITY_NUMBERS, parameters
from sinssim.rotation import cross_k
from sinssim.rotation.vectors import turned
from sinssim.strapdown.attitude.euler import _seen_after_k, _turned_k
from sinssim.strapdown.coning_sculling import logarithm_k
from sinssim.strapdown.frames.inertial import geodetic_k, gravitation_rate_k
from sinssim.strapdown.frames.navigation_problem import Models
from sinssim.strapdown.frames.wander_free_transverse import (
    FREE_AZIMUTH,
    TRANSVERSE,
    WANDER,
    Place,
    earth_k,
    pole_k,
    transport_k,
)


@pytest.mark.parametrize(("kernel", "order"), [(turned, 3), (_seen_after_k, 4)])
def test_a_vector_seen_from_axes_that_turn(kernel, order) -> None:
    """exp(−[r×]) x, up to the first term that is left out, |r|ⁿ/n!."""
    for r in np.random.default_rng(1).uniform(-0.02, 0.02, (20, 3)):
        x = np.array([1.0, -2.0, 3.0]) + r
        expected = Rotation.from_rotvec(r).apply(x, inverse=True)
        left_out = np.linalg.norm(r) ** order / np.prod(np.arange(1, order + 1)) * np.linalg.norm(x)
        assert (
            np.linalg.norm(np.array(kernel(*r, *x) if order == 4 else kernel(tuple(x), tuple(r))) - expected)
            < 1.01 * left_out
        )


def test_an_earth_fixed_vector_in_the_frames_axes() -> None:
    rng = np.random.default_rng(4)
    for q, v in zip(
        Rotation.random(20, random_state=4).as_quat(scalar_first=True), rng.normal(size=(20, 3)), strict=True
    ):
        expected = Rotation.from_quat(q, scalar_first=True).apply(v, inverse=True)
        np.testing.assert_allclose(pole_k(TRANSVERSE, v, tuple(q)), expected, rtol=0, atol=2e-15)


def test_within_a_metre_of_the_axis_the_longitude_is_that_of_the_place() -> None:
    """0.4 m from the axis towards 90° east, moving towards the pole: due north; the Earth's own motion is 3e-5 m/s."""
    where = geodetic_k(parameters(WGS84), (1.0, 0.0), (0.0, 0.4, 6.36e6), (0.0, -3.0, 0.0))
    np.testing.assert_allclose(where.longitude, (0.0, 1.0), rtol=0, atol=1e-15)
    np.testing.assert_allclose(where.v, (3.0, 0.0, 0.0), rtol=0, atol=1e-4)


def test_a_free_azimuth_does_not_turn_about_the_vertical_among_the_stars() -> None:
    for v, k in np.random.default_rng(3).uniform(-1.0, 1.0, (20, 2, 3)):
        place = Place(tuple(k), (1.0, 0.0, 0.0), 0.0, 1.6e-7, 1e-9, 0.0, 9.8)
        rate = transport_k(FREE_AZIMUTH, 7.3e-5, place, tuple(v))
        assert rate[2] + 7.3e-5 * k[2] == 0.0
        assert rate[:2] == transport_k(WANDER, 7.3e-5, place, tuple(v))[:2]


def test_the_transverse_frame_turns_with_the_pole_of_its_route() -> None:
    """ṗ = −ω × p of a point fixed to the Earth: its y component stays zero, so that x stays towards it."""
    for v, k, p in np.random.default_rng(3).uniform(-1.0, 1.0, (20, 3, 3)):
        place = Place(tuple(k), tuple(p), 0.0, 1.6e-7, 1e-9, 0.0, 9.8)
        rate = transport_k(TRANSVERSE, 7.3e-5, place, tuple(v))
        assert abs(np.cross(rate, [p[0], 0.0, p[2]])[1]) < 1e-15 * np.linalg.norm(rate)
        assert rate[:2] == transport_k(WANDER, 7.3e-5, place, tuple(v))[:2]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_earth_at_the_poles(side: float) -> None:
    """Both radii are a²/b there, κ is e²b/(a²(1 − e²)), and gravity has no horizontal part."""
    a, b, gravity_at_pole = 6378137.0, 6356752.314245, 9.8321849378
    e2 = 1.0 - (b / a) ** 2
    k2, kappa, along, down = earth_k(
        Models(parameters(WGS84), GRAVITY_NUMBERS["normal"], False), (0.0, 0.0, -side), 0.0
    )
    assert k2 == pytest.approx(b / a**2, rel=1e-12)
    assert kappa == pytest.approx(e2 / (1.0 - e2) * b / a**2, rel=1e-9)
    assert along == 0.0
    assert down == pytest.approx(gravity_at_pole, abs=1e-10)


@pytest.mark.parametrize("change", [0.0, 1e-9, -0.02, 0.0599, -0.0601, 0.3, -2.0, 7.0])
def test_sine_and_cosine_after_a_change(change: float) -> None:
    """By series below 0.06 rad, afresh above."""
    for angle in (-3.0, 0.1, 1.5):
        found = _turned_k(angle, change, np.sin(angle), np.cos(angle))
        np.testing.assert_allclose(found, [np.sin(angle + change), np.cos(angle + change)], rtol=0, atol=4e-16)


def test_gravitation_changes_along_a_motion() -> None:
    """d/dt of −GM r/|r|³, by central differences of the fourth order."""
    gm, step = 3.986004418e14, 1.0

    def central(r: np.ndarray) -> np.ndarray:
        return -gm * r / np.linalg.norm(r) ** 3

    for r, v in np.random.default_rng(5).uniform(1.0, 2.0, (20, 2, 3)) * [[5e6], [3e3]]:
        near, wide = (central(r + n * step * v) - central(r - n * step * v) for n in (1, 2))
        expected = (8.0 * near - wide) / (12.0 * step)
        np.testing.assert_allclose(
            gravitation_rate_k(gm, tuple(r), tuple(v)), expected, rtol=0, atol=1e-9 * np.abs(expected).max()
        )


def twist_matrix(twist):
    """Return the matrix of a rate and a force, (4, 4)."""
    out = np.zeros((4, 4))
    out[:3, :3] = np.array([cross_k(*twist[:3], *axis) for axis in np.eye(3)]).T
    out[:3, 3] = twist[3:]
    return out


def test_the_logarithm_is_of_the_sixth_order() -> None:
    """Y' = Y A(t) with a quadratic rate and force, against an integrator and the matrix logarithm."""
    a, b, c = np.random.default_rng(2).uniform(-1.0, 1.0, (3, 6))
    off = []
    for h in (0.5, 0.25):

        def slope(s, y, h=h):
            return (y.reshape(4, 4) @ twist_matrix(h * a + h**2 * b * s + h**3 * c * s * s)).ravel()

        end = solve_ivp(slope, (-0.5, 0.5), np.eye(4).ravel(), method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        log = logm(end.reshape(4, 4)).real
        expected = np.array([log[2, 1], log[0, 2], log[1, 0], *log[:3, 3]])
        moments = (h * a + h**3 * c / 12.0, h**2 * b, h**3 * c)
        off.append(np.abs(np.array(logarithm_k(*(tuple(m) for m in moments))) - expected))
    assert off[0].max() < 5e-6
    assert np.all(off[0] > 2.0**6.5 * off[1])
