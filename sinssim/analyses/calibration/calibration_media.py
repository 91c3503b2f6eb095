"""What a calibration shows and writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.exhibits import Exhibits
from sinssim.recording.result import Media


class CalibrationMedia(Media[CalibrationResult]):
    """Numbers, streams, figure and files of a calibration."""

    def summary(self, result: CalibrationResult) -> dict[str, Any]:
        from sinssim.analyses.calibration.calibration_files import to_json as of_calibration

        return of_calibration(result)

    def exhibits(self, result: CalibrationResult) -> Exhibits:
        from sinssim.analyses.calibration.calibration_exhibits import exhibits_of

        return exhibits_of(result)

    def save(self, result: CalibrationResult, directory: Path, *, overwrite: bool) -> Path:
        from sinssim.analyses.calibration.calibration_files import write_calibration

        return write_calibration(result, directory, overwrite=overwrite)


CalibrationResult.media = CalibrationMedia()
