"""What the rules of all claims share: the numbers they judge, and the form of their results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from sinssim.experiments.studies.motions import MotionFacts
from sinssim.experiments.studies.results import NAN, ErrorGrowth, Heading, Row

FEW_TENTHS_ARCSEC = 18.0
"""The chapter's "few tenths of a minute of arc": 0.3′."""
ALLOWED_ARCSEC_H = 18.0
"""Attitude drift of a sufficient rate: 0.3′ in an hour, 0.005 deg/h, half of a gyro of the 1 nmi/h grade."""

EULER = "euler"
LOW_ORDER = ("poisson-1", "poisson-2", "quaternion-1", "quaternion-2", "two-quaternions")
"""Algorithms of first and second order."""
PLAIN = ("poisson-3", "poisson-4", "quaternion-3", "quaternion-4", "rotation-vector-1")
"""Algorithms of high order for a constant rate, with the increment in place of the rotation vector."""

LOOKS_AHEAD = ("quaternion", "poisson", "euler", "functional-iteration")
"""Algorithms whose step uses samples after its end, for recorded or delayed data: a rate fitted over five intervals,
two of them later, or a window."""


@dataclass(frozen=True)
class Evidence:
    """The numbers of the parts that decide a claim.

    Attributes:
        rows: finished cases.
        facts: characteristics of the motions by name.
        growth: returns the growth of the errors of a case over time.
        headings: headings through turns, by form.
    """

    rows: list[Row]
    facts: dict[str, MotionFacts] = field(default_factory=dict)
    growth: Callable[[Row], ErrorGrowth | None] = lambda row: None
    headings: Sequence[Heading] = ()


@dataclass(frozen=True)
class Point:
    """One line of a verdict.

    Attributes:
        text: motion, form and numbers.
        verdict: the verdict on this motion and form; "" for a line that only informs.
    """

    text: str
    verdict: str = ""


@dataclass(frozen=True)
class Outcome:
    """The result of a rule.

    Attributes:
        verdict: "confirmed", "partly", "refuted" or "undecided".
        reason: a sentence or two.
        points: the deciding numbers, motion by motion.
        numbers: the deciding numbers by name.
        measured: the figure that decides, with its unit.
        expected: the same figure if the claim held.
    """

    verdict: str
    reason: str
    points: tuple[Point, ...] = ()
    numbers: dict[str, float] = field(default_factory=dict)
    measured: str = ""
    expected: str = ""


def undecided(lacking: str) -> Outcome:
    """Return the outcome of a claim without its numbers."""
    return Outcome("undecided", f"The study lacks the numbers that decide it: {lacking}.")


def overall(points: Sequence[Point]) -> str:
    """Return the verdict on a claim that must hold on every motion.

    Returns:
        "confirmed" if all judged points are, "refuted" if all are, otherwise "partly".
    """
    judged = {point.verdict for point in points if point.verdict}
    return judged.pop() if len(judged) == 1 else "partly"


def by(rows: Sequence[Row], key: Callable[[Row], str]) -> dict[str, list[Row]]:
    """Return rows in groups, in the order of their first rows."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def of_motion(row: Row) -> str:
    """Return the motion of a row."""
    return row.motion


def base(algorithm: str) -> str:
    """Return the name of an algorithm without its correction after each step."""
    return algorithm.removesuffix("-ortho").removesuffix("-norm")


def needed(rows: Sequence[Row]) -> dict[str, Row]:
    """Return the lowest rate from which on the attitude drifts by at most 0.3′ in an hour.

    Returns:
        The row of that rate, by algorithm; none for an algorithm that exceeds the limit at its highest rate.
    """
    found = {}
    for algorithm, own in by(rows, lambda row: row.algorithm).items():
        enough = None
        for row in sorted(own, key=lambda row: -row.rate_hz):
            if not row.attitude_drift_arcsec_h <= ALLOWED_ARCSEC_H:
                break
            enough = row
        if enough is not None:
            found[algorithm] = enough
    return found


def drift_at(rows: Sequence[Row], algorithms: Sequence[str], rate_hz: float) -> float:
    """Return the least attitude drift of some algorithms at a rate.

    Returns:
        Arcsec/h; NaN if there is none.
    """
    own = [r for r in rows if base(r.algorithm) in algorithms and r.rate_hz == rate_hz]
    return min((row.attitude_drift_arcsec_h for row in own), default=NAN)
