"""The start of navigation: P₀ against the spread of emulated alignments."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim import earth
from sinssim.alignment import (
    STATES,
    Stillness,
    align_disturbed,
    determine,
    expected_errors,
    ideal_readings,
    initial_covariance,
    initial_state,
)
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCSEC, DEG_H
from tests.slow import slow

ANGLES = (1.2, 0.3, -0.2)  # heading, roll, pitch
LATITUDE = np.radians(50.0)
SECTION = Imu(grade="laser-standard")


def test_the_state_is_the_determined_attitude_at_rest():
    result = determine(*ideal_readings(*ANGLES, LATITUDE))
    state = initial_state(result, 0.4, 120.0)
    expected = Rotation.from_euler("ZYX", [1.2, -0.2, 0.3])
    assert (Rotation.from_quat(state.q_nb, scalar_first=True).inv() * expected).magnitude() < 1e-12
    assert (state.latitude, state.longitude, state.height) == (pytest.approx(LATITUDE), 0.4, 120.0)
    np.testing.assert_array_equal(state.velocity_ned, 0.0)
    assert initial_state(result, 0.4, 120.0, latitude=0.7).latitude == 0.7


@cache
def errors_of_alignments(runs, duration):
    """Latitude, attitude and the sensors' constants of emulated sessions, (runs, 28)."""
    gyro, accel = ideal_readings(*ANGLES, LATITUDE)
    rng = np.random.default_rng(6)
    readings, constants = [], []
    for seed in range(runs // 10):
        errors = draw(SECTION, seed)
        for _ in range(10):  # new noise ten times on each draw: the biases cost the time
            measured = [
                (1 + t.scale) * (ideal + t.misalignment @ ideal)
                + t.bias
                + t.random_walk / np.sqrt(duration) * rng.standard_normal(3)
                for t, ideal in ((errors.gyro, gyro), (errors.accel, accel))
            ]
            readings.append(measured)
            g, a = errors.gyro, errors.accel
            tilts = (t.misalignment[~np.eye(3, dtype=bool)] for t in (g, a))
            constants.append(np.r_[g.bias, a.bias, g.scale, a.scale, *tilts])
    result = determine(*np.moveaxis(np.array(readings), 1, 0))
    c_true = Rotation.from_euler("ZYX", [ANGLES[0], ANGLES[2], ANGLES[1]])
    computed = Rotation.from_euler("ZYX", np.stack([result.heading, result.pitch, result.roll], axis=1))
    phi = -(computed * c_true.inv()).as_rotvec()  # C_computed = (I − [φ×]) C_true
    north = (result.latitude - LATITUDE) * earth.radii(LATITUDE)[0]
    return np.column_stack([north, phi, constants])


@pytest.mark.parametrize("runs", [5000, *slow(20_000)])
@pytest.mark.parametrize("known", [True, False])
def test_covariance_is_that_of_emulated_alignments(known, runs):
    """Attitude and all constant errors of the sensors of many runs, cross-correlations included."""
    duration = 300.0
    gyro, accel = ideal_readings(*ANGLES, LATITUDE)
    samples = errors_of_alignments(runs, duration)
    rows = [0, *range(6, 33)]

    sigma = expected_errors(SECTION).sigma
    exact = determine(gyro, accel)
    latitude = LATITUDE if known else None
    covariance = initial_covariance(
        exact, sigma, duration, latitude=latitude, position_sigma=(5.0, 6.0, 7.0), states=STATES
    )
    assert covariance.shape == (33, 33)
    default = initial_covariance(exact, sigma, duration, latitude=latitude, position_sigma=(5.0, 6.0, 7.0))
    np.testing.assert_array_equal(default, covariance[:15, :15])
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance / np.sqrt(np.outer(*(np.diag(covariance),) * 2))).min() > -1e-12
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)[1:6]), [6.0, 7.0, 0.01, 0.01, 0.01])
    predicted = covariance[np.ix_(rows, rows)]
    if known:
        assert predicted[0, 0] == pytest.approx(25.0)
        rows, samples, predicted = rows[1:], samples[:, 1:], predicted[1:, 1:]
    scale = np.sqrt(np.diag(predicted))
    found = np.cov(samples.T) / np.outer(scale, scale)
    # a tenth of the runs are independent draws, n: a correlation is known to 1/√n, four of them
    np.testing.assert_allclose(found, predicted / np.outer(scale, scale), rtol=0, atol=4 * np.sqrt(2 / (runs // 10)))


@pytest.mark.parametrize("known", [True, False])
def test_covariance_of_a_disturbed_base_is_consistent(known):
    """Position north, attitude and biases of alignments on gravity's cone, in units of P₀: chi-squared."""
    q_nb = Rotation.from_euler("ZYX", [ANGLES[0], ANGLES[2], ANGLES[1]]).as_quat(scalar_first=True)
    ideal = Parked(LATITUDE, 0.3, 0.0, q_nb, 300.0).increments(2.0)
    sigma, latitude, runs, squares = expected_errors(SECTION).sigma, LATITUDE if known else None, 40, []
    rows = np.r_[6:15] if known else np.r_[0, 6:15]
    for seed in range(runs):
        drawn = draw(SECTION, seed)
        found = align_disturbed(emulate(ideal, SECTION, seed), latitude).determination
        state = initial_state(found, 0.3, 0.0, latitude)
        p0 = initial_covariance(found, sigma, 300.0, latitude=latitude, method="disturbed")[np.ix_(rows, rows)]
        turn = Rotation.from_quat(state.q_nb, scalar_first=True) * Rotation.from_quat(q_nb, scalar_first=True).inv()
        north = (state.latitude - LATITUDE) * earth.radii(LATITUDE)[0]
        error = np.r_[north, -turn.as_rotvec(), drawn.gyro.bias, drawn.accel.bias][-len(rows) :]
        scale = np.sqrt(np.diag(p0))
        squares.append((error / scale) @ np.linalg.solve(p0 / np.outer(scale, scale), error / scale))
    low, high = chi2.ppf([1e-4, 1 - 1e-4], len(rows) * runs) / runs
    assert low < np.mean(squares) < high


def test_a_gyro_bias_to_the_north_opens_the_cone_and_the_latitude_falls():
    """cosφ = (horizontal rate)/U: δφ = −δω/(U sinφ), on either side of the equator; its share of P₀ has that sign."""
    sigma = ImuErrors(gyro=TriadErrors(bias=np.array([0.01 * DEG_H, 0.0, 0.0])))  # on the forward axis, which is north
    for latitude in (LATITUDE, -LATITUDE):
        exact = determine(*ideal_readings(0.0, 0.0, 0.0, latitude))
        covariance = initial_covariance(exact, sigma, 300.0, method="disturbed")
        slope = covariance[0, STATES.index("gyro bias forward")] / (0.01 * DEG_H) ** 2  # m per rad/s
        assert slope == pytest.approx(-earth.radii(latitude)[0] / (OMEGA_IE * np.sin(latitude)), rel=1e-9)
        # and the fit itself does so
        q_nb = np.array([1.0, 0.0, 0.0, 0.0])
        ideal = Parked(latitude, 0.3, 0.0, q_nb, 300.0).increments(4.0)
        biased = ImuData(ideal.time, ideal.dtheta + 0.01 * DEG_H / 4.0 * np.eye(3)[0], ideal.dvel)
        moved = align_disturbed(biased).determination.latitude - align_disturbed(ideal).determination.latitude
        assert moved * earth.radii(latitude)[0] / (0.01 * DEG_H) == pytest.approx(slope, rel=0.01)


def test_the_heading_error_knows_the_gyro_bias_that_caused_it():
    exact = determine(*ideal_readings(0.0, 0.0, 0.0, LATITUDE))
    covariance = initial_covariance(exact, expected_errors(SECTION).sigma, 3600.0, latitude=LATITUDE)
    row, column = STATES.index("attitude down"), STATES.index("gyro bias right")
    correlation = covariance[row, column] / np.sqrt(covariance[row, row] * covariance[column, column])
    # a positive east gyro bias makes the heading too small, φ_down = −ΔK too large; at one hour it is most of it
    assert 0.9 < correlation < 1.0
    row, column = STATES.index("attitude east"), STATES.index("accelerometer bias forward")
    correlation = covariance[row, column] / np.sqrt(covariance[row, row] * covariance[column, column])
    assert -1.0 < correlation < -0.8  # φ_east = −Δθ
    assert np.sqrt(covariance[7, 7]) / ARCSEC == pytest.approx(11.5, abs=0.1)  # 50 µg and 5 arcsec


def test_what_is_not_determined_cannot_start_navigation():
    pole = determine(*ideal_readings(0.3, 0.1, 0.2, np.pi / 2))
    with pytest.raises(InputError, match="heading not determined"):
        initial_state(pole, 0.0, 0.0)
    with pytest.raises(InputError, match="heading not determined"):
        initial_covariance(pole, expected_errors(SECTION).sigma, 300.0)
    with pytest.raises(InputError, match="one vehicle"):
        initial_state(determine(*ideal_readings([0.3, 0.4], 0.1, 0.2, 0.5)), 0.0, 0.0)


def test_covariance_by_differences_of_the_determination() -> None:
    """Each block of P₀ from the change of eq. (1) by each mean reading: no formula of the theory."""
    heading, roll, pitch, latitude, height, duration = 1.2, 0.3, -0.2, -0.7, 4000.0, 80.0
    gyro, accel = ideal_readings(heading, roll, pitch, latitude)
    found = determine(gyro, accel)
    c_nb = Rotation.from_euler("ZYX", [heading, pitch, roll])

    def of(readings: np.ndarray) -> np.ndarray:
        """North error, m, and φ."""
        one = determine(readings[:3], readings[3:])
        phi = -(Rotation.from_euler("ZYX", [one.heading, one.pitch, one.roll]) * c_nb.inv()).as_rotvec()
        return np.r_[(one.latitude - latitude) * (earth.radii(latitude)[0] + height), phi]

    mean = np.r_[gyro, accel]
    steps = np.r_[np.full(3, 1e-4 * OMEGA_IE), np.full(3, 1e-4)]
    slope = np.column_stack([(of(mean + s) - of(mean - s)) / (2.0 * s.max()) for s in np.diag(steps)])
    sizes = {"bias": np.array([1.0, 2.0, 3.0]), "scale": np.array([4.0, 1.0, 2.0]),
             "misalignment": np.array([[0.0, 1.0, 2.0], [3.0, 0.0, 4.0], [5.0, 6.0, 0.0]])}  # fmt: skip
    gyros, accels = (
        TriadErrors(
            bias=unit * sizes["bias"], scale=unit * relative * sizes["scale"],
            misalignment=unit * relative * sizes["misalignment"], random_walk=walk, quantum=quantum,
        )
        for unit, relative, walk, quantum in ((1e-8, 1e3, 3e-7, 2e-6), (3e-4, 0.3, 2e-4, 5e-3))
    )  # fmt: skip
    spread = np.array([5.0, 6.0, 7.0]), np.array([0.02, 0.03, 0.04])
    covariance = initial_covariance(
        found, ImuErrors(gyros, accels), duration, height=height, position_sigma=spread[0], velocity_sigma=spread[1],
        states=STATES,
    )  # fmt: skip
    # readings by the sensors' constants, in the order of the states
    apart = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)]
    by_error, variance = np.zeros((6, 24)), []
    for first in (0, 3):
        for axis in range(3):
            by_error[first + axis, first + axis] = 1.0
            by_error[first + axis, 6 + first + axis] = mean[first + axis]
        for k, (i, j) in enumerate(apart):
            by_error[first + i, 12 + 2 * first + k] = mean[first + j]
    for name in ("bias", "scale", "misalignment"):
        for triad in (gyros, accels):
            value = getattr(triad, name)
            variance += [value[i, j] ** 2 for i, j in apart] if name == "misalignment" else list(value**2)
    noise = np.repeat([3e-7**2 / 80.0 + 2e-6**2 / (6.0 * 80.0**2), 2e-4**2 / 80.0 + 5e-3**2 / (6.0 * 80.0**2)], 3)
    of_readings = by_error @ np.diag(variance) @ by_error.T + np.diag(noise)
    expected = np.zeros((33, 33))
    rows = [0, 6, 7, 8]
    expected[np.ix_(rows, rows)] = slope @ of_readings @ slope.T
    expected[np.ix_(rows, range(9, 33))] = slope @ by_error @ np.diag(variance)
    expected[9:, rows] = expected[rows, 9:].T
    expected[9:, 9:] = np.diag(variance)
    expected[range(1, 6), range(1, 6)] = [36.0, 49.0, 4e-4, 9e-4, 16e-4]
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        covariance / np.outer(scale, scale), expected / np.outer(scale, scale), rtol=0, atol=1e-6
    )

    # what the base may have turned: half of its mean square at the last instant, and its rate in the mean
    still = Stillness((), True, np.array([3e-6, -4e-6, 1e-6]), 2e-6, 7e-6, duration, accel / np.linalg.norm(accel))
    more = initial_covariance(
        found, ImuErrors(gyros, accels), duration, height=height, position_sigma=spread[0], velocity_sigma=spread[1],
        states=STATES, still=still,
    ) - covariance  # fmt: skip
    turn, c = still.turn_covariance, c_nb.as_matrix()
    expected = np.zeros((33, 33))
    expected[np.ix_(rows, rows)] = slope[:, :3] @ turn @ slope[:, :3].T / duration**2
    expected[6:9, 6:9] += 0.5 * c @ turn @ c.T
    np.testing.assert_allclose(more / np.outer(scale, scale), expected / np.outer(scale, scale), rtol=0, atol=1e-6)


def test_names_and_order_of_the_states() -> None:
    expected = [f"{what} {axis}" for what in ("position", "velocity", "attitude") for axis in ("north", "east", "down")]
    for what in ("bias", "scale"):
        for triad in ("gyro", "accelerometer"):
            expected += [f"{triad} {what} {axis}" for axis in ("forward", "right", "down")]
    for triad in ("gyro", "accelerometer"):
        expected += [f"{triad} misalignment {pair}" for pair in ("xy", "xz", "yx", "yz", "zx", "zy")]
    assert list(STATES) == expected


@pytest.mark.parametrize(
    ("name", "values", "unit"), [("position_sigma", [1.0, -2.0, 3.0], "m"), ("velocity_sigma", [1.0, 2.0, -3.0], "m/s")]
)
def test_standard_deviations_are_not_negative(name: str, values: list[float], unit: str) -> None:
    with pytest.raises(InputError) as info:
        initial_covariance(determine(*ideal_readings(*ANGLES, 0.5)), ImuErrors(), 300.0, **{name: values})
    assert str(info.value) == f"{name} = {values} {unit} must be standard deviations: zero or more."
