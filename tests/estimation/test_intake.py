"""CheckedMeasurements that cannot be used, and the epochs that the others make."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Array, Measurements
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.measurement_epochs import Branches, take_in

MODEL = ErrorModel(tuple(Block(name, 1.0) for name in ("position", "velocity", "attitude")), 0.0, 0.0)
IMU_TIME = np.arange(0.0, 10.001, 0.01)


def heights(time: Array, value: float = 100.0) -> Measurements:
    time = np.asarray(time, dtype=float)
    return Measurements("baro-height", time, time, np.full((len(time), 1), value), np.ones((len(time), 1)))


def test_epochs_are_those_of_the_rate_and_of_the_readings() -> None:
    readings, epochs = take_in([heights([1.0, 2.0000004, 3.337, 10.0])], MODEL, IMU_TIME, 10.0)
    np.testing.assert_allclose(np.delete(epochs.time, 34), np.arange(101) / 10.0, atol=1e-9)
    assert epochs.time[34] == 3.337
    assert not epochs.on_edge[34]
    assert epochs.edge[34] == 333
    assert epochs.on_edge.sum() == 101
    assert epochs.second.sum() == 11
    assert readings[0].epoch.tolist() == [10, 20, 34, 101]


def test_readings_within_a_microsecond_of_an_edge_or_of_each_other_share_its_epoch() -> None:
    """At the ends of the data too, which here begin at 100 s."""
    time = 100.0 + IMU_TIME
    first = heights(100.0 + np.array([-4e-7, 1.9999996, 3.337, 10.0000004]))
    second = replace(heights(100.0 + np.array([0.0, 2.0000004, 3.3370005, 9.9999996])), name="second")
    (one, two), epochs = take_in([first, second], MODEL, time, 10.0)
    assert len(epochs.time) == 102
    assert one.epoch.tolist() == two.epoch.tolist() == [0, 20, 34, 101]
    assert one.between(0, 19).tolist() == [0]
    assert one.between(1, 34).tolist() == [1, 2]
    np.testing.assert_allclose(epochs.time[epochs.second], time[::100])


def test_readings_a_whole_microsecond_apart_share_an_epoch() -> None:
    early = 1.25e-6  # a microsecond later is one in binary numbers too
    (one, two), epochs = take_in(
        [heights([early]), replace(heights([early + 1e-6]), name="late")], MODEL, IMU_TIME, 10.0
    )
    assert epochs.time[:3].tolist() == [0.0, early, 0.1]
    assert (one.epoch.tolist(), two.epoch.tolist()) == ([1], [1])


@pytest.mark.parametrize(("rate_hz", "stride"), [(0.5, 200), (1000.0, 1)])
def test_slow_and_fast_predictions(rate_hz: float, stride: int) -> None:
    """Slower than a second, every epoch is on its grid; faster than the data, there is one at every edge."""
    _, epochs = take_in([], MODEL, IMU_TIME, rate_hz)
    assert epochs.edge.tolist() == list(range(0, 1001, stride))
    assert epochs.edge[epochs.second].tolist() == list(range(0, 1001, max(stride, 100)))


def test_one_interval_has_two_epochs() -> None:
    (readings,), epochs = take_in([heights([0.01])], MODEL, IMU_TIME[:2], 10.0)
    assert epochs.time.tolist() == [0.0, 0.01]
    assert readings.epoch.tolist() == [1]


def test_a_rate_that_does_not_divide_the_datas_is_rounded_to_whole_samples() -> None:
    _, epochs = take_in([], MODEL, np.arange(0.0, 1.0001, 1.0 / 128.0), 10.0)
    np.testing.assert_allclose(np.diff(epochs.time)[:-1], 13.0 / 128.0)
    assert epochs.time[-1] == 1.0


def test_single_readings_that_cannot_be_used_say_why() -> None:
    m = heights([-1.0, 1.0, 1.0, 2.0, 3.0, 11.0])
    m.value[3] = np.nan
    m.value[4] = np.inf
    (readings,), _ = take_in([m], MODEL, IMU_TIME, 10.0)
    assert list(readings.reason) == [
        "valid before the inertial data begin",
        "",
        "a second measurement at the same time",
        "not a finite number",
        "not a finite number",
        "valid after the inertial data end",
    ]
    assert readings.usable.tolist() == [1]
    assert readings.epoch.tolist() == [-1, 10, -1, -1, -1, -1]


def test_a_reading_takes_the_place_of_one_at_its_instant_that_is_no_number() -> None:
    m = heights([1.0, 1.0])
    m.value[0] = np.nan
    (readings,), _ = take_in([m], MODEL, IMU_TIME, 10.0)
    assert readings.usable.tolist() == [1]


def test_readings_out_of_order_are_put_in_the_order_of_their_validity() -> None:
    m = heights([3.0, 1.0, 2.0])
    m.value[:, 0] = [30.0, 10.0, 20.0]
    (readings,), _ = take_in([m], MODEL, IMU_TIME, 10.0)
    assert readings.data.time.tolist() == [1.0, 2.0, 3.0]
    assert readings.data.value[:, 0].tolist() == [10.0, 20.0, 30.0]
    assert readings.epoch.tolist() == [10, 20, 30]


def test_a_zero_rate_reading_is_a_mean_since_the_one_before_or_as_long_as_that() -> None:
    time = np.array([1.0, 1.5, 2.0, 6.0, 6.5])
    m = Measurements("zero-rate", time, time, np.zeros((5, 3)), np.ones((5, 3)))
    (readings,), epochs = take_in([m], MODEL, IMU_TIME, 1.0)
    np.testing.assert_allclose(readings.interval, 0.5)
    assert 5.5 in epochs.time


@pytest.mark.parametrize(
    ("time", "interval"),
    [
        ([0.4, 0.9, 1.4], [0.4, 0.5, 0.5]),  # the first since the data begin
        ([0.5, 1.0, 2.0, 2.5], [0.5] * 4),  # a pause of one reading
        ([0.5, 1.0, 1.7, 2.2], [0.5, 0.5, 0.7, 0.5]),  # one that is late
        ([0.5, 1.0, 1.0, 1.5], [0.5] * 4),  # one that comes twice, the second of which is not used
    ],
)
def test_intervals_of_zero_rate_readings(time: list[float], interval: list[float]) -> None:
    at = np.array(time)
    m = Measurements("zero-rate", at, at, np.zeros((len(at), 3)), np.ones((len(at), 3)))
    (readings,), _ = take_in([m], MODEL, IMU_TIME, 1.0)
    np.testing.assert_allclose(readings.interval, interval, atol=1e-12)


def test_a_mean_rate_needs_an_interval_before_it() -> None:
    at = np.array([0.0, 0.5])
    m = Measurements("zero-rate", at, at, np.zeros((2, 3)), np.ones((2, 3)))
    (readings,), _ = take_in([m], MODEL, IMU_TIME, 1.0)
    assert readings.usable.tolist() == [1]


def test_variance_is_that_of_the_reading_and_of_a_pulse() -> None:
    """A pulse rounds evenly over its weight Q: Q²/12."""
    at = np.array([1.0, 2.0])
    m = Measurements("zero-velocity", at, at, np.zeros((2, 3)), np.array([[0.3, 0.4, 0.5], [0.6, 0.7, 0.8]]))
    model = replace(MODEL, accel_quantum=0.6)
    (readings,), _ = take_in([m], model, IMU_TIME, 1.0)
    np.testing.assert_allclose(readings.variance(np.arange(2), model), m.sigma**2 + 0.03, rtol=1e-14)


def test_a_second_reading_within_a_microsecond_is_left_out() -> None:
    (readings,), _ = take_in([heights([1.0, 1.0000009, 1.0000021])], MODEL, IMU_TIME, 10.0)
    assert readings.usable.tolist() == [0, 2]
    (readings,), _ = take_in([heights([0.0, 1e-6, 2e-6])], MODEL, IMU_TIME, 10.0)  # a whole one counts as within
    assert readings.usable.tolist() == [0, 2]


GOOD = heights([1.0, 2.0])
PLACE = Measurements("gnss-position", GOOD.time, GOOD.time, np.zeros((2, 3)), np.ones((2, 3)))


@pytest.mark.parametrize(
    ("measurements", "message"),
    [
        ([replace(GOOD, kind="baro")], "unknown kind of measurement 'baro'.*baro-height"),
        ([replace(GOOD, value=np.zeros((2, 3)))], "shapes"),
        ([replace(GOOD, sigma=np.array([[1.0], [0.0]]))], r"sigma\[1\] = \[0.\] at t = 2 s.*positive definite"),
        ([replace(GOOD, sigma=np.array([[1.0], [-1.0]]))], "positive definite"),
        ([replace(GOOD, sigma=np.array([[np.nan], [1.0]]))], "positive definite"),
        ([replace(GOOD, arrival=np.array([1.0, 1.9]))], "measurement 1 is valid at t = 2.0.*must not arrive before"),
        ([replace(GOOD, time=np.array([1.0, np.nan]))], r"time\[1\] = nan"),
        ([replace(GOOD, lever_arm=np.array([np.inf, 0.0, 0.0]))], "lever_arm"),
        ([replace(GOOD, value=np.full((2, 1), "high"))], "not an array of numbers"),
        (GOOD, "a sequence with one entry per sensor"),
        ([GOOD, GOOD], "two sensors are called 'baro-height'"),
        ([replace(GOOD, name="first"), GOOD, GOOD], "two sensors are called 'baro-height'"),
    ],
)
def test_refused(measurements: list[Measurements], message: str) -> None:
    with pytest.raises(InputError, match=message):
        take_in(measurements, MODEL, IMU_TIME, 10.0)


def test_a_sensors_block_needs_its_sensor_and_its_size() -> None:
    def with_block(block: Block) -> ErrorModel:
        return ErrorModel((*MODEL.blocks, block), 0.0, 0.0)

    take_in([GOOD], with_block(Block("baro-height bias", 1.0)), IMU_TIME, 10.0)
    take_in([replace(GOOD, name="altimeter")], with_block(Block("altimeter scale", 1.0)), IMU_TIME, 10.0)
    for block, given in (
        (Block("baro bias", 1.0), GOOD),
        (Block("baro-height bias", np.ones(3)), GOOD),
        (Block("gnss-position scale", 1.0), PLACE),
    ):
        with pytest.raises(InputError, match=block.name.split()[0]):
            take_in([given], with_block(block), IMU_TIME, 10.0)
    with pytest.raises(InputError, match="rate_hz"):
        take_in([GOOD], MODEL, IMU_TIME, 0.0)


def test_a_place_that_is_none_is_left_out() -> None:
    (readings,), _ = take_in([replace(PLACE, value=np.full((2, 3), 50.0))], MODEL, IMU_TIME, 10.0)
    assert list(readings.reason) == ["a latitude beyond a pole (radians are expected)"] * 2


def test_correlations_are_part_of_the_noise() -> None:
    """R has σᵢσⱼρᵢⱼ; what is no correlation is refused."""
    time = np.array([3.0, 1.0])
    rho = np.array([[1.0, 0.6, -0.2], [0.6, 1.0, 0.1], [-0.2, 0.1, 1.0]])
    sigma = np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]])
    given = Measurements("gnss-position", time, time, np.zeros((2, 3)), sigma, correlation=np.array([np.eye(3), rho]))
    (readings,), _ = take_in([given], MODEL, IMU_TIME, 10.0)
    variance = readings.variance(np.arange(2), MODEL)
    expected = [[0.01, 0.012, -0.006], [0.012, 0.04, 0.006], [-0.006, 0.006, 0.09]]
    np.testing.assert_allclose(readings.covariance(0, variance[0]), expected, rtol=1e-12)  # in the order of time
    np.testing.assert_allclose(readings.covariance(1, variance[1]), np.diag([1.0, 4.0, 9.0]), rtol=1e-12)
    uneven = rho + np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for wrong in (2.0 * rho, uneven, np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])):
        with pytest.raises(InputError, match="not a correlation matrix"):
            take_in([replace(given, correlation=np.array([rho, wrong]))], MODEL, IMU_TIME, 10.0)
    with pytest.raises(InputError, match="has the shape"):
        take_in([replace(given, correlation=np.eye(3))], MODEL, IMU_TIME, 10.0)


def test_what_is_wrong_with_readings_is_said_with_its_numbers() -> None:
    time = np.array([1.25, 2.5, 3.75])
    good = Measurements("gnss-position", time, time + 0.5, np.zeros((3, 3)), np.ones((3, 3)), name="m8")
    sigma = np.ones((3, 3))
    sigma[1, 2] = -0.5
    early = time + np.array([0.5, -0.25, -1.0])
    for wrong, text in (
        (
            replace(good, value=np.zeros((3, 1))),
            "measurements of 'm8': time, arrival, value, sigma and lever_arm have the shapes ((3,), (3,), (3, 1), "
            "(3, 3), (3,)); 3 measurements of kind 'gnss-position' have ((3,), (3,), (3, 3), (3, 3), (3,)).",
        ),
        (
            replace(good, sigma=sigma),
            "measurements of 'm8': sigma[1] = [ 1.   1.  -0.5] at t = 2.5 s; every 1σ must be a positive number, or R "
            "is not positive definite.",
        ),
        (
            replace(good, arrival=early),
            "measurements of 'm8': measurement 1 is valid at t = 2.500000 s and arrives at 2.250000 s, which is "
            "earlier; a measurement must not arrive before it is valid.",
        ),
    ):
        with pytest.raises(InputError) as info:
            take_in([wrong], MODEL, IMU_TIME, 10.0)
        assert str(info.value) == text
    model = ErrorModel((*MODEL.blocks, Block("m8 scale", 1.0)), 0.0, 0.0)
    with pytest.raises(InputError) as info:
        take_in([good], model, IMU_TIME, 10.0)
    assert str(info.value) == (
        "block 'm8 scale' has 1 states; measurements of 'm8' are of kind 'gnss-position', whose blocks of states are "
        "m8 bias (3), m8 delay (1)."
    )


def test_a_branch_holds_what_arrives_before_its_end() -> None:
    """Readings up to a microsecond before the end, and none at it."""
    branches: Branches[Any] = Branches(SimpleNamespace(until=np.inf))
    branches.waiting = [SimpleNamespace(until=5.0), SimpleNamespace(until=7.0)]
    held = {arrival: [b.until for b in branches.holding(arrival)] for arrival in (4.9, 5.0 - 1e-7, 5.0, 6.9, 7.0)}
    assert held == {4.9: [5.0, 7.0], 5.0 - 1e-7: [7.0], 5.0: [7.0], 6.9: [7.0], 7.0: []}
