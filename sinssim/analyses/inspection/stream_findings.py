"""Findings about single streams of recorded data: their times, and the numbers of a triad.

A finding is a fact, a doubt, or an error, in one sentence, with what to do about it. Times have a rate, jitter, gaps,
duplicates, or go back; numbers have a resolution, saturation, frozen and missing values.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import printable
from sinssim.logs.recorded_streams import GAP

Grade = Literal["fact", "doubt", "wrong"]


@dataclass(frozen=True)
class Finding:
    """One sentence about recorded data."""

    subject: str  # what it is about, for example "time", "accelerometers", "clock"
    grade: Grade  # "fact"; "doubt", which a person should look into; "wrong", with which results are worthless
    text: str  # the sentence, with the number
    fix: str = ""  # what to do about it; empty for facts
    # the numbers of the sentence by name, with units in the names
    numbers: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text))

    @property
    def sentence(self) -> str:
        """The sentence and the fix."""
        return f"{self.text} {self.fix}".rstrip()


def time_text(time: float) -> str:
    """Write an instant: six digits, or a tenth of a second of times that count from an epoch."""
    return f"{time:.6g} s" if abs(time) < 1e6 else f"{time:.1f} s"


def span_text(begin: float, end: float, to: str = " to ") -> str:
    """Write a span as two instants with one unit."""
    return f"{time_text(begin).removesuffix(' s')}{to}{time_text(end)}"


def fact(subject: str, text: str, **numbers: Any) -> Finding:
    """Return a fact."""
    return Finding(subject, "fact", text, "", numbers)


def doubt(subject: str, text: str, fix: str, **numbers: Any) -> Finding:
    """Return a doubt."""
    return Finding(subject, "doubt", text, fix, numbers)


def wrong(subject: str, text: str, fix: str, **numbers: Any) -> Finding:
    """Return an error of the data."""
    return Finding(subject, "wrong", text, fix, numbers)


_CHANCE = 1e-4
"""Probability that a channel which works seems frozen in a log."""
_RARE = 5
"""Most runs of at least half the length of the longest one; of a sensor that freezes there are a few in a log."""
_LEAST_FROZEN = 20
"""Equal samples in a row below which nothing is frozen: fewer may be a reading held by the logger."""
_SATURATED = 3
"""Samples at the extreme value in a row that count as saturation; one or two may be a peak."""


def channel_findings(subject: str, values: Array, unit: str, scale: float = 1.0) -> list[Finding]:
    """Judge the numbers of three channels. `values`: (N, 3), SI; `scale`: one of that unit, SI."""
    findings: list[Finding] = []
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        findings.append(
            wrong(
                subject,
                f"{int(bad.sum())} rows of the {subject} have missing or infinite numbers, first row "
                f"{int(np.argmax(bad)) + 1}.",
                "Remove these rows or repair them.",
                rows=int(bad.sum()),
            )
        )
        values = values[~bad]
    if len(values) < 2:
        return findings
    quanta = [_quantum(axis) for axis in values.T]
    if min(quanta) > 0.0:
        text = ", ".join(f"{q / scale:.3g}" for q in quanta)
        findings.append(fact(subject, f"Resolution of x, y, z: {text} {unit}.", resolution_si=quanta))
    runs = [_frozen_run(axis, quantum) for axis, quantum in zip(values.T, quanta, strict=True)]
    if runs[0] is not None and len(set(runs)) == 1:
        findings.append(_froze(subject, "channels", f"The channels of the {subject} give the same numbers", *runs[0]))
        runs = [None, None, None]
    for name, axis, quantum, run in zip("xyz", values.T, quanta, runs, strict=True):
        if run is not None:
            findings.append(_froze(subject, name, f"The {name} channel of the {subject} gives the same number", *run))
        findings += _of_axis(subject, name, axis, quantum, unit, scale)
    return findings


def _froze(subject: str, channel: str, what: str, length: int, row: int) -> Finding:
    text = f"{what} {length} times in a row, from row {row}."
    fix = "The sensor or the logger froze there: treat it as a gap."
    return doubt(subject, text, fix, channel=channel, frozen=length)


def _frozen_run(axis: Array, quantum: float) -> tuple[int, int] | None:
    """Return length and first row, from one, of the longest run of equal values if the channel froze there."""
    length, start = _longest_run(axis)
    froze = length >= _LEAST_FROZEN and not _usual(axis, start, length) and _frozen(axis, start, length, quantum)
    return (length, start + 1) if froze and float(np.ptp(axis)) > 0.0 else None


def _quantum(axis: Array) -> float:
    """Return the least difference between two values; 0 if they are too many to be steps of one."""
    different = np.unique(axis)
    if len(different) < 2 or len(different) > 0.5 * len(axis):
        return 0.0
    steps = np.diff(different)
    return float(np.min(steps[steps > 1e-9 * max(float(np.max(np.abs(different))), 1e-300)], initial=np.inf))


def _of_axis(subject: str, name: str, axis: Array, quantum: float, unit: str, scale: float) -> list[Finding]:
    """Return findings on one channel."""
    if float(np.ptp(axis)) == 0.0:
        text = f"The {name} channel of the {subject} never changes ({axis[0] / scale:.6g} {unit})."
        return [wrong(subject, text, "The column is wrong, or the sensor is dead.")]
    findings = []
    spread = float(np.std(np.diff(axis)))
    for extreme, word in ((float(axis.max()), "largest"), (float(axis.min()), "least")):
        at = axis == extreme
        runs, first = _longest_run(np.where(at, 1.0, np.arange(len(axis)) + 2.0))
        expected = _longest_run(np.where(at, np.arange(len(axis)) + 2.0, axis))[0]  # a resolution repeats any value
        beyond = abs(extreme - np.median(axis)) > 4.0 * max(spread, quantum)
        if runs >= _SATURATED and runs > expected and at[first] and beyond:
            findings.append(
                doubt(
                    subject,
                    f"The {name} channel of the {subject} stays at its {word} value, {extreme / scale:.5g} {unit}, "
                    f"for {runs} samples from row {first + 1}; {int(at.sum())} samples have this value.",
                    "The sensor is saturated there; its range is too small, or the value marks missing samples.",
                    channel=name,
                    saturated=int(at.sum()),
                )
            )
    return findings


def _frozen(axis: Array, start: int, length: int, quantum: float) -> bool:
    """Return whether noise of the size beside a run of equal values would not give such a run. A noise of σ about the
    middle of a step q, where equal values are most frequent, gives the same number with the probability p = erf(q/(2√2
    σ)). Of N samples, N pᴸ runs of the length L are expected at most. σ is that of the calmer side of the run, over its
    length. The quantum is 0 if the resolution is finer than the numbers show."""
    from scipy.special import erf

    sides = axis[max(start - length, 0) : start], axis[start + length : start + 2 * length]
    noise = [float(np.std(np.diff(side))) / np.sqrt(2.0) for side in sides if len(side) >= _LEAST_FROZEN]
    if not noise or not min(noise) > 0.0:
        return False
    same = float(erf(quantum / (2.0 * np.sqrt(2.0) * min(noise))))
    return len(axis) * same**length < _CHANCE


def _usual(axis: Array, start: int, length: int) -> bool:
    """Return whether half as long runs of this value are usual: those of a dead band, or of a laser gyro at rest."""
    ends, lengths = _runs(axis)
    return int(((2 * lengths >= length) & (axis[ends] == axis[start])).sum()) > _RARE


def _runs(axis: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the last indices and the lengths of the runs of equal values."""
    ends = np.flatnonzero(np.append(np.diff(axis) != 0.0, True))
    return ends, np.diff(np.append(-1, ends))


