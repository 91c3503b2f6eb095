"""The parked vehicle: heading, roll, pitch and latitude from gyros and accelerometers, and their errors."""

from sinssim.alignment.axes import Angles, Attitude, paper_axes
from sinssim.alignment.budget import (
    AVERAGED,
    SOURCES,
    Expected,
    bias_takes_over,
    error_budget,
    expected_errors,
    largest_drift,
    total,
)
from sinssim.alignment.determination import Determination, determine, ideal_readings
from sinssim.alignment.disturbed import DisturbedAlignment, align_disturbed
from sinssim.alignment.initial import STATES, initial_covariance, initial_state
from sinssim.alignment.orientation import BestHeadings, best_headings, set_sigma
from sinssim.alignment.session import Stillness, determine_session, mean_readings, stillness
from sinssim.alignment.theory import (
    Coefficients,
    ErrorStatistics,
    InstrumentErrors,
    coefficients,
    error_statistics,
    errors,
)

__all__ = [
    "AVERAGED",
    "SOURCES",
    "STATES",
    "Angles",
    "Attitude",
    "BestHeadings",
    "Coefficients",
    "Determination",
    "DisturbedAlignment",
    "ErrorStatistics",
    "Expected",
    "InstrumentErrors",
    "Stillness",
    "align_disturbed",
    "best_headings",
    "bias_takes_over",
    "coefficients",
    "determine",
    "determine_session",
    "error_budget",
    "error_statistics",
    "errors",
    "expected_errors",
    "ideal_readings",
    "initial_covariance",
    "initial_state",
    "largest_drift",
    "mean_readings",
    "paper_axes",
    "set_sigma",
    "stillness",
    "total",
]
