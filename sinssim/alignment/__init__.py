"""The parked vehicle: heading, roll, pitch and latitude from gyros and accelerometers, and their errors."""

from sinssim.alignment.axes import Angles, Attitude, paper_axes
from sinssim.alignment.determination import Determination, determine, ideal_readings
from sinssim.alignment.theory import (
    Coefficients,
    ErrorStatistics,
    InstrumentErrors,
    coefficients,
    error_statistics,
    errors,
)

__all__ = [
    "Angles",
    "Attitude",
    "Coefficients",
    "Determination",
    "ErrorStatistics",
    "InstrumentErrors",
    "coefficients",
    "determine",
    "error_statistics",
    "errors",
    "ideal_readings",
    "paper_axes",
]
