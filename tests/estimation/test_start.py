"""Alignment by the filter: on the ground after the analytic determination, in motion from nothing, from a master."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim import rotation
from sinssim.alignment import determine_session, initial_covariance, initial_state
from sinssim.alignment.alignment_in_motion import WIDER, align_in_motion
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError, RunError
from sinssim.estimation import Block, ErrorModel, error_model
from sinssim.estimation.consistency import consistency, nees
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_start import at_rest
from sinssim.sensors import ImuErrors, TriadErrors, flicker
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.estimation.worlds import (
    biases_only,
    errors_of,
    not_turning,
    one_run,
    positions,
    standing,
    velocities,
    weaving,
)
from tests.slow import slow

LATITUDE = np.radians(50.0)
NAVIGATION = biases_only("laser-navigation")
FIRST = 60.0
"""The session from which the attitude is determined analytically, s; the filter has the rest."""


def gyrocompass(total: float, seed: int, *, zero_rate: bool = False) -> tuple[float, float]:
    """Return error and predicted σ of the heading after so many seconds, rad."""
    model = error_model(NAVIGATION, position=1.0, velocity=0.01)
    rng = np.random.default_rng([3, seed])
    heading = rng.uniform(0.0, 2.0 * np.pi)
    place = Parked(LATITUDE, 0.3, 200.0, rotation.quaternion_from_euler(0.02, -0.03, heading), total)
    imu = one_run(place, place.increments(10.0), model, NAVIGATION, seed).imu
    k = round(FIRST * 10.0)
    found = determine_session(ImuData(imu.time[: k + 1], imu.dtheta[:k], imu.dvel[:k]))
    start = initial_state(found, 0.3, 200.0, LATITUDE)
    p = initial_covariance(found, NAVIGATION, FIRST, height=200.0, latitude=LATITUDE, position_sigma=(1.0, 1.0, 1.0))
    time = np.arange(FIRST + 1.0, total + 0.5)
    given = [standing(time, rng)] + ([not_turning(time, rng)] if zero_rate else [])
    rest = ImuData(imu.time[k:], imu.dtheta[k:], imu.dvel[k:])
    result = estimate(rest, start, given, model, covariance=p, rate_hz=1.0, gate=None)
    assert result.divergence is None
    error = navigation_error(place.state(result.time), result.solution)
    return float(error.attitude[-1, 2]), float(result.sigma[-1, 8])


def expected(total: float) -> float:
    """σ_ψ = √(σ_b² + N²/T)/(ω_ie cos φ) of the east gyro."""
    gyro = NAVIGATION.gyro
    return float(np.sqrt(gyro.bias[0] ** 2 + gyro.random_walk**2 / total) / (OMEGA_IE * np.cos(LATITUDE)))


LONG = [
    pytest.param(t, z, marks=pytest.mark.slow) for t, z in ((30.0, False), (30.0, True), (60.0, False), (60.0, True))
]


@pytest.mark.parametrize("gravity", ["normal", "j2", "somigliana"])
@pytest.mark.parametrize(("latitude", "height"), [(0.9, 3000.0), (-0.6, 8000.0), (0.7, -400.0), (1.5, 300.0)])
def test_the_attitude_at_rest_refers_to_the_normal_of_the_ellipsoid(
    gravity: str, latitude: float, height: float
) -> None:
    """Gravity, by which eq. (1) levels, departs from the normal by up to 0.17\" per km of height."""
    q_nb = rotation.quaternion_from_euler(0.1, -0.2, 2.0)
    place = Parked(latitude, 0.3, height, q_nb, 20.0, gravity=gravity)
    imu, truth = place.increments(10.0), place.state(0.0)
    model = error_model(NAVIGATION, position=1.0, velocity=0.01)
    found = at_rest(imu, truth, model, NAVIGATION, 100, gravity=gravity).state.q_nb
    apart = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(truth.q_nb), found))
    # the mean of increments in body axes, which turn with the Earth, is exact to (ω T)²/24
    assert np.linalg.norm(apart) < 1e-7 * 1e-2


