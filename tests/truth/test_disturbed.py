"""Motions in the true gravity field: what sensors feel, the spline along the path, navigation that knows the field."""

from __future__ import annotations

from functools import cache
from math import radians
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim import earth, rotation
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import shipped
from sinssim.scenario import Scenario
from sinssim.strapdown.navigate import navigate, navigate_in_field
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import SpinRock
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from sinssim.truth.true_gravity_disturbance import Disturbed, RemainderModel
from sinssim.units import ARCSEC, MGAL


@cache
def field() -> DisturbingField:
    return DisturbingField(shipped())


def over_mountains(duration: float = 600.0, field_: DisturbingField | None = None) -> Disturbed:
    """Return a flight along the Himalaya."""
    base = GreatCircle(radians(28.0), radians(82.0), 9000.0, radians(110.0), 240.0, duration)
    return Disturbed(base, field() if field_ is None else field_)


def test_a_parked_vehicle_feels_minus_gravity() -> None:
    """f = −g in north, east, down: at rest nothing else acts. Parked at a pole and in the mountains."""
    for latitude, longitude in ((28.0, 87.0), (90.0, 30.0), (-90.0, 0.0)):
        q_nb = rotation.quaternion_from_euler(0.1, -0.3, 2.0)
        place = radians(latitude), radians(longitude), 4000.0
        motion = Disturbed(Parked(*place, q_nb, 20.0), field())
        _, force = motion.rates(7.0)
        expected = -(earth.gravity_ned(place[0], place[2]) + field().at(*place).gravity_ned)
        np.testing.assert_allclose(rotation.rotate(q_nb, force), expected, rtol=0, atol=1e-12)
        dvel = motion.increments(10.0).dvel
        np.testing.assert_allclose(dvel, np.tile(0.1 * force, (200, 1)), rtol=0, atol=1e-13)


def test_increments_are_the_integrals_of_the_rates() -> None:
    """Against Gauss-Legendre quadrature of what the rates have more than those in normal gravity."""
    motion = over_mountains(40.0)
    imu, own = motion.increments(5.0), motion.base.increments(5.0)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    middle, half = 0.5 * (imu.time[1:] + imu.time[:-1]), 0.1
    t = (middle[:, None] + half * nodes).ravel()
    change = (motion.rates(t)[1] - motion.base.rates(t)[1]).reshape(-1, 5, 3)
    wanted = half * np.einsum("j,nji->ni", weights, change)
    np.testing.assert_allclose(imu.dvel - own.dvel, wanted, rtol=0, atol=1e-14)
    assert np.abs(wanted).max() > 1e-5


def test_the_spline_meets_the_field_between_its_knots() -> None:
    """The bar is 0.01 mGal; a path at 240 m/s over the steepest field is far below."""
    motion = over_mountains(3600.0)
    assert motion.along is not None
    t = np.sort(np.random.default_rng(1).uniform(0.0, 3600.0, 500))
    s = motion.state(t)
    wanted = field().at(s.latitude, s.longitude, s.height).gravity_ned
    error = np.abs(motion.disturbance_ned(t) - wanted).max() / MGAL
    assert error < 0.001
    assert motion.along.error / MGAL < 0.01
    assert np.abs(wanted).max() / MGAL > 50.0


def test_a_navigator_with_the_field_of_the_truth_closes() -> None:
    """10 min: the bar is 0.01 m an hour. Without the field the error is metres."""
    motion = over_mountains(600.0)
    imu = motion.increments(20.0)
    truth, options = motion.state(imu.time), {"vertical": "truth", "height": motion.state(imu.time).height}

    def by_normal(data: object) -> object:
        return navigate(data, motion.state(0.0), **options)  # type: ignore[arg-type]

    def horizontal(solution: object) -> float:
        error = navigation_error(truth, solution, WGS84)  # type: ignore[arg-type]
        return float(np.hypot(error.position_ned[:, 0], error.position_ned[:, 1]).max())

    assert horizontal(by_normal(imu)) > 10.0
    assert horizontal(navigate_in_field(imu, field(), WGS84, by_normal)) < 1e-4  # type: ignore[arg-type]


def test_the_random_remainder_is_felt_with_the_signs_of_geodesy() -> None:
    """f_N = +γξ, f_E = +γη and f_D = −γ − Δg for a parked vehicle, and the same values from the same seed."""
    q_nb = np.array([1.0, 0.0, 0.0, 0.0])
    base = Parked(radians(40.0), 0.0, 0.0, q_nb, 10.0)
    model = RemainderModel(2, (5.0 * ARCSEC, 6.0 * ARCSEC, 30.0 * MGAL), 20e3)
    motion = Disturbed(base, None, model, seed=5)
    assert motion.remainder is not None
    xi, eta, anomaly = motion.remainder.at(np.zeros(1))[0]
    change = motion.rates(3.0)[1] - base.rates(3.0)[1]
    gamma = earth.gravity_ned(radians(40.0), 0.0)[2]
    np.testing.assert_allclose(change, [gamma * xi, gamma * eta, -anomaly], rtol=0, atol=1e-15)
    again = Disturbed(base, None, model, seed=5).remainder
    other = Disturbed(base, None, model, seed=6).remainder
    assert again is not None
    assert other is not None
    np.testing.assert_array_equal(again.values, motion.remainder.values)
    assert np.abs(other.values - again.values).max() > 0.0


