"""Offset and drift between the clocks of an inertial unit and a satellite receiver.

The offset is what the files state, leap seconds, or what the motion shows. Offset and drift are those with the least
residual of the velocity match. The drift turns the times about the middle of the log, so that the two are nearly
independent. Its 1σ follows from the scatter of the windows' gradients (the sandwich estimator, White, Econometrica 48,
1980, with each window as one group), because the residuals within a window are correlated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact
from sinssim.analyses.inspection.unit_axes import EXPLAINED, judge_reading
from sinssim.analyses.inspection.velocity_match import FIXES_IN_WINDOW, Match, Pushed, Seen, match, pushed, scatter
from sinssim.data import Array
from sinssim.logs.gps_time import leap_seconds, unix_from_gps
from sinssim.logs.recorded_streams import Clock

NEAR = 1.0
"""Range of the fine search, s."""
WINDOWS = (10.0, 30.0)
"""Lengths of the windows that are tried, s: the shorter one bears with biases that change, the longer one is needed for
motion that changes slowly, as that of an airliner; the one with the smaller scatter counts."""
_TURNS_ALIKE = 0.5  # least correlation of the turns
_MOST_STEPS = 1e7  # eleven days in steps of 0.1 s; what lasts longer has a wrong stamp
_COURSE = 10.0  # in units of the velocities' σ: a course at this speed is good to 0.1 rad


@dataclass(frozen=True)
class Offset:
    """The unit's clock minus that of the receiver."""

    value: float  # s, relative to the stamps of the velocities
    sigma: float  # 1σ from the scatter between parts of the log, s; NaN if there are too few windows, or no motion
    match: Match  # agreement of the curves at this offset
    inside: bool  # whether the residual is least inside of the searched range, and clearly larger at both of its ends

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
    """The offset by the rates of turn."""

    value: float  # the unit's clock minus that of the receiver, s
    alike: float  # correlation of the two rates of turn there


def coarse_offset(time: Array, rate: Array, fixes: Seen) -> Coarse | None:
    """Find the offset of two clocks that have nothing in common, s, from the rates of turn; None if nothing stands out.
    The magnitude of the gyros' rate, (N, 3) rad/s at times of the unit, is compared with the magnitude of the rate of
    the course, at all offsets at which the logs overlap by half of the shorter one."""
    step = max(float(np.median(np.diff(fixes.time))), 0.1)
    if not max(np.ptp(fixes.time), np.ptp(time)) < _MOST_STEPS * step:
        return None
    grid = np.arange(fixes.time[0], fixes.time[-1], step)
    direction = fixes.relative / np.maximum(fixes.speed, 1e-3)[:, None]
    turn = np.linalg.norm(np.gradient(direction, fixes.time, axis=0), axis=1) * (fixes.speed > _COURSE * fixes.sigma)
    course = np.interp(grid, fixes.time, np.minimum(turn, 2.0))
    grid_of_unit = np.arange(time[0], time[-1], step)
    angle = np.concatenate([[np.zeros(3)], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, None], axis=0)])
    size = np.linalg.norm(np.diff([np.interp(grid_of_unit, time, a) for a in angle.T], axis=1), axis=0) / step
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
    size_in_common, course_in_common = a[common], b[common.start - lag : common.stop - lag]
    if not size_in_common.std() or not course_in_common.std():
        return None
    alike = float(np.corrcoef(size_in_common, course_in_common)[0, 1])
    return Coarse(float(grid_of_unit[0] - grid[0] + lags[best] * step), alike) if alike >= _TURNS_ALIKE else None


def _correlate(a: Array, b: Array) -> Array:
    from scipy.signal import correlate

    return np.asarray(correlate(a, b, mode="full", method="fft"))


def fine_offset(curve: Pushed, fixes: Seen, about: float) -> Offset | None:
    """Find the offset with the least residual of the velocities from a first guess, s; None if the logs do not
    overlap."""
    from scipy.optimize import minimize_scalar

    offsets: list[Offset] = []
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
        fit = match(curve, fixes, value, window=window)
        inside = 0 < best < len(grid) - 1 and min(costs[0], costs[-1]) > _RISES * costs[best]
        offsets.append(Offset(value, _offset_sigma(curve, fixes, value, fit), fit, inside))
    return min(
        offsets,
        key=lambda offset_of_window: (
            not offset_of_window.inside,
            np.isnan(offset_of_window.sigma),
            offset_of_window.sigma,
        ),
        default=None,
    )


