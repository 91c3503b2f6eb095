"""Speed and memory of a batch of runs.

    python -m benchmarks.bench_ensemble [--runs 1000] [--minutes 84.4] [--threads 2]

The motion is that of the scenario `first_flight` (its flight comes from the cache, or is flown), the sensors are
laser-standard in full: white noise, Gauss-Markov instability and quantisation. Printed are the time of each stage for a
sample of a run, the run-samples per second of one core and of all threads, the ratios to single runs one after another
and, where it is installed, to runs by pyins, and the largest memory of a process of its own.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import sinssim
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.earth.gravity import parameters
from sinssim.experiments.ensembles import batch_layout
from sinssim.experiments.ensembles.batch_kernel import WORD_ROWS, engine
from sinssim.experiments.ensembles.batch_navigation import navigate_batch
from sinssim.jit import strict_kernel
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.emulation_kernel import pack
from sinssim.sensors.imu.imu_section import Imu
from sinssim.statistics.random_numbers import key
from sinssim.strapdown.coning_sculling import weight_table
from sinssim.strapdown.navigate import navigate

SENSORS: dict[str, Any] = {
    "grade": "laser-standard",
    "gyro_instability_deg_h": 0.003,
    "accel_instability_ug": 5.0,
    "gyro_quantum_arcsec": 0.5,
    "accel_quantum_mm_s": 1.0,
}
"""laser-standard in full: white, Gauss-Markov, quantised."""
EPOCHS = 500
CHUNK = 500
"""Runs of one call."""
REPEATS = 1000


def motion(minutes: float) -> tuple[ImuData, NavState, Array]:
    """Return the ideal increments, the true initial state and the true height at the edges."""
    scenario = sinssim.load_scenario("scenarios/first_flight.toml")
    trajectory = sinssim.fly(scenario)
    ideal = trajectory.increments(scenario.imu.rate_hz)
    truth = trajectory.state(ideal.time)
    count = min(len(ideal), round(minutes * 60.0 * scenario.imu.rate_hz))
    cut = ImuData(ideal.time[: count + 1], ideal.dtheta[:count], ideal.dvel[:count])
    fields = (truth.latitude, truth.longitude, truth.height, truth.velocity_ned, truth.q_nb)
    return cut, NavState(*(field[0] for field in fields)), truth.height[: count + 1]


def ensemble(runs: int, minutes: float, threads: int) -> tuple[float, float, float, int]:
    """Return elapsed and processor time of an ensemble, s, that of drawing its errors, and its samples."""
    ideal, initial, height = motion(minutes)
    section = Imu.model_validate(SENSORS)
    epochs = np.unique(np.linspace(0, len(ideal), EPOCHS).astype(int))

    def go(first: int, last: int, rows: Any) -> float:
        began = time.perf_counter()
        errors = [draw(section, seed) for seed in range(first, last)]
        drawn = time.perf_counter() - began
        navigate_batch(
            ideal, initial, errors, range(first, last), rows, vertical="baro-loop", height=height, threads=threads
        )
        return drawn

    go(0, 1, [10])  # compiles, or loads what is compiled
    start, busy, drawn = time.perf_counter(), time.process_time(), 0.0
    for first in range(0, runs, CHUNK):
        drawn += go(first, min(first + CHUNK, runs), epochs)
    return time.perf_counter() - start, time.process_time() - busy, drawn, runs * len(ideal)


def stages() -> dict[str, float]:
    """Return the processor time of each stage for a sample of a run, ns."""
    ideal, initial, height = motion(1.0)
    section = Imu.model_validate(SENSORS)
    lanes = batch_layout.LANES
    packed = pack([draw(section, seed) for seed in range(lanes)], float(ideal.time[0]))
    kernel: Any = engine("quaternion", 0, 1, "exact", packed.active)
    parts = dict(kernel.py_func.__globals__)
    parts |= {n: parts["_navigate_lane"].py_func.__globals__[n] for n in ("_draw_lane", "_measure_lane", "_step_lane")}
    w, x = np.zeros(batch_layout.SENSOR_ROWS * lanes), np.zeros(batch_layout.NAVIGATION_ROWS * lanes)
    y, keys = np.zeros((5, 6 * lanes)), np.array([key(seed) for seed in range(lanes)], dtype=np.uint64).T.copy()
    lane_keys, c = np.empty((WORD_ROWS, lanes), np.uint64), packed.conditions.copy()
    columns = np.array([initial.latitude, initial.longitude, initial.height, *initial.velocity_ned, *initial.q_nb])
    states = np.repeat(columns[:, None], lanes, axis=1)
    earth, weights = parameters(ellipsoid_by_name("wgs84")), weight_table(ideal.time, True)
    parts["_prepare_lane"](w, packed.parameters, keys, lane_keys, 0, lanes)
    gains = parts["_begin_lane"](x, states, earth, float(height[0]), 50.0, 0, lanes)
    u, slots = np.concatenate([ideal.dtheta[0], ideal.dvel[0]]), np.arange(5)
    c[2], c[3] = 0.01, 0.1  # length of the interval and its root
    for k in range(5):
        parts["_draw_lane"](w, lane_keys, k + 1)
        parts["_measure_lane"](w, u, c, packed.faults)
        y[k] = w[batch_layout.READING * lanes : (batch_layout.READING + 6) * lanes]
    draw_lane, measure_lane, step_lane = (parts[name] for name in ("_draw_lane", "_measure_lane", "_step_lane"))

    # the loops are compiled, because a call from Python takes as long as a stage

    @strict_kernel
    def drawing(times, w, words):
        for n in range(times):
            draw_lane(w, words, n)

    @strict_kernel
    def measuring(times, w, u, c, faults):
        for _ in range(times):
            measure_lane(w, u, c, faults)

    @strict_kernel
    def stepping(times, x, y, weights, slots, earth, gains, height):
        for _ in range(times):
            step_lane(x, y, weights, 2, 2, slots, earth, gains, 0.01, (height, 0.0))

    calls: dict[str, Callable[[int], None]] = {
        "random numbers, 12 of two noises": lambda n: drawing(n, w, lane_keys),
        "errors of six channels": lambda n: measuring(n, w, u, c, packed.faults),
        "increments, attitude and navigation": lambda n: stepping(
            n, x, y, weights, slots, earth, gains, float(height[0])
        ),
    }

    def of_call(call: Callable[[int], None]) -> float:
        call(1)
        times = []
        for _ in range(9):
            start = time.process_time()
            call(REPEATS)
            times.append(time.process_time() - start)
        return min(times) / REPEATS / lanes * 1e9

    return {name: of_call(call) for name, call in calls.items()}


def single(minutes: float, repeat: int = 3) -> float:
    """Return the processor time of one run by `emulate` and `navigate`, s."""
    ideal, initial, height = motion(minutes)
    section = Imu.model_validate(SENSORS)
    times = []
    for seed in range(repeat + 1):
        start = time.process_time()
        navigate(emulate(ideal, draw(section, seed), seed), initial, vertical="baro-loop", height=height)
        times.append(time.process_time() - start)
    return min(times[1:])


def pyins(minutes: float) -> float | None:
    """Return the processor time of pyins' kernel for one run without sensor errors, s; None if it is not installed."""
    if importlib.util.find_spec("pyins") is None:
        return None
    from pyins._numba_integrate import integrate

    from sinssim import rotation

    ideal, initial, _ = motion(minutes)
    count = len(ideal)
    lla, velocity, matrices = np.empty((count + 1, 3)), np.empty((count + 1, 3)), np.empty((count + 1, 3, 3))
    lla[0] = np.degrees(initial.latitude), np.degrees(initial.longitude), initial.height
    velocity[0], matrices[0] = initial.velocity_ned, rotation.dcm_from_quaternion(initial.q_nb)
    step = np.diff(ideal.time)
    times = []
    for _ in range(4):
        start = time.process_time()
        integrate(step, lla, velocity, matrices, ideal.dtheta, ideal.dvel, 0, True)
        times.append(time.process_time() - start)
    return min(times[1:])


