"""A short aided run over the antimeridian in the south, made once in a test session."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from pathlib import Path

from sinssim.experiments.run.run_execution import run
from sinssim.scenario.schema import Scenario

CONTENTS = {
    "name": "short",
    "seed": 3,
    "great_circle": {
        "latitude_deg": -36.5, "longitude_deg": 179.99, "altitude_m": 120.0, "course_deg": 80.0, "speed_mps": 100.0,
        "duration_s": 20.0,
    },
    "imu": {"grade": "mems-industrial", "rate_hz": 50.0},
    "navigation": {"algorithms": ["quaternion", "euler"], "vertical": "truth"},
    "aiding": {"gnss": {"rate_hz": 5.0, "lever_arm_m": [0.5, 0.0, -1.5]}},
    "filter": {},
}  # fmt: skip


@functools.cache
def short_run() -> Path:
    """Return the directory of the run."""
    folder = Path(tempfile.mkdtemp(prefix="sinssim-test-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    run(Scenario.model_validate(CONTENTS), folder / "short")
    return folder / "short"
