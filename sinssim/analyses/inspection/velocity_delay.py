"""Delay of the velocities of a satellite receiver against its positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact
from sinssim.analyses.inspection.velocity_match import scatter
from sinssim.data import Array
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.logs.recorded_streams import FixStream

_CHANGES = 5.0  # s; changes of velocity within twice this time show a delay, slower ones only its edges
_LEAST_CHANGE = 0.1  # m/s
_ALIKE = 0.9  # least correlation of velocities and differences of positions


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
    fast, fast_mean = _without_slow(moved, width), _without_slow(mean, width)
    if len(fast) < 2 * width or float(np.std(fast_mean)) < _LEAST_CHANGE:
        return None
    curve = CubicSpline(time[middle], fast_mean)
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
    return Delay(value, scatter(low, here, high, h))


def _without_slow(values: Array, width: int) -> Array:
    """Return values minus their running mean over an odd number of rows, (N, k)."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(values - uniform_filter1d(values, width, axis=0, mode="nearest"))


def delay_findings(fixes: FixStream, delay_of_velocities: Delay | None, described: float) -> list[Finding]:
    """Return the finding on the delay of the velocities, which a description may give already."""
    if delay_of_velocities is None:
        return []
    delay, sigma = delay_of_velocities.value, delay_of_velocities.sigma
    step = interval_of(fixes)
    numbers = {"velocity_delay_s": delay, "sigma_s": sigma if np.isfinite(sigma) else None}
    if not sigma < _SHOWN_DELAY * step:
        text = "The motion does not show whether the velocities are older than the positions; no delay is described."
        return [doubt("fixes", text, "See the manual of the receiver.", **numbers)]
    text = f"The velocities are {1e3 * delay:.0f} ± {1e3 * sigma:.0f} ms older than the positions of the same stamp"
    if described and abs(delay - described) < 0.1 * step:
        return [fact("fixes", f"{text}; {1e3 * described:.0f} ms are described.", **numbers)]
    if described:
        text += f"; {1e3 * described:.0f} ms are described"
    elif not delayed(delay_of_velocities, step):
        return [fact("fixes", f"{text}: no delay is described.", **numbers)]
    why = " (half an interval: they are means over it)" if abs(delay / step - 0.5) < 0.15 else ""
    return [doubt("fixes", f"{text}{why}.", f"Describe a velocity delay of {delay:.3f} s.", **numbers)]


_SHOWN_DELAY = 1.0 / 6.0
"""Largest 1σ of a delay that the data show, in intervals of the fixes: half an interval is then 3σ."""


def delayed(delay: Delay, step: float) -> bool:
    """Return whether the data show that velocities are older, by a tenth of the interval of the fixes or more."""
    return delay.sigma < _SHOWN_DELAY * step and abs(delay.value) >= max(0.1 * step, 3.0 * delay.sigma)


def interval_of(fixes: FixStream) -> float:
    """Return the usual interval of fixes, s."""
    return float(np.median(np.diff(fixes.time)))
