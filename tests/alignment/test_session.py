"""Sessions: mean readings, noise seen past motion, and vehicles that did not stand still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.alignment import (
    InstrumentErrors,
    determine_session,
    expected_errors,
    ideal_readings,
    largest_drift,
    mean_readings,
    stillness,
)
from sinssim.alignment.session import white_level
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.scenario.imu import ImuSection
from sinssim.sensors import emulate
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, PPM, UG

HEADING, ROLL, PITCH, LATITUDE = 2.1, 0.02, -0.03, np.radians(50.0)


def session(duration=300.0, rate=20.0, change=None):
    """A parked vehicle; `change(t)` gives rotation vectors of its attitude, (N+1, 3) rad, from the first one."""
    gyro, accel = ideal_readings(HEADING, ROLL, PITCH, LATITUDE)
    time = np.arange(round(duration * rate) + 1) / rate
    dtheta, dvel = np.tile(gyro / rate, (len(time) - 1, 1)), np.tile(accel / rate, (len(time) - 1, 1))
    if change is not None:  # small rotations: the Earth's rate and gravity as the turned block sees them
        turn = change(time)
        middle = Rotation.from_rotvec(0.5 * (turn[1:] + turn[:-1]))
        dtheta = middle.inv().apply(dtheta) + np.diff(turn, axis=0)
        dvel = middle.inv().apply(dvel)
    return ImuData(time, dtheta, dvel)


def step(size, axis, at):
    """A turn of `size` about one axis within two seconds."""
    return lambda t: np.outer(size * np.clip((t - at) / 2.0, 0.0, 1.0), np.eye(3)[axis])


def test_a_quiet_session_gives_the_angles():
    result = determine_session(session())
    np.testing.assert_allclose(
        [result.heading, result.roll, result.pitch, result.latitude],
        [HEADING, ROLL, PITCH, LATITUDE],
        rtol=0,
        atol=1e-11,
    )


def test_mean_readings_take_uneven_intervals():
    imu = session()
    coarse = np.r_[0:90:4, 90, 93, 94, 98, 100 : len(imu.time)]
    sums = [np.add.reduceat(x, coarse[:-1], axis=0) for x in (imu.dtheta, imu.dvel)]
    for mine, all_samples in zip(mean_readings(ImuData(imu.time[coarse], *sums)), mean_readings(imu), strict=True):
        np.testing.assert_allclose(mine, all_samples, rtol=1e-12)


@pytest.mark.parametrize("grade", ["ideal", "laser-navigation", "laser-standard", "tactical", "mems-tactical"])
def test_noise_alone_is_not_taken_for_motion(grade):
    for seed in range(20):
        found = stillness(emulate(session(), ImuSection(grade=grade), seed))
        assert not found.moved, (seed, found)


def test_pulses_are_not_taken_for_motion():
    section = ImuSection(grade="laser-standard", gyro_quantum_arcsec=1.0, accel_quantum_mm_s=1.0)
    for seed in range(20):
        assert not stillness(emulate(session(), section, seed)).moved


def test_drift_within_the_known_bias_is_not_taken_for_motion():
    sigmas = InstrumentErrors(25 * DEG_H, 1000 * PPM, 2000 * UG, 1000 * PPM)
    for seed in range(20):
        assert not stillness(emulate(session(), ImuSection(grade="mems-industrial"), seed), sigmas).moved


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (step(20 * ARCSEC, 0, 120.0), "specific force turns"),  # rolled a little
        (step(60 * ARCSEC, 2, 200.0), "departs from a steady turn"),  # turned a little on the spot
        (lambda t: np.outer(1e-2 * np.sin(2 * np.pi * 0.3 * t), [1.0, 0.5, 0.2]), "moved"),  # swayed
        (lambda t: np.outer(10 * ARCSEC * t / t[-1], [0.0, 1.0, 0.0]), "specific force turns"),  # sank slowly
    ],
)
def test_a_vehicle_that_moved_is_found_out(change, text):
    imu = emulate(session(change=change), ImuSection(grade="laser-standard"), 3)
    with pytest.raises(InputError, match="moved during the session") as info:
        determine_session(imu)
    assert text in str(info.value)
    assert "arcsec" in str(info.value)


DRIFTING = {
    "gyro temperature": {"gyro_bias_temperature_sigma_deg_h_per_c": 0.02},
    "accelerometer temperature": {"accel_bias_temperature_sigma_ug_per_c": 10.0},
    "accelerometer scale": {"accel_scale_temperature_sigma_ppm_per_c": 20.0},
    "gyro ramp": {"gyro_ramp_deg_h_per_h": (2.0, -3.0, 1.0)},
    "accelerometer ramp": {"accel_ramp_ug_per_h": (700.0, -500.0, 0.0)},
    "gyro walk": {"gyro_rrw_deg_h_sqrt_h": 0.3},
    "accelerometer walk": {"accel_rrw_ug_sqrt_h": 300.0},
}


@pytest.mark.parametrize("name", DRIFTING)
def test_a_drift_that_is_known_of_is_not_taken_for_motion(name: str) -> None:
    section = ImuSection(
        grade="ideal", temperature_start_c=-20.0, temperature_steady_c=10.0, warm_up_time_s=200.0, **DRIFTING[name]
    )
    expected = expected_errors(section)
    drift = largest_drift(expected, 300.0)
    alone = []
    for seed in range(20):
        imu = emulate(session(), section, seed)
        alone.append(stillness(imu).moved)
        assert not stillness(imu, expected.instrument_sigmas, drift).moved
    assert any(alone)
    # and motion is found all the same
    moved = emulate(session(change=step(600 * ARCSEC, 2, 200.0)), section, 1)
    assert stillness(moved, expected.instrument_sigmas, drift).moved


def test_samples_that_are_missing_are_told():
    imu = session()
    keep = np.r_[0:3000, 3200:6000]  # 10 s of increments lost
    holed = ImuData(np.r_[0.0, imu.time[1:][keep]], imu.dtheta[keep], imu.dvel[keep])
    with pytest.raises(InputError, match=r"samples are missing, there are none for 10\.05 s from time\[3000\] = 150 s"):
        determine_session(holed)


def test_the_time_of_a_jolt_is_told():
    found = stillness(emulate(session(change=step(60 * ARCSEC, 2, 200.0)), ImuSection(grade="laser-standard"), 1))
    assert found.rotation_time == pytest.approx(201.0, abs=3.0)
    # a step of size s at fraction x of the session departs from the chord by s·max(x, 1-x)
    assert found.rotation == pytest.approx(60 * ARCSEC * 2 / 3, abs=6 * ARCSEC)


@pytest.mark.parametrize("quantum_arcsec", [0.0, 1.0])
def test_white_level_is_the_random_walk_and_what_pulses_leave(quantum_arcsec):
    section = ImuSection(grade="laser-standard", gyro_quantum_arcsec=quantum_arcsec)
    levels = [white_level(emulate(session(rate=100.0), section, seed).dtheta, 300.0) for seed in range(8)]
    # pulses add Q²/4τ to N²; the longest octave that leaves 128 parts of 300 s is 1.28 s
    expected = np.hypot(0.003 * DEG_SQRT_H, quantum_arcsec * ARCSEC / np.sqrt(4 * 1.28))
    assert np.mean(levels) == pytest.approx(expected, rel=0.1)


def test_a_sway_does_not_hide_itself_by_raising_the_noise_level():
    sway = session(change=lambda t: np.outer(1e-3 * np.sin(2 * np.pi * 0.5 * t), [1.0, 1.0, 1.0]), rate=100.0)
    found = stillness(emulate(sway, ImuSection(grade="laser-standard"), 1))
    assert found.rotation > 3 * found.rotation_limit


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda d: replace(d, time=d.time[:-1]), "do not belong together"),
        (lambda d: replace(d, dtheta=d.dtheta[:, :2]), "do not belong together"),
        (lambda d: ImuData(d.time[:11], d.dtheta[:10], d.dvel[:10]), "10 samples"),
        (lambda d: replace(d, dvel=np.where(np.arange(len(d))[:, None] == 17, np.nan, d.dvel)), "dvel[17]"),
        (lambda d: replace(d, time=np.where(np.arange(len(d) + 1) == 5, 0.0, d.time)), "time[4] = "),
        (lambda d: replace(d, dtheta=0.0 * d.dtheta), "gyros read zero"),
        (lambda d: replace(d, dvel=0.0 * d.dvel), "accelerometers read zero"),
        (lambda d: replace(d, dvel=d.dvel * 20.0), "m/s per increment"),
    ],
)
def test_unusable_sessions_are_refused(spoil, text):
    with pytest.raises(InputError) as info:
        determine_session(spoil(session(duration=60.0)))
    assert text in str(info.value)
