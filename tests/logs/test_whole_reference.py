"""Where a reference is known, and what differs from it, on motions that its splines pass exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import Array, NavSolution
from sinssim.errors import InputError
from sinssim.logs.reference_solution import Reference
from sinssim.simulation.recorded_filter_run import ReferenceMotion

A = 6378137.0
A1 = A * (1.0 - 0.0066943799901413165)
"""Radii of curvature on the equator: along it, and of the meridian, m."""


def at(times: list[float], **keys: object) -> Reference:
    time = np.array(times)
    return Reference("r", time, 0.0 * time, 0.0 * time + 0.5, 0.0 * time, **keys)  # type: ignore[arg-type]


def test_where_a_dense_reference_is_known() -> None:
    """Rows every 0.25 s but for one second: in this gap up to 20 ms from a row; at the ends up to a microsecond."""
    times = [10.0, 10.25, 10.5, 11.5, 11.75, 12.0, 12.25]
    asked = np.array([9.99, 10.0, 10.3, 10.51, 10.53, 11.0, 11.47, 11.49, 11.6, 12.2500005, 12.3])
    known = [False, True, True, True, False, False, False, True, True, True, False]
    assert at(times).known(asked).tolist() == known
    assert at(times, gap=0.9).known(asked).tolist() == known
    known[4:7] = [True] * 3
    assert at(times, gap=1.0).known(asked).tolist() == known
    assert not at([10.0]).known(np.array([10.0])).any()
    # 0.75 s are three usual intervals: no gap yet
    assert at([10.0, 10.25, 10.5, 11.25, 11.5, 11.75]).known(np.array([10.9])).all()


@pytest.mark.parametrize(("step", "dense"), [(0.33, True), (0.35, False)])
def test_a_reference_of_less_than_three_rows_a_second(step: float, dense: bool) -> None:
    asked = np.array([0.0, 0.019, 0.021, step - 0.019, step - 0.1, 2.0 * step])
    known = [True, True, dense, True, dense, True]
    assert at([0.0, step, 2.0 * step]).known(asked).tolist() == known


TIME = 5.0 + 0.25 * np.arange(13)


def height(t: Array) -> Array:
    return 100.0 + 2.0 * t - 0.5 * t**2 + 0.25 * t**3


def speed(t: Array) -> Array:
    return np.column_stack([1.0 + t**3, 2.0 - t**2, 3.0 * t])


def turned(t: Array) -> Rotation:
    return Rotation.from_rotvec(t[:, None] * np.array([0.1, -0.2, 0.3]))


def test_differences_from_cubics() -> None:
    """On the equator, as far north as 3 m and east as 4 m; velocities have instants of their own, 0.5 s earlier."""
    own = np.array([5.1, 5.8, 6.9, 8.0])
    north, east, up = (
        np.array([3.0, -5.0, 7.0, 9.0]),
        np.array([4.0, 12.0, -24.0, 8.0]),
        np.array([1.5, -2.5, 3.5, 0.5]),
    )
    tilt = np.array([[1.0, -2.0, 3.0], [-4.0, 5.0, 6.0], [7.0, -8.0, -9.0], [2.5, 3.5, -1.5]]) * 1e-3
    faster = np.array([[0.25, -0.5, 0.75], [-0.125, 0.375, 0.625], [1.25, -1.5, 1.75], [2.0, 3.0, -4.0]])
    q = turned(TIME).as_quat(scalar_first=True)
    q[3] = np.nan
    place = TIME, 0.0 * TIME, 0.0 * TIME + 0.5, height(TIME)
    velocity_time = TIME - 0.5
    sigma = np.column_stack([TIME, 2.0 * TIME, 3.0 * TIME])
    reference = Reference("r", *place, speed(velocity_time), q, sigma, velocity_time=velocity_time)
    assert reference.knows == ("position", "velocity", "attitude")
    solution = NavSolution(
        own, north / (A1 + height(own)), 0.5 + east / (A + height(own)), height(own) + up, speed(own) + faster,
        (Rotation.from_rotvec(tilt).inv() * turned(own)).as_quat(scalar_first=True), np.zeros(4),
    )  # fmt: skip
    e = reference.error_of(solution)
    np.testing.assert_array_equal(e.time, own)
    np.testing.assert_allclose(e.position_ned, np.column_stack([north, east, -up]), atol=2e-4)
    np.testing.assert_allclose(e.velocity_ned[:3], faster[:3], atol=1e-11)
    assert np.isnan(e.velocity_ned[3]).all(), "0.5 s after the last velocity"
    np.testing.assert_allclose(e.attitude, tilt, atol=1e-11)
    found = reference.sigma_at(np.array([5.6, 9.0]))
    assert found is not None
    np.testing.assert_allclose(found, [[5.6, 11.2, 16.8], [np.nan] * 3])
    assert Reference("r", *place).knows == ("position",)
    assert Reference("r", *place).state_at(own) is None
    state = reference.state_at(own[:3])
    assert state is not None
    np.testing.assert_allclose(state.height, height(own[:3]), atol=1e-8)
    np.testing.assert_allclose(state.velocity_ned, speed(own[:3]), atol=1e-11)
    assert reference.state_at(own) is None, "one velocity is not known"


ARM = (2.0, -3.0, -1.5)
RATE = 0.25
"""Of a level block that turns about down on the equator at 100 m."""


def turning(t: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Latitude, longitude, height, velocity of a point at the lever arm of the turning block, and its attitude."""
    c, s = np.cos(RATE * t), np.sin(RATE * t)
    north, east = ARM[0] * c - ARM[1] * s, ARM[0] * s + ARM[1] * c
    velocity = np.column_stack([-RATE * east, RATE * north, 0.0 * t])
    q = Rotation.from_euler("Z", (RATE * t)[:, None]).as_quat(scalar_first=True)
    return north / (A1 + 101.5), 0.5 + east / (A + 101.5), 0.0 * t + 101.5, velocity, q


