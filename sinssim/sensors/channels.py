"""Channels of a log on equal intervals, as Allan deviations and spectra need them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sinssim.checks import longest_gap
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.sensors.log import Samples, TriadName

AXES = ("x", "y", "z")
"""Forward, right, down."""
CHANNELS: tuple[tuple[TriadName, int], ...] = tuple((triad, i) for triad in ("gyro", "accel") for i in range(3))
"""Triad and axis of every channel, in the order in which they are shown."""
SHORTEST, LONGEST = 1e-9, 1e6
"""Intervals that a log may have, s."""

_STEADY = 0.01  # of an interval, by which times may be rounded


@dataclass(frozen=True)
class Clock:
    """How the samples of a log lie in time.

    Attributes:
        interval: mean interval T, s.
        unevenness: largest departure of an interval from T, relative to T.
    """

    interval: float
    unevenness: float

    @property
    def even(self) -> bool:
        """Whether the intervals are equal but for the rounding of times."""
        return self.unevenness <= _STEADY


def channel_name(triad: TriadName, axis: int) -> str:
    """Return what a channel is called: gyro_x."""
    return f"{triad}_{AXES[axis]}"


def chosen_channels(names: Sequence[str]) -> list[tuple[TriadName, int]]:
    """Return the channels that some names stand for.

    Args:
        names: "gyro_x" … "accel_z", "gyro" or "accel" for three of them; nothing for all.

    Returns:
        Triads and axes, in the order of `CHANNELS`.

    Raises:
        InputError: there is no such channel.
    """
    known = {channel_name(*channel): {channel} for channel in CHANNELS}
    known |= {triad: {channel for channel in CHANNELS if channel[0] == triad} for triad in ("gyro", "accel")}
    wanted: set[tuple[TriadName, int]] = set() if names else set(CHANNELS)
    for name in names:
        if name not in known:
            raise unknown_name("channel", name, known)
        wanted |= known[name]
    return [channel for channel in CHANNELS if channel in wanted]


def part(samples: Samples, start: float | None, end: float | None, source: str) -> Samples:
    """Cut some time out of a log.

    Args:
        samples: the log.
        start, end: times on the log's own clock, s; None for its own ends.
        source: what to call it in a message.

    Returns:
        The intervals that lie between.

    Raises:
        InputError: there are none.
    """
    time = samples.time
    first = 0 if start is None else int(np.searchsorted(time, start - 1e-9))
    last = len(time) if end is None else int(np.searchsorted(time, end + 1e-9, side="right"))
    if last - first < 2:
        asked = " ".join(f"{word} {limit:.9g} s" for word, limit in (("from", start), ("to", end)) if limit is not None)
        raise InputError(
            f"{source}: there are no samples {asked}; the log runs from {time[0]:.9g} to {time[-1]:.9g} s."
        )
    rows = slice(first, last - 1)
    return Samples(samples.kind, time[first:last], {name: values[rows] for name, values in samples.triads.items()})


def clock(samples: Samples, source: str) -> Clock:
    """Look at the times of a log.

    Args:
        samples: the log.
        source: what to call it in a message.

    Returns:
        Mean interval, and how much the intervals differ.

    Raises:
        InputError: samples are missing somewhere.
    """
    steps = np.diff(samples.time)
    if (gap := longest_gap(samples.time)) is not None:
        worst, typical = gap
        raise InputError(
            f"{source}, sample {worst}: there are no samples for {steps[worst]:.6g} s from {samples.time[worst]:.9g} s "
            f"on, where intervals are {typical:.6g} s. Take a part without a gap (--from, --to); if samples are lost "
            "but not their increments, put the log on equal intervals first."
        )
    interval = float((samples.time[-1] - samples.time[0]) / len(steps))
    if not SHORTEST <= interval <= LONGEST:
        raise InputError(
            f"{source}: samples every {interval:.3g} s are no inertial sensor's, which gives one every {SHORTEST:g} to "
            f"{LONGEST:g} s. Which unit do its times have (time_unit, rate_hz)?"
        )
    return Clock(interval, float(np.max(np.abs(steps - interval))) / interval)


def even_increments(samples: Samples, triad: TriadName, axis: int, timing: Clock) -> Array:
    """Return one channel's increments over equal intervals.

    A rate is taken to hold over the interval before its sample. At uneven times the accumulated angle is taken at the
    sample nearest to each edge, not interpolated, which would smooth the noise: white noise stays what it is.

    Args:
        samples: the log.
        triad: "gyro" or "accel".
        axis: 0, 1 or 2.
        timing: its times.

    Returns:
        (N,) rad or m/s.
    """
    values = np.ascontiguousarray(samples.triads[triad][:, axis])
    if timing.even:
        return values if samples.kind == "increments" else np.asarray(values * timing.interval)
    steps = np.diff(samples.time)
    mean = float(np.mean(values)) if samples.kind == "rates" else float(np.sum(values) / np.sum(steps))
    # without the mean rate, so that uneven times do not become noise by it
    departures = (values - mean) * steps if samples.kind == "rates" else values - mean * steps
    angle = np.concatenate([[0.0], np.cumsum(departures)])
    edges = np.linspace(samples.time[0], samples.time[-1], len(samples.time))
    after = np.searchsorted(samples.time, edges).clip(1, len(steps))
    nearest = after - (edges - samples.time[after - 1] < samples.time[after] - edges)
    return np.asarray(np.diff(angle[nearest]) + mean * timing.interval)
