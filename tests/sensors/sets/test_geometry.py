"""Geometry of redundant sets: the bound 9/m, parity, and which faults can be told apart."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.sensors.sensor_set_section import (
    READY,
    checked_directions,
    dilution,
    estimator,
    not_isolable,
    parity_matrix,
)


def random_directions(count: int, seed: int) -> np.ndarray:
    rows = np.random.default_rng(seed).standard_normal((count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.parametrize(("name", "count"), [("cone-4", 4), ("cone-5", 5), ("dodecahedron", 6), ("skewed-triads", 6)])
def test_ready_sets_reach_the_bound(name: str, count: int) -> None:
    axes = READY[name]
    assert axes.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, rtol=1e-15)
    assert np.linalg.matrix_rank(axes) == 3
    assert np.trace(np.linalg.inv(axes.T @ axes)) == pytest.approx(9.0 / count, rel=1e-14)
    assert dilution(axes) == pytest.approx(9.0 / count, rel=1e-14)


def test_cones_and_dodecahedron_have_their_published_angles() -> None:
    """The optimum half-angle is 54.7356°, and the axes of the dodecahedron are atan 2 = 63.4349° apart."""
    for name in ("cone-4", "cone-5"):
        np.testing.assert_allclose(np.degrees(np.arccos(READY[name][:, 2])), 54.735610317, rtol=1e-10)
    angles = [np.degrees(np.arccos(abs(a @ b))) for a, b in itertools.combinations(READY["dodecahedron"], 2)]
    np.testing.assert_allclose(angles, 63.434948823, rtol=1e-10)


def test_skewed_triads_are_two_right_handed_triads_60_degrees_apart() -> None:
    first, second = READY["skewed-triads"][:3], READY["skewed-triads"][3:]
    for triad in (first, second):
        np.testing.assert_allclose(triad @ triad.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(triad) == pytest.approx(1.0)
    assert np.degrees(np.arccos(0.5 * (np.trace(second @ first.T) - 1.0))) == pytest.approx(60.0)


@pytest.mark.parametrize("count", [4, 5, 6, 9])
def test_no_set_is_better_than_the_bound(count: int) -> None:
    traces = [dilution(random_directions(count, seed)) for seed in range(200)]
    assert min(traces) > 9.0 / count


@pytest.mark.parametrize("name", [*READY, "random"])
def test_parity_has_its_defining_properties(name: str) -> None:
    axes = READY.get(name, random_directions(7, 3))
    count, v = len(axes), parity_matrix(axes)
    assert v.shape == (count - 3, count)
    np.testing.assert_allclose(v @ axes, 0.0, atol=1e-15)
    np.testing.assert_allclose(v @ v.T, np.eye(count - 3), atol=1e-14)
    projection = np.eye(count) - axes @ np.linalg.inv(axes.T @ axes) @ axes.T
    np.testing.assert_allclose(v.T @ v, projection, atol=1e-14)


def test_the_estimate_is_the_weighted_least_squares_solution() -> None:
    """Against numpy's solver of the weighted equations; a sensor of weight zero has no influence."""
    axes, rng = random_directions(6, 4), np.random.default_rng(5)
    weights, y = rng.uniform(0.5, 2.0, 6), rng.standard_normal(6)
    root = np.sqrt(weights)
    expected = np.linalg.lstsq(axes * root[:, None], y * root, rcond=None)[0]
    np.testing.assert_allclose(estimator(axes, weights) @ y, expected, rtol=1e-12)
    without = np.linalg.lstsq(np.delete(axes, 2, 0), np.delete(y, 2), rcond=None)[0]
    np.testing.assert_allclose(estimator(axes, np.array([1.0, 1, 0, 1, 1, 1])) @ y, without, rtol=1e-12)
    with pytest.raises(InputError, match="do not span three dimensions"):
        estimator(axes, np.array([1.0, 1, 0, 0, 0, 0]))


@pytest.mark.parametrize("name", ["dodecahedron", "skewed-triads"])
def test_six_sensors_survive_any_two_faults_in_turn(name: str) -> None:
    """After one exclusion the next fault can still be isolated, and after two the rest still spans space."""
    for first, second in itertools.permutations(range(6), 2):
        five = np.delete(READY[name], first, axis=0)
        assert not_isolable(READY[name]) == not_isolable(five) == ""
        four = np.delete(READY[name], [first, second], axis=0)
        assert np.linalg.svd(four, compute_uv=False)[-1] > 0.4
        assert dilution(four) < 4.6


def test_five_isolate_and_four_only_detect() -> None:
    assert not_isolable(READY["cone-5"]) == ""
    assert not_isolable(READY["cone-4"]) == "four sensors detect a fault, but each of them could have caused it"


def test_twins_cannot_be_told_apart() -> None:
    """Two sensors along x and the only ones with a component there: their faults are equal and opposite in parity."""
    s = np.sqrt(0.5)
    axes = np.array([(1.0, 0, 0), (1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0, s, s)])
    assert not_isolable(axes) == "a fault of sensor 2 looks like one of sensor 1"
    lonely = np.array([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0, s, s), (0, s, -s)])
    assert not_isolable(lonely) == "without sensor 1 the others lie in one plane, so that its fault is not seen"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (np.eye(3), r"directions needs 4 to 12 unit vectors .* shape \(3, 3\)\. Three sensors have no redundancy"),
        (np.ones((13, 3)), r"needs 4 to 12 unit vectors"),
        ([[1.0, 0], [0, 1.0], [0, 1.0], [0, 1.0]], r"unit vectors of three numbers"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], r"directions\.4 = \[0\.0, 0\.0, 0\.0\] .* it has no direction"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], r"length 1\.732051 instead of 1: .* \[0\.5773503, 0\.5773503"),
        ([[1, 0, 0], [0, 1, 0], [0.6, 0.8, 0], [0.8, 0.6, 0]], r"rank 2: all 4 lie in one plane"),
        ([[1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], r"rank 1"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1], [np.nan, 0, 0]], r"directions\.4 = .*has the length nan"),
    ],
)
def test_directions_that_cannot_be(rows: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        checked_directions(np.array(rows, dtype=float))
