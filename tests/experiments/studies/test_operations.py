"""Counting operations: known numbers of known formulas, and the same results as the compiled kernels."""

from __future__ import annotations

from collections.abc import Iterator
from math import sin, sqrt

import numpy as np
import pytest

from sinssim.experiments.studies import step_cost
from sinssim.experiments.studies.step_cost import OF_FUNCTION, count
from sinssim.jit import kernel
from sinssim.rotation import cross_k, multiply_k
from sinssim.strapdown.navigate import navigate


@pytest.fixture(autouse=True, scope="module")
def _fewer_samples() -> Iterator[None]:
    """Count over 120 samples: the mean over 240 takes twice as long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step_cost, "_COUNTED_SAMPLES", 120)
        step_cost.count_operations.cache_clear()
        yield
    step_cost.count_operations.cache_clear()


@kernel
def _mean_sine(values, result):
    total = 0.0
    for i in range(values.shape[0]):
        if values[i] > 0.0:
            total += sin(values[i]) / 4.0 + 1.0 / values[i]
    result[0] = sqrt(total * total)


@kernel
def _by_parts(values, result):
    work = np.empty((3, 2))
    for i in range(3):
        work[i, 0], work[i, 1] = values[i] ** 3, -values[i]
    result[0], result[1], result[2] = cross_k(work[0, 0], work[1, 0], work[2, 0], work[0, 1], work[1, 1], work[2, 1])


@kernel
def _inner(x):
    return x * x


@kernel
def _middle(x):
    return _inner(x) + 1.0


@kernel
def _outer(x, out):
    out[0] = _inner(x[0]) + _middle(x[0])


def test_branches_functions_and_divisions_by_constants():
    values, result = np.array([1.0, -2.0, 3.0]), np.zeros(1)
    operations, _ = count(_mean_sine, (values, result), 1)
    # two of three values: sine, /4 (a multiplication), 1/x, two additions; then a product and a root
    assert (operations.function, operations.multiply, operations.divide) == (2, 3, 2)
    assert (operations.add, operations.root) == (4, 1)
    assert operations.total == 10 + 2 * OF_FUNCTION
    compiled = np.zeros(1)
    _mean_sine(values, compiled)
    assert result[0] == pytest.approx(compiled[0], rel=1e-15)


def test_inner_arrays_and_called_kernels():
    values, result, compiled = np.array([1.0, -2.0, 3.0]), np.zeros(3), np.zeros(3)
    operations, _ = count(_by_parts, (values, result), 1)
    assert operations.multiply == 6 + 6  # three cubes, a vector product
    assert operations.add == 3
    _by_parts(values, compiled)
    np.testing.assert_allclose(result, compiled, rtol=1e-15)


def test_quaternion_product_takes_28_operations():
    @kernel
    def product(a, b, out):
        out[0], out[1], out[2], out[3] = multiply_k(a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3])

    out = np.zeros(4)
    operations, _ = count(product, (np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.5, -1.0, 2.0, 1.0]), out), 1)
    assert (operations.multiply, operations.add) == (16, 12)
    np.testing.assert_array_equal(out, [-7.5, -5.0, -2.5, 10.0])  # (1+2i+3j+4k)(½−i+2j+k) by hand


def test_what_stands_apart_is_not_counted_where_the_kernel_itself_calls_it():
    out = np.zeros(1)
    operations, _ = count(_outer, (np.array([3.0]), out), 1, apart=("_inner",))
    assert (operations.multiply, operations.add) == (1, 2)  # the product in _middle; the sums in _middle and _outer
    assert out[0] == 19.0


def test_only_what_is_needed():
    """Of two sums and two products of three numbers each, those that no result depends on."""

    @kernel
    def wasteful(a, b, out):
        for i in range(3):
            unused = a[i] * b[i] + 1.0
            out[0] = a[i] * a[i] - abs(-b[i]) ** 2 + 0.0 * (i * 1.0)
        out[1] = unused

    out = np.zeros(2)
    arguments = (np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]), out)
    every, _ = count(wasteful, arguments, 1)
    assert (every.multiply, every.add) == (9, 9)
    needed, _ = count(wasteful, arguments, 1, needed=True)
    # the last pass alone: a², b², their difference and + 0; then a b + 1
    assert (needed.multiply, needed.add) == (3, 3)
    np.testing.assert_array_equal(out, [-27.0, 19.0])
    again, _ = count(wasteful, arguments, 1)
    assert again == every


def test_poisson_costs_its_products_and_no_output():
    """Poisson's fourth-order step beside that of the second: two more products and sums for s and c, twice."""
    second, fourth = (step_cost.count_operations(f"poisson-{n}", "level") for n in (2, 4))
    assert fourth.total - second.total == pytest.approx(8.0, abs=0.1)


