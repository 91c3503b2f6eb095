"""Navigators that align themselves: errors of the start against the theory, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.stats import chi2

import sinssim
from sinssim.alignment.alignment_budget import error_budget, expected_errors, total
from sinssim.alignment.parked_theory import Attitude
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario.schema import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.emulation import emulate
from sinssim.simulation.navigation_stage import align_itself
from sinssim.truth.trajectory import Trajectory

PARKED = {"latitude_deg": 50.0, "heading_deg": 30.0, "pitch_deg": 0.5, "altitude_m": 300.0, "duration_s": 310.0}


def scenario(**navigation: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "own",
            "parked": PARKED,
            "imu": {"grade": "laser-navigation", "rate_hz": 20.0},
            "navigation": {"alignment": {"duration_s": 300.0}, **navigation},
        }
    )


def starts(case: Scenario, trajectory: Trajectory, draws: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of heading, roll and pitch of the aligned starts, and their 1σ by the theory, rad."""
    ideal = trajectory.increments(case.imu.rate_hz)
    count = round(seconds * case.imu.rate_hz) + 2
    ideal = ImuData(ideal.time[: count + 1], ideal.dtheta[:count], ideal.dvel[:count])
    place = trajectory.state(trajectory.start)
    angles = []
    for seed in range(draws):
        used, state = align_itself(case, emulate(ideal, case.imu, seed), place, WGS84)
        true = trajectory.state(ideal.time[used])
        roll, pitch, heading = (np.subtract(*pair) for pair in zip(
            euler_from_quaternion(state.q_nb), euler_from_quaternion(true.q_nb), strict=True
        ))  # fmt: skip
        angles.append((heading, roll, pitch))
    roll, pitch, heading = (float(angle) for angle in euler_from_quaternion(place.q_nb))
    method = case.navigation.alignment.method  # type: ignore[union-attr]
    known = "disturbed, latitude known" if method == "disturbed" else "quiet"
    sigma = expected_errors(case.imu).sigma
    budget = total(
        error_budget(
            Attitude(np.asarray(heading), np.asarray(roll), np.asarray(pitch)), float(place.latitude), sigma, seconds,
            method=known, rate_hz=case.imu.rate_hz,
        )
    )  # fmt: skip
    return np.array(angles), np.array([float(angle) for angle in budget[:3]])


@pytest.mark.parametrize("method", ["quiet", "disturbed"])
def test_errors_of_the_start_are_those_of_the_theory(method: str) -> None:
    case = scenario(alignment={"duration_s": 300.0, "method": method})
    found, sigma = starts(case, fly(case), 40, 300.0)
    # three sums of 40 squares; each outside its band with a probability of 2e-5, for fixed seeds once and for all
    squares = np.sum((found / sigma) ** 2, axis=0)
    assert (squares > chi2.ppf(1e-5, 40)).all()
    assert (squares < chi2.isf(1e-5, 40)).all()


@pytest.mark.slow
def test_errors_of_the_start_at_the_gate_are_within_ten_percent() -> None:
    case = sinssim.load_scenario("gate_to_gate", ["imu.rate_hz=20"])
    found, sigma = starts(case, fly(case), 400, 600.0)
    # the relative 1σ of a standard deviation of 400 draws is 3.5 %
    assert np.sqrt(np.mean(found**2, axis=0)) == pytest.approx(sigma, rel=0.1)


def test_navigation_begins_at_the_end_of_the_alignment() -> None:
    run = sinssim.run(scenario(initial_error={"north_m": 5.0}))
    solution, error = run.solutions["quaternion"], run.errors["quaternion"]
    assert solution.time[0] == 300.0
    assert len(solution.time) == 10 * 20 + 1
    assert error.position_ned[0, 0] == pytest.approx(5.0, abs=1e-6)
    assert np.abs(error.velocity_ned[0]).max() < 1e-12


def test_ideal_sensors_align_exactly() -> None:
    case = scenario().model_copy(update={"imu": sinssim.load_scenario("closure").imu})
    run = sinssim.run(case)
    assert np.abs(run.errors["quaternion"].attitude[0]).max() < 1e-8


def test_what_cannot_align_is_said() -> None:
    with pytest.raises(InputError, match=r"navigation.alignment.duration_s = 400: the run lasts 310 s"):
        sinssim.run(scenario(alignment={"duration_s": 400.0}))
    with pytest.raises(ValidationError, match=r"initial_error.heading_arcmin would have no effect"):
        scenario(initial_error={"heading_arcmin": 1.0})
    moving = Scenario.model_validate(
        {
            "name": "moving",
            "motion": {
                "type": "coning",
                "latitude_deg": 50.0,
                "half_angle_deg": 1.0,
                "frequency_hz": 0.5,
                "duration_s": 400.0,
            },
            "imu": {"grade": "laser-navigation", "rate_hz": 10.0},
            "navigation": {"alignment": {}},
        }
    )
    with pytest.raises(InputError, match=r'duration_s = 300, method = "quiet": the alignment ends at 300 s'):
        sinssim.run(moving)
    with pytest.raises(InputError, match=r"navigation.alignment.duration_s = 400: the run lasts 310 s"):
        sinssim.budget(scenario(alignment={"duration_s": 400.0}))
