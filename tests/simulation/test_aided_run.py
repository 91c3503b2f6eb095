"""From a scenario to its aided solution: what the filter is told, and that it is right about itself when told so."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim import data
from sinssim.errors import InputError, RunError
from sinssim.estimation import state_errors
from sinssim.estimation.consistency import nees
from sinssim.experiments.run.filter_summary import filter_numbers, sentences
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.filter_model import filter_model, inertial_sigma, states
from sinssim.scenario.navigation_section import initial_state_with_errors
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import draw
from sinssim.sensors.sensor_set_readings import draw_true_errors
from sinssim.simulation import aided_run
from sinssim.simulation.aided_run import aid_run, navigate_beside
from sinssim.truth.motions import mounted_block
from tests.slow import slow

ARCMIN, DEG_H, UG = np.pi / 180.0 / 60.0, np.pi / 180.0 / 3600.0, 9.80665e-6
EVERY_STATE = (
    "gyro bias", "accelerometer bias", "gyro scale", "accelerometer scale", "gyro misalignment",
    "accelerometer misalignment",
)  # fmt: skip


def scenario(**tables) -> Scenario:
    """Return a scenario: level flight of a minute and a half, unless something else is said."""
    own = {
        "name": "aided",
        "great_circle": {"latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 200.0, "duration_s": 90.0},
        "imu": {"grade": "laser-standard", "rate_hz": 50.0},
        "aiding": {"gnss": {}},
        "filter": {},
    }
    return Scenario.model_validate({k: v for k, v in {**own, **tables}.items() if v is not None})


def aided(s: Scenario):
    """Return a scenario's aided solution, without recording anything."""
    trajectory = fly(s)
    imu = emulate(trajectory.increments(s.imu.rate_hz), s.imu, s.seed)
    start = trajectory.state(trajectory.start)
    initial = initial_state_with_errors(start, s.navigation.initial_error, trajectory.ellipsoid, s.seed)
    return aid_run(s, trajectory, imu, initial, draw_true_errors(s.imu, s.seed, s.compensation))


# What the filter is told


def test_filter_is_told_what_the_start_is_drawn_from():
    error = {
        "position_sigma_m": 3.0, "north_m": 4.0, "height_sigma_m": 7.0, "velocity_sigma_mps": 0.2,
        "tilt_sigma_arcmin": 0.6, "roll_arcmin": 0.8, "heading_sigma_arcmin": 12.0,
    }  # fmt: skip
    model = filter_model(scenario(navigation={"initial_error": error}))
    assert model.states[:9] == tuple(
        f"{b} {a}" for b in ("position", "velocity", "attitude") for a in ("north", "east", "down")
    )
    expected = [5.0, 3.0, 7.0, 0.2, 0.2, 0.2, 1.0 * ARCMIN, 1.0 * ARCMIN, 12.0 * ARCMIN]
    np.testing.assert_allclose(model.sigma[:9], expected, rtol=1e-12, atol=0)


def test_exact_start_is_told_as_a_small_error_and_a_wrong_one_as_it_is_written():
    np.testing.assert_allclose(
        filter_model(scenario()).sigma[:9],
        [0.1] * 3 + [0.01] * 3 + [0.1 * ARCMIN] * 3,
        rtol=1e-12, atol=0,
    )  # fmt: skip
    own = {"position_m": 50.0, "height_m": 60.0, "velocity_mps": 2.0, "tilt_arcmin": 3.0, "heading_arcmin": 90.0}
    told = filter_model(scenario(filter={"initial_sigma": own})).sigma[:9]
    np.testing.assert_allclose(
        told, [50.0, 50.0, 60.0, 2.0, 2.0, 2.0, 3.0 * ARCMIN, 3.0 * ARCMIN, 90.0 * ARCMIN], rtol=1e-12, atol=0
    )


