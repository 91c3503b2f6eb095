"""The demonstration run against JSBSim alone, with the flight to fly and with the flight cached; and `--help`.

    python -m benchmarks.bench_demo [--repeat 3]

Every run is a process of its own with nothing in its flight cache at first and its kernels compiled. Seconds are wall
clock and processor time of the whole process, the least of the repetitions; run it on a quiet machine.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.bench_flight import alone
from sinssim import load_scenario
from sinssim.jit import cache_root
from sinssim.recording.report import Material, run_report
from sinssim.simulation import run


def process(arguments: list[str], cache: Path) -> tuple[float, float, str]:
    """Run the program and return wall-clock time, processor time (s) and what it printed."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    ended = subprocess.run(
        [sys.executable, "-m", "sinssim", *arguments],
        env={**os.environ, "SINSSIM_CACHE": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, ended.stdout


def demo(folder: Path, fresh: bool) -> tuple[float, float, dict[str, Any]]:
    """Run the demonstration, and return wall-clock time, processor time (s) and its summary."""
    if fresh:
        for flight in (folder / "flights").glob("*"):
            flight.unlink()
    out = ["run", "first_flight", "-o", str(folder / "run"), "--overwrite", "--json"]
    wall, processor, said = process(out, folder)
    return wall, processor, json.loads(said)


def show(what: str, runs: list[tuple[float, float, dict[str, Any]]], bare: float, stock: float) -> None:
    """Print one line, and the stages of the best run."""
    wall, _, summary = min(runs, key=lambda r: r[0])
    processor = min(r[1] for r in runs)
    ratios = f"x{wall / bare:.2f} of JSBSim alone, x{wall / stock:.2f} with the model as shipped"
    print(f"{what:30s} {wall:7.2f} s wall, {processor:6.2f} s processor: {ratios}")
    print(" " * 31 + ", ".join(f"{stage.removesuffix('_s')} {s:.2f}" for stage, s in summary["timing"].items() if s))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    repeat = range(parser.parse_args().repeat)
    scenario = load_scenario("first_flight")
    assert scenario.flight is not None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kernels = cache_root() / "kernels"
        kernels.mkdir(parents=True, exist_ok=True)
        (folder / "kernels").symlink_to(kernels)
        _, _, summary = demo(folder, fresh=True)  # compiles what is not compiled yet
        seconds = summary["end_s"] - summary["start_s"]
        bare, stock = (min(alone(scenario.flight, seconds, shipped=s) for _ in repeat) for s in (False, True))
        print(f"{'JSBSim alone, the same flight':30s} {bare:7.2f} s processor, model as shipped {stock:.2f} s")
        show("demo, flight to fly", [demo(folder, fresh=True) for _ in repeat], bare, stock)
        show("demo, flight cached", [demo(folder, fresh=False) for _ in repeat], bare, stock)
        helped = [process(["--help"], folder) for _ in range(5)]
        wall, processor = (min(h[i] for h in helped) for i in (0, 1))
        print(f"{'sinssim --help':30s} {wall:7.2f} s wall, {processor:6.2f} s processor")

    result = run(scenario)
    error = next(iter(result.errors.values()))
    material = Material(scenario, result.trajectory, error.time, result.truth, result.solutions, result.errors)
    times = []
    for _ in range(5):
        begin = time.process_time()
        page = run_report(material, result.summary)
        times.append(time.process_time() - begin)
    print(f"{'report.html':30s} {min(times):7.2f} s processor, {len(page.encode()) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
