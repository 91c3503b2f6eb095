"""The sum of the sources' shares is the covariance of all of them together, to 1e-9."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget.covariance_propagation import CORE, Vertical, _with_loop
from sinssim.analyses.error_budget.source_propagation import GaussMarkov, NavigationStep, Propagation, Reading, Walk
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation.error_dynamics import NominalMotion

N, M = 5, 4
SIGMA = np.array([1.0, 2.0, 0.5, 3.0])


def test_the_sum_of_the_sources_is_the_whole() -> None:
    """One joint state holds the core, all constants and all processes; its covariance takes the same steps."""
    rng = np.random.default_rng(4)
    shares = Propagation.start(N, M, ["one", "two"])
    shares.sensitivity[:, 3] = rng.normal(size=N)
    markov, walk = GaussMarkov(5.0), Walk()
    shares.add("markov", markov, np.array([0.3, 0.4, 0.5]), 0)
    shares.add("walk", walk, np.array([0.2, 0.2, 0.2]), 1)
    shares.add("sensor", GaussMarkov(2.0), np.array([0.7]), None)

    # joint state: core, constants, markov (3), walk (3), sensor (1)
    size = N + M + 7
    start = np.zeros((size, size))
    start[N : N + M, N : N + M] = np.diag(SIGMA**2)
    start[N + M : N + M + 3, N + M : N + M + 3] = np.diag([0.09, 0.16, 0.25])
    start[-1, -1] = 0.49
    move = np.eye(size)
    move[:N, N + 3] = shares.sensitivity[:, 3]
    joint = move @ start @ move.T

    for k in range(12):
        interval = float(rng.uniform(0.1, 1.0))
        phi = np.eye(N) + 0.3 * rng.normal(size=(N, N))
        constants, gyro, accel = (rng.normal(size=(N, c)) for c in (M, 3, 3))
        roots = [rng.normal(size=(N, 2)) for _ in range(2)]
        noise = {"one": roots[0] @ roots[0].T, "two": roots[1] @ roots[1].T}
        shares.step(NavigationStep(phi, constants, noise, (gyro, accel), interval))

        move, drive = np.eye(size), np.zeros((size, 10))
        move[:N, :N], move[:N, N : N + M] = phi, constants
        for first, bias, process, sigma, column in (
            (N + M, gyro, markov, (0.3, 0.4, 0.5), 0), (N + M + 3, accel, walk, (0.2,) * 3, 3)
        ):  # fmt: skip
            step = process.step(interval)
            for axis in range(3):
                move[:N, first + axis] = bias[:, axis] * step.mean_of_state[0]
                move[first + axis, first + axis] = step.keep[0, 0]
                for q in range(len(step.mean_of_fresh)):
                    number = column + len(step.mean_of_fresh) * axis + q
                    drive[:N, number] = sigma[axis] * bias[:, axis] * step.mean_of_fresh[q]
                    drive[first + axis, number] = sigma[axis] * step.fresh[0, q]
        of_sensor = GaussMarkov(2.0).step(interval)
        move[-1, -1], drive[-1, 9] = of_sensor.keep[0, 0], 0.7 * of_sensor.fresh[0, 0]
        joint = move @ joint @ move.T + drive @ drive.T
        joint[:N, :N] += noise["one"] + noise["two"]

        if k % 3 == 0:
            gain, core, h_theta, h_y = (rng.normal(size=s) for s in ((N, 2), (2, N), (2, M), (2, 1)))
            variance = {"two": np.array([0.5, 0.2])}
            shares.read(Reading(gain, core, h_theta, {"sensor": h_y}, variance))
            move = np.eye(size)
            move[:N, :N] += gain @ core
            move[:N, N : N + M], move[:N, -1:] = gain @ h_theta, gain @ h_y
            joint = move @ joint @ move.T
            joint[:N, :N] += (gain * variance["two"]) @ gain.T
        if k == 7:
            turn = rng.normal(size=(N, N))
            shares.map(turn)
            move = np.eye(size)
            move[:N, :N] = turn
            joint = move @ joint @ move.T

    parts = [np.outer(s := shares.sensitivity[:, j] * SIGMA[j], s) for j in range(M)]
    total = sum(parts) + sum(shares.covariances(N).values())
    assert total == pytest.approx(joint[:N, :N], rel=1e-9, abs=1e-9 * np.abs(joint[:N, :N]).max())


def test_a_copy_continues_by_itself() -> None:
    one = Propagation.start(N, M, ["white"])
    one.add("markov", GaussMarkov(5.0), np.ones(3), 0)
    other = one.copy()
    bias = np.ones((N, 3))
    other.step(NavigationStep(np.eye(N), np.ones((N, M)), {"white": np.eye(N)}, (bias, bias), 1.0))
    assert not one.sensitivity.any()
    assert not one.covariance.any()
    assert not one.covariances(N)["markov"].any()
    assert other.covariances(N)["markov"].any()


def test_the_gains_of_the_vertical_loop() -> None:
    """3/τ, 3/τ² + 2 g/R and 1/τ³ of 1000 s, on height, velocity and integral; at 45° the gravity is 9.806199 m/s² and
    the radius across the meridian 6 388 838.3 m. With an altimeter they act on what is held, with the loop closed."""
    at = np.full(2, np.pi / 4.0)
    none: Any = None
    nominal = NominalMotion(at, np.zeros(2), none, none, none, none, none)
    motion: Any = SimpleNamespace(trajectory=SimpleNamespace(ellipsoid=WGS84), gravity="normal")
    gains = [3e-3, 3e-6 + 2.0 * 9.806199 / 6_388_838.3, 1e-9]
    f = np.arange(2.0 * CORE**2).reshape(2, CORE, CORE)
    exact = _with_loop(f, nominal, Vertical("baro-loop", 1000.0, None), motion, np.zeros(2, bool))
    np.testing.assert_allclose([f[0, 2, 2] - exact[0, 2, 2], f[0, 5, 2] - exact[0, 5, 2]], gains[:2], rtol=1e-6)
    assert -exact[0, CORE, 2] == pytest.approx(gains[2], rel=1e-12)
    assert (exact[0, 5, CORE], exact[0, 5, CORE + 1]) == (1.0, 0.0)
    read = _with_loop(f, nominal, Vertical("baro-loop", 1000.0, none or object()), motion, np.array([False, True]))  # type: ignore[arg-type]
    np.testing.assert_allclose(read[0, (2, 5, CORE), CORE + 1], gains, rtol=1e-6)
    assert not read[1, (2, 5, CORE), CORE + 1].any()
    np.testing.assert_array_equal(read[:, :CORE, :CORE], f)
    free = _with_loop(f, nominal, Vertical("free", 1000.0, None), motion, np.zeros(2, bool))
    assert not free[:, CORE:].any()
    assert not free[:, :, CORE:].any()
