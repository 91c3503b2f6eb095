"""Data sets of robots: EuRoC and TUM, read and written, and KITTI OXTS, read; their stamps, axes and local positions.

Axes are those of ROS (REP 103): body forward-left-up, fixed axes east-north-up, position from an origin that EuRoC and
TUM do not give; written ones are from the true start. Stamps that a double cannot hold are whole nanoseconds of Unix
time or decimal seconds.

EuRoC: imu0/data.csv and state_groundtruth_estimate0/data.csv, or the folder mav0 that has both. IMU: stamp [ns],
angular rate x, y, z [rad/s], specific force x, y, z [m/s²]. Ground truth: stamp [ns], position x, y, z [m], quaternion
w, x, y, z, velocity x, y, z [m/s], biases. (The mounting of EuRoC's own IMU is in sensor.yaml.) Layout: Burri et al.,
"The EuRoC micro aerial vehicle datasets", IJRR 2016.

TUM trajectory: time [s], position x, y, z [m], quaternion x, y, z, w; blanks between the columns. Layout: the benchmark
of the Technical University of Munich.

KITTI OXTS: a folder oxts with timestamps.txt and one text file of 30 numbers for each instant: lat, lon [°], alt [m],
roll, pitch, yaw [rad], vn, ve, vf, vl, vu [m/s], ax, ay, az, af, al, au [m/s²], wx, wy, wz, wf, wl, wu [rad/s],
pos_accuracy [m], vel_accuracy [m/s], navstat, numsats, posmode, velmode, orimode. Yaw 0 is east and grows
counter-clockwise. Layout: dataformat.txt of the KITTI raw data (Geiger et al., IJRR 2013).
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.geodetic_coordinates import enu_about, flipped, level_turn, q_enu_flu, q_nb_from_enu_flu, swapped
from sinssim.errors import InputError
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import EPOCH_UNIX, gps_from_unix, unix_from_gps
from sinssim.logs.numeric_columns import (
    WHITESPACE,
    check_finite,
    columns_of,
    cut_rows,
    head_numbers,
    read_numbers,
    text_rows,
    write_columns,
)
from sinssim.logs.recorded_streams import Clock, InertialStream, SolutionStream, Streams
from sinssim.system.files import open_file, read_text
from sinssim.units import DEG

NS = 1_000_000_000


def clock_of(ns: NDArray[np.int64], note: str) -> tuple[Clock, Array]:
    """Return the clock of stamps, (N,) ns of Unix time or since another start, with an origin if they are dates since
    1980, and the times from its origin, (N,) s."""
    seconds, rest = np.divmod(ns, NS)
    if seconds[0] < EPOCH_UNIX:
        first = 0
        note = f"{note}, since an unknown start"
        origin = None
    else:
        first = int(seconds[0])
        origin = int(gps_from_unix(float(first)))
        note = f"{note}, taken as Unix time"
    return Clock("machine", origin, note), (seconds - first) + rest * 1e-9


def split_first(path: Path, delimiter: str = WHITESPACE, skip: int = 0) -> NDArray[np.int64]:
    """Return the first column of a text file that `read_numbers` accepts as whole nanoseconds, (N,), without rounding:
    decimal numbers are seconds, whole numbers of 16 digits or more nanoseconds."""
    stamps: list[int] = []
    for number, fields in text_rows(path, delimiter, skip, cut_rows(path, delimiter, skip)):
        word = fields[0]
        whole, point, decimals = word.partition(".")
        try:
            if not point and len(whole.lstrip("+-0")) >= 16:
                stamps.append(int(whole))
            elif "e" in word.lower():
                stamps.append(round(float(word) * 1e9))
            else:
                part = int((decimals + "000000000")[:9]) if decimals.isdigit() or not decimals else None
                if part is None:
                    raise ValueError
                stamps.append(int(whole or "0") * NS + (-part if whole.startswith("-") else part))
        except (ValueError, OverflowError) as error:
            raise InputError(f"{path}, line {number}: {word[:40]!r} is not a stamp.") from error
        if not -(2**62) < stamps[-1] < 2**62:
            raise InputError(f"{path}, line {number}: the stamp {word[:40]} is out of range.")
    return np.array(stamps, dtype=np.int64)


def recognises_tum(path: Path, head: bytes) -> bool:
    """Return whether the first rows have eight numbers, the last four of norm 1."""
    rows = head_numbers(head)
    if rows is None or rows.shape[1] != 8 or not np.isfinite(rows).all():
        return False
    return bool((np.abs(np.linalg.norm(rows[:, 4:], axis=1) - 1.0) < 0.01).all() and (np.diff(rows[:, 0]) > 0.0).all())


def unit(path: Path, q: Array) -> Array:
    """Return quaternions, (N, 4), with norm 1."""
    norm = np.linalg.norm(q, axis=1)
    bad = ~(np.abs(norm - 1.0) < 0.01)
    if bad.any():
        row = int(np.argmax(bad))
        raise InputError(f"{path}, row {row + 1}: the quaternion has the norm {norm[row]:.4g}, not 1.")
    return np.asarray(q / norm[:, np.newaxis])


def local_solution(time: Array, position: Array, q: Array | None, velocity: Array | None) -> SolutionStream:
    """Return a solution in local axes from positions, (N, 3) m, and velocities, (N, 3) m/s, east, north, up, and
    attitudes from forward-left-up to east-north-up, scalar first, (N, 4)."""
    nowhere = np.full(len(time), np.nan)
    return SolutionStream(
        time=time,
        latitude=nowhere,
        longitude=nowhere,
        height=nowhere,
        velocity_ned=None if velocity is None else velocity[:, (1, 0, 2)] * np.array([1.0, 1.0, -1.0]),
        q_nb=None if q is None else rotation.normalize(q_nb_from_enu_flu(q)),
        local_enu=position,
    )


def read_tum(path: Path) -> Streams:
    """Read the trajectory."""
    notes = ["Axes taken as east-north-up and forward-left-up; the file does not define them."]
    rows = read_numbers(path, (8,), notes)
    check_finite(path, rows, "number")
    clock, time = clock_of(split_first(path), "seconds")
    stream = local_solution(time, rows[:, 1:4], unit(path, rows[:, 4:])[:, (3, 0, 1, 2)], None)
    return Streams(path, "tum", clock, solutions={"solution": stream}, notes=tuple(notes))


_IMU_FILE, _TRUTH_FILE = "imu0/data.csv", "state_groundtruth_estimate0/data.csv"


def _euroc_kind(head: bytes) -> str:
    """Return "imu", "truth", or "" by the line of names."""
    first = head.split(b"\n", 1)[0]
    if not first.startswith(b"#timestamp"):
        return ""
    return "imu" if b"w_RS_S_x" in first and b"p_RS" not in first else "truth" if b"p_RS_R_x" in first else ""


def recognises_euroc(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with imu0/data.csv, or a file with EuRoC's names."""
    return bool(files_of_euroc(path)) if path.is_dir() else bool(_euroc_kind(head))


