"""The offset of the clocks of a unit and a receiver: what the files state, leap seconds, or what the motion shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sinssim.analyses.inspection.finding import Finding, doubt, fact
from sinssim.analyses.inspection.hypotheses import judge_reading
from sinssim.analyses.inspection.times.offset import NEAR, Coarse, Offset, coarse_offset, fine_offset
from sinssim.analyses.inspection.velocity_match import Pushed, Seen, match, pushed
from sinssim.data import Array
from sinssim.logs.gps_time import leap_seconds, unix_from_gps
from sinssim.logs.streams import Clock

Readings = tuple[Array, Array, Array]

GOOD = 5.0
"""Residual in units of the velocities' σ up to which an offset is trusted without a search for another one."""
_BETTER = 1.5
"""Factor by which another offset must reduce the residual."""
_PLAIN = 0.3
"""Offset up to which nothing else is tried, s: delays of receivers and loggers are as long."""
_ROUNDS = 3
"""Corrections of the readings one after the other: the unit, then signs or order."""
_HOUR = 3600.0
_QUARTER = 900.0
"""All time zones differ by multiples of it, s."""


@dataclass(frozen=True)
class Agreement:
    """How unit and receiver agree.

    Attributes:
        offset: of the clocks; None if there is none.
        stated: the offset that the files state, s; None if they state none.
        about: the offset near which it was searched, s: the stated one, one with leap seconds, or that of the turns.
        coarse: the offset by the rates of turn; None if they are not alike.
        readings: findings on units and axes.
        gyro, accel: matrices from the stated readings to the right ones, (3, 3).
    """

    offset: Offset | None
    stated: float | None
    about: float | None
    coarse: Coarse | None
    readings: tuple[Finding, ...]
    gyro: Array
    accel: Array


def stated_offset(unit: Clock, receiver: Clock) -> float | None:
    """Return the offset that two files state, s; None if their clocks have nothing in common.

    Files without dates count from the same instant, unless their motion says otherwise.
    """
    if unit.origin_gps_s is not None and receiver.origin_gps_s is not None:
        return float(receiver.origin_gps_s - unit.origin_gps_s)
    return 0.0 if unit.origin_gps_s is receiver.origin_gps_s is None else None


def agreement(
    readings: Readings, fixes: Seen, unit: Clock, receiver: Clock, axes: Array, kind: Literal["rates", "increments"]
) -> Agreement:
    """Find the offset of the clocks, and the right reading of the unit.

    Args:
        readings: times (N,) s, rates (N, 3) rad/s, specific forces (N, 3) m/s².
        axes: matrix from the columns of the file to the axes of the readings, (3, 3).
        kind: whether the file gives rates or increments, as stated.
    """
    time, rate, force = readings
    stated = stated_offset(unit, receiver)
    leap = 0.0
    if receiver.origin_gps_s is not None and unit.origin_gps_s is not None:
        leap = float(leap_seconds(unix_from_gps(receiver.origin_gps_s + fixes.time[0])))
    found: list[Finding] = []
    gyro = accel = np.eye(3)
    for _ in range(_ROUNDS):
        turned = time, rate @ gyro.T, force @ accel.T
        coarse = coarse_offset(*turned[:2], fixes)
        best = _best(turned, fixes, stated, leap, coarse)
        if best is None:
            break
        about, offset = best
        reading = judge_reading(*turned, fixes, offset.value, about, offset.match.window, axes, kind)
        if reading.gyro is None and coarse is not None and offset.match.residual > GOOD * fixes.sigma:
            # a wrong reading hides the offset
            at_turns = judge_reading(*turned, fixes, coarse.value, coarse.value, offset.match.window, axes, kind)
            reading = at_turns if at_turns.gyro is not None else reading
        found += reading.findings
        if reading.gyro is None or reading.accel is None:
            return Agreement(offset, stated, about, coarse, tuple(found), gyro, accel)
        gyro, accel = reading.gyro @ gyro, reading.accel @ accel
    else:
        best = _best((time, rate @ gyro.T, force @ accel.T), fixes, stated, leap, coarse)
    near, last = (stated, None) if best is None else best
    return Agreement(last, stated, near, coarse, tuple(found), gyro, accel)


