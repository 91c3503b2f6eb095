"""The limits of requirements in a recording: lines throughout the run, and dots at their times."""

from __future__ import annotations

import numpy as np

from sinssim.recording.figures.limits import FAR, Judged, color_of, height_of, instant_of
from sinssim.recording.rerun.rrd import Recording


def record_limits(
    recording: Recording, entity: str, judged: Judged, unit: float, start: float, lasts: float, most: float
) -> None:
    """Record the limits of requirements below the entity of a plot; far ones are left out.

    Args:
        recording: the recording.
        entity: the plot's entity, whose range of values is extended.
        judged: the requirements whose quantities it shows, with their verdicts.
        unit: unit of the plot, SI.
        start: start of the run on the recording's time axis, s.
        lasts: length of the run, s.
        most: highest curve, SI.
    """
    low, high = recording.ranges[entity]
    for number, (one, verdict) in enumerate(judged, start=1):
        height = height_of(one, lasts)
        if height > FAR * most:
            continue
        name, color, value = f"{one.text}: {verdict}", color_of(verdict), np.full((1, 1), height / unit)
        place = f"{entity}/limit_{number}"
        if one.when == "run":
            recording.series(place, np.array([start, start + lasts]), value.repeat(2, axis=0), [name], colors=[color])
        else:
            at = np.array([start + instant_of(one, lasts)])
            recording.points(place, 1, at, value, [name], color, marker="down", size=6.0)
        low, high = min(low, height / unit), max(high, height / unit)
    recording.ranges[entity] = (low, high)
