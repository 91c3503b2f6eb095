"""The initial state of navigation: the true state with the scenario's initial errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim import earth, rotation, units
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.strapdown.polar_axes import carried

if TYPE_CHECKING:
    from sinssim.scenario.navigation_section import InitialErrorSection


def initial_state_with_errors(
    truth: NavState, error: InitialErrorSection, ellipsoid: Ellipsoid, seed: int = 0, axes: str = "north"
) -> NavState:
    """Return the initial state of navigation: the true state with errors added.

    Args:
        error: the errors; if all are zero, the true state is returned bit for bit.
        seed: the run's seed, for random errors.
        axes: axes in which the run's errors are compared, see `sinssim.frames.AXES`.
    """
    from sinssim.statistics.random_numbers import normals

    def draw(term: str, *sigma: float) -> Array:
        return np.array([s * normals(seed, f"initial {term}", i, 1)[0] if s else 0.0 for i, s in enumerate(sigma)])

    position = np.array([error.north_m, error.east_m, error.height_m])
    position += draw("position", error.position_sigma_m, error.position_sigma_m, error.height_sigma_m)
    velocity = np.array([error.velocity_north_mps, error.velocity_east_mps, error.velocity_down_mps])
    velocity += draw("velocity", *[error.velocity_sigma_mps] * 3)
    r1, r2 = radii(truth.latitude, ellipsoid)
    longitude = truth.longitude
    if position[1] and axes == "north":
        longitude = longitude + position[1] / ((r2 + truth.height) * np.cos(truth.latitude))
    q_nb = truth.q_nb
    turn = np.array([error.roll_arcmin, error.pitch_arcmin, error.heading_arcmin]) * units.ARCMIN
    if turn.any():
        roll, pitch, heading = rotation.euler_from_quaternion(q_nb)
        q_nb = rotation.quaternion_from_euler(roll + turn[0], pitch + turn[1], heading + turn[2])
    phi = units.ARCMIN * draw("attitude", error.tilt_sigma_arcmin, error.tilt_sigma_arcmin, error.heading_sigma_arcmin)
    if phi.any():
        q_nb = rotation.multiply(rotation.quaternion_from_rotation_vector(-phi), q_nb)  # q_true = q(φ) ⊗ q_solution
    if axes == "transported" and (position.any() or velocity.any() or phi.any()):
        row = NavState(
            truth.latitude[None], truth.longitude[None], truth.height[None],
            (truth.velocity_ned + velocity)[None], q_nb[None],
        )  # fmt: skip
        place = earth.displaced(row.latitude, row.longitude, row.height, position[:1], position[1:2], ellipsoid)
        moved = carried(row, *place, row.height + position[2])
        return NavState(*(part[0] for part in vars(moved).values()))
    return NavState(
        truth.latitude + position[0] / (r1 + truth.height),
        longitude,
        truth.height + position[2],
        truth.velocity_ned + velocity,
        q_nb,
    )
