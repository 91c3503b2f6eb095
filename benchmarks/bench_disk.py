"""Disk and processor time of the demonstration run by what is kept of it, its flight cached.

    python -m benchmarks.bench_disk [--repeat 3]

Every run is a process of its own; the least processor time of the repetitions counts. The same of loading the modules
that a run spends most on, each with what it loads itself.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

KINDS = {
    "--keep summary": ("--keep", "summary"),
    "--keep report": ("--keep", "report"),
    "--keep streams": ("--keep", "streams"),
    "default": (),
    "--recording full": ("--recording", "full"),
}


MODULES = ("numpy", "scipy.linalg", "numba", "sinssim.scenario.schema", "pyarrow.parquet", "rerun")
"""Modules that a run loads and that take longest."""


def environment() -> dict[str, str]:
    """Return the environment of an installed program, which keeps the bytecode of its modules."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def processor_time(*arguments: str) -> float:
    """Run Python with some arguments, and return the processor time of the process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, env=environment())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    repeat = range(parser.parse_args().repeat)
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "run"
        run = ("-m", "sinssim", "run", "first_flight", "-o", str(out), "--overwrite", "-q")
        processor_time(*run)  # flies, and compiles what is not compiled yet
        for words, options in KINDS.items():
            seconds = min(processor_time(*run, *options) for _ in repeat)
            recording, streams = out / "recording.rrd", list((out / "streams").glob("*.parquet"))
            recorded = recording.stat().st_size / 1e6 if recording.exists() else 0.0
            stored = sum(stream.stat().st_size for stream in streams) / 1e6
            print(f"{words:18s} {seconds:6.2f} s processor, recording {recorded:6.1f} MB, streams {stored:6.1f} MB")
        for module in MODULES:
            seconds = min(processor_time("-c", f"import {module}") for _ in repeat)
            print(f"import {module:24s} {seconds:6.2f} s processor, alone")


if __name__ == "__main__":
    main()