def _longest_run(axis: Array) -> tuple[int, int]:
    """Return length and first index of the longest run of equal values."""
    ends, lengths = _runs(axis)
    k = int(np.argmax(lengths))
    return int(lengths[k]), int(ends[k] - lengths[k] + 1)


_SHOWN_TIMES = 5  # gaps named one by one


_LONG = 0.11
"""Interval of inertial samples, s, from which the motion between two of them matters: a step takes half a second."""


def rate_findings(subject: str, time: Array) -> list[Finding]:
    """Return the doubt on an inertial unit that gives few samples (stamps, (N,) s)."""
    interval = float(np.median(np.abs(np.diff(time)))) if len(time) > 1 else 0.0
    if interval < _LONG:
        return []
    text = f"{1.0 / interval:.3g} samples a second are few: turns and accelerations between two of them are lost."
    return [doubt(subject, text, "Record 50 a second or more.")]


def time_findings(subject: str, time: Array, unit: str = "samples") -> list[Finding]:
    """Judge the times of a stream. `time`: stamps, (N,) s."""
    count = len(time)
    if count < 2:
        return [wrong(subject, f"{subject} has {count} {unit}.", "At least two are needed.", count=count)]
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    if not len(forward):
        return [wrong(subject, f"No time of {subject} follows the preceding one.", "The time column may be wrong.")]
    interval = float(np.median(forward))
    low, high = np.percentile(forward[forward < GAP * interval], (1.0, 99.0))
    findings = [
        fact(
            subject,
            f"{count} {unit} from {time_text(time[0])} to {time_text(time[-1])} ({time[-1] - time[0]:.6g} s), "
            f"{1.0 / interval:.6g} a second; 98 % of the intervals last {1e3 * low:.4g} to {1e3 * high:.4g} ms.",
            count=count,
            start_s=float(time[0]),
            end_s=float(time[-1]),
            rate_hz=1.0 / interval,
            interval_1_percent_s=float(low),
            interval_99_percent_s=float(high),
        )
    ]
    findings += _not_forward(subject, time, steps)
    gaps = np.flatnonzero(steps > GAP * interval)
    if len(gaps):
        missing = float(np.sum(np.rint(steps[gaps] / interval) - 1.0))
        where = ", ".join(f"{time_text(time[k])} ({steps[k]:.3g} s)" for k in gaps[:_SHOWN_TIMES])
        more = f" and {len(gaps) - _SHOWN_TIMES} more" if len(gaps) > _SHOWN_TIMES else ""
        findings.append(
            doubt(
                subject,
                f"{len(gaps)} gap{'s' * (len(gaps) > 1)} with about {missing:.0f} missing {unit}, the longest "
                f"{float(steps.max()):.3g} s: after {where}{more}.",
                "Navigation has to bridge them; what moved in between is lost.",
                gaps=len(gaps),
                missing=missing,
                longest_gap_s=float(steps.max()),
            )
        )
    return findings


def _not_forward(subject: str, time: Array, steps: Array) -> list[Finding]:
    """Return findings on times that repeat or go back."""
    findings = []
    same, back = np.flatnonzero(steps == 0.0), np.flatnonzero(steps < 0.0)
    if len(same):
        findings.append(
            doubt(
                subject,
                f"{len(same)} time{'s' * (len(same) > 1)} of {subject} repeat the preceding one, first in row "
                f"{same[0] + 2} ({time[same[0]]:.9g} s).",
                'If the IMU samples evenly, use stamps = "even" in [log.imu]. Copies of rows are skipped.',
                repeated=len(same),
            )
        )
    if len(back):
        k = int(back[0])
        findings.append(
            wrong(
                subject,
                f"The time of {subject} goes back {len(back)} time{'s' * (len(back) > 1)}, first in row {k + 2}: from "
                f"{time[k]:.9g} s to {time[k + 1]:.9g} s.",
                "The clock was reset or rows are out of order: cut the log there, or sort it.",
                backward=len(back),
                row=k + 2,
            )
        )
    return findings
