"""Standstill detection: stops of a vehicle in its inertial readings, and the zero velocities and rates they give.

A vehicle with its engine on shakes; what shaking means rest is learned from a time at which it stands. A window of time
is taken for rest if it passes three tests:

1. the variances s² of its six axes are not larger than at rest, in their geometric mean: Π (s²/s₀²)^(1/6) < ratio.
   Σ ln(s²/s₀²) is the likelihood ratio of Gaussian readings of variance s₀² against any other variance, less terms
   linear in s²/s₀² (detectors of this family: Skog, Händel, Nilsson and Rantakokko, IEEE Trans. Biomedical Engineering
   57, 2010, 2657); a single axis that a cold engine shakes more does not outvote the others;
2. its mean rates are those at rest, which are the gyros' biases, within the 5σ by which they scatter there, and the
   drift of the biases;
3. its mean rates and specific forces change neither from the first half of the window to the second nor from the first
   window of the stop to this one, within 5σ: a vehicle that starts to roll on its idling engine shakes no more than
   before, but it accelerates.

A vehicle that rolls at a constant, small velocity without more shaking cannot be told from one at rest by any inertial
sensor. Fixes of a satellite receiver veto a stop where there are any.

A foot stands for some tenths of a second between two swings of large rates and forces, and windows are so short that
means do not help. A window of W samples f and ω is then taken for rest by the generalised likelihood ratio of Skog et
al. ("SHOE"), here with the gyros' bias b and the magnitude of gravity g as learned at rest, and divided by its mean 6:

    1/(6W) Σ [ |f − g f̄/|f̄||²/σ_f² + |ω − b|²/σ_ω² ] < ratio
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim.arguments import POSITIVE, checked_increments, number
from sinssim.data import Array, ImuData, Measurements
from sinssim.errors import InputError


@dataclass(frozen=True)
class Windows:
    """Means and variances of rates and specific forces over windows."""

    # of each window, (W,) s
    begin: Array
    end: Array
    mean: Array  # gyros, then accelerometers, (W, 6) rad/s and m/s²
    variance: Array  # of the readings about their mean, (W, 6)
    change: Array  # mean of the second half less that of the first, (W, 6)


def windows_of(imu: ImuData, length_s: float, step_s: float, least: int = 8) -> Windows:
    """Return means and variances over overlapping windows of at least so many samples, with a time from the end of one
    to the end of the next."""
    steps = np.diff(imu.time)
    interval = float(np.mean(steps))
    count, step = round(length_s / interval), max(round(step_s / interval), 1)
    if count < least or count > len(steps):
        raise InputError(
            f"a window of {length_s:g} s needs at least {least} samples and no more than there are: the data have "
            f"{len(steps)} samples of {interval:.3g} s."
        )
    rate = np.concatenate([imu.dtheta, imu.dvel], axis=1) / steps[:, None]
    offset = rate.mean(axis=0)
    rate -= offset
    none = np.zeros((1, 6))
    sums = np.concatenate([none, np.cumsum(rate, axis=0)])
    squares = np.concatenate([none, np.cumsum(rate * rate, axis=0)])
    last = np.arange(count, len(steps) + 1, step)
    mean = (sums[last] - sums[last - count]) / count
    variance = (squares[last] - squares[last - count]) / count - mean * mean
    half = count // 2
    change = (sums[last] - sums[last - half] - (sums[last - count + half] - sums[last - count])) / half
    return Windows(imu.time[last - count], imu.time[last], mean + offset, np.maximum(variance, 0.0), change)


LEAST_S = 5.0
"""Shortest time of rest from which its shaking is learned, s: five windows of a second."""

RATIO = 3.0
"""Largest geometric mean of the variances of a window at rest, in units of those learned."""

SIGMAS = 5.0
"""Largest deviation of the means of a window at rest, in units of their scatter."""

_STEPS = 10  # windows begin a tenth of their length after one another


FOOT_WINDOW_S = 0.05
"""Length of the windows in which the stances of a foot are looked for, s."""


@dataclass(frozen=True)
class Rest:
    """Inertial readings of a vehicle at rest."""

    window_s: float  # length of the windows, s
    variance: Array  # median variance of gyros and accelerometers in a window, (6,) rad²/s² and m²/s⁴
    mean: Array  # median of their means, (6,) rad/s and m/s²
    scatter: Array  # 1σ of the means of windows, (6,)
    seconds: float  # time from which this was learned, s


@dataclass(frozen=True)
class Stops:
    """The stops of a run."""

    spans: Array  # beginning and end of each stop, (S, 2) s
    rest: Rest  # what rest is


def learn_rest(
    imu: ImuData,
    velocity: Measurements | None = None,
    spans: Sequence[tuple[float, float]] | None = None,
    window_s: float = 1.0,
) -> Rest:
    """Learn the readings of a vehicle at rest from spans in which it is known to stand, or else from "gnss-velocity",
    which shows that it stands by components within 3σ of zero."""
    checked_increments(imu)
    window_s = number("window_s", window_s, "s", low=POSITIVE)
    windows = windows_of(imu, window_s, window_s / _STEPS)
    if spans is not None:
        still = np.zeros(len(windows.end), dtype=bool)
        for begin, end in spans:
            still |= (windows.begin >= begin - 1e-6) & (windows.end <= end + 1e-6)
    elif velocity is not None:
        still = _shown_by(velocity, windows, standing=True)
    else:
        raise InputError(
            "to learn the noise at rest, give velocity fixes, or spans in which the vehicle is stationary."
        )
    begins, ends = windows.begin[still], windows.end[still]
    seconds = float(np.sum(ends - np.maximum(begins, np.append(-np.inf, ends)[:-1])))  # windows overlap
    if seconds < LEAST_S - 1e-6:
        raise InputError(
            f"the vehicle stands for {seconds:.3g} s of the data; its vibration at rest is learned from {LEAST_S:g} s "
            "or more. Give spans in which the vehicle is known to be stationary, or the times of its stops."
        )
    variance, mean = np.median(windows.variance[still], axis=0), np.median(windows.mean[still], axis=0)
    # robust: a quarter of the windows may belong to the beginning or the end of a stop
    scatter = np.median(np.abs(np.diff(windows.mean[still][::_STEPS], axis=0)), axis=0) / (0.6745 * np.sqrt(2.0))
    samples = window_s * len(imu) / float(imu.time[-1] - imu.time[0])
    return Rest(window_s, variance, mean, np.maximum(scatter, np.sqrt(variance / samples)), seconds)


def find_stops(
    imu: ImuData,
    rest: Rest,
    *,
    ratio: float = RATIO,
    rate_drift: float = np.radians(0.2),
    velocity: Measurements | None = None,
) -> Stops:
    """Find the stops of a vehicle, in each of which at least one window passed the tests.

    `ratio` is the largest geometric mean of the variances, in units of those at rest; the gyros' biases may drift from
    those learned by `rate_drift`, rad/s. "gnss-velocity" vetoes a stop by a component beyond 5σ of zero within a
    window.
    """
    checked_increments(imu)
    ratio = number("ratio", ratio, low=POSITIVE)
    windows = windows_of(imu, rest.window_s, rest.window_s / _STEPS)
    with np.errstate(divide="ignore"):
        level = np.mean(np.log(windows.variance / rest.variance), axis=1)
    turning = np.abs(windows.mean[:, :3] - rest.mean[:3]) > SIGMAS * rest.scatter[:3] + rate_drift
    # the mean of half a window scatters √2 times as much, the difference of two halves twice as much
    changing = np.abs(windows.change) > SIGMAS * 2.0 * rest.scatter
    still = (level < np.log(ratio)) & ~turning.any(axis=1) & ~changing.any(axis=1)
    if velocity is not None:
        still &= ~_shown_by(velocity, windows, standing=False)
    spans: list[tuple[float, float]] = []
    anchor = None
    for k in np.flatnonzero(still):
        begin, end = float(windows.begin[k]), float(windows.end[k])
        if anchor is None or begin > spans[-1][1]:
            anchor = windows.mean[k]
            spans.append((begin, end))
        elif np.all(np.abs(windows.mean[k] - anchor) <= SIGMAS * np.sqrt(2.0) * rest.scatter):
            spans[-1] = (spans[-1][0], end)
    return Stops(np.array(spans).reshape(-1, 2), rest)


def find_stances(
    imu: ImuData,
    rest: Rest,
    *,
    window_s: float = FOOT_WINDOW_S,
    ratio: float = RATIO,
    velocity: Measurements | None = None,
) -> Stops:
    """Find the stances of a foot by the likelihood ratio of windows that begin at each sample; see the module's text.

    `ratio` is its largest value; "gnss-velocity" vetoes as in `find_stops`.
    """
    checked_increments(imu)
    window_s, ratio = number("window_s", window_s, "s", low=POSITIVE), number("ratio", ratio, low=POSITIVE)
    windows = windows_of(imu, window_s, 0.0, least=3)
    level = np.zeros(len(windows.end))
    gravity = np.linalg.norm(rest.mean[3:])
    off = (
        np.linalg.norm(windows.mean[:, :3] - rest.mean[:3], axis=1),
        np.linalg.norm(windows.mean[:, 3:], axis=1) - gravity,
    )
    for triad, away in zip((slice(0, 3), slice(3, 6)), off, strict=True):
        level += (windows.variance[:, triad].sum(axis=1) + away**2) / (6.0 * rest.variance[triad].mean())
    still = level < ratio
    if velocity is not None:
        still &= ~_shown_by(velocity, windows, standing=False)
    begin, end = windows.begin[still], windows.end[still]
    first = np.flatnonzero(np.append(True, begin[1:] > end[:-1]))[: len(begin)]
    spans = np.column_stack([begin[first], np.append(end[first[1:] - 1], end[-1:])])
    return Stops(spans, rest)


def _shown_by(velocity: Measurements, windows: Windows, *, standing: bool) -> NDArray[np.bool_]:
    """Return the windows in which fixes of velocity show rest, or in which one shows motion, (W,)."""
    size = np.max(np.abs(velocity.value) / velocity.sigma, axis=1)
    size = np.where(np.isfinite(size), size, np.inf if standing else 0.0)
    first = np.searchsorted(velocity.time, windows.begin - 1e-6)
    last = np.searchsorted(velocity.time, windows.end + 1e-6)
    moving = np.concatenate([[0], np.cumsum(size > (3.0 if standing else SIGMAS))])
    any_moving = moving[last] > moving[first]
    return np.asarray(~any_moving & (last > first) if standing else any_moving)


def standstill(
    stops: Stops, *, velocity_sigma: float = 0.02, rate_hz: float = 1.0, velocity: bool = True, rate: bool = True
) -> list[Measurements]:
    """Return the readings "zero-velocity" and "zero-rate" that stops give, valid at the ends of whole intervals within
    a stop. The 1σ of the velocity is that of the shaking, m/s; that of the rates is the scatter of their means at
    rest."""
    velocity_sigma = number("velocity_sigma", velocity_sigma, "m/s", low=POSITIVE)
    interval = 1.0 / number("rate_hz", rate_hz, "measurements per second", low=POSITIVE)
    times = [np.arange(begin + interval, end + 1e-9, interval) for begin, end in stops.spans]
    time = np.concatenate(times) if times else np.zeros(0)
    zero = np.zeros((len(time), 3))
    readings = []
    if velocity:
        sigma = np.broadcast_to(np.full(3, velocity_sigma), (len(time), 3))
        readings.append(Measurements("zero-velocity", time, time, zero, sigma))
    if rate:
        scatter = stops.rest.scatter[:3] * np.sqrt(stops.rest.window_s / interval)
        readings.append(Measurements("zero-rate", time, time, zero, np.broadcast_to(scatter, (len(time), 3))))
    return readings
