"""The budget at rest and in straight flight against the closed forms of the Schuler loop.

The closed forms neglect the rotation of the Earth, (Ut)²/2: 0.4 % after 20 minutes. Each source is alone.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sinssim import earth
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.sensors import flicker
from sinssim.sensors.error_propagation import Schuler
from sinssim.units import ARCMIN, ARCSEC, DEG_H, DEG_SQRT_H, UG
from tests.analyses.error_budget.worlds import PLACE, scenario

T = 1200.0
EARTH = Schuler.at(math.radians(50.0))
TAU = 400.0


def at_rest(**tables: Any) -> Any:
    """Return the budget of a level vehicle that heads north."""
    return budget(scenario(parked={**PLACE, "altitude_m": 0.0, "duration_s": T}, **tables))


def horizontal(result: Any) -> float:
    """Return the horizontal standard deviation at the end, m."""
    return math.hypot(*result.sigma()[-1, :2])


def _both(kind: Any, of: Any) -> float:
    return math.sqrt(2.0) * float(of(kind))


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("gyro_bias_sigma_deg_h", 0.01, 0.01 * DEG_H * math.hypot(
            math.sqrt(2.0) * float(EARTH.step("tilt", np.asarray(T))), float(EARTH.step("azimuth", np.asarray(T))))),
        ("accel_bias_sigma_ug", 50.0, 50.0 * UG * _both("velocity", lambda k: EARTH.step(k, np.asarray(T)))),
        ("gyro_arw_deg_sqrt_h", 0.003, 0.003 * DEG_SQRT_H * math.hypot(
            math.sqrt(2.0) * EARTH.white("tilt", T), EARTH.white("azimuth", T))),
        ("accel_vrw_ug_sqrt_hz", 10.0, 10.0 * UG * _both("velocity", lambda k: EARTH.white(k, T))),
        ("accel_ramp_sigma_ug_per_h", 100.0, 100.0 * UG / 3600.0 * _both("velocity", lambda k: EARTH.ramp(k, T))),
        ("accel_rrw_ug_sqrt_h", 30.0, 0.5 * UG * _both("velocity", lambda k: EARTH.correlated(k, T, np.minimum))),
        ("accel_flicker_ug", 10.0, 10.0 * UG * _both("velocity", lambda k: EARTH.correlated(
            k, T, lambda u, v: flicker.covariance(np.abs(u - v) * 20.0)))),
        ("accel_misalignment_sigma_arcsec", 5.0, 5.0 * ARCSEC * EARTH.gravity * _both(
            "velocity", lambda k: EARTH.step(k, np.asarray(T)))),
    ],
)  # fmt: skip
def test_one_source_at_rest(key: str, value: float, expected: float) -> None:
    assert horizontal(at_rest(imu={key: value})) == pytest.approx(expected, rel=0.01)


def test_bias_instability_at_rest() -> None:
    imu = {"accel_instability_ug": 20.0, "accel_correlation_time_s": TAU}
    expected = 20.0 * UG * EARTH.correlated("velocity", T, lambda u, v: np.exp(-np.abs(u - v) / TAU))
    assert horizontal(at_rest(imu=imu)) == pytest.approx(math.sqrt(2.0) * expected, rel=0.01)


def test_quantisation_of_the_angle_at_rest() -> None:
    """A random walk of the velocity of density g Q √(T/12)."""
    walk = EARTH.gravity * 2.0 * ARCSEC / math.sqrt(12.0 * 20.0)
    expected = math.sqrt(2.0) * walk * EARTH.white("velocity", T)
    assert horizontal(at_rest(imu={"gyro_quantum_arcsec": 2.0})) == pytest.approx(expected, rel=0.01)


def test_a_given_bias_has_a_sign_and_no_spread() -> None:
    """A bias of the forward accelerometer moves the position north; a right gyro's drift tilts it, too."""
    result = at_rest(imu={"accel_bias_ug": [50.0, 0.0, 0.0]})
    assert not result.total.any()
    assert result.bias[-1, 0] == pytest.approx(50.0 * UG * float(EARTH.step("velocity", np.asarray(T))), rel=0.01)
    assert result.r95[-1] == pytest.approx(math.hypot(*result.bias[-1, :2]))


@pytest.mark.parametrize(
    ("key", "value", "kind", "size"),
    [
        ("velocity_sigma_mps", 0.1, "velocity", 0.1),
        ("tilt_sigma_arcmin", 0.5, "tilt", 0.5 * ARCMIN),
    ],
)
def test_initial_errors_at_rest(key: str, value: float, kind: Any, size: float) -> None:
    result = at_rest(navigation={"initial_error": {key: value}})
    expected = math.sqrt(2.0) * size * float(EARTH.impulse(kind, np.asarray(T)))
    assert horizontal(result) == pytest.approx(expected, rel=0.01)


def test_initial_heading_in_straight_flight() -> None:
    """Eastwards, the azimuth error ζ turns the transport rate, too: ζ R (U cos φ + V/R) (t − sin ωt/ω)."""
    speed, latitude = 200.0, 0.0
    plan = scenario(
        great_circle={"latitude_deg": latitude, "course_deg": 90.0, "speed_mps": speed, "duration_s": T},
        navigation={"initial_error": {"heading_sigma_arcmin": 5.0}},
    )
    result = budget(plan)
    at = Schuler.at(latitude)
    r1, r2 = (float(r) for r in earth.radii(latitude))
    w = math.sqrt(at.gravity / r1)  # the error is to the north, in the meridian
    moved = r1 * (at.north_rate + speed / r2) * (T - math.sin(w * T) / w)
    # seen from the true position, the heading error itself has no other effect at constant velocity
    assert result.sigma()[-1, 0] == pytest.approx(5.0 * ARCMIN * moved, rel=0.01)


def test_the_free_vertical_channel_diverges() -> None:
    """b (cosh √2 ωt − 1)/2ω² for the bias of the down accelerometer."""
    plan = scenario(
        parked={**PLACE, "altitude_m": 0.0, "duration_s": T},
        imu={"accel_bias_sigma_ug": 50.0},
        navigation={"vertical": "free"},
    )
    w = EARTH.frequency
    expected = 50.0 * UG * (math.cosh(math.sqrt(2.0) * w * T) - 1.0) / (2.0 * w**2)
    assert budget(plan).sigma()[-1, 2] == pytest.approx(expected, rel=0.01)
