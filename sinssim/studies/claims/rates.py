"""The rates needed for velocity and position, and for attitude."""

from __future__ import annotations

import math

from sinssim.formatting import number_text
from sinssim.studies.claims.outcome import (
    FEW_TENTHS_ARCSEC,
    LOW_ORDER,
    PLAIN,
    Evidence,
    Outcome,
    Point,
    base,
    by,
    error_at,
    needed,
    of_motion,
    undecided,
)
from sinssim.studies.results import Row

NEGLIGIBLE = 0.1
"""A rate is sufficient if its error is less than this fraction of the error of sensors of the 1 nmi/h grade."""

_SLOW_HZ = (10.0, 20.0)
_LEAST_HZ, _MOST_HZ = 50.0, 80.0


# Long: one sentence for each motion, made of its numbers.
def velocity_rate(evidence: Evidence) -> Outcome:
    """Decide on slow velocity and position with fast attitude, relative to the errors of sensors.

    Args:
        evidence: numbers of the deciding parts.

    Returns:
        The outcome, with a verdict on each motion.
    """
    rows = evidence.rows
    numbers: dict[str, float] = {}
    said = []
    worst: dict[float, tuple[float, str]] = dict.fromkeys(_SLOW_HZ, (0.0, ""))
    for motion, found in by(rows, of_motion).items():
        real = [r for r in found if r.sensors != "ideal" and (not r.schedule_hz or len(set(r.schedule_hz)) == 1)]
        words, enough = [], []
        for rate in _SLOW_HZ:
            slow = [r for r in found if r.sensors == "ideal" and r.schedule_hz[1:] == (rate, rate)]
            if not slow or not real:
                return undecided(
                    "velocity and position at 10 and 20 Hz with perfect sensors, and real sensors at the full rate"
                )
            ratio = max(
                slow[0].max_horizontal_error_m / real[0].max_horizontal_error_m,
                slow[0].max_velocity_error_mps / real[0].max_velocity_error_mps,
            )
            worst[rate] = max(worst[rate], (ratio, motion))
            enough.append(ratio < NEGLIGIBLE)
            numbers[f"{motion}: {rate:g} Hz, m"] = slow[0].max_horizontal_error_m
            numbers[f"{motion}: {rate:g} Hz, m/s"] = slow[0].max_velocity_error_mps
            words.append(
                f"{rate:g} Hz {slow[0].max_horizontal_error_m:.3g} m and {slow[0].max_velocity_error_mps:.3g} m/s"
            )
        numbers[f"{motion}: {real[0].sensors}, m"] = real[0].max_horizontal_error_m
        numbers[f"{motion}: {real[0].sensors}, m/s"] = real[0].max_velocity_error_mps
        words.append(
            f"{real[0].sensors} sensors {real[0].max_horizontal_error_m:.3g} m and "
            f"{real[0].max_velocity_error_mps:.3g} m/s"
        )
        said.append(Point(f"{motion}: {', '.join(words)}", _of_slow_rates(*enough)))
    if not said:
        return undecided("any result")
    loads = {row.pace: row.operations_per_step for row in rows if row.schedule_hz and row.operations_per_step > 0.0}
    numbers |= {f"{pace}: operations per step": load for pace, load in loads.items()}
    if loads:
        shown = ", ".join(f"{pace} {load:.0f}" for pace, load in loads.items())
        said.append(Point(f"operations per fast step: {shown}"))
    sufficient = {rate: ratio < NEGLIGIBLE for rate, (ratio, _) in worst.items()}
    judged = ", ".join(
        f"{rate:g} Hz {'is' if sufficient[rate] else 'is not'} ({100.0 * ratio:.2g} % on {motion})"
        for rate, (ratio, motion) in worst.items()
    )
    numbers |= {f"{rate:g} Hz, part of what sensors cost": ratio for rate, (ratio, _) in worst.items()}
    reason = (
        f"A rate is sufficient if its error is less than {100.0 * NEGLIGIBLE:g} % of the sensors' error, in position "
        f"and in velocity: {judged}. Largest errors due to the slow rates alone, and due to the sensors:"
    )
    return Outcome(_of_slow_rates(*sufficient.values()), reason, tuple(said), numbers)


