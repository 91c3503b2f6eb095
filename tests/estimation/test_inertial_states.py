"""Errors of the inertial sensors beyond bias, scale factor and misalignment as states: consistent with, not without."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import sinssim
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array, ImuData, Measurements
from sinssim.estimation import error_model
from sinssim.estimation.error_dynamics import calibrated, reading_error, remaining, with_products
from sinssim.estimation.estimate import estimate
from sinssim.estimation.state_model import INERTIAL, block_of_term, values_of
from sinssim.scenario import load_scenario
from sinssim.scenario.filter_model import choice, states
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.navigation_error import navigation_error
from tests.estimation.test_diagnosis import ALL_STATES, RATE, SIGMA, START, disturbed, motion
from tests.slow import slow

BLOCKS: dict[str, dict[str, Any]] = {
    "gyro g-sensitivity": {"grade": "mems-tactical", "gyro_g_sensitivity_sigma_deg_h_per_g": 500.0},
    "accelerometer asymmetry": {"grade": "mems-tactical", "accel_asymmetry_sigma_ppm": 60_000.0},
    "gyro quadratic": {"gyro_quadratic_sigma_ppm_per_deg_s": 400.0},
    "gyro cubic": {"gyro_cubic_sigma_ppm_per_deg2_s2": 120.0},
    "accelerometer quadratic": {"accel_quadratic_sigma_ug_per_g2": 4000.0},
    "accelerometer cubic": {"accel_cubic_sigma_ug_per_g3": 5000.0},
    "accelerometer cross-axis": {"accel_cross_axis_sigma_ug_per_g2": 4000.0},
}
"""Errors that matter on the drive, beside those of a grade."""


def nees(seed: int, block: str, with_state: bool, seconds: float) -> float:
    """Return the sum of squared errors of navigation at the end of a drive, normalised by their covariance, (9)."""
    truth, unit = motion(seconds), Imu(**{"grade": "laser-navigation", "rate_hz": RATE, **BLOCKS[block]})
    imu = sinssim.emulate(truth.increments(RATE), unit, seed=seed)
    time, rng = np.arange(1.0, seconds - 0.5), np.random.default_rng(seed)
    state = truth.state(time)
    place = np.column_stack((state.latitude, state.longitude, state.height))
    place += rng.standard_normal(place.shape) * SIGMA["gnss-position"] * (1.0 / 6.36e6, 1.0 / 4.89e6, 1.0)
    velocity = state.velocity_ned + SIGMA["gnss-velocity"] * rng.standard_normal((len(time), 3))
    readings = [
        Measurements(kind, time, time, value, np.full((len(time), 3), SIGMA[kind]))
        for kind, value in (("gnss-position", place), ("gnss-velocity", velocity))
    ]
    model = error_model(
        expected_errors(unit).sigma, **START, imu=(*ALL_STATES, *([block] * with_state)), duration=seconds
    )
    done = estimate(imu, disturbed(truth.state(0.0), seed), readings, model, gate=None, history=False, row_s=0.0)
    error = navigation_error(truth.state(done.time), done.solution)
    x = np.r_[error.position_ned[-1], error.velocity_ned[-1], error.attitude[-1]]
    return float(x @ np.linalg.solve(done.covariance[-1, :9, :9], x))


QUICK = ("gyro g-sensitivity", "accelerometer asymmetry", "accelerometer cross-axis")


@pytest.mark.parametrize(("block", "runs"), [*((of, 3) for of in QUICK), *slow(*((of, 20) for of in BLOCKS))])
def test_the_filter_is_consistent_with_the_state_and_not_without(block: str, runs: int) -> None:
    """The mean NEES of 9 states over n runs is χ² of 9n degrees over n; outside 99.8 % by chance in 0.2 %."""
    seconds = 60.0 if runs == 3 else 100.0
    low, high = chi2.ppf((0.001, 0.999), 9 * runs) / runs
    assert low < np.mean([nees(seed, block, True, seconds) for seed in range(runs)]) < high
    assert np.mean([nees(seed, block, False, seconds) for seed in range(runs)]) > high


def test_each_state_has_the_effect_of_its_row() -> None:
    """By the table's own formulas at one rate and force, written out."""
    rate, force = np.array([[0.3, -0.2, 0.5]]), np.array([[1.0, -2.0, -9.0]])
    model = error_model(expected_errors(Imu(grade="mems-tactical")).sigma, imu=tuple(INERTIAL))
    gyro, accel = (reading_error(model, of, u, force)[0] for of, u in (("gyro", rate), ("accelerometer", force)))
    at = model.slices
    np.testing.assert_allclose(gyro[:, at["gyro g-sensitivity"]][1], [0, 0, 0, 1, -2, -9, 0, 0, 0])
    np.testing.assert_allclose(gyro[:, at["gyro quadratic"]], np.diag([0.09, 0.04, 0.25]))
    np.testing.assert_allclose(gyro[:, at["gyro cubic"]], np.diag([0.027, -0.008, 0.125]))
    np.testing.assert_allclose(gyro[:, at["gyro asymmetry"]], np.diag([0.15, 0.1, 0.25]))
    np.testing.assert_allclose(accel[:, at["accelerometer cross-axis"]][2], [0, 0, 0, 0, -9.0, 18.0])
    assert not gyro[:, at["accelerometer quadratic"]].any()
    for term in TERMS:
        if (name := block_of_term(term)) in INERTIAL:
            value = term.shaped(np.arange(1.0, term.size + 1.0))
            assert values_of(term, value).tolist() == list(range(1, term.size + 1))
            u = rate if term.triad == "gyro" else force
            effect = reading_error(model, name.split()[0], u, force)[0][:, at[name]] @ values_of(term, value)
            np.testing.assert_allclose(effect, np.broadcast_to(term.effect(value, u, force), (1, 3))[0])


