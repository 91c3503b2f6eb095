"""CSV whose columns are named with their units, as the tables that sinssim writes: time_s, latitude_deg, height_m, …

The first line has the names, separated by commas, semicolons or tabs. Known names, each with one of its units:

    time_s (the run's own clock), gps_s (since 1980-01-06), unix_s
    latitude, longitude: _rad, _deg; height_m
    velocity_n_mps, velocity_e_mps, velocity_d_mps
    q_nb_w, q_nb_x, q_nb_y, q_nb_z, or roll, pitch, heading: _rad, _deg
    dtheta_x_rad, …, dvel_x_mps, …: increments; gyro_x: _radps, _degps, …, accel_x_mps2, …: rates
    sigma_n_m, sigma_e_m, sigma_d_m, sigma_vn_mps, sigma_ve_mps, sigma_vd_mps

Others are left out and named.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats.number_table import check_finite, check_times, read_numbers
from sinssim.logs.gps_time import gps_from_unix
from sinssim.logs.streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.system.user_file import open_file
from sinssim.units import DEG

_UNITS = {"rad": 1.0, "deg": DEG, "m": 1.0, "mps": 1.0, "mps2": 1.0, "radps": 1.0, "degps": DEG}
_TIMES = ("time_s", "gps_s", "unix_s")
_POSITION = ("latitude", "longitude", "height")
_VELOCITY = ("velocity_n", "velocity_e", "velocity_d")
_QUATERNION = ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z")
_ANGLES = ("roll", "pitch", "heading")
_SIGMA = ("sigma_n", "sigma_e", "sigma_d")
_VELOCITY_SIGMA = ("sigma_vn", "sigma_ve", "sigma_vd")
_INERTIAL = {"increments": ("dtheta", "dvel"), "rates": ("gyro", "accel")}


def _names(line: bytes) -> tuple[str, list[str]]:
    """Return the delimiter and the names of the first line."""
    text = line.decode("utf-8-sig", errors="replace").strip()
    delimiter = next((sign for sign in (",", ";", "\t") if sign in text), ",")
    return delimiter, [name.strip().strip('"') for name in text.split(delimiter)]


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line names a time, and a whole position or inertial readings.

    Looser tables of positions are tracks, which `track_csv` reads.
    """
    if b"\0" in head or not head[:3].strip(b"\xef\xbb\xbf"):
        return False
    _, names = _names(head.split(b"\n", 1)[0])
    stems = {name.rpartition("_")[0] for name in names}
    timed = any(time in names for time in _TIMES)
    placed = {"latitude", "longitude", "height"} <= stems and "qw" not in names
    return timed and (placed or {"dtheta_x", "dvel_x"} <= stems or "gyro_x" in stems)


def read(path: Path) -> Streams:
    """Read the columns whose names are known."""
    with open_file(path) as file:
        delimiter, names = _names(file.readline(1 << 16))
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise InputError(f"{path}, line 1: the column {shortened(doubled[0])!r} appears twice.")
    notes: list[str] = []
    table = _Columns(path, names, read_numbers(path, (len(names),), notes, delimiter=delimiter, skip=1))
    clock, time = _clock(path, table)
    position = table.vector(_POSITION)
    inertial = _inertial(time, table)
    if position is None and inertial is None:
        raise InputError(
            f"{path}, line 1: it names neither a position (latitude_deg, longitude_deg, height_m) nor inertial "
            f"data (gyro_x_radps … accel_z_mps2, or dtheta_x_rad … dvel_z_mps). It has: "
            f"{shortened(', '.join(names), 300)}."
        )
    solutions: dict[str, SolutionStream] = {}
    fixes: dict[str, FixStream] = {}
    if position is not None:
        check_finite(path, position, "position")
        velocity, sigma = table.vector(_VELOCITY), table.vector(_SIGMA)
        velocity_sigma = table.vector(_VELOCITY_SIGMA)
        place = position[:, 0], position[:, 1], position[:, 2]
        q_nb = _attitude(path, table)
        if sigma is not None and q_nb is None:
            fixes["gnss"] = FixStream(time, *place, "ellipsoid", sigma, velocity, velocity_sigma)
        else:
            solutions["solution"] = SolutionStream(time, *place, "ellipsoid", velocity, q_nb, sigma, velocity_sigma)
    rest = [name for name in names if name not in table.used]
    notes += [f"Columns left out: {shortened(', '.join(rest), 300)}."] if rest else []
    unit = {"imu": inertial} if inertial is not None else {}
    return Streams(path, "columns", clock, unit, fixes, solutions, notes=tuple(notes))


