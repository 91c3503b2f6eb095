"""Simplified radii of curvature against gyros, and the rate of latitude."""

from __future__ import annotations

from sinssim.formatting import number_text
from sinssim.frames import listed
from sinssim.studies.claims.outcome import Evidence, Outcome, Point, by, of_motion, undecided

GOOD_GYRO_DEG_H = 0.0035
"""A high-quality gyro: the bias of the grade laser-navigation."""


def simplified_radii(evidence: Evidence) -> Outcome:
    """Find, for each form of simplified radii, the gyro bias that causes the same position error.

    Args:
        evidence: numbers of the deciding parts.

    Returns:
        The outcome, with a verdict on each motion and form.
    """
    numbers: dict[str, float] = {}
    said = []
    worst: dict[str, float] = {}
    for motion, found in by(evidence.rows, of_motion).items():
        forms = [r for r in found if r.curvature != "exact" and r.sensors == "ideal"]
        biased = [r for r in found if r.curvature == "exact" and r.sensors == "gyro-0_01-deg-h"]
        if not forms or not biased:
            return undecided("simplified radii with perfect sensors, and exact radii with the block gyro-0_01-deg-h")
        by_bias = biased[0].max_horizontal_error_m
        numbers[f"{motion}: gyros of 0.01 deg/h, m"] = by_bias
        for row in forms:
            error = row.max_horizontal_error_m
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
    shown = [f"{form} ({number_text(value, 2)})" for form, value in worst.items()]
    as_much = [text for text, much in zip(shown, costly, strict=True) if much]
    less = [text for text, much in zip(shown, costly, strict=True) if not much]
    judged = [f"{listed(as_much)} cost as much or more"] if as_much else []
    judged += [f"{listed(less)} cost less"] if less else []
    reason = (
        f"A high-quality gyro has {GOOD_GYRO_DEG_H:g} deg/h. By their largest error, deg/h in brackets, "
        f"{'; '.join(judged)}. Largest position error with perfect sensors, and the gyro bias with the same error:"
    )
    return Outcome(verdict, reason, tuple(said), numbers)


def latitude_rate(evidence: Evidence) -> Outcome:
    """Compute the rate of latitude on a true motion due north.

    Args:
        evidence: numbers of the deciding parts.

    Returns:
        The outcome.
    """
    facts = evidence.facts
    best = max(
        facts.items(), key=lambda item: item[1].latitude_rate_deg_h / max(item[1].ground_speed_kmh, 1.0), default=None
    )
    if best is None:
        return undecided("a motion to the north")
    motion, fact = best
    rate = fact.latitude_rate_deg_h * 1100.0 / fact.ground_speed_kmh
    text = (
        f"On the motion “{motion}” latitude changes by {fact.latitude_rate_deg_h:.3f} deg/h at "
        f"{fact.ground_speed_kmh:.1f} km/h; at 1100 km/h that is {rate:.2f} deg/h."
    )
    return Outcome("confirmed" if abs(rate - 10.0) < 0.5 else "refuted", text, (), {"latitude rate, deg/h": rate})
