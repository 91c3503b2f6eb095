"""The largest drift of a reading within a session, worked out by hand from round numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import dblquad

from sinssim.alignment import Expected, largest_drift
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.imu_errors import WarmUp
from sinssim.units import G0

HALVES = WarmUp(90.0, 10.0, 100.0 / np.log(2.0))
"""80 K above the steady temperature, half of it every 100 s: 50 K at 100 s, 20 K at 300 s."""


def drifting(reading: float, unit: float) -> TriadErrors:
    """Right axis: 3 and 4 units by temperature, 12 by the ramp in 200 s, which are 13; the others have less."""
    return TriadErrors(
        bias_temperature=np.array([1.0, -3.0, 2.0]) * unit / 30.0,
        scale_temperature=np.array([2.0, 4.0, -3.0]) * unit / 30.0 / reading,
        ramp=np.array([-11.0, 12.0, 5.0]) * unit / 200.0,
    )


def test_known_drifts_add_by_squares_and_the_largest_axis_counts() -> None:
    mean = ImuErrors(drifting(OMEGA_IE, 1e-8), drifting(G0, 1e-4), warm_up=HALVES)
    found = largest_drift(Expected(mean, ImuErrors()), 200.0, 100.0)
    np.testing.assert_allclose(found, (13e-8, 0.0, 13e-4, 0.0), rtol=1e-12)


def test_unknown_drifts_and_wandering_biases_add_by_squares() -> None:
    """13, 84 and 132 units are 157; an instability whose memory halves within the session changes by its σ."""

    def triad(reading: float, unit: float) -> TriadErrors:
        terms = {name: getattr(drifting(reading, unit), name) for name in ("bias_temperature", "scale_temperature")}
        return TriadErrors(
            **terms,
            ramp=np.array([-11.0, 12.0, 5.0]) * unit / 200.0,
            instability=84.0 * unit,
            correlation_time=200.0 / np.log(2.0),
            rate_walk=132.0 * unit / np.sqrt(200.0),
        )

    expected = Expected(ImuErrors(warm_up=HALVES), ImuErrors(triad(OMEGA_IE, 1e-8), triad(G0, 1e-4), warm_up=HALVES))
    np.testing.assert_allclose(largest_drift(expected, 200.0, 100.0), (0.0, 157e-8, 0.0, 157e-4), rtol=1e-12)


def test_flicker_between_means_over_a_second() -> None:
    """The covariance of a density B²/πf at a distance x is −(B²/π) ln x and a constant, which cancels."""
    distance = 30.0
    apart, _ = dblquad(lambda x, y: np.log(distance + x - y), 0.0, 1.0, 0.0, 1.0)
    within, _ = dblquad(lambda x, y: np.log(np.abs(x - y)), 0.0, 1.0, 0.0, lambda y: y)
    variance = 2.0 / np.pi * (apart - 2.0 * within)
    sigma = ImuErrors(TriadErrors(flicker=5e-8), TriadErrors(flicker=3e-4))
    found = largest_drift(Expected(ImuErrors(), sigma), distance)
    np.testing.assert_allclose(found, (0.0, 5e-8 * np.sqrt(variance), 0.0, 3e-4 * np.sqrt(variance)), rtol=1e-4)
    short, second = (largest_drift(Expected(ImuErrors(), sigma), length) for length in (0.2, 1.0))
    assert short.rate_sigma == second.rate_sigma  # means over a second are not closer than that


def test_the_null_shift_adds_its_range_to_the_rates() -> None:
    """3e-9 per kelvin from 50 K to 20 K, and a curve that turns back at 30 K."""
    mean = ImuErrors(drifting(OMEGA_IE, 1e-8), drifting(G0, 1e-4), warm_up=HALVES)
    for bias, span in ((lambda t: -3e-9 * t, 9e-8), (lambda t: 1e-10 * (t - 30.0) ** 2, 4e-8)):
        known = ImuErrors(mean.gyro, mean.accel, warm_up=HALVES, null_shift=SimpleNamespace(bias=bias))  # type: ignore[arg-type]
        found = largest_drift(Expected(known, ImuErrors()), 200.0, 100.0)
        np.testing.assert_allclose(found, (13e-8 + span, 0.0, 13e-4, 0.0), rtol=1e-6)
        later = largest_drift(Expected(known, ImuErrors()), 200.0, 10_000.0)  # all is warm
        assert later.rate == pytest.approx(12e-8, rel=1e-12)
