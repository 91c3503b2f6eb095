"""What a diagnosis tries, and from when on: states, walks, starts, by a table of what is expected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.filter_diagnosis import (
    gain,
    initial_candidates,
    needed_gain,
    refusals,
    size_of_innovations,
    state_candidates,
    walks,
    widened,
    with_block,
)
from tests.estimation.made import MODEL, readings

TIME = np.array([1.0, 3.0, 5.5, 7.5, 9.5])
EVERY = np.ones(5, dtype=bool)
GNSS = readings("gnss-position", TIME, EVERY, value=np.zeros((5, 3)))
SPEED = readings("gnss-velocity", TIME, EVERY, value=np.zeros((5, 3)), kind="gnss-velocity")
BARO = readings("baro", TIME, EVERY, kind="baro-height", covariance=np.array([[16.0]]))


def sizes(blocks: list[Block]) -> dict[str, tuple[float, int]]:
    return {block.name: (float(np.max(block.sigma)), block.size) for block in blocks}


def test_states_that_are_tried() -> None:
    """A bias as large as the noise of a sample of 0.01 s; further states by their wide 1σ."""
    inertial = {
        "gyro bias": (1e-3, 3), "gyro scale": (0.01, 3), "gyro misalignment": (0.02, 6),
        "accelerometer bias": (1e-2, 3), "accelerometer scale": (0.01, 3), "accelerometer misalignment": (0.02, 6),
    }  # fmt: skip
    satellites = {"gnss lever arm": (10.0, 3), "gnss time offset": (1.0, 1)}
    height = {"baro bias": (1000.0, 1), "baro scale": (0.3, 1)}
    for sensors, expected in (
        ([], inertial),
        ([GNSS], satellites | inertial),
        ([GNSS, SPEED], satellites | {"gnss-velocity delay": (1.0, 1)} | inertial),
        ([BARO], inertial | height),
        ([readings("baro", np.zeros(0), np.zeros(0), kind="baro-height")], inertial),
    ):
        found = sizes(state_candidates(MODEL, sensors, 0.01))
        assert found == {name: (pytest.approx(size), count) for name, (size, count) in expected.items()}
    quiet = replace(MODEL, gyro_noise=0.0)
    assert "gyro bias" not in sizes(state_candidates(quiet, [], 0.01))


@pytest.mark.parametrize(("sigma", "tried"), [(0.9e-4, True), (1.1e-4, False)])
def test_a_state_that_is_assumed_small_is_tried_with_its_drive(sigma: float, tried: bool) -> None:
    """Below a tenth of the wide 1σ of 1e-3 rad/s."""
    model = with_block(MODEL, Block("gyro bias", [sigma / 3.0, sigma, sigma / 2.0], random_walk=5e-7))
    found = [block for block in state_candidates(model, [], 0.01) if block.name == "gyro bias"]
    assert len(found) == tried
    for block in found:
        assert (block.sigma, block.random_walk.tolist()) == (pytest.approx(1e-3), [5e-7] * 3)


def test_biases_that_may_walk() -> None:
    """Of constants alone: noise of the triads, and of a sensor its median 1σ times the root of the median interval."""
    model = ErrorModel((*MODEL.blocks, Block("accelerometer bias", 0.3), Block("baro bias", 5.0)), 1e-4, 1e-3)
    found = {name: (block, noise) for name, block, noise in walks(model, [BARO, GNSS], 0.01)}
    assert list(found) == ["gyro", "accelerometer", "baro"]
    block, noise = found["gyro"]
    assert (block.name, block.sigma, noise) == ("gyro bias", pytest.approx(1e-3), 1e-4)
    assert found["accelerometer"] == (model.blocks[3], 1e-3)
    assert found["baro"] == (model.blocks[4], pytest.approx(4.0 * np.sqrt(2.0)))
    wandering = ErrorModel(
        (*MODEL.blocks, Block("gyro bias", 0.1, correlation_time=50.0), Block("baro bias", 5.0, correlation_time=9.0)),
        1e-4, 0.0,
    )  # fmt: skip
    assert list(walks(wandering, [BARO], 0.01)) == []


def test_a_block_is_added_or_replaced() -> None:
    more = with_block(MODEL, Block("gyro bias", 0.1))
    assert [block.name for block in more.blocks] == ["position", "velocity", "attitude", "gyro bias"]
    again = with_block(more, Block("velocity", 7.0))
    assert [(block.name, block.sigma) for block in again.blocks] == [
        ("position", 2.0), ("velocity", 7.0), ("attitude", 1e-3), ("gyro bias", 0.1),
    ]  # fmt: skip


def test_starts_of_which_the_filter_knows_little() -> None:
    """Each where its σ is below a tenth: 1 km, 30 m/s, 0.1 rad of tilt, 1 rad of heading."""
    found = {name: model.sigma for name, model in initial_candidates(MODEL)}
    own = np.repeat([2.0, 0.5, 1e-3], 3)
    expected = {
        "initial position": np.r_[[1000.0] * 3, own[3:]],
        "initial velocity": np.r_[own[:3], [30.0] * 3, own[6:]],
        "initial tilt": np.r_[own[:6], 0.1, 0.1, 1e-3],
        "initial heading": np.r_[own[:6], 1e-3, 1e-3, 1.0],
    }
    assert list(found) == list(expected)
    for name, sigma in expected.items():
        np.testing.assert_allclose(found[name], sigma)
    known = ErrorModel(
        (Block("position", (1.0, 101.0, 1.0)), Block("velocity", 2.9), Block("attitude", (1e-3, 0.011, 0.11))),
        1e-4,
        1e-3,
    )
    assert [name for name, _ in initial_candidates(known)] == ["initial velocity"]

    wide = dict(initial_candidates(MODEL))["initial tilt"]
    covariance = np.diag(np.arange(1.0, 13.0)) + 0.1
    more = widened(covariance, MODEL, wide)
    assert more is not None
    change = np.zeros((12, 12))
    change[6, 6] = change[7, 7] = 0.01 - 1e-6
    np.testing.assert_allclose(more - covariance, change, rtol=0, atol=1e-15)
    assert widened(None, MODEL, wide) is None


def test_runs_of_refusals_that_chance_does_not_explain() -> None:
    """Of a gate of 5 % three in a row among a hundred have 1.25 %, four 0.06 %; what is not compared does not count."""
    time = 10.0 + 0.5 * np.arange(102.0)
    nis = np.ones(102)
    nis[[31, 60]] = np.nan
    accepted = np.ones(102, dtype=bool)
    accepted[[5, 6, 7, 30, 31, 32, 33, 34, 60]] = False
    value = np.zeros((102, 2))
    value[30:35] = [[-3.0, 6.0], [99.0, 99.0], [-5.0, 2.0], [-1.0, 4.0], [-3.0, 8.0]]
    sensor = readings("radio", time, accepted, nis=nis, value=value, bound=float(chi2.isf(0.05, 2)))
    (span,) = refusals(sensor)
    assert (span.sensor, span.start, span.end, span.count, span.mean) == ("radio", 25.0, 27.0, 4, (3.0, -5.0))
    assert list(refusals(replace(sensor, bound=np.inf))) == []


def test_the_gain_counts_what_both_compared_and_refusals_with_the_bound() -> None:
    """ν²/S + ln S: 1 + 1 + 4 of the own model, 0.5 + 4 + 1 of the other; a variance of e³ counts 3 for each reading."""
    own = readings("s", TIME, EVERY, nis=np.array([1.0, np.nan, 1.0, 90.0, 7.0]), bound=4.0)
    other = readings("s", TIME, EVERY, nis=np.array([0.5, 2.0, 60.0, 1.0, np.nan]), bound=4.0,
                     covariance=np.array([[np.exp(3.0)]]))  # fmt: skip
    assert gain([own], [other]) == pytest.approx(6.0 - 5.5 - 9.0)
    assert gain([own, own], [other, own]) == pytest.approx(-8.5)
    assert gain([own], [readings("s", TIME[1:], EVERY[1:])]) == -np.inf


def test_what_a_gain_must_be_among_twenty() -> None:
    assert needed_gain(20, fitted=False) == pytest.approx(2.0 * np.log(2000.0))
    assert needed_gain(20, fitted=True) == pytest.approx(chi2.isf(0.01 / 20.0, 1))


def test_the_median_tells_the_size() -> None:
    """Of eight compared readings of two components the median of NIS is 9 · 1.386, the median of χ² of two."""
    nis = 9.0 * 2.0 * np.log(2.0) * np.array([0.1, 0.2, 0.3, 0.9, 1.1, 5.0, 6.0, 70.0])
    time = np.arange(9.0)
    sensor = readings("s", time, time >= 0, nis=np.r_[nis, np.nan], value=np.zeros((9, 2)))
    assert size_of_innovations(sensor) == pytest.approx(3.0)
    assert np.isnan(size_of_innovations(replace(sensor, nis=np.r_[nis[:7], np.nan, np.nan])))