def test_flicker_in_the_heading_at_rest_is_that_of_the_mean_of_the_samples() -> None:
    """Without a state for the bias it adds that of the mean of 100 samples of 10 Hz over ω_ie cos φ, by squares."""
    place = Parked(LATITUDE, 0.3, 200.0, rotation.quaternion_from_euler(0.0, 0.0, 2.0), 20.0)
    blocks = (Block("position", np.ones(3)), Block("velocity", np.full(3, 0.01)), Block("attitude", np.full(3, 0.1)))
    imu, state, model, size = place.increments(10.0), place.state(0.0), ErrorModel(blocks, 0.0, 0.0), 1e-7

    def variance(of: float) -> float:
        sigma = ImuErrors(TriadErrors(flicker=of), TriadErrors())
        covariance = at_rest(imu, state, model, sigma, 100, NAVIGATION).covariance
        assert covariance is not None
        return float(covariance[8, 8])

    of_mean = size * np.sqrt(flicker.variance_of_mean(100.0))
    added = np.sqrt(variance(size) - variance(0.0))
    assert added == pytest.approx(of_mean / (OMEGA_IE * np.cos(LATITUDE)), rel=1e-4)


@pytest.mark.parametrize(("minutes", "zero_rate"), [(5.0, False), (5.0, True), (10.0, False), (10.0, True), *LONG])
def test_gyrocompassing_is_as_good_as_the_east_gyro(minutes: float, zero_rate: bool) -> None:
    _, sigma = gyrocompass(60.0 * minutes, 0, zero_rate=zero_rate)
    # a gyro that is known to stand still needs no accelerometer to tell drift from tilt
    assert sigma == pytest.approx(expected(60.0 * minutes), rel=0.02 if zero_rate else 0.10)


@pytest.mark.parametrize(
    ("minutes", "runs"),
    [
        pytest.param(5.0, 5, id="5min"),
        *(pytest.param(m, 100, id=f"{m:g}min-100", marks=pytest.mark.slow) for m in (5.0, 10.0, 30.0, 60.0)),
    ],
)
def test_actual_headings_agree_with_it(minutes: float, runs: int) -> None:
    errors, sigmas = np.array([gyrocompass(60.0 * minutes, seed) for seed in range(runs)]).T
    np.testing.assert_allclose(sigmas, expected(60.0 * minutes), rtol=0.10)
    # the rms of 5 (100) numbers is within 62 % (14 %) of σ in 95 %, the largest below 2.6 (3.5) σ
    assert np.sqrt(np.mean((errors / sigmas) ** 2)) == pytest.approx(1.0, abs=0.62 if runs == 5 else 0.15)
    assert np.abs(errors / sigmas).max() < 3.5


