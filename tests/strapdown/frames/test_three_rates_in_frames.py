"""The three-rate schedule in every frame: orders, the lag of held gravitation in closed form, poles, forms of radii."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import FRAMES, ImuData, NavState, navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.oracles.s_turn import STurn
from tests.slow import slow

OTHERS = tuple(frame for frame in FRAMES if frame != "level")
RADIUS = 6.38e6


@pytest.fixture(scope="module")
def flight():
    return STurn(duration=240).fly(200)


def run(flight, rates, **options):
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    options = {"gravity": "somigliana", "vertical": "truth", "height": flight.height, **options}
    if options["vertical"] == "free":
        del options["height"]
    return navigate(imu, first, rates_hz=rates, **options)


def errors(flight, rates, **options):
    """Largest horizontal error, m, error of velocity, m/s, and of attitude, rad."""
    solution = run(flight, rates, **options)
    at = np.searchsorted(flight.time, solution.time - 1e-9)
    np.testing.assert_allclose(np.diff(solution.time), 1 / rates[-1], rtol=0, atol=1e-9)
    north = RADIUS * (solution.latitude - flight.latitude[at])
    east = RADIUS * np.cos(flight.latitude[at]) * (solution.longitude - flight.longitude[at])
    q, p = solution.q_nb, flight.q_nb[at]
    vector = p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - np.cross(p[:, 1:], q[:, 1:])
    velocity = np.abs(solution.velocity_ned - flight.velocity_ned[at])[:, :2]
    return np.max(np.hypot(north, east)), np.max(velocity), 2 * np.max(np.linalg.norm(vector, axis=1))


def order(found):
    return np.log2(np.array(found[:-1]) / np.array(found[1:]))


@pytest.mark.parametrize("frame", OTHERS)
def test_second_order_in_the_medium_interval(flight, frame):
    found = [errors(flight, (200, rate, 5), slow_quantities="extrapolate", frame=frame)[1] for rate in (10, 20, 40)]
    np.testing.assert_allclose(order(found), 2.0, rtol=0, atol=0.1)


@pytest.mark.parametrize("frame", OTHERS)
@pytest.mark.parametrize(("slow_quantities", "expected"), [("hold", 1.0), ("extrapolate", 2.0)])
def test_order_in_the_slow_interval(flight, frame, slow_quantities, expected):
    """Position, and attitude, which in inertial axes feels the computed place alone."""
    found = [errors(flight, (200, 200, rate), slow_quantities=slow_quantities, frame=frame) for rate in (0.5, 1, 2)]
    np.testing.assert_allclose(order([attitude for *_, attitude in found]), expected, rtol=0, atol=0.15)
    if expected == 1.0 or frame == "inertial":
        np.testing.assert_allclose(order([metres for metres, *_ in found]), expected, rtol=0, atol=0.15)


@pytest.mark.parametrize("frame", OTHERS)
@pytest.mark.parametrize("vertical", ["free", "baro-loop", "truth"])
def test_vertical_channels(flight, frame, vertical):
    solution = run(flight, (200, 100, 20), vertical=vertical, slow_quantities="extrapolate", frame=frame)
    limit = {"free": 0.5, "baro-loop": 0.05, "truth": 1e-6}[vertical]
    assert np.max(np.abs(solution.height - 5000)) < limit


@pytest.mark.parametrize(
    ("algorithm", "frame"),
    [("rotation-vector-1p", "inertial"), *slow(("poisson-2", "wander"), ("two-quaternions", "transverse")),
     *slow(("euler", "inertial"), ("rotation-vector-1p", "free-azimuth"))],
)  # fmt: skip
def test_algorithms(flight, frame, algorithm):
    """The algorithm's own error and no other: in the level frame it is the same, to the rates of the frames."""
    options = {"algorithm": algorithm, "slow_quantities": "extrapolate"}
    level = errors(flight, (200, 100, 50), **options)[2]
    found = errors(flight, (200, 100, 50), frame=frame, **options)[2]
    assert found == pytest.approx(level, rel=0.1, abs=1e-8)


def test_held_gravitation_lags_in_inertial_axes():
    """At rest it points to where the Earth's centre was T/2 before: an acceleration G ω cos φ T/2 to the east."""
    latitude, slow_s, end = np.deg2rad(50.0), 2.0, 60.0
    place = Parked(latitude, 0.0, 0.0, np.array([1.0, 0.0, 0.0, 0.0]), end)
    imu = place.increments(20.0)
    held = {}
    for treatment in ("hold", "extrapolate"):
        solution = navigate(
            imu, place.state(0.0), frame="inertial", rates_hz=(20.0, 10.0, 1.0 / slow_s), slow_quantities=treatment,
            vertical="truth", height=np.zeros(len(imu.time)),
        )  # fmt: skip
        held[treatment] = solution.velocity_ned[-1]
    # gravitation has the centrifugal acceleration in it
    expected = 9.83 * 7.292115e-5 * np.cos(latitude) * 0.5 * slow_s * end
    assert held["hold"][1] == pytest.approx(expected, rel=0.01)
    # without a value before the first, the first interval is held, too
    assert held["extrapolate"][1] == pytest.approx(expected * slow_s / end, rel=0.05)


@pytest.mark.parametrize("frame", ["wander", "free-azimuth", "transverse", "inertial"])
def test_over_the_pole(frame):
    flight = GreatCircle(latitude=np.deg2rad(89.0), longitude=0.5, height=10e3, course=0.0, speed=300.0, duration=800.0)
    imu = flight.increments(20.0)
    solution = navigate(
        imu, flight.state(0.0), frame=frame, rates_hz=(20.0, 10.0, 2.0), slow_quantities="extrapolate",
        vertical="truth", height=np.full(len(imu.time), 10e3),
    )  # fmt: skip
    assert np.max(solution.latitude) > np.deg2rad(89.99)
    assert np.max(navigation_error(flight.state(solution.time), solution).horizontal) < 0.2


# "simplified" has the kernels of the exact form; each of the others has two of its own in each frame
@pytest.mark.parametrize("form", ["simplified", *slow("spherical-no-height", "spherical", "no-height")])
@pytest.mark.parametrize("frame", ["level", "wander", *slow("transverse")])
def test_forms_of_the_radii(flight, frame, form):
    """The error of the form as without a schedule."""
    options = {"frame": frame, "curvature": form}
    whole = run(flight, None, **options)
    solution = run(flight, (200, 200, 20), slow_quantities="extrapolate", **options)
    at = np.searchsorted(whole.time, solution.time - 1e-9)
    cost = errors(flight, (200, 200, 20), slow_quantities="extrapolate", **options)[0]
    assert cost > (0.1 if form == "simplified" else 20.0)
    apart = RADIUS * np.max(np.abs(solution.latitude - whole.latitude[at]))
    assert apart < 0.01 * cost + 1e-3
