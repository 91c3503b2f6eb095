"""The three-rate schedule against the chapter's single-rate scheme written out here, and its order."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import ImuData, InputError, NavState, navigate
from tests.oracles.s_turn import E2, OMEGA_IE, STurn
from tests.slow import slow

A = 6378137.0


def first_of(flight):
    return NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])


def run(flight, rates, **options):
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    options = {"gravity": "somigliana", "vertical": "truth", "height": flight.height, **options}
    if options["vertical"] == "free":
        del options["height"]
    return navigate(imu, first_of(flight), rates_hz=rates, **options)


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rotation(v):
    """Rodrigues' formula."""
    angle = np.linalg.norm(v)
    k = skew(v)
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * k @ k


def matrix(q):
    w, v = q[0], q[1:]
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v)


def single_rate(flight):
    """Attitude, velocity, position, in that order, everything else from the step's start, in plain matrices."""
    latitude, longitude, height = flight.latitude[0], flight.longitude[0], flight.height[0]
    v, b, h = flight.velocity_ned[0].copy(), matrix(flight.q_nb[0]), flight.time[1] - flight.time[0]
    rows = [(latitude, longitude, height, *v)]
    for k in range(len(flight.dtheta)):
        s, c = np.sin(latitude), np.cos(latitude)
        r1 = A * (1 - E2) / (1 - E2 * s * s) ** 1.5 + height
        r2 = A / np.sqrt(1 - E2 * s * s) + height
        earth = OMEGA_IE * np.array([c, 0, -s])
        transport = np.array([v[1] / r2, -v[0] / r1, -v[1] * s / c / r2])
        surface = 9.7803253359 * (1 + 0.00193185265241 * s * s) / np.sqrt(1 - E2 * s * s)
        gravity = np.array([0, 0, surface * (1 - 2 * height / A)])
        # coning to the fourth order (Bortz): Δθ × its change from interval to interval, a twelfth
        before, after = flight.dtheta[max(k - 1, 0)], flight.dtheta[min(k + 1, len(flight.dtheta) - 1)]
        span = min(k + 1, len(flight.dtheta) - 1) - max(k - 1, 0)
        phi = flight.dtheta[k] + np.cross(flight.dtheta[k], (after - before) / span) / 12
        new = rotation(-(earth + transport) * h) @ b @ rotation(phi)
        change = 0.5 * (b + new) @ flight.dvel[k] + h * gravity
        new_v = v + change - h * np.cross(2 * earth + transport, v + 0.5 * change)
        mean = 0.5 * (v + new_v)
        longitude += h * mean[1] / r2 / np.cos(latitude + 0.5 * h * mean[0] / r1)
        latitude += h * mean[0] / r1
        height -= h * mean[2]
        v, b = new_v, new
        rows.append((latitude, longitude, height, *v))
    return np.array(rows)


@pytest.mark.parametrize(
    ("algorithm", "metres"), [("quaternion", 2e-6), ("rotation-vector-1p", 1e-4), *slow(("poisson", 2e-6))]
)
def test_equal_rates_are_the_single_rate_scheme(algorithm, metres):
    """To what the attitudes differ in: coning to the sixth, the fourth and the third order in the interval."""
    flight = STurn(duration=20).fly(20)
    expected = single_rate(flight)
    solution = run(flight, (20, 20, 20), algorithm=algorithm, vertical="free")
    np.testing.assert_array_equal(solution.time, flight.time)
    np.testing.assert_allclose(solution.latitude, expected[:, 0], rtol=0, atol=metres / A)
    np.testing.assert_allclose(solution.longitude, expected[:, 1], rtol=0, atol=metres / A)
    np.testing.assert_allclose(solution.height, expected[:, 2], rtol=0, atol=metres)
    np.testing.assert_allclose(solution.velocity_ned, expected[:, 3:], rtol=0, atol=0.1 * metres)
    # the scheme itself is much further from the truth
    assert np.max(np.abs(solution.velocity_ned - flight.velocity_ned)) > 1e-3


def velocity_error(flight, rates, **options):
    solution = run(flight, rates, **options)
    at = np.searchsorted(flight.time, solution.time - 1e-9)
    np.testing.assert_allclose(np.diff(solution.time), 1 / rates[2], rtol=0, atol=1e-9)
    return np.max(np.abs(solution.velocity_ned - flight.velocity_ned[at])[:, :2])


@pytest.fixture(scope="module")
def flight():
    return STurn(duration=240).fly(200)


def test_second_order_in_the_medium_interval(flight):
    found = [velocity_error(flight, (200, rate, 5), slow_quantities="extrapolate") for rate in (10, 20, 40)]
    orders = np.log2(np.array(found[:-1]) / np.array(found[1:]))
    np.testing.assert_allclose(orders, 2.0, rtol=0, atol=0.1)


