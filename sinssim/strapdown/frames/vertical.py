"""The vertical channel: pure inertial height runs away, so a reference may hold it.

The third-order baro loop (spec 06) pulls height and vertical velocity towards a height reference with the error
e = h − h_ref:  ḣ = −v_D − k₁e,  v̇_D = … + k₂e + k₃∫e dt,  k₁ = 3/τ,  k₂ = 3/τ² + 2g/R,  k₃ = 1/τ³.

An altimeter's readings come one by one. When one arrives, e is the height then less the reading, and it is held until
the next arrives, as in a sampled control loop. The loop knows nothing of latency and lag: in a climb the height lags by
so much of the climb. When the next reading is overdue the loop opens: e is 0 and the integral is kept, so that height
coasts on the accelerometers with the bias that the loop has found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, number, numbers
from sinssim.checks import first_not_finite
from sinssim.data import Array
from sinssim.errors import InputError, check_name
from sinssim.frames import BARO_TIME_CONSTANT, VERTICALS
from sinssim.jit import inline

FREE, BARO_LOOP, HELD = 0, 1, 2
"""Vertical channels by number."""

NUMBERS = {"free": FREE, "baro-loop": BARO_LOOP, "truth": HELD}
"""Their numbers by name."""


NOTHING_NEW, OVERDUE, NO_HEIGHT = 1e30, 2e30, 0.5e30
"""What stands in a reference at a row where no reading arrived, e being held or the loop open; and a height, m, that is
none. Infinity and NaN would not do: kernels are compiled for finite numbers."""


@dataclass(frozen=True)
class HeightReadings:
    """An altimeter's readings as they come to a loop.

    Attributes:
        arrival: when each arrives, in order, (M,) s.
        value: heights above the ellipsoid, (M,) m.
        interval: time between readings, s; one that is late by more than half of it is overdue.
    """

    arrival: Array
    value: Array
    interval: float

    def at(self, time: Array) -> Array:
        """Return the reading that arrived since the row before, at each row; none arrives at the first.

        Args:
            time: of the rows, (N+1,) s.

        Returns:
            Heights, (N+1,) m; numbers beyond all heights where nothing new came or the next reading is overdue.
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


def checked_channel(vertical: str, height: ArrayLike | HeightReadings | None, time_constant: float) -> float:
    """Raise for a time constant that cannot be, and for what a vertical channel would not use.

    Args:
        vertical: one of `VERTICALS`.
        height: reference height, None if there is none.
        time_constant: of the baro loop, s.

    Returns:
        The time constant, s.

    Raises:
        InputError: an unknown channel; otherwise naming the option and what it needs.
    """
    check_name("vertical channel", vertical, VERTICALS)
    time_constant = number("baro_time_constant", time_constant, "s", low=POSITIVE)
    if height is not None and vertical == "free":
        raise InputError(
            'height would have no effect: vertical = "free" goes by no height; "baro-loop" and "truth" do.'
        )
    if time_constant != BARO_TIME_CONSTANT and vertical != "baro-loop":
        raise InputError(
            f'baro_time_constant = {time_constant:g} would have no effect: it is that of vertical = "baro-loop"; here '
            f'vertical = "{vertical}".'
        )
    return time_constant


def height_reference(vertical: str, height: ArrayLike | HeightReadings | None, time: Array) -> tuple[Array, Array]:
    """Return what a vertical channel needs along the way.

    Args:
        vertical: one of `VERTICALS`.
        height: reference height at every time, (N+1,) m, or for the loop readings; None for the free channel.
        time: (N+1,) s.

    Returns:
        Reference height, (N+1,) m, and for the held channel its rate as a down velocity, (N+1,) m/s; empty arrays
        where the channel does not need them.

    Raises:
        InputError: an unknown channel, no height where one is needed, a wrong shape, a height that is not finite.
    """
    check_name("vertical channel", vertical, VERTICALS)
    if vertical == "free":
        return np.empty(0), np.empty(0)
    if height is None:
        raise InputError(f'vertical="{vertical}" needs height=…: the reference height at every imu.time, (N+1,) m.')
    if isinstance(height, HeightReadings):
        if vertical != "baro-loop":
            raise InputError(f'vertical="{vertical}" needs a height at every imu.time; readings are for "baro-loop".')
        return height.at(time), np.empty(0)
    reference = numbers("height", height).copy()  # a copy, as the loop fills in what it coasted by
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
    h: float, h1: float, v_down1: float, reference: Array, k: int,
) -> tuple[float, float, float]:  # fmt: skip
    """Height, down velocity and k₃∫e dt at the end of an interval under the loop, second order in it.

    h is the height at the start, h1 and v_down1 the free ones at the end; reference[k] and reference[k + 1] those of
    both ends. Where no reading came the height less the error that counts from there on takes its place.
    """
    e0 = h - reference[k] if reference[k] < NO_HEIGHT else 0.0
    e = e0
    if reference[k + 1] < NO_HEIGHT:
        e1 = h1 - dt * gain1 * e0 - reference[k + 1]
        e = 0.5 * (e0 + e1)
    pull = dt * (gain2 * e + loop_sum + 0.5 * dt * gain3 * e)
    held = h1 - dt * (gain1 * e + 0.5 * pull)
    next_error_k(reference, k + 1, held, e0)
    return held, v_down1 + pull, loop_sum + dt * gain3 * e


@inline
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
    """Return the error that counts from a row on; where no reading came, put h less it in the reading's place.

    h is the height at the row, and e the error that counted until then.
    """
    if reference[row] > NO_HEIGHT:
        reference[row] = h - e if reference[row] < OVERDUE else h
    error: float = h - reference[row]
    return error
