"""Thinning for the screen: the picture stays the same, and so do extremes, gaps, ends and the rows around events."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import BLOCK
from sinssim.recording.rerun_file import AROUND, COLUMNS, is_long, screen_rows, screen_vectors
from sinssim.recording.streams import Stream, Vector

COUNT = 200_004
"""No multiple of a column of pixels is a row: 200 003 and 4000 have no common divisor."""


@pytest.fixture(scope="module")
def series() -> tuple[np.ndarray, np.ndarray]:
    """Noise, a smooth line with one spike of a single row, and a step with gaps."""
    rng, time = np.random.default_rng(1), np.arange(COUNT) / 100.0
    smooth = np.sin(time / 200.0)
    smooth[123_457] = 5.0
    step = np.where(time < 777.77, 0.0, 1.0)
    step[50_000:60_000] = np.nan
    step[70_001] = np.nan
    return time, np.column_stack((rng.standard_normal(COUNT), smooth, step))


def test_extremes_of_each_column_stay(series):
    time, values = series
    rows = screen_rows(time, values, time[0], time[-1])
    kept = np.zeros(COUNT, dtype=bool)
    kept[rows] = True
    column = np.minimum(((time - time[0]) / (time[-1] - time[0]) * COLUMNS).astype(int), COLUMNS - 1)
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    for reduce in (np.fmin, np.fmax):
        everything = reduce.reduceat(values, starts)
        of_kept = reduce.reduceat(np.where(kept[:, np.newaxis], values, np.nan), starts)
        np.testing.assert_array_equal(everything[:, :2], of_kept[:, :2])
    assert {0, COUNT - 1, 123_457} <= set(rows)
    assert len(rows) < 2 * 3 * COLUMNS + 8


def test_a_step_needs_few_rows_and_is_drawn_as_it_is(series):
    time, values = series
    step = values[:, 2:]
    rows = screen_rows(time, step, time[0], time[-1])
    assert len(rows) < 20
    drawn = np.interp(time, time[rows], step[rows, 0])
    known = ~np.isnan(step[:, 0]) & ~np.isnan(drawn)
    late = np.flatnonzero(drawn[known] != step[known, 0])
    assert len(late) <= 50  # within the column of the step: half a second of 2000
    assert known.sum() >= COUNT - 10_001 - 2


def test_gaps_begin_and_end_where_they_did(series):
    time, values = series
    rows = set(screen_rows(time, values, time[0], time[-1]))
    assert {49_999, 50_000, 59_999, 60_000, 70_000, 70_001, 70_002} <= rows


def test_rows_around_events_stay(series):
    time, values = series
    rows = set(screen_rows(time, values, time[0], time[-1], [999.99]))
    assert set(range(99_999 - AROUND, 99_999 + AROUND)) <= rows


def test_the_picture_is_the_same():
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = 60_001
    time = np.arange(count) / 100.0
    values = np.random.default_rng(4).normal(np.sin(time / 60.0), 0.2)
    values[31_415] = 5.0

    def picture(rows: np.ndarray | slice) -> np.ndarray:
        figure = Figure(figsize=(10.0, 2.5), dpi=100)
        canvas, axes = FigureCanvasAgg(figure), figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(time[0], time[-1]), ylim=(-6.0, 6.0))
        axes.plot(time[rows], values[rows], linewidth=1.0, antialiased=False)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., 0] < 128

    whole = picture(slice(None))
    thin = picture(screen_rows(time, values[:, np.newaxis], time[0], time[-1]))
    plain = picture(slice(None, None, 8))  # as many rows
    assert whole.sum() > 20_000
    assert (whole != thin).sum() < 0.002 * whole.sum()
    assert (whole != plain).sum() > 0.05 * whole.sum()


def test_a_stream_is_thinned_block_by_block_without_a_trace_of_the_blocks(series):
    time, values = series
    stream = Stream("s", time, (Vector("a", ("a", "b", "c"), values), Vector("b", ("c",), values[:, 2:])))
    found = {name: (t, v) for name, t, v in screen_vectors(stream, [999.99])}
    alone = screen_rows(time, values, time[0], time[-1], [999.99])
    ends = [row for k in range(0, COUNT, BLOCK) for row in (k, min(k + BLOCK, COUNT) - 1)]
    assert set(time[alone]) <= set(found["a"][0])
    assert len(found["a"][0]) <= len(alone) + 7 * len(ends)  # a column cut by a block has extremes in both parts
    assert len(found["b"][0]) < 200 < len(found["a"][0])  # a step needs few rows
    k = np.searchsorted(time, found["a"][0])
    np.testing.assert_array_equal(found["a"][1], values[k])


@pytest.mark.parametrize("place", [BLOCK - 3, BLOCK, BLOCK + 1, BLOCK + AROUND - 1, 7])
def test_rows_around_an_event_stay_at_the_edge_of_a_block(place: int) -> None:
    """A constant needs its ends alone; an event lies at a row, or between two of them."""
    time = np.arange(3.0 * BLOCK)
    stream = Stream("s", time, (Vector("a", ("a",), np.full((len(time), 1), 2.5)),))
    for at in (float(place), place - 0.5):
        ((_, kept, values),) = screen_vectors(stream, [at])
        assert set(np.arange(max(place - AROUND, 0), place + AROUND, dtype=float)) <= set(kept)
        assert len(kept) <= 6 + 3 * AROUND
        assert set(values.ravel()) == {2.5}


def test_a_constant_is_drawn_by_its_ends() -> None:
    time = 50.0 + np.arange(9000.0)
    rows = screen_rows(time, np.full((9000, 2), -3.5), time[0], time[-1])
    assert rows.tolist() == [0, 8999]
    rows = screen_rows(time, np.full((9000, 2), -3.5), time[0], time[-1], [4050.5])  # between rows 4000 and 4001
    assert rows.tolist() == [0, *range(4001 - AROUND, 4001 + AROUND), 8999]


def test_sparse_parts_of_a_record_stay_whole():
    time = np.concatenate((np.arange(0.0, 1.0, 1e-5), np.arange(1.0, 1000.0)))
    values = np.random.default_rng(2).standard_normal((len(time), 1))
    rows = screen_rows(time, values, time[0], time[-1])
    assert set(range(100_001, len(time))) <= set(rows)
    assert len(rows) < 999 + 20


def test_what_a_screen_can_show_is_not_long():
    assert not is_long(2 * COLUMNS)
    assert is_long(2 * COLUMNS + 1)
    np.testing.assert_array_equal(screen_rows(np.array([3.0, 3.0]), np.ones((2, 1)), 3.0, 3.0), [0, 1])
