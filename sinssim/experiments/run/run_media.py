"""What a run shows and writes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from sinssim.experiments.run.result import Run
from sinssim.recording.result import Media, Result
from sinssim.recording.streams import Stream


class RunMedia(Media[Run]):
    """Numbers, streams, figure and files of a run."""

    def __init__(self, write: Callable[..., Result]) -> None:
        self._write = write

    def streams(self, result: Run) -> Iterator[Stream]:
        from sinssim.experiments.run.store.run_streams import streams_of_run

        yield from streams_of_run(result)

    def figure(self, result: Run, quantity: str | None = None) -> Any:
        from sinssim.experiments.run.report.errors import figure_charts
        from sinssim.recording.figures.charts import figure_of

        return figure_of(figure_charts(result))

    def save(self, result: Run, directory: Path, *, overwrite: bool) -> Path:
        place = self._write(result.scenario, directory, overwrite=overwrite).directory
        assert place is not None
        return Path(place)