@pytest.mark.parametrize(
    ("grade", "seconds", "runs"),
    [
        ("mems-industrial", 90.0, 1),
        *slow(("mems-industrial", 90.0, 3), ("laser-standard", 60.0, 2)),
        *(pytest.param(g, s, 40, marks=pytest.mark.slow) for g, s in (("mems-industrial", 90.0), ("tactical", 60.0))),
    ],
)
def test_alignment_in_motion_from_nothing(grade: str, seconds: float, runs: int) -> None:
    sigma = biases_only(grade)
    model = error_model(sigma)
    time = np.arange(1.0, 400.5)
    flight, ideal = weaving(400.0, 25.0)
    coarse, fine = [], []
    for seed in range(runs):
        run, rng = one_run(flight, ideal, model, sigma, seed), np.random.default_rng([6, seed])
        place, speed = positions(flight, time, rng), velocities(flight, time, rng)
        k, imu = round(seconds * 25.0), run.imu
        found = align_in_motion(ImuData(imu.time[: k + 1], imu.dtheta[:k], imu.dvel[:k]), place, speed, sigma)
        truth = flight.state(imu.time[found.edge])
        off = rotation.rotation_vector_from_quaternion(
            rotation.multiply(truth.q_nb, rotation.conjugate(found.state.q_nb))
        )
        assert np.degrees(np.linalg.norm(off)) < (15.0 if grade == "mems-industrial" else 3.0)
        coarse.append(9.0 * off @ np.linalg.solve(found.covariance[6:, 6:], off) / 3.0)
        np.testing.assert_allclose(3.0 * found.sigma, np.sqrt(found.covariance[6:, 6:].diagonal()))
        rest = ImuData(imu.time[found.edge :], imu.dtheta[found.edge :], imu.dvel[found.edge :])
        result = estimate(rest, found.state, [place, speed], model, covariance=found.covariance, rate_hz=5.0)
        assert result.divergence is None
        errors = errors_of(model, result, flight, run)[result.rows]
        fine.append(nees(errors[[30, 100, -1]], result.covariance[[30, 100, -1]]) / model.size)
        assert np.degrees(np.abs(errors[-1, 8])) < 0.5
    # the alignment's own σ is right, and the filter that starts from it is consistent all the way
    lower, upper = chi2.ppf((0.005, 0.995), 3 * runs) / (3 * runs)
    assert lower < np.mean(coarse) < upper
    lower, upper = chi2.ppf((0.005, 0.995), model.size * runs) / (model.size * runs)
    assert np.all((np.mean(fine, axis=0) > lower) & (np.mean(fine, axis=0) < upper))


ALONE = {
    "fixes": (ImuErrors(), 0.2),
    "accelerometers": (ImuErrors(TriadErrors(), TriadErrors(random_walk=0.05)), 1e-6),
    "gyros": (ImuErrors(TriadErrors(random_walk=2e-4), TriadErrors()), 1e-6),
}
"""One noise at a time: of the sensors in rad/√s and m/s/√s, of the velocity's fixes in m/s."""


@pytest.mark.parametrize("name", ALONE)
def test_each_noise_alone_is_in_the_covariance_of_an_alignment_in_motion(name: str) -> None:
    """White noise put on the increments here, N√Δt of each: the spread of the attitudes against the stated one."""
    noise, fix_sigma = ALONE[name]
    flight, ideal = weaving(100.0, 25.0)
    time, runs = np.arange(1.0, 100.5), 60
    squares = []
    step = np.sqrt(np.diff(ideal.time))[:, None]
    exact = align_in_motion(
        ideal, positions(flight, time, np.random.default_rng(0), (1e-3, 1e-3, 1e-3)),
        velocities(flight, time, np.random.default_rng(0), 1e-6), ImuErrors(),
    )  # fmt: skip
    assert exact.residual < 0.02
    for seed in range(runs):
        rng = np.random.default_rng([11, seed])
        spoiled = ImuData(
            ideal.time,
            ideal.dtheta + noise.gyro.random_walk * step * rng.standard_normal(ideal.dtheta.shape),
            ideal.dvel + noise.accel.random_walk * step * rng.standard_normal(ideal.dvel.shape),
        )
        place = positions(flight, time, rng, (1e-3, 1e-3, 1e-3))
        found = align_in_motion(spoiled, place, velocities(flight, time, rng, fix_sigma), noise)
        # what the method itself leaves without any noise is not the noise's
        off = rotation.rotation_vector_from_quaternion(
            rotation.multiply(exact.state.q_nb, rotation.conjugate(found.state.q_nb))
        )
        squares.append(WIDER**2 * off @ np.linalg.solve(found.covariance[6:, 6:], off) / 3.0)
    lower, upper = chi2.ppf((0.0005, 0.9995), 3 * runs) / (3 * runs)
    assert lower < np.mean(squares) < upper


