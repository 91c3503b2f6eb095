"""Small trade studies that the tests start from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sinssim.experiments.studies.trade_schema import Axis, TradeStudy

BIAS, GRADE, ACCEL = "imu.gyro_bias_sigma_deg_h", "imu.grade", "imu.accel_bias_sigma_ug"

SCENARIO = """\
name = "standing"
seed = 5
parked = { latitude_deg = 50.0, duration_s = 60.0, roll_deg = 1.0 }
imu = { grade = "laser-standard", rate_hz = 2.0 }
navigation = { initial_error = { position_sigma_m = 3.0, tilt_sigma_arcmin = 1.0 } }
"""

AIDED = """\
name = "aligning"
seed = 6
parked = { latitude_deg = 50.0, duration_s = 40.0 }
imu = { grade = "laser-navigation", rate_hz = 20.0 }
[navigation]
vertical = "baro-loop"
initial_error = { position_sigma_m = 2.0, height_sigma_m = 2.0, velocity_sigma_mps = 0.05, tilt_sigma_arcmin = 1.0, \
heading_sigma_arcmin = 10.0 }
[aiding]
zero_velocity = { rate_hz = 1.0, sigma_mps = 0.01 }
gnss = { rate_hz = 1.0 }
[filter]
"""

AXES: tuple[dict[str, Any], ...] = (
    {"key": GRADE, "values": ("laser-navigation", "laser-standard")},
    {"key": BIAS, "values": (0.001, 0.01, 0.1)},
)


def study(folder: Path, contents: str = SCENARIO, axes: tuple[dict[str, Any], ...] = AXES, **keys: Any) -> TradeStudy:
    """Return a study of a scenario that is written to a folder."""
    file = folder / "standing.toml"
    if not file.exists():
        file.write_text(contents, encoding="utf-8")
    return TradeStudy(**{"name": "small", "scenario": str(file), "axes": tuple(Axis(**a) for a in axes), **keys})
