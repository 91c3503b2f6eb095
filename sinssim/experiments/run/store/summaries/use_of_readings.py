"""The use of the readings of each aiding sensor: how many there were, and why the others were not used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from sinssim.estimation import Innovations
    from sinssim.simulation.aided.truth_comparison import Aided

BEFORE, AFTER, REJECTED = "before the start of the filter", "after the end of the filter", "rejected by the gate"
"""Reasons for which a reading is not used, beside those of `sinssim.estimation.intake`."""


def use_of_readings(aided: Aided) -> dict[str, dict[str, Any]]:
    """Return what became of the readings of each sensor.

    Returns:
        By sensor `readings`, all of them; `taken`, those that updated the filter; `unused`, the number of the others by
        reason. The numbers of `unused` and `taken` add up to `readings`.
    """
    total = {s.measurements.label: len(s.measurements) for s in aided.sensed}
    return {i.sensor: _of_sensor(i, total.get(i.sensor, len(i.time))) for i in aided.estimate.innovations}


def _of_sensor(i: Innovations, total: int) -> dict[str, Any]:
    unused = Counter({BEFORE: total - len(i.time)})
    for row in np.flatnonzero(~i.accepted).tolist():
        unused[REJECTED if np.isfinite(i.nis[row]) else i.reason[row] or AFTER] += 1
    return {
        "readings": total,
        "taken": int(np.count_nonzero(i.accepted)),
        "unused": {reason: number for reason, number in unused.items() if number},
    }


def unused_sentences(sensors: Mapping[str, Any]) -> Iterator[str]:
    """Report readings outside of the time of the filter; its own remarks report those within.

    Args:
        sensors: entry `sensors` of a filter in `summary.json`.
    """
    for reason in (BEFORE, AFTER):
        some = [(name, s["unused"].get(reason, 0), s["readings"]) for name, s in sensors.items()]
        words = [f"{number} of {total} of {name}" for name, number, total in some if number]
        if words:
            yield f"Measurements {reason}, which are not used: {', '.join(words)}."
