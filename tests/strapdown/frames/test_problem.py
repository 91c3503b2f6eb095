"""Python around the engines: readings at rows, references of the vertical channel, and the sentences of failures."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from sinssim.errors import InputError, RunError
from sinssim.strapdown.attitude.functional_iteration import engine
from sinssim.strapdown.frames import level
from sinssim.strapdown.frames.navigation_problem import check_solution, ran_away
from sinssim.strapdown.frames.vertical_channel import NOTHING_NEW, OVERDUE, HeightReadings, height_reference
from sinssim.strapdown.iteration_windows import chebyshev_points, windows


def test_readings_since_the_row_before() -> None:
    """Every 2 s from 1.2 s on, one missing: new at 2, 4 and 10 s; after 7.2 s, half an interval late, it is overdue."""
    readings = HeightReadings(np.array([1.2, 3.2, 4.0, 9.2]), np.array([11.0, 22.0, 33.0, 44.0]), 2.0)
    found = readings.at(np.arange(12.0))
    held, late = NOTHING_NEW, OVERDUE
    assert found.tolist() == [late, late, 11.0, held, 33.0, held, held, held, late, late, 44.0, held]
    assert HeightReadings(np.zeros(0), np.zeros(0), 1.0).at(np.arange(3.0)).tolist() == [OVERDUE] * 3


def test_references_of_the_vertical_channel() -> None:
    """A held channel has the rate downwards, of unequal steps by the parabola through three points: h = 3 + 2t + t²."""
    time = np.array([0.0, 1.0, 3.0, 4.0])
    height = 3.0 + 2.0 * time + time**2
    held, climb = height_reference("truth", height, time)
    np.testing.assert_array_equal(held, height)
    np.testing.assert_allclose(climb, [-3.0, -4.0, -8.0, -9.0])  # −2 − 2t within, the chords at both ends
    loop, none = height_reference("baro-loop", height, time)
    np.testing.assert_array_equal(loop, height)
    assert loop is not height
    assert len(none) == 0
    assert [len(part) for part in height_reference("free", None, time)] == [0, 0]
    readings = HeightReadings(np.array([0.5]), np.array([7.0]), 9.0)
    assert height_reference("baro-loop", readings, time)[0].tolist() == [OVERDUE, 7.0, NOTHING_NEW, NOTHING_NEW]
    with pytest.raises(InputError, match=r'vertical="truth" needs a height at every imu.time; measurements are for'):
        height_reference("truth", readings, time)
    with pytest.raises(InputError, match=r"height\[2\] = inf m at t = 3\.000000 s is not a finite number\."):
        height_reference("truth", np.array([1.0, 2.0, np.inf, 4.0]), time)
    with pytest.raises(InputError, match='height would have no effect: vertical = "free" uses no height reference'):
        height_reference("free", height, time)


def problem(**change: Any) -> Any:
    """Return the arrays of a problem of three rows, each of two samples, as far as the checks look at them."""
    fine = {
        "time": np.array([10.0, 10.5, 11.0]), "height": np.zeros(3), "velocity": np.zeros((3, 3)),
        "q_nb": np.zeros((3, 4)),
        "latitude": np.radians([89.5, 89.6, 89.7]), "algorithm": "euler",
        "dtheta": np.radians([[1.0, 2.0, 2.0], [0.0, 3.0, 4.0], [6.0, 6.0, 7.0], [90.0, 0.0, 0.0]]),
        "dvel": np.array([[0.3, 0.4, 0.0], [0.0, 0.5, 1.2], [2.0, 0.0, 0.0], [9.0, 0.0, 0.0]]),
    }  # fmt: skip
    return SimpleNamespace(**{**fine, **change})


def test_a_solution_that_diverges_is_said_with_what_went_before() -> None:
    """Row 1 at 10.5 s: the two samples before it turn by up to 5° and push by up to 1.3 m/s."""
    error = ran_away(problem(), "height", 1)
    assert str(error) == (
        "the navigation's height diverged and is not usable at t = 10.50 s. The increments before it rotate the body "
        "by up to 5° and accelerate it by up to 1.3 m/s in one interval. If that is right (rad and m/s are expected), "
        "the interval is too long for euler: use a higher rate or another algorithm."
    )
    assert error.time == 10.5
    assert "up to 90° and accelerate it by up to 9 m/s" in str(ran_away(problem(), "height", 2))
    velocity = np.zeros((3, 3))
    velocity[2, 1] = np.nan
    with pytest.raises(RunError, match=r"the navigation's velocity diverged and is not usable at t = 11\.00 s"):
        check_solution(problem(velocity=velocity))
    check_solution(problem())


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_level_frame_ends_near_a_pole(sign: float) -> None:
    level.check(problem(latitude=sign * np.radians([89.5, 89.899, 89.7])), "level")
    with pytest.raises(RunError) as error:
        level.check(problem(latitude=sign * np.radians([89.5, 89.91, 89.95])), "level")
    assert str(error.value) == (
        "the north-pointing level frame cannot be used within 0.1° of a pole, where the direction of north changes too "
        f"fast: latitude {sign * 89.91:.4f}° at t = 10.50 s. The frames wander, free-azimuth, transverse and inertial "
        "pass the poles."
    )
    assert error.value.time == 10.5
    with pytest.raises(RunError, match="the navigation's latitude diverged"):
        level.check(problem(latitude=np.array([1.5, sign * 1.6, 1.5])), "level")


def test_options_without_effect_and_data_that_are_too_short() -> None:
    imu = ImuData(np.arange(4.0), np.zeros((3, 3)), np.tile([0.0, 0.0, -9.8], (3, 1)))
    start = NavState(*(np.asarray(x) for x in (0.5, 0.1, 0.0)), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    for options, words in (
        (
            {"azimuth": 0.3},
            r'azimuth would have no effect: it is for the frames wander and free-azimuth; here frame = "l',
        ),
        (
            {"route": (0.1, 0.2, 0.3, 0.4)},
            r'route would have no effect: it is for frame = "transverse"; here frame = "l',
        ),
        (
            {"slow_quantities": "extrapolate"},
            r'slow_quantities = "extrapolate" would have no effect: .* rates_hz is not',
        ),
        (
            {"algorithm": "rotation-vector-4"},
            r"3 samples, are shorter than one update of rotation-vector-4, which takes 4",
        ),
        (
            {"rates_hz": (1.0, 0.5, 0.25)},
            r"3 samples, are shorter than one update of quaternion at the slow rate, 0\.25 Hz",
        ),
        ({"algorithm": "functional-iteration"}, "needs windows of 8 samples; the data have only 3"),
    ):
        with pytest.raises(InputError, match=words):
            navigate(imu, start, **options)  # type: ignore[arg-type]
    uneven = replace(imu, time=np.array([0.0, 1.0, 2.5, 3.0]))
    with pytest.raises(
        InputError, match=r"rotation-vector-2 needs equal .* those of the data range from 0\.5 s to 1\.5 s"
    ):
        navigate(uneven, start, algorithm="rotation-vector-2")
    assert engine("level") is not None


def test_windows_of_eight_samples() -> None:
    """19 samples: two windows, and the last three samples of one that is fitted to the last eight.

    Of increments of the rate 1 + 2x + 3x² per window, the rate at the nodes, its integral, and the values at the ends.
    """
    nodes = np.asarray(chebyshev_points(), dtype=np.float64)
    assert (nodes[0], nodes[-1], len(nodes)) == (0.0, 1.0, 12)
    whole, last = windows(np.arange(20.0), True)
    assert (whole.first.tolist(), whole.size.tolist(), whole.fit.tolist()) == ([0, 8], [8, 8], [0, 8])
    assert (last.first.tolist(), last.size.tolist(), last.fit.tolist()) == ([16], [3], [11])

    def rate(x: Any) -> Any:
        return 1.0 + 2.0 * x + 3.0 * x * x

    for part, skipped, length in ((whole, 0, 8), (last, 5, 3)):
        x = (np.arange(9.0) - skipped) / length  # edges of the fitted samples; the navigated window is 0 … 1
        increments = np.diff(x + x**2 + x**3)
        np.testing.assert_allclose(part.rate[0] @ increments, rate(nodes), rtol=1e-9)
        np.testing.assert_allclose(part.integral @ rate(nodes), nodes + nodes**2 + nodes**3, rtol=1e-12, atol=1e-14)
        ends = x[skipped + 1 :]
        np.testing.assert_allclose(part.edge[0, :length] @ (nodes**3), ends**3, rtol=1e-12)
        assert not part.edge[0, length:].any()
        # heights at the edges, straight between: 0, 1, 4, 9, … at the edges
        heights = np.arange(9.0) ** 2
        np.testing.assert_allclose(part.height[0] @ heights, np.interp(nodes, x, heights), rtol=1e-12, atol=1e-12)
    time = np.cumsum(np.append(0.0, np.random.default_rng(2).uniform(0.5, 1.5, 16)))
    (uneven,) = windows(time, False)
    assert uneven.table.tolist() == [0, 1]
    edges = (time[8:] - time[8]) / (time[16] - time[8])
    np.testing.assert_allclose(uneven.rate[1] @ np.diff(edges + edges**2 + edges**3), rate(nodes), rtol=1e-9)