def _of_slow_rates(ten: bool, twenty: bool) -> str:
    return "confirmed" if ten and twenty else "partly" if twenty else "refuted"


def attitude_rate(evidence: Evidence) -> Outcome:
    """Find the lowest rate that keeps attitude within a few tenths of a minute of arc, motion by motion.

    Args:
        evidence: numbers of the deciding parts.

    Returns:
        The outcome, with a verdict on each motion.
    """
    numbers: dict[str, float] = {}
    said: list[Point] = []
    high: dict[str, float] = {}
    low: dict[str, float] = {}
    for motion, found in by(evidence.rows, of_motion).items():
        rows = list(needed(found, FEW_TENTHS_ARCSEC).values())
        good = [r for r in rows if base(r.algorithm) not in (*LOW_ORDER, *PLAIN)]
        if not good:
            return Outcome("refuted", f"On {motion} no algorithm of high order stays within 0.3′ at any rate.")
        best = _least(good)
        high[motion] = best.rate_hz
        arcmin = best.max_attitude_error_arcsec / 60.0
        numbers[f"{motion}: high order, Hz"] = best.rate_hz
        numbers[f"{motion}: high order, arcmin"] = arcmin
        fact = evidence.facts.get(motion)
        up_to = f" (up to {fact.max_rate_deg_s:.0f} deg/s)" if fact else ""
        text = f"{motion}{up_to}: high order from {best.rate_hz:g} Hz ({best.algorithm}, {arcmin:.2g}′)"
        slower = [r for r in rows if base(r.algorithm) in LOW_ORDER]
        text += ", " + _low_order(motion, found, slower, numbers)
        low[motion] = _least(slower).rate_hz if slower else math.inf
        uncompensated = [r.rate_hz for r in rows if base(r.algorithm) in PLAIN]
        if uncompensated:
            text += f", high order without coning compensation from {min(uncompensated):g} Hz"
            numbers[f"{motion}: high order without coning compensation, Hz"] = min(uncompensated)
        said.append(Point(text, _of_attitude(high[motion], low[motion])))
    if not said:
        return undecided("any result")
    worst, plainest = (max(rates, key=lambda motion: rates[motion]) for rates in (high, low))
    than = f"{low[plainest]:g} Hz" if math.isfinite(low[plainest]) else "a higher rate than any here"
    reason = (
        f"A high order needs at most {high[worst]:g} Hz, on {worst}; first and second order need {than} on "
        f"{plainest}. The claim is confirmed on a motion if a high order needs 50 to 80 Hz, and partly so if it needs "
        "less but a low order needs more than 50 Hz. Lowest rate that stays within 0.3′ to the end of the motion:"
    )
    return Outcome(_of_attitude(high[worst], low[plainest]), reason, tuple(said), numbers)


def _least(rows: list[Row]) -> Row:
    return min(rows, key=lambda row: (row.rate_hz, row.max_attitude_error_arcsec))


def _of_attitude(high: float, low: float) -> str:
    return "confirmed" if _LEAST_HZ <= high <= _MOST_HZ else "partly" if high < _LEAST_HZ < low else "refuted"


def _low_order(motion: str, found: list[Row], slower: list[Row], numbers: dict[str, float]) -> str:
    """Return the words on first and second order; their errors at 100 Hz and at the highest rate if none is enough."""
    if slower:
        numbers[f"{motion}: low order, Hz"] = _least(slower).rate_hz
        return f"first and second order from {_least(slower).rate_hz:g} Hz"
    rates = sorted({100.0, max(row.rate_hz for row in found)} & {row.rate_hz for row in found})
    errors = {rate: error_at(found, LOW_ORDER, rate) for rate in rates}
    numbers |= {f"{motion}: low order at {rate:g} Hz, arcsec": error for rate, error in errors.items()}
    shown = ", ".join(f"{number_text(error)}″ at {rate:g} Hz" for rate, error in errors.items())
    return f"first and second order at no rate (at best {shown})"
