"""A satellite receiver: position and velocity of its antenna, with noise, and with what goes wrong with satellites."""

from __future__ import annotations

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.scenario.aiding import GnssSection
from sinssim.sensors.aiding.lever_arm import state_at
from sinssim.sensors.aiding.noise import correlated, white
from sinssim.sensors.aiding.readings import Sensed, epochs, sensed, within
from sinssim.truth.trajectory import Trajectory

_DOWN = np.array([1.0, 1.0, -1.0])
"""North, east, up to north, east, down."""


def gnss(trajectory: Trajectory, section: GnssSection, seed: int = 0) -> list[Sensed]:
    """Return what a satellite receiver gives.

    Args:
        trajectory: the true motion of the sensor block.
        section: the receiver.
        seed: the run's seed.

    Returns:
        Positions (latitude, longitude, height) and velocities (north, east, down) of the antenna; the section may
        want only one of them. The lever arm that the filter is told is off by what the section says.

    Raises:
        InputError: the motion is over before the first fix, or the seed cannot be used.
    """
    s = section
    time = epochs(trajectory, s, "gnss")
    antenna = state_at(trajectory, time, s.lever_arm_m)
    off = white(seed, "gnss lever arm", (s.lever_arm_sigma_m,) * 3, 1)[0]
    arm = {"gnss lever arm": -off}
    told = np.array(s.lever_arm_m) + off
    moved, drift = _faults(s, time)
    given = []
    if s.position:
        sigma = (s.position_sigma_m, s.position_sigma_m, s.height_sigma_m)
        slow = (s.correlated_position_sigma_m, s.correlated_position_sigma_m, s.correlated_height_sigma_m)
        bias = correlated(seed, "gnss position drift", slow, time, s.correlation_time_s)
        error = moved + bias + white(seed, "gnss position noise", sigma, len(time))  # north, east, up
        r1, r2 = earth.radii(antenna.latitude, trajectory.ellipsoid)
        value = np.column_stack(
            (
                antenna.latitude + error[:, 0] / (r1 + antenna.height),
                antenna.longitude + error[:, 1] / ((r2 + antenna.height) * np.cos(antenna.latitude)),
                antenna.height + error[:, 2],
            )
        )
        true = {"gnss-position bias": bias * _DOWN, **arm}
        given.append(sensed("gnss-position", "gnss-position", s, time, value, sigma, true, lever_arm=told))
    if s.velocity:
        sigma = (s.velocity_sigma_mps,) * 3
        slow = (s.correlated_velocity_sigma_mps,) * 3
        bias = correlated(seed, "gnss velocity drift", slow, time, s.correlation_time_s)
        value = antenna.velocity_ned + drift * _DOWN + bias
        value += white(seed, "gnss velocity noise", sigma, len(time))
        true = {"gnss-velocity bias": bias, **arm}
        given.append(sensed("gnss-velocity", "gnss-velocity", s, time, value, sigma, true, lever_arm=told))
    return given


def _faults(section: GnssSection, time: Array) -> tuple[Array, Array]:
    """Return what jumps and ramps add to position and velocity, north, east, up, (M, 3) m and m/s."""
    position, velocity = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    for jump in section.jumps:
        on = within(time, [(jump.from_s, np.inf if jump.to_s is None else jump.to_s)])
        position[on] += (jump.north_m, jump.east_m, jump.up_m)
    for ramp in section.ramps:
        on = within(time, [(ramp.from_s, np.inf if ramp.to_s is None else ramp.to_s)])
        drift = np.array([ramp.north_mps, ramp.east_mps, ramp.up_mps])
        position[on] += np.multiply.outer(time[on] - ramp.from_s, drift)
        velocity[on] += drift
    return position, velocity
