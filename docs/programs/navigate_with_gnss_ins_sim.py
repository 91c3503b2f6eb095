import sys

import numpy as np

sys.path.insert(0, sys.argv[1])  # the directory of gnss-ins-sim
from demo_algorithms.free_integration import FreeIntegration
from gnss_ins_sim.attitude import attitude


def table(name):
    return np.genfromtxt(f"{sys.argv[2]}/{name}.csv", delimiter=",", skip_header=1)


time, position, velocity = table("time"), table("ref_pos"), table("ref_vel")
angles = np.radians(table("ref_att_euler"))  # yaw, pitch, roll
start = np.concatenate(
    [
        np.radians(position[0, :2]),
        position[0, 2:],
        attitude.euler2dcm(angles[0]) @ velocity[0],  # along the axes of the body
        angles[0],
    ]
)
program = FreeIntegration(start)
program.run([0, 1 / (time[1] - time[0]), np.radians(table("gyro-0")), table("accel-0")])  # 0: north-east-down
heading, pitch, roll = np.degrees(program.att).T
rows = [time, *np.degrees(program.pos[:, :2]).T, program.pos[:, 2], *program.vel.T, roll, pitch, heading % 360]
np.savetxt(
    "gnss_ins_sim_inertial.csv",
    np.column_stack(rows),
    fmt="%.17g",
    delimiter=",",
    comments="",
    header="time_s,latitude_deg,longitude_deg,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps,"
    "roll_deg,pitch_deg,heading_deg",
)
