"""An hour with ideal sensors: the navigated path stays on the true one, in closed form and in flight."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import load_scenario
from tests.oracles.s_turn import STurn

# Asked of the best algorithm and of the default one: 0.01 m and 0.05 m on S-turns, 0.001 m and 0.01 m in flight.
S_TURN = {"functional-iteration": 0.01, "quaternion": 0.05}
CLOSURE = {"functional-iteration": 0.001, "quaternion": 0.01}


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", S_TURN)
def test_s_turns_for_an_hour(algorithm: str) -> None:
    flight = STurn(duration=3600).fly(100)
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    solution = navigate(imu, first, algorithm=algorithm, gravity="somigliana")
    rows = np.searchsorted(flight.time, solution.time)  # an update may take several samples
    assert np.array_equal(flight.time[rows], solution.time)
    truth = type(flight)(
        flight.time[rows],
        flight.dtheta,
        flight.dvel,
        *(field[rows] for field in (flight.latitude, flight.longitude, flight.height)),
        flight.velocity_ned[rows],
        flight.q_nb[rows],
    )
    assert np.max(truth.horizontal_error(solution.latitude, solution.longitude)) < S_TURN[algorithm]


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_flight_for_an_hour(frame: str) -> None:
    settings = [f"navigation.algorithms={list(CLOSURE)}", f"navigation.frame={frame}"]
    result = run(load_scenario("closure", settings))
    assert result.truth.ideal.time[-1] - result.truth.ideal.time[0] == pytest.approx(3600.0, abs=1.0)
    for algorithm, metres in CLOSURE.items():
        assert result.summary["algorithms"][algorithm]["max_horizontal_error_m"] < metres, algorithm
