"""The registries of the formats of recorded files and of exports, and the detection of a file's format.

Libraries that read the formats of vendors are imported here; a missing one is named with the command that installs it.

A format of recorded files takes a line in `FORMATS`, one of exports a line in `WRITERS`; reader and writer of a format
share a file of this folder, and "kf_gins:imu" means the names of kf_gins.py that end in _imu. A reader defines

    def recognises(path: Path, head: bytes) -> bool: whether a file with these first 4096 bytes may be of the format
    def read(path: Path) -> Streams: its streams; InputError with file and row if it cannot be read

A format may be a folder; then the head is empty, and the file also defines

    def files_of(folder: Path) -> list[Path]: the files in a folder that belong to the format

A writer defines

    SUFFIX: suffix of its file, "" if it is a folder
    HOLDS: what goes into it: "solution" for one solution, "run" for the truth or a solution, readings and fixes
    def write(content: Content, place: Path) -> list[str]: writes it, and says in sentences what is where
"""

from __future__ import annotations

import csv
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from sinssim.errors import InputError
from sinssim.system.registries import ensure, module_of, modules
from sinssim.system.user_file import open_file

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.logs.recorded_streams import FixStream, SolutionStream, Streams


FORMATS = modules("formats", "format", {
    "kf-gins-imu": ("kf_gins_imu", "IMU file of KF-GINS: seconds of week, Δθ, Δv, forward-right-down"),
    "kf-gins-gnss": ("kf_gins_gnss", "GNSS file of KF-GINS: seconds of week, position, σ; or with velocity"),
    "kf-gins-solution": ("kf_gins_solution", "solution or truth of KF-GINS: position, velocity, attitude"),
    "psins-imu": ("psins_imu", "PSINS .imu: counts of angle and velocity, scale factors, right-front-up"),
    "psins-avp": ("psins_avp", "PSINS .avp: attitude, velocity, position, time"),
    "sbet": ("sbet", "Applanix SBET: 17 doubles per record"),
    "gnss-ins-sim": ("gnss_ins_sim", "folder of gnss-ins-sim: time.csv, gyro-0.csv, accel-0.csv, gps-0.csv"),
    "inertial-explorer": ("inertial_explorer", "text export of Inertial Explorer or GrafNav"),
    "nmea": ("nmea", "NMEA 0183 (library pynmeagps)"),
    "ubx": ("ubx", "u-blox UBX: NAV-PVT, NAV-HPPOSLLH, NAV-COV, NAV-RELPOSNED (library pyubx2)"),
    "novatel": ("novatel", "NovAtel, Unicore: RAWIMU, BESTPOS, BESTVEL, INSPVA (binary by novatel-edie)"),
    "chc": ("chc", "CHC CGI receivers: GPCHC sentences with IMU data and solution"),
    "vbox": ("vbox", "Racelogic VBOX (.vbo): fixes"),
    "flysight": ("flysight", "FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with gyros and accelerometers"),
    "android-gnss": ("android_gnss", "GnssLogger of Android: gyros, accelerometers, fixes"),
    "ardupilot": ("ardupilot", "ArduPilot: DataFlash .bin and .log, text of mavlogdump: IMU, GPS"),
    "ulog": ("px4_ulog", "PX4 ULog (library pyulog)"),
    "ros": ("ros", "ROS 1 and 2 bags, MCAP: Imu, NavSatFix, TwistStamped, Odometry (library rosbags)"),
    "euroc": ("euroc", "EuRoC: CSV files of IMU and ground truth"),
    "tum": ("tum", "TUM trajectory: time, position, quaternion"),
    "kitti-oxts": ("kitti_oxts", "KITTI OXTS: folder of text files, 30 numbers each"),
    "columns": ("columns", "CSV whose columns are named with their units: time_s, latitude_deg, height_m, …"),
    "gpx": ("gpx", "GPX 1.0 and 1.1: track points with UTC times"),
    "kml": ("kml", "KML: gx:Track with times"),
    "track-csv": ("track_csv", "CSV or Parquet with named columns: time_s, latitude_deg, longitude_deg, height_m, …"),
    "rtklib-pos": ("rtklib_pos", "solution of RTKLIB (.pos): dates or GPS weeks; positions geodetic or x, y, z"),
})  # fmt: skip
"""Module under `sinssim.logs.formats` and a sentence on the format, by its name; then formats outside the package."""


DEFAULT_START = "2026-01-01T00:00:00Z"
"""Date of the time 0 of a run if none is given."""

