"""What a study shows and writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sinssim.errors import InputError
from sinssim.experiments.studies.results import StudyResult
from sinssim.recording.result import Media
from sinssim.recording.store.directory import write_directory


class StudyMedia(Media[StudyResult]):
    """Numbers, streams, figure and files of a study."""

    def summary(self, result: StudyResult) -> dict[str, Any]:
        from sinssim.experiments.studies.study_files import results

        return results(result)

    def figure(self, result: StudyResult, quantity: str | None = None) -> Any:
        from sinssim.experiments.studies.naming import labeller, line_labeller, over_rates
        from sinssim.experiments.studies.study_charts import against_rate, bars, palette
        from sinssim.recording.figures.charts import figure_of

        paint = palette(result)
        for part in result.study.parts:
            rows = [row for row in result.of_part(part.title) if row.status == "done"]
            if rows and over_rates(part):
                return figure_of(against_rate(rows, labeller(rows), paint))
            if rows:
                return figure_of(bars(rows, labeller(rows, pace=True), line_labeller(part, rows), paint))
        raise InputError(f"the study {result.study.name} has no finished navigation to draw.")

    def save(self, result: StudyResult, directory: Path, *, overwrite: bool) -> Path:
        from sinssim.experiments.studies.study_files import write_study

        return write_directory(directory, lambda folder: write_study(result, folder), overwrite=overwrite)


StudyResult.media = StudyMedia()
