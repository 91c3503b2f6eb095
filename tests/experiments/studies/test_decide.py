"""Verdicts on numbers made for the purpose: each claim can be confirmed and refuted, and is undecided without data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.experiments.studies.claims import decide
from sinssim.experiments.studies.study_exhibits import StudyMedia
from sinssim.experiments.studies.study_results import ErrorGrowth, Heading, Row, StudyResult, Verdict
from sinssim.experiments.studies.study_schema import CLAIM_WORDS, CLAIMS, COMPUTED, MotionFacts, Study
from sinssim.strapdown.attitude.rotation_vector import drift_under_coning
from sinssim.units import ARCSEC

FACTS = MotionFacts(3600.0, 1.1e6, 9.9, 1100.0, 1.0, 5.0, 50.0)


def row(algorithm: str = "quaternion", rate: float = 100.0, **more) -> Row:
    case = {
        "part": "p", "motion": "flight", "variant": "rate-gyros", "sensors": "ideal", "algorithm": algorithm,
        "frame": "level", "gravity": "normal", "curvature": "exact", "rate_hz": rate, "schedule_hz": (), "slow": "",
    }  # fmt: skip
    return Row(**{**case, **more})


NAVIGATED = [claim for claim in CLAIMS if claim not in COMPUTED]


def verdict(claim: str, *rows: Row, facts: MotionFacts = FACTS, growth: ErrorGrowth | None = None) -> Verdict:
    part = {
        "title": "p", "decides": (claim,), "rates_hz": (100.0,),
        "motions": ({"name": "flight", "parked": {"latitude_deg": 0.0, "duration_s": 1.0}},),
    }  # fmt: skip
    study = Study.model_validate({"name": "s", "parts": (part,)})
    comparison = StudyResult(
        study, rows=list(rows), motions={(r.part, r.motion): facts for r in rows}, media=StudyMedia()
    )
    comparison.histories = {
        r.case: growth or ErrorGrowth(*(np.array([0.0, x]) for x in (5063.0, r.max_horizontal_error_m, 1.0)))
        for r in rows
    }
    (decided,) = decide(comparison)
    assert decided.claim == claim
    return decided


@pytest.mark.parametrize("claim", NAVIGATED)
def test_undecided_without_numbers(claim):
    assert verdict(claim).verdict == "undecided"


@pytest.mark.parametrize(
    ("at_10", "at_20", "expected"), [(1.0, 0.5, "confirmed"), (30.0, 7.06, "confirmed"), (30.0, 7.08, "refuted")]
)
def test_velocity_rate(at_10, at_20, expected):
    """The limit is a tenth of two biases of 50 µg, 7.071 µg."""

    def slow(rate, drift):
        case = {"rate": 200.0, "schedule_hz": (200.0, rate, rate), "operations_per_step": 600.0 + rate}
        return row(**case, velocity_drift_ug=drift)

    found = verdict("velocity-rate", slow(10.0, at_10), slow(20.0, at_20))
    assert found.verdict == expected
    assert found.numbers["flight: 10 Hz, µg"] == at_10
    assert found.numbers["200/20/20: operations per step"] == 620.0
    assert found.points[-1] == "operations per fast step: 200/10/10 610, 200/20/20 620"
    assert found.expected == "below 7.07 µg"


@pytest.mark.parametrize(
    ("needed_high", "needed_low", "expected"),
    [(50.0, 200.0, "confirmed"), (80.0, 100.0, "confirmed"), (20.0, 100.0, "partly"), (20.0, 20.0, "refuted"),
     (100.0, 200.0, "refuted")],
)  # fmt: skip
def test_attitude_rate(needed_high, needed_low, expected):
    def family(algorithm, needed):
        rates = (10.0, 20.0, 50.0, 80.0, 100.0, 200.0)
        return [row(algorithm, r, attitude_drift_arcsec_h=17.0 if r >= needed else 60.0) for r in rates]

    found = verdict("attitude-rate", *family("rotation-vector-2", needed_high), *family("quaternion-1", needed_low))
    assert found.verdict == expected
    assert found.numbers["flight: high order, Hz"] == needed_high
    assert found.numbers["flight: low order, Hz"] == needed_low
    assert "later samples" not in found.points[0]


def test_later_samples_are_named_where_they_decide():
    rows = [
        row("quaternion", 50.0, attitude_drift_arcsec_h=1.0),
        row("rotation-vector-2", 80.0, attitude_drift_arcsec_h=1.0),
        row("rotation-vector-2", 50.0, attitude_drift_arcsec_h=20.0),
    ]
    found = verdict("attitude-rate", *rows)
    assert "50 Hz (quaternion, uses later samples" in found.points[0]
    assert "without later samples from 80 Hz (rotation-vector-2" in found.points[0]
    assert found.numbers["flight: high order without later samples, Hz"] == 80.0


def test_a_rate_that_happens_to_be_good_below_a_bad_one_is_not_enough():
    errors = {10.0: 5.0, 20.0: 100.0, 50.0: 10.0, 80.0: 1.0}
    rows = [row("rotation-vector-2", rate, attitude_drift_arcsec_h=drift) for rate, drift in errors.items()]
    assert verdict("attitude-rate", *rows).numbers["flight: high order, Hz"] == 50.0


@pytest.mark.parametrize(("operations", "expected"), [(900.0, "confirmed"), (1500.0, "refuted")])
def test_cheapest(operations, expected):
    good = {"attitude_drift_arcsec_h": 1.0, "ns_per_step": 100.0}
    found = verdict(
        "cheapest",
        row("quaternion-3", **good, operations_per_step=operations),
        row("poisson-3", **good, operations_per_step=1000.0),
        row("poisson-1", 50.0, attitude_drift_arcsec_h=99.0, ns_per_step=1.0, operations_per_step=1.0),
        row("rotation-vector-4", **good, operations_per_step=1.0),
    )
    assert found.verdict == expected  # neither the inaccurate one nor the one beyond the chapter decides
    assert found.numbers["flight: quaternions, 1000 operations/s"] == pytest.approx(operations / 10.0)
    assert "attitude alone" not in found.reason


def test_cheapest_attitude_alone():
    """Beside the whole navigation, which decides: the least of each family by the attitude's own operations."""
    good = {"attitude_drift_arcsec_h": 1.0, "ns_per_step": 100.0, "operations_per_step": 1000.0}
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
    # lengths are off by twice the norm's error: 1e-6 is 2 ppm of a force
    ppm = found.numbers.get("scale error of the forces, ppm")
    assert ppm == (None if expected == "confirmed" else pytest.approx(2.0))


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


