"""Sampling of a true motion: edges of the intervals, checked instants, integrals over intervals, and what is logged.

Rates of motions in closed form are integrated by Gauss-Legendre quadrature; flights by `sinssim.truth.curve`.
`block_state` returns the navigation state of a sensor block from its motion in Earth-fixed coordinates.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.arguments import POSITIVE, number, numbers
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError
from sinssim.system.process import machine_memory, thread_pool

# A sample edge start + k/rate may differ from the end by rounding; a nanosecond beyond either end is accepted.
_SLACK = 1e-9

_BYTES = 56  # bytes per sample of increments: an edge and six integrals

_BLOCK = 4096  # items per thread below which starting the thread costs more than it saves

_PART = 65536  # instants evaluated together, so that no temporary is as long as a run


def sample_edges(start: float, end: float, rate_hz: float) -> Array:
    """Return the edges of equal intervals that fit between two instants: start + k/rate_hz for k = 0...N, (N+1,) s."""
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
    """Return the geodetic place of a motion, rad and m, as three numbers after a check."""
    angle = number("latitude", latitude, "rad, north positive")
    if not abs(angle) <= 0.5 * math.pi:
        raise InputError(f"latitude = {math.degrees(angle):g}° must lie within ±90°; give radians.")
    # from the sphere outside which geodetic latitude is defined to the limit of the gravity models
    return angle, number("longitude", longitude, "rad"), number("height", height, "m", low=-5e6, high=1e9)


def checked_duration(duration: float) -> float:
    """Check and return the duration of a motion."""
    return number("duration", duration, "s", low=POSITIVE)


def check_instants(t: ArrayLike, start: float, end: float) -> Array:
    """Return instants on the trajectory as an array, () or (N,) s, after a check."""
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
    """Return the states of a motion at instants, () or (N,) s, evaluated part by part to save memory; no state depends
    on the number of instants."""
    if instants.size <= _PART:
        return state(instants)
    states = NavState(*(np.empty((len(instants), *columns)) for columns in ((), (), (), (3,), (4,))))
    for start in range(0, len(instants), _PART):
        part = slice(start, start + _PART)
        for name, values in vars(state(instants[part])).items():
            getattr(states, name)[part] = values
    return states


class BlockMotion:
    """A motion of a sensor block by functions of rows of instants, (N,) s: `_state` and `_rates`."""

    start: float
    end: float
    smooth = False
    """Whether state and rates are smooth between `breaks`, with no significant content beyond `fastest`, rad/s."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.start:g} … {self.end:g} s)"

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block; see `Trajectory.state`."""
        instants = check_instants(t, self.start, self.end)
        rows = part_by_part(self._state, np.atleast_1d(instants))
        return NavState(*(values.reshape((*instants.shape, *values.shape[1:])) for values in vars(rows).values()))

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the sensor block; see `Trajectory.rates`."""
        instants = check_instants(t, self.start, self.end)
        omega, force = self._rates(np.atleast_1d(instants))
        return omega.reshape(*instants.shape, 3), force.reshape(*instants.shape, 3)

    def _state(self, time: Array) -> NavState:
        raise NotImplementedError

    def _rates(self, time: Array) -> tuple[Array, Array]:
        raise NotImplementedError


