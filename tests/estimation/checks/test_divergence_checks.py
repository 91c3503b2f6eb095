"""When filter and sensors contradict each other: against a plain walk through all readings in order."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import Array
from sinssim.estimation.checks.divergence_checks import (
    CONTRADICTION,
    CONTRADICTION_S,
    Diverged,
    check_covariance,
    contradiction,
)
from sinssim.estimation.result import Innovations, Reasons


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
