"""The drift of rotation vectors under coning."""

from __future__ import annotations

from sinssim.experiments.studies.claims.outcome import Evidence, Outcome, Point, by, of_motion, undecided
from sinssim.strapdown.coning_drift import drift, leading_term
from sinssim.units import ARCSEC

LAW_HOLDS = 0.03
"""Relative error up to which a law holds."""

_SAMPLES = {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}
_LEAST_DRIFT = 1e-5 * ARCSEC  # total drift; a smaller one contains rounding


def coning_drift(evidence: Evidence) -> Outcome:
    """Compare the drift after whole turns of a cone with the law and with the exact theory.

    Returns:
        The outcome, with a verdict on each cone and number of samples.
    """
    numbers: dict[str, float] = {}
    said = []
    kept: list[tuple[str, float]] = []
    farthest = 0.0
    for motion, found in by(evidence.rows, of_motion).items():
        cone = evidence.facts[motion].cone
        for algorithm, at_rates in by(found, lambda row: row.algorithm).items():
            name = algorithm.removeprefix("rotation-vector-")
            if cone is None or name not in _SAMPLES:
                continue
            words, apart = [], 0.0
            for row in sorted(at_rates, key=lambda row: -row.rate_hz):
                case = (_SAMPLES[name], *cone, 1.0 / row.rate_hz, name == "1p")
                law, exact = leading_term(*case), abs(drift(*case))
                if exact * row.duration_s < _LEAST_DRIFT:
                    continue
                measured = row.final_attitude_error_arcsec * ARCSEC / row.duration_s
                x = cone[1] / row.rate_hz
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/law"] = measured / law
                numbers[f"{motion}, {name}, Ωh = {x:.3f}: measured/exact"] = measured / exact
                apart = max(apart, abs(measured / exact - 1.0))
                holds = abs(exact / law - 1.0) < LAW_HOLDS
                if holds:
                    kept.append((name, measured / law))
                words.append(f"{measured / law:.3f}{'' if holds else f' [{exact / law:.3f}]'} at {x:.3f}")
            farthest = max(farthest, apart)
            if words:
                text = f"{motion}, n = {'1 and the one before' if name == '1p' else name}: {', '.join(words)}"
                said.append(Point(text, "confirmed" if apart < LAW_HOLDS else "refuted"))
    if {name for name, _ in kept} != set(_SAMPLES):
        return undecided("for each number of samples a cone and a rate at which the law holds")
    worst = max((ratio for _, ratio in kept), key=lambda ratio: abs(ratio - 1.0))
    good = abs(worst - 1.0) < LAW_HOLDS and farthest < LAW_HOLDS
    reason = (
        f"The law is the leading term. Where it is within {100.0 * LAW_HOLDS:g} % of the exact drift, measured drifts "
        f"are {worst:.3f} of it in the worst case; elsewhere (exact ratio in brackets) the next term or the floor of "
        f"triple products dominates. They differ from the exact drift by at most {100.0 * farthest:.2g} %. Measured "
        "drift over the law, at Ωh:"
    )
    shown, expected = f"{worst:.3f} of the law", f"1 ± {LAW_HOLDS:g}"
    return Outcome("confirmed" if good else "refuted", reason, tuple(said), numbers, shown, expected)
