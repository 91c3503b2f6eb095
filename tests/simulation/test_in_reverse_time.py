"""Data, models and estimates in reverse time, on a few rows by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData, Measurements, NavSolution
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.filter_result import Divergence, Estimate, Innovations, Reasons
from sinssim.estimation.state_model import INERTIAL
from sinssim.simulation.backward_filter import (
    _in_forward_time,
    reversed_imu,
    reversed_readings,
    signs_in_reverse_time,
    start_model,
)

EDGES = np.array([3.0, 4.0, 6.0, 7.0])
NAVIGATION = (Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1e-3))


def test_increments_in_reverse_time() -> None:
    """Edges 3, 4, 6, 7 become 3, 4, 6, 7 read backwards: intervals of 1, 2, 1 s."""
    imu = ImuData(np.array([3.0, 4.0, 6.0, 7.5]), np.arange(9.0).reshape(3, 3), 10.0 + np.arange(9.0).reshape(3, 3))
    found = reversed_imu(imu)
    np.testing.assert_allclose(found.time, [3.0, 4.5, 6.5, 7.5])
    np.testing.assert_array_equal(found.dtheta, [[-6, -7, -8], [-3, -4, -5], [0, -1, -2]])
    np.testing.assert_array_equal(found.dvel, [[16, 17, 18], [13, 14, 15], [10, 11, 12]])


def test_readings_in_reverse_time() -> None:
    """Out of order, and one beyond either end; velocities change their sign, positions do not."""
    time = np.array([4.5, 2.9, 3.5, 7.1, 6.9])
    value, sigma = np.arange(15.0).reshape(5, 3) + 1.0, 20.0 + np.arange(15.0).reshape(5, 3)
    correlation = np.array([np.eye(3) + 0.1 * k * (1.0 - np.eye(3)) for k in range(5)])
    for kind, sign in (("gnss-velocity", -1.0), ("gnss-position", 1.0)):
        given = Measurements(kind, time, time + 0.2, value, sigma, np.array([1.0, 2.0, 3.0]), correlation=correlation)
        found = reversed_readings(given, EDGES)
        rows = [4, 0, 2]  # 6.9, 4.5 and 3.5 s
        np.testing.assert_allclose(found.time, [3.1, 5.5, 6.5])
        np.testing.assert_allclose(found.arrival, found.time)
        np.testing.assert_array_equal(found.value, sign * value[rows])
        np.testing.assert_array_equal(found.sigma, sigma[rows])
        np.testing.assert_array_equal(found.correlation, correlation[rows])
        np.testing.assert_array_equal(found.lever_arm, [1.0, 2.0, 3.0])
    wheels = Measurements("land-velocity", time, time, np.arange(20.0).reshape(5, 4) + 1.0, np.ones((5, 2)))
    found = reversed_readings(wheels, EDGES)
    np.testing.assert_array_equal(found.value, [[-17, -18, 19, 20], [-1, -2, 3, 4], [-9, -10, 11, 12]])
    # a mean rate over (5, 6] s is one over (4, 5] s, valid at 5 s; that of (3, 4] s is valid at 7 s
    rates = Measurements(
        "zero-rate", np.array([4.0, 5.0, 6.0]), np.array([4.0, 5.0, 6.0]), np.arange(9.0).reshape(3, 3), np.ones((3, 3))
    )
    found = reversed_readings(rates, EDGES)
    np.testing.assert_allclose(found.time, [5.0, 6.0, 7.0])
    np.testing.assert_array_equal(found.value, [[-6, -7, -8], [-3, -4, -5], [0, -1, -2]])


def test_signs_of_the_states() -> None:
    """Velocity, biases of gyros and of velocities, delays and wind change theirs."""
    names = {
        "gyro bias": -1, "accelerometer bias": 1, "gyro instability": -1, "accelerometer instability": 1,
        "gyro scale": 1, "accelerometer misalignment": 1, "gnss lever arm": 1, "gnss time offset": -1,
    }  # fmt: skip
    own = {"pitot wind": (2, -1), "pitot bias": (1, 1), "gv bias": (3, -1), "gp bias": (3, 1), "baro delay": (1, -1),
           "wheel bias": (1, -1), "wheel scale": (1, 1), "wheels mounting": (2, 1)}  # fmt: skip
    blocks = [Block(name, 1.0) for name in names] + [Block(name, np.ones(size)) for name, (size, _) in own.items()]
    model = ErrorModel((*NAVIGATION, *blocks), 1e-4, 1e-3)
    kinds = {"pitot": "airspeed", "gv": "gnss-velocity", "gp": "gnss-position", "baro": "baro-height", "wheel": "speed",
             "wheels": "land-velocity"}  # fmt: skip
    found = signs_in_reverse_time(model, kinds)
    expected = {
        "position": 1,
        "velocity": -1,
        "attitude": 1,
        **names,
        **{name: sign for name, (_, sign) in own.items()},
    }
    for name, where in model.slices.items():
        np.testing.assert_array_equal(found[where], expected[name], err_msg=name)


@pytest.mark.parametrize("block", list(INERTIAL))
def test_an_error_of_a_sensor_turns_its_reading_in_reverse_time(block: str) -> None:
    """Rates change their signs and so do their errors, specific forces and their errors do not; processes too."""
    term, force = INERTIAL[block], np.array([[1.0, -2.0, -9.0]])
    reading, sign = (np.array([[0.3, -0.2, 0.5]]), -1.0) if term.triad == "gyro" else (force, 1.0)
    model = ErrorModel((*NAVIGATION, Block(block, 1.0), Block("gyro flicker 1", 1.0)), 1e-4, 1e-3)
    signs = signs_in_reverse_time(model, {})
    value = np.arange(1.0, term.size + 1.0)
    there = term.effect(term.shaped(signs[model.slices[block]] * value), sign * reading, force)
    np.testing.assert_allclose(there, sign * np.asarray(term.effect(term.shaped(value), reading, force)))
    assert np.all(signs[model.slices["gyro flicker 1"]] == -1.0)


def test_the_model_of_the_start() -> None:
    """Ten times the last σ, of an attitude at most 0.5 rad or its own; random walks as large as after 100 s."""
    blocks = (
        *NAVIGATION, Block("gyro bias", [3.0, 6.0, 5.0], random_walk=[0.4, 0.8, 1.2]),
        Block("accelerometer instability", 7.0, correlation_time=50.0), Block("gyro scale", 0.01),
    )  # fmt: skip
    model = ErrorModel(blocks, 1e-4, 1e-3)
    sigma = np.vstack([np.ones(model.size), np.r_[1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.01, 0.06, 0.7, np.full(9, 99.0)]])
    forward: Any = SimpleNamespace(model=model, time=np.array([20.0, 120.0]), sigma=sigma)
    found = start_model(forward)
    expected = np.r_[10.0, 20.0, 30.0, 1.0, 2.0, 3.0, 0.1, 0.5, 0.7, 5.0, 10.0, 13.0, [7.0] * 3, [0.01] * 3]
    np.testing.assert_allclose(found.sigma, expected, rtol=1e-12)
    np.testing.assert_array_equal(found.density, model.density)
    assert [block.correlation_time for block in found.blocks] == [block.correlation_time for block in model.blocks]


def test_an_estimate_is_read_backwards() -> None:
    model = ErrorModel((*NAVIGATION, Block("gyro bias", 1.0), Block("gv bias", np.ones(3))), 1e-4, 1e-3)
    n = model.size
    time = np.array([3.0, 4.5, 7.0])
    rng = np.random.default_rng(2)
    velocity, q = rng.normal(size=(3, 3)), rng.normal(size=(3, 4))
    solution = NavSolution(
        time, np.arange(3.0), 10.0 + np.arange(3.0), 20.0 + np.arange(3.0), velocity, q, 0.1 * np.arange(3.0), "own"
    )
    root = rng.normal(size=(2, n, n))
    covariance = root @ root.transpose(0, 2, 1)
    values = {"gyro bias": rng.normal(size=(3, 3)), "gv bias": rng.normal(size=(3, 3))}
    innovations = (
        Innovations("gv", "gnss-velocity", np.array([4.5, 6.0]), np.array([[1.0, 2, 3], [4, 5, 6]]),
                    np.arange(12.0).reshape(2, 6), np.array([0.5, 0.7]), np.array([True, False]),
                    Reasons(2, {1: "gate"}), 9.0),
        Innovations("wheels", "land-velocity", np.array([4.0, 6.5]), np.array([[1.0, 2], [3, 4]]),
                    np.array([[1.0, 2, 3], [4, 5, 6]]), np.array([0.1, 0.2]), np.array([True, True]),
                    Reasons(2, {}), 9.0),
        Innovations("gp", "gnss-position", np.array([4.0, 6.5]), np.array([[1.0, 2, 3], [4, 5, 6]]),
                    np.arange(12.0).reshape(2, 6), np.array([0.1, 0.2]), np.array([True, True]),
                    Reasons(2, {}), 9.0),
    )  # fmt: skip
    sigma = rng.uniform(size=(3, n))
    one = Estimate(model, time, solution, values, sigma, np.array([0, 2]), covariance, innovations, None, None,
                   Divergence(6.5, "gv 1", "why"), (), lambda: solution)  # fmt: skip
    found = _in_forward_time(one, np.array([3.0, 7.0]), {"gv": "gnss-velocity", "gp": "gnss-position"})
    np.testing.assert_allclose(found.time, [3.0, 5.5, 7.0])
    s = found.solution
    np.testing.assert_allclose(s.time, [3.0, 5.5, 7.0])
    np.testing.assert_array_equal([s.latitude, s.longitude, s.height], [[2, 1, 0], [12, 11, 10], [22, 21, 20]])
    np.testing.assert_array_equal(s.velocity_ned, -velocity[::-1])
    np.testing.assert_array_equal(s.q_nb, q[::-1])
    np.testing.assert_allclose(s.defect, [0.2, 0.1, 0.0])
    for name, value in values.items():
        np.testing.assert_array_equal(found.parameters[name], -value[::-1])
    np.testing.assert_array_equal(found.sigma, sigma[::-1])
    assert found.rows.tolist() == [0, 2]
    signs = np.r_[np.ones(3), -np.ones(3), np.ones(3), -np.ones(6)]
    np.testing.assert_allclose(found.covariance, [np.diag(signs) @ c @ np.diag(signs) for c in covariance[::-1]])
    assert found.divergence == Divergence(3.5, "gv 1", "why")
    velocities, wheels, positions = found.innovations
    np.testing.assert_allclose(velocities.time, [4.0, 5.5])
    np.testing.assert_array_equal(velocities.value, [[-4, -5, -6], [-1, -2, -3]])
    np.testing.assert_array_equal(velocities.lower, [np.arange(6.0, 12.0), np.arange(6.0)])
    np.testing.assert_array_equal(velocities.nis, [0.7, 0.5])
    assert (velocities.accepted.tolist(), list(velocities.reason)) == ([False, True], ["gate", ""])
    np.testing.assert_array_equal(wheels.value, [[-3, -4], [-1, -2]])
    np.testing.assert_array_equal(wheels.lower, [[4, 5, 6], [1, 2, 3]])
    np.testing.assert_array_equal(positions.value, [[4, 5, 6], [1, 2, 3]])


@pytest.mark.parametrize("beyond", [-1e-7, 1e-7])
def test_instants_within_rounding_of_the_ends_count(beyond: float) -> None:
    time = np.array([3.0 + beyond, 7.0 + beyond])
    given = Measurements("baro-height", time, time, np.array([[1.0], [2.0]]), np.ones((2, 1)))
    found = reversed_readings(given, EDGES)
    np.testing.assert_allclose(found.time, [3.0, 7.0], rtol=0, atol=2e-7)
    assert found.time[0] >= 3.0
    assert found.time[1] <= 7.0
