"""Duration, rotation and acceleration of a scenario's motion, estimated from its plan without flying it."""

from __future__ import annotations

import math
from typing import NamedTuple

from sinssim.algorithms import PLATFORM
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.scenario.tables import Tables
from sinssim.system.resources import machine_memory
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.motion import Motion
from sinssim.truth.one_component import OneComponent
from sinssim.units import ARCSEC, DEG, G0

_SAMPLE_BYTES, _ALGORITHM_BYTES = 880.0, 176.0
"""Memory per sample while a run is recorded, bytes (420 without a run directory): true and measured increments, true
and navigated states, errors, and copies being written; each further algorithm adds a solution and its errors."""
_PLATFORM_BYTES = 360.0
"""What a platform takes beside its solution: forces, attitude, gimbals, readings, and a further strapdown solution."""
_PLANE_BYTES = 1500.0
"""The same for a one-component run."""


def check_times(scenario: Tables) -> None:
    """Raise for a run that is too short or too long for its sensors, as far as this is known beforehand.

    The duration of a flight is an estimate, so up to twice the estimate plus ten minutes is accepted.
    """
    if isinstance(scenario.source, OneComponent):
        _check_plane(scenario.source)
        return
    imu, lasts = scenario.imu, expected_duration(scenario)
    about, longest = "lasts", lasts
    if isinstance(scenario.source, FlightPlan):
        about, longest = "lasts about", 2.0 * lasts + 600.0
    for number, fault in enumerate(imu.faults, start=1):
        name, begin = ("at_s", fault.at_s) if fault.type == "spike" else ("from_s", fault.from_s)
        if begin > longest or (begin == longest and fault.type != "spike"):
            raise InputError(
                f"imu.faults.{number}.{name} = {begin:g} lies outside the run, which {about} {lasts:.6g} s; a "
                f"{fault.type} must begin before the run ends."
            )
    if longest * imu.rate_hz < 1.0:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} gives no sample in a run that {about} {lasts:.6g} s; at least "
            f"{1.0 / lasts:.3g} would give one."
        )
    memory = machine_memory()
    needed = sample_bytes(scenario) * imu.rate_hz * lasts
    if needed > memory:
        raise InputError(
            f"imu.rate_hz = {imu.rate_hz:g} makes {imu.rate_hz * lasts:.2g} samples in a run that {about} {lasts:.6g} "
            f"s, which need {needed / 1e9:.3g} GB of memory; this machine has {memory / 1e9:.3g} GB. Use at most "
            f"{imu.rate_hz * memory / needed:.3g}."
        )


def _check_plane(section: OneComponent) -> None:
    """Raise for a one-component run that is shorter than an interval, or too long for this machine's memory."""
    intervals, memory = section.duration_s * section.rate_hz, machine_memory()
    if intervals < 1.0:
        raise InputError(
            f"one_component.rate_hz = {section.rate_hz:g} gives no sample in a run of {section.duration_s:g} s; at "
            f"least {1.0 / section.duration_s:.3g} would give one."
        )
    if _PLANE_BYTES * intervals > memory:
        raise InputError(
            f"one_component.rate_hz = {section.rate_hz:g} makes {intervals:.2g} samples in a run of "
            f"{section.duration_s:g} s, which need {_PLANE_BYTES * intervals / 1e9:.3g} GB of memory; this machine "
            f"has {memory / 1e9:.3g} GB. Use at most {memory / (_PLANE_BYTES * section.duration_s):.3g}."
        )


def sample_bytes(scenario: Tables, first: float = _SAMPLE_BYTES) -> float:
    """Return the memory per sample of a run, bytes; `first` is that of a run with one algorithm."""
    more = _PLATFORM_BYTES if PLATFORM in scenario.navigation.algorithms else 0.0
    return first + _ALGORITHM_BYTES * (len(scenario.navigation.algorithms) - 1) + more


def expected_duration(scenario: Tables) -> float:
    """Estimate the duration of a scenario's motion: duration, s: exact except for a flight, for which it is an
    estimate."""
    source = scenario.source
    lasts = source.duration(scenario.truth) if isinstance(source, Motion) else source.known_duration
    if lasts is None:
        raise InputError(
            f"the scenario {scenario.name} has recorded sensors ([log]), whose duration is known when their files are "
            "read, as `sinssim run` and `sinssim check` do; nothing else uses such a scenario."
        )
    return lasts


_RADIUS = 6.371e6  # radius of the Earth, m


class Excitation(NamedTuple):
    """Rotation and acceleration that excite the errors of the inertial sensors."""

    duration: float  # duration of the run, s
    rate: float  # ∫ω² dt over the run, rad²/s; ω is the rate relative to inertial space
    force: float  # ∫f² dt over the run, m²/s³; at least the effect of gravity


def excitation(scenario: Tables) -> Excitation:
    """Estimate the rotation and acceleration of a scenario's motion.

    The estimate contains the Earth's rate and the transport rate, a flight's manoeuvres and turbulence or the rates of
    another motion, the turning of the block, angular vibration, and gravity. It is accurate to a factor of a few.
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
