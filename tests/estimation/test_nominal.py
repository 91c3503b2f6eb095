"""The motion between and beyond the rows of a solution, and mean rates over any interval, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import ImuData, NavSolution, NavState, solution_of
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation.linearisation import at, motion, near
from sinssim.sensors.imu.compensation import MeanGyroRates
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from tests.oracles import error_equations as oracle

LATITUDE, LONGITUDE, HEIGHT = 0.9, -3.14158, 800.0
W = 1.0 - 6.69437999014e-3 * np.sin(LATITUDE) ** 2
NORTH = 6378137.0 * (1.0 - 6.69437999014e-3) / W**1.5 + HEIGHT
EAST = (6378137.0 / np.sqrt(W) + HEIGHT) * np.cos(LATITUDE)
V, A = np.array([30.0, -50.0, 4.0]), np.array([0.5, 0.8, -0.3])
RATE = np.array([0.02, -0.03, 0.05])


def moved(t: Any) -> np.ndarray:
    t = np.asarray(t)[..., None] - 10.0
    return V * t + 0.5 * A * t**2


def solution(time: np.ndarray) -> NavSolution:
    """A block that accelerates and turns steadily, from 10 s on."""
    place, since = moved(time), time - 10.0
    q = Rotation.from_euler("ZYX", [0.4, 0.1, -0.2]) * Rotation.from_rotvec(np.outer(since, RATE))
    longitude = LONGITUDE + place[:, 1] / EAST
    return NavSolution(
        time, LATITUDE + place[:, 0] / NORTH, (longitude + np.pi) % (2.0 * np.pi) - np.pi, HEIGHT - place[:, 2],
        V + np.outer(since, A), q.as_quat(scalar_first=True), np.zeros(len(time)),
    )  # fmt: skip


def check(state: Any, time: np.ndarray, metres: float) -> None:
    place, since = moved(time), np.asarray(time) - 10.0
    np.testing.assert_allclose((state.latitude - LATITUDE) * NORTH, place[:, 0], rtol=0, atol=metres)
    east = (state.longitude - LONGITUDE + np.pi) % (2.0 * np.pi) - np.pi
    np.testing.assert_allclose(east * EAST, place[:, 1], rtol=0, atol=metres)
    np.testing.assert_allclose(HEIGHT - state.height, place[:, 2], rtol=0, atol=metres)
    np.testing.assert_allclose(state.velocity_ned, V + np.outer(since, A), rtol=0, atol=metres)
    q = Rotation.from_euler("ZYX", [0.4, 0.1, -0.2]) * Rotation.from_rotvec(np.outer(since, RATE))
    assert (Rotation.from_quat(state.q_nb, scalar_first=True) * q.inv()).magnitude().max() < metres / 1e3 + 1e-12


@pytest.mark.parametrize("axes", ["north", "transported"])
def test_between_rows_the_acceleration_is_steady(axes: str) -> None:
    """Across the 180th meridian, in steps of 2 s."""
    rows = solution(np.array([10.0, 12.0, 14.0, 16.0]))
    assert rows.longitude.max() - rows.longitude.min() > 6.0
    edge, fraction = np.array([0, 1, 1, 2, 3]), np.array([0.25, 0.0, 0.6, 0.9, 0.0])
    check(
        at(rows, edge, fraction, WGS84, axes),
        np.array([10.5, 12.0, 13.2, 15.8, 16.0]),
        0.01 if axes == "north" else 0.05,
    )
    bend = np.array([[1e-3, -2e-3, 3e-3]])
    plain, bent = (at(rows, np.array([1]), np.array([0.6]), WGS84, axes, given) for given in (None, bend))
    turn = Rotation.from_quat(plain.q_nb, scalar_first=True).inv() * Rotation.from_quat(bent.q_nb, scalar_first=True)
    np.testing.assert_allclose(turn.as_rotvec(), bend, rtol=0.05)


def test_beyond_the_ends_acceleration_and_rate_go_on() -> None:
    """0.4 s before the first row and after the last; the first acceleration is that over 0.1 s, five rows."""
    time = np.arange(10.0, 11.01, 0.02)
    rows = solution(time)
    edges = np.arange(9.0, 12.05, 0.1)
    measured = np.tile((RATE + np.array([0.01, 0.0, 0.0])) * 0.1, (len(edges) - 1, 1))
    gyros = MeanGyroRates(ImuData(edges, measured, np.zeros((len(edges) - 1, 3))))
    known = ImuErrors(TriadErrors(bias=np.array([0.01, 0.0, 0.0])))
    at_times = np.array([9.6, 10.0, 10.333, 11.0, 11.4])
    check(near(rows, at_times, gyros, known, WGS84), at_times, 2e-3)


def test_at_the_first_row_is_what_it_holds() -> None:
    """Also where the motion does not go on from the rows after it."""
    rows = solution(np.arange(10.0, 11.01, 0.02))
    rows.velocity_ned[0] += 1.0
    gyros = MeanGyroRates(ImuData(np.array([9.0, 12.0]), np.zeros((1, 3)), np.zeros((1, 3))))
    state = near(rows, rows.time[:1], gyros, ImuErrors(), WGS84)
    np.testing.assert_allclose(state.velocity_ned, rows.velocity_ned[:1], rtol=0, atol=1e-12)


def test_the_rows_of_a_solution() -> None:
    rows = solution(np.array([10.0, 12.0]))
    found = solution_of(rows.time, rows.state(slice(None)), "own")  # type: ignore[arg-type]
    assert found.algorithm == "own"
    for name in ("time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect"):
        np.testing.assert_array_equal(getattr(found, name), getattr(rows, name))


def test_mean_rates_over_parts_of_samples() -> None:
    """Angles of 1, 2, 4 and 8 mrad in samples of 0.5, 1, 0.5 and 2 s, about axes as 1 : −2 : 3."""
    time = np.array([3.0, 3.5, 4.5, 5.0, 7.0])
    axis = np.array([1.0, -2.0, 3.0])
    gyros = MeanGyroRates(ImuData(time, np.outer([1e-3, 2e-3, 4e-3, 8e-3], axis), np.zeros((4, 3))))
    begin, end = np.array([3.25, 3.5, 4.0, 2.0, 6.0]), np.array([4.0, 5.0, 5.5, 3.5, 8.0])
    # by hand: ½ + 1, 2 + 4, 1 + 4 + 2; those that reach beyond the data are moved inside: 3.0–4.5 s, 5.0–7.0 s
    expected = np.array([1.5e-3 / 0.75, 6e-3 / 1.5, 7e-3 / 1.5, 3e-3 / 1.5, 8e-3 / 2.0])
    np.testing.assert_allclose(gyros.mean(begin, end, ImuErrors()), np.outer(expected, axis), rtol=1e-12)
    known = ImuErrors(TriadErrors(bias=np.array([1e-3, 0.0, 0.0]), scale=np.array([0.0, 1.0, 0.0])))
    found = gyros.mean(begin, end, known)
    np.testing.assert_allclose(found[:, 0], expected - 1e-3, rtol=1e-9)
    np.testing.assert_allclose(found[:, 1], -expected, rtol=1e-9)
    assert gyros.mean(np.zeros(0), np.zeros(0), known).shape == (0, 3)
    # around an instant: one mean interval of 1 s on either side
    around = gyros.at(np.array([4.25, 2.0]), ImuErrors())
    np.testing.assert_allclose(around, np.outer([(0.5e-3 + 2e-3 + 4e-3 + 1e-3) / 2.0, 2e-3 / 1.0], axis), rtol=1e-12)


def test_the_specific_force_of_a_vehicle_on_a_parallel() -> None:
    """East at 220 m/s, 5 km high, while the speed grows by 0.4 m/s²: Δv/T + (2ω_ie + ω_en) × v − g."""
    v, earth = np.array([0.0, 220.0, 0.0]), oracle.Earth()
    ie, en = oracle.rates(earth, LATITUDE, 5000.0, v)
    state = NavState(
        np.full(2, LATITUDE), np.array([0.1, 0.2]), np.full(2, 5000.0),
        np.array([[0.0, 219.6, 0.0], [0.0, 220.4, 0.0]]), np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
    )  # fmt: skip
    attitude = Rotation.from_euler("ZYX", [0.4, 0.1, -0.2])
    middle = NavState(
        state.latitude[:1], np.array([0.15]), state.height[:1], v[None], attitude.as_quat(scalar_first=True)[None]
    )
    found = motion(state, middle, np.array([2.0]), RATE[None], "normal", WGS84)
    force = (
        np.array([0.0, 0.4, 0.0])
        + np.cross(2.0 * ie + en, v)
        - [0.0, 0.0, oracle.gravity_down(earth, LATITUDE, 5000.0)]
    )
    np.testing.assert_allclose(found.force_n[0, [1, 2]], force[[1, 2]], rtol=0, atol=1e-5)
    # 5 km high gravity leans towards the equator by 8e-6 m/s² per km and sin 2φ
    assert found.force_n[0, 0] == pytest.approx(force[0] + 5.0 * 8.2e-6 * np.sin(2.0 * LATITUDE), abs=2e-6)
    np.testing.assert_allclose(found.force_b[0], attitude.inv().apply(found.force_n[0]), rtol=1e-12)
    np.testing.assert_allclose(found.c_nb[0], attitude.as_matrix(), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.rate_b, RATE[None])
    still = motion(state, middle, np.array([0.0]), RATE[None], "normal", WGS84)  # the first epoch has no interval
    assert np.isfinite(still.force_n).all()
