"""The start of navigation: P₀ against the spread of emulated alignments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim import earth
from sinssim.alignment import (
    STATES,
    align_disturbed,
    determine,
    expected_errors,
    ideal_readings,
    initial_covariance,
    initial_state,
)
from sinssim.data import ImuData
from sinssim.earth.models import OMEGA_IE
from sinssim.errors import InputError
from sinssim.scenario.sections.imu import ImuSection
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.emulate import emulate
from sinssim.truth.motions.parked import Parked
from sinssim.units import ARCSEC, DEG_H

ANGLES = (1.2, 0.3, -0.2)  # heading, roll, pitch
LATITUDE = np.radians(50.0)
SECTION = ImuSection(grade="laser-standard")


def test_the_state_is_the_determined_attitude_at_rest():
    result = determine(*ideal_readings(*ANGLES, LATITUDE))
    state = initial_state(result, 0.4, 120.0)
    expected = Rotation.from_euler("ZYX", [1.2, -0.2, 0.3])
    assert (Rotation.from_quat(state.q_nb, scalar_first=True).inv() * expected).magnitude() < 1e-12
    assert (state.latitude, state.longitude, state.height) == (pytest.approx(LATITUDE), 0.4, 120.0)
    np.testing.assert_array_equal(state.velocity_ned, 0.0)
    assert initial_state(result, 0.4, 120.0, latitude=0.7).latitude == 0.7


@pytest.mark.parametrize("known", [True, False])
def test_covariance_is_that_of_emulated_alignments(known):
    """Attitude and all constant errors of the sensors of many runs, cross-correlations included."""
    runs, duration = 20_000, 300.0
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
    samples = np.column_stack([north, phi, constants])
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
    # 2000 independent draws: a correlation is known to 1/√2000, four of them
    np.testing.assert_allclose(found, predicted / np.outer(scale, scale), rtol=0, atol=4 * np.sqrt(2 / (runs // 10)))


@pytest.mark.parametrize("known", [True, False])
def test_covariance_of_a_disturbed_base_is_consistent(known):
    """Position north, attitude and biases of alignments on gravity's cone, in units of P₀: chi-squared."""
    q_nb = Rotation.from_euler("ZYX", [ANGLES[0], ANGLES[2], ANGLES[1]]).as_quat(scalar_first=True)
    ideal = Parked(LATITUDE, 0.3, 0.0, q_nb, 300.0).increments(2.0)
    sigma, latitude, runs, squares = expected_errors(SECTION).sigma, LATITUDE if known else None, 150, []
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
