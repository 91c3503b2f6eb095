"""Speed and memory of the emulator over one Schuler period at 100 Hz: `python -m benchmarks.bench_emulate`.

A sample is three gyros and three accelerometers. Samples per second are of processor time on one core, through
`emulate`: checks, drawing and arrays included.
"""

from __future__ import annotations

import time
import tracemalloc

import numpy as np

from sinssim.data import ImuData
from sinssim.scenario.imu import ImuSection
from sinssim.sensors import emulate

SAMPLES = 504_000  # 84 min at 100 Hz
REPEATS = 9

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
"""What differs from laser-standard, and the bar, M samples/s."""


def main() -> None:
    """Print one line per case."""
    edges = np.arange(SAMPLES + 1) / 100.0
    rng = np.random.default_rng(1)
    ideal = ImuData(edges, rng.normal(0, 1e-3, (SAMPLES, 3)), rng.normal(0, 0.1, (SAMPLES, 3)))
    size = (ideal.dtheta.nbytes + ideal.dvel.nbytes) / 2**20
    for name, (keys, bar) in CASES.items():
        section = ImuSection.model_validate({"grade": "laser-standard", **keys})
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


if __name__ == "__main__":
    main()
