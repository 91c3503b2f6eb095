"""Time of a flight by sinssim's autopilot, compared with JSBSim alone stepping the same model for the same time."""

from __future__ import annotations

import argparse
import tempfile
import time

from sinssim.truth.flight import jsbsim_model, jsbsim_simulation
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import flight_log
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.units import FOOT


def plan(aircraft: str, seconds: float) -> FlightPlan:
    """Return a flight of S-turns and changes of height at the aircraft's usual airspeed."""
    altitude = 1500.0 if aircraft == "c172x" else 5000.0
    return FlightPlan.model_validate(
        {
            "aircraft": aircraft,
            "start": {"on": "air", "latitude_deg": 50.0, "longitude_deg": 14.0, "altitude_m": altitude},
            "legs": [
                {"type": "climb", "altitude_m": altitude + 200.0},
                {"type": "s_turns", "duration_s": 0.6 * seconds},
                {"type": "hold", "until_s": seconds},
            ],
        }
    )


def alone(flight: FlightPlan, seconds: float, shipped: bool) -> float:
    """Return the time that JSBSim alone takes, s: the model as shipped, or without its sockets as sinssim loads it."""
    import jsbsim

    aircraft = load_aircraft(flight.aircraft)
    with jsbsim_model.quiet(), tempfile.TemporaryDirectory() as folder:
        if shipped:
            executive = jsbsim.FGFDMExec(None)
            executive.set_debug_level(0)
            executive.set_output_path(folder)
            executive.load_model(aircraft.jsbsim_model)
            executive.disable_output()
            executive.set_dt(jsbsim_model.STEP)
            executive["ic/h-sl-ft"] = flight.start.altitude_m / FOOT
            executive["ic/vc-kts"] = aircraft.performance.cruise_kt
            executive.run_ic()
            executive["propulsion/set-running"] = -1
            executive["simulation/do_simple_trim"] = 1
        else:
            executive = jsbsim_model.loaded_model(flight.aircraft, aircraft, folder)
            jsbsim_model.bring_to_start(executive, flight, aircraft, 0)
        run = executive.run
        begin = time.process_time()
        for _ in range(round(seconds / jsbsim_model.STEP)):
            run()
        return time.process_time() - begin


def main() -> None:
    """Print both times and their ratios for each aircraft."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="duration of the flight")
    parser.add_argument("--repeat", type=int, default=3, help="the best of this many")
    arguments = parser.parse_args()
    for aircraft in ("737", "f16", "c172x"):
        flight = plan(aircraft, arguments.seconds)
        flight_log(jsbsim_simulation.fly_plan(flight))  # compiles the kernels that make the log's attitudes
        ours, bare, shipped = [], [], []
        for _ in range(arguments.repeat):
            begin = time.process_time()
            flight_log(jsbsim_simulation.fly_plan(flight))
            ours.append(time.process_time() - begin)
            bare.append(alone(flight, arguments.seconds, shipped=False))
            shipped.append(alone(flight, arguments.seconds, shipped=True))
        flown, same, stock = min(ours), min(bare), min(shipped)
        print(
            f"{aircraft:6s} flight {flown:6.3f} s   JSBSim alone, same model {same:6.3f} s: x{flown / same:.2f}"
            f"   model as shipped {stock:6.3f} s: x{flown / stock:.2f}"
        )


if __name__ == "__main__":
    main()
