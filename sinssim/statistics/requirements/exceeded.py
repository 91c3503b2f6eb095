"""Since when a requirement over the whole run is exceeded, and how long after the last fix that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.statistics.requirements.requirement import Requirement


@dataclass(frozen=True)
class Exceeded:
    """The first time at which a limit is exceeded.

    Attributes:
        time: the time, s since the start.
        fixes_end: time of the last fix before it, if it lies in an outage, s since the start; None otherwise.
    """

    time: float
    fixes_end: float | None = None

    @property
    def text(self) -> str:
        """In words: "exceeded from 1319 s, 119 s after the fixes end"."""
        shown = float(round(self.time) if self.time >= 100.0 else f"{self.time:.3g}")
        text = f"exceeded from {shown:.10g} s" if shown else "exceeded from the start"
        if self.fixes_end is None:
            return text
        return f"{text}, {max(shown - self.fixes_end, 0.0):.4g} s after the fixes end"

    @property
    def numbers(self) -> dict[str, float | None]:
        """The time, and how long after the last fix it is, s; by name."""
        after = None if self.fixes_end is None else self.time - self.fixes_end
        return {"exceeded_from_s": self.time, "after_fixes_end_s": after}


NEVER = {"exceeded_from_s": None, "after_fixes_end_s": None}
"""The numbers of a limit that is not exceeded."""


def first_exceeded(
    requirement: Requirement, time: Array, values: Array, outages: Sequence[tuple[float, float]] = ()
) -> Exceeded | None:
    """Return since when a requirement over the whole run is exceeded.

    Args:
        time: instants, (E,) s since the start.
        values: its quantity at these instants, (E,) SI; NaN where it is unknown.
        outages: beginning and end of each interval without fixes, s since the start; they may overlap.

    Returns:
        The first time, on the straight line between two instants; None if the limit is not exceeded, or holds at one
        time only.
    """
    above = np.flatnonzero(values > requirement.limit)
    if requirement.when != "run" or not len(above):
        return None
    first = int(above[0])
    at, value = float(time[first]), float(values[first])
    if first > 0 and np.isfinite(value) and np.isfinite(values[first - 1]):
        before = float(values[first - 1])
        at -= (at - float(time[first - 1])) * (value - requirement.limit) / (value - before)
    ended = [begin for begin, end in outages if begin <= at <= end]
    while ended and (earlier := [begin for begin, end in outages if begin < min(ended) <= end]):
        ended = earlier
    return Exceeded(at, min(ended, default=None))
