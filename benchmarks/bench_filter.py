"""Cost of an hour of filtering: 15 states, covariance predicted at 10 Hz, a GNSS position every second."""

from __future__ import annotations

import argparse
import time

import numpy as np

from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Measurements
from sinssim.estimation import error_model
from sinssim.estimation.consistency import consistency
from sinssim.estimation.estimate import estimate
from sinssim.sensors import draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import GreatCircle


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--velocity", action="store_true", help="a GNSS velocity every second as well")
    parser.add_argument("--smooth", action="store_true", help="smooth as well")
    parser.add_argument("--profile", action="store_true", help="say where the time goes")
    arguments = parser.parse_args()

    flight = GreatCircle(0.8, 0.2, 9000.0, 1.0, 230.0, 3600.0)
    section = Imu(grade="laser-standard")
    imu = emulate(flight.increments(100.0), draw(section, 1), 1)
    instants = np.arange(1.0, 3601.0)
    truth, rng = flight.state(instants), np.random.default_rng(1)
    place = np.column_stack([truth.latitude, truth.longitude, truth.height])
    sigma = np.tile((1.5, 1.5, 3.0), (3600, 1))
    place += sigma * rng.standard_normal((3600, 3)) * (1.57e-7, 2.2e-7, -1.0)
    given = [Measurements("gnss-position", instants, instants, place, sigma)]
    if arguments.velocity:
        velocity = truth.velocity_ned + 0.05 * rng.standard_normal((3600, 3))
        given.append(Measurements("gnss-velocity", instants, instants, velocity, np.full((3600, 3), 0.05)))
    model, start = error_model(expected_errors(section).sigma), flight.state(0.0)

    def run() -> None:
        estimate(imu, start, given, model, smooth=arguments.smooth)

    run()
    if arguments.profile:
        import cProfile

        cProfile.runctx("run()", {"run": run}, {}, sort="tottime")
        return
    best = np.inf
    for _ in range(7):
        begin = time.process_time()
        run()
        best = min(best, time.process_time() - begin)
    print(f"estimate: {best:.3f} s of processor time for an hour, {model.size} states, 36000 predictions")
    begin = time.process_time()
    consistency(estimate(imu, start, given, model))
    print(f"with the report of consistency: {time.process_time() - begin:.3f} s")


if __name__ == "__main__":
    main()
