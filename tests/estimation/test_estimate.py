"""The filter in closed and open loop, on time and late, with readings that lie and with none at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim import rotation
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array, ImuData, Measurements, NavState, rows_of
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel, Estimate, error_model
from sinssim.estimation.consistency import nees
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_result import corrected
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.estimation.worlds import (
    biases_only,
    errors_of,
    metres,
    not_turning,
    one_run,
    positions,
    standing,
    velocities,
    weaving,
)
from tests.slow import slow

DURATION = 300.0
SIGMA = biases_only("laser-standard")
MODEL = error_model(SIGMA, position=(5.0, 5.0, 5.0), velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))
SECONDS = np.arange(1.0, DURATION + 0.5)


def world(seed: int, model: ErrorModel = MODEL, sigma: ImuErrors = SIGMA, rate_hz: float = 20.0) -> tuple:
    flight, ideal = weaving(DURATION, rate_hz)
    run = one_run(flight, ideal, model, sigma, seed)
    rng = np.random.default_rng([5, seed])
    return flight, run, [positions(flight, SECONDS, rng), velocities(flight, SECONDS, rng)]


def only(m: Measurements, use: Array) -> Measurements:
    return replace(m, time=m.time[use], arrival=m.arrival[use], value=m.value[use], sigma=m.sigma[use])


def in_sigmas(a: Estimate, b: Estimate, at_a: Array, at_b: Array) -> float:
    """Return the largest difference of two estimates in standard deviations, at rows of each."""
    reference = navigation_error(rows_of(a.solution, at_a), b_rows(b, at_b))
    off = np.hstack([reference.position_ned, reference.velocity_ned, reference.attitude])
    parameters = [a.parameters[name][at_a] - b.parameters[name][at_b] for name in a.parameters]
    off = np.hstack([off, *parameters])
    return float(np.abs(off / a.sigma[at_a]).max())


def b_rows(estimate: Estimate, rows: Array):
    from sinssim.data import solution_of

    return solution_of(estimate.time[rows], rows_of(estimate.solution, rows), "")


def test_errors_lie_within_their_sigmas_and_biases_are_found() -> None:
    values = []
    for seed in range(3):
        flight, run, given = world(seed)
        result = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0)
        assert result.divergence is None
        errors = errors_of(MODEL, result, flight, run)
        values.append(nees(errors[result.rows[-1]], result.covariance[-1]))
        assert np.abs(errors[-1] / result.sigma[-1]).max() < 4.0
        vertical = MODEL.slices["accelerometer bias"].stop - 1
        assert result.sigma[-1, vertical] < 0.2 * MODEL.sigma[vertical]
        np.testing.assert_allclose(result.covariance[-1].diagonal(), result.sigma[result.rows[-1]] ** 2, rtol=1e-14)
    assert 0.5 * 15 < np.mean(values) < 1.6 * 15  # 3 × 15 degrees of freedom: 0.63 … 1.46 in 95 %


@pytest.mark.parametrize("seconds", [100, *slow(300)])
def test_what_is_fed_back_when_makes_no_difference(seconds: int) -> None:
    _, run, given = world(3)
    count = 20 * seconds
    imu = ImuData(run.imu.time[: count + 1], run.imu.dtheta[:count], run.imu.dvel[:count])
    given = [only(m, m.time <= seconds) for m in given]
    usual = estimate(imu, run.initial, given, MODEL)
    everything = np.arange(len(usual.time))
    textbook = estimate(imu, run.initial, given, MODEL, feedback_s=1.0)  # after every update
    assert in_sigmas(usual, textbook, everything, everything) < 0.01
    open_loop = estimate(imu, run.initial, given, MODEL, loop="open")
    # in the open loop the errors are as large as inertial navigation makes them: 0.4″ of second order in the attitude
    assert in_sigmas(usual, open_loop, everything, everything) < 0.1


def test_the_inertial_solution_stays_beside() -> None:
    _, run, given = world(0)
    result = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0)
    alone = navigate(run.imu, run.initial)
    assert result.inertial is not None
    np.testing.assert_array_equal(result.inertial.latitude, alone.latitude)
    np.testing.assert_array_equal(result.inertial.q_nb, alone.q_nb)


@pytest.mark.parametrize("loop", ["closed", "open"])
def test_without_measurements_the_result_is_inertial(loop: str) -> None:
    _, run, given = world(0)
    lost = [replace(m, value=np.full_like(m.value, np.nan)) for m in given]
    for measurements, remark in ((lost, "No measurement was used"), ([], "There are no measurements")):
        result = estimate(run.imu, run.initial, measurements, MODEL, rate_hz=5.0, loop=loop)
        assert any(remark in text and "inertial" in text for text in result.remarks)
        assert result.inertial is not None
        rows = np.searchsorted(result.inertial.time, result.time - 1e-9)
        for name, value in vars(rows_of(result.inertial, rows)).items():
            np.testing.assert_array_equal(getattr(result.solution, name), value)
        assert result.divergence is None
        assert all(not i.accepted.any() for i in result.innovations)
    assert "gnss-position: none of 300 measurements was used (300 not a finite number)" in " ".join(
        estimate(run.imu, run.initial, lost, MODEL, rate_hz=1.0).remarks
    )


def test_a_late_reading_counts_from_its_instant_and_is_known_when_it_arrives() -> None:
    _, run, (place, speed) = world(2)
    on_time = estimate(run.imu, run.initial, [place, speed], MODEL)
    late = replace(place, arrival=place.time + 0.35)
    delayed = estimate(run.imu, run.initial, [late, speed], MODEL)
    np.testing.assert_array_equal(on_time.time, delayed.time)
    tenth = np.round(delayed.time * 10.0).astype(int) % 10
    waiting = (tenth < 4) & (delayed.time >= 1.0)
    arrived = np.flatnonzero(~waiting)
    # the last digit of the latitude is 7e-10 m, σ 0.24 m
    assert in_sigmas(on_time, delayed, arrived, arrived) < 1e-8
    np.testing.assert_allclose(delayed.sigma[arrived], on_time.sigma[arrived], rtol=1e-12)
    # while it is on its way: as if it had ended one second earlier
    for second in (57.0, 100.0):
        shorter = [only(late, late.time < second), only(speed, speed.time <= second)]
        without = estimate(run.imu, run.initial, shorter, MODEL)
        rows = np.flatnonzero((delayed.time > second - 0.01) & (delayed.time < second + 0.31))
        assert len(rows) == 4
        same = np.searchsorted(without.time, delayed.time[rows] - 1e-9)
        assert in_sigmas(delayed, without, rows, same) < 1e-3
        np.testing.assert_allclose(delayed.sigma[rows], without.sigma[same], rtol=1e-4)
        assert np.all(delayed.sigma[rows, 0] > on_time.sigma[rows, 0])


@pytest.mark.parametrize("gate", [*slow(None), 1e-4])
def test_the_solution_holds_what_had_arrived_and_nothing_else(gate: float | None) -> None:
    """Positions late by 0.85 s, heights by 0.25 s, velocities at once, a lie among these: none delays another."""
    flight, run, _ = world(3)
    end = 40.0
    imu = ImuData(run.imu.time[:801], run.imu.dtheta[:800], run.imu.dvel[:800])
    rng = np.random.default_rng(31)
    seconds, fifths = np.arange(1.0, end), np.arange(0.2, end, 0.2)
    place, speed = positions(flight, seconds, rng), velocities(flight, fifths, rng)
    speed.value[150] += 3.0  # at 30.2 s, while a position is on its way
    tall = flight.state(seconds + 0.15).height[:, None] + 2.0 * rng.standard_normal((len(seconds), 1))
    height = Measurements("baro-height", seconds + 0.15, seconds + 0.4, tall, np.full((len(seconds), 1), 2.0))
    late = [replace(place, arrival=place.time + 0.85), height, speed]
    found = estimate(imu, run.initial, late, MODEL, gate=gate)
    for instant in (20.1, 20.9, 30.3, 30.5):
        arrived = [only(m, m.arrival <= instant + 1e-9) for m in late]
        by_then = estimate(imu, run.initial, arrived, MODEL, gate=gate)
        row, same = (np.array([np.searchsorted(e.time, instant - 1e-6)]) for e in (found, by_then))
        assert found.time[row[0]] == pytest.approx(instant, abs=1e-6)
        assert in_sigmas(found, by_then, row, same) < 1e-3, instant
        np.testing.assert_allclose(found.sigma[row], by_then.sigma[same], rtol=1e-5)


def test_zero_rates_in_time_beside_a_late_receiver() -> None:
    """The covariance of the attitude with the gyros' noise goes with each of the estimates, too."""
    run_time = 60.0
    standing_still = Parked(0.8, 0.2, 100.0, np.array([1.0, 0.0, 0.0, 0.0]), run_time)
    imu = standing_still.increments(20.0)
    rng = np.random.default_rng(7)
    seconds = np.arange(1.0, run_time)
    fixes = positions(standing_still, seconds, rng)
    late = [replace(fixes, arrival=fixes.time + 0.7), not_turning(np.arange(0.5, run_time, 0.5), rng, 1e-7)]
    first = standing_still.state(np.zeros(1))
    initial = NavState(*(part[0] for part in vars(first).values()))
    found = estimate(imu, initial, late, MODEL, gate=None)
    for instant in (40.2, 40.6, 40.9):
        arrived = [only(m, m.arrival <= instant + 1e-9) for m in late]
        by_then = estimate(imu, initial, arrived, MODEL, gate=None)
        row, same = (np.array([np.searchsorted(e.time, instant - 1e-6)]) for e in (found, by_then))
        assert in_sigmas(found, by_then, row, same) < 1e-3
        np.testing.assert_allclose(found.sigma[row], by_then.sigma[same], rtol=1e-5)