def pyins_whole(minutes: float, repeat: int = 3) -> float | None:
    """Return the processor time of one run by pyins in full, s; None if it is not installed.

    Its sensor errors (bias, random walk of the bias, white noise, scale and misalignment), its coning and sculling
    corrections, and its integrator at a given altitude, through its public functions.
    """
    if importlib.util.find_spec("pyins") is None:
        return None
    import pandas as pd
    from pyins import inertial_sensor, strapdown
    from pyins.util import ACCEL_COLS, GYRO_COLS, TRAJECTORY_COLS

    from sinssim import rotation

    ideal, initial, _ = motion(minutes)
    rows = np.hstack([np.vstack([values[:1], values]) for values in (ideal.dtheta, ideal.dvel)])
    imu = pd.DataFrame(rows, index=ideal.time, columns=[*GYRO_COLS, *ACCEL_COLS])
    place = np.degrees([initial.latitude, initial.longitude])
    angles = np.degrees(np.ravel(rotation.euler_from_quaternion(initial.q_nb)))
    start = np.concatenate([place, [initial.height], initial.velocity_ned, angles])
    pva = pd.Series(start, index=TRAJECTORY_COLS, name=ideal.time[0])
    times = []
    for seed in range(repeat + 1):
        began, rng = time.process_time(), np.random.RandomState(seed)
        scale = np.eye(3) + 1e-5 * rng.randn(3, 3)
        gyro = inertial_sensor.Parameters(scale, 5e-8 * rng.randn(3), 3e-7, 1e-10, rng)
        accel = inertial_sensor.Parameters(scale, 5e-4 * rng.randn(3), 1e-4, 1e-7, rng)
        measured = inertial_sensor.apply_imu_parameters(imu, "increment", gyro, accel)
        increments = strapdown.compute_increments_from_imu(measured, "increment")
        strapdown.Integrator(pva, with_altitude=False).integrate(increments)
        times.append(time.process_time() - began)
    return min(times[1:])


