"""Cost of an ensemble of runs with a filter, against as many filter runs by themselves.

    python -m benchmarks.bench_filter_ensemble [--scenario aided_airliner] [--set KEY=VALUE] [--runs 16] [--threads 2]

A filter run by itself is the reading of its sensors and the filter, on a true motion that is there already, without a
recording. The ensemble is a whole call of `sinssim.ensemble` without a directory: worker processes, which start, load
what is compiled and compute the motion, the files of runs, and their errors read again. Both are measured in turns, in
processor time of all processes and in elapsed time. The ratio of processor times does not depend on other programs.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable

import numpy as np

import sinssim
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, member
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import with_states
from sinssim.scenario.navigation_section import initial_state_with_errors
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.sensor_set_readings import draw_true_errors, read
from sinssim.simulation.aided_run import aid_run


def processor_time() -> float:
    """Return the processor time of this process and of its children that have ended, s."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in (own, children))


def filter_run(base: Scenario, truths: TruthCache, number: int) -> None:
    """Sense and filter one run of the ensemble."""
    scenario = with_states(member(base, number).scenario)
    truth = truths.of(scenario)
    errors = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    imu = read(truth.trajectory, truth.ideal, scenario.imu, scenario.seed, errors)[1].imu
    compensated = imu if errors.calibration is None else compensate(imu, errors.calibration)
    start = truth.trajectory.state(truth.trajectory.start)
    initial = initial_state_with_errors(
        start, scenario.navigation.initial_error, truth.trajectory.ellipsoid, scenario.seed
    )
    aid_run(scenario, truth.trajectory, compensated, initial, errors, history=False, row_s=1.0)


def timed(call: Callable[[], object]) -> tuple[float, float]:
    """Return processor time and elapsed time of a call, s."""
    busy, start = processor_time(), time.perf_counter()
    call()
    return processor_time() - busy, time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="aided_airliner")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--runs", type=int, default=16)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--turns", type=int, default=2)
    options = parser.parse_args()
    scenario = sinssim.load_scenario(options.scenario, options.set)
    truths = TruthCache()
    filter_run(scenario, truths, 0)  # flies and compiles
    single, whole = [], []
    for _ in range(options.turns):
        single += [timed(lambda number=number: filter_run(scenario, truths, number)) for number in range(1, 4)]
        whole.append(timed(lambda: sinssim.ensemble(scenario, options.runs, threads=options.threads)))
    one, elapsed = np.median(np.array(single), axis=0)
    busy, waited = np.min(np.array(whole), axis=0)
    print(f"{options.scenario}: one filter run {one:.2f} s of processor time, {elapsed:.2f} s elapsed")
    print(f"{options.runs} runs, {options.threads} processes: {busy:.1f} s of processor time, {waited:.1f} s elapsed")
    print(f"ratio to {options.runs} filter runs: {busy / options.runs / one:.2f} in processor time, "
          f"{waited * min(options.threads, options.runs) / options.runs / elapsed:.2f} elapsed")  # fmt: skip


if __name__ == "__main__":
    main()
