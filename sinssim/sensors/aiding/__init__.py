"""The sensors beside the inertial ones: what a filter corrects inertial navigation by."""

from __future__ import annotations

from sinssim.data import NavSolution
from sinssim.scenario.aiding import AidingSection
from sinssim.sensors.aiding.airspeed import airspeed
from sinssim.sensors.aiding.attitude import attitude_reference, star_tracker
from sinssim.sensors.aiding.barometer import barometer
from sinssim.sensors.aiding.gnss import gnss
from sinssim.sensors.aiding.magnetometer import magnetometer
from sinssim.sensors.aiding.master import master
from sinssim.sensors.aiding.odometer import odometer
from sinssim.sensors.aiding.readings import Sensed
from sinssim.sensors.aiding.standstill import zero_rate, zero_velocity
from sinssim.truth.trajectory import Trajectory

__all__ = [
    "Sensed", "aid", "airspeed", "attitude_reference", "barometer", "gnss", "magnetometer", "master", "odometer",
    "star_tracker", "zero_rate", "zero_velocity",
]  # fmt: skip


def aid(
    trajectory: Trajectory, section: AidingSection, seed: int = 0, better: NavSolution | None = None
) -> list[Sensed]:
    """Return what all aiding sensors of a scenario give.

    Args:
        trajectory: the true motion of the sensor block.
        section: the [aiding] section of a scenario.
        seed: the run's seed; every axis of every term of every sensor has a generator of its own, so that the draws
            of one do not depend on which others there are.
        better: what the better inertial system of a transfer alignment navigates, if the section has one.

    Returns:
        One entry for each kind of measurement of each sensor that the section has.

    Raises:
        InputError: the motion is over before a sensor's first reading, or the seed cannot be used.
    """
    s = section
    found = [] if s.gnss is None else gnss(trajectory, s.gnss, seed)
    found += [] if s.baro is None else [barometer(trajectory, s.baro, seed)]
    found += [] if s.magnetometer is None else [magnetometer(trajectory, s.magnetometer, seed)]
    found += [] if s.airspeed is None else [airspeed(trajectory, s.airspeed, seed)]
    found += [] if s.odometer is None else [odometer(trajectory, s.odometer, seed)]
    found += [] if s.zero_velocity is None else [zero_velocity(trajectory, s.zero_velocity, seed)]
    found += [] if s.zero_rate is None else [zero_rate(trajectory, s.zero_rate, seed)]
    found += [] if s.attitude is None else [attitude_reference(trajectory, s.attitude, seed)]
    found += [] if s.star_tracker is None else [star_tracker(trajectory, s.star_tracker, seed)]
    found += [] if s.master is None or better is None else master(trajectory, s.master, better, seed)
    return found
