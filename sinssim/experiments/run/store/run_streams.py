"""The streams of a run in memory, by name, as arrays, Arrow, pandas or polars: the columns of its Parquet files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sinssim.experiments.run.store.filter_streams import filter_streams
from sinssim.recording.store.streams import error_stream, imu_stream, nav_stream, reference_stream, truth_stream
from sinssim.recording.streams import Stream
from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.experiments.run.result import Run


def streams_of_run(run: Run) -> Iterator[Stream]:
    """Yield the streams that a run in memory has."""
    truth = run.truth
    if isinstance(truth, Truth):
        yield truth_stream(truth.time, truth.state)
        yield imu_stream("ideal", truth.ideal)
    elif truth.reference is not None:
        yield reference_stream(truth.reference)
    yield imu_stream("measured", run.sensed.measured)
    for name, solution in run.solutions.items():
        yield nav_stream(name, solution)
        if name in run.errors:
            yield error_stream(name, run.errors[name].at, solution.time)
    if run.aided is not None:
        yield from filter_streams(run.aided)