def test_a_lower_degree_leaves_the_rest() -> None:
    """The error with half the degree lies between that of all and that of none."""
    low = DisturbingField(shipped().to_degree(60))
    t = np.linspace(0.0, 600.0, 50)
    motion = over_mountains(600.0)
    whole = motion.disturbance_ned(t)
    part = over_mountains(600.0, low).disturbance_ned(t)
    assert 0.05 < np.sqrt(np.mean((whole - part) ** 2) / np.mean(whole**2)) < 0.95


@pytest.mark.parametrize("order", [2, 3])
def test_parts_of_the_state_are_stationary(order: int) -> None:
    """F P + P Fᵀ must be the negative of white noise on the highest derivative alone."""
    model = RemainderModel(order, (1.0, 1.0, 1.0), 10e3)
    f, p = model.dynamics()
    scale = np.sqrt(np.diag(p))
    drive = -(f @ p + p @ f.T) / np.outer(scale, scale)
    assert drive[-1, -1] > 0.0
    drive[-1, -1] = 0.0
    np.testing.assert_allclose(drive, 0.0, atol=1e-18)
    assert model.correlation(np.array(10e3)) == pytest.approx(np.exp(-1.0), rel=1e-9)


@pytest.mark.slow
def test_a_filter_that_knows_the_field_has_no_error_by_it() -> None:
    """Three minutes with perfect sensors and satellites: innovations and errors are smaller by the field's part."""
    tables = {
        "name": "aided",
        "great_circle": {
            "latitude_deg": 28.0, "longitude_deg": 82.0, "altitude_m": 9000.0, "course_deg": 110.0, "speed_mps": 240.0,
            "duration_s": 180.0,
        },
        "imu": {"grade": "ideal", "rate_hz": 10.0},
        "gravity": {"model": "egm2008"},
        "aiding": {"gnss": {"position_sigma_m": 1e-3, "velocity_sigma_mps": 1e-4}},
        "filter": {},
    }  # fmt: skip

    def worst(scenario: Scenario) -> float:
        aided = sinssim.run(scenario).aided
        assert aided is not None
        return float(np.abs(aided.error.attitude[len(aided.error.attitude) // 2 :, :2]).max())

    without, known = worst(Scenario(**tables)), worst(Scenario(**tables, navigation={"gravity_degree": 120}))
    assert without > 20.0 * ARCSEC
    assert known < 0.05 * without


def test_a_platform_feels_the_field_as_strapdown_sensors_do() -> None:
    scenario = sinssim.load_scenario(
        "gravity_disturbance",
        ["imu.rate_hz=4", "great_circle.duration_s=900", "imu.sensor_set.type=platform"],
    )
    run = sinssim.run(scenario)
    platform, strapdown = (run.errors[name].position_ned[-1, :2] for name in ("platform", "quaternion"))
    assert np.hypot(*strapdown) > 50.0
    np.testing.assert_allclose(platform, strapdown, rtol=0, atol=0.01 * np.hypot(*strapdown))


def test_the_disturbance_of_a_body_that_spins_between_samples() -> None:
    """2 rad/s about the vertical at 1 Hz, in a remainder that is constant at rest: integrals of its sine and cosine."""
    base = OnEarth(SpinRock([0.0, 0.0, 1.0], 2.0, 0.0, 1.0), radians(40.0), 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 4.0)
    motion = Disturbed(base, None, RemainderModel(2, (5.0 * ARCSEC, 6.0 * ARCSEC, 30.0 * MGAL), 20e3), seed=5)
    north, east, down = motion.disturbance_ned(1.0)
    t = np.arange(5.0)
    sine, cosine = np.diff(np.sin(2.0 * t)) / 2.0, -np.diff(np.cos(2.0 * t)) / 2.0  # of cos 2t and of sin 2t
    expected = np.column_stack([north * sine + east * cosine, east * sine - north * cosine, np.full(4, down)])
    imu = motion.increments(1.0)
    np.testing.assert_allclose(base.increments(1.0).dvel - imu.dvel, expected, rtol=0, atol=2e-10)
    assert np.abs(expected).max() > 1e-5


def test_the_way_along_a_motion() -> None:
    """At 6 m/s north and 8 m/s east times the time it is 5 t² m."""
    speed = np.array([6.0, 8.0, 3.0])
    base: Any = SimpleNamespace(
        start=2.0, end=12.0, events=(), channels={}, gravity="normal", ellipsoid=WGS84,
        state=lambda t: SimpleNamespace(velocity_ned=np.outer(t - 2.0, speed)),
    )  # fmt: skip
    time, way = Disturbed(base, None)._travelled
    np.testing.assert_allclose(way, 5.0 * (time - 2.0) ** 2, rtol=1e-12, atol=1e-9)
