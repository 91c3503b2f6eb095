"""The orthogonality that the two quaternions keep."""

from __future__ import annotations

from sinssim.experiments.studies.claims.outcome import Evidence, Outcome, Point, by, of_motion, overall, undecided

KEPT = 1e-9
"""Deviation from 1 up to which a norm counts as preserved."""


def orthogonality(evidence: Evidence) -> Outcome:
    """Decide on the norm that the two quaternions lose.

    Returns:
        The outcome, with a verdict on each motion.
    """
    rows = evidence.rows
    two = [row for row in rows if row.algorithm == "two-quaternions"]
    if not two:
        return undecided("the algorithm two-quaternions")
    worst, best = max(two, key=lambda r: r.max_defect), min(two, key=lambda r: r.max_defect)
    numbers = {"greatest defect": worst.max_defect, "least defect": best.max_defect}
    text = (
        "A matrix made of quaternions has orthogonal axes by construction, but their length is the squared "
        f"norm, which each step multiplies by 1 + e⁴/64: the norm is in error by {worst.max_defect:.2g} on "
        f"{worst.motion} at {worst.pace} Hz"
    )
    matrices = [
        r for r in rows if r.algorithm == "poisson-2" and r.motion == worst.motion and r.rate_hz == worst.rate_hz
    ]
    if matrices:
        numbers["direction cosines of second order"] = matrices[0].max_defect
        text += f", where Poisson's equation of second order loses {matrices[0].max_defect:.2g} of orthogonality"
    text += "."
    points = []
    for motion, found in by(two, of_motion).items():
        ends = [max(found, key=lambda r: r.max_defect), min(found, key=lambda r: r.max_defect)]
        shown = " to ".join(f"{r.max_defect:.2g} at {r.pace} Hz" for r in dict.fromkeys(ends))
        kept = [row.max_defect < KEPT for row in found]
        verdict = "confirmed" if all(kept) else "partly"
        points.append(Point(f"{motion}: norm in error by {shown}", verdict))
    if worst.max_defect >= KEPT:
        ppm = 2.0 * worst.max_defect * 1e6
        numbers["scale error of the forces, ppm"] = ppm
        text += f" At worst the resolved forces are {ppm:.2g} ppm too large: normalise."
    text += f" Kept means to {KEPT:g}:"
    measured = f"norm in error by up to {worst.max_defect:.2g}"
    return Outcome(overall(points), text, tuple(points), numbers, measured, f"at most {KEPT:g}")
