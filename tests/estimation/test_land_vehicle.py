"""A land vehicle: time offsets, delays, mounting, constraint, stops and alignment by the course, over many drives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim import rotation
from sinssim.alignment.alignment_in_motion import align_by_course
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import Block, Estimate, error_model, state_errors
from sinssim.estimation.consistency import nees
from sinssim.estimation.estimate import estimate
from sinssim.scenario.filter_section import AidingSection
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.aiding.standstill import find_stops, learn_rest, standstill
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.sensors.vibration_noise import AddedNoise, vibration, vibration_noise
from tests.estimation.drives import MOUNTED_DEG, STANDS, block_in_vehicle, drive
from tests.estimation.worlds import DEG, UG, one_run
from tests.slow import slow

DURATION, RATE_HZ, AHEAD = 100.0, 50.0, 1.2
MEMS = ImuErrors(
    TriadErrors(bias=np.full(3, 0.1 * DEG), random_walk=0.01 * DEG),
    TriadErrors(bias=np.full(3, 5e3 * UG), random_walk=300.0 * UG),
)
RTK: dict[str, Any] = {"rate_hz": 4.0, "position_sigma_m": 0.02, "height_sigma_m": 0.03, "velocity_sigma_mps": 0.05}


def driven(seed: int, tables: dict[str, dict[str, Any]], **options: Any) -> tuple[Estimate, Array]:
    """Return the estimate of one drive, and its errors in the filter's states."""
    trajectory, ideal = drive(DURATION, RATE_HZ, True, AHEAD)
    section = AidingSection.model_validate(tables)
    vehicle = Vehicle(trajectory, seed, q_bs=block_in_vehicle())
    sensed = [given for sensor in section.sensors().values() for given in sensor.read(vehicle)]
    states = [state for sensor in section.sensors().values() for state in sensor.states() if any(state.sigma)]
    model = error_model(
        MEMS,
        position=0.1,
        velocity=0.02,
        attitude=(5e-3, 5e-3, 5e-2),
        extra=[Block(s.block, s.sigma, correlation_time=s.correlation_time) for s in states],
    )
    plain = replace(model, blocks=model.blocks[:5])
    run = one_run(trajectory, ideal, plain, MEMS, seed)
    found = estimate(run.imu, run.initial, [given.measurements for given in sensed], model, gate=None, **options)
    true = dict(run.parameters) | {
        name: value if value.ndim == 1 else np.column_stack([np.interp(found.time, given.time, v) for v in value.T])
        for given in sensed
        for name, value in given.parameters.items()
    }
    return found, state_errors(model, found, trajectory.state(found.time), true, WGS84)


def nees_of_drives(seeds: range, tables: dict[str, dict[str, Any]], **options: Any) -> tuple[float, int]:
    """Return the mean normalised square of the errors at the ends of drives, and its degrees of freedom."""
    values = []
    for seed in seeds:
        found, errors = driven(seed, tables, **options)
        assert found.divergence is None
        values.append(float(nees(errors[found.rows[-1]], found.covariance[-1])))
    return float(np.mean(values)), len(seeds) * found.model.size


# The filter is linear in the offset δ: with δ = 0.65 s, ½ a δ² is 0.4 m at 2 m/s², 20σ of a fix.
TIMED = {"gnss": {**RTK, "time_offset_sigma_s": 0.1, "velocity_delay_sigma_s": 0.05}}
LATE = {"gnss": {**RTK, "time_offset_sigma_s": 0.02, "velocity_averaging_s": 0.25}}
CONSTRAINED = {
    "gnss": {**RTK, "outages_s": ((75.0, 99.0),)},
    "land_vehicle": {
        "lever_arm_m": tuple(rotation.dcm_from_quaternion(block_in_vehicle()).T @ [AHEAD, 0.0, 0.0]),
        "lever_arm_sigma_m": 0.3,
        "mounting_sigma_deg": 5.0,
        "slip_sigma_deg_per_g": 3.0,
        "drift_lateral_mps": 0.03,
        "drift_vertical_mps": 0.06,
    },
}
HEADED = {"gnss": RTK, "dual_antenna": {"baseline_m": (0.6, -0.8, 0.1), "bias_sigma_deg": 1.0}}
CASES = {"time offset": TIMED, "velocity mean": LATE, "constraint": CONSTRAINED, "two antennas": HEADED}


