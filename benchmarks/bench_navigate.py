"""Speed of navigation in samples per second, kernel alone and through the API, for every algorithm.

    python -m benchmarks.bench_navigate [ALGORITHM ...] [--hours 1] [--rate 100] [--repeat 15] [--gravity normal]
                                        [--increments pyins]

The increments are those of an hour of S-turns, and the largest horizontal error is printed beside each speed. Where
`pyins` can be imported, its kernel and its `Integrator.integrate` run on the same increments and the ratios to them
are printed. Seconds are processor time of one core, the best of the repetitions. `--increments pyins` takes the
increments that pyins' generator makes of the same motion: what algorithms of different order then have in common is
the generator's own error.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import sinssim
from sinssim import rotation
from sinssim.strapdown.frames import level
from sinssim.strapdown.navigate import navigate as api
from tests.oracles.s_turn import Flight, STurn


def best(call: Callable[[], object], repeat: int) -> float:
    """Return the smallest processor time of a call, s."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def measure(flight: Flight, algorithm: str, gravity: str, repeat: int) -> tuple[float, float, float]:
    """Return seconds of the kernel, seconds of `navigate` and the largest horizontal error, m."""
    imu = sinssim.ImuData(flight.time, flight.dtheta, flight.dvel)
    first = (field[0] for field in (flight.latitude, flight.longitude, flight.height))
    initial = sinssim.NavState(*first, flight.velocity_ned[0], flight.q_nb[0])

    def run() -> sinssim.NavSolution:
        return api(imu, initial, algorithm=algorithm, gravity=gravity)

    solution = run()  # compiles, or loads what is compiled
    rows = np.searchsorted(flight.time, solution.time)  # an update may take several samples
    truth = replace(
        flight, **{name: getattr(flight, name)[rows] for name in ("time", "latitude", "longitude", "height")}
    )
    error = float(np.max(truth.horizontal_error(solution.latitude, solution.longitude)))
    api_seconds = best(run, repeat)

    kernel_seconds: list[float] = []

    def timed(engine: Callable[..., Any]) -> Callable[..., Any]:
        """Make the kernels that a function returns record their time."""

        def choose(*choice: str) -> Any:
            kernel = engine(*choice)
            if kernel is None:
                return None

            def run_timed(*arguments: Any) -> None:
                start = time.process_time()
                kernel(*arguments)
                kernel_seconds.append(time.process_time() - start)

            return run_timed

        return choose

    module = importlib.import_module("sinssim.strapdown.navigate")
    engine, own_engine = level.engine, module.own_engine
    level.engine, module.own_engine = timed(engine), timed(own_engine)
    try:
        for _ in range(repeat):
            run()
    finally:
        level.engine, module.own_engine = engine, own_engine
    return min(kernel_seconds), api_seconds, error


def measure_pyins(flight: Flight, repeat: int) -> tuple[float, float, float]:
    """Return the same three numbers of pyins' kernel and `Integrator.integrate`."""
    import pandas as pd
    from pyins import strapdown, transform
    from pyins._numba_integrate import integrate
    from pyins.util import ACCEL_COLS, GYRO_COLS, TRAJECTORY_COLS

    dtheta = np.concatenate([flight.dtheta[:1], flight.dtheta])  # pyins wants a sample before the first one
    dvel = np.concatenate([flight.dvel[:1], flight.dvel])
    imu = pd.DataFrame(np.hstack([dtheta, dvel]), index=flight.time, columns=GYRO_COLS + ACCEL_COLS)
    increments = strapdown.compute_increments_from_imu(imu, "increment")
    angles = np.rad2deg(np.array(rotation.euler_from_quaternion(flight.q_nb[0])))
    place = [np.rad2deg(flight.latitude[0]), np.rad2deg(flight.longitude[0]), flight.height[0]]
    start = pd.Series(np.concatenate([place, flight.velocity_ned[0], angles]), index=TRAJECTORY_COLS, name=0.0)
    result = strapdown.Integrator(start).integrate(increments)
    error = float(np.max(flight.horizontal_error(np.deg2rad(result.lat.values), np.deg2rad(result.lon.values))))
    api_seconds = best(lambda: strapdown.Integrator(start).integrate(increments), max(3, repeat // 3))

    count = len(increments)
    lla, velocity, matrices = np.empty((count + 1, 3)), np.empty((count + 1, 3)), np.empty((count + 1, 3, 3))
    lla[0], velocity[0], matrices[0] = place, flight.velocity_ned[0], transform.mat_from_rph(angles)
    step, theta, dv = (
        np.ascontiguousarray(increments[columns])
        for columns in ("dt", ["theta_x", "theta_y", "theta_z"], ["dv_x", "dv_y", "dv_z"])
    )
    kernel_seconds = best(lambda: integrate(step, lla, velocity, matrices, theta, dv, 0, True), repeat)
    return kernel_seconds, api_seconds, error


def by_pyins(flight: Flight) -> Flight:
    """Return the motion with the increments that pyins' generator makes of its positions, velocities and angles."""
    from pyins import sim

    place = np.column_stack([np.rad2deg(flight.latitude), np.rad2deg(flight.longitude), flight.height])
    angles = np.rad2deg(np.column_stack(rotation.euler_from_quaternion(flight.q_nb)))
    _, imu = sim.generate_imu(flight.time, place, angles, flight.velocity_ned, sensor_type="increment")
    readings = imu.to_numpy()[1:]  # its first sample stands for the time before the start
    return replace(flight, dtheta=readings[:, :3], dvel=readings[:, 3:])


def main() -> None:
    """Print one line per algorithm."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("algorithms", nargs="*", help="all of them by default")
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--rate", type=float, default=100.0, help="samples a second")
    parser.add_argument("--repeat", type=int, default=15)
    parser.add_argument(
        "--gravity",
        default="somigliana",
        choices=sinssim.GRAVITY_MODELS,
        help="model navigated with; the S-turns are flown under somigliana, as pyins has it, so others err by theirs",
    )
    parser.add_argument(
        "--increments", default="exact", choices=("exact", "pyins"), help="who makes them; pyins must be installed"
    )
    options = parser.parse_args()
    flight = STurn(duration=3600 * options.hours).fly(options.rate)
    if options.increments == "pyins":
        flight = by_pyins(flight)
    count = len(flight.dtheta)
    print(f"{count} samples; M samples/s, kernel | API; largest horizontal error")
    reference = None
    if importlib.util.find_spec("pyins"):
        reference = measure_pyins(flight, options.repeat)
        kernel, whole, error = reference
        print(f"{'pyins':20s} {count / kernel / 1e6:6.1f} | {count / whole / 1e6:5.1f}  {error:9.2e} m")
    for algorithm in options.algorithms or sinssim.ALGORITHMS:
        try:
            kernel, whole, error = measure(flight, algorithm, options.gravity, options.repeat)
        except sinssim.RunError as failure:  # the first orders run away in an hour
            print(f"{algorithm:20s} {failure}")
            continue
        line = f"{algorithm:20s} {count / kernel / 1e6:6.1f} | {count / whole / 1e6:5.1f}  {error:9.2e} m"
        if reference:
            line += f"   {reference[0] / kernel:4.1f} x | {reference[1] / whole:4.1f} x pyins"
        print(line)
    if not reference:
        print("pyins is not installed: no ratio to it")


if __name__ == "__main__":
    main()
