"""Figure 8.4 of the chapter: what an accelerometer's and a gyro's error do in the one-component system.

Run it from anywhere:  python scenarios/one_component.py [-o DIR]

It draws the simulation over the closed forms (8.13) and (8.15) as figure_8_4.svg and .png, and says how far apart they
are.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sinssim.strapdown.one_component import accelerometer_error, gyro_error
from sinssim.studies.one_component import ACCELEROMETER_BIAS, GYRO_DRIFT, draw_figure_8_4, error_runs


def main() -> None:
    """Draw and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/one_component"), help="folder to write")
    folder = parser.parse_args().out
    time, by_accelerometer, by_gyro = error_runs()
    for name, simulated, closed in (
        ("accelerometer error, 100 µg, (8.13)", by_accelerometer, accelerometer_error(time, ACCELEROMETER_BIAS)),
        ("gyro error, 0.01 deg/h, (8.15)", by_gyro, gyro_error(time, GYRO_DRIFT)),
    ):
        apart = float(np.abs(simulated - closed).max() / np.abs(closed).max())
        print(f"{name}: simulation and closed form differ by {apart:.1e} of the greatest error")
    print("Figures:", *draw_figure_8_4(folder))


if __name__ == "__main__":
    main()
