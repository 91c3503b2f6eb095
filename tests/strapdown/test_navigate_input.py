"""What `navigate` refuses, and whether it says what, where and what would be right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim import ImuData, InputError, NavState, SinssimError, navigate
from sinssim.errors import RunError
from tests.oracles.s_turn import STurn

FLIGHT = STurn(duration=2).fly(50)
IMU = ImuData(FLIGHT.time, FLIGHT.dtheta, FLIGHT.dvel)
FIRST = NavState(FLIGHT.latitude[0], FLIGHT.longitude[0], FLIGHT.height[0], FLIGHT.velocity_ned[0], FLIGHT.q_nb[0])


def changed(name, index, value):
    array = np.array(getattr(IMU, name))
    array[index] = value
    return replace(IMU, **{name: array})


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("name", "index", "place"),
    [
        ("dtheta", (37, 1), r"dtheta\[37\].*t = 0\.76"),
        ("dvel", (0, 2), r"dvel\[0\].*t = 0\.02"),
        ("time", 12, r"time\[12\]"),
        ("dvel", (99, 0), r"dvel\[99\].*t = 2\.0"),
    ],
)
def test_what_is_not_finite_is_named(value, name, index, place):
    with pytest.raises(InputError, match=place):
        navigate(changed(name, index, value), FIRST)


def test_infinities_that_cancel_are_found_too():
    array = np.array(IMU.dtheta)
    array[5, 0], array[6, 0] = np.inf, -np.inf
    with pytest.raises(InputError, match=r"dtheta\[5\]"):
        navigate(replace(IMU, dtheta=array), FIRST)


def test_the_first_bad_sample_far_into_a_long_log_is_named():
    count = 200_000
    dvel = np.zeros((count, 3))
    dvel[150_000, 2] = np.nan
    imu = ImuData(np.arange(count + 1) / 100, np.zeros((count, 3)), dvel)
    with pytest.raises(InputError, match=r"dvel\[150000\].*t = 1500\.01"):
        navigate(imu, FIRST)


def test_a_gap_is_named() -> None:
    holed = replace(IMU, time=IMU.time + np.where(IMU.time > 0.71, 5.0, 0.0))
    with pytest.raises(
        InputError, match=r"missing for 5\.02 s from time\[35\] = 0\.7 s on; usual intervals are 0\.02 s"
    ):
        navigate(holed, FIRST)
    navigate(replace(IMU, time=IMU.time + np.where(IMU.time > 0.71, 0.05, 0.0)), FIRST)  # uneven, and no more


@pytest.mark.parametrize("later", [0.4, 0.38])
def test_times_must_increase(later):
    with pytest.raises(InputError, match=r"time\[20\] = 0\.4.*time\[21\] = "):
        navigate(changed("time", 21, later), FIRST)
    long = np.arange(100_001) / 100
    long[65536] = long[65535]  # at a seam of the checks' blocks
    with pytest.raises(InputError, match=r"time\[65535\].*time\[65536\]"):
        navigate(ImuData(long, np.zeros((100_000, 3)), np.zeros((100_000, 3))), FIRST)


@pytest.mark.parametrize(
    "imu",
    [
        ImuData(np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 3))),
        ImuData(np.arange(4.0), np.zeros((3, 3)), np.zeros((2, 3))),
        ImuData(np.arange(4.0), np.zeros((3, 2)), np.zeros((3, 3))),
        ImuData(np.arange(1.0), np.zeros((0, 3)), np.zeros((0, 3))),
        ImuData(np.zeros((4, 1)), np.zeros((3, 3)), np.zeros((3, 3))),
    ],
)
def test_shapes_must_fit(imu):
    with pytest.raises(InputError, match=r"N\+1 edges"):
        navigate(imu, FIRST)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("latitude", 55.0, "radians"),
        ("latitude", np.nan, "latitude"),
        ("longitude", np.inf, "longitude"),
        ("height", np.zeros(2), "height"),
        ("velocity_ned", np.zeros(2), "velocity_ned"),
        ("velocity_ned", np.array([0, np.nan, 0]), "velocity_ned"),
        ("q_nb", np.array([2.0, 0, 0, 0]), "unit quaternion"),
        ("q_nb", np.zeros(4), "unit quaternion"),
        ("q_nb", np.array([np.nan, 0, 0, 1]), "q_nb"),
    ],
)
def test_initial_state_must_make_sense(field, value, message):
    with pytest.raises(InputError, match=message):
        navigate(IMU, replace(FIRST, **{field: value}))


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("algorithm", "quaternoin", r"quaternoin.*quaternion.*euler"),
        ("frame", "levle", r"levle.*level"),
        ("gravity", "somigliani", r"somigliani.*somigliana.*normal"),
        ("ellipsoid", "WGS84", r"WGS84.*wgs84"),
        ("curvature", "flat", r"flat.*exact.*simplified"),
        ("vertical", "baro", r"baro.*baro-loop.*truth"),
        ("baro_time_constant", 0.0, "positive"),
        ("baro_time_constant", np.nan, "positive"),
    ],
)
def test_unknown_options_are_answered_with_the_list(option, value, message):
    with pytest.raises(InputError, match=message):
        navigate(IMU, FIRST, **{option: value})


@pytest.mark.parametrize("vertical", ["baro-loop", "truth"])
def test_height_reference_is_checked(vertical):
    with pytest.raises(InputError, match=r"height=.*every imu\.time"):
        navigate(IMU, FIRST, vertical=vertical)
    with pytest.raises(InputError, match=r"\(7,\).*\(101,\)"):
        navigate(IMU, FIRST, vertical=vertical, height=np.zeros(7))
    bad = np.array(FLIGHT.height)
    bad[33] = np.nan
    with pytest.raises(InputError, match=r"height\[33\].*t = 0\.66"):
        navigate(IMU, FIRST, vertical=vertical, height=bad)


def test_numbers_that_run_away_are_an_error_of_the_run():
    wild = replace(IMU, dvel=IMU.dvel * 1e200)
    with pytest.raises(RunError) as caught:
        navigate(wild, FIRST)
    assert isinstance(caught.value, SinssimError)


def test_what_was_given_is_left_alone():
    copies = [np.array(array) for array in (IMU.time, IMU.dtheta, IMU.dvel)]
    for array in (IMU.time, IMU.dtheta, IMU.dvel):
        array.setflags(write=False)
    try:
        solution = navigate(IMU, FIRST)
        single = navigate(
            ImuData(IMU.time, IMU.dtheta.astype(np.float32), np.asfortranarray(IMU.dvel)), FIRST
        )  # any layout and precision is taken
    finally:
        for array in (IMU.time, IMU.dtheta, IMU.dvel):
            array.setflags(write=True)
    for array, copy in zip((IMU.time, IMU.dtheta, IMU.dvel), copies, strict=True):
        np.testing.assert_array_equal(array, copy)
    assert solution.q_nb.shape == single.q_nb.shape == (101, 4)
    assert solution.state(0).latitude == FIRST.latitude


@pytest.mark.parametrize("frame", ["level", "wander", "inertial"])
def test_a_solution_that_runs_away_is_told_from_a_pole(frame):
    """First-order steps of 2 rad stretch the matrix by √5 each: no pole is to blame for where that leads."""
    count = 1000
    turning = ImuData(
        0.02 * np.arange(count + 1), np.tile([0.0, 0.0, 2.0], (count, 1)), np.tile([0.0, 0.0, -0.2], (count, 1))
    )
    with pytest.raises(
        RunError, match=r"diverged .* at t = \d+\.\d\d s.*up to 115°.*0.2 m/s in one interval.*too long for poisson-1"
    ) as found:
        navigate(turning, FIRST, algorithm="poisson-1", frame=frame)
    assert "north-pointing" not in str(found.value)