def test_filter_is_told_the_grade_and_a_given_error_as_unknown():
    s = scenario(imu={"grade": "tactical", "gyro_bias_deg_h": [0.0, -2.0, 0.5]}, filter={"states": EVERY_STATE})
    model = filter_model(s)
    np.testing.assert_allclose(model.sigma[model.slices["gyro bias"]], np.array([0.0, 2.0, 0.5]) * DEG_H, rtol=1e-9)
    np.testing.assert_allclose(model.sigma[model.slices["accelerometer bias"]], 1000.0 * UG, rtol=1e-9)
    np.testing.assert_allclose(model.sigma[model.slices["gyro scale"]], 150e-6, rtol=1e-9)
    np.testing.assert_allclose(model.sigma[model.slices["gyro misalignment"]], 100.0 * ARCMIN / 60.0, rtol=1e-9)
    assert model.gyro_noise == pytest.approx(0.125 * np.pi / 180.0 / 60.0, rel=1e-9)
    twice = filter_model(scenario(imu={"grade": "tactical"}, filter={"inertial_noise_factor": 2.0}))
    assert twice.gyro_noise == pytest.approx(2.0 * model.gyro_noise, rel=1e-12)
    assert twice.accel_noise == pytest.approx(2.0 * model.accel_noise, rel=1e-12)


def test_after_a_calibration_the_filter_is_told_what_that_leaves():
    s = scenario(compensation={"gyro_bias_sigma_deg_h": 0.002, "accel_scale_sigma_ppm": 7.0})
    sigma = inertial_sigma(s)
    np.testing.assert_allclose(sigma.gyro.bias, 0.002 * DEG_H, rtol=1e-9)
    np.testing.assert_allclose(sigma.accel.scale, 7e-6, rtol=1e-9)
    np.testing.assert_array_equal(sigma.accel.bias, 0.0)
    assert sigma.gyro.random_walk == pytest.approx(0.003 * np.pi / 180.0 / 60.0, rel=1e-9)  # no calibration knows it


def test_of_a_measured_calibration_value_the_filter_is_told_the_uncertainty():
    value = {"gyro_bias_deg_h": (0.5, -0.3, 0.2), "gyro_bias_sigma_deg_h": 0.002}
    np.testing.assert_allclose(inertial_sigma(scenario(compensation=value)).gyro.bias, 0.002 * DEG_H, rtol=1e-9)


def test_errors_of_aiding_sensors_become_states():
    s = scenario(
        aiding={
            "gnss": {"correlated_position_sigma_m": 2.0, "correlated_height_sigma_m": 4.0, "correlation_time_s": 200.0,
                     "lever_arm_sigma_m": 0.2},
            "baro": {"bias_sigma_m": 8.0, "bias_correlation_time_s": 900.0, "scale_ppm": -4000.0},
            "magnetometer": {"bias_sigma_deg": 1.0, "deviation_sigma_deg": 2.0},
            "airspeed": {"wind_sigma_mps": 6.0, "bias_sigma_mps": 8.0, "scale_ppm": 500.0},
            "odometer": {"scale_sigma_ppm": 3000.0},
            "attitude": {"bias_sigma_arcmin": 5.0},
            "star_tracker": {"bias_sigma_arcsec": 30.0},
            "zero_velocity": {},
            "master": {"attitude": True, "mounting_sigma_arcmin": 15.0},
        },
        filter={"measurement_noise_factor": 3.0, "states": ["gyro bias", "accelerometer bias"]},
    )  # fmt: skip
    blocks = {b.name: b for b in filter_model(s).blocks[5:]}
    degree = np.pi / 180.0
    expected = {
        "gnss-position bias": ((2.0, 2.0, 4.0), 200.0),
        "gnss lever arm": ((0.2,) * 3, np.inf),
        "baro bias": ((8.0,), 900.0),
        "baro scale": ((4e-3,), np.inf),
        "magnetometer bias": ((degree,), np.inf),
        "magnetometer deviation": ((2.0 * degree,) * 2, np.inf),
        "airspeed bias": ((8.0,), np.inf),
        "airspeed scale": ((5e-4,), np.inf),
        "airspeed wind": ((6.0,) * 2, 1200.0),
        "odometer scale": ((3e-3,), np.inf),
        "attitude bias": ((5.0 * ARCMIN,) * 3, 600.0),
        "star-tracker bias": ((0.5 * ARCMIN,) * 3, np.inf),
        "master-velocity bias": ((0.1,) * 3, 3600.0),
        "master-attitude bias": ((15.0 * ARCMIN,) * 3, np.inf),
    }
    assert set(blocks) == set(expected)
    for name, (sigma, tau) in expected.items():
        np.testing.assert_allclose(np.asarray(blocks[name].sigma) / 3.0, sigma, rtol=1e-12, atol=0)
        assert blocks[name].correlation_time == tau


