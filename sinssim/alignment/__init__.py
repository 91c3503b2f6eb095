"""Alignment of a parked vehicle: heading, roll, pitch and latitude from gyros and accelerometers, and their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.alignment.axes import Angles, Attitude, paper_axes
    from sinssim.alignment.base_motion import Departure, Stillness, determine_session, motion_errors, stillness
    from sinssim.alignment.budget import (
        AVERAGED,
        MOTION,
        SOURCES,
        Expected,
        bias_takes_over,
        error_budget,
        expected_errors,
        total,
    )
    from sinssim.alignment.determination import Determination, determine
    from sinssim.alignment.disturbed import DisturbedAlignment, align_disturbed
    from sinssim.alignment.drift import Drift, largest_drift
    from sinssim.alignment.initial_conditions import STATES, initial_covariance, initial_state
    from sinssim.alignment.orientation import BestHeadings, best_headings, set_sigma
    from sinssim.alignment.readings_at_rest import ideal_readings
    from sinssim.alignment.session import mean_readings
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
    "MOTION",
    "SOURCES",
    "STATES",
    "Angles",
    "Attitude",
    "BestHeadings",
    "Coefficients",
    "Departure",
    "Determination",
    "DisturbedAlignment",
    "Drift",
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
    "motion_errors",
    "paper_axes",
    "set_sigma",
    "stillness",
    "total",
]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "AVERAGED": "sinssim.alignment.budget",
        "MOTION": "sinssim.alignment.budget",
        "Angles": "sinssim.alignment.axes",
        "Attitude": "sinssim.alignment.axes",
        "BestHeadings": "sinssim.alignment.orientation",
        "Coefficients": "sinssim.alignment.theory",
        "Departure": "sinssim.alignment.base_motion",
        "Drift": "sinssim.alignment.drift",
        "motion_errors": "sinssim.alignment.base_motion",
        "Determination": "sinssim.alignment.determination",
        "DisturbedAlignment": "sinssim.alignment.disturbed",
        "ErrorStatistics": "sinssim.alignment.theory",
        "Expected": "sinssim.alignment.budget",
        "InstrumentErrors": "sinssim.alignment.theory",
        "SOURCES": "sinssim.alignment.budget",
        "STATES": "sinssim.alignment.initial_conditions",
        "Stillness": "sinssim.alignment.base_motion",
        "align_disturbed": "sinssim.alignment.disturbed",
        "best_headings": "sinssim.alignment.orientation",
        "bias_takes_over": "sinssim.alignment.budget",
        "coefficients": "sinssim.alignment.theory",
        "determine": "sinssim.alignment.determination",
        "determine_session": "sinssim.alignment.base_motion",
        "error_budget": "sinssim.alignment.budget",
        "error_statistics": "sinssim.alignment.theory",
        "errors": "sinssim.alignment.theory",
        "expected_errors": "sinssim.alignment.budget",
        "ideal_readings": "sinssim.alignment.readings_at_rest",
        "initial_covariance": "sinssim.alignment.initial_conditions",
        "initial_state": "sinssim.alignment.initial_conditions",
        "largest_drift": "sinssim.alignment.drift",
        "mean_readings": "sinssim.alignment.session",
        "paper_axes": "sinssim.alignment.axes",
        "set_sigma": "sinssim.alignment.orientation",
        "stillness": "sinssim.alignment.base_motion",
        "total": "sinssim.alignment.budget",
    },
)
