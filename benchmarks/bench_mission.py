"""Processor time of the truth of a whole mission, in pairs with JSBSim's own steps.

    python -m benchmarks.bench_mission [--scenario gate_to_gate] [--repeat 3]

One process, no cache and no recording. The numerator is all that makes the truth: the autopilot's flight, the log, the
curve, increments and states at every sample. The denominator is a plain loop of `run()` of the same model as it is
loaded, with the same steps: as many on the runway and as many in the air as the mission has. Steps that are left out
because the aircraft stands still do not count. The two are measured in turns; the smallest of each is compared.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.bench_flight import alone, plan
from sinssim import load_scenario
from sinssim.experiments.run.parts.phases import phases_of
from sinssim.scenario import Scenario
from sinssim.truth.curve import Curve
from sinssim.truth.flight.flight_log import FlightLog, flight_log
from sinssim.truth.flight.jsbsim_simulation import fly_plan

_IN_THE_AIR = ("flight", "landing")


def truth(scenario: Scenario) -> tuple[float, float, FlightLog]:
    """Return the processor time of flight and log, that of the rest of the truth, and the log."""
    assert scenario.flight is not None
    begin = time.process_time()
    log = flight_log(fly_plan(scenario.flight, scenario.seed))
    flown = time.process_time()
    curve = Curve(log.time, log.position_ecef, log.q_eb, (10.0, 0.0, 1.0), events=log.events, channels=log.channels)
    curve.state(curve.increments(scenario.imu.rate_hz).time)
    return flown - begin, time.process_time() - flown, log


def stepped(log: FlightLog) -> tuple[float, float]:
    """Return how long the model was stepped on the ground and in the air, s."""
    moves = np.append(False, np.any(np.diff(log.position_ecef, axis=0) != 0.0, axis=1))
    air = np.zeros(len(log.time), dtype=bool)
    for phase in phases_of(log.events):
        if phase.name in _IN_THE_AIR:
            air |= (log.time > phase.start) & (log.time <= phase.end)
    interval = float(log.time[1] - log.time[0])
    return interval * np.count_nonzero(moves & ~air), interval * np.count_nonzero(moves & air)


def main() -> None:
    """Print the times of each pair and the ratio of the smallest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="gate_to_gate")
    parser.add_argument("--repeat", type=int, default=3, help="number of pairs")
    arguments = parser.parse_args()
    scenario = load_scenario(arguments.scenario)
    assert scenario.flight is not None
    ground, air = stepped(truth(scenario)[2])  # compiles, or loads what was compiled
    ours, bare = [], []
    print(f"{ground:.0f} s stepped on the ground, {air:.0f} s in the air; processor time, s")
    for _ in range(arguments.repeat):
        flown, rest, _ = truth(scenario)
        own = alone(scenario.flight, ground, shipped=False)
        own += alone(plan(scenario.flight.aircraft, air), air, shipped=False)
        ours.append(flown + rest)
        bare.append(own)
        print(
            f"flight {flown:6.3f}  rest of the truth {rest:6.3f}  JSBSim alone {own:6.3f}  x{(flown + rest) / own:.2f}"
        )
    print(f"smallest: {min(ours):.3f} / {min(bare):.3f} = x{min(ours) / min(bare):.2f}")


if __name__ == "__main__":
    main()
