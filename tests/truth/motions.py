"""Smooth motions known in closed form, for tests of the truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from sinssim.truth import Trajectory
from tests.oracles import integrator as oracle

Array = NDArray[np.float64]


def synthetic_flight(time: ArrayLike) -> tuple[Array, Array]:
    """Return position (K, 3) m and q_eb (K, 4) of a flight with turns, climbs and motions of a second's period."""
    t = np.asarray(time, dtype=np.float64)
    heading = 1.0 + 0.3 * np.sin(0.05 * t) + 1e-4 * t
    roll = 0.6 * np.sin(0.09 * t) + 0.02 * np.sin(1.3 * t)
    pitch = 0.05 + 0.06 * np.sin(0.21 * t + 1.0) + 0.01 * np.sin(2.1 * t)
    latitude = 0.7 + 0.1 * np.sin(3e-4 * t) + 2e-7 * np.sin(0.31 * t)
    longitude = 0.4 + 2.6e-5 * t + 5e-5 * np.sin(0.05 * t)
    height = 5000.0 + 300.0 * np.sin(0.02 * t) + 0.5 * np.sin(1.1 * t)
    position = oracle.geodetic_to_ecef(latitude, longitude, height)
    c_nb = Rotation.from_euler("ZYX", np.stack([heading, pitch, roll], axis=-1)).as_matrix()
    c_eb = np.swapaxes(oracle.ned_axes(latitude, longitude), -1, -2) @ c_nb
    return position, Rotation.from_matrix(c_eb).as_quat(scalar_first=True)


def ecef(trajectory: Trajectory, t: Array) -> tuple[Array, Array, Array]:
    """Return a trajectory's position, velocity and C_es in Earth-fixed axes by the oracle's formulas."""
    s = trajectory.state(t)
    c_en = np.swapaxes(oracle.ned_axes(s.latitude, s.longitude), -1, -2)
    position = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    return position, np.einsum("...ij,...j->...i", c_en, s.velocity_ned), c_en @ oracle.matrix(s.q_nb)
