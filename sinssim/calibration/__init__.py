"""Calibration on a turntable: errors of gyros and accelerometers from separate tests or from navigation errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.calibration.calibrate import calibrate
    from sinssim.calibration.result import CalibrationResult

__all__ = ["CalibrationResult", "calibrate"]

__getattr__, __dir__ = on_first_use(
    __name__, {"CalibrationResult": "sinssim.calibration.result", "calibrate": "sinssim.calibration.calibrate"}
)