def grown(early: float, late: float, end: float = 18000.0) -> ErrorGrowth:
    """An error with one power of time up to a Schuler period, and another one beyond, at a small tilt."""
    t = np.geomspace(1.0, end, 4000)
    error = 100.0 * np.where(t < 5063.0, (t / 5063.0) ** early, (t / 5063.0) ** late)
    return ErrorGrowth(np.append(0.0, t), np.append(0.0, error), np.ones(4001))


@pytest.mark.parametrize(
    ("early", "late", "expected"), [(4.0, 2.0, "partly"), (2.0, 2.0, "confirmed"), (4.0, 2.5, "refuted")]
)
def test_gyro_free(early, late, expected):
    """The chapter's power is 2; the theory's is 4 at first."""
    case = {"variant": "six-accelerometers-1m", "sensors": "bad", "max_attitude_error_arcsec": 1.0}
    found = verdict("gyro-free", row(**case), growth=grown(early, late))
    assert found.verdict == expected
    assert found.numbers["flight, bad, arms of 1m, power of time below 1000 s"] == pytest.approx(early, abs=0.01)
    assert found.numbers["flight, bad, arms of 1m, power of time beyond a Schuler period"] == pytest.approx(
        late, abs=0.01
    )
    assert found.measured == f"t^{early:.2f}, then t^{late:.2f}"


