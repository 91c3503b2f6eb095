"""Names of columns: every quantity carries its unit, once. Streams are written block by block, every row once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim import data
from sinssim.data import Computed
from sinssim.recording.streams import Stream, Vector, channel_streams, write_stream
from sinssim.truth.sampling import Channel


@pytest.mark.parametrize(
    ("name", "unit", "column"),
    [
        ("airspeed_mps", "m/s", "airspeed_mps"),
        ("thrust_n", "N", "thrust_n"),
        ("load_factor", "g", "load_factor_g"),
        ("throttle", "", "throttle"),
        ("climb", "m/s", "climb_mps"),
    ],
)
def test_columns_of_channels_carry_their_unit_once(name: str, unit: str, column: str) -> None:
    (stream,) = channel_streams({name: Channel(np.arange(3.0), np.zeros(3), unit)})
    assert stream.vectors[0].columns == (column,)


@pytest.mark.parametrize("count", [0, 1, 100, 101, 250])
def test_a_stream_is_written_block_by_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    monkeypatch.setattr(data, "BLOCK", 100)
    time, rows, asked = np.arange(float(count)), np.random.default_rng(1).normal(size=(count, 2)), []

    def squares(part: slice) -> data.Array:
        asked.append(part.stop - part.start)
        return rows[part] ** 2

    stream = Stream("s", time, (Vector("a", ("a0", "a1"), rows), Vector("b", ("b0", "b1"), Computed(count, squares))))
    table = pq.read_table(write_stream(stream, tmp_path))
    assert table.column_names == ["time_s", "a0", "a1", "b0", "b1"]
    np.testing.assert_array_equal(table["time_s"], time)
    for k in range(2):
        np.testing.assert_array_equal(table[f"a{k}"], rows[:, k])
        np.testing.assert_array_equal(table[f"b{k}"], rows[:, k] ** 2)
    assert max(asked) <= 100
    assert sum(asked) == count
