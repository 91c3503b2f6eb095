"""What an alignment shows and writes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sinssim.analyses.alignment.report import AlignmentResult
from sinssim.errors import InputError
from sinssim.exhibits import Exhibits
from sinssim.recording.result import Media
from sinssim.recording.streams import Stream


class AlignmentMedia(Media[AlignmentResult]):
    """Numbers, streams, figure and files of an alignment."""

    def streams(self, result: AlignmentResult) -> Iterator[Stream]:
        from sinssim.recording.store.streams import imu_stream

        yield imu_stream("measured", result.imu)

    def exhibits(self, result: AlignmentResult) -> Exhibits:
        from sinssim.analyses.alignment.alignment_exhibits import exhibits_of

        return exhibits_of(result)

    def figure(self, result: AlignmentResult, quantity: str | None = None) -> Any:
        from sinssim.analyses.alignment.alignment_exhibits import has_expectation

        if not has_expectation(result):
            raise InputError(
                f"{result.source}: nothing to plot: the expected errors need the sensors' grade (--grade for a log) "
                "and a determined attitude and latitude."
            )
        return super().figure(result, quantity)

    def save(self, result: AlignmentResult, directory: Path, *, overwrite: bool) -> Path:
        from sinssim.analyses.alignment.alignment_files import write_alignment

        return write_alignment(result, directory, overwrite=overwrite)


AlignmentResult.media = AlignmentMedia()
