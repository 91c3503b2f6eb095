"""The demonstration run against JSBSim alone, with a new and with a cached flight; and `--help`.

    python -m benchmarks.bench_demo [--repeat 3]

Every run is a process of its own with nothing in its flight cache at first and its kernels compiled. Its denominators
are whole processes too, `bare_jsbsim`: JSBSim stepping the model as sinssim loads it, and as the jsbsim package ships
it. All of them alternate, and the ratios are medians of the pairs. Seconds are wall clock and processor time.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.bench_disk import environment
from sinssim import load_scenario
from sinssim.experiments.run.run_execution import run
from sinssim.jit import cache_root
from sinssim.recording.page import page_of
from sinssim.truth.flight import jsbsim_model
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.units import FOOT


def timed(command: list[str], cache: Path) -> tuple[float, float, str]:
    """Run a process and return its wall-clock time, its processor time (s) and its output."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    ended = subprocess.run(
        command, env={**environment(), "SINSSIM_CACHE": str(cache)}, capture_output=True, text=True, check=True
    )
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, ended.stdout


def bare(flight: FlightPlan, seconds: float, loaded: Path | None) -> list[str]:
    """Return the command that lets JSBSim alone fly as long, with the model in a folder or as shipped."""
    aircraft = load_aircraft(flight.aircraft)
    script = Path(__file__).with_name("bare_jsbsim.py")
    numbers = (seconds, jsbsim_model.STEP, flight.start.altitude_m / FOOT, aircraft.performance.cruise_kt)
    command = [sys.executable, str(script), aircraft.jsbsim_model, *map(str, numbers)]
    return command if loaded is None else [*command, str(loaded)]


def demo(folder: Path, fresh: bool) -> tuple[float, float, dict[str, Any]]:
    """Run the demonstration, and return wall-clock time, processor time (s) and its summary."""
    if fresh:
        for flight in (folder / "flights").glob("*"):
            flight.unlink()
    out = ["run", "first_flight", "-o", str(folder / "run"), "--overwrite", "--json"]
    wall, processor, said = timed([sys.executable, "-m", "sinssim", *out], folder)
    return wall, processor, json.loads(said)


def show(what: str, runs: list[tuple[float, float, Any]], against: dict[str, list[tuple[float, float, Any]]]) -> None:
    """Print one line, with the medians of the ratios to each denominator, and the stages of the fastest run."""
    wall, processor, summary = min(runs, key=lambda r: r[0])
    print(f"{what:30s} {wall:7.2f} s wall, {processor:6.2f} s processor")
    for name, others in against.items():
        ratios = [[a[i] / b[i] for a, b in zip(runs, others, strict=True)] for i in (0, 1)]
        print(" " * 31 + f"x{median(ratios[0]):.2f} wall, x{median(ratios[1]):.2f} processor of {name}")
    if isinstance(summary, dict):
        print(
            " " * 31 + ", ".join(f"{stage.removesuffix('_s')} {s:.2f}" for stage, s in summary["timing"].items() if s)
        )


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
        aircraft = load_aircraft(scenario.flight.aircraft)
        loaded = folder / "model"
        loaded.mkdir()
        with jsbsim_model.quiet():
            jsbsim_model.loaded_model(scenario.flight.aircraft, aircraft, str(loaded))
        same, stock = (bare(scenario.flight, seconds, where) for where in (loaded, None))
        rounds = [
            (timed(same, folder), demo(folder, fresh=True), timed(stock, folder), demo(folder, fresh=False))
            for _ in repeat
        ]
        as_loaded, flown, as_shipped, cached = ([r[i] for r in rounds] for i in range(4))
        denominators = {"JSBSim, model as loaded": as_loaded, "JSBSim, model as shipped": as_shipped}
        for name, runs in denominators.items():
            show(name, runs, {})
        show("demo, flight to fly", flown, denominators)
        show("demo, flight cached", cached, denominators)
        helped = [timed([sys.executable, "-m", "sinssim", "--help"], folder) for _ in range(5)]
        wall, processor = (min(h[i] for h in helped) for i in (0, 1))
        print(f"{'sinssim --help':30s} {wall:7.2f} s wall, {processor:6.2f} s processor")

    result = run(scenario)
    times = []
    for _ in range(5):
        begin = time.process_time()
        page = page_of(result.exhibits)
        times.append(time.process_time() - begin)
    print(f"{'report.html':30s} {min(times):7.2f} s processor, {len(page.encode()) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
