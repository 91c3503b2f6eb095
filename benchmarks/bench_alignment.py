"""Determinations by eq. (1) per second and core, checks of the readings included."""

from __future__ import annotations

import time

import numpy as np

from sinssim.alignment import determine, ideal_readings

COUNT = 1_000_000


def main() -> None:
    """Measure and print."""
    rng = np.random.default_rng(0)
    heading, roll = rng.uniform(-np.pi, np.pi, (2, COUNT))
    pitch, latitude = rng.uniform(-1.4, 1.4, (2, COUNT))
    readings = ideal_readings(heading, roll, pitch, latitude, gravity=9.81)
    best = np.inf
    for _ in range(7):
        start = time.process_time()
        determine(*readings)
        best = min(best, time.process_time() - start)
    print(f"determine: {COUNT / best / 1e6:.2f} million determinations per second of one core")


if __name__ == "__main__":
    main()
