"""What follows from the attitude that the match gives: the mounting of the unit, and whether a reference is right.

The mounting follows from the direction of motion in the unit's axes and from gravity. The attitude of a reference is
compared with that of the match, which no filter and no magnetometer has touched.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.inspection.finding import Finding, doubt, fact
from sinssim.analyses.inspection.velocity_match import Match, Pushed, Seen
from sinssim.data import Array
from sinssim.logs.text.description import DIRECTIONS
from sinssim.sensors.from_readings.first_course import WORST

_FAST = 5.0  # m/s, at which the direction of a velocity of 0.05 m/s noise is good to 0.6°
_STRAIGHT = np.radians(3.0)  # rad/s; in turns the body of a vehicle does not point along the velocity
_LASTING = 2.0  # s, over which the residuals of a match are alike: biases, scale factors and the receiver's filter
_SURE = 5.0  # °, uncertainty of a window's attitude up to which a reference is compared with it
_NEAR = 0.1  # s, from a fix to the nearest row of a reference
_AGREES = 2.0  # °, difference of a reference up to which nothing is doubtful: mounting and flexure make as much
_LEAST_WINDOWS = 3
_KNOWN = np.radians(5.0)  # 1σ up to which a mounting is known: named axes are 90° apart, and 3σ are a sixth of it
_NAMES = {place: name for name, place in DIRECTIONS.items()}


@dataclass(frozen=True)
class Mounting:
    """How the unit sits in a vehicle that moves where it points.

    Attributes:
        axes: the vehicle's direction nearest to x, y and z of the unit, for example ("forward", "right", "down").
        angles: small rotation that remains, roll, pitch, yaw of the unit's named axes in the vehicle, (3,) rad.
        sigma: 1σ of the pitch and the yaw from the scatter between windows, (2,) rad.
        windows: number of windows used.
    """

    axes: tuple[str, str, str]
    angles: Array
    sigma: Array
    windows: int

    @property
    def known(self) -> bool:
        """Whether the data show it: with fewer windows there is no scatter, and with more of it no nearest axis."""
        return self.windows >= _LEAST_WINDOWS and bool(np.max(self.sigma) < _KNOWN)

    def of_vehicle(self, of_unit: Array) -> Array:
        """Return roll, pitch and heading of the vehicle from those of the unit, (3,) rad."""
        named = np.zeros((3, 3))
        for column, name in enumerate(self.axes):
            row, sign = DIRECTIONS[name]
            named[row, column] = sign
        c_vs, c_ns = (rotation.dcm_from_quaternion(rotation.quaternion_from_euler(*a)) for a in (self.angles, of_unit))
        q_nv = rotation.quaternion_from_dcm(c_ns @ (c_vs @ named).T)
        return np.array(rotation.euler_from_quaternion(q_nv))


def mounting(curve: Pushed, fixes: Seen, agreement: Match, offset: float) -> Mounting | None:
    """Find the mounting.

    The forward axis is the mean direction of the velocity in the unit's axes, on straight parts at speed. The right
    axis is perpendicular to it and to the mean direction of the vertical, so that the roll refers to the mean roll of
    the vehicle.

    Args:
        offset: the unit's clock minus that of the fixes, s.

    Returns:
        The mounting; None if the vehicle hardly moved.
    """
    if not len(agreement.centre):
        return None
    q_ib, row, window, inside = _attitudes(curve, fixes, agreement, offset)
    step = np.maximum(curve.time[row] - curve.time[row - 1], 1e-9)
    lag = max(round(1.0 / float(np.median(step))), 1)  # rate over a second
    before = np.maximum(row - lag, 0)
    turned = rotation.rotation_vector_from_quaternion(
        rotation.multiply(rotation.conjugate(curve.q_b0b[before]), curve.q_b0b[row])
    )
    rate = np.linalg.norm(turned, axis=1) / np.maximum(curve.time[row] - curve.time[before], 1e-9)
    used = inside & (fixes.speed > _FAST) & (rate < _STRAIGHT)
    used &= agreement.each[window] < 3.0 * float(np.median(agreement.each))
    if int(used.sum()) < 20:
        return None
    along = rotation.rotate(rotation.conjugate(q_ib[used]), fixes.relative[used]) / fixes.speed[used][:, None]
    weight = agreement.turning[window[used]] / np.maximum(agreement.each[window[used]], 1e-6) ** 2
    forward, of_window = _mean_direction(along, weight, window[used])
    down = -np.mean(rotation.rotate(rotation.conjugate(q_ib[used]), fixes.up[used]), axis=0)
    right = np.cross(down, forward)
    right /= np.linalg.norm(right)
    c_bv = np.column_stack([forward, right, np.cross(forward, right)])
    return _named(c_bv, of_window)


def _attitudes(
    curve: Pushed, fixes: Seen, agreement: Match, offset: float
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
    """Return the unit's attitude in inertial axes at each fix, its row in the curve, its window, and if it is in it."""
    at = np.clip(fixes.time + offset, curve.time[0], curve.time[-1])
    row = np.clip(np.searchsorted(curve.time, at), 1, len(curve.time) - 1)
    window = np.argmin(np.abs(fixes.time[:, None] - agreement.centre[None, :]), axis=1)
    inside = np.abs(fixes.time - agreement.centre[window]) <= 0.5 * agreement.window
    middle = np.searchsorted(curve.time, np.clip(agreement.centre + offset, curve.time[0], curve.time[-1]))
    since = curve.by_accel_bias[row] - curve.by_accel_bias[np.minimum(middle, len(curve.time) - 1)[window]]
    drift = rotation.quaternion_from_rotation_vector(-since @ agreement.bias[:3])
    q_ib = rotation.multiply(agreement.q_ib0[window], rotation.multiply(drift, curve.q_b0b[row]))
    return q_ib, row, window, inside