def test_readings_later_than_the_next_ones_are_taken_in_order() -> None:
    _, run, (place, speed) = world(2)
    on_time = estimate(run.imu, run.initial, [place, speed], MODEL, rate_hz=5.0, history=True)
    very_late = replace(place, arrival=place.time + 2.5)
    delayed = estimate(run.imu, run.initial, [very_late, speed], MODEL, rate_hz=5.0, history=True)
    # what was known at t is what is known on time of readings up to t − 2.5 s, predicted
    assert np.all(delayed.sigma[50:, 0] >= on_time.sigma[50:, 0])
    assert on_time.history is not None
    assert delayed.history is not None
    np.testing.assert_allclose(delayed.history.covariance, on_time.history.covariance, rtol=1e-6, atol=1e-18)


def test_readings_between_the_samples() -> None:
    flight, run, _ = world(4)
    rng = np.random.default_rng(0)
    instants = np.sort(rng.uniform(0.5, DURATION, 300))
    exact = [positions(flight, instants, rng, (1e-3,) * 3), velocities(flight, instants, rng, 1e-4)]
    result = estimate(run.imu, run.initial, exact, MODEL, gate=None)
    errors = errors_of(MODEL, result, flight, run)[300:]
    # 200 m/s over half a sample of 50 ms would be 5 m
    assert np.sqrt(np.mean(errors[:, :3] ** 2)) < 2e-3


