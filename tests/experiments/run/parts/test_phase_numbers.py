"""What each phase adds, against errors that are known at every instant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Section, Sentence, Table
from sinssim.experiments.run.parts.phases import Phase, phase_numbers, phase_rows, phases_of, tables
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.sampling import FlightEvent
from sinssim.units import ARCMIN, ARCSEC


def events(*legs: tuple[str, float]) -> list[FlightEvent]:
    found, time = [], 0.0
    for number, (kind, lasting) in enumerate(legs, start=1):
        found.append(FlightEvent(time, f"leg {number} ({kind}) begins"))
        time += lasting
        found.append(FlightEvent(time, f"leg {number} ({kind}) ends"))
    return found


_KEYS = [f"{one}_{what}_{unit}" for one, unit in (("horizontal", "m"), ("velocity", "mps"), ("heading", "arcmin"),
                                                ("tilt", "arcsec")) for what in ("error", "added")]  # fmt: skip
LEGS = (("park", 100.0), ("taxi", 20.0), ("taxi", 30.0), ("take_off", 50.0), ("climb", 40.0), ("turn", 60.0))


def rows_of(entry: Any) -> dict[str, Any]:
    """Return the rows of the page's tables by title; the first sentence but for notes under "why"."""
    found: dict[str, Any] = {"why": [one.text for one in tables(entry, "page") if isinstance(one, Sentence)]}
    for one in tables(entry, "page"):
        if isinstance(one, Section):
            (table,) = one.items
            assert isinstance(table, Table)
            found[one.title] = [tuple(row) for row in table.rows]
    return found


def test_neighbouring_legs_of_a_kind_are_one_phase() -> None:
    assert phases_of(events(*LEGS)) == [
        Phase("standstill", 0.0, 100.0),
        Phase("taxi", 100.0, 150.0),
        Phase("take-off", 150.0, 200.0),
        Phase("flight", 200.0, 300.0),
    ]
    assert phases_of(events(("hold", 10.0), ("climb", 10.0))) == []  # nothing to compare
    assert [p.name for p in phases_of(events(("stop", 5.0), ("turn", 5.0)), driven=True)] == ["standstill", "under way"]


@pytest.mark.parametrize(
    ("events", "phases"),
    [
        (
            [(60.0, "lift-off"), (70.0, "burn-out of stage 1"), (74.0, "ignition of stage 2"),
             (99.0, "burn-out of stage 2")],
            [("standstill", 0.0, 60.0), ("powered flight", 60.0, 99.0), ("free flight", 99.0, np.inf)],
        ),
        (
            [(30.0, "launch"), (600.0, "burst at 3.0 km"), (900.0, "landing")],
            [("standstill", 0.0, 30.0), ("ascent", 30.0, 600.0), ("descent", 600.0, 900.0),
             ("standstill", 900.0, np.inf)],
        ),
        (
            [(0.0, "leg 1 (hold) begins"), (9.0, "leg 1 (hold) ends"), (9.0, "released from the carrier")],
            [("flight", 0.0, 9.0), ("fall", 9.0, np.inf)],
        ),
        ([(9.0, "released from the carrier")], [("carried", 0.0, 9.0), ("fall", 9.0, np.inf)]),
    ],
)  # fmt: skip
def test_events_of_motions_without_legs_begin_phases(events: Any, phases: Any) -> None:
    found = phases_of([FlightEvent(time, text) for time, text in events])
    assert [(phase.name, phase.start, phase.end) for phase in found] == phases