def attitude_finding(
    curve: Pushed, fixes: Seen, agreement: Match, offset: float, time: Array, q_nb: Array
) -> Finding | None:
    """Compare the attitude of a reference with that of the match, which takes gyros, accelerometers and fixes alone.

    Args:
        offset: the unit's clock minus that of the fixes, s.
        time: instants of the reference on the unit's clock, (R,) s.
        q_nb: attitude of the unit, (R, 4).

    Returns:
        The finding; None if no window determines the attitude.
    """
    if not len(agreement.centre):
        return None
    q_ib, _, window, inside = _attitudes(curve, fixes, agreement, offset)
    alike = np.sqrt(max(_LASTING / float(np.median(np.diff(fixes.time))), 1.0))
    uncertain = np.degrees(alike * agreement.each / np.sqrt(np.maximum(agreement.turning, 1e-12)))
    at = fixes.time + offset
    near = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    near -= at - time[near - 1] < time[near] - at
    used = inside & (uncertain[window] < _SURE) & (np.abs(time[near] - at) < _NEAR)
    if int(used.sum()) < 20:
        return None
    c_ni = np.stack([fixes.north, np.cross(fixes.north, fixes.up), -fixes.up], axis=1)[used]
    c_nb = c_ni @ rotation.dcm_from_quaternion(q_ib[used])
    other = rotation.dcm_from_quaternion(q_nb[near[used]])
    error = rotation.rotation_vector_from_quaternion(rotation.quaternion_from_dcm(other @ np.swapaxes(c_nb, -1, -2)))
    off = np.degrees(np.sqrt(np.mean(np.square(error), axis=0)))
    tilt, heading, count = float(np.hypot(off[0], off[1])), float(off[2]), len(np.unique(window[used]))
    own = float(np.sqrt(np.mean(uncertain[window[used]] ** 2)))
    text = (
        f"The attitude of the reference differs from that of inertial data and fixes without a filter by "
        f"{tilt:.2f}° in tilt and {heading:.2f}° in heading (rms over {count} windows of {agreement.window:g} s, "
        f"uncertain by about {own:.2g}°)."
    )
    numbers = {"tilt_deg": tilt, "heading_deg": heading, "uncertain_deg": own, "windows": count}
    if max(tilt, heading) < max(_AGREES, 3.0 * own):
        return fact("reference", text, **numbers)
    fix = "Its axes or its clock differ from the description, or it is wrong: do not judge attitudes by it."
    return doubt("reference", text, fix, **numbers)


