"""Measures what a navigator of somebody else costs beyond its own work: a library, a program in bulk, and step by step.

    python -m benchmarks.bench_foreign_navigator [--samples 1000000] [--repeat 5]

Its own work is next to nothing: it answers each sample with the state that it began with. Times are wall-clock, with
the start of its process; the best of the repetitions.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from sinssim.content import package_content
from sinssim.data import ImuData
from sinssim.scenario.navigation_section import NavigatorSection
from sinssim.simulation import foreign_navigator
from sinssim.simulation.navigator_protocol import Feed

IDLE = """
#include "sinssim_navigator.h"
static struct sinssim_solution now;
static int navigator_begin(const struct sinssim_begin *begin, const struct sinssim_sensor *sensors) {
    (void)sensors;
    memcpy(now.state, begin->state, sizeof now.state);
    return 0;
}
static void navigator_sample(const struct sinssim_sample *sample) { now.time = sample->time; }
static void navigator_measurement(unsigned k, double a, double t, const double *v, const double *s) {
    (void)k, (void)a, (void)t, (void)v, (void)s;
}
static void navigator_solution(struct sinssim_solution *solution) { memcpy(solution, &now, 88); }
"""


def feed_of(samples: int, *, stepwise: bool = False) -> Feed:
    """Return samples of a vehicle at rest, at 100 Hz."""
    edges = 0.01 * np.arange(samples + 1)
    numbers = dict.fromkeys(
        ("epoch_gps_s", "time_s", "state_sigma", "imu_rate_hz", "gyro_noise", "accel_noise", "gyro_bias", "accel_bias",
         "gyro_walk", "accel_walk", "gyro_instability", "accel_instability", "correlation_s", "gyro_scale",
         "accel_scale", "quantum", "ellipsoid", "gravity_equator", "gravity_k"), 0.0,
    )  # fmt: skip
    state = np.array([0.8, 0.2, 100.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    begin = {**numbers, "state": state, "gravity": "normal"}
    return Feed(begin, ImuData(edges, np.zeros((samples, 3)), np.full((samples, 3), 0.1)), (), stepwise=stepwise)


def seconds(navigator: NavigatorSection, feed: Feed, repeat: int) -> float:
    """Return the best time of a navigator, from its start to its checked solution, s."""
    best = np.inf
    for _ in range(repeat):
        begin = time.perf_counter()
        solution = foreign_navigator.navigated(navigator, feed)
        best = min(best, time.perf_counter() - begin)
        assert len(solution.time) == len(feed.imu) + 1
    return float(best)


def main() -> None:
    """Print the three figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    header = package_content("scenarios") / "new_navigator" / "c"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "idle.c").write_text(IDLE)
        compiler = ["cc", "-O2", "-I", str(header), str(folder / "idle.c"), "-lm"]
        subprocess.run([*compiler, "-DSINSSIM_PROGRAM", "-o", str(folder / "idle")], check=True)
        subprocess.run([*compiler, "-shared", "-fPIC", "-o", str(folder / "idle.so")], check=True)
        library = NavigatorSection(name="library", library=str(folder / "idle.so"))
        program = NavigatorSection(name="program", command=(str(folder / "idle"),))
        feed, steps = feed_of(options.samples), feed_of(options.samples // 10, stepwise=True)
        took = seconds(library, feed, options.repeat)
        print(f"library    {took / options.samples * 1e6:6.3f} µs a sample")
        took = seconds(program, feed, options.repeat)
        print(f"program    {options.samples / took / 1e6:6.2f} million samples/s")
        took = seconds(program, steps, options.repeat)
        print(f"stepwise   {options.samples / 10 / took:6.0f} answered steps/s")


if __name__ == "__main__":
    main()
