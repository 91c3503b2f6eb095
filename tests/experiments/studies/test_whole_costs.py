"""Whole verdicts on costs and on drifts under coning, from made-up numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

from sinssim.experiments.studies import claims
from sinssim.experiments.studies.attitude_claims import coning_drift
from sinssim.experiments.studies.attitude_cost import MatrixCost
from sinssim.experiments.studies.claims import cheapest, trigonometric_matrix
from sinssim.experiments.studies.step_cost import Operations
from sinssim.experiments.studies.study_results import Evidence, Row
from sinssim.experiments.studies.study_schema import MotionFacts
from sinssim.units import ARCSEC
from tests.experiments.studies.test_decide import row


def costly(algorithm: str, rate: float, operations: float, alone: float, **more: Any) -> Row:
    return row(algorithm, rate, operations_per_step=operations, attitude_operations_per_step=alone, ns_per_step=40.0,
               **{"attitude_drift_arcsec_h": 5.0, **more})  # fmt: skip


def test_the_cheapest_on_two_motions() -> None:
    """Operations per second of motion: 300 · 40 = 12 000 of a quaternion against 250 · 50 = 12 500 of a matrix."""
    rows = [
        costly("quaternion", 40.0, 300.0, 90.0), costly("quaternion-2", 100.0, 200.0, 30.0),
        costly("poisson-2", 50.0, 250.0, 100.0), costly("euler", 80.0, 400.0, 60.0),
        costly("rotation-vector-2", 20.0, 350.0, 70.0),
        costly("poisson-1", 10.0, 1.0, 1.0, attitude_drift_arcsec_h=20.0),
        costly("quaternion", 60.0, 300.0, 90.0, motion="b"), costly("poisson-2", 50.0, 250.0, 100.0, motion="b"),
    ]  # fmt: skip
    found = cheapest(Evidence(rows))
    assert [(point.text, point.verdict) for point in found.points] == [
        ("flight: quaternions 12 thousand (quaternion at 40 Hz, uses later samples), direction cosines 12.5 thousand "
         "(poisson-2 at 50 Hz), Euler angles 32 thousand (euler at 80 Hz, uses later samples), beyond the chapter, "
         "rotation vectors 7 thousand (rotation-vector-2 at 20 Hz)", "confirmed"),
        ("b: direction cosines 12.5 thousand (poisson-2 at 50 Hz), quaternions 18 thousand (quaternion at 60 Hz, uses "
         "later samples)", "refuted"),
    ]  # fmt: skip
    numbers = found.numbers
    assert numbers["flight: quaternions, 1000 operations/s"] == pytest.approx(12.0)
    assert numbers["flight: quaternions, µs/s"] == pytest.approx(1.6)
    # of the attitude alone 30 · 100 = 3000, 60 · 80 = 4800 and 100 · 50 = 5000; on b 90 · 60 = 5400
    assert numbers["flight: quaternions, attitude alone, 1000 operations/s"] == pytest.approx(3.0)
    assert numbers["flight: Euler angles, attitude alone, 1000 operations/s"] == pytest.approx(4.8)
    assert found.reason.startswith(
        "Quaternions need the fewest operations on 1 of 2 motions; the best of the others takes -30.6 % to +4.2 %, of "
        "the attitude alone -7.4 % to +60.0 %."
    )
    assert (found.verdict, found.measured, found.expected) == (
        "partly", "best of the others: -30.6 %", "more than 0 %",
    )  # fmt: skip


def test_the_matrix_by_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    """45 operations and 2 ns against 18 and six functions of 24, 162, and 25 ns."""
    by_products = MatrixCost(Operations(18.0, 27.0, 0.0, 0.0, 0.0), 2.0)
    by_functions = MatrixCost(Operations(4.0, 14.0, 0.0, 0.0, 6.0), 25.0)
    monkeypatch.setattr(claims, "matrix_costs", lambda: (by_products, by_functions))
    found = trigonometric_matrix()
    assert found.numbers == {
        "quaternion, operations": 45.0, "angles, operations": 162.0, "angles, operations if a function were one": 24.0,
        "quaternion, ns": 2.0, "angles, ns": 25.0,
    }  # fmt: skip
    assert [(point.text, point.verdict) for point in found.points] == [
        ("from a quaternion: 45 operations, 2 ns", ""),
        ("from angles by six functions: 162 operations, 25 ns", "confirmed"),
    ]
    assert (found.verdict, found.measured, found.expected) == (
        "confirmed", "3.6 × operations, 12 × time", "more than 1",
    )  # fmt: skip


def test_drifts_under_coning_against_the_law() -> None:
    """α²Ω(Ωh)²ⁿ n!/(2ⁿ⁺¹(2n+1)!!), from one sample α²Ω(Ωh)²/12 and with the one before α²Ω(Ωh)⁴/60."""
    alpha, omega, seconds = math.radians(0.1), 2.0 * math.pi * 10.0, 1000.0
    facts = {"flight": MotionFacts(seconds, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, cone=(alpha, omega))}
    law = {"1": lambda x: x**2 / 12.0, "1p": lambda x: x**4 / 60.0, "2": lambda x: x**4 / 60.0,
           "3": lambda x: x**6 * 6.0 / (16.0 * 105.0), "4": lambda x: x**8 * 24.0 / (32.0 * 945.0)}  # fmt: skip
    rows = []
    for name, factor in (("1", 1.01), ("1p", 1.0), ("2", 1.0), ("3", 0.99), ("4", 1.0)):
        rate = 1000.0 if name in "1p2" else 180.0  # Ωh = 0.0628, and 0.349 where the floor is below 3 %
        x = omega / rate
        drift = alpha**2 * omega * law[name](x) * seconds / ARCSEC
        rows.append(
            row(f"rotation-vector-{name}", rate, duration_s=seconds, final_attitude_error_arcsec=factor * drift)
        )
    found = coning_drift(Evidence(rows, facts))
    for name, x, ratio in (
        ("1", 0.063, 1.01),
        ("1p", 0.063, 1.0),
        ("2", 0.063, 1.0),
        ("3", 0.349, 0.99),
        ("4", 0.349, 1.0),
    ):
        assert found.numbers[f"flight, {name}, Ωh = {x:.3f}: measured/law"] == pytest.approx(ratio, rel=1e-9), name
    assert found.points[0].text == "flight, n = 1: 1.010 at 0.063"
    assert found.points[1].text == "flight, n = 1 and the one before: 1.000 at 0.063"
    assert (found.measured, found.expected) == ("1.010 of the law", "1 ± 0.03")
