"""Verdicts on numbers made for the purpose: each claim can be confirmed and refuted, and is undecided without data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.strapdown.coning_drift import drift
from sinssim.studies.claims.decide import decide
from sinssim.studies.motions import MotionFacts
from sinssim.studies.results import Heading, Row, StudyResult, Verdict
from sinssim.studies.schema import CLAIMS, Study
from sinssim.units import ARCSEC

FACTS = MotionFacts(3600.0, 1.1e6, 9.9, 1100.0, 1.0, 5.0, 50.0)


def row(algorithm: str = "quaternion", rate: float = 100.0, **more) -> Row:
    case = {
        "part": "p", "motion": "flight", "variant": "rate-gyros", "sensors": "ideal", "algorithm": algorithm,
        "frame": "level", "gravity": "normal", "curvature": "exact", "rate_hz": rate, "schedule_hz": (), "slow": "",
    }  # fmt: skip
    return Row(**{**case, **more})


def verdict(claim: str, *rows: Row, facts: MotionFacts = FACTS) -> Verdict:
    part = {
        "title": "p", "decides": (claim,), "rates_hz": (100.0,),
        "motions": ({"name": "flight", "parked": {"latitude_deg": 0.0, "duration_s": 1.0}},),
    }  # fmt: skip
    study = Study.model_validate({"name": "s", "parts": (part,)})
    comparison = StudyResult(study, rows=list(rows), motions={(r.part, r.motion): facts for r in rows})
    (decided,) = decide(comparison)
    assert decided.claim == claim
    return decided


@pytest.mark.parametrize("claim", CLAIMS)
def test_undecided_without_numbers(claim):
    assert verdict(claim).verdict == "undecided"


@pytest.mark.parametrize(
    ("at_10", "at_20", "expected"), [(1.0, 0.5, "confirmed"), (30.0, 5.0, "partly"), (30.0, 20.0, "refuted")]
)
def test_velocity_rate(at_10, at_20, expected):
    def slow(rate, error):
        return row(
            rate=200.0,
            schedule_hz=(200.0, rate, rate),
            max_horizontal_error_m=error,
            max_velocity_error_mps=error / 1e3,
            operations_per_step=600.0 + rate,
        )

    real = row(
        rate=200.0, schedule_hz=(200.0, 200.0, 200.0), sensors="laser-standard", max_horizontal_error_m=100.0,
        max_velocity_error_mps=0.1,
    )  # fmt: skip
    found = verdict("velocity-rate", slow(10.0, at_10), slow(20.0, at_20), real)
    assert found.verdict == expected
    assert found.numbers["flight: 10 Hz, m"] == at_10
    assert found.numbers["200/20/20: operations per step"] == 620.0
    assert found.points[-1] == "operations per fast step: 200/10/10 610, 200/20/20 620"


@pytest.mark.parametrize(
    ("needed_high", "needed_low", "expected"),
    [(50.0, 200.0, "confirmed"), (80.0, 100.0, "confirmed"), (20.0, 100.0, "partly"), (20.0, 20.0, "refuted"),
     (100.0, 200.0, "refuted")],
)  # fmt: skip
def test_attitude_rate(needed_high, needed_low, expected):
    def family(algorithm, needed):
        rates = (10.0, 20.0, 50.0, 80.0, 100.0, 200.0)
        return [row(algorithm, r, max_attitude_error_arcsec=17.0 if r >= needed else 60.0) for r in rates]

    found = verdict("attitude-rate", *family("rotation-vector-2", needed_high), *family("quaternion-1", needed_low))
    assert found.verdict == expected
    assert found.numbers["flight: high order, Hz"] == needed_high
    assert found.numbers["flight: low order, Hz"] == needed_low


def test_a_rate_that_happens_to_be_good_below_a_bad_one_is_not_enough():
    errors = {10.0: 5.0, 20.0: 100.0, 50.0: 10.0, 80.0: 1.0}
    rows = [row("rotation-vector-2", rate, max_attitude_error_arcsec=error) for rate, error in errors.items()]
    assert verdict("attitude-rate", *rows).numbers["flight: high order, Hz"] == 50.0


@pytest.mark.parametrize(("operations", "expected"), [(900.0, "confirmed"), (1500.0, "refuted")])
def test_cheapest(operations, expected):
    good = {"max_attitude_error_arcsec": 1.0, "ns_per_step": 100.0}
    found = verdict(
        "cheapest",
        row("quaternion-3", **good, operations_per_step=operations),
        row("poisson-3", **good, operations_per_step=1000.0),
        row("poisson-1", 50.0, max_attitude_error_arcsec=99.0, ns_per_step=1.0, operations_per_step=1.0),
        row("rotation-vector-4", **good, operations_per_step=1.0),
    )
    assert found.verdict == expected  # neither the inaccurate one nor the one beyond the chapter decides
    assert found.numbers["flight: quaternions, 1000 operations/s"] == pytest.approx(operations / 10.0)
    assert "attitude alone" not in found.reason


def test_cheapest_attitude_alone():
    """Beside the whole navigation, which decides: the least of each family by the attitude's own operations."""
    good = {"max_attitude_error_arcsec": 1.0, "ns_per_step": 100.0, "operations_per_step": 1000.0}
    found = verdict(
        "cheapest",
        row("quaternion-3", **good, attitude_operations_per_step=200.0),
        row("quaternion-4", **{**good, "operations_per_step": 990.0}, attitude_operations_per_step=250.0),
        row("poisson-3", **{**good, "operations_per_step": 1010.0}, attitude_operations_per_step=300.0),
        row("euler", **{**good, "operations_per_step": 1200.0}, attitude_operations_per_step=500.0),
    )
    assert found.verdict == "confirmed"
    assert "of the attitude alone +50.0 % to +50.0 %" in found.reason
    assert found.numbers["flight: Euler angles, attitude alone, 1000 operations/s"] == pytest.approx(50.0)


