"""From the motions of a study file to true trajectories, and what can be said of a motion in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim import units
from sinssim.errors import InputError
from sinssim.scenario.duration import expected_duration
from sinssim.scenario.load import load_scenario
from sinssim.studies.schema import (
    ConingMotion,
    GreatCircleMotion,
    Motion,
    ParkedMotion,
    ScenarioMotion,
    ScullingMotion,
    SpinConeMotion,
    SpinRockMotion,
    ToneSection,
)

if TYPE_CHECKING:
    from sinssim.truth.analytic import Motion as AnalyticMotion
    from sinssim.truth.trajectory import Trajectory
    from sinssim.truth.vibration import Tone

_LEVEL = (1.0, 0.0, 0.0, 0.0)
_HEIGHT = 1000.0  # of analytic motions above the ellipsoid [m]


@dataclass(frozen=True)
class MotionFacts:
    """What a motion is like.

    Attributes:
        duration_s: how long it lasts.
        distance_m: horizontal distance covered.
        latitude_rate_deg_h: mean magnitude of the rate of latitude.
        ground_speed_kmh: mean ground speed.
        max_rate_deg_s: greatest angular rate.
        max_pitch_deg: steepest pitch.
        max_latitude_deg: greatest magnitude of the latitude.
    """

    duration_s: float
    distance_m: float
    latitude_rate_deg_h: float
    ground_speed_kmh: float
    max_rate_deg_s: float
    max_pitch_deg: float
    max_latitude_deg: float


def expected_seconds(motion: Motion) -> float:
    """Estimate how long a motion lasts, without making it.

    Args:
        motion: the motion.

    Returns:
        Duration, s: exact except for a flight.

    Raises:
        InputError: there is no such scenario, or it has mistakes.
    """
    if not isinstance(motion, ScenarioMotion):
        return motion.duration_s
    whole = expected_duration(load_scenario(motion.scenario, motion.set))
    return min(whole, motion.duration_s or whole)


def is_cached(motion: ScenarioMotion) -> bool:
    """Return whether a scenario's motion needs no flying.

    Args:
        motion: the motion.

    Returns:
        Whether it is no flight, or one that lies in the cache.
    """
    from sinssim.truth.cache import is_cached as flown

    scenario = load_scenario(motion.scenario, motion.set)
    return scenario.flight is None or flown(scenario.flight, scenario.seed)


def make(motion: Motion, seed: int) -> Trajectory:
    """Return the true trajectory of a motion; a flight comes from the cache if it was flown before.

    Args:
        motion: the motion.
        seed: of vibration noise.

    Returns:
        The trajectory of the sensor block. It may last longer than `motion.duration_s` asks for.

    Raises:
        InputError: there is no such scenario, it has mistakes, or it does not last as long as is asked for.
        RunError: its flight cannot be flown.
    """
    trajectory = _base(motion)
    if motion.duration_s is not None and motion.duration_s > trajectory.end - trajectory.start + 1e-6:
        raise InputError(
            f"the motion {motion.label!r} lasts {trajectory.end - trajectory.start:.1f} s, less than its duration_s = "
            f"{motion.duration_s:g} s; at most what it lasts can be asked for."
        )
    tones = _tones(motion.vibration, seed)
    if not tones:
        return trajectory
    from sinssim.truth.vibration import Vibrating

    return Vibrating(trajectory, tones)


def _base(motion: Motion) -> Trajectory:
    from sinssim.truth.analytic import OnEarth
    from sinssim.truth.coning import SpinCone, classical_cone
    from sinssim.truth.fly import fly
    from sinssim.truth.great_circle import GreatCircle
    from sinssim.truth.parked import Parked
    from sinssim.truth.rocking import Sculling, SpinRock

    deg, turn = units.DEG, 2.0 * np.pi
    match motion:
        case ScenarioMotion():
            return fly(load_scenario(motion.scenario, motion.set))
        case GreatCircleMotion():
            return GreatCircle(
                motion.latitude_deg * deg,
                motion.longitude_deg * deg,
                motion.altitude_m,
                motion.course_deg * deg,
                motion.speed_mps,
                motion.duration_s,
            )
        case ParkedMotion():
            from sinssim.rotation import quaternion_from_euler

            q_nb = quaternion_from_euler(motion.roll_deg * deg, motion.pitch_deg * deg, motion.heading_deg * deg)
            return Parked(
                motion.latitude_deg * deg, motion.longitude_deg * deg, motion.altitude_m, q_nb, motion.duration_s
            )
        case ConingMotion():
            analytic: AnalyticMotion = classical_cone(motion.half_angle_deg * deg, motion.frequency_hz * turn)
        case ScullingMotion():
            analytic = Sculling(motion.angle_deg * deg, motion.displacement_mm * 1e-3, motion.frequency_hz * turn)
        case SpinConeMotion():
            analytic = SpinCone(motion.angle_deg * deg, motion.precession_deg_s * deg, motion.spin_deg_s * deg)
        case SpinRockMotion():
            analytic = SpinRock(
                motion.axis,
                motion.spin_deg_s * deg,
                motion.angle_deg * deg,
                motion.frequency_hz * turn,
                motion.lever_arm_m,
            )
    return OnEarth(analytic, motion.latitude_deg * deg, 0.0, _HEIGHT, _LEVEL, motion.duration_s)


def _tones(sections: tuple[ToneSection, ...], seed: int) -> list[Tone]:
    if not sections:
        return []
    from sinssim.truth.vibration import Tone, band_noise

    tones: list[Tone] = []
    for number, section in enumerate(sections):
        rms = (section.rms_arcsec or 0.0) * units.ARCSEC + (section.rms_mm or 0.0) * 1e-3
        if section.high_hz is None:
            tones.append(Tone(section.coordinate, rms * 2.0**0.5, section.low_hz, section.phase_deg * units.DEG))
        else:
            tones += band_noise(section.coordinate, rms, section.low_hz, section.high_hz, seed + number)
    return tones


def facts(trajectory: Trajectory, duration: float) -> MotionFacts:
    """Describe a motion in numbers.

    Args:
        trajectory: the motion.
        duration: how much of it counts, from its start, s.

    Returns:
        The numbers, from states and rates at evenly spread instants.
    """
    from sinssim import rotation
    from sinssim.earth import geodetic_to_ecef

    time = trajectory.start + np.linspace(0.0, duration, 4001)
    state = trajectory.state(time)
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    ground = geodetic_to_ecef(state.latitude, state.longitude, 0.0 * state.height, trajectory.ellipsoid)
    latitude_moved = float(np.abs(np.diff(state.latitude)).sum())
    pitch = rotation.euler_from_quaternion(state.q_nb)[1]
    omega = trajectory.rates(time)[0]
    return MotionFacts(
        duration_s=duration,
        distance_m=float(np.linalg.norm(np.diff(ground, axis=0), axis=1).sum()),
        latitude_rate_deg_h=latitude_moved / duration / units.DEG_H,
        ground_speed_kmh=float(speed.mean()) * 3.6,
        max_rate_deg_s=float(np.linalg.norm(omega, axis=1).max()) / units.DEG,
        max_pitch_deg=float(np.abs(pitch).max()) / units.DEG,
        max_latitude_deg=float(np.abs(state.latitude).max()) / units.DEG,
    )
