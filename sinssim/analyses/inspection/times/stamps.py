"""The times of a stream: rate, jitter, gaps, duplicates, and a clock that goes back."""

from __future__ import annotations

import numpy as np

from sinssim.analyses.inspection.finding import Finding, doubt, fact, wrong
from sinssim.data import Array

GAP = 1.75
"""Intervals longer than this many median ones are gaps: the middle between one and two and a half, so that jitter of a
whole interval is not one and a missing sample is."""

_SHOWN = 5  # gaps named one by one


def time_findings(subject: str, time: Array, unit: str = "samples") -> list[Finding]:
    """Judge the times of a stream.

    Args:
        time: stamps, (N,) s.
    """
    count = len(time)
    if count < 2:
        return [wrong(subject, f"{subject} has {count} {unit}.", "At least two are needed.", count=count)]
    steps = np.diff(time)
    forward = steps[steps > 0.0]
    if not len(forward):
        return [wrong(subject, f"No time of {subject} follows the preceding one.", "The time column may be wrong.")]
    interval = float(np.median(forward))
    low, high = np.percentile(forward[forward < GAP * interval], (1.0, 99.0))
    found = [
        fact(
            subject,
            f"{count} {unit} from {time[0]:.6g} s to {time[-1]:.6g} s ({time[-1] - time[0]:.6g} s), "
            f"{1.0 / interval:.6g} a second; 98 % of the intervals last {1e3 * low:.4g} to {1e3 * high:.4g} ms.",
            count=count,
            start_s=float(time[0]),
            end_s=float(time[-1]),
            rate_hz=1.0 / interval,
            interval_1_percent_s=float(low),
            interval_99_percent_s=float(high),
        )
    ]
    found += _not_forward(subject, time, steps)
    gaps = np.flatnonzero(steps > GAP * interval)
    if len(gaps):
        missing = float(np.sum(np.rint(steps[gaps] / interval) - 1.0))
        where = ", ".join(f"{time[k]:.6g} s ({steps[k]:.3g} s)" for k in gaps[:_SHOWN])
        more = f" and {len(gaps) - _SHOWN} more" if len(gaps) > _SHOWN else ""
        found.append(
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
    return found


def _not_forward(subject: str, time: Array, steps: Array) -> list[Finding]:
    """Return findings on times that repeat or go back."""
    found = []
    same, back = np.flatnonzero(steps == 0.0), np.flatnonzero(steps < 0.0)
    if len(same):
        found.append(
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
        found.append(
            wrong(
                subject,
                f"The time of {subject} goes back {len(back)} time{'s' * (len(back) > 1)}, first in row {k + 2}: from "
                f"{time[k]:.9g} s to {time[k + 1]:.9g} s.",
                "The clock was reset or rows are out of order: cut the log there, or sort it.",
                backward=len(back),
                row=k + 2,
            )
        )
    return found
