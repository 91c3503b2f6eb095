"""KITTI OXTS: a folder oxts with timestamps.txt and one text file of 30 numbers for each instant.

lat, lon [°], alt [m], roll, pitch, yaw [rad], vn, ve, vf, vl, vu [m/s], ax, ay, az, af, al, au [m/s²], wx, wy, wz, wf,
wl, wu [rad/s], pos_accuracy [m], vel_accuracy [m/s], navstat, numsats, posmode, velmode, orimode. Body axes forward,
left, up; yaw 0 is east and grows counter-clockwise. Layout: dataformat.txt of the KITTI raw data (Geiger et al., IJRR
2013).
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.errors import InputError
from sinssim.logs.formats.stamps import NS, clock_of
from sinssim.logs.recorded_streams import InertialStream, SolutionStream, Streams
from sinssim.system.user_file import read_text
from sinssim.units import DEG

_FIELDS = 30


def _folder(path: Path) -> Path:
    return path / "oxts" if (path / "oxts" / "data").is_dir() else path


def recognises(path: Path, head: bytes) -> bool:
    """Return whether it is a folder with timestamps.txt and data/0000000000.txt."""
    folder = _folder(path)
    return (folder / "timestamps.txt").is_file() and (folder / "data" / "0000000000.txt").is_file()


def files_of(folder: Path) -> list[Path]:
    """Return the files of this format in a folder."""
    own = _folder(folder)
    return [own / "timestamps.txt", *(own / "data").glob("*.txt")]


def read(path: Path) -> Streams:
    """Read all instants; a missing file is left out with its stamp."""
    folder = _folder(path)
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
        rows.append(_numbers(file))
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


def _numbers(file: Path) -> list[float]:
    """Return the numbers of one instant."""
    words = read_text(file, encoding="utf-8", errors="replace").split()
    if len(words) != _FIELDS:
        raise InputError(f"{file}, line 1: it has {len(words)} numbers; {_FIELDS} are needed.")
    try:
        found = [float(word) for word in words]
    except ValueError as error:
        raise InputError(f"{file}, line 1: {error}.") from error
    if not all(map(math.isfinite, found)):
        raise InputError(f"{file}, line 1: a number is not finite.")
    return found
