"""Prints the table [envelope] of an aircraft.toml: what the model can do in steady flight, by JSBSim's trim.

Those of the shipped aircraft are made by

python aircraft/envelope.py 737 --heights 0 15000 1500 --speeds 160 200 240 280 320 360 400
python aircraft/envelope.py c172x --heights 0 8000 1000 --speeds 50 60 70 80 90 100 110 120 130
python aircraft/envelope.py f16 --steepest 75 --heights 0 18000 2000 --speeds 150 200 250 300 350 400 500 600 700 800
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sinssim.truth.aircraft_design.trimmed_envelope import trimmed_envelope


def _row(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{float(value)}" for value in values) + "]"


def main() -> None:
    """Compute and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("aircraft", help="name or path")
    parser.add_argument("--heights", nargs=3, type=int, required=True, metavar=("FROM", "TO", "STEP"), help="m")
    parser.add_argument("--speeds", nargs="+", type=float, required=True, help="calibrated airspeeds, kt")
    parser.add_argument(
        "--steepest", type=float, default=30.0, help="angle up to which the steepest is looked for, deg"
    )
    wanted = parser.parse_args()
    low, high, step = wanted.heights
    heights = [float(height) for height in range(low, high + 1, step)]
    envelope = trimmed_envelope(wanted.aircraft, heights, wanted.speeds, wanted.steepest)
    print("[envelope]   # of the model, by JSBSim's trim; made by `python aircraft/envelope.py`")
    for key in ("height_m", "min_kt", "max_kt", "airspeed_kt"):
        print(f"{key} = {_row(getattr(envelope, key))}")
    for key in ("climb_mps", "descent_mps"):
        print(f"{key} = [")
        for row in getattr(envelope, key):
            print(f"    {_row(row)},")
        print("]")


if __name__ == "__main__":
    main()
