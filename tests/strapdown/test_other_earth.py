"""A navigator with the constants of another Earth than the true one, against closed forms and a motion integrated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim import earth, navigate
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked

A, F = 6378137.0, 1 / 298.257223563
KRASOVSKY = 6378245.0, 1 / 298.3
SCHULER_RATE = np.sqrt(9.806 / 6.378e6)


def k1(latitude: float, a: float, f: float) -> float:
    """1/R₁."""
    e2 = f * (2 - f)
    return (1 - e2 * np.sin(latitude) ** 2) ** 1.5 / (a * (1 - e2))


def horizontal_error(motion, ellipsoid, rate_hz=4.0):
    imu = motion.increments(rate_hz)
    height = motion.state(imu.time).height
    solution = navigate(imu, motion.state(imu.time[0]), ellipsoid=ellipsoid, vertical="truth", height=height)
    return navigation_error(motion.state(solution.time), solution, motion.ellipsoid)


def test_an_earth_rate_rounded_by_the_chapter():
    """7.27e-5 instead of 7.292115e-5 rad/s acts as a gyro along the Earth's axis: R δω cos φ (t − sin ωt/ω) east."""
    t, latitude = 1800.0, np.deg2rad(45.0)
    error = horizontal_error(Parked(latitude, 0.0, 0.0, np.array([1.0, 0.0, 0.0, 0.0]), t), "chapter")
    drift = (7.292115e-5 - 7.27e-5) * np.cos(latitude)
    expected = 6.388e6 * drift * (t - np.sin(SCHULER_RATE * t) / SCHULER_RATE)
    assert expected == pytest.approx(1163, abs=3)
    assert abs(error.position_ned[-1, 1]) == pytest.approx(expected, rel=0.01)
    # north only by what the Earth's rotation turns of it
    assert abs(error.position_ned[-1, 0]) < 0.1 * expected


def test_krasovskys_radii_over_wgs84():
    """North from the equator: φ̇' = V' k', θ̇' = V' k' − V k, V̇' = (V² k − g) sin θ', with each ellipsoid's radius.

    The Earth's rotation, left out here, turns the oscillation's plane by little: 1 − cos(Ω sin φ t) < 1e-3.
    """
    v, end = 305.5556, 1800.0
    motion = GreatCircle(latitude=0.0, longitude=0.3, height=0.0, course=0.0, speed=v, duration=end)
    error = horizontal_error(motion, "krasovsky-1940")

    def rates(_, y):
        true, computed, own_v, tilt = y
        k, own = k1(true, A, F), k1(computed, *KRASOVSKY)
        g = 9.7803253359 * (1 + 0.00193185265241 * np.sin(true) ** 2) / np.sqrt(1 - F * (2 - F) * np.sin(true) ** 2)
        return [v * k, own_v * own, (v * v * k - g) * np.sin(tilt), own_v * own - v * k]

    found = solve_ivp(rates, (0, end), [0.0, 0.0, v, 0.0], t_eval=error.time, rtol=1e-12, atol=1e-14)
    expected = (found.y[1] - found.y[0]) / np.array([k1(x, A, F) for x in found.y[0]])
    assert np.max(np.abs(expected)) > 4.0
    np.testing.assert_allclose(error.position_ned[:, 0], expected, rtol=0, atol=0.01)


def test_pz_90_11_is_wgs84_to_a_twentieth_of_a_metre():
    motion = GreatCircle(
        latitude=np.deg2rad(40.0), longitude=0.3, height=11e3, course=np.pi / 2, speed=305.5556, duration=1800.0
    )
    assert 0.02 < np.max(horizontal_error(motion, "pz-90.11").horizontal) < 0.05


@pytest.mark.parametrize(
    ("name", "a", "flattening", "metres"),
    [("krasovsky-1940", *KRASOVSKY, 2.66), ("international-1924", 6378388.0, 1 / 297, 89.9)],
)
def test_the_same_numbers_are_another_point_in_space(name, a, flattening, metres):
    """Molodensky's formula without shifts: (a Δf + f Δa) sin 2φ along the meridian, which no time lets grow."""
    latitude = np.deg2rad(40.0)
    there, here = (
        earth.geodetic_to_ecef(latitude, 0.0, 0.0, ellipsoid) for ellipsoid in (ELLIPSOIDS[name], ELLIPSOIDS["wgs84"])
    )
    north = (there - here) @ np.array([-np.sin(latitude), 0.0, np.cos(latitude)])
    expected = -(A * (flattening - F) + F * (a - A)) * np.sin(2 * latitude)
    assert north == pytest.approx(expected, rel=0.01)
    assert abs(north) == pytest.approx(metres, rel=0.01)