@pytest.mark.parametrize(("defect", "expected"), [(1e-13, "confirmed"), (1e-6, "partly")])
def test_orthogonality(defect, expected):
    found = verdict("orthogonality", row("two-quaternions", max_defect=defect), row("poisson-2", max_defect=1e-3))
    assert found.verdict == expected
    assert found.numbers["greatest defect"] == defect


@pytest.mark.parametrize(("damage", "expected"), [(600.0, "refuted"), (0.1, "confirmed")])
def test_euler_limit(damage, expected):
    rows = [row("euler", passages=1, max_damage_arcsec=damage), row(max_attitude_error_arcsec=1e-3)]
    found = verdict("euler-limit", *rows)
    assert found.verdict == expected
    assert found.numbers["quaternion, arcsec"] == 1e-3


@pytest.mark.parametrize(
    ("metres", "spherical", "expected"),
    [(10.0, None, "refuted"), (500.0, None, "confirmed"), (10.0, 700.0, "partly"), (10.0, 349.0, "refuted"),
     (350.0, 351.0, "confirmed")],
)  # fmt: skip
def test_simplified_radii(metres, spherical, expected):
    forms = [row(curvature="simplified", max_horizontal_error_m=metres)]
    if spherical:
        forms.append(row(curvature="spherical", max_horizontal_error_m=spherical))
    found = verdict("simplified-radii", *forms, row(sensors="gyro-0_01-deg-h", max_horizontal_error_m=1000.0))
    assert found.verdict == expected
    assert found.numbers["flight: simplified, equivalent gyro bias, deg/h"] == pytest.approx(metres * 1e-5)
    if spherical:
        assert found.numbers["spherical: largest equivalent gyro bias, deg/h"] == pytest.approx(spherical * 1e-5)


@pytest.mark.parametrize(
    ("rate", "speed", "expected"), [(9.9, 1100.0, "confirmed"), (4.95, 550.0, "confirmed"), (5.0, 1100.0, "refuted")]
)
def test_latitude_rate(rate, speed, expected):
    facts = MotionFacts(3600.0, 1e6, rate, speed, 1.0, 0.0, 50.0)
    assert verdict("latitude-rate", row(), facts=facts).verdict == expected


def test_failed_cases_decide_nothing():
    assert verdict("orthogonality", row("two-quaternions", status="failed")).verdict == "undecided"


