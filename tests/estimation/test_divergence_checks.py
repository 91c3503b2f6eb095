"""When filter and sensors contradict each other: against a plain walk through all readings in order."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array
from sinssim.estimation.estimate import remarks
from sinssim.estimation.filter_result import Innovations, Reasons
from sinssim.estimation.innovation_gate import CONTRADICTION, CONTRADICTION_S, contradiction
from sinssim.estimation.kalman_filter import Diverged, check_covariance
from tests.estimation.made import readings


def sensor(name: str, time: Array, accepted: Array, looked_at: Array) -> Innovations:
    count = len(time)
    nis = np.where(looked_at, 1.0, np.nan)
    reasons = Reasons(count, {})
    return Innovations(
        name,
        "gnss-position",
        time,
        np.zeros((count, 1)),
        np.ones((count, 1)),
        nis,
        accepted & looked_at,
        reasons,
        9.0,
    )


def walked(sensors: list[Innovations]) -> tuple[float, str] | None:
    """Return the first reading of a contradiction, found reading by reading."""
    every = sorted(
        (float(s.time[row]), number, row)
        for number, s in enumerate(sensors)
        for row in range(len(s.time))
        if not np.isnan(s.nis[row])
    )
    row_of_refused: list[tuple[float, int, int]] = []
    for reading in [*every, None]:
        if reading is not None and not sensors[reading[1]].accepted[reading[2]]:
            row_of_refused.append(reading)
            continue
        if len(row_of_refused) >= CONTRADICTION and row_of_refused[-1][0] - row_of_refused[0][0] >= CONTRADICTION_S:
            time, number, row = row_of_refused[0]
            return time, f"{sensors[number].sensor} {row} (valid at {time:.3f} s)"
        row_of_refused = []
    return None


def test_a_contradiction_counts_its_rejections() -> None:
    """Once per second: 20 accepted, 40 rejected from 21 s to 60 s, 40 accepted."""
    time = np.arange(1.0, 101.0)
    found = contradiction([sensor("receiver", time, (time <= 20.0) | (time > 60.0), np.ones(100, dtype=bool))])
    assert found is not None
    assert found.time == 21.0
    assert "rejected all 40 measurements in 39 s" in str(found.reason)


def test_a_contradiction_is_where_a_walk_finds_it() -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(300):
        sensors = []
        for number in range(int(rng.integers(1, 4))):
            time = np.unique(rng.integers(0, 150, 120)).astype(float)  # many simultaneous readings
            begin = rng.uniform(0.0, 150.0)
            refused = (time > begin) & (time < begin + rng.uniform(20.0, 60.0))
            accepted = np.where(refused, rng.random(len(time)) < 0.004, rng.random(len(time)) < 0.8)
            sensors.append(sensor(f"s{number}", time, accepted, rng.random(len(time)) < 0.95))
        expected, got = walked(sensors), contradiction(sensors)
        assert (expected is None) == (got is None)
        if expected is not None and got is not None:
            found += 1
            assert (got.time, got.measurement) == expected
    assert 50 < found < 290


@pytest.mark.parametrize("sensors", [[], [sensor("s", np.zeros(0), np.zeros(0, bool), np.zeros(0, bool))]])
def test_no_readings_no_contradiction(sensors: list[Innovations]) -> None:
    assert contradiction(sensors) is None


@pytest.mark.parametrize(("least", "sound"), [(1e-6, True), (0.0, True), (-1e-14, True), (-1e-8, False)])
def test_a_covariance_may_be_singular_but_not_indefinite(least: float, sound: bool) -> None:
    """States that depend on each other have an eigenvalue of zero, which rounding makes a negative one."""
    axes, _ = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))
    p = axes @ np.diag([least, 0.5, 0.8, 1.0, 1.5, 2.2]) @ axes.T
    size = np.array([1e3, 1.0, 1e-9, 1e-4, 1.0, 10.0])
    correlation = p / np.sqrt(np.outer(p.diagonal(), p.diagonal()))
    covariance = correlation * size[:, None] * size
    if sound:
        check_covariance(covariance, np.arange(6), 1.0, "")
    else:
        with pytest.raises(Diverged, match="no longer positive definite"):
            check_covariance(covariance, np.arange(6), 1.0, "")


def test_what_is_said_of_a_contradiction() -> None:
    """From 21 s on, every 4 s; what was not compared before does not count. Ten in 30 s are the fewest."""
    time = np.array([5.0, 9.0, 13.0, 17.0, *(21.0 + 4.0 * np.arange(12.0))])
    first = readings("gnss", time, time < 20.0, nis=np.where(time == 17.0, np.nan, 1.0))
    later = readings("baro", np.array([22.5, 23.5]), np.zeros(2))
    found = contradiction([later, first])
    assert found is not None
    assert (found.time, found.measurement) == (21.0, "gnss 4 (valid at 21.000 s)")
    assert found.reason == (
        "from this measurement on, the gate rejected all 14 measurements in 44 s: either the sensors are wrong, or the "
        "filter is overconfident"
    )
    for step, count, there in ((3.4, 10, True), (3.3, 10, False), (4.0, 9, False)):
        spell = readings("gnss", 50.0 + step * np.arange(float(count)), np.zeros(count))
        assert (contradiction([spell]) is not None) == there


def test_what_is_said_of_readings_that_were_not_used() -> None:
    used = np.arange(20) >= 3
    sensors = [
        readings("gnss", np.arange(20.0), used, nis=np.where(np.arange(20) < 2, np.nan, 1.0),
                 reasons={0: "before the start", 1: "before the start", 2: "gate"}),
        readings("baro", np.arange(5.0), np.zeros(5), nis=np.array([np.nan, np.nan, np.nan, 1.0, 1.0]),
                 reasons={0: "without a fix", 1: "outside of the data", 2: "without a fix", 3: "gate", 4: "gate"}),
        readings("still", np.zeros(0), np.zeros(0), kind="zero-velocity"),
        readings("heading", np.zeros(0), np.zeros(0), kind="heading"),
        readings("turning", np.zeros(0), np.zeros(0), kind="zero-rate"),
        readings("late", np.arange(20.0), np.ones(20)),
        readings("pending", np.arange(20.0), np.ones(20)),
    ]  # fmt: skip
    assert remarks(sensors, [0, 0, 0, 0, 0, 3, 2]) == [
        "gnss: some of 20 measurements could not be used (2 before the start).",
        "gnss: the gate rejected 1 of 20 measurements.",
        "baro: none of 5 measurements was used (2 without a fix, 1 outside of the data; 2 rejected by the gate); the "
        "sensor corrects nothing.",
        "still: there was no measurement (the vehicle was never at rest); the sensor corrects nothing.",
        "heading: there was no measurement; the sensor corrects nothing.",
        "turning: there was no measurement (the vehicle was never at rest); the sensor corrects nothing.",
        "late: 3 of 20 measurements arrive after the end of the run; only the smoothed solution uses them.",
    ]
    assert remarks(sensors[3:4], [0])[-1] == "No measurement was used: the result is the inertial solution."
    assert remarks([], []) == ["There are no measurements: the result is the inertial solution."]
    one = readings("one", np.array([4.0]), np.ones(1))
    assert remarks([one], [1]) == [
        "one: 1 of 1 measurements arrive after the end of the run; only the smoothed solution uses them."
    ]
