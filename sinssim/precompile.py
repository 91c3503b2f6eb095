"""Compiles what the usual scenario needs into the cache by using each kernel once: `python -m sinssim.precompile`.

The remaining attitude algorithms and frames take a second or two each when first used.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from sinssim import earth
from sinssim.scenario import Scenario
from sinssim.simulation import run
from sinssim.truth.curve import Curve


def main() -> None:
    """Run a parked vehicle through every algorithm, and fly half a second of a curve."""
    scenario = Scenario.model_validate(
        {
            "name": "precompile",
            "parked": {"latitude_deg": 45.0, "duration_s": 2.0},
            "imu": {"grade": "mems-industrial", "rate_hz": 20.0},
            "navigation": {"algorithms": ("quaternion", "poisson", "euler"), "vertical": "baro-loop"},
        }
    )
    with tempfile.TemporaryDirectory(prefix="sinssim-") as folder:
        run(scenario, Path(folder) / "run")

    knots = np.arange(16) / 30.0
    position = earth.geodetic_to_ecef(0.8 + 3e-5 * knots, 0.2 + 1e-6 * knots**2, 1000.0 + 10.0 * knots)
    attitude = np.tile((1.0, 0.0, 0.0, 0.0), (len(knots), 1))
    curve = Curve(knots, position, attitude)
    increments = curve.increments(100.0)
    curve.state(increments.time)
    curve.rates(increments.time)


if __name__ == "__main__":
    main()
