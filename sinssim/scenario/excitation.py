"""Estimates the rotation and acceleration of a scenario's motion from its plan without flying it."""

from __future__ import annotations

import math
from typing import NamedTuple

from sinssim.earth.models import OMEGA_IE
from sinssim.scenario.duration import expected_duration, planned_turning
from sinssim.scenario.tables import Tables
from sinssim.truth.flight.plan import FlightPlan, Turbulence
from sinssim.truth.motions.closed_forms import AnyClosedForm
from sinssim.truth.motions.coning import ConingMotion, SpinConeMotion
from sinssim.truth.motions.rocking import ScullingMotion
from sinssim.truth.motions.rotation_table import DwellStep, RotationTableMotion
from sinssim.units import ARCSEC, DEG, G0

_RADIUS = 6.371e6  # radius of the Earth, m
_AIRLINER = 250.0  # m/s: largest usual ground speed; its effects are small
_SCALE, _SPAN = 533.0, 20.0  # scale of turbulence above 2000 ft (MIL-F-8785C), and a medium wing span, m


class Excitation(NamedTuple):
    """Rotation and acceleration that excite the errors of the inertial sensors.

    Attributes:
        duration: duration of the run, s.
        rate: ∫ω² dt over the run, rad²/s; ω is the rate relative to inertial space.
        force: ∫f² dt over the run, m²/s³; at least the effect of gravity.
    """

    duration: float
    rate: float
    force: float


def excitation(scenario: Tables) -> Excitation:
    """Estimate the rotation and acceleration of a scenario's motion.

    The estimate contains the Earth's rate and the transport rate, a flight's manoeuvres and turbulence or the rates of
    another motion, the turning of the block, angular vibration, and gravity. It is accurate to a factor of a few.

    Args:
        scenario: the scenario.

    Returns:
        The estimate.

    Raises:
        InputError: the aircraft's description is not right.
    """
    lasts = expected_duration(scenario)
    rate, turning = OMEGA_IE, 0.0
    if scenario.great_circle is not None:
        rate += scenario.great_circle.speed_mps / _RADIUS
    elif scenario.flight is not None:
        rate += _AIRLINER / _RADIUS
        turning = planned_turning(scenario.flight) + _gusts(scenario.flight) ** 2 * lasts
    elif scenario.track is not None:
        turning = scenario.track.prepared(scenario.truth).fit.turning
    elif (vehicle := scenario.drive or scenario.voyage) is not None:
        turning = vehicle.profile.turning
    elif scenario.motion is not None:
        turning = _of_motion(scenario.motion)
    if scenario.imu.rotation is not None:
        turning += scenario.imu.rotation.mean_square_rate_deg2_s2 * DEG**2 * lasts
    for vibration in scenario.vibration:
        middle = math.sqrt(vibration.low_hz * (vibration.high_hz or vibration.low_hz))
        turning += ((vibration.rms_arcsec or 0.0) * ARCSEC * 2.0 * math.pi * middle) ** 2 * lasts
    return Excitation(lasts, rate**2 * lasts + turning, G0**2 * lasts)


def _gusts(flight: FlightPlan) -> float:
    """Return the 1σ of the roll rate in turbulence, rad/s: 1.9 σ_w/√(L b) (MIL-F-8785C)."""
    turbulence = flight.turbulence
    return 0.0 if turbulence is None else 1.9 * _gust_speed(turbulence) / math.sqrt(_SCALE * _SPAN)


def _gust_speed(turbulence: Turbulence) -> float:
    """Return the 1σ of the vertical gusts, m/s: a tenth of the wind near the ground, above it by the severity."""
    return max(0.1 * turbulence.wind_at_6m_mps, turbulence.severity - 1.0)


def _of_motion(motion: AnyClosedForm) -> float:
    """Return ∫ω² dt of a motion in closed form, rad²/s."""
    if isinstance(motion, RotationTableMotion):
        turns = [step for step in motion.steps if not isinstance(step, DwellStep)]
        return sum(abs(step.angle_deg) * step.rate_deg_s * DEG**2 for step in turns)
    if isinstance(motion, ConingMotion):
        rate = 2.0 * math.pi * motion.frequency_hz * 2.0 * math.sin(0.5 * motion.half_angle_deg * DEG)
    elif isinstance(motion, ScullingMotion):
        rate = math.sqrt(2.0) * math.pi * motion.frequency_hz * motion.angle_deg * DEG
    elif isinstance(motion, SpinConeMotion):
        about, along = motion.precession_deg_s, motion.spin_deg_s  # separated by the cone's angle
        rate = math.sqrt(about**2 + along**2 + 2.0 * about * along * math.cos(motion.angle_deg * DEG)) * DEG
    else:
        rocking = math.sqrt(2.0) * math.pi * motion.frequency_hz * motion.angle_deg
        rate = math.hypot(motion.spin_deg_s, rocking) * DEG
    return rate**2 * motion.duration_s
