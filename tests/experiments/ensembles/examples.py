"""Small ensembles that the tests start from."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from sinssim.scenario.schema import Scenario

PARKED: dict[str, Any] = {
    "name": "standing",
    "seed": 5,
    "parked": {"latitude_deg": 50.0, "duration_s": 30.0, "roll_deg": 1.0},
    "imu": {"grade": "laser-standard", "rate_hz": 20.0},
    "navigation": {
        "algorithms": ("euler", "quaternion"),
        "initial_error": {"position_sigma_m": 3.0, "tilt_sigma_arcmin": 1.0},
    },
}

AIDED: dict[str, Any] = {
    "name": "aligning",
    "seed": 6,
    "parked": {"latitude_deg": 50.0, "duration_s": 40.0},
    "imu": {"grade": "laser-navigation", "rate_hz": 20.0},
    "navigation": {
        "vertical": "baro-loop",
        "initial_error": {
            "position_sigma_m": 2.0,
            "height_sigma_m": 2.0,
            "velocity_sigma_mps": 0.05,
            "tilt_sigma_arcmin": 1.0,
            "heading_sigma_arcmin": 10.0,
        },
    },
    "aiding": {"zero_velocity": {"rate_hz": 1.0, "sigma_mps": 0.01}, "gnss": {"rate_hz": 1.0}},
    "filter": {},
}


def scenario(contents: dict[str, Any] = PARKED, **changes: Any) -> Scenario:
    """Return a scenario with other tables."""
    return Scenario.model_validate({**contents, **changes})


def files(folder: Path) -> dict[str, str]:
    """Return the digest of every file of runs, and of the manifest."""
    found = [*(folder / "runs").iterdir(), folder / "ensemble.json"]
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in found}
