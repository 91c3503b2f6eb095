"""What cannot be a motion is named with source and sample."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.truth.track.samples import TrackSamples, checked_samples
from sinssim.truth.track.vehicles import VEHICLES

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


def test_missing_heights_are_interpolated_and_said() -> None:
    found = checked_samples(samples(height=(slice(4, 7), np.nan)), LAND)
    assert np.array_equal(found.height, np.full(20, 10.0))
    assert "3 of 20 rows have no height, first row 5" in found.notes[0]
    none = checked_samples(samples(height=(slice(None), np.nan)), LAND)
    assert np.array_equal(none.height, np.zeros(20))
    assert "No row has a height" in none.notes[0]


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
