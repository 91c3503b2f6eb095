"""The registries of the formats of recorded files and of exports, and the detection of a file's format.

A format of recorded files is a `Format`, and one that runs are exported in an `Export` (`export_streams`). Both are
stated at the end of the file of their program or family of devices, and have a line in `FORMATS` or `WRITERS`, which
are lists that can be read without loading these files. Libraries that read the formats of vendors are imported here; a
missing one is named with the command that installs it.
"""

from __future__ import annotations

import csv
import importlib
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.errors import InputError
from sinssim.system.files import open_file
from sinssim.system.registries import ensure, entries, load_entry

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sinssim.data import Array
    from sinssim.logs.recorded_streams import FixStream, SolutionStream, Streams


@dataclass(frozen=True)
class Format:
    """A format of recorded files."""

    # whether a file with these first 4096 bytes may be of the format; of a folder, the bytes are none
    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path], Streams]  # the streams of a file; an InputError with file and row if it cannot be read
    # the files in a folder that belong to the format, if it is a folder
    files_of: Callable[[Path], list[Path]] = lambda folder: []
    # longitude, latitude [°] and height [m] of a path without times, (N, 3), if the format may have one
    read_path: Callable[[Path], Array | None] = lambda path: None


FORMATS = entries("formats", "format", {
    "kf-gins-imu": ("kf_gins:IMU", "IMU file of KF-GINS: seconds of week, Δθ, Δv, forward-right-down"),
    "kf-gins-gnss": ("kf_gins:GNSS", "GNSS file of KF-GINS: seconds of week, position, σ; or with velocity"),
    "kf-gins-solution": ("kf_gins:SOLUTION", "solution or truth of KF-GINS: position, velocity, attitude"),
    "psins-imu": ("psins_gnss_ins_sim:IMU", "PSINS .imu: counts of angle and velocity, scale factors, right-front-up"),
    "psins-avp": ("psins_gnss_ins_sim:AVP", "PSINS .avp: attitude, velocity, position, time"),
    "sbet": ("sbet_inertial_explorer:SBET", "Applanix SBET: 17 doubles per record"),
    "gnss-ins-sim": (
        "psins_gnss_ins_sim:GNSS_INS_SIM",
        "folder of gnss-ins-sim: time.csv, gyro-0.csv, accel-0.csv, gps-0.csv",
    ),
    "inertial-explorer": ("sbet_inertial_explorer:INERTIAL_EXPLORER", "text export of Inertial Explorer or GrafNav"),
    "nmea": ("nmea_ubx:NMEA", "NMEA 0183 (library pynmeagps)"),
    "ubx": ("nmea_ubx:UBX", "u-blox UBX: NAV-PVT, NAV-HPPOSLLH, NAV-COV, NAV-RELPOSNED (library pyubx2)"),
    "novatel": ("novatel:FORMAT", "NovAtel, Unicore: RAWIMU, BESTPOS, BESTVEL, INSPVA (binary by novatel-edie)"),
    "chc": ("nmea_ubx:CHC", "CHC CGI receivers: GPCHC sentences with IMU data and solution"),
    "vbox": ("vbox_flysight_android:VBOX", "Racelogic VBOX (.vbo): fixes"),
    "flysight": (
        "vbox_flysight_android:FLYSIGHT",
        "FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers",
    ),
    "android-gnss": ("vbox_flysight_android:ANDROID", "GnssLogger of Android: gyros, accelerometers, fixes"),
    "ardupilot": ("px4_ardupilot:ARDUPILOT", "ArduPilot: DataFlash .bin and .log, text of mavlogdump: IMU, GPS"),
    "ulog": ("px4_ardupilot:ULOG", "PX4 ULog (library pyulog)"),
    "ros": ("ros_mcap:FORMAT", "ROS 1 and 2 bags, MCAP: Imu, NavSatFix, TwistStamped, Odometry (library rosbags)"),
    "euroc": ("euroc_tum_kitti:EUROC", "EuRoC: CSV files of IMU and ground truth"),
    "tum": ("euroc_tum_kitti:TUM", "TUM trajectory: time, position, quaternion"),
    "kitti-oxts": ("euroc_tum_kitti:KITTI", "KITTI OXTS: folder of text files, 30 numbers each"),
    "columns": (
        "csv_parquet_matlab:CSV",
        "CSV whose columns are named with their units: time_s, latitude_deg, height_m, …",
    ),
    "gpx": ("gpx_kml_geojson:GPX", "GPX 1.0 and 1.1: track points with UTC times"),
    "kml": ("gpx_kml_geojson:KML", "KML: gx:Track with times"),
    "track-csv": (
        "csv_parquet_matlab:TRACK",
        "CSV or Parquet with named columns: time_s, latitude_deg, longitude_deg, height_m, …",
    ),
    "rtklib-pos": (
        "rtklib:RTKLIB",
        "solution of RTKLIB (.pos): dates or GPS weeks; positions geodetic or x, y, z",
    ),
})  # fmt: skip
"""Where each `Format` is stated, and a sentence on it, by its name; then formats outside the package."""


