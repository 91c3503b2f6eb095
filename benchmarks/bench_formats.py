"""Reads a million rows of an IMU as text of KF-GINS, with all digits of a double: processor time and memory.

    python -m benchmarks.bench_formats

The file is written by one process and read by another, so that the memory is that of reading alone.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

_ROWS = 1_000_000


def main() -> None:
    """Write the file, and read it in a process of its own."""
    if len(sys.argv) == 2:
        _read(Path(sys.argv[1]))
        return
    from sinssim.logs.numeric_columns import columns_of, write_columns

    with tempfile.TemporaryDirectory() as folder:
        path, head = Path(folder) / "imu.txt", Path(folder) / "head.txt"
        values = 1e-3 * np.random.default_rng(1).standard_normal((_ROWS, 6))
        values[:, 5] -= 0.005 * 9.8  # at rest: gravity is what the format is recognised by
        columns = columns_of(345618.0 + 0.005 * np.arange(_ROWS), values)
        write_columns(path, columns)
        write_columns(head, [column[:100] for column in columns])
        subprocess.run([sys.executable, "-m", "benchmarks.bench_formats", str(path)], check=True)


def _read(path: Path) -> None:
    """Read the file, and print the time and the memory beside that of the arrays."""
    from sinssim.logs.formats import read_file

    read_file(path.with_name("head.txt"))  # loads the libraries
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, processor = time.perf_counter(), time.process_time()
    imu = read_file(path).inertial["imu"]
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    size = imu.time.nbytes + imu.gyro.nbytes + imu.accel.nbytes
    print(f"{len(imu)} rows, {path.stat().st_size / 1e6:.0f} MB: {wall:.2f} s, processor {processor:.2f} s (≤ 2 s)")
    print(f"memory of reading: {more / 1e6:.0f} MB, {more / size:.1f} × the arrays (≤ 5)")


if __name__ == "__main__":
    main()
