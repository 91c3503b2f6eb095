"""The judgement with the truth on histories of a few rows: statistics, limits and sentences by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import Array
from sinssim.estimation import Block, ErrorModel, consistency
from sinssim.estimation.consistency import ALL, _between_edges, _noise, actual_consistency
from sinssim.estimation.filter_result import History
from tests.estimation.made import MODEL, history

A, V = slice(6, 9), slice(3, 6)
TIME = np.array([3.0, 5.0, 7.0, 9.0, 11.0])


def noisy(attitude: float = 1e-10, velocity: float = 1e-6) -> Array:
    """Q of five rows; that of the second and the fourth interval is three times that of the others."""
    q = np.zeros((5, 9, 9))
    for row, factor in enumerate((7.0, 1.0, 3.0, 1.0, 3.0)):
        q[row, A, A], q[row, V, V] = factor * attitude * np.eye(3), factor * velocity * np.eye(3)
    return q


def carried(w: Array, start: Array, fed: Array) -> tuple[History, Array]:
    """Return rows with a coupled transition, and errors with the noise w from row to row."""
    phi = np.tile(np.eye(9), (5, 1, 1))
    phi[:, V, A], phi[:, :3, V] = 0.5 * np.eye(3), 2.0 * np.eye(3)
    errors = [start]
    for k in range(1, 5):
        errors.append(phi[k] @ errors[-1] - fed[k] + w[k - 1])
    return history(TIME, transition=phi, noise=noisy(), fed_back=fed), np.array(errors)


def test_differences_of_neighbouring_noises_over_both_variances() -> None:
    """Gyros: (2, −4, 4)e-5 and (0, 2, 0)e-5 over (1 + 3)e-10: 9 and 1, over six numbers. Accelerometers likewise."""
    w, fed = np.zeros((4, 9)), np.zeros((5, 9))
    lasting = np.array([3e-5, -2e-5, 1e-5])
    for k, (gyro, accel) in enumerate(
        (((0, 0, 0), (0, 0, 0)), ((2, -4, 4), (6, 0, 8)), ((1, 1, 1), (0, 0, 0)), ((1, 3, 1), (0, 0, 2)))
    ):
        w[k, A] = 1e-5 * np.array(gyro) + lasting  # an error without a state, the same in each interval
        w[k, V] = 1e-3 * np.array(accel)
    fed[2, :3], fed[3, V] = 5.0, 0.7  # feedback is no noise
    found = actual_consistency(MODEL, *carried(w, np.full(9, 1e-4), fed))
    for name, value in (("gyro noise", 10.0 / 6.0), ("accelerometer noise", (25.0 + 1.0) / 6.0)):
        test, verdict = found.noise[name]
        assert test.value == pytest.approx(value, rel=1e-9)
        assert (test.lower, test.upper) == pytest.approx(tuple(chi2.ppf((0.025, 0.975), 6) / 6.0))
        assert test.probability == pytest.approx(2.0 * chi2.sf(6.0 * value, 6), rel=1e-9)
        assert verdict == "consistent"
    assert list(found.noise) == ["gyro noise", "accelerometer noise"]


def test_rounding_of_pulses_and_instabilities() -> None:
    """Pulses of √6·1e-5 rad add 1e-10 to each interval: the gyros' squares are halved and a third, 9·4/6."""
    blocks = (*MODEL.blocks, Block("gyro instability", 1e-6, correlation_time=100.0))
    model = ErrorModel(blocks, 1e-4, 1e-3, np.sqrt(6.0) * 1e-5, np.sqrt(6.0) * 2e-3)
    n, rows = 12, np.array([1.0, 2.0, 4.0])
    q = np.zeros((3, n, n))
    for row, factor in enumerate((9.0, 1.0, 3.0)):
        q[row, A, A], q[row, V, V], q[row, 9:, 9:] = (factor * size * np.eye(3) for size in (1e-10, 1e-6, 1e-14))
    errors = np.zeros((3, n))
    errors[2] = np.r_[np.zeros(3), 0.0, 6e-3, 0.0, 2e-5, -4e-5, 4e-5, 0.0, 0.0, 4e-7]
    unit, none = np.tile(np.eye(n), (3, 1, 1)), np.zeros((3, n))
    made = History(rows, unit, q, unit, none, none, 0.0 * unit, unit, history(rows).navigation, none)
    found = {name: test.value for name, (test, _) in actual_consistency(model, made, errors).noise.items()}
    assert found == {
        "gyro noise": pytest.approx(36.0 / (4.0 + 2.0) / 3.0),
        "accelerometer noise": pytest.approx(36.0 / (4.0 + 8.0) / 3.0),
        "gyro instability": pytest.approx(16.0 / 4.0 / 3.0),
    }


