"""The numbers of a triad of sensors as such: resolution, saturation, frozen and missing values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.inspection.finding import Finding, doubt, fact, wrong
from sinssim.data import Array

_CHANCE = 1e-4
"""Probability that a channel which works seems frozen in a log."""
_RARE = 5
"""Most runs of at least half the length of the longest one; of a sensor that freezes there are a few in a log."""
_LEAST_FROZEN = 20
"""Equal samples in a row below which nothing is frozen: fewer may be a reading held by the logger."""
_SATURATED = 3
"""Samples at the extreme value in a row that count as saturation; one or two may be a peak."""


def channel_findings(subject: str, values: Array, unit: str, scale: float = 1.0) -> list[Finding]:
    """Judge the numbers of three channels.

    Args:
        values: (N, 3), SI.
        scale: one of that unit, SI.
    """
    found: list[Finding] = []
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        found.append(
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
        return found
    quanta = [_quantum(axis) for axis in values.T]
    if min(quanta) > 0.0:
        text = ", ".join(f"{q / scale:.3g}" for q in quanta)
        found.append(fact(subject, f"Resolution of x, y, z: {text} {unit}.", resolution_si=quanta))
    for name, axis, quantum in zip("xyz", values.T, quanta, strict=True):
        found += _of_axis(subject, name, axis, quantum, unit, scale)
    return found


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
    found = []
    spread = float(np.std(np.diff(axis)))
    longest, start = _longest_run(axis)
    if longest >= _LEAST_FROZEN and not _usual(axis, start, longest) and _frozen(axis, start, longest, quantum):
        found.append(
            doubt(
                subject,
                f"The {name} channel of the {subject} gives the same number {longest} times in a row, from row "
                f"{start + 1}.",
                "The sensor or the logger froze there: treat it as a gap.",
                channel=name,
                frozen=longest,
            )
        )
    for extreme, word in ((float(axis.max()), "largest"), (float(axis.min()), "least")):
        at = axis == extreme
        runs, first = _longest_run(np.where(at, 1.0, np.arange(len(axis)) + 2.0))
        expected = _longest_run(np.where(at, np.arange(len(axis)) + 2.0, axis))[0]  # a resolution repeats any value
        beyond = abs(extreme - np.median(axis)) > 4.0 * max(spread, quantum)
        if runs >= _SATURATED and runs > expected and at[first] and beyond:
            found.append(
                doubt(
                    subject,
                    f"The {name} channel of the {subject} stays at its {word} value, {extreme / scale:.5g} {unit}, "
                    f"for {runs} samples from row {first + 1}; {int(at.sum())} samples have this value.",
                    "The sensor is saturated there; its range is too small, or the value marks missing samples.",
                    channel=name,
                    saturated=int(at.sum()),
                )
            )
    return found


def _frozen(axis: Array, start: int, length: int, quantum: float) -> bool:
    """Return whether noise of the size beside a run of equal values would not give such a run.

    A noise of σ about the middle of a step q, where equal values are most frequent, gives the same number with the
    probability p = erf(q/(2√2 σ)). Of N samples, N pᴸ runs of the length L are expected at most. σ is that of the
    calmer side of the run, over its length.

    Args:
        axis: the channel, (N,).
        quantum: the resolution; 0 if it is finer than the numbers show.
    """
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
