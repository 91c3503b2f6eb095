"""Units, kinds and axes of an inertial unit other than stated: does another reading fit the fixes better?

A common rotation of gyros and accelerometers changes nothing in the match with the fixes, because the attitude is free
there. A wrong scale or sign of the gyros, a left-handed set of axes, or axes of the gyros in another order than those
of the accelerometers increase the residual by far. Where the velocities do not tell, the turns of the course do: the
gyros turn as much about the vertical that the accelerometers show, for a vehicle that moves where it points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations
from typing import Any, Literal

import numpy as np

from sinssim.analyses.inspection.finding import Finding, doubt, fact, wrong
from sinssim.analyses.inspection.velocity_match import Seen, match, pushed, turns_apart
from sinssim.data import Array

CLEARLY = 2.0
"""Factor by which another reading must reduce the residual before it is believed."""
_RATE = 25.0  # samples a second are enough for the question
_WINDOWS = 12  # windows with the largest changes of velocity
_EXPLAINED = 0.5  # part of the change of velocity that an interpretation may leave over
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
_NAMES = {"°/s": "deg/s", "rad/s": "rad/s"}


def _others(interval: float, kind: Literal["rates", "increments"]) -> Iterator[tuple[str, str, Array, Array]]:
    """Yield what another reading is, what would be right, and the matrices of gyros and accelerometers."""
    one = np.eye(3)
    for right, stated, key, ratio in _RATIOS:
        yield f"the rates are in {right} and were taken for {stated}", f'the unit "{key}"', one * ratio, one
        yield f"the rates are in {stated} and were taken for {right}", f'the unit "{_NAMES[stated]}"', one / ratio, one
    if kind == "rates":
        yield "the gyros give increments, not rates", 'kind = "increments"', one / interval, one
    else:
        yield "the gyros give rates, not increments", 'kind = "rates"', one * interval, one
    yield "the gyros' signs are opposite to those of right-handed axes", "all gyros with the other sign", -one, one
    yield "the accelerometers give gravity's direction (down at rest)", "them with the other sign", one, -one
    mirror = np.diag((1.0, -1.0, 1.0))
    yield "gyros and accelerometers have left-handed axes", "one axis of both with the other sign", mirror, mirror
    for k, name in enumerate("xyz"):
        sign = np.diag([-1.0 if j == k else 1.0 for j in range(3)])
        yield f"the {name} gyro has the opposite sign", f"the {name} gyro with the other sign", sign, one
        both = -sign
        rest = " and ".join(n for n in "xyz" if n != name)
        yield f"the {rest} gyros have the opposite sign", "these gyros with the other sign", both, one
    for order in permutations(range(3)):
        if order != (0, 1, 2):
            names = ", ".join("xyz"[k] for k in order)
            yield (
                f"the gyros' columns are in another order: {names}",
                "the columns in that order",
                one[list(order)],
                one,
            )


@dataclass(frozen=True)
class Reading:
    """What the readings mean.

    Attributes:
        findings: the sentences.
        gyro, accel: matrices from the stated readings to the right ones, (3, 3); None if the stated ones are right.
    """

    findings: list[Finding]
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
    """Judge units, signs and axes of the readings by the fixes.

    Args:
        time: (N,) s.
        rate: (N, 3) rad/s, as stated.
        force: (N, 3) m/s², as stated.
        offset: the unit's clock minus that of the fixes as the stated readings show it, s.
        about: the same before the readings were looked at, s; right within a second if the readings are not.
        window: length of the windows of the match, s.
        axes: matrix from the columns of the file to the axes of the readings, (3, 3).
        kind: whether the file gives rates or increments, as stated.

    Returns:
        A fact if the stated reading fits best, an error with the right reading if another one fits clearly better, a
        doubt if the motion does not tell.
    """
    own = match(pushed(time, rate, force, _RATE), fixes, offset, most=_WINDOWS, window=window)
    if not len(own.each):
        return Reading([])
    largest = float(np.ptp(fixes.relative, axis=0).max())
    if largest < _MANOEUVRES * fixes.sigma:
        text = f"The velocity of the fixes changes by {largest:.3g} m/s at most: too little to verify units and axes."
        return Reading([doubt("units and axes", text, "Inspect a part of the log with manoeuvres.")])
    interval = float(np.median(np.diff(time)))
    # a wrong reading spoils the offset as well: others are then tried over its whole range
    offsets = [offset] if own.residual < _GOOD * fixes.sigma else [offset, *(about + np.arange(-0.9, 1.0, 0.3))]
    best: tuple[float, str, str, Array, Array] = (np.inf, "", "", np.eye(3), np.eye(3))

    def least(gyro: Array, accel: Array) -> float:
        curve = pushed(time, rate @ gyro.T, force @ accel.T, _RATE)
        return min(match(curve, fixes, at, most=_WINDOWS, window=window).residual for at in offsets)

    def turned(gyro: Array, accel: Array) -> float:
        return turns_apart(time, rate @ gyro.T, force @ accel.T, fixes, offset)

    without_turns = least(np.zeros((3, 3)), np.eye(3))
    stated_turns, by_turns, refuted = turned(np.eye(3), np.eye(3)), None, False
    for meaning, right, *of_columns in _others(interval, kind):
        gyro, accel = (axes @ matrix @ axes.T for matrix in of_columns)
        size = float(np.percentile(np.linalg.norm(rate @ gyro.T, axis=1), 90.0))
        if size > 100.0:  # rad/s, beyond any vehicle
            continue
        residual = least(gyro, accel)
        scaled = not np.isclose(abs(np.linalg.det(gyro)), 1.0)
        if scaled and CLEARLY * residual > without_turns:  # any unit in which the rates are tiny fits straight motion
            continue
        one = (residual, meaning, right, gyro, accel)
        if own.residual / CLEARLY < residual < CLEARLY * own.residual:  # the turns of the course may decide
            apart = turned(gyro, accel)
            if (
                stated_turns > CLEARLY * apart
                and residual <= own.residual
                and (by_turns is None or residual < by_turns[0])
            ):
                by_turns = one
            if apart > CLEARLY * stated_turns:
                refuted = True
                continue
        if residual < best[0]:
            best = one
    explained = own.residual <= _EXPLAINED * own.moved
    numbers: dict[str, Any] = {
        "residual_mps": own.residual,
        "residual_of_best_other_mps": best[0],
        "best_other": best[1],
    }
    numbers |= {"turns_agree": True} if refuted and explained else {}
    text = (
        f"In windows of {window:.3g} s the data agree with the velocities of the fixes to {own.residual:.3g} m/s rms"
        f"{', and in their turns with the course' if refuted else ''}; the best alternative interpretation, that "
        f"{best[1]}, agrees to {best[0]:.3g} m/s."
    )
    if own.residual > CLEARLY * best[0]:
        found = wrong("units and axes", text, f"Describe the log with {best[2]}.", **numbers)
        return Reading([found], best[3], best[4])
    if by_turns is not None:
        found = wrong(
            "units and axes",
            f"The gyros turn about the vertical otherwise than the course of the fixes, unless {by_turns[1]}: then the "
            f"data also agree with the velocities in windows of {window:.3g} s to {by_turns[0]:.3g} m/s rms instead of "
            f"{own.residual:.3g} m/s.",
            f"Describe the log with {by_turns[2]}.",
            **{**numbers, "best_other": by_turns[1]},
        )
        return Reading([found], by_turns[3], by_turns[4])
    if best[0] > CLEARLY * own.residual:
        return Reading([fact("units and axes", f"{text} Units, signs and handedness are correct.", **numbers)])
    fix = "The motion does not distinguish the two: verify the description."
    if not explained:
        text = (
            f"In windows of {window:.3g} s the velocity of the fixes changes by {own.moved:.3g} m/s rms, and the data "
            f"explain it to {own.residual:.3g} m/s only; so does every other interpretation of the columns."
        )
        fix = (  # probably: so it was in seven of eight public logs whose suggested scenario was run
            "Navigation with these inertial data is probably worse than the fixes alone. Likely causes: the unit moves "
            "in the vehicle or is beyond its range, or the files are not of the same vehicle and time."
        )
        numbers["worse_than_fixes"] = True
    return Reading([doubt("units and axes", text, fix, **numbers)])