@pytest.mark.parametrize(
    ("name", "drives"),
    [("constraint", 1), *slow(("constraint", 3), ("time offset", 3), ("velocity mean", 3), ("two antennas", 3))],
)
def test_errors_are_as_large_as_the_filter_says(name: str, drives: int) -> None:
    """With drives of n states the mean is outside the band by chance in one of a thousand cases."""
    mean, freedom = nees_of_drives(range(drives), CASES[name])
    size = freedom / drives
    low, high = chi2.ppf((5e-4, 1.0 - 5e-4), freedom) / freedom
    assert low < mean / size < high, (mean, size)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_errors_of_many_drives_are_as_large_as_the_filter_says(name: str) -> None:
    """The mean of forty drives is outside the band by chance in one of a thousand cases."""
    mean, freedom = nees_of_drives(range(100, 140), CASES[name])
    size = freedom / 40
    low, high = chi2.ppf((5e-4, 1.0 - 5e-4), freedom) / freedom
    assert low < mean / size < high, (mean / size, low, high)


def test_a_time_offset_of_a_quarter_of_a_second_is_found() -> None:
    """Given, not drawn: 1σ of 2 ms at most at the end, and the error within four of them."""
    tables = {"gnss": {**RTK, "time_offset_s": 0.25}}
    found, errors = driven(1, tables)
    where = found.model.slices["gnss time offset"]
    assert found.sigma[-1, where][0] < 2e-3
    assert abs(errors[-1, where][0]) < 4.0 * found.sigma[-1, where][0]
    np.testing.assert_allclose(found.parameters["gnss time offset"][-1], 0.25, atol=8e-3)


def test_the_constraint_holds_an_outage() -> None:
    """Without satellites for 24 s the constraint at least halves the error of position across the way."""
    with_it, _ = driven(4, CONSTRAINED)
    without, _ = driven(4, {"gnss": CONSTRAINED["gnss"]})
    now = [float(np.hypot(*e.sigma[np.searchsorted(e.time, 98.5), :2])) for e in (with_it, without)]
    assert now[0] < 0.5 * now[1]


def test_the_mounting_is_that_of_the_block() -> None:
    found, errors = driven(2, CONSTRAINED)
    where = found.model.slices["land-vehicle mounting"]
    assert np.all(found.sigma[-1, where] < 0.2 * DEG)
    assert np.all(np.abs(errors[-1, where]) < 4.0 * found.sigma[-1, where])
    trajectory, _ = drive(DURATION, RATE_HZ, True, AHEAD)
    readings = AidingSection.model_validate({"land_vehicle": {}}).sensors()["land_vehicle"]
    told = readings.read(Vehicle(trajectory, 0, q_bs=block_in_vehicle()))[0].measurements
    ahead = rotation.dcm_from_quaternion(block_in_vehicle())[0]
    pitch, yaw = told.value[0, 2:]
    expected = (np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch))
    np.testing.assert_allclose(ahead, expected, atol=1e-12)
    assert MOUNTED_DEG[1] > 4.0  # so that the sign of either angle is tested


def test_added_noise_is_that_of_the_model() -> None:
    """Noise along the run, told as added noise instead of by the model, gives the same covariance."""
    trajectory, ideal = drive(30.0, RATE_HZ, False)
    quiet = ImuErrors(replace(MEMS.gyro, random_walk=1e-4 * DEG), replace(MEMS.accel, random_walk=1.0 * UG))
    sigmas = []
    for told in (MEMS, quiet):
        model = error_model(told, position=0.1, velocity=0.02, attitude=(5e-3, 5e-3, 5e-2))
        added = None
        if told is quiet:
            n, a = (
                np.sqrt(np.full((1, 3), loud.random_walk**2 - own.random_walk**2))
                for loud, own in ((MEMS.gyro, quiet.gyro), (MEMS.accel, quiet.accel))
            )
            added = AddedNoise(np.zeros(1), n, a)
        gnss = AidingSection.model_validate({"gnss": RTK}).sensors()["gnss"].read(Vehicle(trajectory, 3))
        found = estimate(
            ideal, trajectory.state(0.0), [g.measurements for g in gnss], model, gate=None, added_noise=added
        )
        sigmas.append(found.sigma)
    np.testing.assert_allclose(sigmas[1], sigmas[0], rtol=1e-3)


