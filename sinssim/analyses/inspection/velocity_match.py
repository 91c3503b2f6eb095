"""Inertial readings against the velocities of satellites, without knowledge of attitude, place or mounting of the unit.

The gyros give the unit's attitude relative to that at the beginning of the log, b₀. The specific force, turned by it
and integrated, is a curve α(t). Satellites give the same curve in an inertial frame, β(t), the velocity minus the
integral of gravitation. Within a window of time the two differ by a rotation, the unknown attitude, and by a constant;
in all windows together by constant biases b_g of the gyros and b_a of the accelerometers:

    β(t_k) = C_w [α + G b_g − Θ b_a](t_k + τ) + c_w + ε_k,    Θ = ∫ C_b₀b dt,    G = ∫ (C_b₀b f) × Θ dt

C_w is the rotation that fits best (Wahba's problem, solved by the singular value decomposition, Markley, J. Astronaut.
Sci. 36, 1988). The biases follow by least squares in which every window has a small rotation of its own. The rms of ε
is small only if times, units, handedness and scales of the unit are right. So τ and every doubt of this kind are
decided by the least residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.alignment.disturbed_base import inertial_curve
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.logs.recorded_streams import FixStream

WINDOW = 10.0
"""Default length of the windows, s: a manoeuvre of a car lasts as long, and a bias that changes by 0.1 °/s turns by a
degree meanwhile."""
_LEAST = 8  # fixes in a window
FIXES_IN_WINDOW = 10
"""Intervals of fixes that a window has at least, so that a few missing ones leave `_LEAST`."""
_GAP = 0.1
"""Longest interval of the readings within a window, s: beyond it their straight line is no motion (`max_gap_s`)."""
_EARTH = ELLIPSOIDS["wgs84"]
_BIAS_SIGMA = np.repeat((np.radians(1.0), 0.5), 3)  # rad/s and m/s² of the worst units


@dataclass(frozen=True)
class Pushed:
    """The inertial curve of a log."""

    time: Array  # (N+1,) s
    q_b0b: Array  # attitude of the unit relative to the first instant, (N+1, 4)
    alpha: Array  # integral of the specific force in b₀, (N+1, 3) m/s
    by_gyro_bias: Array  # G, (N+1, 3, 3) m
    by_accel_bias: Array  # Θ, (N+1, 3, 3) s

    @cached_property
    def table(self) -> Array:
        """α, G and Θ, row by row, (21, N+1): the matches at all offsets interpolate them."""
        parts = (self.alpha, self.by_gyro_bias.reshape(-1, 9), self.by_accel_bias.reshape(-1, 9))
        return np.ascontiguousarray(np.concatenate(parts, axis=1).T)


@dataclass(frozen=True)
class Seen:
    """The curve of the fixes, in an inertial frame that coincides with the Earth-fixed one at the first fix."""

    time: Array  # (M,) s
    beta: Array  # velocity minus the integral of gravitation, (M, 3) m/s
    relative: Array  # velocity relative to the Earth, in the inertial axes, (M, 3) m/s
    up: Array  # direction of the vertical, in the inertial axes, (M, 3)
    north: Array  # direction of north, in the inertial axes, (M, 3)
    speed: Array  # (M,) m/s
    sigma: float  # typical 1σ of a component of the velocity, m/s


@dataclass(frozen=True)
class Match:
    """How the two curves agree."""

    residual: float  # rms of ε over the windows, m/s per component; infinite without windows
    each: Array  # rms of each window, (W,) m/s
    centre: Array  # time of the fix in the middle of each window, (W,) s
    q_ib0: Array  # rotation of each window, for the gyros' attitude in the middle of it, (W, 4)
    turning: Array  # how well each window determines the rotation: the second singular value, (W,) m²/s²
    bias: Array  # of gyros and accelerometers, (6,) rad/s and m/s²
    window: float  # length of the windows, s
    moved: float = 0.0  # rms of the velocity of the fixes about its mean in the windows, m/s per component


def pushed(time: Array, rate: Array, force: Array, most_hz: float = np.inf) -> Pushed:
    """Integrate instantaneous readings at increasing times (N,) s; samples are joined so that there are at most
    `most_hz`."""
    steps = np.diff(time)[:, None]
    dtheta = 0.5 * (rate[1:] + rate[:-1]) * steps
    dvel = 0.5 * (force[1:] + force[:-1]) * steps
    join = max(int(1.0 / (most_hz * float(np.median(steps)))), 1) if np.isfinite(most_hz) else 1
    if join > 1:
        starts = np.arange(0, len(dtheta), join)
        dtheta, dvel = np.add.reduceat(dtheta, starts), np.add.reduceat(dvel, starts)
        time = np.append(time[starts], time[-1])
    q, alpha = inertial_curve(ImuData(time, dtheta, dvel))
    c, length = rotation.dcm_from_quaternion(q), np.diff(time)[:, None, None]
    theta = _summed(0.5 * (c[1:] + c[:-1]) * length)
    middle = 0.5 * (theta[1:] + theta[:-1])
    return Pushed(time, q, alpha, _summed(np.cross(np.diff(alpha, axis=0)[:, :, None], middle, axis=1)), theta)


def _summed(steps: Array) -> Array:
    """Return running sums from zero, (N+1, ...)."""
    return np.concatenate([np.zeros((1, *steps.shape[1:])), np.cumsum(steps, axis=0)])


def seen(fixes: FixStream) -> Seen | None:
    """Return the curve of fixes with velocities, which are differences of positions where there are none; None if fewer
    than a window's fixes are usable."""
    good = np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude) & np.isfinite(fixes.height)
    if fixes.velocity_ned is not None:
        good &= np.isfinite(fixes.velocity_ned[:, :2]).all(axis=1)
    good &= np.append(True, np.diff(fixes.time) > 0.0)
    if int(good.sum()) < _LEAST:
        return None
    time, latitude, longitude = fixes.time[good], fixes.latitude[good], fixes.longitude[good]
    place = earth.geodetic_to_ecef(latitude, longitude, fixes.height[good], _EARTH)
    q_en = earth.q_en(latitude, longitude)
    if fixes.velocity_ned is None:
        v_e, sigma = np.gradient(place, time, axis=0), 0.1
        velocity = rotation.rotate(rotation.conjugate(q_en), v_e)
    else:
        velocity = fixes.velocity_ned[good]
        if not np.isfinite(velocity[:, 2]).all():  # speed and course: the climb follows from the heights
            velocity = np.column_stack([velocity[:, :2], -_climb(time, fixes.height[good])])
        v_e = rotation.rotate(q_en, velocity)
        given = fixes.velocity_sigma
        sigma = 0.05 if given is None or not np.isfinite(given[good]).any() else float(np.nanmedian(given[good]))
    since = time - time[0]
    relative = earth.ecef_to_eci(v_e, since, _EARTH)
    carried = v_e + _EARTH.omega * np.stack([-place[:, 1], place[:, 0], np.zeros(len(place))], axis=1)
    pull = earth.ecef_to_eci(earth.gravitation_ecef(place, "normal", _EARTH), since, _EARTH)
    fallen = np.zeros_like(pull)
    fallen[1:] = np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(time)[:, None], axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    up, north = (
        earth.ecef_to_eci(rotation.rotate(q_en, np.array(axis)), since, _EARTH)
        for axis in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0))
    )
    return Seen(time, earth.ecef_to_eci(carried, since, _EARTH) - fallen, relative, up, north, speed, max(sigma, 1e-3))