def in_blocks(count: int, work: Callable[[int, int], None]) -> None:
    """Run work(first, last) over consecutive blocks of range(count), on two threads if that is faster. The work must
    release the GIL, and the items must be independent."""
    threads = min(2, os.cpu_count() or 1, 1 + count // _BLOCK)
    edges = [count * i // threads for i in range(threads + 1)]
    if threads == 1:
        work(0, count)
        return
    with thread_pool(threads) as pool:
        for _ in pool.map(work, edges[:-1], edges[1:]):
            pass


@dataclass(frozen=True)
class FlightEvent:
    """An event at one instant, for example the beginning of a leg or lift-off."""

    time: float  # instant in the trajectory's time, s
    text: str  # one sentence


@dataclass(frozen=True)
class Channel:
    """A quantity logged along a trajectory in addition to the motion: airspeed, a control, the wind."""

    time: Array  # instants, (K,) s
    values: Array  # one number or one vector per instant, (K,) or (K, m), in `unit`
    unit: str  # unit of the values in customary notation, "" for a pure number


# Phase of the fastest oscillation, rad, on the longest panel of n Gauss-Legendre points. Its error is φ^(2n+1) (n!)^4 /
# ((2n+1) ((2n)!)^3) of the amplitude (Abramowitz and Stegun 25.4.30): 2e-18, 1e-18 and 1e-19.
_LONGEST = {8: 2.0, 12: 6.4, 16: 12.0}
_CHUNK = 8192  # panels evaluated at once


def breaks_between(breaks: ArrayLike, first: float, last: float) -> Array:
    """Return the instants, (K,) s, that lie between two others."""
    inside = np.asarray(breaks, dtype=np.float64)
    return inside[(inside > first) & (inside < last)]


def panels(corners: Array, least: float) -> tuple[Array, Array]:
    """Return beginnings and lengths, (P,) s, of equal parts of consecutive intervals, `least` of them or more per
    second."""
    parts = np.maximum(np.ceil(np.diff(corners) * least).astype(np.intp), 1)
    length = np.repeat(np.diff(corners) / parts, parts)
    within = np.arange(len(length)) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.repeat(corners[:-1], parts) + within * length, length


def integrate_samples(
    rates: Callable[[Array], Array],
    edges: Array,
    fastest: float,
    breaks: ArrayLike = (),
    columns: int = 6,
    *,
    points: int | None = None,
) -> Array:
    """Return the integrals (N, columns) of a function over consecutive intervals by Gauss-Legendre quadrature.

    The function takes instants, (M,) s, returns (M, columns), has no significant content beyond the angular frequency
    `fastest`, rad/s, and is smooth between `breaks`, (K,) s. A panel has the given number of points; by default, the
    one of `_LONGEST` with which the longest interval has the fewest.
    """
    corners = np.union1d(edges, breaks_between(breaks, edges[0], edges[-1]))
    phase = float(np.diff(corners).max()) * fastest
    points = points or min(_LONGEST, key=lambda n: n * np.ceil(phase / _LONGEST[n]) or n)
    left, length = panels(corners, fastest / _LONGEST.get(points, 2.0))
    # a break may lie within rounding of the last edge
    sample = np.minimum(np.searchsorted(edges, left + 0.5 * length, side="right") - 1, len(edges) - 2)

    nodes, weights = np.polynomial.legendre.leggauss(points)
    totals = np.zeros((len(edges) - 1, columns))
    for first in range(0, len(left), _CHUNK):
        part = slice(first, first + _CHUNK)
        half = 0.5 * length[part, None]
        time = left[part, None] + half + half * nodes
        values = rates(time.reshape(-1)).reshape(-1, points, columns)
        sums = half * np.einsum("j,nji->ni", weights, values)
        starts = np.flatnonzero(np.diff(sample[part], prepend=-1))
        # a chunk may begin in the middle of a sample, so its sums are added
        totals[sample[part][starts]] += np.add.reduceat(sums, starts, axis=0)
    return totals


def block_state(position: Array, velocity: Array, q_es: Array, ellipsoid: Ellipsoid) -> NavState:
    """Return geodetic position, north-east-down velocity and attitude of a block from position and velocity in
    Earth-fixed axes, (..., 3), and attitude, v_e = C_es v_s, (..., 4).

    On the polar axis, north and east are those of the meridian of the returned longitude.
    """
    latitude, longitude, height = earth.ecef_to_geodetic(position, ellipsoid)
    q_ne = rotation.conjugate(earth.q_en(latitude, longitude))
    return NavState(latitude, longitude, height, rotation.rotate(q_ne, velocity), rotation.multiply(q_ne, q_es))
