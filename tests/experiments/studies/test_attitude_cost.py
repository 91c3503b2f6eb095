"""The attitude alone: its matrix against SciPy, and operations counted by hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import ImuData
from sinssim.experiments.studies import attitude_cost, step_cost
from sinssim.experiments.studies.attitude_cost import _loop, attitude_costs, count_attitude
from sinssim.strapdown.attitude import REGISTRY
from sinssim.strapdown.coning_sculling import weight_table

COUNT = 24


@pytest.fixture(autouse=True)
def few_samples(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Count over 24 samples: the mean over 240 takes ten times as long."""
    monkeypatch.setattr(attitude_cost, "_COUNTED", COUNT)
    monkeypatch.setattr(step_cost, "_COUNTED_SAMPLES", COUNT)
    for cache in (count_attitude, step_cost.count_operations):
        cache.cache_clear()
    yield
    for cache in (count_attitude, step_cost.count_operations):
        cache.cache_clear()


def matrix_after(algorithm: str, by_functions: bool = False) -> np.ndarray:
    """B after turning by COUNT equal increments in a frame that turns at a constant rate."""
    time = np.arange(COUNT + 1) * 0.01
    turned = np.tile([3e-3, -2e-3, 4e-3], (COUNT, 1))
    frame = np.array([1e-5, 2e-5, -3e-5])
    updates = COUNT // REGISTRY[algorithm].samples
    matrices = np.empty((updates, 9))
    _loop(algorithm, by_functions)(
        turned, np.zeros((COUNT, 3)), weight_table(time, True), np.array([1.0, 0.0, 0.0, 0.0]),
        frame * REGISTRY[algorithm].samples, updates, matrices,
    )  # fmt: skip
    return matrices[-1].reshape(3, 3)


@pytest.mark.parametrize("algorithm", ["quaternion", "poisson", "euler", "rotation-vector-2", "rotation-vector-1p"])
def test_the_timed_loop_is_the_attitude(algorithm):
    body = Rotation.from_rotvec(COUNT * np.array([3e-3, -2e-3, 4e-3]))
    frame = Rotation.from_rotvec(COUNT * np.array([1e-5, 2e-5, -3e-5]))
    expected = (frame.inv() * body).as_matrix()
    np.testing.assert_allclose(matrix_after(algorithm), expected, rtol=0, atol=1e-9)
    if algorithm == "euler":
        np.testing.assert_allclose(matrix_after(algorithm, by_functions=True), expected, rtol=0, atol=1e-9)


def test_b_by_sines_and_cosines():
    """Six functions, 14 products and 4 sums: sin θ sin φ and sin θ cos φ are taken once."""
    _, matrix = count_attitude("euler", by_functions=True)
    assert (matrix.function, matrix.multiply, matrix.add) == pytest.approx((6.0, 14.0, 4.0))
    _, own = count_attitude("euler")
    assert own.function == 0.0  # by the addition theorems, from the step


def test_b_is_the_variable_of_poissons_equation():
    whole, matrix = count_attitude("poisson-2")
    assert matrix.total == 0.0
    assert whole.total > 100.0


def test_attitude_is_a_part_of_the_navigation():
    for algorithm in ("quaternion", "euler", "rotation-vector-2"):
        whole, matrix = count_attitude(algorithm)
        assert matrix.total < whole.total < step_cost.count_operations(algorithm, "level").total


def test_lines_of_a_report():
    (quaternion,) = attitude_costs("quaternion")
    assert quaternion.name == "quaternion"
    assert 0.1 < quaternion.ns_per_step < 1e5
    assert [cost.name for cost in attitude_costs("euler")] == ["euler", "euler, B by sines and cosines"]
    assert attitude_costs("functional-iteration") == []  # attitude, velocity and position are iterated together


def test_b_alone_from_many_attitudes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both loops fill 20 000 matrices, row by row; the time is shared among them."""
    filled, times = [], iter((40_000.0, 70_000.0))

    def timed(call: Any) -> float:
        call()
        loop, (attitudes, matrices) = call.func, call.args
        filled.append((loop, attitudes, matrices))
        return next(times)

    monkeypatch.setattr(attitude_cost, "least_time", timed)
    by_quaternion, by_angles = attitude_cost.matrix_costs()
    assert (by_quaternion.ns, by_angles.ns) == (2.0, 3.5)
    assert (by_angles.operations.function, by_angles.operations.multiply, by_angles.operations.add) == (6.0, 14.0, 4.0)
    assert by_quaternion.operations.function == by_quaternion.operations.root == 0.0
    (_, quaternions, first), (_, angles, second) = filled
    assert len(angles) == len(quaternions) == 20_000
    assert -1.5 < angles.min() < -1.49
    assert 1.49 < angles.max() < 1.5
    exact = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix().reshape(-1, 9)
    np.testing.assert_allclose(first, exact, rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(second, exact, rtol=0.0, atol=2e-15)


def test_the_time_of_an_attitude_is_that_of_a_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 2 µs for 10 samples, which an algorithm of two samples takes in five steps."""
    imu, steps = ImuData(np.arange(11.0), np.zeros((10, 3)), np.zeros((10, 3))), list[int]()
    monkeypatch.setattr(attitude_cost, "timed_data", lambda: (imu, None))
    monkeypatch.setattr(attitude_cost, "_loop", lambda *given: lambda count, matrices: steps.append(count))
    monkeypatch.setattr(attitude_cost, "_arguments", lambda *given: ())
    monkeypatch.setattr(attitude_cost, "least_time", lambda call: call() or 2000.0)
    monkeypatch.setattr(attitude_cost, "count_attitude", lambda *given: ("of all", "of B"))
    cost = attitude_cost._cost("rotation-vector-2", False)
    assert (cost.algorithm, cost.by_functions, steps) == ("rotation-vector-2", False, [5])
    assert list(vars(cost).values())[2:] == [200.0, "of all", "of B"]