def test_a_jump_is_gated_and_said() -> None:
    flight, run, (place, speed) = world(1)
    north, _ = metres(flight.state(place.time))
    wrong = (place.time > 100.0) & (place.time <= 120.0)
    value = place.value.copy()
    value[wrong, 0] += 50.0 / north[wrong]
    result = estimate(run.imu, run.initial, [replace(place, value=value), speed], MODEL, rate_hz=5.0)
    record = result.innovations[0]
    assert not record.accepted[wrong].any()
    assert record.accepted[~wrong].mean() > 0.99
    assert all("beyond the gate" in record.reason[k] for k in np.flatnonzero(wrong))
    assert np.all(record.nis[wrong] > record.bound)
    assert any(text.startswith("gnss-position: the gate rejected 2") for text in result.remarks)
    assert np.abs(errors_of(MODEL, result, flight, run)[:, 0]).max() < 20.0
    assert result.divergence is None  # velocities were taken in all the time
    ungated = estimate(run.imu, run.initial, [replace(place, value=value), speed], MODEL, rate_hz=5.0, gate=None)
    assert ungated.innovations[0].accepted.all()


def test_a_slow_ramp_is_not_gated_and_its_fixes_are_withdrawn() -> None:
    """0.2 m/s to the north from 100 s on, in the velocities as well."""
    flight, run, (place, speed) = world(1)
    late = SECONDS - 100.0
    north, _ = metres(flight.state(place.time))
    forged, faster = place.value.copy(), speed.value.copy()
    forged[late > 0.0, 0] += 0.2 * late[late > 0.0] / north[late > 0.0]
    faster[late > 0.0, 0] += 0.2
    told = [replace(place, value=forged), replace(speed, value=faster)]
    gated = estimate(run.imu, run.initial, told, MODEL, rate_hz=5.0)
    assert min(i.accepted[late > 30.0].mean() for i in gated.innovations) > 0.9
    assert all(i.withdrawn == np.inf for i in gated.innovations)
    watched = estimate(run.imu, run.initial, told, MODEL, rate_hz=5.0, monitor_s=100.0)
    (since,) = {i.withdrawn for i in watched.innovations}
    assert 110.0 < since < 260.0
    for i, before in zip(watched.innovations, gated.innovations, strict=True):
        after = i.time > since
        assert not i.accepted[after].any()
        assert set(np.array(i.reason)[after]) == {"withdrawn by the monitor of the innovations"}
        np.testing.assert_array_equal(i.value[~after], before.value[~after])
        assert f"{i.sensor}: withdrawn from {since:.0f} s on, because the sum" in " ".join(watched.remarks)
    assert watched.divergence is None
    right = estimate(run.imu, run.initial, [place, speed], MODEL, rate_hz=5.0, monitor_s=100.0)
    assert all(i.withdrawn == np.inf for i in right.innovations)
    with pytest.raises(InputError, match="monitor_s = -1"):
        estimate(run.imu, run.initial, [place], MODEL, monitor_s=-1.0)


