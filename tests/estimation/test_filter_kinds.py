"""Kinds of filters: errors of any size against inertial navigation, the group's exponential, agreement where linear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import InputError
from sinssim.estimation import SHIPPED, Block, error_model
from sinssim.estimation.error_dynamics import driving_noise
from sinssim.estimation.estimate import estimate
from sinssim.estimation.linearisation import Linearisation, Surroundings, linearise
from sinssim.estimation.measurement_epochs import take_in
from sinssim.estimation.unscented_cubature_ensemble import by_group, filter_of
from sinssim.sensors import ImuErrors
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.measurement_kind import CORE
from sinssim.strapdown.navigate import Segments, navigate
from tests.estimation.made import reading
from tests.estimation.worlds import biases_only, errors_of, one_run, positions, velocities, weaving
from tests.slow import slow

SIGMA = biases_only("laser-navigation")
SMALL = error_model(SIGMA, position=5.0, velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))


def segment(
    seconds: float, axes: str = "north", lever_arm: tuple[float, ...] = (0.0, 0.0, 0.0), extra: tuple[Block, ...] = ()
) -> Linearisation:
    """Return a segment of the weaving flight by perfect sensors, a tenth of a second between epochs, with fixes."""
    flight, ideal = weaving(60.0, 100.0)
    time, rng = np.arange(1.0, seconds + 0.5), np.random.default_rng(4)
    given = [replace(of, lever_arm=np.array(lever_arm)) for of in (positions(flight, time, rng),
                                                                  velocities(flight, time, rng))]  # fmt: skip
    model = replace(SMALL, axes=axes, blocks=(*SMALL.blocks, *extra))
    engine = Segments(ideal)
    readings, epochs = take_in(given, model, engine.time, 10.0)
    around = Surroundings(model, driving_noise(model), epochs, readings, MeanGyroRates(ideal), "normal", WGS84, False)
    last = round(10.0 * seconds)
    nominal = navigate(ideal, flight.state(0.0))
    parameters = {block.name: np.zeros(block.size) for block in model.blocks[3:]}
    return linearise(around, 0, last, nominal, ImuErrors(), parameters)


@pytest.mark.parametrize("axes", ["north", "transported"])
def test_errors_of_any_size_move_as_another_navigation_does(axes: str) -> None:
    """The state that is true with a heading error of 30°, a kilometre and 20 m/s is navigated by its true sensors."""
    _, ideal = weaving(60.0, 100.0)
    model, line = replace(SMALL, axes=axes), segment(20.0, axes)
    error = np.zeros((1, model.size))
    error[0, :CORE] = [1000.0, -700.0, 300.0, 20.0, -10.0, 5.0, 0.05, -0.08, 0.5]
    error[0, model.slices["gyro bias"]], error[0, model.slices["accelerometer bias"]] = (1e-4, -2e-4, 3e-4), 0.02
    motion = line.motion()
    start = NavState(*(np.atleast_1d(part)[0] for part in vars(motion.states(0, error)).values()))
    off_gyro, off_accel = (error[0, model.slices[f"{triad} bias"]] for triad in ("gyro", "accelerometer"))
    interval = np.diff(ideal.time)[:, None]
    true = navigate(
        replace(ideal, dtheta=ideal.dtheta - off_gyro * interval, dvel=ideal.dvel - off_accel * interval), start
    )
    moved = error
    for k in range(1, 201):
        moved = motion.moved(k, moved)
    got, want = motion.states(200, moved), true.state(slice(2000, 2001))
    places = [geodetic_to_ecef(of.latitude, of.longitude, of.height) for of in (got, want)]
    turn = rotation.multiply(got.q_nb, rotation.conjugate(want.q_nb))
    # the biases are taken in the axes at the start of each interval, in which the body turns by some 0.02 rad
    assert np.linalg.norm(places[0] - places[1]) < 0.03
    np.testing.assert_allclose(got.velocity_ned, want.velocity_ned, rtol=0, atol=3e-3)
    assert np.linalg.norm(rotation.rotation_vector_from_quaternion(turn)) < 1e-7


@pytest.mark.parametrize("axes", ["north", "transported"])
def test_small_errors_move_by_the_transition_and_are_seen_by_h(axes: str) -> None:
    """Differences of a centimetre, a millimetre a second and a microradian against Φ and H, lever arm and all."""
    gravity = Block("gravity disturbance", 3e-4, correlation_distance=20e3)
    line = segment(3.0, axes, (2.0, -1.0, 3.0), (gravity,))
    n, motion = line.phi.shape[1], line.motion()
    step = np.where(np.arange(n) < 3, 1e-2, np.where(np.arange(n) < 6, 1e-3, 1e-6))
    step[CORE:] = 1e-6
    for k in (1, 17, 30):
        by_points = (motion.moved(k, np.diag(step)) - motion.moved(k, -np.diag(step))).T / (2.0 * step)
        scaled = np.abs(by_points - line.phi[k]) * step / step[:, None]
        assert scaled[:CORE].max() < 3e-4  # of a step: the mean over an interval against its two ends
        np.testing.assert_allclose(by_points[CORE:], line.phi[k][CORE:], atol=1e-9)
    for observed in line.observed[10]:
        seen = -(observed.residuals(np.diag(step)) - observed.residuals(-np.diag(step))).T / (2.0 * step)
        np.testing.assert_allclose(seen, observed.h, atol=2e-4 * np.abs(observed.h).max())
        np.testing.assert_allclose(observed.residuals(np.zeros((1, n)))[0], observed.residual)


def test_the_correction_by_the_group_is_its_exponential() -> None:
    """Against the exponential of the 5 × 5 matrix [φ× v r; 0] by scipy, for a turn of 2.4 rad and a tiny one."""
    for size in (1.0, 1e-6):
        error = np.array([100.0, -50.0, 20.0, 3.0, -4.0, 5.0, *(size * np.array([0.9, -1.2, 1.9])), 7.0])
        twist = np.zeros((5, 5))
        twist[:3, :3] = np.cross(np.eye(3), error[6:9])  # [φ×]
        twist[:3, 3], twist[:3, 4] = error[3:6], error[:3]
        whole = scipy.linalg.expm(twist)
        subtracted, matrix = by_group(error)
        np.testing.assert_allclose(subtracted[3:6], whole[:3, 3], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(subtracted[:3], whole[:3, 4], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(subtracted[6:], error[6:])
        for part in (slice(0, 3), slice(3, 6), slice(6, 9)):
            np.testing.assert_allclose(matrix[part, part], whole[:3, :3], atol=1e-12)
        assert matrix[9, 9] == 1.0
        assert np.count_nonzero(matrix) == 28


@pytest.mark.parametrize("kind", SHIPPED)
def test_one_linear_update_is_that_of_every_kind(kind: str) -> None:
    """Of linear readings each kind has the conditional moments: mean and covariance of a normal distribution."""
    rng = np.random.default_rng(8)
    root = rng.standard_normal((5, 5)) * np.array([1e3, 1.0, 1e-3, 1.0, 1.0])[:, None]
    root[:, 4] = root[4] = 0.0  # a state that is known
    p, h, r = root @ root.T, rng.standard_normal((2, 5)) / 30.0, np.array([[2.0, 0.6], [0.6, 0.5]])
    h[:, 2] *= 1e4
    z = np.array([3.0, -4.0])
    s = h @ p @ h.T + r
    gain = p @ h.T @ np.linalg.inv(s)
    one = filter_of(kind, p, 5)
    np.testing.assert_allclose(one.covariance, p, rtol=1e-9, atol=1e-12)
    innovation = one.innovation(reading(z, h), r)
    np.testing.assert_allclose(innovation.value, z, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(innovation.covariance, s, rtol=1e-9)
    other = one.copy()
    one.update(reading(z, h), r)
    np.testing.assert_allclose(one.x, gain @ z, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(one.covariance, p - gain @ s @ gain.T, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(one.gain, gain, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(other.covariance, p, rtol=1e-9, atol=1e-12)  # a branch goes on by itself


@pytest.mark.parametrize("kind", ["cubature", "unscented", "ensemble"])
def test_small_errors_are_predicted_as_by_the_transition(kind: str) -> None:
    """Mean and covariance by points and by Φ and Q: Q is added exactly, also by members that are drawn."""
    line = segment(2.0)
    p = np.diag(np.where(np.arange(line.phi.shape[1]) < CORE, SMALL.sigma, SMALL.sigma)) ** 2
    one, linear = filter_of(kind, p, 2), filter_of("error-state", p, 0)
    for k in range(1, 6):
        one.predict_along(line, k)
        linear.predict_along(line, k)
    sigma = np.sqrt(linear.covariance.diagonal())
    assert (np.abs(one.covariance - linear.covariance) / np.outer(sigma, sigma)).max() < 2e-4
    assert (np.abs(one.x) / sigma).max() < 2e-4


def aided(kind: str, heading: float, gate: float | None = None) -> tuple[Array, Array]:
    """Return heading errors and 1σ of a filter that begins with a heading error, rad, of its σ or a little less."""
    flight, ideal = weaving(60.0, 20.0)
    model = error_model(SIGMA, position=2.0, velocity=0.1, attitude=(1e-3, 1e-3, heading))
    constants = np.zeros(model.size)
    constants[8] = 0.9
    run, rng = one_run(flight, ideal, model, SIGMA, 0, constants), np.random.default_rng(3)
    time = np.arange(1.0, 60.5)
    given = [positions(flight, time, rng), velocities(flight, time, rng)]
    result = estimate(run.imu, run.initial, given, model, rate_hz=2.0, kind=kind, gate=gate)
    return errors_of(model, result, flight, run)[:, 8], result.sigma[:, 8]


@pytest.mark.parametrize("kind", ["invariant", "cubature", "ensemble", *slow("unscented")])
def test_kinds_agree_where_errors_are_small(kind: str) -> None:
    """The spread of an invariant filter, of points and of members is that of the covariance."""
    (error, sigma), (other, spread) = aided("error-state", 1e-3), aided(kind, 1e-3)
    np.testing.assert_allclose(spread, sigma, rtol=0.01)
    assert np.abs(other - error).max() < 0.03 * sigma[0]


@pytest.mark.parametrize("kind", ["invariant", "unscented", "ensemble"])
def test_a_large_heading_error_is_estimated_in_turns(kind: str) -> None:
    """100° of heading, 1σ 110°."""
    error, sigma = aided(kind, np.radians(110.0), gate=1e-4)
    assert abs(error[-1]) < 4.0 * sigma[-1] < np.radians(2.0)


def test_what_a_kind_cannot_is_refused() -> None:
    flight, ideal = weaving(60.0, 20.0)
    rest = (ideal, flight.state(0.0), [], SMALL)
    with pytest.raises(InputError, match='kind = "invariant" feeds back after each reading; it needs loop = "closed"'):
        estimate(*rest, kind="invariant", loop="open")
    with pytest.raises(InputError, match="smooth: the filter cubature has no smoother; error-state and invariant"):
        estimate(*rest, kind="cubature", smooth=True)
    with pytest.raises(InputError, match="kind"):
        estimate(*rest, kind="extended")
    assert len(filter_of("ensemble", np.eye(99), 0).x) == 99  # members and noise are orthogonal: 1 + 99 + 99 columns
    with pytest.raises(InputError, match="200 members are too few for 100 states; an ensemble has fewer than 100"):
        filter_of("ensemble", np.eye(100), 0)