def test_added_noise_ends_where_it_is_said_to() -> None:
    """A heading that nothing aids: N² t of the model, and n² t of what adds to it in the first 20 s alone."""
    trajectory, ideal = drive(30.0, RATE_HZ, False)
    own, more = 0.1 * DEG / 60.0, 0.3 * DEG / 60.0
    quiet = ImuErrors(TriadErrors(random_walk=own), TriadErrors(random_walk=1e-5))
    model = error_model(quiet, position=0.1, velocity=0.02, attitude=(1e-4, 1e-4, 1e-5))
    added = AddedNoise(np.array([0.0, 20.0]), np.array([[more] * 3, [0.0] * 3]), np.zeros((2, 3)))
    found = estimate(ideal, trajectory.state(0.0), [], model, gate=None, added_noise=added)
    variance = found.sigma[:, model.slices["attitude"].stop - 1] ** 2
    expected = 1e-10 + own**2 * found.time + more**2 * np.minimum(found.time, 20.0)
    np.testing.assert_allclose(variance, expected, rtol=5e-5)  # the Earth's rotation mixes the axes by ω t = 2e-3


def shaken(imu: ImuData, seed: int, still: float, moving: float, engine: float) -> ImuData:
    """Return readings with the shaking of an engine, and with that of the road in motion, as white noise."""
    rng = np.random.default_rng([31, seed])
    at_rest = np.zeros(len(imu), dtype=bool)
    for begin, end in STANDS:
        at_rest |= (imu.time[:-1] >= begin - 1e-6) & (imu.time[1:] <= end + 1e-6)
    size = np.where(at_rest, still, moving)[:, None]
    angle = size * 0.5 * DEG / RATE_HZ * rng.standard_normal((len(imu), 3))
    speed = size * 0.05 / RATE_HZ * rng.standard_normal((len(imu), 3))
    angle[:, 1] += engine * DEG / RATE_HZ * rng.standard_normal(len(imu))
    return ImuData(imu.time, imu.dtheta + angle, imu.dvel + speed)


def test_noise_that_vibration_adds_is_found_and_the_filter_stays_consistent() -> None:
    """White noise that is eight times as large in motion: with κ = 1 the errors are as large as the filter says."""

    trajectory, ideal = drive(50.0, RATE_HZ, False)
    model = error_model(MEMS, position=0.1, velocity=0.02, attitude=(5e-3, 5e-3, 5e-2))
    values: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(1):
        run = one_run(trajectory, ideal, model, MEMS, seed)
        imu = shaken(run.imu, seed, 0.5, 4.0, 0.0)
        gnss = AidingSection.model_validate({"gnss": RTK}).sensors()["gnss"].read(Vehicle(trajectory, seed))
        for told in values:
            added = vibration_noise(vibration(imu), 1.0, 1.0) if told else None
            found = estimate(imu, run.initial, [g.measurements for g in gnss], model, gate=None, added_noise=added)
            errors = state_errors(model, found, trajectory.state(found.time), run.parameters, WGS84)
            values[told].append(float(nees(errors[found.rows[-1]], found.covariance[-1])))
    low, high = chi2.ppf((5e-4, 1.0 - 5e-4), 15)
    assert np.mean(values[True]) < high  # the level holds the sensors' own noise, too, so that κ = 1 is a bound
    assert np.mean(values[True]) > 0.5 * low
    assert np.mean(values[False]) > 3.0 * high


def test_a_filter_that_was_told_of_no_vibration_names_the_key() -> None:
    trajectory, ideal = drive(50.0, RATE_HZ, False)
    model = error_model(MEMS, position=0.1, velocity=0.02, attitude=(5e-3, 5e-3, 5e-2))
    run = one_run(trajectory, ideal, model, MEMS, 5)
    gnss = AidingSection.model_validate({"gnss": RTK}).sensors()["gnss"].read(Vehicle(trajectory, 5))
    given = [g.measurements for g in gnss]
    shaking = estimate(shaken(run.imu, 5, 1.0, 12.0, 20.0), run.initial, given, model)
    assert any("filter.vibration_noise" in remark and "gyros by" in remark for remark in shaking.remarks)
    quiet = estimate(run.imu, run.initial, given, model)
    assert not any("vibration" in remark for remark in quiet.remarks)