def files_of_euroc(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    return [f for up in (folder, folder / "mav0") for f in (up / _IMU_FILE, up / _TRUTH_FILE) if f.is_file()]


def read_euroc(path: Path) -> Streams:
    """Read a file, or both files of a folder."""
    files = [path]
    if path.is_dir():
        files = files_of_euroc(path)
        if not files:
            raise InputError(f"{path} has neither {_IMU_FILE} nor {_TRUTH_FILE}.")
    inertial: dict[str, InertialStream] = {}
    solutions: dict[str, SolutionStream] = {}
    clock: Clock | None = None
    notes: list[str] = []
    for file in files:
        with open_file(file) as opened:
            kind = _euroc_kind(opened.read(4096))
        if not kind:
            raise InputError(f"{file}, line 1: it does not begin with EuRoC's names, #timestamp, w_RS_S_x or p_RS_R_x.")
        rows = read_numbers(file, (7,) if kind == "imu" else (8, 11, 17), notes, delimiter=",")
        check_finite(file, rows[:, :11], "number")
        file_clock, time = clock_of(split_first(file, ","), "nanoseconds")
        if clock is None:
            clock = file_clock
        elif clock.origin_gps_s is not None and file_clock.origin_gps_s is not None:
            time = time + (file_clock.origin_gps_s - clock.origin_gps_s)
        if kind == "imu":
            inertial["imu"] = InertialStream(time, rows[:, 1:4], rows[:, 4:7])
        else:
            velocity = rows[:, 8:11] if rows.shape[1] > 8 else None
            solutions["solution"] = local_solution(time, rows[:, 1:4], unit(file, rows[:, 4:8]), velocity)
    assert clock is not None
    notes += ["Axes of the truth taken as east-north-up and forward-left-up."] if solutions else []
    return Streams(path, "euroc", clock, inertial, {}, solutions, notes=tuple(notes))


_KITTI_FIELDS = 30


def _kitti_folder(path: Path) -> Path:
    return path / "oxts" if (path / "oxts" / "data").is_dir() else path


def recognises_kitti(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with timestamps.txt and data/0000000000.txt."""
    folder = _kitti_folder(path)
    return (folder / "timestamps.txt").is_file() and (folder / "data" / "0000000000.txt").is_file()


def files_of_kitti(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    oxts = _kitti_folder(folder)
    return [oxts / "timestamps.txt", *(oxts / "data").glob("*.txt")]


def read_kitti(path: Path) -> Streams:
    """Read all instants; a missing file is left out with its stamp."""
    folder = _kitti_folder(path)
    lines = read_text(folder / "timestamps.txt", encoding="utf-8", errors="replace").splitlines()
    stamps: list[int] = []
    rows: list[list[float]] = []
    missing = 0
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        file = folder / "data" / f"{number - 1:010d}.txt"
        if not file.is_file():
            missing += 1
            continue
        stamps.append(_stamp(folder / "timestamps.txt", number, line.strip()))
        rows.append(_kitti_numbers(file))
    if not rows:
        raise InputError(f"{folder} has no time stamps: timestamps.txt and data/*.txt do not correspond.")
    r = np.array(rows)
    clock, time = clock_of(np.array(stamps, dtype=np.int64), "dates of the logger")
    q_nb = rotation.quaternion_from_euler(r[:, 3], -r[:, 4], math.pi / 2.0 - r[:, 5])
    sigma = np.repeat(r[:, 23:24], 3, axis=1)
    velocity = np.column_stack((r[:, 6], r[:, 7], -r[:, 10]))
    solution = SolutionStream(
        time, r[:, 0] * DEG, r[:, 1] * DEG, r[:, 2], "unknown", velocity, q_nb, sigma, np.repeat(r[:, 24:25], 3, axis=1)
    )
    imu = InertialStream(time, r[:, 17:20], r[:, 11:14], "rates", axes=("forward", "left", "up"))
    notes = (f"{missing} time stamps have no file and were left out.",) if missing else ()
    return Streams(path, "kitti-oxts", clock, {"imu": imu}, {}, {"solution": solution}, notes=notes)


def _stamp(file: Path, number: int, text: str) -> int:
    """Return a date such as "2011-09-26 13:02:25.964389445" as nanoseconds of Unix time."""
    whole, _, decimals = text.partition(".")
    try:
        seconds = int(datetime.strptime(whole, "%Y-%m-%d %H:%M:%S").replace(tzinfo=UTC).timestamp())
        return seconds * NS + int((decimals + "000000000")[:9])
    except (ValueError, OverflowError) as error:
        raise InputError(f"{file}, line {number}: {text[:40]!r} is not a date like 2011-09-26 13:02:25.964.") from error


def _kitti_numbers(file: Path) -> list[float]:
    """Return the numbers of one instant."""
    words = read_text(file, encoding="utf-8", errors="replace").split()
    if len(words) != _KITTI_FIELDS:
        raise InputError(f"{file}, line 1: it has {len(words)} numbers; {_KITTI_FIELDS} are needed.")
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise InputError(f"{file}, line 1: {error}.") from error
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{file}, line 1: a number is not finite.")
    return numbers


LOCAL = (
    "Positions are east, north, up in the plane axes of the run's true start; attitudes from forward-left-up to these "
    "axes (REP 103)."
)


def origin_words(content: Content) -> str:
    """Return a sentence on the origin."""
    latitude, longitude, height = content.origin
    return f"Origin: latitude {latitude / DEG:.9f} deg, longitude {longitude / DEG:.9f} deg, height {height:.4f} m."


def pose(content: Content) -> tuple[Array, Array]:
    """Return position, east, north, up, (N, 3) m, and attitude, from forward-left-up to the origin's axes, scalar
    first, (N, 4), of the chosen solution, which has an attitude."""
    s = content.solution
    assert s.q_nb is not None
    position = enu_about(content.origin, s.latitude, s.longitude, s.height)
    return position, rotation.multiply(level_turn(content.origin, s.latitude, s.longitude), q_enu_flu(s.q_nb))


def velocity(content: Content) -> Array:
    """Return the velocity of the chosen solution, which has one, in the origin's axes, east, north, up, (N, 3) m/s."""
    s = content.solution
    assert s.velocity_ned is not None
    return rotation.rotate(level_turn(content.origin, s.latitude, s.longitude), swapped(s.velocity_ned))


_IMU_HEADER = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],"
    "a_RS_S_z [m s^-2]\n"
)
_TRUTH_HEADER = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], "
    "b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n"
)