def test_numbers_are_the_errors_at_the_ends_and_their_changes() -> None:
    time = np.arange(60.0, 300.0 + 0.05, 0.1)  # an alignment of 60 s
    zero = np.zeros(len(time))
    error = NavError(
        time,
        np.stack([0.03 * time, 0.04 * time, zero], axis=1),
        np.stack([zero, 1e-3 * time, zero], axis=1),
        np.stack([3e-4 * time * ARCSEC, 4e-4 * time * ARCSEC, -1e-4 * time * ARCMIN], axis=1),
    )
    rows = phase_numbers(phases_of(events(*LEGS)), time, error.rows)
    assert [row["phase"] for row in rows] == ["alignment", "standstill", "taxi", "take-off", "flight"]
    assert rows[0]["horizontal_error_m"] == rows[0]["horizontal_added_m"] == pytest.approx(3.0)
    assert rows[0]["heading_error_arcmin"] == pytest.approx(6e-3)  # −φ_down
    for row, (begin, end) in zip(rows[1:], ((60, 100), (100, 150), (150, 200), (200, 300)), strict=True):
        assert (row["from_s"], row["to_s"]) == (begin, end)
        assert row["horizontal_error_m"] == pytest.approx(0.05 * end)
        assert row["horizontal_added_m"] == pytest.approx(0.05 * (end - begin))
        assert row["velocity_added_mps"] == pytest.approx(1e-3 * (end - begin))
        assert row["heading_added_arcmin"] == pytest.approx(1e-4 * (end - begin))
        assert row["tilt_error_arcsec"] == pytest.approx(5e-4 * end)
        assert row["tilt_added_arcsec"] == pytest.approx(5e-4 * (end - begin))
    fine = phase_numbers(phases_of(events(*LEGS)), time, error.rows, fine=True)
    assert [row["phase"] for row in fine][:3] == ["alignment", "fine alignment", "taxi"]


def test_a_change_of_direction_adds_its_length() -> None:
    time = np.array([0.0, 10.0, 20.0])
    position = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    error = NavError(time, position, np.zeros((3, 3)), np.zeros((3, 3)))
    rows = phase_numbers([Phase("taxi", 0.0, 10.0), Phase("flight", 10.0, 20.0)], time, error.rows)
    assert rows[1]["horizontal_error_m"] == 5.0
    assert rows[1]["horizontal_added_m"] == pytest.approx(np.hypot(5.0, 5.0))


def test_cells_are_short_and_rounding_is_zero() -> None:
    time = np.array([0.0, 10.0])
    error = NavError(time, np.full((2, 3), 1e-12), np.zeros((2, 3)), np.zeros((2, 3)))
    rows = phase_numbers([Phase("taxi", 0.0, 10.0)], time, error.rows)
    assert rows_of({"quaternion": rows})["quaternion"][0][:4] == ("taxi", "0 … 10", "0", "0")


def test_every_number_of_a_phase() -> None:
    """Positions (3, 4, 2) and (−9, 12, −5) m, velocities of 7 and 9 m/s, φ = (3, −4, 30)″ and (5, 12, −90)″."""
    time = np.array([20.0, 30.0, 44.0])
    error = NavError(
        time,
        np.array([[3.0, 4.0, 2.0], [-9.0, 12.0, -5.0], [-9.0, 4.0, 1.0]]),
        np.array([[2.0, 3.0, 6.0], [1.0, -4.0, 8.0], [1.0, 2.0, 2.0]]),
        np.array([[3.0, -4.0, 30.0], [5.0, 12.0, -90.0], [0.6, 0.8, 60.0]]) * ARCSEC,
    )
    moved = [Phase("taxi", 20.0, 30.0), Phase("flight", 30.0, 50.0)]
    first, last = phase_numbers(moved, time, error.rows)
    assert first == pytest.approx(
        {
            "phase": "taxi", "from_s": 20.0, "to_s": 30.0, "horizontal_error_m": 15.0,
            "horizontal_added_m": np.hypot(12.0, 8.0), "height_error_m": 5.0, "height_added_m": 7.0,
            "velocity_error_mps": 9.0, "velocity_added_mps": np.sqrt(1.0 + 49.0 + 4.0), "heading_error_arcmin": 1.5,
            "heading_added_arcmin": 2.0, "tilt_error_arcsec": 13.0, "tilt_added_arcsec": np.hypot(2.0, 16.0),
        }
    )  # fmt: skip
    assert last == pytest.approx(
        {
            "phase": "flight", "from_s": 30.0, "to_s": 44.0, "horizontal_error_m": np.hypot(9.0, 4.0),
            "horizontal_added_m": 8.0, "height_error_m": -1.0, "height_added_m": -6.0, "velocity_error_mps": 3.0,
            "velocity_added_mps": np.sqrt(36.0 + 36.0), "heading_error_arcmin": -1.0, "heading_added_arcmin": -2.5,
            "tilt_error_arcsec": 1.0, "tilt_added_arcsec": np.hypot(4.4, 11.2),
        }
    )  # fmt: skip
    assert rows_of({"euler": [first, last]})["euler"] == [
        ("taxi", "20 … 30", "15.0", "14.4", "9.00", "7.35", "1.50", "2.00", "13.0", "16.1"),
        ("flight", "30 … 44", "9.85", "8.00", "3.00", "8.49", "−1.00", "−2.50", "1.00", "12.0"),
    ]
    assert rows_of({"e": [{**first, "tilt_added_arcsec": None}]})["e"][0][-1] == "–"


