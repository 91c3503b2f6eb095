"""Tables with named columns and units: CSV and Parquet, read and written, and MATLAB .mat (version 5), written.

"columns" is CSV as sinssim writes it. The first line has the names, separated by commas, semicolons or tabs. Known
names, each with one of its units:

    time_s (the run's own clock), gps_s (since 1980-01-06), unix_s
    latitude, longitude: _rad, _deg; height_m
    velocity_n_mps, velocity_e_mps, velocity_d_mps
    q_nb_w, q_nb_x, q_nb_y, q_nb_z, or roll, pitch, heading: _rad, _deg
    dtheta_x_rad, …, dvel_x_mps, …: increments; gyro_x: _radps, _degps, …, accel_x_mps2, …: rates
    sigma_n_m, sigma_e_m, sigma_d_m, sigma_vn_mps, sigma_ve_mps, sigma_vd_mps

Others are left out and named. "track-csv" is the table of a track, CSV or Parquet; the streams `truth` and `nav_…` of a
run are such tables. Written are a folder of CSV files (solution or truth, inertial readings, fixes), every stream of a
run as Parquet with the errors, which a run directory does not store, and structures of the truth, every solution, imu
and fixes for MATLAB, SI units in the names.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.column_names import TIME_UNITS, epoch_unit, meaning_of
from sinssim.logs.column_tables import NamedTable, names_of
from sinssim.logs.formats import Format
from sinssim.logs.formats.euroc_tum_kitti import unit
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import gps_from_unix, gps_seconds, week_and_seconds
from sinssim.logs.numeric_columns import check_finite, columns_of, rounded, write_columns
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams
from sinssim.logs.stored_run import StoredStreams
from sinssim.units import DEG

_TIMES = ("time_s", "gps_s", "unix_s")
_INERTIAL = {"increments": ("dtheta", "dvel"), "rates": ("gyro", "accel")}


def recognises_csv(path: Path, head: bytes) -> bool:
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


def read_csv(path: Path) -> Streams:
    """Read the columns whose names are known."""
    table = NamedTable(path, _TIMES)
    clock, time = _csv_clock(table)
    position, inertial = table.vector(("latitude", "longitude", "height")), _csv_inertial(time, table)
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


def _csv_clock(table: NamedTable) -> tuple[Clock, Array]:
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


def _csv_inertial(time: Array, table: NamedTable) -> InertialStream | None:
    """Return the inertial readings, if there are any."""
    for kind, names in _INERTIAL.items():
        gyro, accel = (table.vector([f"{name}_{axis}" for axis in "xyz"]) for name in names)
        if gyro is not None and accel is not None:
            check_finite(table.path, np.hstack((gyro, accel)), "inertial reading")
            return InertialStream(time, gyro, accel, "increments" if kind == "increments" else "rates")
    return None


_PLACE = ("latitude", "longitude", "height")
_ATTITUDE = ("roll", "pitch", "heading")


def recognises_track(path: Path, head: bytes) -> bool:
    """Return whether a file with these first bytes may be a table with the columns of a track."""
    try:
        _, names = names_of(path, head)
    except InputError:
        return False
    if recognises_csv(path, head):
        return False  # which reads inertial readings and σ, too
    return {"time", "latitude"} <= {meaning[0] for name in names if (meaning := meaning_of(name)) is not None}


def read_track(path: Path) -> Streams:
    """Return the track in a CSV or Parquet file with named columns: one solution, named "track".

    The columns are a time (`time_s`, or `time` in seconds or ISO 8601), `latitude_deg`, `longitude_deg`, optionally
    `height_m`, the attitude (`roll_deg`, `pitch_deg`, `heading_deg`, or `qw`, `qx`, `qy`, `qz`), and a velocity
    (`velocity_n_mps`, `velocity_e_mps`, `velocity_d_mps`). Angles may be in radians: `latitude_rad`, heights in feet:
    `altitude_ft`. A note names the columns that are not read.
    """
    table = NamedTable(path)
    notes = [*table.notes]
    time, clock = _track_time(table, notes)
    place = {name: _track_column(table, name, notes) for name in _PLACE}
    latitude, longitude, height = place.values()
    if latitude is None or longitude is None:
        name = "latitude" if latitude is None else "longitude"
        raise InputError(f"{path} has no column {name}_deg; its columns are {table.listed}. Rename one of them.")
    q_nb = table.quaternion()
    if q_nb is None and table.complete(_ATTITUDE):
        angles = [angle for name in _ATTITUDE if (angle := _track_column(table, name, notes)) is not None]
        q_nb = rotation.quaternion_from_euler(*angles) if len(angles) == len(_ATTITUDE) else None
    solution = SolutionStream(
        time,
        latitude,
        longitude,
        np.full(len(time), np.nan) if height is None else height,
        "ellipsoid" if "height_m" in table.names else "unknown",
        velocity_ned=table.vector(("north", "east", "down")),
        q_nb=q_nb,
    )
    if rest := table.unused:
        notes.append(f"Columns that are not read: {shortened(', '.join(rest), 300)}.")
    return Streams(path, "track-csv", clock, solutions={"track": solution}, notes=tuple(notes))


def _track_column(table: NamedTable, quantity: str, notes: list[str]) -> Array | None:
    """Return a column, SI; angles without a unit are degrees if one of them exceeds a turn in radians."""
    given = table.find(quantity)
    if len(given) > 1:
        raise InputError(f"{table.path} has the columns {' and '.join(name for name, _ in given)}: keep one of them.")
    if not given or given[0][1] or quantity == "height":
        return table.column(quantity)
    bare = [table.table.column(name, gaps=True) for of in _ATTITUDE for name, unit in table.find(of) if not unit]
    if quantity in _ATTITUDE and not any(
        float(np.nanmax(np.abs(angles), initial=0.0)) > 2.0 * np.pi for angles in bare
    ):
        name = given[0][0]
        notes.append(
            f"The column {name} has no unit, and its numbers may be degrees or radians: name it {name}_deg or "
            f"{name}_rad."
        )
        return None
    return table.numbers(given[0][0]) * DEG


def _track_time(table: NamedTable, notes: list[str]) -> tuple[Array, Clock]:
    """Return the times of the column time_s, or else of the first one of times, and their clock."""
    given = dict(table.find("time"))
    if not given:
        raise InputError(
            f"{table.path} has no column time_s; its columns are {table.listed}. A path without times is planned with "
            "[[track.waypoints]] and speeds."
        )
    name = "time_s" if "time_s" in given else next(iter(given))
    texts = table.table.texts(name)
    if texts is None or not ("-" in texts[0].strip()[1:] and ":" in texts[0]):
        stamps, unit = table.numbers(name), given[name]
        if not unit and len(stamps) > 1:
            unit = epoch_unit(stamps, float(np.median(np.diff(stamps)))) or "s"
        return stamps * TIME_UNITS[unit or "s"], Clock("machine", None, f"{unit or 's'} of the column {name}")
    table.used.add(name)
    moments, zoned = np.empty(len(texts)), True
    for row, word in enumerate(texts):
        try:
            moments[row], zone = gps_seconds(str(word))
        except InputError as error:
            raise InputError(f"{table.table.place(row)}: {error}") from error
        zoned = zoned and zone
    origin = int(np.floor(moments[0]))
    if not zoned:
        notes.append("Times without a time zone are taken as UTC.")
    return moments - origin, Clock("utc", origin, f"UTC of the column {name}")


_POSITION = ["latitude_deg", "longitude_deg", "height_m"]
_VELOCITY = ["velocity_n_mps", "velocity_e_mps", "velocity_d_mps"]


def write_csv(content: Content, place: Path) -> list[str]:
    """Write one file for each stream."""
    name = f"{content.solution_name}.csv"
    _write_csv_solution(content.solution, place / name)
    sentences = [
        f"{name}: {content.solution_name}; latitude, longitude in degrees, height above the ellipsoid, velocity "
        "north-east-down, quaternion (scalar first) and roll, pitch, heading of forward-right-down axes."
    ]
    if content.imu_name is not None:
        imu = content.imu
        names = [f"dtheta_{axis}_rad" for axis in "xyz"] + [f"dvel_{axis}_mps" for axis in "xyz"]
        columns = columns_of(imu.time, imu.gyro, imu.accel)
        write_columns(place / "imu.csv", columns, header=_csv_header(["time_s", *names]), delimiter=",")
        sentences.append(f"imu.csv: {content.imu_name} data, increments over the interval that ends at the time.")
    for receiver, fixes in content.fixes.items():
        _write_csv_fixes(fixes, place / f"{receiver}.csv")
        arm = ", ".join(f"{value:g}" for value in content.run.lever_arm(receiver))
        sentences.append(
            f"{receiver}.csv: fixes of the antenna, which is at {arm} m (forward, right, down) of the IMU."
        )
    return [*sentences, "time_s is the run's own time."]


def _csv_header(names: list[str]) -> str:
    return ",".join(names) + "\n"


def _write_csv_solution(s: SolutionStream, path: Path) -> None:
    names = ["time_s", *_POSITION]
    parts = [rounded(s.time), s.latitude / DEG, s.longitude / DEG, s.height]
    if s.velocity_ned is not None:
        names += _VELOCITY
        parts.append(s.velocity_ned)
    if s.q_nb is not None:
        names += ["q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z", "roll_deg", "pitch_deg", "heading_deg"]
        parts += [s.q_nb, np.column_stack(rotation.euler_from_quaternion(s.q_nb)) / DEG]
    write_columns(path, columns_of(*parts), header=_csv_header(names), delimiter=",")


def _write_csv_fixes(f: FixStream, path: Path) -> None:
    names = ["time_s", *_POSITION]
    parts = [rounded(f.time), f.latitude / DEG, f.longitude / DEG, f.height]
    if f.position_sigma is not None:
        names += ["sigma_n_m", "sigma_e_m", "sigma_d_m"]
        parts.append(f.position_sigma)
    if f.velocity_ned is not None:
        names += _VELOCITY
        parts.append(f.velocity_ned)
    if f.velocity_sigma is not None:
        names += ["sigma_vn_mps", "sigma_ve_mps", "sigma_vd_mps"]
        parts.append(f.velocity_sigma)
    write_columns(path, columns_of(*parts), header=_csv_header(names), delimiter=",")


def write_parquet(content: Content, place: Path) -> list[str]:
    """Write a folder of Parquet files. `content`: of any run; every stream is written whole."""
    import pyarrow as pa
    from pyarrow import parquet

    streams = StoredStreams(content.run.path / "streams")
    for name in streams.names:
        if streams.is_stored(name):
            shutil.copyfile(streams.path(name), place / f"{name}.parquet")
            continue
        columns = streams.columns(name)
        table = pa.table(dict(zip(columns, map(pa.array, streams.read(name, columns)), strict=True)))
        split = dict.fromkeys(columns, "BYTE_STREAM_SPLIT")
        parquet.write_table(
            table, place / f"{name}.parquet", compression="zstd", use_dictionary=False, column_encoding=split
        )
    return [
        "Every stream of the run at all its samples, doubles bit for bit; times are the run's own, units are in the "
        "names of the columns.",
        "error_<algorithm>.parquet are the errors against the truth: north, east, down.",
    ]


_MAT_LARGEST = 2**31 - 1  # bytes of one variable in version 5


def write_mat(content: Content, place: Path) -> list[str]:
    """Write the file. `content`: what is written; all solutions of the run go in."""
    from scipy.io import savemat

    week, seconds = week_and_seconds(content.start_gps_s)
    variables: dict[str, Any] = {"start": {"gps_week": float(week), "gps_seconds_of_week": float(seconds)}}
    for name in content.run.solutions:
        variables[_mat_name(name)] = _mat_solution(content.run.solution(name))
    if content.imu_name is not None:
        imu = content.imu
        variables["imu"] = {"time_s": imu.time, "dtheta_rad": imu.gyro, "dvel_mps": imu.accel}
    for name, fixes in content.fixes.items():
        variables[_mat_name(name)] = {**_mat_fixes(fixes), "lever_arm_m": np.array(content.run.lever_arm(name))}
    largest = max(
        value.nbytes for part in variables.values() for value in part.values() if isinstance(value, np.ndarray)
    )
    if largest > _MAT_LARGEST:
        raise InputError(f"a column of this run has {largest / 1e9:.1f} GB; a .mat file of version 5 holds 2 GB each.")
    savemat(place, variables, oned_as="column", do_compression=True)
    names = ", ".join(variables)
    return [
        f"Structures: {names}. Angles in rad, heights above the ellipsoid, velocity north-east-down, quaternions "
        "scalar first, body axes forward-right-down.",
        f"imu holds the {content.imu_name} data, increments over the interval that ends at time_s."
        if content.imu_name is not None
        else "The run has no inertial data with three gyros.",
        f"time_s is the run's own time; its 0 is second {seconds} of the GPS week {week}.",
    ]


def _mat_name(name: str) -> str:
    """Return a name that MATLAB accepts."""
    return "".join(c if c.isalnum() else "_" for c in name)


def _mat_solution(s: SolutionStream) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "time_s": s.time, "latitude_rad": s.latitude, "longitude_rad": s.longitude, "height_m": s.height,
    }  # fmt: skip
    if s.velocity_ned is not None:
        fields["velocity_ned_mps"] = s.velocity_ned
    if s.q_nb is not None:
        roll, pitch, heading = rotation.euler_from_quaternion(s.q_nb)
        fields |= {"q_nb": s.q_nb, "roll_rad": roll, "pitch_rad": pitch, "heading_rad": heading}
    return fields


def _mat_fixes(f: FixStream) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "time_s": f.time, "latitude_rad": f.latitude, "longitude_rad": f.longitude, "height_m": f.height,
    }  # fmt: skip
    more = {
        "sigma_ned_m": f.position_sigma,
        "velocity_ned_mps": f.velocity_ned,
        "velocity_sigma_ned_mps": f.velocity_sigma,
    }
    return fields | {name: value for name, value in more.items() if value is not None}


CSV = Format(recognises_csv, read_csv)
TRACK = Format(recognises_track, read_track)
CSV_EXPORT = Export("", "run", write_csv)
PARQUET_EXPORT = Export("", "run", write_parquet)
MATLAB_EXPORT = Export(".mat", "run", write_mat)
