"""What a calibration shows and writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.recording.result import Media


class CalibrationMedia(Media[CalibrationResult]):
    """Numbers, streams, figure and files of a calibration."""

    def summary(self, result: CalibrationResult) -> dict[str, Any]:
        from sinssim.analyses.calibration.calibration_files import to_json as of_calibration

        return of_calibration(result)

    def figure(self, result: CalibrationResult, quantity: str | None = None) -> Any:
        from sinssim.analyses.calibration.calibration_figure import parameters_figure

        return parameters_figure(result)

    def save(self, result: CalibrationResult, directory: Path, *, overwrite: bool) -> Path:
        from sinssim.analyses.calibration.calibration_files import write_calibration

        return write_calibration(result, directory, overwrite=overwrite)


CalibrationResult.media = CalibrationMedia()