DEFAULT_START = "2026-01-01T00:00:00Z"
"""Date of the time 0 of a run if none is given."""

WRITERS = entries("writers", "format", {
    "csv": (
        "csv_parquet_matlab:CSV_EXPORT",
        "folder of CSV files, one for each stream, units in the names of the columns",
    ),
    "parquet": (
        "csv_parquet_matlab:PARQUET_EXPORT",
        "folder of Parquet files, every stream of the run and the errors of its solutions",
    ),
    "mat": ("csv_parquet_matlab:MATLAB_EXPORT", "MATLAB .mat with all streams as structures"),
    "kml": ("gpx_kml_geojson:KML_EXPORT", "path with heights and time for Google Earth"),
    "gpx": ("gpx_kml_geojson:GPX_EXPORT", "GPX 1.1 track"),
    "geojson": ("gpx_kml_geojson:GEOJSON_EXPORT", "GeoJSON line with times"),
    "kf-gins": ("kf_gins:EXPORT", "KF-GINS: folder of IMU, GNSS, truth and configuration"),
    "psins": ("psins_gnss_ins_sim:PSINS_EXPORT", "PSINS: folder of .imu, .avp of the truth and of the fixes"),
    "gnss-ins-sim": ("psins_gnss_ins_sim:GNSS_INS_SIM_EXPORT", "folder of CSV files as gnss-ins-sim saves them"),
    "sbet": ("sbet_inertial_explorer:SBET_EXPORT", "Applanix SBET, 17 doubles per record"),
    "rtklib-pos": ("rtklib:RTKLIB_POS", "RTKLIB solution, .pos"),
    "nmea": ("nmea_ubx:NMEA_EXPORT", "NMEA 0183: GGA, RMC, and HDT with an attitude"),
    "mcap": ("ros_mcap:EXPORT", "MCAP with ROS 2 messages: Imu, NavSatFix, TwistStamped, Odometry"),
    "euroc": ("euroc_tum_kitti:EUROC_EXPORT", "EuRoC: folder mav0 with IMU and ground truth"),
    "tum": ("euroc_tum_kitti:TUM_EXPORT", "TUM trajectory: time, position, quaternion"),
})  # fmt: skip
"""Where each `Export` is stated, and a sentence on it, by its name; then formats outside the package."""


_HEAD = 4096


def format_of(name: str) -> Format:
    """Return a format by its name."""
    loaded = load_entry(FORMATS, name, "sinssim.logs.formats", ("recognises", "read"))
    if isinstance(loaded, Format):
        return loaded
    return Format(
        **{field.name: getattr(loaded, field.name) for field in fields(Format) if hasattr(loaded, field.name)}
    )


def candidates(path: Path) -> list[str]:
    """Return the names of the formats that a file may have: keys of `FORMATS`, none if no format fits. `path`: a file,
    or a folder for the formats that are folders."""
    if not path.exists():
        raise InputError(f"{path} does not exist; give a recorded file.")
    head = b""
    if not path.is_dir():
        try:
            with open_file(path) as file:
                head = file.read(_HEAD)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
        if not head.strip():
            raise InputError(f"{path} is empty{' but for blanks' if head else ''}; it contains no data.")
    if names := [name for name in FORMATS if format_of(name).recognises(path, head)]:
        return names
    known = list(FORMATS)
    ensure("formats", "*")  # those of installed packages, whose list takes a while to read
    return [name for name in FORMATS if name not in known and format_of(name).recognises(path, head)]