def _best(
    readings: Readings, fixes: Seen, stated: float | None, leap: float, coarse: Coarse | None
) -> tuple[float, Offset] | None:
    """Return the offset with clearly the least residual, and the one near which it was searched."""
    curve = pushed(*readings)
    best: tuple[float, Offset] | None = None
    guesses: list[float] = []
    if stated is not None:
        first = fine_offset(curve, fixes, stated)
        if first is not None:
            best = stated, first
            plain = first.inside and abs(first.value - stated) < _PLAIN
            if plain and first.match.residual < GOOD * fixes.sigma:
                return best
        guesses += [stated - leap, stated + leap] if leap else []
    if coarse is not None and all(
        abs(coarse.value - other) > NEAR for other in (*guesses, stated) if other is not None
    ):
        guesses.append(coarse.value)
    for guess in guesses:
        other = fine_offset(curve, fixes, guess)
        if other is None:
            continue
        if guess == (None if coarse is None else coarse.value) and not _stands_out(curve, fixes, other):
            other = replace(other, inside=False)
        clearly = 1.0 if best is not None and other.shown and not best[1].shown else _BETTER
        if best is None or clearly * other.match.residual < best[1].match.residual:
            best = guess, other
    return best


_FAR = (-9.0, -6.0, -3.0, 3.0, 6.0, 9.0)  # s


def _stands_out(curve: Pushed, fixes: Seen, found: Offset) -> bool:
    """Return whether an offset explains the velocities clearly better than offsets some seconds away."""
    at = found.match
    far = [match(curve, fixes, found.value + d, window=at.window, bias=at.bias, rounds=0).residual for d in _FAR]
    known = [residual for residual in far if np.isfinite(residual)]
    return bool(known) and float(np.median(known)) > _BETTER * at.residual


def offset_finding(found: Agreement, value: float, unit: Clock, receiver: Clock) -> Finding:
    """Return the finding on the clocks.

    Args:
        value: the unit's clock minus that of the positions, s.

    Returns:
        A fact if the files state it; a doubt with what to describe if the data show another offset, and a question if
        they suggest one without enough evidence.
    """
    offset, stated = found.offset, found.stated
    assert offset is not None
    sigma = f" ± {1e3 * offset.sigma:.0f} ms" if np.isfinite(offset.sigma) else ""
    numbers = {
        "imu_clock_minus_gnss_clock_s": value,
        "sigma_s": offset.sigma if np.isfinite(offset.sigma) else None,
        "shown": offset.shown,
    }
    late = value - (stated or 0.0)
    word = ("ahead of" if late >= 0.0 else "behind") if stated is None or abs(late) > NEAR else "late"
    if word == "late":
        word = f"{'late' if late > 0.0 else 'early'} relative to"
        text = f"The stamps of the unit are {1e3 * abs(late):.0f} ms{sigma} {word} those of the positions"
    else:
        text = f"The unit's clock is {abs(late):.3f} s{sigma} {word} that of the positions"
    if not offset.shown:
        evidence = "the motion is too small, or too short" if offset.inside else "other offsets fit as well"
        if stated is not None and abs(late) <= NEAR:
            text = (
                f"The motion does not show the offset of the clocks within {NEAR:g} s ({evidence}); none is described."
            )
        else:
            text = f"Is it so that {text[0].lower()}{text[1:]}? The data do not show it: {evidence}."
        return doubt("clocks", text, "Do you know it? Otherwise record a drive with turns and stops.", **numbers)
    text += ", by the match of the velocities."
    if stated is not None and abs(late) <= max(3.0 * offset.sigma, 0.01):
        return fact("clocks", text.replace(", by the match of the velocities", ""), **numbers)
    why = _why(late, unit, receiver) if stated is not None else "the clocks have no common origin"
    return doubt("clocks", text, f"Describe this offset{f': {why}' if why else ''}.", **numbers)


def _why(late: float, unit: Clock, receiver: Clock) -> str:
    """Return what explains an offset of whole leap seconds or of a time zone; empty if nothing does."""
    if unit.origin_gps_s is None or receiver.origin_gps_s is None or abs(late) <= NEAR:
        return ""
    leap = float(leap_seconds(unix_from_gps(receiver.origin_gps_s)))
    if abs(abs(late) - leap) <= NEAR:
        # leap seconds are added to UTC: times that had them already run ahead, and UTC taken for GPS time is behind
        ahead, behind = (unit, receiver) if late > 0.0 else (receiver, unit)
        of = {id(unit): "the unit", id(receiver): "the receiver"}
        causes = []
        if ahead.kind != "gps":
            causes.append(f"the times of {of[id(ahead)]} are GPS time, but are taken for UTC")
        if behind.kind != "utc":
            causes.append(f"the times of {of[id(behind)]} are UTC, but are taken for GPS time")
        cause = ", or ".join(causes) or "one of the files confuses UTC and GPS time"
        return f"{leap:.0f} s are the leap seconds between UTC and GPS time: {cause}"
    zones = round(late / _QUARTER) * _QUARTER
    if zones and abs(late - zones) <= NEAR + leap:
        return f"{zones / _HOUR:g} h are the difference of a time zone: local time is taken for UTC or GPS time"
    return ""