class _Columns:
    """The columns by name, in SI."""

    def __init__(self, path: Path, names: Sequence[str], rows: Array) -> None:
        self.path, self.names, self.rows = path, list(names), rows
        self.used: set[str] = set()

    def column(self, stem: str) -> Array | None:
        """Return the column of a stem, in whatever unit it has; None if there is none."""
        for i, name in enumerate(self.names):
            start, _, unit = name.rpartition("_")
            if start == stem and unit in _UNITS:
                self.used.add(name)
                return self.rows[:, i] * _UNITS[unit] if _UNITS[unit] != 1.0 else self.rows[:, i]
        return None

    def plain(self, name: str) -> Array | None:
        """Return a column without unit."""
        if name not in self.names:
            return None
        self.used.add(name)
        return self.rows[:, self.names.index(name)]

    def vector(self, stems: Sequence[str]) -> Array | None:
        """Return several columns side by side; None if none is there."""
        found = [self.column(stem) for stem in stems]
        have = [column for column in found if column is not None]
        if not have:
            return None
        if len(have) < len(found):
            missing = stems[[column is None for column in found].index(True)]
            raise InputError(f"{self.path}, line 1: the column {missing} with its unit is missing next to {stems[0]}.")
        return np.column_stack(have)


def _clock(path: Path, table: _Columns) -> tuple[Clock, Array]:
    """Return the clock and the times."""
    for name in _TIMES:
        time = table.plain(name)
        if time is None:
            continue
        check_times(path, time, f"column {name}")
        if name == "time_s":
            return Clock("machine", None, "the column time_s, seconds from an unknown start"), time
        gps = gps_from_unix(time) if name == "unix_s" else time
        origin = int(gps[0]) if abs(gps[0]) < 1e15 else 0
        kind: tuple[str, str] = ("utc", "Unix time") if name == "unix_s" else ("gps", "GPS time")
        return Clock("utc" if name == "unix_s" else "gps", origin, f"{kind[1]}, the column {name}"), gps - origin
    raise InputError(f"{path}, line 1: no column gives the time: time_s, gps_s or unix_s is needed.")


def _attitude(path: Path, table: _Columns) -> Array | None:
    """Return the attitude quaternions, of four columns or of angles."""
    found = [table.plain(name) for name in _QUATERNION]
    have = [column for column in found if column is not None]
    if len(have) == len(_QUATERNION):
        q = np.column_stack(have)
        norm = np.linalg.norm(q, axis=1)
        if (bad := ~(np.abs(norm - 1.0) < 0.01)).any():
            row = int(np.argmax(bad))
            raise InputError(f"{path}, row {row + 1}: the quaternion has the norm {norm[row]:.4g}, not 1.")
        return np.asarray(q / norm[:, np.newaxis])
    angles = table.vector(_ANGLES)
    if angles is None:
        return None
    check_finite(path, angles, "attitude")
    return rotation.quaternion_from_euler(*angles.T)


def _inertial(time: Array, table: _Columns) -> InertialStream | None:
    """Return the inertial readings, if there are any."""
    for kind, (turn, force) in _INERTIAL.items():
        gyro = table.vector([f"{turn}_{axis}" for axis in "xyz"])
        accel = table.vector([f"{force}_{axis}" for axis in "xyz"])
        if gyro is not None and accel is not None:
            check_finite(table.path, np.hstack((gyro, accel)), "inertial reading")
            return InertialStream(time, gyro, accel, "increments" if kind == "increments" else "rates")
    return None