def main() -> None:
    """Print the lines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--minutes", type=float, default=84.4)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--child", action="store_true", help="print the ensemble's figures only, for the parent")
    options = parser.parse_args()
    if options.child:
        figures = ensemble(options.runs, options.minutes, options.threads)
        print(*figures, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        return
    for name, ns in stages().items():
        print(f"{name:40s} {ns:6.1f} ns a sample of a run")
    command = [sys.executable, "-m", "benchmarks.bench_ensemble", "--child"]
    chosen = ["--runs", str(options.runs), "--minutes", str(options.minutes), "--threads", str(options.threads)]
    output = subprocess.run([*command, *chosen], capture_output=True, text=True, check=True).stdout
    elapsed, busy, drawn, samples, memory = (float(word) for word in output.split())
    print(f"{options.runs} runs of {options.minutes:g} min, {options.threads} threads: {elapsed:.1f} s elapsed, of "
          f"which errors drawn {drawn:.1f} s")  # fmt: skip
    print(f"run-samples/s: {samples / busy / 1e6:.1f} M a core, {samples / elapsed / 1e6:.1f} M elapsed")
    print(f"largest memory {memory / 2**10:.0f} MiB")
    alone, per_run = single(options.minutes), busy / options.runs
    print(f"one run by emulate and navigate {alone:.3f} s: {alone / per_run:.1f} times that in the batch")
    kernel, whole = pyins(options.minutes), pyins_whole(options.minutes)
    if kernel is None or whole is None:
        print("pyins is not installed: no ratio to it")
    else:
        print(f"one run by pyins, errors, increments, integrator {whole:.3f} s: {whole / per_run:.1f} times the batch")
        print(f"pyins' compiled integrator alone {kernel:.3f} s: {kernel / per_run:.1f} times the batch")


if __name__ == "__main__":
    main()
