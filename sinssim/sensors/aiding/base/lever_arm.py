"""The motion of a point fixed at a lever arm from the sensor block: an antenna, a wheel, another unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.truth.block import block_state
from sinssim.truth.sample_times import part_by_part
from sinssim.truth.trajectory import Trajectory


def turning(trajectory: Trajectory, time: Array, state: NavState) -> Array:
    """Return the angular rate of the sensor block relative to the Earth, ω_eb = ω_ib − C_be ω_ie.

    Args:
        time: instants, (M,) s.

    Returns:
        The rate in the block's axes, (M, 3) rad/s.

    Raises:
        InputError: an instant lies outside the trajectory.
    """
    q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)
    spin = rotation.rotate(rotation.conjugate(q_eb), np.array([0.0, 0.0, trajectory.ellipsoid.omega]))
    return np.asarray(trajectory.rates(time)[0] - spin)


def state_at(trajectory: Trajectory, time: Array, lever_arm: ArrayLike) -> NavState:
    """Return the true state of a point that is rigidly connected to the sensor block.

    r = r_block + C_eb l and v = v_block + C_eb (ω_eb × l), in Earth-fixed axes.

    Args:
        time: instants, (M,) s.
        lever_arm: l, from the block to the point, body axes, (3,) m.

    Returns:
        The state of the point; north, east and down are those at the point.

    Raises:
        InputError: an instant lies outside the trajectory.
    """
    arm = np.asarray(lever_arm, dtype=np.float64)
    if not arm.any():
        return trajectory.state(time)
    return part_by_part(lambda part: _on_the_arm(trajectory, part, arm), time)


def _on_the_arm(trajectory: Trajectory, time: Array, arm: Array) -> NavState:
    state = trajectory.state(time)
    q_en = earth.q_en(state.latitude, state.longitude)
    q_eb = rotation.multiply(q_en, state.q_nb)
    position = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, trajectory.ellipsoid)
    swing = np.cross(turning(trajectory, time, state), arm)
    return block_state(
        position + rotation.rotate(q_eb, arm),
        rotation.rotate(q_en, state.velocity_ned) + rotation.rotate(q_eb, swing),
        q_eb,
        trajectory.ellipsoid,
    )
