"""Results of a filter on a few rows by hand: corrections, errors in its states, gate, smoother, comparison, remarks."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.estimate import _initial_covariance, _too_late, neglected
from sinssim.estimation.filter_result import History, Reasons, Smoothed, corrected, nominal_errors, state_errors
from sinssim.estimation.filter_start import _as_bias, at_rest
from sinssim.estimation.innovation_gate import Innovation, InnovationGate
from sinssim.estimation.kalman_filter import ErrorFilter
from sinssim.estimation.measurement_epochs import take_in
from sinssim.estimation.smoother import smooth
from sinssim.estimation.state_model import error_model
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.simulation.aided_run import _after, with_noise_factor
from sinssim.simulation.truth_comparison import Aided, _true_parameters
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.estimation.made import reading

LATITUDE, LONGITUDE, HEIGHT = 0.9, 0.4, 800.0
W = 1.0 - 6.69437999014e-3 * np.sin(LATITUDE) ** 2
NORTH = 6378137.0 * (1.0 - 6.69437999014e-3) / W**1.5 + HEIGHT
EAST = (6378137.0 / np.sqrt(W) + HEIGHT) * np.cos(LATITUDE)
TRUE = Rotation.from_euler("ZYX", [0.7, 0.2, -0.1])
MODEL = ErrorModel(
    (Block("position", 2.0), Block("velocity", 0.5), Block("attitude", 1e-3), Block("gyro bias", 0.1),
     Block("b bias", [3.0])),
    1e-4, 1e-3,
)  # fmt: skip
X = np.array([30.0, -20.0, 5.0, 0.3, -0.2, 0.1, 1e-4, -2e-4, 3e-4])
"""Errors: solution less truth; φ with C_solution = (I − [φ×]) C_true."""


def states(rows: int, off: Array | None = None) -> dict[str, Array]:
    """Return true states, or those that are off by an error."""
    e = np.zeros(9) if off is None else off
    q = Rotation.from_rotvec(-e[6:]) * TRUE
    one = np.ones(rows)
    return {
        "latitude": (LATITUDE + e[0] / NORTH) * one, "longitude": (LONGITUDE + e[1] / EAST) * one,
        "height": (HEIGHT - e[2]) * one, "velocity_ned": np.tile(np.array([60.0, -40.0, 3.0]) + e[3:6], (rows, 1)),
        "q_nb": np.tile(q.as_quat(scalar_first=True), (rows, 1)),
    }  # fmt: skip


def solution(rows: int, off: Array | None = None) -> NavSolution:
    return NavSolution(np.arange(float(rows)), **states(rows, off), defect=np.zeros(rows))


@pytest.mark.parametrize("axes", ["north", "transported"])
def test_a_correction_takes_an_error_away(axes: str) -> None:
    found = corrected(NavState(**states(2, X)), np.tile(X, (2, 1)), WGS84, axes)
    true = states(2)
    np.testing.assert_allclose((found.latitude - LATITUDE) * NORTH, 0.0, rtol=0, atol=1e-3)
    np.testing.assert_allclose((found.longitude - LONGITUDE) * EAST, 0.0, rtol=0, atol=1e-3)
    np.testing.assert_allclose(found.height, HEIGHT, rtol=0, atol=1e-3)
    # carried axes turn with the place: 20 m over the radius, times 70 m/s
    np.testing.assert_allclose(found.velocity_ned, true["velocity_ned"], rtol=0, atol=1e-9 if axes == "north" else 1e-3)
    turned = Rotation.from_quat(found.q_nb, scalar_first=True) * TRUE.inv()
    assert turned.magnitude().max() < (1e-12 if axes == "north" else 1e-5)


def test_errors_in_the_states_of_the_filter() -> None:
    """Of navigation solution less truth, of parameters truth less estimate; a missing one has the true value zero."""
    estimated: Any = SimpleNamespace(
        solution=solution(2, X),
        parameters={"gyro bias": np.array([[1.0, 2, 3], [4, 5, 6]]), "b bias": np.array([[7.0], [8.0]])},
    )
    found = state_errors(MODEL, estimated, NavState(**states(2)), {"gyro bias": np.array([10.0, 20.0, 30.0])}, WGS84)
    np.testing.assert_allclose(found[:, :9], np.tile(X, (2, 1)), rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(found[:, 9:], [[9, 18, 27, -7], [6, 15, 24, -8]])
    n, unit = MODEL.size, np.tile(np.eye(MODEL.size), (2, 1, 1))
    compensated = np.tile(np.r_[np.full(9, 99.0), 1.0, 2.0, 3.0, 4.0], (2, 1))
    none = np.zeros((2, n))
    history = History(np.arange(2.0), unit, unit, unit, none, none, unit, unit, NavState(**states(2, X)), compensated)
    found = nominal_errors(MODEL, history, NavState(**states(2)), {"gyro bias": np.array([10.0, 20.0, 30.0])}, WGS84)
    np.testing.assert_allclose(found[:, :9], np.tile(X, (2, 1)), rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(found[:, 9:], np.tile([9.0, 18.0, 27.0, -4.0], (2, 1)))


def test_a_gate_says_why() -> None:
    """Three components at 1 %: 11.3. What was skipped has no innovation."""
    time = np.arange(1.0, 5.0)
    m = Measurements("gnss-position", time, time, np.zeros((4, 3)), np.ones((4, 3)), name="m8")
    readings: Any = SimpleNamespace(data=m, reason=Reasons(4, {3: "not a finite number"}))
    gate = InnovationGate(readings, 0.01)
    bound = chi2.isf(0.01, 3)
    s = np.array([[4.0, 1.0, 2.0], [1.0, 9.0, 3.0], [2.0, 3.0, 16.0]])
    assert gate.passes(0, Innovation(np.array([1.0, 2.0, 3.0]), s, bound - 1e-6))
    assert not gate.passes(1, Innovation(np.array([4.0, 5.0, 6.0]), 2.0 * s, 123.456))
    gate.skip(2, "why not")
    found = gate.innovations()
    assert (found.sensor, found.kind, found.bound) == ("m8", "gnss-position", pytest.approx(bound))
    np.testing.assert_array_equal(found.value[:2], [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(found.lower[:2], [[4, 1, 9, 2, 3, 16], [8, 2, 18, 4, 6, 32]])
    assert np.isnan(found.value[2:]).all()
    assert np.isnan(found.nis[2:]).all()
    assert found.accepted.tolist() == [True, False, False, False]
    assert list(found.reason) == ["", "NIS 123 is beyond the gate, 11.3", "why not", "not a finite number"]
    assert InnovationGate(readings, None).admits(Innovation(np.zeros(3), s, 1e30))


def test_a_filters_update_with_noise_that_is_in_the_state() -> None:
    """The state's error e and the reading's noise v together: the best linear estimate by Schur's complement."""
    rng = np.random.default_rng(5)
    root = rng.normal(size=(5, 5))
    joint = root @ root.T  # of three states and two noises
    p, r, cross = joint[:3, :3], joint[3:, 3:], joint[:3, 3:]
    h, z, x = rng.normal(size=(2, 3)), rng.normal(size=2), rng.normal(size=3)
    for common in (cross, None):
        both = np.zeros((3, 2)) if common is None else common
        own = ErrorFilter(p)
        own.x = x.copy()
        s = h @ p @ h.T + r + h @ both + both.T @ h.T
        gain = (p @ h.T + both) @ np.linalg.inv(s)
        found = own.innovation(reading(z, h), r, common)
        np.testing.assert_allclose(found.value, z - h @ x, rtol=1e-12)
        np.testing.assert_allclose(found.covariance, s, rtol=1e-9)
        assert found.nis == pytest.approx((z - h @ x) @ np.linalg.solve(s, z - h @ x), rel=1e-9)
        own.update(reading(z, h), r, common)
        np.testing.assert_allclose(own.x, x + gain @ (z - h @ x), rtol=1e-9)
        np.testing.assert_allclose(own.covariance, p - gain @ s @ gain.T, rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(own.gain, gain, rtol=1e-9)
    own = ErrorFilter(p)
    own.x = x.copy()
    turn = rng.normal(size=(3, 3))
    fed = rng.normal(size=3)
    own.feed(fed, turn, lambda errors: errors)
    np.testing.assert_allclose(own.x, turn @ (x - fed))
    np.testing.assert_allclose(own.covariance, turn @ p @ turn.T)


def test_the_smoother_with_feedback_is_least_squares_over_all_rows() -> None:
    """Three rows of a random walk of a sensor's bias, measured at each; some is fed back in between.

    The total at each row, b₀, b₁, b₂ with b₀ of variance 9 and steps of variance 4, is estimated from three readings of
    variance 1 by one least squares; the filter's numbers are those of its recursion, written out.
    """
    z = np.array([2.0, -1.0, 4.0])
    prior = 9.0 * np.ones((3, 3)) + 4.0 * np.minimum.outer(np.arange(3.0), np.arange(3.0))
    gain = prior @ np.linalg.inv(prior + np.eye(3))
    batch, spread = gain @ z, prior - gain @ prior
    n, fed = MODEL.size, np.array([0.0, 1.5, -0.7])
    p, x, variances, estimates, told, known = 9.0, 0.0, [], [], [], 0.0
    for k in range(3):
        if k:
            p += 4.0
        weight = p / (p + 1.0)
        x, p = x + weight * (z[k] - known - x), (1.0 - weight) * p
        x, known = x - fed[k], known + fed[k]
        variances.append(p)
        estimates.append(x)
        told.append(known)
    unit = np.tile(np.eye(n), (3, 1, 1))

    def at_bias(values: Array, matrix: bool = False) -> Array:
        out = np.zeros((3, n, n)) if matrix else np.zeros((3, n))
        out[(slice(None), 12, 12) if matrix else (slice(None), 12)] = values
        return out

    history = History(
        np.array([3.0, 4.0, 6.0]), unit, at_bias(np.array([0.0, 4.0, 4.0]), True), at_bias(np.array(variances), True),
        at_bias(np.array(estimates)), at_bias(fed), unit, unit, NavState(**states(3)), at_bias(np.array(told)),
    )  # fmt: skip
    found = smooth(MODEL, history, WGS84, "own")
    np.testing.assert_allclose(found.parameters["b bias"][:, 0], batch, rtol=1e-9)
    np.testing.assert_allclose(found.sigma[:, 12], np.sqrt(np.diag(spread)), rtol=1e-9)
    assert (found.time.tolist(), found.solution.algorithm) == ([3.0, 4.0, 6.0], "own")
    assert isinstance(found, Smoothed)


def test_true_parameters_are_taken_at_the_epochs() -> None:
    """What changes is interpolated between the readings; what the model lacks is left out."""
    sensor: Any = SimpleNamespace(
        time=np.array([0.0, 10.0]),
        parameters={"b bias": np.array([[1.0], [3.0]]), "b scale": np.array([7.0]), "c bias": np.array([9.0])},
    )
    inertial = {"gyro bias": np.array([1.0, 2.0, 3.0]), "accelerometer bias": np.array([4.0, 5.0, 6.0])}
    found = _true_parameters(inertial, (sensor,), np.array([2.5, 5.0, 20.0]), MODEL)
    assert set(found) == {"gyro bias", "b bias"}
    np.testing.assert_allclose(found["b bias"], [[1.5], [2.0], [3.0]])
    np.testing.assert_array_equal(found["gyro bias"], [1.0, 2.0, 3.0])


def test_errors_of_an_aided_solution() -> None:
    """By block and by row, against a motion that the solution misses by X, and by twice that in its last row."""
    own = solution(3, X)
    last = states(1, 2.0 * X)
    for name, value in last.items():
        getattr(own, name)[2] = value[0]
    motion: Any = SimpleNamespace(ellipsoid=WGS84, state=lambda time: NavState(**states(len(time))))
    estimated: Any = SimpleNamespace(
        solution=own, time=own.time, model=MODEL,
        parameters={"gyro bias": np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]]),
                    "b bias": np.array([[1.0], [2.0], [4.0]])},
    )  # fmt: skip
    parameters = {"gyro bias": np.array([10.0, 20.0, 30.0]), "b bias": np.array([[5.0], [7.0], [11.0]])}
    aided = Aided((), estimated, parameters, motion, None, None, np.zeros((0, 13)), 9.0)
    scale = np.array([1.0, 1.0, 2.0])[:, None]
    whole = np.hstack([scale * X, [[9, 18, 27], [6, 15, 24], [3, 12, 21]], [[4], [5], [7]]])
    np.testing.assert_allclose(aided.state_errors, whole, rtol=1e-4, atol=1e-7)
    rows = np.array([2, 0])
    np.testing.assert_allclose(aided.state_errors_at(rows), whole[rows], rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(aided.block_error("velocity", slice(1, 3)), whole[1:, 3:6], rtol=1e-4)
    np.testing.assert_allclose(aided.block_error("attitude"), whole[:, 6:9], rtol=1e-3)
    np.testing.assert_allclose(aided.block_error("position", np.array([-1])), whole[2:, :3], rtol=1e-4)
    np.testing.assert_array_equal(aided.block_error("b bias", rows), [[7.0], [4.0]])
    assert isinstance(aided.error, NavError)
    np.testing.assert_array_equal(aided.error_at(slice(1, None)).time, [1.0, 2.0])
    assert aided.true_parameters_known
    (block,) = aided.error_blocks()
    np.testing.assert_array_equal(block.position_ned, aided.error.position_ned)


def test_readings_after_the_start_and_their_noise() -> None:
    time = np.array([4.0, 5.0, 5.5])
    m = Measurements("baro-height", time, time + 0.1, np.array([[1.0], [2.0], [3.0]]), np.array([[4.0], [5.0], [6.0]]),
                     correlation=np.ones((3, 1, 1)))  # fmt: skip
    found = _after(m, 5.0)
    assert (found.time.tolist(), found.arrival.tolist()) == ([5.5], [5.6])
    assert (found.value.tolist(), found.sigma.tolist()) == ([[3.0]], [[6.0]])
    assert found.correlation is not None
    assert len(found.correlation) == 1
    assert _after(m, 3.9) is m
    assert with_noise_factor(m, 1.0) is m
    assert with_noise_factor(m, 2.5).sigma.tolist() == [[10.0], [12.5], [15.0]]


def test_remarks_and_late_readings() -> None:
    assert neglected(MODEL) == []
    told = replace(MODEL, untold=("scale factors of the gyros", "faults of the sensors"))
    assert neglected(told) == [
        "The inertial sensors have errors that no state of the filter describes: scale factors of the gyros, faults of "
        "the sensors."
    ]
    time = np.array([1.0, 2.0, 3.0, 3.9])
    m = Measurements("baro-height", time, time + np.array([9.0, 0.5, 1.0, 0.5]),
                     np.array([[np.nan], [2.0], [3.0], [4.0]]), np.ones((4, 1)), name="b")  # fmt: skip
    edges = np.arange(0.0, 4.05, 0.1)
    imu = ImuData(edges, np.zeros((40, 3)), np.zeros((40, 3)))
    (readings,), _ = take_in([m], MODEL, edges, 1.0)
    assert _too_late(readings, imu) == 1  # the first, later still, cannot be used anyway


def test_a_given_initial_covariance() -> None:
    given = np.diag(np.arange(1.0, 11.0))
    given[0, 9] = given[9, 0] = 0.5
    found = _initial_covariance(MODEL, given)
    np.testing.assert_array_equal(found[:10, :10], given)
    np.testing.assert_allclose(found[10:, 10:], np.diag([0.01, 0.01, 9.0]))
    assert not found[:10, 10:].any()
    np.testing.assert_allclose(_initial_covariance(MODEL, None), np.diag(MODEL.sigma**2))
    for wrong in (np.eye(8), np.eye(14), np.ones((9, 10))):
        with pytest.raises(InputError, match=r"it must be that of the first 9 to 13 states"):
            _initial_covariance(MODEL, wrong)
    for wrong in (np.diag([1.0] * 8 + [-1.0]), np.eye(9) + np.eye(9, k=1), np.full((9, 9), np.nan)):
        with pytest.raises(InputError, match="finite, symmetric and positive semi-definite"):
            _initial_covariance(MODEL, wrong)


def test_the_start_after_an_alignment_at_rest() -> None:
    """At the end of 40 s, with the filter's own biases held in the mean: their σ tilts the block by σ/g."""
    q_nb = TRUE.as_quat(scalar_first=True)
    imu = Parked(LATITUDE, LONGITUDE, HEIGHT, q_nb, 60.0).increments(5.0)
    gyro = TriadErrors(bias=np.full(3, 1e-8), bias_temperature=np.full(3, 1e-9), ramp=np.full(3, 1e-12), flicker=1e-9,
                       random_walk=1e-8)  # fmt: skip
    sigma = ImuErrors(gyro, TriadErrors(bias=np.array([1e-3, 2e-3, 3e-3]), random_walk=1e-6))
    model = error_model(sigma, position=(3.0, 4.0, 5.0), velocity=0.02, extra=[Block("baro bias", [7.0])])
    place = NavState(
        np.asarray(LATITUDE), np.asarray(LONGITUDE), np.asarray(HEIGHT), np.ones(3), np.array([1.0, 0, 0, 0])
    )
    start = at_rest(imu, place, model, sigma, 200)
    assert (start.imu.time[0], start.imu.time[-1], len(start.imu)) == (40.0, 60.0, 100)
    np.testing.assert_array_equal(start.imu.dvel, imu.dvel[200:])
    assert (Rotation.from_quat(start.state.q_nb, scalar_first=True) * TRUE.inv()).magnitude() < 1e-8
    assert (start.state.latitude, start.state.longitude, start.state.height) == (LATITUDE, LONGITUDE, HEIGHT)
    assert not start.state.velocity_ned.any()
    assert start.covariance is not None
    np.testing.assert_allclose(np.diag(start.covariance)[:6], [9.0, 16.0, 25.0, *[4e-4] * 3], rtol=1e-9)
    np.testing.assert_allclose(np.diag(start.covariance)[9:], model.sigma[9:] ** 2, rtol=1e-9)
    # g φ_E = −δf_N and g φ_N = δf_E of the accelerometers' errors in north and east
    c = TRUE.as_matrix()
    expected = np.vstack([c[1], -c[0]]) @ np.diag([1e-6, 4e-6, 9e-6]) / 9.81
    np.testing.assert_allclose(start.covariance[6:8, 12:15], expected, rtol=2e-3)
    held = _as_bias(gyro, "gyro", model, 40.0)
    np.testing.assert_array_equal(held.bias, model.sigma[9:12])
    assert not held.bias_temperature.any()
    assert not held.ramp.any()
    assert (held.flicker, held.random_walk) == (0.0, 1e-8)
    assert _as_bias(gyro, "other", model, 40.0) is gyro
