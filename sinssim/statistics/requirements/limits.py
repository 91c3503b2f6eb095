"""The limits of requirements as marks of a chart over time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sinssim.charts import Limit
from sinssim.statistics.requirements.requirement import SHARES, Requirement

CIRCLES = tuple(SHARES)
"""Quantities whose limits belong to the chart of CEP and R95."""

Judged = Sequence[tuple[Requirement, str]]
"""Requirements with their verdicts: "met", "not met" or "undecided"."""


def limits_of(judged: Judged, quantities: Iterable[str], end: float) -> list[Limit]:
    """Return the limits of the requirements on some quantities.

    Args:
        quantities: names of the quantities that a chart shows.
        end: end of the run, s since its start.

    Returns:
        One mark for each; the limit of a rate is the length that it allows at its time.
    """
    chosen, found = set(quantities), []
    for one, verdict in judged:
        if one.quantity in chosen:
            at = one.time if one.when == "at" else end
            height = one.limit * at if one.quantity == "rate" else one.limit
            found.append(Limit(text=one.text, verdict=verdict, height=height, at=None if one.when == "run" else at))
    return found