def test_alignment_in_motion_with_the_antenna_on_a_lever_arm() -> None:
    sigma = ImuErrors(TriadErrors(), TriadErrors())
    flight, imu = weaving(120.0, 25.0)
    time, rng = np.arange(1.0, 120.5), np.random.default_rng(0)
    arm = np.array([8.0, 0.0, -3.0])
    truth = flight.state(time)
    rate = flight.rates(time)[0]
    q_eb = rotation.multiply(earth_q_en(truth), truth.q_nb)
    spin = rotation.rotate(rotation.conjugate(q_eb), np.array([0.0, 0.0, OMEGA_IE]))
    swing = rotation.rotate(truth.q_nb, np.cross(rate - spin, arm))
    speed = velocities(flight, time, rng, 1e-3)
    speed = replace(speed, value=speed.value + swing, lever_arm=arm)
    place = positions(flight, time, rng, (0.1, 0.1, 0.1))
    with_arm = align_in_motion(imu, place, speed, sigma)
    without = align_in_motion(imu, place, replace(speed, lever_arm=np.zeros(3)), sigma)
    assert with_arm.residual < 0.02
    assert without.residual > 10.0 * with_arm.residual
    off = rotation.multiply(truth.q_nb[0], rotation.conjugate(with_arm.state.q_nb))
    assert np.degrees(np.linalg.norm(rotation.rotation_vector_from_quaternion(off))) < 0.05
    np.testing.assert_allclose(with_arm.state.velocity_ned, truth.velocity_ned[0], atol=0.02)


@pytest.mark.parametrize("delay", [0.05, 0.2625, 1.3])
def test_alignment_in_motion_with_velocities_older_than_the_positions(delay: float) -> None:
    """Velocities valid before the positions, by less and by more than the step of the fixes: the known heading."""
    sigma = ImuErrors(TriadErrors(), TriadErrors())
    flight, imu = weaving(120.0, 25.0)
    time, rng = np.arange(2.0, 120.5), np.random.default_rng(0)
    speed = velocities(flight, time - delay, rng, 1e-3)
    place = positions(flight, time, rng, (0.1, 0.1, 0.1))
    found = align_in_motion(imu, place, speed, sigma)
    truth = flight.state(imu.time[found.edge])
    off = rotation.multiply(truth.q_nb, rotation.conjugate(found.state.q_nb))
    assert np.degrees(np.linalg.norm(rotation.rotation_vector_from_quaternion(off))) < 0.05
    metre = 1.0 / 6.4e6
    # half the acceleration times the square of the time between them
    np.testing.assert_allclose(found.state.latitude, truth.latitude, atol=1.0 * metre)
    np.testing.assert_allclose(found.state.velocity_ned, truth.velocity_ned, atol=0.2)


def earth_q_en(state: NavState) -> Array:
    from sinssim import earth

    return earth.q_en(state.latitude, state.longitude)


def test_alignment_in_motion_refuses_what_shows_nothing() -> None:
    straight = GreatCircle(0.8, 0.2, 5000.0, 1.0, 200.0, 100.0)
    imu = straight.increments(25.0)
    time, rng = np.arange(1.0, 100.5), np.random.default_rng(0)
    place, speed = positions(straight, time, rng), velocities(straight, time, rng)
    with pytest.raises(RunError, match=r"from t = 1 s to 100 s: the vehicle accelerated too little"):
        align_in_motion(imu, place, speed, biases_only("consumer"))
    # to gyros that are good enough the turn of the Earth under the flight shows north even so
    found = align_in_motion(imu, place, speed, biases_only("laser-navigation"))
    truth = straight.state(imu.time[found.edge])
    off = rotation.rotation_vector_from_quaternion(rotation.multiply(truth.q_nb, rotation.conjugate(found.state.q_nb)))
    assert np.degrees(found.sigma[2]) < 5.0
    assert np.abs(off / found.sigma).max() < 3.5
    late = place.time + 75.0
    few = replace(place, time=late), replace(speed, time=late)
    with pytest.raises(InputError, match="at least 40 s"):
        align_in_motion(imu, *few, biases_only("tactical"))
    with pytest.raises(InputError, match="gnss-velocity"):
        align_in_motion(imu, place, place, biases_only("tactical"))


