"""An ensemble whose samples are never stored: the same bits as one run after the other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from sinssim.data import Array, ImuData
from sinssim.jit import strict_kernel
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.emulation_kernel import FAULTY, STATES, advance, begin, draw_sample, measure, pack
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.size_effect import what_is_felt
from sinssim.statistics.random_numbers import key
from tests.sensors.imu.test_error_terms import lively
from tests.slow import slow

MIX = np.uint64(0x9E3779B97F4A7C15)


@strict_kernel
def run_all(active, time, dtheta, dvel, c, p, key_0, key_1, faults):
    """Return a number of every run into which every bit of every sample of every channel went, and the flags' sum."""
    runs = len(key_0)
    s, z = np.empty((runs, 6, STATES)), np.empty((4, 6, runs))
    u, y, flags = np.empty(6), np.empty(6), np.zeros(6, np.uint8)
    mixed, flagged = np.zeros(runs, np.uint64), np.zeros(runs, np.int64)
    for run in range(runs):
        begin(active, s, run, key_0[run], key_1[run])
    for k in range(len(dtheta)):
        advance(active, c, time[k], time[k + 1])
        draw_sample(active, z, k, key_0, key_1)
        u[:3], u[3:] = dtheta[k], dvel[k]
        for run in range(runs):
            measure(active, u, y, flags, c, p, s, run, z, run, faults)
            for i in range(6):
                mixed[run] = (mixed[run] ^ np.uint64(np.float64(y[i]).view(np.int64))) * MIX
                flagged[run] += flags[i]
    return mixed, flagged


def mixed_bits(measured: ImuData) -> int:
    """Return the same number from stored samples, with Python's integers."""
    number = 0
    for bits in np.hstack([measured.dtheta, measured.dvel]).ravel().view(np.uint64):
        number = ((number ^ int(bits)) * int(MIX)) & 0xFFFFFFFFFFFFFFFF
    return number


SECTIONS = {
    "equation (2)": Imu(grade="laser-standard", gyro_arw_deg_sqrt_h=0.0, accel_vrw_ug_sqrt_hz=0.0),
    "laser": Imu(grade="laser-standard", gyro_quantum_arcsec=1.0, accel_quantum_mm_s=1.0),
    "everything": Imu.model_validate(
        {
            "grade": "consumer",
            "gyro_asymmetry_sigma_ppm": 100.0,
            "gyro_g_sensitivity_sigma_deg_h_per_g": 10.0,
            "gyro_ramp_sigma_deg_h_per_h": 5.0,
            "gyro_bias_temperature_sigma_deg_h_per_c": 2.0,
            "gyro_flicker_deg_h": 5.0,
            "gyro_rrw_deg_h_sqrt_h": 3.0,
            "gyro_range_deg_s": 40.0,
            "gyro_quantum_arcsec": 2.0,
            "accel_cross_axis_sigma_ug_per_g2": 100.0,
            "accel_quadratic_sigma_ug_per_g2": 50.0,
            "accel_instability_ug": 30.0,
            "accel_flicker_ug": 20.0,
            "accel_rrw_ug_sqrt_h": 10.0,
            "accel_range_g": 1.5,
            "temperature_start_c": -10.0,
            "temperature_steady_c": 15.0,
            "warm_up_time_s": 2.0,
            "accel_arms_mm": [[20.0, 0.0, 5.0], [0.0, -30.0, 0.0], [10.0, 10.0, 10.0]],
            "accel_delay_ms": 0.5,
            "faults": [
                {"type": "dropout", "from_s": 13.0, "to_s": 13.2},
                {"type": "freeze", "from_s": 13.1, "to_s": 13.4, "channels": ["gyro_x"]},
                {"type": "spike", "at_s": 14.0, "accel_mm_s": [100.0, 0.0, 0.0]},
                {"type": "bias-step", "from_s": 14.5, "gyro_deg_h": [100.0, 0.0, 0.0]},
                {"type": "saturation", "from_s": 15.0, "gyro_deg_s": 20.0},
            ],
        }
    ),
}


def _packed(runs: list[ImuErrors], ideal: ImuData, seeds: list[int]) -> tuple[Array, ...]:
    packed = pack(runs, float(ideal.time[0]))
    keys = np.array([key(seed) for seed in seeds], dtype=np.uint64).T.copy()
    arguments = (packed.active, ideal.time, ideal.dtheta, ideal.dvel, packed.conditions, packed.parameters)
    return *arguments, keys[0], keys[1], packed.faults


# the compiler takes five seconds for the kernel alone, and ten to inline everything into one
@pytest.mark.parametrize("every_run", slow(run_all.py_func, run_all), ids=["called", "inlined"])
@pytest.mark.parametrize("name", SECTIONS)
def test_an_ensemble_is_its_runs_bit_for_bit(name: str, every_run: Callable[..., tuple[Array, Array]]) -> None:
    section, seeds = SECTIONS[name], [0, 1, 2, 7, 1 << 40]
    ideal = lively(500)
    runs = [draw(section, seed) for seed in seeds]
    felt = what_is_felt(ideal, runs[0])  # once for all runs
    arguments = _packed(runs, felt, seeds)
    with np.errstate(over="ignore"):  # the product of two words of 64 bits is cut off
        mixed, flagged = every_run(*arguments)
    singly = [emulate(ideal, section, seed) for seed in seeds]
    assert [int(number) for number in mixed] == [mixed_bits(measured) for measured in singly]
    assert len(set(mixed.tolist())) == len(seeds)
    if arguments[0] & FAULTY:
        assert flagged.tolist() == [int(measured.flags.sum()) for measured in singly]  # type: ignore[union-attr]
        assert np.all(flagged > 100)


def test_the_first_samples_do_not_know_how_many_follow() -> None:
    ideal = lively(700)
    short = ImuData(ideal.time[:302], ideal.dtheta[:301], ideal.dvel[:301])
    section = SECTIONS["everything"].model_copy(update={"accel_arms_mm": ((0.0,) * 3,) * 3, "accel_delay_ms": 0.0})
    whole, part = emulate(ideal, draw(section, 3), 3), emulate(short, draw(section, 3), 3)
    assert np.array_equal(whole.dtheta[:301], part.dtheta)
    assert np.array_equal(whole.dvel[:301], part.dvel)
    assert np.array_equal(whole.flags[:301], part.flags)  # type: ignore[index]
