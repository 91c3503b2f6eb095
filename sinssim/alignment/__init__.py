"""Alignment of a parked vehicle: heading, roll, pitch and latitude from gyros and accelerometers, and their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.alignment.alignment_budget import AVERAGED as AVERAGED
    from sinssim.alignment.alignment_budget import MOTION as MOTION
    from sinssim.alignment.alignment_budget import SOURCES as SOURCES
    from sinssim.alignment.alignment_budget import BestHeadings as BestHeadings
    from sinssim.alignment.alignment_budget import Expected as Expected
    from sinssim.alignment.alignment_budget import best_headings as best_headings
    from sinssim.alignment.alignment_budget import bias_takes_over as bias_takes_over
    from sinssim.alignment.alignment_budget import error_budget as error_budget
    from sinssim.alignment.alignment_budget import expected_errors as expected_errors
    from sinssim.alignment.alignment_budget import set_sigma as set_sigma
    from sinssim.alignment.alignment_budget import total as total
    from sinssim.alignment.base_motion import Departure as Departure
    from sinssim.alignment.base_motion import Drift as Drift
    from sinssim.alignment.base_motion import Stillness as Stillness
    from sinssim.alignment.base_motion import determine_session as determine_session
    from sinssim.alignment.base_motion import largest_drift as largest_drift
    from sinssim.alignment.base_motion import motion_errors as motion_errors
    from sinssim.alignment.base_motion import stillness as stillness
    from sinssim.alignment.determination import Determination as Determination
    from sinssim.alignment.determination import determine as determine
    from sinssim.alignment.determination import mean_readings as mean_readings
    from sinssim.alignment.disturbed_base import DisturbedAlignment as DisturbedAlignment
    from sinssim.alignment.disturbed_base import align_disturbed as align_disturbed
    from sinssim.alignment.initial_conditions import STATES as STATES
    from sinssim.alignment.initial_conditions import initial_covariance as initial_covariance
    from sinssim.alignment.initial_conditions import initial_state as initial_state
    from sinssim.alignment.parked_theory import Angles as Angles
    from sinssim.alignment.parked_theory import Attitude as Attitude
    from sinssim.alignment.parked_theory import Coefficients as Coefficients
    from sinssim.alignment.parked_theory import ErrorStatistics as ErrorStatistics
    from sinssim.alignment.parked_theory import InstrumentErrors as InstrumentErrors
    from sinssim.alignment.parked_theory import coefficients as coefficients
    from sinssim.alignment.parked_theory import error_statistics as error_statistics
    from sinssim.alignment.parked_theory import errors as errors
    from sinssim.alignment.parked_theory import ideal_readings as ideal_readings
    from sinssim.alignment.parked_theory import paper_axes as paper_axes

__getattr__, __dir__, __all__ = on_first_use(__name__)
