"""Calibration on a turntable: errors of gyros and accelerometers from separate tests or from navigation errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.analyses.calibration.calibration_result import CalibrationResult as CalibrationResult
    from sinssim.analyses.calibration.turntable_calibration import calibrate as calibrate

__getattr__, __dir__, __all__ = on_first_use(__name__)
