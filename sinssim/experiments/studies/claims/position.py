"""Simplified radii of curvature and the computer's errors against gyros, and the rate of latitude."""

from __future__ import annotations

from sinssim.earth.models import MEAN_RADIUS
from sinssim.experiments.studies.claims.outcome import Evidence, Outcome, Point, by, of_motion, overall, undecided
from sinssim.experiments.studies.claims.power_of_time import SCHULER_PERIOD
from sinssim.experiments.studies.results import Row
from sinssim.formatting import listed, number_text
from sinssim.strapdown.one_component import gyro_error
from sinssim.units import DEG_H

GOOD_GYRO_DEG_H = 0.0035
"""A high-quality gyro: the bias of the grade laser-navigation."""
BIASED = "gyro-0_01-deg-h"
"""Name of the block with a bias of 0.01 deg/h of every gyro."""
LEVEL_BIASED = "east-gyro-0_01-deg-h"
"""Name of the block with a bias of 0.01 deg/h of the gyro to the right."""
COMPUTER_SHARE = 0.01
"""Error of a good computer at most, relative to that of the sensors."""
PLANE_WITHIN = 0.05
"""Distance of the plane's error (8.15) from that on the turning Earth within two hours: (Ωt)²/6 is 0.046."""


_WRITTEN = {
    "simplified": "to first order, 1/(R₁+H) ≈ (1/a)[1 + e²(1 − 3/2 sin²B) − H/a] and "
    "1/(R₂+H) ≈ (1/a)[1 − ½e² sin²B − H/a]",
    "spherical": "without e², 1/(a+H) for both",
    "no-height": "without H, 1/R₁ and 1/R₂",
    "spherical-no-height": "without e² and H, 1/a for both",
}
"""The forms of the radii, written out."""


def simplified_radii(evidence: Evidence) -> Outcome:
    """Find, for each form of simplified radii, the gyro bias that causes the same position error in a Schuler period.

    The error by the radii is bounded and reaches its largest value within one Schuler period, while that of a gyro
    grows without bound. So the comparison depends on its duration, and one Schuler period is the shortest that shows
    both.

    Returns:
        The outcome, with a verdict on each motion and form.
    """
    numbers: dict[str, float] = {}
    said = []
    worst: dict[str, float] = {}
    for motion, found in by(evidence.rows, of_motion).items():
        forms = [r for r in found if r.curvature != "exact" and r.sensors == "ideal"]
        biased = [r for r in found if r.curvature == "exact" and r.sensors == BIASED]
        if not forms or not biased:
            return undecided(f"simplified radii with perfect sensors, and exact radii with the block {BIASED}")
        by_bias = _in_a_period(biased[0], evidence)
        if by_bias is None:
            return undecided(f"motions of at least one Schuler period, {SCHULER_PERIOD:.0f} s")
        numbers[f"{motion}: gyros of 0.01 deg/h, m"] = by_bias
        for row in forms:
            error = _in_a_period(row, evidence) or 0.0
            equivalent = 0.01 * error / by_bias
            worst[row.curvature] = max(worst.get(row.curvature, 0.0), equivalent)
            numbers[f"{motion}: {row.curvature}, m"] = error
            numbers[f"{motion}: {row.curvature}, equivalent gyro bias, deg/h"] = equivalent
            text = f"{motion}, {row.curvature}: {number_text(error)} m, as much as {number_text(equivalent, 2)} deg/h"
            said.append(Point(text, "confirmed" if equivalent >= GOOD_GYRO_DEG_H else "refuted"))
    if not said:
        return undecided("any result")
    costly = [value >= GOOD_GYRO_DEG_H for value in worst.values()]
    verdict = "confirmed" if all(costly) else "partly" if any(costly) else "refuted"
    numbers |= {f"{form}: largest equivalent gyro bias, deg/h": value for form, value in worst.items()}
    shown = [f"{_WRITTEN.get(form, form)} ({number_text(value, 2)})" for form, value in worst.items()]
    as_much = [text for text, much in zip(shown, costly, strict=True) if much]
    less = [text for text, much in zip(shown, costly, strict=True) if not much]
    judged = [f"as much or more: {listed(as_much)}"] if as_much else []
    judged += [f"less: {listed(less)}"] if less else []
    reason = (
        f"A high-quality gyro has {GOOD_GYRO_DEG_H:g} deg/h. By their largest error in one Schuler period, deg/h in "
        f"brackets, these forms of the radii cost {'; '.join(judged)}. Largest position error with perfect sensors, "
        "and the gyro bias with the same error:"
    )
    measured = f"by form {' to '.join(number_text(of(worst.values()), 2) for of in (min, max))} deg/h"
    return Outcome(verdict, reason, tuple(said), numbers, measured, f"at least {GOOD_GYRO_DEG_H:g} deg/h")


