"""Allan deviation and identification of ten hours of six channels at 100 Hz: `python -m benchmarks.bench_allan`.

Seconds are of processor time on one core. The noise is that of a mems-tactical unit with flicker, emulated.
"""

from __future__ import annotations

import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sinssim.analyses.allan_deviation import allan_deviation
from sinssim.analyses.noise_fit import fit_noise
from sinssim.analyses.noise_report import noise_report
from sinssim.data import ImuData
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu

SAMPLES, RATE = 3_600_000, 100.0
REPEATS = 3
BAR = 10.0
"""Seconds for the whole log."""


def main() -> None:
    """Measure and print."""
    unit = Imu(grade="mems-tactical", gyro_flicker_deg_h=0.5, accel_flicker_ug=30.0)
    time_s = np.arange(SAMPLES + 1) / RATE
    still = ImuData(time_s, np.full((SAMPLES, 3), 5e-7), np.full((SAMPLES, 3), -0.05))
    measured = emulate(still, unit, seed=1)
    channel = np.ascontiguousarray(measured.dtheta[:, 0])
    for name, work in (
        ("overlapping Allan deviation of a channel", lambda: allan_deviation(channel, 1.0 / RATE)),
        ("noise terms of a channel", lambda: fit_noise(channel, 1.0 / RATE)),
    ):
        print(f"{name:48s} {_best(work):6.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "imu.parquet"
        columns = {"time_s": measured.time[1:]}
        for axis, letter in enumerate("xyz"):
            columns[f"dtheta_{letter}_rad"] = measured.dtheta[:, axis]
            columns[f"dvel_{letter}_mps"] = measured.dvel[:, axis]
        pq.write_table(pa.table(columns), path)
        size = sum(values.nbytes for values in columns.values()) / 2**20
        seconds = _best(lambda: noise_report(path))
        tracemalloc.start()
        noise_report(path)
        peak = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
    name = "six channels, read from Parquet"
    print(f"{name:48s} {seconds:6.2f} s (bar {BAR:g})   peak {peak:.0f} MiB for {size:.0f} MiB")


def _best(work: Callable[[], object]) -> float:
    seconds = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        seconds.append(time.process_time() - start)
    return min(seconds)


if __name__ == "__main__":
    main()
