"""Calibration on a turntable: errors of gyros and accelerometers from separate tests or from navigation errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.analyses.calibration.calibrate import calibrate as calibrate
    from sinssim.analyses.calibration.result import CalibrationResult as CalibrationResult

__getattr__, __dir__, __all__ = on_first_use(__name__)
