"""Time and memory of the emulator over one Schuler period at 100 Hz: `python benchmarks/bench_emulate.py`."""

from __future__ import annotations

import time
import tracemalloc

import numpy as np

from sinssim.data import ImuData
from sinssim.scenario.imu import ImuSection
from sinssim.sensors import emulate

SAMPLES = 504_000  # 84 min at 100 Hz


def main() -> None:
    """Print one line per case."""
    edges = np.arange(SAMPLES + 1) / 100.0
    rng = np.random.default_rng(1)
    ideal = ImuData(edges, rng.normal(0, 1e-3, (SAMPLES, 3)), rng.normal(0, 0.1, (SAMPLES, 3)))
    size = (ideal.dtheta.nbytes + ideal.dvel.nbytes) / 2**20
    cases = {
        "laser-standard": ImuSection(grade="laser-standard"),
        "laser-standard, quantised": ImuSection(
            grade="laser-standard", gyro_quantum_arcsec=1.0, accel_quantum_mm_s=1.0
        ),
        "consumer, with instability": ImuSection(grade="consumer"),
    }
    for name, section in cases.items():
        emulate(ideal, section)  # compiles what it needs
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            emulate(ideal, section)
            seconds.append(time.perf_counter() - start)
        tracemalloc.start()
        emulate(ideal, section)
        peak = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        print(
            f"{name:28s} {min(seconds) * 1e3:6.1f} ms  {SAMPLES / min(seconds) / 1e6:5.1f} M samples/s  "
            f"peak {peak:.0f} MiB for {size:.0f} MiB of increments"
        )


if __name__ == "__main__":
    main()
