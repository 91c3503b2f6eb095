"""A flight by its own navigator: cost beside the flight by the truth, agreement of both ways, closure of its truth.

Processor time, of this process and of the one that flies, so that other programs do not count; every case flies a plan
that is in no cache.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from typing import TypeVar

import sinssim
from sinssim.scenario import Scenario, filter_model, load_scenario
from sinssim.scenario.true_motion import true_motion
from sinssim.simulation.guided_passes import apart, by_sections, closed_loop, solution_errors
from sinssim.strapdown.navigation_error import navigation_error

CASES = {
    "laser": ("first_flight", 'navigation.algorithms=["quaternion"]', 'flight.guidance.source="quaternion"'),
    "late": (
        "first_flight", 'navigation.algorithms=["poisson-1"]', 'flight.guidance.source="poisson-1"', "imu.rate_hz=50",
        "flight.guidance.latency_s=0.4", "flight.guidance.rate_hz=10",
    ),
    "aided": ("aided_airliner", 'flight.guidance.source="aided"'),
}  # fmt: skip
T = TypeVar("T")


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time of some work, s, and its result."""
    before = os.times()
    result = work()
    return sum(now - then for now, then in zip(os.times()[:4], before[:4], strict=True)), result


def measure(name: str, scenario: Scenario) -> None:
    """Measure a case and print it."""
    opened, by_truth = timed(lambda: true_motion(scenario, errors="none"))
    more, _ = timed(lambda: solution_errors(scenario, by_truth))
    opened += more
    closed, (path, guided) = timed(lambda: closed_loop(scenario))  # the first flight is in the cache by now
    closed += opened
    stepped, (other, trials) = timed(lambda: by_sections(scenario, by_truth, lambda fraction: None))
    stepped += opened
    imu = path.increments(100.0)
    solution = sinssim.navigate(imu, path.state(imu.time[0]), vertical="truth", height=path.state(imu.time).height)
    off = navigation_error(path.state(imu.time), solution, path.ellipsoid).horizontal.max()
    moved = ", ".join(f"{value:.2g}" for value in guided.moved)
    print(f"{name}: {path.end:.0f} s, passes {moved} m; closure of its increments {off:.1e} m")
    print(f"  by the truth {opened:.1f} s; by passes {closed:.1f} s, {closed / opened:.1f} ×")
    print(f"  by {len(trials)} sections {stepped:.1f} s, {stepped / opened:.1f} ×; apart {apart(path, other):.1e} m")


def main() -> None:
    """Measure the cases by name, all by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], help="by default all")
    for name in parser.parse_args().cases or CASES:
        base, *settings = CASES[name]
        new = f"flight.start.altitude_m={3000.0 + time.time() % 10.0:.6f}"
        measure(name, filter_model.with_states(load_scenario(base, [*settings, new])))


if __name__ == "__main__":
    main()
