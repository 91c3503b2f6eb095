import sys
import time

import numpy as np
import pandas as pd
from pyins import filters, inertial_sensor, measurements, strapdown

folder, lever_arm = sys.argv[1], [float(word) for word in sys.argv[2:5]]
imu = pd.read_csv(f"{folder}/imu.csv", index_col="time_s")
imu.columns = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]  # pyins' names; increments here
gnss = pd.read_csv(f"{folder}/gnss.csv", index_col="time_s")
first = pd.read_csv(f"{folder}/truth.csv", index_col="time_s").iloc[0]

names = {
    "lat": "latitude_deg",
    "lon": "longitude_deg",
    "alt": "height_m",
    "VN": "velocity_n_mps",
    "VE": "velocity_e_mps",
    "VD": "velocity_d_mps",
    "roll": "roll_deg",
    "pitch": "pitch_deg",
    "heading": "heading_deg",
}
start = pd.Series({mine: first[theirs] for mine, theirs in names.items()}, name=first.name)

# pyins wants the sample before the first interval, too
before = pd.DataFrame([imu.iloc[0]], index=[first.name])
increments = strapdown.compute_increments_from_imu(pd.concat([before, imu]), "increment")


def save(trajectory, path):
    trajectory.rename(columns=names)[list(names.values())].to_csv(path, index_label="time_s")


begin = time.perf_counter()
save(strapdown.Integrator(start).integrate(increments), "pyins_inertial.csv")
print(f"inertial {time.perf_counter() - begin:.2f} s")

fixes = gnss.rename(columns={theirs: mine for mine, theirs in names.items()})
begin = time.perf_counter()
result = filters.run_feedback_filter(
    start,
    position_sd=1.0,
    velocity_sd=0.1,
    level_sd=1.0,
    azimuth_sd=3.0,
    increments=increments,
    gyro_model=inertial_sensor.EstimationModel(bias_sd=np.radians(50.0) / 3600.0, noise=np.radians(0.3) / 60.0),
    accel_model=inertial_sensor.EstimationModel(bias_sd=0.05, noise=0.05 / 60.0),
    measurements=[
        measurements.Position(fixes, gnss["sigma_n_m"].iloc[0], lever_arm),
        measurements.NedVelocity(fixes, gnss["sigma_vn_mps"].iloc[0], lever_arm),
    ],
)
save(result.trajectory, "pyins_filter.csv")
print(f"filter {time.perf_counter() - begin:.2f} s")
