"""The offset between the clocks of an inertial unit and a satellite receiver, and the delay of the velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.analyses.inspection.velocity_match import FIXES_IN_WINDOW, Match, Pushed, Seen, match
from sinssim.data import Array
from sinssim.earth.models import ELLIPSOIDS
from sinssim.logs.streams import FixStream

NEAR = 1.0
"""Range of the fine search, s."""
WINDOWS = (10.0, 30.0)
"""Lengths of the windows that are tried, s: the shorter one bears with biases that change, the longer one is needed for
motion that changes slowly, as that of an airliner; the one with the smaller scatter counts."""
_CHANGES = 5.0  # s; changes of velocity within twice this time show a delay, slower ones only its edges
_LEAST_CHANGE = 0.1  # m/s
_ALIKE = 0.9  # least correlation of velocities and differences of positions
_TURNS_ALIKE = 0.5  # least correlation of the turns
_MOST_STEPS = 1e7  # eleven days in steps of 0.1 s; what lasts longer has a wrong stamp
_COURSE = 10.0  # in units of the velocities' σ: a course at this speed is good to 0.1 rad
_PARTS = 5  # groups of windows whose scatter gives the uncertainty
_LEAST_PARTS = 3


@dataclass(frozen=True)
class Offset:
    """The unit's clock minus that of the receiver.

    Attributes:
        value: s, relative to the stamps of the velocities.
        sigma: 1σ from the scatter between parts of the log, s; NaN if there are too few windows, or no motion.
        match: agreement of the curves at this offset.
        inside: whether the residual is least inside of the searched range, and clearly larger at both of its ends.
    """

    value: float
    sigma: float
    match: Match
    inside: bool

    @property
    def shown(self) -> bool:
        """Whether the data show it: the residual has a minimum, whose 1σ is small against the searched range."""
        return self.inside and bool(self.sigma < _SHARP * NEAR)


_SHARP = 1.0 / 6.0
"""Largest 1σ of an offset that the data show, in units of the searched range: 3σ are then half of it."""


_RISES = 1.1
"""Factor by which the residual is larger at both ends of the range, if the motion shows the offset: of noise alone, it
differs by less, being the rms of a hundred independent values or more."""


@dataclass(frozen=True)
class Coarse:
    """The offset by the rates of turn.

    Attributes:
        value: the unit's clock minus that of the receiver, s.
        alike: correlation of the two rates of turn there.
    """

    value: float
    alike: float


def coarse_offset(time: Array, rate: Array, fixes: Seen) -> Coarse | None:
    """Find the offset of two clocks that have nothing in common, from the rates of turn.

    The magnitude of the gyros' rate is compared with the magnitude of the rate of the course, at all offsets at which
    the logs overlap by half of the shorter one.

    Args:
        time: of the unit, (N,) s.
        rate: (N, 3) rad/s.

    Returns:
        The offset, s; None if nothing stands out.
    """
    step = max(float(np.median(np.diff(fixes.time))), 0.1)
    if not max(np.ptp(fixes.time), np.ptp(time)) < _MOST_STEPS * step:
        return None
    grid = np.arange(fixes.time[0], fixes.time[-1], step)
    direction = fixes.relative / np.maximum(fixes.speed, 1e-3)[:, None]
    turn = np.linalg.norm(np.gradient(direction, fixes.time, axis=0), axis=1) * (fixes.speed > _COURSE * fixes.sigma)
    course = np.interp(grid, fixes.time, np.minimum(turn, 2.0))
    own = np.arange(time[0], time[-1], step)
    angle = np.concatenate([[np.zeros(3)], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, None], axis=0)])
    size = np.linalg.norm(np.diff([np.interp(own, time, a) for a in angle.T], axis=1), axis=0) / step
    if not (len(size) and len(course)):
        return None
    a, b = size - np.mean(size), course - np.mean(course)
    if not (a.any() and b.any()):
        return None
    product = np.correlate(a, b, mode="full") if min(len(a), len(b)) < 2000 else _correlate(a, b)
    lags = np.arange(-(len(b) - 1), len(a))
    overlap = np.minimum(lags + len(b), len(a)) - np.maximum(lags, 0)
    product = np.where(overlap >= 0.5 * min(len(a), len(b)), product / np.sqrt(np.maximum(overlap, 1)), -np.inf)
    best = int(np.argmax(product))
    lag = int(lags[best])
    common = slice(max(lag, 0), min(lag + len(b), len(a)))
    one, other = a[common], b[common.start - lag : common.stop - lag]
    if not one.std() or not other.std():
        return None
    alike = float(np.corrcoef(one, other)[0, 1])
    return Coarse(float(own[0] - grid[0] + lags[best] * step), alike) if alike >= _TURNS_ALIKE else None


def _correlate(a: Array, b: Array) -> Array:
    from scipy.signal import correlate

    return np.asarray(correlate(a, b, mode="full", method="fft"))


def fine_offset(curve: Pushed, fixes: Seen, about: float) -> Offset | None:
    """Find the offset with the least residual of the velocities.

    Args:
        about: first guess, s.

    Returns:
        The offset; None if the logs do not overlap.
    """
    from scipy.optimize import minimize_scalar

    found: list[Offset] = []
    least = FIXES_IN_WINDOW * float(np.median(np.diff(fixes.time)))
    for window in (max(each, least * each / WINDOWS[0]) for each in WINDOWS):
        first = match(curve, fixes, about, window=window)
        if not np.isfinite(first.residual):
            continue

        def cost(offset: float, window: float = window, bias: Array = first.bias, rounds: int = 1) -> float:
            return match(curve, fixes, offset, window=window, bias=bias, rounds=rounds).residual

        grid = about + np.arange(-NEAR, NEAR + 0.05, 0.1)
        costs = [cost(offset, rounds=0) for offset in grid]
        best = int(np.argmin(costs))
        around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
        value = float(minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 5e-4}).x)
        own = match(curve, fixes, value, window=window)
        inside = 0 < best < len(grid) - 1 and min(costs[0], costs[-1]) > _RISES * costs[best]
        found.append(Offset(value, _offset_sigma(curve, fixes, value, own), own, inside))
    return min(found, key=lambda one: (not one.inside, np.isnan(one.sigma), one.sigma), default=None)


def _offset_sigma(curve: Pushed, fixes: Seen, value: float, own: Match) -> float:
    """Return the 1σ of the offset, s."""
    h = 0.05
    low, middle, high = (
        match(curve, fixes, value + d, window=own.window, bias=own.bias, rounds=0).each ** 2 for d in (-h, 0.0, h)
    )
    return _scatter(low, middle, high, h) if len(low) == len(middle) == len(high) else float("nan")


def _scatter(low: Array, middle: Array, high: Array, h: float) -> float:
    """Return the 1σ of the place of a minimum from the scatter of its gradient between parts of the log.

    It is the sandwich estimator (White, Econometrica 48, 1980) with each part as one group, times the quantile of
    Student's distribution for so few groups.

    Args:
        low, middle, high: what is least, for each window, (W,), at distances −h, 0 and h of the minimum.
        h: that distance.

    Returns:
        1σ in the unit of h; NaN with fewer than three windows, or without a minimum.
    """
    from scipy.stats import t as student

    parts = min(_PARTS, len(middle))
    bend = float(np.sum(low - 2.0 * middle + high)) / h**2
    if parts < _LEAST_PARTS or not bend > 0.0:
        return float("nan")
    gradient = np.array([part.sum() for part in np.array_split(high - low, parts)]) / (2.0 * h)
    few = float(student.ppf(0.8413, parts - 1))
    return few * float(np.sqrt(parts / (parts - 1.0) * np.sum(gradient**2))) / bend


@dataclass(frozen=True)
class Delay:
    """By how much the velocities of a receiver are older than its positions.

    Attributes:
        value: s.
        sigma: 1σ from the scatter between parts of the log, s; NaN if they do not give it.
    """

    value: float
    sigma: float


def velocity_delay(fixes: FixStream) -> Delay | None:
    """Find by how much the velocities of a receiver are older than its positions.

    A velocity that is the mean over the last interval is half an interval old. Central differences of the positions are
    compared with the velocities, equally smoothed and at another time; the delay has the largest correlation. A least
    difference would be biased, because interpolation changes the noise.

    Returns:
        The delay, s; None without velocities, motion, or positions precise enough to show it.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    if fixes.velocity_ned is None:
        return None
    good = np.isfinite(fixes.velocity_ned[:, :2]).all(axis=1) & np.isfinite(fixes.latitude) & np.isfinite(fixes.height)
    good &= np.append(True, np.diff(fixes.time) > 0.0)
    if int(good.sum()) < 50:
        return None
    time, velocity = fixes.time[good], fixes.velocity_ned[good]
    ellipsoid = ELLIPSOIDS["wgs84"]
    place = earth.geodetic_to_ecef(fixes.latitude[good], fixes.longitude[good], fixes.height[good], ellipsoid)
    c = rotation.dcm_from_quaternion(earth.q_en(fixes.latitude[good][0], fixes.longitude[good][0]))
    step = float(np.median(np.diff(time)))
    middle = slice(1, -1)
    moved = (((place - place[0]) @ c)[2:] - ((place - place[0]) @ c)[:-2])[:, :2] / (time[2:] - time[:-2])[:, None]
    # The same mean over two intervals of the velocities, and of both what changes within seconds.
    mean = 0.25 * velocity[:-2, :2] + 0.5 * velocity[1:-1, :2] + 0.25 * velocity[2:, :2]
    width = 2 * max(round(_CHANGES / step), 1) + 1
    fast, own = _without_slow(moved, width), _without_slow(mean, width)
    if len(fast) < 2 * width or float(np.std(own)) < _LEAST_CHANGE:
        return None
    curve = CubicSpline(time[middle], own)
    inside = slice(3, -5)  # the delays of the grid stay inside
    regular = np.diff(time[middle], prepend=time[0]) < 1.5 * step
    at, to = time[middle][inside], fast[inside] * regular[inside][:, None]

    def cost(delay: float) -> float:
        return -float(np.sum(curve(at + delay) * to))

    grid = step * np.arange(-2.0, 4.01, 0.1)
    costs = np.array([cost(d) for d in grid])
    best = int(np.argmin(costs))
    alike = -costs[best] / max(float(np.sqrt(np.sum(curve(at + grid[best]) ** 2) * np.sum(to**2))), 1e-300)
    if not 0 < best < len(grid) - 1 or alike < _ALIKE:
        return None
    bounds = (grid[best - 1], grid[best + 1])
    value = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-4}).x)
    h = 0.1 * step
    # differences scatter by the noise alone, correlations also by the motion at both ends of a part
    same = regular[inside][:, None]
    low, here, high = (0.5 * np.sum((curve(at + value + d) * same - to) ** 2, axis=1) for d in (-h, 0.0, h))
    return Delay(value, _scatter(low, here, high, h))


def _without_slow(values: Array, width: int) -> Array:
    """Return values minus their running mean over an odd number of rows, (N, k)."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(values - uniform_filter1d(values, width, axis=0, mode="nearest"))
