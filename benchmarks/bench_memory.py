"""Peak memory of a run with a filter: a parked vehicle, every rate 10 Hz, no smoothing; Linux only."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario
from sinssim.scenario.run_memory import needed_memory


def scenario(seconds: float, rate: float, smooth: bool) -> Scenario:
    """Return the scenario that is measured."""
    return Scenario.model_validate(
        {
            "name": "standing",
            "parked": {"latitude_deg": 50.0, "duration_s": seconds},
            "imu": {"grade": "tactical", "rate_hz": rate},
            "aiding": {"gnss": {"rate_hz": rate}, "baro": {"rate_hz": rate}},
            "filter": {"rate_hz": rate, "states": ("gyro bias", "accelerometer bias"), "smooth": smooth},
        }
    )


def status(name: str) -> float:
    """Return a size from the kernel's account of this process, bytes; Linux only."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return 1024.0 * float(line.split()[1])
    raise LookupError(name)


def main() -> None:
    """Measure in a process of its own and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0, help="duration (default: %(default)s)")
    parser.add_argument("--rate", type=float, default=10.0, help="every rate, Hz (default: %(default)s)")
    parser.add_argument("--smooth", action="store_true", help="smooth as well")
    parser.add_argument("--stages", action="store_true", help="print the memory during the run as well")
    parser.add_argument("--here", choices=("recorded", "kept"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    measured = scenario(3600.0 * arguments.hours, arguments.rate, arguments.smooth)
    if arguments.here is None:
        for where, words in (("kept", "without a run directory"), ("recorded", "written to a run directory")):
            command = [sys.executable, "-m", "benchmarks.bench_memory", *sys.argv[1:], "--here", where]
            print(f"{words}: {subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE).stdout}", end="")
        return

    def watch(stage: str, fraction: float) -> None:
        if arguments.stages:
            print(f"  {stage:>9} {fraction:5.2f}  {status('VmRSS') / 1e9:.3f} GB", file=sys.stderr)

    with tempfile.TemporaryDirectory() as folder:
        recorded = arguments.here == "recorded"
        run(measured, Path(folder) / "run" if recorded else None, progress=watch)
    expected = needed_memory(measured, recorded=recorded).total
    print(f"{status('VmHWM') / 1e9:.2f} GB at most, {expected / 1e9:.2f} GB estimated")


if __name__ == "__main__":
    main()