def attitude_by_match(
    curve: Pushed, fixes: Seen, agreement: Match, offset: float, begin: float
) -> tuple[Array, float] | None:
    """Return the attitude of the unit at an instant, which needs neither its mounting nor a motion along one axis.

    Args:
        offset: the unit's clock minus that of the fixes, s.
        begin: the instant on the unit's clock, s.

    Returns:
        Roll, pitch and heading, (3,) rad, from the first window that gives the heading to `WORST` and carried back by
        the gyros without their biases; and the 1σ of the heading, rad. None if no window gives it.
    """
    alike = np.sqrt(max(_LASTING / float(np.median(np.diff(fixes.time))), 1.0))
    uncertain = alike * agreement.each / np.sqrt(np.maximum(agreement.turning, 1e-12))
    sure = np.flatnonzero((uncertain < WORST) & (agreement.centre + offset >= begin))
    if not len(sure):
        return None
    w = int(sure[0])
    row, middle = (
        min(int(np.searchsorted(curve.time, t)), len(curve.time) - 1) for t in (begin, agreement.centre[w] + offset)
    )
    since = curve.by_accel_bias[row] - curve.by_accel_bias[middle]
    drift = rotation.quaternion_from_rotation_vector(-since @ agreement.bias[:3])
    q_ib = rotation.multiply(agreement.q_ib0[w], rotation.multiply(drift, curve.q_b0b[row]))
    near = int(np.argmin(np.abs(fixes.time + offset - begin)))
    north, up = fixes.north[near], fixes.up[near]
    c_ni = np.stack([north, np.cross(north, up), -up])
    q_nb = rotation.quaternion_from_dcm(c_ni @ rotation.dcm_from_quaternion(q_ib))
    return np.array(rotation.euler_from_quaternion(q_nb)), float(uncertain[w])


def _mean_direction(along: Array, weight: Array, window: Array) -> tuple[Array, Array]:
    """Return the weighted mean direction, and the mean direction of each window with enough weight, (W, 3)."""
    each, heavy = [], []
    for w in np.unique(window):
        rows = window == w
        mean = along[rows].mean(axis=0)
        each.append(mean / np.linalg.norm(mean))
        heavy.append(float(weight[rows].mean()))
    directions, weights = np.array(each), np.array(heavy)
    centre = np.median(directions, axis=0)
    for _ in range(20):  # robust mean: weights of Huber's kind
        far = np.linalg.norm(directions - centre, axis=1)
        limit = max(1.5 * float(np.median(far)), 1e-6)
        w = np.sqrt(weights) * np.minimum(1.0, limit / np.maximum(far, 1e-12))
        centre = (w[:, None] * directions).sum(axis=0) / w.sum()
    return np.asarray(centre / np.linalg.norm(centre)), directions


def _named(c_bv: Array, of_window: Array) -> Mounting:
    """Return the nearest named axes and the remaining angles."""
    best, nearest = -np.inf, np.eye(3)
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            m = np.zeros((3, 3))
            m[range(3), list(order)] = signs
            if np.linalg.det(m) > 0.0 and float(np.sum(m * c_bv)) > best:
                best, nearest = float(np.sum(m * c_bv)), m
    names = [_NAMES[(int(np.argmax(np.abs(row))), int(np.sign(row[np.argmax(np.abs(row))])))] for row in nearest]
    c_vs = c_bv.T @ nearest  # from the unit's axes, renamed to forward-right-down, into the vehicle's
    roll, pitch, yaw = (float(x) for x in rotation.euler_from_quaternion(rotation.quaternion_from_dcm(c_vs)))
    yaw = (yaw + np.pi) % (2.0 * np.pi) - np.pi  # the axes are named by quarter turns: the rest is small
    inside = of_window @ nearest  # directions of motion in the renamed axes
    centre = np.median(inside, axis=0)
    spread = 1.4826 * np.median(np.abs(inside - centre), axis=0) / np.sqrt(max(len(inside) - 1, 1))
    return Mounting(
        (names[0], names[1], names[2]),
        np.array([roll, pitch, yaw]),
        np.array([spread[2], spread[1]]),
        len(of_window),
    )
