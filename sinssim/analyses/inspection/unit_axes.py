"""Units, kinds, axes and mounting of an inertial unit by the match with the fixes.

A common rotation of gyros and accelerometers changes nothing in the match with the fixes, because the attitude is free
there. A wrong scale or sign of the gyros, a left-handed set of axes, or axes of the gyros in another order than those
of the accelerometers increase the residual by far. Where the velocities do not tell, the turns of the course do: the
gyros turn as much about the vertical that the accelerometers show, for a vehicle that moves where it points.

The mounting follows from the direction of motion in the unit's axes and from gravity. The attitude of a reference is
compared with that of the match, which no filter and no magnetometer has touched.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact, wrong
from sinssim.analyses.inspection.velocity_match import Match, Pushed, Seen, match, pushed, turns_apart
from sinssim.data import Array
from sinssim.logs.column_description import DIRECTIONS
from sinssim.sensors.aiding.gnss import WORST

WORSE = "Navigation with these inertial data is probably worse than the fixes alone. "
"""So it was in seven of eight public logs whose suggested scenario was run."""
CLEARLY = 2.0
"""Factor by which another reading must reduce the residual before it is believed."""
_RATE = 25.0  # samples a second are enough for the question
_WINDOWS = 12  # windows with the largest changes of velocity
EXPLAINED = 0.5
"""Part of the change of velocity that an interpretation may leave over."""
_GOOD = 5.0  # residual, in units of the velocities' σ, up to which the offset is trusted
_MANOEUVRES = 10.0  # in units of the velocities' σ: a change of velocity that tells hypotheses apart


_RATIOS = (
    ("°/s", "rad/s", "deg/s", np.pi / 180.0),
    ("mrad/s", "rad/s", "mrad/s", 1e-3),
    ("°/h", "°/s", "deg/h", 1.0 / 3600.0),
    ("°/h", "rad/s", "deg/h", np.pi / 180.0 / 3600.0),
    ("mrad/s", "°/s", "mrad/s", 0.18 / np.pi),
)
"""Units of rates that are taken for each other: the right one, the stated one, the key of the right one, ratio."""
_AXIS_SET_NAMES = {"°/s": "deg/s", "rad/s": "rad/s"}


def _others(interval: float, kind: Literal["rates", "increments"]) -> Iterator[tuple[str, str, Array, Array]]:
    """Yield what another reading is, what would be right, and the matrices of gyros and accelerometers."""
    identity = np.eye(3)
    for right, stated, key, ratio in _RATIOS:
        yield f"the rates are in {right} and were taken for {stated}", f'the unit "{key}"', identity * ratio, identity
        yield (
            f"the rates are in {stated} and were taken for {right}",
            f'the unit "{_AXIS_SET_NAMES[stated]}"',
            identity / ratio,
            identity,
        )
    if kind == "rates":
        yield "the gyros give increments, not rates", 'kind = "increments"', identity / interval, identity
    else:
        yield "the gyros give rates, not increments", 'kind = "rates"', identity * interval, identity
    yield (
        "the gyros' signs are opposite to those of right-handed axes",
        "all gyros with the other sign",
        -identity,
        identity,
    )
    yield "the accelerometers give gravity's direction (down at rest)", "them with the other sign", identity, -identity
    mirror = np.diag((1.0, -1.0, 1.0))
    yield "gyros and accelerometers have left-handed axes", "one axis of both with the other sign", mirror, mirror
    for k, name in enumerate("xyz"):
        sign = np.diag([-1.0 if j == k else 1.0 for j in range(3)])
        yield f"the {name} gyro has the opposite sign", f"the {name} gyro with the other sign", sign, identity
        both = -sign
        rest = " and ".join(n for n in "xyz" if n != name)
        yield f"the {rest} gyros have the opposite sign", "these gyros with the other sign", both, identity
    for order in permutations(range(3)):
        if order != (0, 1, 2):
            names = ", ".join("xyz"[k] for k in order)
            yield (
                f"the gyros' columns are in another order: {names}",
                "the columns in that order",
                identity[list(order)],
                identity,
            )


@dataclass(frozen=True)
class Reading:
    """What the readings mean."""

    findings: list[Finding]  # the sentences
    # gyro, accel: matrices from the stated readings to the right ones, (3, 3); None if the stated ones are right
    gyro: Array | None = None
    accel: Array | None = None


def judge_reading(
    time: Array,
    rate: Array,
    force: Array,
    fixes: Seen,
    offset: float,
    about: float,
    window: float,
    axes: Array,
    kind: Literal["rates", "increments"],
) -> Reading:
    """Judge units, signs and axes of the readings by the fixes: a fact if the stated reading fits best, an error with
    the right reading if another one fits clearly better, a doubt if the motion does not tell. The offset is the unit's
    clock minus that of the fixes as the stated readings show it, and `about` the same before they were looked at, right
    within a second if they are not, s. The windows of the match have a length, s; the matrix of axes leads to those of
    the readings from the columns of the file, which gives a kind as stated."""
    stated = match(pushed(time, rate, force, _RATE), fixes, offset, most=_WINDOWS, window=window)
    if not len(stated.each):
        return Reading([])
    largest = float(np.ptp(fixes.relative, axis=0).max())
    if largest < _MANOEUVRES * fixes.sigma:
        text = f"The velocity of the fixes changes by {largest:.3g} m/s at most: too little to verify units and axes."
        return Reading([doubt("units and axes", text, "Inspect a part of the log with manoeuvres.")])
    interval = float(np.median(np.diff(time)))
    # a wrong reading spoils the offset as well: others are then tried over its whole range
    offsets = [offset] if stated.residual < _GOOD * fixes.sigma else [offset, *(about + np.arange(-0.9, 1.0, 0.3))]

    def least(gyro: Array, accel: Array) -> float:
        curve = pushed(time, rate @ gyro.T, force @ accel.T, _RATE)
        return min(match(curve, fixes, at, most=_WINDOWS, window=window).residual for at in offsets)

    def turned(gyro: Array, accel: Array) -> float:
        return turns_apart(time, rate @ gyro.T, force @ accel.T, fixes, offset)

    without_turns = least(np.zeros((3, 3)), np.eye(3))
    stated_turns, refuted = turned(np.eye(3), np.eye(3)), False
    best, by_turns = _Other(), _Other()
    for meaning, right, *of_columns in _others(interval, kind):
        gyro, accel = (axes @ matrix @ axes.T for matrix in of_columns)
        if float(np.percentile(np.linalg.norm(rate @ gyro.T, axis=1), 90.0)) > 100.0:  # rad/s, beyond any vehicle
            continue
        other = _Other(least(gyro, accel), meaning, right, gyro, accel)
        scaled = not np.isclose(abs(np.linalg.det(gyro)), 1.0)
        if scaled and CLEARLY * other.residual > without_turns:  # any unit with tiny rates fits straight motion
            continue
        if stated.residual / CLEARLY < other.residual < CLEARLY * stated.residual:  # the turns may decide
            apart = turned(gyro, accel)
            if stated_turns > CLEARLY * apart and other.residual <= stated.residual:
                by_turns = min(by_turns, other, key=lambda each: each.residual)
            if apart > CLEARLY * stated_turns:
                refuted = True
                continue
        best = min(best, other, key=lambda each: each.residual)
    return _judged(stated, best, by_turns, window, refuted=refuted)


class _Other(NamedTuple):
    """Another reading: residual [m/s], what it is, what would be right, and matrices to the right readings, (3, 3)."""

    residual: float = np.inf
    meaning: str = ""
    right: str = ""
    gyro: Array = np.eye(3)
    accel: Array = np.eye(3)


def _judged(stated: Match, best: _Other, by_turns: _Other, window: float, *, refuted: bool) -> Reading:
    """Return the reading that the fixes show, of the stated one, the best other one by the velocities, and the best one
    that also explains the turns of the course, which the stated one does not; the turns may have refuted another
    one."""
    explained = stated.residual <= EXPLAINED * stated.moved
    numbers: dict[str, Any] = {
        "residual_mps": stated.residual,
        "residual_of_best_other_mps": best.residual,
        "best_other": best.meaning,
    }
    numbers |= {"turns_agree": True} if refuted and explained else {}
    text = (
        f"In windows of {window:.3g} s the data agree with the velocities of the fixes to {stated.residual:.3g} m/s rms"
        f"{', and in their turns with the course' if refuted else ''}; the best alternative interpretation, that "
        f"{best.meaning}, agrees to {best.residual:.3g} m/s."
    )
    if stated.residual > CLEARLY * best.residual:
        finding = wrong("units and axes", text, f"Describe the log with {best.right}.", **numbers)
        return Reading([finding], best.gyro, best.accel)
    if by_turns.meaning:
        finding = wrong(
            "units and axes",
            f"The gyros turn about the vertical otherwise than the course of the fixes, unless {by_turns.meaning}: "
            f"then the data also agree with the velocities in windows of {window:.3g} s to {by_turns.residual:.3g} m/s "
            f"rms instead of {stated.residual:.3g} m/s.",
            f"Describe the log with {by_turns.right}.",
            **{**numbers, "best_other": by_turns.meaning},
        )
        return Reading([finding], by_turns.gyro, by_turns.accel)
    if best.residual > CLEARLY * stated.residual:
        return Reading([fact("units and axes", f"{text} Units, signs and handedness are correct.", **numbers)])
    fix = "The motion does not distinguish the two: verify the description."
    if not explained:
        text = (
            f"In windows of {window:.3g} s the velocity of the fixes changes by {stated.moved:.3g} m/s rms, and the "
            f"data explain it to {stated.residual:.3g} m/s only; so does every other interpretation of the columns."
        )
        fix = (
            f"{WORSE}Likely causes: the unit moves in the vehicle or is beyond its range, or the files are not of the "
            "same vehicle and time."
        )
        numbers["worse_than_fixes"] = True
    return Reading([doubt("units and axes", text, fix, **numbers)])


_FAST = 5.0  # m/s, at which the direction of a velocity of 0.05 m/s noise is good to 0.6°
_STRAIGHT = np.radians(3.0)  # rad/s; in turns the body of a vehicle does not point along the velocity
_LASTING = 2.0  # s, over which the residuals of a match are alike: biases, scale factors and the receiver's filter
_SURE = 5.0  # °, uncertainty of a window's attitude up to which a reference is compared with it
_NEAR = 0.1  # s, from a fix to the nearest row of a reference
_AGREES = 2.0  # °, difference of a reference up to which nothing is doubtful: mounting and flexure make as much
_LEAST_WINDOWS = 3
_KNOWN = np.radians(5.0)  # 1σ up to which a mounting is known: named axes are 90° apart, and 3σ are a sixth of it
_MOUNTING_NAMES = {place: name for name, place in DIRECTIONS.items()}


@dataclass(frozen=True)
class Mounting:
    """How the unit sits in a vehicle that moves where it points."""

    # the vehicle's direction nearest to x, y and z of the unit, for example ("forward", "right", "down")
    axes: tuple[str, str, str]
    angles: Array  # small rotation that remains, roll, pitch, yaw of the unit's named axes in the vehicle, (3,) rad
    sigma: Array  # 1σ of the pitch and the yaw from the scatter between windows, (2,) rad
    windows: int  # number of windows used

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
    """Find the mounting at an offset, the unit's clock minus that of the fixes, s; None if the vehicle hardly moved.
    The forward axis is the mean direction of the velocity in the unit's axes, on straight parts at speed. The right
    axis is perpendicular to it and to the mean direction of the vertical, so that the roll refers to the mean roll of
    the vehicle."""
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
    """Compare the attitude of a reference, q_nb (R, 4) of the unit at instants on its clock, with that of the match,
    which takes gyros, accelerometers and fixes alone; None if no window determines it. The offset is the unit's clock
    minus that of the fixes, s."""
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
    uncertainty = float(np.sqrt(np.mean(uncertain[window[used]] ** 2)))
    text = (
        f"The attitude of the reference differs from that of inertial data and fixes without a filter by "
        f"{tilt:.2f}° in tilt and {heading:.2f}° in heading (rms over {count} windows of {agreement.window:g} s, "
        f"uncertain by about {uncertainty:.2g}°)."
    )
    numbers = {"tilt_deg": tilt, "heading_deg": heading, "uncertain_deg": uncertainty, "windows": count}
    if max(tilt, heading) < max(_AGREES, 3.0 * uncertainty):
        return fact("reference", text, **numbers)
    fix = "Its axes or its clock differ from the description, or it is wrong: do not judge attitudes by it."
    return doubt("reference", text, fix, **numbers)


def attitude_by_match(
    curve: Pushed, fixes: Seen, agreement: Match, offset: float, begin: float
) -> tuple[Array, float] | None:
    """Return the attitude of the unit at an instant of its clock, s, which needs neither its mounting nor a motion
    along one axis: roll, pitch and heading, (3,) rad, from the first window that gives the heading to `WORST` and
    carried back by the gyros without their biases; and the 1σ of the heading, rad. None if no window gives it. The
    offset is the unit's clock minus that of the fixes, s."""
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
    names = [
        _MOUNTING_NAMES[(int(np.argmax(np.abs(row))), int(np.sign(row[np.argmax(np.abs(row))])))] for row in nearest
    ]
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
