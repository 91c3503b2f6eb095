"""When an aiding sensor reads, and what becomes of its readings on the way to the filter: outages and latency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.data import Array, Measurements
from sinssim.errors import InputError
from sinssim.scenario.aiding import AidingSensor
from sinssim.truth.times import sample_edges
from sinssim.truth.trajectory import Trajectory

Mask = NDArray[np.bool_]
Spans = Sequence[tuple[float, float]]


def epochs(trajectory: Trajectory, section: AidingSensor, key: str) -> Array:
    """Return the instants at which a sensor reads, were there no outage.

    Args:
        trajectory: the true motion.
        section: the sensor.
        key: its table in [aiding], for the message.

    Returns:
        start + k/rate for k = 1, 2, …, (M,) s.

    Raises:
        InputError: the motion is over before the first reading.
    """
    rate = section.rate_hz
    duration = trajectory.end - trajectory.start
    if duration * rate < 1.0 - 1e-9:
        raise InputError(
            f"aiding.{key}.rate_hz = {rate:g}: the first reading comes after {1.0 / rate:g} s, and the motion is over "
            f"after {duration:g} s; a higher rate or a longer motion is needed."
        )
    return sample_edges(trajectory.start, trajectory.end, rate)[1:]


def within(time: Array, spans: Spans) -> Mask:
    """Say which instants lie in one of some spans.

    Args:
        time: (M,) s.
        spans: begin and end of each, both included, s.

    Returns:
        (M,).
    """
    inside = np.zeros(len(time), dtype=bool)
    for begin, end in spans:
        inside |= (time >= begin) & (time <= end)
    return inside


@dataclass(frozen=True)
class Sensed:
    """What an aiding sensor gives, and the truth about it.

    Attributes:
        measurements: what the filter gets.
        time: instants of all readings, those in outages too, (M,) s.
        parameters: true values of what a filter may estimate of the sensor, by block of states: constants (k,), or at
            `time` (M, k).
    """

    measurements: Measurements
    time: Array
    parameters: dict[str, Array]


def sensed(
    name: str,
    kind: str,
    section: AidingSensor,
    time: Array,
    value: Array,
    sigma: ArrayLike,
    parameters: dict[str, Array],
    *,
    lever_arm: ArrayLike = (0.0, 0.0, 0.0),
    there: Mask | None = None,
    lag: float = 0.0,
) -> Sensed:
    """Return readings as the filter gets them. All have been drawn before: an outage leaves the others' noise alone.

    Args:
        name: of the sensor.
        kind: what is measured, see `Measurements`.
        section: the sensor, for its outages and latency.
        time: instants of all readings, (M,) s.
        value: all readings, (M, k).
        sigma: 1σ of each component that the filter is told, (k,).
        parameters: see `Sensed`.
        lever_arm: from the block to the sensor, body axes, (3,) m.
        there: which readings there are, outages apart, (M,); all if not given.
        lag: how long before a reading that was which it tells, s.

    Returns:
        The readings outside the outages.
    """
    kept = ~within(time, section.outages_s)
    if there is not None:
        kept &= there
    told = np.tile(np.asarray(sigma, dtype=np.float64), (int(np.count_nonzero(kept)), 1))
    when, arm = time[kept], np.asarray(lever_arm, dtype=np.float64)
    given = Measurements(kind, when - lag, when + section.latency_s, value[kept], told, arm, name)
    return Sensed(given, time, parameters)