def test_gyro_free_needs_more_than_a_schuler_period():
    case = {"variant": "six-accelerometers-1m", "sensors": "bad"}
    assert verdict("gyro-free", row(**case), growth=grown(4.0, 2.0, 6000.0)).verdict == "undecided"
    turned = grown(4.0, 2.0)
    turned.attitude[2000:] = 6.0 * 3600.0
    assert verdict("gyro-free", row(**case), growth=turned).verdict == "undecided"


@pytest.mark.parametrize(("own", "expected"), [(0.9, "confirmed"), (1.1, "refuted")])
def test_computer_errors(own, expected):
    """One percent of a gyro's error; at rest this must be (8.15): R Δω (t − sin ω_s t/ω_s), 2107 m in two hours."""
    gyro = row(sensors="east-gyro-0_01-deg-h", max_horizontal_error_m=100.0, duration_s=7200.0)
    flown = verdict("computer-errors", row(max_horizontal_error_m=own), gyro)
    assert flown.verdict == expected
    still = MotionFacts(7200.0, 0.0, 0.0, 0.0, 0.0, 0.0, 50.0)
    assert verdict("computer-errors", row(max_horizontal_error_m=own), gyro, facts=still).verdict == "refuted"
    right = row(sensors="east-gyro-0_01-deg-h", max_horizontal_error_m=2107.0, duration_s=7200.0)
    assert verdict("computer-errors", row(max_horizontal_error_m=20.0 * own), right, facts=still).verdict == expected


@pytest.mark.parametrize(("factor", "expected"), [(1.0, "confirmed"), (1.04, "refuted")])
def test_coning_drift(factor, expected):
    alpha, omega, seconds = math.radians(0.1), 2.0 * math.pi * 50.0, 2.0
    facts = MotionFacts(seconds, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, cone=(alpha, omega))
    rows = []
    for name, samples in {"1": 1, "1p": 1, "2": 2, "3": 3, "4": 4}.items():
        for rate in (1000.0, 3000.0):
            exact = abs(drift_under_coning(samples, alpha, omega, 1.0 / rate, previous=name == "1p"))
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
    (decided,) = decide(
        StudyResult(Study.model_validate({"name": "s", "parts": (part,)}), headings=list(found), media=StudyMedia())
    )
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
        row("rotation-vector-2", 10.0, motion="calm", attitude_drift_arcsec_h=1.0),
        row("quaternion-1", 10.0, motion="calm", attitude_drift_arcsec_h=1.0),
        row("rotation-vector-2", 50.0, motion="wild", attitude_drift_arcsec_h=1.0),
        row("quaternion-1", 100.0, motion="wild", attitude_drift_arcsec_h=488.0),
    ]
    found = verdict("attitude-rate", *rows)
    assert found.verdict == "partly"
    assert found.judged == ("refuted", "confirmed")
    assert found.numbers["wild: low order at 100 Hz, arcsec/h"] == 488.0


@pytest.mark.parametrize("claim", NAVIGATED)
def test_every_point_may_have_a_verdict(claim):
    found = verdict(claim)
    assert len(found.lines) == len(found.points)


def test_titles_fit_into_a_line():
    assert all(len(words.title) <= 40 for words in CLAIM_WORDS.values())


def test_forms_of_the_arctangent_are_judged_modulo_360():
    """That of two arguments restarts at ±180° and is right; that of one argument is wrong by 180°."""
    found = of_headings(
        heading("integrated", 0, 1.0), heading("arctangent of two arguments", 3, 1e-8),
        heading("arctangent of one argument", 6, 648000.0),
    )  # fmt: skip
    assert found.judged == ("confirmed", "confirmed", "refuted")
