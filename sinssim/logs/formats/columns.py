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

from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats.tum import unit
from sinssim.logs.gps_time import gps_from_unix
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.logs.text.column_tables import NamedTable, names_of
from sinssim.logs.text.numeric_columns import check_finite

_TIMES = ("time_s", "gps_s", "unix_s")
_INERTIAL = {"increments": ("dtheta", "dvel"), "rates": ("gyro", "accel")}


def recognises(path: Path, head: bytes) -> bool:
    """Return whether the first line names a time, and a whole position or inertial readings.

    Looser tables of positions are tracks, which `track_csv` reads.
    """
    if b"\0" in head or not head[:3].strip(b"\xef\xbb\xbf"):
        return False
    _, names = names_of(path, head.split(b"\n", 1)[0])
    stems = {name.rpartition("_")[0] for name in names}
    timed = any(time in names for time in _TIMES)
    placed = {"latitude", "longitude", "height"} <= stems and "qw" not in names
    return timed and (placed or {"dtheta_x", "dvel_x"} <= stems or "gyro_x" in stems)


def read(path: Path) -> Streams:
    """Read the columns whose names are known."""
    table = NamedTable(path, _TIMES)
    clock, time = _clock(table)
    position, inertial = table.vector(("latitude", "longitude", "height")), _inertial(time, table)
    if position is None and inertial is None:
        raise InputError(
            f"{path}, line 1: it names neither a position (latitude_deg, longitude_deg, height_m) nor inertial "
            f"data (gyro_x_radps … accel_z_mps2, or dtheta_x_rad … dvel_z_mps). It has: {table.listed}."
        )
    solutions: dict[str, SolutionStream] = {}
    fixes: dict[str, FixStream] = {}
    if position is not None:
        check_finite(path, position, "position")
        velocity, sigma = table.vector(("north", "east", "down")), table.vector(("sigma_n", "sigma_e", "sigma_d"))
        velocity_sigma = table.vector(("sigma_vn", "sigma_ve", "sigma_vd"))
        place = position[:, 0], position[:, 1], position[:, 2]
        q_nb = table.quaternion()
        if q_nb is not None:
            q_nb = unit(path, q_nb)
        elif (q_nb := table.attitude()) is not None:
            check_finite(path, q_nb, "attitude")
        if sigma is not None and q_nb is None:
            fixes["gnss"] = FixStream(time, *place, "ellipsoid", sigma, velocity, velocity_sigma)
        else:
            solutions["solution"] = SolutionStream(time, *place, "ellipsoid", velocity, q_nb, sigma, velocity_sigma)
    notes = table.notes
    if table.unused:
        notes += (f"Columns left out: {shortened(', '.join(table.unused), 300)}.",)
    imu = {"imu": inertial} if inertial is not None else {}
    return Streams(path, "columns", clock, imu, fixes, solutions, notes=notes)


def _clock(table: NamedTable) -> tuple[Clock, Array]:
    """Return the clock and the times."""
    name = next((name for name in _TIMES if name in table.names), None)
    if name is None:
        raise InputError(f"{table.path}, line 1: no column gives the time: time_s, gps_s or unix_s is needed.")
    time = table.numbers(name)
    check_finite(table.path, time, f"column {name}")
    if name == "time_s":
        return Clock("machine", None, "the column time_s, seconds from an unknown start"), time
    unix = name == "unix_s"
    gps = gps_from_unix(time) if unix else time
    origin = int(gps[0]) if abs(gps[0]) < 1e15 else 0
    words = f"{'Unix' if unix else 'GPS'} time, the column {name}"
    return Clock("utc" if unix else "gps", origin, words), gps - origin


def _inertial(time: Array, table: NamedTable) -> InertialStream | None:
    """Return the inertial readings, if there are any."""
    for kind, names in _INERTIAL.items():
        gyro, accel = (table.vector([f"{name}_{axis}" for axis in "xyz"]) for name in names)
        if gyro is not None and accel is not None:
            check_finite(table.path, np.hstack((gyro, accel)), "inertial reading")
            return InertialStream(time, gyro, accel, "increments" if kind == "increments" else "rates")
    return None
