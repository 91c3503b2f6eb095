"""Sessions: mean readings, noise seen past motion, and what is no session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim.alignment import determine_session, ideal_readings, mean_readings
from sinssim.alignment.determination import white_level
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.units import ARCSEC, DEG_SQRT_H

HEADING, ROLL, PITCH, LATITUDE = 2.1, 0.02, -0.03, np.radians(50.0)


def session(duration=300.0, rate=20.0):
    """A parked vehicle."""
    gyro, accel = ideal_readings(HEADING, ROLL, PITCH, LATITUDE)
    count = round(duration * rate)
    return ImuData(np.arange(count + 1) / rate, np.tile(gyro / rate, (count, 1)), np.tile(accel / rate, (count, 1)))


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


def test_samples_that_are_missing_are_told():
    imu = session()
    keep = np.r_[0:3000, 3200:6000]  # 10 s of increments lost
    holed = ImuData(np.r_[0.0, imu.time[1:][keep]], imu.dtheta[keep], imu.dvel[keep])
    with pytest.raises(InputError, match=r"samples are missing for 10\.05 s from time\[3000\] = 150 s"):
        determine_session(holed)


@pytest.mark.parametrize("quantum_arcsec", [0.0, 1.0])
def test_white_level_is_the_random_walk_and_what_pulses_leave(quantum_arcsec):
    section = Imu(grade="laser-standard", gyro_quantum_arcsec=quantum_arcsec)
    levels = [white_level(emulate(session(rate=100.0), section, seed).dtheta, 300.0) for seed in range(8)]
    # pulses add Q²/4τ to N²; the longest octave that leaves 128 parts of 300 s is 1.28 s
    expected = np.hypot(0.003 * DEG_SQRT_H, quantum_arcsec * ARCSEC / np.sqrt(4 * 1.28))
    assert np.mean(levels) == pytest.approx(expected, rel=0.1)


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