def test_transfer_alignment_from_a_master() -> None:
    """A tactical unit, two degrees wrong, takes velocity and attitude from a better one that is mounted askew."""
    sigma = biases_only("tactical")
    askew = 2e-3
    model = error_model(
        sigma, position=10.0, velocity=1.0, attitude=0.035, extra=(Block("master bias", np.full(3, askew)),)
    )
    flight, ideal = weaving(240.0, 25.0)
    time = np.arange(0.5, 240.0, 0.5)
    values, found = [], []
    for seed in range(2):
        run, rng = one_run(flight, ideal, model, sigma, seed), np.random.default_rng([8, seed])
        truth = flight.state(time)
        speed = replace(velocities(flight, time, rng, 0.02), name="master velocity")
        turn = run.parameters["master bias"] + 1e-4 * rng.standard_normal((len(time), 3))
        value = rotation.multiply(truth.q_nb, rotation.quaternion_from_rotation_vector(turn))
        attitude = Measurements("attitude", time, time, value, np.full((len(time), 3), 1e-4), name="master")
        result = estimate(run.imu, run.initial, [speed, attitude], model, rate_hz=5.0)
        assert result.divergence is None
        assert consistency(result).consistent
        errors = errors_of(model, result, flight, run)[-1]
        values.append(nees(errors, result.covariance[-1]) / model.size)
        found.append(result.sigma[-1] / model.sigma)
        assert np.abs(errors[model.slices["master bias"]] / result.sigma[-1, model.slices["master bias"]]).max() < 3.5
    # the attitude is known to better than the mounting was; the gyros' biases come with it
    assert np.all(np.array(found)[:, 6:9] * 0.035 < askew)
    assert np.all(np.array(found)[:, model.slices["gyro bias"]] < 0.5)
    assert 0.6 < np.mean(values) < 1.5  # 36 degrees of freedom: 0.59 … 1.51


def test_pulses_of_the_gyros_are_in_the_comparison_with_a_zero_rate() -> None:
    """A pulse of an arcsecond against a mean over a second; told of it the filter is no less sure than it may be."""
    arcsec = np.pi / 180.0 / 3600.0
    sigma = ImuErrors(replace(NAVIGATION.gyro, quantum=1.0 * arcsec), replace(NAVIGATION.accel, quantum=5e-3))
    model = error_model(sigma, position=1.0, velocity=0.01, attitude=(1e-4, 1e-4, 1e-3))
    assert model.gyro_quantum == 1.0 * arcsec
    place = Parked(LATITUDE, 0.3, 200.0, rotation.quaternion_from_euler(0.02, -0.03, 1.0), 600.0)
    run, rng = one_run(place, place.increments(10.0), model, sigma, 0), np.random.default_rng(1)
    time = np.arange(1.0, 600.5)
    given = [standing(time, rng, 1e-4), not_turning(time, rng)]
    told = estimate(run.imu, run.initial, given, model, rate_hz=1.0, gate=None)
    untold = replace(model, gyro_quantum=0.0, accel_quantum=0.0)
    naive = estimate(run.imu, run.initial, given, untold, rate_hz=1.0, gate=None)
    for which in (0, 1):
        assert np.mean(naive.innovations[which].nis) / 3.0 > 2.0
        assert 0.5 < np.mean(told.innovations[which].nis) / 3.0 < 1.5
    errors = errors_of(model, told, place, run)[-1]
    assert nees(errors[6:], told.covariance[-1][6:, 6:]) < 21.7  # 9 degrees of freedom, 99 %
