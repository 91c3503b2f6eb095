"""What cannot be a motion is named with source and sample."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.track_samples import TrackSamples, checked_samples
from sinssim.truth.vehicle_attitude import VEHICLES

LAND = VEHICLES["land"]


def samples(**change: Any) -> TrackSamples:
    t = np.arange(20.0)
    columns = {"time": t, "latitude": 0.8 + 1e-6 * t, "longitude": 0.2 + 0.0 * t, "height": 10.0 + 0.0 * t}
    for name, (row, value) in change.items():
        columns[name] = columns[name].copy()
        columns[name][row] = value
    return TrackSamples("drive.csv", "row", *columns.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time": (7, np.nan)}, ["drive.csv, row 8", "its time is nan"]),
        ({"longitude": (3, np.inf)}, ["drive.csv, row 4", "its longitude is inf"]),
        ({"latitude": (5, 2.0)}, ["drive.csv, row 6", "114.59156°", "beyond ±90°", "exchanged"]),
        ({"longitude": (5, 40.0)}, ["drive.csv, row 6", "beyond ±360°", "radians"]),
        ({"height": (5, 2e6)}, ["drive.csv, row 6", "its height"]),
        ({"time": (9, 3.5)}, ["drive.csv, row 10", "4.5 s before that of row 9", "must increase"]),
        ({"time": (9, 8.0)}, ["drive.csv, row 10", "same time as row 9", "6.37 m"]),
        ({"latitude": (9, 0.9)}, ["drive.csv, row 10", "a speed of 636836 m/s", "more than 150 m/s"]),
    ],
)
def test_refusals(change: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as error:
        checked_samples(samples(**change), LAND)
    for word in words:
        assert word in str(error.value)


def test_single_sample() -> None:
    with pytest.raises(InputError, match=r"single row.*\[parked\]"):
        checked_samples(samples().part(slice(0, 1)), LAND)


def test_repeated_sample_is_left_out_and_said() -> None:
    twice = samples().part(np.array([0, 1, 2, 2, 3, 4]))
    left = checked_samples(twice, LAND)
    assert len(left) == 5
    assert left.notes == ("1 row with the time of the previous one left out, the first of them row 3.",)


def test_the_first_repetition_is_named_by_its_own_row() -> None:
    given = samples(time=(9, 8.0), latitude=(9, 0.8 + 8e-6))
    assert "the first of them row 10." in checked_samples(given, LAND).notes[0]


def test_missing_heights_are_interpolated_and_said() -> None:
    found = checked_samples(samples(height=(slice(4, 7), np.nan)), LAND)
    assert np.array_equal(found.height, np.full(20, 10.0))
    assert "3 of 20 rows have no height, first row 5" in found.notes[0]
    none = checked_samples(samples(height=(slice(None), np.nan)), LAND)
    assert np.array_equal(none.height, np.zeros(20))
    assert "No row has a height" in none.notes[0]


def test_heights_are_interpolated_in_time_and_left_out_samples_counted() -> None:
    """Missing at 3 s of 2 … 6 s between 10 and 50 m; before the first known one it is that."""
    time, height = np.array([0.0, 2.0, 3.0, 6.0, 9.0]), np.array([np.nan, 10.0, np.nan, 50.0, 20.0])
    given = TrackSamples("a.gpx", "fix", time, 0.5 + 1e-6 * time, 0.1 + 0.0 * time, height)
    found = checked_samples(given, LAND)
    np.testing.assert_allclose(found.height, [10.0, 10.0, 20.0, 50.0, 20.0])
    assert found.notes == ("2 of 5 fixes have no height, first fix 1; it is interpolated in time.",)
    one = checked_samples(given.part(slice(1, None)), LAND)
    assert one.notes == ("1 of 4 fixes has no height, first fix 3; it is interpolated in time.",)
    again = given.part(np.array([1, 1, 3, 3, 4, 4, 4]))
    kept = checked_samples(again, LAND)
    assert kept.rows.tolist() == [2, 4, 5]
    assert kept.notes == ("4 fixes with the time of the previous one left out, the first of them fix 2.",)


def test_messages_have_their_numbers() -> None:
    """A jump of 400 m in 2 s at row 3, the limits of heights and speeds, a norm, a time that goes back."""
    time = np.array([10.0, 12.0, 14.0, 16.0])
    north = np.array([0.0, 100.0, 500.0, 600.0]) / 6.357e6  # the meridian's radius at latitude 0.5
    given = TrackSamples("a.csv", "row", time, 0.5 + north, 0.1 + 0.0 * time, 0.0 * time)
    with pytest.raises(InputError) as error:
        checked_samples(given, LAND)
    assert str(error.value).startswith("a.csv, row 3 (at 4 s): it lies ")
    assert " m from row 2, 2 s before: a speed of " in str(error.value)
    assert str(error.value).endswith(
        "m/s, more than 150 m/s of such a vehicle; max_speed_mps allows more. Remove the wrong row, or check the unit "
        "of the times and angles."
    )
    said = re.search(r"it lies (\S+) m .* speed of (\S+) m/s", str(error.value))
    assert said is not None
    assert (float(said[1]), float(said[2])) == pytest.approx((400.0, 200.0), rel=2e-3)
    with pytest.raises(InputError, match=r"more than 190 m/s, max_speed_mps\. Remove"):
        checked_samples(given, LAND, 190.0)
    assert len(checked_samples(given, LAND, 210.0)) == 4
    for height in (-12_001.0, 1_000_001.0):
        with pytest.raises(
            InputError, match=rf"row 1 \(at 0 s\): its height, {height:.8g} m, is not from -12000 to 1e\+06 m"
        ):
            checked_samples(replace(given, height=np.array([height, 0.0, 0.0, 0.0])), LAND)
    q = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    q[2] *= 1.25
    with pytest.raises(InputError, match=r"row 3 \(at 4 s\): its quaternion has the norm 1\.25; it must be 1\."):
        checked_samples(replace(given, latitude=0.5 + 0.1 * north, q_nb=q), LAND)
    with pytest.raises(InputError, match=r"row 3 \(at 1 s\): its time lies 1 s before that of row 2: times must"):
        checked_samples(replace(given, time=np.array([10.0, 12.0, 11.0, 16.0])), LAND)


def test_higher_speed_is_allowed_on_demand() -> None:
    assert len(checked_samples(samples(latitude=(slice(9, None), 0.8001)), LAND, 1000.0)) == 20


def test_attitude_that_turns_too_far() -> None:
    q = np.tile((1.0, 0.0, 0.0, 0.0), (20, 1))
    q[11:] = (np.cos(0.5), 0.0, 0.0, np.sin(0.5))
    with pytest.raises(InputError, match=r"row 12.*turns by 57° since row 11"):
        checked_samples(replace(samples(), q_nb=q), LAND)


def test_radians_as_degrees_are_suspected() -> None:
    small = samples()
    small = TrackSamples("drive.csv", "row", small.time, small.latitude / 57.3, small.longitude / 57.3, small.height)
    assert "Gulf of Guinea" in checked_samples(small, LAND).notes[0]
