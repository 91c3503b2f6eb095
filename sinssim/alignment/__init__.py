"""Alignment of a parked vehicle: heading, roll, pitch and latitude from gyros and accelerometers, and their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.alignment.axes import Angles as Angles
    from sinssim.alignment.axes import Attitude as Attitude
    from sinssim.alignment.axes import paper_axes as paper_axes
    from sinssim.alignment.base_motion import Departure as Departure
    from sinssim.alignment.base_motion import Stillness as Stillness
    from sinssim.alignment.base_motion import determine_session as determine_session
    from sinssim.alignment.base_motion import motion_errors as motion_errors
    from sinssim.alignment.base_motion import stillness as stillness
    from sinssim.alignment.budget import AVERAGED as AVERAGED
    from sinssim.alignment.budget import MOTION as MOTION
    from sinssim.alignment.budget import SOURCES as SOURCES
    from sinssim.alignment.budget import Expected as Expected
    from sinssim.alignment.budget import bias_takes_over as bias_takes_over
    from sinssim.alignment.budget import error_budget as error_budget
    from sinssim.alignment.budget import expected_errors as expected_errors
    from sinssim.alignment.budget import total as total
    from sinssim.alignment.determination import Determination as Determination
    from sinssim.alignment.determination import determine as determine
    from sinssim.alignment.disturbed import DisturbedAlignment as DisturbedAlignment
    from sinssim.alignment.disturbed import align_disturbed as align_disturbed
    from sinssim.alignment.drift import Drift as Drift
    from sinssim.alignment.drift import largest_drift as largest_drift
    from sinssim.alignment.initial_conditions import STATES as STATES
    from sinssim.alignment.initial_conditions import initial_covariance as initial_covariance
    from sinssim.alignment.initial_conditions import initial_state as initial_state
    from sinssim.alignment.orientation import BestHeadings as BestHeadings
    from sinssim.alignment.orientation import best_headings as best_headings
    from sinssim.alignment.orientation import set_sigma as set_sigma
    from sinssim.alignment.readings_at_rest import ideal_readings as ideal_readings
    from sinssim.alignment.session import mean_readings as mean_readings
    from sinssim.alignment.theory import Coefficients as Coefficients
    from sinssim.alignment.theory import ErrorStatistics as ErrorStatistics
    from sinssim.alignment.theory import InstrumentErrors as InstrumentErrors
    from sinssim.alignment.theory import coefficients as coefficients
    from sinssim.alignment.theory import error_statistics as error_statistics
    from sinssim.alignment.theory import errors as errors

__getattr__, __dir__, __all__ = on_first_use(__name__)