def test_such_an_error_is_a_state_by_default() -> None:
    scenario = load_scenario("mems_uav", ["imu.gyro_g_sensitivity_sigma_deg_h_per_g=100"])
    assert "gyro g-sensitivity" in states(scenario)
    assert any(line.split()[:4] == ["gyro", "g-sensitivity", "a", "state"] for line in choice(scenario))
    assert "gyro g-sensitivity" not in states(load_scenario("mems_uav"))


@pytest.mark.parametrize("tilted", [True, False])
def test_large_errors_are_fed_back_without_a_remainder(tilted: bool) -> None:
    """Readings of sensors that are wrong by percents, written out, against the compensator before and after.

    The errors of the compensated readings are linear in the states to rounding, and an estimate that is wrong by
    percents leaves exactly what it lacks, multiplied by the matrix."""
    rng = np.random.default_rng(5)
    names = ("gyro bias", "gyro scale", *(["gyro misalignment"] if tilted else []))
    model = error_model(expected_errors(Imu(grade="consumer")).sigma, imu=(*names, "accelerometer bias"))
    off, at, u = ~np.eye(3, dtype=bool), model.slices, rng.standard_normal((7, 3))

    def sensors(values: dict[str, Array]) -> TriadErrors:
        axes = np.zeros((3, 3))
        axes[off] = values.get("gyro misalignment", np.zeros(6))
        return TriadErrors(bias=values["gyro bias"], scale=values["gyro scale"], misalignment=axes)

    def left(known: Array) -> tuple[Array, Array]:
        """Return the states, and what the compensator leaves of the readings' errors less what they say."""
        values = {block.name: known[at[block.name]] for block in model.blocks[3:]}
        x = np.zeros(model.size)
        for name, error in remaining(model, true, values).items():
            x[at[name]] = error
        got = compensate(ImuData(np.arange(8.0), reading, np.zeros((7, 3))), ImuErrors(gyro=sensors(values))).dtheta
        return x, got - u - reading_error(model, "gyro", got, got) @ x

    true = {name: 0.03 * rng.standard_normal(model.slices[name].stop - model.slices[name].start) for name in names}
    errors = sensors(true)
    reading = (1.0 + errors.scale) * (u @ (np.eye(3) + errors.misalignment).T) + errors.bias
    known = np.zeros(model.size)
    for name in names:
        known[at[name]] = 0.02 * rng.standard_normal(true[name].size)
    before, rest = left(known)
    assert np.abs(rest).max() < 1e-15
    assert np.abs(before).max() > 0.02
    fed = np.zeros(model.size)
    for name in names:
        fed[at[name]] = before[at[name]] + 0.01 * rng.standard_normal(true[name].size)
    new, turn = calibrated(model, known, fed)
    assert turn is not None
    after, rest = left(new)
    assert np.abs(rest).max() < 1e-15
    np.testing.assert_allclose(after, turn @ (before - fed), atol=1e-15)
    np.testing.assert_allclose(left(calibrated(model, known, before)[0])[0], 0.0, atol=1e-15)


@pytest.mark.parametrize("scale_ppm", [1.0, 200.0])
def test_a_scale_factor_known_better_than_the_squares_of_misalignments(scale_ppm: float) -> None:
    """σ of the states at the start against 20 000 sensors with misalignments of 10 mrad: to four of its own σ, 2 %."""
    triad = TriadErrors(scale=np.full(3, 1e-6 * scale_ppm), misalignment=0.01 * (1.0 - np.eye(3)))
    model = error_model(ImuErrors(triad, triad), **START, imu=ALL_STATES)
    rng = np.random.default_rng(7)
    sigma = {block.name: np.broadcast_to(block.sigma, model.slices[block.name].stop - model.slices[block.name].start)
             for block in model.blocks}  # fmt: skip
    true = {name: of * rng.standard_normal((20_000, len(of))) for name, of in sigma.items()}
    states = remaining(model, true, {name: np.zeros_like(value) for name, value in true.items()})
    expected = np.sqrt(with_products(model, model.covariance).diagonal())
    for name in ("gyro scale", "accelerometer scale", "gyro misalignment", "accelerometer misalignment"):
        assert states[name].std(axis=0) == pytest.approx(expected[model.slices[name]], rel=0.02)


def test_what_no_sensor_is_wrong_by_is_fed_back_as_a_difference() -> None:
    """An estimate of a scale factor of a half: 1 − X̂ may have no inverse."""
    model = error_model(expected_errors(Imu(grade="consumer")).sigma, imu=("gyro bias", "gyro scale"))
    fed = np.zeros(model.size)
    fed[model.slices["gyro scale"]] = 0.5
    known, turn = calibrated(model, fed, fed)
    assert turn is None
    np.testing.assert_array_equal(known[model.slices["gyro scale"]], 1.0)