def unix_ns(content: Content, time: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return stamps as nanoseconds of Unix time: (N,) int64. `content`: with the date of time 0; `time`: the run's own
    time, (N,) s."""
    seconds, ns = content.stamps(time)
    return np.asarray(unix_from_gps(seconds.astype(np.float64)).astype(np.int64) * 1_000_000_000 + ns, dtype=np.int64)


def write_euroc(content: Content, place: Path) -> list[str]:
    """Write the folder."""
    s, imu = content.solution, content.imu
    if s.velocity_ned is None or s.q_nb is None:
        raise InputError(f"EuRoC's ground truth has velocity and attitude; {content.solution_name} lacks them.")
    assert imu.interval is not None
    folder = place / "mav0" / "imu0"
    folder.mkdir(parents=True)
    rates = flipped(imu.gyro / imu.interval[:, :1]), flipped(imu.accel / imu.interval[:, 1:])
    write_columns(
        folder / "data.csv", [unix_ns(content, imu.time), *columns_of(*rates)], header=_IMU_HEADER, delimiter=","
    )
    folder = place / "mav0" / "state_groundtruth_estimate0"
    folder.mkdir()
    position, q = pose(content)
    columns = columns_of(position, q, velocity(content), np.zeros((len(s), 6)))
    write_columns(folder / "data.csv", [unix_ns(content, s.time), *columns], header=_TRUTH_HEADER, delimiter=",")
    return [
        f"mav0/imu0/data.csv: {content.imu_name} data, mean rates over the interval that ends at the time stamp, axes "
        "forward-left-up.",
        f"mav0/state_groundtruth_estimate0/data.csv: {content.solution_name}, with velocity; the biases are 0.",
        LOCAL,
        origin_words(content),
        "Stamps are nanoseconds of Unix time.",
    ]


def write_tum(content: Content, place: Path) -> list[str]:
    """Write the file."""
    if content.solution.q_nb is None:
        raise InputError(f"TUM has an attitude in every row; {content.solution_name} has none.")
    position, q = pose(content)
    seconds, ns = content.stamps(content.solution.time)
    unix = unix_from_gps(seconds.astype(np.float64)).astype(np.int64)
    stamps = [f"{s}.{part:09d}" for s, part in zip(unix.tolist(), ns.tolist(), strict=True)]
    header = f"# timestamp tx ty tz qx qy qz qw\n# {origin_words(content)}\n"
    write_columns(place, [stamps, *columns_of(position, q[:, (1, 2, 3, 0)])], header=header)
    return [f"{content.solution_name}: Unix time, position, quaternion.", LOCAL, origin_words(content)]


EUROC = Format(recognises_euroc, read_euroc, files_of_euroc)
TUM = Format(recognises_tum, read_tum)
KITTI = Format(recognises_kitti, read_kitti, files_of_kitti)
EUROC_EXPORT = Export("", "run", write_euroc)
TUM_EXPORT = Export(".tum", "solution", write_tum)