def folder_of(file: Path) -> Path | None:
    """Return the folder that a file is a part of, in one of the formats that are folders; None if there is none."""
    for folder in (file.parent, file.parent.parent):
        for name in candidates(folder):
            if file in format_of(name).files_of(folder):
                return folder
    return None


def detect(path: Path) -> str:
    """Return the format, key of `FORMATS`, of a file, or of a folder for the formats that are folders."""
    names = candidates(path)
    if len(names) == 1:
        return names[0]
    if not names:
        raise InputError(
            f"{path} has none of the known formats: {', '.join(FORMATS)}. If it has one of them, give its name "
            "(--format NAME)."
        )
    raise InputError(
        f"{path} may be {', '.join(names[:-1])} or {names[-1]}: their numbers look alike. Give the format "
        "(--format NAME)."
    )


def read_file(path: Path | str, format_name: str | None = None) -> Streams:
    """Read a recorded file. `path`: the file, or a folder for the formats that are folders; `format_name`: key of
    `FORMATS`; found from the file if not given."""
    path = Path(path)
    if format_name is not None:
        FORMATS.check(format_name)
        if not path.exists():
            raise InputError(f"{path} does not exist; give a recorded file.")
    name = detect(path) if format_name is None else format_name
    import numpy as np  # not at the start, since the command line reads the names of the formats

    try:
        with np.errstate(all="ignore"):  # damaged numbers overflow; they are judged below
            streams = format_of(name).read(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except csv.Error as error:
        raise InputError(f"{path} cannot be read as a table: {error}.") from error
    except MemoryError as error:
        raise InputError(f"{path} does not fit into memory. Split it into parts.") from error
    _check(streams)
    return streams


def _check(streams: Streams) -> None:
    """Refuse streams without rows, times that are not finite, and places that are not on the Earth."""
    import numpy as np

    for name, imu in streams.inertial.items():
        _check_times(streams, name, imu.time)
        finite = np.isfinite(imu.gyro).all(axis=1) & np.isfinite(imu.accel).all(axis=1)
        _refuse(streams, name, ~finite, "a reading is not finite")
    placed: list[tuple[str, FixStream | SolutionStream]] = [*streams.fixes.items(), *streams.solutions.items()]
    for name, stream in placed:
        _check_times(streams, name, stream.time)
        _refuse(streams, name, np.abs(stream.latitude) > 0.5 * np.pi + 1e-9, "the latitude is beyond ±90°")
        _refuse(streams, name, np.abs(stream.longitude) > 2.0 * np.pi + 1e-9, "the longitude is beyond ±360°")


def _check_times(streams: Streams, name: str, time: Array) -> None:
    import numpy as np

    if not len(time):
        raise InputError(f"{streams.path}: the stream {name!r} has no rows.")
    _refuse(streams, name, ~np.isfinite(time), "the time is not finite")


def _refuse(streams: Streams, name: str, given: ArrayLike, what: str) -> None:
    import numpy as np

    bad = np.asarray(given, dtype=np.bool_)
    if bad.any():
        raise InputError(f"{streams.path}, row {int(np.argmax(bad)) + 1} of {name!r}: {what}. The file may be damaged.")


INSTALL = "pip install 'sinssim[logs]'"
"""The command that installs all of them."""


def library(module: str, package: str, purpose: str) -> Any:
    """Import a library of the extra `logs`. `purpose`: what needs it, the beginning of the message: a file, or "--to
    mcap"."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{purpose} needs the library {package}, which is not installed ({error}). Install it with: {INSTALL}"
        ) from error


def refused(path: Path, format_name: str, error: BaseException) -> InputError:
    """Return the error for a file that a vendor's library cannot read as what it should be, for example "a PX4
    ULog"."""
    reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
    return InputError(
        f"{path} cannot be read as {format_name}: {reason[:300] or type(error).__name__}. It may be damaged or "
        "incomplete."
    )