def _offset_sigma(curve: Pushed, fixes: Seen, value: float, at_least: Match) -> float:
    """Return the 1σ of the offset, s."""
    h = 0.05
    low, middle, high = (
        match(curve, fixes, value + d, window=at_least.window, bias=at_least.bias, rounds=0).each ** 2
        for d in (-h, 0.0, h)
    )
    return scatter(low, middle, high, h) if len(low) == len(middle) == len(high) else float("nan")


_RATE = 25.0  # samples a second are enough for the question
_LEAST_WINDOWS = 8
_STEPS = np.array([0.03, 0.06])
"""Steps of the differences: of the offset, and of the change of the offset over the log, s."""
_FAR_DRIFT = (0.0, -0.3, 0.3, -0.6, 0.6, -1.0, 1.0, -1.5, 1.5)
"""Changes of the offset over the log that are tried if the match is poor, s."""
_HOPELESS, _WORTH = 10.0, 3.0
"""Residuals, in units of a trusted one, beyond which no drift is searched, and none is improved."""
_DRIFT_ROUNDS = 8
_NEAR = 1e-4  # s; the end of the improvements
_CHANCE = 1e-4
"""Probability that clocks without a drift seem to have one."""
_LEAST = 0.02
"""Change of the offset over the log that matters, s: about the uncertainty of an offset."""


@dataclass(frozen=True)
class Drift:
    """The drift of the unit's clock."""

    value: float  # relative to the clock of the fixes, s/s; positive if the unit's clock runs fast
    sigma: float  # 1σ, s/s


def even_times(time: Array, drift: float) -> Array:
    """Return times that run as fast as those of the fixes, with the same first one. `time`: of the unit, (N,) s;
    `drift`: s/s."""
    return np.asarray(time[0] + (time - time[0]) / (1.0 + drift))


def clock_drift(readings: tuple[Array, Array, Array], fixes: Seen, offset: Offset, good: float) -> Drift | None:
    """Find the drift of the clocks from times (N,) s, rates (N, 3) rad/s and specific forces (N, 3) m/s²; a match is
    trusted up to a `good` residual, m/s. None if the data show none, or none that matters."""
    from scipy.stats import t as student

    time, rate, force = readings
    length = float(time[-1] - time[0])
    middle = 0.5 * float(time[0] + time[-1])

    def tried(at: Array) -> Match:
        even = middle + (time - middle) / (1.0 + at[1] / length)
        curve = pushed(even, rate, force, _RATE)
        return match(curve, fixes, float(at[0]), window=offset.match.window, bias=offset.match.bias, rounds=1)

    at = np.array([offset.value, 0.0])
    if offset.match.residual > _HOPELESS * good:  # units or axes are wrong; see the hypotheses
        return None
    if offset.match.residual > good:
        at = min((np.array([offset.value, far]) for far in _FAR_DRIFT), key=lambda x: tried(x).residual)
        if tried(at).residual > _WORTH * good:
            return None
    for _ in range(_DRIFT_ROUNDS):
        change = _step(tried, at)
        at = at + change
        if np.abs(change).max() < _NEAR:
            break
    fit = tried(at)
    if fit.residual > good or len(fit.each) < _LEAST_WINDOWS or abs(at[1]) < _LEAST:
        return None
    sigma = _sigma(tried, at)
    if not abs(at[1]) > float(student.ppf(1.0 - 0.5 * _CHANCE, len(fit.each) - 2)) * sigma:
        return None
    return Drift(float(at[1]) / length, sigma / length)


def _step(tried: Callable[[Array], Match], at: Array) -> Array:
    """Return the change of offset and drift to the least of the parabola through three residuals each, (2,) s."""
    here, change = tried(at).residual ** 2, np.zeros(2)
    for k in range(2):
        h = np.zeros(2)
        h[k] = _STEPS[k]
        low, high = tried(at - h).residual ** 2, tried(at + h).residual ** 2
        bend = low - 2.0 * here + high
        most = 10.0 * _STEPS[k]
        newton = 0.5 * _STEPS[k] * (low - high) / bend if bend > 0.0 else most * np.sign(low - high)
        change[k] = np.clip(np.nan_to_num(newton), -most, most)  # residuals are infinite where nothing overlaps
    return change


