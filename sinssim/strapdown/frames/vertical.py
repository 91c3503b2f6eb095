"""The vertical channel: pure inertial height is unstable and can be stabilised by a reference.

The third-order baro loop controls height and vertical velocity by the error e = h − h_ref against a height reference: ḣ
= −v_D − k₁e, v̇_D = … + k₂e + k₃∫e dt, k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³.

The readings of an altimeter are discrete. When one arrives, e is the height at that time minus the reading, and is held
until the next one arrives, as in a sampled control loop. The loop does not compensate latency and lag: in a climb the
height lags accordingly. When the next reading is overdue, the loop opens: e is 0 and the integral is kept, so that the
height is integrated from the accelerometers with the bias that the loop has estimated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import numbers
from sinssim.checks import first_not_finite
from sinssim.data import Array
from sinssim.errors import InputError, check_name
from sinssim.frames import VERTICALS
from sinssim.jit import inline, strict_inline

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""

NUMBERS = {"free": FREE, "baro-loop": BARO_LOOP, "truth": HELD}
"""Their numbers by name."""


NOTHING_NEW, OVERDUE, NO_HEIGHT = 1e30, 2e30, 0.5e30
"""Values in a reference at a row without a reading, for a held e or an open loop; and a limit of heights, m. Infinity
and NaN cannot be used, because kernels are compiled for finite numbers."""


@dataclass(frozen=True)
class HeightReadings:
    """The readings of an altimeter for the loop.

    Attributes:
        arrival: arrival times, in order, (M,) s.
        value: heights above the ellipsoid, (M,) m.
        interval: time between readings, s; a reading that is late by more than half of it is overdue.
    """

    arrival: Array
    value: Array
    interval: float

    def at(self, time: Array) -> Array:
        """Return the reading that arrived since the previous row, for each row; the first row has none.

        Args:
            time: times of the rows, (N+1,) s.

        Returns:
            Heights, (N+1,) m; special values where there is no new reading or the next reading is overdue.
        """
        last = np.searchsorted(self.arrival, time + 1e-9, side="right") - 1
        out = np.full(len(time), NOTHING_NEW)
        if len(self.arrival):
            new = np.diff(last, prepend=-1) > 0
            out[new] = self.value[last[new]]
            out[time - self.arrival[last] > 1.5 * self.interval] = OVERDUE
        out[last < 0] = OVERDUE
        out[0] = OVERDUE
        return out


def height_reference(vertical: str, height: ArrayLike | HeightReadings | None, time: Array) -> tuple[Array, Array]:
    """Return the references of a vertical channel.

    Args:
        vertical: one of `VERTICALS`.
        height: reference height at every time, (N+1,) m, or readings for the loop; None for the free channel.
        time: (N+1,) s.

    Returns:
        Reference height, (N+1,) m, and for the held channel its rate as a down velocity, (N+1,) m/s; empty arrays if
        the channel does not need them.

    Raises:
        InputError: the channel is unknown, the required height is missing or has a wrong shape, a height is not finite,
            or it would have no effect.
    """
    check_name("vertical channel", vertical, VERTICALS)
    if height is not None and vertical == "free":
        raise InputError(
            'height would have no effect: vertical = "free" uses no height reference; "baro-loop" and "truth" do.'
        )
    if vertical == "free":
        return np.empty(0), np.empty(0)
    if height is None:
        raise InputError(f'vertical="{vertical}" needs height=…: the reference height at every imu.time, (N+1,) m.')
    if isinstance(height, HeightReadings):
        if vertical != "baro-loop":
            raise InputError(
                f'vertical="{vertical}" needs a height at every imu.time; measurements are for "baro-loop".'
            )
        return height.at(time), np.empty(0)
    reference = numbers("height", height).copy()  # a copy, because the loop fills in heights without readings
    if reference.shape != time.shape:
        raise InputError(
            f"height has shape {reference.shape}, but must have one value at every imu.time, {time.shape}."
        )
    row = first_not_finite(reference)
    if row is not None:
        raise InputError(f"height[{row}] = {reference[row]} m at t = {time[row]:.6f} s is not a finite number.")
    return reference, -np.gradient(reference, time) if vertical == "truth" else np.empty(0)


@strict_inline
def loop_gains_k(time_constant: float, gravity_down: float, k2: float) -> tuple[float, float, float]:
    """Gains k₁, k₂, k₃ of the baro loop; k2 is the curvature 1/(R₂+h) where it is used."""
    rate = 1.0 / time_constant
    return 3.0 * rate, 3.0 * rate * rate + 2.0 * gravity_down * k2, rate * rate * rate


@strict_inline
def error_after_k(reference: float, h: float, e: float) -> float:
    """Return the error that holds from a row on, from its reference, its height h and the previous error e."""
    if reference < NO_HEIGHT:
        return h - reference
    return e if reference < OVERDUE else 0.0


@strict_inline
def baro_step_k(
    dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float, error: float,
    h1: float, v_down1: float, reference: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Height, down velocity, k₃∫e dt and held error at the end of an interval under the loop, second order in it.

    error is the one at the start, h1 and v_down1 are the free values at the end, and reference that of the end.
    """
    e1 = h1 - dt * gain1 * error - reference
    e = 0.5 * (error + e1) if reference < NO_HEIGHT else error
    pull = dt * (gain2 * e + loop_sum + 0.5 * dt * gain3 * e)
    held = h1 - dt * (gain1 * e + 0.5 * pull)
    return held, v_down1 + pull, loop_sum + dt * gain3 * e, error_after_k(reference, held, error)


