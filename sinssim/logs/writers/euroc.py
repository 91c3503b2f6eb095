"""EuRoC: folder mav0 with imu0/data.csv and state_groundtruth_estimate0/data.csv; stamps are Unix nanoseconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.errors import InputError
from sinssim.logs.gps_time import unix_from_gps
from sinssim.logs.local_level import flipped
from sinssim.logs.text.numeric_columns import columns_of, write_columns
from sinssim.logs.writers.local import LOCAL, origin_words, pose, velocity
from sinssim.logs.writers.run_export import Content

SUFFIX = ""
HOLDS = "run"
_IMU = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],"
    "a_RS_S_z [m s^-2]\n"
)
_TRUTH = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], "
    "b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n"
)


def unix_ns(content: Content, time: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return stamps as nanoseconds of Unix time.

    Args:
        content: with the date of time 0.
        time: the run's own time, (N,) s.

    Returns:
        (N,) int64.
    """
    seconds, ns = content.stamps(time)
    return np.asarray(unix_from_gps(seconds.astype(np.float64)).astype(np.int64) * 1_000_000_000 + ns, dtype=np.int64)


def write(content: Content, place: Path) -> list[str]:
    """Write the folder.

    Raises:
        InputError: the solution has no velocity or attitude.
    """
    s, imu = content.solution, content.imu
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError(f"EuRoC's ground truth has velocity and attitude; {content.solution_name} lacks them.")
    assert imu.interval is not None
    folder = place / "mav0" / "imu0"
    folder.mkdir(parents=True)
    rates = flipped(imu.gyro / imu.interval[:, :1]), flipped(imu.accel / imu.interval[:, 1:])
    write_columns(folder / "data.csv", [unix_ns(content, imu.time), *columns_of(*rates)], header=_IMU, delimiter=",")
    folder = place / "mav0" / "state_groundtruth_estimate0"
    folder.mkdir()
    position, q = pose(content)
    columns = columns_of(position, q, velocity(content), np.zeros((len(s), 6)))
    write_columns(folder / "data.csv", [unix_ns(content, s.time), *columns], header=_TRUTH, delimiter=",")
    return [
        f"mav0/imu0/data.csv: {content.imu_name} data, mean rates over the interval that ends at the time stamp, axes "
        "forward-left-up.",
        f"mav0/state_groundtruth_estimate0/data.csv: {content.solution_name}, with velocity; the biases are 0.",
        LOCAL,
        origin_words(content),
        "Stamps are nanoseconds of Unix time.",
    ]