def _in_a_period(row: Row, evidence: Evidence) -> float | None:
    """Return the largest horizontal error in the first Schuler period, m; None for a shorter motion."""
    growth = evidence.growth(row)
    if growth is None or growth.time[-1] - growth.time[0] < SCHULER_PERIOD * (1.0 - 1e-2):
        return None
    return float(growth.horizontal[growth.time - growth.time[0] <= SCHULER_PERIOD].max())


def latitude_rate(evidence: Evidence) -> Outcome:
    """Compute the rate of latitude on a true motion due north."""
    facts = evidence.facts
    best = max(
        facts.items(), key=lambda item: item[1].latitude_rate_deg_h / max(item[1].ground_speed_kmh, 1.0), default=None
    )
    if best is None:
        return undecided("a motion to the north")
    motion, fact = best
    rate = fact.latitude_rate_deg_h * 1100.0 / fact.ground_speed_kmh
    round_earth = 1100.0 / 3.6 / MEAN_RADIUS / DEG_H
    text = (
        f"On the motion “{motion}” latitude changes by {fact.latitude_rate_deg_h:.3f} deg/h at "
        f"{fact.ground_speed_kmh:.1f} km/h; at 1100 km/h that is {rate:.2f} deg/h. V/R of the mean Earth is "
        f"{round_earth:.2f} deg/h; R₁ at the equator is smaller by 0.6 %."
    )
    verdict = "confirmed" if abs(rate - 10.0) < 0.5 else "refuted"
    return Outcome(verdict, text, (), {"latitude rate, deg/h": rate}, f"{rate:.2f} deg/h", "10 ± 0.5 deg/h")


def computer_errors(evidence: Evidence) -> Outcome:
    """Compare the errors of the algorithm, with perfect sensors, with those that the sensors cause.

    Returns:
        The outcome, with a verdict on each motion. On a motion at rest the closed form (8.15) is beside the errors.
    """
    numbers: dict[str, float] = {}
    points: list[Point] = []
    worst = 0.0
    for motion, found in by(evidence.rows, of_motion).items():
        ideal = [row for row in found if row.sensors == "ideal"]
        biased = [row for row in found if row.sensors == LEVEL_BIASED]
        if not ideal or not biased:
            return undecided(f"perfect sensors and the block {LEVEL_BIASED} on the same motions")
        own, sensors = ideal[0].max_horizontal_error_m, biased[0].max_horizontal_error_m
        share = own / sensors
        worst = max(worst, share)
        numbers |= {f"{motion}: computer, m": own, f"{motion}: sensors, m": sensors}
        text = f"{motion}: computer {number_text(own, 2)} m, gyro {number_text(sensors, 4)} m"
        verdict = "confirmed" if share <= COMPUTER_SHARE else "refuted"
        if evidence.facts[motion].distance_m < 1.0:
            closed = MEAN_RADIUS * float(gyro_error(biased[0].duration_s, 0.01 * DEG_H))
            numbers[f"{motion}: (8.15), m"] = closed
            text += f", by (8.15) {number_text(closed, 4)} m"
            verdict = verdict if abs(sensors / closed - 1.0) <= PLANE_WITHIN else "refuted"
        points.append(Point(text, verdict))
    if not points:
        return undecided("any result")
    reason = (
        "A computer is good if its own error, with perfect sensors, is at most 1 % of that of one gyro of 0.01 deg/h. "
        f"At rest the gyro's error must also be that of (8.15), to {100.0 * PLANE_WITHIN:g} % because the chapter's "
        "plane does not turn with the Earth. Largest position errors:"
    )
    measured = f"{number_text(100.0 * worst, 2)} % of a gyro's"
    return Outcome(overall(points), reason, tuple(points), numbers, measured, f"at most {100.0 * COMPUTER_SHARE:g} %")
