"""The true motions of a study: their trajectories, durations, and the numbers that characterise them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim import units
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.experiments.studies.study_schema import StudyMotion
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.planned_motion import expected_duration

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


@dataclass(frozen=True)
class MotionFacts:
    """Characteristics of a motion.

    Attributes:
        duration_s: duration.
        distance_m: horizontal distance covered.
        latitude_rate_deg_h: mean magnitude of the rate of latitude.
        ground_speed_kmh: mean ground speed.
        max_rate_deg_s: largest angular rate.
        max_pitch_deg: steepest pitch.
        max_latitude_deg: largest magnitude of the latitude.
        cone: half-angle α, rad, and rate Ω, rad/s, of pure coning.
    """

    duration_s: float
    distance_m: float
    latitude_rate_deg_h: float
    ground_speed_kmh: float
    max_rate_deg_s: float
    max_pitch_deg: float
    max_latitude_deg: float
    cone: tuple[float, float] | None = None


def scenario_of(motion: StudyMotion) -> Scenario:
    """Return a scenario with the motion; of its other sections only the place of the sensor block is used."""
    if motion.scenario is None:
        return Scenario(
            name="motion",
            parked=motion.parked,
            great_circle=motion.great_circle,
            motion=motion.motion,
            vibration=motion.vibration,
        )
    scenario = load_scenario(motion.scenario, motion.set)
    return scenario.model_copy(update={"vibration": (*scenario.vibration, *motion.vibration)})


def expected_seconds(motion: StudyMotion) -> float:
    """Return the duration of a motion without making it, s: exact except for a flight."""
    whole = flight_seconds(motion)
    if motion.scenario is None:
        _check_duration(motion, whole)
    return min(whole, motion.duration_s or whole)


def flight_seconds(motion: StudyMotion) -> float:
    """Return the duration of the complete motion, s, of which a study may use only the beginning."""
    return expected_duration(scenario_of(motion))


def is_cached(motion: StudyMotion) -> bool:
    """Return whether a motion needs no flight simulation."""
    from sinssim.truth.flight.flight_cache import is_cached as flown

    scenario = scenario_of(motion)
    return scenario.flight is None or flown(scenario.flight, scenario.seed)


def make(motion: StudyMotion) -> Trajectory:
    """Return the true trajectory of a motion; a flight flown before comes from the cache."""
    from sinssim.scenario.true_motion import fly

    trajectory = fly(scenario_of(motion))
    if motion.duration_s is None:
        return trajectory
    _check_duration(motion, trajectory.end - trajectory.start)
    return Beginning(trajectory, motion.duration_s)


def _check_duration(motion: StudyMotion, lasts: float) -> None:
    if motion.duration_s is not None and motion.duration_s > lasts + 1e-6:
        raise InputError(
            f"the motion {motion.label!r} lasts {lasts:.1f} s, less than its duration_s = {motion.duration_s:g} s; "
            "duration_s can be at most the duration of the motion."
        )


class Beginning:
    """The first part of a trajectory, as a trajectory.

    Args:
        whole: the trajectory.
        duration: duration of the part, s.
    """

    def __init__(self, whole: Trajectory, duration: float) -> None:
        self._whole = whole
        self.start, self.end = whole.start, whole.start + duration
        self.events = tuple(event for event in whole.events if event.time <= self.end)
        self.gravity, self.ellipsoid, self.channels = whole.gravity, whole.ellipsoid, whole.channels
        self.state, self.rates = whole.state, whole.rates
        self.breaks = getattr(whole, "breaks", ())
        self.fastest = getattr(whole, "fastest", 0.0)

    def increments(self, rate_hz: float) -> ImuData:
        """Return the ideal increments; see `Trajectory.increments`."""
        return first_seconds(self._whole.increments(rate_hz), self.end - self.start)


def first_seconds(imu: ImuData, duration: float) -> ImuData:
    """Return the beginning of some increments: the intervals that end within a duration, s."""
    count = int(np.searchsorted(imu.time, imu.time[0] + duration + 1e-9, side="right")) - 1
    return ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])


def facts(motion: StudyMotion, trajectory: Trajectory) -> MotionFacts:
    """Characterise a motion by numbers.

    Returns:
        The characteristics, from states and rates at evenly spread instants.
    """
    from sinssim import rotation
    from sinssim.earth.geodetic_coordinates import geodetic_to_ecef

    duration = trajectory.end - trajectory.start
    time = np.linspace(trajectory.start, trajectory.end, 4001)
    state = trajectory.state(time)
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    ground = geodetic_to_ecef(state.latitude, state.longitude, 0.0 * state.height, trajectory.ellipsoid)
    latitude_moved = float(np.abs(np.diff(state.latitude)).sum())
    pitch = rotation.euler_from_quaternion(state.q_nb)[1]
    omega = trajectory.rates(time)[0]
    cone = motion.motion if motion.motion is not None and motion.motion.type == "coning" else None
    return MotionFacts(
        duration_s=duration,
        distance_m=float(np.linalg.norm(np.diff(ground, axis=0), axis=1).sum()),
        latitude_rate_deg_h=latitude_moved / duration / units.DEG_H,
        ground_speed_kmh=float(speed.mean()) * 3.6,
        max_rate_deg_s=float(np.linalg.norm(omega, axis=1).max()) / units.DEG,
        max_pitch_deg=float(np.abs(pitch).max()) / units.DEG,
        max_latitude_deg=float(np.abs(state.latitude).max()) / units.DEG,
        cone=None if cone is None else (cone.half_angle_deg * units.DEG, 2.0 * np.pi * cone.frequency_hz),
    )