def test_filter_and_sensor_that_contradict_are_reported() -> None:
    flight, run, (place, _) = world(1)
    north, _ = metres(flight.state(place.time))
    value = place.value.copy()
    value[150:, 0] += 300.0 / north[150:]
    result = estimate(run.imu, run.initial, [replace(place, value=value)], MODEL, rate_hz=5.0)
    assert result.divergence is not None
    assert result.divergence.time == 151.0
    assert result.divergence.measurement == "gnss-position 150 (valid at 151.000 s)"
    assert "rejected" in result.divergence.reason
    assert result.time[-1] == DURATION  # all of it is there


def test_a_filter_that_cannot_go_on_keeps_what_it_has() -> None:
    _, run, (place, _) = world(1)
    # The variances of a place somewhere in the solar system and of a millimetre do not go into one double.
    lost = error_model(SIGMA, position=1e8, velocity=1e8, attitude=1.0)
    given = only(replace(place, sigma=np.full_like(place.sigma, 1e-3)), place.time > 60.0)
    result = estimate(run.imu, run.initial, [given], lost, rate_hz=5.0, gate=None)
    assert result.divergence is not None
    assert result.divergence.reason == "the covariance is no longer positive definite"
    assert result.divergence.measurement.startswith("gnss-position ")
    assert 60.0 < result.divergence.time < 70.0
    assert 60.0 < result.time[-1] < result.divergence.time
    assert len(result.solution.latitude) == len(result.time) == len(result.sigma)
    assert result.rows[-1] < len(result.time)
    assert np.isfinite(result.sigma).all()


