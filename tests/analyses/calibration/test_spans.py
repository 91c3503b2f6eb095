"""Dwells among the samples: planned, given, and found in the gyros' readings."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.turntable_calibration import calibrate
from sinssim.analyses.turntable_dwells import Dwells, between, detected, planned
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.scenario import load_scenario
from sinssim.truth.motions.turntable import Turntable

TIME = 2.0 + 0.5 * np.arange(41)  # to 22 s
TABLE = Turntable.model_validate({
    "turns": [{"axis": [0.0, 0.0, 1.0], "angle_deg": 90.0},
              {"axis": [1.0, 0.0, 0.0], "angle_deg": -32.0, "rate_deg_s": 4.0}],
    "dwell_s": 20.0, "first_dwell_s": 15.0, "rate_deg_s": 10.0,
})  # fmt: skip


def test_dwells_between_given_times() -> None:
    """Samples wholly inside; the turns are all samples between two dwells."""
    found = between(((2.0, 5.0), (7.7, 11.2), (13.5, 22.0)), TIME, "key")
    assert found.rows.tolist() == [[0, 6], [12, 18], [23, 40]]
    assert found.turns.tolist() == [[6, 12], [18, 23]]
    np.testing.assert_array_equal(found.seconds(TIME), [[2.0, 5.0], [8.0, 11.0], [13.5, 22.0]])
    assert between(((2.0, 3.5),), TIME, "key").rows.tolist() == [[0, 3]]  # three samples are enough


def test_planned_dwells() -> None:
    """15 s, a turn of 90°/10°/s + 1 s + 1 s, 20 s, a turn of 32°/4°/s + 2 s, 20 s."""
    time = 0.25 * np.arange(305)  # to 76 s
    np.testing.assert_array_equal(planned(TABLE, time).seconds(time), [[0.0, 15.0], [26.0, 46.0], [56.0, 76.0]])


@pytest.mark.parametrize(("span", "text"), [
    ((1.5, 9.0), "key: dwell 2 from 1.5 s to 9 s lies outside the data, which last from 2 s to 22 s."),
    ((7.0, 22.6), "key: dwell 2 from 7 s to 22.6 s lies outside the data, which last from 2 s to 22 s."),
    ((7.0, 8.4), "key: dwell 2 lasts 1.4 s and has 2 samples of 0.5 s; it needs at least 3."),
])  # fmt: skip
def test_dwells_that_the_data_do_not_have(span: tuple[float, float], text: str) -> None:
    with pytest.raises(InputError) as info:
        between(((2.0, 5.0), span), TIME, "key")
    assert str(info.value) == text


def readings(*rates: tuple[float, float]) -> ImuData:
    """Gyros of a bias of 2°/s at 10 Hz from 7 s on; spans of a length, s, with a rate, °/s, about the right axis."""
    turned = np.concatenate([np.full(round(10 * seconds), rate) for seconds, rate in rates])
    dtheta = np.radians(np.column_stack([0 * turned, turned, 0 * turned + 2.0])) / 10.0
    return ImuData(7.0 + 0.1 * np.arange(len(turned) + 1), dtheta, np.zeros((len(turned), 3)))


SEQUENCE = ((15.0, 0.0), (11.0, 10.0), (20.0, 0.0), (10.0, -4.0))


def test_found_dwells_are_a_second_shorter_at_both_ends() -> None:
    """What turns by less than a tenth of the slowest turn, 0.4°/s, stands; 4 s of standing are too short."""
    for last in (0.0, 0.39):
        found = detected(readings(*SEQUENCE, (4.0, 0.0), (2.0, 4.0), (20.0, last)), TABLE)
        assert found.rows.tolist() == [[10, 140], [270, 450], [630, 810]]


def test_dwells_that_are_not_found() -> None:
    with pytest.raises(InputError) as info:
        detected(readings(*SEQUENCE, (20.0, 0.41)), TABLE)
    assert str(info.value) == (
        "the log has 2 spans at rest, but the sequence of [turntable] has 3 dwells. Give the sequence that was run, or "
        "the times of the dwells in calibration.dwells_s; found: 8-21 s, 34-52 s."
    )
    with pytest.raises(InputError) as info:
        detected(readings(*((4.0, 0.0), (2.0, 4.0)) * 9), TABLE)
    assert str(info.value) == (
        "the log has no spans at rest of 5 s: the mean rate of no such span is below 0.4°/s, a tenth of the slowest "
        "turn. Give calibration.dwells_s, or the log of a sequence with dwells."
    )
    with pytest.raises(InputError, match=r"has 9 spans .* found: 8-12 s, 17-21 s, .* 71-75 s, …\.$"):
        detected(readings(*((6.0, 0.0), (3.0, 4.0)) * 9), TABLE)


def test_no_turns() -> None:
    assert Dwells(np.array([[3, 9]])).turns.shape == (0, 2)


def test_the_shortest_dwell_needs_three_samples() -> None:
    settings = ("turntable.dwell_s=1", "turntable.first_dwell_s=100", "imu.rate_hz=2")
    with pytest.raises(InputError) as error:
        calibrate(load_scenario("calibration_systematic", settings))
    assert str(error.value) == (
        "turntable.dwell_s = 1 is shorter than three samples at imu.rate_hz = 2; give at least 1.5 s."
    )
