"""What each phase adds, against errors that are known at every instant."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.recording.store.summaries.phase_summary import Phase, phase_numbers, phase_tables, phases_of
from sinssim.strapdown.nav_error import NavError
from sinssim.truth.trajectory import FlightEvent
from sinssim.units import ARCMIN, ARCSEC


def events(*legs: tuple[str, float]) -> list[FlightEvent]:
    found, time = [], 0.0
    for number, (kind, lasting) in enumerate(legs, start=1):
        found.append(FlightEvent(time, f"leg {number} ({kind}) begins"))
        time += lasting
        found.append(FlightEvent(time, f"leg {number} ({kind}) ends"))
    return found


LEGS = (("park", 100.0), ("taxi", 20.0), ("taxi", 30.0), ("take_off", 50.0), ("climb", 40.0), ("turn", 60.0))


def test_neighbouring_legs_of_a_kind_are_one_phase() -> None:
    assert phases_of(events(*LEGS)) == [
        Phase("standstill", 0.0, 100.0),
        Phase("taxi", 100.0, 150.0),
        Phase("take-off", 150.0, 200.0),
        Phase("flight", 200.0, 300.0),
    ]
    assert phases_of(events(("hold", 10.0), ("climb", 10.0))) == []  # nothing to compare
    assert [p.name for p in phases_of(events(("stop", 5.0), ("turn", 5.0)), driven=True)] == ["standstill", "under way"]


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
    ((name, lines),) = phase_tables({"phases": {"quaternion": rows}})
    assert name == "quaternion"
    assert lines[0][:4] == ("taxi", "0 … 10", "0", "0")
