"""A compass that is corrected by the World Magnetic Model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.sensors.aiding import magnetometer
from sinssim.sensors.aiding.magnetometer import Magnetometer
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle

DEG = np.pi / 180.0
TINY: dict[str, Any] = {"sigma_deg": 1e-12}


class Lift:
    """From the ground to a height of 100 km in 200 s, heading north."""

    start, end = 0.0, 200.0

    def __init__(self, latitude: float, longitude: float) -> None:
        self._place = latitude * DEG, longitude * DEG

    def state(self, t: np.ndarray) -> NavState:
        n, zero = len(t), np.zeros(len(t))
        level = np.tile((1.0, 0.0, 0.0, 0.0), (n, 1))
        return NavState(self._place[0] + zero, self._place[1] + zero, 500.0 * t, np.zeros((n, 3)), level)


def sense(place: tuple[float, float], seed: int = 1, **keys: Any) -> tuple[AidingReadings, np.ndarray]:
    """Return the readings and their errors, deg."""
    (given,) = Magnetometer(**{**TINY, **keys}).read(Vehicle(Lift(*place), seed))  # type: ignore[arg-type]
    return given, np.degrees(np.angle(np.exp(1j * given.measurements.value[:, 0])))


@pytest.mark.parametrize(
    ("year", "place", "low", "high"),  # D on the ground and at 100 km, NOAA's test values
    [(2025.0, (80.0, 0.0), 1.28, 0.85), (2027.5, (-80.0, 240.0), 68.49, 67.93), (2022.5, (80.0, 0.0), 0.01, -0.41)],
)
def test_declination_of_the_start_is_wrong_by_its_change(
    year: float, place: tuple[float, float], low: float, high: float
) -> None:
    given, error = sense(place, declination="start", date=year, declination_sigma_deg=0.0)
    assert error[-1] == pytest.approx(low - high, abs=0.0101)  # two numbers rounded to 0.01°
    assert abs(error[0]) < 0.01
    np.testing.assert_allclose(given.parameters["magnetometer bias"][:, 0], error * DEG, rtol=0, atol=1e-13)


def test_model_leaves_its_own_error() -> None:
    """A constant of the stated 1σ, the same for both corrections; the chance to fail is 1e-5."""
    drawn = []
    for seed in range(150):
        given, error = sense((50.0, 10.0), seed, declination="wmm", rate_hz=0.02)
        assert np.ptp(error) < 1e-10
        np.testing.assert_allclose(given.parameters["magnetometer bias"], [error[0] * DEG], rtol=0, atol=1e-13)
        drawn.append(error[0])
    low, high = chi2.ppf([0.5e-5, 1.0 - 0.5e-5], len(drawn))
    assert low < np.sum(np.square(drawn)) / 0.4**2 < high
    _, start = sense((50.0, 10.0), 7, declination="start", rate_hz=0.02)
    _, known = sense((50.0, 10.0), 7, declination="start", rate_hz=0.02, declination_sigma_deg=0.0)
    np.testing.assert_allclose(start - known, drawn[7], rtol=0, atol=1e-10)


def test_filter_is_told_the_error_of_the_model() -> None:
    for keys, sigma in (
        ({}, 0.0),
        ({"declination": "wmm"}, 0.4),
        ({"declination": "start", "bias_sigma_deg": 0.3}, 0.5),
        ({"declination": "wmm", "declination_sigma_deg": 1.2, "bias_deg": 0.5}, 1.3),
    ):
        bias = next(iter(Magnetometer(**keys).states()))
        assert bias.block == "magnetometer bias"
        assert bias.sigma == pytest.approx((sigma * DEG,), rel=1e-14)


def test_compass_is_refused_near_a_magnetic_pole() -> None:
    with pytest.raises(
        InputError, match=r"aiding\.magnetometer\.declination = \"wmm\": .* nT at latitude 86\.0°.* Below 2000 nT no"
    ):
        sense((86.0, 140.0), declination="wmm")


def test_where_a_compass_cannot_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 5, 1.5 and 1.7 µT level at three places, the weakest is told; the field points 100 µT down."""
    field = 1e-6 * np.array([[3.0, 4.0, 100.0], [0.9, -1.2, 100.0], [1.7, 0.0, 100.0]])
    monkeypatch.setattr(magnetometer, "field_along", lambda *given: field)
    place = np.radians([[10.0, 20.0], [71.25, -130.5], [72.0, -131.0]])
    states = [NavState(*place[rows].T, np.zeros(len(rows)), None, None) for rows in ([0], [1, 2])]  # type: ignore[arg-type]
    compass = Magnetometer(declination="start", date=2026.0)
    with pytest.raises(InputError) as error:
        compass._change_deg(*states)
    assert str(error.value) == (
        'aiding.magnetometer.declination = "start": the horizontal magnetic field falls to 1500 nT at latitude 71.2°, '
        "longitude -130.5°. Below 2000 nT no compass can be used: remove [aiding.magnetometer], or choose another "
        "route."
    )
    field[1:, :2] = 3e-6 * np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(compass._change_deg(*states), np.array([90.0, 180.0]) - np.degrees(np.arctan2(4.0, 3.0)))


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"declination": "wmm", "date": 2031.5}, r"date: 2031\.5 is outside the validity of the World Magnetic Model"),
        ({"declination": "start", "date": "2026-13-01"}, r"date: '2026-13-01' is not a date"),
        ({"declination": "start", "date": True}, "date: give a decimal year"),
        ({"date": 2026.0}, "date would have no effect: the declination is exact"),
        ({"declination_sigma_deg": 0.3}, "declination_sigma_deg would have no effect"),
    ],
)
def test_refused(keys: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Magnetometer(**keys)


def test_written_out_defaults_are_accepted() -> None:
    for keys in ({}, {"declination": "wmm", "date": 2027}, {"declination": "start", "date": "2026-06-01"}):
        section = Magnetometer(**keys)
        assert Magnetometer(**section.model_dump(exclude_none=True)) == section
