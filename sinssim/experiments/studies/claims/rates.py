"""The rates needed for velocity and position, and for attitude."""

from __future__ import annotations

import math

from sinssim.experiments.studies.claims.outcome import (
    LOOKS_AHEAD,
    LOW_ORDER,
    PLAIN,
    Evidence,
    Outcome,
    Point,
    base,
    by,
    drift_at,
    needed,
    of_motion,
    overall,
    undecided,
)
from sinssim.experiments.studies.results import Row
from sinssim.formatting import number_text
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.units import UG

NEGLIGIBLE = 0.1
"""A rate is sufficient if its error is less than this fraction of the error of sensors of the 1 nmi/h grade."""
SENSORS_UG = math.sqrt(2.0) * GRADE_TABLE["laser-standard"].accel.bias / UG
"""Their error of the horizontal acceleration: biases of two accelerometers, 1σ."""

_ENOUGH_HZ = 20.0
_LEAST_HZ, _MOST_HZ = 50.0, 80.0


def velocity_rate(evidence: Evidence) -> Outcome:
    """Decide on slow velocity and position with fast attitude, relative to the errors of accelerometers.

    Both act as an error of the acceleration: the drift of the velocity in perfect navigation with slow rates, and the
    bias of the accelerometers. So the comparison depends neither on a draw nor on the duration.

    Returns:
        The outcome, with a verdict on each motion.
    """
    numbers: dict[str, float] = {}
    said = []
    limit = NEGLIGIBLE * SENSORS_UG
    worst: dict[float, tuple[float, str]] = {}
    for motion, found in by(evidence.rows, of_motion).items():
        slow = {r.schedule_hz[1]: r for r in found if r.schedule_hz and r.schedule_hz[1] == r.schedule_hz[2]}
        if _ENOUGH_HZ not in slow:
            return undecided("velocity and position at 20 Hz with perfect sensors")
        for rate, row in slow.items():
            worst[rate] = max(worst.get(rate, (0.0, "")), (row.velocity_drift_ug, motion))
            numbers[f"{motion}: {rate:g} Hz, µg"] = row.velocity_drift_ug
            numbers[f"{motion}: {rate:g} Hz, m"] = row.max_horizontal_error_m
        enough = slow[_ENOUGH_HZ].velocity_drift_ug < limit
        drifts = ", ".join(
            f"{rate:g} Hz {number_text(row.velocity_drift_ug, 2)} ± "
            f"{number_text(row.velocity_drift_uncertainty_ug, 1)} µg"
            for rate, row in sorted(slow.items(), reverse=True)
        )
        said.append(Point(f"{motion}: {drifts}", "confirmed" if enough else "refuted"))
    if not said:
        return undecided("any result")
    loads = {r.pace: r.operations_per_step for r in evidence.rows if r.schedule_hz and r.operations_per_step > 0.0}
    numbers |= {f"{pace}: operations per step": load for pace, load in loads.items()}
    if loads:
        shown = ", ".join(f"{pace} {load:.0f}" for pace, load in loads.items())
        said.append(Point(f"operations per fast step: {shown}"))
    numbers |= {f"{rate:g} Hz, part of the sensors' error": drift / SENSORS_UG for rate, (drift, _) in worst.items()}
    insufficient = [
        f"{rate:g} Hz costs {100.0 * drift / SENSORS_UG:.2g} % on {motion}"
        for rate, (drift, motion) in sorted(worst.items())
        if drift >= limit
    ]
    drift, motion = worst[_ENOUGH_HZ]
    reason = (
        "Drift of the velocity by the slow rates alone, with perfect sensors: it acts like an error of the "
        f"acceleration. A rate is sufficient below {limit:.3g} µg, {100.0 * NEGLIGIBLE:g} % of the biases of two level "
        f"accelerometers of the 1 nmi/h grade. At {_ENOUGH_HZ:g} Hz it is {100.0 * drift / SENSORS_UG:.2g} % of them "
        f"on {motion}"
        + (f"; lower rates are not sufficient everywhere: {'; '.join(insufficient)}" if insufficient else "")
        + ":"
    )
    measured = f"{number_text(drift, 2)} µg at {_ENOUGH_HZ:g} Hz ({motion})"
    return Outcome(overall(said), reason, tuple(said), numbers, measured, f"below {limit:.3g} µg")