@pytest.mark.parametrize(("share", "there"), [(1.01, True), (0.99, False)])
@pytest.mark.parametrize("what", ["tilt", "composed"])
def test_rows_whose_second_order_is_a_third_of_their_noise_do_not_count(what: str, share: float, there: bool) -> None:
    """½ g θ² T of a tilt θ = 0.01 over 2 s, and ½ |θ||δ| of a correction δ = 0.02: 0.3 σ of the noise at most."""
    velocity = (0.5 * 9.80665 * 0.01**2 * 2.0 / 0.3) ** 2 * share if what == "tilt" else 1.0
    attitude = (0.5 * 0.01 * 0.02 / 0.3) ** 2 * share if what == "composed" else 1.0
    errors, fed = np.zeros((5, 9)), np.zeros((5, 9))
    errors[:, A] = 0.01 * np.array([0.6, 0.0, -0.8])
    fed[1:, A] = 0.02 * np.array([0.0, 0.6, 0.8])
    model = ErrorModel(MODEL.blocks, 1e-4, 1e-3)
    made = history(TIME, noise=noisy(attitude, velocity), fed_back=fed)
    assert set(actual_consistency(model, made, errors).noise) == (
        {"gyro noise", "accelerometer noise"} if there else set()
    )


@pytest.mark.parametrize(("share", "there"), [(1.05, True), (0.95, False)])
def test_a_noise_is_tested_where_the_sensor_has_some(share: float, there: bool) -> None:
    """1e-9 of the variance, over 2 s."""
    model = ErrorModel(MODEL.blocks, float(np.sqrt(share * 1e-9 * 1e-10 / 2.0)), 0.0)
    q = noisy()
    q[1:, A, A] = 1e-10 * np.eye(3)
    found = actual_consistency(model, history(TIME, noise=q), np.zeros((5, 9)))
    assert set(found.noise) == ({"gyro noise"} if there else set())


def test_rows_between_two_ends_are_joined() -> None:
    """Rows 1, 3 and 4 lie within samples: Φ, Q and feedback are carried to the next end."""
    rng = np.random.default_rng(5)
    phi, root, fed = rng.normal(size=(6, 9, 9)), rng.normal(size=(6, 9, 9)), rng.normal(size=(6, 9))
    q, errors = root @ root.transpose(0, 2, 1), rng.normal(size=(6, 9))
    edge = np.array([True, False, True, False, False, True])
    time = np.array([1.0, 1.5, 2.0, 2.4, 2.7, 3.0])
    made = history(time, transition=phi, noise=q, fed_back=fed, on_edge=edge)
    found = _between_edges(made, errors)
    np.testing.assert_array_equal(found[0], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found[1], errors[[0, 2, 5]])
    p = phi
    np.testing.assert_allclose(found[2], [p[2] @ p[1], p[5] @ p[4] @ p[3]], rtol=1e-12)
    first = q[2] + p[2] @ q[1] @ p[2].T
    second = q[5] + p[5] @ q[4] @ p[5].T + p[5] @ p[4] @ q[3] @ p[4].T @ p[5].T
    np.testing.assert_allclose(found[3], [first, second], rtol=1e-10)
    np.testing.assert_allclose(
        found[4], [fed[2] + p[2] @ fed[1], fed[5] + p[5] @ fed[4] + p[5] @ p[4] @ fed[3]], rtol=1e-12
    )


