"""Divergence checks and warnings of the filter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.result import Divergence, Innovations

CONTRADICTION_S, CONTRADICTION = 30.0, 10
"""For so long [s], and at least so often, all readings must be rejected before filter and sensors contradict."""


class Diverged(Exception):  # noqa: N818 - no error of the user's: the run ends there, and keeps what it has
    """That the filter cannot go on.

    Args:
        time: s.
        measurement: at which it was found.
        reason: one sentence without its full stop.
    """

    def __init__(self, time: float, measurement: str, reason: str) -> None:
        super().__init__(reason)
        self.divergence = Divergence(time, measurement, reason)


def check_covariance(covariance: Array, varying: NDArray[np.intp], time: float, measurement: str) -> None:
    """Raise for a covariance that none can be.

    Args:
        covariance: P, (n, n).
        varying: numbers of the states that are not known exactly.
        time: s.
        measurement: the last that was taken in.

    Raises:
        Diverged: P is not positive definite.
    """
    p = covariance if len(varying) == len(covariance) else covariance[np.ix_(varying, varying)]
    variance = p.diagonal()
    if variance.min() > 0.0:
        scale = 1.0 / np.sqrt(variance)
        try:
            np.linalg.cholesky(p * scale[:, None] * scale)  # row by row: products of two scales may overflow
        except np.linalg.LinAlgError:
            pass
        else:
            return
    raise Diverged(time, measurement, "the covariance is no longer positive definite")


def contradiction(innovations: Sequence[Innovations]) -> Divergence | None:
    """Find the first time from which on, for long, every reading of every sensor was rejected.

    Args:
        innovations: of all sensors.

    Returns:
        That filter and sensors contradict each other, None if they do not.
    """
    looked_at = [~np.isnan(i.nis) for i in innovations]
    time = np.concatenate([i.time[seen] for i, seen in zip(innovations, looked_at, strict=True)] or [np.zeros(0)])
    if not len(time):
        return None
    accepted = np.concatenate([i.accepted[seen] for i, seen in zip(innovations, looked_at, strict=True)])
    order = np.argsort(time, kind="stable")
    time, accepted = time[order], accepted[order]
    # runs of rejected readings
    edges = np.flatnonzero(np.diff(np.concatenate([[True], accepted, [True]]).astype(int)))
    for begin, end in edges.reshape(-1, 2):
        lasting = time[end - 1] - time[begin]
        if end - begin >= CONTRADICTION and lasting >= CONTRADICTION_S:
            which = next(
                f"{i.sensor} {row} (valid at {i.time[row]:.3f} s)"
                for i in innovations
                for row in np.flatnonzero((i.time == time[begin]) & ~i.accepted & ~np.isnan(i.nis))
            )
            return Divergence(
                float(time[begin]),
                which,
                f"from this reading on all {end - begin} readings of {lasting:.0f} s were rejected by the gate: either "
                "the sensors are wrong, or the filter believes in itself more than it should",
            )
    return None


def remarks(innovations: Sequence[Innovations], late: Sequence[int]) -> list[str]:
    """Say what became of readings that were not taken in.

    Args:
        innovations: of all sensors.
        late: how many readings of each arrive after the end.

    Returns:
        Whole sentences, none for a sensor all of whose readings were taken in.
    """
    found = [] if innovations else ["There are no measurements: the result is the inertial solution."]
    for i, later in zip(innovations, late, strict=True):
        count = len(i.time)
        if later > max(1, count // 10) or later == count > 0:  # the last ones may well be under way
            found.append(
                f"{i.sensor}: {later} of {count} readings arrive after the end of the run; the solution, known at each "
                "instant, is without them, and only smoothing has them."
            )
        rejected = int(np.count_nonzero(~i.accepted & ~np.isnan(i.nis)))
        unusable = Counter(reason for reason, nis in zip(i.reason, i.nis, strict=True) if np.isnan(nis) and reason)
        if not count:
            stood = " (the vehicle never stood still)" if i.kind in ("zero-velocity", "zero-rate") else ""
            found.append(f"{i.sensor}: no reading came{stood}, so that it corrects nothing.")
            continue
        why = ", ".join(f"{number} {reason}" for reason, number in unusable.items())
        if not i.accepted.any():
            detail = "; ".join(filter(None, [why, f"{rejected} rejected by the gate" if rejected else ""]))
            found.append(
                f"{i.sensor}: none of {count} readings was taken in{f' ({detail})' if detail else ''}, so that it "
                "corrects nothing."
            )
            continue
        if why:
            found.append(f"{i.sensor}: of {count} readings some could not be used ({why}).")
        if rejected:
            found.append(f"{i.sensor}: the gate rejected {rejected} of {count} readings.")
    if innovations and not any(i.accepted.any() for i in innovations):
        found.append("No reading was taken in at all: the result is the inertial solution.")
    return found