def block(t: Array) -> NavSolution:
    return NavSolution(t, 0.0 * t, 0.0 * t + 0.5, 0.0 * t + 100.0, np.zeros((len(t), 3)), turning(t)[4], 0.0 * t)


@pytest.mark.parametrize("attitude", [True, False])
def test_a_lever_arm(attitude: bool) -> None:
    """With an attitude the reference is taken to the block; without one the solution is taken to its point."""
    time = np.arange(0.0, 4.01, 0.1)
    latitude, longitude, h, velocity, q = turning(time)
    reference = Reference(
        "r", time, latitude, longitude, h, velocity, q if attitude else None, lever_arm=ARM, gap=0.5
    )  # fmt: skip
    own = np.arange(0.5, 3.51, 0.05)
    e = reference.error_of(block(own))
    np.testing.assert_allclose(e.position_ned, 0.0, atol=5e-6)
    np.testing.assert_allclose(e.velocity_ned, 0.0, atol=1e-5)
    if attitude:
        np.testing.assert_allclose(e.attitude, 0.0, atol=1e-8)
        motion = ReferenceMotion(reference, 0.5, 3.5)
        state = motion.state(np.array([1.3, 2.7]))
        np.testing.assert_allclose([state.latitude, state.longitude - 0.5], 0.0, atol=1e-12)
        np.testing.assert_allclose(state.height, 100.0, atol=1e-5)
        np.testing.assert_allclose(state.velocity_ned, 0.0, atol=1e-5)
        one = motion.state(1.3)
        assert np.shape(one.latitude) == ()
        assert one.velocity_ned.shape == (3,)
        with pytest.raises(InputError, match=r"r does not cover the whole run, 3\.000 to 9\.000 s"):
            motion.state(np.array([3.0, 9.0]))
    else:
        assert np.isnan(e.attitude).all()
        with pytest.raises(InputError, match=r"but r has no attitude\."):
            ReferenceMotion(reference, 0.5, 3.5).state(np.array([1.3]))
        bare = Reference("r", time, latitude, longitude, h)
        with pytest.raises(InputError, match="but r has no velocity and no attitude"):
            ReferenceMotion(bare, 0.5, 3.5).state(1.3)


def test_a_part_of_one_row_is_known_there_alone() -> None:
    """A row between two gaps is itself; parts on both sides are splines of their own."""
    time = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 3.0, 5.0, 5.25, 5.5, 5.75, 6.0])
    h = np.where(time < 2.0, height(time), np.where(time < 4.0, 77.0, 500.0 - time))
    reference = Reference("r", time, 0.0 * time, 0.0 * time + 0.5, h)
    own = np.array([0.9, 3.0, 3.01, 5.1, 1.5, 4.0])
    solution = NavSolution(own, 0.0 * own, 0.0 * own + 0.5, 0.0 * own, np.zeros((6, 3)), turning(own)[4], 0.0 * own)
    found = reference.error_of(solution).position_ned[:, 2]
    np.testing.assert_allclose(found, [height(np.array([0.9]))[0], 77.0, 77.0, 494.9, np.nan, np.nan], atol=1e-6)
