"""Closed-loop errors of navigation with ideal sensors: the hour of `closure`, by rate.

    python -m benchmarks.bench_closure [--rates 100 50 25 12.5]

Whatever is left is the algorithms' own error; the exponent of its growth with the interval is their order.
"""

from __future__ import annotations

import argparse
import math

from sinssim import load_scenario
from sinssim.experiments.run.run_execution import run


def main() -> None:
    """Print one line per rate and algorithm."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rates", type=float, nargs="+", default=[100.0, 50.0, 25.0, 12.5], help="samples a second")
    rates = sorted(parser.parse_args().rates, reverse=True)
    print("largest errors over the hour; order: of the horizontal error, from the rate above")
    before: dict[str, tuple[float, float]] = {}
    for rate in rates:
        result = run(load_scenario("closure", (f"imu.rate_hz={rate}",)))
        for name, numbers in result.summary["algorithms"].items():
            metres, arcsec = numbers["max_horizontal_error_m"], numbers["max_attitude_error_arcsec"]
            line = f"{rate:6g} Hz  {name:12s} {metres:9.2e} m  {arcsec:9.2e} arcsec"
            if name in before:
                fine, at = before[name]
                line += f"   order {math.log(metres / fine) / math.log(at / rate):.1f}"
            print(line)
            before[name] = (metres, rate)


if __name__ == "__main__":
    main()