@pytest.mark.parametrize(("size", "verdict"), [(3.0, "optimistic"), (0.2, "pessimistic")])
def test_what_is_said_of_a_wrong_noise(size: float, verdict: str) -> None:
    """Fifteen pairs whose differences have three, or a fifth, of the assumed σ, on each axis alike."""
    time = 2.0 * np.arange(31.0)
    q = np.zeros((31, 9, 9))
    q[:, A, A], q[:, V, V] = 1e-10 * np.eye(3), 1e-6 * np.eye(3)
    errors = np.zeros((31, 9))
    # the noise of every second interval is d
    errors[2:, A] = size * np.sqrt(2e-10) * np.repeat(np.arange(1.0, 16.0), 2)[:29, None]
    errors[2:, V] = np.sqrt(2e-6) * np.repeat(np.arange(1.0, 16.0), 2)[:29, None]
    covariance = np.tile(1e8 * np.eye(9), (31, 1, 1))
    found = actual_consistency(MODEL, history(time, noise=q, covariance=covariance), errors)
    low, high = np.sqrt(chi2.ppf((0.025, 0.975), 45) / 45.0)
    assert found.noise["gyro noise"].verdict == verdict
    assert found.noise["accelerometer noise"].verdict == "consistent"
    assert found.sentences == (
        f"gyro noise: {verdict}, the noise is {size:.3g} times the assumed noise (95 % band {low:.3g} … {high:.3g}).",
    )


