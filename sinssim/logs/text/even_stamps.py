"""Even instants of samples whose stamps jitter, repeat or go back: order and count are those of the samples.

A loop follows the stamps: the next sample is expected one interval after the one before, and a stamp moves the
expectation by a small part of its departure. Samples of one stamp are a packet, which is stamped at its end. If it and
those after it come more than half an interval too late, others are missing before it. Numbers of samples times the
interval, plus the mean departure of the stamps over some seconds, which follows a clock that drifts, are the instants.
"""

from __future__ import annotations

import math

import numpy as np

from sinssim.data import Array

_GAIN = 0.01
"""Part of a departure that the loop takes over: jitter of an interval moves the expectation by a tenth of one."""
_LATE = 0.5
"""Departure in intervals from which a sample is missing."""
_AGREEING = 5
"""Samples or packets that have to be late together, so that jitter of half an interval is taken for a loss once in 1e4
samples."""
_FIRST = 11
"""Samples or packets whose median departure the loop starts from."""
_MEAN_S = 30.0
"""Time over which departures are averaged, s: jitter becomes a fiftieth at 100 samples a second, and the drift of a
quartz is even over it."""
_SHARE = (5.0, 75.0)
"""Percentiles of the times of several samples between which none is missing, unless many are."""


def even_stamps(time: Array) -> tuple[Array, float]:
    """Return even instants of samples.

    Args:
        time: stamps, in the order of the samples, (N,) s.

    Returns:
        Increasing instants, (N,) s, and the interval of the samples, s.
    """
    interval = _interval(time)
    for _ in range(2):
        number = _numbers(time, interval)
        interval = float(np.polyfit(number, time - time[0], 1)[0])
    departure = time - time[0] - interval * number
    width = 2 * max(int(0.5 * _MEAN_S / interval), 1) + 1
    if len(time) < 2 * width:
        mean = np.full(len(time), departure.mean())
    else:
        from scipy.ndimage import uniform_filter1d

        mean = uniform_filter1d(departure, width, mode="reflect")
    return np.asarray(time[0] + interval * number + mean), interval


def _interval(time: Array) -> float:
    """Return the interval of samples of which some are missing."""
    steps = np.diff(time)
    many = min(10 * math.ceil(1.0 / max(float((steps > 0.0).mean()), 1e-3)), len(steps))
    several = (time[many:] - time[:-many]) / many
    low, high = np.percentile(several, _SHARE)
    interval = float(several[(several >= low) & (several <= high)].mean())
    while (many := 5 * many) < len(steps):  # over more samples, whose number follows from the interval so far
        lasts = time[many:] - time[:-many]
        interval = float(np.median(lasts / np.maximum(np.rint(lasts / interval), 1.0)))
    return interval


def _numbers(time: Array, interval: float) -> Array:
    """Return the numbers of the samples, with those that are missing counted, (N,)."""
    begins = np.flatnonzero(np.append(True, np.diff(time) != 0.0))  # of packets, and of single samples
    sizes = np.diff(np.append(begins, len(time)))
    stamps = ((time[begins] - time[0]) / interval).tolist()
    counted = np.cumsum(sizes).tolist()
    missing = 0
    # by what a stamp exceeds the number of its sample; more than a few at the beginning lack no sample
    shift = float(np.median([a - b for a, b in zip(stamps[:_FIRST], counted[:_FIRST], strict=True)]))
    ends = [counted[0]]
    for k in range(1, len(stamps)):
        departure = stamps[k] - counted[k] - missing - shift
        if departure > _LATE:
            few = range(k, min(k + _AGREEING, len(stamps)))
            mean = sum(stamps[j] - counted[j] for j in few) / len(few) - missing - shift
            if mean > _LATE:
                missing += round(mean)
                departure = stamps[k] - counted[k] - missing - shift
        shift += _GAIN * departure
        ends.append(counted[k] + missing)
    number = np.repeat(np.array(ends) - sizes, sizes) + np.arange(len(time)) - np.repeat(begins, sizes)
    return np.asarray(number - number[0], dtype=np.float64)