def _sigma(tried: Callable[[Array], Match], at: Array) -> float:
    """Return the 1σ of the change of the offset over the log, s."""
    here = tried(at).each ** 2
    gradients, bends = [], []
    for k in range(2):
        h = np.zeros(2)
        h[k] = _STEPS[k]
        low, high = tried(at - h).each ** 2, tried(at + h).each ** 2
        count = min(len(low), len(high), len(here))
        gradients.append((high[:count] - low[:count]) / (2.0 * _STEPS[k]))
        bends.append(float(np.sum(low[:count] - 2.0 * here[:count] + high[:count])) / _STEPS[k] ** 2)
    count = min(map(len, gradients))
    scatter = float(np.sum(gradients[1][:count] ** 2)) * count / max(count - 2, 1)
    return float(np.sqrt(scatter)) / bends[1] if bends[1] > 0.0 else float("inf")


Readings = tuple[Array, Array, Array]

GOOD = 5.0
"""Residual in units of the velocities' σ up to which an offset is trusted without a search for another one."""
_BETTER = 1.5
"""Factor by which another offset must reduce the residual."""
_PLAIN = 0.3
"""Offset up to which nothing else is tried, s: delays of receivers and loggers are as long."""
_AGREEMENT_ROUNDS = 3
"""Corrections of the readings one after the other: the unit, then signs or order."""
_HOUR = 3600.0
_QUARTER = 900.0
"""All time zones differ by multiples of it, s."""


@dataclass(frozen=True)
class Agreement:
    """How unit and receiver agree."""

    offset: Offset | None  # of the clocks; None if there is none
    stated: float | None  # the offset that the files state, s; None if they state none
    # the offset near which it was searched, s: the stated one, one with leap seconds, or that of the turns
    about: float | None
    coarse: Coarse | None  # the offset by the rates of turn; None if they are not alike
    readings: tuple[Finding, ...]  # findings on units and axes
    # gyro, accel: matrices from the stated readings to the right ones, (3, 3)
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
    """Find the offset of the clocks, and the right reading of the unit, from times (N,) s, rates (N, 3) rad/s and
    specific forces (N, 3) m/s², of the stated kind; the matrix of axes leads to theirs from the columns of the file."""
    time, rate, force = readings
    stated = stated_offset(unit, receiver)
    leap = 0.0
    if receiver.origin_gps_s is not None and unit.origin_gps_s is not None:
        leap = float(leap_seconds(unix_from_gps(receiver.origin_gps_s + fixes.time[0])))
    findings: list[Finding] = []
    gyro = accel = np.eye(3)
    for _ in range(_AGREEMENT_ROUNDS):
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
        findings += reading.findings
        if reading.gyro is None or reading.accel is None:
            return Agreement(offset, stated, about, coarse, tuple(findings), gyro, accel)
        gyro, accel = reading.gyro @ gyro, reading.accel @ accel
    else:
        best = _best((time, rate @ gyro.T, force @ accel.T), fixes, stated, leap, coarse)
    near, last = (stated, None) if best is None else best
    return Agreement(last, stated, near, coarse, tuple(findings), gyro, accel)


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
        if other is None or (best is not None and other.match.residual > EXPLAINED * other.match.moved):
            continue  # with a wrong unit no offset explains the velocities, and the least residual is chance
        if guess == (None if coarse is None else coarse.value) and not _stands_out(curve, fixes, other):
            other = replace(other, inside=False)
        clearly = 1.0 if best is not None and other.shown and not best[1].shown else _BETTER
        if best is None or clearly * other.match.residual < best[1].match.residual:
            best = guess, other
    return best


_FAR_OFFSET = (-9.0, -6.0, -3.0, 3.0, 6.0, 9.0)  # s


def _stands_out(curve: Pushed, fixes: Seen, candidate: Offset) -> bool:
    """Return whether an offset explains the velocities clearly better than offsets some seconds away."""
    at = candidate.match
    far = [
        match(curve, fixes, candidate.value + d, window=at.window, bias=at.bias, rounds=0).residual for d in _FAR_OFFSET
    ]
    known = [residual for residual in far if np.isfinite(residual)]
    return bool(known) and float(np.median(known)) > _BETTER * at.residual


def offset_finding(agreed: Agreement, value: float, unit: Clock, receiver: Clock) -> Finding:
    """Return the finding on the clocks, of which the unit's minus that of the positions is a value, s: a fact if the
    files state it; a doubt with what to describe if the data show another offset, and a question if they suggest one
    without enough evidence."""
    offset, stated = agreed.offset, agreed.stated
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