@pytest.mark.parametrize(("power", "expected"), [(4.0, "confirmed"), (2.5, "confirmed"), (1.5, "refuted")])
def test_gyro_free(power, expected):
    t = np.linspace(0.0, 60.0, 4001)
    error = 37.0 * (t / 60.0) ** power
    grown = {"final_horizontal_error_m": error[-1], "rms_horizontal_error_m": float(np.sqrt(np.mean(error**2)))}
    case = {"variant": "six-accelerometers-1m", "sensors": "bad", "duration_s": 60.0, **grown}
    found = verdict("gyro-free", row(**case, max_attitude_error_arcsec=3600.0))
    assert found.verdict == expected
    assert found.numbers["flight, bad, arms of 1m, power of time"] == pytest.approx(power, abs=0.01)
    # a block that has turned over says nothing of the power
    assert verdict("gyro-free", row(**case, max_attitude_error_arcsec=36000.0)).verdict == "undecided"


@pytest.mark.parametrize(("factor", "expected"), [(1.0, "confirmed"), (1.04, "refuted")])
def test_coning_drift(factor, expected):
    alpha, omega, seconds = math.radians(0.1), 2.0 * math.pi * 50.0, 2.0
    facts = MotionFacts(seconds, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, cone=(alpha, omega))
    rows = []
    for name, samples in {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}.items():
        for rate in (1000.0, 3000.0):
            exact = abs(drift(samples, alpha, omega, 1.0 / rate, previous=name == "1p"))
            error = factor * exact * seconds / ARCSEC
            rows.append(row(f"rotation-vector-{name}", rate, duration_s=seconds, final_attitude_error_arcsec=error))
    found = verdict("coning-drift", *rows, facts=facts)
    assert found.verdict == expected
    assert found.numbers["flight, 1, Ωh = 0.314: measured/exact"] == pytest.approx(factor)
    # four samples at 3 kHz drift by 1e-8″ in two seconds: nothing is said of that
    assert not any(key.startswith("flight, 4, Ωh = 0.105") for key in found.numbers)
    assert verdict("coning-drift", *rows[:-2], facts=facts).verdict == "undecided"  # four samples are lacking


def heading(form: str, jumps: int, arcsec: float, turns: float = 3.0) -> Heading:
    empty = np.empty(0)
    return Heading("p", "flight", form, 100.0, turns, arcsec, arcsec, jumps, 0.0, 0.0, empty, empty, empty)


def of_headings(*found: Heading) -> Verdict:
    part = {
        "title": "p", "decides": ("euler-heading",), "rates_hz": (100.0,),
        "motions": ({"name": "flight", "parked": {"latitude_deg": 0.0, "duration_s": 1.0}},),
    }  # fmt: skip
    (decided,) = decide(StudyResult(Study.model_validate({"name": "s", "parts": (part,)}), headings=list(found)))
    return decided


@pytest.mark.parametrize(
    ("jumps", "arcsec", "expected"), [(0, 1.0, "confirmed"), (0, 60.0, "refuted"), (1, 1.0, "refuted")]
)
def test_euler_heading(jumps, arcsec, expected):
    """The integrated heading decides; every form has a verdict of its own."""
    found = of_headings(heading("integrated", jumps, arcsec), heading("arctangent of one argument", 6, 3.9e6))
    assert found.verdict == expected
    assert found.judged == (expected, "refuted")
    assert found.numbers["flight, arctangent of one argument: jumps"] == 6.0


def test_less_than_a_turn_decides_nothing():
    assert of_headings(heading("integrated", 0, 1.0, turns=0.9)).verdict == "undecided"


def test_each_motion_has_its_own_verdict():
    rows = [
        row("rotation-vector-2", 10.0, motion="calm", max_attitude_error_arcsec=1.0),
        row("quaternion-1", 10.0, motion="calm", max_attitude_error_arcsec=1.0),
        row("rotation-vector-2", 50.0, motion="wild", max_attitude_error_arcsec=1.0),
        row("quaternion-1", 100.0, motion="wild", max_attitude_error_arcsec=488.0),
    ]
    found = verdict("attitude-rate", *rows)
    assert found.verdict == "confirmed"
    assert found.judged == ("refuted", "confirmed")
    assert found.numbers["wild: low order at 100 Hz, arcsec"] == 488.0


@pytest.mark.parametrize("claim", CLAIMS)
def test_every_point_may_have_a_verdict(claim):
    found = verdict(claim)
    assert len(found.lines) == len(found.points)
