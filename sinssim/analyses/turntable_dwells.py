"""The dwells of a sequence on a turntable: those of its plan, and those that the recorded rates show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.truth.motions.turntable import Turntable
from sinssim.units import DEG

_WINDOW = 0.5
"""Length of the windows in which a standing block is looked for, s."""
_STILL = 0.1
"""Largest mean rate of a standing block, in parts of the slowest turn."""
_MARGIN = 1.0
"""Time left out at both ends of a dwell that was found, s."""
_SHORTEST = 3.0
"""Shortest dwell that is found, s."""
_LEAST = 3
"""Fewest samples of a dwell."""


@dataclass(frozen=True)
class Dwells:
    """The samples of the dwells: all samples between two of them belong to a turn."""

    rows: Array  # first sample of each dwell, and the first after it, (P, 2)

    @property
    def turns(self) -> Array:
        """First sample of each turn, and the first after it, (P − 1, 2)."""
        return np.column_stack([self.rows[:-1, 1], self.rows[1:, 0]])

    def seconds(self, time: Array) -> Array:
        """Return beginning and end of each dwell, (P, 2) s."""
        return np.asarray(time[self.rows])


def planned(section: Turntable, time: Array) -> Dwells:
    """Return the dwells at the times of the sequence; `time` are the edges of the samples since its beginning, s."""
    return between(section.dwells, time, "turntable.dwell_s")


def between(spans: tuple[tuple[float, float], ...], time: Array, key: str) -> Dwells:
    """Return the samples of given dwells, `spans` in s; `key` names them in a scenario, for messages."""
    rows = []
    slack = 1e-6 * float(time[1] - time[0])
    for number, (begin, end) in enumerate(spans, start=1):
        if begin < time[0] - slack or end > time[-1] + float(time[1] - time[0]):
            raise InputError(
                f"{key}: dwell {number} from {begin:g} s to {end:g} s lies outside the data, which last from "
                f"{time[0]:g} s to {time[-1]:g} s."
            )
        first, last = int(np.searchsorted(time, begin - slack)), int(np.searchsorted(time, end + slack, "right")) - 1
        if last - first < _LEAST:
            raise InputError(
                f"{key}: dwell {number} lasts {end - begin:g} s and has {max(last - first, 0)} samples of "
                f"{time[1] - time[0]:g} s; it needs at least {_LEAST}."
            )
        rows.append((first, last))
    return Dwells(np.array(rows, dtype=np.intp))


def detected(imu: ImuData, section: Turntable) -> Dwells:
    """Return the dwells of a log: spans in which the gyros stand still, as many as the sequence has."""
    interval = float(np.median(np.diff(imu.time)))
    size = max(round(_WINDOW / interval), 1)
    count = len(imu) // size
    mean = np.add.reduceat(imu.dtheta[: count * size], np.arange(0, count * size, size)) / (size * interval)
    slowest = min((turn.rate_deg_s or section.rate_deg_s) * DEG for turn in section.all_turns)
    still = np.linalg.norm(mean - np.median(mean, axis=0), axis=1) < _STILL * slowest
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    margin = round(_MARGIN / interval)
    rows = [(a * size + margin, b * size - margin) for a, b in edges.reshape(-1, 2)]
    rows = [(a, b) for a, b in rows if (b - a) * interval >= _SHORTEST]
    wanted = len(section.dwells)
    if not rows:
        raise InputError(
            f"the log has no spans at rest of {_SHORTEST + 2.0 * _MARGIN:g} s: the mean rate of no such span is below "
            f"{_STILL * slowest / DEG:g}°/s, a tenth of the slowest turn. Give calibration.dwells_s, or the log of a "
            "sequence with dwells."
        )
    if len(rows) != wanted:
        raise InputError(
            f"the log has {len(rows)} spans at rest, but the sequence of [turntable] has {wanted} dwells. Give the "
            f"sequence that was run, or the times of the dwells in calibration.dwells_s; found: {_listed(rows, imu)}."
        )
    return Dwells(np.array(rows, dtype=np.intp))


def _listed(rows: list[tuple[int, int]], imu: ImuData) -> str:
    words = [f"{imu.time[a]:.0f}-{imu.time[b]:.0f} s" for a, b in rows[:8]]
    return ", ".join(words) + (", …" if len(rows) > 8 else "")