@pytest.mark.parametrize(
    ("algorithm", "frame"),
    [("quaternion", "level"), ("rotation-vector-3", "level"), ("functional-iteration", "level"), ("euler", "wander")],
)
def test_counted_navigation_is_the_compiled_one(algorithm, frame):
    operations, counted = step_cost._counted(algorithm, frame)
    imu, initial = step_cost._data(step_cost._COUNTED_SAMPLES)
    compiled = navigate(imu, initial, algorithm=algorithm, frame=frame)
    np.testing.assert_array_equal(counted.time, compiled.time)
    np.testing.assert_allclose(counted.q_nb, compiled.q_nb, rtol=0, atol=1e-14)
    np.testing.assert_allclose(counted.latitude, compiled.latitude, rtol=0, atol=1e-15)
    np.testing.assert_allclose(counted.velocity_ned, compiled.velocity_ned, rtol=0, atol=1e-11)
    assert 200 < operations.total < 10_000


@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_counted_schedule_is_the_compiled_one(frame):
    operations, counted = step_cost._counted("quaternion", frame, (4, 5))
    imu, initial = step_cost._data(step_cost._COUNTED_SAMPLES)
    compiled = navigate(imu, initial, frame=frame, rates_hz=(100.0, 25.0, 5.0))
    np.testing.assert_array_equal(counted.time, compiled.time)
    np.testing.assert_allclose(counted.q_nb, compiled.q_nb, rtol=0, atol=1e-14)
    np.testing.assert_allclose(counted.velocity_ned, compiled.velocity_ned, rtol=0, atol=1e-11)
    assert operations == step_cost.measure_cost("quaternion", frame, (200.0, 50.0, 10.0)).operations


@pytest.mark.parametrize("frame", ["level", "inertial"])
def test_a_schedule_costs_its_parts(frame):
    """Fast + medium/r + slow/(r s): from three schedules follows a fourth."""
    ratios = [(1, 1), (2, 1), (2, 2)]
    shares = np.array([[1.0, 1.0 / r, 1.0 / (r * s)] for r, s in ratios])
    parts = np.linalg.solve(shares, [step_cost.count_operations("quaternion", frame, pair).total for pair in ratios])
    assert np.all(parts > 20.0)
    expected = parts @ [1.0, 1.0 / 10.0, 1.0 / 50.0]
    assert step_cost.count_operations("quaternion", frame, (10, 5)).total == pytest.approx(expected, abs=2.0)


def test_several_samples_a_step_take_fewer_operations_a_sample():
    totals = [step_cost.count_operations(f"rotation-vector-{n}", "level").total for n in (1, 2, 4)]
    assert totals[0] > 1.5 * totals[1] > 2.0 * totals[2]


def test_time_is_that_of_the_slower():
    """A clock that stands still gives 0, so the measure is of the clock, divided by the samples."""
    ticks = iter(range(1000))
    seconds = step_cost.measure_time("quaternion", "level", lambda: float(next(ticks)))
    assert seconds == pytest.approx(1e9 / step_cost._TIMED_SAMPLES)