@pytest.mark.parametrize("begin", [0.0, 30.0])
def test_alignment_by_the_course(begin: float) -> None:
    """From rest the level is that of the accelerometers' bias; in motion it is that of the road, and both headings are
    those of the velocity: the errors are within four of their σ."""
    trajectory, ideal = drive(DURATION, RATE_HZ, True, AHEAD)
    run = one_run(trajectory, ideal, error_model(MEMS), MEMS, 2)
    first = int(np.searchsorted(ideal.time, begin - 1e-9))
    imu = ImuData(run.imu.time[first:], run.imu.dtheta[first:], run.imu.dvel[first:])
    gnss = AidingSection.model_validate({"gnss": RTK}).sensors()["gnss"].read(Vehicle(trajectory, 2))
    position, velocity = (g.measurements for g in gnss)
    aligned = align_by_course(imu, position, velocity, MEMS, angles=mounting(), angles_sigma=0.0)
    assert (aligned.edge == 0) is (begin == 0.0)
    assert not aligned.backwards
    truth = trajectory.state(imu.time[aligned.edge])
    off = rotation.rotation_vector_from_quaternion(
        rotation.multiply(truth.q_nb, rotation.conjugate(aligned.state.q_nb))
    )
    assert np.all(np.abs(off) < 4.0 * np.sqrt(aligned.covariance.diagonal()[6:]))
    assert np.sqrt(aligned.covariance[8, 8]) < 10.0 * DEG
    if begin == 0.0:
        tolerance = 4.0 * MEMS.gyro.random_walk / np.sqrt(8.0) + 1e-4
        np.testing.assert_allclose(aligned.gyro_bias, run.parameters["gyro bias"], atol=tolerance)


def test_a_vehicle_that_sets_off_backwards() -> None:
    """The same readings with the block turned round: its forward axis points to the rear."""
    trajectory, ideal = drive(DURATION, RATE_HZ, False)
    turn = np.array([-1.0, -1.0, 1.0])
    reverse = ImuData(ideal.time, turn * ideal.dtheta, turn * ideal.dvel)
    gnss = AidingSection.model_validate({"gnss": RTK}).sensors()["gnss"].read(Vehicle(trajectory, 2))
    aligned = align_by_course(reverse, *(g.measurements for g in gnss), MEMS)
    assert aligned.backwards
    half_turn = rotation.quaternion_from_euler(0.0, 0.0, np.pi)
    expected = rotation.multiply(trajectory.state(0.0).q_nb, half_turn)
    off = rotation.rotation_vector_from_quaternion(rotation.multiply(expected, rotation.conjugate(aligned.state.q_nb)))
    assert np.abs(off).max() < 8.0 * DEG


def mounting() -> tuple[float, float]:
    """Return pitch and yaw of the vehicle's axes in the block's."""
    ahead = rotation.dcm_from_quaternion(block_in_vehicle())[0]
    return float(np.arcsin(-ahead[2])), float(np.arctan2(ahead[1], ahead[0]))


def test_stops_of_a_drive_are_found_and_nothing_else() -> None:
    """On three drives with an engine that shakes one axis more: no window that moves by more than a millimetre counts,
    and of each stop all but the length of a window and a little more."""
    _, ideal = drive(DURATION, RATE_HZ, False)
    for seed in range(3):
        imu = shaken(ideal, seed, 1.0, 6.0, 1.0)
        rest = learn_rest(imu, spans=[(0.0, 8.0)])
        spans = find_stops(imu, rest).spans
        for begin, end in spans:
            assert any(a - 0.1 <= begin and end <= b + 0.3 for a, b in STANDS)
        for begin, end in STANDS:
            found = sum(min(end, b) - max(begin, a) for a, b in spans if a < end and b > begin)
            assert found > end - begin - 1.5
        zero_velocity, zero_rate = standstill(find_stops(imu, rest))
        assert len(zero_velocity) == len(zero_rate) > 10