def test_an_engine_that_fails_under_the_filter() -> None:
    to_the_pole = GreatCircle(np.radians(89.5), 0.0, 9000.0, 0.0, 250.0, 300.0)
    run = one_run(to_the_pole, to_the_pole.increments(10.0), MODEL, SIGMA, 1)
    given = positions(to_the_pole, SECONDS, np.random.default_rng(0))
    result = estimate(run.imu, run.initial, [given], MODEL, rate_hz=5.0)
    assert result.divergence is not None
    assert "inertial navigation failed: the north-pointing level frame" in result.divergence.reason
    assert result.divergence.reason.endswith("The frames wander, free-azimuth, transverse and inertial pass the poles")
    assert 100.0 < result.time[-1] < 180.0  # within 11 km of it, 44 km on
    assert np.isfinite(result.sigma).all()
    assert result.inertial is None
    assert "The pure inertial solution failed" in result.remarks[0]


def test_what_cannot_be_compensated_ends_the_filter() -> None:
    """Without a gate, fixes that are certain to a millimetre and jump by 100 km make scale factors below −1."""
    _, run, (place, *_) = world(0)
    own = ImuErrors(*(replace(t, scale=np.full(3, 1e-3)) for t in (SIGMA.gyro, SIGMA.accel)))
    blocks = ("gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale")
    model = error_model(own, position=1e-3, velocity=1e-3, attitude=1e-6, imu=blocks)
    value = place.value.copy()
    value[100:, 0] += 1e5 / 6.4e6
    jumping = replace(place, value=value, sigma=np.full_like(place.sigma, 1e-3))
    result = estimate(run.imu, run.initial, [jumping], model, rate_hz=5.0, gate=None)
    assert result.divergence is not None
    assert result.divergence.time == pytest.approx(result.time[-1])
    assert result.divergence.measurement.startswith("gnss-position 10")
    assert "cannot be inverted" in result.divergence.reason
    assert result.inertial is not None
    assert len(result.inertial.time) == len(run.imu.time)


def test_the_alignments_covariance_may_start_it() -> None:
    _, run, given = world(1)
    p = np.diag(MODEL.sigma**2)
    p[8, 10] = p[10, 8] = 0.9 * MODEL.sigma[8] * MODEL.sigma[10]
    usual = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0)
    tied = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0, covariance=p)
    np.testing.assert_allclose(tied.covariance[0], p, rtol=1e-12)
    assert tied.sigma[-1, 10] < usual.sigma[-1, 10]
    core = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0, covariance=p[:9, :9])
    np.testing.assert_allclose(core.sigma[-1], usual.sigma[-1], rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"loop": "half"}, "closed"),
        ({"gate": 0.0}, "gate = 0"),
        ({"feedback_s": -1.0}, "feedback_s"),
        ({"covariance": np.eye(4)}, "first 9 to 15"),
        ({"covariance": np.eye(16)}, "first 9 to 15"),
        ({"covariance": np.diag([*np.ones(8), -1.0])}, "semi-definite"),
        ({"covariance": np.full((9, 9), np.nan)}, "finite"),
        ({"covariance": np.eye(9) + 0.1 * np.triu(np.ones((9, 9)), 1)}, "symmetric"),
        ({"algorithm": "functional-iteration"}, "windows of samples"),
        ({"frame": "levle"}, "unknown frame"),
        ({"frame": "inertial", "curvature": "simplified"}, "would have no effect"),
        ({"axes": "east"}, "unknown axes of errors"),
    ],
)
def test_refused(options: dict, message: str) -> None:
    _, run, given = world(0)
    with pytest.raises(InputError, match=message):
        estimate(run.imu, run.initial, given, MODEL, **options)


