"""The vertical channel against its closed forms: free divergence, the third-order loop, the held height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from tests.oracles import gravity as zonal
from tests.oracles.s_turn import STurn
from tests.oracles.turntable import turn


def parked(t):
    return np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*t.shape, 4)), np.zeros((*t.shape, 3))


def run(flight, height_error=0.0, **options):
    first = NavState(
        flight.latitude[0],
        flight.longitude[0],
        flight.height[0] + height_error,
        flight.velocity_ned[0],
        flight.q_nb[0],
    )
    options.setdefault("gravity", "somigliana")
    return navigate(ImuData(flight.time, flight.dtheta, flight.dvel), first, **options)


@pytest.mark.parametrize("model", ["somigliana", "normal"])
def test_free_height_diverges_as_theory_says(model):
    """cosh(√(∂g/∂h) t): 278 times in an hour. Near a pole, where vertical motion feels no Coriolis to speak of."""
    latitude = 1.4
    flight = turn(parked, 3600, 5, latitude=latitude, height=0.0)
    growth = run(flight, 1.0, gravity=model).height - run(flight, 0.0, gravity=model).height
    if model == "somigliana":
        s2 = np.sin(latitude) ** 2
        g = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - 6.69437999014e-3 * s2)
        gradient = 2 * g / 6378137.0
    else:
        _, down = zonal.WGS84.north_down(np.full(2, latitude), np.array([-100.0, 100.0]))
        gradient = (down[0] - down[1]) / 200
    expected = np.cosh(np.sqrt(gradient) * flight.time)
    assert expected[-1] == pytest.approx(278, abs=0.5)
    # Coriolis takes 4ω²cos²B·⅔ off the gradient: 0.07 % of the growth in an hour
    np.testing.assert_allclose(growth, expected, rtol=1e-3)


def test_free_divergence_at_middle_latitude_feels_coriolis():
    """Rising masses drift west, and that drift weighs on them: less than the ×277 of the spherical estimate."""
    flight = turn(parked, 3600, 5, latitude=0.0, height=0.0)
    growth = run(flight, 1.0).height[-1] - run(flight, 0.0).height[-1]
    assert 265 < growth < np.cosh(np.sqrt(2 * 9.7803253359 / 6378137.0) * 3600) - 2


@pytest.mark.parametrize("tau", [20.0, 50.0])
def test_baro_loop_answers_with_its_triple_pole(tau):
    """A wrong initial height decays as s²/(s + 1/τ)³: (1 − 2x + x²/2) e⁻ˣ with x = t/τ."""
    flight = turn(parked, 600, 100, height=0.0)
    solution = run(flight, 100.0, vertical="baro-loop", height=flight.height, baro_time_constant=tau)
    x = flight.time / tau
    expected = 100 * (1 - 2 * x + x * x / 2) * np.exp(-x)
    # 2g/R is taken at the start: gravity's own change over 100 m makes 1e-5 of difference
    np.testing.assert_allclose(solution.height, expected, atol=1e-3, rtol=0)
    # v_D = −(ḣ + k₁ h) of that response
    rate = 100 / tau * (-3 + 3 * x - x * x / 2) * np.exp(-x) + 3 / tau * expected
    np.testing.assert_allclose(-solution.velocity_ned[:, 2], rate, atol=1e-4, rtol=0)


def test_baro_loop_takes_up_an_accelerometer_bias():
    """A constant vertical bias b moves the height by b t²/2 e⁻ˣ, at most 2τ²b/e², and is then compensated."""
    tau, bias = 30.0, 1e-3
    flight = turn(parked, 900, 50, height=0.0)
    biased = replace(flight, dvel=flight.dvel - [0.0, 0.0, bias / 50])
    solution = run(biased, vertical="baro-loop", height=flight.height, baro_time_constant=tau)
    expected = bias * flight.time**2 / 2 * np.exp(-flight.time / tau)
    assert expected.max() == pytest.approx(2 * tau**2 * bias / np.e**2, rel=1e-4)
    np.testing.assert_allclose(solution.height, expected, atol=1e-4 * expected.max(), rtol=0)
    # what is left is Coriolis: the loop's transient leaves 0.2 mm/s to the east, which swings with Schuler's period
    assert abs(solution.height[-1]) < 2e-6
    assert abs(solution.velocity_ned[-1, 2]) < 1e-7


def test_baro_loop_keeps_the_height_of_a_flight_bounded():
    flight = STurn(duration=1800).fly(20)
    wrong = replace(flight, dvel=flight.dvel - [0.0, 0.0, 5e-4 / 20])  # 50 µg
    free = run(wrong)
    loop = run(wrong, vertical="baro-loop", height=flight.height)
    assert np.max(np.abs(free.height - flight.height)) > 1000
    assert np.max(np.abs(loop.height - flight.height)) < 2 * 50**2 * 5e-4 / np.e**2 * 1.1


def test_truth_holds_the_height_and_its_rate():
    flight = STurn(duration=120).fly(20)
    reference = flight.height + 30 * np.sin(0.05 * flight.time)
    solution = run(flight, 77.0, vertical="truth", height=reference)
    np.testing.assert_array_equal(solution.height[1:], reference[1:])
    # the rate of a table of heights by second differences: 30 · 0.05³ · dt²/6
    np.testing.assert_allclose(
        solution.velocity_ned[1:-1, 2], -1.5 * np.cos(0.05 * flight.time[1:-1]), atol=5e-6, rtol=0
    )
