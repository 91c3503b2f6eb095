"""The disturbance of gravity in a navigator's increments, in a field that is known, and the drift of the algorithms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavSolution
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import RunError
from sinssim.strapdown.attitude.rotation_vector import drift_under_coning, leading_drift_under_coning
from sinssim.strapdown.navigate import disturbance_in_body, disturbance_of_segment, navigate_in_field

PLACE = (0.4, 1.1, 300.0)
Q_NB = rotation.quaternion_from_euler(0.2, -0.3, 1.4)
GRADIENT = np.array([3e-4, -5e-4, 2e-4])  # Earth-fixed, m/s²


def solution(time: Any, height: float = 300.0) -> NavSolution:
    t = np.asarray(time, dtype=np.float64)
    n = len(t)
    return NavSolution(
        t, np.full(n, PLACE[0]), np.full(n, PLACE[1]), np.full(n, height), np.zeros((n, 3)), np.tile(Q_NB, (n, 1)),
        np.zeros(n), "quaternion",
    )  # fmt: skip


def field(asked: list[Array], factor: float = 1.0) -> Any:
    """Return a field of the same vector everywhere, times a factor for each point asked for."""

    def at(r: Array) -> tuple[None, Array]:
        asked.append(r)
        return None, np.outer(factor ** np.arange(len(r)), GRADIENT)

    return SimpleNamespace(potential_and_gradient=at)


def in_body() -> Array:
    q_eb = rotation.multiply(earth.q_en(PLACE[0], PLACE[1]), Q_NB)
    return np.asarray(rotation.rotate(rotation.conjugate(q_eb), GRADIENT))


def test_a_body_at_rest_feels_the_vector_for_the_time_of_each_interval() -> None:
    """Its gyros turn it with the Earth; the vector turns with the Earth as well. The solution has every other row."""
    time = np.array([5.0, 5.5, 6.5, 7.0, 8.0])
    omega = rotation.rotate(
        rotation.conjugate(rotation.multiply(earth.q_en(PLACE[0], PLACE[1]), Q_NB)), np.array([0.0, 0.0, WGS84.omega])
    )
    imu = ImuData(time, np.outer(np.diff(time), omega), np.zeros((4, 3)))
    panels = np.zeros((2, 4, 3))
    panels[:, 0] = GRADIENT
    for rows in (time, time[::2], time[1:2]):
        found = disturbance_in_body(imu, solution(rows), panels, 5.0, 2.0, WGS84)
        np.testing.assert_allclose(found, np.outer(np.diff(time), in_body()), rtol=0, atol=1e-12)


def test_a_segment_between_two_rows_has_knots_of_two_seconds() -> None:
    """Over 5 s there are three intervals; of one row alone the vector there counts."""
    time = np.linspace(20.0, 25.0, 6)
    imu = ImuData(time, np.zeros((5, 3)), np.zeros((5, 3)))
    asked: list[Array] = []
    found = disturbance_of_segment(field(asked, 2.0), WGS84, imu, solution(time))
    assert [len(r) for r in asked] == [4]
    np.testing.assert_allclose(asked[0], np.tile(earth.geodetic_to_ecef(*PLACE), (4, 1)), atol=1e-6)
    # values 1, 2, 4, 8 times the vector at 20, 21 2/3, 23 1/3 and 25 s, straight between; Simpson's rule over a second
    knots = np.array([20.0, 20.0 + 5.0 / 3.0, 20.0 + 10.0 / 3.0, 25.0])
    at = np.interp(np.linspace(20.0, 25.0, 11), knots, [1.0, 2.0, 4.0, 8.0])
    simpson = (at[:-2:2] + 4.0 * at[1::2] + at[2::2]) / 6.0
    np.testing.assert_allclose(found, np.outer(simpson, in_body()), rtol=1e-3)  # the Earth turns by 4e-4 rad
    single = disturbance_of_segment(field(asked), WGS84, imu, solution(time[:1]))
    np.testing.assert_allclose(single, np.tile(in_body(), (5, 1)), rtol=1e-3)


def test_the_field_is_not_asked_for_at_impossible_heights() -> None:
    time = np.array([0.0, 1.0])
    imu = ImuData(time, np.zeros((1, 3)), np.zeros((1, 3)))
    for height, used in ((-30e3, -20e3), (5e6, 1000e3), (400e3, 400e3)):
        asked: list[Array] = []
        disturbance_of_segment(field(asked), WGS84, imu, solution(time, height))
        expected = earth.geodetic_to_ecef(PLACE[0], PLACE[1], used)
        np.testing.assert_allclose(asked[0][0], expected, atol=1e-6)


def test_navigation_is_repeated_until_the_path_stays() -> None:
    """Two passes agree to a millimetre; a path that never settles is an error with the last change."""
    time = np.linspace(0.0, 40.0, 41)
    imu = ImuData(time, np.zeros((40, 3)), np.full((40, 3), 0.5))
    given = []

    def settles(data: ImuData) -> NavSolution:
        given.append(data.dvel)
        return solution(time, 300.0 + 2.0 * 1e-3 ** len(given))

    navigate_in_field(imu, field([]), WGS84, settles)
    assert len(given) == 3  # 2 mm, then less
    np.testing.assert_array_equal(given[0], imu.dvel)
    np.testing.assert_allclose(given[1] - imu.dvel, np.tile(in_body(), (40, 1)), rtol=4e-3)
    count = []

    def never(data: ImuData) -> NavSolution:
        count.append(1)
        return solution(time, 300.0 + 10.0 * (len(count) % 2))

    with pytest.raises(RunError, match=r"after 20 passes the position still changes by \d+(\.\d+)? m between them"):
        navigate_in_field(imu, field([]), WGS84, never)
    assert len(count) == 21


@pytest.mark.parametrize(("samples", "law"), [(1, 1 / 12), (2, 1 / 60), (3, 1 / 280), (4, 1 / 1260)])
def test_leading_term_of_the_drift(samples: int, law: float) -> None:
    """L of the table in the module, times α²Ω (Ωh)²ⁿ; with the previous sample (Ωh)⁴/60."""
    assert leading_drift_under_coning(samples, 0.02, 30.0, 0.01) == pytest.approx(
        law * 0.02**2 * 30.0 * 0.3 ** (2 * samples)
    )
    assert leading_drift_under_coning(1, 0.02, 30.0, 0.01, previous=True) == pytest.approx(
        0.02**2 * 30.0 * 0.3**4 / 60.0
    )


@pytest.mark.parametrize(("samples", "previous", "b"), [(1, False, 1 / 20), (1, True, 5 / 42), (2, False, 5 / 42),
                                                        (3, False, 7 / 36)])  # fmt: skip
def test_the_exact_drift_begins_with_its_series(samples: int, previous: bool, b: float) -> None:
    """−α²Ω L x²ⁿ (1 − b x²) for a narrow cone, x = 0.2: what follows is below x⁴, floors are below α²/x²."""
    alpha, rate, interval = 1e-5, 30.0, 0.2 / 30.0
    lead = leading_drift_under_coning(samples, alpha, rate, interval, previous)
    assert drift_under_coning(samples, alpha, rate, interval, previous) == pytest.approx(
        -lead * (1.0 - b * 0.04), rel=1e-3, abs=0.0
    )