@pytest.mark.parametrize("runs", [1, *slow(4)])
def test_all_fifteen_to_thirty_three_states_at_once(runs: int) -> None:
    """Scale factors, misalignments, a Gauss-Markov bias, a lever arm and a barometer's bias: NEES of a few runs."""
    sigma = expected_errors(Imu(grade="mems-industrial")).sigma
    arm = np.array([0.3, 0.1, -1.2])
    model = error_model(
        sigma,
        position=3.0,
        velocity=0.1,
        attitude=(5e-3, 5e-3, 2e-2),
        imu=("gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale", "gyro misalignment"),
        extra=(Block("gnss lever arm", 0.1), Block("baro-height bias", 10.0)),
    )
    assert model.size == 9 + 6 + 6 + 6 + 3 + 3 + 1
    values = []
    flight, ideal = weaving(DURATION, 50.0)
    for seed in range(runs):
        run = one_run(flight, ideal, model, sigma, seed)
        rng = np.random.default_rng([5, seed])
        truth = flight.state(SECONDS)
        offset = rotation.rotate(truth.q_nb, arm + run.parameters["gnss lever arm"])
        antenna = corrected(truth, np.hstack([-offset, np.zeros((len(offset), 6))]), WGS84)
        place = positions(flight, SECONDS, rng)
        value = place.value + np.column_stack(
            [antenna.latitude - truth.latitude, antenna.longitude - truth.longitude, antenna.height - truth.height]
        )
        heights = truth.height[:, None] + run.parameters["baro-height bias"] + rng.standard_normal((len(SECONDS), 1))
        baro = Measurements("baro-height", SECONDS, SECONDS, heights, np.ones_like(heights))
        given = [replace(place, value=value, lever_arm=arm), baro]
        result = estimate(run.imu, run.initial, given, model, gate=None)
        errors = errors_of(model, result, flight, run)
        values.append(nees(errors[-1], result.covariance[-1]) / model.size)
        assert result.sigma[-1, -1] < 1.0  # the bias of the barometer, from 10 m
    few = np.sqrt(4.0 / runs)
    assert 1.0 - 0.3 * few < np.mean(values) < 1.0 + 0.35 * few  # 4 × 34 degrees of freedom: 0.78 … 1.25 in 95 %


@pytest.mark.parametrize("hours", [pytest.param(1.0, id="1h"), pytest.param(24.0, id="24h", marks=pytest.mark.slow)])
def test_the_covariance_stays_one(hours: float) -> None:
    """Symmetric and positive definite; parked, where many states are seen by nothing but each other."""
    duration = hours * 3600.0
    place = Parked(0.9, 0.2, 100.0, rotation.quaternion_from_euler(0.01, 0.02, 1.0), duration)
    rng = np.random.default_rng(0)
    errors = ImuErrors(TriadErrors(random_walk=8e-7), TriadErrors(random_walk=1e-4))
    run = one_run(place, place.increments(1.0), MODEL, replace(SIGMA, gyro=errors.gyro, accel=errors.accel), 0)
    time = np.arange(10.0, duration + 1.0, 10.0)
    given = [positions(place, time, rng), standing(time, rng)]
    result = estimate(run.imu, run.initial, given, MODEL, rate_hz=1.0)
    assert result.divergence is None
    assert result.time[-1] == duration
    p = result.covariance
    assert np.abs(p - p.transpose(0, 2, 1)).max() <= 1e-12
    scale = np.sqrt(np.einsum("kii->ki", p))
    correlation = p / (scale[:, :, None] * scale[:, None, :])
    assert np.abs(correlation - correlation.transpose(0, 2, 1)).max() <= 1e-12
    assert np.linalg.eigvalsh(correlation).min() > 0.0


def test_a_fix_with_correlated_errors() -> None:
    """The covariance after one fix is that of Bayes for two Gaussian variables, (P⁻¹ + R⁻¹)⁻¹."""
    flight, ideal = weaving(2.0, 20.0)
    sigma = np.array([2.0, 3.0, 4.0])
    rho = np.array([[1.0, 0.7, -0.3], [0.7, 1.0, 0.2], [-0.3, 0.2, 1.0]])
    start = flight.state(0.0)
    value = np.array([[start.latitude, start.longitude, start.height]])
    zero = np.zeros(1)
    fix = Measurements("gnss-position", zero, zero, value, sigma[None], correlation=rho[None])
    found = estimate(ideal, start, [fix], MODEL, rate_hz=20.0)
    r = rho * np.outer(sigma, sigma)
    expected = np.linalg.inv(np.eye(3) / 5.0**2 + np.linalg.inv(r))
    np.testing.assert_allclose(found.covariance[0][:3, :3], expected, rtol=1e-9)
