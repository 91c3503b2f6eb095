"""Rows of a long stream that a screen can show: extremes, gaps and events stay, at their exact times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.jit import strict_kernel
from sinssim.recording.scales import Rows
from sinssim.recording.streams import Stream, blocks

COLUMNS = 4000
"""Columns of pixels that are told apart: a wide screen has as many."""
AROUND = 10
"""Rows on each side of an event that are kept whole."""


@strict_kernel
def _mark_k(time: Array, values: Array, start: float, width: float, kept: NDArray[np.bool_]) -> None:
    """Mark the rows with the least and the greatest value of each series in each column, and the ends of gaps."""
    rows, series = values.shape
    for j in range(series):
        held = np.nan  # the value of a column of pixels in which the series is constant
        first = 0
        while first < rows:
            edge = start + width * (np.floor((time[first] - start) / width) + 1.0)
            low, high = np.inf, -np.inf
            at_low, at_high = -1, -1
            i = first
            while i == first or (i < rows and time[i] < edge):
                v = values[i, j]
                if v < low:
                    low, at_low = v, i
                if v > high:
                    high, at_high = v, i
                if i > 0 and np.isnan(v) != np.isnan(values[i - 1, j]):
                    kept[i - 1] = kept[i] = True
                i += 1
            if not (low == high and low == held):
                if at_low >= 0:
                    kept[at_low] = True
                if at_high >= 0:
                    kept[at_high] = True
            held = low if low == high else np.nan
            first = i


def is_long(count: int) -> bool:
    """Return whether a stream has more rows than a screen can show."""
    return count > 2 * COLUMNS


def screen_rows(time: Array, values: Array, start: float, end: float, events: Sequence[float] = ()) -> Rows:
    """Return the rows that draw the same picture as all of them.

    In each column of pixels these are, for each series, the row with its least and that with its greatest value. The
    first and the last row, both rows at the ends of a gap (NaN), and the rows around events stay. No value or time is
    changed, and no extreme is lost.

    Args:
        time: (N,) s, in order; all rows of a stream or a block of them.
        values: (N, k), the series that share the rows.
        start: time of the first column, s, at most `time[0]`.
        end: end of the last of `COLUMNS` columns, s.
        events: times around which all rows stay, s.
    """
    count = len(time)
    if count <= 2 or end <= start:
        return np.arange(count)
    kept = np.zeros(count, dtype=np.bool_)
    _mark_k(time, np.ascontiguousarray(values, dtype=np.float64), start, (end - start) / COLUMNS, kept)
    kept[[0, -1]] = True
    for at in np.searchsorted(time, np.asarray(events, dtype=np.float64)):
        kept[max(0, at - AROUND) : at + AROUND] = True
    return np.flatnonzero(kept)


def screen_vectors(stream: Stream, events: Sequence[float] = ()) -> Iterator[tuple[str, Array, Array]]:
    """Yield the vectors of a long stream with the rows that a screen can show.

    Args:
        stream: the stream, of which one block of rows after the other is computed.
        events: times around which all rows stay, s.

    Yields:
        Name of the vector, times (M,) s and values (M, k), exact rows of the stream; each vector has its own rows.
    """
    start, end = float(stream.time[0]), float(stream.time[-1])
    found: dict[str, list[tuple[Array, Array]]] = {vector.name: [] for vector in stream.vectors}
    places = np.searchsorted(stream.time, np.asarray(events, dtype=np.float64))
    for rows in blocks(len(stream.time)):
        time = stream.time[rows]
        near = [at for at, place in zip(events, places, strict=True)
                if rows.start - AROUND < place < rows.stop + AROUND]  # fmt: skip
        for vector in stream.vectors:
            values = vector.values[rows]
            k = screen_rows(time, values, start, end, near)
            found[vector.name].append((time[k], values[k]))
    for name, parts in found.items():
        yield name, np.concatenate([times for times, _ in parts]), np.concatenate([values for _, values in parts])
