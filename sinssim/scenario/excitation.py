"""Estimates the rotation and acceleration of a scenario's motion from its plan without flying it."""

from __future__ import annotations

import math
from typing import NamedTuple

from sinssim.earth.models import OMEGA_IE
from sinssim.scenario.duration import expected_duration
from sinssim.scenario.tables import Tables
from sinssim.truth.motion import Motion
from sinssim.units import ARCSEC, DEG, G0

_RADIUS = 6.371e6  # radius of the Earth, m


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

    Raises:
        InputError: the aircraft's description is not right.
    """
    lasts = expected_duration(scenario)
    rate, turning, source = OMEGA_IE, 0.0, scenario.source
    if isinstance(source, Motion):
        rate += source.usual_speed / _RADIUS
        turning = source.turning(scenario.truth)
    if scenario.imu.rotation is not None:
        turning += scenario.imu.rotation.mean_square_rate_deg2_s2 * DEG**2 * lasts
    for vibration in scenario.vibration:
        middle = math.sqrt(vibration.low_hz * (vibration.high_hz or vibration.low_hz))
        turning += ((vibration.rms_arcsec or 0.0) * ARCSEC * 2.0 * math.pi * middle) ** 2 * lasts
    return Excitation(lasts, rate**2 * lasts + turning, G0**2 * lasts)
