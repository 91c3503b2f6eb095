"""Speed and memory of the emulator over one Schuler period at 100 Hz: `python -m benchmarks.bench_emulate`.

A sample is three gyros and three accelerometers. Samples per second are of processor time on one core, through
`emulate`: checks, drawing and arrays included. The last line is an ensemble whose samples are never stored.
"""

from __future__ import annotations

import resource
import time
import tracemalloc

import numpy as np

from sinssim.data import ImuData
from sinssim.jit import strict_kernel
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.emulation_kernel import STATES, advance, begin, draw_sample, measure, pack
from sinssim.sensors.imu.imu_section import Imu
from sinssim.statistics.random_numbers import key

SAMPLES = 504_000  # 84 min at 100 Hz
REPEATS = 9
RUNS, OF_RUN = 2000, 60_000  # an ensemble of ten minutes

QUIET = {"gyro_arw_deg_sqrt_h": 0.0, "accel_vrw_ug_sqrt_hz": 0.0}
WANDER = {"gyro_instability_deg_h": 0.003, "accel_instability_ug": 5.0}
WALK = {"gyro_rrw_deg_h_sqrt_h": 0.001, "accel_rrw_ug_sqrt_h": 1.0}
FLICKER = {"gyro_flicker_deg_h": 0.001, "accel_flicker_ug": 3.0}
PULSES = {"gyro_quantum_arcsec": 1.0, "accel_quantum_mm_s": 1.0}

CASES = {
    "equation (2)": ({"gyro_misalignment_sigma_arcsec": 0.0, "accel_misalignment_sigma_arcsec": 0.0, **QUIET}, 30.0),
    "laser-standard: (2), misalignment, random walks": ({}, None),
    "laser-standard, quantised": (PULSES, None),
    "all white and Gauss-Markov noise": ({**WANDER, **WALK}, 5.0),
    "all of them and flicker": ({**WANDER, **WALK, **FLICKER}, 5.0),
    "all of them, flicker, quantised": ({**WANDER, **WALK, **FLICKER, **PULSES}, None),
}
"""Differences from laser-standard, and the required speed, M samples/s."""


def main() -> None:
    """Print one line per case."""
    edges = np.arange(SAMPLES + 1) / 100.0
    rng = np.random.default_rng(1)
    ideal = ImuData(edges, rng.normal(0, 1e-3, (SAMPLES, 3)), rng.normal(0, 0.1, (SAMPLES, 3)))
    size = (ideal.dtheta.nbytes + ideal.dvel.nbytes) / 2**20
    for name, (keys, bar) in CASES.items():
        section = Imu.model_validate({"grade": "laser-standard", **keys})
        emulate(ideal, section)  # compiles what it needs
        seconds = []
        for _ in range(REPEATS):
            start = time.process_time()
            emulate(ideal, section)
            seconds.append(time.process_time() - start)
        tracemalloc.start()
        emulate(ideal, section)
        peak = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        print(
            f"{name:48s} {min(seconds) * 1e3:6.1f} ms  {SAMPLES / min(seconds) / 1e6:5.1f} M samples/s"
            f"{'' if bar is None else f' (bar {bar:g})':11s} peak {peak:.0f} MiB for {size:.0f} MiB of increments"
        )
    ensemble(ideal)


@strict_kernel
def _sums(active, time, dtheta, dvel, c, p, key_0, key_1, faults):
    """Return the sums of the measured increments of every run, (R, 6)."""
    runs = len(key_0)
    s, z, sums = np.empty((runs, 6, STATES)), np.empty((4, 6, runs)), np.zeros((runs, 6))
    u, y, flags = np.empty(6), np.empty(6), np.zeros(6, np.uint8)
    for run in range(runs):
        begin(active, s, run, key_0[run], key_1[run])
    for k in range(len(dtheta)):
        advance(active, c, time[k], time[k + 1])
        draw_sample(active, z, k, key_0, key_1)
        u[:3], u[3:] = dtheta[k], dvel[k]
        for run in range(runs):
            measure(active, u, y, flags, c, p, s, run, z, run, faults)
            sums[run] += y
    return sums


def ensemble(ideal: ImuData) -> None:
    """Print the memory of an ensemble in addition to the ideal increments."""
    section = Imu.model_validate({"grade": "laser-standard", **PULSES})
    packed = pack([draw(section, seed) for seed in range(RUNS)], 0.0)
    keys = np.array([key(seed) for seed in range(RUNS)], dtype=np.uint64).T.copy()

    def run(samples: int) -> None:
        time, dtheta, dvel = ideal.time[: samples + 1], ideal.dtheta[:samples], ideal.dvel[:samples]
        _sums(packed.active, time, dtheta, dvel, packed.conditions.copy(), packed.parameters, keys[0], keys[1],
              packed.faults)  # fmt: skip

    run(1)
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    run(OF_RUN)
    seconds = time.process_time() - start
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 2**10
    print(
        f"ensemble of {RUNS} runs, laser-standard, quantised {seconds:10.1f} s   "
        f"{RUNS * OF_RUN / seconds / 1e6:5.1f} M samples/s            "
        f"{more:.0f} MiB more, not {RUNS * OF_RUN * 48 / 2**20:.0f} MiB of increments"
    )


if __name__ == "__main__":
    main()
