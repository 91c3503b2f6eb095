"""The vertical channel: pure inertial height runs away, so a reference may hold it.

The third-order baro loop (spec 06) pulls height and vertical velocity towards a height reference with the error
e = h − h_ref:  ḣ = −v_D − k₁e,  v̇_D = … + k₂e + k₃∫e dt,  k₁ = 3/τ,  k₂ = 3/τ² + 2g/R,  k₃ = 1/τ³.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.checks import first_not_finite
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.jit import inline
from sinssim.names import VERTICALS

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""

NUMBERS = {"free": FREE, "baro-loop": BARO_LOOP, "truth": HELD}
"""Their numbers by name."""


def height_reference(vertical: str, height: ArrayLike | None, time: Array) -> tuple[Array, Array]:
    """Return what a vertical channel needs along the way.

    Args:
        vertical: one of `VERTICALS`.
        height: reference height at every time, (N+1,) m; None for the free channel.
        time: (N+1,) s.

    Returns:
        Reference height, (N+1,) m, and for the held channel its rate as a down velocity, (N+1,) m/s; empty arrays
        where the channel does not need them.

    Raises:
        InputError: an unknown channel, no height where one is needed, a wrong shape, a height that is not finite.
    """
    if vertical not in VERTICALS:
        raise unknown_name("vertical channel", vertical, VERTICALS)
    if vertical == "free":
        return np.empty(0), np.empty(0)
    if height is None:
        raise InputError(f'vertical="{vertical}" needs height=…: the reference height at every imu.time, (N+1,) m.')
    reference = np.ascontiguousarray(height, dtype=np.float64)
    if reference.shape != time.shape:
        raise InputError(f"height has shape {reference.shape}; one value at every imu.time, {time.shape}, is needed.")
    row = first_not_finite(reference)
    if row is not None:
        raise InputError(f"height[{row}] = {reference[row]} m at t = {time[row]:.6f} s is not a finite number.")
    return reference, -np.gradient(reference, time) if vertical == "truth" else np.empty(0)


@inline
def loop_gains_k(time_constant: float, gravity_down: float, k2: float) -> tuple[float, float, float]:
    """Gains k₁, k₂, k₃ of the baro loop; k2 is the curvature 1/(R₂+h) where it is used."""
    rate = 1.0 / time_constant
    return 3.0 * rate, 3.0 * rate * rate + 2.0 * gravity_down * k2, rate * rate * rate


@inline
def baro_loop_k(
    dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float,
    h: float, h1: float, v_down1: float, reference: float, reference1: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Height, down velocity and k₃∫e dt at the end of an interval under the loop, second order in it.

    h is the height at the start, h1 and v_down1 the free ones at the end, reference and reference1 those of both ends.
    """
    e0 = h - reference
    e1 = h1 - dt * gain1 * e0 - reference1
    e = 0.5 * (e0 + e1)
    pull = dt * (gain2 * e + loop_sum + 0.5 * dt * gain3 * e)
    return h1 - dt * (gain1 * e + 0.5 * pull), v_down1 + pull, loop_sum + dt * gain3 * e
