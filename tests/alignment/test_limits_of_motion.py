"""Departures and limits of the tests for motion, each worked out by hand on a short session."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.alignment import Coefficients, Departure, Expected, Stillness, motion_errors, stillness
from sinssim.alignment.base_motion import ARCSEC
from sinssim.alignment.determination import pulse, white_level
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.imu_errors import WarmUp

G, COUNT, STEP, BEGIN = 10.0, 40, 0.5, 7.0
LENGTH = COUNT * STEP
EDGES = np.arange(COUNT + 1) * STEP
GYRO = {"random_walk": 3e-7, "quantum": 2e-7}
ACCEL = {"random_walk": 5e-6, "quantum": 4e-6}
RAMPS = {"gyro": (3e-10, 1e-10), "accel": (2e-7, 6e-7)}  # known and unknown: 20 times as much in the session
EACH = 0.5e-3 / (3 + 22 + 6 * 4)
"""Half of a false alarm in a thousand, over the bridge, the parts, and sums over 1, 2, 4 and 8 of 40 samples."""


def blocks() -> Expected:
    gyro, accel = (
        (TriadErrors(ramp=np.full(3, RAMPS[name][0])), TriadErrors(ramp=np.full(3, RAMPS[name][1]), **noise))
        for name, noise in (("gyro", GYRO), ("accel", ACCEL))
    )
    return Expected(ImuErrors(gyro[0], accel[0]), ImuErrors(gyro[1], accel[1]))


def session(turn: np.ndarray, lean: np.ndarray) -> ImuData:
    """Gyros that measure increments `turn`, (40, 3); accelerometers that feel the level block lean by `lean`."""
    dvel = G * STEP * np.column_stack([lean[:, 1], -lean[:, 0], np.full(COUNT, -1.0)])
    return ImuData(BEGIN + EDGES, turn, dvel)


def by_name(found: Stillness) -> dict[str, Departure]:
    return {one.what: one for one in found.departures}


def allowance(window: float) -> tuple[float, float]:
    """σ_d by the formula at the head of the module, and the 0.01″ of rounding."""
    white, walk, keep = 5e-6 / G, 3e-7, 1.0 - window / LENGTH
    variance = 2.0 * white**2 / window + walk**2 * (2.0 * window / 3.0 - window**2 / LENGTH)
    variance += (4e-6 / G / window) ** 2 / 3.0 + 2e-7**2 / 6.0  # pulses at the ends of a mean, and of an angle
    variance += (20.0 * 6e-7 / G) ** 2 + (0.5 * 20.0 * 1e-10 * window) ** 2  # drifts
    return float(np.sqrt(variance)) / keep, 0.01 * ARCSEC


SIGMA, WINDOW = min((allowance(count * STEP)[0], count * STEP) for count in range(1, 21))
HARMLESS = SIGMA + 0.01 * ARCSEC
DRIFT = {"gyro": 20.0 * (3e-10 + 3.0 * 1e-10), "tilt": 20.0 * (2e-7 + 3.0 * 6e-7) / G}
"""Largest changes of the readings: known, and three times the unknown one."""


def test_a_step_of_the_gyros_angle() -> None:
    """3 µrad in the 31st of 40 samples leave the line by ¾ of that, at its beginning."""
    turn = np.zeros((COUNT, 3))
    turn[30, 1] = 3e-6
    turn[:, 0] = 4e-5  # a steady turn is none
    found = by_name(stillness(session(turn, np.zeros((COUNT, 3))), blocks()))[
        "its gyros' angle departs from a steady turn by"
    ]
    limit = 3e-7 * np.sqrt(0.5 * np.log(2.0 / EACH) * LENGTH) + 2e-7 + 0.25 * DRIFT["gyro"] * LENGTH + HARMLESS
    assert found.size == pytest.approx(2.25e-6, rel=1e-9)
    assert found.time == BEGIN + 15.0
    assert found.limit == pytest.approx(limit, rel=1e-9)


@pytest.mark.parametrize(("lean", "size", "time", "span"), [
    (np.where(EDGES[1:] <= 10.0, -3e-6, 3e-6), 5e-6, 5.0, 10.0),  # one half against the other
    (np.where(np.arange(COUNT) // 2 == 13, 19e-6, -1e-6), 19e-6 * 5.0 / 3.0, 13.5, 1.0),  # one part of twenty
])  # fmt: skip
def test_a_part_whose_specific_force_differs(lean: np.ndarray, size: float, time: float, span: float) -> None:
    leaning = np.outer(lean, [1.0, 4.0 / 3.0, 0.0])  # with what is felt about both axes, 3-4-5
    found = by_name(stillness(session(np.zeros((COUNT, 3)), leaning), blocks()))["its specific force turns by"]
    limit = 5e-7 * np.sqrt(-2.0 * np.log(EACH) / span) + 4e-7 / span + np.sqrt(2.0) * DRIFT["tilt"] + HARMLESS
    assert found.size == pytest.approx(size, rel=1e-6)
    assert found.time == BEGIN + time
    assert found.limit == pytest.approx(limit, rel=1e-9)


def test_sums_over_samples() -> None:
    """Alternating angles a, −a: their sums over one sample have a variance of 40/39 a², over two of zero."""
    swings = np.where(np.arange(COUNT) % 2 == 0, 1.0, -1.0)
    turn, lean = np.outer(swings, [0.0, 2e-7, 5e-7]), np.outer(swings, [3e-7, -7e-7, 0.0])
    found = by_name(stillness(session(turn, lean), blocks()))
    for samples in (1, 2, 4, 8):
        span, sums = samples * STEP, COUNT // samples
        heavy = chi2.isf(EACH, sums - 1) / (sums - 1)
        one = found[f"its gyros' angle over {span:g} s varies (1σ) by"]
        square = 3e-7**2 * span * heavy + 2e-7**2 + (0.5 * DRIFT["gyro"] * span) ** 2 + HARMLESS**2
        assert one.size == pytest.approx(5e-7 * np.sqrt(40.0 / 39.0) if samples == 1 else 0.0, rel=1e-6, abs=1e-15)
        assert one.limit == pytest.approx(np.sqrt(square), rel=1e-9)
        assert one.time is None
        one = found[f"its specific force, averaged over {span:g} s, varies in direction (1σ) by"]
        square = 5e-7**2 * span * heavy + 4e-7**2 + (0.5 * DRIFT["tilt"] * span) ** 2
        square += 0.5 * (HARMLESS * max(span, WINDOW)) ** 2
        assert one.size == pytest.approx(7e-7 * np.sqrt(40.0 / 39.0) if samples == 1 else 0.0, rel=1e-6, abs=1e-15)
        assert one.limit == pytest.approx(np.sqrt(square) / span, rel=1e-9)
    assert len(found) == 3 + 2 * 4


def test_the_net_turn_of_any_motion_between() -> None:
    """The path at the edges in µrad; the accelerometers feel its mean in every interval."""
    path = np.cumsum(np.random.default_rng(2).normal(size=(COUNT + 1, 2)), axis=0) * 1e-6
    path -= 0.5 * (path[1:] + path[:-1]).mean(axis=0)  # so that the mean force is that of the level block
    turn = np.column_stack([np.diff(path, axis=0), np.full(COUNT, 4e-5)])
    found = stillness(session(turn, np.column_stack([0.5 * (path[1:] + path[:-1]), np.zeros(COUNT)])), blocks())
    np.testing.assert_allclose(found.net_turn[:2], path[-1] - path[0], rtol=1e-8)
    assert found.net_turn[2] == pytest.approx(0.0, abs=1e-15)
    assert found.net_turn_sigma == pytest.approx(SIGMA, rel=1e-12)
    # the known drift of both axes of the plumb line, and of the rate over the window; a false alarm is Rayleigh's
    known = np.sqrt(2.0) * 20.0 * (2e-7 / G + 0.5 * 3e-10 * WINDOW) / (1.0 - WINDOW / LENGTH)
    largest = known + SIGMA * np.sqrt(-2.0 * np.log(0.5e-3))
    assert found.net_turn_limit == pytest.approx(largest, rel=1e-12)
    whole = by_name(found)["from the first sample to the last the base turns by"]
    assert (whole.size, whole.time) == (pytest.approx(np.linalg.norm(path[-1] - path[0]), rel=1e-8), None)
    assert whole.limit == pytest.approx(largest + 0.01 * ARCSEC, rel=1e-12)
    assert (found.duration, found.graded) == (LENGTH, True)
    np.testing.assert_allclose(found.up, [0.0, 0.0, -1.0], rtol=0, atol=1e-12)


def test_the_session_begins_after_the_sensors_are_warm_or_cold() -> None:
    """A bias of 3e-9 rad/s per kelvin, which cools by 40 K in the first 20 s and by 10 K from 40 s to 60 s."""
    cooling = WarmUp(90.0, 10.0, 20.0 / np.log(2.0))
    known = ImuErrors(TriadErrors(bias_temperature=np.full(3, 3e-9)), warm_up=cooling)
    expected = Expected(known, ImuErrors(warm_up=cooling))
    imu = session(np.full((COUNT, 3), 1e-6), np.zeros((COUNT, 3)))
    limits = [
        by_name(stillness(imu, expected, start))["its gyros' angle departs from a steady turn by"].limit
        for start in (0.0, 40.0)
    ]
    assert limits[0] - limits[1] == pytest.approx(0.25 * 3e-9 * (40.0 - 10.0) * LENGTH, rel=1e-9)


def test_without_a_grade_the_record_tells_the_noise_and_small_departures_pass() -> None:
    swings = np.where(np.arange(COUNT) % 2 == 0, 1.0, -1.0)
    imu = session(np.outer(swings, [0.0, 2e-7, 5e-7]), np.outer(swings, [3e-7, -7e-7, 0.0]))
    found = stillness(imu)
    each = 0.5e-3 / (3 + 22 + 6)
    # differences are twice the amplitude: N² = ½ (2a)² / dt; a pulse is three times the amplitude
    walk, white = (np.sqrt(2.0) * size / np.sqrt(STEP) for size in (5e-7, 7e-7 * STEP))
    bridge = walk * np.sqrt(0.5 * np.log(2.0 / each) * LENGTH) + 3.0 * 5e-7 + 0.01 * ARCSEC
    tilts = [
        white * np.sqrt(-2.0 * np.log(each) / span) + 3.0 * 7e-7 * STEP / span + 0.01 * ARCSEC for span in (10.0, 1.0)
    ]
    assert len(found.departures) == 2
    assert not found.graded
    assert found.departures[0].limit == pytest.approx(np.hypot(bridge, 5.0 * ARCSEC), rel=1e-6)
    assert found.departures[1].limit in [pytest.approx(np.hypot(tilt, 1.5 * ARCSEC), rel=1e-6) for tilt in tilts]


def still(**changes: object) -> Stillness:
    departures = (
        Departure("its size was", 30.0 * ARCSEC, 20.0 * ARCSEC, 1234.5678),
        Departure("it was moved by", 6.66666 * ARCSEC, 3.123456 * ARCSEC, None),
    )
    values = {"departures": departures, "graded": True, "net_turn": np.array([3e-6 * 0.8, -4e-6, 3e-6 * 0.6]),
              "net_turn_sigma": 2e-6, "net_turn_limit": 7e-6, "duration": 300.0,
              "up": np.array([0.6, 0.0, -0.8])}  # fmt: skip
    return Stillness(**{**values, **changes})  # type: ignore[arg-type]


def test_the_covariance_of_the_net_turn_and_what_it_does_to_the_angles() -> None:
    """About the horizontal axes h₁ = (0.8, 0, 0.6) and h₂ = y the turn is (3, −4) µrad, about the vertical unknown."""
    basis = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [0.6, 0.0, -0.8]]).T
    covariance = basis @ (np.array([[13.0, -12.0, 0.0], [-12.0, 20.0, 0.0], [0.0, 0.0, 49.0]]) * 1e-12) @ basis.T
    np.testing.assert_allclose(still().turn_covariance, covariance, rtol=0, atol=1e-24)
    m, n, q, l, p, r = (np.eye(3)[k % 3] * size for k, size in enumerate((2e4, 1.0, 2.0, 3.0, 3e4, 4.0)))  # noqa: E741
    errors = motion_errors(Coefficients(m, n, q, l, p, r), still())
    xx = 0.64 * 13.0 + 0.36 * 49.0  # of the forward axis; the right one has 20
    expected = (2e4 * np.sqrt(xx) / 300.0, np.sqrt(33.0) / 2.0, np.sqrt(33.0) / 2.0, 3e4 * np.sqrt(20.0) / 300.0)
    np.testing.assert_allclose(errors, np.array(expected) * 1e-6, rtol=1e-12)


def test_what_is_said_of_a_vehicle_that_moved() -> None:
    """The worst is that of the largest ratio, not of the largest size."""
    remedy = (
        " arcsec. Align it as a disturbed base (--disturbed, align_disturbed), or use a part of the session in which "
        "the vehicle is stationary."
    )
    with pytest.raises(InputError) as info:
        still().require()
    assert str(info.value) == (
        "the vehicle moved during the session: it was moved by 6.667 arcsec, but the noise of the sensors' grade "
        "explains only 3.12" + remedy
    )
    with pytest.raises(InputError) as info:
        still(departures=still().departures[:1], graded=False).require()
    assert str(info.value) == (
        "the vehicle moved during the session: at 1234.57 s its size was 30 arcsec, but the noise in the record "
        "explains only 20" + remedy
    )
    still(departures=(Departure("at its limit", 2e-6, 2e-6),)).require()


def test_white_level_and_pulse_of_few_samples() -> None:
    """Differences of two samples are ½ N² of white noise; of sixteen parts the middle one counts."""
    swings = np.where(np.arange(64) % 2 == 0, 1.0, -1.0)
    increments = np.outer(swings, [1e-6, -3e-6, 2e-6])
    increments[40] = 1e-3  # a jolt in one part
    assert white_level(increments, 32.0) == pytest.approx(np.sqrt(0.5 * (2 * 3e-6) ** 2 / 0.5), rel=1e-9)
    assert white_level(np.outer(np.tile([1e-6, -1e-6], 128), [1.0, 1.0, 1.0]), 128.0) == 0.0  # 128 pairs are enough
    mean = increments.mean(axis=0)  # the jolt shifts it
    assert pulse(increments) == pytest.approx(3.0 * np.max(np.abs(mean) + np.array([1e-6, 3e-6, 2e-6])), rel=1e-9)
