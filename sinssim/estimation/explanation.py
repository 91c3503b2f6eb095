"""What explains innovations that speak against a filter: refused readings, the hypotheses that were tried."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Kind = Literal["state", "initial state", "measurement noise", "inertial noise", "bias walk"]
"""Kinds of hypotheses."""

ALIKE = 2.0 * math.log(100.0)
"""Difference of gains below which two explanations are called alike: one is at most a hundred times more probable."""


@dataclass(frozen=True)
class Refusals:
    """Consecutive refused readings of one sensor, more than chance explains.

    Attributes:
        sensor: its name.
        start, end: instants of the first and of the last one, s.
        count: number of them.
        mean: mean of the readings less their predictions, in the axes and the unit of the kind of measurement.
    """

    sensor: str
    start: float
    end: float
    count: int
    mean: tuple[float, ...] = ()


@dataclass(frozen=True)
class Hypothesis:
    """One explanation that was tried.

    Attributes:
        name: block of states; "initial heading" and the like; sensors whose σ is wrong, joined by ", "; "inertial
            noise"; or "gyro", "accelerometer".
        kind: what it is.
        value: estimates of the states, or the factor or density that explains the innovations best.
        sigma: 1σ of the estimates, or of the factors of σ; empty for another fitted size.
        gain: see `sinssim.estimation.checks.evidence.gain`.
        needed: gain from which it is named.
    """

    name: str
    kind: Kind
    value: tuple[float, ...]
    sigma: tuple[float, ...]
    gain: float
    needed: float


@dataclass(frozen=True)
class Diagnosis:
    """What the innovations of a filter say about its faults.

    Attributes:
        until: end of the time that was looked at, s.
        refusals: spans of refused readings.
        sizes: factor by which the innovations of each sensor are larger than assumed.
        hypotheses: all that were tried, the one with the largest gain first.
        runs: number of runs of the filter that the search took, and `seconds`, their duration, s.
        cut: whether the search ended at its limit, with hypotheses untried.
    """

    until: float
    refusals: tuple[Refusals, ...]
    sizes: Mapping[str, float]
    hypotheses: tuple[Hypothesis, ...]
    runs: int = 0
    seconds: float = 0.0
    cut: bool = False

    @property
    def cause(self) -> Hypothesis | None:
        """The best explanation; None if no hypothesis explains enough."""
        named = [one for one in self.hypotheses if one.gain > one.needed]
        return named[0] if named else None

    @property
    def alike(self) -> tuple[Hypothesis, ...]:
        """Other explanations that the readings can hardly tell from the cause."""
        cause = self.cause
        if cause is None:
            return ()
        return tuple(
            one
            for one in self.hypotheses
            if one is not cause and one.gain > one.needed and cause.gain - one.gain < ALIKE
        )