@pytest.mark.parametrize(("value", "wrong"), [(1.1, False), (0.9, False), (1.15, True), (0.85, True)])
def test_a_tenth_of_a_variance_does_not_matter(value: float, wrong: bool) -> None:
    """10 000 pairs of three numbers tell a variance to 0.8 %."""
    rows = 20_001
    time = np.arange(float(rows))
    q = np.broadcast_to(np.diag(np.repeat([0.0, 1e-6, 1e-10], 3)), (rows, 9, 9))
    errors = np.zeros((rows, 9))
    steps = np.tile([0.0, 1.0, 0.0, -1.0], rows // 4)
    errors[1:, A] = np.cumsum(steps)[:, None] * np.sqrt(value * 2e-10)
    errors[1:, V] = np.cumsum(steps)[:, None] * np.sqrt(2e-6)
    unit = np.broadcast_to(np.eye(9), (rows, 9, 9))
    none = np.zeros((rows, 9))
    made = History(time, unit, q, 1e12 * unit, none, none, unit, unit, history(np.zeros(1)).navigation, none)
    (name, (test, probability)), _ = _noise(MODEL, made, errors)
    assert (name, test.value) == ("gyro noise", pytest.approx(value, rel=1e-6))
    assert (probability < 1e-4) == wrong


@pytest.mark.parametrize(("share", "larger"), [(0.7, True), (1.4, False)])
def test_what_is_said_of_errors_larger_than_stated(share: float, larger: bool) -> None:
    """One row: χ² of three numbers at the share of 0.005/4 that four tests leave; all nine states are inconspicuous."""
    square = chi2.isf(share * 0.005 / 4.0, 3)
    errors = np.array([[0.0, 0.0, 0.0, 0.2 * np.sqrt(square), 0.0, 0.0, 0.0, 0.0, 0.0]])
    state = np.full((1, 9), 0.3)
    covariance = np.diag([4.0, 4.0, 4.0, 0.04, 0.04, 0.04, 1e-6, 1e-6, 1e-6])[None]
    found = actual_consistency(MODEL, history(np.zeros(1), covariance=covariance, state=state), errors + state)
    assert {name: test.value for name, (test, _) in found.nees.items()} == {
        ALL: pytest.approx(square / 9.0), "position": 0.0, "velocity": pytest.approx(square / 3.0), "attitude": 0.0,
    }  # fmt: skip
    assert {name: judged.verdict for name, judged in found.nees.items() if name != "velocity"} == {
        ALL: "consistent", "position": "consistent", "attitude": "consistent",
    }  # fmt: skip
    test, verdict = found.nees["velocity"]
    assert verdict == ("optimistic" if larger else "consistent")
    # the band of a weighted sum is an approximation to some per cent
    assert (test.lower, test.upper) == pytest.approx(tuple(chi2.ppf((0.025, 0.975), 3) / 3.0), rel=0.05)
    said = (
        f"velocity: the errors are larger than the filter states, NEES per state {square / 3.0:.3g} (95 % band "
        f"{test.lower:.3g} … {test.upper:.3g}).",
    )
    assert found.sentences == (said if larger else ())


def test_the_covariance_of_normalised_errors_of_several_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """E[yₖ yⱼᵀ] = Bₖ Ψₖ … Ψⱼ₊₁ Pⱼ Bⱼᵀ, and the sum of the squares, of three rows of two of nine states."""
    rng = np.random.default_rng(8)
    root, decay, e = rng.normal(size=(3, 9, 9)), rng.normal(size=(2, 9, 9)), rng.normal(size=(3, 9))
    p = root @ root.transpose(0, 2, 1) * np.outer(10.0 ** np.arange(-4, 5), 10.0 ** np.arange(-4, 5))
    states = np.array([2, 7])
    seen: list[tuple[str, float, Array]] = []
    monkeypatch.setattr(consistency, "weighted_test", lambda *given: seen.append(given))
    consistency._of_block("two", e, p, decay, np.eye(9)[states])
    ((name, square, weights),) = seen
    b = []
    for k in range(3):
        own = p[k][np.ix_(states, states)]
        whitening = np.zeros((2, 9))
        whitening[:, states] = np.linalg.inv(np.linalg.cholesky(own))
        b.append(whitening)
    lasting = {(1, 0): decay[0], (2, 1): decay[1], (2, 0): decay[1] @ decay[0]}
    together = np.eye(6)
    for (k, j), psi in lasting.items():
        block = b[k] @ psi @ p[j] @ b[j].T
        together[2 * k : 2 * k + 2, 2 * j : 2 * j + 2] = block
        together[2 * j : 2 * j + 2, 2 * k : 2 * k + 2] = block.T
    expected = np.linalg.eigvalsh(together)
    np.testing.assert_allclose(weights, expected[expected > 0.0], rtol=1e-8)
    assert name == "NEES, two"
    assert square == pytest.approx(sum(np.sum((b[k] @ e[k]) ** 2) for k in range(3)), rel=1e-9)


def test_rows_of_the_nees_are_even_and_end_with_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """At most twelve numbers: of nine states every fourth row of five, of three every second; the decay is between."""
    rng = np.random.default_rng(9)
    decay, errors, state = rng.normal(size=(5, 9, 9)), rng.normal(size=(5, 9)), rng.normal(size=(5, 9))
    made = history(TIME, decay=decay, state=state, covariance=np.tile(np.diag([1.0] * 8 + [0.0]), (5, 1, 1)))
    seen: dict[str, tuple[Array, Array, list[int]]] = {}
    monkeypatch.setattr(consistency, "_ROWS", 12)
    monkeypatch.setattr(
        consistency,
        "_of_block",
        lambda name, e, p, psi, rows: seen.update({name: (e, psi, np.nonzero(rows)[1].tolist())}),
    )
    list(consistency._nees_of_run(MODEL, made, errors))
    assert list(seen) == [ALL, "position", "velocity", "attitude"]
    e, psi, states = seen["position"]
    assert states == [0, 1, 2]
    np.testing.assert_array_equal(e, (errors - state)[[0, 2, 4]])
    np.testing.assert_allclose(psi, [decay[2] @ decay[1], decay[4] @ decay[3]])
    e, psi, states = seen[ALL]
    assert states == list(range(8))  # the last is known exactly
    np.testing.assert_array_equal(e, (errors - state)[[0, 4]])
    np.testing.assert_allclose(psi, [decay[4] @ decay[3] @ decay[2] @ decay[1]])
    assert seen["attitude"][2] == [6, 7]
