"""Largest memory of `sinssim ensemble` with its report, for few runs and for many.

    python -m benchmarks.bench_ensemble_memory [--runs 1000 20000] [--rate 10]

The memory of a run in progress depends on the rate of the samples, that of the statistics on the number of runs.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile


def peak(runs: int, rate: float) -> float:
    """Return the largest memory of the command, processes that it waits for included, MiB."""
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "sinssim", "ensemble", "first_flight", "--runs", str(runs), "-q", "-o", place]
        child = os.posix_spawn(sys.executable, [*command, "--set", f"imu.rate_hz={rate:g}"], os.environ)
        _, status, usage = os.wait4(child, 0)
    if status:
        raise RuntimeError(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
    return usage.ru_maxrss / 2**10


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, nargs="+", default=[1000, 20_000])
    parser.add_argument("--rate", type=float, default=10.0)
    options = parser.parse_args()
    for runs in options.runs:
        print(f"{runs} runs of first_flight at {options.rate:g} Hz: {peak(runs, options.rate):.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
