"""The baro loop on an altimeter's readings: causal, held between them, open when they are overdue."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import ImuData, NavSolution, navigate
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.strapdown.frames.vertical_channel import NOTHING_NEW, OVERDUE, HeightReadings
from sinssim.truth.motions.parked_and_great_circle import GreatCircle

TAU, RATE, SPAN = 8.0, 20.0, 40.0
FLIGHT = GreatCircle(0.9, 0.1, 3000.0, 0.7, 150.0, SPAN)
ENGINES = (
    ("quaternion", "level"),
    ("rotation-vector-2", "level"),
    ("quaternion", "wander"),
    ("quaternion", "inertial"),
    ("functional-iteration", "level"),
    ("functional-iteration", "inertial"),
)


def samples() -> ImuData:
    return FLIGHT.increments(RATE)


def solve(readings: HeightReadings | Array, algorithm: str = "quaternion", frame: str = "level", **more) -> NavSolution:
    first = FLIGHT.state(0.0)
    options = {"vertical": "baro-loop", "baro_time_constant": TAU, "gravity": "normal", **more}
    return navigate(samples(), first, algorithm=algorithm, frame=frame, height=readings, **options)


def sampled_loop(time: Array, arrival: Array, value: Array, interval: float) -> Array:
    """Return the height less 3000 m of level flight under a sampled loop, by small steps of its differential equation.

    k₂'s part 2g/R and the change of gravity with height undo one another but for what the error's sampling leaves.
    """
    k1, k2, k3, gradient = 3.0 / TAU, 3.0 / TAU**2, 1.0 / TAU**3, 2.0 * 9.81 / 6.37e6
    steps = 20
    x = np.zeros(3)  # height, upward velocity, integral
    out, e = [0.0], 0.0
    for k in range(1, len(time)):
        dt = (time[k] - time[k - 1]) / steps
        for _ in range(steps):
            h, up, total = x
            x = x + dt * np.array([up - k1 * e, gradient * h - (k2 + gradient) * e - total, k3 * e])
        out.append(x[0])
        come = np.flatnonzero(arrival <= time[k] + 1e-9)
        if len(come) and arrival[come[-1]] > time[k - 1] + 1e-9:
            e = x[0] - (value[come[-1]] - 3000.0)
        elif not len(come) or time[k] - arrival[come[-1]] > 1.5 * interval:
            e = 0.0
    return np.array(out)


@pytest.mark.parametrize(("algorithm", "frame"), ENGINES)
def test_loop_is_that_of_a_sampled_error(algorithm: str, frame: str) -> None:
    """Readings once a second with an offset and a swing, none from 15 s to 25 s."""
    at = np.arange(1.0, SPAN + 0.5)
    at = at[(at < 15.0) | (at > 25.0)]
    value = 3000.0 + 20.0 + 5.0 * np.sin(0.7 * at)
    solution = solve(HeightReadings(at, value, 1.0), algorithm, frame)
    expected = sampled_loop(solution.time, at, value, 1.0)
    assert np.ptp(expected) > 15.0
    # of windows a reading counts from the next one on, at most 4 samples late
    late = 0.25 if algorithm.startswith("functional") else 0.03
    np.testing.assert_allclose(solution.height - 3000.0, expected, rtol=0, atol=late * 20.0)


@pytest.mark.parametrize(("algorithm", "frame"), ENGINES)
def test_no_reading_counts_before_it_arrives(algorithm: str, frame: str) -> None:
    at = np.arange(1.0, SPAN + 0.5)
    value = 3000.0 + 10.0 * np.cos(at)
    for moment in (9.0, 20.0):
        later = value + np.where(at + 0.3 > moment, 500.0, 0.0)
        one, other = (solve(HeightReadings(at + 0.3, v, 1.0), algorithm, frame) for v in (value, later))
        before = one.time < np.min((at + 0.3)[at + 0.3 > moment]) - 1e-6
        assert np.array_equal(one.height[before], other.height[before])
        assert abs(one.height[-1] - other.height[-1]) > 100.0


def test_three_rates_lose_no_reading() -> None:
    at = np.arange(1.0, SPAN + 0.5) + 0.05  # between the slow instants
    value = np.full(len(at), 3030.0)
    solution = solve(HeightReadings(at, value, 1.0), rates_hz=(20.0, 10.0, 5.0))
    expected = sampled_loop(solution.time, at, value, 1.0)
    # over the slow step at whose end a reading came the loop pulls by half of it: 3/τ · 30 m · 0.2 s/2
    np.testing.assert_allclose(solution.height - 3000.0, expected, rtol=0, atol=1.2)


def test_an_outage_coasts_on_what_the_loop_has_learned() -> None:
    """A vertical bias b, found by the integral; then no reading: free, not pulled to the last one or the next."""
    imu = samples()
    long = FLIGHT.state(0.0)
    bias = np.array([0.0, 0.0, 2e-3]) / RATE
    biased = ImuData(imu.time, imu.dtheta, imu.dvel + bias)
    at = np.arange(0.05, SPAN, 0.05)
    at = at[at < 30.0]
    options = {"vertical": "baro-loop", "baro_time_constant": 2.0}
    readings = HeightReadings(at, np.full(len(at), 3000.0), 0.05)
    coasting = navigate(biased, long, height=readings, **options)
    assert np.abs(coasting.height[-1] - 3000.0) < 0.05  # ½ b t² of the bias alone would be 0.1 m
    climbing = np.array(coasting.height[coasting.time > 31.0])
    assert np.ptp(climbing) < 0.05


def test_readings_are_for_the_loop() -> None:
    readings = HeightReadings(np.array([1.0]), np.array([3000.0]), 1.0)
    with pytest.raises(InputError, match="baro-loop"):
        solve(readings, vertical="truth")
    silent = solve(HeightReadings(np.empty(0), np.empty(0), 1.0))
    free = navigate(samples(), FLIGHT.state(0.0))
    np.testing.assert_allclose(silent.height, free.height, rtol=0, atol=1e-9)


def test_what_a_loop_finds_at_every_row() -> None:
    """A reading where it has come since the row before, to a nanosecond; overdue 1.5 intervals after the last."""
    arrival = np.array([1.0, 2.0 + 5e-10, 3.0 + 2e-9, 6.0])
    time = np.arange(17) / 2.0
    late, held = [OVERDUE], [NOTHING_NEW]
    expected = 2 * late + [10.0] + held + [20.0] + 2 * held + [30.0] + 2 * held + 2 * late + [60.0] + 3 * held + late
    found = HeightReadings(arrival, np.array([10.0, 20.0, 30.0, 60.0]), 1.0).at(time)
    assert found.tolist() == expected
