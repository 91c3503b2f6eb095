"""Sample edges and times on a trajectory with their checks; work split over threads."""

from __future__ import annotations

import math
import os
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import POSITIVE, number, numbers
from sinssim.data import Array, NavState
from sinssim.errors import InputError
from sinssim.system.memory import machine_memory
from sinssim.system.threads import thread_pool

# A sample edge start + k/rate may differ from the end by rounding; a nanosecond beyond either end is accepted.
_SLACK = 1e-9

_BYTES = 56  # bytes per sample of increments: an edge and six integrals

_BLOCK = 4096  # items per thread below which starting the thread costs more than it saves

_PART = 65536  # instants evaluated together, so that no temporary is as long as a run


def sample_edges(start: float, end: float, rate_hz: float) -> Array:
    """Return the edges of equal intervals that fit between two instants.

    Args:
        start: first edge, s.
        end: no edge lies beyond it, s.

    Returns:
        start + k/rate_hz for k = 0...N, (N+1,) s.

    Raises:
        InputError: the rate is not positive and finite, or an interval is longer than the whole time.
    """
    rate_hz = number("rate_hz", rate_hz, "samples per second", low=POSITIVE)
    samples, most = (end - start + _SLACK) * rate_hz, machine_memory() / _BYTES
    if not samples <= most:
        raise InputError(
            f"rate_hz = {rate_hz:g} gives {samples:.3g} samples of a trajectory of {end - start:g} s, but this "
            f"machine's memory holds only {most:.3g}; use a rate of at most {most / (end - start):.3g} Hz."
        )
    count = int(np.floor(samples))
    if count < 1:
        raise InputError(
            f"the trajectory lasts {end - start:g} s, less than one sample interval of {1 / rate_hz:g} s "
            f"at {rate_hz:g} Hz; use a longer trajectory or a higher rate."
        )
    return np.asarray(start + np.arange(count + 1) / rate_hz)


def checked_place(latitude: float, longitude: float, height: float) -> tuple[float, float, float]:
    """Return the place of a motion as three numbers.

    Args:
        latitude, longitude: geodetic, rad.
        height: above the ellipsoid, m.

    Raises:
        InputError: a value is not finite, the latitude is beyond a pole, or the height is not near the Earth.
    """
    found = number("latitude", latitude, "rad, north positive")
    if not abs(found) <= 0.5 * math.pi:
        raise InputError(f"latitude = {math.degrees(found):g}° must lie within ±90°; give radians.")
    # from the sphere outside which geodetic latitude is defined to the limit of the gravity models
    return found, number("longitude", longitude, "rad"), number("height", height, "m", low=-5e6, high=1e9)


def checked_duration(duration: float) -> float:
    """Check and return the duration of a motion.

    Args:
        duration: s.

    Raises:
        InputError: the duration is not positive and finite.
    """
    return number("duration", duration, "s", low=POSITIVE)


def check_instants(t: ArrayLike, start: float, end: float) -> Array:
    """Check that instants lie on the trajectory, and return them as an array.

    Args:
        t: instants, () or (N,) s.
        start, end: first and last time of the trajectory, s.

    Returns:
        The same times, () or (N,).

    Raises:
        InputError: a time lies outside [start, end] or is not a number, or the array has more than one axis.
    """
    instants = numbers("t", t)
    if instants.ndim > 1:
        raise InputError(f"the times must be one number or one row of numbers, not an array of shape {instants.shape}.")
    outside = ~((instants >= start - _SLACK) & (instants <= end + _SLACK))
    if np.any(outside):
        raise InputError(
            f"the time {np.atleast_1d(instants)[np.argmax(outside)]!s} s lies outside the trajectory, "
            f"which runs from {start!s} s to {end!s} s."
        )
    return instants


def part_by_part(state: Callable[[Array], NavState], instants: Array) -> NavState:
    """Return the states of a motion, evaluated part by part to save memory.

    Args:
        state: returns the states at instants, of whose number none depends.
        instants: () or (N,) s.
    """
    if instants.size <= _PART:
        return state(instants)
    found = NavState(*(np.empty((len(instants), *columns)) for columns in ((), (), (), (3,), (4,))))
    for start in range(0, len(instants), _PART):
        part = slice(start, start + _PART)
        for name, values in vars(state(instants[part])).items():
            getattr(found, name)[part] = values
    return found


def in_blocks(count: int, work: Callable[[int, int], None]) -> None:
    """Run work(first, last) over consecutive blocks of range(count), on two threads if that is faster.

    Args:
        work: processes the items first...last-1; it must release the GIL, and the items must be independent.
    """
    threads = min(2, os.cpu_count() or 1, 1 + count // _BLOCK)
    edges = [count * i // threads for i in range(threads + 1)]
    if threads == 1:
        work(0, count)
        return
    with thread_pool(threads) as pool:
        for _ in pool.map(work, edges[:-1], edges[1:]):
            pass
