"""Time to compute the truth: curve through an hour of knots, increments and states at its sample edges.

    python -m benchmarks.bench_truth [--hours 1] [--rate 100] [--repeat 5]

The first line is a warm-up (it compiles, or loads what was compiled before).
"""

from __future__ import annotations

import argparse
import time

from sinssim.truth.curve import Curve
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.truth.motions import synthetic_flight

KNOT_HZ = 30.0


def main() -> None:
    """Time each stage and print milliseconds."""
    import numpy as np

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=100.0, help="samples per second")
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()

    knots = np.arange(round(options.hours * 3600 * KNOT_HZ) + 1) / KNOT_HZ
    position, q_eb = synthetic_flight(knots)
    print(f"{len(knots)} knots, {options.hours * 3600 * options.rate:.0f} samples; milliseconds")
    print(f"{'':10}{'curve':>10}{'increments':>12}{'states':>10}{'total':>10}{'great circle':>14}")
    for run in range(options.repeat + 1):
        times = [time.perf_counter()]
        curve = Curve(knots, position, q_eb, (10.0, 0.0, 1.0))
        times.append(time.perf_counter())
        imu = curve.increments(options.rate)
        times.append(time.perf_counter())
        curve.state(imu.time)
        times.append(time.perf_counter())
        GreatCircle(0.6, 0.2, 9000.0, 1.0, 250.0, options.hours * 3600).increments(options.rate)
        times.append(time.perf_counter())
        ms = 1e3 * np.diff(times)
        label = "warm-up" if run == 0 else f"run {run}"
        print(f"{label:10}{ms[0]:10.0f}{ms[1]:12.0f}{ms[2]:10.0f}{ms[:3].sum():10.0f}{ms[3]:14.0f}")


if __name__ == "__main__":
    main()
