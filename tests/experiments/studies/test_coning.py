"""The whole verdict on the drift under coning, with a law and a theory whose numbers are given."""

from __future__ import annotations

from typing import Any

import pytest

from sinssim.experiments.studies import attitude_claims
from sinssim.experiments.studies.study_results import Evidence, Outcome, Point, Row
from sinssim.experiments.studies.study_schema import MotionFacts
from tests.experiments.studies.test_decide import row

SAMPLES = {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}
CONES = {"slow": (0.02, 10.0), "wide": (0.05, 30.0), "table": None}
LASTING = 40.0


def law(samples: int, half_angle: float, rate: float, interval: float, previous: bool) -> float:
    return (samples + 0.5 * previous) * half_angle * rate * interval * 1e-6


def theory(samples: int, half_angle: float, rate: float, interval: float, previous: bool) -> float:
    """Larger than the law by (Ωh)², and against the cone's direction."""
    return -law(samples, half_angle, rate, interval, previous) * (1.0 + (rate * interval) ** 2)


def navigated(motion: str, name: str, rate_hz: float, over_theory: float) -> Row:
    half_angle, rate = CONES[motion] or (0.02, 10.0)
    drift = abs(theory(SAMPLES.get(name, 1), half_angle, rate, 1.0 / rate_hz, name == "1p")) * over_theory
    arcsec = drift * LASTING / 4.84813681109536e-6
    return row(f"rotation-vector-{name}", rate_hz, motion=motion, duration_s=LASTING,
               final_attitude_error_arcsec=arcsec)  # fmt: skip


ROWS = [
    navigated("slow", "1", 20.0, 1.01), navigated("slow", "1", 100.0, 0.99), navigated("slow", "1", 1e9, 7.0),
    navigated("slow", "1p", 100.0, 1.002), navigated("slow", "2", 80.0, 1.004), navigated("slow", "3", 100.0, 0.996),
    navigated("slow", "5", 100.0, 3.0), navigated("wide", "4", 300.0, 1.003), navigated("wide", "4", 60.0, 1.02),
    navigated("table", "4", 60.0, 9.0),
]  # fmt: skip


def decided(monkeypatch: pytest.MonkeyPatch, rows: list[Row]) -> Outcome:
    monkeypatch.setattr(attitude_claims, "leading_drift_under_coning", law)
    monkeypatch.setattr(attitude_claims, "drift_under_coning", theory)
    facts = {name: MotionFacts(LASTING, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, cone=cone) for name, cone in CONES.items()}
    return attitude_claims.coning_drift(Evidence(rows, facts))


def test_the_whole_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Ωh = 0.1 the law is 1 % below the theory and holds; at 0.5 it is 25 % below and does not."""
    found = decided(monkeypatch, ROWS)
    assert [(point.text, point.verdict) for point in found.points] == [
        ("slow, n = 1: 1.000 at 0.100, 1.262 [1.250] at 0.500", "confirmed"),
        ("slow, n = 1 and the one before: 1.012 at 0.100", "confirmed"),
        ("slow, n = 2: 1.020 at 0.125", "confirmed"),
        ("slow, n = 3: 1.006 at 0.100", "confirmed"),
        ("wide, n = 4: 1.013 at 0.100, 1.275 [1.250] at 0.500", "confirmed"),
    ]
    expected: dict[str, Any] = {}
    for case, x, over in (("slow, 1", 0.1, 0.99), ("slow, 1", 0.5, 1.01), ("slow, 1p", 0.1, 1.002),
                          ("slow, 2", 0.125, 1.004), ("slow, 3", 0.1, 0.996), ("wide, 4", 0.1, 1.003),
                          ("wide, 4", 0.5, 1.02)):  # fmt: skip
        expected[f"{case}, Ωh = {x:.3f}: measured/law"] = over * (1.0 + x * x)
        expected[f"{case}, Ωh = {x:.3f}: measured/exact"] = over
    assert found.numbers == pytest.approx(expected, rel=1e-12)
    assert (found.verdict, found.measured, found.expected) == ("confirmed", "1.020 of the law", "1 ± 0.03")
    assert found.reason == (
        "The law is the leading term. Where it is within 3 % of the exact drift, measured drifts are 1.020 of it in "
        "the worst case; elsewhere (exact ratio in brackets) the next term or the floor of triple products dominates. "
        "They differ from the exact drift by at most 2 %. Measured drift over the law, at Ωh:"
    )


def test_one_cone_apart_from_the_theory_refutes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """By 4 %, where the law is not judged; the others are confirmed. A number of samples that is missing is asked."""
    found = decided(monkeypatch, [*ROWS[:-2], navigated("wide", "4", 60.0, 1.04)])
    assert found.verdict == "refuted"
    assert found.points[-1] == Point("wide, n = 4: 1.013 at 0.100, 1.300 [1.250] at 0.500", "refuted")
    assert {point.verdict for point in found.points[:-1]} == {"confirmed"}
    assert "differ from the exact drift by at most 4 %." in found.reason
    below = decided(monkeypatch, [navigated("slow", "2", 80.0, 0.95), *ROWS])
    assert below.verdict == "refuted"  # 0.965 of the law
    assert (below.measured, below.points[0].verdict) == ("0.965 of the law", "refuted")
    assert decided(monkeypatch, ROWS[:-4]).verdict == "undecided"
    assert decided(monkeypatch, ROWS[:-4]).reason.endswith(
        "for each number of samples a cone and a rate at which the law holds."
    )