@inline
def baro_loop_k(
    dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float,
    h: float, h1: float, v_down1: float, reference: Array, k: int,
) -> tuple[float, float, float]:  # fmt: skip
    """Height, down velocity and k₃∫e dt at the end of interval k; see `baro_step_k`.

    h is the height at the start. At rows without a reading, the height minus the current error replaces the reference.
    """
    error = h - reference[k] if reference[k] < NO_HEIGHT else 0.0
    held, v_down, loop_sum, error = baro_step_k(
        dt, gain1, gain2, gain3, loop_sum, error, h1, v_down1, reference[k + 1]
    )  # fmt: skip
    if reference[k + 1] > NO_HEIGHT:
        reference[k + 1] = held - error
    return held, v_down, loop_sum


@strict_inline
def vertical_step_k(
    vertical: int, dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float, error: float,
    h1: float, v_down1: float, reference: float, climb: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Height, down velocity, k₃∫e dt and held error at the end of an interval in any of the channels.

    h1 and v_down1 are the free ones; reference and climb are the height and the down velocity of the reference there.
    """
    if vertical == BARO_LOOP:
        return baro_step_k(dt, gain1, gain2, gain3, loop_sum, error, h1, v_down1, reference)
    if vertical == HELD:
        return reference, climb, loop_sum, error
    return h1, v_down1, loop_sum, error


@strict_inline
def vertical_channel_k(
    vertical: int, dt: float, gain1: float, gain2: float, gain3: float, loop_sum: float,
    h: float, h1: float, v_down1: float, reference: Array, climb_reference: Array, k: int,
) -> tuple[float, float, float]:  # fmt: skip
    """Height, down velocity and k₃∫e dt at the end of interval k in any of the channels.

    h is the height at the start, h1 and v_down1 the free ones at the end.
    """
    if vertical == BARO_LOOP:
        return baro_loop_k(dt, gain1, gain2, gain3, loop_sum, h, h1, v_down1, reference, k)
    if vertical == HELD:
        return reference[k + 1], climb_reference[k + 1], loop_sum
    return h1, v_down1, loop_sum


@inline
def next_error_k(reference: Array, row: int, h: float, e: float) -> float:
    """Return the error that holds from a row on; at a row without a reading, store h minus this error as reference.

    h is the height at the row, and e the previous error.
    """
    if reference[row] > NO_HEIGHT:
        reference[row] = h - e if reference[row] < OVERDUE else h
    error: float = h - reference[row]
    return error