WRITERS = modules("writers", "format", {
    "csv": ("csv_tables", "folder of CSV files, one for each stream, units in the names of the columns"),
    "parquet": ("parquet", "folder of Parquet files, every stream of the run and the errors of its solutions"),
    "mat": ("matlab", "MATLAB .mat with all streams as structures"),
    "kml": ("kml", "path with heights and time for Google Earth"),
    "gpx": ("gpx", "GPX 1.1 track"),
    "geojson": ("geojson", "GeoJSON line with times"),
    "kf-gins": ("kf_gins", "KF-GINS: folder of IMU, GNSS, truth and configuration"),
    "psins": ("psins", "PSINS: folder of .imu, .avp of the truth and of the fixes"),
    "gnss-ins-sim": ("gnss_ins_sim", "folder of CSV files as gnss-ins-sim saves them"),
    "sbet": ("sbet", "Applanix SBET, 17 doubles per record"),
    "rtklib-pos": ("rtklib_pos", "RTKLIB solution, .pos"),
    "nmea": ("nmea", "NMEA 0183: GGA, RMC, and HDT with an attitude"),
    "mcap": ("mcap", "MCAP with ROS 2 messages: Imu, NavSatFix, TwistStamped, Odometry"),
    "euroc": ("euroc", "EuRoC: folder mav0 with IMU and ground truth"),
    "tum": ("tum", "TUM trajectory: time, position, quaternion"),
})  # fmt: skip
"""Module under `sinssim.logs.writers` and a sentence on the format, by its name; then formats outside the package."""


_HEAD = 4096


class Format(Protocol):
    """What a module of a format defines; `files_of` only if the format is a folder."""

    def recognises(self, path: Path, head: bytes) -> bool: ...
    def read(self, path: Path) -> Streams: ...
    def files_of(self, folder: Path) -> list[Path]: ...


def format_module(name: str) -> Format:
    """Return the module of a format.

    Args:
        name: key of `FORMATS`.

    Raises:
        InputError: the format is unknown.
    """
    return cast(Format, module_of(FORMATS, name, "sinssim.logs.formats", ("recognises", "read")))


def candidates(path: Path) -> list[str]:
    """Return the names of the formats that a file may have.

    Args:
        path: a file, or a folder for the formats that are folders.

    Returns:
        Keys of `FORMATS`, none if no format fits.

    Raises:
        InputError: the file does not exist, is empty or cannot be read.
    """
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
    if found := [name for name in FORMATS if format_module(name).recognises(path, head)]:
        return found
    known = list(FORMATS)
    ensure("formats", "*")  # those of installed packages, whose list takes a while to read
    return [name for name in FORMATS if name not in known and format_module(name).recognises(path, head)]


def folder_of(file: Path) -> Path | None:
    """Return the folder that a file is a part of, in one of the formats that are folders; None if there is none."""
    for folder in (file.parent, file.parent.parent):
        for name in candidates(folder):
            if file in format_module(name).files_of(folder):
                return folder
    return None


def detect(path: Path) -> str:
    """Return the format of a file.

    Args:
        path: a file, or a folder for the formats that are folders.

    Returns:
        Key of `FORMATS`.

    Raises:
        InputError: no format fits, or several do.
    """
    found = candidates(path)
    if len(found) == 1:
        return found[0]
    if not found:
        raise InputError(
            f"{path} has none of the known formats: {', '.join(FORMATS)}. If it has one of them, give its name "
            "(--format NAME)."
        )
    raise InputError(
        f"{path} may be {', '.join(found[:-1])} or {found[-1]}: their numbers look alike. Give the format "
        "(--format NAME)."
    )


def read_file(path: Path | str, format_name: str | None = None) -> Streams:
    """Read a recorded file.

    Args:
        path: the file, or a folder for the formats that are folders.
        format_name: key of `FORMATS`; found from the file if not given.

    Raises:
        InputError: the file cannot be read, is of an unknown format, is damaged, or needs a library that is not
            installed.
    """
    path = Path(path)
    if format_name is not None:
        FORMATS.check(format_name)
        if not path.exists():
            raise InputError(f"{path} does not exist; give a recorded file.")
    name = detect(path) if format_name is None else format_name
    try:
        with np.errstate(all="ignore"):  # damaged numbers overflow; they are judged below
            found = format_module(name).read(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except csv.Error as error:
        raise InputError(f"{path} cannot be read as a table: {error}.") from error
    except MemoryError as error:
        raise InputError(f"{path} does not fit into memory. Split it into parts.") from error
    _check(found)
    return found


def _check(streams: Streams) -> None:
    """Refuse streams without rows, times that are not finite, and places that are not on the Earth."""
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
    if not len(time):
        raise InputError(f"{streams.path}: the stream {name!r} has no rows.")
    _refuse(streams, name, ~np.isfinite(time), "the time is not finite")


def _refuse(streams: Streams, name: str, given: ArrayLike, what: str) -> None:
    bad = np.asarray(given, dtype=np.bool_)
    if bad.any():
        raise InputError(f"{streams.path}, row {int(np.argmax(bad)) + 1} of {name!r}: {what}. The file may be damaged.")


INSTALL = "pip install 'sinssim[logs]'"
"""The command that installs all of them."""


def library(module: str, package: str, purpose: str) -> Any:
    """Import a library of the extra `logs`.

    Args:
        purpose: what needs it, the beginning of the message: a file, or "--to mcap".

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{purpose} needs the library {package}, which is not installed ({error}). Install it with: {INSTALL}"
        ) from error


def refused(path: Path, format_name: str, error: BaseException) -> InputError:
    """Return the error for a file that a vendor's library cannot read.

    Args:
        format_name: what the file should be, for example "a PX4 ULog".
        error: the library's error.
    """
    reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
    return InputError(
        f"{path} cannot be read as {format_name}: {reason[:300] or type(error).__name__}. It may be damaged or "
        "incomplete."
    )