# The truth beside it


def test_true_parameters_are_this_runs_errors(monkeypatch):
    s = scenario(
        seed=4,
        imu={"grade": "mems-industrial", "rate_hz": 50.0},
        aiding={"gnss": {"lever_arm_sigma_m": 0.3}, "baro": {"bias_sigma_m": 5.0}},
        filter={"states": EVERY_STATE},
    )
    result = aided(s)
    errors = draw(s.imu, s.seed)
    np.testing.assert_array_equal(result.parameters["gyro bias"], errors.gyro.bias)
    np.testing.assert_array_equal(result.parameters["accelerometer scale"], errors.accel.scale)
    m = errors.gyro.misalignment
    np.testing.assert_array_equal(
        result.parameters["gyro misalignment"], [m[0, 1], m[0, 2], m[1, 0], m[1, 2], m[2, 0], m[2, 1]]
    )
    assert result.parameters["gyro instability"].shape == (len(result.estimate.time), 3)
    found, flight = result.estimate, fly(s)
    expected = state_errors(found.model, found, flight.state(found.time), result.parameters, flight.ellipsoid)
    np.testing.assert_array_equal(result.state_errors[:, 9:], expected[:, 9:])
    np.testing.assert_allclose(result.state_errors[:, :9], expected[:, :9], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(result.state_errors_at(np.array([3, 5])), result.state_errors[[3, 5]])
    np.testing.assert_array_equal(result.block_error("baro bias")[:, 0], result.state_errors[:, -1])
    monkeypatch.setattr(data, "BLOCK", 100)
    whole = result.error
    np.testing.assert_array_equal(np.concatenate([e.attitude for e in result.error_blocks()]), whole.attitude)
    rows = np.array([-1, 3, 250, 99, 100])
    np.testing.assert_array_equal(result.error_at(rows).position_ned, whole.position_ned[rows])
    assert found.model.blocks[-1].name == "baro bias"
    # the true instability is the emulator's: one more block with nothing but that drift differs by its integral
    quiet = s.model_copy(update={"imu": s.imu.model_copy(update={"gyro_instability_deg_h": 0.0})})
    ideal = fly(s).increments(50.0)
    drift = emulate(ideal, s.imu, 4).dtheta - emulate(ideal, quiet.imu, 4).dtheta
    rows = np.searchsorted(ideal.time, result.estimate.time[1:] - 1e-9) - 1
    np.testing.assert_allclose(result.parameters["gyro instability"][1:], drift[rows] * 50.0, rtol=1e-6, atol=1e-12)


def test_what_a_calibration_knows_is_no_parameter_any_more():
    biases = {"states": ["gyro bias", "accelerometer bias"]}
    s = scenario(compensation={"gyro_bias_sigma_deg_h": 0.5}, filter=biases, seed=8)

    result = aided(s)
    left = draw(s.imu, 8).gyro.bias - s.compensation.draw(draw(s.imu, 8), 8).gyro.bias
    np.testing.assert_array_equal(result.parameters["gyro bias"], left)
    np.testing.assert_array_equal(result.parameters["accelerometer bias"], np.zeros(3))


@pytest.mark.parametrize(
    ("loop", "grade", "angle"), [("closed", "mems-industrial", 20.0), *slow(("open", "tactical", 2.0))]
)
@pytest.mark.parametrize("runs", [2, *slow(6, 16)])
def test_ensemble_with_every_aiding_error_is_consistent(loop, grade, angle, runs):
    """NEES of all states at the end, over some runs: a wrong sign, unit or time anywhere in the chain shows.

    In the open loop errors must stay small enough for linear equations.
    """
    values, size = [], 0
    for seed in range(runs):
        s = scenario(
            seed=seed,
            great_circle={"latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 150.0, "duration_s": 30.0},
            vibration=[{"coordinate": c, "rms_arcsec": 7200.0, "low_hz": f} for c, f in (("roll", 0.2), ("yaw", 0.13))],
            imu={"grade": grade, "rate_hz": 50.0},
            navigation={"initial_error": {"position_sigma_m": 4.0, "height_sigma_m": 6.0, "velocity_sigma_mps": 0.3,
                                          "tilt_sigma_arcmin": angle, "heading_sigma_arcmin": 3.0 * angle}},
            aiding={
                "gnss": {"rate_hz": 2.0, "correlated_position_sigma_m": 3.0, "correlated_height_sigma_m": 5.0,
                         "correlated_velocity_sigma_mps": 0.1, "correlation_time_s": 20.0, "latency_s": 0.3,
                         "lever_arm_m": [2.0, -3.0, -1.5], "lever_arm_sigma_m": 0.4},
                "baro": {"bias_sigma_m": 8.0, "bias_correlation_time_s": 60.0, "scale_sigma_ppm": 5000.0},
                "magnetometer": {"bias_sigma_deg": 2.0, "deviation_sigma_deg": 3.0},
                "odometer": {"scale_sigma_ppm": 5000.0, "lever_arm_m": [-1.0, 0.5, 1.0]},
                "attitude": {"bias_sigma_arcmin": 10.0, "bias_correlation_time_s": 50.0},
                "star_tracker": {"sigma_arcsec": [60.0, 60.0, 120.0], "bias_sigma_arcsec": 300.0},
            },
            filter={"states": EVERY_STATE, "loop": loop, "gate": 0.0},
        )  # fmt: skip
        result = aided(s)
        size = result.estimate.model.size
        values.append(float(nees(result.state_errors[-1], result.estimate.covariance[-1])))
    low, high = chi2.ppf([0.5e-4, 1.0 - 0.5e-4], runs * size) / (runs * size)
    assert size > 50
    assert low < np.mean(values) / size < high


# Runs of all kinds


def test_parked_vehicle_finds_north_from_a_coarse_alignment():
    s = scenario(
        great_circle=None,
        parked={"latitude_deg": 50.0, "heading_deg": 30.0, "duration_s": 300.0},
        imu={"grade": "laser-navigation", "rate_hz": 50.0},
        aiding={"zero_velocity": {"sigma_mps": 0.002}, "zero_rate": {}},
        filter={"alignment_s": 100.0},
    )
    result = aided(s)
    found = result.estimate
    assert found.time[0] == pytest.approx(100.0)
    assert found.time[-1] == pytest.approx(300.0)
    # √(σ_b² + N²/T)/(ω_ie cos φ), and that the base may have turned by σ_d (10 µg/√Hz over τ) to 4σ_d in 100 s
    bias, walk, white = 0.0035 * DEG_H, 0.002 * np.pi / 180.0 / 60.0, 10e-6
    tau = np.linspace(1.0, 49.0, 49)
    turns = (2.0 * white**2 / tau + walk**2 * (2.0 * tau / 3.0 - tau**2 / 100.0)) / (1.0 - tau / 100.0) ** 2
    turn = np.sqrt(turns.min()) / 100.0
    north = 7.292115e-5 * np.cos(np.radians(50.0))
    rate = found.sigma[0, 8] * north
    assert np.sqrt(bias**2 + walk**2 / 100.0 + turn**2) * 0.97 < rate
    assert rate < np.sqrt(bias**2 + walk**2 / 100.0 + 17.0 * turn**2)
    # at the end what the alignment told and the 200 s of the filter together, noise as the inverse of its variance
    noise = 1.0 / (1.0 / (rate**2 - bias**2) + 200.0 / walk**2)
    assert found.sigma[-1, 8] * north == pytest.approx(np.sqrt(bias**2 + noise), rel=0.12)
    assert np.all(np.abs(result.state_errors[[0, -1], 8]) < 4.0 * found.sigma[[0, -1], 8])


def test_alignment_in_motion_from_a_heading_that_is_all_wrong():
    """The state that navigation starts from is 120° off; the filter, told nothing of it, finds the heading."""
    s = scenario(
        seed=1,
        vibration=[{"coordinate": c, "rms_mm": 20_000.0, "low_hz": f} for c, f in (("forward", 0.03), ("right", 0.02))],
        imu={"grade": "tactical", "rate_hz": 50.0},
        navigation={"initial_error": {"heading_arcmin": 7200.0, "roll_arcmin": 900.0}},
        aiding={"gnss": {"rate_hz": 2.0, "lever_arm_m": [1.0, 0.0, -2.0], "velocity_sigma_mps": 0.02}},
        filter={"alignment": "in-motion", "alignment_s": 60.0, "states": EVERY_STATE},
    )
    result = aided(s)
    found, errors = result.estimate, result.state_errors
    assert found.time[0] == pytest.approx(0.5)  # the first fix
    assert found.time[-1] == pytest.approx(90.0)
    assert found.divergence is None
    for row in (0, -1):
        assert np.all(np.abs(errors[row, :9]) < 3.5 * found.sigma[row, :9])
    assert found.sigma[-1, 8] < 60.0 * ARCMIN
    assert np.abs(found.inertial.q_nb[0] @ fly(s).state(found.time[0]).q_nb) > 0.99  # not 120° off
    numbers = filter_numbers(result, s)
    told = numbers["alignment"]
    assert (told["method"], told["coarse_s"]) == ("in-motion", 60.0)
    assert told["end"]["heading_error_arcmin"] == pytest.approx(errors[-1, 8] / ARCMIN)
    assert told["begin"]["heading_sigma_arcmin"] == pytest.approx(found.sigma[0, 8] / ARCMIN)
    sentence = next(line for line in sentences(numbers) if line.startswith("Aligned"))
    assert sentence.startswith(
        "Aligned in motion during the first 60 s: the filter started at 0.5 s with a heading error of"
    )
    size = {"deg": 60.0, "arcmin": 1.0, "arcsec": 1.0 / 60.0}
    written = re.findall(r"error (?:of|was) (\S+) (\w+) \(1σ (\S+) (\w+)\)", sentence)
    for at, (error, unit, sigma, same) in zip((told["begin"], told["end"]), written, strict=True):
        assert unit == same
        assert 1.0 <= float(sigma) < 60.0
        assert size[unit] * float(error) == pytest.approx(abs(at["heading_error_arcmin"]), rel=6e-3)
        assert size[unit] * float(sigma) == pytest.approx(at["heading_sigma_arcmin"], rel=6e-3)


def test_vehicle_that_moves_is_not_aligned_coarsely():
    with pytest.raises(InputError, match=r"filter\.alignment_s = 40: .* the vehicle moved during the session"):
        aided(
            scenario(
                great_circle=None,
                motion={"type": "spin-rock", "axis": [0.0, 0.0, 1.0], "angle_deg": 2.0, "frequency_hz": 0.05,
                        "duration_s": 60.0},
                aiding={"zero_velocity": {}},
                filter={"alignment_s": 40.0},
            )
        )  # fmt: skip


@pytest.mark.slow
def test_transfer_alignment_takes_the_attitude_of_the_better_system():
    """Velocity matching through turns: the azimuth, unknown at first by a degree, comes down and stays within 4σ."""
    s = scenario(
        seed=2,
        vibration=[{"coordinate": c, "rms_mm": 20_000.0, "low_hz": 0.03} for c in ("forward", "right")],
        imu={"grade": "tactical", "rate_hz": 20.0},
        navigation={"initial_error": {"tilt_sigma_arcmin": 10.0, "heading_sigma_arcmin": 60.0}},
        aiding={"master": {"rate_hz": 2.0, "lever_arm_m": [1.0, 4.0, 0.0]}},
        filter={"states": EVERY_STATE},
    )
    result = aided(s)
    sigma = result.estimate.sigma
    assert sigma[0, 8] == pytest.approx(60.0 * ARCMIN)
    assert sigma[-1, 8] < 0.2 * sigma[0, 8]
    assert np.all(np.abs(result.state_errors[-1, 3:9]) < 4.0 * sigma[-1, 3:9])
    assert [i.sensor for i in result.estimate.innovations] == ["master-velocity"]
    told = filter_numbers(result, s)["alignment"]
    assert told["method"] == "transfer"
    assert told["begin"]["heading_sigma_arcmin"] == pytest.approx(60.0)
    assert told["end"]["time_s"] == pytest.approx(90.0)
    # what the better system itself gets wrong is a state, and as large as it is said to be
    assert 0.005 < np.abs(result.parameters["master-velocity bias"]).max() < 0.3


@pytest.mark.parametrize("key", ["gyro_arw_deg_sqrt_h", "accel_vrw_mps_sqrt_h"])
def test_sensors_without_noise_are_judged_all_the_same(key):
    """The process noise of attitude, or velocity, is then what the other sensors leave there, and singular."""
    parked = {"latitude_deg": 50.0, "duration_s": 12.0}
    imu = {"grade": "tactical", "rate_hz": 20.0, key: 0.0}
    result = aided(scenario(great_circle=None, parked=parked, imu=imu, filter={"rate_hz": 5.0}))
    numbers = filter_numbers(result, scenario())
    assert numbers["nees"]["attitude"]["verdict"] == "consistent"
    assert ("gyro noise" if key.startswith("gyro") else "accelerometer noise") not in numbers["noise"]


def test_without_a_single_fix_the_result_is_inertial():
    s = scenario(aiding={"gnss": {"outages_s": [[0.0, 1e6]]}}, filter={"states": EVERY_STATE})
    result = aided(s)
    np.testing.assert_allclose(
        result.error.position_ned[-1],
        np.zeros(3), rtol=0, atol=10.0,
    )  # fmt: skip
    inertial = result.estimate.inertial
    for name in ("latitude", "longitude", "height"):
        np.testing.assert_allclose(
            getattr(result.estimate.solution, name)[-1], getattr(inertial, name)[-1], rtol=0, atol=1e-9
        )
    assert "gnss-position: there was no measurement; the sensor corrects nothing." in result.estimate.remarks
    said = list(sentences(filter_numbers(result, s)))
    assert said[0] == "The filter used no measurement; its errors agree with its covariance."
    assert "No measurement was used: the result is the inertial solution." in said


def test_readings_that_come_too_late_leave_the_inertial_solution_and_it_is_said():
    s = scenario(aiding={"gnss": {"latency_s": 100.0, "jumps": [{"from_s": 95.0, "north_m": 50.0}]},
                         "zero_velocity": {}})  # fmt: skip
    result = aided(s)
    inertial = result.estimate.inertial
    np.testing.assert_allclose(result.estimate.solution.latitude[-1], inertial.latitude[-1], rtol=0, atol=1e-9)
    said = " ".join(sentences(filter_numbers(result, s)))
    assert "aiding.gnss.latency_s = 100: no measurement arrives before the end of the run at 90 s." in said
    assert "aiding.gnss.jumps.1 begins at 95 s, but the run ends at 90 s: it has no effect." in said
    assert "zero-velocity: there was no measurement (the vehicle was never at rest)" in said
    assert "caught" not in said


def test_alignment_in_motion_that_cannot_be_names_its_key():
    straight = {"alignment": "in-motion", "alignment_s": 60.0}
    with pytest.raises(RunError, match=r"filter\.alignment_s = 60: .* the vehicle accelerated too little"):
        aided(scenario(imu={"grade": "mems-industrial", "rate_hz": 50.0}, filter=straight))
    with pytest.raises(InputError, match=r"filter\.alignment_s = 60: .* at least 40 s of them are needed"):
        aided(scenario(aiding={"gnss": {"outages_s": [[0.0, 30.0]]}}, filter=straight))


def test_alignment_in_motion_on_a_straight_flight_is_as_good_as_the_gyros():
    """Only the turn of the Earth below shows north: the σ is wide, and right; it is no covariance that cannot be."""
    s = scenario(filter={"alignment": "in-motion", "alignment_s": 60.0})
    result = aided(s)
    sigma, error = result.estimate.sigma[0, 8], result.state_errors[0, 8]
    assert np.radians(3.0) < sigma < np.radians(21.0)
    assert abs(error) < 3.0 * sigma


def test_smoothed_solution_has_its_errors_too():
    result = aided(scenario(filter={"smooth": True}, aiding={"gnss": {"outages_s": [[30.0, 60.0]]}}))
    assert result.smoothed_error is not None
    assert result.smoothed_state_errors is not None
    smoothed = result.estimate.smoothed
    assert smoothed is not None
    assert len(result.smoothed_error.time) == len(smoothed.time) == len(result.smoothed_state_errors)
    assert result.smoothed_error.horizontal.max() < result.error.horizontal.max()


@pytest.mark.parametrize(
    "name",
    ["aided_airliner", "mems_uav", "gyrocompassing", "in_flight_calibration", "spoofed", "align_in_motion",
     "transfer_alignment"],
)  # fmt: skip
def test_scenarios_of_the_package_say_what_they_mean(name):
    """Every one has a model whose sensors are there, and what it promises is in it."""
    s = load_scenario(name)
    model = filter_model(s)
    assert set(states(s)) == set(model.slices) & set(EVERY_STATE)
    if name == "aided_airliner":
        lengths = [end - begin for begin, end in s.aiding.gnss.outages_s]
        assert lengths == [300.0, 900.0]
        assert s.aiding.baro is not None
        assert s.filter.smooth
    if name == "mems_uav":
        assert (s.imu.grade, s.flight.aircraft, s.aiding.gnss.rate_hz) == ("mems-industrial", "c172x", 5.0)
    if name == "spoofed":
        assert len(s.aiding.gnss.ramps) == 1
    if name == "align_in_motion":
        assert s.filter.alignment == "in-motion"
        assert s.navigation.initial_error.heading_arcmin == 150.0 * 60.0
    if name == "transfer_alignment":
        assert (s.imu.grade, s.aiding.master.grade) == ("tactical", "laser-navigation")


def test_the_second_unit_navigates_as_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """A unit of another grade and other noises at its lever arm, in the frame and gravity of the scenario, held at the
    true height of its place."""
    place = SimpleNamespace(start=5.0, increments=lambda rate: SimpleNamespace(time=("edges at", rate)),
                            state=lambda time: SimpleNamespace(height=("height", time)))  # fmt: skip
    made: list[Any] = []
    monkeypatch.setattr(mounted_block, "Vibrating", lambda *given: made.append(given) or place)
    monkeypatch.setattr(aided_run, "emulate", lambda *given: made.append(given) or "readings")
    monkeypatch.setattr(aided_run, "navigate", lambda *given, **keys: (given, keys))
    scenario: Any = SimpleNamespace(seed=7, imu=SimpleNamespace(rate_hz=50.0),
                                    navigation=SimpleNamespace(frame="wander", gravity="centrifugal"))  # fmt: skip
    path: Any = SimpleNamespace(ellipsoid=SimpleNamespace(name="WGS-84"))
    found: Any = navigate_beside(scenario, path, "tactical", (1.0, 2.0, 3.0))
    (imu, start), keys = found
    assert made[0] == (path, (), (1.0, 2.0, 3.0))
    _, unit, seed = made[1]
    assert (unit.grade, unit.rate_hz, seed - 7) == ("tactical", 50.0, aided_run._APART)
    assert (imu, start.height) == ("readings", ("height", 5.0))
    assert keys == {"algorithm": "quaternion", "frame": "wander", "gravity": "centrifugal", "ellipsoid": "WGS-84",
                    "vertical": "baro-loop", "height": ("height", ("edges at", 50.0))}  # fmt: skip
