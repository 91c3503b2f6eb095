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
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import first_not_finite, numbers
from sinssim.data import Array
from sinssim.errors import InputError, check_name
from sinssim.jit import strict_inline
from sinssim.rotation.quaternions import Vector
from sinssim.strapdown.mechanization import VERTICALS

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""


NUMBERS = {"free": FREE, "baro-loop": BARO_LOOP, "truth": HELD}
"""Their numbers by name."""


NOTHING_NEW, OVERDUE, NOT_A_HEIGHT = 1e30, 2e30, 0.5e30
"""Values in a reference at a row without a reading, for a held e or an open loop; and a limit of heights, m. Infinity
and NaN cannot be used, because kernels are compiled for finite numbers."""

OVERDUE_AFTER = 1.5
"""Intervals between readings after which the loop opens."""


@dataclass(frozen=True)
class HeightReadings:
    """The readings of an altimeter for the loop."""

    arrival: Array  # arrival times, in order, (M,) s
    value: Array  # heights above the ellipsoid, (M,) m
    interval: float  # time between readings, s; see `OVERDUE_AFTER`

    def at(self, time: Array) -> Array:
        """Return the reading that arrived since the previous row, for each row, (N+1,) m; the first row has none.

        Special values stand where there is no new reading or the next reading is overdue.
        """
        last = np.searchsorted(self.arrival, time + 1e-9, side="right") - 1
        out = np.full(len(time), NOTHING_NEW)
        if len(self.arrival):
            new = np.diff(last, prepend=-1) > 0
            out[new] = self.value[last[new]]
            out[time - self.arrival[last] > OVERDUE_AFTER * self.interval] = OVERDUE
        out[last < 0] = OVERDUE
        out[0] = OVERDUE
        return out


def height_reference(vertical: str, height: ArrayLike | HeightReadings | None, time: Array) -> tuple[Array, Array]:
    """Return the references of a vertical channel at the rows: height, m, and for the held one its down velocity, m/s.

    `height` is the reference at every time, m, or readings for the loop; None for the free channel. References that the
    channel does not need are empty.
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


class Channel(NamedTuple):
    """The vertical channel of an engine: its number, references at the rows (empty if not needed), τ of the loop."""

    number: int
    height: Array
    climb: Array
    time_constant: float


@strict_inline
def loop_gains_k(time_constant: float, gravity_down: float, k2: float) -> Vector:
    """Gains k₁, k₂, k₃ of the baro loop; k2 is the curvature 1/(R₂+h) where it is used."""
    rate = 1.0 / time_constant
    return 3.0 * rate, 3.0 * rate * rate + 2.0 * gravity_down * k2, rate * rate * rate


@strict_inline
def error_after_k(reference: float, h: float, e: float) -> float:
    """Return the error that holds from a row on, from its reference, its height h and the previous error e."""
    if reference < NOT_A_HEIGHT:
        return h - reference
    return e if reference < OVERDUE else 0.0


class Loop(NamedTuple):
    """State of the baro loop: k₃∫e dt, and the error e that is held until the next reading."""

    sum: float
    error: float


@strict_inline
def start_loop_k(channel: Channel, h: float) -> Loop:
    """State of the loop at the start."""
    return Loop(0.0, error_after_k(channel.height[0], h, 0.0) if channel.number == BARO_LOOP else 0.0)


@strict_inline
def reference_k(channel: Channel, row: int) -> tuple[float, float]:
    """Height and down velocity of a channel's reference at a row, as far as it has them."""
    height = channel.height[row] if channel.number != FREE else 0.0
    return height, channel.climb[row] if channel.number == HELD else 0.0


@strict_inline
def vertical_step_k(
    vertical: int, dt: float, gains: Vector, loop: Loop, h1: float, v_down1: float, reference: tuple[float, float]
) -> tuple[float, float, Loop]:
    """Height, down velocity and loop at the end of an interval in any of the channels, second order in the interval.

    h1 and v_down1 are the free values at the end, and `reference` is that of the end.
    """
    height, climb = reference
    if vertical == HELD:
        return height, climb, loop
    if vertical != BARO_LOOP:
        return h1, v_down1, loop
    e = 0.5 * (loop.error + (h1 - dt * gains[0] * loop.error - height)) if height < NOT_A_HEIGHT else loop.error
    pull = dt * (gains[1] * e + loop.sum + 0.5 * dt * gains[2] * e)
    corrected_height = h1 - dt * (gains[0] * e + 0.5 * pull)
    return (
        corrected_height,
        v_down1 + pull,
        Loop(loop.sum + dt * gains[2] * e, error_after_k(height, corrected_height, loop.error)),
    )
