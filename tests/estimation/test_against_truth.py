"""A run judged with the truth: the band of its NEES, and the noise of the inertial sensors against what was told."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import Block, ErrorModel, error_model, nominal_errors
from sinssim.estimation.consistency import ActualConsistency, actual_consistency, consistency
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_result import History
from tests.estimation.worlds import biases_only, one_run, positions, velocities, weaving
from tests.slow import slow

CLOCKWORK = ErrorModel(
    (Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1e-3), Block("gyro bias", 1.0)), 1e-4, 1e-3
)
"""A model whose blocks a made-up linear world gives the names to."""


def made(rows: int, seed: int, p: Array, gains: Array, told: float = 1.0) -> tuple[History, Array]:
    """Return a run of a linear filter of twelve states and its errors, from a covariance on that is its own.

    Position and attitude wander and are measured, gyro bias and velocity are constant: what is known of them is known
    once and for all.
    """
    rng = np.random.default_rng([31, seed])
    n = CLOCKWORK.size
    phi, q = TRANSITION, NOISE
    x = np.linalg.cholesky(p[0]) @ rng.standard_normal(n)
    found, errors, states = np.zeros(n), [x], [np.zeros(n)]
    for gain in gains:
        x = phi @ x + told * np.sqrt(q.diagonal()) * rng.standard_normal(n)
        found = phi @ found
        z = H @ x + np.sqrt(R.diagonal()) * rng.standard_normal(len(H))
        found = found + gain @ (z - H @ found)
        errors.append(x)
        states.append(found)
    none = np.zeros((rows, n))
    transition, noise = np.tile(phi, (rows, 1, 1)), np.tile(q, (rows, 1, 1))
    still = NavState(*(np.zeros((rows, *s)) for s in ((), (), (), (3,), (4,))))
    left = np.array([np.eye(n), *((np.eye(n) - gain @ H) @ phi for gain in gains)])
    history = History(np.arange(float(rows)), transition, noise, p, np.array(states), none, none, left, still, none)
    return history, np.array(errors)


TRANSITION = np.eye(12)
TRANSITION[0:3, 3:6] = 0.05 * np.eye(3)
TRANSITION[6:9, 9:12] = 1e-5 * np.eye(3)
NOISE = np.diag(np.repeat([0.0, 1e-6, 1e-8, 0.0], 3))
H = np.vstack([np.eye(12)[0:3], np.eye(12)[6:9]])
R = np.diag(np.repeat([1.0, 1e-6], 3))


def designed(rows: int) -> tuple[Array, Array]:
    """Return the covariances after each row, and the gains, of the made-up filter."""
    p, gains = [np.diag(np.repeat([1.0, 1.0, 1e-6, 1.0], 3))], []
    for _ in range(rows - 1):
        before = TRANSITION @ p[-1] @ TRANSITION.T + NOISE
        gain = before @ H.T @ np.linalg.inv(H @ before @ H.T + R)
        p.append(before - gain @ H @ before)
        gains.append(gain)
    return np.array(p), np.array(gains)


@cache
def sound_runs(count: int) -> list[ActualConsistency]:
    """Return the judgements of runs of a right filter."""
    p, gains = designed(100)
    return [actual_consistency(CLOCKWORK, *made(100, seed, p, gains)) for seed in range(count)]


@pytest.mark.parametrize("count", [20, *slow(200)])
def test_the_band_is_that_of_the_means_of_many_runs(count: int) -> None:
    """Mean and variance of a run's NEES are what the filter itself says of them, for slow and for quick states."""
    values: dict[str, list[float]] = {}
    for found in sound_runs(count):
        for name, (test, _) in found.nees.items():
            values.setdefault(name, []).append(test.value)
    bands = {name: (test.lower, test.upper) for name, (test, _) in found.nees.items()}
    assert set(bands) == {"all states", "position", "velocity", "attitude", "gyro bias"}
    assert bands["gyro bias"][1] > 2.5  # hardly more than three numbers: the constants of one run
    assert bands["attitude"][1] < 1.6
    for name, of_runs in values.items():
        inside = np.mean([bands[name][0] < v < bands[name][1] for v in of_runs])
        assert inside == pytest.approx(0.95, abs=0.05 * np.sqrt(200 / count)), name
        assert np.mean(of_runs) == pytest.approx(1.0, abs=4.0 * np.std(of_runs) / np.sqrt(count)), name


@pytest.mark.parametrize(("count", "most"), [(20, 3), *slow((200, 8))])
def test_sound_runs_fail_as_rarely_as_said(count: int, most: int) -> None:
    """1 % of 20 are 0.2, at most 3 with a probability of 0.9999; of 200 they are 2, at most 8 with 0.9998."""
    assert sum(bool(run.sentences) for run in sound_runs(count)) <= most


@pytest.mark.parametrize(("told", "verdict"), [(1.0 / 0.3, "optimistic"), (1.0 / 3.0, "pessimistic")])
def test_noise_that_is_told_wrong_is_measured(told: float, verdict: str) -> None:
    found = actual_consistency(CLOCKWORK, *made(100, 0, *designed(100), told))
    for name in ("gyro noise", "accelerometer noise"):
        test, judged = found.noise[name]
        assert judged == verdict
        assert test.value == pytest.approx(told**2, rel=0.35)  # 4σ of 300 squares
    assert any(verdict in sentence and "times the assumed noise" in sentence for sentence in found.sentences)


def flown(inertial: float) -> tuple[bool, ActualConsistency]:
    """Return both judgements of a laser system under metre-grade fixes that is told so many times its noise."""
    flight, ideal = weaving(400.0, 20.0)
    sigma = biases_only("laser-standard")
    model = error_model(sigma, position=5.0, velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))
    run, rng = one_run(flight, ideal, model, sigma, 4), np.random.default_rng(4)
    time = np.arange(1.0, 400.5)
    given = [positions(flight, time, rng), velocities(flight, time, rng)]
    told = replace(model, gyro_noise=inertial * model.gyro_noise, accel_noise=inertial * model.accel_noise)
    result = estimate(run.imu, run.initial, given, told, rate_hz=5.0, history=True)
    truth = flight.state(result.history.time)
    errors = nominal_errors(told, result.history, truth, run.parameters, WGS84)
    return consistency(result).consistent, actual_consistency(told, result.history, errors)


def test_what_no_innovation_shows_the_truth_does() -> None:
    blind, sound = flown(1.0)
    assert blind
    assert sound.sentences == ()
    assert {name: test.value for name, (test, _) in sound.noise.items()} == pytest.approx(
        {"gyro noise": 1.0, "accelerometer noise": 1.0}, abs=0.12
    )
    blind, found = flown(3.0)
    assert blind  # drowned in the noise of the fixes
    assert {name: verdict for name, (_, verdict) in found.noise.items()} == {
        "gyro noise": "pessimistic",
        "accelerometer noise": "pessimistic",
    }
    assert len(found.sentences) == 2