_CLIMB_S = 5.0
"""Time over which heights are smoothed for the climb, s: roads change their slope within about a hundred metres."""


def _climb(time: Array, height: Array) -> Array:
    """Return the rate of heights whose noise is that of a receiver without vertical velocity, (M,) m/s."""
    from scipy.ndimage import gaussian_filter1d

    step = float(np.median(np.diff(time)))
    return np.asarray(np.gradient(gaussian_filter1d(height, max(0.5 * _CLIMB_S / step, 0.1)), time))


def match(
    curve: Pushed,
    fixes: Seen,
    offset: float,
    *,
    window: float = WINDOW,
    most: int | None = None,
    bias: Array | None = None,
    rounds: int = 3,
) -> Match:
    """Fit the two curves to each other at an offset, the unit's clock minus that of the fixes, s, in windows of a
    length, s: `most` of them, those with the largest changes of velocity, by default all. The biases, (6,) rad/s and
    m/s², begin with a first guess, by default zero."""
    rows = _windows(curve, fixes, offset, window, most)
    if not rows:
        none = np.zeros(0)
        return Match(np.inf, none, none, np.zeros((0, 4)), none, np.zeros(6), window)
    at = fixes.time + offset
    values = np.stack([np.interp(at, curve.time, row) for row in curve.table], axis=1)
    pieces = [_Window(fixes.beta[r], values[r]) for r in rows]
    biases = np.zeros(6) if bias is None else bias
    for _ in range(rounds):
        normal, right = np.diag((fixes.sigma / _BIAS_SIGMA) ** 2), -biases * (fixes.sigma / _BIAS_SIGMA) ** 2
        for piece in pieces:
            squares, product = piece.of_biases(biases)
            normal, right = normal + squares, right + product
        biases = biases + np.linalg.solve(normal, right)
    fits = [piece.fit(biases) for piece in pieces]
    each = np.array([np.sqrt(np.mean(error * error)) for error, _, _, _ in fits])
    return Match(
        float(np.sqrt(np.mean(np.square(each)))),
        each,
        np.array([float(fixes.time[r[len(r) // 2]]) for r in rows]),
        rotation.quaternion_from_dcm(np.array([c for _, c, _, _ in fits])),
        np.array([strength for _, _, strength, _ in fits]),
        biases,
        window,
        float(np.sqrt(np.mean([np.var(fixes.relative[r], axis=0).mean() for r in rows]))),
    )


def _windows(curve: Pushed, fixes: Seen, offset: float, window: float, most: int | None) -> list[NDArray[np.intp]]:
    """Return the rows of the fixes in each window."""
    time = fixes.time
    first = max(float(time[0]), float(curve.time[0]) - offset)
    last = min(float(time[-1]), float(curve.time[-1]) - offset)
    count, step = np.ceil((last - window - first) / window), (first + window) - first  # those of numpy's arange
    near = np.floor((time - first) / window)  # only windows with fixes: a wrong stamp may be years away
    numbers = np.unique(np.concatenate([near - 1.0, near, near + 1.0]))
    begins = first + step * numbers[(numbers >= 0.0) & (numbers < count)]
    rows = [np.arange(*np.searchsorted(time, (b, b + window))) for b in begins]
    rows = [r for r in rows if len(r) >= _LEAST]
    edges = np.flatnonzero(np.diff(curve.time) > max(_GAP, 5.0 * float(np.median(np.diff(curve.time)))))
    if len(edges):
        begin, end = curve.time[edges] - offset, curve.time[edges + 1] - offset
        rows = [r for r in rows if not ((begin < time[r[-1]]) & (end > time[r[0]])).any()] or rows
    if most is not None and len(rows) > most:
        size = [float(np.ptp(fixes.relative[r], axis=0).max()) for r in rows]
        rows = [rows[k] for k in np.sort(np.argsort(size)[::-1][:most])]
    return rows


_TURN_S = 5.0
"""Time over which turns are compared, s: longer than the delay of a course, shorter than gyros drift by a radian."""
_TURN = np.radians(20.0)
"""Least rms of the turns of a course that tell readings apart: the course of a slow vehicle is known to 0.1 rad."""
_LEVEL_S = 2.0
"""Time over which the specific force is averaged for the vertical, s: steps and jolts are shorter."""


def turns_apart(time: Array, rate: Array, force: Array, fixes: Seen, offset: float) -> float:
    """Return by how much the turns of the gyros about the vertical of the accelerometers differ from the course's at an
    offset, the unit's clock minus that of the fixes, s: the rms, rad, but for a bias of the gyros; NaN if the course
    hardly turns."""
    from scipy.ndimage import gaussian_filter1d

    step = float(np.median(np.diff(time)))
    up = gaussian_filter1d(force, _LEVEL_S / step, axis=0)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-30)
    turned = _summed(0.5 * np.diff(time) * -np.sum((rate * up)[1:] + (rate * up)[:-1], axis=1))
    at = fixes.time + offset
    known = (at > time[0]) & (at < time[-1])
    east = np.sum(fixes.relative * np.cross(fixes.north, fixes.up), axis=1)
    north = np.sum(fixes.relative * fixes.north, axis=1)
    course = np.unwrap(np.arctan2(east, north))
    slow = np.cumsum(np.append(0, ~known | (np.hypot(north, east) < max(1.0, 10.0 * fixes.sigma))))
    span = max(_TURN_S, 4.0 * float(np.median(np.diff(at))))
    end = np.searchsorted(at, at + span)
    begin = np.flatnonzero(end < len(at))
    begin = begin[slow[end[begin] + 1] == slow[begin]]
    end = end[begin]
    if len(begin) < 2 * _LEAST:
        return np.nan
    of_course = course[end] - course[begin]
    if float(np.sqrt(np.mean(of_course**2))) < _TURN:
        return np.nan
    of_gyros = np.interp(at, time, turned)
    apart = of_gyros[end] - of_gyros[begin] - of_course
    drift = np.clip(np.median(apart) / span, -_BIAS_SIGMA[0], _BIAS_SIGMA[0])
    return float(np.sqrt(np.mean((apart - drift * span) ** 2)))


class _Window:
    """The two curves within a window, without their means."""

    def __init__(self, beta: Array, values: Array) -> None:
        alpha, by_gyro, by_accel = values[:, :3], values[:, 3:12].reshape(-1, 3, 3), values[:, 12:].reshape(-1, 3, 3)
        middle = by_accel[len(values) // 2]  # G relative to the attitude in the middle of the window
        by_gyro = by_gyro - _crossing(alpha) @ middle
        by_bias = np.concatenate([by_gyro, -by_accel], axis=2)
        self.beta, self.alpha = beta - beta.mean(axis=0), alpha - alpha.mean(axis=0)
        self.by_bias = by_bias - by_bias.mean(axis=0)

    def fit(self, bias: Array) -> tuple[Array, Array, float, Array]:
        """Return ε (K, 3), C, the second singular value, and the corrected α (K, 3)."""
        alpha = self.alpha + self.by_bias @ bias
        left, values, right = np.linalg.svd(self.beta.T @ alpha)
        c = left @ np.diag((1.0, 1.0, np.sign(np.linalg.det(left @ right)))) @ right
        return self.beta - alpha @ c.T, c, float(values[1]), alpha

    def of_biases(self, bias: Array) -> tuple[Array, Array]:
        """Return the normal equations of a change of the biases, (6, 6) and (6,), without the window's rotation."""
        error, c, _, alpha = self.fit(bias)
        columns = self.by_bias.reshape(-1, 6)
        turned = _crossing(alpha).reshape(-1, 3)  # δ × α, but for the sign
        residual = (error @ c).reshape(-1)
        both = np.column_stack([columns, residual])
        both -= turned @ np.linalg.lstsq(turned, both, rcond=None)[0]
        return both[:, :6].T @ both[:, :6], both[:, :6].T @ both[:, 6]


def _crossing(vectors: Array) -> Array:
    """Return the matrices of v ×, (K, 3, 3)."""
    out = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out


_PARTS = 5  # groups of windows whose scatter gives the uncertainty
_LEAST_PARTS = 3


def scatter(low: Array, middle: Array, high: Array, h: float) -> float:
    """Return the 1σ of the place of a minimum, in the unit of h, from the scatter of its gradient between parts of the
    log; NaN with fewer than three windows, or without a minimum. It is the sandwich estimator (White, Econometrica 48,
    1980) with each part as one group, times the quantile of Student's distribution for so few groups. What is least is
    given for each window, (W,), at distances −h, 0 and h of the minimum."""
    from scipy.stats import t as student

    parts = min(_PARTS, len(middle))
    bend = float(np.sum(low - 2.0 * middle + high)) / h**2
    if parts < _LEAST_PARTS or not bend > 0.0:
        return float("nan")
    gradient = np.array([part.sum() for part in np.array_split(high - low, parts)]) / (2.0 * h)
    few = float(student.ppf(0.8413, parts - 1))
    return few * float(np.sqrt(parts / (parts - 1.0) * np.sum(gradient**2))) / bend
