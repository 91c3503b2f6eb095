"""pyins as a navigator of sinssim: `pyins_navigator.py inertial` integrates, `filter` runs its feedback filter.

`model GYROS ACCELEROMETERS` is the filter with the sigmas and the noise of the run. The protocol has no misalignments:
their 1σ are the two numbers, in seconds of arc.
"""

import struct
import sys

import numpy as np
import pandas as pd
from pyins import filters, inertial_sensor, measurements, strapdown

PVA = ["lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading"]
read, sensors, samples, fixes = sys.stdin.buffer.read, [], [], {}


def angles(w, x, y, z):
    """Return roll, pitch and heading of a quaternion from body to north, east, down, in degrees."""
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.degrees([roll, np.arcsin(2 * (w * y - x * z)), heading])


def quaternions(roll, pitch, heading):
    """Return the quaternions of angles in degrees."""
    (a, b, c), (d, e, f) = (function(np.radians([roll, pitch, heading]) / 2) for function in (np.cos, np.sin))
    return a * b * c + d * e * f, d * b * c - a * e * f, a * e * c + d * b * f, a * b * f - d * e * c


assert struct.unpack("<8sII", read(16))[:2] == (b"SINSSIM\0", 1), "another version of the protocol"
while True:
    kind, index, size = struct.unpack("<HHI", read(8))
    data = read(size)
    if kind == 1:
        start_time, *state = struct.unpack_from("<11d", data, 8)
        numbers = struct.unpack_from("<62d", data)
    elif kind == 2:
        name, about, *arm, values, sigmas = struct.unpack("<32s32s3dII", data)
        sensors.append((about.rstrip(b"\0").decode(), arm))
    elif kind == 3:
        samples.append(struct.unpack("<8d", data))
    elif kind == 4:
        fixes.setdefault(index, []).append(struct.unpack(f"<{size // 8}d", data))
    elif kind == 5:
        break

degrees = np.degrees(state[:2])
start = pd.Series([*degrees, *state[2:6], *angles(*state[6:])], index=PVA, name=start_time)
rows = np.array(samples)
imu = pd.DataFrame(
    np.vstack([rows[:1, 2:], rows[:, 2:]]),  # pyins wants the sample before the first interval, too
    index=np.append(start_time, rows[:, 0]),
    columns=["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"],
)
increments = strapdown.compute_increments_from_imu(imu, "increment")
if sys.argv[1] == "inertial":
    trajectory = strapdown.Integrator(start).integrate(increments)
else:
    given = []
    for number, (kind, arm) in enumerate(sensors):
        values = np.array(fixes[number])
        columns = values[:, 2:5]
        if kind == "gnss-position":
            columns = np.column_stack([np.degrees(columns[:, :2]), columns[:, 2]])
            frame = pd.DataFrame(columns, index=values[:, 1], columns=PVA[:3])
            given.append(measurements.Position(frame, values[0, 5], arm))
        elif kind == "gnss-velocity":
            frame = pd.DataFrame(columns, index=values[:, 1], columns=PVA[3:6])
            given.append(measurements.NedVelocity(frame, values[0, 5], arm))
    if sys.argv[1] == "filter":
        sigma, step = {"position_sd": 1.0, "velocity_sd": 0.1, "level_sd": 1.0, "azimuth_sd": 3.0}, 0.1
        models = [
            {"bias_sd": np.radians(50.0) / 3600.0, "noise": np.radians(0.3) / 60.0},
            {"bias_sd": 0.05, "noise": 0.05 / 60.0},
        ]
    else:
        north, _, _, velocity, _, _, tilt, _, heading = numbers[12:21]
        sigma, step = {"position_sd": north, "velocity_sd": velocity}, 1.0
        sigma |= {"level_sd": np.degrees(tilt), "azimuth_sd": np.degrees(heading)}
        models = []
        for noise, bias, scale, angle in zip((22, 25), (28, 31), (48, 51), sys.argv[2:], strict=True):
            matrix = np.full((3, 3), np.radians(float(angle) / 3600.0))
            np.fill_diagonal(matrix, numbers[scale])
            models.append({"bias_sd": numbers[bias], "noise": numbers[noise], "scale_misal_sd": matrix})
    gyro, accel = (inertial_sensor.EstimationModel(**model) for model in models)
    trajectory = filters.run_feedback_filter(
        start, **sigma, increments=increments, gyro_model=gyro, accel_model=accel, measurements=given, time_step=step
    ).trajectory
answers = np.zeros(len(trajectory), np.dtype("<u2, <u2, <u4, (11,)<f8"))
answers["f0"], answers["f2"] = 6, 88
answers["f3"] = np.column_stack(
    [
        trajectory.index,
        np.radians(trajectory[["lat", "lon"]]),
        trajectory[PVA[2:6]],
        *quaternions(*trajectory[PVA[6:]].to_numpy().T),
    ]
)
sys.stdout.buffer.write(struct.pack("<8sII", b"SINSSIM\0", 1, 0) + answers.tobytes())
