"""KF-GINS (Wuhan University): IMU file, GNSS files, truth, and the configuration to start it with.

The layouts are those of its loaders and of its own results: see `sinssim.logs.formats.kf_gins_imu` and the
modules beside it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.gps_time import WEEK, week_and_seconds
from sinssim.logs.recorded_streams import FixStream, SolutionStream
from sinssim.logs.text.numeric_columns import columns_of, rounded, write_columns
from sinssim.logs.writers.kf_gins_configuration import configuration, noise_of
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

SUFFIX = ""
HOLDS = "run"


def write(content: Content, place: Path) -> list[str]:
    """Write imu.txt, gnss.txt, truth.nav and kf-gins.yaml.

    Raises:
        InputError: the run crosses the end of a GPS week, which KF-GINS cannot process.
    """
    week, start = week_and_seconds(content.start_gps_s)
    imu = content.imu
    if start + float(imu.time[-1]) > WEEK:
        raise InputError(
            f"the run ends {start + float(imu.time[-1]) - WEEK:.0f} s after the end of the GPS week {week}, beyond "
            "which KF-GINS does not read. Choose an earlier date with --start."
        )
    write_columns(place / "imu.txt", columns_of(rounded(start + imu.time), imu.gyro, imu.accel))
    said = [f"imu.txt: {content.imu_name} increments; seconds of week, Δθ [rad], Δv [m/s], forward-right-down."]
    for name, fixes in content.fixes.items():
        _write_gnss(fixes, start, place / f"{name}.txt")
        said.append(f"{name}.txt: fixes of the antenna; seconds of week, latitude, longitude [°], height [m], σ [m].")
    file = "truth.nav" if content.solution_name == "truth" else f"{content.solution_name}.nav"
    _write_solution(content.solution, week, start, place / file)
    said.append(f"{file}: week, seconds, latitude, longitude [°], height [m], velocity, roll, pitch, heading [°].")
    if np.abs(np.diff(content.motion.longitude)).max() > np.pi:
        said.append("The run crosses the antimeridian, where KF-GINS fails because it subtracts longitudes.")
    known = noise_of(content.run) is not None
    noise = "and the noise of the run's sensors" if known else "and the noise of a MEMS IMU; set that of your sensors"
    (place / "kf-gins.yaml").write_text(configuration(content, start), encoding="utf-8")
    return [
        *said,
        f"kf-gins.yaml: initial state of {content.solution_name}, lever arm of the antenna, {noise}.",
        f"Times are seconds of the GPS week {week}; the time 0 of the run is {start}.",
    ]


def _write_gnss(f: FixStream, start: float, path: Path) -> None:
    sigma = f.position_sigma if f.position_sigma is not None else np.ones((len(f), 3))
    columns = columns_of(rounded(start + f.time), f.latitude / DEG, f.longitude / DEG, f.height, sigma)
    write_columns(path, columns)


def _write_solution(s: SolutionStream, week: int, start: float, path: Path) -> None:
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError("the solution of KF-GINS has velocity and attitude; choose the truth or an algorithm.")
    angles = np.column_stack(rotation.euler_from_quaternion(s.q_nb)) / DEG
    place = s.latitude / DEG, s.longitude / DEG, s.height
    first = np.full(len(s), week, dtype=np.int64)
    write_columns(path, [first, *columns_of(rounded(start + s.time), *place, s.velocity_ned, angles)])
