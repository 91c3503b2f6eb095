"""Logs the monitoring of a redundant set for the viewer: test statistics, sensors in use, errors with and without."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.experiments.run.store.summaries.redundancy_summary import NAMES, window_names
from sinssim.recording import style
from sinssim.recording.scales import thinned
from sinssim.scales import ANGLES, LENGTHS, suiting
from sinssim.truth.channel import FlightEvent

if TYPE_CHECKING:
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.sensors.sets.monitor import Monitored
    from sinssim.strapdown.nav_error import NavError


def draw_monitoring(recording: Recording, time: Array, found: Sequence[Monitored]) -> dict[str, str]:
    """Record the parity tests, below `redundancy/`.

    Args:
        recording: the recording.
        time: edges of the samples, (N+1,) s.
        found: gyros and accelerometers.

    Returns:
        Labels for the views' titles.
    """
    labels = {"redundancy": "yes"}
    rows = thinned(len(time) - 1)
    at = time[1:][rows]
    for one in found:
        names = window_names(one.windows)
        peaks = np.fmax.reduceat(one.statistic, rows, axis=1).T
        paint = style.colors([f"window {name}" for name in names])
        where = f"redundancy/{one.kind}"
        recording.series(f"{where}/statistic", at, peaks, names, colors=paint, widths=1.2)
        grey = [style.COLORS["refused"]]
        limit = one.threshold[rows, np.newaxis]
        recording.series(f"{where}/threshold", at, limit, ["threshold"], colors=grey, widths=2.0)
        used = one.used[rows].astype(np.float64) * np.arange(1, one.used.shape[1] + 1)
        numbers = [str(number) for number in range(1, one.used.shape[1] + 1)]
        recording.series(f"{where}/used", at, np.where(used, used, np.nan), numbers, widths=3.0)
        labels[f"redundancy_{one.kind}_threshold"] = f"{np.nanmax(one.threshold):.6g}"
    return labels


def draw_with_and_without(recording: Recording, own: tuple[str, NavError], without: NavError) -> dict[str, str]:
    """Record the errors of the first algorithm with and without monitoring, below `redundancy/`.

    Args:
        recording: the recording.
        own: the algorithm, and its errors with monitoring.
        without: its errors without monitoring.

    Returns:
        Labels for the views' titles.
    """
    name, error = own
    names, labels = ["without monitoring", "with monitoring"], {"redundancy_algorithm": name}
    paint = [style.COLORS["refused"], style.COLORS["aided"]]
    rows = thinned(min(len(error.time), len(without.time)))
    for key, table, values in (
        ("horizontal", LENGTHS, [without.horizontal[rows], error.horizontal[rows]]),
        ("attitude", ANGLES, [without.angle[rows], error.angle[rows]]),
    ):
        labels[f"redundancy_{key}"], size = suiting(table, *values)
        lines = np.column_stack(values) / size
        recording.series(f"redundancy/{key}", error.time[rows], lines, names, colors=paint, widths=[3.0, 1.5])
    return labels


def alarm_events(found: Sequence[Monitored]) -> Iterator[FlightEvent]:
    """Yield the events of the monitoring.

    Args:
        found: gyros and accelerometers.

    Yields:
        Detection of each fault, and exclusion of its sensor.
    """
    for one in found:
        name = NAMES[one.kind]
        for alarm in one.alarms:
            if alarm.sensor is None or alarm.isolated is None:
                yield FlightEvent(alarm.detected, f"fault of the {name}s detected, not isolated")
                continue
            if alarm.isolated > alarm.detected:
                yield FlightEvent(alarm.detected, f"fault of the {name}s detected")
            yield FlightEvent(alarm.isolated, f"{name} {alarm.sensor} excluded")
