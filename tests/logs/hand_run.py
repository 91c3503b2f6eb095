"""A run directory written by hand, with all numbers different: what an export of it contains is known in advance."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from sinssim.data import Array
from tests.logs.formats.whole import attitude

START = "2017-01-01T23:59:59Z"
"""Date of the time 0: 86 399 s of a day and 18 leap seconds after the beginning of GPS week 1930; midnight is after
the second sample."""
WEEK, SECONDS = 1930, 86417
TIME = np.array([0.25, 0.75, 1.25, 1.75])
LATITUDE = np.array([-33.5, -33.25, -33.125, -32.75])
LONGITUDE = np.array([179.75, 179.875, -179.875, -179.75])
HEIGHT = np.array([81.75, 82.5, -12.25, 90.5])
VELOCITY = np.array([[3.0, -4.0, 0.5], [-6.0, 8.0, -1.5], [5.0, 12.0, 2.5], [8.0, -15.0, -3.5]])
ANGLES = np.array([[10.5, -20.25, 130.75], [-5.5, 15.75, 244.5], [20.5, 5.25, 10.25], [-30.5, -35.75, 350.5]])
"""Roll, pitch, heading, °."""
BESIDE = (
    LATITUDE + 0.001,
    LONGITUDE - 0.002,
    HEIGHT + 3.0,
    VELOCITY + np.array([0.25, -0.5, 0.75]),
    ANGLES + np.array([1.0, 2.0, -3.0]),
)
"""Latitude, longitude, height, velocity and angles of the algorithm, beside the truth."""
GYRO_COUNTS = np.array([[10.4, -20.3, 30.2], [11.4, 20.6, -5.3], [-12.4, 7.9, 12.1]])
ACCEL_COUNTS = np.array([[100.3, -200.4, 300.2], [110.4, 220.3, -50.6], [-120.3, 70.4, 120.2]])
GYRO, ACCEL = GYRO_COUNTS * 1e-4 * np.pi / 648000.0, ACCEL_COUNTS * 1e-3 * 9.80665e-6
"""Increments: counts of 1e-4 arcsec and of 1e-3 µg s; forward, right, down."""
FIX_TIME = np.array([0.75, 1.75])
FIX = np.array([[-33.26, 179.88, 83.5], [-32.76, -179.76, 91.5]])
FIX_SIGMA = np.array([[0.5, 0.25, 0.75], [1.5, 1.25, 1.75]])
FIX_VELOCITY = np.array([[-6.5, 8.5, -1.25], [8.5, -15.5, -3.75]])
FIX_VELOCITY_SIGMA = np.array([[0.125, 0.375, 0.625], [0.0625, 0.1875, 0.3125]])
ARM = (0.5, -0.25, -1.5)


def _state(latitude: Array, longitude: Array, height: Array, velocity: Array, angles: Array) -> dict[str, Array]:
    q = attitude(angles.tolist())
    return {
        "time_s": TIME,
        "latitude_rad": np.radians(latitude),
        "longitude_rad": np.radians(longitude),
        "height_m": height,
        **{f"velocity_{axis}_mps": velocity[:, k] for k, axis in enumerate("ned")},
        **{f"q_nb_{axis}": q[:, k] for k, axis in enumerate("wxyz")},
    }


def _readings(gyro: Array, accel: Array) -> dict[str, Array]:
    return {
        "time_s": TIME[1:],
        **{f"dtheta_{axis}_rad": gyro[:, k] for k, axis in enumerate("xyz")},
        **{f"dvel_{axis}_mps": accel[:, k] for k, axis in enumerate("xyz")},
    }


def hand_run(folder: Path) -> Path:
    """Write the run: a truth, the algorithm euler a little beside it, readings, ideal ones, and a receiver."""
    streams = {
        "truth": _state(LATITUDE, LONGITUDE, HEIGHT, VELOCITY, ANGLES),
        "nav_euler": _state(*BESIDE),
        "imu_measured": _readings(GYRO, ACCEL),
        "imu_ideal": _readings(2.0 * GYRO, 3.0 * ACCEL),
        "aiding_gnss_position": {
            "time_s": FIX_TIME,
            "latitude_rad": np.radians(FIX[:, 0]),
            "longitude_rad": np.radians(FIX[:, 1]),
            "height_m": FIX[:, 2],
            **{f"sigma_{axis}_m": FIX_SIGMA[:, k] for k, axis in enumerate("ned")},
        },
        "aiding_gnss_velocity": {
            "time_s": FIX_TIME,
            **{f"velocity_{axis}_mps": FIX_VELOCITY[:, k] for k, axis in enumerate("ned")},
            **{f"sigma_{axis}_mps": FIX_VELOCITY_SIGMA[:, k] for k, axis in enumerate("ned")},
        },
    }
    (folder / "streams").mkdir(parents=True)
    for name, columns in streams.items():
        parquet.write_table(pa.table(columns), folder / "streams" / f"{name}.parquet")
    (folder / "summary.json").write_text(json.dumps({"algorithms": {"euler": {}}}))
    (folder / "scenario.toml").write_text(f'name = "by hand"\n[aiding.gnss]\nlever_arm_m = {list(ARM)}\n')
    return folder


def log_run(folder: Path, **reference: object) -> Path:
    """Write a run on recorded sensors by hand: solutions euler and aided, and a reference that has everything."""
    run = hand_run(folder)
    streams = run / "streams"
    table = parquet.read_table(streams / "truth.parquet").to_pydict()
    for k, axis in enumerate(("north", "east", "down")):
        table[f"sigma_{axis}_m"] = [0.5 + k, 1.25 + k, 2.5 + k, 3.75 + k]
    parquet.write_table(pa.table(table), streams / "reference.parquet")
    (streams / "truth.parquet").unlink()
    (streams / "nav_aided.parquet").write_bytes((streams / "nav_euler.parquet").read_bytes())
    log = {
        "reference_file": "truth.nav",
        "knows": ["position", "velocity", "attitude"],
        "time_0_gps_s": WEEK * 604800 + SECONDS + 0.125,
    }
    (run / "summary.json").write_text(json.dumps({"algorithms": {"euler": {}}, "log": log}))
    keys = {"file": "truth.nav", "lever_arm_m": [0.25, 0.5, -0.75], **reference}
    lines = "\n".join(f"{key} = {json.dumps(value)}" for key, value in keys.items())
    (run / "scenario.toml").write_text(f"[log.gnss]\nlever_arm_m = {list(ARM)}\n[log.reference]\n{lines}\n")
    return run