@pytest.mark.parametrize(("slow_quantities", "order"), [("hold", 1.0), ("extrapolate", 2.0)])
def test_order_in_the_slow_interval(flight, slow_quantities, order):
    """The attitude feels the frame's rate alone, so the medium interval stays out of it."""

    def attitude_error(rate):
        solution = run(flight, (200, 200, rate), slow_quantities=slow_quantities)
        at = np.searchsorted(flight.time, solution.time - 1e-9)
        q, p = solution.q_nb, flight.q_nb[at]
        vector = p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - np.cross(p[:, 1:], q[:, 1:])
        return 2 * np.max(np.linalg.norm(vector, axis=1))

    found = [attitude_error(rate) for rate in (0.5, 1, 2)]
    orders = np.log2(np.array(found[:-1]) / np.array(found[1:]))
    np.testing.assert_allclose(orders, order, rtol=0, atol=0.15)


def test_extrapolation_pays(flight):
    held = velocity_error(flight, (200, 50, 1), slow_quantities="hold")
    ahead = velocity_error(flight, (200, 50, 1), slow_quantities="extrapolate")
    assert ahead < 0.1 * held


def test_fast_part_below_the_data_rate(flight):
    """Samples are summed: attitude at 50 Hz on 200 Hz data is attitude on 50 Hz data."""
    coarse = STurn(duration=240).fly(50)
    a, b = run(flight, (50, 25, 5)), run(coarse, (50, 25, 5))
    np.testing.assert_allclose(a.time, b.time, rtol=0, atol=1e-9)
    np.testing.assert_allclose(a.velocity_ned, b.velocity_ned, rtol=0, atol=1e-9)
    np.testing.assert_allclose(a.q_nb, b.q_nb, rtol=0, atol=1e-12)


@pytest.mark.parametrize("vertical", ["free", "baro-loop"])
def test_vertical_channels(flight, vertical):
    solution = run(flight, (200, 100, 20), vertical=vertical, slow_quantities="extrapolate")
    assert np.max(np.abs(solution.height - 5000)) < (0.5 if vertical == "free" else 0.05)


def test_euler_reports_its_singularity_at_three_rates():
    from tests.oracles.turntable import spin, turn

    flight = turn(spin(np.array([0.0, 0.5, 0.0]), np.array([np.cos(5e-4), np.sin(5e-4), 0, 0])), 5, 100)
    solution = run(flight, (100, 50, 10), algorithm="euler")
    (event,) = solution.events
    assert event.start < np.pi < event.end
    assert event.damage > 1e-3


@pytest.mark.parametrize(
    ("rates", "message"),
    [
        ((30, 10, 5), r"fast rate, 30 Hz.*data's rate, 50 Hz.*use 50 or 25 Hz"),
        ((50, 20, 5), r"medium rate, 20 Hz.*fast rate, 50 Hz.*use 25 or 16\.6666667 Hz"),
        ((50, 25, 10), r"slow rate, 10 Hz.*medium rate, 25 Hz.*use 12\.5 or 8\.33333333 Hz"),
        ((100, 50, 10), r"fast rate, 100 Hz.*use 50 Hz"),
        ((50, 25, 0), "slow rate, 0.0 Hz, must be positive"),
        ((50, float("nan"), 1), "must be three finite numbers, Hz.* or two: the rate of attitude"),
        ((50,), "must be three finite numbers, Hz"),
        ((50, 25, 5, 1), "must be three finite numbers, Hz"),
        ("50", "must be three finite numbers, Hz"),
        (50.0, "must be three finite numbers, Hz"),
        ((50, 20), r"medium rate, 20 Hz.*fast rate, 50 Hz.*use 25 or 16\.6666667 Hz"),
        ((50, 25, 0.05), r"100 samples, are shorter .* slow rate, 0\.05 Hz"),
    ],
)
def test_rates_that_do_not_divide(rates, message):
    with pytest.raises(InputError, match=message):
        run(STurn(duration=2).fly(50), rates)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"algorithm": "rotation-vector-2"}, "sample by sample, but rotation-vector-2"),
        ({"algorithm": "functional-iteration"}, "sample by sample, but functional-iteration"),
        ({"slow_quantities": "held"}, "unknown treatment of slow quantities 'held'.*hold"),
    ],
)
def test_what_three_rates_cannot_do(options, message):
    with pytest.raises(InputError, match=message):
        run(STurn(duration=2).fly(50), (50, 25, 5), **options)


def test_two_rates_are_those_of_attitude_and_of_the_rest(flight):
    two, three = run(flight, [100, 10]), run(flight, (100, 10, 10))
    np.testing.assert_array_equal(two.velocity_ned, three.velocity_ned)
    np.testing.assert_array_equal(two.time, three.time)


def test_a_frame_without_a_schedule_is_refused(monkeypatch):
    from dataclasses import replace

    from sinssim.strapdown.frames import FRAME_REGISTRY

    monkeypatch.setitem(FRAME_REGISTRY.shipped, "wander", replace(FRAME_REGISTRY["wander"], has_three_rates=False))
    with pytest.raises(InputError, match=r"works in the frames level, free-azimuth, .*, not in wander"):
        run(STurn(duration=2).fly(50), (50, 25, 5), frame="wander")


def test_three_rates_need_equal_intervals():
    flight = STurn(duration=2).fly(50)
    time = flight.time.copy()
    time[7] += 0.001
    imu = ImuData(time, flight.dtheta, flight.dvel)
    with pytest.raises(InputError, match="equal sampling intervals"):
        navigate(imu, first_of(flight), rates_hz=(50, 25, 5))
