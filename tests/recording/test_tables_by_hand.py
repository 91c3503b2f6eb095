"""The tables on the console, from results whose every number is written by hand: whole lines, heads and units."""

from __future__ import annotations

from math import log, pi, sqrt
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.cli.commands.analyses import show_findings
from sinssim.exhibits import Column, Table
from sinssim.experiments.run import one_component_exhibits as one_component
from sinssim.recording.console import show_items
from sinssim.sensors import error_propagation as expectation
from sinssim.sensors.error_propagation import Contribution, Expectation, Term
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import LENGTH_SCALE
from tests.recording.by_hand import printed

DEG, DEG_H, UG = pi / 180.0, pi / 648_000.0, 9.80665e-6


def shown(of: Expectation) -> list[str]:
    return printed(lambda console: show_items(expectation.expectation_exhibits(of), console))


def test_the_expectation_of_a_grade() -> None:
    """Contributions of 3000 m and 4000 m add up to 5000 m: 2.7 nmi in two hours; its class is 0.8326 of it."""
    terms = (Term("gyro_walk", 12_345.6, "deg/√h", 3.59, "1/√s", "noise"),
             Term("x", 0.0123456, "ppm", 1.23456e-8, "1", "scale"))  # fmt: skip
    contributions = (Contribution("walk", "turning 90°", 4000.0), Contribution("bias", "at rest", 3000.0))
    section = Imu(grade="ideal")
    lines = shown(Expectation(section, 45.5 * DEG, 7200.0, terms, contributions))
    assert lines[2:] == [
        "Value (1σ)",
        "term value SI is",
        "gyro_walk 12346 deg/√h 3.59 /√s noise",
        "x 0.01235 ppm 1.235e-08 scale",
        "Horizontal position error that each alone causes in 2 h, latitude 45.5°",
        "m (1σ) nmi from vehicle",
        "4,000 2.16 walk turning 90°",
        "3,000 1.62 bias at rest",
        "5,000 2.70 total",
        "Vehicle: turning 90°, at 3°/s at the start, then at rest; at rest, level, heading north.",
        "All together: root of the sum of squares.",
        f"Half of all runs end within {sqrt(log(2.0)) * 5000.0 / 1852.0 / 2.0:.2f} nmi per hour, which is called the "
        "class of a unit.",
    ]
    found = expectation.expectation_numbers(Expectation(section, 45.5 * DEG, 7200.0, terms, contributions))
    assert found["circular_error_probable_nmi"] == pytest.approx(sqrt(log(2.0)) * 5000.0 / 1852.0, rel=1e-4)
    assert found["root_sum_square_m"] == pytest.approx(5000.0)
    assert found["root_sum_square_nmi"] == pytest.approx(5000.0 / 1852.0)
    assert (found["latitude_deg"], found["duration_s"]) == (pytest.approx(45.5), 7200.0)
    assert found["contributions"][1] == {"term": "bias", "assumes": "at rest", "position_m": 3000.0}
    assert found["terms"][0] == {"name": "gyro_walk", "value": 12_345.6, "unit": "deg/√h", "si": 3.59,
                                 "si_unit": "1/√s", "meaning": "noise"}  # fmt: skip
    assert found["linear"]
    lost = Expectation(section, 0.5, 3600.0, terms, (Contribution("bias", "at rest", 6e5),))
    found = shown(lost)
    assert "> 500,000 > 270 bias at rest" in found
    assert "> 500,000 > 270 total" in found
    assert not expectation.expectation_numbers(lost)["linear"]
    assert found[-1] == "The linear theory is not valid beyond 500 km: the position is lost."
    bias = Expectation(section, 45.0 * DEG, 600.0, (Term("accel_bias", 50.0, "µg", 50.0 * UG, "m/s²", "bias"),), ())
    # b (cosh(√2 ω t) − 1)/(2 ω²) with ω t = 0.745: 0.5 b t² (1 + (ω t)²/6 + …)
    w2 = 9.806 / 6.378e6 * 600.0**2
    height = 0.5 * 50.0 * UG * 600.0**2 * (1.0 + w2 / 6.0 + w2**2 / 90.0)
    last = shown(bias)[-1]
    assert last.startswith("Height is not included: unaided, its error grows to ")
    assert last.endswith(" m in 0.166667 h for the bias of the down accelerometer alone.")
    assert float(last.split(" grows to ")[1].split(" m in ")[0]) == pytest.approx(height, rel=2e-3)
    assert shown(Expectation(section, 0.5, 60.0, (), ()))[-1] == "The sensors have no errors."