def attitude_rate(evidence: Evidence) -> Outcome:
    """Find the lowest rate that keeps attitude within a few tenths of a minute of arc in an hour, motion by motion.

    Returns:
        The outcome, with a verdict on each motion.
    """
    numbers: dict[str, float] = {}
    said: list[Point] = []
    high: dict[str, Row] = {}
    for motion, found in by(evidence.rows, of_motion).items():
        rows = list(needed(found).values())
        good = [r for r in rows if base(r.algorithm) not in (*LOW_ORDER, *PLAIN)]
        if not good:
            return Outcome("refuted", f"On {motion} no algorithm of high order drifts by less than 0.3′/h at any rate.")
        best = high[motion] = _least(good)
        numbers[f"{motion}: high order, Hz"] = best.rate_hz
        numbers[f"{motion}: high order, arcsec/h"] = best.attitude_drift_arcsec_h
        fact = evidence.facts.get(motion)
        up_to = f" (up to {fact.max_rate_deg_s:.0f} deg/s)" if fact else ""
        text = f"{motion}{up_to}: high order from {_shown(best)}"
        causal = [r for r in good if base(r.algorithm) not in LOOKS_AHEAD]
        if base(best.algorithm) in LOOKS_AHEAD:
            text += f", without later samples {f'from {_shown(_least(causal))}' if causal else 'at no rate'}"
        if causal:
            numbers[f"{motion}: high order without later samples, Hz"] = _least(causal).rate_hz
        slower = [r for r in rows if base(r.algorithm) in LOW_ORDER]
        text += ", " + _low_order(motion, found, slower, numbers)
        uncompensated = [r.rate_hz for r in rows if base(r.algorithm) in PLAIN]
        if uncompensated:
            text += f", high order without coning compensation from {min(uncompensated):g} Hz"
            numbers[f"{motion}: high order without coning compensation, Hz"] = min(uncompensated)
        said.append(Point(text, _of_attitude(best.rate_hz, _least(slower).rate_hz if slower else math.inf)))
    if not said:
        return undecided("any result")
    worst = max(high, key=lambda motion: high[motion].rate_hz)
    reason = (
        "Lowest rate from which on the attitude drifts by at most 0.3′ in an hour, half as much as a gyro of the "
        "1 nmi/h grade. The drift is a line fitted to the error, so that the duration of a motion does not matter. The "
        f"claim is confirmed on a motion if a high order needs {_LEAST_HZ:g} to {_MOST_HZ:g} Hz, and partly so if it "
        f"needs less but a low order needs more than {_LEAST_HZ:g} Hz. {high[worst].rate_hz:g} Hz with a high order is "
        f"enough on every motion, and necessary on {worst}:"
    )
    measured = f"high order from {high[worst].rate_hz:g} Hz ({worst})"
    return Outcome(overall(said), reason, tuple(said), numbers, measured, "50–80 Hz (0.3′ in an hour)")


def _shown(row: Row) -> str:
    ahead = ", uses later samples" if base(row.algorithm) in LOOKS_AHEAD else ""
    drift, apart = row.attitude_drift_arcsec_h, row.attitude_drift_uncertainty_arcsec_h
    return f"{row.rate_hz:g} Hz ({row.algorithm}{ahead}, {number_text(drift, 2)} ± {number_text(apart, 1)} ″/h)"


def _least(rows: list[Row]) -> Row:
    return min(rows, key=lambda row: (row.rate_hz, row.attitude_drift_arcsec_h))


def _of_attitude(high: float, low: float) -> str:
    return "confirmed" if _LEAST_HZ <= high <= _MOST_HZ else "partly" if high < _LEAST_HZ < low else "refuted"


def _low_order(motion: str, found: list[Row], slower: list[Row], numbers: dict[str, float]) -> str:
    """Return the words on first and second order; their drifts at 100 Hz and at the highest rate if none is enough."""
    if slower:
        numbers[f"{motion}: low order, Hz"] = _least(slower).rate_hz
        return f"first and second order from {_least(slower).rate_hz:g} Hz"
    rates = sorted({100.0, max(row.rate_hz for row in found)} & {row.rate_hz for row in found})
    drifts = {rate: drift_at(found, LOW_ORDER, rate) for rate in rates}
    numbers |= {f"{motion}: low order at {rate:g} Hz, arcsec/h": drift for rate, drift in drifts.items()}
    shown = ", ".join(f"{number_text(drift)} ″/h at {rate:g} Hz" for rate, drift in drifts.items())
    return f"first and second order at no rate (at best {shown})"