def test_rows_of_a_solution_that_begins_later() -> None:
    """A start at 25 s: taxi is over, 25 s of the standstill are an alignment; zero velocity goes on aligning."""
    phases = [Phase("taxi", 0.0, 20.0), Phase("standstill", 20.0, 60.0), Phase("take-off", 60.0, 70.0),
              Phase("standstill", 70.0, 95.0)]  # fmt: skip
    time = np.array([25.0, 60.0, 90.0])
    rows = [(row["phase"], row["from_s"], row["to_s"]) for row in phase_rows(phases, time, fine=True)]
    assert rows == [("alignment", 20.0, 25.0), ("fine alignment", 25.0, 60.0), ("take-off", 60.0, 70.0),
                    ("standstill", 70.0, 90.0)]  # fmt: skip
    exact = [row["phase"] for row in phase_rows(phases, np.array([60.0, 95.0]), fine=False)]
    assert exact == ["alignment", "take-off", "standstill"]
    for last, kept in ((65.0, 3), (60.0, 2)):  # the filter diverged: later phases have no errors
        cut = phase_rows(phases, np.array([25.0, last]), fine=True)
        assert [(row["phase"], row["to_s"]) for row in cut] == [
            ("alignment", 25.0), ("fine alignment", 60.0), ("take-off", last),
        ][:kept]  # fmt: skip


@pytest.mark.parametrize(
    ("leg", "phase"),
    [("parked", "standstill"), ("stop", "standstill"), ("takeoff", "take-off"), ("land", "landing"),
     ("straight", "under way"), ("turn", "under way"), ("hold", "flight")],
)  # fmt: skip
def test_the_phase_of_a_leg(leg: str, phase: str) -> None:
    found = phases_of(events(("taxi", 5.0), (leg, 7.0)), driven=True)
    assert found == [Phase("taxi", 0.0, 5.0), Phase(phase, 5.0, 12.0)]
    assert phases_of(events(("taxi", 5.0), ("straight", 7.0)))[1].name == "flight"


def test_the_flight_to_each_waypoint_is_a_phase() -> None:
    legs = [
        FlightEvent(3.0, "leg 4 (taxi) begins"),
        FlightEvent(8.0, "leg 4 (taxi) ends"),
        FlightEvent(8.0, "leg 5 (waypoint) begins"),
        FlightEvent(20.0, "ALPHA reached: 31 m away, height 900 m"),
        FlightEvent(33.0, "BRAVO reached: 12 m away, height 800 m"),
        FlightEvent(40.0, "leg 5 (waypoint) ends"),
    ]
    assert phases_of(legs) == [
        Phase("taxi", 3.0, 8.0), Phase("flight to ALPHA", 8.0, 20.0), Phase("flight to BRAVO", 20.0, 33.0),
        Phase("flight", 33.0, 40.0),
    ]  # fmt: skip


def test_the_sources_of_a_phase_in_words() -> None:
    """At most two sources of a tenth or more; what a phase does not change is 0."""
    horizontal = {"horizontal_sigma_m": 12.345, "shares": {"gyro bias": 0.614, "start": 0.2, "accel bias": 0.15}}
    heading = {"heading_sigma_arcmin": 0.5, "shares": {"gyro bias": 0.996, "start": 0.004}}
    sources = {"horizontal": horizontal, "heading": heading, "tilt": {"tilt_sigma_arcsec": 1e-12, "shares": {}}}
    rows = [dict.fromkeys(_KEYS, 1.0) | {"from_s": 0.0, "to_s": 1.0, "phase": "taxi", "sources": sources}]
    found = rows_of({"euler": rows, "poisson": [{**rows[0], "no_sources": "because."}], "none": []})
    assert found["euler: sources"] == [
        ("taxi", "12.3 m: gyro bias 61\u00a0%, start 20\u00a0%", "0.500 arcmin: gyro bias 100\u00a0%", "0")
    ]
    assert found["why"][1] == "poisson: the sources of the phases’ errors are unknown (no budget). because."