def test_the_findings_of_an_inspection() -> None:
    def finding(subject: str, grade: str, text: str, fix: str = "") -> SimpleNamespace:
        return SimpleNamespace(subject=subject, grade=grade, text=text, fix=fix)

    findings = [finding("logs/imu.csv", "fact", "It has 5 rows."), finding("logs/imu.csv", "doubt", "Late.", "Cut it."),
                finding("clock", "wrong", "It runs back.")]  # fmt: skip
    assert printed(lambda console: show_findings(SimpleNamespace(findings=findings), console)) == [
        "imu.csv It has 5 rows.", "doubt Late. Cut it.", "clock WRONG It runs back.",
        "1 error, 1 doubt. Results from data with errors are worthless.",
    ]  # fmt: skip
    assert printed(lambda console: show_findings(SimpleNamespace(findings=findings[:1] * 2), console))[-1] == (
        "0 errors, 0 doubts."
    )
    more = SimpleNamespace(findings=[findings[1], *findings])
    assert printed(lambda console: show_findings(more, console))[-1].startswith("1 error, 2 doubts. ")


def test_a_run_of_one_component() -> None:
    errors = {"final_position_error_m": -3.5, "rms_position_error_m": 2.25, "max_position_error_m": 4.75,
              "max_velocity_error_mps": 0.125, "max_pitch_error_arcsec": 90.0}  # fmt: skip
    other = {key: 2.0 * value for key, value in errors.items()} | {"max_pitch_error_arcsec": None}
    found = {
        "variant": "one-integral", "schuler_period_s": 5064.0, "errors": {"simulation": errors, "equation_8_11": other},
        "differences": {"equation_8_11": {"max_m": 0.0625, "relative": 0.0132}},
    }  # fmt: skip
    summary = {"one_component": found, "timing": {"truth_s": 0.125, "navigation_s": 2.5, "recording_s": 0.0}}
    scenario = SimpleNamespace(name="plane", description="It moves.")
    plane: Any = (scenario, summary)
    assert printed(lambda console: show_items(one_component.plane_brief(*plane), console)) == [
        "It moves.",
        "plane: errors against the truth",
        "position velocity pitch difference",
        "final, m rms, m max, m max, m/s max, arcmin max, m relative",
        "simulation −3.5 2.25 4.75 0.125 1.5",
        "equation (8.11) −7 4.5 9.5 0.25 – 0.0625 1.3e-02",
        "Variant “one-integral”: pitch by one integral of a gyro's rate. Schuler period 84.40 min.",
        "Difference: from the simulated error minus that with perfect sensors; relative: its ratio to the largest "
        "value of that error.",
        "Time: truth 0.12 s, navigation 2.50 s",
    ]


@pytest.mark.parametrize(
    ("lengths", "unit", "texts"),
    [
        ((117_845.2, 0.009395, 6.2e-11), "m", ["117,845", "0.009395", "6.2e-11"]),
        ((117_845.2, 2.5, 6.2e-11), "km", ["117.8", "0.0025", "6.2e-14"]),
        ((3.0, 0.009395, 2e-6), "m", ["3", "0.009395", "0.000002000"]),
    ],
)
def test_a_large_unit_hides_no_small_number(lengths: tuple[float, ...], unit: str, texts: list[str]) -> None:
    """Kilometres of an inertial solution hide the centimetres of the aided one; rounding errors do not count."""
    table = Table((Column("max", LENGTH_SCALE),), [[length] for length in lengths])
    _, heads, rows = table.shown("console")
    assert heads == [("max", unit)]
    assert [text for (text,) in rows] == texts
