"""Instants on a trajectory: sample edges, the check of what was asked for, work split over threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError

# A sample edge start + k/rate may differ from the end by rounding; a nanosecond beyond either end is let pass.
_SLACK = 1e-9

_BLOCK = 4096  # below so many items per thread, starting the thread costs more than it saves


def sample_edges(start: float, end: float, rate_hz: float) -> Array:
    """Return the edges of equal intervals that fit between two instants.

    Args:
        start: first edge, s.
        end: no edge lies beyond it, s.
        rate_hz: intervals per second.

    Returns:
        start + k/rate_hz for k = 0...N, (N+1,) s.

    Raises:
        InputError: a rate that is not positive and finite, or an interval longer than the whole time.
    """
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError(f"sample rate {rate_hz!r} Hz: it must be a positive, finite number.")
    count = int(np.floor((end - start + _SLACK) * rate_hz))
    if count < 1:
        raise InputError(
            f"the trajectory lasts {end - start:g} s, less than one sample interval of {1 / rate_hz:g} s "
            f"at {rate_hz:g} Hz; a longer trajectory or a higher rate is needed."
        )
    return np.asarray(start + np.arange(count + 1) / rate_hz)


def check_instants(t: ArrayLike, start: float, end: float) -> Array:
    """Return instants as an array after checking that they lie on the trajectory.

    Args:
        t: instants, () or (N,) s.
        start, end: first and last instant of the trajectory, s.

    Returns:
        The same instants, () or (N,).

    Raises:
        InputError: an instant outside [start, end] or not a number, or an array of more than one axis.
    """
    instants = np.asarray(t, dtype=np.float64)
    if instants.ndim > 1:
        raise InputError(f"instants must be one number or one row of numbers, not an array of shape {instants.shape}.")
    outside = ~((instants >= start - _SLACK) & (instants <= end + _SLACK))
    if np.any(outside):
        raise InputError(
            f"instant {np.atleast_1d(instants)[np.argmax(outside)]!s} s lies outside the trajectory, "
            f"which runs from {start!s} s to {end!s} s."
        )
    return instants


def in_blocks(count: int, work: Callable[[int, int], None]) -> None:
    """Run work(first, last) over consecutive blocks of range(count), on two threads when that pays.

    Args:
        count: how many items there are.
        work: does the items first...last-1; it releases the GIL, and no item depends on another.
    """
    threads = min(2, os.cpu_count() or 1, 1 + count // _BLOCK)
    edges = [count * i // threads for i in range(threads + 1)]
    if threads == 1:
        work(0, count)
        return
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, edges[:-1], edges[1:]):
            pass
