"""EuRoC data set: imu0/data.csv and state_groundtruth_estimate0/data.csv, or the folder mav0 that has both.

IMU: stamp [ns], angular rate x, y, z [rad/s], specific force x, y, z [m/s²]. Ground truth: stamp [ns], position x, y, z
[m], quaternion w, x, y, z, velocity x, y, z [m/s], biases. The axes are taken as those of ROS (REP 103): z up, position
from an origin that the file does not give, body forward-left-up. (The mounting of EuRoC's own IMU is in sensor.yaml.)
Layout: Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016.
"""

from __future__ import annotations

from pathlib import Path

from sinssim.errors import InputError
from sinssim.logs.formats.stamps import clock_of, split_first
from sinssim.logs.formats.tum import local_solution, unit
from sinssim.logs.recorded_streams import Clock, InertialStream, SolutionStream, Streams
from sinssim.logs.text.numeric_columns import check_finite, read_numbers
from sinssim.system.user_file import open_file

_IMU, _TRUTH = "imu0/data.csv", "state_groundtruth_estimate0/data.csv"


def _kind(head: bytes) -> str:
    """Return "imu", "truth", or "" by the line of names."""
    first = head.split(b"\n", 1)[0]
    if not first.startswith(b"#timestamp"):
        return ""
    return "imu" if b"w_RS_S_x" in first and b"p_RS" not in first else "truth" if b"p_RS_R_x" in first else ""


def recognises(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with imu0/data.csv, or a file with EuRoC's names."""
    return bool(files_of(path)) if path.is_dir() else bool(_kind(head))


def files_of(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    return [f for up in (folder, folder / "mav0") for f in (up / _IMU, up / _TRUTH) if f.is_file()]


def read(path: Path) -> Streams:
    """Read a file, or both files of a folder."""
    files = [path]
    if path.is_dir():
        files = files_of(path)
        if not files:
            raise InputError(f"{path} has neither {_IMU} nor {_TRUTH}.")
    inertial: dict[str, InertialStream] = {}
    solutions: dict[str, SolutionStream] = {}
    clock: Clock | None = None
    notes: list[str] = []
    for file in files:
        with open_file(file) as opened:
            kind = _kind(opened.read(4096))
        if not kind:
            raise InputError(f"{file}, line 1: it does not begin with EuRoC's names, #timestamp, w_RS_S_x or p_RS_R_x.")
        rows = read_numbers(file, (7,) if kind == "imu" else (8, 11, 17), notes, delimiter=",")
        check_finite(file, rows[:, :11], "number")
        own, time = clock_of(split_first(file, ","), "nanoseconds")
        if clock is None:
            clock = own
        elif clock.origin_gps_s is not None and own.origin_gps_s is not None:
            time = time + (own.origin_gps_s - clock.origin_gps_s)
        if kind == "imu":
            inertial["imu"] = InertialStream(time, rows[:, 1:4], rows[:, 4:7])
        else:
            velocity = rows[:, 8:11] if rows.shape[1] > 8 else None
            solutions["solution"] = local_solution(time, rows[:, 1:4], unit(file, rows[:, 4:8]), velocity)
    assert clock is not None
    notes += ["Axes of the truth taken as east-north-up and forward-left-up."] if solutions else []
    return Streams(path, "euroc", clock, inertial, {}, solutions, notes=tuple(notes))
