"""Whole verdicts on made-up numbers: every figure, its unit, and the sentence that has it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.experiments.studies.attitude_claims import euler_heading, euler_limit, orthogonality
from sinssim.experiments.studies.claims import SENSORS_UG, attitude_rate, velocity_rate
from sinssim.experiments.studies.position_claims import (
    EARLY,
    SCHULER_PERIOD,
    _outcome,
    accelerometer_term,
    computer_errors,
    fitted_power,
    gravity_series,
    gyro_free,
    gyro_term,
    latitude_rate,
    linear_part,
    simplified_radii,
)
from sinssim.experiments.studies.study_results import (
    ALLOWED_ARCSEC_H,
    ErrorGrowth,
    Evidence,
    Heading,
    Point,
    Row,
    drift_at,
    needed,
    overall,
)
from sinssim.experiments.studies.study_schema import MotionFacts
from tests.experiments.studies.test_decide import row


def texts(found: tuple[Point, ...]) -> list[tuple[str, str]]:
    return [(point.text, point.verdict) for point in found]


def test_the_rate_of_velocity_on_two_motions() -> None:
    """Biases of 50 µg on two axes are 70.7 µg; a tenth of them is 7.07 µg."""
    assert pytest.approx(math.sqrt(2.0) * 50.0) == SENSORS_UG

    def slow(motion: str, rate: float, drift: float, metres: float) -> Row:
        return row(
            rate=200.0, motion=motion, schedule_hz=(200.0, rate, rate), velocity_drift_ug=drift,
            velocity_drift_uncertainty_ug=0.1 * drift, max_horizontal_error_m=metres, operations_per_step=500.0 + rate,
        )  # fmt: skip

    rows = [slow("calm", 10.0, 4.0, 30.0), slow("calm", 20.0, 0.5, 20.0), slow("wild", 20.0, 2.5, 90.0),
            slow("wild", 10.0, 21.0, 70.0)]  # fmt: skip
    found = velocity_rate(Evidence(rows))
    assert (found.verdict, found.measured, found.expected) == ("confirmed", "2.5 µg at 20 Hz (wild)", "below 7.07 µg")
    assert texts(found.points) == [
        ("calm: 20 Hz 0.50 ± 0.05 µg, 10 Hz 4.0 ± 0.4 µg", "confirmed"),
        ("wild: 20 Hz 2.5 ± 0.2 µg, 10 Hz 21 ± 2 µg", "confirmed"),
        ("operations per fast step: 200/10/10 510, 200/20/20 520", ""),
    ]
    assert found.numbers == pytest.approx({
        "calm: 10 Hz, µg": 4.0, "calm: 10 Hz, m": 30.0, "calm: 20 Hz, µg": 0.5, "calm: 20 Hz, m": 20.0,
        "wild: 20 Hz, µg": 2.5, "wild: 20 Hz, m": 90.0, "wild: 10 Hz, µg": 21.0, "wild: 10 Hz, m": 70.0,
        "200/10/10: operations per step": 510.0, "200/20/20: operations per step": 520.0,
        "10 Hz, part of the sensors' error": 21.0 / math.sqrt(5000.0),
        "20 Hz, part of the sensors' error": 2.5 / math.sqrt(5000.0),
    })  # fmt: skip
    assert "A rate is sufficient below 7.07 µg, 10 % of the biases" in found.reason
    assert found.reason.endswith(
        "At 20 Hz it is 3.5 % of them on wild; lower rates are not sufficient everywhere: 10 Hz costs 30 % on wild:"
    )


def test_the_rate_of_attitude_on_two_motions() -> None:
    """Each motion by the lowest rate from which on all higher ones are good; the one that needs most is named."""
    rows = [
        row("quaternion-norm", 40.0, motion="calm", attitude_drift_arcsec_h=5.0,
            attitude_drift_uncertainty_arcsec_h=0.4),
        row("quaternion-norm", 20.0, motion="calm", attitude_drift_arcsec_h=18.5),
        row("rotation-vector-2", 40.0, motion="calm", attitude_drift_arcsec_h=19.0),
        row("rotation-vector-2", 60.0, motion="calm", attitude_drift_arcsec_h=2.0,
            attitude_drift_uncertainty_arcsec_h=0.3),
        row("poisson-2", 100.0, motion="calm", attitude_drift_arcsec_h=1.0),
        row("quaternion-4", 50.0, motion="calm", attitude_drift_arcsec_h=3.0),
        row("rotation-vector-3", 70.0, motion="wild", attitude_drift_arcsec_h=17.9,
            attitude_drift_uncertainty_arcsec_h=2.0),
        row("poisson-1", 70.0, motion="wild", attitude_drift_arcsec_h=900.0),
        row("quaternion-2-norm", 100.0, motion="wild", attitude_drift_arcsec_h=250.0),
        row("quaternion-2-norm", 200.0, motion="wild", attitude_drift_arcsec_h=70.0),
    ]  # fmt: skip
    facts = {"calm": MotionFacts(60.0, 0.0, 0.0, 0.0, 7.4, 0.0, 0.0), "wild": MotionFacts(60.0, 0, 0, 0, 203.6, 0, 0)}
    found = attitude_rate(Evidence(rows, facts))
    assert texts(found.points) == [
        ("calm (up to 7 deg/s): high order from 40 Hz (quaternion-norm, uses later samples, 5.0 ± 0.4 ″/h), without "
         "later samples from 60 Hz (rotation-vector-2, 2.0 ± 0.3 ″/h), first and second order from 100 Hz, high order "
         "without coning compensation from 50 Hz", "partly"),
        ("wild (up to 204 deg/s): high order from 70 Hz (rotation-vector-3, 18 ± 2 ″/h), first and second order at no "
         "rate (at best 250 ″/h at 100 Hz, 70.0 ″/h at 200 Hz)", "confirmed"),
    ]  # fmt: skip
    assert found.numbers == {
        "calm: high order, Hz": 40.0, "calm: high order, arcsec/h": 5.0,
        "calm: high order without later samples, Hz": 60.0, "calm: low order, Hz": 100.0,
        "calm: high order without coning compensation, Hz": 50.0,
        "wild: high order, Hz": 70.0, "wild: high order, arcsec/h": 17.9,
        "wild: high order without later samples, Hz": 70.0,
        "wild: low order at 100 Hz, arcsec/h": 250.0, "wild: low order at 200 Hz, arcsec/h": 70.0,
    }  # fmt: skip
    assert (found.verdict, found.measured) == ("partly", "high order from 70 Hz (wild)")
    assert found.expected == "50–80 Hz (0.3′ in an hour)"
    assert found.reason.endswith("70 Hz with a high order is enough on every motion, and necessary on wild:")


def test_a_rate_at_the_limit_is_enough() -> None:
    assert ALLOWED_ARCSEC_H == 18.0  # 0.3′ in an hour
    rows = [row("q", rate, attitude_drift_arcsec_h=drift) for rate, drift in ((50.0, 18.0), (80.0, 3.0), (20.0, 18.1))]
    assert needed(rows)["q"].rate_hz == 50.0
    assert not needed([row("q", 50.0, attitude_drift_arcsec_h=math.nan)])
    drifts = (
        ("poisson-1", 20.0, 9.0),
        ("poisson-1-ortho", 20.0, 7.0),
        ("poisson-1", 50.0, 1.0),
        ("poisson", 20.0, 0.1),
    )
    pair = [row(name, rate, attitude_drift_arcsec_h=drift) for name, rate, drift in drifts]
    assert drift_at(pair, ("poisson-1",), 20.0) == 7.0
    assert math.isnan(drift_at(pair, ("poisson-1",), 30.0))
    assert [overall([Point("", v) for v in words]) for words in (("a", "a", ""), ("a", "b"), ("",))] == [
        "a", "partly", "partly",
    ]  # fmt: skip


def test_the_norm_that_two_quaternions_lose() -> None:
    rows = [
        row("two-quaternions", 50.0, max_defect=3e-7), row("two-quaternions", 200.0, max_defect=2e-10),
        row("two-quaternions", 80.0, motion="b", max_defect=4e-10), row("poisson-2", 50.0, max_defect=7e-4),
        row("poisson-2", 200.0, max_defect=9e-4),
    ]  # fmt: skip
    found = orthogonality(Evidence(rows))
    assert texts(found.points) == [
        ("flight: norm in error by 3e-07 at 50 Hz to 2e-10 at 200 Hz", "partly"),
        ("b: norm in error by 4e-10 at 80 Hz", "confirmed"),
    ]
    assert found.numbers == pytest.approx({
        "greatest defect": 3e-7, "least defect": 2e-10, "direction cosines of second order": 7e-4,
        "scale error of the forces, ppm": 0.6,
    })  # fmt: skip
    assert (found.verdict, found.measured, found.expected) == (
        "partly", "norm in error by up to 3e-07", "at most 1e-09",
    )  # fmt: skip
    assert (
        "is in error by 3e-07 on flight at 50 Hz, where Poisson's equation of second order loses 0.0007" in found.reason
    )
    assert "At worst the resolved forces are 0.6 ppm too large: normalise." in found.reason


def test_passages_through_the_vertical() -> None:
    rows = [
        row("euler", 50.0, passages=2, max_damage_arcsec=90.0), row("euler", 200.0, passages=2, max_damage_arcsec=17.0),
        row("euler", 20.0, max_damage_arcsec=0.0), row("quaternion", 50.0, max_attitude_error_arcsec=0.031),
        row("quaternion", 200.0, max_attitude_error_arcsec=0.5),
    ]  # fmt: skip
    found = euler_limit(Evidence(rows))
    assert texts(found.points) == [("flight at 50 Hz: 90.0″", "refuted"), ("flight at 200 Hz: 17.0″", "confirmed")]
    assert found.numbers == {"greatest damage, arcsec": 90.0, "least damage, arcsec": 17.0, "quaternion, arcsec": 0.031}
    assert found.reason.startswith(
        "Passing it on flight causes an attitude error of 1.5′ at 50 Hz, 0.283′ at 200 Hz; the error of the quaternion "
        "is at most 0.031″ on the whole motion."
    )
    assert (found.verdict, found.measured) == ("refuted", "90.0″ by a passage at 50 Hz")
    assert found.expected == "at most 18″ (0.3′)"


def test_headings_through_turns() -> None:
    def heading(form: str, rate: float, arcsec: float, wrong: float, least: float = 0.0, **more: float) -> Heading:
        none = np.empty(0)
        turns, jumps = more.get("turns", -4.2), int(more.get("jumps", 0))
        return Heading("p", "flight", form, rate, turns, arcsec, 0.0, jumps, wrong, least, none, none, none)

    found = euler_heading(Evidence([], headings=[
        heading("integrated", 100.0, 7.0, 0.0), heading("integrated", 50.0, 700.0, 0.3, turns=5.0, jumps=2),
        heading("arctangent of one argument", 100.0, 648_000.0, 0.482, jumps=9),
        heading("arctangent of two, unwrapped", 100.0, 17.9, 0.0, 3.25),
    ]))  # fmt: skip
    assert texts(found.points) == [
        ("flight, integrated at 100 Hz: off by at most 7.0″, no jumps", "confirmed"),
        ("flight, arctangent of one argument at 100 Hz: off by up to 180°, wrong for 48 % of the time, 9 jumps",
         "refuted"),
        ("flight, arctangent of two, unwrapped at 100 Hz: off by at most 18″, no jumps, read at least at 3.2 Hz",
         "confirmed"),
    ]  # fmt: skip
    assert found.numbers["flight, arctangent of one argument: jumps"] == 9.0
    assert found.numbers["flight, arctangent of one argument: largest error, arcsec"] == 648_000.0
    assert found.numbers["flight, arctangent of one argument: wrong, part of the time"] == 0.482
    assert found.reason.startswith("Through up to 5.0 turns of heading")
    assert (found.verdict, found.measured) == ("confirmed", "7.0″ in 5 turns")


def growth(metres: dict[float, float], tilt: float = 1.0) -> ErrorGrowth:
    """Return errors in metres at times from 100 s on."""
    return ErrorGrowth(np.array(list(metres)) + 100.0, np.array(list(metres.values())), np.full(len(metres), tilt))


def test_simplified_radii_in_the_first_schuler_period() -> None:
    """What comes later does not count: 2π √(6371 km/9.81 m/s²) = 5063.5 s."""
    assert pytest.approx(5063.5, abs=0.1) == SCHULER_PERIOD
    rows = [row(curvature="spherical"), row(curvature="no-height"), row(sensors="gyro-0_01-deg-h"),
            row(curvature="spherical", sensors="gyro-0_01-deg-h")]  # fmt: skip
    courses = {
        rows[0]: {0.0: 0.0, 3000.0: 800.0, 5000.0: 600.0, 5100.0: 2000.0},
        rows[1]: {0.0: 0.0, 5063.0: 64.0, 5100.0: 90.0},
        rows[2]: {0.0: 0.0, 5050.0: 1600.0, 5200.0: 5000.0},
    }
    found = simplified_radii(Evidence(rows, growth=lambda one: growth(courses[one])))
    assert texts(found.points) == [
        ("flight, spherical: 800 m, as much as 0.0050 deg/h", "confirmed"),
        ("flight, no-height: 64.0 m, as much as 0.00040 deg/h", "refuted"),
    ]
    assert found.numbers == pytest.approx({
        "flight: gyros of 0.01 deg/h, m": 1600.0, "flight: spherical, m": 800.0, "flight: no-height, m": 64.0,
        "flight: spherical, equivalent gyro bias, deg/h": 0.005,
        "flight: no-height, equivalent gyro bias, deg/h": 0.0004,
        "spherical: largest equivalent gyro bias, deg/h": 0.005,
        "no-height: largest equivalent gyro bias, deg/h": 0.0004,
    })  # fmt: skip
    assert found.verdict == "partly"
    short = simplified_radii(Evidence(rows, growth=lambda one: growth({0.0: 0.0, 5000.0: 9.0})))
    assert short.verdict == "undecided"
    assert "motions of at least one Schuler period, 5063 s" in short.reason


def test_latitude_on_the_way_north() -> None:
    """The motion that goes most to the north decides: 4.95 deg/h at 550 km/h, not 6 deg/h at 900 km/h."""
    facts = {
        "north": MotionFacts(60.0, 0.0, 4.95, 550.0, 1.0, 0.0, 50.0),
        "east": MotionFacts(60.0, 0, 6.0, 900.0, 1, 0, 5),
    }
    found = latitude_rate(Evidence([], facts))
    assert found.numbers == {"latitude rate, deg/h": pytest.approx(9.9)}
    assert found.reason.startswith(
        "On the motion “north” latitude changes by 4.950 deg/h at 550.0 km/h; at 1100 km/h that is 9.90 deg/h. V/R of "
        "the mean Earth is 9.89 deg/h;"
    )
    assert (found.verdict, found.measured, found.expected) == ("confirmed", "9.90 deg/h", "10 ± 0.5 deg/h")


def test_the_errors_of_a_computer() -> None:
    """R Δω (t − sin ωt/ω) of 0.01 deg/h after 2 h, 7200 s: ω = 1.2409e-3 rad/s."""
    omega, drift = math.sqrt(9.81 / 6.371e6), math.radians(0.01) / 3600.0
    closed = 6.371e6 * drift * (7200.0 - math.sin(omega * 7200.0) / omega)
    rows = [row(motion="still", max_horizontal_error_m=2.0),
            row(motion="still", sensors="east-gyro-0_01-deg-h", max_horizontal_error_m=2050.0, duration_s=7200.0),
            row(motion="flown", max_horizontal_error_m=3.0),
            row(motion="flown", sensors="east-gyro-0_01-deg-h", max_horizontal_error_m=250.0)]  # fmt: skip
    facts = {
        "still": MotionFacts(7200.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0),
        "flown": MotionFacts(600.0, 5e4, 0, 0, 0, 0, 0),
    }
    found = computer_errors(Evidence(rows, facts))
    assert texts(found.points) == [
        (f"still: computer 2.0 m, gyro 2050 m, by (8.15) {closed:.0f} m", "confirmed"),
        ("flown: computer 3.0 m, gyro 250.0 m", "refuted"),
    ]
    assert found.numbers == pytest.approx({
        "still: computer, m": 2.0, "still: sensors, m": 2050.0, "still: (8.15), m": closed, "flown: computer, m": 3.0,
        "flown: sensors, m": 250.0,
    })  # fmt: skip
    assert (found.verdict, found.measured, found.expected) == ("partly", "1.2 % of a gyro's", "at most 1 %")


def test_six_accelerometers() -> None:
    """t³ below 1000 s and t² beyond a Schuler period; the closed form has 3.9 to 4.0 and about 2."""
    time = np.concatenate([[0.0], np.geomspace(1.0, 20_000.0, 3000)])
    error = 5.0 * np.where(time < 2000.0, (time / 2000.0) ** 3, (time / 2000.0) ** 2)
    course = ErrorGrowth(time, error, np.full(len(time), 3600.0))
    one = row(variant="six-accelerometers-0.1m", sensors="bad", duration_s=20_000.0, final_horizontal_error_m=500.0,
              max_attitude_error_arcsec=7200.0)  # fmt: skip
    found = gyro_free(Evidence([one], growth=lambda row: course))
    name = "flight, bad, arms of 0.1m"
    early, late, end = texts(found.points)
    assert early[0].startswith(f"{name}: power 3.00 below 1000 s (closed form 3.9")
    assert late[0].startswith(f"{name}: power 2.00 beyond a Schuler period (closed form ")
    assert (early[1], late[1]) == ("refuted", "confirmed")
    assert end == (f"{name}: 500 m after 20000 s, tilted by up to 2.00°", "")
    assert found.numbers[f"{name}, m"] == 500.0
    assert (found.verdict, found.measured) == ("partly", "t^3.00, then t^2.00")


def test_the_part_of_a_growth_that_is_linear() -> None:
    """From t² = 100 · 12 ℓ/g on, 36.7 s and more for 11 m, up to the tilt of 5°."""
    time = np.arange(0.0, 400.0, 1.0)
    course = ErrorGrowth(time + 7.0, 1e-3 * time**2, np.where(time < 300.0, 5.0 * 3600.0, 5.1 * 3600.0))
    found, error = linear_part(course, 11.0)
    assert (found[0], found[-1]) == (math.ceil(math.sqrt(1200.0 * 11.0 / 9.81)), 299.0)
    assert error[0] == pytest.approx(1e-3 * found[0] ** 2)
    assert EARLY == 1000.0
    power, closed = fitted_power(np.arange(10.0, 400.0), 3.0 * np.arange(10.0, 400.0) ** 2.5, 50.0, 200.0)
    assert power == pytest.approx(2.5, abs=2e-3)
    assert closed == pytest.approx(4.0, abs=0.01)
    assert math.isnan(
        fitted_power(np.arange(10.0, 400.0), np.ones(390), 300.0, 440.0)[0]
    )  # less than half as much again


def test_terms_of_one_component_in_their_units() -> None:
    """2 · 10 µg/g = 0.0687′ and 0.1 deg/h = 6′/h."""
    by_accelerometer, by_gyro = accelerometer_term(1), gyro_term(1)
    assert list(by_accelerometer.numbers)[:2] == ["1 µg, measured", "1 µg, 2Δa/g"]
    assert by_accelerometer.numbers["10 µg, 2Δa/g"] == pytest.approx(
        math.degrees(2e-5 * 9.80665 / 9.81) * 60.0, rel=1e-9
    )
    assert by_accelerometer.expected == "2Δa/g = 0.6873′"
    assert by_accelerometer.measured == "0.6873′ for 100 µg"
    assert by_gyro.numbers["0.001 deg/h, Δω₀"] == pytest.approx(0.06, rel=1e-12)
    assert (by_gyro.measured, by_gyro.expected) == ("6.000′/h for 0.1 deg/h", "Δω₀ = 6.000′/h")


def test_series_of_gravity_in_numbers() -> None:
    """Omitted terms at 12 km: x = 1.8814e-3, 4x³ = 2.66e-8 and 3x² = 1.06e-5; β = 5ω²a/2g − e²/2 of WGS 84."""
    found = gravity_series(12e3)
    x = 12e3 / 6378137.0
    assert found.numbers["order-1e-5, largest omitted term"] == pytest.approx(4.0 * x**3, rel=1e-12)
    assert found.numbers["order-1e-4, largest omitted term"] == pytest.approx(3.0 * x**2, rel=1e-12)
    assert found.numbers["order-1e-2, largest omitted term"] == pytest.approx(
        2.5 * 7.292115e-5**2 * 6378137.0 / 9.7803253359 - 0.5 * 0.00669437999, rel=1e-6
    )
    assert found.points[0].text.endswith("of gravity; omitted term 2.7e-08")
    assert found.points[1].text.endswith("of gravity; omitted term 1.1e-05")
    assert "heights up to 12 km" in found.reason
    assert found.expected == "at most 1e-5, 1e-4, 1e-2 of g"


def test_a_term_and_what_is_measured_of_it() -> None:
    """Within a thousandth it is confirmed; the last one is shown."""
    figures = {1.0: (2.001, 2.0), 10.0: (20.03, 20.0)}
    found = _outcome({"small": 1.0, "large": 10.0}, figures.__getitem__, "′", "2Δa/g", "A reason:")
    assert texts(found.points) == [("small: 2.0010′, 2.0000′", "confirmed"), ("large: 20.030′, 20.000′", "refuted")]
    assert found.numbers == {"small, measured": 2.001, "small, 2Δa/g": 2.0, "large, measured": 20.03,
                             "large, 2Δa/g": 20.0}  # fmt: skip
    assert (found.verdict, found.reason) == ("partly", "A reason:")
    assert (found.measured, found.expected) == ("20.03′ for large", "2Δa/g = 20.00′")
