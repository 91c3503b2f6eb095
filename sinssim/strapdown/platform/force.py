"""What acts on a platform: the specific force along a motion, in inertial axes.

The rotation of the vehicle does not reach the platform, so the force is taken from the velocity of the motion and not
from the increments of a block that rotates with the vehicle: ∫f dt = Δv − ∫gravitation dt in inertial axes. Gravitation
is integrated by Simpson's rule, with the position in the middle from the cubic Hermite curve; its error in an hour at
100 Hz is below 1e-12 m/s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.models import Ellipsoid


class Forces(NamedTuple):
    """The motion as a platform experiences it; inertial axes that coincide with the Earth-fixed ones at t = 0.

    Attributes:
        push: integrals of the specific force over the intervals, (N, 3) m/s.
        q_ib: attitudes of the vehicle at the edges, (N+1, 4).
    """

    push: Array
    q_ib: Array


def inertial_forces(
    time: Array, truth: NavState, gravity: str, ellipsoid: Ellipsoid, disturbance: Array | None = None
) -> Forces:
    """Return the specific force along a motion and the vehicle's attitude in inertial axes.

    Args:
        time: edges of the intervals, (N+1,) s.
        gravity: gravity model of the truth, one of `GRAVITY_MODELS`.
        disturbance: of the true gravity at the edges, north, east, down, (N+1, 3) m/s²; None for none.
    """
    longitude = truth.longitude + ellipsoid.omega * time
    q_in = earth.q_en(truth.latitude, longitude)
    position = earth.geodetic_to_ecef(truth.latitude, longitude, truth.height, ellipsoid)
    velocity = rotation.rotate(q_in, truth.velocity_ned)
    velocity[:, 0] -= ellipsoid.omega * position[:, 1]
    velocity[:, 1] += ellipsoid.omega * position[:, 0]
    dt = np.diff(time)[:, np.newaxis]
    middle = 0.5 * (position[1:] + position[:-1]) - 0.125 * dt * np.diff(velocity, axis=0)
    at_edges = earth.gravitation_ecef(position, gravity, ellipsoid)
    between = earth.gravitation_ecef(middle, gravity, ellipsoid)
    push = np.diff(velocity, axis=0) - dt / 6.0 * (at_edges[1:] + 4.0 * between + at_edges[:-1])
    if disturbance is not None:
        felt = rotation.rotate(q_in, disturbance)
        push -= 0.5 * dt * (felt[1:] + felt[:-1])
    return Forces(push, rotation.multiply(q_in, truth.q_nb))
