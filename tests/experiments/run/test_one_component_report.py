"""The report of a one-component run: sentences, table and plots from errors that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.run import one_component_exhibits as report
from tests.recording.made_one_component import COORDINATE, NUMBERS, TIME, result
from tests.recording.spies import Plots, cells, read

SIMULATION, CLOSED, FIRST, PENDULUM, ALONG = "#0072b2", "#e69f00", "#cc79a7", "#009e73", "#7864c8"
GREEN, BLUE, ORANGE = "#009e73", "#56b4e9", "#d55e00"
MARKS = [(5100.0, "T = 83.3 min", False), (10_100.0, "2 T", False)]


def test_the_first_sentences() -> None:
    first, second = report._in_short(result(), NUMBERS)
    assert first.startswith("One component, variant “one-integral”: ")
    assert first.endswith("20 samples per second for 166.7 min; R = 6371 km, g = 9.8 m/s², Schuler period 83.33 min.")
    assert second == (
        "Position error: −5560 m at the end, 7413 m at most. Relative difference of equation (8.11) from the "
        "simulation: 1.7e-03."
    )
    lost: Any = {**NUMBERS, "errors": {"simulation": {"max_position_error_m": None, "final_position_error_m": None}}}
    assert list(report._in_short(result(), lost))[1] == "The solution diverged: its errors are not finite."


def test_the_table_of_errors() -> None:
    html = report._table(NUMBERS)
    assert cells(html) == [
        ["", "position final [m]", "rms [m]", "max [m]", "velocity max [m/s]", "pitch max [arcmin]",
         "difference max [m]", "relative"],
        ["simulation", "−5560", "4322", "7413", "0.04000", "24.00", "", ""],
        ["perfect sensors", "1.500", "2.500", "3.500", "0.001000", "0.1000", "", ""],
        ["equation (8.11)", "5670", "4400", "7500", "0.05000", "25.00", "12.35", "1.7e-03"],
    ]  # fmt: skip
    assert html.index(SIMULATION) < html.index("simulation</td>") < html.index(PENDULUM) < html.index("(8.11)</td>")


def test_errors_beside_the_equations(plots: Plots) -> None:
    """arcmin of the coordinate, m/s and arcmin of velocity and pitch; each line thinner than the one below."""
    list(report._error_plots(result(), NUMBERS))
    coordinate, velocity, pitch = plots
    coordinate.shows(
        "Error Δy of the coordinate", "arcmin ≈ nmi", ("closed form at rest", CLOSED, TIME, 2.5 * COORDINATE),
        ("first order (8.12)", FIRST, TIME, 1.5 * COORDINATE), ("equation (8.11)", PENDULUM, TIME, 1.02 * COORDINATE),
        ("simulation", SIMULATION, TIME, COORDINATE),
    )  # fmt: skip
    assert [line.width for line in coordinate.lines] == [7.0, 4.6, 3.0, 1.4]
    speed = np.array([10.0, 20.0, -40.0, 30.0])
    velocity.shows("Velocity error ΔV", "mm/s", ("equation (8.11)", PENDULUM, TIME, 1.02 * speed),
                   ("simulation", SIMULATION, TIME, speed))  # fmt: skip
    angle = np.array([3.0, 6.0, 12.0, -24.0])
    pitch.shows("Pitch error Δα", "arcmin", ("equation (8.11)", PENDULUM, TIME, 1.02 * angle),
                ("simulation", SIMULATION, TIME, angle))  # fmt: skip
    for found in plots:
        assert found.span == (100.0, 10_100.0)
        assert found.marks == MARKS


def test_sources_and_differences(plots: Plots) -> None:
    """Of 0.02 and 0.03 times 4 arcmin, the largest differences are 4.8″ and 7.2″."""
    list(report._by_source(result(), NUMBERS))
    list(report._differences(result(), NUMBERS))
    bias, tilt, apart = plots
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
    assert [found.marks for found in plots] == [MARKS] * 3


def test_the_motion(plots: Plots) -> None:
    html = "".join(report._motion(result(steady=True)))
    assert read(html) == "Steady: V = 200 m/s, H = 900 m, pitch ϑ = 5°; a η = 9.5 m/s²."
    list(report._motion(result()))
    velocity, height, pitch, force = plots
    velocity.shows("Velocity V", "m/s", ("", GREEN, TIME, [200.0, 210.0, 230.0, 195.0]))
    height.shows("Height H", "m", ("", BLUE, TIME, [900.0, 950.0, 920.0, 970.0]))
    pitch.shows("Pitch ϑ of the body", "°", ("", ORANGE, TIME, [5.0, 7.0, 1.0, 6.0]))
    force.shows("Specific force", "m/s²", ("horizontal aξ", ORANGE, TIME, [0.25, 0.5, -0.75, 0.125]),
                ("vertical aη − g", BLUE, TIME, [-0.3, -0.05, 0.7, 0.075]))  # fmt: skip
    assert {found.span for found in plots} == {(100.0, 10_100.0)}


def test_marks_begin_a_period_after_the_start() -> None:
    """At most twelve."""
    assert report._span(result(), {"schuler_period_s": 20_000.0}) == ((100.0, 10_100.0), [])
    many = report._span(result(), {"schuler_period_s": 500.0})[1]
    assert [(mark.time, mark.text) for mark in many[:2]] == [(600.0, "T = 8.3 min"), (1100.0, "2 T")]
    assert len(many) == 12


def test_how_it_was_computed() -> None:
    found = {"timing": {"flight_s": 0.0, "navigate_s": 1.236, "total_s": 0.0}, "seed": 41, "versions": {"numpy": "9.8"}}
    rows = cells(report._made(found))
    assert rows[:6] == [
        ["stage", "time [s]"], ["navigate", "1.24"], ["total", "0.00"], ["computed with", ""], ["seed", "41"],
        ["numpy", "9.8"],
    ]  # fmt: skip
    assert rows[6][0] == "processor"
