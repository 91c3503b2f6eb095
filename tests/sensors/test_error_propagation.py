"""Closed forms of the position error against the navigator itself, at rest for an hour."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from sinssim import rotation
from sinssim.data import ImuData, NavState
from sinssim.sensors.error_propagation import Schuler
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.parked_and_great_circle import Parked

HOUR, RATE_HZ = 3600.0, 1.0
KINDS = ("velocity", "tilt", "azimuth")
COLUMN = {"velocity": 0, "tilt": 1, "azimuth": 2}  # the axis on which each acts: north, east, down


def truth(latitude: float, duration: float = HOUR) -> Parked:
    return Parked(latitude, 0.4, 0.0, np.array([1.0, 0.0, 0.0, 0.0]), duration)


def position_error(parked: Parked, imu: ImuData, start: NavState | None = None) -> float:
    """Length of the horizontal error at the end, m."""
    there = parked.state(imu.time)
    solution = navigate(imu, parked.state(0.0) if start is None else start, vertical="truth", height=there.height)
    return float(np.linalg.norm(navigation_error(there, solution, parked.ellipsoid).position_ned[-1, :2]))


def with_rates(ideal: ImuData, kind: str, rates: np.ndarray) -> ImuData:
    """Add an error of the sensor that changes velocity, tilt or azimuth, (N,) m/s² or rad/s."""
    dtheta, dvel = ideal.dtheta.copy(), ideal.dvel.copy()
    (dvel if kind == "velocity" else dtheta)[:, COLUMN[kind]] += rates * np.diff(ideal.time)
    return ImuData(ideal.time, dtheta, dvel)


@pytest.mark.parametrize("latitude_deg", [0.0, 45.0, -65.0])
@pytest.mark.parametrize("kind", KINDS)
def test_impulse(kind: str, latitude_deg: float) -> None:
    latitude = np.radians(latitude_deg)
    parked = truth(latitude)
    start = parked.state(0.0)
    size = {"velocity": 0.1, "tilt": 2e-5, "azimuth": 1e-4}[kind]
    if kind == "velocity":
        off = NavState(start.latitude, start.longitude, start.height, np.array([size, 0.0, 0.0]), start.q_nb)
    else:
        turn = np.eye(3)[COLUMN[kind]] * size
        q = rotation.multiply(rotation.quaternion_from_rotation_vector(turn), start.q_nb)
        off = NavState(start.latitude, start.longitude, start.height, start.velocity_ned, q)
    ideal = parked.increments(RATE_HZ)
    for t in (1500.0, 3600.0):
        n = int(t * RATE_HZ)
        first = ImuData(ideal.time[: n + 1], ideal.dtheta[:n], ideal.dvel[:n])
        found = position_error(parked, first, off)
        expected = size * abs(float(Schuler.at(latitude).impulse(kind, np.asarray(t))))
        # a tilt to the east turns with the Earth into an azimuth error, and Schuler's centre with it: (Ut)²/2
        assert found == pytest.approx(expected, rel=0.035 if kind == "tilt" else 0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_step_and_ramp(kind: str) -> None:
    latitude = np.radians(45.0)
    parked, form = truth(latitude), Schuler.at(latitude)
    ideal = parked.increments(RATE_HZ)
    size = 1e-4 if kind == "velocity" else 1e-8
    constant = position_error(parked, with_rates(ideal, kind, np.full(3600, size)))
    assert constant == pytest.approx(size * float(form.step(kind, np.asarray(HOUR))), rel=0.01)
    middle = 0.5 * (ideal.time[1:] + ideal.time[:-1])
    growing = position_error(parked, with_rates(ideal, kind, size * middle / HOUR))
    assert growing == pytest.approx(size / HOUR * form.ramp(kind, HOUR), rel=0.01)
    assert form.driven(kind, HOUR, lambda u: u) == pytest.approx(form.ramp(kind, HOUR), rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_is_the_sum_of_the_navigators_own_impulses(kind: str) -> None:
    """Standard deviations of white, correlated and wandering noise from impulses put in at forty instants."""
    latitude = np.radians(45.0)
    parked, form = truth(latitude), Schuler.at(latitude)
    ideal = parked.increments(RATE_HZ)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    sample = np.clip(np.rint(0.5 * HOUR * (1.0 + nodes) - 0.5), 0, 3599).astype(int)
    size = 1e-3 if kind == "velocity" else 1e-6
    pushed = (
        np.array([position_error(parked, with_rates(ideal, kind, size * np.eye(1, 3600, k)[0])) for k in sample]) / size
    )
    # the size alone loses the sign; it is that of the closed form
    pushed *= np.sign(form.impulse(kind, HOUR - sample - 0.5))
    w = 0.5 * HOUR * weights
    assert form.white(kind, HOUR) == pytest.approx(np.sqrt(w @ pushed**2), rel=0.015)
    at = sample + 0.5
    for covariance in (lambda u, v: np.exp(-np.abs(u - v) / 900.0), np.minimum):
        both = (w * pushed) @ covariance(at[:, None], at[None, :]) @ (w * pushed)
        assert form.correlated(kind, HOUR, covariance) == pytest.approx(np.sqrt(both), rel=0.015)


@pytest.mark.parametrize("kind", KINDS)
def test_integrals(kind: str) -> None:
    """Steps, ramps and white noise are integrals of the impulse response, by adaptive quadrature."""
    form, t = Schuler.at(0.9), 2711.0

    def impulse(u: float) -> float:
        return float(form.impulse(kind, np.asarray(u)))

    assert form.step(kind, np.asarray(t)) == pytest.approx(quad(impulse, 0.0, t)[0], rel=1e-9)
    ramp = quad(lambda u: float(form.step(kind, np.asarray(u))), 0.0, t)[0]
    assert form.ramp(kind, t) == pytest.approx(ramp, rel=1e-9)
    assert form.white(kind, t) == pytest.approx(np.sqrt(quad(lambda u: impulse(u) ** 2, 0.0, t)[0]), rel=1e-9)
    assert form.correlated(kind, t, lambda u, v: np.ones_like(u)) == pytest.approx(
        abs(form.step(kind, np.asarray(t))), rel=1e-9
    )


def test_known_numbers() -> None:
    """50 µg: at most 2 Δa/g of arc (chapter, eq. 8.13); 0.01 deg/h: 0.6 nmi an hour of drift on which Schuler rides."""
    form = Schuler.at(np.radians(45.0))
    half = np.pi / form.frequency
    assert 2.0 * half / 60.0 == pytest.approx(84.4, abs=0.2)
    assert 50e-6 * 9.80665 * float(form.step("velocity", np.asarray(half))) == pytest.approx(
        2.0 * 50e-6 * 6371e3, rel=2e-3
    )
    drift = 0.01 / 3600.0 * np.pi / 180.0 * float(form.step("tilt", np.asarray(2.0 * half)))
    assert drift / (2.0 * half) * 3600.0 / 1852.0 == pytest.approx(0.6, rel=3e-3)
