"""The report of a one-component run: sentences, table and plots from errors that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.run import one_component_exhibits as report
from tests.recording.made_one_component import COORDINATE, NUMBERS, TIME, result
from tests.recording.spies import cells, html, plots, read

SIMULATION, CLOSED, FIRST, PENDULUM, ALONG = "#0072b2", "#e69f00", "#cc79a7", "#009e73", "#7864c8"
GREEN, BLUE, ORANGE = "#009e73", "#56b4e9", "#d55e00"
MARKS = [(100.0 + 2.0 * np.pi * np.sqrt(6_371_000.0 / 9.8), "T = 84.4 min", False)]


def test_the_first_sentences() -> None:
    first, second = (sentence.text for sentence in report._in_short(result(), NUMBERS))
    assert first.startswith("One component, variant “one-integral”: ")
    assert first.endswith("20 samples per second for 166.7 min; R = 6371 km, g = 9.8 m/s², Schuler period 83.33 min.")
    assert second == (
        "Position error: −5560 m at the end, 7413 m at most. Relative difference of equation (8.11) from the "
        "simulation: 1.7e-03."
    )
    lost: Any = {**NUMBERS, "errors": {"simulation": {"max_position_error_m": None, "final_position_error_m": None}}}
    assert list(report._in_short(result(), lost))[1].text == "The solution diverged: its errors are not finite."


def test_the_table_of_errors() -> None:
    page = html(report.error_table(NUMBERS))
    assert cells(page) == [
        ["", "position [m]", "velocity [m/s]", "pitch [arcmin]", "difference"],
        ["", "final", "rms", "max", "max", "max", "max, m", "relative"],
        ["simulation", "−5560", "4322", "7413", "0.04", "24", "", ""],
        ["perfect sensors", "1.5", "2.5", "3.5", "0.001", "0.1", "", ""],
        ["equation (8.11)", "5670", "4400", "7500", "0.05", "25", "12.35", "1.7e-03"],
    ]  # fmt: skip
    assert page.index(SIMULATION) < page.index("simulation</td>") < page.index(PENDULUM) < page.index("(8.11)</td>")


def test_errors_beside_the_equations() -> None:
    """arcmin of the coordinate, m/s and arcmin of velocity and pitch; each line thinner than the one below."""
    found = plots(report._errors_over_time(result()))
    coordinate, velocity, pitch = found
    coordinate.shows(
        "Error Δy of the coordinate", "arcmin ≈ nmi", ("closed form at rest", CLOSED, TIME, 2.5 * COORDINATE),
        ("first order (8.12)", FIRST, TIME, 1.5 * COORDINATE), ("equation (8.11)", PENDULUM, TIME, 1.02 * COORDINATE),
        ("simulation", SIMULATION, TIME, COORDINATE),
    )  # fmt: skip
    assert [line.weight for line in coordinate.lines] == ["broad", "wide", "bold", "line"]
    speed = np.array([10.0, 20.0, -40.0, 30.0])
    velocity.shows("Velocity error ΔV", "mm/s", ("equation (8.11)", PENDULUM, TIME, 1.02 * speed),
                   ("simulation", SIMULATION, TIME, speed))  # fmt: skip
    angle = np.array([3.0, 6.0, 12.0, -24.0])
    pitch.shows("Pitch error Δα", "arcmin", ("equation (8.11)", PENDULUM, TIME, 1.02 * angle),
                ("simulation", SIMULATION, TIME, angle))  # fmt: skip
    for one in found:
        assert one.span == (100.0, 10_100.0)
        assert one.marks == MARKS


def test_sources_and_differences() -> None:
    """Of 0.02 and 0.03 times 4 arcmin, the largest differences are 4.8″ and 7.2″."""
    found = plots([*report._by_source(result()), *report._differences(result())])
    bias, tilt, apart = found
    bias.shows(
        "Δy due to the gyro bias alone",
        "arcmin ≈ nmi",
        ("closed form at rest", CLOSED, TIME, 0.75 * COORDINATE),
        ("simulation", SIMULATION, TIME, 0.5 * COORDINATE),
    )
    tilt.shows("Δy due to the tilt <0> alone", "arcmin ≈ nmi", ("closed form at rest", CLOSED, TIME, 3.5 * COORDINATE),
               ("simulation", SIMULATION, TIME, 3.0 * COORDINATE))  # fmt: skip
    apart.shows("Δy: equation minus simulation", "arcsec", ("equation (8.10)", ALONG, TIME, 1.2 * COORDINATE),
                ("equation (8.11)", PENDULUM, TIME, 1.8 * COORDINATE))  # fmt: skip
    assert [one.marks for one in found] == [MARKS] * 3


def test_the_motion() -> None:
    page = html(*report._motion(result(steady=True)))
    assert read(page) == "Steady: V = 200 m/s, H = 900 m, pitch ϑ = 5°; a η = 9.5 m/s²."
    found = plots(report._motion(result()))
    velocity, height, pitch, force = found
    velocity.shows("Velocity V", "m/s", ("velocity", GREEN, TIME, [200.0, 210.0, 230.0, 195.0]))
    height.shows("Height H", "m", ("height", BLUE, TIME, [900.0, 950.0, 920.0, 970.0]))
    pitch.shows("Pitch ϑ of the body", "°", ("pitch", ORANGE, TIME, [5.0, 7.0, 1.0, 6.0]))
    force.shows("Specific force", "m/s²", ("horizontal aξ", ORANGE, TIME, [0.25, 0.5, -0.75, 0.125]),
                ("vertical aη − g", BLUE, TIME, [-0.3, -0.05, 0.7, 0.075]))  # fmt: skip
    assert {one.span for one in found} == {(100.0, 10_100.0)}


def test_marks_begin_a_period_after_the_start() -> None:
    """At most twelve; with R = 6371 km and g = 9.8 m/s² the period is 5066 s."""
    own = result()
    marks = report.schuler_marks(own)
    assert [(mark.at, mark.text) for mark in marks] == [(at, text) for at, text, _ in MARKS]
    own.section.gravity_mps2 = 4000.0
    assert len(report.schuler_marks(own)) == 12
