"""Euler angles: heading through full turns, and passages through pitch ±90°."""

from __future__ import annotations

from sinssim.experiments.studies.claims.outcome import (
    EULER,
    FEW_TENTHS_ARCSEC,
    Evidence,
    Outcome,
    Point,
    by,
    of_motion,
    undecided,
)
from sinssim.experiments.studies.results import Heading, Row
from sinssim.formatting import number_text


def euler_heading(evidence: Evidence) -> Outcome:
    """Decide on the heading through full turns: integrated, and from ratios of direction cosines by arctangents.

    The verdict is that of the integrated heading, at the highest rate of each motion: it must be right and must not
    jump. The other forms are judged modulo 360°, beside it: a heading of 10° is that of 370°.

    Returns:
        The outcome, with a verdict on each motion and form.
    """
    turned = [heading for heading in evidence.headings if abs(heading.turns) > 1.0]
    if not turned:
        return undecided("a motion that turns through more than 360° of heading with a pitch below 85°")
    numbers: dict[str, float] = {}
    points, integrated, errors = [], [], []
    for motion in dict.fromkeys(heading.motion for heading in turned):
        here = [heading for heading in turned if heading.motion == motion]
        highest = max(heading.rate_hz for heading in here)
        for heading in (h for h in here if h.rate_hz == highest):
            right = heading.max_error_arcsec <= FEW_TENTHS_ARCSEC
            if heading.form == "integrated":
                right = right and not heading.jumps
                integrated.append("confirmed" if right else "refuted")
                errors.append(heading.max_error_arcsec)
            name = f"{motion}, {heading.form}"
            numbers[f"{name}: jumps"] = float(heading.jumps)
            numbers[f"{name}: largest error, arcsec"] = heading.max_error_arcsec
            numbers[f"{name}: wrong, part of the time"] = heading.wrong
            verdict = "confirmed" if right else "refuted"
            points.append(Point(f"{motion}, {heading.form} at {highest:g} Hz: {_said(heading)}", verdict))
    verdict = integrated[0] if len(set(integrated)) == 1 else "partly"
    most = max(turned, key=lambda heading: abs(heading.turns))
    reason = (
        f"Through up to {abs(most.turns):.1f} turns of heading, errors modulo 360°. Integrated angles count turns by "
        "themselves. The arctangent of one argument has limits: it is wrong by 180° in half of all headings. That of "
        "two arguments is right in every quadrant and only restarts at ±180°; unwrapped, it counts turns, too, but "
        "must be evaluated at least every half turn. So the advantage is one over the arctangent of one argument. A "
        "form is confirmed if it stays within 0.3′, the integrated one also without a jump:"
    )
    measured = f"{number_text(max(errors), 2)}″ in {abs(most.turns):.0f} turns"
    return Outcome(verdict, reason, tuple(points), numbers, measured, "at most 18″ (0.3′), no jump")


def _said(heading: Heading) -> str:
    if heading.max_error_arcsec < 3600.0:
        text = f"off by at most {number_text(heading.max_error_arcsec, 2)}″"
    else:
        text = (
            f"off by up to {number_text(heading.max_error_arcsec / 3600.0)}°, wrong for {100.0 * heading.wrong:.0f} % "
            "of the time"
        )
    text += f", {heading.jumps or 'no'} jumps"
    if heading.least_hz:
        text += f", read at least at {number_text(heading.least_hz, 2)} Hz"
    return text


def euler_limit(evidence: Evidence) -> Outcome:
    """Decide on the errors of Euler angles and of quaternions at ±90° of pitch.

    Returns:
        The outcome, with a verdict on each motion and rate.
    """
    rows = evidence.rows
    passed = [row for row in rows if row.algorithm == EULER and row.passages]
    if not passed:
        return undecided("Euler angles on a motion that passes ±90° of pitch")
    worst, best = max(passed, key=lambda r: r.max_damage_arcsec), min(passed, key=lambda r: r.max_damage_arcsec)
    numbers = {"greatest damage, arcsec": worst.max_damage_arcsec, "least damage, arcsec": best.max_damage_arcsec}
    text = (
        f"Passing it on {worst.motion} causes an attitude error of {worst.max_damage_arcsec / 60.0:.3g}′ at "
        f"{worst.pace} Hz" + (f", {best.max_damage_arcsec / 60.0:.3g}′ at {best.pace} Hz" if best is not worst else "")
    )
    other = [r for r in rows if r.algorithm == "quaternion" and (r.motion, r.pace) == (worst.motion, worst.pace)]
    if other:
        numbers["quaternion, arcsec"] = other[0].max_attitude_error_arcsec
        text += (
            f"; the error of the quaternion is at most {other[0].max_attitude_error_arcsec:.2g}″ on the whole motion"
        )
    points = [
        Point(f"{motion} at {row.pace} Hz: {number_text(row.max_damage_arcsec)}″", _of_damage(row))
        for motion, found in by(passed, of_motion).items()
        for row in found
    ]
    text += ". It is a limit where a passage costs more than 0.3′. Damage by the worst passage:"
    measured = f"{number_text(worst.max_damage_arcsec)}″ by a passage at {worst.pace} Hz"
    return Outcome(_of_damage(worst), text, tuple(points), numbers, measured, "at most 18″ (0.3′)")


def _of_damage(row: Row) -> str:
    """A passage with an error of a few tenths of an arcminute at most is no limit."""
    return "refuted" if row.max_damage_arcsec > FEW_TENTHS_ARCSEC else "confirmed"
