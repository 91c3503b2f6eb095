"""What is said of the times of a stream: whole findings, with the numbers written down here."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.inspection.stream_findings import Finding, doubt, rate_findings, time_findings, wrong
from sinssim.data import Array


def _beside_the_rate(time: Array, unit: str = "samples") -> list[Finding]:
    first, *others = time_findings("imu", time, unit)
    assert first.grade == "fact"
    return others


def test_rate_and_intervals() -> None:
    """200 intervals of 19 and 21 ms by turns, and two of 18 and 25 ms, which 1 % and 99 % leave out."""
    steps = np.tile((0.019, 0.021), 100)
    steps[[50, 120]] = 0.018, 0.025
    time = 3.5 + np.append(0.0, np.cumsum(steps))
    (found,) = time_findings("imu", time)
    length = 98 * 0.019 + 100 * 0.021 + 0.018 + 0.025  # both replace an interval of 19 ms
    assert (found.subject, found.grade, found.fix) == ("imu", "fact", "")
    assert found.text == (
        f"201 samples from 3.5 s to {3.5 + length:.6g} s ({length:.6g} s), 47.619 a second; 98 % of the intervals last "
        "19 to 21 ms."
    )
    assert found.numbers == pytest.approx(
        {
            "count": 201,
            "start_s": 3.5,
            "end_s": 3.5 + length,
            "rate_hz": 1.0 / 0.021,
            "interval_1_percent_s": 0.019,
            "interval_99_percent_s": 0.021,
        }
    )


def test_few_samples_a_second() -> None:
    """Nine a second are few for a unit; ten are enough."""
    nine, ten = (np.arange(40) / rate for rate in (9.0, 10.0))
    text = "9 samples a second are few: turns and accelerations between two of them are lost."
    assert rate_findings("imu", nine) == [doubt("imu", text, "Record 50 a second or more.")]
    assert rate_findings("imu", ten) == rate_findings("imu", ten[:1]) == []


def test_gaps_are_counted_and_named() -> None:
    """Intervals of 0.1 s; 0.17 s is jitter, 0.18 s lacks a sample, 0.41 s three; of six gaps five are named."""
    steps = np.full(60, 0.1)
    steps[[5, 9]] = 0.17, 0.18
    assert _beside_the_rate(10.0 + np.append(0.0, np.cumsum(steps)), "fixes") == [
        doubt(
            "imu",
            "1 gap with about 1 missing fixes, the longest 0.18 s: after 10.97 s (0.18 s).",
            "Navigation has to bridge them; what moved in between is lost.",
            gaps=1,
            missing=1.0,
            longest_gap_s=pytest.approx(0.18),
        )
    ]
    steps = np.full(60, 0.1)
    steps[5:47:8] = 0.41, 0.2, 0.2, 0.2, 0.2, 0.75
    (found,) = _beside_the_rate(10.0 + np.append(0.0, np.cumsum(steps)))
    named = "10.5 s (0.41 s), 11.61 s (0.2 s), 12.51 s (0.2 s), 13.41 s (0.2 s), 14.31 s (0.2 s) and 1 more"
    assert found.text == f"6 gaps with about 14 missing samples, the longest 0.75 s: after {named}."
    assert found.numbers == pytest.approx({"gaps": 6, "missing": 3 + 4 + 7, "longest_gap_s": 0.75})


def test_times_that_repeat_or_go_back() -> None:
    time = 20.0 + 0.5 * np.arange(12)
    time[[4, 8]] = time[[3, 7]]
    fix = 'If the IMU samples evenly, use stamps = "even" in [log.imu]. Copies of rows are skipped.'
    said = "2 times of imu repeat the preceding one, first in row 5 (21.5 s)."
    assert doubt("imu", said, fix, repeated=2) in _beside_the_rate(time)
    time = 20.0 + 0.5 * np.arange(12)
    time[6:] -= 2.0
    assert _beside_the_rate(time) == [
        wrong(
            "imu",
            "The time of imu goes back 1 time, first in row 7: from 22.5 s to 21 s.",
            "The clock was reset or rows are out of order: cut the log there, or sort it.",
            backward=1,
            row=7,
        )
    ]


def test_too_few_times() -> None:
    assert time_findings("gnss", np.array([4.0]), "fixes") == [
        wrong("gnss", "gnss has 1 fixes.", "At least two are needed.", count=1)
    ]
    assert time_findings("gnss", np.array([4.0, 3.0, 3.0])) == [
        wrong("gnss", "No time of gnss follows the preceding one.", "The time column may be wrong.")
    ]


def test_98_percent_of_the_intervals() -> None:
    """Of 101 intervals of 20.00, 20.01 … 21.00 ms 1 % are below 20.01 ms, and 1 % above 20.99 ms."""
    (found,) = time_findings("imu", np.append(0.0, np.cumsum(0.02 + 1e-5 * np.arange(101.0))))
    assert "98 % of the intervals last 20.01 to 20.99 ms." in found.text
